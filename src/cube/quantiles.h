/* quantiles.h - exact quantiles of more floats than memory holds, by passing over them twice.
 *
 * Floats sort as their bits do (those of negative ones turned over).  The first pass counts by the
 * upper half of the bits, the second, within the halves where a quantile lies, by the lower one.
 * NaN is not counted. */
#ifndef SKINSPEC_CUBE_QUANTILES_H
#define SKINSPEC_CUBE_QUANTILES_H

#include <stddef.h>
#include <stdint.h>

enum { QUANTILES_MOST = 4, QUANTILES_HALF = 1 << 16 };

struct quantiles {
    size_t wanted;
    double share[QUANTILES_MOST];
    uint64_t count;                /* of all numbers, after the first pass */
    uint64_t rank[QUANTILES_MOST]; /* of each quantile, within its half */
    uint32_t half[QUANTILES_MOST]; /* where it lies */
    /* By the upper half; the last is of NaN.  Values next to each other are counted apart: they
     * are often alike, and a count that was written just now is not read at once. */
    uint64_t upper[QUANTILES_HALF + 1][2];
    uint64_t lower[QUANTILES_MOST][QUANTILES_HALF];
};

/* For the smallest values that shares (0..1) of the values do not exceed: of the median 0.5.
 * wanted: 1 .. QUANTILES_MOST.  *q may have served for others before. */
void quantiles_begin(struct quantiles *q, const double *share, size_t wanted);
void quantiles_first(struct quantiles *q, const float *value, size_t n);  /* all values, in parts */
void quantiles_between(struct quantiles *q);                              /* then this once */
void quantiles_second(struct quantiles *q, const float *value, size_t n); /* all values again */

/* Quantile i; NAN where there was no number. */
double quantiles_end(const struct quantiles *q, size_t i);

#endif
