/* band_grid.c - which grid, and the weights by exact integrals of two straight lines. */
#include "cube/band_grid.h"

#include <math.h>
#include <stdio.h>

/* Wavelengths are printed with two decimals at least. */
#define EVEN_NM 0.011

static double nm(const struct envi_header *h, const struct band_grid *g, size_t i)
{
    return h->nm[g->band[i]];
}

/* ---- which grid --------------------------------------------------------------------- */

static enum status choose_bands(const struct envi_header *h, double lo, double hi,
                                struct band_grid *g, struct envi_fault *fault)
{
    g->used = 0;
    for (size_t i = 0; i < h->bands; i++)
        if (!h->bad[i] && h->nm[i] >= lo - EVEN_NM && h->nm[i] <= hi + EVEN_NM)
            g->band[g->used++] = i;
    fault->line = 0;
    if (g->used < BAND_GRID_LEAST) {
        snprintf(fault->text, sizeof fault->text,
                 "%zu of %zu bands (%g..%g nm) are good and within %g..%g nm; a fit needs %d",
                 g->used, h->bands, h->nm[0], h->nm[h->bands - 1], lo, hi, (int)BAND_GRID_LEAST);
        return STATUS_RANGE;
    }
    for (size_t i = 1; i < g->used; i++) {
        if (nm(h, g, i) - nm(h, g, i - 1) <= BAND_GRID_COARSEST + EVEN_NM)
            continue;
        snprintf(fault->text, sizeof fault->text,
                 "there is no good band between %g and %g nm; neighbours may be %g nm apart, so "
                 "take the part on one side (--nm LO:HI)",
                 nm(h, g, i - 1), nm(h, g, i), BAND_GRID_COARSEST);
        return STATUS_RANGE;
    }
    return STATUS_OK;
}

static bool stands_evenly(const struct envi_header *h, const struct band_grid *g, double spacing)
{
    double first = nm(h, g, 0);
    if (g->used > BAND_GRID_MOST || spacing < BAND_GRID_FINEST - EVEN_NM)
        return false;
    for (size_t i = 0; i < g->used; i++)
        if (fabs(nm(h, g, i) - first - (double)i * spacing) > EVEN_NM)
            return false;
    return true;
}

static double step_for(double spacing)
{
    static const double steps[] = { BAND_GRID_STEP, 15.0, 20.0, BAND_GRID_COARSEST };
    size_t i = 0;
    while (i < 3 && spacing > steps[i] + EVEN_NM)
        i++;
    return steps[i];
}

/* ---- weights ------------------------------------------------------------------------ */

/* Rises from 0 at a to 1 at b, falls to 0 at c; 1 at b where one of the sides has no width. */
static double hat(double x, double a, double b, double c)
{
    if (x < b)
        return x > a ? (x - a) / (b - a) : 0.0;
    if (x > b)
        return x < c ? (c - x) / (c - b) : 0.0;
    return 1.0;
}

/* Of the product of two functions that are straight between lo and hi: Simpson's rule is exact,
 * and looks a little inside, so that corners count to their own side. */
static double overlap(double lo, double hi, const double line[3], const double triangle[3])
{
    double sum = 0.0;
    if (!(hi > lo))
        return 0.0;
    for (int i = 0; i < 3; i++) {
        double x = lo + 0.5 * (double)i * (hi - lo);
        sum += (i == 1 ? 4.0 : 1.0) * hat(x, line[0], line[1], line[2]) *
               hat(x, triangle[0], triangle[1], triangle[2]);
    }
    return sum * (hi - lo) / 6.0;
}

/* Weight of a band, whose line goes up and down between its neighbours, at a grid point. */
static double weight_of(const double line[3], double at, double half)
{
    const double triangle[3] = { at - half, at, at + half };
    double sum = 0.0;
    if (half <= 0.0)
        return hat(at, line[0], line[1], line[2]);
    /* Corners of both, in order; between two of them both are straight. */
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            sum += overlap(fmax(line[i], triangle[j]), fmin(line[i + 1], triangle[j + 1]), line,
                           triangle);
    return sum / half;
}

static void find_weights(const struct envi_header *h, struct band_grid *g, double spacing)
{
    double ends[2] = { nm(h, g, 0), nm(h, g, g->used - 1) };
    double wide = sqrt(fmax(g->step_nm * g->step_nm - spacing * spacing, 0.0));
    size_t weights = 0;
    for (size_t i = 0; i < g->n; i++) {
        double at = g->first_nm + (double)i * g->step_nm;
        double half = fmax(fmin(wide, fmin(at - ends[0], ends[1] - at)), 0.0);
        at = fmin(fmax(at, ends[0]), ends[1]); /* off by a rounding of the header at most */
        g->first[i] = weights;
        g->count[i] = 0;
        for (size_t b = 0; b < g->used; b++) {
            double here = nm(h, g, b);
            const double line[3] = { b > 0 ? nm(h, g, b - 1) : here, here,
                                     b + 1 < g->used ? nm(h, g, b + 1) : here };
            double w = weight_of(line, at, half);
            if (w <= 0.0)
                continue;
            if (g->count[i]++ == 0)
                g->from[i] = b;
            g->weight[weights++] = (float)w;
        }
    }
}

/* Bands beyond the range, as far as a triangle at its end reaches: they tell what is there. */
static void reach_out(const struct envi_header *h, double lo, double hi, struct band_grid *g)
{
    size_t first = g->band[0], last = g->band[g->used - 1], kept = first;
    while (first > 0 && (h->bad[first - 1] || h->nm[first - 1] >= lo - g->step_nm))
        first--;
    while (last + 1 < h->bands && (h->bad[last + 1] || h->nm[last + 1] <= hi + g->step_nm))
        last++;
    /* Over a gap nothing is told. */
    for (size_t i = kept; i-- > first;) {
        if (h->bad[i])
            continue;
        if (h->nm[kept] - h->nm[i] > BAND_GRID_COARSEST)
            break;
        kept = i;
    }
    g->used = 0;
    for (size_t i = kept; i <= last; i++) {
        if (h->bad[i])
            continue;
        if (g->used > 0 && h->nm[i] - nm(h, g, g->used - 1) > BAND_GRID_COARSEST + EVEN_NM)
            break;
        g->band[g->used++] = i;
    }
}

enum status band_grid_init(const struct envi_header *h, double lo_nm, double hi_nm,
                           struct band_grid *ret, struct envi_fault *fault)
{
    enum status s = choose_bands(h, lo_nm, hi_nm, ret, fault);
    if (s != STATUS_OK)
        return s;
    double first = nm(h, ret, 0), last = nm(h, ret, ret->used - 1);
    double spacing = (last - first) / (double)(ret->used - 1);
    ret->as_is = stands_evenly(h, ret, spacing);
    if (ret->as_is) {
        ret->first_nm = first;
        ret->step_nm = spacing;
        ret->n = ret->used;
        return STATUS_OK;
    }
    ret->step_nm = step_for(spacing);
    reach_out(h, lo_nm, hi_nm, ret);
    first = fmax(nm(h, ret, 0), lo_nm);
    last = fmin(nm(h, ret, ret->used - 1), hi_nm);
    ret->first_nm = ceil((first - EVEN_NM) / ret->step_nm) * ret->step_nm;
    double steps = floor((last + EVEN_NM - ret->first_nm) / ret->step_nm);
    if (steps + 1.0 < BAND_GRID_LEAST) {
        snprintf(fault->text, sizeof fault->text,
                 "bands from %g to %g nm give %g values by %g nm; a fit needs %d", first, last,
                 steps + 1.0, ret->step_nm, (int)BAND_GRID_LEAST);
        return STATUS_RANGE;
    }
    ret->n = (size_t)steps + 1;
    find_weights(h, ret, spacing);
    return STATUS_OK;
}

/* ---- values ------------------------------------------------------------------------- */

void band_grid_apply(const struct band_grid *g, const float *in, size_t n, size_t in_row,
                     size_t out_row, float factor, float *out)
{
    for (size_t i = 0; i < g->n; i++) {
        float *restrict to = out + i * out_row;
        const float *from = in + (g->as_is ? i : g->from[i]) * in_row;
        float w = g->as_is ? factor : factor * g->weight[g->first[i]];
        for (size_t x = 0; x < n; x++)
            to[x] = w * from[x];
        for (size_t k = 1; !g->as_is && k < g->count[i]; k++) {
            from += in_row;
            w = factor * g->weight[g->first[i] + k];
            for (size_t x = 0; x < n; x++)
                to[x] += w * from[x];
        }
    }
}
