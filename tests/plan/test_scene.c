/* test_scene.c - scenes that contradict themselves, and what is said of them. */
#include "plan/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static struct scene wanting(unsigned wanted)
{
    struct scene s = scene_empty();
    s.wanted = wanted;
    return s;
}

static void accepted(const struct scene *s)
{
    char why[SCENE_WHY_SIZE] = "";
    enum status status = scene_check(s, why);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, status, why);
    TEST_ASSERT_EQUAL_STRING("", why);
}

/* The words name what is wrong and what to do: each case a part of both. */
static void refused(const struct scene *s, const char *wrong, const char *remedy)
{
    char why[SCENE_WHY_SIZE] = "";
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_RANGE, scene_check(s, why), wrong);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, wrong), why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, remedy), why);
    TEST_ASSERT_NOT_EQUAL_CHAR('.', why[strlen(why) - 1]);
}

static void test_accepted(void)
{
    struct scene s = wanting(SCENE_LAB);
    accepted(&s);
    s = wanting(SCENE_LAB | SCENE_RGB | SCENE_COEFFICIENTS | SCENE_NEAREST | SCENE_REFINED |
                SCENE_INTERVAL);
    s.k = SCENE_MAX_K;
    s.range[0] = (struct scene_range){ 0.0, 0.5 };
    s.range[1] = (struct scene_range){ 1.0, 1.0 };
    s.range[2] = (struct scene_range){ 0.001, 0.1 };
    s.bound.rms = 0.01;
    s.first_nm = 400.0;
    s.last_nm = 700.0;
    s.step_nm = 10.0;
    accepted(&s);
}

static void test_wanted(void)
{
    struct scene s = wanting(0);
    refused(&s, "nothing is wanted", "name one");
    s = wanting(SCENE_LAB | SCENE_INTERVAL);
    refused(&s, "an interval is that of a fitted skin", "want `refined`");
    s = wanting(SCENE_LAB);
    s.k = 3;
    refused(&s, "k counts", "leave `k` out");
    s.k = 0;
    refused(&s, "k is 0", "1..100");
    s = wanting(SCENE_LAB);
    s.has_by = true;
    refused(&s, "`by` says", "leave `by` out");
    s = wanting(SCENE_NEAREST);
    s.fit = REFINE_THREE;
    refused(&s, "`fit` says", "want `refined`");
    s = wanting(SCENE_REFINED);
    s.start = SCENE_START_CLOSED_FORM;
    s.has_by = true;
    refused(&s, "no rows are searched", "leave `by` out");
}

static void test_ranges(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    s.range[0] = (struct scene_range){ 0.3, 0.1 };
    refused(&s, "range of Cm is empty", "lower end first");
    s.range[0] = (struct scene_range){ 0.7, 0.7 };
    refused(&s, "Cm is held at 0.7, outside 0..0.5", "inside");
    s.range[0] = (struct scene_range){ NAN, NAN };
    s.range[2] = (struct scene_range){ 0.0, 0.1 };
    refused(&s, "Ch may be 0..0.1 here, beyond 0.001..0.1", "keep inside");
    s.range[2] = (struct scene_range){ 0.01, NAN };
    refused(&s, "one end", "give both");
    s.range[2] = (struct scene_range){ NAN, NAN };
    s.range[1] = (struct scene_range){ -0.1, 0.5 };
    refused(&s, "Bm may be", "keep inside");
    s = wanting(SCENE_REFINED);
    for (size_t i = 0; i < 3; i++)
        s.range[i] = (struct scene_range){ 0.05, 0.05 };
    refused(&s, "all held", "free one");
    s.range[2] = (struct scene_range){ NAN, NAN };
    accepted(&s);
    s.no_dermis = true;
    refused(&s, "all held (Ch without the dermis)", "free one");
    s = wanting(SCENE_REFINED);
    s.fit = REFINE_SKIN;
    s.range[1] = (struct scene_range){ 0.2, 0.3 };
    refused(&s, "holds Bm", "hold it at one value");
}

static void unused(const struct scene *s, const char *member, const char *remedy)
{
    char why[SCENE_WHY_SIZE] = "";
    accepted(s);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_RANGE, scene_check_use(s, why), member);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, member), why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, remedy), why);
}

static void test_what_nothing_uses(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    char why[SCENE_WHY_SIZE] = "";
    s.observer = OBSERVER_2DEG;
    unused(&s, "`observer`", "want `lab` or `rgb`");
    s.wanted |= SCENE_RGB;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, scene_check_use(&s, why));
    s = wanting(SCENE_NEAREST | SCENE_LAB);
    s.placement = 0.01; /* of what a row is expected to be wrong by */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, scene_check_use(&s, why));
    s.wanted = SCENE_LAB;
    unused(&s, "`placement`", "`nearest` or `refined`");
    s = wanting(SCENE_NEAREST);
    s.start = SCENE_START_ROWS;
    unused(&s, "`start`", "want `refined` or `coefficients`");
    s = wanting(SCENE_LAB);
    s.range[SKIN_CH] = (struct scene_range){ 0.01, 0.02 };
    unused(&s, "`Ch`", "`nearest` or `refined`");
    s = wanting(SCENE_REFINED);
    s.no_dermis = true;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, scene_check_use(&s, why));
    s.fit = REFINE_SKIN;
    unused(&s, "dermis as well", "fit three");
}

static void test_models(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.model = model_find("paper");
    refused(&s, "model paper has no spectra", "take another model");
    s = wanting(SCENE_NEAREST);
    s.model = model_find("paper");
    accepted(&s);
    s.has_by = true;
    s.by = MATCH_SPECTRUM;
    refused(&s, "model paper has no spectra", "by rgb");
}

static void test_bands_and_noise(void)
{
    struct scene s = wanting(SCENE_LAB);
    s.first_nm = 400.0;
    refused(&s, "bands need", "step_nm");
    s.last_nm = 700.0;
    s.step_nm = -10.0;
    refused(&s, "are none", "step_nm above 0");
    s.step_nm = 7.0;
    refused(&s, "does not come to 700", "change");
    s = wanting(SCENE_REFINED);
    s.white = 0.0;
    refused(&s, "the noise is 0", "1e-09..1");
    s.white = NAN;
    s.placement = 2.0;
    refused(&s, "placement noise is 2", "0..1");
}

static void test_limits(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.bound.coefficient[0] = 0.01;
    accepted(&s);
    s.budget_us = 10.0;
    refused(&s, "both given", "give one");
    s.bound.coefficient[0] = 0.0;
    refused(&s, "at most 0", "above 0");
    s.bound.coefficient[0] = NAN;
    s.budget_us = -1.0;
    refused(&s, "-1 us", "above 0");
    s = wanting(SCENE_LAB);
    s.bound.dE00 = 1.0;
    refused(&s, "about the skin that is found", "leave the bound out");
    s = wanting(SCENE_REFINED);
    s.bound.coefficient[1] = 0.1;
    s.range[1] = (struct scene_range){ 1.0, 1.0 };
    refused(&s, "Bm is held at 1", "leave one");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_accepted);
    RUN_TEST(test_wanted);
    RUN_TEST(test_ranges);
    RUN_TEST(test_what_nothing_uses);
    RUN_TEST(test_models);
    RUN_TEST(test_bands_and_noise);
    RUN_TEST(test_limits);
    return UNITY_END();
}
