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

/* Eqs. 1-3 and 6, and haemoglobin. */
wide twin_pheomelanin(wide nm);
wide twin_eumelanin(wide nm);
wide twin_base(wide nm);
wide twin_scattering(wide nm);
wide twin_epsilon(wide nm, bool oxygenated);
wide twin_blood(wide nm, bool oxygenated);

/* Eqs. 4 and 5.  x: Cm, Bm, Ch, gamma, scattering_a, scattering_b, nm */
struct twin_skin {
    wide sigma_a1, sigma_s1, sigma_a2, sigma_s2;
};
struct twin_skin twin_skin_of(const wide *x);

#endif
