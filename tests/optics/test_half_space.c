/* test_half_space.c - spectral Eq. 9 on the summed absorption. */
#include "optics/half_space.h"

#include <math.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: 60-digit decimals, tests/reference/dipole.py --half-space */
static const struct half_space_case {
    const char *what;
    double sigma_a_epidermis, sigma_a_dermis, sigma_s_prime, eta, expect;
} half_space_cases[] = {
    { "nothing absorbs: only the surface takes its part", 0.0, 0.0, 5.0, 1.4,
      0.97222222222222222222 },
    { "a skin", 0.25, 0.5, 5.0, 1.4, 0.24116218640398370252 },
    { "layers exchanged: the sum counts", 0.5, 0.25, 5.0, 1.4, 0.24116218640398370252 },
    { "dark skin", 3.0, 0.125, 7.5, 1.4, 0.13641544317198052949 },
    { "darker, under water's index", 12.0, 1.5, 4.0, 1.33, 0.02454816162747853314 },
    { "no surface", 0.001953125, 0.03125, 6.0, 1.0, 0.80552700084669261510 },
    { "into a thinner medium", 1.0, 1.0, 2.0, 0.75, 0.08306268989455391059 },
    { "hardly absorbing", 1e-20, 0.0, 3.0, 1.4, 0.97222222191430665637 },
};
enum { HALF_SPACE_CASES = sizeof half_space_cases / sizeof *half_space_cases };

static void test_reference(void)
{
    for (size_t i = 0; i < HALF_SPACE_CASES; i++) {
        const struct half_space_case *c = &half_space_cases[i];
        double epi = c->sigma_a_epidermis, der = c->sigma_a_dermis, s_epi = c->sigma_s_prime;
        double s_der = 1e-3; /* does not enter */
        double R;
        struct medium m = { 1, 0.08, c->eta, &epi, &der, &s_epi, &s_der };
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, half_space_reflectance(&m, &R), c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12 * c->expect, c->expect, R, c->what);
    }
}

/* Three bands, of which the last is shown: bad input there leaves R untouched.
 * expect: the limits of optics/dipole.h, on the sum. */
static const struct range_case {
    const char *what;
    double sigma_a_epidermis, sigma_a_dermis, sigma_s_prime, eta;
    enum status status;
} range_cases[] = {
    { "good", 1.0, 1.0, 5.0, 1.4, STATUS_OK },
    { "absorption unknown", NAN, 1.0, 5.0, 1.4, STATUS_RANGE },
    { "the dermis's", 1.0, NAN, 5.0, 1.4, STATUS_RANGE },
    { "negative in all", 1.0, -2.0, 5.0, 1.4, STATUS_RANGE },
    { "each allowed, too much together", 1e100, 1e100, 5.0, 1.4, STATUS_RANGE },
    { "nothing scatters", 1.0, 1.0, 0.0, 1.4, STATUS_RANGE },
    { "index too high", 1.0, 1.0, 5.0, 3.85, STATUS_RANGE },
    { "index too low", 1.0, 1.0, 5.0, 0.25, STATUS_RANGE },
    { "index unknown", 1.0, 1.0, 5.0, NAN, STATUS_RANGE },
};

static void test_ranges(void)
{
    for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
        const struct range_case *c = &range_cases[i];
        double epi[] = { 1.0, 2.0, c->sigma_a_epidermis }, der[] = { 1.0, 1.0, c->sigma_a_dermis };
        double s_epi[] = { 5.0, 5.0, c->sigma_s_prime }, s_der[] = { 2.5, 2.5, 2.5 };
        double R[] = { 77.0, 77.0, 77.0 };
        struct medium m = { 3, 0.08, c->eta, epi, der, s_epi, s_der };
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, half_space_reflectance(&m, R), c->what);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_MESSAGE((R[k] == 77.0) == (c->status != STATUS_OK), c->what);
    }
}

/* Property: R lies between 0 and 1-Rs and falls with absorption. */
static void test_falls_with_absorption(void)
{
    enum { N = 121 };
    double epi[N], der[N], s_epi[N], s_der[N], R[N];
    for (int i = 0; i < N; i++) {
        epi[i] = pow(10.0, (i - 60) / 10.0);
        der[i] = 0.0;
        s_epi[i] = 5.0;
        s_der[i] = 2.5;
    }
    struct medium m = { N, 0.08, 1.4, epi, der, s_epi, s_der };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, half_space_reflectance(&m, R));
    TEST_ASSERT_TRUE(R[0] < 35.0 / 36.0);
    for (int i = 1; i < N; i++)
        TEST_ASSERT_TRUE(R[i] > 0.0 && R[i] < R[i - 1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_reference);
    RUN_TEST(test_ranges);
    RUN_TEST(test_falls_with_absorption);
    return UNITY_END();
}
