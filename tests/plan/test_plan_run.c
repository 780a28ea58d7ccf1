/* test_plan_run.c - what a plan leaves out is not computed, and what remains is what the whole
 * answer says, to the last bit. */
#include "plan/plan_run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"
#include "optics/opaque.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, SKINS = 200 };

static struct table rows;
static struct matcher by_spectrum, by_lab;
static struct plan_table at_hand_table;
static struct plan_at_hand hand;
static struct spectrum skins[SKINS]; /* any model's: half of them two-layer with noise */
static char why_text[SCENE_WHY_SIZE];

static void draw(struct dice *dice, struct spectrum *ret, bool one_melanin)
{
    struct chromophores c;
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    struct tissue t = tissue_of(exp(dice_between(dice, log(0.005), log(0.3))),
                                one_melanin ? 1.0 : dice_between(dice, 0.0, 1.0),
                                exp(dice_between(dice, log(0.002), log(0.08))));
    *ret = (struct spectrum){
        .first_nm = 400.0, .step_nm = 10.0, .n = BANDS, .specular = SPECULAR_SCE, .aperture_mm = NAN
    };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &c));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_reflectance(model_find("two-layer"), &t, &c, scratch, ret->value));
    for (size_t i = 0; i < BANDS; i++)
        ret->value[i] += dice_between(dice, -0.005, 0.005); /* sd 0.003 */
}

void setUp(void)
{
    struct dice dice = { 71 };
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid.Cm.n = recipe.grid.Ch.n = 20;
    recipe.grid.Bm.n = 6;
    size_t n = grid_rows(&recipe.grid);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, n, &rows));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&rows, 0, n, 1));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&rows, MATCH_SPECTRUM, &by_spectrum));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&rows, MATCH_LAB, &by_lab));
    at_hand_table = (struct plan_table){ "small", &rows.recipe, rows.n };
    hand = (struct plan_at_hand){ costs_builtin(), &at_hand_table, 1, 400.0, 10.0, BANDS };
    for (size_t i = 0; i < SKINS; i++)
        draw(&dice, &skins[i], i % 4 == 0);
}

void tearDown(void)
{
    matcher_close(&by_lab);
    matcher_close(&by_spectrum);
    table_done(&rows);
}

static struct scene wanting(unsigned wanted)
{
    struct scene s = scene_empty();
    s.wanted = wanted;
    return s;
}

/* A scene opened: its plan and what runs it. */
struct opened {
    struct plan plan;
    struct plan_runner *runner;
};

static void open_scene(const struct scene *s, struct opened *ret)
{
    const char *why = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_make(s, &hand, &ret->plan, why_text), why_text);
    const struct matcher *m = !plan_runs(&ret->plan, PLAN_SEARCH) ? NULL
                              : ret->plan.scene.by == MATCH_LAB   ? &by_lab
                                                                  : &by_spectrum;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_open(&ret->plan, m, &ret->runner, &why), why);
}

static struct nearest_hit hits[SCENE_MAX_K];

static struct plan_work run(const struct opened *o, const struct spectrum *s,
                            struct plan_answer *ret)
{
    struct plan_work work = { 0 };
    const char *why = NULL;
    memset(ret, 0xff, sizeof *ret); /* NaN all over: nothing is there by chance */
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_run(o->runner, s, 1, s, hits, ret, &work, &why),
                                  why);
    return work;
}

static void same(const double *expect, const double *x, size_t n)
{
    TEST_ASSERT_EQUAL_MEMORY(expect, x, n * sizeof *x);
}

/* ---- nothing that is not wanted is computed ----------------------------------------- */

static void test_colour_alone(void)
{
    struct scene s = wanting(SCENE_LAB);
    struct opened o;
    struct plan_answer a;
    struct xyz_weights w;
    double XYZ[3], Lab[3];
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, 400.0, 10.0, BANDS, &w));
    open_scene(&s, &o);
    for (size_t i = 0; i < SKINS; i++) {
        struct plan_work work = run(&o, &skins[i], &a);
        TEST_ASSERT_EQUAL_size_t(1, work.colours);
        TEST_ASSERT_EQUAL_size_t(0, work.rows + work.judged + work.evaluations + work.derivatives +
                                        work.bytes);
        TEST_ASSERT_TRUE(a.has_colour && !a.has_nearest && !a.has_refined && !a.has_coefficients);
        xyz_from_reflectance(&w, skins[i].value, XYZ);
        lab_from_xyz(XYZ, w.white, Lab);
        same(Lab, a.Lab, 3);
        TEST_ASSERT_TRUE(isnan(a.rgb[0]));
    }
    plan_close(o.runner);
}

/* expect: matcher_match(), which computes the colour too. */
static void test_nearest_alone(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    struct opened o;
    struct plan_answer a;
    s.k = 4;
    open_scene(&s, &o);
    for (size_t i = 0; i < SKINS; i++) {
        struct nearest_hit whole_hits[4];
        struct match whole;
        struct plan_work work = run(&o, &skins[i], &a);
        TEST_ASSERT_EQUAL_size_t(0, work.colours + work.evaluations + work.derivatives);
        TEST_ASSERT_TRUE(work.rows > 0 && work.rows < rows.n);
        TEST_ASSERT_EQUAL_size_t(work.rows * rows.stride * sizeof(float), work.bytes);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              matcher_match(&by_spectrum, &skins[i], 4, whole_hits, &whole));
        for (size_t k = 0; k < 4; k++) {
            TEST_ASSERT_EQUAL_size_t(whole_hits[k].row, hits[k].row);
            same(&whole_hits[k].distance, &hits[k].distance, 1);
        }
        same(&whole.rms, &a.nearest.rms, 1);
        same(&whole.row.Cm, a.coefficient, 3);
        TEST_ASSERT_EQUAL_HEX32(whole.flags, a.nearest.flags);
        TEST_ASSERT_TRUE(isnan(a.nearest.dE00) && !a.has_colour && !a.has_refined);
    }
    plan_close(o.runner);
}

/* By Lab the colour is computed for the search, and no spectrum of the table is looked at. */
static void test_nearest_by_lab(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    struct opened o;
    struct plan_answer a;
    s.has_by = true;
    s.by = MATCH_LAB;
    float *spectra = rows.spectrum;
    size_t stride = rows.stride;
    open_scene(&s, &o);
    for (size_t i = 0; i < SKINS; i++) {
        struct match whole;
        struct nearest_hit hit;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&by_lab, &skins[i], 1, &hit, &whole));
        rows.spectrum = NULL; /* as a table that was loaded without */
        rows.stride = 0;
        struct plan_work work = run(&o, &skins[i], &a);
        rows.spectrum = spectra;
        rows.stride = stride;
        TEST_ASSERT_EQUAL_size_t(1, work.colours);
        TEST_ASSERT_EQUAL_size_t(whole.row_index, a.nearest.row_index);
        same(&whole.distance, &a.nearest.distance, 1);
        same(&whole.dE00, &a.nearest.dE00, 1);
        TEST_ASSERT_TRUE(isnan(a.nearest.rms));
    }
    plan_close(o.runner);
}

/* ---- a fit -------------------------------------------------------------------------- */

static void whole_answer(const struct spectrum *s, struct refined_match *ret)
{
    struct refine_wish wish = refine_wish_none();
    struct refiner *refiner;
    struct nearest_hit starts[REFINE_STARTS];
    struct fit fit;
    wish.kind = REFINE_THREE;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_fit(&wish, &rows.recipe, &fit, NULL));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400.0, 10.0, BANDS, &refiner, NULL));
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, refined_match(&by_spectrum, refiner, &wish, s, 1, s, 1, starts, ret, NULL));
    refiner_close(refiner);
}

/* expect: refined_match(), which leaves nothing out. */
static void test_refined(void)
{
    struct scene little = wanting(SCENE_REFINED), all = little;
    struct opened few, every;
    struct plan_answer a, b;
    size_t few_evaluations = 0, evaluations = 0, other = 0;
    all.wanted |= SCENE_INTERVAL | SCENE_LAB | SCENE_RGB | SCENE_NEAREST | SCENE_COEFFICIENTS;
    open_scene(&little, &few);
    open_scene(&all, &every);
    for (size_t i = 0; i < SKINS; i++) {
        struct refined_match whole;
        whole_answer(&skins[i], &whole);
        const struct refined *w = &whole.refined;
        struct plan_work little_work = run(&few, &skins[i], &a), work = run(&every, &skins[i], &b);

        /* All of it. */
        same(w->value, b.refined.value, SKIN_PARAMETERS);
        same(w->se, b.refined.se, SKIN_PARAMETERS);
        same(w->lo, b.refined.lo, SKIN_PARAMETERS);
        same(w->hi, b.refined.hi, SKIN_PARAMETERS);
        same(w->residual, b.refined.residual, BANDS);
        same(&w->dE00, &b.refined.dE00, 1);
        same(whole.Lab, b.fitted_Lab, 3);
        same(&whole.nearest.dE00, &b.nearest.dE00, 1);
        TEST_ASSERT_EQUAL_HEX32(w->flags, b.refined.flags);

        /* Values alone. */
        TEST_ASSERT_EQUAL_size_t(0, little_work.colours);
        TEST_ASSERT_EQUAL_size_t(work.rows, little_work.rows);
        TEST_ASSERT_TRUE(isnan(a.refined.se[0]) && isnan(a.refined.lo[0]) &&
                         isnan(a.refined.dE00) && isnan(a.fitted_Lab[0]));
        TEST_ASSERT_TRUE(little_work.evaluations <= a.refined.evaluations + 1);
        few_evaluations += little_work.evaluations;
        evaluations += work.evaluations;
        if (w->chi_square < a.refined.chi_square) { /* looking around, it came upon a better one */
            other++;
            continue;
        }
        same(w->value, a.refined.value, SKIN_PARAMETERS);
        same(w->residual, a.refined.residual, BANDS);
        same(&w->chi_square, &a.refined.chi_square, 1);
        same(a.refined.value, a.coefficient, 3);
    }
    TEST_ASSERT_LESS_THAN(SKINS / 50, other);
    TEST_ASSERT_GREATER_THAN(5 * few_evaluations, evaluations);
    plan_close(few.runner);
    plan_close(every.runner);
}

/* One melanin: fewer derivatives, no rows but those that have it, and the answer has it too. */
static void test_held(void)
{
    struct scene s = wanting(SCENE_REFINED);
    struct opened free_one, held;
    struct plan_answer a, b;
    struct plan_work free_work = { 0 }, held_work = { 0 };
    open_scene(&s, &free_one);
    s.range[1] = (struct scene_range){ 1.0, 1.0 };
    open_scene(&s, &held);
    TEST_ASSERT_EQUAL_size_t(rows.n / 6 / 20 * 20, held.plan.rows / 20 * 20);
    for (size_t i = 0; i < SKINS; i += 4) { /* those of eumelanin alone */
        struct plan_work f = run(&free_one, &skins[i], &a), h = run(&held, &skins[i], &b);
        TEST_ASSERT_TRUE(b.refined.value[SKIN_BM] == 1.0);
        TEST_ASSERT_TRUE(b.nearest.row.Bm == 1.0);
        TEST_ASSERT_LESS_OR_EQUAL(held.plan.rows, h.rows);
        free_work.evaluations += f.evaluations;
        free_work.derivatives += f.derivatives;
        held_work.evaluations += h.evaluations;
        held_work.derivatives += h.derivatives;
    }
    TEST_ASSERT_TRUE(2 * held_work.evaluations >= held_work.derivatives);
    TEST_ASSERT_TRUE(2 * free_work.evaluations < free_work.derivatives);
    plan_close(free_one.runner);
    plan_close(held.runner);
}

/* A range prunes: the rows looked at are fewer, and those found are what a look at all of them
 * would have found. */
static void test_range(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    struct opened some;
    struct plan_answer b;
    s.range[0] = (struct scene_range){ 0.02, 0.05 };
    open_scene(&s, &some);
    for (size_t i = 0; i < SKINS; i++) {
        struct plan_work work = run(&some, &skins[i], &b);
        TEST_ASSERT_TRUE(work.rows > 0 && work.rows <= some.plan.rows);
        double least = INFINITY;
        size_t at = 0;
        for (size_t row = 0; row < rows.n; row++) {
            if (rows.Cm[row] < 0.02 || rows.Cm[row] > 0.05)
                continue;
            double rms = nearest_rms(&rows, row, &skins[i]);
            if (rms < least) {
                least = rms;
                at = row;
            }
        }
        TEST_ASSERT_EQUAL_size_t(at, b.nearest.row_index);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, least, b.nearest.distance);
    }
    TEST_ASSERT_LESS_THAN(rows.n / 3, some.plan.rows);
    plan_close(some.runner);
}

/* The closed form, and a fit from there: no table.  expect: refiner_run() from nothing. */
static void test_without_table(void)
{
    struct scene s = wanting(SCENE_REFINED);
    struct opened o;
    struct plan_answer a;
    struct refiner *refiner;
    struct fit fit = fit_three(&rows.recipe);
    struct noise noise = noise_default();
    struct refined expect;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400.0, 10.0, BANDS, &refiner, NULL));
    s.start = SCENE_START_CLOSED_FORM;
    open_scene(&s, &o);
    for (size_t i = 0; i < SKINS; i++) {
        struct plan_work work = run(&o, &skins[i], &a);
        TEST_ASSERT_EQUAL_size_t(0, work.rows + work.judged + work.bytes);
        TEST_ASSERT_EQUAL_INT(
            STATUS_OK, refiner_run(refiner, &noise, &skins[i], 1, NULL, 0, 0, &expect, NULL));
        same(expect.value, a.refined.value, SKIN_PARAMETERS);
    }
    refiner_close(refiner);
    plan_close(o.runner);
    s = wanting(SCENE_COEFFICIENTS);
    s.start = SCENE_START_CLOSED_FORM;
    s.model = model_find("half-space");
    open_scene(&s, &o);
    struct plan_work work = run(&o, &skins[0], &a);
    TEST_ASSERT_EQUAL_size_t(0, work.rows + work.evaluations + work.colours);
    TEST_ASSERT_TRUE(a.has_coefficients && a.coefficient[0] >= 0.0 && a.coefficient[0] <= 0.5);
    plan_close(o.runner);
}

/* Without its dermis the fitted skin is within the bound of what the whole model says of it. */
static void test_opaque(void)
{
    struct scene s = wanting(SCENE_REFINED);
    struct opened o;
    struct plan_answer a;
    struct chromophores c;
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    double R[BANDS], R1[BANDS], sum = 0.0;
    struct spectrum dark = skins[0];
    struct tissue t = tissue_of(0.45, 0.8, 0.03);
    s.first_nm = 400.0;
    s.last_nm = 500.0;
    s.step_nm = 10.0;
    s.range[0] = (struct scene_range){ 0.4, 0.5 };
    s.bound.rms = 0.02;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &c));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_reflectance(model_find("two-layer"), &t, &c, scratch, dark.value));
    s.model = model_find("two-layer");
    open_scene(&s, &o);
    TEST_ASSERT_EQUAL_PTR(&opaque_model, o.plan.fit.model);
    struct plan_work work = run(&o, &dark, &a);
    TEST_ASSERT_TRUE(2 * work.evaluations >= work.derivatives); /* by Cm and Bm */
    struct tissue fitted = fit_tissue(&o.plan.fit, a.refined.value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_reflectance(model_find("two-layer"), &fitted, &c, scratch, R));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, model_reflectance(&opaque_model, &fitted, &c, scratch, R1));
    for (size_t i = 0; i < 11; i++)
        sum += (R[i] - R1[i]) * (R[i] - R1[i]);
    TEST_ASSERT_TRUE(sqrt(sum / 11.0) <= s.bound.rms);
    TEST_ASSERT_TRUE(a.refined.rms < 0.002);
    plan_close(o.runner);
}

/* Held and narrow between the table's values, and without a dermis: every skin has an answer,
 * inside what was said, and its scene gives the same again. */
static void test_off_the_grid(void)
{
    struct scene scenes[5];
    struct plan_answer a, b;
    for (size_t i = 0; i < 5; i++)
        scenes[i] = wanting(SCENE_REFINED);
    scenes[0].range[2] = (struct scene_range){ 0.0123, 0.0123 };
    scenes[1].range[0] = (struct scene_range){ 0.0123, 0.0124 };
    scenes[1].range[1] = (struct scene_range){ 0.31, 0.31 };
    scenes[2].range[0] = (struct scene_range){ 0.0, 0.0 };
    scenes[3].no_dermis = true;
    scenes[4].no_dermis = true;
    scenes[4].wanted |= SCENE_NEAREST;
    for (size_t k = 0; k < 5; k++) {
        struct opened first, again;
        open_scene(&scenes[k], &first);
        open_scene(&first.plan.scene, &again);
        for (size_t i = 0; i < SKINS; i++) {
            (void)run(&first, &skins[i], &a);
            (void)run(&again, &skins[i], &b);
            TEST_ASSERT_TRUE(a.has_refined && a.has_nearest);
            for (size_t j = 0; j < 3; j++) {
                struct scene_range r = scene_range_of(&scenes[k], j);
                TEST_ASSERT_TRUE(a.coefficient[j] >= r.lo && a.coefficient[j] <= r.hi);
            }
            same(a.refined.value, b.refined.value, SKIN_PARAMETERS);
            TEST_ASSERT_EQUAL_size_t(a.nearest.row_index, b.nearest.row_index);
        }
        plan_close(first.runner);
        plan_close(again.runner);
    }
}

/* Fewer bands: as if no others had been measured. */
static void test_bands(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    struct opened o;
    struct plan_answer a;
    struct match expect;
    struct nearest_hit hit;
    struct spectrum few = skins[3];
    s.first_nm = 500.0;
    s.last_nm = 700.0;
    s.step_nm = 20.0;
    open_scene(&s, &o);
    (void)run(&o, &skins[3], &a);
    few.first_nm = 500.0;
    few.step_nm = 20.0;
    few.n = 11;
    for (size_t i = 0; i < 11; i++)
        few.value[i] = skins[3].value[10 + 2 * i];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_match(&by_spectrum, &few, 1, &hit, &expect));
    TEST_ASSERT_EQUAL_size_t(expect.row_index, a.nearest.row_index);
    same(&expect.distance, &a.nearest.distance, 1);
    plan_close(o.runner);
}

static void test_refused(void)
{
    struct scene s = wanting(SCENE_LAB | SCENE_NEAREST);
    struct opened o;
    struct plan_answer a;
    const char *why = NULL;
    struct spectrum gap = skins[0];
    open_scene(&s, &o);
    gap.value[5] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          plan_run(o.runner, &gap, 1, &gap, hits, &a, NULL, &why));
    TEST_ASSERT_NOT_NULL(strstr(why, "want neither"));
    gap.n = 30;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, plan_run(o.runner, &gap, 1, &gap, hits, &a, NULL, &why));
    TEST_ASSERT_NOT_NULL(strstr(why, "other bands"));
    plan_close(o.runner);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, plan_open(&o.plan, NULL, &o.runner, &why));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, plan_open(&o.plan, &by_lab, &o.runner, &why));
    plan_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_colour_alone);
    RUN_TEST(test_nearest_alone);
    RUN_TEST(test_nearest_by_lab);
    RUN_TEST(test_refined);
    RUN_TEST(test_held);
    RUN_TEST(test_range);
    RUN_TEST(test_without_table);
    RUN_TEST(test_opaque);
    RUN_TEST(test_off_the_grid);
    RUN_TEST(test_bands);
    RUN_TEST(test_refused);
    return UNITY_END();
}
