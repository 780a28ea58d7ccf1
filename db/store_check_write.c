/* store_check_write.c - references, limits and checks of tiles: each a job of its own. */
#include "db/store_check.h"

#include <math.h>
#include <string.h>

#include "db/sql.h"
#include "db/store_private.h"

static bool is_spectrum(const struct spectrum *s)
{
    return s->n >= 1 && s->n <= SPECTRUM_MAX_BANDS && isfinite(s->first_nm) && isfinite(s->step_nm);
}

static enum status next_seq(struct store *store, enum store_statement next, int64_t *ret)
{
    sqlite3_stmt *select = store->statement[next];
    enum status s = sql_status(sqlite3_step(select));
    if (s == STATUS_OK)
        *ret = sqlite3_column_int64(select, 0);
    sqlite3_reset(select);
    return s;
}

static void put_grid(struct store_row *row, const struct spectrum *s)
{
    bool none = s->n == 0;
    store_row_number(row, "first_nm", none ? (double)NAN : s->first_nm);
    store_row_number(row, "step_nm", none ? (double)NAN : s->step_nm);
    store_row_integer_unless(row, "bands", (int64_t)s->n, none);
}

/* A retry is the one whose uuid is bound to `get`: STATUS_NOT_FOUND where there is none. */
static enum status look_for_retry(struct store *store, enum store_statement get, const char *uuid)
{
    sqlite3_stmt *select = store->statement[get];
    store_text_bind(select, 1, uuid);
    int stepped = sqlite3_step(select);
    return stepped == SQLITE_DONE ? STATUS_NOT_FOUND : sql_status(stepped);
}

static enum status same_request(struct store *store, bool same)
{
    return same ? STATUS_OK : store_refuse(store, "uuid", STATUS_EXISTS);
}

/* ---- references and limits ---------------------------------------------------------- */

static enum status find_tile_retry(struct store *store, const struct store_check_tile *asked,
                                   struct store_check_tile *ret)
{
    enum status s = look_for_retry(store, SQL_GET_CHECK_TILE, asked->uuid);
    if (s == STATUS_OK)
        s = store_check_tile_read(store->statement[SQL_GET_CHECK_TILE], ret);
    sqlite3_reset(store->statement[SQL_GET_CHECK_TILE]);
    if (s != STATUS_OK)
        return s;
    return same_request(store, ret->source == asked->source &&
                                   strcmp(ret->parameters_sha256, asked->parameters_sha256) == 0);
}

static enum status insert_tile_row(struct store *store, const struct store_check_tile *t,
                                   int64_t seq, int64_t instrument, struct audit_digests *digests)
{
    unsigned char values[8 * SPECTRUM_MAX_BANDS];
    struct store_row row;
    store_values_write(&t->spectrum, values);
    store_row_begin(&row, store->statement[SQL_ADD_CHECK_TILE], "check_tile");
    store_row_integer(&row, "seq", seq);
    store_row_text(&row, "id", t->id);
    store_row_text(&row, "taken_at", t->taken_at);
    store_row_text(&row, "uuid", t->uuid);
    store_row_text(&row, "parameters_sha256", t->parameters_sha256);
    store_row_text(&row, "who", t->who);
    store_row_text(&row, "tile", t->tile);
    store_row_text(&row, "source", store_tile_source_name(t->source));
    store_row_number(&row, "limit_dE00", t->limit_dE00);
    store_row_number(&row, "aperture_mm", t->aperture_mm);
    put_grid(&row, &t->spectrum);
    store_row_blob(&row, "spectrum", values, 8 * t->spectrum.n);
    store_row_integer_unless(&row, "instrument", instrument, instrument == 0);
    store_row_text(&row, "calibration", t->calibration_id);
    store_row_integer_unless(&row, "replicates", (int64_t)t->replicates, t->replicates == 0);
    return store_row_insert(&row, digests);
}

static enum status insert_tile(struct store *store, struct store_check_tile *t)
{
    struct audit_digests digests = { .n = 0 };
    struct store_stamp stamp;
    int64_t seq, instrument = 0;
    enum status s =
        store_must_exist(store, SQL_FIND_CALIBRATION, t->calibration_id, "calibration_id");
    if (s == STATUS_OK && t->source == STORE_TILE_MEASURED)
        s = store_instrument_key(store, &t->instrument, &instrument);
    if (s == STATUS_OK)
        s = store_stamp_id(store, &stamp);
    if (s == STATUS_OK)
        s = next_seq(store, SQL_NEXT_CHECK_TILE, &seq);
    if (s != STATUS_OK)
        return s;
    memcpy(t->id, stamp.id, sizeof t->id);
    memcpy(t->taken_at, stamp.at, sizeof t->taken_at);
    s = insert_tile_row(store, t, seq, instrument, &digests);
    if (s == STATUS_OK)
        s = audit_append_known(&store->audit, stamp.at, t->who, AUDIT_CHECK_TILE, t->id, &digests);
    return s;
}

enum status store_add_check_tile(struct store *store, struct store_check_tile *tile, bool *known)
{
    struct store_check_tile made = *tile, stored;
    bool is_limit = tile->source == STORE_TILE_LIMIT;
    store->bad_member = NULL;
    if (is_limit ? tile->spectrum.n != 0 : !is_spectrum(&tile->spectrum))
        return store_refuse(store, "spectrum", STATUS_RANGE);
    enum status s = store_job_begin(store);
    if (s != STATUS_OK)
        return s;
    s = find_tile_retry(store, tile, &stored);
    bool is_new = s == STATUS_NOT_FOUND;
    if (is_new)
        s = insert_tile(store, &made);
    s = store_job_end(store, "keep a check tile", s);
    if (s != STATUS_OK)
        return s;
    *tile = is_new ? made : stored;
    *known = !is_new;
    return STATUS_OK;
}

/* ---- checks ------------------------------------------------------------------------- */

static enum status find_check_retry(struct store *store, const struct store_check *asked,
                                    struct store_check *ret)
{
    enum status s = look_for_retry(store, SQL_GET_CHECK, asked->uuid);
    if (s == STATUS_OK)
        s = store_check_read(store->statement[SQL_GET_CHECK], ret);
    sqlite3_reset(store->statement[SQL_GET_CHECK]);
    if (s != STATUS_OK)
        return s;
    return same_request(store, strcmp(ret->parameters_sha256, asked->parameters_sha256) == 0);
}

static enum status insert_check_row(struct store *store, const struct store_check *c,
                                    int64_t instrument, struct audit_digests *digests)
{
    unsigned char values[8 * SPECTRUM_MAX_BANDS];
    struct store_row row;
    store_values_write(&c->spectrum, values);
    store_row_begin(&row, store->statement[SQL_ADD_CHECK], "check_reading");
    store_row_integer(&row, "seq", c->seq);
    store_row_text(&row, "id", c->id);
    store_row_text(&row, "taken_at", c->taken_at);
    store_row_text(&row, "uuid", c->uuid);
    store_row_text(&row, "parameters_sha256", c->parameters_sha256);
    store_row_text(&row, "operator", c->operator_name);
    store_row_integer(&row, "instrument", instrument);
    store_row_text(&row, "calibration", c->calibration_id);
    store_row_integer(&row, "fence", c->fence);
    store_row_text(&row, "tile", c->tile);
    store_row_text(&row, "reference", c->reference_id);
    store_row_number(&row, "aperture_mm", c->aperture_mm);
    store_row_integer(&row, "replicates", (int64_t)c->replicates);
    put_grid(&row, &c->spectrum);
    store_row_blob(&row, "spectrum", values, 8 * c->spectrum.n);
    store_row_number(&row, "dE00", c->dE00);
    store_row_number(&row, "rms", c->rms);
    store_row_number(&row, "limit_dE00", c->limit_dE00);
    store_row_integer(&row, "passed", c->passed);
    return store_row_insert(&row, digests);
}

static enum status insert_check(struct store *store, struct store_check *c)
{
    struct audit_digests digests = { .n = 0 };
    struct store_stamp stamp;
    int64_t instrument;
    enum status s =
        store_must_exist(store, SQL_FIND_CALIBRATION, c->calibration_id, "calibration_id");
    if (s == STATUS_OK)
        s = store_must_exist(store, SQL_FIND_CHECK_TILE, c->reference_id, "reference_id");
    if (s == STATUS_OK)
        s = store_instrument_key(store, &c->instrument, &instrument);
    if (s == STATUS_OK)
        s = store_stamp_id(store, &stamp);
    if (s == STATUS_OK)
        s = next_seq(store, SQL_NEXT_CHECK, &c->seq);
    if (s != STATUS_OK)
        return s;
    memcpy(c->id, stamp.id, sizeof c->id);
    memcpy(c->taken_at, stamp.at, sizeof c->taken_at);
    s = insert_check_row(store, c, instrument, &digests);
    if (s == STATUS_OK)
        s = audit_append_known(&store->audit, stamp.at, c->operator_name, AUDIT_CHECK, c->id,
                               &digests);
    return s;
}

enum status store_add_check(struct store *store, struct store_check *check, bool *known)
{
    struct store_check made = *check, stored;
    store->bad_member = NULL;
    if (!is_spectrum(&check->spectrum))
        return store_refuse(store, "spectrum", STATUS_RANGE);
    enum status s = store_job_begin(store);
    if (s != STATUS_OK)
        return s;
    s = find_check_retry(store, check, &stored);
    bool is_new = s == STATUS_NOT_FOUND;
    if (is_new)
        s = insert_check(store, &made);
    s = store_job_end(store, "keep a check", s);
    if (s != STATUS_OK)
        return s;
    *check = is_new ? made : stored;
    *known = !is_new;
    return STATUS_OK;
}
