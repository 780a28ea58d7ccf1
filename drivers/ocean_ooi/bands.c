/* bands.c - integrals of triangles times hats. */
#include "drivers/ocean_ooi/bands.h"

#include <assert.h>
#include <math.h>

void ooi_wavelengths(const double c[4], size_t first, size_t n, double *nm)
{
    for (size_t i = 0; i < n; i++) {
        double p = (double)(first + i);
        nm[i] = c[0] + p * (c[1] + p * (c[2] + p * c[3]));
    }
}

static double triangle(double centre, double nm)
{
    return fmax(0.0, 1.0 - fabs(nm - centre) / OOI_STEP_NM);
}

/* Add to the weights of the pixels at a and b what the band has between u and v, where
 * a <= u <= v <= b and the triangle has no corner inside.  The product of two straight lines is a
 * parabola, which Simpson's rule integrates exactly. */
static void add_piece(double centre, double a, double b, double u, double v, double *at_a,
                      double *at_b)
{
    double middle = 0.5 * (u + v), sixth = (v - u) / 6.0 / OOI_STEP_NM;
    double t[3] = { triangle(centre, u), 4.0 * triangle(centre, middle), triangle(centre, v) };
    double h[3] = { (u - a) / (b - a), (middle - a) / (b - a), (v - a) / (b - a) };
    for (int i = 0; i < 3; i++) {
        *at_a += sixth * t[i] * (1.0 - h[i]);
        *at_b += sixth * t[i] * h[i];
    }
}

/* Weights of one band; from the last pixel at or below its lower corner to the first at or
 * above its upper one. */
static void weigh(double centre, size_t n, const double *nm, size_t *first_ret, size_t *n_ret,
                  double *weight)
{
    const double low = centre - OOI_STEP_NM, high = centre + OOI_STEP_NM;
    size_t first = 0, last = 0;
    while (first + 1 < n && nm[first + 1] <= low)
        first++;
    for (last = first; last + 1 < n && nm[last] < high; last++)
        weight[last - first] = 0.0;
    weight[last - first] = 0.0;
    for (size_t p = first; p < last; p++) {
        double a = nm[p], b = nm[p + 1];
        double u = fmax(a, low), v = fmin(b, high);
        double *at_a = &weight[p - first], *at_b = at_a + 1;
        if (u < centre && centre < v) {
            add_piece(centre, a, b, u, centre, at_a, at_b);
            add_piece(centre, a, b, centre, v, at_a, at_b);
        } else {
            add_piece(centre, a, b, u, v, at_a, at_b);
        }
    }
    *first_ret = first;
    *n_ret = last - first + 1;
}

enum status ooi_bands_init(size_t n, const double *nm, struct ooi_bands *ret)
{
    const size_t room = sizeof ret->weight / sizeof *ret->weight;
    if (n < 2 || n > OOI_MAX_PIXELS)
        return STATUS_RANGE;
    for (size_t p = 1; p < n; p++)
        if (!(nm[p] > nm[p - 1]))
            return STATUS_RANGE;
    if (!(nm[0] <= OOI_LOWEST_NM && nm[n - 1] >= OOI_HIGHEST_NM))
        return STATUS_RANGE;
    size_t at = 0;
    for (size_t i = 0; i < OOI_BANDS; i++) {
        ret->at[i] = at;
        weigh(OOI_FIRST_NM + (double)i * OOI_STEP_NM, n, nm, &ret->first[i], &ret->n[i],
              ret->weight + at);
        at += ret->n[i];
        assert(at <= room);
    }
    (void)room;
    return STATUS_OK;
}

void ooi_bands_apply(const struct ooi_bands *bands, const double *value, double *band)
{
    for (size_t i = 0; i < OOI_BANDS; i++) {
        const double *weight = bands->weight + bands->at[i], *of = value + bands->first[i];
        double sum = 0.0;
        for (size_t p = 0; p < bands->n[i]; p++)
            sum += weight[p] * of[p];
        band[i] = sum;
    }
}
