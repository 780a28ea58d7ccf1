/* wire_scene.c - scenes, plans and what came of them, as objects. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "colour/srgb.h"
#include "json/maker.h"
#include "station/strict_json.h"
#include "station/wire.h"

/* ---- a scene read ------------------------------------------------------------------- */

/* Members one by one; the first fault stays. */
struct reading {
    const cJSON *object;
    bool failed;
    char *why;
};

__attribute__((format(printf, 2, 3))) static void fault(struct reading *r, const char *format, ...)
{
    va_list arguments;
    if (r->failed)
        return;
    va_start(arguments, format);
    vsnprintf(r->why, SCENE_WHY_SIZE, format, arguments);
    va_end(arguments);
    r->failed = true;
}

/* Members that an object may have; `of` names it. */
static void known_members(struct reading *r, const cJSON *object, const char *const *names,
                          size_t n, const char *of)
{
    char echo[STRICT_JSON_ECHO_SIZE], list[160] = "";
    const cJSON *member;
    for (size_t i = 0; i < n; i++) {
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", used > 0 ? ", " : "", names[i]);
    }
    cJSON_ArrayForEach(member, object)
    {
        size_t i = 0;
        while (i < n && strcmp(names[i], member->string) != 0)
            i++;
        if (i == n)
            fault(r, "%s is no member of %s; there are %s", strict_json_echo(member->string, echo),
                  of, list);
    }
}

/* STATUS_OK, or why[] and the fault. */
static const char *text_of(struct reading *r, const char *name)
{
    const cJSON *value = strict_json_member(r->object, name);
    if (value != NULL && !cJSON_IsString(value))
        fault(r, "`%s` must be a text", name);
    return cJSON_GetStringValue(value);
}

static double number_of(struct reading *r, const cJSON *object, const char *name)
{
    const cJSON *value = strict_json_member(object, name);
    if (value == NULL)
        return NAN;
    if (!cJSON_IsNumber(value) || !isfinite(value->valuedouble))
        fault(r, "`%s` must be a number", name);
    return cJSON_IsNumber(value) ? value->valuedouble : (double)NAN;
}

static void read_want(struct reading *r, struct scene *s)
{
    const cJSON *want = strict_json_member(r->object, "want"), *one;
    char echo[STRICT_JSON_ECHO_SIZE];
    if (!cJSON_IsArray(want))
        fault(r, "`want` must be a list of lab, rgb, coefficients, nearest, refined, interval");
    cJSON_ArrayForEach(one, want)
    {
        const char *text = cJSON_GetStringValue(one);
        size_t i = 0;
        while (i < SCENE_WANTS && (text == NULL || strcmp(scene_want_name(i), text) != 0))
            i++;
        if (i < SCENE_WANTS)
            s->wanted |= 1u << i;
        else
            fault(r,
                  "%s cannot be wanted; there are lab, rgb, coefficients, nearest, refined, "
                  "interval",
                  strict_json_echo(text != NULL ? text : "", echo));
    }
}

static void read_light(struct reading *r, struct scene *s)
{
    char echo[STRICT_JSON_ECHO_SIZE];
    if (cJSON_IsNumber(strict_json_member(r->object, "observer")))
        fault(r, "`observer` must be a text: say \"2\" or \"10\", in quotes");
    const char *illuminant = text_of(r, "illuminant"), *observer = text_of(r, "observer");
    if (illuminant != NULL && illuminant_parse(illuminant, &s->illuminant) != STATUS_OK)
        fault(r, "there is no illuminant %s; take D65, A, D50 or another of the CIE's",
              strict_json_echo(illuminant, echo));
    if (observer != NULL && observer_parse(observer, &s->observer) != STATUS_OK)
        fault(r, "there is no observer %s; take 2 or 10", strict_json_echo(observer, echo));
}

static void read_way(struct reading *r, struct scene *s)
{
    const char *model = text_of(r, "model"), *by = text_of(r, "by"), *fit = text_of(r, "fit"),
               *start = text_of(r, "start");
    char echo[STRICT_JSON_ECHO_SIZE];
    s->model = model != NULL ? model_find(model) : NULL;
    if (model != NULL && s->model == NULL)
        fault(r,
              "there is no model %s; take two-layer, half-space or another of `skinspec table "
              "build --help`",
              strict_json_echo(model, echo));
    for (int i = MATCH_RGB; by != NULL && i <= MATCH_SPECTRUM; i++) {
        if (strcmp(by, match_by_name((enum match_by)i)) != 0)
            continue;
        s->by = (enum match_by)i;
        s->has_by = true;
    }
    if (by != NULL && !s->has_by)
        fault(r, "`by` is %s; it must be rgb, rgb-float, lab, de2000 or spectrum",
              strict_json_echo(by, echo));
    if (fit != NULL && refine_kind_parse(fit, &s->fit) != STATUS_OK)
        fault(r, "`fit` is %s; it must be three or skin", strict_json_echo(fit, echo));
    for (int i = SCENE_START_ROWS; start != NULL && i <= SCENE_START_CLOSED_FORM; i++)
        if (strcmp(start, scene_start_name((enum scene_start)i)) == 0)
            s->start = (enum scene_start)i;
    if (start != NULL && s->start == SCENE_START_ANY)
        fault(r, "`start` is %s; it must be rows or closed-form", strict_json_echo(start, echo));
}

static void read_k(struct reading *r, struct scene *s)
{
    double k = number_of(r, r->object, "k");
    if (isnan(k))
        return;
    if (!(k >= 1.0 && k <= SCENE_MAX_K && k == floor(k)))
        fault(r, "`k` must be a whole number, 1..%d", (int)SCENE_MAX_K);
    else
        s->k = (size_t)k;
}

/* A number: held there; a pair: a range. */
static void read_range(struct reading *r, size_t i, struct scene_range *range)
{
    const char *name = skin_parameter_name(i);
    const cJSON *value = strict_json_member(r->object, name);
    const cJSON *lo = cJSON_GetArrayItem(value, 0), *hi = cJSON_GetArrayItem(value, 1);
    if (value == NULL)
        return;
    if (cJSON_IsNumber(value))
        range->lo = range->hi = value->valuedouble;
    else if (cJSON_IsArray(value) && cJSON_GetArraySize(value) == 2 && cJSON_IsNumber(lo) &&
             cJSON_IsNumber(hi))
        *range = (struct scene_range){ lo->valuedouble, hi->valuedouble };
    else
        fault(r, "`%s` must be a number, which holds it, or [from, to]", name);
}

static void read_bands(struct reading *r, struct scene *s)
{
    static const char *const names[] = { "first_nm", "last_nm", "step_nm" };
    const cJSON *bands = strict_json_member(r->object, "bands");
    if (bands == NULL)
        return;
    if (!cJSON_IsObject(bands) || bands->child == NULL)
        fault(r, "`bands` must be an object with first_nm, last_nm and step_nm");
    known_members(r, bands, names, 3, "`bands`");
    s->first_nm = number_of(r, bands, "first_nm");
    s->last_nm = number_of(r, bands, "last_nm");
    s->step_nm = number_of(r, bands, "step_nm");
}

static void read_error(struct reading *r, struct scene *s)
{
    static const char *const names[] = { "Cm", "Bm", "Ch", "dE00", "rms" };
    const cJSON *error = strict_json_member(r->object, "error");
    if (error == NULL)
        return;
    if (!cJSON_IsObject(error) || error->child == NULL)
        fault(r, "`error` must be an object with one or more of Cm, Bm, Ch, dE00, rms");
    known_members(r, error, names, 5, "`error`");
    for (size_t i = 0; i < 3; i++)
        s->bound.coefficient[i] = number_of(r, error, names[i]);
    s->bound.dE00 = number_of(r, error, "dE00");
    s->bound.rms = number_of(r, error, "rms");
}

enum status wire_read_kept_scene(const cJSON *object, struct scene *ret, char why[SCENE_WHY_SIZE])
{
    static const char *const names[] = { "want",  "illuminant", "observer", "model", "by",
                                         "k",     "fit",        "start",    "Cm",    "Bm",
                                         "Ch",    "bands",      "dermis",   "noise", "placement",
                                         "error", "budget_us" };
    struct reading r = { object, false, why };
    struct scene s = scene_empty();
    const cJSON *dermis = strict_json_member(object, "dermis");
    if (!cJSON_IsObject(object))
        fault(&r, "a scene is an object: {\"want\": [\"lab\"]}");
    known_members(&r, object, names, sizeof names / sizeof *names, "a scene");
    read_want(&r, &s);
    read_light(&r, &s);
    read_way(&r, &s);
    read_k(&r, &s);
    for (size_t i = 0; i < 3; i++)
        read_range(&r, i, &s.range[i]);
    read_bands(&r, &s);
    if (dermis != NULL && !cJSON_IsBool(dermis))
        fault(&r, "`dermis` must be true or false");
    s.no_dermis = cJSON_IsFalse(dermis);
    s.white = number_of(&r, object, "noise");
    s.placement = number_of(&r, object, "placement");
    read_error(&r, &s);
    s.budget_us = number_of(&r, object, "budget_us");
    if (r.failed)
        return STATUS_FORMAT;
    enum status status = scene_check(&s, why);
    if (status == STATUS_OK)
        *ret = s;
    return status;
}

enum status wire_read_scene(const cJSON *object, struct scene *ret, char why[SCENE_WHY_SIZE])
{
    struct scene s;
    enum status status = wire_read_kept_scene(object, &s, why);
    if (status == STATUS_OK)
        status = scene_check_use(&s, why);
    if (status == STATUS_OK)
        *ret = s;
    return status;
}

/* ---- a scene told ------------------------------------------------------------------- */

static void put_range(struct maker *m, const struct scene *s, size_t i)
{
    const double pair[] = { s->range[i].lo, s->range[i].hi };
    if (scene_is_held(s, i))
        maker_number(m, skin_parameter_name(i), pair[0]);
    else if (!isnan(pair[0]))
        maker_numbers(m, skin_parameter_name(i), pair, 2);
}

static void put_wanted(struct maker *m, unsigned wanted)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < SCENE_WANTS; i++)
        if (wanted & 1u << i)
            maker_append(&array, STATUS_OK, cJSON_CreateString(scene_want_name(i)));
    maker_nested(m, "want", &array);
}

static void put_errors(struct maker *m, const struct scene *s)
{
    struct maker error = maker_begin();
    if (!scene_is_bounded(s)) {
        cJSON_Delete(error.object);
        return;
    }
    for (size_t i = 0; i < 3; i++)
        maker_known_number(&error, skin_parameter_name(i), s->bound.coefficient[i]);
    maker_known_number(&error, "dE00", s->bound.dE00);
    maker_known_number(&error, "rms", s->bound.rms);
    maker_nested(m, "error", &error);
}

enum status wire_scene(const struct scene *s, cJSON **ret)
{
    struct maker m = maker_begin();
    put_wanted(&m, s->wanted);
    maker_text(&m, "illuminant", illuminant_name(s->illuminant));
    maker_text(&m, "observer", observer_name(s->observer));
    if (s->model != NULL)
        maker_text(&m, "model", s->model->name);
    if (s->has_by)
        maker_text(&m, "by", match_by_name(s->by));
    if (s->k > 1)
        maker_number(&m, "k", (double)s->k);
    maker_known_text(&m, "fit", refine_kind_name(s->fit));
    maker_known_text(&m, "start", scene_start_name(s->start));
    for (size_t i = 0; i < 3; i++)
        put_range(&m, s, i);
    if (!isnan(s->first_nm)) {
        struct maker bands = maker_begin();
        maker_number(&bands, "first_nm", s->first_nm);
        maker_number(&bands, "last_nm", s->last_nm);
        maker_number(&bands, "step_nm", s->step_nm);
        maker_nested(&m, "bands", &bands);
    }
    if (s->no_dermis)
        maker_put(&m, "dermis", cJSON_CreateFalse());
    maker_known_number(&m, "noise", s->white);
    maker_known_number(&m, "placement", s->placement);
    put_errors(&m, s);
    maker_known_number(&m, "budget_us", s->budget_us);
    return maker_end(&m, ret);
}

/* ---- a plan ------------------------------------------------------------------------- */

static void put_left_out(struct maker *m, const struct plan *plan)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < plan->omissions; i++) {
        struct maker one = maker_begin();
        char words[PLAN_WORDS_SIZE];
        cJSON *made = NULL;
        plan_omission_words(plan, i, words);
        maker_text(&one, "what", plan_part_name(plan->omission[i].part));
        maker_text(&one, "why", words);
        enum status s = maker_end(&one, &made);
        maker_append(&array, s, made);
    }
    maker_nested(m, "left_out", &array);
}

static void put_estimate(struct maker *m, const struct plan_estimate *e)
{
    struct maker object = maker_begin();
    maker_known_number(&object, "us", e->us);
    maker_known_number(&object, "us_p95", e->us_p95);
    for (size_t i = 0; i < 3; i++)
        maker_known_number(&object, skin_parameter_name(i), e->coefficient[i]);
    maker_known_number(&object, "dE00", e->dE00);
    maker_known_number(&object, "rms", e->rms);
    maker_known_number(&object, "noise", e->white);
    maker_known_number(&object, "placement", e->placement);
    maker_nested(m, "estimated", &object);
}

static void put_work(struct maker *m, const struct plan_work *w)
{
    struct maker object = maker_begin();
    maker_number(&object, "colours", (double)w->colours);
    maker_number(&object, "rows", (double)w->rows);
    maker_number(&object, "judged", (double)w->judged);
    maker_number(&object, "bytes", (double)w->bytes);
    maker_number(&object, "evaluations", (double)w->evaluations);
    maker_number(&object, "derivatives", (double)w->derivatives);
    maker_nested(m, "work", &object);
}

enum status wire_plan(const struct plan *plan, const struct plan_work *work, double us, cJSON **ret)
{
    struct maker m = maker_begin(), array = maker_begin_array();
    cJSON *scene = NULL;
    for (int part = 0; part < PLAN_PARTS_RUN; part++)
        if (plan_runs(plan, (enum plan_part)part))
            maker_append(&array, STATUS_OK,
                         cJSON_CreateString(plan_part_name((enum plan_part)part)));
    maker_nested(&m, "ran", &array);
    put_left_out(&m, plan);
    put_estimate(&m, &plan->estimated);
    maker_known_number(&m, "us", us);
    if (work != NULL)
        put_work(&m, work);
    enum status s = wire_scene(&plan->scene, &scene);
    maker_made(&m, "scene", s, scene);
    return maker_end(&m, ret);
}

/* ---- what came of it ---------------------------------------------------------------- */

static void put_colour(struct maker *m, const struct plan *plan, const struct plan_answer *a)
{
    struct maker colour = maker_begin();
    if ((plan->scene.wanted & SCENE_LAB) != 0)
        maker_numbers(&colour, "Lab", a->Lab, 3);
    if ((plan->scene.wanted & SCENE_RGB) != 0) {
        int code[3];
        (void)srgb_code(a->rgb, code);
        maker_numbers(&colour, "sRGB", (double[3]){ code[0], code[1], code[2] }, 3);
    }
    maker_text(&colour, "illuminant", illuminant_name(plan->scene.illuminant));
    maker_text(&colour, "observer", observer_name(plan->scene.observer));
    maker_nested(m, "colour", &colour);
}

/* All members of one object into another, which is then empty. */
static void move_members(struct maker *m, enum status s, cJSON *made)
{
    if (s != STATUS_OK)
        maker_fail(m, s);
    while (s == STATUS_OK && made->child != NULL) {
        cJSON *member = cJSON_DetachItemViaPointer(made, made->child);
        char name[64];
        snprintf(name, sizeof name, "%s", member->string);
        maker_put(m, name, member);
    }
    if (s == STATUS_OK)
        cJSON_Delete(made);
}

static void put_refined(struct maker *m, const struct plan *plan, const struct table *table,
                        const struct plan_answer *a, const struct nearest_hit *hits, size_t k)
{
    struct refined_match match = {
        .nearest = a->nearest, .wish = plan->wish, .refined = a->refined, .source = a->source
    };
    cJSON *made = NULL;
    memcpy(match.Lab, a->fitted_Lab, sizeof match.Lab);
    enum status s = a->has_nearest ? wire_refined_match(table, &match, hits, k, &made)
                                   : wire_refined_fit(plan->scene.model, &match, &made);
    move_members(m, s, made);
}

enum status wire_plan_answer(const struct plan *plan, const struct table *table,
                             const struct plan_answer *a, const struct nearest_hit *hits, size_t k,
                             cJSON **ret)
{
    struct maker m = maker_begin();
    cJSON *made = NULL;
    if (a->has_colour)
        put_colour(&m, plan, a);
    if (a->has_refined) {
        put_refined(&m, plan, table, a, hits, k);
    } else if (a->has_nearest) {
        enum status s = wire_match(table, &a->nearest, hits, k, &made);
        move_members(&m, s, made);
    } else if (a->has_coefficients) {
        for (size_t i = 0; i < 3; i++)
            maker_number(&m, skin_parameter_name(i), a->coefficient[i]);
        maker_text(&m, "model", plan->scene.model->name);
    }
    return maker_end(&m, ret);
}
