/* test_no_memory.c - allocations that fail, one after the other: the status says
 * so, results stay untouched, nothing leaks (seen under AddressSanitizer).
 *
 * The sources are compiled into this test with an allocator that fails on
 * request; their objects in the library are then not linked. */
#define _DEFAULT_SOURCE 1 /* as base/huge_pages.c, which is compiled in */
#include <stdlib.h>
#include <string.h>

static int allocations_left = -1; /* -1: never fail */

static int may_allocate(void)
{
    if (allocations_left == 0)
        return 0;
    if (allocations_left > 0)
        allocations_left--;
    return 1;
}

static void *test_calloc(size_t n, size_t size)
{
    return may_allocate() ? calloc(n, size) : NULL;
}

static void *test_aligned_alloc(size_t alignment, size_t size)
{
    return may_allocate() ? aligned_alloc(alignment, size) : NULL;
}

#define calloc test_calloc
#define aligned_alloc test_aligned_alloc
#include "base/huge_pages.c"
#include "match/components.c"
#include "match/kd_make.c"
#include "match/kd_tree.c"
#include "match/match.c"
#include "match/nearest.c"
#include "match/recipe.c"
#include "match/table.c"
#undef calloc
#undef aligned_alloc

#include "unity.h"

static struct recipe recipe;
static struct table table;

void setUp(void)
{
    allocations_left = -1;
    recipe = recipe_default(model_find("two-layer"));
    recipe.grid =
        (struct grid){ { 0.1, 0.5, 5, false }, { 0, 1, 3, false }, { 0.01, 0.1, 4, false } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 60, &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&table, 0, 60, 1));
}

void tearDown(void)
{
    allocations_left = -1;
    table_done(&table);
}

/* Every number of allocations up to the one that is enough. */
static void test_table_init(void)
{
    for (int enough = 0;; enough++) {
        struct table t, before;
        memset(&t, 77, sizeof t);
        before = t;
        allocations_left = enough;
        enum status s = table_init(&recipe, 60, &t);
        if (s == STATUS_OK) {
            TEST_ASSERT_EQUAL_INT(2, enough); /* columns, spectra */
            table_done(&t);
            return;
        }
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_EQUAL_MEMORY(&before, &t, sizeof t);
    }
}

/* One row maker a thread. */
static void test_table_compute(void)
{
    for (int enough = 0; enough < 3; enough++) {
        allocations_left = enough;
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, table_compute(&table, 0, 60, 3));
    }
    allocations_left = 3;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&table, 0, 60, 3));
}

static void test_recipe_check(void)
{
    allocations_left = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, recipe_check(&recipe));
}

/* expect: the search itself, what its kind prepares (codes: 1, components: 2,
 * a tree: its head, a builder, its arrays and points), and the weights of the table's bands. */
static const struct open_case {
    enum match_by by;
    int enough;
} open_cases[] = {
    { MATCH_LAB, 1 + 4 + 1 },     { MATCH_SPECTRUM, 1 + 2 + 4 + 1 },
    { MATCH_RGB, 1 + 1 + 4 + 1 }, { MATCH_RGB_FLOAT, 1 + 1 + 4 + 1 },
    { MATCH_DE2000, 1 + 4 + 1 },
};

static void test_open(void)
{
    for (size_t i = 0; i < sizeof open_cases / sizeof *open_cases; i++) {
        const struct open_case *c = &open_cases[i];
        for (int enough = 0; enough <= c->enough; enough++) {
            struct matcher matcher = { .table = NULL };
            allocations_left = enough;
            enum status s = matcher_open(&table, c->by, &matcher);
            TEST_ASSERT_EQUAL_INT_MESSAGE(enough < c->enough ? STATUS_NO_MEMORY : STATUS_OK, s,
                                          match_by_name(c->by));
            TEST_ASSERT_EQUAL_INT(s == STATUS_OK, matcher.table != NULL);
            matcher_close(&matcher);
        }
    }
}

/* A table whose bytes are more than a size can say. */
static void test_sizes_that_overflow(void)
{
    TEST_ASSERT_NULL(huge_pages_alloc(SIZE_MAX / 4, 8));
    TEST_ASSERT_NULL(huge_pages_alloc(SIZE_MAX, 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_table_init);
    RUN_TEST(test_table_compute);
    RUN_TEST(test_recipe_check);
    RUN_TEST(test_open);
    RUN_TEST(test_sizes_that_overflow);
    return UNITY_END();
}
