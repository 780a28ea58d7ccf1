/* transport.h - radiative transfer in layers with N streams: the models transport-4, -8, -16 and
 * -32, and stacks of layers between two surfaces.
 *
 * Layers scatter isotropically (the reduced coefficients stand for the anisotropic ones, g = 0)
 * under a smooth surface of relative index eta; light comes in along the normal.  Solved exactly
 * are the equations for N directions of each hemisphere (optics/streams.h), layer by layer through
 * their modes and added up from below (optics/modes.h, optics/layers.h): no doubling, no step.
 *
 * Trust, against 64 streams over 60 random skins (tests/reference/transport_skins.csv), in R:
 *     streams    4        8         16        32
 *     rms        0.0043   0.00093   1.4e-4    1.6e-5
 *     worst      0.0066   0.0015    2.1e-4    2.5e-5
 * The N-stream equations themselves are solved to 1e-12 of R (tests/reference/transport_exact.csv):
 * sigma_a 0 .. 1e12, sigma_s' 1e-6 .. 1e6, d 0 .. 10 mm, eta 0.3 .. 3.8, layers that absorb
 * nothing, everything, or 1e-16.  That scattering is taken as isotropic costs about 0.012 in R.
 *
 * Nothing is allocated; each call takes about 0.7 MB of stack. */
#ifndef SKINSPEC_OPTICS_TRANSPORT_H
#define SKINSPEC_OPTICS_TRANSPORT_H

#include <stddef.h>

#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

enum { TRANSPORT_STREAMS_MAX = 64, TRANSPORT_LAYERS_MAX = 8 };

/* Epidermis over endless dermis: R[m->n], 0 .. 1; streams a multiple of 4, 4 ..
 * TRANSPORT_STREAMS_MAX.  STATUS_RANGE with R untouched where a coefficient or eta is outside the
 * limits of optics/dipole.h, or the thickness outside tissue.h's. */
enum status transport_reflectance(int streams, const struct medium *m, double *R);

/* The same R to the last bit, and its derivatives.
 *   - Where the dermis absorbs nothing (or no double of what it scatters) the one by its sigma_a is
 *     -INFINITY, as R falls as the root of it, and the one by its sigma_s' 0.
 *   - Without an epidermis (d = 0) those by its coefficients are 0; the one by d is what a first
 *     layer of it would do.
 * Good to 1e-11 of themselves; by a coefficient, where two effects balance, to 1e-14 of R per
 * relative change of the layer's coefficients. */
enum status transport_slopes(int streams, const struct medium *m, double *R,
                             const struct slopes *dR);

/* The models of optics/model.h. */
enum status transport_4_reflectance(const struct medium *m, double *R);
enum status transport_8_reflectance(const struct medium *m, double *R);
enum status transport_16_reflectance(const struct medium *m, double *R);
enum status transport_32_reflectance(const struct medium *m, double *R);
enum status transport_4_slopes(const struct medium *m, double *R, const struct slopes *dR);
enum status transport_8_slopes(const struct medium *m, double *R, const struct slopes *dR);
enum status transport_16_slopes(const struct medium *m, double *R, const struct slopes *dR);
enum status transport_32_slopes(const struct medium *m, double *R, const struct slopes *dR);

struct transport_layer {
    double sigma_a, sigma_s_prime; /* mm^-1 */
    double thickness_mm; /* 0 .. TISSUE_EPIDERMIS_MM_MAX; INFINITY for the last: endless */
};

struct transport_flux { /* per incident light */
    double R_total;     /* all that comes back, */
    double R_diffuse;   /* without the mirror reflection of the upper surface */
    double T_total;     /* all that leaves below, scattered or not; 0 under an endless layer */
};

/* count layers (1 .. TRANSPORT_LAYERS_MAX), top first, all of index eta relative to what is above
 * and below.  STATUS_RANGE with *ret untouched as above, or where a layer over another is endless.
 */
enum status transport_stack(int streams, double eta, const struct transport_layer *layers,
                            size_t count, struct transport_flux *ret);

#endif
