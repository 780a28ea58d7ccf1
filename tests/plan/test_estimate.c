/* test_estimate.c - what plans expect of scenes that are not what was measured.  How near to the
 * truth that is: tests/cli/test_scene_estimates.py. */
#include "plan/estimate.h"

#include <math.h>
#include <string.h>

#include "plan/plan.h"
#include "plan/rehearsal.h"
#include "unity.h"

static struct recipe two_layer;
static struct plan_table table;
static struct plan_at_hand hand;
static struct plan plan;
static char why[SCENE_WHY_SIZE];

void setUp(void)
{
    two_layer = recipe_default(model_find("two-layer"));
    table = (struct plan_table){ "two-layer", &two_layer, grid_rows(&two_layer.grid) };
    hand = (struct plan_at_hand){ costs_builtin(), &table, 1, 400.0, 10.0, 31 };
    why[0] = '\0';
}

void tearDown(void)
{
}

static struct scene wanting(unsigned wanted)
{
    struct scene s = scene_empty();
    s.wanted = wanted;
    s.white = COSTS_NOISE;
    s.model = two_layer.model;
    return s;
}

static void use_bands(struct scene *s, double first_nm, double last_nm, double step_nm)
{
    s->first_nm = first_nm;
    s->last_nm = last_nm;
    s->step_nm = step_nm;
}

static const struct plan_estimate *expect(const struct scene *s)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_make(s, &hand, &plan, why), why);
    return &plan.estimated;
}

static void refused(const struct scene *s, const char *wrong, const char *remedy)
{
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, plan_make(s, &hand, &plan, why));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, wrong), why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, remedy), why);
}

static const struct cost *cost_of(enum match_by by, enum refine_kind refine)
{
    const struct costs *costs = costs_builtin();
    for (size_t i = 0; i < costs->n; i++) {
        const struct cost *c = &costs->cost[i];
        if (c->model == two_layer.model && c->rows == table.rows && c->by == by &&
            c->refine == refine && !c->interval)
            return c;
    }
    TEST_FAIL_MESSAGE("no such cost");
    return NULL;
}

/* ---- errors ------------------------------------------------------------------------- */

static void test_as_measured(void)
{
    const struct scene fit = wanting(SCENE_REFINED), row = wanting(SCENE_NEAREST);
    const struct cost *c = cost_of(MATCH_SPECTRUM, REFINE_THREE);
    const struct plan_estimate *e = expect(&fit);
    for (size_t i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL_DOUBLE(c->rmse[i], e->coefficient[i]);
    TEST_ASSERT_EQUAL_DOUBLE(c->us, e->us);
    TEST_ASSERT_EQUAL_DOUBLE(c->rms_R, e->rms);
    TEST_ASSERT_EQUAL_DOUBLE(cost_of(MATCH_SPECTRUM, REFINE_NOT)->rmse[0],
                             expect(&row)->coefficient[0]);
}

/* More noise, more error; of Cm, which no bound is near, in proportion. */
static void test_noise(void)
{
    struct scene s = wanting(SCENE_REFINED);
    double before = expect(&s)->coefficient[0];
    s.white = 2.0 * COSTS_NOISE;
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 2.0, expect(&s)->coefficient[0] / before);
    s.white = 0.5 * COSTS_NOISE;
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.5, expect(&s)->coefficient[0] / before);
    /* That of a probe set down by hand: what is not said is no less for it. */
    s.white = NAN;
    TEST_ASSERT_TRUE(expect(&s)->coefficient[0] > 3.0 * before);
    TEST_ASSERT_EQUAL_DOUBLE(NOISE_DEFAULT_WHITE, plan.estimated.white);
    TEST_ASSERT_EQUAL_DOUBLE(NOISE_DEFAULT_PLACEMENT, plan.estimated.placement);
    s.placement = NOISE_DEFAULT_PLACEMENT;
    s.white = NOISE_DEFAULT_WHITE;
    TEST_ASSERT_TRUE(expect(&s)->coefficient[0] > 3.0 * before);
}

/* A row takes all for white noise; of the grid's part nothing goes away. */
static void test_rows(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    double as_measured = expect(&s)->coefficient[0];
    double grid2 =
        as_measured * as_measured - pow(cost_of(MATCH_SPECTRUM, REFINE_THREE)->rmse[0], 2.0);
    s.white = 1e-6;
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, sqrt(grid2), expect(&s)->coefficient[0]);
    s.white = NAN;
    double row = expect(&s)->coefficient[0];
    s = wanting(SCENE_REFINED);
    s.white = NAN;
    TEST_ASSERT_TRUE(row > 1.5 * expect(&s)->coefficient[0]);
}

/* Of what is held nothing is unknown, and of the rest less. */
static void test_held(void)
{
    struct scene s = wanting(SCENE_REFINED);
    double free = expect(&s)->coefficient[0];
    s.range[SKIN_BM] = (struct scene_range){ 0.5, 0.5 };
    TEST_ASSERT_TRUE(isnan(expect(&s)->coefficient[1]));
    TEST_ASSERT_TRUE(plan.estimated.coefficient[0] < 0.8 * free);
}

static void test_colours(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    s.has_by = true;
    s.by = MATCH_LAB;
    double before = expect(&s)->coefficient[0];
    TEST_ASSERT_EQUAL_DOUBLE(cost_of(MATCH_LAB, REFINE_NOT)->rmse[0], before);
    s.white = 0.01;
    TEST_ASSERT_TRUE(expect(&s)->coefficient[0] > 1.5 * before);
}

/* Nothing is said that is not known: of skin as the paper's model has it there are no spectra. */
static void test_unknown(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    struct recipe paper = recipe_default(model_find("paper"));
    table = (struct plan_table){ "paper", &paper, grid_rows(&paper.grid) };
    s.model = NULL;
    TEST_ASSERT_FALSE(isnan(expect(&s)->coefficient[0]));
    s.white = 0.01;
    TEST_ASSERT_TRUE(isnan(expect(&s)->coefficient[0]));
    TEST_ASSERT_FALSE(isnan(plan.estimated.us));
    s.bound.coefficient[0] = 0.1;
    refused(&s, "is not known otherwise", "search by spectrum");
}

/* Where fits from the closed form do not end, they begin at rows, unless the scene says. */
static void test_unfinished(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.bound.coefficient[0] = 0.05;
    (void)expect(&s);
    TEST_ASSERT_EQUAL_INT(SCENE_START_CLOSED_FORM, plan.scene.start);
    use_bands(&s, 600.0, 690.0, 10.0);
    (void)expect(&s);
    TEST_ASSERT_EQUAL_INT(SCENE_START_ROWS, plan.scene.start);
    s.start = SCENE_START_CLOSED_FORM;
    (void)expect(&s);
    TEST_ASSERT_EQUAL_INT(PLAN_NO_TABLE, plan.table);
    s.start = SCENE_START_ANY;
    hand.tables = 0;
    refused(&s, "do not end", "closed-form");
}

/* ---- times -------------------------------------------------------------------------- */

static void test_k(void)
{
    static const enum match_by ways[] = { MATCH_RGB, MATCH_LAB, MATCH_DE2000, MATCH_SPECTRUM };
    struct scene s = wanting(SCENE_NEAREST);
    s.has_by = true;
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        s.by = ways[i];
        s.k = 1;
        double one = expect(&s)->us;
        s.k = 100; /* 8 to 20 times as long was measured */
        TEST_ASSERT_TRUE(expect(&s)->us > 5.0 * one && plan.estimated.us < 25.0 * one);
    }
    s.k = 100;
    s.budget_us = 3.0;
    refused(&s, "nothing at hand takes 3 us or less", "allow as much");
    /* A fit looks for three rows anyway. */
    s = wanting(SCENE_REFINED | SCENE_NEAREST);
    double one = expect(&s)->us;
    s.k = 3;
    TEST_ASSERT_EQUAL_DOUBLE(one, expect(&s)->us);
    s.k = 50;
    TEST_ASSERT_TRUE(expect(&s)->us > 2.0 * one);
}

/* Without all of the table's bands every row is looked at: 250 to 400 times as long was
 * measured. */
static void test_scan(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    double all = expect(&s)->us;
    use_bands(&s, 400.0, 700.0, 20.0);
    TEST_ASSERT_TRUE(expect(&s)->us > 100.0 * all && plan.estimated.us < 1000.0 * all);
    s.budget_us = 2.0;
    refused(&s, "nothing at hand takes 2 us or less", "allow as much");
    s = wanting(SCENE_REFINED);
    use_bands(&s, 400.0, 700.0, 20.0);
    TEST_ASSERT_TRUE(expect(&s)->us > 100.0 * all);
    s.start = SCENE_START_CLOSED_FORM; /* there are fewer bands to fit */
    double few = expect(&s)->us;
    s = wanting(SCENE_REFINED);
    s.start = SCENE_START_CLOSED_FORM;
    TEST_ASSERT_TRUE(few < expect(&s)->us);
}

/* ---- rehearsed ---------------------------------------------------------------------- */

/* expect: docs/inversion.md, rms errors of 4 000 skins whose spectra share no code with ours. */
static void test_rehearsed(void)
{
    static const struct {
        const char *model;
        double rmse[3];
    } cases[] = { { "half-space", { 0.0034, 0.060, 0.0024 } },
                  { "two-layer", { 0.0020, 0.052, 0.0023 } } };
    for (size_t m = 0; m < 2; m++) {
        const struct recipe recipe = recipe_default(model_find(cases[m].model));
        struct rehearsal r = { .fit = fit_three(&recipe),
                               .noise = noise_white(0.003),
                               .told = noise_white(0.003),
                               .first_nm = 400.0,
                               .step_nm = 10.0,
                               .bands = 31 };
        struct rehearsed found, again;
        for (size_t i = 0; i < 3; i++)
            r.range[i] = scene_whole_range(i);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, rehearse(&r, &found));
        for (size_t i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.15, 1.0, found.rmse[i] / cases[m].rmse[i],
                                              cases[m].model);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, found.unfinished);
        r.noise.white = r.told.white = 0.004; /* not what is remembered */
        TEST_ASSERT_EQUAL_INT(STATUS_OK, rehearse(&r, &again));
        TEST_ASSERT_TRUE(again.rmse[0] > found.rmse[0]);
        r.noise.white = r.told.white = 0.003;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, rehearse(&r, &again));
        TEST_ASSERT_EQUAL_MEMORY(&found, &again, sizeof found);
    }
}

/* Bands that no skin is known at. */
static void test_not_rehearsed(void)
{
    const struct recipe recipe = recipe_default(two_layer.model);
    struct rehearsal r = { .fit = fit_three(&recipe),
                           .noise = noise_white(0.003),
                           .told = noise_white(0.003),
                           .first_nm = 100.0,
                           .step_nm = 10.0,
                           .bands = 31 };
    struct rehearsed found;
    TEST_ASSERT_NOT_EQUAL(STATUS_OK, rehearse(&r, &found));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_as_measured);
    RUN_TEST(test_noise);
    RUN_TEST(test_rows);
    RUN_TEST(test_held);
    RUN_TEST(test_colours);
    RUN_TEST(test_unknown);
    RUN_TEST(test_unfinished);
    RUN_TEST(test_k);
    RUN_TEST(test_scan);
    RUN_TEST(test_rehearsed);
    RUN_TEST(test_not_rehearsed);
    return UNITY_END();
}
