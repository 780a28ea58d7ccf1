/* guess.h - a first guess of Cm, Bm and Ch from a spectrum, by a polynomial: for many spectra.
 *
 * Spectra of skins that differ in these three lie near a bent surface of three dimensions.  f(R) =
 * R - 1.2 R^2 + 0.64 R^3 straightens it somewhat, as a root would; its three largest principal
 * components tell where on the surface a spectrum is, and polynomials of these, fitted to skins all
 * over the bounds of a fit, what the roots of Cm and Ch, and Bm, are there. Trust: on skins as they
 * are, with noise of 0.003, it raises chi^2 by some 5 (median) to 50 (95 %) above what the best
 * skin has.  Spectra that are far from any skin of the fit, as real ones are from those of a simple
 * model, the polynomials tell values far outside of the bounds; there the first terms alone, which
 * run away slowly, are a better guess.  Any spectrum gives some. */
#ifndef SKINSPEC_MATCH_GUESS_H
#define SKINSPEC_MATCH_GUESS_H

#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/fit.h"
#include "optics/quick.h"

enum { GUESS_PARAMETERS = 3, GUESS_DEGREE = 6 };
/* Products of three of a whole degree up to that. */
enum { GUESS_TERMS = (GUESS_DEGREE + 1) * (GUESS_DEGREE + 2) * (GUESS_DEGREE + 3) / 6 };

/* In single precision, as it is used. */
struct guess {
    /* Component k = sum of direction[band][k] f(R) - offset[k]. */
    float direction[SPECTRUM_MAX_BANDS][GUESS_PARAMETERS], offset[GUESS_PARAMETERS];
    /* Term 0 is 1; term i is term before[i] times component by[i]. */
    unsigned char before[GUESS_TERMS], by[GUESS_TERMS];
    float term[GUESS_TERMS][GUESS_PARAMETERS];             /* root of Cm, Bm, root of Ch */
    float linear[1 + GUESS_PARAMETERS][GUESS_PARAMETERS];  /* the same by the first terms alone */
    float least[GUESS_PARAMETERS], most[GUESS_PARAMETERS]; /* beyond them it is no guess */
};

/* f(R) */
static inline float guess_straight(float R)
{
    return R * (1.0f + R * (0.64f * R - 1.2f));
}

/* For a fit in which these three are free.  STATUS_NO_MEMORY; STATUS_RANGE where the model takes
 * none of the skins. */
enum status guess_init(const struct fit *fit, const struct quick *quick, struct guess *ret);

#endif
