/* store_read.c - readers: a connection each, no snapshot between calls. */
#include "db/store.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/station_schema.h"
#include "db/store_private.h"

static const char *const query_sql[STORE_QUERIES] = {
    [QUERY_BY_ID] = STORE_RECORD_SELECT "WHERE m.id = ?",
    [QUERY_BY_UUID] =
        STORE_RECORD_SELECT "WHERE m.seq = (SELECT measurement FROM client_uuid WHERE uuid = ?)",
    [QUERY_NEWEST] = "SELECT max(seq) FROM measurement",
    [QUERY_NEXT] = STORE_RECORD_SELECT "WHERE m.seq > ?1 AND m.seq <= ?2 ORDER BY m.seq LIMIT 1",
    [QUERY_NEXT_OF_SUBJECT] = STORE_RECORD_SELECT
    "WHERE m.subject = ?3 AND m.seq > ?1 AND m.seq <= ?2 ORDER BY m.seq LIMIT 1",
    [QUERY_SUBJECT] = "SELECT s.rowid, s.id, p.label, p.name, p.birth_year, p.notes,"
                      " p.subject IS NULL FROM subject s"
                      " LEFT JOIN subject_person p ON p.subject = s.id"
                      " WHERE s.rowid > ? ORDER BY s.rowid LIMIT 1",
    [QUERY_SITE] = "SELECT id, name FROM site WHERE id > ? ORDER BY id LIMIT 1",
    [QUERY_CALIBRATION] =
        "SELECT c.id, c.taken_at, c.boot_id, c.boottime_ms, c.step, c.tile, c.operator,"
        " i.driver, i.maker, i.model, i.serial, i.firmware"
        " FROM instrument i JOIN calibration c ON c.instrument = i.id AND c.step = ?5"
        " WHERE i.driver = ?1 AND i.maker = ?2 AND i.model = ?3 AND i.serial = ?4"
        " ORDER BY c.id DESC LIMIT 1",
};

/* ---- opening ------------------------------------------------------------------------------ */

/* station.db, or what it was moved to. */
static enum status find_file(const char *folder, char path[STORE_PATH_SIZE], bool *aside)
{
    char name[STORE_TEXT_SIZE];
    enum status s = store_folder_fits(folder);
    if (s != STATUS_OK)
        return s;
    *aside = store_is_put_aside(folder, name) && *name != '\0' &&
             access(store_path(folder, name, path), F_OK) == 0;
    if (*aside || access(store_path(folder, STORE_FILE, path), F_OK) == 0)
        return STATUS_OK;
    if (errno == ENOENT)
        return STATUS_NOT_FOUND;
    log_error("store: '%s': %s", path, strerror(errno));
    return STATUS_IO;
}

static enum status look(sqlite3 *db, int *version)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, "PRAGMA user_version", &select);
    if (s == STATUS_OK)
        s = sql_status(sqlite3_step(select));
    if (s == STATUS_OK)
        *version = sqlite3_column_int(select, 0);
    sqlite3_finalize(select);
    return s;
}

/* SQLite wants to write -shm beside a WAL database even to read it.  In a folder that
 * cannot be written nobody writes: without a WAL the file is all there is. */
static enum status connect_reader(const char *path, bool aside, sqlite3 **ret, int *version)
{
    sqlite3 *db = NULL;
    enum status s =
        aside ? store_connect_aside(path, &db) : store_connect(path, SQLITE_OPEN_READONLY, &db);
    if (s == STATUS_OK)
        s = look(db, version);
    if (s == STATUS_IO && db != NULL && !store_has_wal(path)) {
        sqlite3_close(db);
        db = NULL;
        s = store_connect_alone(path, &db);
        if (s == STATUS_OK)
            s = look(db, version);
    }
    if (db == NULL) /* logged */
        return s;
    if (s == STATUS_OK)
        s = sql_run(db, "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;"
                        "PRAGMA temp_store = MEMORY;");
    if (s != STATUS_OK)
        log_error("store: cannot read '%s': %s", path, sql_reason(db));
    *ret = db;
    return s;
}

enum status store_reader_open(const char *state_folder, struct store_reader **ret)
{
    char path[STORE_PATH_SIZE];
    int version = 0;
    bool aside;
    enum status s = find_file(state_folder, path, &aside);
    if (s != STATUS_OK)
        return s;
    struct store_reader *reader = calloc(1, sizeof *reader);
    if (reader == NULL)
        return STATUS_NO_MEMORY;
    s = connect_reader(path, aside, &reader->db, &version);
    if (s == STATUS_OK && version != station_version()) {
        log_error("store: '%s' is of version %d, this program reads version %d", path, version,
                  station_version());
        s = STATUS_VERSION;
    }
    for (size_t i = 0; i < STORE_QUERIES && s == STATUS_OK; i++) {
        s = sql_prepare(reader->db, query_sql[i], &reader->query[i]);
        if (s != STATUS_OK)
            log_error("store: cannot read '%s': %s", path, sql_reason(reader->db));
    }
    if (s == STATUS_OK)
        *ret = reader;
    else
        store_reader_close(reader);
    return s;
}

void store_reader_close(struct store_reader *reader)
{
    if (reader == NULL)
        return;
    for (size_t i = 0; i < STORE_QUERIES; i++)
        sqlite3_finalize(reader->query[i]);
    sqlite3_close(reader->db);
    free(reader);
}

void store_reader_interrupt(struct store_reader *reader)
{
    sqlite3_interrupt(reader->db);
}

/* ---- one row at a time ------------------------------------------------------------------------
 */

/* Step to a row: STATUS_OK, STATUS_NOT_FOUND after the last, STATUS_CANCELLED, or a
 * failure, which is logged. */
static enum status next_row(struct store_reader *reader, sqlite3_stmt *query)
{
    int stepped = sqlite3_step(query);
    if (stepped == SQLITE_ROW)
        return STATUS_OK;
    if (stepped == SQLITE_DONE)
        return STATUS_NOT_FOUND;
    if (stepped == SQLITE_INTERRUPT)
        return STATUS_CANCELLED;
    log_error("store: cannot read: %s", sql_reason(reader->db));
    return sql_status(stepped);
}

static enum status read_record(struct store_reader *reader, sqlite3_stmt *query,
                               struct store_record *ret)
{
    enum status s = next_row(reader, query);
    if (s == STATUS_OK) {
        s = store_record_read(query, ret);
        if (s != STATUS_OK)
            log_error("store: record %lld: %s", (long long)ret->seq, status_text(s));
    }
    sqlite3_reset(query);
    return s;
}

enum status store_get(struct store_reader *reader, const char *id, const char *uuid,
                      struct store_record *ret)
{
    sqlite3_stmt *query = reader->query[id != NULL ? QUERY_BY_ID : QUERY_BY_UUID];
    store_text_bind(query, 1, id != NULL ? id : uuid);
    return read_record(reader, query, ret);
}

static enum status newest_seq(struct store_reader *reader, int64_t *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_NEWEST];
    enum status s = next_row(reader, query);
    if (s == STATUS_OK)
        *ret = sqlite3_column_int64(query, 0);
    sqlite3_reset(query);
    return s;
}

enum status store_list(struct store_reader *reader, int64_t since_seq, const char *subject,
                       store_visit *visit, void *context)
{
    sqlite3_stmt *query = reader->query[subject != NULL ? QUERY_NEXT_OF_SUBJECT : QUERY_NEXT];
    int64_t newest = 0;
    struct store_record *record = malloc(sizeof *record);
    if (record == NULL)
        return STATUS_NO_MEMORY;
    enum status s = newest_seq(reader, &newest);
    if (s == STATUS_OK && subject != NULL)
        store_text_bind(query, 3, subject);
    for (int64_t since = since_seq; s == STATUS_OK;) {
        sqlite3_bind_int64(query, 1, since);
        sqlite3_bind_int64(query, 2, newest);
        s = read_record(reader, query, record);
        if (s != STATUS_OK || !visit(context, record))
            break;
        since = record->seq;
    }
    free(record);
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

static int64_t read_subject(sqlite3_stmt *query, struct store_subject *ret)
{
    store_text_read(query, 1, ret->id, sizeof ret->id);
    store_text_read(query, 2, ret->label, sizeof ret->label);
    store_text_read(query, 3, ret->name, sizeof ret->name);
    ret->birth_year = sqlite3_column_int(query, 4);
    store_text_read(query, 5, ret->notes, sizeof ret->notes);
    ret->forgotten = sqlite3_column_int(query, 6) != 0;
    return sqlite3_column_int64(query, 0);
}

enum status store_list_subjects(struct store_reader *reader, store_visit_subject *visit,
                                void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_SUBJECT];
    struct store_subject subject = { .birth_year = 0 };
    enum status s = STATUS_OK;
    for (int64_t since = 0; s == STATUS_OK;) {
        sqlite3_bind_int64(query, 1, since);
        s = next_row(reader, query);
        if (s == STATUS_OK)
            since = read_subject(query, &subject);
        sqlite3_reset(query);
        if (s == STATUS_OK && !visit(context, &subject))
            break;
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

enum status store_list_sites(struct store_reader *reader, store_visit_text *visit, void *context)
{
    sqlite3_stmt *query = reader->query[QUERY_SITE];
    char name[STORE_TEXT_SIZE];
    enum status s = STATUS_OK;
    for (int64_t since = 0; s == STATUS_OK;) {
        sqlite3_bind_int64(query, 1, since);
        s = next_row(reader, query);
        if (s == STATUS_OK) {
            since = sqlite3_column_int64(query, 0);
            store_text_read(query, 1, name, sizeof name);
        }
        sqlite3_reset(query);
        if (s == STATUS_OK && !visit(context, name))
            break;
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

static void read_calibration(sqlite3_stmt *query, struct store_calibration *ret)
{
    store_text_read(query, 0, ret->id, sizeof ret->id);
    store_text_read(query, 1, ret->taken_at, sizeof ret->taken_at);
    store_text_read(query, 2, ret->boot_id, sizeof ret->boot_id);
    ret->boottime_ms = sqlite3_column_int64(query, 3);
    store_text_read(query, 4, ret->step, sizeof ret->step);
    store_text_read(query, 5, ret->tile, sizeof ret->tile);
    store_text_read(query, 6, ret->operator_name, sizeof ret->operator_name);
    store_text_read(query, 7, ret->instrument.driver, sizeof ret->instrument.driver);
    store_text_read(query, 8, ret->instrument.maker, sizeof ret->instrument.maker);
    store_text_read(query, 9, ret->instrument.model, sizeof ret->instrument.model);
    store_text_read(query, 10, ret->instrument.serial, sizeof ret->instrument.serial);
    store_text_read(query, 11, ret->instrument.firmware, sizeof ret->instrument.firmware);
}

enum status store_last_calibration(struct store_reader *reader,
                                   const struct store_instrument *instrument, const char *step,
                                   struct store_calibration *ret)
{
    sqlite3_stmt *query = reader->query[QUERY_CALIBRATION];
    const char *const texts[] = { instrument->driver, instrument->maker, instrument->model,
                                  instrument->serial, step };
    for (int i = 0; i < 5; i++)
        sqlite3_bind_text(query, i + 1, texts[i], -1, SQLITE_STATIC);
    enum status s = next_row(reader, query);
    if (s == STATUS_OK)
        read_calibration(query, ret);
    sqlite3_reset(query);
    return s;
}
