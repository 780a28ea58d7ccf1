/* refine.h - from a table's nearest rows, or from nothing, to the continuous skin, and how
 * sure that is.
 *
 * The replicates of one site are fitted by bounded least squares with the model's own
 * derivatives:
 *     chi^2 = sum over replicates r^T C^-1 r + sum over priors ((x - mean)/sd)^2
 * with r = measured - R(x) over the measured bands, and C of match/noise.h.  Answers lie
 * inside the bounds, are finite, and are the same for the same input.  docs/inversion.md
 * says what the numbers mean. */
#ifndef SKINSPEC_MATCH_REFINE_H
#define SKINSPEC_MATCH_REFINE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "match/fit.h"
#include "match/noise.h"

/* A set of bits.  First one bit per parameter of each of these kinds, then single ones. */
enum refine_flag {
    REFINE_AT_BOUND = 1 << 0,     /* << parameter: it ended on a bound of the fit */
    REFINE_UNDETERMINED = 1 << 7, /* << parameter: the interval spans half of the range and more
                                   * (of Cm and Ch in square roots, which reflectance goes by) */
    REFINE_BY_PRIOR = 1 << 14,    /* << parameter: the prior says more about it than the data do */
    REFINE_RESIDUAL_TOO_LARGE = 1 << 21, /* p < 0.001: model or noise do not explain the data */
    REFINE_RESIDUAL_TOO_SMALL = 1 << 22, /* p > 0.999: the noise stated is too large; not told of
                                          * a fit with a model_error, which is its own */
    REFINE_SECOND_SOLUTION = 1 << 23,    /* another skin fits nearly as well: see second[] */
    REFINE_NOT_CONVERGED = 1 << 24,      /* the step limit was reached; the best point met stands */
};
enum { REFINE_FLAG_COUNT = 25 };

/* Token of bit 1 << i: "Cm_at_bound" ... "scattering_b_by_prior" "residual_too_large"
 * "residual_too_small" "second_solution" "not_converged". */
const char *refine_flag_name(size_t i);

/* What is computed beside the values, chi^2 and se; a set of bits.  Costs: an interval some
 * ten evaluations of the model per parameter, a second solution some thirty. */
enum refine_want {
    REFINE_INTERVALS = 1 << 0, /* else lo and hi are +-1.96 se, cut at the bounds */
    REFINE_SECOND = 1 << 1,    /* else has_second is false */
    REFINE_COLOUR = 1 << 2,    /* else dE00 is NAN */
    REFINE_ALL = 7,
    /* Values and chi^2 alone, without covariance: se, repeat_se, lo and hi are NAN, and flags
     * that go by them are not told.  Not with the two first. */
    REFINE_NO_SE = 1 << 3,
};

struct refined {
    /* Of each parameter: value, standard error, 95 % interval.  se 0 and lo = hi = value
     * where it was held; se is at most hi - lo of the role, which says nothing is known. */
    double value[SKIN_PARAMETERS], se[SKIN_PARAMETERS];
    double lo[SKIN_PARAMETERS], hi[SKIN_PARAMETERS];
    /* The part of se that measuring the site anew, with as many replicates, would show: without
     * what the model's own error does, which comes again. */
    double repeat_se[SKIN_PARAMETERS];
    unsigned free;  /* bit per free parameter */
    unsigned flags; /* enum refine_flag */
    double first_nm, step_nm;
    size_t bands;
    double residual[SPECTRUM_MAX_BANDS]; /* [bands] mean of the measured - mean of the fitted;
                                          * NAN where no replicate has the band */
    double rms;                          /* of residual[] */
    double dE00;         /* mean of the measured - mean of the fitted, under fit's light; NAN where
                          * these bands give no colour or a band is missing */
    double chi_square;   /* of all replicates, priors included */
    size_t degrees;      /* bands measured + priors - free parameters; 0: nothing can be said */
    double chi_square_p; /* probability of a larger one; 1 where degrees is 0 */
    struct noise noise;  /* what was assumed */
    size_t iterations, evaluations; /* of the fit itself */
    /* All that was computed, whatever for: spectra of the model, and derivatives of spectra. */
    size_t model_spectra, model_derivatives;
    bool has_second;
    double second[SKIN_PARAMETERS], second_chi_square;
};

/* What the flags mean here, in sentences for people without full stop: "Bm cannot be told
 * at this melanin", one for each that deserves it; NULL past the last. */
const char *refine_words(const struct refined *r, size_t i);

/* What one fit on one band grid shares, made once; then many threads may use it at a time. */
struct refiner;

/* STATUS_NO_MEMORY; as fit_check(), fewer bands than free parameters, and as
 * chromophores_init() (250..1000 nm).  *why (may be NULL) as in fit_check(). */
enum status refiner_open(const struct fit *fit, double first_nm, double step_nm, size_t bands,
                         struct refiner **ret, const char **why);
void refiner_close(struct refiner *refiner); /* takes NULL */

/* The model that it fits by. */
const struct model *refiner_model(const struct refiner *refiner);

/* spectra[replicates] on the refiner's grid; a band that is NAN counts as not measured.
 * starts[n_starts]: where to begin, best first, as the rows of a table (parameters that are
 * held are taken from the fit); 0 of them: the closed form of the half space, by which a fit of
 * Cm, Bm and Ch by that model begins anyway.
 * STATUS_UNSUPPORTED: a spectrum that is not SCE; more replicates with parameters of their
 * own than LEAST_SQUARES_MAX has room for.  STATUS_RANGE: no replicate, another grid, a value
 * infinite or beyond +-REFINE_R_MAX, fewer measured bands than free parameters (in one
 * replicate: than its own), noise as noise_check(), a start that is not finite.  *why (may be
 * NULL) as in fit_check(). */
#define REFINE_R_MAX 10.0
enum status refiner_run(const struct refiner *refiner, const struct noise *noise,
                        const struct spectrum *spectra, size_t replicates,
                        const double (*starts)[SKIN_PARAMETERS], size_t n_starts, unsigned want,
                        struct refined *ret, const char **why);

/* Open, run with REFINE_ALL, close: for one site. */
enum status refine(const struct fit *fit, const struct noise *noise, const struct spectrum *spectra,
                   size_t replicates, const double (*starts)[SKIN_PARAMETERS], size_t n_starts,
                   struct refined *ret, const char **why);

#endif
