/* test_store_schema.c - versions of station.db: each step whole or not at all. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "db/sql.h"
#include "db/station_schema.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static sqlite3 *db;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
}

void tearDown(void)
{
    sqlite3_close(db);
    heard_stop();
    folder_remove(folder);
}

static long long number(const char *sql)
{
    sqlite3_stmt *select;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, sql_prepare(db, sql, &select), sql);
    TEST_ASSERT_EQUAL_INT_MESSAGE(SQLITE_ROW, sqlite3_step(select), sql);
    long long x = sqlite3_column_int64(select, 0);
    sqlite3_finalize(select);
    return x;
}

/* expect: the list of tables, written by hand. */
static const char *const tables[] = { "station",      "subject",     "subject_person", "site",
                                      "instrument",   "calibration", "measurement",    "match",
                                      "client_uuid",  "audit",       "sync_peer",      "check_tile",
                                      "check_reading" };

static void test_last_version(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, station_steps_n));
    TEST_ASSERT_EQUAL_INT(STATION_APPLICATION_ID, number("PRAGMA application_id"));
    TEST_ASSERT_EQUAL_INT(4, station_version());
    TEST_ASSERT_EQUAL_INT(station_version(), number("PRAGMA user_version"));
    TEST_ASSERT_EQUAL_INT(sizeof tables / sizeof *tables,
                          number("SELECT count(*) FROM sqlite_schema WHERE type = 'table'"));
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
        char sql[128];
        snprintf(sql, sizeof sql, "SELECT count(*) FROM %s", tables[i]);
        TEST_ASSERT_EQUAL_INT(0, number(sql));
    }
    /* Again: nothing to do. */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, station_steps_n));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* From each version there was to this one: tables with rows in them stay as they are. */
static void test_from_each_version(void)
{
    for (size_t from = 1; from < station_steps_n; from++) {
        sqlite3 *file = db;
        TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &db));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, from));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(db, "INSERT INTO site VALUES (1, 'arm')"));
        TEST_ASSERT_EQUAL_INT(from, number("PRAGMA user_version"));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, station_steps_n));
        TEST_ASSERT_EQUAL_INT(station_version(), number("PRAGMA user_version"));
        TEST_ASSERT_EQUAL_INT(1, number("SELECT count(*) FROM site"));
        TEST_ASSERT_EQUAL_INT(0, number("SELECT count(*) FROM check_reading"));
        sqlite3_close(db);
        db = file;
    }
}

/* ---- the documentation ----------------------------------------------------------------- */

/* Names, types and NOT NULL of each column in order, and what each index is made of. */
static const char shape_sql[] =
    "SELECT group_concat(line, char(10)) FROM (SELECT m.name || '.' || c.cid || ' ' || c.name ||"
    " ' ' || c.type || ' ' || c.\"notnull\" || ' ' || c.pk AS line FROM sqlite_schema m,"
    " pragma_table_info(m.name) c WHERE m.type = 'table' UNION ALL"
    " SELECT i.name || ' ' || i.\"unique\" || ' ' || i.partial || ' ' || m.name || '(' ||"
    " (SELECT group_concat(name) FROM pragma_index_info(i.name)) || ')' FROM sqlite_schema m,"
    " pragma_index_list(m.name) i WHERE m.type = 'table' ORDER BY line)";

static void read_shape(sqlite3 *from, char *text, size_t size)
{
    sqlite3_stmt *select;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_prepare(from, shape_sql, &select));
    TEST_ASSERT_EQUAL_INT(SQLITE_ROW, sqlite3_step(select));
    snprintf(text, size, "%s", (const char *)sqlite3_column_text(select, 0));
    sqlite3_finalize(select);
    TEST_ASSERT_TRUE(strlen(text) > 2000 && strlen(text) + 1 < size);
}

/* The SQL that docs/data.md gives for station.db, run: the same tables and indexes. */
static void test_documented(void)
{
    static char ours[16384], theirs[16384];
    static const char begin[] = "```sql\nPRAGMA application_id = 1399542644;";
    size_t size;
    sqlite3 *documented;
    char *text = (char *)file_bytes("docs/data.md", &size);
    TEST_ASSERT_NOT_NULL(text);
    char *sql = strstr(text, begin);
    TEST_ASSERT_NOT_NULL(sql);
    sql += strlen("```sql\n");
    *strstr(sql, "```") = '\0';
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &documented));
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, sql_run(documented, sql), sqlite3_errmsg(documented));
    free(text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, station_steps_n));
    read_shape(db, ours, sizeof ours);
    read_shape(documented, theirs, sizeof theirs);
    TEST_ASSERT_EQUAL_STRING(ours, theirs);
    sqlite3_stmt *version;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_prepare(documented, "PRAGMA user_version", &version));
    TEST_ASSERT_EQUAL_INT(SQLITE_ROW, sqlite3_step(version));
    TEST_ASSERT_EQUAL_INT(station_version(), sqlite3_column_int(version, 0));
    sqlite3_finalize(version);
    sqlite3_close(documented);
}

/* What the schema itself refuses. */
static const struct refused_case {
    const char *what, *sql;
} refused_cases[] = {
    { "a second station", "INSERT INTO station VALUES (2,'x','y',1)" },
    { "text where a number belongs", "INSERT INTO site VALUES ('x','y')" },
    { "a site twice", "INSERT INTO site VALUES (7,'arm'), (8,'arm')" },
    { "a match without a measurement", "INSERT INTO match VALUES (99,'','','','{}',NULL)" },
    { "a measurement changed", "UPDATE measurement SET L = 0" },
    { "a measurement deleted", "DELETE FROM measurement" },
    { "a match changed", "UPDATE match SET result = ''" },
    { "a match deleted", "DELETE FROM match" },
    { "a calibration changed", "UPDATE calibration SET step = ''" },
    { "a calibration deleted", "DELETE FROM calibration" },
    { "a check changed", "UPDATE check_reading SET passed = 1" },
    { "a check deleted", "DELETE FROM check_reading" },
    { "a reference changed", "UPDATE check_tile SET limit_dE00 = 9" },
    { "a reference deleted", "DELETE FROM check_tile" },
    { "a check that half passed",
      "INSERT INTO check_reading SELECT 2,'i','t','v',parameters_sha256,operator,instrument,"
      "calibration,fence,tile,reference,aperture_mm,replicates,first_nm,step_nm,bands,spectrum,"
      "dE00,rms,limit_dE00,2 FROM check_reading" },
    { "an audit row changed", "UPDATE audit SET who = 'nobody'" },
    { "an audit row deleted", "DELETE FROM audit" },
};

static void test_refused_by_the_schema(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, station_steps, station_steps_n));
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK,
        sql_run(db, "PRAGMA foreign_keys = ON; INSERT INTO instrument VALUES (1,'','','','','');"
                    "INSERT INTO measurement(seq,id,taken_at,boottime_ms,fence,specular,first_nm,"
                    "step_nm,bands,spectrum,replicates,red,green,blue)"
                    " VALUES (1,'m','t',0,0,'sce',400,10,1,x'00',0,1,2,3);"
                    "INSERT INTO match VALUES (1,'t','s','lab','{}',NULL);"
                    "INSERT INTO calibration VALUES ('c','t','b',0,1,'zero','','',8.0);"
                    "INSERT INTO check_tile VALUES (1,'r','t','u','p','','tile','certificate',0.5,"
                    "8.0,400.0,10.0,1,x'00',NULL,NULL,NULL);"
                    "INSERT INTO check_reading VALUES (1,'k','t','u','p','',1,'c',1,'tile','r',8.0,"
                    "1,400.0,10.0,1,x'00',0.7,0.1,0.5,0);"
                    "INSERT INTO audit VALUES (1,'t','w','a','e',NULL,x'00');"));
    for (size_t i = 0; i < sizeof refused_cases / sizeof *refused_cases; i++) {
        const struct refused_case *c = &refused_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DB, sql_run(db, c->sql), c->what);
    }
}

/* ---- more steps ---------------------------------------------------------------------- */

static const struct station_step two[] = {
    { 1, { "PRAGMA user_version = 1; CREATE TABLE a(x);", "INSERT INTO a VALUES (1);" } },
    { 2, { "ALTER TABLE a ADD COLUMN y; UPDATE a SET y = 2; PRAGMA user_version = 2;" } },
};

static void test_from_nothing_and_from_the_middle(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, two, 1));
    TEST_ASSERT_EQUAL_INT(1, number("PRAGMA user_version"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, two, 2));
    TEST_ASSERT_EQUAL_INT(2, number("PRAGMA user_version"));
    TEST_ASSERT_EQUAL_INT(2, number("SELECT y FROM a"));
    TEST_ASSERT_EQUAL_INT(1, number("SELECT count(*) FROM a"));
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, station_migrate(db, two, 1));
    TEST_ASSERT_TRUE(heard_contains("version 2"));
    TEST_ASSERT_EQUAL_INT(2, number("PRAGMA user_version"));
}

/* A second step that cannot be taken leaves the first, without a trace of it. */
static const struct failing_case {
    const char *what;
    struct station_step step;
    const char *says;
} failing_cases[] = {
    { "SQL that fails at its end",
      { 2,
        { "CREATE TABLE b(x); UPDATE a SET x = 5; PRAGMA user_version = 2;",
          "INSERT INTO nowhere VALUES (1);" } },
      "no such table: nowhere" },
    { "a step that forgets its number",
      { 2, { "CREATE TABLE b(x); UPDATE a SET x = 5;" } },
      "leads elsewhere" },
    { "a step with another number",
      { 2, { "CREATE TABLE b(x); UPDATE a SET x = 5; PRAGMA user_version = 3;" } },
      "leads elsewhere" },
    { "a step that ends its transaction",
      { 2, { "CREATE TEMP TABLE b(x); COMMIT; BEGIN; UPDATE a SET x = 5; SELECT 1 FROM z;" } },
      "no such table: z" },
};

static void test_a_step_that_fails(void)
{
    for (size_t i = 0; i < sizeof failing_cases / sizeof *failing_cases; i++) {
        const struct failing_case *c = &failing_cases[i];
        const struct station_step steps[] = { two[0], c->step };
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DB, station_migrate(db, steps, 2), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        TEST_ASSERT_MESSAGE(heard_contains("version 2"), heard_last());
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, number("PRAGMA user_version"), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, number("SELECT x FROM a"), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            0, number("SELECT count(*) FROM sqlite_schema WHERE name = 'b'"), c->what);
        TEST_ASSERT_TRUE(sqlite3_get_autocommit(db) != 0);
        /* The right step is taken from there. */
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, two, 2));
}

/* Locked by somebody else, and no database at all. */
static void test_what_cannot_be_migrated(void)
{
    sqlite3 *other;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, station_migrate(db, two, 1));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &other));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(other, "BEGIN IMMEDIATE"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, station_migrate(db, two, 2));
    TEST_ASSERT_TRUE(heard_contains("locked"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, sql_run(other, "ROLLBACK"));
    sqlite3_close(other);
    sqlite3_close(db);
    TEST_ASSERT_TRUE(file_write(path, "this is no database, it is a letter", 35));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, station_migrate(db, two, 2));
    TEST_ASSERT_TRUE(heard_contains("cannot read its version"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_last_version);
    RUN_TEST(test_from_each_version);
    RUN_TEST(test_documented);
    RUN_TEST(test_refused_by_the_schema);
    RUN_TEST(test_from_nothing_and_from_the_middle);
    RUN_TEST(test_a_step_that_fails);
    RUN_TEST(test_what_cannot_be_migrated);
    return UNITY_END();
}
