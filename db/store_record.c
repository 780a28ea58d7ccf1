/* store_record.c - a record as SQL values, there and back, bit for bit.
 *
 * Numbers in blobs are little-endian whatever the machine. */
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "db/sql.h"
#include "db/store_private.h"

void store_text_bind(sqlite3_stmt *statement, int i, const char *text)
{
    if (*text != '\0')
        sqlite3_bind_text(statement, i, text, -1, SQLITE_STATIC);
    else
        sqlite3_bind_null(statement, i);
}

void store_text_read(sqlite3_stmt *row, int column, char *text, size_t size)
{
    const char *stored = (const char *)sqlite3_column_text(row, column);
    snprintf(text, size, "%s", stored != NULL ? stored : "");
}

/* ---- what fits together --------------------------------------------------------------- */

static bool same_grid(const struct spectrum *a, const struct spectrum *b)
{
    return a->n == b->n && a->first_nm == b->first_nm && a->step_nm == b->step_nm;
}

/* All replicates on the grid, or none measured so. */
static bool fits(const struct store_record *r, const struct spectrum *replicate)
{
    for (size_t i = 0; i < r->replicates; i++)
        if (replicate[0].n == 0 ? replicate[i].n != 0 : !same_grid(&replicate[i], &r->spectrum))
            return false;
    return true;
}

const char *store_record_misfit(const struct store_record *r)
{
    if (r->spectrum.n < 1 || r->spectrum.n > SPECTRUM_MAX_BANDS ||
        !isfinite(r->spectrum.first_nm) || !isfinite(r->spectrum.step_nm))
        return "spectrum";
    if (r->replicates > STORE_MAX_REPLICATES)
        return "replicates";
    if (!fits(r, r->replicate))
        return "replicate";
    if (!fits(r, r->replicate_sci))
        return "replicate_sci";
    if (r->raw != NULL && r->raw_n > (size_t)2 * STORE_MAX_REPLICATES * SPECTRUM_MAX_BANDS)
        return "raw";
    return NULL;
}

/* ---- blobs ------------------------------------------------------------------------------- */

struct writer {
    unsigned char *at;
};

static void put(struct writer *w, uint64_t bits, size_t bytes)
{
    for (size_t i = 0; i < bytes; i++)
        *w->at++ = (unsigned char)(bits >> (8 * i));
}

static void put_values(struct writer *w, const struct spectrum *s)
{
    for (size_t i = 0; i < s->n; i++) {
        uint64_t bits;
        memcpy(&bits, &s->value[i], sizeof bits);
        put(w, bits, sizeof bits);
    }
}

static bool put_flags(struct writer *w, const struct spectrum *s)
{
    bool any = false;
    for (size_t i = 0; i < s->n; i++) {
        any = any || s->flag[i] != 0;
        *w->at++ = s->flag[i];
    }
    return any;
}

/* Offsets of the blobs in one piece of memory; where one ends the next begins. */
struct blobs {
    unsigned char *memory;
    size_t sce, sci, flags, raw, end; /* the spectrum at 0 */
    bool flagged;
};

static enum status make_blobs(const struct store_record *r, struct blobs *ret)
{
    size_t bands = r->spectrum.n;
    size_t sce = r->replicate[0].n > 0 ? r->replicates : 0;
    size_t sci = r->replicate_sci[0].n > 0 ? r->replicates : 0;
    struct blobs b = { .sce = 8 * bands };
    b.sci = b.sce + 8 * bands * sce;
    b.flags = b.sci + 8 * bands * sci;
    b.raw = b.flags + bands * (1 + sce + sci);
    b.end = b.raw + (r->raw != NULL ? 4 * r->raw_n : 0);
    b.memory = malloc(b.end);
    if (b.memory == NULL)
        return STATUS_NO_MEMORY;
    struct writer w = { b.memory };
    put_values(&w, &r->spectrum);
    for (size_t i = 0; i < sce; i++)
        put_values(&w, &r->replicate[i]);
    for (size_t i = 0; i < sci; i++)
        put_values(&w, &r->replicate_sci[i]);
    b.flagged = put_flags(&w, &r->spectrum);
    for (size_t i = 0; i < sce; i++)
        b.flagged = put_flags(&w, &r->replicate[i]) || b.flagged;
    for (size_t i = 0; i < sci; i++)
        b.flagged = put_flags(&w, &r->replicate_sci[i]) || b.flagged;
    for (size_t i = 0; r->raw != NULL && i < r->raw_n; i++)
        put(&w, (uint32_t)r->raw[i], 4);
    *ret = b;
    return STATUS_OK;
}

/* ---- writing -------------------------------------------------------------------------------- */

/* Values in the order of the statement's parameters. */
struct binder {
    sqlite3_stmt *to;
    int i;
};

static void text(struct binder *b, const char *value)
{
    store_text_bind(b->to, ++b->i, value);
}

static void integer(struct binder *b, int64_t value)
{
    sqlite3_bind_int64(b->to, ++b->i, value);
}

/* NULL for 0, which no key is. */
static void key(struct binder *b, int64_t value)
{
    if (value != 0)
        sqlite3_bind_int64(b->to, ++b->i, value);
    else
        sqlite3_bind_null(b->to, ++b->i);
}

/* SQLite takes NAN as NULL. */
static void number(struct binder *b, double value)
{
    sqlite3_bind_double(b->to, ++b->i, value);
}

/* NULL where it is empty. */
static void blob(struct binder *b, const unsigned char *memory, size_t from, size_t end)
{
    if (end > from)
        sqlite3_bind_blob(b->to, ++b->i, memory + from, (int)(end - from), SQLITE_STATIC);
    else
        sqlite3_bind_null(b->to, ++b->i);
}

/* In the order of the table, after seq: what it is about and how it was made. */
static void bind_origin(struct binder *b, const struct store_record *r,
                        const struct store_record_keys *keys)
{
    text(b, keys->id);
    text(b, keys->taken_at);
    text(b, r->boot_id);
    integer(b, r->boottime_ms);
    text(b, r->uuid);
    text(b, r->parameters_sha256);
    text(b, r->operator_name);
    key(b, keys->instrument);
    text(b, r->calibration_id);
    integer(b, r->fence);
    text(b, r->subject);
    key(b, keys->site);
    text(b, r->corrects);
}

static void bind_spectra(struct binder *b, const struct store_record *r, const struct blobs *blobs)
{
    text(b, specular_name(r->specular));
    number(b, r->aperture_mm);
    number(b, r->spectrum.first_nm);
    number(b, r->spectrum.step_nm);
    integer(b, (int64_t)r->spectrum.n);
    blob(b, blobs->memory, 0, blobs->sce);
    number(b, r->surface);
    integer(b, (int64_t)r->replicates);
    blob(b, blobs->memory, blobs->sce, blobs->sci);
    blob(b, blobs->memory, blobs->sci, blobs->flags);
    blob(b, blobs->memory, blobs->flags, blobs->flagged ? blobs->raw : blobs->flags);
    blob(b, blobs->memory, blobs->raw, blobs->end);
    number(b, r->raw_unit);
}

static void bind_colour(struct binder *b, const struct store_record *r)
{
    for (int i = 0; i < 3; i++)
        number(b, r->XYZ[i]);
    for (int i = 0; i < 3; i++)
        number(b, r->Lab[i]);
    for (int i = 0; i < 3; i++)
        integer(b, r->sRGB[i]);
    number(b, r->ITA);
    text(b, r->ita_scheme);
    text(b, r->illuminant);
    text(b, r->observer);
    text(b, r->flags);
}

enum status store_record_insert(sqlite3_stmt *insert, const struct store_record *record,
                                const struct store_record_keys *keys)
{
    struct blobs blobs;
    struct binder b = { insert, 0 };
    enum status s = make_blobs(record, &blobs);
    if (s != STATUS_OK)
        return s;
    bind_origin(&b, record, keys);
    bind_spectra(&b, record, &blobs);
    bind_colour(&b, record);
    s = sql_step_done(insert);
    sqlite3_clear_bindings(insert); /* the memory goes */
    free(blobs.memory);
    return s;
}

/* ---- reading ----------------------------------------------------------------------------------
 */

/* Columns in the order of the statement. */
struct cursor {
    sqlite3_stmt *row;
    int i;
    bool good; /* nothing yet that no record can hold */
};

#define TEXT(c, array) store_text_read((c)->row, (c)->i++, (array), sizeof(array))

static int64_t next_integer(struct cursor *c)
{
    return sqlite3_column_int64(c->row, c->i++);
}

static double next_number(struct cursor *c)
{
    int i = c->i++;
    return sqlite3_column_type(c->row, i) == SQLITE_NULL ? (double)NAN
                                                         : sqlite3_column_double(c->row, i);
}

/* A blob of that size, or NULL where it is not there; any other size is damage. */
static const unsigned char *next_blob(struct cursor *c, size_t size)
{
    const unsigned char *bytes = sqlite3_column_blob(c->row, c->i);
    size_t n = (size_t)sqlite3_column_bytes(c->row, c->i++);
    if (n != 0 && n != size)
        c->good = false;
    return n == size ? bytes : NULL;
}

static double get_value(const unsigned char *bytes)
{
    uint64_t bits = 0;
    double x;
    for (size_t i = 0; i < 8; i++)
        bits |= (uint64_t)bytes[i] << (8 * i);
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* One spectrum on the record's grid; no values: n = 0.  Flags are added later. */
static void get_spectrum(const struct store_record *r, enum specular specular,
                         const unsigned char *values, struct spectrum *ret)
{
    ret->first_nm = r->spectrum.first_nm;
    ret->step_nm = r->spectrum.step_nm;
    ret->aperture_mm = r->aperture_mm;
    ret->specular = specular;
    ret->n = values != NULL ? r->spectrum.n : 0;
    for (size_t i = 0; i < ret->n; i++)
        ret->value[i] = get_value(values + 8 * i);
    memset(ret->flag, 0, ret->n);
}

static void get_replicates(const struct store_record *r, enum specular specular,
                           const unsigned char *values, struct spectrum *ret)
{
    for (size_t i = 0; i < STORE_MAX_REPLICATES; i++) {
        const unsigned char *own =
            values != NULL && i < r->replicates ? values + 8 * r->spectrum.n * i : NULL;
        get_spectrum(r, specular, own, &ret[i]);
    }
}

static const unsigned char *get_flags(const unsigned char *flags, struct spectrum *ret)
{
    memcpy(ret->flag, flags, ret->n);
    return flags + ret->n;
}

static void read_flags(struct cursor *c, struct store_record *r)
{
    size_t spectra = 1 + (r->replicate[0].n > 0 ? r->replicates : 0) +
                     (r->replicate_sci[0].n > 0 ? r->replicates : 0);
    const unsigned char *at = next_blob(c, spectra * r->spectrum.n);
    if (at == NULL)
        return;
    at = get_flags(at, &r->spectrum);
    for (size_t i = 0; i < r->replicates; i++)
        at = get_flags(at, &r->replicate[i]); /* nothing where n is 0 */
    for (size_t i = 0; i < r->replicates; i++)
        at = get_flags(at, &r->replicate_sci[i]);
}

static void read_joined(struct cursor *c, struct store_record *r)
{
    TEXT(c, r->instrument.driver);
    TEXT(c, r->instrument.maker);
    TEXT(c, r->instrument.model);
    TEXT(c, r->instrument.serial);
    TEXT(c, r->instrument.firmware);
    TEXT(c, r->site);
    TEXT(c, r->table_name);
    TEXT(c, r->table_sha256);
    TEXT(c, r->method);
    TEXT(c, r->match_json);
}

static void read_origin(struct cursor *c, struct store_record *r)
{
    r->seq = next_integer(c);
    TEXT(c, r->id);
    TEXT(c, r->taken_at);
    TEXT(c, r->boot_id);
    r->boottime_ms = next_integer(c);
    TEXT(c, r->uuid);
    TEXT(c, r->parameters_sha256);
    TEXT(c, r->operator_name);
    c->i++; /* instrument: joined */
    TEXT(c, r->calibration_id);
    r->fence = next_integer(c);
    TEXT(c, r->subject);
    c->i++; /* site: joined */
    TEXT(c, r->corrects);
}

static void read_spectra(struct cursor *c, struct store_record *r)
{
    char specular[16];
    TEXT(c, specular);
    if (specular_parse(specular, &r->specular) != STATUS_OK)
        r->specular = SPECULAR_UNKNOWN;
    r->aperture_mm = next_number(c);
    r->spectrum.first_nm = next_number(c);
    r->spectrum.step_nm = next_number(c);
    int64_t bands = next_integer(c);
    c->good = bands >= 1 && bands <= SPECTRUM_MAX_BANDS;
    r->spectrum.n = c->good ? (size_t)bands : 0;
    get_spectrum(r, r->specular, next_blob(c, 8 * r->spectrum.n), &r->spectrum);
    r->surface = next_number(c);
    int64_t replicates = next_integer(c);
    c->good = c->good && r->spectrum.n > 0 && replicates >= 0 && replicates <= STORE_MAX_REPLICATES;
    r->replicates = c->good ? (size_t)replicates : 0;
    size_t size = 8 * r->spectrum.n * r->replicates;
    get_replicates(r, SPECULAR_SCE, next_blob(c, size), r->replicate);
    get_replicates(r, SPECULAR_SCI, next_blob(c, size), r->replicate_sci);
    read_flags(c, r);
    r->raw = NULL;
    r->raw_n = (size_t)sqlite3_column_bytes(c->row, c->i++) / 4;
    r->raw_unit = next_number(c);
}

static void read_colour(struct cursor *c, struct store_record *r)
{
    for (int i = 0; i < 3; i++)
        r->XYZ[i] = next_number(c);
    for (int i = 0; i < 3; i++)
        r->Lab[i] = next_number(c);
    for (int i = 0; i < 3; i++)
        r->sRGB[i] = (int)next_integer(c);
    r->ITA = next_number(c);
    TEXT(c, r->ita_scheme);
    TEXT(c, r->illuminant);
    TEXT(c, r->observer);
    TEXT(c, r->flags);
}

enum status store_record_read(sqlite3_stmt *row, struct store_record *ret)
{
    struct cursor c = { row, 0, true };
    read_joined(&c, ret);
    read_origin(&c, ret);
    read_spectra(&c, ret);
    read_colour(&c, ret);
    if (sqlite3_errcode(sqlite3_db_handle(row)) == SQLITE_NOMEM)
        return STATUS_NO_MEMORY;
    return c.good ? STATUS_OK : STATUS_DAMAGED;
}
