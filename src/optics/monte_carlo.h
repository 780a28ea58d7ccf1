/* monte_carlo.h - light in layers by random walks: no approximation, but noise.
 *
 * Layers of one refractive index, scattering by Henyey and Greenstein (g = 0: evenly), under a
 * smooth surface of relative index eta by Fresnel; where the last layer has an end, over a second
 * such surface.  Light comes in along the normal.  What is counted is R, diffuse reflectance per
 * incident light without the mirror reflection, as in model.h.
 *
 * A walk carries a weight: at each scattering it keeps the albedo of the layer, at the surface the
 * part 1-r leaves and is counted, the part r goes on.  Below 1/10 of what entered it lives on with
 * a chance of 0.3 at 1/0.3 times the weight, which keeps the mean.  After 4096, 16384, 65536 and
 * 262144 scatterings it lives on with a chance of 1/2 at double weight; after 2^20, the most there
 * can be, what it still carries is counted by what diffusion lets out from its depth (`left` says
 * how much that was; over skin it is 0).  So every medium ends: albedo 1 takes 25 times as long as
 * fair skin.
 *
 * Random numbers are a function of (seed, band, photon, how many it has drawn): the same
 * whatever the number of threads, and for neighbouring media the same walks, so that differences
 * are far less noisy than values.  R is then a continuous function of the coefficients but for
 * small jumps: where a scattering changes layers, or a weight passes 1/10.
 *
 * Slopes are expectations over the same walks (likelihood ratios: scatterings and path lengths in
 * each layer), unbiased, and noisy; errors are given beside them.
 * Where no walk came, as under many mean free paths, a mean and its error are 0.
 * Trust: exact within its standard error for what it is given; 1e4 photons give 0.0005 (dark) to
 * 0.0035 (fair) in R, a hundred times as many a tenth of it. */
#ifndef SKINSPEC_OPTICS_MONTE_CARLO_H
#define SKINSPEC_OPTICS_MONTE_CARLO_H

#include <stddef.h>
#include <stdint.h>

#include "base/progress.h"
#include "base/status.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

enum { MONTE_CARLO_MAX_LAYERS = 8 };

/* What the model `monte-carlo` takes, as in tables: photons per band, seed. */
#define MONTE_CARLO_PHOTONS 10000
#define MONTE_CARLO_SEED 1

#define MONTE_CARLO_MIN_PHOTONS 2
#define MONTE_CARLO_MAX_PHOTONS ((uint64_t)1 << 40)
#define MONTE_CARLO_MAX_G 0.99

struct monte_carlo_run {
    uint64_t photons; /* of each band, within the limits above */
    uint64_t seed;
    unsigned threads;                /* as parallel_run() takes them */
    const struct progress *progress; /* in photons of all bands; NULL: none */
};

struct monte_carlo_layer {
    double sigma_a; /* mm^-1, 0 .. 1e100 */
    double sigma_s; /* mm^-1, 1e-100 .. 1e100; of even scattering where g is 0 */
    double g;       /* mean cosine, -0.99 .. 0.99 */
    double mm;      /* above 0, to 1e100; INFINITY for a last layer without an end */
};

/* A mean over photons and its standard error. */
struct monte_carlo_mean {
    double value, error;
};

/* Derivatives of R by one layer, mm, mm and mm^-1; the last is 0 in an endless layer. */
struct monte_carlo_slopes {
    struct monte_carlo_mean by_sigma_a, by_sigma_s, by_mm;
};

struct monte_carlo_answer {
    double specular;              /* mirror reflection at entry, not in R */
    struct monte_carlo_mean R, T; /* per incident light; T through the lower surface */
    double left;                  /* part of R that was counted by diffusion, see above */
    struct monte_carlo_slopes slope[MONTE_CARLO_MAX_LAYERS];
};

/* n layers from the top, 1 .. MONTE_CARLO_MAX_LAYERS.  STATUS_RANGE where anything is outside
 * its range or eta outside that of optics/dipole.h, STATUS_CANCELLED as progress says; *ret is
 * then untouched.  Takes 110 KB of stack. */
enum status monte_carlo_layers(const struct monte_carlo_layer *layer, size_t n, double eta,
                               const struct monte_carlo_run *run, struct monte_carlo_answer *ret);

/* A skin, band by band, each with random numbers of its own: R[m->n] and, where not NULL, the
 * standard error of each, the slopes and their errors.  By sigma_a of the dermis the slope is
 * -INFINITY where that is 0 and a walk has met the dermis.  The slope by the thickness of an
 * epidermis thinner than 0.01 mean free paths, or of none, is that at 0.01, from walks of its
 * own.  A slope's error is not finite where the slope is not.
 * STATUS_RANGE as other models have it; STATUS_CANCELLED; the outputs are then of no meaning. */
enum status monte_carlo_skin(const struct medium *m, const struct monte_carlo_run *run, double *R,
                             double *R_error, const struct slopes *dR,
                             const struct slopes *dR_error);

/* The model: the defaults above, on the calling thread alone.  R[m->n], STATUS_RANGE with R
 * untouched as optics/two_layer.h. */
enum status monte_carlo_reflectance(const struct medium *m, double *R);
enum status monte_carlo_slopes(const struct medium *m, double *R, const struct slopes *dR);

#endif
