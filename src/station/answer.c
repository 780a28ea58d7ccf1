/* answer.c - one way to colour and match, for new records and for recomputed ones. */
#include "station/answer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "json/print.h"
#include "station/strict_json.h"
#include "station/wire.h"

enum { QUICK_MAX_K = 32 };

/* ---- colour ------------------------------------------------------------------------- */

struct colour {
    double XYZ[3], Lab[3], ITA;
    int sRGB[3];
};

/* NULL where the bands give no colour. */
static const struct xyz_weights *weights_of(struct answer_weights *w, const struct spectrum *s)
{
    if (w->n != s->n || w->first_nm != s->first_nm || w->step_nm != s->step_nm) {
        w->first_nm = s->first_nm;
        w->step_nm = s->step_nm;
        w->n = s->n;
        w->usable = xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, s->first_nm, s->step_nm, s->n,
                                     &w->weights) == STATUS_OK;
    }
    return w->usable ? &w->weights : NULL;
}

/* False, with numbers that say so, where there is none: bands that do not do, or one of
 * them not measured. */
static bool colour_of(struct answer_weights *w, const struct spectrum *s, struct colour *ret)
{
    const struct xyz_weights *weights = weights_of(w, s);
    double linear[3];
    *ret = (struct colour){ { NAN, NAN, NAN }, { NAN, NAN, NAN }, NAN, { 0, 0, 0 } };
    if (weights == NULL)
        return false;
    xyz_from_reflectance(weights, s->value, ret->XYZ);
    lab_from_xyz(ret->XYZ, weights->white, ret->Lab);
    ret->ITA = lab_ita_deg(ret->Lab);
    srgb_linear_from_xyz(ret->XYZ, weights->white, linear);
    srgb_code(linear, ret->sRGB);
    return !isnan(ret->XYZ[0] + ret->XYZ[1] + ret->XYZ[2]);
}

void answer_colour(struct answer_weights *weights, struct store_record *record)
{
    struct colour colour;
    bool known = colour_of(weights, &record->spectrum, &colour);
    memcpy(record->XYZ, colour.XYZ, sizeof record->XYZ);
    memcpy(record->Lab, colour.Lab, sizeof record->Lab);
    memcpy(record->sRGB, colour.sRGB, sizeof record->sRGB);
    record->ITA = colour.ITA;
    strcpy(record->ita_scheme, known ? LAB_ITA_SCHEME : "");
    strcpy(record->illuminant, illuminant_name(ILLUMINANT_D65));
    strcpy(record->observer, observer_name(OBSERVER_10DEG));
}

/* ---- match -------------------------------------------------------------------------- */

bool answer_is_quick(struct loaded_table *table, enum match_by by, size_t k)
{
    return by != MATCH_DE2000 && k <= QUICK_MAX_K && loaded_matcher_is_made(table, by);
}

static enum status find(struct loaded_table *table, enum match_by by, size_t k,
                        const struct spectrum *spectrum, struct nearest_hit *hits,
                        struct match *ret)
{
    const struct matcher *matcher;
    enum status s = loaded_matcher(table, by, &matcher);
    return s == STATUS_OK ? matcher_match(matcher, spectrum, k > 0 ? k : 1, hits, ret) : s;
}

enum status answer_match(struct loaded_table *table, enum match_by by, size_t k,
                         struct nearest_hit *hits, struct store_record *record, cJSON **ret)
{
    const struct table *rows = loaded_table(table);
    struct match match;
    cJSON *kept = NULL, *reply = NULL;
    char *text = NULL;
    enum status s = find(table, by, k, &record->spectrum, hits, &match);
    if (s == STATUS_OK)
        s = wire_match(rows, &match, hits, 0, &kept);
    if (s == STATUS_OK)
        s = json_print(kept, sizeof record->match_json - 1, &text, NULL);
    if (s == STATUS_OK && ret != NULL)
        s = wire_match(rows, &match, hits, k, &reply);
    if (s == STATUS_OK) {
        strcpy(record->table_name, rows->name);
        strcpy(record->table_sha256, rows->sha256);
        strcpy(record->method, match_by_name(by));
        strcpy(record->match_json, text);
        if (ret != NULL)
            *ret = reply;
    }
    cJSON_Delete(kept);
    free(text);
    return s;
}

/* ---- both again --------------------------------------------------------------------- */

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

/* What has no measure of its own. */
static void compare_whole(struct comparison *c, bool same)
{
    c->same = c->same && same;
    c->difference = fmax(c->difference, same ? 0.0 : 1.0);
}

static void compare_colour(struct comparison *c, const struct store_record *stored,
                           const struct colour *now)
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

static enum status read_stored(const struct store_record *record, cJSON **object,
                               struct wire_match *ret)
{
    enum strict_json_fault fault;
    enum status s =
        strict_json_parse(record->match_json, strlen(record->match_json), object, &fault, NULL);
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

enum status answer_recompute(struct answer_weights *weights, struct loaded_table *table,
                             const struct store_record *record, cJSON **ret)
{
    struct comparison comparison = { true, 0.0 };
    struct wire_match stored;
    struct match now;
    struct nearest_hit hit;
    struct colour colour;
    cJSON *before = NULL, *after = NULL;
    enum status s = read_stored(record, &before, &stored);
    if (s == STATUS_OK)
        s = find(table, stored.match.by, 1, &record->spectrum, &hit, &now);
    if (s == STATUS_OK)
        s = wire_match(loaded_table(table), &now, &hit, 0, &after);
    if (s != STATUS_OK) {
        cJSON_Delete(before);
        return s;
    }
    colour_of(weights, &record->spectrum, &colour);
    compare_colour(&comparison, record, &colour);
    compare_match(&comparison, &stored.match, &now);
    return make_result(record->id, &comparison, before, after, ret);
}
