/* test_table_verify.c - a table against itself computed anew. */
#include "db/table_verify.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <sqlite3.h>

#include "db/table_file.h"
#include "db/table_hash.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "t.db", path);
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

static void build_small(const char *model)
{
    struct recipe recipe = small_recipe(model);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
}

static struct table_verify_report verify(enum status expect, const char *what)
{
    struct table_verify_report report = { .rows = 77 };
    heard_start();
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, table_verify(path, 2, NULL, &report), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect == STATUS_OK ? 0 : 1, heard_count(), what);
    return report;
}

/* Property: on the machine that built it a table comes out bit for bit, on any
 * number of threads. */
static void test_own_tables(void)
{
    static const char *const models[] = { "two-layer", "half-space", "paper" };
    for (size_t i = 0; i < 3; i++) {
        build_small(models[i]);
        for (unsigned threads = 1; threads <= 3; threads++) {
            struct table_verify_report r;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, table_verify(path, threads, NULL, &r));
            TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, r.rows);
            TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, r.identical_rows);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, r.worst);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, r.worst_spectrum);
            TEST_ASSERT_EQUAL_size_t(0, r.worst_id);
            TEST_ASSERT_TRUE(r.content_hash_matches);
        }
    }
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* A zero with a sign in the recipe: the file keeps none, and still agrees. */
static void test_negative_zero(void)
{
    struct recipe recipe = small_recipe("two-layer");
    recipe.grid.Cm.lo = -0.0;
    recipe.grid.Bm.lo = -0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, verify(STATUS_OK, "-0").identical_rows);
}

/* More rows than one chunk of 8 192. */
static void test_several_chunks(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    recipe.grid.Cm.n = 20; /* 20 x 21 x 48 */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_EQUAL_size_t(20160, verify(STATUS_OK, "chunks").identical_rows);
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE entry SET l = l + 1 WHERE id = 20000"));
    TEST_ASSERT_TRUE(table_rehash(path));
    TEST_ASSERT_EQUAL_size_t(20000, verify(STATUS_DAMAGED, "far out").worst_id);
}

/* One row changed by SQL; the pages hash is right again, for `rehash` the content
 * hash too.  expect: a difference beyond 1e-10 is one, and its row is named. */
static const struct change_case {
    const char *what, *sql;
    bool rehash;
    enum status status;
    const char *says;
    size_t worst_id, identical;
    double worst_min, worst_max;
} change_cases[] = {
    { "L* by much", "UPDATE entry SET l = l + 1 WHERE id = 33", true, STATUS_DAMAGED, "row 33 ", 33,
      63, 0.999, 1.001 },
    { "the same with the old hash", "UPDATE entry SET l = l + 1 WHERE id = 33", false,
      STATUS_DAMAGED, "content hash", 33, 63, 0.999, 1.001 },
    { "the first row", "UPDATE entry SET cm = 0.1 WHERE id = 1", true, STATUS_DAMAGED, "row 1 ", 1,
      63, 0.1, 0.1 },
    { "the last row", "UPDATE entry SET b_ = b_ - 1e-9 WHERE id = 64", true, STATUS_DAMAGED,
      "row 64 ", 64, 63, 0.99e-9, 1.01e-9 },
    { "just too much", "UPDATE entry SET r = r + 1.1e-10 WHERE id = 9", true, STATUS_DAMAGED,
      "row 9 ", 9, 63, 1.0e-10, 1.2e-10 },
    { "within the tolerance", "UPDATE entry SET r = r + 0.9e-10 WHERE id = 9", true, STATUS_OK, "",
      9, 63, 0.8e-10, 1.0e-10 },
    { "within it, with the old hash", "UPDATE entry SET r = r + 0.9e-10 WHERE id = 9", false,
      STATUS_DAMAGED, "content hash", 9, 63, 0.8e-10, 1.0e-10 },
    { "of two the larger",
      "UPDATE entry SET a = a + 1 WHERE id = 5; UPDATE entry SET a = a + 2 WHERE id = 4", true,
      STATUS_DAMAGED, "row 4 ", 4, 62, 1.99, 2.01 },
    { "of two alike the first", "UPDATE entry SET ch = 0.5 WHERE id IN (4, 8)", true,
      STATUS_DAMAGED, "row 4 ", 4, 62, 0.1, 0.5 },
    { "infinity", "UPDATE entry SET g = 9e999 WHERE id = 12", true, STATUS_DAMAGED, "row 12 ", 12,
      63, (double)INFINITY, (double)INFINITY },
    { "another version wrote it", "UPDATE meta SET value = '0.0.9' WHERE key = 'code_version'",
      true, STATUS_DAMAGED, "content hash", 0, 64, 0.0, 0.0 },
    { "another recipe's rows", "UPDATE meta SET value = '1.33' WHERE key = 'eta'", true,
      STATUS_DAMAGED, "row ", 0, 0, 0.1, 100.0 },
    { "a hash of something else",
      "UPDATE meta SET value = replace(value, substr(value, 1, 1), 'e') WHERE key = "
      "'content_sha256'; UPDATE meta SET value = 'f' || substr(value, 2) WHERE key = "
      "'content_sha256'",
      false, STATUS_DAMAGED, "content hash", 0, 64, 0.0, 0.0 },
};

static void test_changed_rows(void)
{
    for (size_t i = 0; i < sizeof change_cases / sizeof *change_cases; i++) {
        const struct change_case *c = &change_cases[i];
        build_small("two-layer");
        TEST_ASSERT_TRUE_MESSAGE(table_edit(path, c->sql), c->what);
        TEST_ASSERT_TRUE_MESSAGE(c->rehash ? table_rehash(path) : table_reseal(path), c->what);
        struct table_verify_report r = verify(c->status, c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        TEST_ASSERT_EQUAL_size_t_MESSAGE(SMALL_TABLE_ROWS, r.rows, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->identical, r.identical_rows, c->what);
        TEST_ASSERT_MESSAGE(r.worst >= c->worst_min && r.worst <= c->worst_max, c->what);
        if (c->identical > 0)
            TEST_ASSERT_EQUAL_size_t_MESSAGE(c->worst_id, r.worst_id, c->what);
    }
}

/* A table that another version wrote is judged by that version's hash. */
static void test_another_version(void)
{
    struct table table;
    struct table_meta meta;
    struct table_content_hash hash;
    char hex[TABLE_SHA256_SIZE], sql[256];
    build_small("half-space");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_read(path, &table));
    table_meta_of(&table.recipe, &meta);
    TEST_ASSERT_EQUAL_STRING("code_version", meta.key[4]);
    strcpy(meta.value[4], "0.0.9");
    table_content_begin(&hash, &meta);
    table_content_rows(&hash, &table, 0, table.n, 1);
    table_content_end(&hash, hex);
    table_done(&table);
    snprintf(sql, sizeof sql,
             "UPDATE meta SET value = '0.0.9' WHERE key = 'code_version';"
             "UPDATE meta SET value = '%s' WHERE key = 'content_sha256'",
             hex);
    TEST_ASSERT_TRUE(table_edit(path, sql));
    TEST_ASSERT_TRUE(table_reseal(path));
    TEST_ASSERT_TRUE(verify(STATUS_OK, "0.0.9").content_hash_matches);
}

/* Bands of one row moved by so many neighbours among the float32. */
static void move_bands(size_t id, int band, int ulps)
{
    sqlite3 *db;
    sqlite3_blob *blob;
    unsigned char bytes[4];
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    TEST_ASSERT_EQUAL_INT(
        SQLITE_OK, sqlite3_blob_open(db, "main", "entry", "spectrum", (sqlite3_int64)id, 1, &blob));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_blob_read(blob, bytes, 4, 4 * band));
    unsigned long bits = bytes[0] | (unsigned long)bytes[1] << 8 | (unsigned long)bytes[2] << 16 |
                         (unsigned long)bytes[3] << 24;
    bits += (unsigned long)ulps; /* reflectances are positive: neighbours differ by 1 */
    for (int i = 0; i < 4; i++)
        bytes[i] = (unsigned char)(bits >> (8 * i));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_blob_write(blob, bytes, 4, 4 * band));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_blob_close(blob));
    sqlite3_close(db);
}

/* expect: one unit in the last place is a rounding, two are none. */
static const struct ulp_case {
    const char *what;
    int band, ulps;
    enum status status;
} ulp_cases[] = {
    { "one up", 0, 1, STATUS_OK },         { "one down", 30, -1, STATUS_OK },
    { "two up", 15, 2, STATUS_DAMAGED },   { "two down", 15, -2, STATUS_DAMAGED },
    { "many", 7, 100000, STATUS_DAMAGED },
};

static void test_spectra_to_a_unit_in_the_last_place(void)
{
    for (size_t i = 0; i < sizeof ulp_cases / sizeof *ulp_cases; i++) {
        const struct ulp_case *c = &ulp_cases[i];
        build_small("two-layer");
        move_bands(21, c->band, c->ulps);
        TEST_ASSERT_TRUE(table_rehash(path));
        struct table_verify_report r = verify(c->status, c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(fabs((double)c->ulps), r.worst_spectrum, c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, r.worst, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(21, r.worst_id, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(63, r.identical_rows, c->what);
        if (c->status != STATUS_OK)
            TEST_ASSERT_MESSAGE(heard_contains("row 21 "), heard_last());
    }
}

/* A spectrum that is not a number, and one with a sign. */
static void test_spectra_that_are_none(void)
{
    static const char *const hex[] = { "0000c07f", "0000c0ff", "000080bf", "0000807f" };
    for (size_t i = 0; i < 4; i++) {
        char sql[160];
        build_small("two-layer");
        snprintf(sql, sizeof sql,
                 "UPDATE entry SET spectrum = CAST(x'%s' || substr(spectrum, 5) AS BLOB)"
                 " WHERE id = 50",
                 hex[i]);
        TEST_ASSERT_TRUE(table_edit(path, sql));
        TEST_ASSERT_TRUE(table_rehash(path));
        struct table_verify_report r = verify(STATUS_DAMAGED, hex[i]);
        TEST_ASSERT_EQUAL_size_t(50, r.worst_id);
        TEST_ASSERT_TRUE(r.worst_spectrum > 1e6);
    }
}

/* A rounding in the spectrum of a later row does not hide the row that is wrong. */
static void test_the_row_that_is_wrong_is_named(void)
{
    build_small("two-layer");
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE entry SET l = l + 1e-6 WHERE id = 5"));
    move_bands(9, 3, 1);
    TEST_ASSERT_TRUE(table_rehash(path));
    struct table_verify_report r = verify(STATUS_DAMAGED, "row 5 wrong, row 9 rounded");
    TEST_ASSERT_EQUAL_size_t(5, r.worst_id);
    TEST_ASSERT_MESSAGE(heard_contains("row 5 "), heard_last());
    TEST_ASSERT_EQUAL_size_t(62, r.identical_rows);
}

/* What the readers refuse is refused here, with their message and no other. */
static void test_files_that_are_refused(void)
{
    struct table_verify_report report = { .rows = 77 };
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, table_verify(path, 1, NULL, &report));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    build_small("paper");
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE entry SET l = l + 1 WHERE id = 5"));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, table_verify(path, 1, NULL, &report));
    TEST_ASSERT_EQUAL_INT(2, heard_count());
    TEST_ASSERT_TRUE(table_edit(path, "DELETE FROM entry WHERE id = 5"));
    TEST_ASSERT_TRUE(table_reseal(path));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, table_verify(path, 1, NULL, &report));
    TEST_ASSERT_EQUAL_INT(3, heard_count());
    TEST_ASSERT_EQUAL_size_t(77, report.rows);
}

struct watch {
    size_t calls, stop_at, done, total;
};

static bool watch_on(void *context, size_t done, size_t total)
{
    struct watch *w = context;
    w->done = done;
    w->total = total;
    return ++w->calls != w->stop_at;
}

/* 20 160 rows in chunks of 8 192: three reports before a chunk, one at the end. */
static void test_progress_and_stopping(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    recipe.grid.Cm.n = 20;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    for (size_t stop_at = 0; stop_at <= 4; stop_at++) {
        struct watch w = { .stop_at = stop_at };
        struct progress progress = { watch_on, &w };
        struct table_verify_report report = { .rows = 77 };
        TEST_ASSERT_EQUAL_INT(stop_at == 0 ? STATUS_OK : STATUS_CANCELLED,
                              table_verify(path, 2, &progress, &report));
        TEST_ASSERT_EQUAL_size_t(stop_at == 0 ? 4 : stop_at, w.calls);
        TEST_ASSERT_EQUAL_size_t(stop_at == 0 ? 20160 : 77, report.rows);
        TEST_ASSERT_EQUAL_size_t(20160, w.total);
        TEST_ASSERT_EQUAL_size_t(w.calls == 4 ? 20160 : 8192 * (w.calls - 1), w.done);
    }
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_own_tables);
    RUN_TEST(test_negative_zero);
    RUN_TEST(test_several_chunks);
    RUN_TEST(test_changed_rows);
    RUN_TEST(test_another_version);
    RUN_TEST(test_spectra_to_a_unit_in_the_last_place);
    RUN_TEST(test_spectra_that_are_none);
    RUN_TEST(test_the_row_that_is_wrong_is_named);
    RUN_TEST(test_files_that_are_refused);
    RUN_TEST(test_progress_and_stopping);
    return UNITY_END();
}
