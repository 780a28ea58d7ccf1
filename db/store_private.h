/* store_private.h - what the files of the store share; nobody else includes it.
 *
 *   store_claim    the lock
 *   store_open     make, check, migrate, close
 *   store_damage   what a file is by its bytes; moving aside; beginning anew
 *   store          groups, jobs, the clock
 *   store_keeper   checkpoints
 *   store_write    records, calibrations, subjects, uuids;  store_check_write  check tiles
 *   store_row      one row as SQL values and as a dump
 *   store_record   a record as rows;  store_record_read  and back
 *   store_forget   erasing a person
 *   store_read     readers;  store_list  what they list;  store_verify  what they verify;
 *   store_check_read  check tiles */
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
    SQL_NEXT_SEQ,
    SQL_ADD_MEASUREMENT,
    SQL_ADD_MATCH,
    SQL_ADD_UUID,
    SQL_PRUNE,
    SQL_HIGHEST_FENCE,
    SQL_FIND_CHECK_TILE,
    SQL_ADD_CHECK_TILE,
    SQL_GET_CHECK_TILE,
    SQL_NEXT_CHECK_TILE,
    SQL_NEXT_CHECK,
    SQL_ADD_CHECK,
    SQL_GET_CHECK,
    STORE_STATEMENTS
};

struct store_claim {
    int lock; /* descriptor of STATE/lock */
    char folder[STORE_PATH_SIZE];
};

/* station.db and -wal as they were opened. */
enum { STORE_FILES = 2 }; /* station.db, -wal */
#define STORE_LARGE_WAL INT64_C(67108864)
struct store_files {
    struct {
        char path[STORE_PATH_SIZE];
        ino_t inode;
    } file[STORE_FILES];
};

struct store {
    sqlite3 *db;
    struct store_files files;
    struct store_claim *claim; /* of our own; NULL: the caller's */
    struct store_clock clock;
    char station_id[STORE_UUID_SIZE];
    struct uuid7 ids;
    sqlite3_stmt *statement[STORE_STATEMENTS];
    struct audit audit;
    int64_t next_seq;      /* in the open group; 0: not read yet */
    bool in_group, single; /* single: one job, a group of its own */
    bool together;         /* jobs of the group have no savepoints */
    bool must_part;
    int64_t changes;        /* together: SQLite's count when the job began */
    enum status group;      /* why the open group is lost */
    bool ready;             /* open in full */
    bool damaged;           /* met while writing */
    bool erasing;           /* the WAL may still hold somebody forgotten */
    const char *bad_member; /* of the last refusal */
};

/* ---- store.c ------------------------------------------------------------------------ */

enum status store_prepare(struct store *store);

/* Writes into a file that has lost its name would be lost with it. */
void store_remember_files(struct store_files *files, const char *folder);
bool store_files_moved(const struct store_files *files);    /* either */
bool store_database_moved(const struct store_files *files); /* station.db itself */

/* One job: everything between is kept as a whole or not at all.  job_end() gives the
 * job's status, or that of keeping it; `what` is for the log. */
enum status store_job_begin(struct store *store);
enum status store_job_end(struct store *store, const char *what, enum status s);

int64_t store_now_ms(const struct store_clock *clock);

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

/* ---- store_open.c ------------------------------------------------------------------- */

/* A complete new station.db, put in its place at once or not at all. */
enum status store_make(const char *folder, int64_t now_ms, int64_t first_seq);
void store_sync_folder(const char *folder);

/* ---- store_damage.c ----------------------------------------------------------------- */

enum { STORE_WHY_SIZE = 256 };

/* What the file is, from its bytes: STATUS_OK ours, STATUS_NOT_FOUND none, STATUS_DAMAGED
 * with *why in words; STATUS_FORMAT foreign, STATUS_VERSION newer and STATUS_IO are logged. */
enum status store_judge(const char *folder, const char **why);

/* Move the damaged file aside, marker first; logs what happened. */
void store_put_aside(const char *folder, int64_t now_ms, const char *why);

/* The name of the file that was moved aside, "" where the marker does not say.
 * STATUS_NOT_FOUND where there is no marker; where nobody can tell, the cause, logged. */
enum status store_find_aside(const char *folder, char name[STORE_TEXT_SIZE]);

/* To read what can be read of it; leaves the file as it is. */
enum status store_connect_aside(const char *path, sqlite3 **ret);

/* ---- store_write.c ------------------------------------------------------------------ */

/* The time of a job, and an id where it needs one. */
struct store_stamp {
    char at[STORE_TIME_SIZE], id[STORE_UUID_SIZE];
    int64_t ms;
};
enum status store_stamp_id(struct store *store, struct store_stamp *ret);

/* `s`, with the member that it is about. */
enum status store_refuse(struct store *store, const char *member, enum status s);

/* The id is bound to `find`; STATUS_NOT_FOUND where that gives no row.  "" refers to nothing. */
enum status store_must_exist(struct store *store, enum store_statement find, const char *id,
                             const char *member);

/* The instrument's row, added where it is new. */
enum status store_instrument_key(struct store *store, const struct store_instrument *i,
                                 int64_t *ret);

/* ---- store_row.c -------------------------------------------------------------------- */

/* A row of a table that the chain covers: its columns in order, borrowed until it is
 * inserted. */
struct store_row {
    sqlite3_stmt *insert;
    int i;
    struct audit_dump dump;
};

void store_row_begin(struct store_row *row, sqlite3_stmt *insert, const char *table);
void store_row_text(struct store_row *row, const char *name, const char *text); /* "": NULL */
void store_row_number(struct store_row *row, const char *name, double x);       /* NAN: NULL */
void store_row_integer(struct store_row *row, const char *name, int64_t x);
void store_row_integer_unless(struct store_row *row, const char *name, int64_t x, bool absent);
void store_row_blob(struct store_row *row, const char *name, const unsigned char *bytes,
                    size_t n); /* 0: NULL */
enum status store_row_insert(struct store_row *row, struct audit_digests *digests);

/* ---- store_record.c ----------------------------------------------------------------- */

/* The member that does not fit; NULL where all do. */
const char *store_record_misfit(const struct store_record *record);

struct store_record_keys {
    int64_t seq;
    const char *id, *taken_at;
    int64_t instrument, site; /* 0: none */
};

/* Values as a blob of 8 n bytes. */
void store_values_write(const struct spectrum *s, unsigned char *bytes);

/* Run SQL_ADD_MEASUREMENT and SQL_ADD_MATCH; each adds its row's digest. */
enum status store_record_insert(sqlite3_stmt *insert, const struct store_record *record,
                                const struct store_record_keys *keys,
                                struct audit_digests *digests);
enum status store_match_insert(sqlite3_stmt *insert, const struct store_record *record, int64_t seq,
                               struct audit_digests *digests);

/* ---- store_record_read.c ------------------------------------------------------------ */

#define STORE_RECORD_SELECT \
    "SELECT i.driver, i.maker, i.model, i.serial, i.firmware, p.name," \
    " t.table_name, t.table_sha256, t.method, t.result, t.refined, m.*" \
    " FROM measurement m LEFT JOIN instrument i ON i.id = m.instrument" \
    " LEFT JOIN site p ON p.id = m.site LEFT JOIN match t ON t.measurement = m.seq "

/* The row a STORE_RECORD_SELECT stands on.  STATUS_DAMAGED where it holds what no
 * record can. */
enum status store_record_read(sqlite3_stmt *row, struct store_record *ret);

/* Text into an array, "" for NULL; and the way back. */
void store_text_read(sqlite3_stmt *row, int column, char *text, size_t size);
void store_text_bind(sqlite3_stmt *statement, int i, const char *text);
double store_number_read(sqlite3_stmt *row, int column); /* NAN for NULL */

/* A blob of n values, back: value[n].  False where it has another size. */
bool store_values_read(sqlite3_stmt *row, int column, size_t n, double *value);

/* Raw integers, malloc'ed; NULL and 0 for NULL. */
enum status store_raw_read(sqlite3_stmt *row, int column, int32_t **ret, size_t *n);

/* ---- store_check_read.c ------------------------------------------------------------- */

/* The columns that the two functions below read, and what they are of. */
#define STORE_CHECK_TILE_SELECT \
    "SELECT i.driver, i.maker, i.model, i.serial, i.firmware, t.*" \
    " FROM check_tile t LEFT JOIN instrument i ON i.id = t.instrument "
#define STORE_CHECK_SELECT \
    "SELECT i.driver, i.maker, i.model, i.serial, i.firmware, c.*" \
    " FROM check_reading c JOIN instrument i ON i.id = c.instrument "

/* STATUS_DAMAGED where the row holds what no check can. */
struct store_check_tile;
struct store_check;
enum status store_check_tile_read(sqlite3_stmt *row, struct store_check_tile *ret);
enum status store_check_read(sqlite3_stmt *row, struct store_check *ret);

/* ---- store_read.c ------------------------------------------------------------------- */

#define STORE_HIGHEST_FENCE "SELECT max(fence) FROM measurement WHERE fence > 0"

enum reader_query {
    QUERY_BY_ID,
    QUERY_BY_UUID,
    QUERY_RAW,
    QUERY_STATION,
    QUERY_NEWEST,
    QUERY_HIGHEST_FENCE,
    QUERY_NEXT,
    QUERY_NEXT_OF_SUBJECT,
    QUERY_NEXT_OF_OWNER,
    QUERY_NEXT_OF_BOTH,
    QUERY_SUBJECT_ROW,
    QUERY_SUBJECT,
    QUERY_SITE,
    QUERY_CALIBRATION,
    QUERY_CHECK_TILE_BY_UUID,
    QUERY_LAST_CHECK_TILE,
    QUERY_CHECK_REFERENCE,
    QUERY_NEXT_CHECK_TILE,
    QUERY_CHECK_BY_UUID,
    QUERY_NEXT_CHECK,
    QUERY_LAST_CHECKS,
    READER_QUERIES
};

struct store_reader {
    sqlite3 *db;
    sqlite3_stmt *query[READER_QUERIES];
};

/* Step to a row: STATUS_OK, STATUS_NOT_FOUND after the last, STATUS_CANCELLED, or a
 * failure, which is logged. */
enum status store_reader_step(struct store_reader *reader, sqlite3_stmt *query);

/* The same for a STORE_RECORD_SELECT: the next record; resets the statement. */
enum status store_reader_record(struct store_reader *reader, sqlite3_stmt *query,
                                struct store_record *ret);

#endif
