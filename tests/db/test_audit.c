/* test_audit.c - the chain: recomputed by another program, and every change in a row of a
 * measurement, match, calibration or audit found and named. */
#include "db/audit.h"

#include <sys/wait.h>

#include "db/sql.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct dice dice;

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 31 };
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

/* Three records, one of them without a match and one refined, with raw integers and flags, two
 * calibrations, a subject who was forgotten; closed, all in one file. */
static void make_store(void)
{
    static const int32_t raw[] = { 1, -2, 3 };
    struct store *store;
    struct store_subject subject = { .name = "Zoë" };
    struct store_calibration zero = { .instrument = records_instrument(), .step = "zero" };
    struct store_calibration white = { .instrument = records_instrument(),
                                       .step = "white",
                                       .tile = "T",
                                       .operator_name = "Zoë",
                                       .boot_id = "b" };
    bool known, erased;
    TRY(store_open(folder, NULL, &store));
    TRY(store_add_subject(store, &subject, "clinic"));
    TRY(store_add_calibration(store, &zero));
    TRY(store_add_calibration(store, &white));
    for (int i = 0; i < 3; i++) {
        struct store_record *r = records_make(&dice);
        if (i == 1)
            r->match_json[0] = '\0';
        if (i == 2) {
            r->raw = raw;
            r->raw_n = 3;
            r->raw_unit = 0.001;
            r->surface = 0.04;
            strcpy(r->refined_json, "{\"Cm\":0.031}");
            r->spectrum.flag[3] = 1;
            strcpy(r->subject, subject.id);
            strcpy(r->calibration_id, white.id);
        }
        TRY(store_add_record(store, r, &known));
        free(r);
    }
    TRY(store_forget_subject(store, subject.id, "admin", &erased));
    store_close(store);
}

static struct store_verify_report verify(enum status expect, const char *what)
{
    struct store_verify_report report = { 0 };
    heard_start();
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, tool_verify(folder, &report), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect == STATUS_OK ? 0 : 1, heard_count(), what);
    return report;
}

/* expect: tests/reference/audit_chain.py, from the documentation alone. */
static void test_recomputed_by_another_program(void)
{
    char command[FOLDER_PATH_SIZE + 64], said[256] = "", last[65];
    long rows;
    make_store();
    struct store_verify_report report = verify(STATUS_OK, "");
    snprintf(command, sizeof command, "python3 tests/reference/audit_chain.py '%s'", path);
    FILE *f = popen(command, "r");
    TEST_ASSERT_NOT_NULL(f);
    said[fread(said, 1, sizeof said - 1, f)] = '\0';
    int ended = pclose(f);
    if (WIFEXITED(ended) && WEXITSTATUS(ended) == 3)
        TEST_IGNORE_MESSAGE("python3 has no sqlite3 module");
    TEST_ASSERT_EQUAL_INT_MESSAGE(2, sscanf(said, "rows %ld last %64s", &rows, last), said);
    TEST_ASSERT_EQUAL_INT64(rows, report.audit_rows);
    TEST_ASSERT_EQUAL_STRING(last, report.last_hash);
    /* station, subject, instrument, two calibrations, site, three records, forgotten */
    TEST_ASSERT_EQUAL_INT64(10, rows);
    TEST_ASSERT_EQUAL_INT64(3, report.records);
    TEST_ASSERT_EQUAL_INT64(1, report.first_seq);
    TEST_ASSERT_EQUAL_INT64(3, report.last_seq);
}

/* ---- changes by SQL --------------------------------------------------------------------- */

static void restore(const unsigned char *bytes, size_t size)
{
    char other[FOLDER_PATH_SIZE];
    unlink(folder_path(folder, "station.db-wal", other));
    unlink(folder_path(folder, "station.db-shm", other));
    TEST_ASSERT_TRUE(file_write(path, bytes, size));
}

/* Every column of every row of these tables, changed in a way that the schema allows; what
 * verifying says begins with the table's name (an audit row's without "was changed" where
 * the change took it out of its place). */
static void change_each(const char *table, const unsigned char *bytes, size_t size, int *changed)
{
    sqlite3 *db;
    sqlite3_stmt *columns;
    char sql[1024];
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &db));
    snprintf(sql, sizeof sql,
             "ATTACH '%s' AS s; CREATE TABLE c AS SELECT name, type FROM"
             " pragma_table_info('%s', 's'); DETACH s",
             path, table);
    TRY(sql_run(db, sql));
    TRY(sql_prepare(db, "SELECT name, type FROM c", &columns));
    while (sqlite3_step(columns) == SQLITE_ROW) {
        const char *name = (const char *)sqlite3_column_text(columns, 0);
        const char *type = (const char *)sqlite3_column_text(columns, 1);
        const char *value = strcmp(type, "TEXT") == 0   ? "%s || 'x'"
                            : strcmp(type, "BLOB") == 0 ? "CAST(%s || x'00' AS BLOB)"
                                                        : "%s + 1000";
        for (int row = 0; row < 10; row++) {
            char expression[128], what[160];
            snprintf(expression, sizeof expression, value, name);
            snprintf(sql, sizeof sql,
                     "UPDATE %s SET %s = %s WHERE rowid ="
                     " (SELECT rowid FROM %s ORDER BY rowid LIMIT 1 OFFSET %d) AND %s IS NOT NULL",
                     table, name, expression, table, row, name);
            restore(bytes, size);
            snprintf(what, sizeof what,
                     "SELECT count(*) FROM (SELECT %s AS x FROM %s ORDER BY"
                     " rowid LIMIT 1 OFFSET %d) WHERE x IS NOT NULL",
                     name, table, row);
            if (tool_number(folder, what) != 1)
                continue;
            if (strcmp(name, "one") == 0) /* a CHECK of the schema */
                continue;
            TEST_ASSERT_TRUE(tool_edit(folder, sql));
            struct store_verify_report report = verify(STATUS_DAMAGED, sql);
            TEST_ASSERT_TRUE_MESSAGE(strstr(report.what, table) != NULL, report.what);
            ++*changed;
        }
    }
    sqlite3_finalize(columns);
    sqlite3_close(db);
}

static void test_every_column_of_every_row(void)
{
    static const char *const tables[] = { "measurement", "match", "calibration", "audit",
                                          "instrument",  "site",  "station" };
    size_t size;
    int changed = 0;
    make_store();
    TEST_ASSERT_TRUE(tool_without_triggers(folder));
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA journal_mode = DELETE"));
    unsigned char *bytes = file_bytes(path, &size);
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++)
        change_each(tables[i], bytes, size, &changed);
    free(bytes);
    TEST_ASSERT_TRUE(changed > 180);
}

/* Changes of other kinds; the SQL stands for an evening with a shell. */
static const struct edit_case {
    const char *what, *sql, *says;
} edit_cases[] = {
    { "a value taken away", "UPDATE measurement SET ITA = NULL WHERE seq = 2", "measurement " },
    { "a value added", "UPDATE measurement SET raw_unit = 1 WHERE seq = 1", "measurement " },
    { "one bit of a spectrum",
      "UPDATE measurement SET spectrum = CAST(x'01' || substr(spectrum, 2) AS BLOB) WHERE seq = 1",
      "measurement " },
    { "the smallest change of a number", "UPDATE measurement SET L = L + 1e-14 WHERE seq = 1",
      "measurement " },
    { "text for a blob", "UPDATE match SET result = '{}' WHERE measurement = 3", "match " },
    { "a match taken away", "DELETE FROM match WHERE measurement = 3", "match " },
    { "a match added", "INSERT INTO match VALUES (2,'t','s','lab','{}',NULL)", "match " },
    { "matches exchanged",
      "UPDATE match SET measurement = -1 WHERE measurement = 1;"
      "UPDATE match SET measurement = 1 WHERE measurement = 3;"
      "UPDATE match SET measurement = 3 WHERE measurement = -1",
      "match " },
    { "a record taken away",
      "DELETE FROM client_uuid; DELETE FROM match WHERE measurement = 2;"
      "DELETE FROM measurement WHERE seq = 2",
      "measurement " },
    { "a record taken away with its audit row",
      "DELETE FROM client_uuid; DELETE FROM audit WHERE entity ="
      " (SELECT id FROM measurement WHERE seq = 2); DELETE FROM measurement WHERE seq = 2",
      "audit row 8 is missing" },
    { "the newest record without its audit row",
      "DELETE FROM client_uuid; DELETE FROM match WHERE measurement = 3;"
      "DELETE FROM measurement WHERE seq = 3",
      "measurement " },
    { "a record besides",
      "INSERT INTO measurement(seq,id,taken_at,boottime_ms,fence,specular,first_nm,step_nm,bands,"
      "spectrum,replicates,red,green,blue) SELECT 4,'x',taken_at,0,0,'sce',400,10,31,spectrum,0,"
      "1,2,3 FROM measurement WHERE seq = 1",
      "measurement x is in no audit row" },
    { "a calibration besides",
      "INSERT INTO calibration VALUES ('x','t','b',0,1,'zero',NULL,NULL,8.0)",
      "calibration x is in no audit row" },
    { "a subject besides", "INSERT INTO subject VALUES ('x')", "subject x is in no audit row" },
    { "a site besides", "INSERT INTO site VALUES (9,'x')", "site 9 is in no audit row" },
    { "an instrument besides", "INSERT INTO instrument VALUES (9,'x','','','','')",
      "instrument 9 is in no audit row" },
    { "a subject taken away", "PRAGMA foreign_keys = OFF; DELETE FROM subject", "subject " },
    { "an audit row in the middle", "DELETE FROM audit WHERE id = 5", "audit row 5 is missing" },
    { "the first audit row", "DELETE FROM audit WHERE id = 1", "audit row 1 is missing" },
    { "the last audit row of a record", "DELETE FROM audit WHERE id >= 9", " is in no audit row" },
    { "audit rows exchanged",
      "UPDATE audit SET id = 99 WHERE id = 7; UPDATE audit SET id = 7 WHERE id = 8;"
      "UPDATE audit SET id = 8 WHERE id = 99",
      "audit row 7 was changed" },
    { "digests taken away", "UPDATE audit SET digests = NULL WHERE id = 7",
      "audit row 7 was changed" },
    { "a short hash", "UPDATE audit SET hash = x'00' WHERE id = 4", "audit row 4 was changed" },
    { "a person changed: not in the chain", "UPDATE subject_person SET name = 'Zoe'", NULL },
    { "uuids pruned: not in the chain", "DELETE FROM client_uuid", NULL },
    { "a peer: not in the chain", "INSERT INTO sync_peer VALUES ('x', 1)", NULL },
    { "an uuid of no record",
      "PRAGMA foreign_keys = OFF; INSERT INTO client_uuid VALUES ('x','y',99,0)",
      "a row refers to nothing: client_uuid" },
    { "a first seq that was not", "UPDATE station SET first_seq = 0", "station " },
};

static void test_edits(void)
{
    size_t size;
    make_store();
    TEST_ASSERT_TRUE(tool_without_triggers(folder));
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA journal_mode = DELETE"));
    unsigned char *bytes = file_bytes(path, &size);
    for (size_t i = 0; i < sizeof edit_cases / sizeof *edit_cases; i++) {
        const struct edit_case *c = &edit_cases[i];
        restore(bytes, size);
        TEST_ASSERT_TRUE_MESSAGE(tool_edit(folder, c->sql), c->what);
        struct store_verify_report report =
            verify(c->says != NULL ? STATUS_DAMAGED : STATUS_OK, c->what);
        if (c->says != NULL)
            TEST_ASSERT_TRUE_MESSAGE(strstr(report.what, c->says) != NULL, report.what);
    }
    free(bytes);
}

/* ---- changes of bytes -------------------------------------------------------------------- */

/* All that the chain covers, as one number: the rows in SQL's own words. */
static unsigned long long content(bool *readable)
{
    static const char *const sql[] = { "SELECT * FROM measurement ORDER BY seq",
                                       "SELECT * FROM match ORDER BY measurement",
                                       "SELECT * FROM calibration ORDER BY id",
                                       "SELECT * FROM audit ORDER BY id" };
    unsigned long long h = 14695981039346656037u; /* FNV-1a */
    sqlite3 *db;
    *readable = sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL) == SQLITE_OK;
    for (size_t i = 0; i < sizeof sql / sizeof *sql && *readable; i++) {
        sqlite3_stmt *select = NULL;
        int stepped = sqlite3_prepare_v2(db, sql[i], -1, &select, NULL);
        while (stepped == SQLITE_OK && (stepped = sqlite3_step(select)) == SQLITE_ROW) {
            for (int c = 0; c < sqlite3_column_count(select); c++) {
                h = (h ^ (unsigned)sqlite3_column_type(select, c)) * 1099511628211u;
                const unsigned char *bytes = sqlite3_column_blob(select, c);
                for (int n = sqlite3_column_bytes(select, c); n > 0; n--)
                    h = (h ^ *bytes++) * 1099511628211u;
            }
            stepped = SQLITE_OK;
        }
        *readable = stepped == SQLITE_DONE;
        sqlite3_finalize(select);
    }
    sqlite3_close(db);
    return h;
}

/* Property: a byte of the file changed is found, or it has changed no row. */
static void test_bytes_by_chance(void)
{
    size_t size;
    bool readable;
    int found = 0, harmless = 0;
    make_store();
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA journal_mode = DELETE"));
    unsigned char *bytes = file_bytes(path, &size);
    unsigned long long before = content(&readable);
    TEST_ASSERT_TRUE(readable);
    for (int i = 0; i < 800; i++) {
        size_t at = dice_below(&dice, size);
        unsigned char was = bytes[at];
        bytes[at] ^= (unsigned char)(1 + dice_below(&dice, 255));
        restore(bytes, size);
        bytes[at] = was;
        struct store_reader *reader = NULL;
        struct store_verify_report report;
        enum status s = store_reader_open(folder, &reader);
        if (s == STATUS_OK)
            s = store_verify(reader, &report);
        store_reader_close(reader);
        unsigned long long after = content(&readable);
        if (s == STATUS_OK)
            TEST_ASSERT_TRUE_MESSAGE(readable && after == before, "a change went unnoticed");
        found += s != STATUS_OK;
        harmless += s == STATUS_OK;
    }
    free(bytes);
    TEST_ASSERT_TRUE(found > 50 && harmless > 50); /* the free space of pages is harmless */
}

/* ---- the functions alone -------------------------------------------------------------------- */

/* About a row that is not there; on a spoilt hash; on a file that is no store. */
static void test_appending_where_it_cannot(void)
{
    sqlite3 *db;
    struct audit audit;
    struct audit_report report;
    make_store();
    TEST_ASSERT_TRUE(tool_without_triggers(folder));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    TRY(audit_prepare(db, &audit));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, audit_append(&audit, "t", "", AUDIT_SUBJECT, "nobody"));
    TRY(audit_append(&audit, "t", "w", "note", ""));
    TRY(audit_verify(db, &report));
    TEST_ASSERT_EQUAL_INT64(11, report.rows);
    TRY(sql_run(db, "UPDATE audit SET hash = x'0011' WHERE id = 11"));
    audit_forget_tail(&audit);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, audit_append(&audit, "t", "", "note", ""));
    audit_done(&audit);
    TRY(sql_run(db, "DELETE FROM audit"));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, audit_verify(db, &report));
    TEST_ASSERT_EQUAL_STRING("", report.last_hash);
    TRY(sql_run(db, "DROP TABLE audit"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, audit_prepare(db, &audit));
    audit_done(&audit);
    TEST_ASSERT_EQUAL_INT(STATUS_DB, audit_verify(db, &report));
    sqlite3_close(db);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_recomputed_by_another_program);
    RUN_TEST(test_every_column_of_every_row);
    RUN_TEST(test_edits);
    RUN_TEST(test_bytes_by_chance);
    RUN_TEST(test_appending_where_it_cannot);
    return UNITY_END();
}
