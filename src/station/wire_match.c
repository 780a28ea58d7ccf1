/* wire_match.c - the match object: the nearest row, or the refined skin beside it. */
#include "station/wire.h"

#include <math.h>
#include <string.h>

#include "json/maker.h"
#include "json/taker.h"

/* ---- the nearest row ---------------------------------------------------------------- */

static enum status make_hit(const struct table *table, const struct nearest_hit *hit, cJSON **ret)
{
    struct maker m = maker_begin();
    struct table_row row;
    table_get(table, hit->row, &row);
    maker_number(&m, "row", (double)hit->row + 1.0);
    maker_number(&m, "Cm", row.Cm);
    maker_number(&m, "Bm", row.Bm);
    maker_number(&m, "Ch", row.Ch);
    maker_number(&m, "distance", hit->distance);
    return maker_end(&m, ret);
}

static void put_hits(struct maker *m, const char *name, const struct table *table,
                     const struct nearest_hit *hits, size_t n)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < n; i++) {
        cJSON *hit = NULL;
        enum status s = make_hit(table, &hits[i], &hit);
        maker_append(&array, s, hit);
    }
    maker_nested(m, name, &array);
}

static void put_tokens(struct maker *m, unsigned flags, const char *(*name)(size_t i), size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (flags & 1u << i)
            maker_append(m, STATUS_OK, cJSON_CreateString(name(i)));
}

static void put_match_flags(struct maker *m, unsigned flags)
{
    struct maker array = maker_begin_array();
    put_tokens(&array, flags, match_flag_name, MATCH_FLAG_COUNT);
    maker_nested(m, "flags", &array);
}

static void put_row(struct maker *m, const struct match *match)
{
    maker_number(m, "Cm", match->row.Cm);
    maker_number(m, "Bm", match->row.Bm);
    maker_number(m, "Ch", match->row.Ch);
    maker_number(m, "L", match->row.Lab[0]);
    maker_number(m, "a", match->row.Lab[1]);
    maker_number(m, "b", match->row.Lab[2]);
    maker_known_number(m, "dE00", match->dE00);
    maker_known_number(m, "rms", match->rms);
    maker_number(m, "distance", match->distance);
}

static void put_table(struct maker *m, const struct table *table, enum match_by by)
{
    maker_text(m, "by", match_by_name(by));
    maker_text(m, "table", table->name);
    maker_text(m, "table_sha256", table->sha256);
}

enum status wire_match(const struct table *table, const struct match *match,
                       const struct nearest_hit *hits, size_t k, cJSON **ret)
{
    struct maker m = maker_begin();
    put_row(&m, match);
    put_table(&m, table, match->by);
    if (k > 0)
        put_hits(&m, "nearest", table, hits, k < match->found ? k : match->found);
    put_match_flags(&m, match->flags);
    return maker_end(&m, ret);
}

/* ---- the refined skin --------------------------------------------------------------- */

enum { THREE = 1 << SKIN_CM | 1 << SKIN_BM | 1 << SKIN_CH, ALL = (1 << SKIN_PARAMETERS) - 1 };

/* What is told of a skin: of the fit of three the rest is the table's. */
static unsigned told(enum refine_kind kind)
{
    return kind == REFINE_THREE ? THREE : ALL;
}

/* One parameter into an object: a number, or a pair. */
typedef void put_parameter(struct maker *m, const char *name, const struct refined *r, size_t i);

static void put_value(struct maker *m, const char *name, const struct refined *r, size_t i)
{
    maker_number(m, name, r->value[i]);
}

static void put_second_value(struct maker *m, const char *name, const struct refined *r, size_t i)
{
    maker_number(m, name, r->second[i]);
}

static void put_se(struct maker *m, const char *name, const struct refined *r, size_t i)
{
    maker_number(m, name, r->se[i]);
}

static void put_repeat_se(struct maker *m, const char *name, const struct refined *r, size_t i)
{
    maker_number(m, name, r->repeat_se[i]);
}

static void put_interval(struct maker *m, const char *name, const struct refined *r, size_t i)
{
    const double pair[] = { r->lo[i], r->hi[i] };
    maker_numbers(m, name, pair, 2);
}

/* Those of `bits`, the two of scattering in an object of their own. */
static void put_skin(struct maker *m, const struct refined *r, unsigned bits, put_parameter *put)
{
    struct maker scattering = maker_begin();
    cJSON *made = NULL;
    for (size_t i = 0; i < SKIN_SCATTERING_A; i++)
        if (bits & 1u << i)
            put(m, skin_parameter_name(i), r, i);
    if (bits & 1u << SKIN_SCATTERING_A)
        put(&scattering, "a", r, SKIN_SCATTERING_A);
    if (bits & 1u << SKIN_SCATTERING_B)
        put(&scattering, "b", r, SKIN_SCATTERING_B);
    enum status s = maker_end(&scattering, &made);
    if (s == STATUS_OK && made->child == NULL)
        cJSON_Delete(made);
    else
        maker_made(m, "scattering", s, made);
}

static void put_skin_object(struct maker *m, const char *name, const struct refined *r,
                            unsigned bits, put_parameter *put)
{
    struct maker object = maker_begin();
    put_skin(&object, r, bits, put);
    maker_nested(m, name, &object);
}

static void put_second(struct maker *m, const struct refined_match *match)
{
    struct maker object = maker_begin();
    put_skin(&object, &match->refined, told(match->wish.kind), put_second_value);
    maker_number(&object, "chi_square", match->refined.second_chi_square);
    maker_nested(m, "second", &object);
}

static void put_fixed(struct maker *m, const struct refine_wish *wish)
{
    struct maker object = maker_begin();
    bool any = false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        any = any || !isnan(wish->fix[i]);
        maker_known_number(&object, skin_parameter_name(i), wish->fix[i]);
    }
    if (any)
        maker_nested(m, "fixed", &object);
    else
        cJSON_Delete(object.object);
}

static void put_noise(struct maker *m, const struct refined_match *match)
{
    struct maker object = maker_begin();
    maker_number(&object, "white", match->refined.noise.white);
    maker_number(&object, "placement", match->refined.noise.placement);
    maker_text(&object, "from", noise_source_name(match->source));
    maker_nested(m, "noise", &object);
}

static void put_residual(struct maker *m, const struct refined *r)
{
    struct maker object = maker_begin();
    maker_number(&object, "first_nm", r->first_nm);
    maker_number(&object, "step_nm", r->step_nm);
    maker_numbers(&object, "values", r->residual, r->bands);
    maker_nested(m, "residual", &object);
}

/* Whether standard errors were computed. */
static bool has_errors(const struct refined *r)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if ((r->free & 1u << i) != 0 && isnan(r->se[i]))
            return false;
    return true;
}

static void put_fit(struct maker *m, const struct refined_match *match)
{
    const struct refined *r = &match->refined;
    if (has_errors(r)) {
        put_skin_object(m, "se", r, r->free, put_se);
        put_skin_object(m, "repeat_se", r, r->free, put_repeat_se);
        put_skin_object(m, "interval", r, r->free, put_interval);
    }
    maker_number(m, "chi_square", r->chi_square);
    maker_number(m, "degrees", (double)r->degrees);
    if (r->degrees > 0)
        maker_number(m, "p", r->chi_square_p);
    put_noise(m, match);
    put_residual(m, r);
    if (r->has_second)
        put_second(m, match);
}

static void put_start(struct maker *m, const struct table *table, const struct match *nearest,
                      const struct nearest_hit *hits, size_t k)
{
    struct maker object = maker_begin();
    maker_number(&object, "row", (double)nearest->row_index + 1.0);
    put_row(&object, nearest);
    if (k > 0)
        put_hits(&object, "rows", table, hits, k < nearest->found ? k : nearest->found);
    put_match_flags(&object, nearest->flags);
    maker_nested(m, "nearest", &object);
}

static void put_words(struct maker *m, const struct refined *r)
{
    struct maker array = maker_begin_array();
    const char *words;
    for (size_t i = 0; (words = refine_words(r, i)) != NULL; i++)
        maker_append(&array, STATUS_OK, cJSON_CreateString(words));
    maker_nested(m, "words", &array);
}

/* Of the row's flags those that are about the spectrum. */
static void put_refined_flags(struct maker *m, const struct refined_match *match)
{
    struct maker array = maker_begin_array();
    put_tokens(&array, match->refined.flags, refine_flag_name, REFINE_FLAG_COUNT);
    put_tokens(&array, match->nearest.flags & (MATCH_NO_COLOUR | MATCH_BANDS_ZEROED),
               match_flag_name, MATCH_FLAG_COUNT);
    maker_nested(m, "flags", &array);
}

static enum status make_refined(const struct model *model, const struct table *table,
                                const struct refined_match *match, const struct nearest_hit *hits,
                                size_t k, cJSON **ret)
{
    const struct refined *r = &match->refined;
    struct maker m = maker_begin();
    put_skin(&m, r, told(match->wish.kind), put_value);
    maker_known_number(&m, "L", match->Lab[0]);
    maker_known_number(&m, "a", match->Lab[1]);
    maker_known_number(&m, "b", match->Lab[2]);
    maker_known_number(&m, "dE00", r->dE00);
    maker_number(&m, "rms", r->rms);
    if (table != NULL)
        put_table(&m, table, match->nearest.by);
    maker_text(&m, "refine", refine_kind_name(match->wish.kind));
    maker_text(&m, "model", model->name);
    put_fixed(&m, &match->wish);
    put_fit(&m, match);
    if (table != NULL)
        put_start(&m, table, &match->nearest, hits, k);
    put_words(&m, r);
    put_refined_flags(&m, match);
    return maker_end(&m, ret);
}

enum status wire_refined_match(const struct table *table, const struct refined_match *match,
                               const struct nearest_hit *hits, size_t k, cJSON **ret)
{
    return make_refined(table->recipe.model, table, match, hits, k, ret);
}

enum status wire_refined_fit(const struct model *model, const struct refined_match *match,
                             cJSON **ret)
{
    return make_refined(model, NULL, match, NULL, 0, ret);
}

/* ---- read --------------------------------------------------------------------------- */

static enum match_by get_by(struct taker *t)
{
    static const enum match_by ways[] = { MATCH_RGB, MATCH_RGB_FLOAT, MATCH_LAB, MATCH_DE2000,
                                          MATCH_SPECTRUM };
    char name[16] = "";
    taker_text(t, "by", name, sizeof name);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++)
        if (strcmp(name, match_by_name(ways[i])) == 0)
            return ways[i];
    t->failed = true;
    return MATCH_RGB;
}

static unsigned get_tokens(const struct taker *t, const char *(*name)(size_t i), size_t n)
{
    unsigned flags = 0;
    const cJSON *one;
    cJSON_ArrayForEach(one, taker_member(t, "flags"))
    {
        for (size_t i = 0; i < n; i++)
            if (cJSON_IsString(one) && strcmp(one->valuestring, name(i)) == 0)
                flags |= 1u << i;
    }
    return flags;
}

/* All but how it was found. */
static void take_row(struct taker *t, struct match *match)
{
    match->row.Cm = taker_number(t, "Cm");
    match->row.Bm = taker_number(t, "Bm");
    match->row.Ch = taker_number(t, "Ch");
    match->row.Lab[0] = taker_number(t, "L");
    match->row.Lab[1] = taker_number(t, "a");
    match->row.Lab[2] = taker_number(t, "b");
    match->row.rgb[0] = match->row.rgb[1] = match->row.rgb[2] = NAN;
    match->dE00 = taker_known_number(t, "dE00");
    match->rms = taker_known_number(t, "rms");
    match->distance = taker_number(t, "distance");
    match->flags = get_tokens(t, match_flag_name, MATCH_FLAG_COUNT);
}

static void take_row_number(struct taker *t, struct match *match)
{
    int64_t row = taker_integer(t, "row");
    t->failed = t->failed || row < 1;
    match->row_index = row > 0 ? (size_t)row - 1 : 0;
}

/* Numbers of a skin that are there, the others NAN; [n][2] for pairs. */
static void take_skin(struct taker *t, double value[SKIN_PARAMETERS])
{
    struct taker scattering = { taker_member(t, "scattering"), false };
    for (size_t i = 0; i < SKIN_SCATTERING_A; i++)
        value[i] = taker_known_number(t, skin_parameter_name(i));
    value[SKIN_SCATTERING_A] = taker_known_number(&scattering, "a");
    value[SKIN_SCATTERING_B] = taker_known_number(&scattering, "b");
    t->failed = t->failed || scattering.failed;
}

static void take_pair(struct taker *t, const char *name, double *lo, double *hi)
{
    double pair[2] = { NAN, NAN };
    if (taker_member(t, name) != NULL)
        t->failed = taker_numbers(t, name, pair, 2) != 2 || t->failed;
    *lo = pair[0];
    *hi = pair[1];
}

static void take_intervals(struct taker *t, struct refined *r)
{
    struct taker all = { taker_member(t, "interval"), false };
    struct taker scattering = { taker_member(&all, "scattering"), false };
    for (size_t i = 0; i < SKIN_SCATTERING_A; i++)
        take_pair(&all, skin_parameter_name(i), &r->lo[i], &r->hi[i]);
    take_pair(&scattering, "a", &r->lo[SKIN_SCATTERING_A], &r->hi[SKIN_SCATTERING_A]);
    take_pair(&scattering, "b", &r->lo[SKIN_SCATTERING_B], &r->hi[SKIN_SCATTERING_B]);
    bool may_be_absent = taker_member(t, "plan") != NULL; /* it was not wanted */
    t->failed =
        t->failed || (all.object == NULL && !may_be_absent) || all.failed || scattering.failed;
}

static void take_errors(struct taker *t, struct refined *r)
{
    struct taker se = { taker_member(t, "se"), false };
    take_skin(&se, r->se);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        r->free |= isnan(r->se[i]) ? 0u : 1u << i;
    struct taker again = { taker_member(t, "repeat_se"), false };
    take_skin(&again, r->repeat_se);
    bool may_be_absent = taker_member(t, "plan") != NULL; /* they were not wanted */
    t->failed = t->failed || (se.object == NULL && !may_be_absent) || se.failed || again.failed;
}

/* What was asked: a size of noise that was found out is found out again. */
static void take_noise(struct taker *t, struct refined_match *match)
{
    struct taker noise = { taker_member(t, "noise"), false };
    char from[16] = "";
    match->refined.noise.white = taker_number(&noise, "white");
    match->refined.noise.placement = taker_number(&noise, "placement");
    taker_text(&noise, "from", from, sizeof from);
    size_t source = 0;
    while (source < NOISE_SOURCES &&
           strcmp(from, noise_source_name((enum noise_source)source)) != 0)
        source++;
    t->failed = t->failed || noise.failed || source == NOISE_SOURCES;
    match->source = source < NOISE_SOURCES ? (enum noise_source)source : NOISE_STATED;
    if (match->source == NOISE_STATED) {
        match->wish.white = match->refined.noise.white;
        match->wish.placement = match->refined.noise.placement;
    }
}

static void take_residual(struct taker *t, struct refined *r)
{
    struct taker residual = { taker_member(t, "residual"), false };
    r->first_nm = taker_number(&residual, "first_nm");
    r->step_nm = taker_number(&residual, "step_nm");
    r->bands = taker_numbers(&residual, "values", r->residual, SPECTRUM_MAX_BANDS);
    t->failed = t->failed || residual.failed;
}

static void take_second(struct taker *t, struct refined *r)
{
    struct taker second = { taker_member(t, "second"), false };
    r->has_second = second.object != NULL;
    if (!r->has_second)
        return;
    take_skin(&second, r->second);
    r->second_chi_square = taker_number(&second, "chi_square");
    t->failed = t->failed || second.failed;
}

static void take_fixed(const struct taker *t, struct refine_wish *wish)
{
    struct taker fixed = { taker_member(t, "fixed"), false };
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        wish->fix[i] = taker_known_number(&fixed, skin_parameter_name(i));
}

static void take_refined(struct taker *t, struct refined_match *match)
{
    struct refined *r = &match->refined;
    struct taker nearest = { taker_member(t, "nearest"), false };
    char kind[16] = "";
    match->wish = refine_wish_none();
    taker_text(t, "refine", kind, sizeof kind);
    t->failed = refine_kind_parse(kind, &match->wish.kind) != STATUS_OK || t->failed;
    take_fixed(t, &match->wish);
    take_skin(t, r->value);
    take_errors(t, r);
    take_intervals(t, r);
    take_noise(t, match);
    take_residual(t, r);
    take_second(t, r);
    match->Lab[0] = taker_known_number(t, "L");
    match->Lab[1] = taker_known_number(t, "a");
    match->Lab[2] = taker_known_number(t, "b");
    r->dE00 = taker_known_number(t, "dE00");
    r->rms = taker_number(t, "rms");
    r->chi_square = taker_number(t, "chi_square");
    int64_t degrees = taker_integer(t, "degrees");
    t->failed = t->failed || degrees < 0;
    r->degrees = degrees > 0 ? (size_t)degrees : 0;
    r->chi_square_p = r->degrees > 0 ? taker_number(t, "p") : 1.0;
    r->flags = get_tokens(t, refine_flag_name, REFINE_FLAG_COUNT);
    take_row(&nearest, &match->nearest);
    take_row_number(&nearest, &match->nearest);
    t->failed = t->failed || nearest.failed;
}

enum status wire_read_match(const cJSON *object, struct wire_match *ret)
{
    struct taker t = { object, false };
    struct wire_match m = { .is_refined = false };
    const cJSON *nearest = taker_member(&t, "nearest");
    m.is_refined = taker_member(&t, "refine") != NULL;
    if (m.is_refined) {
        take_refined(&t, &m.refined);
        m.match = m.refined.nearest;
    } else {
        take_row(&t, &m.match);
    }
    m.match.by = m.refined.nearest.by = get_by(&t);
    taker_text(&t, "table", m.table, sizeof m.table);
    taker_text(&t, "table_sha256", m.table_sha256, sizeof m.table_sha256);
    if (!m.is_refined && nearest != NULL && nearest->child != NULL) {
        struct taker first = { nearest->child, false };
        take_row_number(&first, &m.match);
        t.failed = t.failed || first.failed;
        m.match.found = (size_t)cJSON_GetArraySize(nearest);
    }
    if (t.failed)
        return STATUS_FORMAT;
    *ret = m;
    return STATUS_OK;
}
