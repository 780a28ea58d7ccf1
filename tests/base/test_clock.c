/* test_clock.c - times as text, and clocks that go on. */
#include "base/clock.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: date -u -d @SECONDS, and RFC 3339's four digits of a year */
static const struct text_case {
    const char *what;
    int64_t ms;
    const char *text;
} text_cases[] = {
    { "the first", 0, "1970-01-01T00:00:00.000Z" },
    { "before it", -1, "1970-01-01T00:00:00.000Z" },
    { "a leap day", INT64_C(1709164800007), "2024-02-29T00:00:00.007Z" },
    { "beyond 32 bits", INT64_C(4294967296999), "2106-02-07T06:28:16.999Z" },
    { "the last", INT64_C(253402300799999), "9999-12-31T23:59:59.999Z" },
    { "after it", INT64_MAX, "9999-12-31T23:59:59.999Z" },
};

static void test_text(void)
{
    for (size_t i = 0; i < sizeof text_cases / sizeof *text_cases; i++) {
        char text[CLOCK_TEXT_SIZE];
        clock_text(text_cases[i].ms, text);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(text_cases[i].text, text, text_cases[i].what);
    }
}

static void test_clocks(void)
{
    int64_t monotonic = clock_monotonic_ms(), boottime = clock_boottime_ms();
    TEST_ASSERT_TRUE(boottime >= monotonic); /* by the time that the machine was suspended */
    TEST_ASSERT_TRUE(clock_monotonic_ms() >= monotonic);
    TEST_ASSERT_TRUE(clock_realtime_ms() > INT64_C(1700000000000));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_text);
    RUN_TEST(test_clocks);
    return UNITY_END();
}
