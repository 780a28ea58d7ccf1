/* test_nearest_index.c - nearest_find() against nearest_scan(), which looks at every row
 * (and is itself held to tests/support/textbook.h by test_nearest): the same rows, the
 * same distances to the last bit, the same order of ties. */
#include "match/nearest.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/match.h"
#include "tests/support/dice.h"
#include "tests/support/figures.h"
#include "unity.h"

enum { BY = 5, MOST = 1000 };

/* 25 x 9 x 24 = 5 400 rows each. */
static struct table skins, paper;

static void make(struct table *t, const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    recipe.grid =
        (struct grid){ { 0.001, 0.5, 25, true }, { 0, 1, 9, false }, { 0.001, 0.1, 24, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, grid_rows(&recipe.grid), t));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(t, 0, t->n, 2));
}

void setUp(void)
{
    make(&skins, "two-layer");
    make(&paper, "paper");
}

void tearDown(void)
{
    table_done(&skins);
    table_done(&paper);
}

static void assert_same(const struct nearest *nearest, const struct nearest_query *q, size_t k,
                        const char *what)
{
    static struct nearest_hit scanned[MOST], found[MOST];
    size_t n_scanned = 77, n_found = 78;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, nearest_scan(nearest, q, k, scanned, &n_scanned),
                                  what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, nearest_find(nearest, q, k, found, &n_found), what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(n_scanned, n_found, what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(scanned, found, n_found * sizeof *found, what);
}

/* ---- queries ---------------------------------------------------------------------------- */

struct question {
    struct spectrum spectrum;
    struct nearest_query query;
};

static void empty_question(const struct table *t, struct question *ret)
{
    ret->spectrum = (struct spectrum){ .first_nm = t->recipe.first_nm,
                                       .step_nm = t->recipe.step_nm,
                                       .n = t->recipe.bands,
                                       .specular = SPECULAR_SCE,
                                       .aperture_mm = NAN };
    ret->query = (struct nearest_query){ .has_colour = true, .spectrum = &ret->spectrum };
}

/* x + at (y - x) for all values of two rows, and noise of a size relative to 1. */
static void ask_between(const struct table *t, size_t x, size_t y, double at, double noise,
                        struct dice *dice, struct question *ret)
{
    const double *Lab[3] = { t->L, t->a, t->b }, *rgb[3] = { t->red, t->green, t->blue };
    empty_question(t, ret);
    for (size_t i = 0; i < ret->spectrum.n; i++) {
        double from = (double)table_spectrum(t, x)[i], to = (double)table_spectrum(t, y)[i];
        ret->spectrum.value[i] = from + at * (to - from) + dice_between(dice, -noise, noise);
    }
    for (int i = 0; i < 3; i++) {
        double wide = 100.0 * noise;
        ret->query.Lab[i] = Lab[i][x] + at * (Lab[i][y] - Lab[i][x]) +
                            (noise > 0.0 ? dice_between(dice, -wide, wide) : 0.0);
        ret->query.rgb[i] = rgb[i][x] + at * (rgb[i][y] - rgb[i][x]) +
                            (noise > 0.0 ? dice_between(dice, -noise, noise) : 0.0);
    }
}

static const struct kind_case {
    const char *what;
    bool neighbours; /* two rows next to each other; else any two */
    double at, noise;
} kind_cases[] = {
    { "a row itself", true, 0.0, 0.0 },
    { "half-way between neighbours", true, 0.5, 0.0 },
    { "half-way between any two", false, 0.5, 0.0 },
    { "a row nearly", true, 0.0, 1e-9 },
    { "near a row", true, 0.0, 0.002 },
    { "off the surface", true, 0.0, 0.05 },
    { "beyond the table", false, 3.0, 0.05 },
    { "far away", false, 0.0, 10.0 },
    { "as far as a tree goes", false, 0.0, 1e11 },
    { "farther than that", false, 0.0, 1e18 },
    { "where squares overflow", false, 0.0, 1e200 },
};

static void ask_all_kinds(const struct table *t, enum match_by by)
{
    static const size_t ks[] = { 1, 2, 5, 60, MOST };
    struct dice dice = { 60u + (unsigned)by };
    struct nearest *nearest;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(t, by, &nearest));
    for (size_t kind = 0; kind < sizeof kind_cases / sizeof *kind_cases; kind++) {
        const struct kind_case *c = &kind_cases[kind];
        char what[96];
        snprintf(what, sizeof what, "by %s: %s", match_by_name(by), c->what);
        /* Looking at every row takes CIEDE2000 a hundred times as long. */
        for (size_t number = 0; number < (by == MATCH_DE2000 ? 15u : 50u); number++) {
            static struct question q;
            size_t x = dice_below(&dice, t->n - 1), y = c->neighbours ? x + 1 : 0;
            if (!c->neighbours)
                y = dice_below(&dice, t->n);
            ask_between(t, x, y, c->at, c->noise, &dice, &q);
            assert_same(nearest, &q.query, ks[number % 5], what);
        }
    }
    nearest_close(nearest);
}

static void test_all_kinds_of_queries(void)
{
    for (int by = 0; by < BY; by++) {
        ask_all_kinds(&skins, (enum match_by)by);
        if (by != MATCH_SPECTRUM)
            ask_all_kinds(&paper, (enum match_by)by);
    }
}

/* ---- real skin ---------------------------------------------------------------------------- */

/* Measured spectra lie 0.02 to 0.05 off any row. */
static void test_measured_skin(void)
{
    const char *folder = getenv("SKINSPEC_MEASURED");
    char path[4096];
    struct figures f;
    snprintf(path, sizeof path, "%s/nist_forearm_avg_10nm.csv",
             folder != NULL ? folder : "../shared/measured");
    if (!figures_read(path, &f))
        TEST_IGNORE_MESSAGE("nist_forearm_avg_10nm.csv: not here, set SKINSPEC_MEASURED");
    size_t first = figures_column(&f, "400");
    TEST_ASSERT_TRUE(first + skins.recipe.bands <= f.columns);
    for (int by = 0; by < BY; by++) {
        struct nearest *nearest;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, (enum match_by)by, &nearest));
        for (size_t row = 0; row < f.rows; row += by == MATCH_DE2000 ? 10 : 1) {
            static struct question q;
            empty_question(&skins, &q);
            for (size_t i = 0; i < q.spectrum.n; i++)
                q.spectrum.value[i] = figures_at(&f, row, first + i);
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  matcher_colour(&skins, &q.spectrum, q.query.Lab, q.query.rgb));
            assert_same(nearest, &q.query, 1 + row % 7, f.name[0]);
        }
        nearest_close(nearest);
    }
    figures_done(&f);
}

/* ---- tables that are unlike skin ------------------------------------------------------------ */

/* Rows of chance, each there `times` over, values rounded to multiples of 1/`steps`
 * so that more of them tie. */
static void make_chance(struct table *t, size_t n, size_t times, double steps, struct dice *dice)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_row row = { .Cm = 0.1, .Bm = 0.5, .Ch = 0.05 };
    float spectrum[31];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, n, t));
    for (size_t i = 0; i < n; i++) {
        for (int c = 0; c < 3 && i % times == 0; c++) {
            row.Lab[c] = round(dice_between(dice, 0.0, steps)) * 50.0 / steps;
            row.rgb[c] = round(dice_between(dice, 0.0, steps)) / steps;
        }
        for (int band = 0; band < 31 && i % times == 0; band++)
            spectrum[band] = (float)(round(dice_between(dice, 0.0, steps)) / steps);
        table_set(t, i, &row, spectrum);
    }
}

static const struct chance_case {
    const char *what;
    size_t n, times;
    double steps;
} chance_cases[] = {
    { "one row", 1, 1, 100.0 },
    { "two rows alike", 2, 2, 100.0 },
    { "a leaf", 16, 1, 100.0 },
    { "a leaf and one", 17, 1, 100.0 },
    { "chance, each three times", 2000, 3, 1e9 },
    { "few values, so many ties", 2000, 1, 1.0 },
    { "all alike", 1500, 1500, 10.0 },
};

static void test_tables_unlike_skin(void)
{
    struct dice dice = { 71 };
    for (size_t i = 0; i < sizeof chance_cases / sizeof *chance_cases; i++) {
        const struct chance_case *c = &chance_cases[i];
        struct table t;
        make_chance(&t, c->n, c->times, c->steps, &dice);
        for (int by = 0; by < BY; by++) {
            struct nearest *nearest;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, (enum match_by)by, &nearest));
            for (size_t number = 0; number < 40; number++) {
                static const size_t ks[] = { 1, 2, 4, 31, MOST };
                static struct question q;
                size_t x = dice_below(&dice, t.n), y = dice_below(&dice, t.n);
                ask_between(&t, x, y, 0.5 * (double)(number % 3), number % 2 == 0 ? 0.0 : 0.3,
                            &dice, &q);
                assert_same(nearest, &q.query, ks[number % 5], c->what);
            }
            nearest_close(nearest);
        }
        table_done(&t);
    }
}

/* A row that is no number, or farther than a tree takes: searched all the same. */
static void test_rows_that_no_tree_takes(void)
{
    static const double odd[] = { NAN, INFINITY, 1e16 };
    struct dice dice = { 73 };
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++)
        for (int by = 0; by < BY; by++) {
            static struct question q;
            struct nearest *nearest;
            struct table t;
            make_chance(&t, 300, 1, 100.0, &dice);
            t.b[200] = t.blue[200] = odd[i];
            t.spectrum[200 * t.stride + 30] = (float)odd[i];
            TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, (enum match_by)by, &nearest));
            for (int number = 0; number < 20; number++) {
                ask_between(&t, dice_below(&dice, 200), dice_below(&dice, 200), 0.5, 0.1, &dice,
                            &q);
                assert_same(nearest, &q.query, 3, match_by_name((enum match_by)by));
            }
            nearest_close(nearest);
            table_done(&t);
        }
}

/* ---- bands ---------------------------------------------------------------------------------- */

/* The tree speaks of all bands; with one missing it must not be asked. */
static void test_bands_not_measured(void)
{
    struct dice dice = { 79 };
    struct nearest *nearest;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_SPECTRUM, &nearest));
    for (size_t missing = 0; missing <= 21; missing++)
        for (int number = 0; number < 5; number++) {
            static struct question q;
            ask_between(&skins, dice_below(&dice, skins.n), dice_below(&dice, skins.n), 0.3, 0.03,
                        &dice, &q);
            for (size_t i = 0; i < missing; i++)
                q.spectrum.value[(7 * i + (size_t)number) % 31] = NAN;
            assert_same(nearest, &q.query, 4, "bands not measured");
        }
    nearest_close(nearest);
}

/* Finer and longer grids than 31 bands; the query may be finer and longer still. */
static const struct grid_case {
    const char *what;
    double first_nm, step_nm;
    size_t bands;
} grid_cases[] = {
    { "by 5 nm", 400, 5, 61 },
    { "by 10 nm, 360 to 780", 360, 10, 43 },
    { "by 1 nm", 400, 1, 301 },
};

static void test_other_grids(void)
{
    struct dice dice = { 83 };
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        struct recipe recipe = recipe_default(model_find("two-layer"));
        struct nearest *nearest;
        struct table t;
        recipe.first_nm = c->first_nm;
        recipe.step_nm = c->step_nm;
        recipe.bands = c->bands;
        recipe.grid =
            (struct grid){ { 0.001, 0.5, 6, true }, { 0, 1, 3, false }, { 0.001, 0.1, 20, true } };
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 360, &t));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&t, 0, 360, 2));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, MATCH_SPECTRUM, &nearest));
        for (int number = 0; number < 60; number++) {
            static struct question q;
            static struct spectrum wide;
            size_t x = dice_below(&dice, t.n);
            ask_between(&t, x, dice_below(&dice, t.n), 0.5, number % 2 == 0 ? 0.0 : 0.04, &dice,
                        &q);
            wide = (struct spectrum){ .first_nm = 350, .step_nm = 1, .n = 451 };
            for (size_t band = 0; band < wide.n; band++)
                wide.value[band] = dice_between(&dice, 0.0, 1.0);
            for (size_t band = 0; band < c->bands; band++)
                wide.value[spectrum_band(&wide, c->first_nm + c->step_nm * (double)band)] =
                    q.spectrum.value[band];
            assert_same(nearest, &q.query, 5, c->what);
            q.query.spectrum = &wide;
            assert_same(nearest, &q.query, 5, c->what);
        }
        nearest_close(nearest);
        table_done(&t);
    }
}

/* ---- refusals ------------------------------------------------------------------------------- */

/* nearest_scan() has nearest_find()'s contract, which test_nearest has cases for. */
static void test_scan_refuses(void)
{
    struct nearest_query colourless = { .has_colour = false };
    struct nearest_hit hit = { 77, 78.0 };
    struct nearest *nearest;
    size_t found = 79;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&paper, MATCH_LAB, &nearest));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, nearest_scan(nearest, &colourless, 0, &hit, &found));
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, nearest_scan(nearest, &colourless, 1, &hit, &found));
    TEST_ASSERT_EQUAL_size_t(77, hit.row);
    TEST_ASSERT_EQUAL_size_t(79, found);
    nearest_close(nearest);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_kinds_of_queries);
    RUN_TEST(test_measured_skin);
    RUN_TEST(test_tables_unlike_skin);
    RUN_TEST(test_rows_that_no_tree_takes);
    RUN_TEST(test_bands_not_measured);
    RUN_TEST(test_other_grids);
    RUN_TEST(test_scan_refuses);
    return UNITY_END();
}
