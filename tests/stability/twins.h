/* twins.h - equations in wide numbers that more than one study needs. */
#ifndef SKINSPEC_TESTS_STABILITY_TWINS_H
#define SKINSPEC_TESTS_STABILITY_TWINS_H

#include "colour/cie_tables.h"
#include "tests/stability/wide.h"

wide twin_F_dr(wide eta);
wide twin_A(wide eta);
wide twin_Rs(wide eta);
/* sigma_a1, sigma_s1', sigma_a2, sigma_s2', d, eta -> R, 1-Rs in it */
wide twin_two_layer(const wide *x);
wide twin_kubelka_munk(const wide *x);
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

/* Colour.  XYZ, white, Lab, linear: three each; a pair of colours: x[6]. */
void twin_lab(const wide *XYZ, const wide *white, wide *Lab);
void twin_lab_to_xyz(const wide *Lab, const wide *white, wide *XYZ);
wide twin_degrees(wide y, wide x); /* atan2 */
wide twin_radians(wide degrees);
wide twin_hue(wide a, wide b); /* 0 .. 360 degrees, 0 for grey */
wide twin_chroma(wide a, wide b);
void twin_bradford(const wide *XYZ, const wide *from, const wide *to, wide *ret);
void twin_srgb_linear(const wide *XYZ, const wide *white, wide *linear);
void twin_srgb_to_xyz(const wide *linear, wide *XYZ);
wide twin_encode(wide linear);
wide twin_decode(wide coded);
wide twin_delta_e_ab(const wide *x);
wide twin_delta_e_2000(const wide *x);
wide twin_lightness(wide L1, wide L2);

/* XYZ of a spectrum, of white, and the sums of the terms' magnitudes. */
struct twin_xyz {
    wide XYZ[3], white[3], size[3], white_size[3];
};
struct twin_xyz twin_xyz_of(enum illuminant illuminant, enum observer observer, int first_nm,
                            int step_nm, size_t n, const double *value);

/* Gauss and Jordan on a matrix m[n][columns] whose first n columns are symmetric and positive
 * definite: what the others hold becomes the inverse of those times it.  In place; no number may
 * stand at two places. */
void twin_eliminate(wide *m, size_t n, size_t columns);

/* Derivatives of one number by x[i], i < n: where x[i] may move to both sides by next to
 * nothing of scale; where it is 0 and may not fall below; and by the root of x[i] there. */
enum { TWIN_INPUTS = 14 };
typedef wide twin_of_one(const wide *x);
wide twin_slope(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale);
wide twin_slope_from_0(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale);
wide twin_root_slope(twin_of_one *f, const wide *x, size_t n, size_t i, wide scale);

#endif
