/* test_chi_square.c - tail probabilities against a published table and 40 digits. */
#include "match/chi_square.h"

#include <math.h>

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* Abramowitz and Stegun, Table 26.8: chi^2 that is exceeded with a given probability. */
static void test_percentage_points_of_the_table(void)
{
    static const struct {
        size_t degrees;
        double value, probability;
    } row[] = {
        { 1, 3.84146, 0.05 },   { 10, 18.3070, 0.05 },   { 30, 43.7729, 0.05 },
        { 100, 124.342, 0.05 }, { 1, 10.828, 0.001 },    { 10, 29.588, 0.001 },
        { 30, 59.703, 0.001 },  { 100, 149.449, 0.001 }, { 10, 3.94030, 0.95 },
        { 30, 18.4926, 0.95 },  { 100, 77.9295, 0.95 },  { 2, 0.102587, 0.95 },
        { 10, 2.15585, 0.995 }, { 30, 13.7867, 0.995 },  { 100, 67.3276, 0.995 },
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        TEST_ASSERT_DOUBLE_WITHIN(2e-5 * fmin(row[i].probability, 1.0 - row[i].probability) + 1e-6,
                                  row[i].probability,
                                  chi_square_above(row[i].value, row[i].degrees));
}

/* mpmath 1.3, gammainc(k/2, x/2, inf, regularized=True) with 40 digits. */
static void test_to_twelve_digits(void)
{
    static const struct {
        double value;
        size_t degrees;
        double above;
    } row[] = {
        { 0.5, 1, 0.479500122186953462 },           { 3.84, 1, 0.0500435212487051032 },
        { 30.0, 1, 4.32046305782749729e-8 },        { 0.01, 2, 0.995012479192682313 },
        { 25.0, 2, 3.72665317207867099e-6 },        { 1.0, 3, 0.801251956901200802 },
        { 12.3, 28, 0.995520449420423746 },         { 28.0, 28, 0.464447564896856636 },
        { 60.0, 28, 0.000407283705286846284 },      { 120.0, 28, 2.33157138155998017e-13 },
        { 900.0, 28, 1.89525284943217704e-171 },    { 1000.0, 1000, 0.494052853829239642 },
        { 1500.0, 1000, 1.04546403859796573e-22 },  { 800.0, 1000, 0.99999918906189212 },
        { 3000.0, 1000, 1.64368458435695434e-198 }, { 31.0, 31, 0.466212506217508345 },
        { 5.0, 31, 0.999999972599214017 },          { 1e-8, 5, 1.0 },
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-12 * row[i].above, row[i].above,
                                  chi_square_above(row[i].value, row[i].degrees));
}

static void test_ends(void)
{
    TEST_ASSERT_EQUAL_DOUBLE(1.0, chi_square_above(0.0, 28));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, chi_square_above(-1.0, 28));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, chi_square_above(INFINITY, 28));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, chi_square_above(1e6, 28));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, chi_square_above(1.0, 0));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, chi_square_above(0.0, 0));
}

/* It falls as the value grows, across the place where the series is changed. */
static void test_falls(void)
{
    for (size_t degrees = 1; degrees <= 400; degrees += 7) {
        double before = 1.0;
        for (double value = 0.5; value < 1000.0; value += 0.5) {
            double now = chi_square_above(value, degrees);
            TEST_ASSERT_TRUE(now >= 0.0 && now <= before);
            before = now;
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_percentage_points_of_the_table);
    RUN_TEST(test_to_twelve_digits);
    RUN_TEST(test_ends);
    RUN_TEST(test_falls);
    return UNITY_END();
}
