/* answer_scene.c - the planner's answers in the shape of the protocol. */
#include "station/answer_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "json/print.h"
#include "plan/plan_run.h"
#include "station/answer.h"
#include "station/strict_json.h"
#include "station/wire.h"

/* One on its way. */
struct scene_answer {
    struct plan plan;
    const struct table *rows; /* NULL: no table is searched */
    struct plan_answer answer;
    struct plan_work work;
    double us;
    struct nearest_hit hits[SCENE_MAX_K];
};

static const struct costs *measured_costs; /* NULL: none of this machine */

void answer_scene_costs(const struct costs *costs)
{
    measured_costs = costs;
}

static double now_us(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* A record keeps what was found in a table, so of ways that do as well those that search one are
 * left. */
static struct scene for_record(const struct scene *scene)
{
    struct scene s = *scene;
    bool may_do_without = scene_wants_skin(scene) && (scene->wanted & SCENE_NEAREST) == 0;
    if (may_do_without && s.start == SCENE_START_ANY)
        s.start = SCENE_START_ROWS;
    return s;
}

/* Where it is for the record's sake that a scene cannot be had, that is said before the rest. */
static void tell_for_record(const struct scene *scene, const struct plan_at_hand *hand,
                            char why[SCENE_WHY_SIZE])
{
    struct plan plan;
    char rest[SCENE_WHY_SIZE], unused[SCENE_WHY_SIZE];
    if (plan_make(scene, hand, &plan, unused) != STATUS_OK)
        return;
    strcpy(rest, why);
    snprintf(why, SCENE_WHY_SIZE, "a record needs a way that searches a table: %.*s",
             SCENE_WHY_SIZE - 64, rest);
}

/* keep: for a record. */
static enum status make_plan(struct loaded_table *table, const struct scene *scene, bool keep,
                             double first_nm, double step_nm, size_t bands, struct plan *ret,
                             char why[SCENE_WHY_SIZE])
{
    const struct table *rows = table != NULL ? loaded_table(table) : NULL;
    struct plan_table one = { "", NULL, 0 };
    if (rows != NULL)
        one = (struct plan_table){ rows->name, &rows->recipe, rows->n };
    const struct costs *costs = measured_costs != NULL ? measured_costs : costs_builtin();
    struct plan_at_hand hand = { costs, &one, rows != NULL ? 1 : 0, first_nm, step_nm, bands };
    const struct scene kept = keep ? for_record(scene) : *scene;
    enum status s = plan_make(&kept, &hand, ret, why);
    if (s != STATUS_OK && kept.start != scene->start)
        tell_for_record(scene, &hand, why);
    if (s != STATUS_OK || !keep || plan_runs(ret, PLAN_SEARCH))
        return s;
    snprintf(why, SCENE_WHY_SIZE,
             "a record keeps what was found in a table, and this scene searches none; want "
             "`nearest` too%s",
             scene->start == SCENE_START_CLOSED_FORM ? ", or leave `start` out" : "");
    return STATUS_RANGE;
}

/* Colours alone: a record has its own, and they are the answer. */
static enum status check_colours(const struct scene *scene, double first_nm, double step_nm,
                                 size_t bands, char why[SCENE_WHY_SIZE])
{
    struct plan plan;
    const struct scene usual = scene_empty();
    enum status s = make_plan(NULL, scene, false, first_nm, step_nm, bands, &plan, why);
    if (s != STATUS_OK || (scene->illuminant == usual.illuminant &&
                           scene->observer == usual.observer && isnan(scene->first_nm)))
        return s;
    snprintf(why, SCENE_WHY_SIZE,
             "where colours alone are wanted a record has those of all bands under %s and %s "
             "degrees; want `nearest` too, which keeps the scene's, or leave `illuminant`, "
             "`observer` and `bands` out",
             illuminant_name(usual.illuminant), observer_name(usual.observer));
    return STATUS_RANGE;
}

enum status answer_scene_check(struct loaded_table *table, const struct scene *scene,
                               double first_nm, double step_nm, size_t bands,
                               char why[SCENE_WHY_SIZE])
{
    struct plan plan;
    if (!scene_wants_skin(scene))
        return check_colours(scene, first_nm, step_nm, bands, why);
    return make_plan(table, scene, true, first_nm, step_nm, bands, &plan, why);
}

static enum status run(struct loaded_table *table, const struct store_record *record,
                       struct scene_answer *a, const char **what)
{
    const struct matcher *matcher = NULL;
    struct plan_runner *runner = NULL;
    struct spectrum *replicate = NULL;
    size_t n = 0;
    enum status s = STATUS_OK;
    if (plan_runs(&a->plan, PLAN_SEARCH)) {
        a->rows = loaded_table(table);
        s = loaded_matcher(table, a->plan.scene.by, &matcher);
    }
    if (s == STATUS_OK)
        s = plan_open(&a->plan, matcher, &runner, what);
    if (s == STATUS_OK)
        s = answer_replicates(record, &replicate, &n);
    double begun = now_us();
    if (s == STATUS_OK)
        s = plan_run(runner, replicate, n, &record->spectrum, a->hits, &a->answer, &a->work, what);
    a->us = now_us() - begun;
    free(replicate);
    plan_close(runner);
    return s;
}

static enum status make_object(const struct scene_answer *a, size_t k, double us, cJSON **ret)
{
    cJSON *object = NULL, *plan = NULL;
    enum status s = wire_plan_answer(&a->plan, a->rows, &a->answer, a->hits, k, &object);
    if (s == STATUS_OK)
        s = wire_plan(&a->plan, &a->work, us, &plan);
    if (s == STATUS_OK && !cJSON_AddItemToObject(object, "plan", plan))
        s = STATUS_NO_MEMORY;
    if (s == STATUS_OK) {
        *ret = object;
        return s;
    }
    cJSON_Delete(object);
    cJSON_Delete(plan);
    return s;
}

static enum status print_into(cJSON *object, char *into, size_t size)
{
    char *text = NULL;
    enum status s = json_print(object, size - 1, &text, NULL);
    if (s == STATUS_OK)
        strcpy(into, text);
    free(text);
    return s;
}

/* A refined one has its nearest row beside it, as every record has. */
static enum status keep_answer(const struct scene_answer *a, struct store_record *record)
{
    cJSON *object = NULL, *row = NULL;
    enum status s = make_object(a, 0, NAN, &object);
    bool refined = a->answer.has_refined;
    if (s == STATUS_OK && refined)
        s = wire_match(a->rows, &a->answer.nearest, a->hits, 0, &row);
    if (s == STATUS_OK)
        s = print_into(refined ? row : object, record->match_json, sizeof record->match_json);
    if (s == STATUS_OK && refined)
        s = print_into(object, record->refined_json, sizeof record->refined_json);
    cJSON_Delete(row);
    cJSON_Delete(object);
    if (s != STATUS_OK) {
        record->match_json[0] = record->refined_json[0] = '\0';
        return s;
    }
    strcpy(record->table_name, a->rows->name);
    strcpy(record->table_sha256, a->rows->sha256);
    strcpy(record->method, match_by_name(a->plan.scene.by));
    return s;
}

enum status answer_scene(struct loaded_table *table, const struct scene *scene, bool keep,
                         struct store_record *record, cJSON **ret, char why[SCENE_WHY_SIZE])
{
    const char *what = NULL;
    cJSON *object = NULL;
    why[0] = '\0';
    struct scene_answer *a = calloc(1, sizeof *a);
    if (a == NULL)
        return STATUS_NO_MEMORY;
    const struct spectrum *spectrum = &record->spectrum;
    enum status s = make_plan(table, scene, keep, spectrum->first_nm, spectrum->step_nm,
                              spectrum->n, &a->plan, why);
    if (s == STATUS_OK)
        s = run(table, record, a, &what);
    if (s != STATUS_OK && what != NULL)
        snprintf(why, SCENE_WHY_SIZE, "%s", what);
    bool lists = (a->plan.scene.wanted & SCENE_NEAREST) != 0;
    if (s == STATUS_OK)
        s = make_object(a, lists ? a->plan.scene.k : 0, a->us, &object);
    if (s == STATUS_OK && keep)
        s = keep_answer(a, record);
    free(a);
    if (s == STATUS_OK)
        *ret = object;
    else
        cJSON_Delete(object);
    return s;
}

bool answer_has_scene(const cJSON *match)
{
    return strict_json_member(match, "plan") != NULL;
}

enum status answer_scene_of(const cJSON *match, struct scene *ret)
{
    char why[SCENE_WHY_SIZE];
    return wire_read_kept_scene(strict_json_member(strict_json_member(match, "plan"), "scene"), ret,
                                why) == STATUS_OK
               ? STATUS_OK
               : STATUS_FORMAT;
}
