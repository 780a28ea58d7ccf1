/* half_space.h - spectral Eq. 9 of the paper: one semi-infinite medium whose
 * absorption is the sum of both layers'.  What the paper does, done spectrally.
 *   R = (1-Rs) Eq. 9 with sigma_a = epidermis + dermis, sigma_s' = Eq. 6 (the
 *   epidermis's), per incident light. */
#ifndef SKINSPEC_OPTICS_HALF_SPACE_H
#define SKINSPEC_OPTICS_HALF_SPACE_H

#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

/* R[m->n], 0 .. 1.  STATUS_RANGE with R untouched where a coefficient or eta is
 * outside the limits of optics/dipole.h. */
enum status half_space_reflectance(const struct medium *m, double *R);

/* The same R, to the last bit, and its derivatives: those by the dermis's sigma_s' and by the
 * thickness are 0, the two by sigma_a are the same, never positive, and -INFINITY where nothing
 * absorbs at all: there R falls as the root of sigma_a.  STATUS_RANGE as above, nothing touched. */
enum status half_space_slopes(const struct medium *m, double *R, const struct slopes *dR);

#endif
