/* answer_recompute.c - what a record says, computed again from its spectra and compared. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "station/answer.h"
#include "station/answer_scene.h"
#include "station/strict_json.h"
#include "station/wire.h"

struct comparison {
    bool same;
    double difference;
};

/* Finite numbers that are equal have the same bits, but for the sign of 0, which the text
 * of a stored match does not keep; how a NAN is coded says nothing. */
static void compare(struct comparison *c, double stored, double now)
{
    if (stored == now || (isnan(stored) && isnan(now)))
        return;
    c->same = false;
    double relative = 1.0; /* a number on one side alone */
    if (!isnan(stored) && !isnan(now))
        relative = fabs(now - stored) / fmax(fabs(now), fabs(stored));
    c->difference = fmax(c->difference, relative);
}

/* Of a number that is small beside `scale` by its nature, as a residual beside 1. */
static void compare_beside(struct comparison *c, double stored, double now, double scale)
{
    struct comparison one = { true, 0.0 };
    compare(&one, stored, now);
    if (!isnan(stored) && !isnan(now))
        one.difference = fabs(now - stored) / fmax(scale, fmax(fabs(now), fabs(stored)));
    c->same = c->same && one.same;
    c->difference = fmax(c->difference, one.difference);
}

/* What has no measure of its own. */
static void compare_whole(struct comparison *c, bool same)
{
    c->same = c->same && same;
    c->difference = fmax(c->difference, same ? 0.0 : 1.0);
}

static void compare_colour(struct comparison *c, const struct store_record *stored,
                           const struct answer_colour *now)
{
    for (size_t i = 0; i < 3; i++) {
        compare(c, stored->XYZ[i], now->XYZ[i]);
        compare(c, stored->Lab[i], now->Lab[i]);
        compare(c, stored->sRGB[i], now->sRGB[i]);
    }
    compare(c, stored->ITA, now->ITA);
}

static void compare_match(struct comparison *c, const struct match *stored, const struct match *now)
{
    const struct table_row *a = &stored->row, *b = &now->row;
    compare_whole(c, stored->flags == now->flags);
    compare_whole(c, a->Cm == b->Cm && a->Bm == b->Bm && a->Ch == b->Ch); /* else another row */
    for (size_t i = 0; i < 3; i++)
        compare(c, a->Lab[i], b->Lab[i]);
    compare(c, stored->dE00, now->dE00);
    compare(c, stored->rms, now->rms);
    compare(c, stored->distance, now->distance);
}

static void compare_skins(struct comparison *c, const struct refined *stored,
                          const struct refined *now)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        compare(c, stored->value[i], now->value[i]);
        compare(c, stored->se[i], now->se[i]);
        compare(c, stored->repeat_se[i], now->repeat_se[i]);
        compare(c, stored->lo[i], now->lo[i]);
        compare(c, stored->hi[i], now->hi[i]);
    }
    for (size_t i = 0; i < SKIN_PARAMETERS && stored->has_second && now->has_second; i++)
        compare(c, stored->second[i], now->second[i]);
    if (stored->has_second && now->has_second)
        compare(c, stored->second_chi_square, now->second_chi_square);
}

/* Both as they were read from their objects: what is not told is NAN in both. */
static void compare_refined(struct comparison *c, const struct refined_match *stored,
                            const struct refined_match *now)
{
    const struct refined *a = &stored->refined, *b = &now->refined;
    compare_whole(c, a->flags == b->flags && a->degrees == b->degrees && a->bands == b->bands &&
                         a->has_second == b->has_second && stored->source == now->source &&
                         stored->nearest.row_index == now->nearest.row_index);
    compare_skins(c, a, b);
    for (size_t i = 0; i < 3; i++)
        compare(c, stored->Lab[i], now->Lab[i]);
    compare(c, a->dE00, b->dE00);
    compare(c, a->rms, b->rms);
    compare(c, a->chi_square, b->chi_square);
    compare(c, a->chi_square_p, b->chi_square_p);
    compare(c, a->noise.white, b->noise.white);
    compare(c, a->noise.placement, b->noise.placement);
    for (size_t i = 0; i < a->bands && i < b->bands; i++)
        compare_beside(c, a->residual[i], b->residual[i], 1.0);
}

static enum status read_stored(const char *text, cJSON **object, struct wire_match *ret)
{
    enum strict_json_fault fault;
    enum status s = strict_json_parse(text, strlen(text), object, &fault, NULL);
    return s == STATUS_OK ? wire_read_match(*object, ret) : s;
}

/* Both matches are given away, whatever happens. */
static enum status make_result(const char *id, const struct comparison *c, cJSON *stored,
                               cJSON *recomputed, cJSON **ret)
{
    cJSON *result = cJSON_CreateObject();
    bool good = cJSON_AddStringToObject(result, "id", id) != NULL &&
                cJSON_AddBoolToObject(result, "same_bits", c->same) != NULL &&
                cJSON_AddNumberToObject(result, "difference", c->difference) != NULL;
    if (good && cJSON_AddItemToObject(result, "stored", stored))
        stored = NULL;
    if (good && cJSON_AddItemToObject(result, "recomputed", recomputed))
        recomputed = NULL;
    if (stored == NULL && recomputed == NULL) {
        *ret = result;
        return STATUS_OK;
    }
    cJSON_Delete(stored);
    cJSON_Delete(recomputed);
    cJSON_Delete(result);
    return STATUS_NO_MEMORY;
}

/* Every number and text of one tree against the other's, but for `skip`, a member of both. */
static void compare_trees(struct comparison *c, const cJSON *stored, const cJSON *now,
                          const char *skip)
{
    if (cJSON_IsNumber(stored) && cJSON_IsNumber(now)) {
        compare(c, stored->valuedouble, now->valuedouble);
        return;
    }
    if (!cJSON_IsObject(stored) && !cJSON_IsArray(stored)) {
        compare_whole(c, cJSON_Compare(stored, now, true));
        return;
    }
    compare_whole(c, stored->type == now->type &&
                         cJSON_GetArraySize(stored) == cJSON_GetArraySize(now));
    bool named = cJSON_IsObject(stored);
    const cJSON *other = now->child;
    for (const cJSON *one = stored->child; one != NULL; one = one->next) {
        const cJSON *same = named ? strict_json_member(now, one->string) : other;
        other = other != NULL ? other->next : NULL;
        if (named && skip != NULL && strcmp(one->string, skip) == 0)
            continue;
        compare_whole(c, same != NULL);
        if (same != NULL)
            compare_trees(c, one, same, NULL);
    }
}

/* What was found then, and what is found now, as objects. */
struct both {
    cJSON *before, *after;
};

static enum status find_again(struct loaded_table *table, const struct store_record *record,
                              struct comparison *c, struct both *ret)
{
    struct wire_match stored;
    struct match now;
    struct nearest_hit hit;
    enum status s = read_stored(record->match_json, &ret->before, &stored);
    if (s == STATUS_OK)
        s = answer_find(table, stored.match.by, 1, &record->spectrum, &hit, &now);
    if (s == STATUS_OK)
        s = wire_match(loaded_table(table), &now, &hit, 0, &ret->after);
    if (s == STATUS_OK)
        compare_match(c, &stored.match, &now);
    return s;
}

static enum status refine_again(struct loaded_table *table, const struct store_record *record,
                                struct comparison *c, struct both *ret)
{
    struct wire_match stored, now;
    struct refined_match match;
    struct nearest_hit hits[REFINE_STARTS];
    const char *why;
    enum status s = read_stored(record->refined_json, &ret->before, &stored);
    if (s == STATUS_OK && !stored.is_refined)
        s = STATUS_FORMAT;
    if (s == STATUS_OK)
        s = answer_fit(table, stored.match.by, &stored.refined.wish, 0, hits, record, &match, &why);
    if (s == STATUS_OK)
        s = wire_refined_match(loaded_table(table), &match, hits, 0, &ret->after);
    if (s == STATUS_OK)
        s = wire_read_match(ret->after, &now);
    if (s == STATUS_OK)
        compare_refined(c, &stored.refined, &now.refined);
    return s;
}

/* The scene that was settled then: it chooses nothing anew.  The plan itself is not compared: what
 * it takes may change where the answer does not. */
static enum status plan_again(struct loaded_table *table, const struct store_record *record,
                              struct comparison *c, struct both *ret)
{
    struct store_record *copy = malloc(sizeof *copy);
    char why[SCENE_WHY_SIZE];
    struct scene scene;
    enum status s = copy != NULL ? answer_scene_of(ret->before, &scene) : STATUS_NO_MEMORY;
    if (s == STATUS_OK) {
        *copy = *record;
        scene.k = 1; /* rows are not stored */
        s = answer_scene(table, &scene, true, copy, &ret->after, why);
    }
    cJSON_Delete(ret->after);
    ret->after = NULL;
    if (s == STATUS_OK) {
        const char *text = copy->refined_json[0] != '\0' ? copy->refined_json : copy->match_json;
        enum strict_json_fault fault;
        s = strict_json_parse(text, strlen(text), &ret->after, &fault, NULL);
    }
    if (s == STATUS_OK)
        compare_trees(c, ret->before, ret->after, "plan");
    free(copy);
    return s;
}

/* Whether the record's match was made by a scene; *stored then has it. */
static bool has_plan(const struct store_record *record, cJSON **stored)
{
    const char *text = record->refined_json[0] != '\0' ? record->refined_json : record->match_json;
    enum strict_json_fault fault;
    if (strict_json_parse(text, strlen(text), stored, &fault, NULL) != STATUS_OK)
        return false;
    if (answer_has_scene(*stored))
        return true;
    cJSON_Delete(*stored);
    *stored = NULL;
    return false;
}

static void forget(struct both *both)
{
    cJSON_Delete(both->before);
    cJSON_Delete(both->after);
    *both = (struct both){ NULL, NULL };
}

enum status answer_recompute(struct answer_weights *weights, struct loaded_table *table,
                             const struct store_record *record, cJSON **ret)
{
    struct comparison comparison = { true, 0.0 };
    struct both both = { NULL, NULL };
    struct answer_colour colour;
    bool planned = has_plan(record, &both.before);
    enum status s = planned ? plan_again(table, record, &comparison, &both)
                            : find_again(table, record, &comparison, &both);
    if (s == STATUS_OK && !planned && record->refined_json[0] != '\0') {
        forget(&both);
        s = refine_again(table, record, &comparison, &both);
    }
    if (s != STATUS_OK) {
        forget(&both);
        return s;
    }
    (void)answer_colour_of(weights, &record->spectrum, &colour);
    compare_colour(&comparison, record, &colour);
    return make_result(record->id, &comparison, both.before, both.after, ret);
}
