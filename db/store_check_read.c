/* store_check_read.c - rows of check tiles and checks, and what readers list of them. */
#include "db/store_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "db/store_private.h"

static const char *const source_names[] = { "certificate", "measured", "limit" };
enum { SOURCES = sizeof source_names / sizeof *source_names };

const char *store_tile_source_name(enum store_tile_source source)
{
    return (unsigned)source < SOURCES ? source_names[source] : "unknown";
}

/* ---- rows --------------------------------------------------------------------------- */

/* Columns in the order of the statement. */
struct cursor {
    sqlite3_stmt *row;
    int i;
    bool good; /* nothing yet that no check can hold */
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

static void read_instrument(struct cursor *c, struct store_instrument *ret)
{
    TEXT(c, ret->driver);
    TEXT(c, ret->maker);
    TEXT(c, ret->model);
    TEXT(c, ret->serial);
    TEXT(c, ret->firmware);
}

/* Grid and values; without bands: n = 0, which `may_lack` allows. */
static void read_spectrum(struct cursor *c, double aperture_mm, bool may_lack, struct spectrum *ret)
{
    ret->first_nm = next_number(c);
    ret->step_nm = next_number(c);
    int64_t bands = next_integer(c);
    ret->n = bands >= 1 && bands <= SPECTRUM_MAX_BANDS ? (size_t)bands : 0;
    ret->specular = SPECULAR_SCE;
    ret->aperture_mm = aperture_mm;
    memset(ret->flag, 0, sizeof ret->flag);
    if (ret->n > 0)
        c->good = c->good && store_values_read(c->row, c->i, ret->n, ret->value);
    else
        c->good = c->good && may_lack && bands == 0;
    c->i++;
}

static enum status judge(const struct cursor *c)
{
    if (sqlite3_errcode(sqlite3_db_handle(c->row)) == SQLITE_NOMEM)
        return STATUS_NO_MEMORY;
    return c->good ? STATUS_OK : STATUS_DAMAGED;
}

static enum store_tile_source read_source(struct cursor *c)
{
    char name[16];
    TEXT(c, name);
    for (int i = 0; i < SOURCES; i++)
        if (strcmp(source_names[i], name) == 0)
            return (enum store_tile_source)i;
    c->good = false;
    return STORE_TILE_LIMIT;
}

enum status store_check_tile_read(sqlite3_stmt *row, struct store_check_tile *ret)
{
    struct cursor c = { row, 0, true };
    read_instrument(&c, &ret->instrument);
    c.i++; /* seq: order alone */
    TEXT(&c, ret->id);
    TEXT(&c, ret->taken_at);
    TEXT(&c, ret->uuid);
    TEXT(&c, ret->parameters_sha256);
    TEXT(&c, ret->who);
    TEXT(&c, ret->tile);
    ret->source = read_source(&c);
    ret->limit_dE00 = next_number(&c);
    ret->aperture_mm = next_number(&c);
    read_spectrum(&c, ret->aperture_mm, ret->source == STORE_TILE_LIMIT, &ret->spectrum);
    c.i++; /* instrument: joined */
    TEXT(&c, ret->calibration_id);
    ret->replicates = (size_t)next_integer(&c);
    return judge(&c);
}

enum status store_check_read(sqlite3_stmt *row, struct store_check *ret)
{
    struct cursor c = { row, 0, true };
    read_instrument(&c, &ret->instrument);
    ret->seq = next_integer(&c);
    TEXT(&c, ret->id);
    TEXT(&c, ret->taken_at);
    TEXT(&c, ret->uuid);
    TEXT(&c, ret->parameters_sha256);
    TEXT(&c, ret->operator_name);
    c.i++; /* instrument: joined */
    TEXT(&c, ret->calibration_id);
    ret->fence = next_integer(&c);
    TEXT(&c, ret->tile);
    TEXT(&c, ret->reference_id);
    ret->aperture_mm = next_number(&c);
    ret->replicates = (size_t)next_integer(&c);
    read_spectrum(&c, ret->aperture_mm, false, &ret->spectrum);
    ret->dE00 = next_number(&c);
    ret->rms = next_number(&c);
    ret->limit_dE00 = next_number(&c);
    ret->passed = next_integer(&c) != 0;
    return judge(&c);
}

/* ---- one ---------------------------------------------------------------------------- */

static enum status log_damage(const char *what, const char *id, enum status s)
{
    if (s != STATUS_OK)
        log_error("store: %s %s: %s", what, id, status_text(s));
    return s;
}

/* The row the statement steps to; it is reset. */
static enum status one_tile(struct store_reader *reader, sqlite3_stmt *query,
                            struct store_check_tile *ret)
{
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        s = log_damage("check tile", ret->id, store_check_tile_read(query, ret));
    sqlite3_reset(query);
    return s;
}

static enum status one_check(struct store_reader *reader, sqlite3_stmt *query,
                             struct store_check *ret)
{
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        s = log_damage("check", ret->id, store_check_read(query, ret));
    sqlite3_reset(query);
    return s;
}

static void bind_instrument(sqlite3_stmt *query, const struct store_instrument *i)
{
    const char *const texts[] = { i->driver, i->maker, i->model, i->serial };
    for (int j = 0; j < 4; j++) /* '' is a value here, not NULL */
        sqlite3_bind_text(query, j + 1, texts[j], -1, SQLITE_STATIC);
}

enum status store_get_check_tile(struct store_reader *reader, const char *uuid,
                                 struct store_check_tile *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_CHECK_TILE_BY_UUID];
    store_text_bind(query, 1, uuid);
    return one_tile(reader, query, ret);
}

enum status store_get_check(struct store_reader *reader, const char *uuid, struct store_check *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_CHECK_BY_UUID];
    store_text_bind(query, 1, uuid);
    return one_check(reader, query, ret);
}

enum status store_last_check_tile(struct store_reader *reader, const char *tile,
                                  struct store_check_tile *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_LAST_CHECK_TILE];
    store_text_bind(query, 1, tile);
    return one_tile(reader, query, ret);
}

enum status store_find_check_reference(struct store_reader *reader, const char *tile,
                                       double aperture_mm,
                                       const struct store_instrument *instrument,
                                       struct store_check_tile *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_CHECK_REFERENCE];
    bind_instrument(query, instrument);
    store_text_bind(query, 5, tile);
    sqlite3_bind_double(query, 6, aperture_mm);
    return one_tile(reader, query, ret);
}

/* ---- many --------------------------------------------------------------------------- */

enum status store_list_check_tiles(struct store_reader *reader, const char *after_tile,
                                   store_visit_check_tile *visit, void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_NEXT_CHECK_TILE];
    char after[STORE_TILE_SIZE];
    struct store_check_tile *tile = calloc(1, sizeof *tile);
    enum status s = tile != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    strncpy(after, after_tile, sizeof after - 1);
    after[sizeof after - 1] = '\0';
    while (s == STATUS_OK) {
        sqlite3_bind_text(query, 1, after, -1, SQLITE_STATIC);
        s = one_tile(reader, query, tile);
        if (s != STATUS_OK || !visit(context, tile))
            break;
        memcpy(after, tile->tile, sizeof after);
    }
    free(tile);
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

/* The statement has all bound but what seq is above, at place `at`. */
static enum status visit_checks(struct store_reader *reader, sqlite3_stmt *query, int at,
                                int64_t since_seq, store_visit_check *visit, void *context)
{
    struct store_check *check = calloc(1, sizeof *check);
    enum status s = check != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    while (s == STATUS_OK) {
        sqlite3_bind_int64(query, at, since_seq);
        s = one_check(reader, query, check);
        if (s != STATUS_OK || !visit(context, check))
            break;
        since_seq = check->seq;
    }
    sqlite3_clear_bindings(query); /* they were borrowed */
    free(check);
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

enum status store_list_checks(struct store_reader *reader, const struct store_check_query *wanted,
                              store_visit_check *visit, void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_NEXT_CHECK];
    sqlite3_clear_bindings(query); /* NULL: all */
    if (wanted->instrument != NULL)
        bind_instrument(query, wanted->instrument);
    if (wanted->tile != NULL)
        store_text_bind(query, 5, wanted->tile);
    return visit_checks(reader, query, 6, wanted->since_seq, visit, context);
}

enum status store_last_checks(struct store_reader *reader,
                              const struct store_instrument *instrument, store_visit_check *visit,
                              void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_LAST_CHECKS];
    bind_instrument(query, instrument);
    return visit_checks(reader, query, 5, 0, visit, context);
}
