/* wire.c - members one by one; a failure sticks and is seen at the end. */
#include "station/wire.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/maker.h"
#include "json/taker.h"
#include "station/strict_json.h"

/* ---- making ------------------------------------------------------------------------- */

enum status wire_spectrum(const struct spectrum *spectrum, cJSON **ret)
{
    struct maker m = maker_begin();
    maker_number(&m, "first_nm", spectrum->first_nm);
    maker_number(&m, "step_nm", spectrum->step_nm);
    maker_numbers(&m, "values", spectrum->value, spectrum->n);
    return maker_end(&m, ret);
}

static void put_spectrum(struct maker *m, const char *name, const struct spectrum *spectrum)
{
    cJSON *made = NULL;
    enum status s = wire_spectrum(spectrum, &made);
    maker_made(m, name, s, made);
}

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

static void put_nearest(struct maker *m, const struct table *table, const struct nearest_hit *hits,
                        size_t n)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < n; i++) {
        cJSON *hit = NULL;
        enum status s = make_hit(table, &hits[i], &hit);
        maker_append(&array, s, hit);
    }
    maker_array(m, "nearest", &array);
}

static void put_match_flags(struct maker *m, unsigned flags)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < MATCH_FLAG_COUNT; i++)
        if (flags & 1u << i)
            maker_append(&array, STATUS_OK, cJSON_CreateString(match_flag_name(i)));
    maker_array(m, "flags", &array);
}

enum status wire_match(const struct table *table, const struct match *match,
                       const struct nearest_hit *hits, size_t k, cJSON **ret)
{
    struct maker m = maker_begin();
    maker_number(&m, "Cm", match->row.Cm);
    maker_number(&m, "Bm", match->row.Bm);
    maker_number(&m, "Ch", match->row.Ch);
    maker_number(&m, "L", match->row.Lab[0]);
    maker_number(&m, "a", match->row.Lab[1]);
    maker_number(&m, "b", match->row.Lab[2]);
    maker_known_number(&m, "dE00", match->dE00);
    maker_known_number(&m, "rms", match->rms);
    maker_number(&m, "distance", match->distance);
    maker_text(&m, "by", match_by_name(match->by));
    maker_text(&m, "table", table->name);
    maker_text(&m, "table_sha256", table->sha256);
    if (k > 0)
        put_nearest(&m, table, hits, k < match->found ? k : match->found);
    put_match_flags(&m, match->flags);
    return maker_end(&m, ret);
}

/* JSON text that the store keeps, as it is: parsed and printed it would be the same. */
static void put_json(struct maker *m, const char *name, const char *text)
{
    cJSON *parsed;
    enum strict_json_fault fault;
    enum status s = strict_json_parse(text, strlen(text), &parsed, &fault, NULL);
    if (s == STATUS_OK)
        maker_put(m, name, parsed);
    else
        maker_fail(m, s == STATUS_FORMAT ? STATUS_RANGE : s);
}

static void put_spectra(struct maker *m, const char *name, const struct spectrum *spectrum,
                        size_t n)
{
    struct maker array = maker_begin_array();
    for (size_t i = 0; i < n; i++) {
        cJSON *made = NULL;
        enum status s = wire_spectrum(&spectrum[i], &made);
        maker_append(&array, s, made);
    }
    maker_array(m, name, &array);
}

static void put_colour(struct maker *m, const struct store_record *r)
{
    if (isfinite(r->XYZ[0])) {
        maker_numbers(m, "XYZ", r->XYZ, 3);
        maker_numbers(m, "Lab", r->Lab, 3);
        maker_put(m, "sRGB", cJSON_CreateIntArray(r->sRGB, 3));
        maker_number(m, "ITA", r->ITA);
        maker_text(m, "ita_scheme", r->ita_scheme);
    }
    maker_text(m, "illuminant", r->illuminant);
    maker_text(m, "observer", r->observer);
}

static void put_instrument(struct maker *m, const struct store_instrument *i)
{
    char name[sizeof i->maker + sizeof i->model];
    snprintf(name, sizeof name, "%s%s%s", i->maker, *i->maker != '\0' ? " " : "", i->model);
    maker_known_text(m, "instrument", name);
    maker_known_text(m, "serial", i->serial);
}

static void put_readings(struct maker *m, const struct store_record *r)
{
    maker_text(m, "specular", specular_name(r->specular));
    maker_known_number(m, "aperture_mm", r->aperture_mm);
    maker_known_number(m, "surface", r->surface);
    put_spectra(m, "replicates", r->replicate, r->replicate[0].n > 0 ? r->replicates : 0);
    if (r->replicate_sci[0].n > 0 && r->replicates > 0)
        put_spectra(m, "replicates_sci", r->replicate_sci, r->replicates);
    put_spectrum(m, "spectrum", &r->spectrum);
}

enum status wire_record(const struct store_record *r, cJSON **ret)
{
    struct maker m = maker_begin();
    maker_text(&m, "id", r->id);
    maker_number(&m, "seq", (double)r->seq);
    maker_known_text(&m, "uuid", r->uuid);
    maker_text(&m, "taken_at", r->taken_at);
    maker_known_text(&m, "operator", r->operator_name);
    put_instrument(&m, &r->instrument);
    put_readings(&m, r);
    put_colour(&m, r);
    maker_known_text(&m, "calibration_id", r->calibration_id);
    if (r->fence > 0)
        maker_number(&m, "fence", (double)r->fence);
    maker_known_text(&m, "subject", r->subject);
    maker_known_text(&m, "site", r->site);
    put_json(&m, "flags", *r->flags != '\0' ? r->flags : "[]");
    maker_known_text(&m, "corrects", r->corrects);
    if (*r->match_json != '\0')
        put_json(&m, "match", r->match_json);
    return maker_end(&m, ret);
}

/* ---- reading ------------------------------------------------------------------------ */

static void take_spectrum(struct taker *t, struct spectrum *s)
{
    *s = (struct spectrum){ .specular = SPECULAR_UNKNOWN, .aperture_mm = NAN };
    s->first_nm = taker_number(t, "first_nm");
    s->step_nm = taker_number(t, "step_nm");
    s->n = taker_numbers(t, "values", s->value, SPECTRUM_MAX_BANDS);
    t->failed = t->failed || s->n == 0 || !(s->step_nm > 0.0);
}

enum status wire_read_spectrum(const cJSON *object, struct spectrum *ret)
{
    struct taker t = { object, false };
    struct spectrum s;
    take_spectrum(&t, &s);
    if (t.failed)
        return STATUS_FORMAT;
    *ret = s;
    return STATUS_OK;
}

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

static unsigned get_match_flags(const struct taker *t)
{
    unsigned flags = 0;
    const cJSON *one;
    cJSON_ArrayForEach(one, strict_json_member(t->object, "flags"))
    {
        for (size_t i = 0; i < MATCH_FLAG_COUNT; i++)
            if (cJSON_IsString(one) && strcmp(one->valuestring, match_flag_name(i)) == 0)
                flags |= 1u << i;
    }
    return flags;
}

enum status wire_read_match(const cJSON *object, struct wire_match *ret)
{
    struct taker t = { object, false };
    struct wire_match m = { .match = { .row = { .rgb = { NAN, NAN, NAN } } } };
    const cJSON *nearest = strict_json_member(object, "nearest");
    m.match.row.Cm = taker_number(&t, "Cm");
    m.match.row.Bm = taker_number(&t, "Bm");
    m.match.row.Ch = taker_number(&t, "Ch");
    m.match.row.Lab[0] = taker_number(&t, "L");
    m.match.row.Lab[1] = taker_number(&t, "a");
    m.match.row.Lab[2] = taker_number(&t, "b");
    m.match.dE00 = taker_known_number(&t, "dE00");
    m.match.rms = taker_known_number(&t, "rms");
    m.match.distance = taker_number(&t, "distance");
    m.match.by = get_by(&t);
    m.match.flags = get_match_flags(&t);
    taker_text(&t, "table", m.table, sizeof m.table);
    taker_text(&t, "table_sha256", m.table_sha256, sizeof m.table_sha256);
    if (nearest != NULL && nearest->child != NULL) {
        struct taker first = { nearest->child, false };
        int64_t row = taker_integer(&first, "row");
        t.failed = t.failed || first.failed || row < 1;
        m.match.row_index = row > 0 ? (size_t)row - 1 : 0;
        m.match.found = (size_t)cJSON_GetArraySize(nearest);
    }
    if (t.failed)
        return STATUS_FORMAT;
    *ret = m;
    return STATUS_OK;
}

/* Spectra of an array; how many. */
static size_t get_spectra(struct taker *t, const char *name, struct spectrum *into,
                          enum specular specular, double aperture_mm)
{
    size_t n = 0;
    const cJSON *one;
    cJSON_ArrayForEach(one, strict_json_member(t->object, name))
    {
        struct taker part = { one, false };
        if (n == STORE_MAX_REPLICATES) {
            t->failed = true;
            break;
        }
        take_spectrum(&part, &into[n]);
        into[n].specular = specular;
        into[n++].aperture_mm = aperture_mm;
        t->failed = t->failed || part.failed;
    }
    return n;
}

static void get_readings(struct taker *t, struct store_record *r)
{
    char specular[8] = "";
    struct taker spectrum = { strict_json_member(t->object, "spectrum"), false };
    taker_text(t, "specular", specular, sizeof specular);
    t->failed = t->failed || specular_parse(specular, &r->specular) != STATUS_OK;
    r->aperture_mm = taker_known_number(t, "aperture_mm");
    r->surface = taker_known_number(t, "surface");
    size_t sce = get_spectra(t, "replicates", r->replicate, SPECULAR_SCE, r->aperture_mm);
    size_t sci = get_spectra(t, "replicates_sci", r->replicate_sci, SPECULAR_SCI, r->aperture_mm);
    r->replicates = sce > 0 ? sce : sci;
    t->failed = t->failed || (sce > 0 && sci > 0 && sce != sci);
    take_spectrum(&spectrum, &r->spectrum);
    r->spectrum.specular = r->specular;
    r->spectrum.aperture_mm = r->aperture_mm;
    t->failed = t->failed || spectrum.failed;
}

static void get_triple(struct taker *t, const char *name, double into[3])
{
    t->failed = taker_numbers(t, name, into, 3) != 3 || t->failed;
}

static void get_colour(struct taker *t, struct store_record *r)
{
    r->ITA = NAN;
    for (size_t i = 0; i < 3; i++)
        r->XYZ[i] = r->Lab[i] = NAN;
    taker_text(t, "illuminant", r->illuminant, sizeof r->illuminant);
    taker_text(t, "observer", r->observer, sizeof r->observer);
    if (strict_json_member(t->object, "XYZ") == NULL)
        return;
    double codes[3] = { 0, 0, 0 };
    get_triple(t, "XYZ", r->XYZ);
    get_triple(t, "Lab", r->Lab);
    get_triple(t, "sRGB", codes);
    for (size_t i = 0; i < 3; i++) {
        bool fits = codes[i] >= 0.0 && codes[i] <= 255.0;
        r->sRGB[i] = fits ? (int)codes[i] : 0;
        t->failed = t->failed || !fits;
    }
    r->ITA = taker_number(t, "ITA");
    taker_text(t, "ita_scheme", r->ita_scheme, sizeof r->ita_scheme);
}

static void get_match(struct taker *t, struct store_record *r)
{
    const cJSON *match = strict_json_member(t->object, "match");
    struct wire_match m;
    if (match == NULL)
        return;
    if (wire_read_match(match, &m) != STATUS_OK) {
        t->failed = true;
        return;
    }
    taker_json(t, "match", r->match_json, sizeof r->match_json);
    snprintf(r->table_name, sizeof r->table_name, "%s", m.table);
    snprintf(r->table_sha256, sizeof r->table_sha256, "%s", m.table_sha256);
    snprintf(r->method, sizeof r->method, "%s", match_by_name(m.match.by));
}

/* Maker and model as one; room for both is only in a longer text than the model's. */
static void get_instrument(struct taker *t, struct store_instrument *i)
{
    char name[sizeof i->maker + sizeof i->model] = "";
    taker_known_text(t, "instrument", name, sizeof name);
    memcpy(i->model, name, sizeof i->model - 1);
    taker_known_text(t, "serial", i->serial, sizeof i->serial);
}

static void take_record(struct taker *t, struct store_record *r)
{
    taker_text(t, "id", r->id, sizeof r->id);
    r->seq = taker_integer(t, "seq");
    taker_known_text(t, "uuid", r->uuid, sizeof r->uuid);
    taker_text(t, "taken_at", r->taken_at, sizeof r->taken_at);
    taker_known_text(t, "operator", r->operator_name, sizeof r->operator_name);
    get_instrument(t, &r->instrument);
    get_readings(t, r);
    get_colour(t, r);
    taker_known_text(t, "calibration_id", r->calibration_id, sizeof r->calibration_id);
    if (strict_json_member(t->object, "fence") != NULL)
        r->fence = taker_integer(t, "fence");
    taker_known_text(t, "subject", r->subject, sizeof r->subject);
    taker_known_text(t, "site", r->site, sizeof r->site);
    taker_json(t, "flags", r->flags, sizeof r->flags);
    taker_known_text(t, "corrects", r->corrects, sizeof r->corrects);
    get_match(t, r);
    r->raw_unit = NAN;
}

enum status wire_read_record(const cJSON *object, struct store_record *ret)
{
    struct taker t = { object, false };
    /* With room for all replicates it is too large for a thread's stack. */
    struct store_record *r = calloc(1, sizeof *r);
    if (r == NULL)
        return STATUS_NO_MEMORY;
    take_record(&t, r);
    if (!t.failed)
        *ret = *r;
    free(r);
    return t.failed ? STATUS_FORMAT : STATUS_OK;
}
