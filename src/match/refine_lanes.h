/* refine_lanes.h - the fit of Cm, Bm and Ch to many spectra at once, a spectrum a lane.
 *
 * Every lane goes the same way: a start (match/guess.h), steps in single precision until it is not
 * far, then steps in double precision until the last one promises so little that it is taken
 * unseen, as match/least_squares.h does.  Steps are Gauss's and Newton's, to the quadratic's exact
 * minimum inside the bounds (match/box_lanes.h); from the second in double precision on with what
 * the steps before tell of the residuals' own curvature.  A lane that does not come to rest so, or
 * leaves the range of optics/quick_band.h, is given up, for the caller to fit by match/refine.h; no
 * lane depends on another. Trust: where both come to rest, within 1e-3 standard errors of
 * refiner_run(). */
#ifndef SKINSPEC_MATCH_REFINE_LANES_H
#define SKINSPEC_MATCH_REFINE_LANES_H

#include <stdbool.h>
#include <stddef.h>

#include "match/box_lanes.h"
#include "match/fit.h"
#include "match/guess.h"
#include "match/noise.h"
#include "optics/chromophores.h"
#include "optics/quick.h"

/* Lanes that run side by side; and in one call, at most. */
enum { LANES = BOX_LANES, LANES_MOST = 256, LANES_PARAMETERS = 3 };

/* Per band: absorption of both layers is affine in Cm, Cm Bm and Ch. */
struct lanes_band {
    double without1, by_Cm, by_Cm_Bm, ss1; /* the epidermis, or the half space over sigma_s' */
    double without2, by_Ch, ss2;           /* the dermis */
    double direction[NOISE_RANK];          /* of match/noise.h */
};

/* The same in single precision. */
struct lanes_band_float {
    float without1, by_Cm, by_Cm_Bm, ss1, without2, by_Ch, ss2, direction[NOISE_RANK];
};

struct refine_lanes {
    struct lanes_band_float band_float[SPECTRUM_MAX_BANDS];
    struct lanes_band band[SPECTRUM_MAX_BANDS];
    double directions[WHITENER_SCRATCH(SPECTRUM_MAX_BANDS)];
    size_t bands;
    bool two_layer, placed;   /* placement counts beside white noise */
    double A, entering, d;    /* of the surface, and the thickness */
    double white2;            /* white noise and the model's own error */
    double taken[NOISE_RANK]; /* of what lies along a direction, 1 - keep^2 */
    double value[LANES_PARAMETERS], lo[LANES_PARAMETERS], hi[LANES_PARAMETERS];
    struct guess guess;
    enum quick_vectors vectors;
};

/* STATUS_UNSUPPORTED where this fit, or this noise, is not one for lanes; STATUS_NO_MEMORY. */
enum status refine_lanes_init(const struct fit *fit, const struct noise *noise,
                              const struct chromophores *c, const double *nm,
                              struct refine_lanes *ret);

enum lanes_state { LANES_REFUSED, LANES_GIVEN_UP, LANES_FITTED };

/* value[] by Cm, Bm, Ch. */
struct lanes_answer {
    double value[LANES_PARAMETERS][LANES_MOST], se[LANES_PARAMETERS][LANES_MOST];
    double chi_square[LANES_MOST], rms[LANES_MOST];
    unsigned char state[LANES_MOST]; /* enum lanes_state */
};

/* R[groups of LANES][bands][LANES], n lanes of which are used; what is in the others does not
 * matter. A value that is not a number or beyond +-REFINE_R_MAX refuses its lane, and R of it is
 * overwritten. */
void refine_lanes_run(const struct refine_lanes *fit, double *R, size_t n,
                      struct lanes_answer *ret);

/* By given vectors, for tests. */
void refine_lanes_run_by(enum quick_vectors v, const struct refine_lanes *fit, double *R, size_t n,
                         struct lanes_answer *ret);

#endif
