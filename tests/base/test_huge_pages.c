/* test_huge_pages.c - memory on lines of the cache, or on large pages; what is no size. */
#include "base/huge_pages.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static const struct size_case {
    const char *what;
    size_t count, size, aligned;
} size_cases[] = {
    { "a byte", 1, 1, 64 },
    { "a line and a byte", 65, 1, 64 },
    { "less than is worth a page", 4194303, 1, 64 },
    { "two pages", 4194304, 1, 2097152 },
    { "two pages and a number", 524289, 8, 2097152 },
};

static void test_all_of_it_can_be_written(void)
{
    for (size_t i = 0; i < sizeof size_cases / sizeof *size_cases; i++) {
        const struct size_case *c = &size_cases[i];
        unsigned char *memory = huge_pages_alloc(c->count, c->size);
        TEST_ASSERT_NOT_NULL_MESSAGE(memory, c->what);
        TEST_ASSERT_EQUAL_MESSAGE(0, (uintptr_t)memory % c->aligned, c->what);
        memset(memory, 77, c->count * c->size);
        TEST_ASSERT_EQUAL_MESSAGE(77, memory[c->count * c->size - 1], c->what);
        free(memory);
    }
}

static void test_no_sizes(void)
{
    TEST_ASSERT_NULL(huge_pages_alloc(SIZE_MAX / 4, 8));
    TEST_ASSERT_NULL(huge_pages_alloc(SIZE_MAX, 1));
    TEST_ASSERT_NULL(huge_pages_alloc(1, 0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_of_it_can_be_written);
    RUN_TEST(test_no_sizes);
    return UNITY_END();
}
