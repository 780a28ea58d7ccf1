/* answer.c - one way to colour, match and refine, for new records and for recomputed ones. */
#include "station/answer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "json/print.h"
#include "station/quality.h"
#include "station/wire.h"

enum { QUICK_MAX_K = 32 };

/* ---- colour ------------------------------------------------------------------------- */

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

bool answer_colour_of(struct answer_weights *w, const struct spectrum *s, struct answer_colour *ret)
{
    const struct xyz_weights *weights = weights_of(w, s);
    double linear[3];
    *ret = (struct answer_colour){ { NAN, NAN, NAN }, { NAN, NAN, NAN }, NAN, { 0, 0, 0 } };
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
    struct answer_colour colour;
    bool known = answer_colour_of(weights, &record->spectrum, &colour);
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

enum status answer_find(struct loaded_table *table, enum match_by by, size_t k,
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
    enum status s = answer_find(table, by, k, &record->spectrum, hits, &match);
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

/* ---- refined ------------------------------------------------------------------------ */

/* One replicate as it is fitted: SCE. */
static enum status settle(const struct store_record *record, struct spectrum *replicate)
{
    if (isnan(record->surface))
        return STATUS_OK;
    replicate->specular = SPECULAR_SCI;
    return spectrum_remove_surface(replicate, record->surface, NULL);
}

enum status answer_replicates(const struct store_record *record, struct spectrum **ret, size_t *n)
{
    const struct spectrum *all = isnan(record->surface) ? record->replicate : record->replicate_sci;
    double a_star[QUALITY_MAX_REPLICATES];
    struct quality_set set = { .kept = 1 };
    bool one = record->replicates == 0 || all[0].n == 0;
    enum status s = STATUS_OK;
    for (size_t i = 0; i < QUALITY_MAX_REPLICATES; i++)
        a_star[i] = NAN; /* redness is for the operator: it leaves nothing out */
    if (!one)
        s = quality_of_set(all, a_star, record->replicates, &set);
    struct spectrum *kept = s == STATUS_OK ? malloc(set.kept * sizeof *kept) : NULL;
    if (kept == NULL)
        return s == STATUS_OK ? STATUS_NO_MEMORY : s;
    *n = 0;
    if (one)
        kept[(*n)++] = record->spectrum;
    for (size_t i = 0; !one && i < record->replicates && s == STATUS_OK; i++) {
        if (set.left_out[i])
            continue;
        kept[*n] = all[i];
        s = settle(record, &kept[(*n)++]);
    }
    if (s == STATUS_OK)
        *ret = kept;
    else
        free(kept);
    return s;
}

static enum status fit(const struct matcher *matcher, const struct refine_wish *wish, size_t k,
                       struct nearest_hit *hits, const struct store_record *record,
                       const struct spectrum *replicate, size_t n, struct refined_match *ret,
                       const char **why)
{
    const struct spectrum *mean = &record->spectrum;
    struct refiner *refiner = NULL;
    struct fit wished;
    enum status s = refine_wish_fit(wish, &matcher->table->recipe, &wished, why);
    if (s == STATUS_OK)
        s = refiner_open(&wished, mean->first_nm, mean->step_nm, mean->n, &refiner, why);
    if (s == STATUS_OK)
        s = refined_match(matcher, refiner, wish, replicate, n, mean, k, hits, ret, why);
    refiner_close(refiner);
    return s;
}

enum status answer_fit(struct loaded_table *table, enum match_by by, const struct refine_wish *wish,
                       size_t k, struct nearest_hit *hits, const struct store_record *record,
                       struct refined_match *ret, const char **why)
{
    const struct matcher *matcher;
    struct spectrum *replicate = NULL;
    size_t n = 0;
    *why = NULL;
    enum status s = loaded_matcher(table, by, &matcher);
    if (s == STATUS_OK)
        s = answer_replicates(record, &replicate, &n);
    if (s == STATUS_OK)
        s = fit(matcher, wish, k, hits, record, replicate, n, ret, why);
    free(replicate);
    return s;
}

enum status answer_refine(struct loaded_table *table, enum match_by by,
                          const struct refine_wish *wish, size_t k, struct nearest_hit *hits,
                          struct store_record *record, cJSON **ret, const char **why)
{
    const struct table *rows = loaded_table(table);
    struct refined_match match;
    cJSON *kept = NULL, *reply = NULL;
    char *text = NULL;
    enum status s = answer_fit(table, by, wish, k, hits, record, &match, why);
    if (s == STATUS_OK)
        s = wire_refined_match(rows, &match, hits, 0, &kept);
    if (s == STATUS_OK)
        s = json_print(kept, sizeof record->refined_json - 1, &text, NULL);
    if (s == STATUS_OK && ret != NULL)
        s = wire_refined_match(rows, &match, hits, k, &reply);
    if (s == STATUS_OK)
        strcpy(record->refined_json, text);
    if (s == STATUS_OK && ret != NULL)
        *ret = reply;
    cJSON_Delete(kept);
    free(text);
    return s;
}
