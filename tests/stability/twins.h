/* twins.h - equations in wide numbers that more than one study needs. */
#ifndef SKINSPEC_TESTS_STABILITY_TWINS_H
#define SKINSPEC_TESTS_STABILITY_TWINS_H

#include "tests/stability/wide.h"

wide twin_F_dr(wide eta);
wide twin_A(wide eta);
wide twin_Rs(wide eta);
/* sigma_a1, sigma_s1', sigma_a2, sigma_s2', d, eta -> R, 1-Rs in it */
wide twin_two_layer(const wide *x);
wide twin_half_space(wide sigma_a, wide sigma_s_prime, wide eta); /* Eq. 9, without 1-Rs */

#endif
