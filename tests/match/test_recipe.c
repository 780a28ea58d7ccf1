/* test_recipe.c - a row is its parts put together, and what is refused. */
#include "match/recipe.h"

#include <math.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "colour/xyz.h"
#include "optics/half_space.h"
#include "optics/two_layer.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* A small grid with a Cm of 0: 3 + 2 x 3 x 3 rows. */
static const struct grid small_grid = { { 0.0, 0.3, 3, false },
                                        { 0.0, 1.0, 3, false },
                                        { 0.001, 0.1, 3, true } };
enum { SMALL_ROWS = 21 };

/* expect: what DESIGN says of the default tables. */
static const struct default_case {
    const char *model;
    double first_nm, step_nm;
    size_t bands;
    enum observer observer;
} default_cases[] = {
    { "two-layer", 400.0, 10.0, 31, OBSERVER_10DEG },
    { "half-space", 400.0, 10.0, 31, OBSERVER_10DEG },
    { "paper", 0.0, 0.0, 0, OBSERVER_2DEG },
};

static void test_defaults(void)
{
    for (size_t i = 0; i < sizeof default_cases / sizeof *default_cases; i++) {
        const struct default_case *c = &default_cases[i];
        struct recipe r = recipe_default(model_find(c->model));
        TEST_ASSERT_EQUAL_STRING(c->model, r.model->name);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->first_nm, r.first_nm, c->model);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->step_nm, r.step_nm, c->model);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->bands, r.bands, c->model);
        TEST_ASSERT_EQUAL_INT_MESSAGE(ILLUMINANT_D65, r.illuminant, c->model);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->observer, r.observer, c->model);
        TEST_ASSERT_EQUAL_INT_MESSAGE(RGB_READING_LINEAR, r.rgb_reading, c->model);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.75, r.gamma, c->model);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.08, r.epidermis_mm, c->model);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(1.4, r.eta, c->model);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(50400, grid_rows(&r.grid), c->model);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, recipe_check(&r), c->model);
    }
}

/* expect: optics and colour called by hand, one after the other; the same bits. */
static const struct row_case {
    const char *what, *model;
    enum status (*reflectance)(const struct medium *m, double *R);
    double first_nm, step_nm;
    size_t bands;
    enum illuminant illuminant;
    enum observer observer;
    double gamma, epidermis_mm, eta;
} row_cases[] = {
    { "two-layer as by default", "two-layer", two_layer_reflectance, 400.0, 10.0, 31,
      ILLUMINANT_D65, OBSERVER_10DEG, 0.75, 0.08, 1.4 },
    { "half-space as by default", "half-space", half_space_reflectance, 400.0, 10.0, 31,
      ILLUMINANT_D65, OBSERVER_10DEG, 0.75, 0.08, 1.4 },
    { "another skin", "two-layer", two_layer_reflectance, 400.0, 10.0, 31, ILLUMINANT_D65,
      OBSERVER_10DEG, 0.2, 0.15, 1.33 },
    { "another light, wider bands", "two-layer", two_layer_reflectance, 360.0, 10.0, 43,
      ILLUMINANT_A, OBSERVER_2DEG, 0.75, 0.08, 1.4 },
    { "by 5 nm", "half-space", half_space_reflectance, 380.0, 5.0, 81, ILLUMINANT_FL11,
      OBSERVER_10DEG, 0.75, 0.08, 1.4 },
    { "by 1 nm", "two-layer", two_layer_reflectance, 400.0, 1.0, 301, ILLUMINANT_D50, OBSERVER_2DEG,
      0.75, 0.08, 1.4 },
};

static struct recipe recipe_of(const struct row_case *c)
{
    return (struct recipe){ .model = model_find(c->model),
                            .grid = small_grid,
                            .gamma = c->gamma,
                            .epidermis_mm = c->epidermis_mm,
                            .eta = c->eta,
                            .first_nm = c->first_nm,
                            .step_nm = c->step_nm,
                            .bands = c->bands,
                            .illuminant = c->illuminant,
                            .observer = c->observer };
}

static void row_by_hand(const struct row_case *c, size_t row, struct table_row *ret,
                        float *spectrum)
{
    static struct chromophores chromophores;
    static struct xyz_weights weights;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)], R[SPECTRUM_MAX_BANDS];
    struct medium medium;
    double XYZ[3];
    grid_row(&small_grid, row, &ret->Cm, &ret->Bm, &ret->Ch);
    struct tissue t = { .Cm = ret->Cm,
                        .Bm = ret->Bm,
                        .Ch = ret->Ch,
                        .gamma = c->gamma,
                        .epidermis_mm = c->epidermis_mm,
                        .eta = c->eta };
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          chromophores_init(c->first_nm, c->step_nm, c->bands, &chromophores));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &chromophores, scratch, &medium));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, c->reflectance(&medium, R));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, xyz_weights_init(c->illuminant, c->observer, c->first_nm,
                                                      c->step_nm, c->bands, &weights));
    xyz_from_reflectance(&weights, R, XYZ);
    lab_from_xyz(XYZ, weights.white, ret->Lab);
    srgb_linear_from_xyz(XYZ, weights.white, ret->rgb);
    for (size_t i = 0; i < c->bands; i++)
        spectrum[i] = (float)R[i];
}

static void test_spectral_rows(void)
{
    for (size_t i = 0; i < sizeof row_cases / sizeof *row_cases; i++) {
        const struct row_case *c = &row_cases[i];
        struct recipe recipe = recipe_of(c);
        struct row_maker *maker;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, recipe_check(&recipe), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, row_maker_open(&recipe, &maker), c->what);
        for (size_t row = 0; row < SMALL_ROWS; row++) {
            struct table_row expect, got, bare;
            float expect_R[SPECTRUM_MAX_BANDS], R[SPECTRUM_MAX_BANDS];
            row_by_hand(c, row, &expect, expect_R);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, row, &got, R));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect, &got, sizeof got, c->what);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect_R, R, c->bands * sizeof *R, c->what);
            /* Without the spectrum it is the same row. */
            TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, row, &bare, NULL));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect, &bare, sizeof bare, c->what);
        }
        row_maker_close(maker);
    }
}

/* expect: entries of the paper's Table 2 as printed; decoded by IEC 61966-2-1
 * outside of this program; L* by the printed primaries' Y, 0.2126 0.7152 0.0722. */
static const struct paper_case {
    const char *what;
    double Cm, Bm, Ch;
    double printed[3], decoded[3];
} paper_cases[] = {
    { "1st group, 1st column",
      0.005,
      1.0,
      0.001,
      { 0.3016, 0.2319, 0.1795 },
      { 0.074033675, 0.043928605, 0.027073034 } },
    { "3rd group, 3rd column",
      0.1,
      0.3,
      0.05,
      { 0.1055, 0.0813, 0.0598 },
      { 0.010897683, 0.007361802, 0.004875898 } },
};

static double lightness(const double rgb[3])
{
    double Y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    return Y > 216.0 / 24389.0 ? 116.0 * cbrt(Y) - 16.0 : Y * 24389.0 / 27.0;
}

static void test_paper_rows(void)
{
    for (size_t i = 0; i < sizeof paper_cases / sizeof *paper_cases; i++) {
        const struct paper_case *c = &paper_cases[i];
        struct recipe recipe = recipe_default(model_find("paper"));
        recipe.grid = (struct grid){ { c->Cm, c->Cm, 1, false },
                                     { c->Bm, c->Bm, 1, false },
                                     { c->Ch, c->Ch, 1, false } };
        for (int coded = 0; coded <= 1; coded++) {
            const double *expect = coded ? c->decoded : c->printed;
            struct row_maker *maker;
            struct table_row row;
            recipe.rgb_reading = coded ? RGB_READING_CODED : RGB_READING_LINEAR;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&recipe, &maker));
            TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, 0, &row, NULL));
            row_maker_close(maker);
            for (int k = 0; k < 3; k++)
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-5, expect[k], row.rgb[k], c->what);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03, lightness(expect), row.Lab[0], c->what);
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->Cm, row.Cm, c->what);
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->Bm, row.Bm, c->what);
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->Ch, row.Ch, c->what);
        }
    }
}

/* Property: r = g = b is grey under sRGB's own white, a* = b* = 0; here through a
 * model made for it, so that the way from RGB to Lab stands alone. */
static enum status grey(const struct tissue *t, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = t->Cm;
    return STATUS_OK;
}

static void test_rgb_to_lab(void)
{
    struct model grey_model = { .name = "grey", .rgb = grey };
    struct recipe recipe = recipe_default(&grey_model);
    struct row_maker *maker;
    recipe.grid.Cm = (struct axis){ 0.0, 0.5, 11, false };
    recipe.grid.Bm = (struct axis){ 1.0, 1.0, 1, false };
    recipe.grid.Ch = (struct axis){ 0.01, 0.01, 1, false };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, recipe_check(&recipe));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&recipe, &maker));
    for (size_t i = 0; i < 11; i++) {
        struct table_row row;
        double rgb[3] = { 0.05 * (double)i, 0.05 * (double)i, 0.05 * (double)i };
        TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, i, &row, NULL));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, lightness(rgb), row.Lab[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, row.Lab[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, row.Lab[2]);
    }
    row_maker_close(maker);
}

/* expect: the contract of recipe_check(); each row changes one thing. */
static const struct check_case {
    const char *what, *model;
    double first_nm, step_nm;
    size_t bands;
    int illuminant, observer;
    double gamma, epidermis_mm, eta, Cm_max;
    enum status status;
} check_cases[] = {
    { "good", "two-layer", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4, 0.3, STATUS_OK },
    { "good", "half-space", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4, 0.3, STATUS_OK },
    { "good", "paper", 0, 0, 0, ILLUMINANT_D65, 0, 0.75, 0.08, 1.4, 0.3, STATUS_OK },
    { "no bands for spectra", "two-layer", 400, 10, 0, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4, 0.3,
      STATUS_UNSUPPORTED },
    { "bands without spectra", "paper", 400, 10, 31, ILLUMINANT_D65, 0, 0.75, 0.08, 1.4, 0.3,
      STATUS_UNSUPPORTED },
    { "paper under A", "paper", 0, 0, 0, ILLUMINANT_A, 0, 0.75, 0.08, 1.4, 0.3,
      STATUS_UNSUPPORTED },
    { "paper at 10 degrees", "paper", 0, 0, 0, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4, 0.3,
      STATUS_UNSUPPORTED },
    { "melanin beyond the paper's", "two-layer", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4,
      0.6, STATUS_RANGE },
    { "melanin not a number", "paper", 0, 0, 0, ILLUMINANT_D65, 0, 0.75, 0.08, 1.4, NAN,
      STATUS_RANGE },
    { "bands too short for colour", "two-layer", 410, 10, 30, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4,
      0.3, STATUS_RANGE },
    { "by 3 nm there is no colour", "two-layer", 399, 3, 105, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4,
      0.3, STATUS_UNSUPPORTED },
    { "bands beyond the haemoglobin", "two-layer", 400, 10, 62, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4,
      0.3, STATUS_RANGE },
    { "too many bands", "two-layer", 400, 1, 1025, ILLUMINANT_D65, 1, 0.75, 0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "an unknown light", "two-layer", 400, 10, 31, ILLUMINANT_COUNT, 1, 0.75, 0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "an unknown observer", "two-layer", 400, 10, 31, ILLUMINANT_D65, 2, 0.75, 0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "gamma above 1", "two-layer", 400, 10, 31, ILLUMINANT_D65, 1, 1.01, 0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "gamma not a number", "paper", 0, 0, 0, ILLUMINANT_D65, 0, NAN, 0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "thickness below 0", "two-layer", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, -0.08, 1.4, 0.3,
      STATUS_RANGE },
    { "a metre of epidermis", "two-layer", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, 1001, 1.4, 0.3,
      STATUS_RANGE },
    { "index too high", "half-space", 400, 10, 31, ILLUMINANT_D65, 1, 0.75, 0.08, 3.9, 0.3,
      STATUS_RANGE },
    { "index too high", "paper", 0, 0, 0, ILLUMINANT_D65, 0, 0.75, 0.08, 3.9, 0.3, STATUS_RANGE },
};

static void test_check(void)
{
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++) {
        const struct check_case *c = &check_cases[i];
        struct recipe recipe = { .model = model_find(c->model),
                                 .grid = small_grid,
                                 .gamma = c->gamma,
                                 .epidermis_mm = c->epidermis_mm,
                                 .eta = c->eta,
                                 .first_nm = c->first_nm,
                                 .step_nm = c->step_nm,
                                 .bands = c->bands,
                                 .illuminant = (enum illuminant)c->illuminant,
                                 .observer = (enum observer)c->observer };
        recipe.grid.Cm.hi = c->Cm_max;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, recipe_check(&recipe), c->what);
    }
}

/* A row that cannot be made leaves the result alone; so does a maker that cannot. */
static void test_failure_leaves_results_alone(void)
{
    struct recipe recipe = recipe_of(&row_cases[0]);
    struct row_maker *maker, *untouched = (struct row_maker *)&recipe;
    struct table_row row, before;
    float spectrum[31], spectrum_before[31];
    memset(&row, 77, sizeof row);
    memset(spectrum, 77, sizeof spectrum);
    before = row;
    memcpy(spectrum_before, spectrum, sizeof spectrum);
    recipe.eta = 3.9;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&recipe, &maker));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, row_maker_make(maker, 0, &row, spectrum));
    TEST_ASSERT_EQUAL_MEMORY(&before, &row, sizeof row);
    TEST_ASSERT_EQUAL_MEMORY(spectrum_before, spectrum, sizeof spectrum);
    row_maker_close(maker);
    maker = untouched;
    recipe.step_nm = 7.0;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, row_maker_open(&recipe, &maker));
    TEST_ASSERT_EQUAL_PTR(untouched, maker);
    row_maker_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_defaults);
    RUN_TEST(test_spectral_rows);
    RUN_TEST(test_paper_rows);
    RUN_TEST(test_rgb_to_lab);
    RUN_TEST(test_check);
    RUN_TEST(test_failure_leaves_results_alone);
    return UNITY_END();
}
