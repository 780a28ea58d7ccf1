/* test_refine.c - skins found again from spectra that an independent program made
 * (tests/reference/inversion.py), what is refused, and what is said about an answer. */
#include "match/refine.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/dice.h"
#include "tests/support/figures.h"
#include "unity.h"

enum { BANDS = 31 };

static const char *const models[2] = { "half-space", "two-layer" };
static const char *const exact[2] = { "tests/reference/inversion_exact_half_space.csv",
                                      "tests/reference/inversion_exact_two_layer.csv" };
static const char *const noisy[2] = { "tests/reference/inversion_noisy_half_space.csv",
                                      "tests/reference/inversion_noisy_two_layer.csv" };
static struct figures table;
static struct refiner *refiner;
static struct refined answer;

void setUp(void)
{
    refiner = NULL;
    table = (struct figures){ 0 };
}

void tearDown(void)
{
    refiner_close(refiner);
    figures_done(&table);
}

static struct fit three(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    return fit_three(&recipe);
}

static struct spectrum blank(void)
{
    return (struct spectrum){
        .first_nm = 400, .step_nm = 10, .n = BANDS, .specular = SPECULAR_SCE, .aperture_mm = NAN
    };
}

/* Row of a table: Cm, Bm, Ch, then the bands. */
static struct spectrum spectrum_of(const struct figures *f, size_t row)
{
    struct spectrum s = blank();
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = figures_at(f, row, 3 + i);
    return s;
}

static enum status run(const struct fit *fit, const struct noise *noise, const struct spectrum *s,
                       size_t replicates, const char **why)
{
    return refine(fit, noise, s, replicates, NULL, 0, &answer, why);
}

/* ---- what is found --------------------------------------------------------------------- */

static void test_spectra_without_noise_give_the_skin_back(void)
{
    const struct noise noise = noise_white(1e-6);
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(models[m]);
        TEST_ASSERT_TRUE(figures_read(exact[m], &table));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
        for (size_t row = 0; row < table.rows; row++) {
            struct spectrum s = spectrum_of(&table, row);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_run(refiner, &noise, &s, 1, NULL, 0,
                                                         REFINE_COLOUR, &answer, NULL));
            for (size_t i = 0; i < 3; i++)
                TEST_ASSERT_DOUBLE_WITHIN(1e-6, figures_at(&table, row, i), answer.value[i]);
            TEST_ASSERT_TRUE(answer.rms < 1e-9 && answer.dE00 < 1e-6);
            TEST_ASSERT_EQUAL_HEX(REFINE_RESIDUAL_TOO_SMALL, answer.flags);
            TEST_ASSERT_EQUAL_HEX(7, answer.free);
            TEST_ASSERT_EQUAL_size_t(BANDS - 3, answer.degrees);
            TEST_ASSERT_EQUAL_DOUBLE(0.75, answer.value[SKIN_SO2]);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, answer.se[SKIN_SO2]);
            TEST_ASSERT_EQUAL_DOUBLE(0.75, answer.hi[SKIN_SO2]);
        }
        refiner_close(refiner);
        refiner = NULL;
        figures_done(&table);
    }
}

/* From the far corners of the box as from near. */
static void test_the_start_does_not_matter(void)
{
    static const double corner[5][SKIN_PARAMETERS] = {
        { 0.5, 0, 0.1 },   { 0.5, 1, 0.001 }, { 0.001, 0, 0.001 },
        { 0.001, 1, 0.1 }, { 9, -9, 9 }, /* outside: taken to the nearest inside */
    };
    const struct noise noise = noise_white(0.003);
    TEST_ASSERT_TRUE(figures_read(noisy[1], &table));
    struct fit fit = three("two-layer");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
    for (size_t row = 0; row < 100; row++) {
        static struct refined other;
        struct spectrum s = spectrum_of(&table, row);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &answer, NULL));
        for (size_t k = 0; k < 5; k++) {
            TEST_ASSERT_EQUAL_INT(
                STATUS_OK, refiner_run(refiner, &noise, &s, 1, corner + k, 1, 0, &other, NULL));
            for (size_t i = 0; i < 3; i++)
                TEST_ASSERT_DOUBLE_WITHIN(0.001 * answer.se[i], answer.value[i], other.value[i]);
        }
    }
}

/* The end of an interval, held there: the best of the rest is worse by 3.841. */
static void test_interval_ends_are_where_chi_square_has_risen(void)
{
    const struct noise noise = { 0.003, 0.006, 0.4 };
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(models[m]);
        TEST_ASSERT_TRUE(figures_read(noisy[m], &table));
        for (size_t row = 0; row < 60; row++) {
            static struct refined full;
            struct spectrum s = spectrum_of(&table, row);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, refine(&fit, &noise, &s, 1, NULL, 0, &full, NULL));
            for (size_t i = 0; i < 6; i++) {
                struct fit held = fit;
                double end = i < 3 ? full.lo[i] : full.hi[i - 3];
                held.role[i % 3].free = false;
                held.role[i % 3].value = end;
                TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&held, &noise, &s, 1, NULL));
                double rise = answer.chi_square - full.chi_square;
                bool bound = end == fit.role[i % 3].lo || end == fit.role[i % 3].hi;
                TEST_ASSERT_TRUE(bound ? rise <= 3.85 : fabs(rise - 3.841459) < 0.01);
                TEST_ASSERT_TRUE(full.lo[i % 3] <= full.value[i % 3] &&
                                 full.value[i % 3] <= full.hi[i % 3]);
            }
        }
        figures_done(&table);
    }
}

/* Four replicates alike are one with half the noise; of the scatter there is none. */
static void test_replicates_count_as_their_mean(void)
{
    const struct noise noise = { 0.003, 0.006, 0.4 }, half = { 0.0015, 0.003, 0.4 };
    static struct spectrum four[4];
    static struct refined one;
    struct fit fit = three("two-layer");
    TEST_ASSERT_TRUE(figures_read(noisy[1], &table));
    for (size_t k = 0; k < 4; k++)
        four[k] = spectrum_of(&table, 8);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &half, four, 1, NULL));
    one = answer;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, four, 4, NULL));
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, one.value[i], answer.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, one.hi[i], answer.hi[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, one.chi_square, answer.chi_square);
    TEST_ASSERT_EQUAL_size_t(4 * BANDS - 3, answer.degrees);

    /* Two that stray by +-x at one band add 2 x^2/white^2 (white noise alone). */
    four[0].value[5] += 0.01;
    four[1].value[5] -= 0.01;
    const struct noise white = noise_white(0.003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &white, four, 2, NULL));
    double together = answer.chi_square;
    four[0] = four[1] = four[2];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &white, four, 2, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.0 * 1e-4 / 9e-6, together - answer.chi_square);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_spectra_without_noise_give_the_skin_back);
    RUN_TEST(test_the_start_does_not_matter);
    RUN_TEST(test_interval_ends_are_where_chi_square_has_risen);
    RUN_TEST(test_replicates_count_as_their_mean);
    return UNITY_END();
}
