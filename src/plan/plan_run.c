/* plan_run.c - the parts of a plan one after the other. */
#include "plan/plan_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"
#include "match/start.h"

struct plan_runner {
    struct plan plan;
    const struct matcher *matcher;
    struct nearest_range range;
    struct match_ask ask;                 /* less where the work is counted */
    double given_first_nm, given_step_nm; /* of the spectra that come */
    size_t given_bands;
    bool narrowed; /* not all their bands are used */
    struct xyz_weights *weights;
    struct refiner *refiner;
    struct start *start; /* for the closed form alone */
    struct tissue middle;
};

static enum status refuse(enum status s, const char *sentence, const char **why)
{
    if (why != NULL)
        *why = sentence;
    return s;
}

/* ---- opened ------------------------------------------------------------------------- */

static void take_range(const struct plan *plan, struct plan_runner *r)
{
    bool ranged = false;
    for (size_t i = 0; i < 3; i++) {
        bool free = isnan(plan->searched[i].lo);
        r->range.lo[i] = free ? -(double)INFINITY : plan->searched[i].lo;
        r->range.hi[i] = free ? (double)INFINITY : plan->searched[i].hi;
        ranged = ranged || !free;
    }
    r->ask.range = ranged ? &r->range : NULL;
    r->ask.no_colour = !plan_runs(&r->plan, PLAN_COLOUR);
    r->ask.no_spectra = !plan_runs(&r->plan, PLAN_SPECTRA);
}

static enum status open_colour(struct plan_runner *r)
{
    const struct plan *p = &r->plan;
    if (!plan_runs(p, PLAN_COLOUR))
        return STATUS_OK;
    r->weights = malloc(sizeof *r->weights);
    return r->weights == NULL ? STATUS_NO_MEMORY
                              : xyz_weights_init(p->scene.illuminant, p->scene.observer,
                                                 p->first_nm, p->step_nm, p->bands, r->weights);
}

static enum status open_start(struct plan_runner *r)
{
    const struct plan *p = &r->plan;
    struct chromophores c;
    double value[SKIN_PARAMETERS];
    if (!plan_runs(p, PLAN_CLOSED_FORM))
        return STATUS_OK;
    r->start = malloc(sizeof *r->start);
    if (r->start == NULL)
        return STATUS_NO_MEMORY;
    enum status s = chromophores_init(p->first_nm, p->step_nm, p->bands, &c);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = p->fit.role[i].value;
    r->middle = fit_tissue(&p->fit, value);
    start_init(&r->middle, &c, r->start);
    return STATUS_OK;
}

static bool suits(const struct plan *p, const struct matcher *m)
{
    if (!plan_runs(p, PLAN_SEARCH))
        return m == NULL;
    return m != NULL && m->by == p->scene.by && m->table->recipe.model == p->scene.model;
}

enum status plan_open(const struct plan *plan, const struct matcher *matcher,
                      struct plan_runner **ret, const char **why)
{
    if (why != NULL)
        *why = NULL;
    if (!suits(plan, matcher))
        return refuse(STATUS_RANGE, "the matcher is not of the plan's table", why);
    struct plan_runner *r = calloc(1, sizeof *r);
    if (r == NULL)
        return STATUS_NO_MEMORY;
    r->plan = *plan;
    r->matcher = matcher;
    r->given_first_nm = plan->given_first_nm;
    r->given_step_nm = plan->given_step_nm;
    r->given_bands = plan->given_bands;
    r->narrowed = plan->bands != plan->given_bands;
    take_range(plan, r);
    enum status s = open_colour(r);
    if (s == STATUS_OK)
        s = open_start(r);
    if (s == STATUS_OK && plan_runs(plan, PLAN_FIT))
        s = refiner_open(&plan->fit, plan->first_nm, plan->step_nm, plan->bands, &r->refiner, why);
    if (s == STATUS_OK)
        *ret = r;
    else
        plan_close(r);
    return s;
}

void plan_close(struct plan_runner *runner)
{
    if (runner == NULL)
        return;
    free(runner->weights);
    free(runner->start);
    refiner_close(runner->refiner);
    free(runner);
}

/* ---- run ---------------------------------------------------------------------------- */

static enum status run_colour(const struct plan_runner *r, const struct spectrum *s,
                              struct plan_answer *a, const char **why)
{
    const struct xyz_weights *w = r->weights;
    double XYZ[3];
    xyz_from_reflectance(w, s->value, XYZ);
    if (isnan(XYZ[0] + XYZ[1] + XYZ[2]))
        return refuse(STATUS_UNSUPPORTED,
                      "a colour is wanted, and a band of it was not measured; measure it, or want "
                      "neither lab nor rgb",
                      why);
    if ((r->plan.scene.wanted & SCENE_LAB) != 0)
        lab_from_xyz(XYZ, w->white, a->Lab);
    if ((r->plan.scene.wanted & SCENE_RGB) != 0)
        srgb_linear_from_xyz(XYZ, w->white, a->rgb);
    a->has_colour = true;
    return STATUS_OK;
}

static void take_coefficients(struct plan_answer *a, double Cm, double Bm, double Ch)
{
    a->has_coefficients = true;
    a->coefficient[0] = Cm;
    a->coefficient[1] = Bm;
    a->coefficient[2] = Ch;
}

static enum status run_search(const struct plan_runner *r, const struct spectrum *s,
                              struct nearest_hit *hits, struct plan_answer *a,
                              struct plan_work *work)
{
    const struct table *t = r->matcher->table;
    struct nearest_work looked = { 0, 0 };
    struct match_ask ask = r->ask;
    ask.work = work != NULL ? &looked : NULL;
    enum status status = matcher_match_asked(r->matcher, &ask, s, r->plan.k, hits, &a->nearest);
    if (status != STATUS_OK)
        return status;
    a->has_nearest = true;
    take_coefficients(a, a->nearest.row.Cm, a->nearest.row.Bm, a->nearest.row.Ch);
    if (work == NULL)
        return STATUS_OK;
    bool colour = r->matcher->by != MATCH_SPECTRUM;
    work->rows += looked.rows;
    work->judged += looked.judged;
    work->bytes += looked.rows * (colour ? 3 * sizeof(double) : t->stride * sizeof(float));
    work->colours += colour || !ask.no_colour ? 1u : 0u;
    return STATUS_OK;
}

static double inside(const struct plan_runner *r, size_t i, double x)
{
    const struct skin_role *role = &r->plan.fit.role[i];
    return fmin(fmax(x, role->lo), role->hi);
}

/* Rows beside the ranges begin at their ends. */
static size_t starts_of(const struct plan_runner *r, const struct nearest_hit *hits, size_t found,
                        double (*starts)[SKIN_PARAMETERS])
{
    const struct plan *p = &r->plan;
    size_t n = found < REFINE_STARTS ? found : REFINE_STARTS;
    if (!plan_runs(p, PLAN_SEARCH) || p->scene.start == SCENE_START_CLOSED_FORM)
        return 0;
    refined_match_starts(r->matcher->table, hits, n, &p->fit, starts);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < 3; j++)
            if (p->fit.role[j].free)
                starts[i][j] = inside(r, j, starts[i][j]);
    return n;
}

static enum status run_fit(const struct plan_runner *r, const struct spectrum *replicate, size_t n,
                           const struct spectrum *mean, const struct nearest_hit *hits,
                           struct plan_answer *a, struct plan_work *work, const char **why)
{
    const struct plan *p = &r->plan;
    double starts[REFINE_STARTS][SKIN_PARAMETERS];
    struct noise noise;
    enum status s = refine_wish_noise(&p->wish, replicate, n, &noise, &a->source);
    if (s != STATUS_OK)
        return s;
    size_t n_starts = starts_of(r, hits, a->nearest.found, starts);
    s = refiner_run(r->refiner, &noise, replicate, n, (const double(*)[SKIN_PARAMETERS])starts,
                    n_starts, p->want, &a->refined, why);
    if (s != STATUS_OK)
        return s;
    a->has_refined = true;
    take_coefficients(a, a->refined.value[SKIN_CM], a->refined.value[SKIN_BM],
                      a->refined.value[SKIN_CH]);
    bool coloured = plan_runs(p, PLAN_FITTED_COLOUR);
    if (coloured && r->matcher != NULL)
        refined_match_colour(r->matcher->table, mean, &a->refined, a->fitted_Lab);
    if (work != NULL) {
        work->evaluations += a->refined.model_spectra;
        work->derivatives += a->refined.model_derivatives;
        work->colours += !coloured ? 0u : r->matcher != NULL ? 3u : 2u;
    }
    return STATUS_OK;
}

/* The equations know no bounds. */
static void run_closed_form(const struct plan_runner *r, const struct spectrum *s,
                            struct plan_answer *a)
{
    double weight[SPECTRUM_MAX_BANDS], value[SPECTRUM_MAX_BANDS];
    struct tissue t = r->middle;
    for (size_t i = 0; i < s->n; i++) {
        weight[i] = isnan(s->value[i]) ? 0.0 : 1.0;
        value[i] = isnan(s->value[i]) ? 0.0 : s->value[i];
    }
    start_guess(r->start, value, weight, &t);
    take_coefficients(a, inside(r, SKIN_CM, t.Cm), inside(r, SKIN_BM, t.Bm),
                      inside(r, SKIN_CH, t.Ch));
}

static void narrow(const struct plan *p, const struct spectrum *s, struct spectrum *ret)
{
    *ret = (struct spectrum){ .first_nm = p->first_nm,
                              .step_nm = p->step_nm,
                              .n = p->bands,
                              .specular = s->specular,
                              .aperture_mm = s->aperture_mm };
    for (size_t i = 0; i < p->bands; i++) {
        ret->value[i] = s->value[p->first + i * p->every];
        ret->flag[i] = s->flag[p->first + i * p->every];
    }
}

static enum status run_parts(const struct plan_runner *r, const struct spectrum *replicate,
                             size_t n, const struct spectrum *mean, struct nearest_hit *hits,
                             struct plan_answer *a, struct plan_work *work, const char **why)
{
    const struct plan *p = &r->plan;
    enum status s = STATUS_OK;
    if (plan_runs(p, PLAN_COLOUR)) {
        s = run_colour(r, mean, a, why);
        if (work != NULL)
            work->colours++;
    }
    if (s == STATUS_OK && plan_runs(p, PLAN_SEARCH))
        s = run_search(r, mean, hits, a, work);
    if (s == STATUS_OK && plan_runs(p, PLAN_CLOSED_FORM))
        run_closed_form(r, mean, a);
    if (s == STATUS_OK && plan_runs(p, PLAN_FIT))
        s = run_fit(r, replicate, n, mean, hits, a, work, why);
    return s;
}

/* All of them with the scene's bands alone. */
static enum status run_narrowed(const struct plan_runner *r, const struct spectrum *replicate,
                                size_t n, const struct spectrum *mean, struct nearest_hit *hits,
                                struct plan_answer *a, struct plan_work *work, const char **why)
{
    struct spectrum *few = calloc(n + 1, sizeof *few);
    if (few == NULL)
        return STATUS_NO_MEMORY;
    narrow(&r->plan, mean, &few[n]);
    for (size_t i = 0; i < n; i++)
        narrow(&r->plan, &replicate[i], &few[i]);
    enum status s = run_parts(r, few, n, &few[n], hits, a, work, why);
    free(few);
    return s;
}

enum status plan_run(const struct plan_runner *r, const struct spectrum *replicate, size_t n,
                     const struct spectrum *mean, struct nearest_hit *hits, struct plan_answer *ret,
                     struct plan_work *work, const char **why)
{
    if (why != NULL)
        *why = NULL;
    if (mean->n != r->given_bands || mean->first_nm != r->given_first_nm ||
        mean->step_nm != r->given_step_nm)
        return refuse(STATUS_RANGE, "the spectrum has other bands than the plan was made for", why);
    ret->has_colour = ret->has_nearest = ret->has_refined = ret->has_coefficients = false;
    ret->nearest.found = 0;
    ret->nearest.flags = 0;
    for (size_t i = 0; i < 3; i++)
        ret->Lab[i] = ret->rgb[i] = ret->fitted_Lab[i] = ret->coefficient[i] = NAN;
    return r->narrowed ? run_narrowed(r, replicate, n, mean, hits, ret, work, why)
                       : run_parts(r, replicate, n, mean, hits, ret, work, why);
}
