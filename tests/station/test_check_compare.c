/* test_check_compare.c - how far a tile is from its reference. */
#include "station/check_compare.h"

#include <math.h>
#include <string.h>

#include "unity.h"

static struct spectrum reference, measured;

void setUp(void)
{
}

void tearDown(void)
{
}

/* first + slope * (nm - 400) / 300 */
static struct spectrum ramp(double first_nm, double step_nm, size_t n, double first, double slope)
{
    struct spectrum s = { .first_nm = first_nm, .step_nm = step_nm, .n = n };
    for (size_t i = 0; i < n; i++)
        s.value[i] = first + slope * (spectrum_nm(&s, i) - 400.0) / 300.0;
    return s;
}

/* expect: of greys a = b = 0, so that CIEDE2000 (CIE 142) is |dL| / S_L with L of CIE 15, by
 * Python; of the ramp, XYZ by ArgyllCMS's spec2cie -i D65 -o 1964_10, then CIE 15 and
 * CIEDE2000 by Python, which meets Sharma's pairs.  rms: by hand. */
static const struct difference_case {
    const char *what;
    double first, slope, other_first, other_slope, dE00, dE00_within, rms, rms_within;
} difference_cases[] = {
    { "the same", 0.3, 0.2, 0.3, 0.2, 0.0, 1e-12, 0.0, 1e-15 },
    { "greys, 0.50 and 0.51", 0.50, 0.0, 0.51, 0.0, 0.4386535923446611, 1e-9, 0.01, 1e-12 },
    { "a darker one", 0.10, 0.0, 0.09, 0.0, 1.5670513323687365, 1e-9, 0.01, 1e-12 },
    { "reddish ramps", 0.20, 0.40, 0.21, 0.41, 0.8155, 0.002, 0.015293426329272617, 1e-12 },
};

static void test_differences(void)
{
    for (size_t i = 0; i < sizeof difference_cases / sizeof *difference_cases; i++) {
        const struct difference_case *c = &difference_cases[i];
        struct check_difference got, back;
        reference = ramp(400.0, 10.0, 31, c->first, c->slope);
        measured = ramp(400.0, 10.0, 31, c->other_first, c->other_slope);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, check_compare(&reference, &measured, &got),
                                      c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->dE00_within, c->dE00, got.dE00, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->rms_within, c->rms, got.rms, c->what);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, check_compare(&measured, &reference, &back));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, got.dE00, back.dE00, c->what);
    }
}

/* Bands that only one of them has do not count: the difference is that of 400..700 by 10. */
static const struct grid_case {
    const char *what;
    double first_nm, step_nm;
    size_t n;
} grid_cases[] = {
    { "a certificate to both sides beyond", 360.0, 10.0, 43 },
    { "a certificate by 5 nm", 380.0, 5.0, 81 },
    { "a certificate by 1 nm", 400.0, 1.0, 301 },
};

static void test_other_grids(void)
{
    struct check_difference expect, got;
    measured = ramp(400.0, 10.0, 31, 0.21, 0.41);
    reference = ramp(400.0, 10.0, 31, 0.20, 0.40);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, check_compare(&reference, &measured, &expect));
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        reference = ramp(c->first_nm, c->step_nm, c->n, 0.20, 0.40);
        for (size_t j = 0; j < reference.n; j++) /* nonsense where the instrument is blind */
            if (spectrum_nm(&reference, j) < 400.0 || spectrum_nm(&reference, j) > 700.0)
                reference.value[j] = 1.5;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, check_compare(&reference, &measured, &got),
                                      c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, expect.dE00, got.dE00, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, expect.rms, got.rms, c->what);
    }
}

static const struct refused_case {
    const char *what;
    double first_nm, step_nm;
    size_t n;
} refused_cases[] = {
    { "it begins too late", 410.0, 10.0, 30 },
    { "it ends too early", 400.0, 10.0, 30 },
    { "its bands lie between", 405.0, 10.0, 31 },
    { "by 20 nm", 400.0, 20.0, 16 },
    { "by 15 nm, every other in common", 400.0, 15.0, 21 },
    { "no band at all", 400.0, 10.0, 0 },
    { "elsewhere", 900.0, 10.0, 31 },
};

static void test_refused(void)
{
    measured = ramp(400.0, 10.0, 31, 0.21, 0.41);
    struct check_difference got = { -1.0, -1.0 };
    for (size_t i = 0; i < sizeof refused_cases / sizeof *refused_cases; i++) {
        const struct refused_case *c = &refused_cases[i];
        reference = ramp(c->first_nm, c->step_nm, c->n, 0.2, 0.4);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_UNSUPPORTED,
                                      check_compare(&reference, &measured, &got), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_UNSUPPORTED,
                                      check_compare(&measured, &reference, &got), c->what);
    }
    reference = measured;
    reference.value[3] = (double)NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, check_compare(&reference, &measured, &got));
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, got.dE00);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_differences);
    RUN_TEST(test_other_grids);
    RUN_TEST(test_refused);
    return UNITY_END();
}
