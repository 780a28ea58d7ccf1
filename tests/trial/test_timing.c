/* test_timing.c - medians of rounds, quantiles of groups, and skins that stay the same. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "trial/skins.h"
#include "trial/timing.h"
#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* ---- times -------------------------------------------------------------------------- */

static enum status wait_us(const void *context, size_t item)
{
    const double *us = context;
    struct timespec begin, t;
    double passed;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    do {
        clock_gettime(CLOCK_MONOTONIC, &t);
        passed =
            1e6 * (double)(t.tv_sec - begin.tv_sec) + 1e-3 * (double)(t.tv_nsec - begin.tv_nsec);
    } while (passed < us[item]);
    return STATUS_OK;
}

/* Known waits: 90 items of 20 us and 10 of 200. */
static void test_median_and_tail(void)
{
    double us[100], median, p95;
    struct trial_timing t;
    for (size_t i = 0; i < 100; i++)
        us[i] = i % 10 == 9 ? 200.0 : 20.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_timing_init(wait_us, us, 100, 5, 1e6, &t));
    TEST_ASSERT_EQUAL_size_t(1, t.group);
    TEST_ASSERT_EQUAL_size_t(100, t.groups);
    for (size_t i = 0; i < 5; i++)
        TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_timing_round(&t));
    trial_timing_result(&t, &median, &p95);
    trial_timing_done(&t);
    TEST_ASSERT_DOUBLE_WITHIN(3.0, 20.0, median);
    TEST_ASSERT_DOUBLE_WITHIN(20.0, 200.0, p95);
}

/* A round in which another program had the core does not count. */
static void test_one_bad_round_is_not_seen(void)
{
    double us[8] = { 5, 5, 5, 5, 5, 5, 5, 5 }, median, p95;
    struct trial_timing t;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_timing_init(wait_us, us, 8, 5, 1e6, &t));
    for (size_t i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_timing_round(&t));
        for (size_t g = 0; g < t.groups && i == 2; g++)
            t.us[g * t.rounds + i] = 1e6;
    }
    trial_timing_result(&t, &median, &p95);
    trial_timing_done(&t);
    TEST_ASSERT_DOUBLE_WITHIN(2.0, 5.0, median);
    TEST_ASSERT_TRUE(p95 < 100.0);
}

static void test_what_is_slow_is_done_less_often(void)
{
    double us[100];
    struct trial_timing t;
    for (size_t i = 0; i < 100; i++)
        us[i] = 100.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_timing_init(wait_us, us, 100, 2, 2000.0, &t));
    TEST_ASSERT_TRUE(t.group * t.groups >= 8 && t.group * t.groups <= 22);
    trial_timing_done(&t);
}

static enum status refuse(const void *context, size_t item)
{
    (void)context;
    return item == 3 ? STATUS_RANGE : STATUS_OK;
}

static void test_failures_are_told(void)
{
    struct trial_timing t;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, trial_timing_init(refuse, NULL, 100, 2, 1e6, &t));
}

/* ---- skins -------------------------------------------------------------------------- */

static void test_skins_are_what_they_are_said_to_be(void)
{
    enum { N = 20000 };
    struct trial_skins s;
    double Cm = 0.0, Bm = 0.0, Ch = 0.0, noise = 0.0, square = 0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(N, 3, &s));
    for (size_t i = 0; i < N; i++) {
        const struct tissue *t = &s.skin[i];
        TEST_ASSERT_TRUE(t->Cm >= 0.005 && t->Cm <= 0.2 && t->Bm >= 0.0 && t->Bm <= 1.0 &&
                         t->Ch >= 0.001 && t->Ch <= 0.1);
        Cm += log(t->Cm) / N;
        Bm += t->Bm / N;
        Ch += log(t->Ch) / N;
        for (size_t k = 0; k < TRIAL_BANDS; k++) {
            noise += s.noise[i][k] / (N * TRIAL_BANDS);
            square += s.noise[i][k] * s.noise[i][k] / (N * TRIAL_BANDS);
        }
    }
    trial_skins_done(&s);
    /* Means of even distributions: within 5 standard errors, range/sqrt(12 N). */
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 0.5 * (log(0.005) + log(0.2)), Cm);
    TEST_ASSERT_DOUBLE_WITHIN(0.011, 0.5, Bm);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.5 * (log(0.001) + log(0.1)), Ch);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.003 / sqrt(N * TRIAL_BANDS), 0.0, noise);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * 0.003, 0.003, sqrt(square));
}

static void test_more_skins_begin_with_the_same(void)
{
    struct trial_skins few, many, other;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(5, 1, &few));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(50, 1, &many));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(5, 2, &other));
    TEST_ASSERT_EQUAL_MEMORY(few.skin, many.skin, 5 * sizeof *few.skin);
    TEST_ASSERT_EQUAL_MEMORY(few.noise, many.noise, 5 * sizeof *few.noise);
    TEST_ASSERT_TRUE(few.skin[0].Cm != other.skin[0].Cm);
    trial_skins_done(&few);
    trial_skins_done(&many);
    trial_skins_done(&other);
}

static void test_spectra_do_not_depend_on_threads(void)
{
    struct trial_skins skins;
    struct trial_spectra one, three;
    struct spectrum measured;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_skins_init(40, 1, &skins));
    const struct model *model = model_find("two-layer");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_spectra_init(&skins, model, 1, &one));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, trial_spectra_init(&skins, model, 3, &three));
    TEST_ASSERT_EQUAL_MEMORY(one.clean, three.clean, 40 * sizeof *one.clean);
    trial_measured(&skins, &one, 7, &measured);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, measured.specular);
    for (size_t k = 0; k < TRIAL_BANDS; k++)
        TEST_ASSERT_EQUAL_DOUBLE(one.clean[7][k] + skins.noise[7][k], measured.value[k]);
    trial_spectra_done(&one);
    trial_spectra_done(&three);
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          trial_spectra_init(&skins, model_find("paper"), 1, &one));
    trial_skins_done(&skins);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_median_and_tail);
    RUN_TEST(test_one_bad_round_is_not_seen);
    RUN_TEST(test_what_is_slow_is_done_less_often);
    RUN_TEST(test_failures_are_told);
    RUN_TEST(test_skins_are_what_they_are_said_to_be);
    RUN_TEST(test_more_skins_begin_with_the_same);
    RUN_TEST(test_spectra_do_not_depend_on_threads);
    return UNITY_END();
}
