/* test_plan.c - which way is chosen by costs that the test makes up, and what is said to be left
 * out. */
#include "plan/plan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "optics/opaque.h"
#include "unity.h"

/* us | Cm Bm Ch | dE00 rms: round numbers, so that each case shows which line was taken. */
static const char costs_text[] =
    "# machine: none\n"
    "model,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,Bm_transport,Ch_transport,"
    "dE00,rms_R,bytes\n"
    "half-space,0,spectrum,none,0,1,2,0.02,0.2,0.02,0.02,0.2,0.02,4,0.08,0\n"
    "half-space,0,spectrum,three,0,2,3,0.01,0.1,0.01,0.01,0.1,0.01,3,0.05,0\n"
    "two-layer,0,spectrum,three,0,4,5,0.004,0.04,0.004,0.004,0.04,0.004,0.5,0.004,0\n"
    "two-layer,0,spectrum,three,1,40,50,0.004,0.04,0.004,0.004,0.04,0.004,0.5,0.004,0\n"
    "two-layer,50000,lab,none,0,3,4,0.05,0.5,0.05,0.05,0.5,0.05,1,0.02,0\n"
    "two-layer,50000,spectrum,none,0,5,6,0.008,0.2,0.009,0.008,0.2,0.009,0.8,0.006,0\n"
    "two-layer,1000000,spectrum,none,0,7,8,0.006,0.1,0.007,0.006,0.1,0.007,0.7,0.005,0\n"
    "two-layer,50000,spectrum,three,0,9,10,0.004,0.04,0.004,0.004,0.04,0.004,0.5,0.004,0\n"
    "two-layer,50000,spectrum,three,1,60,70,0.004,0.04,0.004,0.004,0.04,0.004,0.5,0.004,0\n";

static struct costs costs;
static struct recipe two_layer, paper, large;
static struct plan_table tables[3];
static struct plan_at_hand hand;
static struct plan plan;
static char why[SCENE_WHY_SIZE];

void setUp(void)
{
    size_t line = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_parse(costs_text, &costs, &line));
    two_layer = large = recipe_default(model_find("two-layer"));
    large.grid.Cm.n = large.grid.Bm.n = large.grid.Ch.n = 100;
    paper = recipe_default(model_find("paper"));
    tables[0] = (struct plan_table){ "two-layer", &two_layer, grid_rows(&two_layer.grid) };
    tables[1] = (struct plan_table){ "paper", &paper, grid_rows(&paper.grid) };
    tables[2] = (struct plan_table){ "large", &large, grid_rows(&large.grid) };
    hand = (struct plan_at_hand){ &costs, tables, 2, 400.0, 10.0, 31 };
    why[0] = '\0';
}

void tearDown(void)
{
}

static struct scene wanting(unsigned wanted)
{
    struct scene s = scene_empty();
    s.wanted = wanted;
    if (scene_wants_skin(&s))
        s.white = COSTS_NOISE; /* figures are then as measured */
    return s;
}

static void make(const struct scene *s)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, plan_make(s, &hand, &plan, why), why);
}

static void refused(enum status status, const struct scene *s, const char *wrong,
                    const char *remedy)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, plan_make(s, &hand, &plan, why), why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, wrong), why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, remedy), why);
}

static void runs(unsigned parts)
{
    TEST_ASSERT_EQUAL_HEX32(parts, plan.run);
}

#define PART(part) (1u << PLAN_##part)

/* Left out for this reason, in these words. */
static void left_out(enum plan_part part, enum plan_reason reason, const char *words)
{
    char text[PLAN_WORDS_SIZE];
    for (size_t i = 0; i < plan.omissions; i++) {
        if (plan.omission[i].part != part)
            continue;
        TEST_ASSERT_EQUAL_INT(reason, plan.omission[i].reason);
        plan_omission_words(&plan, i, text);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, words), text);
        return;
    }
    TEST_FAIL_MESSAGE(plan_part_name(part));
}

static bool is_left_out(enum plan_part part)
{
    for (size_t i = 0; i < plan.omissions; i++)
        if (plan.omission[i].part == part)
            return true;
    return false;
}

/* ---- what is not wanted ------------------------------------------------------------- */

static void test_colour_alone(void)
{
    struct scene s = wanting(SCENE_LAB);
    make(&s);
    runs(PART(COLOUR));
    TEST_ASSERT_EQUAL_INT(PLAN_NO_TABLE, plan.table);
    left_out(PLAN_TABLE, PLAN_NO_ROWS_WANTED, "no row");
    left_out(PLAN_SEARCH, PLAN_NOT_WANTED, "no row of a table is wanted");
    left_out(PLAN_FIT, PLAN_NOT_WANTED, "refined is not wanted");
    TEST_ASSERT_EQUAL_DOUBLE(PLAN_COLOUR_US, plan.estimated.us);
}

static void test_nearest_alone(void)
{
    struct scene s = wanting(SCENE_NEAREST);
    make(&s);
    runs(PART(TABLE) | PART(SPECTRA) | PART(SEARCH));
    TEST_ASSERT_EQUAL_INT(0, plan.table);
    TEST_ASSERT_EQUAL_INT(MATCH_SPECTRUM, plan.scene.by);
    TEST_ASSERT_EQUAL_size_t(1, plan.k);
    TEST_ASSERT_EQUAL_size_t(tables[0].rows, plan.rows);
    left_out(PLAN_COLOUR, PLAN_NOT_WANTED, "neither lab nor rgb");
    TEST_ASSERT_EQUAL_DOUBLE(5.0, plan.estimated.us);
    TEST_ASSERT_EQUAL_DOUBLE(0.008, plan.estimated.coefficient[0]);
    s.has_by = true;
    s.by = MATCH_LAB;
    make(&s);
    runs(PART(TABLE) | PART(SEARCH));
    left_out(PLAN_SPECTRA, PLAN_BY_COLOUR, "searched by lab");
}

static void test_refined(void)
{
    struct scene s = wanting(SCENE_REFINED);
    make(&s);
    runs(PART(TABLE) | PART(SPECTRA) | PART(SEARCH) | PART(FIT));
    TEST_ASSERT_EQUAL_size_t(REFINE_STARTS, plan.k);
    TEST_ASSERT_EQUAL_HEX32(REFINE_NO_SE, plan.want);
    left_out(PLAN_COVARIANCE, PLAN_NO_INTERVAL, "no interval");
    left_out(PLAN_SECOND, PLAN_NO_INTERVAL, "no interval");
    left_out(PLAN_FITTED_COLOUR, PLAN_NOT_WANTED, "lab is not wanted");
    s.wanted |= SCENE_INTERVAL | SCENE_LAB;
    make(&s);
    TEST_ASSERT_EQUAL_HEX32(REFINE_ALL, plan.want);
    TEST_ASSERT_EQUAL_size_t(0, plan.omissions);
    TEST_ASSERT_EQUAL_DOUBLE(60.0 + PLAN_COLOUR_US, plan.estimated.us);
}

/* Without a table at hand it fits from the closed form, and says that there are no rows. */
static void test_without_tables(void)
{
    struct scene s = wanting(SCENE_REFINED);
    hand.tables = 0;
    make(&s);
    runs(PART(FIT));
    TEST_ASSERT_EQUAL_STRING("two-layer", plan.scene.model->name);
    TEST_ASSERT_EQUAL_INT(SCENE_START_CLOSED_FORM, plan.scene.start);
    s.wanted = SCENE_NEAREST;
    refused(STATUS_NOT_FOUND, &s, "no table", "skinspec table build --model two-layer");
}

/* ---- what is held or bounded -------------------------------------------------------- */

static void test_held(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.range[1] = (struct scene_range){ 1.0, 1.0 };
    make(&s);
    left_out(PLAN_BY_BM, PLAN_HELD, "held at 1");
    left_out(PLAN_PHEOMELANIN, PLAN_OTHER_MELANIN, "all melanin is eumelanin");
    TEST_ASSERT_FALSE(plan.fit.role[SKIN_BM].free);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, plan.fit.role[SKIN_BM].value);
    /* Of Bm one of the axis's values, at Cm 0 none. */
    const struct grid *g = &two_layer.grid;
    TEST_ASSERT_EQUAL_size_t((g->Cm.n - (g->Cm.lo == 0.0)) * g->Ch.n, plan.rows);
    left_out(PLAN_ROWS, PLAN_OUT_OF_RANGE, "rows lie outside");
    s.range[1] = (struct scene_range){ 0.0, 0.0 };
    make(&s);
    left_out(PLAN_EUMELANIN, PLAN_OTHER_MELANIN, "all melanin is pheomelanin");
    s.range[1] = (struct scene_range){ 0.31, 0.3101 };
    s.wanted |= SCENE_NEAREST;
    refused(STATUS_RANGE, &s, "no row of table 'two-layer' has Bm in 0.31..0.3101",
            "0.35]: say that");
}

/* Rows of the first table with Cm, Bm or Ch (i) from lo to hi.  expect: counted row by row. */
static size_t count_rows(size_t i, double lo, double hi)
{
    size_t n = 0;
    for (size_t row = 0; row < tables[0].rows; row++) {
        double x[3];
        grid_row(&tables[0].recipe->grid, row, &x[0], &x[1], &x[2]);
        n += x[i] >= lo && x[i] <= hi ? 1u : 0u;
    }
    return n;
}

/* What is held need not be a value of the table: a fit begins at the rows beside it; where a row
 * is the answer, the nearest are told, and what is told can be said. */
static void test_off_the_grid(void)
{
    struct scene s = wanting(SCENE_REFINED);
    double lo, hi;
    s.range[2] = (struct scene_range){ 0.0123, 0.0123 };
    make(&s);
    runs(PART(TABLE) | PART(SPECTRA) | PART(SEARCH) | PART(FIT));
    left_out(PLAN_ROWS, PLAN_NOT_BESIDE, "begins beside them");
    TEST_ASSERT_EQUAL_DOUBLE(0.0123, plan.fit.role[SKIN_CH].value);
    TEST_ASSERT_TRUE(plan.searched[2].lo < 0.0123 && plan.searched[2].hi > 0.0123);
    TEST_ASSERT_EQUAL_size_t(count_rows(2, plan.searched[2].lo, plan.searched[2].hi), plan.rows);
    TEST_ASSERT_EQUAL_size_t(2 * tables[0].rows / two_layer.grid.Ch.n, plan.rows);
    s.range[2] = (struct scene_range){ 0.0123, 0.01231 };
    s.range[0] = (struct scene_range){ 0.02, 0.1 }; /* of which there are */
    make(&s);
    TEST_ASSERT_EQUAL_DOUBLE(0.02, plan.searched[0].lo);
    TEST_ASSERT_TRUE(plan.rows > 0);
    s.range[0] = (struct scene_range){ 0.0, 0.0 }; /* below all rows */
    make(&s);
    TEST_ASSERT_EQUAL_DOUBLE(two_layer.grid.Cm.lo, plan.searched[0].lo);
    TEST_ASSERT_EQUAL_DOUBLE(two_layer.grid.Cm.lo, plan.searched[0].hi);
    TEST_ASSERT_TRUE(plan.rows > 0);
    static const unsigned rows_wanted[] = { SCENE_NEAREST, SCENE_COEFFICIENTS,
                                            SCENE_REFINED | SCENE_NEAREST };
    for (size_t i = 0; i < 3; i++) {
        s = wanting(rows_wanted[i]);
        s.range[2] = (struct scene_range){ 0.0123, 0.0123 };
        refused(STATUS_RANGE, &s, "no row of table 'two-layer' has Ch in 0.0123..0.0123",
                "say that");
        TEST_ASSERT_EQUAL_INT(2, sscanf(strchr(why, '['), "[%lf, %lf]", &lo, &hi));
        s.range[2] = (struct scene_range){ lo, hi };
        make(&s);
        TEST_ASSERT_EQUAL_size_t(2 * tables[0].rows / two_layer.grid.Ch.n, plan.rows);
    }
}

/* Rows without melanin have one Bm, whatever is asked. */
static void test_without_melanin(void)
{
    struct scene s = wanting(SCENE_REFINED);
    two_layer.grid.Cm = (struct axis){ 0.0, 0.5, 11, false };
    tables[0].rows = grid_rows(&two_layer.grid);
    s.range[0] = (struct scene_range){ 0.0, 0.0 };
    s.range[1] = (struct scene_range){ 0.3, 0.4 };
    make(&s);
    TEST_ASSERT_EQUAL_size_t(two_layer.grid.Ch.n, plan.rows);
    s.wanted = SCENE_NEAREST;
    refused(STATUS_RANGE, &s, "without melanin (Cm 0)", "widen");
}

/* Ch is held for the fit; rows have a dermis, so they are searched as if it were not. */
static void test_dermis_said(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.no_dermis = true;
    make(&s);
    runs(PART(TABLE) | PART(SPECTRA) | PART(SEARCH) | PART(FIT));
    TEST_ASSERT_EQUAL_size_t(tables[0].rows, plan.rows);
    TEST_ASSERT_EQUAL_PTR(&opaque_model, plan.fit.model);
    TEST_ASSERT_FALSE(plan.fit.role[SKIN_CH].free);
    left_out(PLAN_BY_CH, PLAN_HELD, "held at 0.01");
    /* Light skin shows it: nothing is known of errors. */
    left_out(PLAN_DERMIS, PLAN_AS_SAID, "is not known");
    TEST_ASSERT_TRUE(isnan(plan.estimated.rms) && isnan(plan.estimated.dE00) &&
                     isnan(plan.estimated.coefficient[0]));
    TEST_ASSERT_EQUAL_DOUBLE(9.0, plan.estimated.us);
    s.range[0] = (struct scene_range){ 0.1, 0.5 };
    make(&s);
    TEST_ASSERT_TRUE(!(plan.estimated.rms > 1.0)); /* R is not more */
    s.range[0] = (struct scene_range){ 0.4, 0.5 };
    s.range[1] = (struct scene_range){ 0.9, 1.0 };
    s.first_nm = 400.0;
    s.last_nm = 500.0;
    s.step_nm = 10.0;
    make(&s);
    left_out(PLAN_DERMIS, PLAN_AS_SAID, "at most");
    TEST_ASSERT_TRUE(plan.estimated.rms > 0.001 && plan.estimated.rms < 0.008);
    TEST_ASSERT_TRUE(plan.estimated.coefficient[0] < 0.1); /* the range's width */
    s = wanting(SCENE_COEFFICIENTS);
    s.no_dermis = true;
    make(&s);
    runs(PART(TABLE) | PART(SPECTRA) | PART(SEARCH) | PART(FIT));
    s.bound.coefficient[0] = 0.02;
    refused(STATUS_RANGE, &s, "without the dermis", "leave `dermis` out");
}

static void test_narrowed(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.range[0] = (struct scene_range){ 0.1, 0.2 };
    make(&s);
    TEST_ASSERT_TRUE(plan.fit.role[SKIN_CM].free);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, plan.fit.role[SKIN_CM].lo);
    TEST_ASSERT_EQUAL_DOUBLE(0.2, plan.fit.role[SKIN_CM].hi);
    size_t n = 0; /* expect: counted row by row */
    for (size_t i = 0; i < tables[0].rows; i++) {
        double Cm, Bm, Ch;
        grid_row(&two_layer.grid, i, &Cm, &Bm, &Ch);
        n += Cm >= 0.1 && Cm <= 0.2 ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_size_t(n, plan.rows);
    s.range[0] = (struct scene_range){ 0.0, 0.01 }; /* holds the rows without melanin */
    make(&s);
    n = 0;
    for (size_t i = 0; i < tables[0].rows; i++) {
        double Cm, Bm, Ch;
        grid_row(&two_layer.grid, i, &Cm, &Bm, &Ch);
        n += Cm <= 0.01 ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_size_t(n, plan.rows);
}

/* expect: opaque_most(), itself held against the whole model by tests/optics/test_opaque.c. */
static void test_opaque(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.model = model_find("two-layer");
    s.first_nm = 400.0;
    s.last_nm = 500.0;
    s.step_nm = 10.0;
    s.range[0] = (struct scene_range){ 0.4, 0.5 };
    s.range[1] = (struct scene_range){ 0.5, 1.0 };
    s.bound.rms = 0.009;
    s.bound.dE00 = 10.0; /* known with a dermis alone */
    make(&s);
    double most, known = plan.estimated.rms;
    TEST_ASSERT_FALSE(is_left_out(PLAN_DERMIS));
    TEST_ASSERT_TRUE(known > 0.0005 && known < 0.006); /* dark skin; 0.004 was measured of any */
    s.bound.dE00 = NAN;
    make(&s);
    struct tissue t = tissue_of(0.4, 0.5, 0.02);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, opaque_most(&t, 1.0, 400.0, 10.0, 11, &most));
    TEST_ASSERT_TRUE(most < 0.005);
    left_out(PLAN_DERMIS, PLAN_OPAQUE, "at most");
    left_out(PLAN_BY_CH, PLAN_HELD, "held at 0.01");
    TEST_ASSERT_EQUAL_PTR(&opaque_model, plan.fit.model);
    TEST_ASSERT_EQUAL_DOUBLE(known + most, plan.estimated.rms);
    s.bound.rms = known + 0.9 * most;
    make(&s);
    TEST_ASSERT_FALSE(is_left_out(PLAN_DERMIS));
    s.bound.rms = 0.009;
    s.range[0].lo = 0.001; /* light skin: it shows */
    make(&s);
    TEST_ASSERT_FALSE(is_left_out(PLAN_DERMIS));
    s.range[0].lo = 0.4;
    for (size_t i = 0; i < 3; i++) { /* that was measured with a dermis */
        s.bound.coefficient[i] = 0.5;
        make(&s);
        TEST_ASSERT_FALSE(is_left_out(PLAN_DERMIS));
        s.bound.coefficient[i] = NAN;
    }
    s.bound.dE00 = 10.0;
    make(&s);
    TEST_ASSERT_FALSE(is_left_out(PLAN_DERMIS));
}

static void test_bands(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.first_nm = 420.0;
    s.last_nm = 680.0;
    s.step_nm = 20.0;
    make(&s);
    TEST_ASSERT_EQUAL_size_t(2, plan.first);
    TEST_ASSERT_EQUAL_size_t(2, plan.every);
    TEST_ASSERT_EQUAL_size_t(14, plan.bands);
    left_out(PLAN_BANDS, PLAN_NOT_IN_SCENE, "17 of 31 bands");
    s.wanted |= SCENE_LAB;
    refused(STATUS_RANGE, &s, "420..680 nm by 20 give no colour, but lab is wanted", "do not want");
    s.wanted = SCENE_NEAREST;
    s.last_nm = 560.0; /* eight bands */
    refused(STATUS_RANGE, &s, "8 of the bands are in table 'two-layer'", "takes 10");
    s.last_nm = 760.0;
    refused(STATUS_RANGE, &s, "not among the measured 400..700 nm by 10", "leave `bands` out");
    s.first_nm = 405.0;
    s.last_nm = 485.0;
    s.step_nm = 10.0;
    refused(STATUS_RANGE, &s, "not among the measured", "were measured");
}

/* ---- error against time ------------------------------------------------------------- */

static void test_error_bound(void)
{
    static const struct {
        double Cm, us;
        unsigned run;
    } cases[] = {
        { 0.03, 1.0, PART(CLOSED_FORM) },
        { 0.015, 2.0, PART(FIT) },
        { 0.005, 4.0, PART(FIT) },
    };
    struct scene s = wanting(SCENE_COEFFICIENTS);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        s.bound.coefficient[0] = cases[i].Cm;
        make(&s);
        runs(cases[i].run);
        TEST_ASSERT_EQUAL_DOUBLE(cases[i].us, plan.estimated.us);
    }
    s.bound.coefficient[0] = 0.003;
    refused(STATUS_RANGE, &s, "the nearest is two-layer, fitted from the closed form",
            "Cm 0.004 for 0.003");
    /* Rows are wanted, so a table it is. */
    s = wanting(SCENE_NEAREST);
    s.bound.coefficient[0] = 0.06;
    make(&s);
    TEST_ASSERT_EQUAL_INT(MATCH_LAB, plan.scene.by);
    s.bound.coefficient[0] = 0.01;
    make(&s);
    TEST_ASSERT_EQUAL_INT(MATCH_SPECTRUM, plan.scene.by);
    s.bound.coefficient[0] = 0.007;
    refused(STATUS_RANGE, &s, "table 'two-layer' by spectrum", "build a larger table");
    hand.tables = 3;
    make(&s);
    TEST_ASSERT_EQUAL_INT(2, plan.table);
    s.bound.dE00 = 0.75;
    s.bound.rms = 0.01;
    make(&s);
    s.bound.dE00 = 0.6;
    refused(STATUS_RANGE, &s, "dE00 0.7 for 0.6", "allow as much");
}

/* Of any model its own error counts; one that the scene names is believed. */
static void test_model_error(void)
{
    struct scene s = wanting(SCENE_COEFFICIENTS);
    s.bound.coefficient[0] = 0.03;
    costs.cost[0].rmse_transport[0] = costs.cost[1].rmse_transport[0] = 0.1;
    make(&s);
    TEST_ASSERT_EQUAL_STRING("two-layer", plan.scene.model->name);
    TEST_ASSERT_EQUAL_DOUBLE(4.0, plan.estimated.us);
    s.model = model_find("half-space");
    make(&s);
    runs(PART(CLOSED_FORM));
    TEST_ASSERT_EQUAL_DOUBLE(0.02, plan.estimated.coefficient[0]);
}

static void test_budget(void)
{
    struct scene s = wanting(SCENE_COEFFICIENTS);
    s.budget_us = 1.5;
    make(&s);
    runs(PART(CLOSED_FORM));
    s.budget_us = 4.0;
    make(&s);
    runs(PART(FIT));
    TEST_ASSERT_EQUAL_STRING("two-layer", plan.scene.model->name);
    s.budget_us = 0.5;
    refused(STATUS_RANGE, &s, "nothing at hand takes 0.5 us or less", "the closed form, 1 us");
    s = wanting(SCENE_REFINED | SCENE_INTERVAL);
    s.budget_us = 39.0;
    refused(STATUS_RANGE, &s, "the quickest is", "40 us");
    s = wanting(SCENE_LAB);
    s.budget_us = 0.01;
    refused(STATUS_RANGE, &s, "0.01 us or less", "a colour takes");
}

static void test_unknown_costs(void)
{
    struct scene s = wanting(SCENE_REFINED);
    s.model = model_find("kubelka-munk");
    make(&s);
    TEST_ASSERT_TRUE(isnan(plan.estimated.us));
    s.budget_us = 10.0;
    refused(STATUS_NOT_FOUND, &s, "was measured", "calibrate");
    s = wanting(SCENE_REFINED);
    s.model = model_find("monte-carlo");
    refused(STATUS_UNSUPPORTED, &s, "monte-carlo", "noise");
}

/* Member by member: between them there may be anything. */
static void same_role(const struct skin_role *x, const struct skin_role *y)
{
    const double a[] = { x->value, x->lo, x->hi, x->prior_mean, x->prior_sd, x->spread };
    const double b[] = { y->value, y->lo, y->hi, y->prior_mean, y->prior_sd, y->spread };
    TEST_ASSERT_EQUAL(x->free, y->free);
    TEST_ASSERT_EQUAL(x->per_replicate, y->per_replicate);
    TEST_ASSERT_EQUAL(x->spread_relative, y->spread_relative);
    TEST_ASSERT_EQUAL_MEMORY(a, b, sizeof a);
}

/* ---- what is chosen, written down --------------------------------------------------- */

/* The scene of a plan gives the same plan when costs say otherwise. */
static void test_settled(void)
{
    struct scene scenes[8];
    size_t n = 0;
    scenes[n++] = wanting(SCENE_LAB);
    scenes[n++] = wanting(SCENE_NEAREST);
    scenes[n++] = wanting(SCENE_REFINED | SCENE_INTERVAL | SCENE_LAB);
    scenes[n] = wanting(SCENE_COEFFICIENTS);
    scenes[n++].bound.coefficient[0] = 0.03;
    scenes[n] = wanting(SCENE_COEFFICIENTS);
    scenes[n++].bound.coefficient[0] = 0.015;
    scenes[n] = wanting(SCENE_NEAREST);
    scenes[n++].bound.coefficient[0] = 0.06;
    scenes[n] = wanting(SCENE_COEFFICIENTS | SCENE_NEAREST);
    scenes[n++].budget_us = 5.5;
    scenes[n] = wanting(SCENE_REFINED);
    scenes[n].range[0] = (struct scene_range){ 0.45, 0.5 };
    scenes[n].range[1] = (struct scene_range){ 0.9, 1.0 };
    scenes[n++].bound.rms = 0.06;
    for (size_t i = 0; i < n; i++) {
        struct plan first;
        setUp();
        make(&scenes[i]);
        first = plan;
        for (size_t j = 0; j < costs.n; j++) { /* upside down */
            costs.cost[j].us = 100.0 - costs.cost[j].us;
            costs.cost[j].rmse_transport[0] = 1.0 - costs.cost[j].rmse_transport[0];
        }
        make(&first.scene);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, scene_check_use(&first.scene, why));
        TEST_ASSERT_EQUAL_HEX32(first.run, plan.run);
        TEST_ASSERT_EQUAL_INT(first.table, plan.table);
        TEST_ASSERT_EQUAL_INT(first.scene.by, plan.scene.by);
        TEST_ASSERT_EQUAL_PTR(first.scene.model, plan.scene.model);
        TEST_ASSERT_EQUAL_PTR(first.fit.model, plan.fit.model);
        TEST_ASSERT_EQUAL_size_t(first.k, plan.k);
        TEST_ASSERT_EQUAL_HEX32(first.want, plan.want);
        for (size_t k = 0; k < SKIN_PARAMETERS; k++)
            same_role(&first.fit.role[k], &plan.fit.role[k]);
    }
}

static void test_names(void)
{
    for (int i = 0; i < PLAN_PARTS; i++) {
        for (int j = 0; j < i; j++)
            TEST_ASSERT_TRUE(
                strcmp(plan_part_name((enum plan_part)i), plan_part_name((enum plan_part)j)) != 0);
        TEST_ASSERT_NOT_NULL(plan_part_name((enum plan_part)i));
    }
    TEST_ASSERT_EQUAL_STRING("unknown", plan_part_name(PLAN_PARTS));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_colour_alone);
    RUN_TEST(test_nearest_alone);
    RUN_TEST(test_refined);
    RUN_TEST(test_without_tables);
    RUN_TEST(test_held);
    RUN_TEST(test_off_the_grid);
    RUN_TEST(test_without_melanin);
    RUN_TEST(test_dermis_said);
    RUN_TEST(test_narrowed);
    RUN_TEST(test_opaque);
    RUN_TEST(test_bands);
    RUN_TEST(test_error_bound);
    RUN_TEST(test_model_error);
    RUN_TEST(test_budget);
    RUN_TEST(test_unknown_costs);
    RUN_TEST(test_settled);
    RUN_TEST(test_names);
    return UNITY_END();
}
