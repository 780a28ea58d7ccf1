/* components.c - subspace iteration over a sample of rows.
 *
 * Any orthonormal directions give a valid bound; good ones a tight one.  So neither
 * the sample nor the iteration has to be large: only orthonormality counts. */
#include "match/components.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/vectors.h"

enum { SAMPLE_ROWS = 1024, ITERATIONS = 6 };

/* Bands are padded with zeros to whole blocks, which loops over them then are made of. */
enum { BLOCK = 8, MAX_PADDED = (SPECTRUM_MAX_BANDS + BLOCK - 1) / BLOCK * BLOCK };

/* Sums side by side, in whole blocks as well. */
enum { ACROSS = (COMPONENTS_DIMS + BLOCK - 1) / BLOCK * BLOCK };

struct components {
    size_t bands, padded;
    enum vectors vectors;
    double *direction[COMPONENTS]; /* [padded] each, orthonormal or all 0 */
    double (*across)[ACROSS];      /* [padded]: the same by bands, and zeros */
    double mean[];                 /* [padded], then the directions, then across */
};

static double dot(size_t n, const double *x, const double *y)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static void add_scaled(size_t n, double factor, const double *x, double *y)
{
    for (size_t i = 0; i < n; i++)
        y[i] += factor * x[i];
}

/* Take what lies in the earlier directions out of this one; returns the norm left. */
static double take_out_earlier(const struct components *c, size_t which)
{
    double *v = c->direction[which];
    for (size_t i = 0; i < which; i++)
        add_scaled(c->bands, -dot(c->bands, c->direction[i], v), c->direction[i], v);
    return sqrt(dot(c->bands, v, v));
}

/* Gram-Schmidt, each direction twice: the second time takes out what rounding left of the
 * first.  A direction that is nearly all in the earlier ones would be made of
 * rounding, so it becomes 0. */
static void make_orthonormal(struct components *c)
{
    for (size_t which = 0; which < COMPONENTS; which++) {
        double *v = c->direction[which];
        double before = sqrt(dot(c->bands, v, v)), after = take_out_earlier(c, which);
        if (after > 1e-8 * before)
            after = take_out_earlier(c, which);
        else
            after = 0.0;
        for (size_t i = 0; i < c->bands; i++)
            v[i] = after > 0.0 ? v[i] / after : 0.0;
    }
}

/* Smooth waves: spectra of skin are smooth, so these are not far off. */
static void begin_with_waves(struct components *c)
{
    const double pi = 3.14159265358979323846;
    for (size_t which = 0; which < COMPONENTS; which++)
        for (size_t i = 0; i < c->bands; i++)
            c->direction[which][i] = cos(pi * ((double)i + 0.5) * (double)which / (double)c->bands);
    make_orthonormal(c);
}

/* The sample: spectra less their mean, which is kept. */
static void take_sample(struct components *c, const struct table *table, size_t rows,
                        double *sample)
{
    for (size_t i = 0; i < rows; i++) {
        const float *spectrum = table_spectrum(table, i * table->n / rows);
        for (size_t j = 0; j < c->bands; j++)
            sample[i * c->bands + j] = (double)spectrum[j];
        add_scaled(c->bands, 1.0 / (double)rows, sample + i * c->bands, c->mean);
    }
    for (size_t i = 0; i < rows; i++)
        add_scaled(c->bands, -1.0, c->mean, sample + i * c->bands);
}

/* Directions times the sample's covariance: what varies most grows most. */
static void iterate(struct components *c, size_t rows, const double *sample, double *product)
{
    memset(product, 0, COMPONENTS * c->bands * sizeof *product);
    for (size_t i = 0; i < rows; i++) {
        const double *x = sample + i * c->bands;
        for (size_t which = 0; which < COMPONENTS; which++)
            add_scaled(c->bands, dot(c->bands, x, c->direction[which]), x,
                       product + which * c->bands);
    }
    for (size_t which = 0; which < COMPONENTS; which++)
        memcpy(c->direction[which], product + which * c->bands, c->bands * sizeof *product);
    make_orthonormal(c);
}

enum status components_open(const struct table *table, struct components **ret)
{
    size_t bands = table->recipe.bands, rows = table->n < SAMPLE_ROWS ? table->n : SAMPLE_ROWS;
    size_t padded = (bands + BLOCK - 1) / BLOCK * BLOCK, across = (1 + COMPONENTS) * padded;
    struct components *c = calloc(1, sizeof *c + (across + ACROSS * padded) * sizeof *c->mean);
    double *scratch = calloc((rows + COMPONENTS) * bands, sizeof *scratch);
    if (c == NULL || scratch == NULL) {
        free(scratch);
        free(c);
        return STATUS_NO_MEMORY;
    }
    c->bands = bands;
    c->padded = padded;
    c->vectors = vectors_best();
    for (size_t which = 0; which < COMPONENTS; which++)
        c->direction[which] = c->mean + (1 + which) * padded;
    c->across = (double(*)[ACROSS])(c->mean + across);
    take_sample(c, table, rows, scratch);
    begin_with_waves(c);
    for (int i = 0; i < ITERATIONS; i++)
        iterate(c, rows, scratch, scratch + rows * bands);
    free(scratch);
    for (size_t i = 0; i < bands; i++)
        for (size_t which = 0; which < COMPONENTS; which++)
            c->across[i][which] = c->direction[which][i];
    *ret = c;
    return STATUS_OK;
}

void components_close(struct components *components)
{
    free(components);
}

VECTORS_INLINE double sum_of_block(const double x[BLOCK])
{
    return ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
}

/* Eight sums side by side; n whole blocks. */
VECTORS_INLINE double square_of(size_t n, const double *x)
{
    double part[BLOCK] = { 0.0 };
    for (size_t at = 0; at < n; at += BLOCK)
        for (size_t i = 0; i < BLOCK; i++)
            part[i] += x[at + i] * x[at + i];
    return sum_of_block(part);
}

VECTORS_INLINE double sum_of(const double x[ACROSS])
{
    double part[BLOCK] = { 0.0 };
    for (size_t at = 0; at < ACROSS; at += BLOCK)
        for (size_t i = 0; i < BLOCK; i++)
            part[i] += x[at + i];
    return sum_of_block(part);
}

/* rest: [padded], the spectrum less the mean.  What the directions leave over is not computed: its
 * square is what theirs lack of the whole.  Sums of 32 and directions not quite orthonormal err by
 * less than 9e-14 of the whole's, so the norm by less than 3e-7 of the whole. */
VECTORS_INLINE void take_point_any(const struct components *c, const double *restrict rest,
                                   double point[COMPONENTS_DIMS])
{
    double even[ACROSS] = { 0.0 }, odd[ACROSS] = { 0.0 }, square[ACROSS];
    for (size_t i = 0; i < c->padded; i += 2) {
        for (size_t which = 0; which < ACROSS; which++)
            even[which] += rest[i] * c->across[i][which];
        for (size_t which = 0; which < ACROSS; which++)
            odd[which] += rest[i + 1] * c->across[i + 1][which];
    }
    for (size_t which = 0; which < ACROSS; which++)
        even[which] += odd[which];
    for (size_t which = 0; which < ACROSS; which++)
        square[which] = even[which] * even[which];
    double left = square_of(c->padded, rest) - sum_of(square);
    memcpy(point, even, COMPONENTS_DIMS * sizeof *point);
    point[COMPONENTS] = sqrt(left < 0.0 ? 0.0 : left); /* NaN stays */
}

static void take_point_plain(const struct components *c, const double *rest, double *point)
{
    take_point_any(c, rest, point);
}

VECTORS_AVX2 static void take_point_avx2(const struct components *c, const double *rest,
                                         double *point)
{
    take_point_any(c, rest, point);
}

VECTORS_AVX512 static void take_point_avx512(const struct components *c, const double *rest,
                                             double *point)
{
    take_point_any(c, rest, point);
}

/* The same operations in the same order: the same bits. */
static void take_point(const struct components *c, const double *rest, double *point)
{
    static void (*const kind[VECTORS_KINDS])(const struct components *, const double *,
                                             double *) = { take_point_plain, take_point_avx2,
                                                           take_point_avx512 };
    kind[c->vectors](c, rest, point);
}

void components_point(const struct components *c, const double *value,
                      double point[COMPONENTS_DIMS])
{
    double rest[MAX_PADDED];
    memset(rest + c->bands, 0, (c->padded - c->bands) * sizeof *rest);
    for (size_t i = 0; i < c->bands; i++)
        rest[i] = value[i] - c->mean[i];
    take_point(c, rest, point);
}

void components_row_point(const struct components *c, const float *value,
                          double point[COMPONENTS_DIMS])
{
    double rest[MAX_PADDED];
    memset(rest + c->bands, 0, (c->padded - c->bands) * sizeof *rest);
    for (size_t i = 0; i < c->bands; i++)
        rest[i] = (double)value[i] - c->mean[i];
    take_point(c, rest, point);
}
