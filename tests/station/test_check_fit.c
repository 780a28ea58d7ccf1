/* test_check_fit.c - which shots of a check tile are refused, and what is said then. */
#include "station/check_fit.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: check_fit.h */
static const struct fit_case {
    const char *what;
    unsigned warnings, shot_flags, set_flags;
    const char *token; /* NULL: fit */
    const char *to_do;
} fit_cases[] = {
    { "nothing to say", 0, 0, 0, NULL, NULL },
    { "one shot", 0, 0, QUALITY_SINGLE, NULL, NULL },
    { "a tile does not blanch", 0, 0, QUALITY_REDNESS_FALLS, NULL, NULL },
    { "a battery that lasts", DRIVER_WARNING_BATTERY_LOW, 0, 0, NULL, NULL },
    { "a weak lamp", DRIVER_WARNING_LAMP_WEAK, 0, 0, "lamp_weak", "charge the battery" },
    { "cold", DRIVER_WARNING_TEMPERATURE, 0, 0, "temperature", "half an hour" },
    { "due", DRIVER_WARNING_CALIBRATION_OLD, 0, 0, "calibration_old", "calibrate" },
    { "set otherwise", DRIVER_WARNING_CONDITIONS_DIFFER, 0, 0, "conditions_differ", "calibrate" },
    { "too bright", DRIVER_WARNING_OVER_RANGE, 0, 0, "over_range", "darker tile" },
    { "a port that gapes", 0, QUALITY_SCI_BELOW_SCE, 0, "sci_below_sce", "flat" },
    { "spread", 0, 0, QUALITY_SPREAD, "spread", "clean the tile" },
    { "one left out", 0, 0, QUALITY_OUTLIER, "outlier", "clean the tile" },
    { "a weak lamp makes them spread", DRIVER_WARNING_LAMP_WEAK, 0, QUALITY_SPREAD, "lamp_weak",
      "rest" },
};

static void test_what_is_fit(void)
{
    for (size_t i = 0; i < sizeof fit_cases / sizeof *fit_cases; i++) {
        const struct fit_case *c = &fit_cases[i];
        struct measuring m = { .warnings = c->warnings, .flags = c->shot_flags };
        struct quality_set set = { .flags = c->set_flags };
        struct refusal refusal = { .reason = REASONS };
        bool fit = check_fit(&m, &set, &refusal);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->token == NULL, fit, c->what);
        if (c->token == NULL) {
            TEST_ASSERT_EQUAL_INT_MESSAGE(REASONS, refusal.reason, c->what);
            continue;
        }
        char begins[64];
        snprintf(begins, sizeof begins, "%s: ", c->token);
        TEST_ASSERT_EQUAL_INT_MESSAGE(REASON_CHECK_UNFIT, refusal.reason, c->what);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(refusal.detail, begins), refusal.detail);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(refusal.detail, c->to_do), refusal.detail);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(refusal.detail, "then check again"), refusal.detail);
    }
}

/* A warning that is added to the drivers is thought of here. */
static void test_every_warning_has_a_row(void)
{
    for (size_t bit = 0; bit < DRIVER_WARNINGS; bit++) {
        struct measuring m = { .warnings = 1u << bit };
        struct quality_set set = { .flags = 0 };
        struct refusal refusal;
        bool fit = check_fit(&m, &set, &refusal);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1u << bit == DRIVER_WARNING_BATTERY_LOW, fit,
                                      driver_warning_name(bit));
        if (!fit)
            TEST_ASSERT_NOT_NULL(strstr(refusal.detail, driver_warning_name(bit)));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_fit);
    RUN_TEST(test_every_warning_has_a_row);
    return UNITY_END();
}
