/* srgb.h - XYZ <-> sRGB, IEC 61966-2-1, and Bradford adaptation to its white.
 * The matrix is derived from the primaries and white (x, y) = (0.3127, 0.3290)
 * of the standard, not from its four printed decimals, so that it inverts.
 *
 *   linear   R, G, B, 1 for the white; not clipped
 *   coded    the same through the transfer curve; below 0 the curve is mirrored,
 *            so that out-of-gamut values stay ordered
 *   code     0..255 integers, clipped and rounded */
#ifndef SKINSPEC_COLOUR_SRGB_H
#define SKINSPEC_COLOUR_SRGB_H

#include <stdbool.h>

/* XYZ (Y = 100 for white) seen under the given white -> linear sRGB.  Always
 * adapted by Bradford from that white to sRGB's, so that white is (1, 1, 1). */
void srgb_linear_from_xyz(const double XYZ[3], const double white[3], double linear[3]);

/* Linear sRGB -> XYZ (Y = 100) and the white that belongs to it (may be NULL). */
void srgb_linear_to_xyz(const double linear[3], double XYZ[3], double white[3]);

double srgb_encode(double linear);
double srgb_decode(double coded);

/* Integers for a screen; true where a channel had to be clipped, that is where
 * rounding alone would have left 0..255.  NaN becomes 0 and counts as clipped. */
bool srgb_code(const double linear[3], int code[3]);

/* [LAM85] Bradford: XYZ under one white -> corresponding XYZ under another. */
void bradford_adapt(const double XYZ[3], const double from_white[3], const double to_white[3],
                    double ret[3]);

#endif
