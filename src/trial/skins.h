/* skins.h - the same skins for every method: who they are, and what an instrument would read.
 *
 * Typical skins: Cm 0.005..0.2 and Ch 0.001..0.1 evenly in the logarithm, Bm 0..1 evenly, the
 * rest as tissue_of() has it.  Spectra are of 31 bands, 400..700 nm, by one of the models, with
 * white noise of TRIAL_NOISE; a skin has the same noise whichever model made its spectrum. */
#ifndef SKINSPEC_TRIAL_SKINS_H
#define SKINSPEC_TRIAL_SKINS_H

#include <stddef.h>
#include <stdint.h>

#include "base/progress.h"
#include "base/spectrum.h"
#include "base/status.h"
#include "optics/model.h"
#include "optics/tissue.h"
#include "plan/costs.h"

enum { TRIAL_BANDS = COSTS_BANDS };
#define TRIAL_FIRST_NM COSTS_FIRST_NM
#define TRIAL_STEP_NM COSTS_STEP_NM
#define TRIAL_NOISE COSTS_NOISE

struct trial_skins {
    size_t n;
    struct tissue *skin;          /* [n] */
    double (*noise)[TRIAL_BANDS]; /* [n] */
};

/* The same for the same seed, and the first of many for more.  STATUS_NO_MEMORY. */
enum status trial_skins_init(size_t n, uint64_t seed, struct trial_skins *ret);
void trial_skins_done(struct trial_skins *skins); /* takes a zeroed one */

/* What one model makes of them. */
struct trial_spectra {
    const struct model *model;
    size_t n;
    double (*clean)[TRIAL_BANDS]; /* [n] without noise */
    double (*Lab)[3];             /* [n] of those, D65, 10 degrees */
};

/* On at most `threads` threads, the same for any number.  STATUS_NO_MEMORY; statuses of
 * model_reflectance(). */
enum status trial_spectra_init(const struct trial_skins *skins, const struct model *model,
                               unsigned threads, struct trial_spectra *ret);
void trial_spectra_done(struct trial_spectra *spectra); /* takes a zeroed one */

/* What is measured of skin i: clean and noise, SCE. */
void trial_measured(const struct trial_skins *skins, const struct trial_spectra *spectra, size_t i,
                    struct spectrum *ret);

/* L*a*b* of such bands, D65, 10 degrees. */
void trial_Lab(const double R[TRIAL_BANDS], double Lab[3]);

#endif
