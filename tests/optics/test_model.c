/* test_model.c - the list of models, and a spectrum through each of them. */
#include "optics/model.h"

#include <math.h>
#include <string.h>

#include "optics/half_space.h"
#include "optics/two_layer.h"
#include "unity.h"

enum { BANDS = 31 };

static struct chromophores chromophores;
static double scratch[MEDIUM_SCRATCH(BANDS)];

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &chromophores));
}

void tearDown(void)
{
}

/* expect: the names users type, and what docs/physics.md says each model can do. */
static const struct model_case {
    const char *name;
    bool spectral, has_thickness;
} model_cases[] = {
    { "paper", false, false },     { "half-space", true, false },  { "kubelka-munk", true, true },
    { "two-layer", true, true },   { "monte-carlo", true, true },  { "transport-4", true, true },
    { "transport-8", true, true }, { "transport-16", true, true }, { "transport-32", true, true },
};

static void test_list(void)
{
    TEST_ASSERT_EQUAL_INT(MODEL_COUNT, sizeof model_cases / sizeof *model_cases);
    for (size_t i = 0; i < MODEL_COUNT; i++) {
        const struct model_case *c = &model_cases[i];
        const struct model *m = model_find(c->name);
        TEST_ASSERT_NOT_NULL_MESSAGE(m, c->name);
        TEST_ASSERT_EQUAL_STRING(c->name, m->name);
        TEST_ASSERT_TRUE_MESSAGE(m >= model_list && m < model_list + MODEL_COUNT, c->name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->spectral, m->reflectance != NULL, c->name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(!c->spectral, m->rgb != NULL, c->name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->has_thickness, m->has_thickness, c->name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(m->summary) > 0 && strlen(m->trust) > 0, c->name);
    }
}

static void test_find_refuses(void)
{
    static const char *const unknown[] = { "", "Two-Layer", "two-layer ", "two", "monte carlo" };
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        TEST_ASSERT_NULL_MESSAGE(model_find(unknown[i]), unknown[i]);
}

/* model_reflectance() is the tissue's medium put into the model. */
static void test_reflectance_is_the_models_own(void)
{
    struct tissue t = tissue_of(0.1, 0.5, 0.05);
    struct medium m;
    double own_scratch[MEDIUM_SCRATCH(BANDS)], expect[BANDS], R[BANDS];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &chromophores, own_scratch, &m));

    TEST_ASSERT_EQUAL_INT(STATUS_OK, half_space_reflectance(&m, expect));
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, model_reflectance(model_find("half-space"), &t, &chromophores, scratch, R));
    TEST_ASSERT_EQUAL_MEMORY(expect, R, sizeof R);

    TEST_ASSERT_EQUAL_INT(STATUS_OK, two_layer_reflectance(&m, expect));
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, model_reflectance(model_find("two-layer"), &t, &chromophores, scratch, R));
    TEST_ASSERT_EQUAL_MEMORY(expect, R, sizeof R);
}

/* expect: a model without spectra, a skin out of range, an index out of range. */
static const struct refusal_case {
    const char *what, *model;
    double Cm, eta;
    enum status status;
} refusal_cases[] = {
    { "good", "half-space", 0.1, 1.4, STATUS_OK },
    { "good", "two-layer", 0.1, 1.4, STATUS_OK },
    { "no spectrum", "paper", 0.1, 1.4, STATUS_UNSUPPORTED },
    { "skin out of range", "half-space", 1.1, 1.4, STATUS_RANGE },
    { "skin out of range", "two-layer", NAN, 1.4, STATUS_RANGE },
    { "index out of range", "half-space", 0.1, 3.85, STATUS_RANGE },
    { "index out of range", "two-layer", 0.1, NAN, STATUS_RANGE },
};

static void test_refusals(void)
{
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        struct tissue t = tissue_of(c->Cm, 0.5, 0.05);
        double R[BANDS];
        t.eta = c->eta;
        for (size_t k = 0; k < BANDS; k++)
            R[k] = 77.0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->status, model_reflectance(model_find(c->model), &t, &chromophores, scratch, R),
            c->what);
        for (size_t k = 0; k < BANDS; k++)
            TEST_ASSERT_MESSAGE((R[k] == 77.0) == (c->status != STATUS_OK), c->what);
    }
}

/* Property: has_thickness says whether the thickness changes the answer; R is a
 * reflectance over the paper's ranges, and falls when melanin is added. */
static void test_spectral_models_behave(void)
{
    for (size_t i = 0; i < MODEL_COUNT; i++) {
        const struct model *m = &model_list[i];
        double fair[BANDS], thick[BANDS], dark[BANDS];
        if (m->reflectance == NULL)
            continue;
        for (int k = 0; k <= 10; k++) {
            struct tissue t = tissue_of(0.049 * k, 0.1 * k, 0.001 + 0.0099 * k);
            struct tissue thicker = t, darker = t;
            thicker.epidermis_mm *= 1.5;
            darker.Cm += 0.01;
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  model_reflectance(m, &t, &chromophores, scratch, fair));
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  model_reflectance(m, &thicker, &chromophores, scratch, thick));
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  model_reflectance(m, &darker, &chromophores, scratch, dark));
            TEST_ASSERT_EQUAL_INT_MESSAGE(m->has_thickness, memcmp(fair, thick, sizeof fair) != 0,
                                          m->name);
            for (size_t n = 0; n < BANDS; n++)
                TEST_ASSERT_MESSAGE(fair[n] > 0.0 && fair[n] < 1.0 && dark[n] < fair[n], m->name);
        }
    }
}

/* Property: slopes come with the R of reflectance(), and keep to the identity of optics/slopes.h.
 */
static void test_slopes(void)
{
    struct tissue t = tissue_of(0.1, 0.5, 0.05);
    struct medium m;
    double R[BANDS], again[BANDS], slope[SLOPES_SCRATCH(BANDS)];
    struct slopes dR = slopes_in(slope, BANDS);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&t, &chromophores, scratch, &m));
    for (size_t i = 0; i < MODEL_COUNT; i++) {
        if (model_list[i].slopes == NULL)
            continue;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_list[i].reflectance(&m, R));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_list[i].slopes(&m, again, &dR));
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(R, again, sizeof R, model_list[i].name);
        for (size_t k = 0; k < BANDS; k++) {
            double sum = m.sigma_a_epidermis[k] * dR.sigma_a_epidermis[k] +
                         m.sigma_a_dermis[k] * dR.sigma_a_dermis[k] +
                         m.sigma_s_prime_epidermis[k] * dR.sigma_s_prime_epidermis[k] +
                         m.sigma_s_prime_dermis[k] * dR.sigma_s_prime_dermis[k];
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(
                1e-10 * R[k], sum, m.epidermis_mm * dR.epidermis_mm[k], model_list[i].name);
            TEST_ASSERT_TRUE_MESSAGE(dR.sigma_a_epidermis[k] < 0.0 && dR.sigma_a_dermis[k] < 0.0,
                                     model_list[i].name);
        }
    }
}

/* The paper's model gives a colour instead. */
static void test_rgb_model(void)
{
    struct tissue t = tissue_of(0.1, 0.5, 0.05);
    double rgb[3] = { NAN, NAN, NAN };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, model_find("paper")->rgb(&t, rgb));
    for (int k = 0; k < 3; k++)
        TEST_ASSERT_TRUE(rgb[k] > 0.0 && rgb[k] < 1.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_list);
    RUN_TEST(test_find_refuses);
    RUN_TEST(test_reflectance_is_the_models_own);
    RUN_TEST(test_refusals);
    RUN_TEST(test_spectral_models_behave);
    RUN_TEST(test_slopes);
    RUN_TEST(test_rgb_model);
    return UNITY_END();
}
