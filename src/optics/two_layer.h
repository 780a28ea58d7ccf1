/* two_layer.h - an epidermis of thickness d over a semi-infinite dermis, by the
 * diffusion equation with an exponential source, in closed form.
 *
 *   -D phi'' + sigma_a phi = sigma_s' e^(-tau(z)),   tau = integral of sigma_t',
 *   D = 1/(3 sigma_t') per layer;  phi(0) = 2 A D phi'(0);  phi and D phi'
 *   continuous at z = d;  phi -> 0 at infinity;  R = (1-Rs) phi(0)/(2A)
 *
 * per incident light, without the mirror reflection.  docs/physics.md derives
 * the form used here, which has no singularity for any accepted medium.
 * Trust, against transport over the paper's ranges (docs/physics.md): rms 0.006;
 * at most 0.02 from 0.06 mm of epidermis up, 0.026 at 0.03 mm, 0.03 at 0.02 mm, where it is too
 * dark above Cm 0.2 in the red. */
#ifndef SKINSPEC_OPTICS_TWO_LAYER_H
#define SKINSPEC_OPTICS_TWO_LAYER_H

#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

/* R[m->n], 0 .. 1.  STATUS_RANGE with R untouched where a coefficient or eta is
 * outside the limits of optics/dipole.h, or the thickness outside tissue.h's. */
enum status two_layer_reflectance(const struct medium *m, double *R);

/* The same R, to the last bit, and its derivatives (docs/physics.md).  By either sigma_a and by
 * the dermis's sigma_s' they have one sign, by the epidermis's sigma_s' and by the thickness
 * either.  By the epidermis's sigma_a it is always finite, also at 0, as its thickness is;
 * by the dermis's it is -INFINITY where the dermis absorbs nothing, whatever the epidermis does,
 * unless that is so thick and dark that nothing comes back from there (then 0).
 * STATUS_RANGE as above, nothing touched. */
enum status two_layer_slopes(const struct medium *m, double *R, const struct slopes *dR);

#endif
