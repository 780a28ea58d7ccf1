/* store_record_read.c - a row as a record, bit for bit as it was; what no record can hold is
 * damage. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

double store_number_read(sqlite3_stmt *row, int column)
{
    return sqlite3_column_type(row, column) == SQLITE_NULL ? (double)NAN
                                                           : sqlite3_column_double(row, column);
}

/* ---- records ------------------------------------------------------------------------ */

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
    return store_number_read(c->row, c->i++);
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

bool store_values_read(sqlite3_stmt *row, int column, size_t n, double *value)
{
    const unsigned char *bytes = sqlite3_column_blob(row, column);
    if (bytes == NULL || (size_t)sqlite3_column_bytes(row, column) != 8 * n)
        return false;
    for (size_t i = 0; i < n; i++)
        value[i] = get_value(bytes + 8 * i);
    return true;
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
    TEXT(c, r->refined_json);
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

static void read_owner(struct cursor *c, struct store_record *r)
{
    int i = c->i++;
    r->owner_uid =
        sqlite3_column_type(c->row, i) == SQLITE_NULL ? -1 : sqlite3_column_int64(c->row, i);
}

enum status store_raw_read(sqlite3_stmt *row, int column, int32_t **ret, size_t *n)
{
    const unsigned char *bytes = sqlite3_column_blob(row, column);
    size_t size = bytes != NULL ? (size_t)sqlite3_column_bytes(row, column) / 4 : 0;
    if (bytes == NULL && sqlite3_errcode(sqlite3_db_handle(row)) == SQLITE_NOMEM)
        return STATUS_NO_MEMORY;
    int32_t *raw = size > 0 ? malloc(size * sizeof *raw) : NULL;
    if (raw == NULL && size > 0)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < size; i++) {
        uint32_t bits = 0;
        for (size_t j = 0; j < 4; j++)
            bits |= (uint32_t)bytes[4 * i + j] << (8 * j);
        memcpy(&raw[i], &bits, sizeof bits);
    }
    *ret = raw;
    *n = size;
    return STATUS_OK;
}

enum status store_record_read(sqlite3_stmt *row, struct store_record *ret)
{
    struct cursor c = { row, 0, true };
    read_joined(&c, ret);
    read_origin(&c, ret);
    read_spectra(&c, ret);
    read_colour(&c, ret);
    read_owner(&c, ret);
    if (sqlite3_errcode(sqlite3_db_handle(row)) == SQLITE_NOMEM)
        return STATUS_NO_MEMORY;
    return c.good ? STATUS_OK : STATUS_DAMAGED;
}
