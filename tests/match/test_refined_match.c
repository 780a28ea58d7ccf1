/* test_refined_match.c - what is wished for: fits, noise, and where the fit begins. */
#include "match/refined_match.h"

#include <math.h>
#include <string.h>

#include "match/skin_fit.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static struct recipe recipe_of(const char *model)
{
    return recipe_default(model_find(model));
}

static void test_names(void)
{
    for (int i = REFINE_THREE; i < REFINE_KINDS; i++) {
        enum refine_kind kind = REFINE_NOT;
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refine_kind_parse(refine_kind_name((enum refine_kind)i), &kind));
        TEST_ASSERT_EQUAL_INT(i, kind);
    }
    enum refine_kind kind = REFINE_THREE;
    TEST_ASSERT_EQUAL_STRING("three", refine_kind_name(REFINE_THREE));
    TEST_ASSERT_EQUAL_STRING("skin", refine_kind_name(REFINE_SKIN));
    TEST_ASSERT_EQUAL_STRING("", refine_kind_name(REFINE_NOT));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, refine_kind_parse("", &kind));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, refine_kind_parse("Three", &kind));
    TEST_ASSERT_EQUAL_INT(REFINE_THREE, kind);
    TEST_ASSERT_EQUAL_STRING("stated", noise_source_name(NOISE_STATED));
    TEST_ASSERT_EQUAL_STRING("population", noise_source_name(NOISE_POPULATION));
    TEST_ASSERT_EQUAL_STRING("replicates", noise_source_name(NOISE_REPLICATES));
}

/* What is fixed: the bit of it is free no more; why not, where it cannot be. */
static const struct fix_case {
    const char *what, *model;
    size_t parameter;
    double value;
    enum status status;
    const char *why;
} fix_cases[] = {
    { "inside", "two-layer", SKIN_BM, 0.25, STATUS_OK, NULL },
    { "on a bound", "two-layer", SKIN_BM, 0, STATUS_OK, NULL },
    { "on the other", "half-space", SKIN_CH, TISSUE_CH_MAX, STATUS_OK, NULL },
    { "below", "two-layer", SKIN_CH, 0.0009, STATUS_RANGE, "Ch" },
    { "above", "two-layer", SKIN_CM, 0.51, STATUS_RANGE, "Cm" },
    { "endless", "two-layer", SKIN_CM, INFINITY, STATUS_RANGE, "Cm" },
    { "what is held anyway, elsewhere", "two-layer", SKIN_SO2, 0.5, STATUS_OK, NULL },
    { "what no blood has", "two-layer", SKIN_SO2, 1.5, STATUS_RANGE, "SO2" },
    { "thickness", "two-layer", SKIN_EPIDERMIS_MM, 0.1, STATUS_OK, NULL },
    { "no thickness", "two-layer", SKIN_EPIDERMIS_MM, -0.1, STATUS_RANGE, "epidermis" },
    { "a thickness of nothing", "half-space", SKIN_EPIDERMIS_MM, 0.1, STATUS_RANGE,
      "no epidermis" },
    { "scattering of its own", "two-layer", SKIN_SCATTERING_A, 3, STATUS_RANGE, "scattering" },
    { "a model without spectra", "paper", SKIN_BM, 0.5, STATUS_UNSUPPORTED, "model" },
    { "a model of chance", "monte-carlo", SKIN_BM, 0.5, STATUS_UNSUPPORTED, "transport-8" },
};

static void test_what_is_fixed(void)
{
    for (size_t i = 0; i < sizeof fix_cases / sizeof *fix_cases; i++) {
        const struct fix_case *c = &fix_cases[i];
        struct recipe recipe = recipe_of(c->model);
        struct refine_wish wish = refine_wish_none();
        const char *why = NULL;
        struct fit fit;
        wish.kind = REFINE_THREE;
        wish.fix[c->parameter] = c->value;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, refine_wish_fit(&wish, &recipe, &fit, &why),
                                      c->what);
        if (c->status != STATUS_OK) {
            TEST_ASSERT_NOT_NULL_MESSAGE(why, c->what);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, c->why), why);
            continue;
        }
        unsigned three = 7u & ~(1u << c->parameter);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(three, fit_free(&fit), c->what);
        TEST_ASSERT_EQUAL_DOUBLE(c->value, fit.role[c->parameter].value);
    }
}

/* Under the table's light, whatever the fit would take. */
static void test_the_light_is_the_table_s(void)
{
    struct recipe recipe = recipe_of("two-layer");
    struct refine_wish wish = refine_wish_none();
    struct fit fit;
    wish.kind = REFINE_THREE;
    recipe.illuminant = ILLUMINANT_A;
    recipe.observer = OBSERVER_2DEG;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_fit(&wish, &recipe, &fit, NULL));
    TEST_ASSERT_EQUAL_INT(ILLUMINANT_A, fit.illuminant);
    TEST_ASSERT_EQUAL_INT(OBSERVER_2DEG, fit.observer);
}

/* Two shots 0.06 apart: their placement is not the population's. */
static void test_noise(void)
{
    static const struct {
        const char *what;
        double white, placement;
        size_t n;
        enum noise_source source;
        double expect_white, expect_placement; /* NAN: any but the population's */
    } cases[] = {
        { "nothing known", NAN, NAN, 1, NOISE_POPULATION, NOISE_DEFAULT_WHITE,
          NOISE_DEFAULT_PLACEMENT },
        { "replicates", NAN, NAN, 2, NOISE_REPLICATES, NOISE_DEFAULT_WHITE, NAN },
        { "white alone", 0.001, NAN, 2, NOISE_STATED, 0.001, 0 },
        { "placement alone", NAN, 0.01, 2, NOISE_STATED, NOISE_DEFAULT_WHITE, 0.01 },
        { "both", 0.001, 0.01, 1, NOISE_STATED, 0.001, 0.01 },
        { "placement none", NAN, 0, 2, NOISE_STATED, NOISE_DEFAULT_WHITE, 0 },
    };
    static struct spectrum shots[2];
    for (size_t r = 0; r < 2; r++) {
        shots[r] = (struct spectrum){ .first_nm = 400, .step_nm = 10, .n = 31 };
        for (size_t i = 0; i < 31; i++)
            shots[r].value[i] = 0.3 + 0.06 * (double)r;
    }
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct refine_wish wish = refine_wish_none();
        enum noise_source source = NOISE_STATED;
        struct noise noise;
        wish.kind = REFINE_THREE;
        wish.white = cases[i].white;
        wish.placement = cases[i].placement;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, refine_wish_noise(&wish, shots, cases[i].n, &noise, &source), cases[i].what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].source, source, cases[i].what);
        TEST_ASSERT_EQUAL_DOUBLE(cases[i].expect_white, noise.white);
        if (isnan(cases[i].expect_placement))
            TEST_ASSERT_TRUE(noise.placement > 1.05 * NOISE_DEFAULT_PLACEMENT);
        else
            TEST_ASSERT_EQUAL_DOUBLE(cases[i].expect_placement, noise.placement);
    }
}

/* The skin itself differs from placement to placement, unless noise is stated: then that is all
 * there is of it. */
static void test_noise_of_measured_skin(void)
{
    static struct spectrum shots[2] = { { .first_nm = 400, .step_nm = 10, .n = 31 },
                                        { .first_nm = 400, .step_nm = 10, .n = 31 } };
    struct recipe recipe = recipe_of("two-layer");
    struct refine_wish wish = refine_wish_none();
    enum noise_source source = NOISE_STATED;
    struct noise noise;
    struct fit fit;
    wish.kind = REFINE_SKIN;
    for (size_t n = 1; n <= 2; n++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_noise(&wish, shots, n, &noise, &source));
        TEST_ASSERT_EQUAL_INT(n == 1 ? NOISE_POPULATION : NOISE_REPLICATES, source);
        TEST_ASSERT_EQUAL_DOUBLE(SKIN_FIT_WHITE, noise.white);
        TEST_ASSERT_EQUAL_DOUBLE(0, noise.placement);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_fit(&wish, &recipe, &fit, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(SKIN_FIT_CM_SPREAD, fit.role[SKIN_CM].spread);
    wish.fix[SKIN_SCATTERING_B] = 1.25;
    wish.white = 0.001;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_fit(&wish, &recipe, &fit, NULL));
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        TEST_ASSERT_EQUAL_DOUBLE(0, fit.role[i].spread);
    TEST_ASSERT_TRUE(!fit.role[SKIN_SCATTERING_B].free &&
                     fit.role[SKIN_SCATTERING_B].value == 1.25);
    wish.fix[SKIN_SCATTERING_B] = 5.5;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_wish_fit(&wish, &recipe, &fit, NULL));
    recipe = recipe_of("paper");
    wish.fix[SKIN_SCATTERING_B] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, refine_wish_fit(&wish, &recipe, &fit, NULL));
}

static void test_noise_that_cannot_be(void)
{
    static const double bad[][2] = { { 0, NAN },      { -1, NAN },       { INFINITY, NAN },
                                     { NAN, -0.001 }, { NAN, INFINITY }, { 0.001, 2 } };
    static struct spectrum shot = { .first_nm = 400, .step_nm = 10, .n = 31 };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct refine_wish wish = refine_wish_none();
        enum noise_source source;
        struct noise noise;
        wish.white = bad[i][0];
        wish.placement = bad[i][1];
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_wish_noise(&wish, &shot, 1, &noise, &source));
    }
}

/* ---- a row and from there a fit ----------------------------------------------------- */

static struct table table;
static struct matcher matcher;

/* A table of 3^3 rows, and a spectrum that is one of them. */
static void open_table(const char *model, size_t row, struct spectrum *ret)
{
    struct recipe recipe = recipe_of(model);
    recipe.grid =
        (struct grid){ { 0.01, 0.2, 3, true }, { 0, 1, 3, false }, { 0.005, 0.05, 3, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, grid_rows(&recipe.grid), &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&table, 0, table.n, 1));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, matcher_open(&table, MATCH_SPECTRUM, &matcher));
    *ret = (struct spectrum){
        .first_nm = 400, .step_nm = 10, .n = recipe.bands, .specular = SPECULAR_SCE
    };
    for (size_t i = 0; i < ret->n; i++)
        ret->value[i] = (double)table_spectrum(&table, row)[i];
}

static enum status fit_by(const char *model, const struct spectrum *s, struct refined_match *ret,
                          const char **why)
{
    struct recipe recipe = recipe_of(model);
    struct refine_wish wish = refine_wish_none();
    struct nearest_hit hits[REFINE_STARTS];
    struct refiner *refiner;
    struct fit fit;
    wish.kind = REFINE_THREE;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_wish_fit(&wish, &recipe, &fit, NULL));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, s->n, &refiner, NULL));
    enum status status = refined_match(&matcher, refiner, &wish, s, 1, s, 1, hits, ret, why);
    refiner_close(refiner);
    return status;
}

/* The row itself is met; a refiner of another model would give another skin without a word. */
static void test_a_refiner_of_another_model_is_refused(void)
{
    enum { ROW = 13 }; /* the middle of every axis */
    static struct refined_match answer;
    struct spectrum s;
    const char *why = NULL;
    open_table("two-layer", ROW, &s);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, fit_by("two-layer", &s, &answer, &why));
    TEST_ASSERT_NULL(why);
    TEST_ASSERT_EQUAL_size_t(ROW, answer.nearest.row_index);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, sqrt(0.01 * 0.2), answer.refined.value[SKIN_CM]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.5, answer.refined.value[SKIN_BM]);
    answer.refined.value[SKIN_CM] = -7;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, fit_by("half-space", &s, &answer, &why));
    TEST_ASSERT_NOT_NULL(why);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, "another model"), why);
    TEST_ASSERT_EQUAL_DOUBLE(-7, answer.refined.value[SKIN_CM]);
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, fit_by("transport-8", &s, &answer, NULL));
    matcher_close(&matcher);
    table_done(&table);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names);
    RUN_TEST(test_what_is_fixed);
    RUN_TEST(test_the_light_is_the_table_s);
    RUN_TEST(test_noise);
    RUN_TEST(test_noise_of_measured_skin);
    RUN_TEST(test_noise_that_cannot_be);
    RUN_TEST(test_a_refiner_of_another_model_is_refused);
    return UNITY_END();
}
