/* delta_e_box.h - how near CIEDE2000 can come from a colour to a box of colours, at least.
 *
 * For searches: a box whose bound is beyond what is wanted holds nothing that is.  Notation of
 * Sharma, Wu, Dalal, Color Res. Appl. 30:21 (2005); 1 is the colour, 2 any colour of the box,
 * s = 1 + G of the pair, which stretches a*; N = a1' b2 - a2' b1, dot = a1' a2' + b1 b2.
 *
 *  1. |dL'|/S_L grows with |dL'| (delta_e_2000_lightness()): least at the box's nearer end.
 *  2. s falls as C* grows: it lies between s_lo and s_hi, its values at the box's largest and
 *     smallest C*.
 *  3. dC'^2 + dH'^2 = D^2 = s^2 da*^2 + db*^2, at least with s_lo and the box's nearest a*, b*.
 *  4. C2' lies between what the corner nearest to grey has with s_lo and what the farthest has
 *     with s_hi, C1' between its values with these: |dC'| is at least the gap between the two
 *     intervals, and at most the distance of their far ends.
 *  5. dH'^2 = 2 (C1' C2' - dot) >= (C1'^2 C2'^2 - dot^2)/(C1' C2') = N^2/(C1' C2'), with N = s (a1
 * b2 - a2 b1): the parenthesis is least at a corner, or 0, and s^2/(C1' C2') grows with s (its
 *     logarithm's derivative is (2 - cos^2 h1' - cos^2 h2')/s).  Where hues are far apart the D^2
 *     of 3 less the largest dC'^2 of 4 is more.
 *  6. S_C and S_H grow with C' and T, and S_C >= S_H.  What of D^2 is not dH'^2 is dC'^2, so with
 * the least dH'^2 of 5 and the largest S_C and S_H, dC'^2/S_C^2 + dH'^2/S_H^2 is at least max(least
 * dC'^2 of 4, D^2 - dH'^2)/S_C^2 + dH'^2/S_H^2.
 *  7. T is that of the mean hue of 1 and the box's middle, s in the middle, and 2.41 (the sum of
 * its terms' slopes) for each radian that the mean hue of 1 and 2 may be off: half the angle of the
 * box about its middle, at most asin(rho) <= rho + 0.5708 rho^3, and (s_hi - s_lo)/4, as dh'/ds =
 * -sin h' cos h'/s.  Where hues may be opposite, or rho is near 1: 1.5725, T's largest.
 *  8. c^2 + h^2 + R_T c h >= (1 - |R_T|/2)(c^2 + h^2), and |R_T|/2 is at most sin(2 d_theta) min(1,
 *     (C'/25)^3); d_theta by steps of the mean hue's distance from 275 degrees, with 7's error.
 *
 * Of a box that is one colour all of these but 7 and 8 are dE00's own terms: of a colour
 * of skin and others up to 10 away, half of the bounds are within 0.02 % of dE00, all within
 * 13 %.
 *
 * Rounding.  All is done in floats, each operation within u = 2^-24 of itself.  Coordinates of up
 * to `extent` are u extent off, as the box's corners may be, and products with them like these: the
 * box is widened by 8 u extent.  C^7 and its root are within 20 u, so s within 9 u: 16 u are added.
 * C' then are within 4 u of themselves, that is 9 u extent: the gap of 4 is made smaller, the
 * distance larger, by 32 u extent.  The mean hue is within 1e-4 rad: where it is less certain it is
 * not used.  D^2 - dH'^2 errs by what counts as D^2's error, D^2 less dC'^2 is taken with 1e-5 of
 * D^2 less; all else is sums and products: 1e-5 of the whole is taken off. */
#ifndef SKINSPEC_COLOUR_DELTA_E_BOX_H
#define SKINSPEC_COLOUR_DELTA_E_BOX_H

#include <stdbool.h>

#include "colour/delta_e_many.h"

/* Boxes at a time, and the largest |a*| and |b*|; L* is as for delta_e_2000_lightness(). */
enum { DELTA_E_BOXES = 16 };
#define DELTA_E_BOX_MAX 1000.0

/* What the bounds from a colour have in common. */
struct delta_e_box {
    float L, a, b;
    float C;                   /* C* */
    float wider, chroma_slack; /* for rounding */
    enum delta_e_vectors vectors;
};

/* Whether a colour is in the range above. */
bool delta_e_box_takes(const double Lab[3]);

/* For boxes of such colours whose coordinates lie within +-extent.  false where Lab is no such
 * colour. */
bool delta_e_box_init(const double Lab[3], double extent, struct delta_e_box *ret);

/* Squares of bounds, bound[DELTA_E_BOXES], to boxes of corners low and high, [3][DELTA_E_BOXES] L*,
 * a*, b*; a corner may be 2^-24 of its value inside the true one. */
void delta_e_box_bound(const struct delta_e_box *q, const float *low, const float *high,
                       float *bound);

/* The same, and the same bits, by given vectors, for tests and measurements. */
void delta_e_box_bound_by(enum delta_e_vectors v, const struct delta_e_box *q, const float *low,
                          const float *high, float *bound);

#endif
