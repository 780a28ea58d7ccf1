/* test_uuid.c - ids of both kinds, and that version 7 never goes back. */
#include "base/uuid.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: RFC 9562 section 4: hexadecimal digits and dashes, output in lower case. */
static const struct text_case {
    const char *what, *text;
    bool good;
} text_cases[] = {
    { "RFC 9562 A.3, version 4", "919108f7-52d1-4320-9bac-f847db4148a8", true },
    { "RFC 9562 A.6, version 7", "017f22e2-79b0-7cc3-98c4-dc0c0c07398f", true },
    { "upper case", "017F22E2-79B0-7CC3-98C4-DC0C0C07398F", true },
    { "all zero", "00000000-0000-0000-0000-000000000000", true },
    { "empty", "", false },
    { "one digit short", "017f22e2-79b0-7cc3-98c4-dc0c0c07398", false },
    { "one digit long", "017f22e2-79b0-7cc3-98c4-dc0c0c07398ff", false },
    { "no dashes", "017f22e279b07cc398c4dc0c0c07398f", false },
    { "a dash moved", "017f22e-279b0-7cc3-98c4-dc0c0c07398f", false },
    { "a digit for a dash", "017f22e2079b0-7cc3-98c4-dc0c0c07398f", false },
    { "not hexadecimal", "017f22e2-79b0-7cc3-98c4-dc0c0c07398g", false },
    { "braces", "{017f22e2-79b0-7cc3-98c4-dc0c0c07398f}", false },
};

static void test_text(void)
{
    for (size_t i = 0; i < sizeof text_cases / sizeof *text_cases; i++) {
        const struct text_case *c = &text_cases[i];
        struct uuid7 last = { 0 };
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->good, uuid_is_text(c->text), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->good ? STATUS_OK : STATUS_FORMAT,
                                      uuid7_continue(&last, c->text), c->what);
    }
}

/* RFC 9562 A.6: this id was made on 22 February 2022, 19:22:22 UTC. */
static void test_fields_as_in_the_standard(void)
{
    struct uuid7 last = { 0 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_continue(&last, "017F22E2-79B0-7CC3-98C4-DC0C0C07398F"));
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1645557742000), last.ms);
    TEST_ASSERT_EQUAL_HEX64(0xcc3, last.hi);
    TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x18c4dc0c0c07398f), last.lo);
}

static void test_random_ids(void)
{
    char id[UUID_TEXT_SIZE], before[UUID_TEXT_SIZE] = "";
    unsigned variants = 0;
    for (int i = 0; i < 1000; i++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid4_make(id));
        TEST_ASSERT_TRUE(uuid_is_text(id));
        TEST_ASSERT_EQUAL_CHAR('4', id[14]);
        TEST_ASSERT_NOT_NULL(strchr("89ab", id[19]));
        variants |= 1u << (strchr("89ab", id[19]) - "89ab");
        TEST_ASSERT_TRUE(strcmp(id, before) != 0);
        memcpy(before, id, sizeof id);
    }
    TEST_ASSERT_TRUE(variants != 0);
}

/* 2026-01-01 00:00 UTC, and what the clock does from there. */
#define NEW_YEAR INT64_C(1767225600000)
#define HOUR INT64_C(3600000)
#define YEAR INT64_C(31536000000)

static const struct clock_case {
    const char *what;
    int64_t first, then;
    bool follows; /* the time in the second id is the clock's */
} clock_cases[] = {
    { "a millisecond on", NEW_YEAR, NEW_YEAR + 1, true },
    { "ten years on", NEW_YEAR, NEW_YEAR + 10 * YEAR, true },
    { "the same millisecond", NEW_YEAR, NEW_YEAR, false },
    { "a millisecond back", NEW_YEAR, NEW_YEAR - 1, false },
    { "an hour back", NEW_YEAR, NEW_YEAR - HOUR, false },
    { "ten years back", NEW_YEAR, NEW_YEAR - 10 * YEAR, false },
    { "to 1970", NEW_YEAR, 0, false },
    { "before 1970", NEW_YEAR, -1, false },
    { "always before 1970", INT64_MIN, -5, false },
    { "beyond what an id holds", NEW_YEAR, INT64_MAX, false },
};

static void test_never_back(void)
{
    for (size_t i = 0; i < sizeof clock_cases / sizeof *clock_cases; i++) {
        const struct clock_case *c = &clock_cases[i];
        struct uuid7 last = { 0 };
        char before[UUID_TEXT_SIZE], id[UUID_TEXT_SIZE], time[24];
        TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_make(&last, c->first, before));
        for (int j = 0; j < 2000; j++) {
            TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_make(&last, c->then, id));
            TEST_ASSERT_TRUE(uuid_is_text(id));
            TEST_ASSERT_EQUAL_CHAR('7', id[14]);
            TEST_ASSERT_NOT_NULL(strchr("89ab", id[19]));
            TEST_ASSERT_MESSAGE(strcmp(id, before) > 0, c->what);
            memcpy(before, id, sizeof id);
        }
        int64_t shown = c->follows ? c->then : c->first > 0 ? c->first : 0;
        snprintf(time, sizeof time, "%08llx-%04llx", (unsigned long long)shown >> 16,
                 (unsigned long long)shown & 0xffff);
        TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(time, id, 13, c->what);
    }
}

/* Where the random bits are used up, the carry goes on into the time. */
static void test_carry(void)
{
    struct uuid7 last = { .ms = 5, .hi = 0x001, .lo = (UINT64_C(1) << 62) - 1 };
    char id[UUID_TEXT_SIZE];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_make(&last, 5, id));
    TEST_ASSERT_EQUAL_STRING_LEN("00000000-0005-7002-8000-0000", id, 28);
    last = (struct uuid7){ .ms = 5, .hi = 0xfff, .lo = (UINT64_C(1) << 62) - 1 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_make(&last, 5, id));
    TEST_ASSERT_EQUAL_STRING_LEN("00000000-0006-7000-8000-0000", id, 28);
}

/* expect: by hand; the greater of both, in each of the three parts. */
static void test_continue(void)
{
    static const char *const rising[] = {
        "017f22e2-79b0-7cc3-98c4-dc0c0c07398f",
        "017f22e2-79b0-7cc3-98c4-dc0c0c073990",
        "017f22e2-79b0-7cc4-8000-000000000000",
        "017f22e2-79b1-7000-8000-000000000000",
    };
    for (size_t i = 0; i < 4; i++) {
        for (size_t j = 0; j < 4; j++) {
            struct uuid7 last = { 0 }, greater = { 0 };
            char id[UUID_TEXT_SIZE];
            TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_continue(&greater, rising[i > j ? i : j]));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_continue(&last, rising[i]));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_continue(&last, rising[j]));
            TEST_ASSERT_EQUAL_MEMORY(&greater, &last, sizeof last);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, uuid7_make(&last, 0, id));
            TEST_ASSERT_TRUE(strcmp(id, rising[i]) > 0 && strcmp(id, rising[j]) > 0);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_text);
    RUN_TEST(test_fields_as_in_the_standard);
    RUN_TEST(test_random_ids);
    RUN_TEST(test_never_back);
    RUN_TEST(test_carry);
    RUN_TEST(test_continue);
    return UNITY_END();
}
