/* test_search.c - answers from tables of thousands of rows against brute force; the short form of
 * `make search`, which has a million. */
#include "match/nearest.h"
#include "tests/support/brute.h"
#include "tests/support/skin_queries.h"
#include "unity.h"

enum { SIDE = 22, QUERIES = 400 };

static struct table skins;

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, skin_table(SIDE, &skins));
}

void tearDown(void)
{
    table_done(&skins);
}

static void test_the_same_rows(void)
{
    static const enum match_by ways[] = { MATCH_LAB, MATCH_SPECTRUM, MATCH_RGB };
    static struct skin_query query[QUERIES];
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct nearest *nearest;
        struct brute *brute = brute_open(&skins, ways[i]);
        TEST_ASSERT_NOT_NULL(brute);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, ways[i], &nearest));
        for (size_t k = 1; k <= 5; k += 4)
            for (int off = 0; off < 2; off++) {
                skin_queries(&skins, off == 1, QUERIES, query);
                struct brute_verdict v = brute_judge(brute, nearest, query, QUERIES, k);
                TEST_ASSERT_EQUAL_size_t_MESSAGE(0, v.wrong, match_by_name(ways[i]));
                TEST_ASSERT_TRUE_MESSAGE(v.rounding <= 2, match_by_name(ways[i]));
            }
        nearest_close(nearest);
        brute_close(brute);
    }
}

/* Or nothing would be judged: brute force on another table than the index's. */
static void test_wrong_rows_are_seen(void)
{
    static struct skin_query query[QUERIES];
    struct nearest *nearest;
    struct table other;
    skin_queries(&skins, false, QUERIES, query);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, skin_table(SIDE, &other));
    for (size_t row = 0; row < other.n; row += 10)
        other.a[row] += 3.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_LAB, &nearest));
    struct brute *brute = brute_open(&other, MATCH_LAB);
    TEST_ASSERT_NOT_NULL(brute);
    struct brute_verdict v = brute_judge(brute, nearest, query, QUERIES, 1);
    TEST_ASSERT_TRUE(v.wrong > QUERIES / 20);
    TEST_ASSERT_TRUE(v.wrong < QUERIES / 2);
    brute_close(brute);
    nearest_close(nearest);
    table_done(&other);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_same_rows);
    RUN_TEST(test_wrong_rows_are_seen);
    return UNITY_END();
}
