/* test_lattice_no_memory.c - allocations that fail, one after the other, while what makes a large
 * table is opened: the status says so, nothing leaks (seen under AddressSanitizer).
 *
 * The sources are compiled into this test with an allocator that fails on request; their objects
 * in the library are then not linked. */
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
#include "match/lattice.c"
#include "match/skeleton.c"
#undef calloc
#undef aligned_alloc

#include "match/table_maker.h"
#include "unity.h"

void setUp(void)
{
    allocations_left = -1;
}

void tearDown(void)
{
    allocations_left = -1;
}

/* expect: itself; scratch, three axes with samples, weights and parts, rows and weights, and what
 * compares; then the sums of each of two threads. */
static void test_open(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    for (int enough = 0;; enough++) {
        struct table_maker *maker = NULL;
        allocations_left = enough;
        enum status s = table_maker_open(&recipe, 2, &maker);
        allocations_left = -1;
        if (s == STATUS_OK) {
            TEST_ASSERT_EQUAL_INT(1 + 3 + 3 * 3 + 2 + 4 + 2 * 3, enough);
            table_maker_close(maker);
            return;
        }
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_NULL(maker);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_open);
    return UNITY_END();
}
