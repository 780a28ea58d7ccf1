/* The closed form: the skin itself where the half space made the spectrum, and the same bits with
 * any vectors. */
#include "match/start.h"

#include <math.h>
#include <string.h>

#include "match/fit.h"
#include "match/recipe.h"
#include "optics/model.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, SKINS = 2000 };

static struct chromophores chromophores;
static struct fit fit;
static struct start start;
static double all[BANDS];

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("half-space"));
    double value[SKIN_PARAMETERS];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &chromophores));
    fit = fit_three(&recipe);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit.role[i].value;
    struct tissue t = fit_tissue(&fit, value);
    start_init(&t, &chromophores, &start);
    for (size_t i = 0; i < BANDS; i++)
        all[i] = 1.0;
}

void tearDown(void)
{
}

/* By the plain model. */
static struct tissue make(struct dice *dice, double *R)
{
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    double value[SKIN_PARAMETERS];
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit.role[i].value;
    value[SKIN_CM] = 0.005 * pow(40.0, dice_between(dice, 0.0, 1.0));
    value[SKIN_BM] = dice_between(dice, 0.1, 0.9);
    value[SKIN_CH] = 0.002 * pow(40.0, dice_between(dice, 0.0, 1.0));
    struct tissue t = fit_tissue(&fit, value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, model_reflectance(fit.model, &t, &chromophores, scratch, R));
    return t;
}

/* To what the curves lose between their steps: nearer than a row of a table, a third off. */
static void test_a_half_space_comes_back(void)
{
    struct dice dice = { 2 };
    for (size_t k = 0; k < SKINS; k++) {
        double R[BANDS];
        struct tissue truth = make(&dice, R), t = truth;
        t.Cm = t.Bm = t.Ch = 0.0;
        start_guess(&start, R, all, &t);
        TEST_ASSERT_DOUBLE_WITHIN(truth.Cm / 3.0, truth.Cm, t.Cm);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, truth.Bm, t.Bm);
        TEST_ASSERT_DOUBLE_WITHIN(truth.Ch / 3.0, truth.Ch, t.Ch);
    }
}

/* A band that was not measured counts for nothing, whatever stands there. */
static void test_what_was_not_measured_is_not_looked_at(void)
{
    struct dice dice = { 4 };
    double R[BANDS], weight[BANDS];
    struct tissue truth = make(&dice, R), without = truth, with = truth;
    memcpy(weight, all, sizeof weight);
    weight[5] = weight[30] = 0.0;
    start_guess(&start, R, weight, &without);
    R[5] = NAN;
    R[30] = -INFINITY;
    start_guess(&start, R, weight, &with);
    TEST_ASSERT_EQUAL_DOUBLE(without.Cm, with.Cm);
    TEST_ASSERT_EQUAL_DOUBLE(without.Bm, with.Bm);
    TEST_ASSERT_EQUAL_DOUBLE(without.Ch, with.Ch);
}

static void test_every_kind_of_vectors_gives_the_same_bits(void)
{
    struct dice dice = { 6 };
    struct start narrow = start;
    narrow.wide = false;
    for (size_t k = 0; k < SKINS; k++) {
        double R[BANDS];
        struct tissue t = make(&dice, R), u = t;
        for (size_t i = 0; i < BANDS; i++) /* beyond both ends of the curves too */
            R[i] += dice_between(&dice, -0.1, 0.1);
        start_guess(&start, R, all, &t);
        start_guess(&narrow, R, all, &u);
        TEST_ASSERT_EQUAL_MEMORY(&t.Cm, &u.Cm, sizeof t.Cm);
        TEST_ASSERT_EQUAL_MEMORY(&t.Bm, &u.Bm, sizeof t.Bm);
        TEST_ASSERT_EQUAL_MEMORY(&t.Ch, &u.Ch, sizeof t.Ch);
    }
}

/* x (1 + y/x)^2/4, whose slope at y = x is 1. */
static void test_a_step_of_an_amount_goes_by_its_root(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.1, start_by_root(0.1, 0.1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.225, start_by_root(0.1, 0.2));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.009, start_by_root(0.1, -5.0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_half_space_comes_back);
    RUN_TEST(test_what_was_not_measured_is_not_looked_at);
    RUN_TEST(test_every_kind_of_vectors_gives_the_same_bits);
    RUN_TEST(test_a_step_of_an_amount_goes_by_its_root);
    return UNITY_END();
}
