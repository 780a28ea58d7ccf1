/* store_verify.c - is everything there, and as it was? */
#include "db/store.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

/* Constant SQL whose first row, if it gives one, says what is wrong. */
static enum status expect(sqlite3 *db, const char *sql, const char *good, const char *what,
                          struct store_verify_report *r)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, sql, &select);
    int stepped = s == STATUS_OK ? sqlite3_step(select) : SQLITE_OK;
    if (s == STATUS_OK)
        s = sql_status(stepped);
    if (stepped == SQLITE_ROW) {
        char text[STORE_TEXT_SIZE];
        store_text_read(select, 0, text, sizeof text);
        if (strcmp(text, good) != 0) {
            snprintf(r->what, sizeof r->what, "%s%.200s", what, text);
            s = STATUS_DAMAGED;
        }
    }
    sqlite3_finalize(select);
    return s;
}

/* Constant SQL for one row of integers. */
static enum status numbers(sqlite3 *db, const char *sql, int64_t *ret, int n)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, sql, &select);
    if (s == STATUS_OK)
        s = sql_status(sqlite3_step(select));
    for (int i = 0; i < n && s == STATUS_OK; i++)
        ret[i] = sqlite3_column_int64(select, i);
    sqlite3_finalize(select);
    return s;
}

static enum status count_seq(sqlite3 *db, struct store_verify_report *r)
{
    enum { COUNT, LOWEST, HIGHEST, FIRST, N };
    int64_t x[N];
    enum status s = numbers(db,
                            "SELECT count(*), coalesce(min(seq), 0), coalesce(max(seq), 0),"
                            " (SELECT first_seq FROM station) FROM measurement",
                            x, N);
    if (s != STATUS_OK)
        return s;
    r->records = x[COUNT];
    r->first_seq = x[LOWEST];
    r->last_seq = x[HIGHEST];
    if (x[COUNT] == 0 || (x[LOWEST] == x[FIRST] && x[HIGHEST] - x[LOWEST] + 1 == x[COUNT]))
        return STATUS_OK;
    snprintf(r->what, sizeof r->what,
             "seq has a gap: %" PRId64 " records from %" PRId64 " to %" PRId64
             ", the first should be %" PRId64,
             x[COUNT], x[LOWEST], x[HIGHEST], x[FIRST]);
    return STATUS_DAMAGED;
}

static enum status walk_chain(sqlite3 *db, struct store_verify_report *r)
{
    struct audit_report audit;
    enum status s = audit_verify(db, &audit);
    r->audit_rows = audit.rows;
    memcpy(r->last_hash, audit.last_hash, sizeof r->last_hash);
    if (audit.what[0] != '\0')
        snprintf(r->what, sizeof r->what, "%s", audit.what);
    return s;
}

/* The chain before the gaps: it names what is missing. */
static enum status verify(sqlite3 *db, struct store_verify_report *r)
{
    enum status s = expect(db, "PRAGMA integrity_check(1)", "ok", "", r);
    if (s == STATUS_OK)
        s = walk_chain(db, r);
    if (s == STATUS_OK)
        s = count_seq(db, r);
    if (s == STATUS_OK)
        s = expect(db, "PRAGMA foreign_key_check", "", "a row refers to nothing: ", r);
    return s;
}

enum status store_verify(struct store_reader *reader, struct store_verify_report *ret)
{
    struct store_verify_report r = { 0 };
    sqlite3 *db = reader->db;
    enum status s = sql_run(db, "BEGIN");
    if (s == STATUS_OK)
        s = verify(db, &r);
    bool interrupted = s != STATUS_OK && sqlite3_errcode(db) == SQLITE_INTERRUPT;
    if (s == STATUS_DAMAGED && r.what[0] == '\0')
        snprintf(r.what, sizeof r.what, "%s", sql_reason(db));
    if (s == STATUS_DAMAGED)
        log_error("store: %s", r.what);
    else if (s != STATUS_OK && !interrupted)
        log_error("store: cannot verify: %s", sql_reason(db));
    if (!sqlite3_get_autocommit(db))
        (void)sql_run(db, "ROLLBACK");
    if (s == STATUS_OK || (s == STATUS_DAMAGED && !interrupted))
        *ret = r;
    return interrupted ? STATUS_CANCELLED : s;
}
