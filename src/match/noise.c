/* noise.c - white noise and the placement of the probe: a covariance of rank two beside a
 * multiple of 1. */
#include "match/noise.h"

#include <math.h>
#include <stdbool.h>

struct noise noise_white(double white)
{
    return (struct noise){ .white = white };
}

struct noise noise_default(void)
{
    return (struct noise){ NOISE_DEFAULT_WHITE, NOISE_DEFAULT_PLACEMENT,
                           NOISE_DEFAULT_SLOPE_RATIO };
}

enum status noise_check(const struct noise *noise, const char **why)
{
    const char *wrong = NULL;
    if (!(noise->white >= NOISE_WHITE_MIN && noise->white <= 1.0))
        wrong = "the white noise must be a standard deviation of reflectance above 0, at most 1; "
                "0.003 is usual";
    else if (!(noise->placement >= 0.0 && noise->placement <= 1.0))
        wrong = "the placement noise must lie between 0 and 1; 0 leaves it out";
    else if (!(noise->slope_ratio >= 0.0 && noise->slope_ratio <= 100.0))
        wrong = "the slope ratio of the placement noise must lie between 0 and 100";
    if (wrong != NULL && why != NULL)
        *why = wrong;
    return wrong == NULL ? STATUS_OK : STATUS_RANGE;
}

/* ---- the shapes -------------------------------------------------------------------- */

static double level_at(double nm)
{
    (void)nm;
    return 1.0;
}

/* (l - 550)/150 has a mean square of 1/3 over 400..700 nm. */
static double slope_at(double nm)
{
    return sqrt(3.0) * (nm - 550.0) / 150.0;
}

/* A slope so much smaller beside what it has in common with the level is rounding. */
#define ROUNDING 1e-14
/* Where less than this is kept along a direction, taking off the rest in one step would leave as
 * much rounding as matters: 1/keep units of the last place. */
#define FAINT (1.0 / 16.0)

/* ---- whitening --------------------------------------------------------------------- */

/* By eight sums side by side: none of them long, and none waits for another. */
enum { SIDE_BY_SIDE = 8 };

static double dot(const double *x, const double *y, size_t n)
{
    double sum[SIDE_BY_SIDE] = { 0 };
    size_t i = 0;
    for (; i + SIDE_BY_SIDE <= n; i += SIDE_BY_SIDE)
        for (size_t k = 0; k < SIDE_BY_SIDE; k++)
            sum[k] += x[i + k] * y[i + k];
    for (size_t k = 0; i + k < n; k++)
        sum[k] += x[i + k] * y[i + k];
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

/* C - white^2 = sum of two p p^T.  In the orthonormal basis of the two p it is a 2x2 matrix
 *     [ xx  xy ]
 *     [ xy  yy ]
 * whose eigenvectors, by one Jacobi rotation, are the directions.  The smaller eigenvalue is the
 * determinant over the larger: as a difference it would cancel. */
struct plane {
    double xx, xy, yy, det;
};

static void rotate_to_axes(const struct plane *m, double *x, double *y, size_t n,
                           double variance[NOISE_RANK])
{
    double angle = 0.5 * atan2(2.0 * m->xy, m->xx - m->yy), c = cos(angle), s = sin(angle);
    variance[0] = c * c * m->xx + 2.0 * c * s * m->xy + s * s * m->yy; /* the larger */
    variance[1] = m->det / variance[0];
    for (size_t i = 0; i < n; i++) {
        double along = c * x[i] + s * y[i];
        y[i] = c * y[i] - s * x[i];
        x[i] = along;
    }
}

void whitener_init(const struct noise *noise, size_t replicates, const double *nm,
                   const double *weight, size_t n, double *scratch, struct whitener *ret)
{
    double *x = scratch, *y = scratch + n, variance[NOISE_RANK];
    double share = 1.0 / (double)replicates, white2 = share * noise->white * noise->white;
    double size2 = share * noise->placement * noise->placement; /* may be 0 of the smallest */
    *ret = (struct whitener){ .n = n, .white2 = white2, .direction = { x, y } };
    if (noise->placement == 0.0 || n == 0)
        return;
    for (size_t i = 0; i < n; i++) {
        x[i] = weight[i] * level_at(nm[i]);
        y[i] = weight[i] * noise->slope_ratio * slope_at(nm[i]);
    }
    double x_size = sqrt(dot(x, x, n)); /* above 0: some band was measured */
    for (size_t i = 0; i < n; i++)
        x[i] /= x_size;
    double along = 0.0;
    for (int turn = 0; turn < 2; turn++) { /* what the first leaves of x in y is rounding */
        double part = dot(x, y, n);
        for (size_t i = 0; i < n; i++)
            y[i] -= part * x[i];
        along += part;
    }
    double y_size = sqrt(dot(y, y, n));
    /* One band, or no slope: what is left of y is rounding. */
    bool plane = y_size > ROUNDING * fabs(along) && y_size > 0.0;
    for (size_t i = 0; i < n; i++)
        y[i] = plane ? y[i] / y_size : 0.0;
    if (!plane)
        y_size = 0.0;
    struct plane m = { x_size * x_size + along * along, along * y_size, y_size * y_size,
                       x_size * x_size * y_size * y_size };
    rotate_to_axes(&m, x, y, n, variance);
    ret->rank = NOISE_RANK;
    for (size_t k = 0; k < NOISE_RANK; k++)
        ret->keep[k] = sqrt(white2 / (white2 + size2 * variance[k]));
    for (size_t k = 0; k < NOISE_RANK; k++)
        ret->shrink[k] = 1.0 - ret->keep[k];
    ret->faint = fmin(ret->keep[0], ret->keep[1]) < FAINT;
}

/* All of v along the directions off, then what is to be kept put back. */
static void apply_faint(const struct whitener *w, double *v)
{
    double part[NOISE_RANK], left[NOISE_RANK];
    for (size_t k = 0; k < NOISE_RANK; k++)
        part[k] = dot(w->direction[k], v, w->n);
    for (size_t k = 0; k < NOISE_RANK; k++)
        for (size_t i = 0; i < w->n; i++)
            v[i] -= part[k] * w->direction[k][i];
    for (size_t k = 0; k < NOISE_RANK; k++)
        left[k] = dot(w->direction[k], v, w->n);
    for (size_t k = 0; k < NOISE_RANK; k++) {
        double back = w->keep[k] * (part[k] + left[k]) - left[k];
        for (size_t i = 0; i < w->n; i++)
            v[i] += back * w->direction[k][i];
    }
}

void whitener_apply(const struct whitener *w, double *v)
{
    double part[NOISE_RANK] = { 0 };
    if (w->faint) {
        apply_faint(w, v);
        return;
    }
    for (size_t k = 0; k < w->rank; k++)
        part[k] = w->shrink[k] * dot(w->direction[k], v, w->n);
    for (size_t k = 0; k < w->rank; k++)
        for (size_t i = 0; i < w->n; i++)
            v[i] -= part[k] * w->direction[k][i];
}

/* The directions are orthonormal: what apply() took off is what is left of it, grown. */
void whitener_undo(const struct whitener *w, double *v)
{
    double part[NOISE_RANK] = { 0 };
    for (size_t k = 0; k < w->rank; k++)
        part[k] = w->shrink[k] / w->keep[k] * dot(w->direction[k], v, w->n);
    for (size_t k = 0; k < w->rank; k++)
        for (size_t i = 0; i < w->n; i++)
            v[i] += part[k] * w->direction[k][i];
}

/* ---- from replicates --------------------------------------------------------------- */

static bool all_have(const struct spectrum *replicate, size_t n, size_t band)
{
    for (size_t k = 0; k < n; k++)
        if (!isfinite(replicate[k].value[band]))
            return false;
    return true;
}

static bool same_grid(const struct spectrum *replicate, size_t n)
{
    for (size_t k = 1; k < n; k++)
        if (replicate[k].n != replicate[0].n || replicate[k].first_nm != replicate[0].first_nm ||
            replicate[k].step_nm != replicate[0].step_nm)
            return false;
    return true;
}

/* The shapes over the bands that all have.  The slope is taken from its own mean: a level and a
 * slope about 550 nm would be nearly one of few bands far from there. */
struct scores {
    size_t bands;
    double mean; /* of the slope */
    double ss;   /* squares of the slope about its mean */
};

static struct scores scores_of(const struct spectrum *replicate, size_t n)
{
    struct scores g = { 0 };
    double sum = 0.0;
    for (size_t i = 0; i < replicate->n; i++)
        if (all_have(replicate, n, i)) {
            g.bands++;
            sum += slope_at(spectrum_nm(replicate, i));
        }
    g.mean = g.bands > 0 ? sum / (double)g.bands : 0.0;
    for (size_t i = 0; i < replicate->n; i++) {
        double off = slope_at(spectrum_nm(replicate, i)) - g.mean;
        if (all_have(replicate, n, i))
            g.ss += off * off;
    }
    return g;
}

/* Level and slope by which replicate k strays from the mean of all. */
static void stray(const struct spectrum *replicate, size_t n, size_t k, const struct scores *g,
                  double *level, double *slope)
{
    double l = 0.0, s = 0.0;
    for (size_t i = 0; i < replicate->n; i++) {
        double mean = 0.0, nm = spectrum_nm(replicate, i);
        if (!all_have(replicate, n, i))
            continue;
        for (size_t j = 0; j < n; j++)
            mean += replicate[j].value[i] / (double)n;
        l += replicate[k].value[i] - mean;
        s += (replicate[k].value[i] - mean) * (slope_at(nm) - g->mean);
    }
    *slope = s / g->ss;
    *level = l / (double)g->bands - g->mean * *slope;
}

enum status noise_from_replicates(const struct noise *population, const struct spectrum *replicate,
                                  size_t n, struct noise *ret)
{
    enum status status = noise_check(population, NULL);
    if (status != STATUS_OK)
        return status;
    if (n == 0 || !same_grid(replicate, n))
        return STATUS_RANGE;
    if (n == 1) {
        *ret = *population;
        return STATUS_OK;
    }
    struct scores g = scores_of(replicate, n);
    /* As above: of bands at one wavelength the slope is rounding. */
    if (g.bands < 2 || !(sqrt(g.ss / (double)g.bands) > ROUNDING * fabs(g.mean)))
        return STATUS_RANGE;
    double ratio = population->slope_ratio, white2 = population->white * population->white;
    double directions = ratio > 0.0 ? 2.0 : 1.0, degrees = directions * (double)(n - 1), sum = 0.0;
    for (size_t k = 0; k < n; k++) {
        double level, slope;
        stray(replicate, n, k, &g, &level, &slope);
        sum += level * level + (ratio > 0.0 ? slope * slope / (ratio * ratio) : 0.0);
    }
    /* White noise gives a level and a slope as well. */
    double level_part = 1.0 / (double)g.bands + g.mean * g.mean / g.ss;
    double white_part = level_part + (ratio > 0.0 ? 1.0 / g.ss / (ratio * ratio) : 0.0);
    double seen = fmax(sum / degrees - white2 * white_part / directions, 0.0);
    double known = population->placement * population->placement;
    *ret = *population;
    ret->placement = fmin(sqrt((degrees * seen + NOISE_POPULATION_DEGREES * known) /
                               (degrees + NOISE_POPULATION_DEGREES)),
                          1.0);
    return STATUS_OK;
}
