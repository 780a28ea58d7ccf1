/* test_noise.c - whitening against the covariance written out and inverted, and placement
 * from replicates against a hand-made case. */
#include "match/noise.h"

#include <math.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31 };

void setUp(void)
{
}
void tearDown(void)
{
}

/* v^T C^-1 v over the bands of weight 1, by Gauss's elimination on C itself. */
static double form(const struct noise *noise, double replicates, const double *nm,
                   const double *weight, const double *v)
{
    double A[BANDS][BANDS + 1], sum = 0.0;
    size_t at[BANDS], n = 0;
    for (size_t i = 0; i < BANDS; i++)
        if (weight[i] == 1.0)
            at[n++] = i;
    for (size_t i = 0; i < n; i++) {
        double si = sqrt(3.0) * (nm[at[i]] - 550.0) / 150.0;
        for (size_t j = 0; j < n; j++) {
            double sj = sqrt(3.0) * (nm[at[j]] - 550.0) / 150.0;
            double together = 1.0 + noise->slope_ratio * noise->slope_ratio * si * sj;
            A[i][j] = noise->placement * noise->placement * together / replicates;
            A[i][j] += i == j ? noise->white * noise->white / replicates : 0.0;
        }
        A[i][n] = v[at[i]];
    }
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            double factor = k == i ? 0.0 : A[k][i] / A[i][i];
            for (size_t j = i; j <= n && k != i; j++)
                A[k][j] -= factor * A[i][j];
        }
    for (size_t i = 0; i < n; i++)
        sum += v[at[i]] * A[i][n] / A[i][i];
    return sum;
}

static void test_whitening_is_the_inverse_of_the_covariance(void)
{
    static const struct noise noises[] = {
        { 0.003, 0.0, 0.4 },   { 0.003, 0.008, 0.4 }, { 0.003, 0.008, 0.0 },
        { 0.003, 0.008, 5.0 }, { 3e-5, 0.01, 1.0 },   { 0.5, 0.001, 1.0 },
    };
    struct dice dice = { 5 };
    double nm[BANDS], weight[BANDS], v[BANDS], scratch[WHITENER_SCRATCH(BANDS)];
    for (size_t i = 0; i < BANDS; i++)
        nm[i] = 400.0 + 10.0 * (double)i;
    for (size_t k = 0; k < sizeof noises / sizeof *noises; k++) {
        for (size_t turn = 0; turn < 50; turn++) {
            size_t replicates = 1 + turn % 4;
            double sum = 0.0;
            struct whitener w;
            for (size_t i = 0; i < BANDS; i++) {
                weight[i] = turn > 10 && dice_below(&dice, 3) == 0 ? 0.0 : 1.0;
                v[i] = weight[i] * dice_between(&dice, -1.0, 1.0);
            }
            double expect = form(&noises[k], (double)replicates, nm, weight, v), before[BANDS];
            memcpy(before, v, sizeof v);
            whitener_init(&noises[k], replicates, nm, weight, BANDS, scratch, &w);
            whitener_apply(&w, v);
            for (size_t i = 0; i < BANDS; i++)
                sum += v[i] * v[i] / w.white2;
            TEST_ASSERT_DOUBLE_WITHIN(1e-8 * expect, expect, sum);
            whitener_undo(&w, v);
            for (size_t i = 0; i < BANDS; i++)
                TEST_ASSERT_DOUBLE_WITHIN(1e-9, before[i], v[i]);
        }
    }
}

/* One or two bands: the level takes one direction, the slope the other or none. */
static void test_few_bands(void)
{
    const struct noise noise = { 0.003, 0.008, 0.4 };
    double nm[BANDS], weight[BANDS] = { 0 }, v[BANDS] = { 0 }, scratch[WHITENER_SCRATCH(BANDS)];
    for (size_t i = 0; i < BANDS; i++)
        nm[i] = 400.0 + 10.0 * (double)i;
    for (size_t last = 7; last <= 8; last++) {
        struct whitener w;
        double sum = 0.0;
        weight[last] = 1.0;
        for (size_t i = 0; i < BANDS; i++)
            v[i] = weight[i] * (0.1 + 0.01 * (double)i);
        double expect = form(&noise, 1.0, nm, weight, v);
        whitener_init(&noise, 1, nm, weight, BANDS, scratch, &w);
        whitener_apply(&w, v);
        for (size_t i = 0; i < BANDS; i++)
            sum += v[i] * v[i] / w.white2;
        TEST_ASSERT_DOUBLE_WITHIN(1e-10 * expect, expect, sum);
    }
}

static struct spectrum flat(double value)
{
    struct spectrum s = { .first_nm = 400, .step_nm = 10, .n = BANDS, .specular = SPECULAR_SCE };
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = value;
    return s;
}

/* Three replicates at 0.29, 0.30, 0.34: the levels stray by -0.02, -0.01, 0.03 and no slope, so
 * with slope_ratio 0.5 the four degrees of freedom show 0.0014/4 - white^2 (1/31 + 1/(31 m
 * 0.25))/2, where m = 1.0666667 is the slope's mean square over these 31 bands. */
static void test_placement_from_replicates(void)
{
    struct noise population = { 0.003, 0.008, 0.5 }, seen;
    static struct spectrum three[3];
    three[0] = flat(0.29);
    three[1] = flat(0.30);
    three[2] = flat(0.34);
    double white = 9e-6 * (1.0 / 31 + 1.0 / (31 * 16.0 / 15.0 * 0.25)) / 2.0;
    double expect = (4.0 * (0.0014 / 4.0 - white) + NOISE_POPULATION_DEGREES * 64e-6) /
                    (4.0 + NOISE_POPULATION_DEGREES);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_from_replicates(&population, three, 3, &seen));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(expect), seen.placement);
    TEST_ASSERT_EQUAL_DOUBLE(0.003, seen.white);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, seen.slope_ratio);

    /* A band that one lacks is left out: the others say the same. */
    three[1].value[3] = NAN;
    three[2].value[3] = 7.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_from_replicates(&population, three, 3, &seen));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, sqrt(expect), seen.placement);

    /* Without a slope there are two degrees of freedom. */
    three[2] = flat(0.34);
    three[1] = flat(0.30);
    population.slope_ratio = 0.0;
    expect = (2.0 * (0.0014 / 2.0 - 9e-6 / 31) + NOISE_POPULATION_DEGREES * 64e-6) /
             (2.0 + NOISE_POPULATION_DEGREES);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_from_replicates(&population, three, 3, &seen));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(expect), seen.placement);
}

static void test_replicates_that_agree_leave_part_of_the_population(void)
{
    struct noise population = noise_default(), seen;
    static struct spectrum two[2];
    two[0] = two[1] = flat(0.3);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_from_replicates(&population, two, 1, &seen));
    TEST_ASSERT_EQUAL_DOUBLE(population.placement, seen.placement);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_from_replicates(&population, two, 2, &seen));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12,
                              population.placement *
                                  sqrt(NOISE_POPULATION_DEGREES / (NOISE_POPULATION_DEGREES + 2.0)),
                              seen.placement);
}

static void test_refusals(void)
{
    static const struct noise bad[] = {
        { 0.0, 0.01, 1 },  { -0.003, 0.01, 1 }, { NAN, 0.01, 1 },     { INFINITY, 0.01, 1 },
        { 1e-12, 0, 0 },   { 2.0, 0.01, 1 },    { 0.003, -0.01, 1 },  { 0.003, NAN, 1 },
        { 0.003, 1.5, 1 }, { 0.003, 0.01, -1 }, { 0.003, 0.01, NAN },
    };
    static struct spectrum two[2];
    struct noise population = noise_default(), seen = { 7, 8, 9 };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *why = NULL;
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_check(&bad[i], &why));
        TEST_ASSERT_NOT_NULL(why);
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_check(&bad[i], NULL));
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_from_replicates(&bad[i], two, 1, &seen));
    }
    two[0] = two[1] = flat(0.3);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_from_replicates(&population, two, 0, &seen));
    two[1].first_nm = 410;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_from_replicates(&population, two, 2, &seen));
    two[1] = two[0];
    for (size_t i = 1; i < BANDS; i++)
        two[1].value[i] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_from_replicates(&population, two, 2, &seen));
    two[0] = two[1] = flat(0.3);
    two[0].step_nm = two[1].step_nm = 0.0; /* bands at one wavelength have no slope */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, noise_from_replicates(&population, two, 2, &seen));
    TEST_ASSERT_EQUAL_DOUBLE(7.0, seen.white);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, noise_check(&population, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_whitening_is_the_inverse_of_the_covariance);
    RUN_TEST(test_few_bands);
    RUN_TEST(test_placement_from_replicates);
    RUN_TEST(test_replicates_that_agree_leave_part_of_the_population);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
