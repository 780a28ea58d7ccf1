/* test_quality.c - shots that are refused, and sets of replicates made by hand. */
#include "station/quality.h"

#include <math.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { BANDS = 31 };

/* A flat spectrum; what a test is about is changed afterwards. */
static struct spectrum flat(double value)
{
    struct spectrum s = { .first_nm = 400.0, .step_nm = 10.0, .n = BANDS };
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = value;
    return s;
}

static const struct shot_case {
    const char *what;
    double all, sci_over; /* every band of SCE; SCI above it, NAN for no SCI */
    double band5;         /* band 5 of SCE instead, NAN for as all */
    unsigned flags;
} shot_cases[] = {
    { "skin", 0.4, 0.04, NAN, 0 },
    { "without SCI", 0.4, NAN, NAN, 0 },
    { "black skin at the blue end", 0.02, 0.04, 0.003, 0 },
    { "nothing under the port", 0.0005, 0.0, NAN, QUALITY_ALL_ZERO },
    { "exactly nothing", 0.0, NAN, NAN, QUALITY_ALL_ZERO },
    { "a band without limit", 0.4, 0.04, INFINITY, QUALITY_NOT_FINITE },
    { "a band too high", 0.4, NAN, 1.21, QUALITY_OUT_OF_RANGE },
    { "a band as high as may be", 0.4, NAN, 1.2, 0 },
    { "a band too low", 0.4, NAN, -0.021, QUALITY_OUT_OF_RANGE },
    { "noise below zero", 0.4, NAN, -0.02, 0 },
    { "black calibrated as white: far above", 24.0, NAN, 0.5, QUALITY_WHITE_BLACK_SWAPPED },
    { "or far below", -3.0, NAN, NAN, QUALITY_WHITE_BLACK_SWAPPED },
    { "SCI a little below, by noise", 0.4, -0.005 + 1e-9, NAN, 0 },
    { "SCI below", 0.4, -0.0051, NAN, QUALITY_SCI_BELOW_SCE },
};

static void test_shots(void)
{
    const struct spectrum bands = flat(0.0);
    for (size_t i = 0; i < sizeof shot_cases / sizeof *shot_cases; i++) {
        const struct shot_case *c = &shot_cases[i];
        struct spectrum sce = flat(c->all), sci = flat(c->all + c->sci_over);
        if (!isnan(c->band5))
            sce.value[5] = c->band5;
        if (!isnan(c->band5))
            sci.value[5] = c->band5 + 0.04;
        unsigned found = quality_shot(&bands, &sce, isnan(c->sci_over) ? NULL : &sci);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->flags, found, c->what);
    }
    struct spectrum sce = flat(0.4), sci = flat(0.44);
    sci.value[30] = NAN;
    TEST_ASSERT_EQUAL_UINT(QUALITY_NOT_FINITE, quality_shot(&bands, &sce, &sci));
}

static void test_other_bands_are_refused(void)
{
    const struct spectrum bands = flat(0.0);
    struct spectrum good = flat(0.4), fewer = flat(0.4), moved = flat(0.4), wider = flat(0.4);
    fewer.n = 30;
    moved.first_nm = 390.0;
    wider.step_nm = 20.0;
    TEST_ASSERT_EQUAL_UINT(QUALITY_WRONG_BANDS, quality_shot(&bands, &fewer, NULL));
    TEST_ASSERT_EQUAL_UINT(QUALITY_WRONG_BANDS, quality_shot(&bands, &moved, NULL));
    TEST_ASSERT_EQUAL_UINT(QUALITY_WRONG_BANDS, quality_shot(&bands, &wider, NULL));
    TEST_ASSERT_EQUAL_UINT(QUALITY_WRONG_BANDS, quality_shot(&bands, &good, &fewer));
}

/* Flat replicates at these levels; rms to the median is then the distance in level,
 * and the spread the standard deviation of the kept levels: both by hand. */
static const struct set_case {
    const char *what;
    size_t n;
    double level[4], a_star[4];
    unsigned flags;
    size_t kept;
    double mean, spread;
    bool lift_probe;
} set_cases[] = {
    { "one", 1, { 0.4 }, { 10.0 }, QUALITY_SINGLE, 1, 0.4, NAN, false },
    { "two alike", 2, { 0.40, 0.41 }, { 10.0, 10.1 }, 0, 2, 0.405, 0.00707106781, false },
    { "two far apart: no saying which is right",
      2,
      { 0.40, 0.44 },
      { 10.0, 9.0 },
      QUALITY_SPREAD,
      2,
      0.42,
      0.0282842712,
      true },
    { "three as skin is", 3, { 0.40, 0.41, 0.39 }, { 10.0, 10.2, 9.9 }, 0, 3, 0.40, 0.01, false },
    { "one of three astray",
      3,
      { 0.40, 0.41, 0.50 },
      { 10.0, 10.2, 9.9 },
      QUALITY_OUTLIER,
      2,
      0.405,
      0.00707106781,
      false },
    { "two of four astray: none goes",
      4,
      { 0.40, 0.40, 0.50, 0.50 },
      { 9.0, 9.5, 9.0, 9.5 },
      QUALITY_SPREAD,
      4,
      0.45,
      0.0577350269,
      true },
    { "redness falls",
      3,
      { 0.40, 0.40, 0.40 },
      { 11.0, 10.4, 9.9 },
      QUALITY_REDNESS_FALLS,
      3,
      0.40,
      0.0,
      true },
    { "falls, but no more than chance",
      3,
      { 0.40, 0.40, 0.40 },
      { 10.0, 9.6, 9.1 },
      0,
      3,
      0.40,
      0.0,
      false },
    { "falls and rises", 3, { 0.40, 0.40, 0.40 }, { 12.0, 9.0, 9.5 }, 0, 3, 0.40, 0.0, false },
    { "two say nothing of a trend", 2, { 0.40, 0.40 }, { 12.0, 9.0 }, 0, 2, 0.40, 0.0, false },
};

static void test_sets(void)
{
    for (size_t i = 0; i < sizeof set_cases / sizeof *set_cases; i++) {
        const struct set_case *c = &set_cases[i];
        struct spectrum replicate[4];
        struct quality_set set;
        for (size_t r = 0; r < c->n; r++)
            replicate[r] = flat(c->level[r]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, quality_of_set(replicate, c->a_star, c->n, &set),
                                      c->what);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->flags, set.flags, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->kept, set.kept, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->lift_probe, set.lift_probe, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, c->mean, set.mean.value[17], c->what);
        if (isnan(c->spread))
            TEST_ASSERT_TRUE_MESSAGE(isnan(set.spread_rms), c->what);
        else
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, c->spread, set.spread_rms, c->what);
    }
}

/* What a band of one replicate carries, the mean carries, unless it was left out. */
static void test_band_flags_reach_the_mean(void)
{
    struct spectrum replicate[3] = { flat(0.40), flat(0.40), flat(0.60) };
    static const double a_star[3] = { 10.0, 10.0, 10.0 };
    struct quality_set set;
    replicate[1].flag[3] = SPECTRUM_BAND_ZEROED;
    replicate[2].flag[4] = SPECTRUM_BAND_ZEROED;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, quality_of_set(replicate, a_star, 3, &set));
    TEST_ASSERT_TRUE(set.left_out[2]);
    TEST_ASSERT_EQUAL_UINT(SPECTRUM_BAND_ZEROED, set.mean.flag[3]);
    TEST_ASSERT_EQUAL_UINT(0, set.mean.flag[4]);
}

static void test_sets_that_are_refused(void)
{
    static struct spectrum replicate[QUALITY_MAX_REPLICATES + 1];
    static double a_star[QUALITY_MAX_REPLICATES + 1];
    struct quality_set set;
    for (size_t r = 0; r < QUALITY_MAX_REPLICATES + 1; r++)
        replicate[r] = flat(0.4);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, quality_of_set(replicate, a_star, 0, &set));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          quality_of_set(replicate, a_star, QUALITY_MAX_REPLICATES, &set));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          quality_of_set(replicate, a_star, QUALITY_MAX_REPLICATES + 1, &set));
    replicate[1].step_nm = 5.0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, quality_of_set(replicate, a_star, 2, &set));
    replicate[0].n = replicate[1].n = 0;
    replicate[1].step_nm = 10.0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, quality_of_set(replicate, a_star, 2, &set));
}

static void test_every_flag_has_a_name_and_a_text(void)
{
    for (size_t i = 0; i < QUALITY_FLAGS; i++) {
        TEST_ASSERT_TRUE(strlen(quality_flag_text(i)) > 10);
        for (size_t j = 0; j < i; j++)
            TEST_ASSERT_TRUE(strcmp(quality_flag_name(i), quality_flag_name(j)) != 0);
    }
    TEST_ASSERT_EQUAL_STRING("sci_below_sce", quality_flag_name(5));
    TEST_ASSERT_EQUAL_STRING("unknown", quality_flag_name(QUALITY_FLAGS));
    TEST_ASSERT_EQUAL_STRING("unknown", quality_flag_text(QUALITY_FLAGS));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_shots);
    RUN_TEST(test_other_bands_are_refused);
    RUN_TEST(test_sets);
    RUN_TEST(test_band_flags_reach_the_mean);
    RUN_TEST(test_sets_that_are_refused);
    RUN_TEST(test_every_flag_has_a_name_and_a_text);
    return UNITY_END();
}
