/* store_private.h - what the files of the store share; nobody else includes it.
 *
 *   store_open     lock, make, check, migrate, close
 *   store_damage   what a file is by its bytes; moving aside; beginning anew
 *   store          groups, jobs, checkpoints, the clock
 *   store_write    records, calibrations, subjects, uuids
 *   store_record   a record as SQL values, there and back
 *   store_forget   erasing a person
 *   store_read     readers;  store_verify  what a reader verifies */
#ifndef SKINSPEC_DB_STORE_PRIVATE_H
#define SKINSPEC_DB_STORE_PRIVATE_H

#include <sys/types.h>

#include <sqlite3.h>

#include "base/uuid.h"
#include "db/audit.h"
#include "db/store.h"

#define STORE_FILE "station.db"
#define STORE_MARKER "station.damaged"
enum { STORE_PATH_SIZE = 4096 };

/* Statements that a store keeps prepared; the SQL is in store.c. */
enum store_statement {
    SQL_BEGIN,
    SQL_COMMIT,
    SQL_ROLLBACK,
    SQL_SAVEPOINT,
    SQL_RELEASE,
    SQL_ROLLBACK_TO,
    SQL_FIND_UUID,
    SQL_FIND_SUBJECT,
    SQL_FIND_CALIBRATION,
    SQL_FIND_MEASUREMENT,
    SQL_FIND_INSTRUMENT,
    SQL_FIND_SITE,
    SQL_ADD_INSTRUMENT,
    SQL_ADD_SITE,
    SQL_ADD_CALIBRATION,
    SQL_ADD_SUBJECT,
    SQL_ADD_PERSON,
    SQL_ADD_MEASUREMENT,
    SQL_ADD_MATCH,
    SQL_ADD_UUID,
    SQL_PRUNE,
    STORE_STATEMENTS
};

enum { STORE_FILES = 2 };

struct store {
    sqlite3 *db;
    struct {
        char path[STORE_PATH_SIZE];
        ino_t inode;
    } file[STORE_FILES]; /* station.db and -wal as they were opened */
    int lock;            /* descriptor of STATE/lock, or -1 */
    struct store_clock clock;
    char station_id[STORE_UUID_SIZE];
    struct uuid7 ids;
    sqlite3_stmt *statement[STORE_STATEMENTS];
    struct audit audit;
    bool in_group, single;  /* single: one job, a group of its own */
    enum status group;      /* why the open group is lost */
    bool ready;             /* open in full */
    bool damaged;           /* met while writing */
    bool erasing;           /* the WAL may still hold somebody forgotten */
    const char *bad_member; /* of the last refusal */
};

/* ---- store.c ------------------------------------------------------------------- */

enum status store_prepare(struct store *store);
void store_remember_files(struct store *store, const char *folder);

/* One job: everything between is kept as a whole or not at all.  job_end() gives the
 * job's status, or that of keeping it; `what` is for the log. */
enum status store_job_begin(struct store *store);
enum status store_job_end(struct store *store, const char *what, enum status s);

int64_t store_now_ms(const struct store_clock *clock);
void store_time_text(int64_t ms, char text[STORE_TIME_SIZE]);

/* Is there room for all names below the folder?  STATUS_IO, logged, where not; asked once
 * by each function of store.h that takes one. */
enum status store_folder_fits(const char *folder);

/* "FOLDER/NAME"; the buffer is the caller's. */
const char *store_path(const char *folder, const char *name, char path[STORE_PATH_SIZE]);

/* A connection as all of ours are: own thread, no checkpoint at close, patient for
 * timeout_ms.  NULL in *ret on failure, which is logged. */
enum { STORE_PATIENCE_MS = 2000 };
enum status store_connect(const char *path, int flags, sqlite3 **ret);

/* To read a file that nobody writes and that has no WAL: leaves nothing beside it. */
enum status store_connect_alone(const char *path, sqlite3 **ret);
bool store_has_wal(const char *path); /* with something in it */

/* ---- store_open.c ---------------------------------------------------------------- */

/* The writer's lock; STATUS_EXISTS or STATUS_IO, logged. */
enum status store_lock(const char *folder, int *ret);
void store_unlock(int lock);

/* A complete new station.db, put in its place at once or not at all. */
enum status store_make(const char *folder, int64_t now_ms, int64_t first_seq);
void store_sync_folder(const char *folder);

/* ---- store_damage.c ---------------------------------------------------------------- */

enum { STORE_WHY_SIZE = 256 };

/* What the file is, from its bytes: STATUS_OK ours, STATUS_NOT_FOUND none, STATUS_DAMAGED
 * with *why in words; STATUS_FORMAT foreign, STATUS_VERSION newer and STATUS_IO are logged. */
enum status store_judge(const char *folder, const char **why);

/* Move the damaged file aside, marker first; logs what happened. */
void store_put_aside(const char *folder, int64_t now_ms, const char *why);

/* Is the marker there, and what is the name of the file that was moved aside ("" where
 * the marker does not say)? */
bool store_is_put_aside(const char *folder, char name[STORE_TEXT_SIZE]);

/* To read what can be read of it; leaves the file as it is. */
enum status store_connect_aside(const char *path, sqlite3 **ret);

/* ---- store_record.c ------------------------------------------------------------------ */

/* The member that does not fit; NULL where all do. */
const char *store_record_misfit(const struct store_record *record);

struct store_record_keys {
    const char *id, *taken_at;
    int64_t instrument, site; /* 0: none */
};

/* Run SQL_ADD_MEASUREMENT. */
enum status store_record_insert(sqlite3_stmt *insert, const struct store_record *record,
                                const struct store_record_keys *keys);

#define STORE_RECORD_SELECT \
    "SELECT i.driver, i.maker, i.model, i.serial, i.firmware, p.name," \
    " t.table_name, t.table_sha256, t.method, t.result, m.*" \
    " FROM measurement m LEFT JOIN instrument i ON i.id = m.instrument" \
    " LEFT JOIN site p ON p.id = m.site LEFT JOIN match t ON t.measurement = m.seq "

/* The row a STORE_RECORD_SELECT stands on.  STATUS_DAMAGED where it holds what no
 * record can. */
enum status store_record_read(sqlite3_stmt *row, struct store_record *ret);

/* Text into an array, "" for NULL; and the way back. */
void store_text_read(sqlite3_stmt *row, int column, char *text, size_t size);
void store_text_bind(sqlite3_stmt *statement, int i, const char *text);

/* ---- store_read.c --------------------------------------------------------------------- */

enum store_query {
    QUERY_BY_ID,
    QUERY_BY_UUID,
    QUERY_NEWEST,
    QUERY_NEXT,
    QUERY_NEXT_OF_SUBJECT,
    QUERY_SUBJECT,
    QUERY_SITE,
    QUERY_CALIBRATION,
    STORE_QUERIES
};

struct store_reader {
    sqlite3 *db;
    sqlite3_stmt *query[STORE_QUERIES];
};

#endif
