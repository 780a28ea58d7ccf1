/* test_sql.c - SQLite's result codes as statuses, and reasons for people. */
#include "db/sql.h"

#include <errno.h>
#include <string.h>

#include "unity.h"

static sqlite3 *db;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &db));
}

void tearDown(void)
{
    sqlite3_close(db);
}

/* expect: sql.h, and what sqlite.org/rescode.html says each code means. */
static const struct status_case {
    const char *what;
    int code;
    enum status status;
} status_cases[] = {
    { "ok", SQLITE_OK, STATUS_OK },
    { "a row", SQLITE_ROW, STATUS_OK },
    { "done", SQLITE_DONE, STATUS_OK },
    { "no memory", SQLITE_NOMEM, STATUS_NO_MEMORY },
    { "no memory, extended", SQLITE_IOERR_NOMEM, STATUS_IO },
    { "disk full", SQLITE_FULL, STATUS_FULL },
    { "cannot read", SQLITE_IOERR_READ, STATUS_IO },
    { "cannot write", SQLITE_IOERR_WRITE, STATUS_IO },
    { "cannot open", SQLITE_CANTOPEN, STATUS_IO },
    { "a folder", SQLITE_CANTOPEN_ISDIR, STATUS_IO },
    { "read-only", SQLITE_READONLY, STATUS_READ_ONLY },
    { "read-only, no -shm", SQLITE_READONLY_CANTINIT, STATUS_READ_ONLY },
    { "damaged", SQLITE_CORRUPT, STATUS_DAMAGED },
    { "damaged index", SQLITE_CORRUPT_INDEX, STATUS_DAMAGED },
    { "no database", SQLITE_NOTADB, STATUS_FORMAT },
    { "an error of its own", SQLITE_ERROR, STATUS_DB },
    { "a constraint", SQLITE_CONSTRAINT_NOTNULL, STATUS_DB },
    { "busy", SQLITE_BUSY, STATUS_DB },
};

static void test_status(void)
{
    for (size_t i = 0; i < sizeof status_cases / sizeof *status_cases; i++) {
        const struct status_case *c = &status_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, sql_status(c->code), c->what);
    }
}

/* expect: errno(3). */
static const struct errno_case {
    int cause;
    enum status status;
} errno_cases[] = {
    { ENOSPC, STATUS_FULL },      { EDQUOT, STATUS_FULL },     { EROFS, STATUS_READ_ONLY },
    { EACCES, STATUS_READ_ONLY }, { EPERM, STATUS_READ_ONLY }, { EIO, STATUS_IO },
    { ENOENT, STATUS_IO },        { EFBIG, STATUS_IO },        { 0, STATUS_IO },
};

/* Where SQLite only knows that the system refused, errno tells; where it knows itself, or the
 * failure is another one, errno is not asked. */
static void test_errno_status(void)
{
    for (size_t i = 0; i < sizeof errno_cases / sizeof *errno_cases; i++) {
        const struct errno_case *c = &errno_cases[i];
        const char *what = strerror(c->cause);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, sql_errno_status(c->cause), what);
        errno = c->cause;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, sql_status_of(db, SQLITE_IOERR), what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, sql_status_of(db, SQLITE_CANTOPEN), what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FULL, sql_status_of(db, SQLITE_FULL), what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, sql_status_of(db, SQLITE_DONE), what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DB, sql_status_of(db, SQLITE_BUSY), what);
    }
}

static void test_run_and_prepare(void)
{
    sqlite3_stmt *statement = (sqlite3_stmt *)&db;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(db, "CREATE TABLE t(x NOT NULL)"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(db, "SELECT 1; PRAGMA user_version"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, sql_run(db, "CREATE TABLE t(x)"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, sql_prepare(db, "SELEKT", &statement));
    TEST_ASSERT_NULL(statement);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_prepare(db, "SELECT x FROM t", &statement));
    TEST_ASSERT_NOT_NULL(statement);
    sqlite3_finalize(statement);
}

/* Steps that end, that fail, and that give a row where none is wanted; after each
 * the statement works again. */
static void test_step_done(void)
{
    sqlite3_stmt *insert, *select;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(db, "CREATE TABLE t(x NOT NULL)"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_prepare(db, "INSERT INTO t VALUES (?)", &insert));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_prepare(db, "SELECT x FROM t", &select));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, sql_step_done(insert)); /* x is NULL */
    sqlite3_bind_int(insert, 1, 7);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_step_done(insert));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_step_done(insert));
    TEST_ASSERT_EQUAL_INT(2, sqlite3_total_changes(db));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, sql_step_done(select));
    sqlite3_finalize(insert);
    sqlite3_finalize(select);
}

/* expect: the words of errno(3) where the system was the cause, else SQLite's. */
static void test_reason(void)
{
    sqlite3 *nowhere = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_DB, sql_run(db, "SELECT * FROM skins"));
    TEST_ASSERT_EQUAL_STRING("no such table: skins", sql_reason(db));

    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(db, "PRAGMA max_page_count = 2; CREATE TABLE t(x)"));
    TEST_ASSERT_EQUAL_INT(STATUS_FULL, sql_run(db, "INSERT INTO t VALUES (zeroblob(100000))"));
    TEST_ASSERT_EQUAL_STRING("No space left on device", sql_reason(db));

    TEST_ASSERT_EQUAL_INT(STATUS_IO, sql_status(sqlite3_open_v2("/no/such/folder/file", &nowhere,
                                                                SQLITE_OPEN_READWRITE, NULL)));
    TEST_ASSERT_EQUAL_STRING("No such file or directory", sql_reason(nowhere));
    sqlite3_close(nowhere);
    /* A code whose cause the system did not name. */
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &nowhere));
    TEST_ASSERT_EQUAL_STRING("not an error", sql_reason(nowhere));
    sqlite3_close(nowhere);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_status);
    RUN_TEST(test_errno_status);
    RUN_TEST(test_run_and_prepare);
    RUN_TEST(test_step_done);
    RUN_TEST(test_reason);
    return UNITY_END();
}
