/* store.c - groups of jobs, and what all parts of the store use. */
#include "db/store.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

/* All SQL that writes.  In each group the first seq is taken from the table itself, so that
 * what is rolled back leaves no gap. */
static const char *const statement_sql[STORE_STATEMENTS] = {
    [SQL_BEGIN] = "BEGIN IMMEDIATE",
    [SQL_COMMIT] = "COMMIT",
    [SQL_ROLLBACK] = "ROLLBACK",
    [SQL_SAVEPOINT] = "SAVEPOINT job",
    [SQL_RELEASE] = "RELEASE job",
    [SQL_ROLLBACK_TO] = "ROLLBACK TO job",
    [SQL_FIND_UUID] = ("SELECT u.parameters_sha256, m.seq, m.id, m.taken_at FROM client_uuid u"
                       " JOIN measurement m ON m.seq = u.measurement WHERE u.uuid = ?"),
    [SQL_FIND_SUBJECT] = "SELECT 1 FROM subject_person WHERE subject = ?",
    [SQL_FIND_CALIBRATION] = "SELECT 1 FROM calibration WHERE id = ?",
    [SQL_FIND_MEASUREMENT] = "SELECT 1 FROM measurement WHERE id = ?",
    [SQL_FIND_INSTRUMENT] = ("SELECT id FROM instrument WHERE driver = ? AND maker = ?"
                             " AND model = ? AND serial = ? AND firmware = ?"),
    [SQL_FIND_SITE] = "SELECT id FROM site WHERE name = ?",
    [SQL_ADD_INSTRUMENT] = "INSERT INTO instrument VALUES (NULL,?,?,?,?,?)",
    [SQL_ADD_SITE] = "INSERT INTO site VALUES (NULL,?)",
    [SQL_ADD_CALIBRATION] = "INSERT INTO calibration VALUES (?,?,?,?,?,?,?,?,?)",
    [SQL_ADD_SUBJECT] = "INSERT INTO subject VALUES (?)",
    [SQL_ADD_PERSON] = "INSERT INTO subject_person VALUES (?,?,?,?,?)",
    [SQL_NEXT_SEQ] = ("SELECT coalesce(max(seq) + 1, (SELECT first_seq FROM station))"
                      " FROM measurement"),
    [SQL_ADD_MEASUREMENT] =
        ("INSERT INTO measurement VALUES "
         "(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"),
    [SQL_ADD_MATCH] = "INSERT INTO match VALUES (?,?,?,?,?,?)",
    [SQL_ADD_UUID] = "INSERT INTO client_uuid VALUES (?,?,?,?)",
    [SQL_PRUNE] = ("DELETE FROM client_uuid WHERE at_ms < ? AND measurement <="
                   " (SELECT max(seq) FROM measurement) - 1000"),
    [SQL_HIGHEST_FENCE] = STORE_HIGHEST_FENCE,
    [SQL_FIND_CHECK_TILE] = "SELECT 1 FROM check_tile WHERE id = ?",
    [SQL_ADD_CHECK_TILE] = ("INSERT INTO check_tile VALUES "
                            "(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"),
    [SQL_GET_CHECK_TILE] = (STORE_CHECK_TILE_SELECT "WHERE t.uuid = ?"),
    [SQL_NEXT_CHECK_TILE] = "SELECT coalesce(max(seq), 0) + 1 FROM check_tile",
    [SQL_NEXT_CHECK] = "SELECT coalesce(max(seq), 0) + 1 FROM check_reading",
    [SQL_ADD_CHECK] = ("INSERT INTO check_reading VALUES "
                       "(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)"),
    [SQL_GET_CHECK] = (STORE_CHECK_SELECT "WHERE c.uuid = ?"),
};

enum status store_prepare(struct store *store)
{
    enum status s = STATUS_OK;
    for (size_t i = 0; i < STORE_STATEMENTS && s == STATUS_OK; i++)
        s = sql_prepare(store->db, statement_sql[i], &store->statement[i]);
    return s == STATUS_OK ? audit_prepare(store->db, &store->audit) : s;
}

/* ---- the clock, paths, connections -------------------------------------------------- */

int64_t store_now_ms(const struct store_clock *clock)
{
    if (clock != NULL && clock->realtime_ms != NULL)
        return clock->realtime_ms(clock->context);
    return clock_realtime_ms();
}

enum status store_folder_fits(const char *folder)
{
    /* The longest name is that of a file moved aside, with its "-wal". */
    if (strlen(folder) + STORE_TEXT_SIZE + 16 < STORE_PATH_SIZE)
        return STATUS_OK;
    log_error("store: '%.64s...': %s", folder, strerror(ENAMETOOLONG));
    return STATUS_IO;
}

const char *store_path(const char *folder, const char *name, char path[STORE_PATH_SIZE])
{
    snprintf(path, STORE_PATH_SIZE, "%s/%s", folder, name);
    return path;
}

enum status store_connect(const char *path, int flags, sqlite3 **ret)
{
    sqlite3 *db = NULL;
    int code = sqlite3_open_v2(path, &db, flags | SQLITE_OPEN_NOMUTEX, NULL);
    /* Not allowed to read is another matter than not to write. */
    bool to_read = (flags & SQLITE_OPEN_READONLY) != 0;
    enum status s = to_read ? sql_status(code) : sql_status_of(db, code);
    if (s == STATUS_OK)
        s = sql_status(sqlite3_db_config(db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL));
    if (s == STATUS_OK)
        s = sql_status(sqlite3_busy_timeout(db, STORE_PATIENCE_MS));
    if (s == STATUS_OK) {
        *ret = db;
        return STATUS_OK;
    }
    log_error("store: cannot open '%s': %s", path, sql_reason(db));
    sqlite3_close(db);
    return s;
}

/* "file:PATH?immutable=1" with the characters that mean something in it escaped. */
static char *uri_of(const char *path)
{
    static const char tail[] = "?immutable=1";
    char *uri = malloc(5 + 3 * strlen(path) + sizeof tail);
    if (uri == NULL)
        return NULL;
    char *to = uri + sprintf(uri, "file:");
    for (; *path != '\0'; path++)
        to += strchr("?#%", *path) != NULL ? sprintf(to, "%%%02x", (unsigned)*path)
                                           : sprintf(to, "%c", *path);
    memcpy(to, tail, sizeof tail);
    return uri;
}

enum status store_connect_alone(const char *path, sqlite3 **ret)
{
    char *uri = uri_of(path);
    if (uri == NULL)
        return STATUS_NO_MEMORY;
    enum status s = store_connect(uri, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, ret);
    free(uri);
    return s;
}

bool store_has_wal(const char *path)
{
    char wal[STORE_PATH_SIZE + 8];
    struct stat st;
    snprintf(wal, sizeof wal, "%s-wal", path);
    return stat(wal, &st) == 0 && st.st_size > 0;
}

void store_remember_files(struct store_files *files, const char *folder)
{
    static const char *const name[STORE_FILES] = { STORE_FILE, STORE_FILE "-wal" };
    for (size_t i = 0; i < STORE_FILES; i++) {
        struct stat st;
        if (stat(store_path(folder, name[i], files->file[i].path), &st) == 0)
            files->file[i].inode = st.st_ino;
    }
}

static bool is_moved(const struct store_files *files, size_t i)
{
    struct stat st;
    return stat(files->file[i].path, &st) != 0 || st.st_ino != files->file[i].inode;
}

bool store_database_moved(const struct store_files *files)
{
    return is_moved(files, 0);
}

bool store_files_moved(const struct store_files *files)
{
    return is_moved(files, 0) || is_moved(files, 1);
}

/* ---- groups and jobs ---------------------------------------------------------------- */

/* What is kept of the ends of seq and of the chain holds no longer. */
static void forget_ends(struct store *store)
{
    store->next_seq = 0;
    audit_forget_tail(&store->audit);
}

/* Only where SQLite has not rolled back already, as it does on a full disk. */
static void roll_back(struct store *store)
{
    if (!sqlite3_get_autocommit(store->db))
        (void)sql_step_done(store->statement[SQL_ROLLBACK]);
    forget_ends(store);
    store->in_group = store->together = store->must_part = false;
    store->group = STATUS_OK;
}

static bool is_answer(enum status s)
{
    return s == STATUS_NOT_FOUND || s == STATUS_EXISTS || s == STATUS_RANGE;
}

/* Why it failed: SQLite's reason, unless the failure was not SQLite's. */
static const char *reason(sqlite3 *db, enum status s)
{
    int code = sqlite3_errcode(db);
    bool sqlite_failed = code != SQLITE_OK && code != SQLITE_ROW && code != SQLITE_DONE;
    return sqlite_failed ? sql_reason(db) : status_text(s);
}

/* Log a failure while SQLite still knows why, and stop writing into a damaged file. */
static enum status report(struct store *store, const char *what, enum status s)
{
    if (s == STATUS_OK || is_answer(s))
        return s;
    log_error("store: cannot %s: %s", what, reason(store->db, s));
    store->damaged = store->damaged || s == STATUS_DAMAGED;
    return s;
}

enum status store_begin(struct store *store)
{
    if (store->damaged)
        return STATUS_DAMAGED; /* logged when it was met */
    if (store_files_moved(&store->files)) {
        log_error("store: " STORE_FILE " or its -wal was moved or deleted; "
                  "nothing is stored until it is opened anew");
        return STATUS_IO;
    }
    roll_back(store); /* one whose own rollback failed, for want of memory */
    enum status s = report(store, "begin", sql_step_done(store->statement[SQL_BEGIN]));
    store->in_group = s == STATUS_OK;
    store->group = STATUS_OK;
    return s;
}

enum status store_begin_together(struct store *store)
{
    enum status s = store_begin(store);
    store->together = s == STATUS_OK;
    return s;
}

bool store_must_part(const struct store *store)
{
    return store->must_part;
}

enum status store_commit(struct store *store)
{
    enum status s = store->group;
    if (s == STATUS_OK)
        s = report(store, "commit", sql_step_done(store->statement[SQL_COMMIT]));
    roll_back(store); /* nothing to do after a commit */
    return s;
}

void store_rollback(struct store *store)
{
    roll_back(store);
}

enum status store_job_begin(struct store *store)
{
    if (!store->in_group) {
        enum status s = store_begin(store);
        store->single = s == STATUS_OK;
        return s;
    }
    if (store->group != STATUS_OK)
        return store->group;
    store->changes = sqlite3_total_changes64(store->db);
    return store->together ? STATUS_OK
                           : report(store, "begin", sql_step_done(store->statement[SQL_SAVEPOINT]));
}

/* The job is undone and the group goes on, unless the group went with it. */
static void drop_job(struct store *store, enum status s)
{
    forget_ends(store);
    if (store->damaged || sqlite3_get_autocommit(store->db)) {
        store->group = s;
        return;
    }
    store->group = sql_step_done(store->statement[SQL_ROLLBACK_TO]);
    if (store->group == STATUS_OK)
        store->group = sql_step_done(store->statement[SQL_RELEASE]);
}

/* Without a savepoint: one that was refused before it changed anything leaves nothing to
 * undo, and one that took the transaction along leaves nothing at all.  Any other takes the
 * group along; it is told when it fails again, with a savepoint. */
static enum status end_together(struct store *store, const char *what, enum status s)
{
    bool untouched = sqlite3_total_changes64(store->db) == store->changes;
    if (s == STATUS_OK || (is_answer(s) && untouched))
        return s;
    if (s == STATUS_DAMAGED || sqlite3_get_autocommit(store->db)) {
        s = report(store, what, s);
        drop_job(store, s);
        return s;
    }
    store->must_part = true;
    store->group = s;
    return s;
}

enum status store_job_end(struct store *store, const char *what, enum status s)
{
    if (store->together)
        return end_together(store, what, s);
    s = report(store, what, s);
    if (store->single) {
        store->single = false;
        if (s == STATUS_OK)
            return store_commit(store);
        roll_back(store);
        return s;
    }
    if (s == STATUS_OK)
        s = report(store, what, sql_step_done(store->statement[SQL_RELEASE]));
    if (s != STATUS_OK)
        drop_job(store, s);
    return s;
}

const char *store_bad_member(const struct store *store)
{
    return store->bad_member != NULL ? store->bad_member : "";
}

const char *store_station_id(const struct store *store)
{
    return store->station_id;
}
