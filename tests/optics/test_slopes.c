/* test_slopes.c - derivatives of the closed-form models against differences in 500 digits. */
#include "optics/slopes.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "optics/half_space.h"
#include "optics/two_layer.h"
#include "tests/support/dice.h"
#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { EPIDERMIS_A, EPIDERMIS_S, DERMIS_A, DERMIS_S, D_MM, INPUTS };

typedef enum status slopes_of(const struct medium *m, double *R, const struct slopes *dR);

/* One band. */
static enum status slopes_at(slopes_of *f, const double x[INPUTS], double eta, double *R,
                             double by[INPUTS])
{
    double in[INPUTS];
    memcpy(in, x, sizeof in);
    struct medium m = {
        1, in[D_MM], eta, &in[EPIDERMIS_A], &in[DERMIS_A], &in[EPIDERMIS_S], &in[DERMIS_S]
    };
    struct slopes dR = { &by[EPIDERMIS_A], &by[DERMIS_A], &by[EPIDERMIS_S], &by[DERMIS_S],
                         &by[D_MM] };
    return f(&m, R, &dR);
}

/* Within 64 ulp of the value, or of what its inputs' relative errors move it by.  What is below
 * 1e-300 counts as 0. */
static void assert_slope(double expect, double moved, double got, const char *what)
{
    if (isinf(expect)) {
        TEST_ASSERT_TRUE_MESSAGE(got == expect, what);
        return;
    }
    double within = 64.0 * DBL_EPSILON * fmax(fabs(expect), moved) + 1e-300;
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(within, expect, got, what);
}

/* expect: tests/reference/slopes_half_space.csv. */
static void test_half_space(void)
{
    struct figures t;
    TEST_ASSERT_TRUE(figures_read("tests/reference/slopes_half_space.csv", &t));
    TEST_ASSERT_EQUAL_STRING("moved_sigma_s", t.name[6]);
    TEST_ASSERT_GREATER_THAN(200, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        double x[INPUTS] = { figures_at(&t, i, 0), figures_at(&t, i, 1), 0.0, 1.0, 0.08 };
        double R = NAN, by[INPUTS];
        char what[64];
        snprintf(what, sizeof what, "slopes_half_space.csv, row %zu", i + 1);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, slopes_at(half_space_slopes, x, figures_at(&t, i, 2), &R, by), what);
        assert_slope(figures_at(&t, i, 3), figures_at(&t, i, 5), by[EPIDERMIS_A], what);
        assert_slope(figures_at(&t, i, 4), figures_at(&t, i, 6), by[EPIDERMIS_S], what);
        /* The sum of both absorptions counts; what does not enter has no slope. */
        TEST_ASSERT_TRUE_MESSAGE(by[DERMIS_A] == by[EPIDERMIS_A], what);
        TEST_ASSERT_TRUE_MESSAGE(by[DERMIS_S] == 0.0 && by[D_MM] == 0.0, what);
    }
    figures_done(&t);
}

/* expect: tests/reference/slopes_two_layer.csv. */
static void test_two_layer(void)
{
    struct figures t;
    TEST_ASSERT_TRUE(figures_read("tests/reference/slopes_two_layer.csv", &t));
    TEST_ASSERT_EQUAL_STRING("moved_d_mm", t.name[15]);
    TEST_ASSERT_GREATER_THAN(800, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        double x[INPUTS], R = NAN, by[INPUTS];
        for (size_t k = 0; k < INPUTS; k++)
            x[k] = figures_at(&t, i, k);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              slopes_at(two_layer_slopes, x, figures_at(&t, i, 5), &R, by));
        for (size_t k = 0; k < INPUTS; k++) {
            char what[96];
            snprintf(what, sizeof what, "slopes_two_layer.csv, row %zu, %s", i + 1, t.name[6 + k]);
            assert_slope(figures_at(&t, i, 6 + k), figures_at(&t, i, 11 + k), by[k], what);
        }
    }
    figures_done(&t);
}

/* Mostly any decade, now and then a bound or nothing. */
static double any_decade(struct dice *dice, double least, double most)
{
    double which = dice_between(dice, 0.0, 1.0);
    return which < 0.1    ? least
           : which < 0.15 ? most
           : which < 0.6  ? pow(10.0, dice_between(dice, -3.0, 3.0))
                          : fmin(fmax(pow(10.0, dice_between(dice, -100.0, 100.0)), least), most);
}

/* Property: for every accepted medium R as reflectance() has it, no derivative NaN, those by
 * absorption never above 0, that by the dermis's scattering never below. */
static void test_every_legal_medium(void)
{
    struct dice dice = { 5 };
    for (int i = 0; i < 100000; i++) {
        double x[INPUTS] = { any_decade(&dice, 0.0, 1e100), any_decade(&dice, 1e-100, 1e100),
                             any_decade(&dice, 0.0, 1e100), any_decade(&dice, 1e-100, 1e100),
                             any_decade(&dice, 0.0, 1000.0) };
        double eta = dice_between(&dice, 0.27, 3.84), R, same, by[INPUTS];
        double in[INPUTS];
        memcpy(in, x, sizeof in);
        struct medium m = {
            1, in[D_MM], eta, &in[EPIDERMIS_A], &in[DERMIS_A], &in[EPIDERMIS_S], &in[DERMIS_S]
        };
        TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, x, eta, &R, by));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, two_layer_reflectance(&m, &same));
        TEST_ASSERT_TRUE(R == same);
        char what[192];
        snprintf(what, sizeof what, "{ %.17g, %.17g, %.17g, %.17g, %.17g } eta %.17g", x[0], x[1],
                 x[2], x[3], x[4], eta);
        TEST_ASSERT_TRUE_MESSAGE(by[EPIDERMIS_A] <= 0.0 && isfinite(by[EPIDERMIS_A]), what);
        TEST_ASSERT_TRUE_MESSAGE(by[DERMIS_A] <= 0.0, what);
        TEST_ASSERT_TRUE_MESSAGE(isfinite(by[DERMIS_A]) || x[DERMIS_A] == 0.0, what);
        TEST_ASSERT_TRUE_MESSAGE(by[DERMIS_S] >= 0.0 && isfinite(by[DERMIS_S]), what);
        TEST_ASSERT_TRUE_MESSAGE(isfinite(by[EPIDERMIS_S]) && isfinite(by[D_MM]), what);
    }
}

/* Property: coefficients times a number and the thickness over it leave R, so
 * d dR/dd = sum of x dR/dx.  No form of the code uses that for y = k1 d above 1/4, or where
 * sigma_t' d is below 1. */
static void test_lengths_scale_out(void)
{
    struct dice dice = { 6 };
    for (int i = 0; i < 20000; i++) {
        double x[INPUTS], R, by[INPUTS], sum = 0.0, size = 0.0;
        for (size_t k = 0; k < INPUTS; k++)
            x[k] = pow(10.0, dice_between(&dice, -3.0, 2.0));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, x, 1.4, &R, by));
        for (size_t k = 0; k < D_MM; k++) {
            sum += x[k] * by[k];
            size += fabs(x[k] * by[k]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-13 * size + 1e-300, x[D_MM] * by[D_MM], sum);
    }
}

/* What two_layer.h says of layers that absorb nothing. */
static void test_without_absorption(void)
{
    double R, by[INPUTS];
    const double clear_dermis[INPUTS] = { 0.3, 5.0, 0.0, 2.5, 0.08 };
    const double clear_epidermis[INPUTS] = { 0.0, 5.0, 0.3, 2.5, 0.08 };
    const double clear[INPUTS] = { 0.0, 5.0, 0.0, 2.5, 0.08 };
    const double hidden[INPUTS] = { 50.0, 5.0, 0.0, 2.5, 900.0 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, clear_dermis, 1.4, &R, by));
    TEST_ASSERT_TRUE(by[DERMIS_A] == -INFINITY && by[DERMIS_S] == 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, clear_epidermis, 1.4, &R, by));
    TEST_ASSERT_TRUE(by[EPIDERMIS_A] < 0.0 && isfinite(by[EPIDERMIS_A]));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, clear, 1.4, &R, by));
    TEST_ASSERT_TRUE(by[EPIDERMIS_A] < 0.0 && isfinite(by[EPIDERMIS_A]));
    TEST_ASSERT_TRUE(by[EPIDERMIS_S] == 0.0 && by[D_MM] == 0.0 && by[DERMIS_A] == -INFINITY);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, slopes_at(two_layer_slopes, hidden, 1.4, &R, by));
    TEST_ASSERT_TRUE(by[DERMIS_A] == 0.0);
}

/* A bad band leaves everything untouched. */
static void test_refusals(void)
{
    static const struct {
        slopes_of *f;
        double sigma_a, eta;
    } bad[] = {
        { half_space_slopes, -1.0, 1.4 },
        { half_space_slopes, 1.0, 3.9 },
        { two_layer_slopes, NAN, 1.4 },
        { two_layer_slopes, 1.0, 0.2 },
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        double x[INPUTS] = { bad[i].sigma_a, 5.0, 0.1, 2.5, 0.08 };
        double R = 77.0, by[INPUTS] = { 77.0, 77.0, 77.0, 77.0, 77.0 };
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, slopes_at(bad[i].f, x, bad[i].eta, &R, by));
        for (size_t k = 0; k < INPUTS; k++)
            TEST_ASSERT_TRUE(R == 77.0 && by[k] == 77.0);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_half_space);
    RUN_TEST(test_two_layer);
    RUN_TEST(test_every_legal_medium);
    RUN_TEST(test_lengths_scale_out);
    RUN_TEST(test_without_absorption);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
