/* legal_skin.h - two layers by chance, anywhere in what the models accept: for what must hold of
 * every skin. */
#ifndef SKINSPEC_TESTS_SUPPORT_LEGAL_SKIN_H
#define SKINSPEC_TESTS_SUPPORT_LEGAL_SKIN_H

#include <stddef.h>

#include "tests/support/dice.h"

/* Layer 1 over layer 2: mm^-1, mm. */
struct skin {
    double sigma_a1, sigma_s1, sigma_a2, sigma_s2, d_mm, eta;
};

/* Mostly of any decade, now and then a bound or nothing: limits of optics/dipole.h and
 * optics/tissue.h, the smallest denormal too. */
struct skin legal_skin(struct dice *dice);

/* 10^low .. 10^high, evenly by decades. */
double dice_decades(struct dice *dice, double low, double high);

/* As an initializer, so that a case can be written down. */
void skin_describe(char *text, size_t size, struct skin s);

#endif
