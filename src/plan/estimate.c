/* estimate.c - figures that were measured, for conditions that were not. */
#include "plan/estimate.h"

#include <math.h>

#include "plan/rehearsal.h"

/* ---- what was measured -------------------------------------------------------------- */

static size_t rows_of(const struct choice *c, const struct way *w)
{
    return w->table == PLAN_NO_TABLE ? 0 : c->at_hand->table[w->table].rows;
}

/* Of a table of another size the one nearest in size, in proportion. */
static const struct cost *cost_of(const struct choice *c, const struct way *w,
                                  enum refine_kind kind, bool interval)
{
    const struct costs *costs = c->at_hand->costs;
    size_t rows = rows_of(c, w);
    const struct cost *found = NULL;
    double least = INFINITY;
    for (size_t i = 0; i < costs->n; i++) {
        const struct cost *cost = &costs->cost[i];
        if (cost->model != w->model || cost->refine != kind || (cost->rows == 0) != (rows == 0) ||
            cost->by != w->by || cost->interval != interval)
            continue;
        double apart = rows == 0 ? 0.0 : fabs(log((double)cost->rows / (double)rows));
        if (apart < least) {
            least = apart;
            found = cost;
        }
    }
    return found;
}

/* Of any fit of Cm, Bm, Ch by the model: they differ in time alone. */
static const struct cost *any_fit(const struct costs *costs, const struct model *model)
{
    for (size_t i = 0; i < costs->n; i++)
        if (costs->cost[i].model == model && costs->cost[i].refine == REFINE_THREE)
            return &costs->cost[i];
    return NULL;
}

/* ---- conditions --------------------------------------------------------------------- */

static enum refine_kind kind_of(const struct choice *c, const struct way *w)
{
    return !w->fits ? REFINE_NOT : c->scene->fit == REFINE_SKIN ? REFINE_SKIN : REFINE_THREE;
}

/* What one spectrum of the scene is taken to stray by. */
static enum status scene_noise(const struct scene *s, struct noise *ret)
{
    enum noise_source source;
    struct refine_wish wish = choice_wish(s);
    return refine_wish_noise(&wish, NULL, 1, ret, &source);
}

static bool is_as_measured(const struct choice *c, const struct noise *noise)
{
    bool bands = c->bands == COSTS_BANDS && fabs(c->first_nm - COSTS_FIRST_NM) < 1e-6 &&
                 fabs(c->step_nm - COSTS_STEP_NM) < 1e-6;
    return bands && !scene_is_ranged(c->scene) && noise->white == COSTS_NOISE &&
           noise->placement == 0.0;
}

static const struct model *stand_in(const struct model *model)
{
    bool itself = model->quick == MODEL_QUICK_HALF_SPACE || model->quick == MODEL_QUICK_TWO_LAYER;
    return itself ? model : model_find("two-layer");
}

/* A fit from rows; that by the half space begins at the closed form anyway. */
static bool from_rows(const struct choice *c, const struct way *w)
{
    return w->table != PLAN_NO_TABLE && w->model->quick != MODEL_QUICK_HALF_SPACE &&
           c->scene->start != SCENE_START_CLOSED_FORM;
}

/* What the costs were measured under. */
static enum status measured_conditions(const struct choice *c, const struct way *w,
                                       struct rehearsal *ret)
{
    const struct recipe recipe = recipe_default(stand_in(w->model));
    struct refine_wish wish = refine_wish_none();
    wish.kind = w->fits ? kind_of(c, w) : REFINE_THREE;
    wish.white = COSTS_NOISE;
    *ret = (struct rehearsal){ .noise = noise_white(COSTS_NOISE),
                               .told = noise_white(COSTS_NOISE),
                               .first_nm = COSTS_FIRST_NM,
                               .step_nm = COSTS_STEP_NM,
                               .bands = COSTS_BANDS,
                               .closed_form = !w->fits && w->table == PLAN_NO_TABLE,
                               .colour = !w->fits && w->by != MATCH_SPECTRUM,
                               .from_there = w->fits ? from_rows(c, w) : true };
    for (size_t i = 0; i < 3; i++)
        ret->range[i] = scene_whole_range(i);
    return refine_wish_fit(&wish, &recipe, &ret->fit, NULL);
}

static enum status scene_conditions(const struct choice *c, const struct way *w,
                                    const struct noise *noise, struct rehearsal *ret)
{
    const char *ignored;
    struct recipe recipe = choice_recipe(c->at_hand, w);
    struct refine_wish wish = choice_wish(c->scene);
    recipe.model = stand_in(w->model);
    *ret = (struct rehearsal){ .noise = *noise,
                               .told = w->fits ? *noise : noise_white(COSTS_NOISE),
                               .first_nm = c->first_nm,
                               .step_nm = c->step_nm,
                               .bands = c->bands,
                               .closed_form = !w->fits && w->table == PLAN_NO_TABLE,
                               .colour = !w->fits && w->by != MATCH_SPECTRUM,
                               .from_there = w->fits ? from_rows(c, w) : true };
    for (size_t i = 0; i < 3; i++)
        ret->range[i] = scene_range_of(c->scene, i);
    return choice_fit(c->scene, &wish, &recipe, &ret->fit, &ignored);
}

/* ---- errors ------------------------------------------------------------------------- */

/* a^2 - b^2, which chance may have made negative; what is not known stays so. */
static double less(double a, double b)
{
    double difference = a * a - b * b;
    return difference < 0.0 ? 0.0 : difference;
}

/* One of Cm, Bm, Ch by skins of the model's own. */
static double own_error(const struct choice *c, const struct way *w, size_t i,
                        const struct rehearsed *S, const struct rehearsed *M)
{
    const struct cost *fit = any_fit(c->at_hand->costs, w->model);
    double times = S->rmse[i] / M->rmse[i], f = w->cost->rmse[i];
    if (w->fits || w->table == PLAN_NO_TABLE)
        return f * times;
    double noise = fit != NULL && w->by == MATCH_SPECTRUM ? fit->rmse[i] : M->rmse[i];
    if (isnan(f) || noise > f)
        return f * times;
    return sqrt(less(f, noise) + noise * times * noise * times);
}

/* What noise does taken off a figure, the rest so many times as large, and other noise put on. */
static double combined(double f, double noise_then, double times, double noise_now)
{
    return sqrt(less(f, noise_then) * times * times + noise_now * noise_now);
}

/* What is rehearsed of a way: under the scene's conditions, and as it was measured. */
struct both {
    struct rehearsed scene, measured;
};

static void set_errors(const struct choice *c, struct way *w, const struct both *noise,
                       const struct both *model)
{
    const struct cost *cost = w->cost;
    const struct rehearsed *S = &noise->scene, *M = &noise->measured;
    for (size_t i = 0; i < 3; i++) {
        double own = own_error(c, w, i, S, M);
        double times = model->scene.rmse[i] / model->measured.rmse[i];
        w->expected.coefficient[i] =
            c->scene->model != NULL ? own
                                    : combined(cost->rmse_transport[i], cost->rmse[i], times, own);
    }
    const struct rehearsed *S_model = &model->scene, *M_model = &model->measured;
    w->expected.dE00 = combined(cost->dE00, M->dE00, S_model->dE00 / M_model->dE00, S->dE00);
    w->expected.rms = combined(cost->rms_R, M->rms_R, S_model->rms_R / M_model->rms_R, S->rms_R);
}

static void set_measured_errors(const struct choice *c, struct way *w)
{
    for (size_t i = 0; i < 3; i++)
        w->expected.coefficient[i] =
            c->scene->model != NULL ? w->cost->rmse[i] : w->cost->rmse_transport[i];
    w->expected.dE00 = w->cost->dE00;
    w->expected.rms = w->cost->rms_R;
}

/* ---- times -------------------------------------------------------------------------- */

/* What a further row adds to a search for one, in parts of it: tables of 50 400 rows, k 10 and
 * 100. */
static double further_row(enum match_by by)
{
    switch (by) {
    case MATCH_LAB:
        return 0.115;
    case MATCH_DE2000:
        return 0.19;
    case MATCH_SPECTRUM:
        return 0.11;
    default:
        return 0.065;
    }
}

/* Whether a search by spectrum has to look at every row. */
static bool scans(const struct choice *c, const struct way *w)
{
    const struct recipe *recipe = c->at_hand->table[w->table].recipe;
    return w->by == MATCH_SPECTRUM && choice_common_bands(c, recipe) < recipe->bands;
}

static double indexed_us(enum match_by by, double one_us, size_t k)
{
    return one_us * (1.0 + further_row(by) * (double)(k - 1));
}

static double search_us(const struct choice *c, const struct way *w, double one_us, size_t k)
{
    return scans(c, w) ? ESTIMATE_SCAN_US * (double)rows_of(c, w) : indexed_us(w->by, one_us, k);
}

/* Of a fit of 31 bands the part that is equations and checks: docs/performance.md, "Bands".  A
 * model that takes far longer than those goes by its bands alone. */
#define FIT_FIXED 0.41
/* What placement noise of match/noise.h's usual size makes a fit longer by beside the number of
 * evaluations (more arithmetic, and no steps in single precision), and one with intervals. */
#define PLACED_FIT 1.5
#define PLACED_INTERVAL 1.6

/* Of a fit without its search, in parts of what was measured. */
static double fit_times(const struct choice *c, const struct way *w, const struct noise *noise,
                        const struct both *both)
{
    bool interval = (c->scene->wanted & SCENE_INTERVAL) != 0;
    double evaluations = both->scene.evaluations / both->measured.evaluations;
    double fixed = stand_in(w->model) == w->model ? FIT_FIXED : 0.0;
    double bands = fixed + (1.0 - fixed) * (double)c->bands / COSTS_BANDS;
    double placement = noise->placement == 0.0 ? 1.0 : interval ? PLACED_INTERVAL : PLACED_FIT;
    /* Intervals are looked for in as many evaluations, however many the fit takes. */
    return bands * placement * (interval ? fmax(evaluations, 1.0) : evaluations);
}

static double way_us(const struct choice *c, const struct way *w, double fit_factor)
{
    const struct cost *row = w->table != PLAN_NO_TABLE ? cost_of(c, w, REFINE_NOT, false) : NULL;
    size_t k = c->scene->k;
    if (w->table == PLAN_NO_TABLE)
        return w->fits ? w->cost->us * fit_factor : w->cost->us;
    if (!w->fits)
        return search_us(c, w, w->cost->us, k);
    if (row == NULL)
        return scans(c, w) ? (double)NAN : w->cost->us * fit_factor;
    double searched = indexed_us(w->by, row->us, REFINE_STARTS);
    double fit = fmax(w->cost->us - searched, 0.0);
    return fit * fit_factor + search_us(c, w, row->us, k < REFINE_STARTS ? REFINE_STARTS : k);
}

static void set_times(const struct choice *c, struct way *w, double fit_factor)
{
    double us = way_us(c, w, fit_factor);
    w->expected.us = us + c->colour_us;
    w->expected.us_p95 = us * w->cost->us_p95 / w->cost->us + c->colour_us;
}

/* ---- all of it ---------------------------------------------------------------------- */

static const struct plan_estimate unknown = { NAN, NAN, { NAN, NAN, NAN }, NAN, NAN, NAN, NAN };

static enum status rehearse_both(struct rehearsal *scene, struct rehearsal *measured,
                                 struct both *ret)
{
    enum status s = rehearse(scene, &ret->scene);
    return s == STATUS_OK ? rehearse(measured, &ret->measured) : s;
}

/* Noise by skins of the way's own model, and the model by skins of transport without noise.
 * STATUS_UNSUPPORTED where the way cannot be rehearsed. */
static enum status rehearse_way(const struct choice *c, const struct way *w,
                                const struct noise *noise, struct both *by_noise,
                                struct both *by_model)
{
    struct rehearsal scene, measured;
    enum status s = scene_conditions(c, w, noise, &scene);
    if (s == STATUS_OK)
        s = measured_conditions(c, w, &measured);
    if (s == STATUS_OK)
        s = rehearse_both(&scene, &measured, by_noise);
    if (s != STATUS_OK)
        return s;
    scene.transport = measured.transport = true;
    scene.noise.white = measured.noise.white = scene.noise.placement = 0.0;
    return rehearse_both(&scene, &measured, by_model);
}

enum status estimate_way(const struct choice *c, struct way *w)
{
    struct noise noise;
    struct both by_noise, by_model = { 0 };
    w->expected = unknown;
    w->unfinished = 0.0;
    w->cost = cost_of(c, w, kind_of(c, w), (c->scene->wanted & SCENE_INTERVAL) != 0);
    if (w->cost == NULL || scene_noise(c->scene, &noise) != STATUS_OK)
        return STATUS_OK;
    w->expected.white = noise.white;
    w->expected.placement = noise.placement;
    if (is_as_measured(c, &noise)) {
        set_measured_errors(c, w);
        set_times(c, w, 1.0);
        return STATUS_OK;
    }
    enum status s = rehearse_way(c, w, &noise, &by_noise, &by_model);
    if (s == STATUS_OK) {
        set_errors(c, w, &by_noise, &by_model);
        set_times(c, w, w->fits ? fit_times(c, w, &noise, &by_noise) : 1.0);
        w->unfinished = w->fits ? by_noise.scene.unfinished : 0.0;
    } else if (!w->fits) {
        set_times(c, w, 1.0);
    }
    return s == STATUS_NO_MEMORY ? s : STATUS_OK;
}
