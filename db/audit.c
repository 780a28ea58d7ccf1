/* audit.c - digests and the chain; writing and verifying share both. */
#include "db/audit.h"

#include <stdio.h>
#include <string.h>

#include "db/sql.h"

/* What each action is about.  The second table is optional: a row may be without. */
static const struct kind {
    const char *action;
    struct {
        const char *table, *select;
    } about[AUDIT_ROWS_EACH];
    const char *uncovered; /* ids of rows that no audit row is about */
} kinds[AUDIT_KINDS] = {
    { AUDIT_STATION,
      { { "station", "SELECT * FROM station WHERE id = ?" } },
      "SELECT id FROM station WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_STATION "')" },
    { AUDIT_SUBJECT,
      { { "subject", "SELECT * FROM subject WHERE id = ?" } },
      "SELECT id FROM subject WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_SUBJECT "')" },
    { AUDIT_SITE,
      { { "site", "SELECT * FROM site WHERE id = ?" } },
      "SELECT id FROM site WHERE id NOT IN"
      " (SELECT CAST(entity AS INTEGER) FROM audit WHERE action = '" AUDIT_SITE "')" },
    { AUDIT_INSTRUMENT,
      { { "instrument", "SELECT * FROM instrument WHERE id = ?" } },
      "SELECT id FROM instrument WHERE id NOT IN"
      " (SELECT CAST(entity AS INTEGER) FROM audit WHERE action = '" AUDIT_INSTRUMENT "')" },
    { AUDIT_CALIBRATION,
      { { "calibration", "SELECT * FROM calibration WHERE id = ?" } },
      "SELECT id FROM calibration WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_CALIBRATION "')" },
    { AUDIT_CHECK_TILE,
      { { "check_tile", "SELECT * FROM check_tile WHERE id = ?" } },
      "SELECT id FROM check_tile WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_CHECK_TILE "')" },
    { AUDIT_CHECK,
      { { "check_reading", "SELECT * FROM check_reading WHERE id = ?" } },
      "SELECT id FROM check_reading WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_CHECK "')" },
    { AUDIT_MEASUREMENT,
      { { "measurement", "SELECT * FROM measurement WHERE id = ?" },
        { "match", "SELECT * FROM match WHERE measurement ="
                   " (SELECT seq FROM measurement WHERE id = ?)" } },
      "SELECT id FROM measurement WHERE id NOT IN"
      " (SELECT entity FROM audit WHERE action = '" AUDIT_MEASUREMENT "')" },
};

/* AUDIT_KINDS for an action about no row. */
static size_t kind_of(const char *action)
{
    size_t k = 0;
    while (k < AUDIT_KINDS && strcmp(kinds[k].action, action) != 0)
        k++;
    return k;
}

/* A value that could not be had for want of memory was taken as empty. */
static bool out_of_memory(sqlite3_stmt *row)
{
    return sqlite3_errcode(sqlite3_db_handle(row)) == SQLITE_NOMEM;
}

/* ---- digests of the rows an action is about ----------------------------------------- */

static enum status digest_row(sqlite3_stmt *select, const char *table, const char *entity,
                              struct audit_digests *ret)
{
    struct audit_dump dump;
    sqlite3_bind_text(select, 1, entity, -1, SQLITE_STATIC);
    int stepped = sqlite3_step(select);
    if (stepped == SQLITE_ROW) {
        audit_dump_begin(&dump, NULL, table);
        audit_dump_row(&dump, select, sqlite3_column_count(select));
        audit_dump_end(&dump, ret->bytes + ret->n * AUDIT_HASH_SIZE);
        ret->n++;
        if (out_of_memory(select))
            stepped = SQLITE_NOMEM;
    }
    sqlite3_reset(select);
    return sql_status(stepped);
}

static enum status digest_rows(struct audit *audit, size_t k, const char *entity,
                               struct audit_digests *ret)
{
    ret->n = 0;
    for (size_t i = 0; k < AUDIT_KINDS && i < AUDIT_ROWS_EACH; i++) {
        if (audit->row[k][i] == NULL)
            break;
        enum status s = digest_row(audit->row[k][i], kinds[k].about[i].table, entity, ret);
        if (s != STATUS_OK)
            return s;
        if (ret->n == 0)
            return STATUS_NOT_FOUND;
    }
    return STATUS_OK;
}

/* ---- writing ------------------------------------------------------------------------ */

enum status audit_prepare(sqlite3 *db, struct audit *ret)
{
    *ret = (struct audit){ .last = NULL };
    enum status s =
        sql_prepare(db, "SELECT id, hash FROM audit ORDER BY id DESC LIMIT 1", &ret->last);
    if (s == STATUS_OK)
        s = sql_prepare(db, "INSERT INTO audit VALUES (?,?,?,?,?,?,?)", &ret->insert);
    for (size_t k = 0; k < AUDIT_KINDS; k++)
        for (size_t i = 0; i < AUDIT_ROWS_EACH && s == STATUS_OK; i++)
            if (kinds[k].about[i].select != NULL)
                s = sql_prepare(db, kinds[k].about[i].select, &ret->row[k][i]);
    return s;
}

void audit_done(struct audit *audit)
{
    sqlite3_finalize(audit->last);
    sqlite3_finalize(audit->insert);
    for (size_t k = 0; k < AUDIT_KINDS; k++)
        for (size_t i = 0; i < AUDIT_ROWS_EACH; i++)
            sqlite3_finalize(audit->row[k][i]);
    *audit = (struct audit){ .last = NULL };
}

/* Id and hash of the last row; 0 and zeros before the first. */
static enum status read_tail(struct audit *audit)
{
    audit->id = 0;
    memset(audit->hash, 0, sizeof audit->hash);
    int stepped = sqlite3_step(audit->last);
    if (stepped == SQLITE_ROW) {
        const void *blob = sqlite3_column_blob(audit->last, 1);
        if (blob != NULL && sqlite3_column_bytes(audit->last, 1) == AUDIT_HASH_SIZE)
            memcpy(audit->hash, blob, AUDIT_HASH_SIZE);
        else
            stepped = SQLITE_CORRUPT;
        audit->id = sqlite3_column_int64(audit->last, 0);
    }
    sqlite3_reset(audit->last);
    audit->tail_known = sql_status(stepped) == STATUS_OK;
    return sql_status(stepped);
}

static void bind_text(sqlite3_stmt *insert, int i, const char *text)
{
    if (*text != '\0')
        sqlite3_bind_text(insert, i, text, -1, SQLITE_STATIC);
    else
        sqlite3_bind_null(insert, i);
}

static enum status insert_row(sqlite3_stmt *insert, int64_t id, const char *const text[4],
                              const struct audit_digests *digests,
                              const uint8_t hash[AUDIT_HASH_SIZE])
{
    sqlite3_bind_int64(insert, 1, id);
    for (int i = 0; i < 4; i++)
        bind_text(insert, i + 2, text[i]);
    if (digests->n > 0)
        sqlite3_bind_blob(insert, 6, digests->bytes, (int)digests->n * AUDIT_HASH_SIZE,
                          SQLITE_STATIC);
    else
        sqlite3_bind_null(insert, 6);
    sqlite3_bind_blob(insert, 7, hash, AUDIT_HASH_SIZE, SQLITE_STATIC);
    return sql_step_done(insert);
}

/* "" stands in SQL as NULL. */
static void dump_text(struct audit_dump *dump, const char *name, const char *text)
{
    if (*text != '\0')
        audit_dump_text(dump, name, text, strlen(text));
}

enum status audit_append_known(struct audit *audit, const char *at, const char *who,
                               const char *action, const char *entity,
                               const struct audit_digests *digests)
{
    const char *const text[4] = { at, who, action, entity };
    static const char *const name[4] = { "at", "who", "action", "entity" };
    uint8_t hash[AUDIT_HASH_SIZE];
    struct audit_dump dump;
    enum status s = audit->tail_known ? STATUS_OK : read_tail(audit);
    if (s != STATUS_OK)
        return s;
    int64_t id = audit->id + 1;
    audit_dump_begin(&dump, audit->hash, "audit");
    audit_dump_integer(&dump, "id", id);
    for (int i = 0; i < 4; i++)
        dump_text(&dump, name[i], text[i]);
    if (digests->n > 0)
        audit_dump_blob(&dump, "digests", digests->bytes, digests->n * AUDIT_HASH_SIZE);
    audit_dump_end(&dump, hash);
    s = insert_row(audit->insert, id, text, digests, hash);
    if (s != STATUS_OK)
        return s;
    audit->id = id;
    memcpy(audit->hash, hash, sizeof hash);
    return STATUS_OK;
}

enum status audit_append(struct audit *audit, const char *at, const char *who, const char *action,
                         const char *entity)
{
    struct audit_digests digests;
    enum status s = digest_rows(audit, kind_of(action), entity, &digests);
    return s == STATUS_OK ? audit_append_known(audit, at, who, action, entity, &digests) : s;
}

void audit_forget_tail(struct audit *audit)
{
    audit->tail_known = false;
}

/* ---- verifying ---------------------------------------------------------------------- */

enum { COLUMN_ID, COLUMN_ACTION = 3, COLUMN_ENTITY, COLUMN_DIGESTS, COLUMN_HASH };

static const char *text_of(sqlite3_stmt *row, int column)
{
    const char *text = (const char *)sqlite3_column_text(row, column);
    return text != NULL ? text : "";
}

/* The audit row follows the one before: its number, and its hash over that of the row
 * before, which becomes its own. */
static bool follows(sqlite3_stmt *row, uint8_t hash[AUDIT_HASH_SIZE], struct audit_report *r)
{
    struct audit_dump dump;
    long long expected = r->rows + 1, id = sqlite3_column_int64(row, COLUMN_ID);
    if (id != expected) {
        snprintf(r->what, sizeof r->what, "audit row %lld is missing", expected);
        return false;
    }
    audit_dump_begin(&dump, hash, "audit");
    audit_dump_row(&dump, row, COLUMN_HASH);
    audit_dump_end(&dump, hash);
    const void *stored = sqlite3_column_blob(row, COLUMN_HASH);
    if (stored == NULL || sqlite3_column_bytes(row, COLUMN_HASH) != AUDIT_HASH_SIZE ||
        memcmp(stored, hash, AUDIT_HASH_SIZE) != 0) {
        snprintf(r->what, sizeof r->what, "audit row %lld was changed", expected);
        return false;
    }
    return true;
}

/* What happened to row i since its digest was taken; NULL: nothing. */
static const char *changed(const struct audit_digests *now, const uint8_t *then, size_t n, size_t i)
{
    size_t at = i * AUDIT_HASH_SIZE;
    if (i < now->n && i < n)
        return memcmp(now->bytes + at, then + at, AUDIT_HASH_SIZE) != 0 ? "was changed" : NULL;
    if (i < now->n)
        return "was added";
    return i < n || i == 0 ? "is missing" : NULL;
}

/* The rows the audit row is about are as they were. */
static enum status same_rows(struct audit *audit, sqlite3_stmt *row, struct audit_report *r)
{
    struct audit_digests now = { .n = 0 };
    const char *entity = text_of(row, COLUMN_ENTITY);
    size_t k = kind_of(text_of(row, COLUMN_ACTION));
    if (k == AUDIT_KINDS)
        return STATUS_OK;
    enum status s = digest_rows(audit, k, entity, &now);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND)
        return s;
    const uint8_t *then = sqlite3_column_blob(row, COLUMN_DIGESTS);
    size_t n = (size_t)sqlite3_column_bytes(row, COLUMN_DIGESTS) / AUDIT_HASH_SIZE;
    for (size_t i = 0; i < AUDIT_ROWS_EACH; i++) {
        const char *what = changed(&now, then, n, i);
        if (what == NULL)
            continue;
        snprintf(r->what, sizeof r->what, "%s %s %s (audit row %lld)", kinds[k].about[i].table,
                 entity, what, (long long)r->rows + 1);
        return STATUS_DAMAGED;
    }
    return STATUS_OK;
}

static enum status walk(sqlite3 *db, struct audit *audit, struct audit_report *r)
{
    uint8_t hash[AUDIT_HASH_SIZE] = { 0 };
    sqlite3_stmt *row;
    int stepped = SQLITE_DONE;
    enum status s = sql_prepare(db, "SELECT * FROM audit ORDER BY id", &row);
    while (s == STATUS_OK && (stepped = sqlite3_step(row)) == SQLITE_ROW) {
        s = follows(row, hash, r) ? same_rows(audit, row, r) : STATUS_DAMAGED;
        if (s == STATUS_DAMAGED && out_of_memory(row))
            s = STATUS_NO_MEMORY;
        if (s == STATUS_OK)
            r->rows++;
    }
    if (s == STATUS_OK)
        s = sql_status(stepped);
    sqlite3_finalize(row);
    for (size_t i = 0; i < sizeof hash && r->rows > 0; i++)
        snprintf(r->last_hash + 2 * i, 3, "%02x", (unsigned)hash[i]);
    return s;
}

static enum status nothing_besides(sqlite3 *db, const struct kind *kind, struct audit_report *r)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, kind->uncovered, &select);
    int stepped = s == STATUS_OK ? sqlite3_step(select) : SQLITE_OK;
    if (stepped == SQLITE_ROW) {
        snprintf(r->what, sizeof r->what, "%s %s is in no audit row", kind->about[0].table,
                 text_of(select, 0));
        s = STATUS_DAMAGED;
    } else if (s == STATUS_OK) {
        s = sql_status(stepped);
    }
    sqlite3_finalize(select);
    return s;
}

enum status audit_verify(sqlite3 *db, struct audit_report *ret)
{
    struct audit audit;
    struct audit_report r = { 0 };
    enum status s = audit_prepare(db, &audit);
    if (s == STATUS_OK)
        s = walk(db, &audit, &r);
    for (size_t k = 0; k < AUDIT_KINDS && s == STATUS_OK; k++)
        s = nothing_besides(db, &kinds[k], &r);
    audit_done(&audit);
    *ret = r;
    return s;
}
