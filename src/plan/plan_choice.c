/* plan_choice.c - what can be done, what it costs, and which of it is taken. */
#include "plan/plan_choice.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "colour/xyz.h"
#include "plan/estimate.h"

__attribute__((format(printf, 3, 4))) static enum status refuse(enum status s, char *why,
                                                                const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, SCENE_WHY_SIZE, format, arguments);
    va_end(arguments);
    return s;
}

static bool wants(const struct scene *scene, unsigned what)
{
    return (scene->wanted & what) != 0;
}

/* ---- bands -------------------------------------------------------------------------- */

static enum status take_bands(struct choice *c, char *why)
{
    const struct plan_at_hand *h = c->at_hand;
    const struct scene *s = c->scene;
    c->first = 0;
    c->every = 1;
    c->bands = h->bands;
    c->first_nm = h->first_nm;
    c->step_nm = h->step_nm;
    if (isnan(s->first_nm))
        return STATUS_OK;
    double last_nm = h->first_nm + (double)(h->bands - 1) * h->step_nm;
    double first = (s->first_nm - h->first_nm) / h->step_nm, every = s->step_nm / h->step_nm;
    double bands = nearbyint((s->last_nm - s->first_nm) / s->step_nm) + 1.0;
    bool single = bands == 1.0;
    if (first < -1e-6 || s->last_nm > last_nm + 1e-6 || fabs(first - nearbyint(first)) > 1e-6 ||
        (!single && (every < 0.5 || fabs(every - nearbyint(every)) > 1e-6)))
        return refuse(STATUS_RANGE, why,
                      "the scene's bands %g..%g nm by %g are not among the measured %g..%g nm by "
                      "%g; ask for bands that were measured, or leave `bands` out",
                      s->first_nm, s->last_nm, s->step_nm, h->first_nm, last_nm, h->step_nm);
    c->first = (size_t)nearbyint(first);
    c->every = single ? 1 : (size_t)nearbyint(every);
    c->bands = (size_t)bands;
    c->first_nm = s->first_nm;
    c->step_nm = single ? h->step_nm : s->step_nm;
    return STATUS_OK;
}

static bool have_colour(const struct choice *c, enum illuminant illuminant, enum observer observer)
{
    struct xyz_weights weights;
    return xyz_weights_init(illuminant, observer, c->first_nm, c->step_nm, c->bands, &weights) ==
           STATUS_OK;
}

static enum status check_colour(const struct choice *c, char *why)
{
    const struct scene *s = c->scene;
    if (!wants(s, SCENE_LAB | SCENE_RGB) || have_colour(c, s->illuminant, s->observer))
        return STATUS_OK;
    return refuse(STATUS_RANGE, why,
                  "the bands %g..%g nm by %g give no colour, but %s is wanted; use bands from 400 "
                  "nm or below to 700 nm or above by 1, 5 or 10 nm, or do not want it",
                  c->first_nm, c->first_nm + (double)(c->bands - 1) * c->step_nm, c->step_nm,
                  wants(s, SCENE_LAB) ? "lab" : "rgb");
}

size_t choice_common_bands(const struct choice *c, const struct recipe *recipe)
{
    size_t n = 0;
    for (size_t i = 0; i < recipe->bands; i++) {
        double nm = recipe->first_nm + (double)i * recipe->step_nm;
        double at = (nm - c->first_nm) / c->step_nm;
        bool there = at > -0.5 && at < (double)c->bands - 0.5 &&
                     fabs(at - nearbyint(at)) * c->step_nm <= 1e-6;
        n += there ? 1u : 0u;
    }
    return n;
}

/* ---- ranges ------------------------------------------------------------------------- */

static size_t values_in(const struct axis *axis, struct scene_range r)
{
    size_t n = 0;
    if (axis->lo >= r.lo && axis->hi <= r.hi)
        return axis->n;
    for (size_t i = 0; i < axis->n; i++) {
        double x = axis_value(axis, i);
        n += x >= r.lo && x <= r.hi ? 1u : 0u;
    }
    return n;
}

static struct scene_range or_whole(struct scene_range r, size_t i)
{
    return isnan(r.lo) ? scene_whole_range(i) : r;
}

size_t choice_rows(const struct scene_range range[3], const struct plan_table *table)
{
    const struct grid *grid = &table->recipe->grid;
    struct scene_range Cm = or_whole(range[0], 0), Bm = or_whole(range[1], 1);
    size_t n = values_in(&grid->Ch, or_whole(range[2], 2));
    if (isnan(range[0].lo) && isnan(range[1].lo) && isnan(range[2].lo))
        return table->rows;
    /* Without melanin there is one Bm. */
    bool bare = grid->Cm.lo == 0.0 && Cm.lo <= 0.0;
    size_t with_melanin = values_in(&grid->Cm, Cm) - (bare ? 1u : 0u);
    size_t bare_rows = bare && grid->Bm.lo >= Bm.lo && grid->Bm.lo <= Bm.hi ? n : 0;
    return bare_rows + with_melanin * values_in(&grid->Bm, Bm) * n;
}

static const struct axis *axis_of(const struct plan_table *table, size_t i)
{
    const struct grid *grid = &table->recipe->grid;
    return i == SKIN_CM ? &grid->Cm : i == SKIN_BM ? &grid->Bm : &grid->Ch;
}

/* The values on both sides of a range that has none; beyond an end of the axis the end. */
static struct scene_range beside(const struct axis *axis, struct scene_range r)
{
    size_t below = 0;
    while (below < axis->n && axis_value(axis, below) < r.lo)
        below++;
    size_t lo = below > 0 ? below - 1 : 0, hi = below < axis->n ? below : axis->n - 1;
    return (struct scene_range){ axis_value(axis, lo), axis_value(axis, hi) };
}

bool choice_searched(const struct scene *s, const struct way *w, const struct plan_table *table,
                     struct scene_range ret[3])
{
    bool widened = false;
    for (size_t i = 0; i < 3; i++)
        ret[i] = s->range[i];
    if (!w->fits || wants(s, SCENE_NEAREST))
        return false;
    for (size_t i = 0; i < 3; i++) {
        if (isnan(ret[i].lo) || values_in(axis_of(table, i), ret[i]) > 0)
            continue;
        ret[i] = beside(axis_of(table, i), ret[i]);
        widened = true;
    }
    if (choice_rows(ret, table) > 0)
        return widened;
    ret[SKIN_BM] = (struct scene_range){ NAN, NAN }; /* without melanin there is one Bm */
    return true;
}

/* ---- the fit of a way --------------------------------------------------------------- */

struct refine_wish choice_wish(const struct scene *s)
{
    struct refine_wish wish = refine_wish_none();
    wish.kind = s->fit != REFINE_NOT ? s->fit : REFINE_THREE;
    wish.white = s->white;
    wish.placement = s->placement;
    for (size_t i = 0; i < 3; i++)
        if (scene_is_held(s, i))
            wish.fix[i] = s->range[i].lo;
    return wish;
}

enum status choice_fit(const struct scene *s, const struct refine_wish *wish,
                       const struct recipe *recipe, struct fit *ret, const char **why)
{
    struct fit fit;
    enum status status = refine_wish_fit(wish, recipe, &fit, why);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < 3; i++) {
        struct skin_role *role = &fit.role[i];
        if (isnan(s->range[i].lo) || scene_is_held(s, i) || !role->free)
            continue;
        role->lo = fmax(role->lo, s->range[i].lo);
        role->hi = fmin(role->hi, s->range[i].hi);
        role->value = fmin(fmax(role->value, role->lo), role->hi);
    }
    status = fit_check(&fit, why);
    if (status == STATUS_OK)
        *ret = fit;
    return status;
}

/* ---- ways --------------------------------------------------------------------------- */

static double over(double error, double bound)
{
    if (isnan(bound))
        return 0.0;
    return isnan(error) ? INFINITY : error / bound;
}

/* By how many times the worst of what is bounded exceeds its bound: at most 1 where all is met. */
static double excess(const struct scene *s, const struct plan_estimate *e)
{
    double most = fmax(over(e->dE00, s->bound.dE00), over(e->rms, s->bound.rms));
    for (size_t i = 0; i < 3; i++)
        most = fmax(most, over(e->coefficient[i], s->bound.coefficient[i]));
    return most;
}

/* Of ways that take no longer than they may the least wrong: errors in parts of the
 * coefficients' ranges. */
static double wrongness(const struct scene *s, const struct plan_estimate *e)
{
    double sum = 0.0;
    for (size_t i = 0; i < 3; i++) {
        struct scene_range whole = scene_whole_range(i);
        if (!scene_is_held(s, i))
            sum += isnan(e->coefficient[i]) ? 1.0 : e->coefficient[i] / whole.hi;
    }
    return sum;
}

static bool none(struct choice *c, enum status s);

/* Fits that do not end are chosen where the scene says how they begin, and else not at all. */
static bool ends(struct choice *c, const struct way *w)
{
    char *why = c->why[0] == '\0' ? c->why : (char[SCENE_WHY_SIZE]){ 0 };
    if (w->unfinished <= ESTIMATE_UNFINISHED || c->scene->start != SCENE_START_ANY)
        return true;
    return none(c, refuse(STATUS_RANGE, why,
                          "%.0f of 100 fits by %s from the closed form do not end with these "
                          "bands; use more bands, or a table's rows (`start` \"rows\"), or say "
                          "`start` \"closed-form\"",
                          fmax(1.0, 100.0 * w->unfinished), w->model->name));
}

/* Of those that were asked for the best so far. */
static void weigh(struct choice *c, const struct way *w)
{
    bool timed = !isnan(c->scene->budget_us);
    double us = w->expected.us, far = excess(c->scene, &w->expected);
    bool met = timed ? us <= c->scene->budget_us : far <= 1.0;
    double score = timed ? wrongness(c->scene, &w->expected) : us, miss = timed ? us : far;
    if (met && (!c->any || score < c->best_score)) {
        c->best = *w;
        c->best_score = score;
        c->any = true;
    } else if (!met && (!c->any_miss || miss < c->miss_score ||
                        (miss == c->miss_score && us < c->miss.expected.us))) {
        c->miss = *w;
        c->miss_score = miss;
        c->any_miss = true;
    }
}

/* A way that can be gone. */
static void offer(struct choice *c, struct way *w)
{
    if (!c->asked && c->any) /* in the order of the default */
        return;
    c->no_memory = estimate_way(c, w) != STATUS_OK || c->no_memory;
    if (c->asked) {
        if (w->cost != NULL && !isnan(w->expected.us) && ends(c, w))
            weigh(c, w);
        return;
    }
    c->best = *w;
    c->any = true;
}

/* The first reason is the one that is told: it is that of the default. */
static bool none(struct choice *c, enum status s)
{
    if (c->status == STATUS_OK)
        c->status = s;
    return false;
}

static bool can_fit(struct choice *c, const struct model *model, const struct recipe *recipe)
{
    struct refine_wish wish = choice_wish(c->scene);
    const char *what = NULL;
    struct fit fit;
    size_t n = 0;
    enum status s = choice_fit(c->scene, &wish, recipe, &fit, &what);
    if (s == STATUS_OK && c->scene->no_dermis && model->quick != MODEL_QUICK_TWO_LAYER) {
        s = STATUS_UNSUPPORTED;
        what = "the dermis can be left out of model two-layer alone; take that, or leave "
               "`dermis` out";
    }
    for (size_t i = 0; s == STATUS_OK && i < SKIN_PARAMETERS; i++)
        n += fit.role[i].free ? 1u : 0u;
    if (n > c->bands) {
        s = STATUS_RANGE;
        what = "fewer bands are used than the fit has free parameters; hold some of them, or use "
               "more bands";
    }
    if (s == STATUS_OK)
        return true;
    if (c->why[0] == '\0')
        (void)refuse(s, c->why, "model %s: %s", model->name, what != NULL ? what : status_text(s));
    return none(c, s);
}

static bool can_search(struct choice *c, const struct plan_table *table, enum match_by by)
{
    const struct recipe *recipe = table->recipe;
    char *why = c->why[0] == '\0' ? c->why : (char[SCENE_WHY_SIZE]){ 0 };
    if (by == MATCH_SPECTRUM && recipe->bands == 0)
        return none(c, refuse(STATUS_RANGE, why,
                              "table '%s' (model %s) has no spectra to search by; use rgb, lab or "
                              "de2000, or another table",
                              table->name, recipe->model->name));
    size_t common = by == MATCH_SPECTRUM ? choice_common_bands(c, recipe) : 0;
    if (by == MATCH_SPECTRUM && common < NEAREST_MIN_BANDS)
        return none(c, refuse(STATUS_RANGE, why,
                              "%zu of the bands are in table '%s' as well; to search by spectrum "
                              "takes %d",
                              common, table->name, (int)NEAREST_MIN_BANDS));
    if (by != MATCH_SPECTRUM && !have_colour(c, recipe->illuminant, recipe->observer))
        return none(c,
                    refuse(STATUS_RANGE, why,
                           "the bands give no colour to search by %s; use 400..700 nm by 1, 5 or "
                           "10 nm, or search by spectrum",
                           match_by_name(by)));
    return true;
}

/* Rounded outwards, so that what is said as a range holds it. */
static double outwards(double x, double (*round)(double))
{
    char text[32];
    (void)snprintf(text, sizeof text, "%.4g", x);
    if (x == 0.0 || strtod(text, NULL) == x)
        return x;
    double unit = pow(10.0, floor(log10(x)) - 3.0);
    return round(x / unit) * unit;
}

/* Whether the table has a row inside the ranges. */
static bool has_rows(struct choice *c, const struct plan_table *table)
{
    const struct scene *s = c->scene;
    char *why = c->why[0] == '\0' ? c->why : (char[SCENE_WHY_SIZE]){ 0 };
    if (choice_rows(s->range, table) > 0)
        return true;
    for (size_t i = 0; i < 3; i++) {
        const struct axis *axis = axis_of(table, i);
        struct scene_range r = s->range[i], whole = scene_whole_range(i);
        if (isnan(r.lo) || values_in(axis, r) > 0)
            continue;
        struct scene_range near = beside(axis, r);
        return none(c, refuse(STATUS_RANGE, why,
                              "no row of table '%s' has %s in %g..%g; the nearest are in "
                              "[%.4g, %.4g]: say that, build a table that has such rows, or want "
                              "`refined` without `nearest`",
                              table->name, skin_parameter_name(i), r.lo, r.hi,
                              fmax(outwards(near.lo, floor), whole.lo),
                              fmin(outwards(near.hi, ceil), whole.hi)));
    }
    return none(c, refuse(STATUS_RANGE, why,
                          "without melanin (Cm 0) the rows of table '%s' have Bm %g alone; widen "
                          "the range of Cm or Bm, or want `refined` without `nearest`",
                          table->name, table->recipe->grid.Bm.lo));
}

/* What only a fit can do is asked for. */
static bool says_fit(const struct scene *s)
{
    return s->fit != REFINE_NOT || s->no_dermis;
}

static void offer_table(struct choice *c, int index)
{
    const struct scene *s = c->scene;
    const struct plan_table *table = &c->at_hand->table[index];
    const struct model *model = table->recipe->model;
    enum match_by first = table->recipe->bands > 0 ? MATCH_SPECTRUM : MATCH_RGB;
    const enum match_by ways[] = { first, MATCH_RGB, MATCH_LAB, MATCH_DE2000, MATCH_SPECTRUM };
    if (s->model != NULL && s->model != model)
        return;
    for (size_t i = 0; i < (s->has_by ? 1u : sizeof ways / sizeof *ways); i++) {
        struct way w = { .table = index, .by = s->has_by ? s->by : ways[i], .model = model };
        if ((i > 0 && w.by == first) || (i > 0 && !c->asked) || !can_search(c, table, w.by))
            continue;
        bool rows = (!wants(s, SCENE_REFINED) && !says_fit(s)) || wants(s, SCENE_NEAREST);
        bool there = !rows || has_rows(c, table);
        if (there && !wants(s, SCENE_REFINED) && !says_fit(s))
            offer(c, &w);
        w.fits = true;
        bool fits =
            wants(s, SCENE_REFINED) || (wants(s, SCENE_COEFFICIENTS) && (c->asked || says_fit(s)));
        if ((there || !wants(s, SCENE_NEAREST)) && fits && can_fit(c, model, table->recipe))
            offer(c, &w);
    }
}

/* Without a table: the half space's closed form, and fits from there. */
static void offer_model(struct choice *c, const struct model *model)
{
    const struct scene *s = c->scene;
    struct way w = { .table = PLAN_NO_TABLE, .by = MATCH_SPECTRUM, .model = model };
    if ((s->model != NULL && s->model != model) || model->reflectance == NULL)
        return;
    const struct recipe recipe = recipe_default(model);
    if (model->quick == MODEL_QUICK_HALF_SPACE && !wants(s, SCENE_REFINED) && !says_fit(s) &&
        c->bands >= 3 && !scene_is_ranged(s))
        offer(c, &w);
    w.fits = true;
    if ((wants(s, SCENE_REFINED) || c->asked || says_fit(s)) && can_fit(c, model, &recipe))
        offer(c, &w);
}

static void offer_all(struct choice *c)
{
    const struct scene *s = c->scene;
    bool rows = s->start != SCENE_START_CLOSED_FORM || wants(s, SCENE_NEAREST);
    bool without = !wants(s, SCENE_NEAREST) && s->start != SCENE_START_ROWS && !s->has_by;
    for (size_t i = 0; rows && i < c->at_hand->tables; i++)
        offer_table(c, (int)i);
    if (!without)
        return;
    /* By default the model of the tables that are usual. */
    const struct model *usual = model_find("two-layer");
    offer_model(c, usual);
    for (size_t i = 0; i < MODEL_COUNT; i++)
        if (&model_list[i] != usual && (c->asked || s->model != NULL))
            offer_model(c, &model_list[i]);
}

/* ---- refused ------------------------------------------------------------------------ */

static void describe(const struct choice *c, const struct way *w, char *text, size_t size)
{
    const char *table = w->table == PLAN_NO_TABLE ? "" : c->at_hand->table[w->table].name;
    if (w->table == PLAN_NO_TABLE)
        snprintf(text, size, "%s, %s", w->model->name,
                 w->fits ? "fitted from the closed form" : "the closed form");
    else
        snprintf(text, size, "table '%s' by %s%s", table, match_by_name(w->by),
                 w->fits ? ", refined" : "");
}

static void list_errors(const struct scene *s, const struct plan_estimate *e, char *text,
                        size_t size)
{
    const double bound[] = { s->bound.coefficient[0], s->bound.coefficient[1],
                             s->bound.coefficient[2], s->bound.dE00, s->bound.rms };
    const double error[] = { e->coefficient[0], e->coefficient[1], e->coefficient[2], e->dE00,
                             e->rms };
    static const char *const names[] = { "Cm", "Bm", "Ch", "dE00", "rms" };
    size_t used = 0;
    text[0] = '\0';
    for (size_t i = 0; i < 5 && used < size; i++) {
        if (isnan(bound[i]))
            continue;
        int n = isnan(error[i]) ? snprintf(text + used, size - used, "%s%s not measured",
                                           used > 0 ? ", " : "", names[i])
                                : snprintf(text + used, size - used, "%s%s %.3g for %g",
                                           used > 0 ? ", " : "", names[i], error[i], bound[i]);
        used += n > 0 ? (size_t)n : 0;
    }
}

/* Whether what is bounded was not measured of the nearest way at all. */
static bool was_not_measured(const struct choice *c)
{
    const struct scene_bound *b = &c->scene->bound;
    const struct cost *cost = c->miss.cost;
    const double *error = c->scene->model != NULL ? cost->rmse : cost->rmse_transport;
    bool unknown = isinf(over(cost->dE00, b->dE00)) || isinf(over(cost->rms_R, b->rms));
    for (size_t i = 0; i < 3; i++)
        unknown = unknown || isinf(over(error[i], b->coefficient[i]));
    return unknown;
}

static enum status refuse_all(const struct choice *c, char *why)
{
    char way[96], errors[160];
    const struct scene *s = c->scene;
    if (c->any_miss) {
        describe(c, &c->miss, way, sizeof way);
        double us = c->miss.expected.us;
        if (!isnan(s->budget_us))
            return refuse(STATUS_RANGE, why,
                          "nothing at hand takes %g us or less; the quickest is %s, %.3g us; allow "
                          "as much, or want less",
                          s->budget_us, way, us);
        if (isinf(c->miss_score) && !was_not_measured(c))
            return refuse(STATUS_RANGE, why,
                          "how wrong %s is was measured under white noise of 0.003, on 31 bands, "
                          "with nothing held, and is not known otherwise; say `noise` 0.003 if so "
                          "it is, search by spectrum, or want `refined`",
                          way);
        list_errors(s, &c->miss.expected, errors, sizeof errors);
        return refuse(STATUS_RANGE, why,
                      "nothing at hand is as good as the error bound; the nearest is %s (%s) in "
                      "%.3g us; allow as much, or build a larger table",
                      way, errors, us);
    }
    if (c->status != STATUS_OK)
        return refuse(c->status, why, "%s", c->why);
    if (c->asked && !wants(s, SCENE_NEAREST))
        return refuse(STATUS_NOT_FOUND, why,
                      "neither error nor time of such a way was measured; leave bound and budget "
                      "out, or run `skinspec bench --calibrate`");
    return refuse(STATUS_NOT_FOUND, why,
                  "no table%s%s that does this is at hand; make one with `skinspec table build "
                  "--model %s`, or want `refined` without `nearest`",
                  s->model != NULL ? " of model " : "", s->model != NULL ? s->model->name : "",
                  s->model != NULL ? s->model->name : "two-layer");
}

/* ---- chosen ------------------------------------------------------------------------- */

struct recipe choice_recipe(const struct plan_at_hand *at_hand, const struct way *way)
{
    return way->table == PLAN_NO_TABLE ? recipe_default(way->model)
                                       : *at_hand->table[way->table].recipe;
}

enum status choice_make(const struct scene *scene, const struct plan_at_hand *at_hand,
                        struct choice *ret, char why[SCENE_WHY_SIZE])
{
    bool colour = wants(scene, SCENE_LAB | SCENE_RGB);
    *ret = (struct choice){ .scene = scene,
                            .at_hand = at_hand,
                            .asked = scene_is_bounded(scene) || !isnan(scene->budget_us),
                            .colour_us = colour ? PLAN_COLOUR_US : 0.0,
                            .best = { .table = PLAN_NO_TABLE } };
    enum status s = take_bands(ret, why);
    if (s == STATUS_OK)
        s = check_colour(ret, why);
    if (s != STATUS_OK)
        return s;
    if (scene_wants_skin(scene)) {
        offer_all(ret);
        if (ret->no_memory)
            return refuse(STATUS_NO_MEMORY, why, "%s", status_text(STATUS_NO_MEMORY));
        return ret->any ? STATUS_OK : refuse_all(ret, why);
    }
    if (!isnan(scene->budget_us) && ret->colour_us > scene->budget_us)
        return refuse(STATUS_RANGE, why,
                      "nothing at hand takes %g us or less; a colour takes %.3g us; allow as much",
                      scene->budget_us, ret->colour_us);
    return STATUS_OK;
}
