/* store_write.c - records, calibrations, subjects, uuids: each a job of its own. */
#include "db/store.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

#define DAY_MS INT64_C(86400000)
enum { UUID_DAYS = 30 };

static void stamp_time(const struct store *store, struct store_stamp *ret)
{
    ret->ms = store_now_ms(&store->clock);
    clock_text(ret->ms, ret->at);
}

enum status store_stamp_id(struct store *store, struct store_stamp *ret)
{
    stamp_time(store, ret);
    return uuid7_make(&store->ids, ret->ms, ret->id);
}

enum status store_refuse(struct store *store, const char *member, enum status s)
{
    store->bad_member = member;
    return s;
}

/* ---- what a row refers to ----------------------------------------------------------- */

enum status store_must_exist(struct store *store, enum store_statement find, const char *id,
                             const char *member)
{
    sqlite3_stmt *select = store->statement[find];
    if (*id == '\0')
        return STATUS_OK;
    store_text_bind(select, 1, id);
    int stepped = sqlite3_step(select);
    enum status s = sql_status(stepped);
    sqlite3_reset(select);
    return stepped == SQLITE_DONE ? store_refuse(store, member, STATUS_NOT_FOUND) : s;
}

/* The id of a row whose values are bound to `find`; 0 where there is none. */
static enum status find_key(sqlite3_stmt *find, int64_t *ret)
{
    int stepped = sqlite3_step(find);
    *ret = stepped == SQLITE_ROW ? sqlite3_column_int64(find, 0) : 0;
    sqlite3_reset(find);
    return sql_status(stepped);
}

/* The row with these n texts, added with an audit row where it is new. */
static enum status key_of(struct store *store, enum store_statement find, enum store_statement add,
                          const char *action, const char *const *texts, int n, int64_t *ret)
{
    sqlite3_stmt *select = store->statement[find], *insert = store->statement[add];
    char entity[24];
    struct store_stamp stamp;
    for (int i = 0; i < n; i++) { /* '' is a value here, not NULL */
        sqlite3_bind_text(select, i + 1, texts[i], -1, SQLITE_STATIC);
        sqlite3_bind_text(insert, i + 1, texts[i], -1, SQLITE_STATIC);
    }
    enum status s = find_key(select, ret);
    if (s != STATUS_OK || *ret != 0)
        return s;
    s = sql_step_done(insert);
    if (s != STATUS_OK)
        return s;
    *ret = sqlite3_last_insert_rowid(store->db);
    snprintf(entity, sizeof entity, "%" PRId64, *ret);
    stamp_time(store, &stamp);
    return audit_append(&store->audit, stamp.at, "", action, entity);
}

enum status store_instrument_key(struct store *store, const struct store_instrument *i,
                                 int64_t *ret)
{
    const char *const texts[] = { i->driver, i->maker, i->model, i->serial, i->firmware };
    return key_of(store, SQL_FIND_INSTRUMENT, SQL_ADD_INSTRUMENT, AUDIT_INSTRUMENT, texts, 5, ret);
}

static bool has_instrument(const struct store_instrument *i)
{
    return (i->driver[0] | i->maker[0] | i->model[0] | i->serial[0] | i->firmware[0]) != 0;
}

/* ---- records ------------------------------------------------------------------------ */

/* What store_add_record() gives out. */
struct outcome {
    struct store_stamp stamp;
    int64_t seq;
    bool known;
};

static enum status find_retry(struct store *store, const struct store_record *record,
                              struct outcome *ret)
{
    char parameters[sizeof record->parameters_sha256];
    sqlite3_stmt *select = store->statement[SQL_FIND_UUID];
    if (record->uuid[0] == '\0')
        return STATUS_OK;
    store_text_bind(select, 1, record->uuid);
    int stepped = sqlite3_step(select);
    enum status s = sql_status(stepped);
    if (stepped == SQLITE_ROW) {
        store_text_read(select, 0, parameters, sizeof parameters);
        ret->known = true;
        ret->seq = sqlite3_column_int64(select, 1);
        store_text_read(select, 2, ret->stamp.id, sizeof ret->stamp.id);
        store_text_read(select, 3, ret->stamp.at, sizeof ret->stamp.at);
        if (strcmp(parameters, record->parameters_sha256) != 0)
            s = store_refuse(store, "uuid", STATUS_EXISTS);
    }
    sqlite3_reset(select);
    return s;
}

static enum status check_references(struct store *store, const struct store_record *record)
{
    enum status s = store_must_exist(store, SQL_FIND_SUBJECT, record->subject, "subject");
    if (s == STATUS_OK)
        s = store_must_exist(store, SQL_FIND_CALIBRATION, record->calibration_id, "calibration_id");
    if (s == STATUS_OK)
        s = store_must_exist(store, SQL_FIND_MEASUREMENT, record->corrects, "corrects");
    return s;
}

static enum status next_seq(struct store *store)
{
    return store->next_seq != 0 ? STATUS_OK
                                : find_key(store->statement[SQL_NEXT_SEQ], &store->next_seq);
}

static enum status insert_measurement(struct store *store, const struct store_record *record,
                                      struct outcome *ret, struct audit_digests *digests)
{
    struct store_record_keys keys = { .id = ret->stamp.id, .taken_at = ret->stamp.at };
    const char *site = record->site;
    enum status s = next_seq(store);
    keys.seq = store->next_seq;
    if (s == STATUS_OK && has_instrument(&record->instrument))
        s = store_instrument_key(store, &record->instrument, &keys.instrument);
    if (s == STATUS_OK && *site != '\0')
        s = key_of(store, SQL_FIND_SITE, SQL_ADD_SITE, AUDIT_SITE, &site, 1, &keys.site);
    if (s == STATUS_OK)
        s = store_record_insert(store->statement[SQL_ADD_MEASUREMENT], record, &keys, digests);
    if (s == STATUS_OK)
        ret->seq = store->next_seq++;
    return s;
}

static enum status insert_uuid(struct store *store, const struct store_record *record,
                               const struct outcome *outcome)
{
    sqlite3_stmt *insert = store->statement[SQL_ADD_UUID];
    if (record->uuid[0] == '\0')
        return STATUS_OK;
    store_text_bind(insert, 1, record->uuid);
    sqlite3_bind_text(insert, 2, record->parameters_sha256, -1, SQLITE_STATIC);
    sqlite3_bind_int64(insert, 3, outcome->seq);
    sqlite3_bind_int64(insert, 4, outcome->stamp.ms);
    return sql_step_done(insert);
}

static enum status insert_record(struct store *store, const struct store_record *record,
                                 struct outcome *ret)
{
    struct audit_digests digests = { .n = 0 };
    enum status s = find_retry(store, record, ret);
    if (s != STATUS_OK || ret->known)
        return s;
    s = check_references(store, record);
    if (s == STATUS_OK)
        s = store_stamp_id(store, &ret->stamp);
    if (s == STATUS_OK)
        s = insert_measurement(store, record, ret, &digests);
    if (s == STATUS_OK && record->match_json[0] != '\0')
        s = store_match_insert(store->statement[SQL_ADD_MATCH], record, ret->seq, &digests);
    if (s == STATUS_OK)
        s = insert_uuid(store, record, ret);
    if (s == STATUS_OK)
        s = audit_append_known(&store->audit, ret->stamp.at, record->operator_name,
                               AUDIT_MEASUREMENT, ret->stamp.id, &digests);
    return s;
}

enum status store_add_record(struct store *store, struct store_record *record, bool *known)
{
    struct outcome outcome = { .known = false };
    const char *misfit = store_record_misfit(record);
    store->bad_member = NULL;
    if (misfit != NULL)
        return store_refuse(store, misfit, STATUS_RANGE);
    enum status s = store_job_begin(store);
    if (s != STATUS_OK)
        return s;
    s = store_job_end(store, "keep a record", insert_record(store, record, &outcome));
    if (s != STATUS_OK)
        return s;
    memcpy(record->id, outcome.stamp.id, sizeof record->id);
    memcpy(record->taken_at, outcome.stamp.at, sizeof record->taken_at);
    record->seq = outcome.seq;
    *known = outcome.known;
    return STATUS_OK;
}

/* ---- calibrations ------------------------------------------------------------------- */

static enum status insert_calibration(struct store *store, const struct store_calibration *c,
                                      struct store_stamp *stamp)
{
    sqlite3_stmt *insert = store->statement[SQL_ADD_CALIBRATION];
    int64_t instrument;
    enum status s = store_instrument_key(store, &c->instrument, &instrument);
    if (s == STATUS_OK)
        s = store_stamp_id(store, stamp);
    if (s != STATUS_OK)
        return s;
    store_text_bind(insert, 1, stamp->id);
    store_text_bind(insert, 2, stamp->at);
    store_text_bind(insert, 3, c->boot_id);
    sqlite3_bind_int64(insert, 4, c->boottime_ms);
    sqlite3_bind_int64(insert, 5, instrument);
    sqlite3_bind_text(insert, 6, c->step, -1, SQLITE_STATIC);
    store_text_bind(insert, 7, c->tile);
    store_text_bind(insert, 8, c->operator_name);
    sqlite3_bind_double(insert, 9, c->aperture_mm); /* NAN is NULL */
    s = sql_step_done(insert);
    if (s == STATUS_OK)
        s = audit_append(&store->audit, stamp->at, c->operator_name, AUDIT_CALIBRATION, stamp->id);
    return s;
}

enum status store_add_calibration(struct store *store, struct store_calibration *calibration)
{
    struct store_stamp stamp;
    enum status s = store_job_begin(store);
    if (s == STATUS_OK)
        s = store_job_end(store, "keep a calibration",
                          insert_calibration(store, calibration, &stamp));
    if (s != STATUS_OK)
        return s;
    memcpy(calibration->id, stamp.id, sizeof calibration->id);
    memcpy(calibration->taken_at, stamp.at, sizeof calibration->taken_at);
    return STATUS_OK;
}

/* ---- subjects ----------------------------------------------------------------------- */

static enum status insert_subject(struct store *store, const struct store_subject *subject,
                                  const char *who, char id[STORE_UUID_SIZE])
{
    sqlite3_stmt *insert = store->statement[SQL_ADD_SUBJECT];
    sqlite3_stmt *person = store->statement[SQL_ADD_PERSON];
    struct store_stamp stamp;
    enum status s = uuid4_make(id);
    if (s != STATUS_OK)
        return s;
    store_text_bind(insert, 1, id);
    s = sql_step_done(insert);
    if (s != STATUS_OK)
        return s;
    store_text_bind(person, 1, id);
    store_text_bind(person, 2, subject->label);
    store_text_bind(person, 3, subject->name);
    if (subject->birth_year != 0)
        sqlite3_bind_int(person, 4, subject->birth_year);
    else
        sqlite3_bind_null(person, 4);
    store_text_bind(person, 5, subject->notes);
    s = sql_step_done(person);
    sqlite3_clear_bindings(person);
    stamp_time(store, &stamp);
    if (s == STATUS_OK)
        s = audit_append(&store->audit, stamp.at, who, AUDIT_SUBJECT, id);
    return s;
}

enum status store_add_subject(struct store *store, struct store_subject *subject, const char *who)
{
    char id[STORE_UUID_SIZE];
    enum status s = store_job_begin(store);
    if (s == STATUS_OK)
        s = store_job_end(store, "keep a subject", insert_subject(store, subject, who, id));
    if (s != STATUS_OK)
        return s;
    memcpy(subject->id, id, sizeof subject->id);
    subject->forgotten = false;
    return STATUS_OK;
}

/* ---- the rest ----------------------------------------------------------------------- */

enum status store_highest_fence(struct store *store, int64_t *ret)
{
    enum status s = find_key(store->statement[SQL_HIGHEST_FENCE], ret);
    if (s != STATUS_OK)
        log_error("store: cannot read the highest fence: %s", sql_reason(store->db));
    return s;
}

enum status store_prune(struct store *store)
{
    sqlite3_stmt *prune = store->statement[SQL_PRUNE];
    enum status s = store_job_begin(store);
    if (s != STATUS_OK)
        return s;
    sqlite3_bind_int64(prune, 1, store_now_ms(&store->clock) - UUID_DAYS * DAY_MS);
    return store_job_end(store, "prune uuids", sql_step_done(prune));
}
