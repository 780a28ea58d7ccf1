/* kubelka_munk.h - an epidermis of thickness d over a semi-infinite dermis, by the two
 * fluxes of Kubelka and Munk, under a surface after Saunderson; in closed form.
 *
 *   dI/dz = -(K+S) I + S J,   -dJ/dz = -(K+S) J + S I     (I down, J up)
 *   continuous at z = d, bounded below;  R_in = J(0)/I(0)
 *   R = (1-Rs) (1-Ri) R_in / (1 - Ri R_in)
 *
 *   K = 2 sigma_a            the mean path of diffuse light through a thin sheet is two thicknesses
 *   S = (3/4) sigma_s_prime  van Gemert and Star, Lasers Life Sci. 1, 287 (1987), without its
 *                            -sigma_a/4: so S is never negative, R smooth, and the worst error less
 *   Rs = ((eta-1)/(eta+1))^2, light along the normal;  Ri = F_dr of optics/dipole.h, diffuse light
 *
 * per incident light, without the mirror reflection.  Kubelka and Munk 1931; Saunderson, J. Opt.
 * Soc. Am. 32, 727 (1942).  docs/physics.md derives the form used here, which has no singularity
 * for any accepted medium.
 * Trust, against transport over the paper's ranges (docs/physics.md): rms 0.027, worst 0.059;
 * mostly too bright.  It knows neither the collimated beam nor how light slants as it goes. */
#ifndef SKINSPEC_OPTICS_KUBELKA_MUNK_H
#define SKINSPEC_OPTICS_KUBELKA_MUNK_H

#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

/* R[m->n], 0 .. 1.  STATUS_RANGE with R untouched where a coefficient or eta is
 * outside the limits of optics/dipole.h, or the thickness outside tissue.h's. */
enum status kubelka_munk_reflectance(const struct medium *m, double *R);

/* The same R, and its derivatives.  By sigma_a of the dermis it is -INFINITY where that is 0
 * and light reaches the dermis; all others are finite but where they leave the range of a
 * double.  STATUS_RANGE as above, with R and dR untouched. */
enum status kubelka_munk_slopes(const struct medium *m, double *R, const struct slopes *dR);

#endif
