/* textbook.h - distances written a second time, straight from their definitions,
 * to judge searches by. */
#ifndef SKINSPEC_TESTS_SUPPORT_TEXTBOOK_H
#define SKINSPEC_TESTS_SUPPORT_TEXTBOOK_H

#include <stddef.h>

#include "base/spectrum.h"

/* CIE 142:2001 in the order of its own formulas, in degrees. */
double textbook_de2000(const double Lab1[3], const double Lab2[3]);

/* IEC 61966-2-1: linear -> 0..255, not rounded; negative values mirrored. */
double textbook_code(double linear);

/* Bands at the same nm within 1e-6, both measured; their number in *bands (may be
 * NULL).  NAN where there are none. */
double textbook_rms(const struct spectrum *s, double first_nm, double step_nm, size_t n,
                    const float *row, size_t *bands);

#endif
