/* delta_e_many.h - CIEDE2000 from one colour to many, as fast as the machine's vectors allow.
 *
 * The whole of delta_e_2000() without a trigonometric function or a branch: hues are directions,
 * their mean the bisector, and cos and sin of its multiples products of those.  The decisions at
 * opposite hues, where dE00 jumps, are the same, made by the same products.  Values of all
 * colours, grey ones too, are within
 *
 *     DELTA_E_MANY_RELATIVE dE00 + DELTA_E_MANY_ABSOLUTE     of delta_e_2000(),
 *
 * for |L*|, |a*| and |b*| up to 1 000.  The blue rotation R_T is left out (0 instead of at most
 * 2.1e-10) of a pair whose mean hue is 120 degrees or more from 275, where it changes dE00 by at
 * most 5.2e-11 of itself; hues from 0 to 155 degrees, those of skin, never need it.
 *
 * A row's value depends on nothing but the row and the colour: the same bits wherever it stands
 * and however many there are.  Multiply and add are fused where the processor can (all with
 * AVX2): the same bits by AVX2 and AVX-512, and others, within the same error, without. */
#ifndef SKINSPEC_COLOUR_DELTA_E_MANY_H
#define SKINSPEC_COLOUR_DELTA_E_MANY_H

#include <stdbool.h>
#include <stddef.h>

#define DELTA_E_MANY_RELATIVE 1e-10
#define DELTA_E_MANY_ABSOLUTE 1e-12

/* Squares of dE00 from Lab to rows 0 .. n-1, which L[n], a[n] and b[n] have the coordinates of:
 * square[n], which overlaps none of them.  Cannot fail; NaN where a coordinate is. */
void delta_e_2000_squares(const double Lab[3], size_t n, const double *L, const double *a,
                          const double *b, double *square);

enum delta_e_vectors { DELTA_E_PLAIN, DELTA_E_AVX2, DELTA_E_AVX512, DELTA_E_VECTORS };
bool delta_e_has(enum delta_e_vectors v);
enum delta_e_vectors delta_e_best_vectors(void); /* the last that the processor has */

/* The same by given vectors, for tests and measurements. */
void delta_e_2000_squares_by(enum delta_e_vectors v, const double Lab[3], size_t n, const double *L,
                             const double *a, const double *b, double *square);

#endif
