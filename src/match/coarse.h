/* coarse.h - the first two steps of a fit of Cm, Bm and Ch to one spectrum by two layers, in
 * single precision.
 *
 * A row of a table is some ten standard errors off.  The way from there to within a few tenths of
 * one needs few digits: in single precision twice as many bands make a vector, and roots and
 * divisions take a quarter of the time.  Steps in double precision (match/least_squares.h) mend
 * what is left.  Nothing is fused, so that all processors begin those at the same bits. */
#ifndef SKINSPEC_MATCH_COARSE_H
#define SKINSPEC_MATCH_COARSE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "match/fit.h"
#include "match/noise.h"
#include "optics/quick.h"

enum { COARSE_PARAMETERS = 3, COARSE_LANES = 16 };

/* A row of n bands takes so many floats: whole vectors. */
#define COARSE_STRIDE(n) (((n) + COARSE_LANES - 1) / COARSE_LANES * COARSE_LANES)

/* Per band: absorption of both layers is affine in Cm, Cm Bm and Ch; sigma_s' of both; 1, and 0
 * past the last band. */
enum coarse_row {
    COARSE_WITHOUT,
    COARSE_BY_CM,
    COARSE_BY_CM_BM,
    COARSE_BY_CH,
    COARSE_SS1,
    COARSE_SS2,
    COARSE_COUNTS,
    COARSE_ROWS
};

struct coarse {
    size_t n, stride;
    float A, entering, d; /* of the surface, and the thickness */
    double lo[COARSE_PARAMETERS], hi[COARSE_PARAMETERS];
    enum quick_vectors vectors;
    float row[COARSE_ROWS * COARSE_STRIDE(SPECTRUM_MAX_BANDS)];
};

/* False where this fit is not one for it: another model, others free than these three, priors. */
bool coarse_init(const struct fit *fit, const struct quick *quick, struct coarse *ret);

/* From x[], by Cm, Bm and Ch, clamped into the bounds, towards the least chi^2 of R[n]; the
 * whitener is one of all n bands.  The first step goes by the logarithm of R against roots of
 * amounts, as misfit_approach() does; the second as it is, unless it is so long that nothing says
 * where it leads.  False where the noise is not white alone: x is then as it was.  *promise: what
 * the second step was to take off chi^2; 0 where there was none.  Trust: where it ends chi^2 was
 * not looked at. */
bool coarse_approach(const struct coarse *coarse, const double *R, const struct whitener *whitener,
                     double x[COARSE_PARAMETERS], double *promise);

/* By given vectors, for tests. */
bool coarse_approach_by(enum quick_vectors v, const struct coarse *coarse, const double *R,
                        const struct whitener *whitener, double x[COARSE_PARAMETERS],
                        double *promise);

#endif
