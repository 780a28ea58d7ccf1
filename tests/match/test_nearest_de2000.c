/* test_nearest_de2000.c - nearest rows by CIEDE2000 against every row's distance: the short form of
 * `make de2000`, and queries where the bound's steps have their edges. */
#include "match/nearest.h"

#include <stdio.h>

#include "tests/support/de2000_rows.h"
#include "tests/support/dice.h"
#include "unity.h"

static struct table table;
static struct nearest *nearest;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, de2000_table(10000, &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&table, MATCH_DE2000, &nearest));
}

void tearDown(void)
{
    nearest_close(nearest);
    table_done(&table);
}

static void test_near_and_off(void)
{
    size_t limited = 0;
    for (size_t number = 0; number < 3000; number++) {
        char what[32];
        snprintf(what, sizeof what, "query %zu", number);
        TEST_ASSERT_TRUE_MESSAGE(de2000_agrees(nearest, &table, number, &limited), what);
    }
    TEST_ASSERT_EQUAL_size_t(1000, limited);
}

/* Most of the work is left out: a search that looked at everything would pass the above. */
static void test_looks_at_few(void)
{
    struct nearest_work work = { 0 };
    for (size_t number = 0; number < 400; number++) {
        struct nearest_query query;
        struct nearest_hit hit;
        size_t found;
        de2000_query(&table, (enum de2000_sort)(number % DE2000_SORTS), number, &query);
        query.work = &work;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &query, 1, &hit, &found));
    }
    TEST_ASSERT_TRUE(work.rows < 400 * 10);
    TEST_ASSERT_TRUE(work.judged < 400 * 400);
}

/* Grey, the far side of it, blue, hue 0, and lightness from end to end and beyond what bounds are
 * for. */
static void test_far_from_skin(void)
{
    static const double places[][3] = {
        { 50, 0, 0 },      { 50, -9, -15 }, { 50, 5, -60 },   { 50, 40, 1e-9 },  { 50, 40, -1e-9 },
        { 50, -40, 1e-9 }, { 0, 0, 0 },     { 100, 0, 0 },    { -20, 10, 10 },   { 120, 10, 10 },
        { -21, 10, 10 },   { 121, 10, 10 }, { 50, 900, 900 }, { 50, 1001, 100 }, { 50, -1e-30, 0 },
    };
    struct dice dice = { 31 };
    for (size_t i = 0; i < 20 * sizeof places / sizeof *places; i++) {
        struct nearest_hit found[3], scanned[3];
        struct nearest_query query = { .has_colour = true };
        size_t n_found = 0, n_scanned = 0;
        for (int k = 0; k < 3; k++) {
            query.Lab[k] = places[i / 20][k];
            if (i % 20 >= 10)
                query.Lab[k] *= 1.0 - dice_between(&dice, 0.0, 0.1);
        }
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &query, 3, found, &n_found));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_scan(nearest, &query, 3, scanned, &n_scanned));
        TEST_ASSERT_EQUAL_size_t(n_scanned, n_found);
        TEST_ASSERT_EQUAL_MEMORY(scanned, found, sizeof found);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_near_and_off);
    RUN_TEST(test_looks_at_few);
    RUN_TEST(test_far_from_skin);
    return UNITY_END();
}
