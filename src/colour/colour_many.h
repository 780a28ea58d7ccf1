/* colour_many.h - spectra to XYZ, L*a*b* and linear sRGB, many at a time by vectors.
 *
 * The same numbers as colour/xyz.h, lab.h and srgb.h to 1e-13 of the white's: XYZ and sRGB within
 * 1e-15 and some rounding, L*, a*, b* within 1e-12.  The same bits whatever spectra are computed
 * together and with AVX2 and AVX-512, and within 1e-12 of them without (docs/decisions/0012). */
#ifndef SKINSPEC_COLOUR_COLOUR_MANY_H
#define SKINSPEC_COLOUR_COLOUR_MANY_H

#include <stddef.h>

#include "base/vectors.h"
#include "colour/xyz.h"

/* What spectra of one grid share under one light; to be made once. */
struct colour_many {
    size_t stride;     /* of spectra: their bands rounded up to VECTORS_LANES */
    double i_white[3]; /* 1 over the white's XYZ */
    double rgb_of_xyz[3][3];
    enum vectors vectors;                 /* the widest the processor has; a test may take others */
    double weight[3][SPECTRUM_MAX_BANDS]; /* 0 past the bands */
};

void colour_many_init(const struct xyz_weights *weights, struct colour_many *ret);

/* Columns of so many colours. */
struct colour_columns {
    double *L, *a, *b, *red, *green, *blue;
};

/* Of n spectra R[i * stride + band], whose values past the bands are finite, the colours into rows
 * 0 .. n-1 of the columns.  0 <= R <= 1. */
void colour_many(const struct colour_many *m, size_t n, const double *R,
                 const struct colour_columns *ret);

/* The same in two steps.  XYZ[k] has room for n rounded up to VECTORS_LANES, and what is past n is
 * finite. */
void colour_many_xyz(const struct colour_many *m, size_t n, const double *R, double *const XYZ[3]);
void colour_many_of_xyz(const struct colour_many *m, size_t n, const double *const XYZ[3],
                        const struct colour_columns *ret);

#endif
