/* xyz.h - reflectance spectrum x illuminant x observer -> XYZ.
 * [E308] ASTM E308, computing colours by tables of weights; [E2022] how the
 * weights are made; [CIE15] CIE 15:2018.
 *
 *   step     how                                            bands wanted
 *   10 nm    E2022 weights                                  on multiples of 10
 *   5 nm     direct sum with the 5 nm illuminant            on multiples of 5
 *   1 nm     direct sum, illuminant linear between 5 nm     on whole nm
 *            (A: by Planck's law, which defines it)
 * The bands must reach from 400 nm or below to 700 nm or above.  Where they end
 * inside the weights' range, the weights beyond are added to the first and last
 * band, as [E308] has it; bands outside the weights' range get weight 0. */
#ifndef SKINSPEC_COLOUR_XYZ_H
#define SKINSPEC_COLOUR_XYZ_H

#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "colour/cie_tables.h"

/* Weights laid on one band grid; make once, use for many spectra. */
struct xyz_weights {
    size_t n;
    double white[3]; /* XYZ of R = 1 everywhere: the sum of the weights used; Y = 100 */
    double weight[SPECTRUM_MAX_BANDS][3];
};

/* STATUS_UNSUPPORTED for a step that is none of the three or bands off the
 * multiples above; STATUS_RANGE where 400..700 nm is not covered, n is 0 or
 * above SPECTRUM_MAX_BANDS, or an argument is not finite. */
enum status xyz_weights_init(enum illuminant illuminant, enum observer observer, double first_nm,
                             double step_nm, size_t n, struct xyz_weights *ret);

/* XYZ of w->n reflectance values.  Cannot fail; NaN in gives NaN out. */
void xyz_from_reflectance(const struct xyz_weights *w, const double *value, double XYZ[3]);

#endif
