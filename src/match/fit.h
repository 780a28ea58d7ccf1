/* fit.h - which fit: the model, what of a skin is free and between which bounds, what is
 * held at which value, and what is known beforehand.
 *
 *   parameter      of struct tissue   unit    bounds at most
 *   Cm             Cm                 -       0 .. 1
 *   Bm             Bm                 -       0 .. 1
 *   Ch             Ch                 -       0 .. 1
 *   SO2            gamma              -       0 .. 1
 *   epidermis_mm   epidermis_mm       mm      0 .. 1000
 *   scattering_a   scattering_a       mm^-1   1e-6 .. 1e6
 *   scattering_b   scattering_b       -       -10 .. 10
 * fit_three() makes the paper's fit, match/skin_fit.h the one for real skin; a caller may
 * alter what they return and fit_check() says whether it still makes sense. */
#ifndef SKINSPEC_MATCH_FIT_H
#define SKINSPEC_MATCH_FIT_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "colour/cie_tables.h"
#include "match/recipe.h"
#include "optics/model.h"
#include "optics/tissue.h"

enum skin_parameter {
    SKIN_CM,
    SKIN_BM,
    SKIN_CH,
    SKIN_SO2,
    SKIN_EPIDERMIS_MM,
    SKIN_SCATTERING_A,
    SKIN_SCATTERING_B,
    SKIN_PARAMETERS
};

/* "Cm" "Bm" "Ch" "SO2" "epidermis_mm" "scattering_a" "scattering_b"; "unknown" past them. */
const char *skin_parameter_name(size_t i);

/* What the fit does with one parameter. */
struct skin_role {
    bool free;
    bool per_replicate; /* free, and each replicate has its own (pressure moves blood); the
                         * answer is their mean, which is also what a prior is about */
    double value;       /* held at; of a free one where the fit starts if no row says better */
    double lo, hi;      /* bounds; a value that is held must lie between them too */
    double prior_mean, prior_sd; /* of a free one; sd INFINITY: no prior */
    double spread; /* standard deviation between placements of the probe on one site, 0: none */
    bool spread_relative; /* it is in parts of the value */
};

struct fit {
    const struct model *model;
    struct skin_role role[SKIN_PARAMETERS];
    bool own_scattering; /* scattering_a and _b are in use; else Eq. 6, and neither is free */
    double eta;
    /* Standard deviation of R, a band, by which the model misses skin at its best; the same at
     * every replicate, so their number does not lower it.  Counts in the weights. */
    double model_error;
    /* Sites differ in how much their placements spread: degrees of freedom, above 2, of what
     * is known of that beforehand (match/spread.h); 0: they do not differ. */
    double spread_degrees;
    /* Light that dE00 is told under. */
    enum illuminant illuminant;
    enum observer observer;
};

/* Cm, Bm, Ch free over the paper's ranges (optics/tissue.h), all else held as the recipe of
 * a table has it, no priors. */
struct fit fit_three(const struct recipe *recipe);

/* Whether a fit can be made.  *why, where not NULL, then says what is wrong and what to do
 * about it, in a constant sentence without full stop.  STATUS_UNSUPPORTED: the model has no
 * derivatives, or noise of its own.  STATUS_RANGE: lo >= hi, a bound or eta beyond what the tissue
 * or the model takes, a value or a prior mean outside the bounds, a prior's sd not above 0, a free
 * parameter that the model does not have, nothing free. */
enum status fit_check(const struct fit *fit, const char **why);

/* Bit 1 << i for each free parameter. */
unsigned fit_free(const struct fit *fit);

/* The skin that holds these values. */
struct tissue fit_tissue(const struct fit *fit, const double value[SKIN_PARAMETERS]);

#endif
