/* The first steps in single precision: from a row's distance to the skin, the same bits with any
 * vectors, and only where they are for it. */
#include "match/coarse.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "match/recipe.h"
#include "optics/model.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, SKINS = 2000 };
#define FIRST_NM 400.0
#define STEP_NM 10.0

static struct chromophores chromophores;
static struct quick quick;
static struct coarse coarse;
static double weight[BANDS], nm[BANDS], directions[WHITENER_SCRATCH(BANDS)];

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(FIRST_NM, STEP_NM, BANDS, &chromophores));
    for (size_t i = 0; i < BANDS; i++) {
        nm[i] = FIRST_NM + STEP_NM * (double)i;
        weight[i] = 1.0;
    }
}

void tearDown(void)
{
}

static struct fit three(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    struct fit fit = fit_three(&recipe);
    quick_init(fit.model, &chromophores, fit.eta, &quick);
    return fit;
}

static struct whitener whitener_of(struct noise noise)
{
    struct whitener ret;
    whitener_init(&noise, 1, nm, weight, BANDS, directions, &ret);
    return ret;
}

/* A skin as people have it, its spectrum by the plain model, and a start a third off. */
static void make(struct dice *dice, const struct fit *fit, double *truth, double *start, double *R)
{
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    double value[SKIN_PARAMETERS];
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit->role[i].value;
    truth[0] = value[SKIN_CM] = 0.005 * pow(40.0, dice_between(dice, 0.0, 1.0));
    truth[1] = value[SKIN_BM] = dice_between(dice, 0.1, 0.9);
    truth[2] = value[SKIN_CH] = 0.002 * pow(40.0, dice_between(dice, 0.0, 1.0));
    start[0] = truth[0] * dice_between(dice, 0.7, 1.4);
    start[1] = truth[1] + dice_between(dice, -0.1, 0.1);
    start[2] = fmin(truth[2] * dice_between(dice, 0.7, 1.4), 0.1);
    struct tissue t = fit_tissue(fit, value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, model_reflectance(fit->model, &t, &chromophores, scratch, R));
}

/* Without noise the skin itself is the least; what a step leaves is the square of the way. */
static void test_two_steps_lead_to_the_skin(void)
{
    struct dice dice = { 3 };
    struct fit fit = three("two-layer");
    struct whitener white = whitener_of(noise_white(0.003));
    size_t near = 0;
    TEST_ASSERT_TRUE(coarse_init(&fit, &quick, &coarse));
    for (size_t k = 0; k < SKINS; k++) {
        double truth[3], x[3], R[BANDS], promise;
        make(&dice, &fit, truth, x, R);
        TEST_ASSERT_TRUE(coarse_approach(&coarse, R, &white, x, &promise));
        TEST_ASSERT_TRUE(promise >= 0.0);
        near += fabs(x[0] / truth[0] - 1.0) < 0.01 && fabs(x[1] - truth[1]) < 0.01 &&
                        fabs(x[2] / truth[2] - 1.0) < 0.01
                    ? 1u
                    : 0u;
    }
    printf("%zu of %d within 1 %%\n", near, SKINS);
    TEST_ASSERT_TRUE(near > SKINS * 9 / 10);
}

static void test_every_kind_of_vectors_gives_the_same_bits(void)
{
    struct dice dice = { 5 };
    struct fit fit = three("two-layer");
    struct whitener white = whitener_of(noise_white(0.003));
    TEST_ASSERT_TRUE(coarse_init(&fit, &quick, &coarse));
    for (size_t k = 0; k < SKINS; k++) {
        double truth[3], start[3], R[BANDS], plain[3], promise[2];
        make(&dice, &fit, truth, start, R);
        memcpy(plain, start, sizeof plain);
        TEST_ASSERT_TRUE(coarse_approach_by(QUICK_PLAIN, &coarse, R, &white, plain, &promise[0]));
        for (int v = QUICK_PLAIN + 1; v < QUICK_VECTORS; v++) {
            double x[3];
            if (!quick_has((enum quick_vectors)v))
                continue;
            memcpy(x, start, sizeof x);
            TEST_ASSERT_TRUE(
                coarse_approach_by((enum quick_vectors)v, &coarse, R, &white, x, &promise[1]));
            TEST_ASSERT_EQUAL_MEMORY(plain, x, sizeof x);
            TEST_ASSERT_EQUAL_MEMORY(&promise[0], &promise[1], sizeof promise[0]);
        }
    }
}

/* Any spectrum, any start: inside the bounds. */
static void test_answers_stay_inside(void)
{
    struct dice dice = { 7 };
    struct fit fit = three("two-layer");
    struct whitener white = whitener_of(noise_white(1e-4));
    TEST_ASSERT_TRUE(coarse_init(&fit, &quick, &coarse));
    for (size_t k = 0; k < SKINS; k++) {
        double R[BANDS], x[3], promise;
        for (size_t i = 0; i < BANDS; i++)
            R[i] = dice_between(&dice, -10.0, 10.0);
        for (size_t i = 0; i < 3; i++)
            x[i] = dice_between(&dice, -2.0, 2.0);
        TEST_ASSERT_TRUE(coarse_approach(&coarse, R, &white, x, &promise));
        for (size_t i = 0; i < 3; i++)
            TEST_ASSERT_TRUE(x[i] >= coarse.lo[i] && x[i] <= coarse.hi[i]);
        TEST_ASSERT_TRUE(promise >= 0.0);
    }
}

static void test_others_are_not_for_it(void)
{
    struct fit fit = three("half-space");
    double R[BANDS] = { 0 }, x[3] = { 7.0, 8.0, 9.0 }, promise;
    TEST_ASSERT_FALSE(coarse_init(&fit, &quick, &coarse));
    fit = three("two-layer");
    fit.role[SKIN_BM].prior_mean = 0.5;
    fit.role[SKIN_BM].prior_sd = 0.1;
    TEST_ASSERT_FALSE(coarse_init(&fit, &quick, &coarse));
    fit = three("two-layer");
    fit.role[SKIN_BM].free = false;
    TEST_ASSERT_FALSE(coarse_init(&fit, &quick, &coarse));
    fit = three("two-layer");
    TEST_ASSERT_TRUE(coarse_init(&fit, &quick, &coarse));
    struct whitener placed = whitener_of(noise_default());
    TEST_ASSERT_FALSE(coarse_approach(&coarse, R, &placed, x, &promise));
    TEST_ASSERT_EQUAL_DOUBLE(8.0, x[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_two_steps_lead_to_the_skin);
    RUN_TEST(test_every_kind_of_vectors_gives_the_same_bits);
    RUN_TEST(test_answers_stay_inside);
    RUN_TEST(test_others_are_not_for_it);
    return UNITY_END();
}
