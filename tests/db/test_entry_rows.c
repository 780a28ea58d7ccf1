/* test_entry_rows.c - rows in memory as SQL sees them: expected is what the test put there. */
#include "db/entry_rows.h"

#include <string.h>

#include "unity.h"

enum { ROWS = 5, BANDS = 31 };

static sqlite3 *db;
static struct table table;
static struct entry_rows rows;

static void fill(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    float spectrum[BANDS];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &table));
    for (size_t i = 0; i < ROWS; i++) {
        double x = (double)i;
        struct table_row row = {
            x, x + 0.1, x + 0.2, { x + 0.3, x + 0.4, x + 0.5 }, { x, -x, 2 * x }
        };
        for (size_t b = 0; b < BANDS; b++)
            spectrum[b] = (float)(100 * i + b);
        table_set(&table, i, &row, spectrum);
    }
    rows = (struct entry_rows){ &table, ROWS };
}

void setUp(void)
{
    memset(&table, 0, sizeof table);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &db));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, entry_rows_register(db, &rows));
}

void tearDown(void)
{
    sqlite3_close(db);
    table_done(&table);
}

static sqlite3_stmt *select_all(void)
{
    sqlite3_stmt *select;
    TEST_ASSERT_EQUAL_INT(
        SQLITE_OK, sqlite3_prepare_v2(db, "SELECT *, rowid FROM entry_rows", -1, &select, NULL));
    return select;
}

static void test_all_columns(void)
{
    fill("two-layer");
    sqlite3_stmt *select = select_all();
    for (int i = 0; i < ROWS; i++) {
        double x = i;
        const double expect[] = { x, x + 0.1, x + 0.2, x + 0.3, x + 0.4, x + 0.5, x, -x, 2 * x };
        float spectrum[BANDS];
        TEST_ASSERT_EQUAL_INT(SQLITE_ROW, sqlite3_step(select));
        TEST_ASSERT_EQUAL_INT(11, sqlite3_column_count(select));
        TEST_ASSERT_EQUAL_INT(1 + i, sqlite3_column_int(select, 10));
        for (int c = 0; c < 9; c++)
            TEST_ASSERT_EQUAL_DOUBLE(expect[c], sqlite3_column_double(select, c));
        TEST_ASSERT_EQUAL_INT(4 * BANDS, sqlite3_column_bytes(select, 9));
        memcpy(spectrum, sqlite3_column_blob(select, 9), sizeof spectrum); /* little-endian here */
        TEST_ASSERT_EQUAL_FLOAT((float)(100 * i), spectrum[0]);
        TEST_ASSERT_EQUAL_FLOAT((float)(100 * i + BANDS - 1), spectrum[BANDS - 1]);
    }
    TEST_ASSERT_EQUAL_INT(SQLITE_DONE, sqlite3_step(select));
    sqlite3_finalize(select);
}

static void test_without_spectra(void)
{
    fill("paper");
    sqlite3_stmt *select = select_all();
    TEST_ASSERT_EQUAL_INT(SQLITE_ROW, sqlite3_step(select));
    TEST_ASSERT_EQUAL_INT(SQLITE_NULL, sqlite3_column_type(select, 9));
    sqlite3_finalize(select);
}

/* One statement for chunk after chunk. */
static void test_rows_change_between_two(void)
{
    fill("two-layer");
    sqlite3_stmt *count;
    TEST_ASSERT_EQUAL_INT(
        SQLITE_OK,
        sqlite3_prepare_v2(db, "SELECT count(*), max(cm) FROM entry_rows", -1, &count, NULL));
    const struct entry_rows chunk[] = { { &table, 5 }, { &table, 2 }, { &table, 0 } };
    for (size_t i = 0; i < 3; i++) {
        rows = chunk[i];
        TEST_ASSERT_EQUAL_INT(SQLITE_ROW, sqlite3_step(count));
        TEST_ASSERT_EQUAL_INT((int)chunk[i].n, sqlite3_column_int(count, 0));
        if (chunk[i].n > 0)
            TEST_ASSERT_EQUAL_INT((int)chunk[i].n - 1, sqlite3_column_int(count, 1));
        sqlite3_reset(count);
    }
    sqlite3_finalize(count);
}

static void test_nothing_can_be_written(void)
{
    fill("two-layer");
    TEST_ASSERT_NOT_EQUAL_INT(SQLITE_OK,
                              sqlite3_exec(db, "DELETE FROM entry_rows", NULL, NULL, NULL));
    TEST_ASSERT_NOT_EQUAL_INT(
        SQLITE_OK, sqlite3_exec(db, "CREATE VIRTUAL TABLE t USING entry_rows", NULL, NULL, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_columns);
    RUN_TEST(test_without_spectra);
    RUN_TEST(test_rows_change_between_two);
    RUN_TEST(test_nothing_can_be_written);
    return UNITY_END();
}
