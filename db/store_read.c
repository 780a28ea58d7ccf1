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

#define OF_INSTRUMENT "i.driver = ?1 AND i.maker = ?2 AND i.model = ?3 AND i.serial = ?4"
#define NEXT "m.seq > ?1 AND m.seq <= ?2 ORDER BY m.seq LIMIT 1"

/* + keeps SQLite from the index of owners: a subject has fewer records than they. */
static const char *const query_sql[READER_QUERIES] = {
    [QUERY_BY_ID] = STORE_RECORD_SELECT "WHERE m.id = ?",
    [QUERY_BY_UUID] =
        STORE_RECORD_SELECT "WHERE m.seq = (SELECT measurement FROM client_uuid WHERE uuid = ?)",
    [QUERY_RAW] = "SELECT raw FROM measurement WHERE id = ?",
    [QUERY_STATION] = "SELECT id FROM station",
    [QUERY_NEWEST] = "SELECT max(seq) FROM measurement",
    [QUERY_HIGHEST_FENCE] = STORE_HIGHEST_FENCE,
    [QUERY_NEXT] = STORE_RECORD_SELECT "WHERE " NEXT,
    [QUERY_NEXT_OF_SUBJECT] = STORE_RECORD_SELECT "WHERE m.subject = ?3 AND " NEXT,
    [QUERY_NEXT_OF_OWNER] = STORE_RECORD_SELECT "WHERE m.owner_uid = ?4 AND " NEXT,
    [QUERY_NEXT_OF_BOTH] =
        STORE_RECORD_SELECT "WHERE m.subject = ?3 AND +m.owner_uid = ?4 AND " NEXT,
    [QUERY_SUBJECT_ROW] = "SELECT rowid FROM subject WHERE id = ?",
    [QUERY_SUBJECT] = "SELECT s.rowid, s.id, p.label, p.name, p.birth_year, p.notes,"
                      " p.subject IS NULL FROM subject s"
                      " LEFT JOIN subject_person p ON p.subject = s.id"
                      " WHERE s.rowid > ? ORDER BY s.rowid LIMIT 1",
    [QUERY_SITE] = "SELECT id, name FROM site WHERE id > ? ORDER BY id LIMIT 1",
    [QUERY_CALIBRATION] =
        "SELECT c.id, c.taken_at, c.boot_id, c.boottime_ms, c.step, c.tile, c.operator,"
        " c.aperture_mm,"
        " i.driver, i.maker, i.model, i.serial, i.firmware"
        " FROM instrument i JOIN calibration c ON c.instrument = i.id AND c.step = ?5"
        " WHERE i.driver = ?1 AND i.maker = ?2 AND i.model = ?3 AND i.serial = ?4"
        " ORDER BY c.id DESC LIMIT 1",
    [QUERY_CHECK_TILE_BY_UUID] = STORE_CHECK_TILE_SELECT "WHERE t.uuid = ?",
    [QUERY_LAST_CHECK_TILE] =
        STORE_CHECK_TILE_SELECT "WHERE t.tile = ? ORDER BY t.seq DESC LIMIT 1",
    [QUERY_CHECK_REFERENCE] =
        STORE_CHECK_TILE_SELECT "WHERE t.tile = ?5 AND t.aperture_mm = ?6 AND"
                                " (t.instrument IS NULL OR (" OF_INSTRUMENT "))"
                                " ORDER BY t.seq DESC LIMIT 1",
    [QUERY_NEXT_CHECK_TILE] =
        STORE_CHECK_TILE_SELECT "WHERE t.seq = (SELECT max(seq) FROM check_tile WHERE tile ="
                                " (SELECT min(tile) FROM check_tile WHERE tile > ?))",
    [QUERY_CHECK_BY_UUID] = STORE_CHECK_SELECT "WHERE c.uuid = ?",
    [QUERY_NEXT_CHECK] =
        STORE_CHECK_SELECT "WHERE c.seq > ?6 AND (?5 IS NULL OR c.tile = ?5) AND"
                           " (?1 IS NULL OR (" OF_INSTRUMENT ")) ORDER BY c.seq LIMIT 1",
    [QUERY_LAST_CHECKS] =
        STORE_CHECK_SELECT "WHERE c.seq > ?5 AND c.seq IN (SELECT max(n.seq) FROM"
                           " check_reading n JOIN instrument i ON i.id = n.instrument WHERE"
                           " " OF_INSTRUMENT " GROUP BY n.tile, n.aperture_mm)"
                           " ORDER BY c.seq LIMIT 1",
};

/* ---- opening ------------------------------------------------------------------------ */

/* station.db, or what it was moved to. */
static enum status find_file(const char *folder, char path[STORE_PATH_SIZE], bool *aside)
{
    char name[STORE_TEXT_SIZE];
    enum status s = store_folder_fits(folder);
    if (s != STATUS_OK)
        return s;
    s = store_find_aside(folder, name);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND)
        return s;
    *aside = s == STATUS_OK && *name != '\0' && access(store_path(folder, name, path), F_OK) == 0;
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
        s = sql_status_of(db, sqlite3_step(select));
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
    if ((s == STATUS_IO || s == STATUS_READ_ONLY) && db != NULL && !store_has_wal(path)) {
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
        if (version == 0)
            log_error("store: '%s' is no station's store", path);
        else
            log_error("store: '%s' is of version %d, this program reads version %d", path, version,
                      station_version());
        s = STATUS_VERSION;
    }
    for (size_t i = 0; i < READER_QUERIES && s == STATUS_OK; i++) {
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
    for (size_t i = 0; i < READER_QUERIES; i++)
        sqlite3_finalize(reader->query[i]);
    sqlite3_close(reader->db);
    free(reader);
}

void store_reader_interrupt(struct store_reader *reader)
{
    sqlite3_interrupt(reader->db);
}

/* ---- one row at a time -------------------------------------------------------------- */

enum status store_reader_step(struct store_reader *reader, sqlite3_stmt *query)
{
    int stepped = sqlite3_step(query);
    if (stepped == SQLITE_ROW)
        return STATUS_OK;
    if (stepped == SQLITE_DONE)
        return STATUS_NOT_FOUND;
    if (stepped == SQLITE_INTERRUPT)
        return STATUS_CANCELLED;
    log_error("store: cannot read: %s", sql_reason(reader->db));
    return sql_status_of(reader->db, stepped);
}

enum status store_reader_record(struct store_reader *reader, sqlite3_stmt *query,
                                struct store_record *ret)
{
    enum status s = store_reader_step(reader, query);
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
    return store_reader_record(reader, query, ret);
}

enum status store_read_station_id(struct store_reader *reader, char ret[STORE_UUID_SIZE])
{
    sqlite3_stmt *query = reader->query[QUERY_STATION];
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        store_text_read(query, 0, ret, STORE_UUID_SIZE);
    sqlite3_reset(query);
    return s == STATUS_NOT_FOUND ? STATUS_DAMAGED : s;
}

/* A number, 0 where it is NULL. */
static enum status read_number(struct store_reader *reader, enum reader_query which, int64_t *ret)
{
    sqlite3_stmt *query = reader->query[which];
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        *ret = sqlite3_column_int64(query, 0);
    sqlite3_reset(query);
    return s;
}

enum status store_newest(struct store_reader *reader, int64_t *seq)
{
    return read_number(reader, QUERY_NEWEST, seq);
}

enum status store_max_fence(struct store_reader *reader, int64_t *ret)
{
    return read_number(reader, QUERY_HIGHEST_FENCE, ret);
}

enum status store_read_raw(struct store_reader *reader, const char *id, int32_t **ret, size_t *n)
{
    sqlite3_stmt *query = reader->query[QUERY_RAW];
    store_text_bind(query, 1, id);
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        s = store_raw_read(query, 0, ret, n);
    sqlite3_reset(query);
    return s;
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
    ret->aperture_mm = store_number_read(query, 7);
    store_text_read(query, 8, ret->instrument.driver, sizeof ret->instrument.driver);
    store_text_read(query, 9, ret->instrument.maker, sizeof ret->instrument.maker);
    store_text_read(query, 10, ret->instrument.model, sizeof ret->instrument.model);
    store_text_read(query, 11, ret->instrument.serial, sizeof ret->instrument.serial);
    store_text_read(query, 12, ret->instrument.firmware, sizeof ret->instrument.firmware);
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
    enum status s = store_reader_step(reader, query);
    if (s == STATUS_OK)
        read_calibration(query, ret);
    sqlite3_reset(query);
    return s;
}
