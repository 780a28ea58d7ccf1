/* plan.c - what is chosen, written down with what it leaves out. */
#include "plan/plan.h"

#include <math.h>
#include <stdio.h>

#include "optics/opaque.h"
#include "plan/plan_choice.h"

static bool wants(const struct scene *scene, unsigned what)
{
    return (scene->wanted & what) != 0;
}

static void leave_out(struct plan *p, enum plan_part part, enum plan_reason reason, double x,
                      double y)
{
    p->omission[p->omissions++] = (struct plan_omission){ part, reason, x, y };
}

static void run(struct plan *p, enum plan_part part)
{
    p->run |= 1u << part;
}

static void plan_colour(struct plan *p)
{
    if (wants(&p->scene, SCENE_LAB | SCENE_RGB))
        run(p, PLAN_COLOUR);
    else
        leave_out(p, PLAN_COLOUR, PLAN_NOT_WANTED, NAN, NAN);
}

static void plan_bands(const struct choice *c, struct plan *p)
{
    size_t given = c->at_hand->bands;
    p->first_nm = c->first_nm;
    p->step_nm = c->step_nm;
    p->first = c->first;
    p->every = c->every;
    p->bands = c->bands;
    p->given_first_nm = c->at_hand->first_nm;
    p->given_step_nm = c->at_hand->step_nm;
    p->given_bands = given;
    if (p->bands < given)
        leave_out(p, PLAN_BANDS, PLAN_NOT_IN_SCENE, (double)(given - p->bands), (double)given);
}

static void plan_search(const struct choice *c, const struct way *w, struct plan *p)
{
    p->table = w->table;
    if (w->table == PLAN_NO_TABLE) {
        enum plan_reason why = !scene_wants_skin(c->scene) ? PLAN_NOT_WANTED
                               : c->asked                  ? PLAN_MEETS_WITHOUT
                                                           : PLAN_NO_ROWS_WANTED;
        leave_out(p, PLAN_TABLE, PLAN_NO_ROWS_WANTED, NAN, NAN);
        leave_out(p, PLAN_SEARCH, why, NAN, NAN);
        return;
    }
    const struct plan_table *table = &c->at_hand->table[w->table];
    run(p, PLAN_TABLE);
    run(p, PLAN_SEARCH);
    p->scene.has_by = true;
    p->scene.by = w->by;
    p->k = w->fits && p->scene.k < REFINE_STARTS ? (size_t)REFINE_STARTS : p->scene.k;
    bool beside = choice_searched(c->scene, w, table, p->searched);
    p->rows = choice_rows(p->searched, table);
    if (w->by == MATCH_SPECTRUM)
        run(p, PLAN_SPECTRA);
    else if (table->recipe->bands > 0)
        leave_out(p, PLAN_SPECTRA, PLAN_BY_COLOUR, NAN, NAN);
    if (p->rows < table->rows)
        leave_out(p, PLAN_ROWS, beside ? PLAN_NOT_BESIDE : PLAN_OUT_OF_RANGE,
                  (double)(table->rows - p->rows), (double)table->rows);
}

/* What the fit holds needs no derivatives; one pigment alone needs no other. */
static void plan_held(struct plan *p)
{
    static const enum plan_part by[] = { PLAN_BY_CM, PLAN_BY_BM, PLAN_BY_CH };
    double Bm = p->fit.role[SKIN_BM].value;
    for (size_t i = 0; i < 3; i++)
        if (!p->fit.role[i].free)
            leave_out(p, by[i], PLAN_HELD, p->fit.role[i].value, NAN);
    if (!p->fit.role[SKIN_BM].free && (Bm == 0.0 || Bm == 1.0))
        leave_out(p, Bm == 1.0 ? PLAN_PHEOMELANIN : PLAN_EUMELANIN, PLAN_OTHER_MELANIN, Bm, NAN);
}

/* What was measured was measured with a dermis. */
static void estimate_opaque(struct plan_estimate *e, double most)
{
    bool small = most <= e->rms; /* not of NAN */
    e->rms += most;
    if (!(e->rms <= 1.0))
        e->rms = NAN;
    if (small)
        return;
    e->dE00 = NAN;
    for (size_t i = 0; i < 3; i++)
        e->coefficient[i] = NAN;
}

/* Whether an error of the reflectance is all that is bounded. */
static bool bounds_rms_alone(const struct scene_bound *b)
{
    return !isnan(b->rms) && isnan(b->dE00) && isnan(b->coefficient[SKIN_CM]) &&
           isnan(b->coefficient[SKIN_BM]) && isnan(b->coefficient[SKIN_CH]);
}

/* Where the epidermis lets next to nothing through, whatever the skin: the dermis is not looked
 * at, and Ch, of which nothing is seen, is held in the middle of its range.  That is the fit's
 * matter: rows have a dermis, and are searched wherever the scene says. */
static void plan_dermis(const struct choice *c, const struct recipe *recipe, struct plan *p)
{
    struct scene *s = &p->scene;
    struct scene_range Cm = scene_range_of(s, SKIN_CM), Bm = scene_range_of(s, SKIN_BM);
    double value[SKIN_PARAMETERS], most = NAN, known = p->estimated.rms;
    const char *ignored;
    if (c->best.model->quick != MODEL_QUICK_TWO_LAYER || p->wish.kind == REFINE_SKIN ||
        !(s->no_dermis || bounds_rms_alone(&c->scene->bound)) ||
        !(p->fit.role[SKIN_CM].free || p->fit.role[SKIN_BM].free))
        return;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = p->fit.role[i].value;
    value[SKIN_CM] = Cm.lo;
    value[SKIN_BM] = Bm.lo;
    struct tissue lightest = fit_tissue(&p->fit, value);
    /* Bands that no model takes are refused where the fit is opened. */
    if (opaque_most(&lightest, Bm.hi, c->first_nm, c->step_nm, c->bands, &most) != STATUS_OK)
        return;
    if (!s->no_dermis && !(most <= c->scene->bound.rms - (isnan(known) ? 0.0 : known)))
        return;
    leave_out(p, PLAN_DERMIS, s->no_dermis ? PLAN_AS_SAID : PLAN_OPAQUE, most, c->scene->bound.rms);
    struct scene_range Ch = scene_range_of(s, SKIN_CH);
    double held = scene_is_held(s, SKIN_CH) ? Ch.lo : sqrt(Ch.lo * Ch.hi);
    s->no_dermis = true;
    p->wish.fix[SKIN_CH] = held;
    (void)choice_fit(s, &p->wish, recipe, &p->fit, &ignored); /* as before, less Ch */
    p->fit.model = &opaque_model;
    estimate_opaque(&p->estimated, most);
}

static enum status plan_fit(const struct choice *c, struct plan *p, char why[SCENE_WHY_SIZE])
{
    const struct recipe recipe = choice_recipe(c->at_hand, &c->best);
    const char *what = NULL;
    struct scene *s = &p->scene;
    p->wish = choice_wish(s);
    enum status status = choice_fit(s, &p->wish, &recipe, &p->fit, &what);
    if (status != STATUS_OK) {
        (void)snprintf(why, SCENE_WHY_SIZE, "%s", what != NULL ? what : status_text(status));
        return status;
    }
    plan_dermis(c, &recipe, p);
    run(p, PLAN_FIT);
    plan_held(p);
    s->wanted |= SCENE_REFINED;
    s->fit = p->wish.kind;
    s->start = c->best.table == PLAN_NO_TABLE || s->start == SCENE_START_CLOSED_FORM
                   ? SCENE_START_CLOSED_FORM
                   : SCENE_START_ROWS;
    if (wants(s, SCENE_INTERVAL)) {
        p->run |= 1u << PLAN_COVARIANCE | 1u << PLAN_INTERVALS | 1u << PLAN_SECOND;
        p->want |= REFINE_INTERVALS | REFINE_SECOND;
    } else {
        leave_out(p, PLAN_COVARIANCE, PLAN_NO_INTERVAL, NAN, NAN);
        leave_out(p, PLAN_INTERVALS, PLAN_NO_INTERVAL, NAN, NAN);
        leave_out(p, PLAN_SECOND, PLAN_NO_INTERVAL, NAN, NAN);
        p->want |= REFINE_NO_SE;
    }
    if (wants(s, SCENE_LAB)) {
        run(p, PLAN_FITTED_COLOUR);
        p->want |= REFINE_COLOUR;
    } else {
        leave_out(p, PLAN_FITTED_COLOUR, PLAN_NOT_WANTED, NAN, NAN);
    }
    return STATUS_OK;
}

/* Nothing is fitted: a row, or the closed form, or no skin at all. */
static enum status plan_no_fit(const struct choice *c, struct plan *p, char why[SCENE_WHY_SIZE])
{
    const char *what = NULL;
    struct scene *s = &p->scene;
    bool skin = scene_wants_skin(s);
    leave_out(p, PLAN_FIT, skin && c->asked ? PLAN_MEETS_WITHOUT : PLAN_NOT_WANTED, NAN, NAN);
    leave_out(p, PLAN_COVARIANCE, PLAN_NOTHING_FITTED, NAN, NAN);
    if (!skin)
        return STATUS_OK;
    if (c->best.table != PLAN_NO_TABLE) {
        s->wanted |= SCENE_NEAREST;
        return STATUS_OK;
    }
    const struct recipe recipe = choice_recipe(c->at_hand, &c->best);
    run(p, PLAN_CLOSED_FORM);
    s->start = SCENE_START_CLOSED_FORM;
    p->wish = choice_wish(s);
    enum status status = choice_fit(s, &p->wish, &recipe, &p->fit, &what);
    if (status != STATUS_OK)
        (void)snprintf(why, SCENE_WHY_SIZE, "%s", what != NULL ? what : status_text(status));
    return status;
}

static void estimate(const struct choice *c, struct plan *p)
{
    p->estimated = (struct plan_estimate){ NAN, NAN, { NAN, NAN, NAN }, NAN, NAN, NAN, NAN };
    if (!scene_wants_skin(c->scene))
        p->estimated.us = c->colour_us;
    else
        p->estimated = c->best.expected;
    for (size_t i = 0; i < 3; i++)
        if (scene_is_held(c->scene, i))
            p->estimated.coefficient[i] = NAN;
}

enum status plan_make(const struct scene *scene, const struct plan_at_hand *at_hand,
                      struct plan *ret, char why[SCENE_WHY_SIZE])
{
    struct choice c;
    enum status s = scene_check(scene, why);
    if (s == STATUS_OK)
        s = choice_make(scene, at_hand, &c, why);
    if (s != STATUS_OK)
        return s;
    static const struct scene_range any = { NAN, NAN };
    struct plan p = { .scene = *scene, .table = PLAN_NO_TABLE, .searched = { any, any, any } };
    p.scene.bound = scene_empty().bound;
    p.scene.budget_us = NAN;
    estimate(&c, &p);
    plan_bands(&c, &p);
    plan_colour(&p);
    plan_search(&c, &c.best, &p);
    if (scene_wants_skin(scene))
        p.scene.model = c.best.model;
    s = c.best.fits ? plan_fit(&c, &p, why) : plan_no_fit(&c, &p, why);
    if (s == STATUS_OK)
        *ret = p;
    return s;
}
