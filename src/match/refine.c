/* refine.c - one site: data checked, started, fitted, and what is to be said about it. */
#include "match/refine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "colour/delta_e.h"
#include "colour/lab.h"
#include "colour/xyz.h"
#include "match/chi_square.h"
#include "match/coarse.h"
#include "match/intervals.h"
#include "match/misfit.h"
#include "match/spread.h"
#include "match/start.h"

/* The fit ends where a step would lower chi^2 by less: 3e-5 standard errors. */
#define TOLERANCE 1e-9
/* A step that promises less, after one that kept its promise, is the last: what it leaves is
 * smaller by the square of how much curvature changes on the way. */
#define UNSEEN 1e-3
/* Where no more than this can be left of chi^2 after it, 3e-4 standard errors, what it leads to is
 * taken from the derivatives before it. */
#define LEFT 1e-7
enum { STEPS = 60 };
/* Another minimum is told where its chi^2 is above the best by less than this (the 99.9 %
 * point for one degree of freedom) and some parameter is off by more than so many standard
 * errors. */
#define SECOND_RISE 10.83
#define SECOND_DISTANCE 3.0
/* Chance is blamed for a chi^2 between these. */
#define P_TOO_LARGE 0.001
#define P_TOO_SMALL 0.999
/* Half of a 95 % interval, in standard errors. */
#define Z_95 1.959963984540054
/* A better minimum met on the way makes all begin again, so often. */
enum { AGAIN = 4 };

struct refiner {
    _Alignas(MISFIT_ALIGNED) struct chromophores chromophores;
    struct fit fit;
    double first_nm, step_nm;
    size_t bands;
    double nm[SPECTRUM_MAX_BANDS];
    struct quick quick;
    struct start start;
    bool has_coarse;
    struct coarse coarse;
    bool has_weights;
    struct xyz_weights weights;
};

static enum status refuse(enum status s, const char *sentence, const char **why)
{
    if (why != NULL)
        *why = sentence;
    return s;
}

/* ---- a refiner --------------------------------------------------------------------- */

static size_t free_parameters(const struct fit *fit, bool own)
{
    size_t n = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        n += fit->role[i].free && fit->role[i].per_replicate == own ? 1u : 0u;
    return n;
}

/* What the parameters are where nothing better is known. */
static const double *values_at_start(const struct fit *fit, double value[SKIN_PARAMETERS])
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit->role[i].value;
    return value;
}

static const char few_bands[] = "fewer bands were measured than the fit has free parameters; hold "
                                "some of them, or measure more bands";

enum status refiner_open(const struct fit *fit, double first_nm, double step_nm, size_t bands,
                         struct refiner **ret, const char **why)
{
    enum status s = fit_check(fit, why);
    if (s != STATUS_OK)
        return s;
    if (bands < free_parameters(fit, false) + free_parameters(fit, true))
        return refuse(STATUS_RANGE, few_bands, why);
    struct refiner *r = aligned_alloc(MISFIT_ALIGNED, sizeof *r);
    if (r == NULL)
        return refuse(STATUS_NO_MEMORY, "there is no memory left", why);
    double value[SKIN_PARAMETERS];
    r->fit = *fit;
    r->first_nm = first_nm;
    r->step_nm = step_nm;
    r->bands = bands;
    s = chromophores_init(first_nm, step_nm, bands, &r->chromophores);
    if (s != STATUS_OK) {
        refiner_close(r);
        return refuse(s, "the bands must lie between 250 and 1000 nm, at most 1024 of them", why);
    }
    for (size_t i = 0; i < bands; i++)
        r->nm[i] = first_nm + (double)i * step_nm;
    struct tissue t = fit_tissue(fit, values_at_start(fit, value));
    quick_init(fit->model, &r->chromophores, fit->eta, &r->quick);
    start_init(&t, &r->chromophores, &r->start);
    r->has_coarse = coarse_init(fit, &r->quick, &r->coarse);
    r->has_weights = xyz_weights_init(fit->illuminant, fit->observer, first_nm, step_nm, bands,
                                      &r->weights) == STATUS_OK;
    *ret = r;
    return STATUS_OK;
}

void refiner_close(struct refiner *refiner)
{
    free(refiner);
}

const struct model *refiner_model(const struct refiner *refiner)
{
    return refiner->fit.model;
}

/* ---- the data -------------------------------------------------------------------------- */

/* One site laid out for the fit. */
struct site {
    const struct noise *noise;
    const struct spectrum *spectra;
    struct misfit misfit;
    size_t replicates, measured; /* bands that all replicates have */
    bool scattered;              /* chi^2 has the replicates about their mean in it */
    double repeated;             /* share of the variance that a new measurement draws anew */
    double weight[SPECTRUM_MAX_BANDS], mean[SPECTRUM_MAX_BANDS];
    double directions[WHITENER_SCRATCH(SPECTRUM_MAX_BANDS)];
    struct misfit_scratch scratch;
};

static const char *spectrum_fault(const struct refiner *r, const struct spectrum *s)
{
    if (s->n != r->bands || s->first_nm != r->first_nm || s->step_nm != r->step_nm)
        return "the spectra must have the bands that the fit was made for";
    size_t wrong = 0; /* of all bands together, by vectors */
    for (size_t i = 0; i < s->n; i++)
        wrong += fabs(s->value[i]) > REFINE_R_MAX ? 1u : 0u; /* NaN is not */
    if (wrong > 0)
        return "a reflectance is far outside 0..1; give fractions, not percent";
    return NULL;
}

static enum status check_spectra(const struct refiner *r, const struct spectrum *spectra,
                                 size_t replicates, const char **why)
{
    if (replicates == 0)
        return refuse(STATUS_RANGE, "there is no spectrum to fit", why);
    for (size_t k = 0; k < replicates; k++) {
        const char *wrong = spectrum_fault(r, &spectra[k]);
        if (spectra[k].specular != SPECULAR_SCE)
            return refuse(STATUS_UNSUPPORTED,
                          "the fit needs spectra without the mirror reflection (SCE); take a "
                          "stated surface off SCI ones",
                          why);
        if (wrong != NULL)
            return refuse(STATUS_RANGE, wrong, why);
    }
    return STATUS_OK;
}

static enum status check_starts(const double (*starts)[SKIN_PARAMETERS], size_t n, const char **why)
{
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < SKIN_PARAMETERS; i++)
            if (!isfinite(starts[k][i]))
                return refuse(STATUS_RANGE, "a start holds a value that is not a number", why);
    return STATUS_OK;
}

static void take_mean(const struct spectrum *spectra, size_t replicates, struct site *site)
{
    size_t n = spectra[0].n, missing = 0;
    double *restrict mean = site->mean, *restrict weight = site->weight;
    memcpy(mean, spectra[0].value, n * sizeof *mean);
    for (size_t k = 1; k < replicates; k++)
        for (size_t i = 0; i < n; i++)
            mean[i] += spectra[k].value[i];
    for (size_t i = 0; i < n && replicates > 1; i++)
        mean[i] /= (double)replicates; /* NaN where one of them is */
    for (size_t i = 0; i < n; i++)
        weight[i] = isnan(mean[i]) ? 0.0 : 1.0;
    for (size_t i = 0; i < n; i++)
        missing += isnan(mean[i]) ? 1u : 0u;
    site->measured = n - missing;
}

/* Chi^2 of the replicates about their mean. */
static double scatter(const struct refiner *r, const struct noise *noise,
                      const struct spectrum *spectra, struct site *site)
{
    double sum = 0.0, *off = site->scratch.R;
    struct whitener one;
    whitener_init(noise, 1, r->nm, site->weight, r->bands, site->directions, &one);
    for (size_t k = 0; k < site->replicates; k++) {
        for (size_t i = 0; i < r->bands; i++)
            off[i] = site->weight[i] == 0.0 ? 0.0 : spectra[k].value[i] - site->mean[i];
        whitener_apply(&one, off);
        for (size_t i = 0; i < r->bands; i++)
            sum += off[i] * off[i] / one.white2;
    }
    return sum;
}

static enum status site_init(const struct refiner *r, const struct noise *noise,
                             const struct spectrum *spectra, size_t replicates, struct site *site,
                             const char **why)
{
    struct misfit *m = &site->misfit;
    size_t own = free_parameters(&r->fit, true);
    bool grouped = own > 0 && replicates > 1;
    take_mean(spectra, replicates, site);
    site->noise = noise;
    site->spectra = spectra;
    site->replicates = replicates;
    if (site->measured < own + free_parameters(&r->fit, false))
        return refuse(STATUS_RANGE, few_bands, why);
    m->fit = &r->fit;
    m->quick = &r->quick;
    m->chromophores = &r->chromophores;
    m->scratch = &site->scratch;
    m->weight = site->weight;
    m->whole = site->measured == r->bands;
    m->groups = grouped ? replicates : 1;
    /* Where parameters spread, the replicates' differences say by how much, not how well. */
    site->scattered = !grouped && replicates > 1 && !spread_any(&r->fit);
    m->scatter = site->scattered ? scatter(r, noise, spectra, site) : 0.0;
    if (m->groups > LEAST_SQUARES_MAX || misfit_layout(m) != STATUS_OK)
        return refuse(STATUS_UNSUPPORTED, "there are too many replicates to give each its own",
                      why);
    for (size_t g = 0; g < m->groups; g++)
        m->measured[g] = grouped ? spectra[g].value : site->mean;
    /* White noise is shared by the replicates, the model's error is not. */
    struct noise all = *noise;
    all.white = sqrt(noise->white * noise->white +
                     (double)replicates * r->fit.model_error * r->fit.model_error);
    whitener_init(&all, grouped ? 1 : replicates, r->nm, site->weight, r->bands, site->directions,
                  &m->whitener);
    site->repeated = noise->white * noise->white / (all.white * all.white);
    return STATUS_OK;
}

/* ---- the fit --------------------------------------------------------------------------- */

/* The closed form of the half space gives these three, if nothing else is free nearly as the fit
 * itself does: nearer than a row of a table. */
static bool closed_form(const struct fit *fit)
{
    const unsigned three = 1u << SKIN_CM | 1u << SKIN_BM | 1u << SKIN_CH;
    return fit->model->quick == MODEL_QUICK_HALF_SPACE && fit_free(fit) == three;
}

/* The three by the half space, the others as given; all where it has no answer. */
static void guess(const struct refiner *r, const struct site *site,
                  const double given[SKIN_PARAMETERS], double *x)
{
    double value[SKIN_PARAMETERS];
    memcpy(value, given, sizeof value);
    struct tissue t = fit_tissue(&r->fit, value);
    start_guess(&r->start, site->mean, site->weight, &t);
    value[SKIN_CM] = t.Cm;
    value[SKIN_BM] = t.Bm;
    value[SKIN_CH] = t.Ch;
    misfit_vector(&site->misfit, value, x);
}

/* Where the fit begins, into x; how many spectra of the model that took.  *promise: as
 * coarse_approach(). */
static size_t begin(const struct refiner *r, const struct site *site,
                    const double (*starts)[SKIN_PARAMETERS], size_t n_starts, double *x,
                    double *promise)
{
    double value[SKIN_PARAMETERS];
    const struct misfit *m = &site->misfit;
    *promise = 0.0;
    if (n_starts == 0 || closed_form(&r->fit)) {
        guess(r, site, n_starts > 0 ? starts[0] : values_at_start(&r->fit, value), x);
        return 0;
    }
    misfit_vector(m, starts[0], x);
    if (r->has_coarse && m->whole && m->groups == 1 &&
        coarse_approach(&r->coarse, site->mean, &m->whitener, x, promise)) {
        m->scratch->spectra += 2;
        m->scratch->derivatives += 2 * m->rows;
        return 2;
    }
    misfit_approach(m, x);
    return 1;
}

/* Down to the minimum from at->x; fitted[bands] is then what fits best.  The last step is
 * taken unseen; if it is not a very small one chi^2 is that of where it leads, and where it is not
 * what was promised the way is gone again step by step.  promise: of the step that led to at->x;
 * 0: none did. */
static enum status descend(struct misfit *m, double promise, struct minimum *at,
                           struct least_squares_run *run, double *fitted)
{
    struct least_squares problem = misfit_problem(m, TOLERANCE, STEPS);
    problem.unseen = UNSEEN;
    problem.promised = promise;
    enum status s = least_squares_run(&problem, at->x, &at->normal, run);
    if (s != STATUS_OK)
        return s;
    if (run->left < LEFT && misfit_follow(m, at->x, fitted))
        return STATUS_OK;
    double chi_square = misfit_chi_square(m, at->x, fitted);
    if (!(fabs(chi_square - at->normal.chi_square) < UNSEEN)) {
        struct least_squares_run more;
        problem.unseen = 0.0;
        (void)least_squares_run(&problem, at->x, &at->normal, &more);
        run->converged = more.converged;
        run->iterations += more.iterations;
        run->evaluations += more.evaluations;
        chi_square = misfit_chi_square(m, at->x, fitted);
    }
    at->normal.chi_square = chi_square;
    return STATUS_OK;
}

/* Whether two minima are different skins, in standard errors of the first. */
static bool distinct(const struct misfit *m, const struct minimum *at, const double *x)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        enum skin_parameter p = (enum skin_parameter)i;
        if (m->places[i] > 0 && fabs(misfit_mean(m, x, p) - misfit_mean(m, at->x, p)) >
                                    SECOND_DISTANCE * minimum_se(m, at, p))
            return true;
    }
    return false;
}

/* Skins to begin from besides the first: other rows of the table, then corners of what is
 * free: light and dark, either melanin, little and much blood. */
static bool other_start(const struct refiner *r, const struct site *site,
                        const double (*starts)[SKIN_PARAMETERS], size_t n_starts, size_t i,
                        double *x)
{
    enum { CORNERS = 4 };
    static const double corner[CORNERS][3] = {
        { 0.02, 0.1, 0.5 }, { 0.5, 0.9, 0.05 }, { 0.02, 0.9, 0.05 }, { 0.5, 0.1, 0.5 }
    };
    static const enum skin_parameter which[3] = { SKIN_CM, SKIN_BM, SKIN_CH };
    double value[SKIN_PARAMETERS];
    if (i + 1 < n_starts) {
        misfit_vector(&site->misfit, starts[i + 1], x);
        return true;
    }
    size_t k = n_starts > 0 ? i + 1 - n_starts : i;
    if (k >= CORNERS)
        return false;
    for (size_t j = 0; j < SKIN_PARAMETERS; j++)
        value[j] = r->fit.role[j].value;
    for (size_t j = 0; j < 3; j++) {
        const struct skin_role *role = &r->fit.role[which[j]];
        value[which[j]] = role->lo + corner[k][j] * (role->hi - role->lo);
    }
    misfit_vector(&site->misfit, value, x);
    return true;
}

/* The best minimum that can be found from all starts into *best, which is one already; true
 * where there is another, the best of which is then *second. */
static bool look_around(const struct refiner *r, struct site *site,
                        const double (*starts)[SKIN_PARAMETERS], size_t n_starts,
                        struct minimum *best, struct minimum *second, double *best_fitted)
{
    struct misfit *m = &site->misfit;
    struct minimum tried;
    struct least_squares_run run;
    double fitted[SPECTRUM_MAX_BANDS];
    bool has_second = false;
    for (size_t i = 0; other_start(r, site, starts, n_starts, i, tried.x); i++) {
        misfit_approach(m, tried.x);
        if (descend(m, 0.0, &tried, &run, fitted) != STATUS_OK || !run.converged ||
            !distinct(m, best, tried.x))
            continue;
        if (tried.normal.chi_square < best->normal.chi_square) {
            *second = *best;
            *best = tried;
            memcpy(best_fitted, fitted, r->bands * sizeof *fitted);
            minimum_covariance(m, best);
            has_second = true;
        } else if (!has_second || tried.normal.chi_square < second->normal.chi_square) {
            *second = tried;
            has_second = true;
        }
    }
    return has_second && distinct(m, best, second->x) &&
           second->normal.chi_square - best->normal.chi_square < SECOND_RISE;
}

/* ---- the answer ------------------------------------------------------------------------ */

/* Values, standard errors and intervals at the minimum; false where a better one was met,
 * which is then where `at` stands. */
static bool describe(struct misfit *m, struct minimum *at, unsigned want, struct refined *ret)
{
    double better[LEAST_SQUARES_MAX];
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        enum skin_parameter p = (enum skin_parameter)i;
        const struct skin_role *role = &m->fit->role[i];
        double value = misfit_mean(m, at->x, p);
        ret->value[i] = ret->lo[i] = ret->hi[i] = value;
        ret->se[i] = 0.0;
        if (!role->free)
            continue;
        ret->se[i] = minimum_se(m, at, p);
        ret->lo[i] = fmax(value - Z_95 * ret->se[i], role->lo);
        ret->hi[i] = fmin(value + Z_95 * ret->se[i], role->hi);
        if ((want & REFINE_INTERVALS) != 0 &&
            !interval_find(m, at, p, &ret->lo[i], &ret->hi[i], better)) {
            memcpy(at->x, better, m->n * sizeof *better);
            return false;
        }
    }
    return true;
}

/* Standard errors and intervals made wider by other placements of the probe; what of them
 * comes from those into spread[]. */
static void widen(const struct refiner *r, const struct site *site, const struct minimum *at,
                  double spread[SKIN_PARAMETERS], struct refined *ret)
{
    double repeated = sqrt(site->repeated);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        spread[i] = 0.0;
    if (spread_any(&r->fit))
        spread_find(&site->misfit, at, site->noise, r->nm, site->spectra, site->replicates, spread);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &r->fit.role[i];
        double value = ret->value[i], half = Z_95 * spread[i], most = role->hi - role->lo;
        double again = repeated * ret->se[i];
        ret->repeat_se[i] = fmin(spread[i] == 0.0 ? again : hypot(again, spread[i]), most);
        if (spread[i] == 0.0)
            continue;
        ret->se[i] = fmin(hypot(ret->se[i], spread[i]), most);
        ret->lo[i] = fmax(value - hypot(value - ret->lo[i], half), role->lo);
        ret->hi[i] = fmin(value + hypot(ret->hi[i] - value, half), role->hi);
    }
}

/* Values alone. */
static void tell_values(const struct misfit *m, const struct minimum *at, struct refined *ret)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        ret->value[i] = misfit_mean(m, at->x, (enum skin_parameter)i);
        ret->se[i] = ret->repeat_se[i] = ret->lo[i] = ret->hi[i] = NAN;
    }
}

/* An amount is judged by its root: reflectance goes by the root of what absorbs. */
static double on_scale(size_t i, double x)
{
    return i == SKIN_CM || i == SKIN_CH ? sqrt(x) : x;
}

static unsigned flags_of(const struct fit *fit, const double spread[SKIN_PARAMETERS],
                         const struct refined *r)
{
    unsigned flags = 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &fit->role[i];
        if (!role->free)
            continue;
        double range = on_scale(i, role->hi) - on_scale(i, role->lo);
        if (r->value[i] == role->lo || r->value[i] == role->hi)
            flags |= (unsigned)REFINE_AT_BOUND << i;
        if (on_scale(i, r->hi[i]) - on_scale(i, r->lo[i]) >= 0.5 * range)
            flags |= (unsigned)REFINE_UNDETERMINED << i;
        /* Less than half of what is known of it comes from the data. */
        double fitted = r->se[i] * r->se[i] - spread[i] * spread[i];
        if (isfinite(role->prior_sd) && fitted > 0.5 * role->prior_sd * role->prior_sd)
            flags |= (unsigned)REFINE_BY_PRIOR << i;
    }
    if (r->degrees > 0 && r->chi_square_p < P_TOO_LARGE)
        flags |= REFINE_RESIDUAL_TOO_LARGE;
    /* Where the model does better than at its usual error, nobody stated a noise too large. */
    if (r->degrees > 0 && r->chi_square_p > P_TOO_SMALL && fit->model_error == 0.0)
        flags |= REFINE_RESIDUAL_TOO_SMALL;
    return flags | (r->has_second ? (unsigned)REFINE_SECOND_SOLUTION : 0u);
}

/* Residual, rms, and with it the difference in colour. */
static void compare(const struct refiner *r, const struct site *site, const double *fitted,
                    unsigned want, struct refined *ret)
{
    enum { PARTS = 4 }; /* sums that do not wait for one another */
    double part[PARTS] = { 0.0 }, XYZ[3], Lab[2][3];
    double *restrict residual = ret->residual;
    for (size_t i = 0; i < r->bands; i++)
        residual[i] = site->mean[i] - fitted[i];
    for (size_t i = 0; i < r->bands; i++) {
        double off = isnan(residual[i]) ? 0.0 : residual[i];
        part[i % PARTS] += off * off;
    }
    ret->rms = sqrt((part[0] + part[1] + part[2] + part[3]) / (double)site->measured);
    ret->dE00 = NAN;
    if ((want & REFINE_COLOUR) == 0 || !r->has_weights || !site->misfit.whole)
        return;
    xyz_from_reflectance(&r->weights, site->mean, XYZ);
    lab_from_xyz(XYZ, r->weights.white, Lab[0]);
    xyz_from_reflectance(&r->weights, fitted, XYZ);
    lab_from_xyz(XYZ, r->weights.white, Lab[1]);
    ret->dE00 = delta_e_2000(Lab[0], Lab[1]);
}

static void judge(const struct refiner *r, const struct site *site, const struct minimum *at,
                  struct refined *ret)
{
    bool each = site->scattered || site->misfit.groups > 1;
    size_t data = site->measured * (each ? site->replicates : 1);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        data += r->fit.role[i].free && isfinite(r->fit.role[i].prior_sd) ? 1u : 0u;
    ret->free = fit_free(&r->fit);
    ret->first_nm = r->first_nm;
    ret->step_nm = r->step_nm;
    ret->bands = r->bands;
    ret->chi_square = at->normal.chi_square;
    ret->degrees = data > site->misfit.n ? data - site->misfit.n : 0;
    ret->chi_square_p = ret->degrees > 0 ? chi_square_above(ret->chi_square, ret->degrees) : 1.0;
}

static void tell_second(const struct misfit *m, const struct minimum *second, struct refined *ret)
{
    ret->has_second = second != NULL;
    ret->second_chi_square = second != NULL ? second->normal.chi_square : NAN;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        ret->second[i] = second != NULL ? misfit_mean(m, second->x, (enum skin_parameter)i) : NAN;
}

static enum status fit_site(const struct refiner *r, struct site *site,
                            const double (*starts)[SKIN_PARAMETERS], size_t n_starts, unsigned want,
                            struct refined *ret)
{
    struct misfit *m = &site->misfit;
    struct minimum at, second;
    struct least_squares_run run, rerun;
    double spread[SKIN_PARAMETERS];
    double fitted[SPECTRUM_MAX_BANDS];
    double promise;
    bool has_second = false;
    size_t approaches = begin(r, site, starts, n_starts, at.x, &promise);
    enum status s = descend(m, promise, &at, &run, fitted);
    if (s != STATUS_OK)
        return s;
    if ((want & REFINE_NO_SE) != 0) {
        tell_values(m, &at, ret);
        memset(spread, 0, sizeof spread);
    } else {
        minimum_covariance(m, &at);
        if ((want & REFINE_SECOND) != 0)
            has_second = look_around(r, site, starts, n_starts, &at, &second, fitted);
        for (int turn = 0; !describe(m, &at, turn < AGAIN ? want : 0, ret); turn++) {
            (void)descend(m, 0.0, &at, &rerun, fitted); /* from where chi^2 was finite just now */
            minimum_covariance(m, &at);
        }
        widen(r, site, &at, spread, ret);
    }
    tell_second(m, has_second ? &second : NULL, ret);
    compare(r, site, fitted, want, ret);
    judge(r, site, &at, ret);
    ret->iterations = run.iterations;
    ret->evaluations = run.evaluations + approaches;
    ret->model_spectra = m->scratch->spectra;
    ret->model_derivatives = m->scratch->derivatives;
    ret->flags =
        flags_of(&r->fit, spread, ret) | (run.converged ? 0u : (unsigned)REFINE_NOT_CONVERGED);
    return STATUS_OK;
}

enum status refiner_run(const struct refiner *refiner, const struct noise *noise,
                        const struct spectrum *spectra, size_t replicates,
                        const double (*starts)[SKIN_PARAMETERS], size_t n_starts, unsigned want,
                        struct refined *ret, const char **why)
{
    struct site site;
    enum status s = noise_check(noise, why);
    if (s == STATUS_OK) /* few numbers: memory fetches the spectra meanwhile */
        s = check_starts(starts, n_starts, why);
    if (s == STATUS_OK)
        s = check_spectra(refiner, spectra, replicates, why);
    if (s == STATUS_OK)
        s = site_init(refiner, noise, spectra, replicates, &site, why);
    if (s != STATUS_OK)
        return s;
    s = fit_site(refiner, &site, starts, n_starts, want, ret);
    if (s != STATUS_OK)
        return refuse(s, "the model takes none of the skins to begin from", why);
    ret->noise = *noise;
    return STATUS_OK;
}

enum status refine(const struct fit *fit, const struct noise *noise, const struct spectrum *spectra,
                   size_t replicates, const double (*starts)[SKIN_PARAMETERS], size_t n_starts,
                   struct refined *ret, const char **why)
{
    struct refiner *refiner;
    if (replicates == 0)
        return refuse(STATUS_RANGE, "there is no spectrum to fit", why);
    enum status s =
        refiner_open(fit, spectra->first_nm, spectra->step_nm, spectra->n, &refiner, why);
    if (s != STATUS_OK)
        return s;
    s = refiner_run(refiner, noise, spectra, replicates, starts, n_starts, REFINE_ALL, ret, why);
    refiner_close(refiner);
    return s;
}
