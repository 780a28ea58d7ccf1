/* chi_square.h - how often chance alone gives a sum of squares as large.
 * [AS] Abramowitz and Stegun 26.4: Q(chi^2|nu) = Gamma(nu/2, chi^2/2)/Gamma(nu/2). */
#ifndef SKINSPEC_MATCH_CHI_SQUARE_H
#define SKINSPEC_MATCH_CHI_SQUARE_H

#include <stddef.h>

/* Probability that chi^2 of so many degrees of freedom exceeds the value; relative error
 * below 1e-12 up to 1000 degrees.  1 for a value at or below 0, 0 for INFINITY, and for 0
 * degrees 0 where the value is above 0. */
double chi_square_above(double value, size_t degrees);

#endif
