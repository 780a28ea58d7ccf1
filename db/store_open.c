/* store_open.c - make the file where there is none, check it, migrate it. */
#include "db/store.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "db/sql.h"
#include "db/station_schema.h"
#include "db/store_private.h"

void store_sync_folder(const char *folder)
{
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)fsync(fd); /* not every file system can; the files themselves are synced */
        close(fd);
    }
}

/* ---- a new file --------------------------------------------------------------------- */

/* secure_delete overwrites what is deleted, temp_store keeps copies of it off the disk.
 * cell_size_check notices more damage.  Checkpoints are the worker's; the WAL shrinks
 * again after a reader let it grow.  A bigger cache keeps a group in memory. */
static const char pragmas[] = "PRAGMA foreign_keys = ON; PRAGMA secure_delete = ON;"
                              "PRAGMA temp_store = MEMORY; PRAGMA cell_size_check = ON;"
                              "PRAGMA trusted_schema = OFF; PRAGMA synchronous = FULL;"
                              "PRAGMA wal_autocheckpoint = 0; PRAGMA cache_size = -8000;"
                              "PRAGMA journal_size_limit = 16777216;";

static enum status insert_station(sqlite3 *db, int64_t now_ms, int64_t first_seq)
{
    char id[STORE_UUID_SIZE], at[STORE_TIME_SIZE];
    struct audit audit = { .last = NULL };
    sqlite3_stmt *insert = NULL;
    clock_text(now_ms, at);
    enum status s = uuid4_make(id);
    if (s == STATUS_OK)
        s = sql_prepare(db, "INSERT INTO station VALUES (1, ?, ?, ?)", &insert);
    if (s == STATUS_OK) {
        store_text_bind(insert, 1, id);
        store_text_bind(insert, 2, at);
        sqlite3_bind_int64(insert, 3, first_seq);
        s = sql_step_done(insert);
    }
    sqlite3_finalize(insert);
    if (s == STATUS_OK)
        s = audit_prepare(db, &audit);
    if (s == STATUS_OK)
        s = audit_append(&audit, at, "", AUDIT_STATION, id);
    audit_done(&audit);
    return s;
}

static enum status fill(const char *path, int64_t now_ms, int64_t first_seq)
{
    sqlite3 *db;
    enum status s = store_connect(path, SQLITE_OPEN_READWRITE, &db);
    if (s != STATUS_OK)
        return s;
    s = sql_run(db, "PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF");
    if (s == STATUS_OK)
        s = station_migrate(db, station_steps, station_steps_n);
    if (s == STATUS_OK) {
        s = insert_station(db, now_ms, first_seq);
        if (s != STATUS_OK)
            log_error("store: cannot make '%s': %s", path, sql_reason(db));
    }
    sqlite3_close(db);
    return s;
}

/* Synced before it gets its name.  And closed: once it has its name another thread may open
 * it, whose locks this descriptor would take along. */
static enum status seal_and_name(int fd, const char *temporary, const char *path)
{
    bool good = fsync(fd) == 0;
    int cause = errno;
    close(fd);
    if (good && rename(temporary, path) == 0)
        return STATUS_OK;
    cause = good ? errno : cause;
    log_error("store: cannot make '%s': %s", path, strerror(cause));
    return sql_errno_status(cause);
}

enum status store_make(const char *folder, int64_t now_ms, int64_t first_seq)
{
    char path[STORE_PATH_SIZE], temporary[STORE_PATH_SIZE];
    store_path(folder, STORE_FILE, path);
    store_path(folder, STORE_FILE ".new", temporary);
    (void)unlink(temporary); /* of one that was killed here */
    int fd = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0) {
        enum status refused = sql_errno_status(errno);
        log_error("store: cannot make '%s': %s", temporary, strerror(errno));
        return refused;
    }
    enum status s = fill(temporary, now_ms, first_seq);
    if (s == STATUS_OK)
        s = seal_and_name(fd, temporary, path);
    else
        close(fd);
    if (s == STATUS_OK)
        store_sync_folder(folder);
    else
        (void)unlink(temporary);
    return s;
}

/* ---- an old one --------------------------------------------------------------------- */

/* STATUS_DAMAGED with SQLite's words where quick_check finds something. */
static enum status check(sqlite3 *db, char why[STORE_WHY_SIZE])
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, "PRAGMA quick_check(1)", &select);
    if (s == STATUS_OK)
        s = sql_status(sqlite3_step(select));
    if (s == STATUS_OK) {
        const char *text = (const char *)sqlite3_column_text(select, 0);
        if (text == NULL)
            s = STATUS_NO_MEMORY;
        else if (strcmp(text, "ok") != 0)
            s = STATUS_DAMAGED;
        snprintf(why, STORE_WHY_SIZE, "%s", text != NULL ? text : "");
    } else {
        snprintf(why, STORE_WHY_SIZE, "%s", sql_reason(db));
    }
    sqlite3_finalize(select);
    return s == STATUS_FORMAT ? STATUS_DAMAGED : s; /* its header was ours */
}

/* Open, check and set up; STATUS_DAMAGED is not logged yet. */
static enum status connect_checked(const char *path, sqlite3 **ret, char why[STORE_WHY_SIZE])
{
    sqlite3 *db;
    enum status s = store_connect(path, SQLITE_OPEN_READWRITE, &db);
    if (s != STATUS_OK)
        return s;
    s = check(db, why);
    if (s == STATUS_OK) {
        s = sql_run(db, pragmas);
        if (s == STATUS_OK)
            s = sql_run(db, "PRAGMA journal_mode = WAL");
        snprintf(why, STORE_WHY_SIZE, "%s", sql_reason(db));
    }
    if (s == STATUS_OK) {
        *ret = db;
        return STATUS_OK;
    }
    if (s != STATUS_DAMAGED)
        log_error("store: cannot open '%s': %s", path, why);
    sqlite3_close(db);
    return s;
}

/* The file as it is, or a new one; what is damaged goes aside. */
static enum status connect_file(const char *folder, int64_t now_ms, sqlite3 **ret)
{
    char path[STORE_PATH_SIZE], sqlite_says[STORE_WHY_SIZE];
    const char *why = sqlite_says;
    enum status s = store_judge(folder, &why);
    if (s == STATUS_NOT_FOUND)
        s = store_make(folder, now_ms, 1);
    if (s == STATUS_OK) {
        why = sqlite_says;
        s = connect_checked(store_path(folder, STORE_FILE, path), ret, sqlite_says);
    }
    if (s == STATUS_DAMAGED)
        store_put_aside(folder, now_ms, why);
    return s;
}

static void remember_id(struct store *store, sqlite3_stmt *select)
{
    const char *id = (const char *)sqlite3_column_text(select, 0);
    if (id != NULL)
        (void)uuid7_continue(&store->ids, id); /* one that is none was never ours */
}

/* Who we are, and the highest ids so far: new ones go on above them. */
static enum status read_ids(struct store *store)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(store->db,
                                "SELECT id FROM (SELECT id FROM measurement ORDER BY seq DESC"
                                " LIMIT 1) UNION ALL SELECT max(id) FROM calibration"
                                " UNION ALL SELECT id FROM (SELECT id FROM check_tile"
                                " ORDER BY seq DESC LIMIT 1)"
                                " UNION ALL SELECT id FROM (SELECT id FROM check_reading"
                                " ORDER BY seq DESC LIMIT 1)",
                                &select);
    int stepped = SQLITE_DONE;
    while (s == STATUS_OK && (stepped = sqlite3_step(select)) == SQLITE_ROW)
        remember_id(store, select);
    s = s == STATUS_OK ? sql_status(stepped) : s;
    sqlite3_finalize(select);
    if (s != STATUS_OK)
        return s;
    s = sql_prepare(store->db, "SELECT id FROM station", &select);
    if (s == STATUS_OK) {
        stepped = sqlite3_step(select);
        store_text_read(select, 0, store->station_id, sizeof store->station_id);
        s = stepped == SQLITE_DONE ? STATUS_DAMAGED : sql_status(stepped);
    }
    sqlite3_finalize(select);
    return s;
}

static enum status set_up(struct store *store, const char *folder)
{
    bool erased;
    enum status s = station_migrate(store->db, station_steps, station_steps_n);
    if (s != STATUS_OK)
        return s;
    s = store_prepare(store);
    if (s == STATUS_OK)
        s = read_ids(store);
    if (s != STATUS_OK) {
        log_error("store: cannot open '%s/" STORE_FILE "': %s", folder,
                  s == STATUS_DAMAGED ? "it does not say whose it is" : sql_reason(store->db));
        return s;
    }
    /* Whoever was forgotten just before a crash may still stand in the WAL. */
    store->erasing = true;
    (void)store_finish_erasing(store, &erased);
    store_remember_files(&store->files, folder);
    (void)sqlite3_db_config(store->db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, NULL);
    store->ready = true;
    return STATUS_OK;
}

static enum status not_put_aside(const char *folder)
{
    char aside[STORE_TEXT_SIZE];
    enum status s = store_find_aside(folder, aside);
    if (s != STATUS_OK)
        return s == STATUS_NOT_FOUND ? STATUS_OK : s;
    log_error("store: '%s/%s' was damaged and is kept; nothing is stored until an empty "
              "store is accepted",
              folder, aside);
    return STATUS_DAMAGED;
}

enum status store_open_claimed(struct store_claim *claim, const struct store_clock *clock,
                               struct store **ret)
{
    const char *folder = claim->folder;
    enum status s = not_put_aside(folder);
    if (s != STATUS_OK)
        return s;
    struct store *store = calloc(1, sizeof *store);
    if (store == NULL)
        return STATUS_NO_MEMORY;
    if (clock != NULL)
        store->clock = *clock;
    s = connect_file(folder, store_now_ms(&store->clock), &store->db);
    if (s == STATUS_OK)
        s = set_up(store, folder);
    if (s == STATUS_OK)
        *ret = store;
    else
        store_close(store);
    return s;
}

enum status store_open(const char *state_folder, const struct store_clock *clock,
                       struct store **ret)
{
    struct store_claim *claim;
    enum status s = store_claim(state_folder, &claim);
    if (s != STATUS_OK)
        return s;
    s = store_open_claimed(claim, clock, ret);
    if (s == STATUS_OK)
        (*ret)->claim = claim;
    else
        store_claim_release(claim);
    return s;
}

/* Readers that are still there keep SQLite from doing this by itself.  A damaged file
 * is left as it is, and so is the WAL of a station.db that has lost its name: it would be
 * emptied into nowhere.  A WAL that lost its own is emptied while this one still holds it. */
static void last_checkpoint(struct store *store)
{
    bool erased;
    if (store->damaged || store_database_moved(&store->files)) {
        (void)sqlite3_db_config(store->db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
        return;
    }
    store->erasing = true;
    (void)store_finish_erasing(store, &erased);
}

void store_close(struct store *store)
{
    if (store == NULL)
        return;
    if (store->in_group)
        store_rollback(store);
    if (store->ready)
        last_checkpoint(store);
    for (size_t i = 0; i < STORE_STATEMENTS; i++)
        sqlite3_finalize(store->statement[i]);
    audit_done(&store->audit);
    sqlite3_close(store->db);
    store_claim_release(store->claim);
    free(store);
}
