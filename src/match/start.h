/* start.h - a first guess of Cm, Bm and Ch from a spectrum, in closed form.
 *
 * The half space's reflectance is a function of q = sigma_a/sigma_s' alone, and q is affine in
 * (Cm, Cm Bm, Ch): so R gives q band by band, and three linear equations the rest.  What SO2
 * and scattering are is taken from the fit; of other models it is a rough guess. */
#ifndef SKINSPEC_MATCH_START_H
#define SKINSPEC_MATCH_START_H

#include <stddef.h>

#include "optics/chromophores.h"
#include "optics/tissue.h"

/* s = sqrt(3 sigma_a/sigma_t') at evenly spaced R, for one refractive index. */
enum { START_STEPS = 128 };
struct start_curve {
    double R_most;             /* of a skin that absorbs nothing */
    double s[START_STEPS + 1]; /* [0]: R = 0, where s = sqrt(3); falls to 0 */
};

/* For an eta that dipole_A() takes. */
void start_curve_init(double eta, struct start_curve *ret);

/* t: a skin whose gamma and scattering hold; its Cm, Bm, Ch become the guess, which is
 * finite and where the equations have no answer what t had.  R[c->n]; weight[c->n] 0 leaves a
 * band out. */
void start_guess(const struct start_curve *curve, const struct chromophores *c, const double *R,
                 const double *weight, struct tissue *t);

#endif
