/* start.h - a first guess of Cm, Bm and Ch from a spectrum, in closed form.
 *
 * The half space's reflectance is a function of q = sigma_a/sigma_s' alone, and q is affine in
 * (Cm, Cm Bm, Ch): so R gives q band by band, and three linear equations the rest.  Of other
 * models it is a rough guess. */
#ifndef SKINSPEC_MATCH_START_H
#define SKINSPEC_MATCH_START_H

#include <stdbool.h>
#include <stddef.h>

#include "optics/chromophores.h"
#include "optics/tissue.h"

/* What many guesses share. */
enum { START_STEPS = 128 };
struct start {
    double steps_per_R; /* of the two curves below, evenly spaced from R = 0 */
    double q[START_STEPS + 1], dR_dq[START_STEPS + 1];
    /* Per band: what a unit of Cm, Cm Bm and Ch adds to q, and what is there without. */
    size_t n;
    bool wide; /* by the widest vectors */
    double column[3][SPECTRUM_MAX_BANDS], without[SPECTRUM_MAX_BANDS];
};

/* t: a skin of the refractive index, gamma and scattering that hold; dipole_A() takes its
 * eta. */
void start_init(const struct tissue *t, const struct chromophores *c, struct start *ret);

/* The guess into t; where the equations have no answer t is left as it is.  R[n], of which
 * those of weight[n] 0 are not looked at. */
void start_guess(const struct start *start, const double *R, const double *weight,
                 struct tissue *t);

/* Where a step of an amount's root ends that begins like one of the amount from x > 0 to y. */
double start_by_root(double x, double y);

#endif
