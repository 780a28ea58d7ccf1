/* store_forget.c - erase a person from the file and from the WAL. */
#include "db/store.h"

#include "base/clock.h"
#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

#define AUDIT_FORGET "subject.forget"

/* secure_delete overwrites the row, but not the stale copies that SQLite leaves in the free
 * space of a page when it moves rows to another one.  So all rows go and come back:
 * every page the table had is overwritten.  The copy in between is in memory. */
static const char rewrite_sql[] =
    "CREATE TEMP TABLE kept AS SELECT * FROM main.subject_person;"
    "DELETE FROM main.subject_person;"
    "INSERT INTO main.subject_person SELECT * FROM temp.kept ORDER BY rowid;"
    "DROP TABLE temp.kept;";

static enum status delete_person(struct store *store, const char *id)
{
    sqlite3_stmt *delete = NULL;
    enum status s = sql_prepare(store->db, "DELETE FROM subject_person WHERE subject = ?", &delete);
    if (s == STATUS_OK) {
        store_text_bind(delete, 1, id);
        s = sql_step_done(delete);
    }
    sqlite3_finalize(delete);
    if (s == STATUS_OK && sqlite3_changes(store->db) == 0)
        s = STATUS_NOT_FOUND;
    return s;
}

static enum status forget(struct store *store, const char *id, const char *who)
{
    char at[STORE_TIME_SIZE];
    enum status s = delete_person(store, id);
    if (s == STATUS_OK)
        s = sql_run(store->db, rewrite_sql);
    clock_text(store_now_ms(&store->clock), at);
    if (s == STATUS_OK)
        s = audit_append(&store->audit, at, who, AUDIT_FORGET, id);
    return s;
}

enum status store_forget_subject(struct store *store, const char *subject_id, const char *who,
                                 bool *erased)
{
    if (store->in_group) {
        log_error("store: a subject cannot be forgotten inside a group");
        return STATUS_DB;
    }
    store->bad_member = "subject_id";
    enum status s = store_job_begin(store);
    if (s == STATUS_OK)
        s = store_job_end(store, "forget a subject", forget(store, subject_id, who));
    if (s != STATUS_OK)
        return s;
    store->erasing = true;
    bool done = false;
    (void)store_finish_erasing(store, &done); /* forgotten it is; the rest is tried again */
    *erased = done;
    return STATUS_OK;
}

enum status store_finish_erasing(struct store *store, bool *erased)
{
    int log = 0, moved = 0;
    if (!store->erasing) {
        *erased = true;
        return STATUS_OK;
    }
    /* Readers are not waited for: whoever calls has more to do. */
    sqlite3_busy_timeout(store->db, 0);
    int code = sqlite3_wal_checkpoint_v2(store->db, NULL, SQLITE_CHECKPOINT_TRUNCATE, &log, &moved);
    sqlite3_busy_timeout(store->db, STORE_PATIENCE_MS);
    if (code != SQLITE_OK && code != SQLITE_BUSY) {
        log_error("store: cannot checkpoint what was forgotten: %s", sql_reason(store->db));
        return sql_status(code);
    }
    store->erasing = code == SQLITE_BUSY;
    *erased = !store->erasing;
    return STATUS_OK;
}
