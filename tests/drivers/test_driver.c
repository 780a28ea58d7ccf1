/* test_driver.c - the registry, names of what the contract counts, how a driver fails. */
#include "drivers/driver.h"

#include <string.h>

#include "drivers/registry.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- the registry ---------------------------------------------------------------------- */

static void test_find_by_name(void)
{
    for (size_t i = 0; driver_registry[i] != NULL; i++)
        TEST_ASSERT_EQUAL_PTR(driver_registry[i], driver_find(driver_registry[i]->name));
}

static void test_find_refuses(void)
{
    static const char *const unknown[] = { "", "Simulated", "simulated:", "simulate", "km" };
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        TEST_ASSERT_NULL_MESSAGE(driver_find(unknown[i]), unknown[i]);
}

/* ---- names ------------------------------------------------------------------------------- */

static const char *result_name(size_t value)
{
    return driver_result_name((enum driver_result)value);
}

static const char *geometry_name(size_t value)
{
    return driver_geometry_name((enum driver_geometry)value);
}

static const char *calibration_name(size_t value)
{
    return driver_calibration_name((enum driver_calibration)value);
}

/* expect: the tokens that reach the socket, which never change */
static const struct names_case {
    const char *what;
    const char *(*name)(size_t value);
    const char *expect[13]; /* from 0; then NULL */
} names_cases[] = {
    { "result",
      result_name,
      { "ok", "cancelled", "timeout", "gone", "busy", "refused", "implausible", "protocol",
        "battery", "fault", "unsupported", "no_permission" } },
    { "geometry", geometry_name, { "d/8", "45/0" } },
    { "calibration", calibration_name, { "zero", "white" } },
    { "warning",
      driver_warning_name,
      { "battery_low", "lamp_weak", "calibration_old", "temperature", "over_range",
        "conditions_differ" } },
};

static void test_names(void)
{
    for (size_t i = 0; i < sizeof names_cases / sizeof *names_cases; i++) {
        const struct names_case *c = &names_cases[i];
        size_t n = 0;
        for (; c->expect[n] != NULL; n++)
            TEST_ASSERT_EQUAL_STRING_MESSAGE(c->expect[n], c->name(n), c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unknown", c->name(n), c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unknown", c->name((size_t)-1), c->what);
    }
}

static void test_fail_cuts_what_is_too_long(void)
{
    struct driver_error error;
    char text[2 * DRIVER_TEXT_SIZE];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, driver_fail(&error, DRIVER_BUSY, text, "%s", text));
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, error.result);
    TEST_ASSERT_EQUAL_size_t(DRIVER_TEXT_SIZE - 1, strlen(error.text));
    TEST_ASSERT_EQUAL_size_t(DRIVER_CODE_SIZE - 1, strlen(error.code));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, driver_fail(&error, DRIVER_GONE, NULL, "%d", 7));
    TEST_ASSERT_EQUAL_STRING("", error.code);
    TEST_ASSERT_EQUAL_STRING("7", error.text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_find_by_name);
    RUN_TEST(test_find_refuses);
    RUN_TEST(test_names);
    RUN_TEST(test_fail_cuts_what_is_too_long);
    return UNITY_END();
}
