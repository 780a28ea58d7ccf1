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
    maker_nested(m, name, &array);
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
    if (*r->refined_json != '\0')
        put_json(&m, "match", r->refined_json);
    else if (*r->match_json != '\0')
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
    if (m.is_refined)
        taker_json(t, "match", r->refined_json, sizeof r->refined_json);
    else
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
