/* paper.h - the paper's own computation, step for step: mode `paper`.
 * [paper] Sec. 3.2 and 4.4; 59 of the 60 entries of its Table 2 come out at the
 * four printed decimals (docs/physics.md tells how it was found out).
 *
 * It turns the *coefficients* into a colour - equal-energy CIE 1931 XYZ over
 * 380..740 nm by 10, a white balance, the sRGB matrix and curve - and puts Eq. 9
 * on top of the three coded channels.  Faithful, not physical: a* falls when Ch
 * rises.  There is no spectrum, hence no answer by wavelength, and the thickness
 * of the epidermis does not enter. */
#ifndef SKINSPEC_OPTICS_PAPER_H
#define SKINSPEC_OPTICS_PAPER_H

#include "base/status.h"
#include "optics/tissue.h"

/* Gamma-coded R, G, B "coefficients".  STATUS_RANGE as tissue_check(). */
enum status paper_coefficients(const struct tissue *t, double sigma_a[3], double sigma_s_prime[3]);

/* Eq. 9 per channel: what Table 2 prints.  Not multiplied by 1-Rs, as printed.
 * STATUS_RANGE as above, or where eta is refused by optics/dipole.h. */
enum status paper_rgb(const struct tissue *t, double rgb[3]);

#endif
