/* test_tissue_slopes.c - derivatives by a skin's parameters against differences in 500 digits. */
#include "optics/tissue_slopes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "optics/model.h"
#include "tests/support/figures.h"
#include "unity.h"

enum { BANDS = 31, FIRST_R = 9 };

static struct chromophores chromophores;
static double scratch[MODEL_SLOPES_SCRATCH(BANDS)];

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400.0, 10.0, BANDS, &chromophores));
}

void tearDown(void)
{
}

static struct tissue skin_of(const struct figures *t, size_t row)
{
    struct tissue skin = tissue_of(0.0, 0.0, 0.0);
    for (size_t p = 0; p < TISSUE_PARAMETERS; p++)
        *tissue_parameter(&skin, (enum tissue_parameter)p) = figures_at(t, row, 2 + p);
    return skin;
}

/* expect: tests/reference/slopes_skins.csv, from Eqs. 1-6 and the textbook solutions.  The
 * coefficients themselves are rounded, which R of dark skin multiplies by 10. */
static void test_reference(void)
{
    struct figures t;
    TEST_ASSERT_TRUE(figures_read("tests/reference/slopes_skins.csv", &t));
    TEST_ASSERT_EQUAL_STRING("scattering_b", t.name[8]);
    TEST_ASSERT_EQUAL_STRING("by_scattering_b", t.name[16]);
    TEST_ASSERT_EQUAL_size_t(56, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        struct tissue skin = skin_of(&t, i);
        const struct model *model =
            model_find(figures_at(&t, i, 0) > 0.0 ? "two-layer" : "half-space");
        size_t band = (size_t)((figures_at(&t, i, 1) - 400.0) / 10.0);
        double R[BANDS], J[TISSUE_PARAMETERS * BANDS];
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_slopes(model, &skin, &chromophores, scratch, R, J));
        TEST_ASSERT_DOUBLE_WITHIN(1e-14, figures_at(&t, i, FIRST_R), R[band]);
        for (size_t p = 0; p < TISSUE_PARAMETERS; p++) {
            double expect = figures_at(&t, i, FIRST_R + 1 + p);
            char what[80];
            snprintf(what, sizeof what, "slopes_skins.csv, row %zu, %s", i + 1,
                     t.name[FIRST_R + 1 + p]);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-13 * fabs(expect), expect, J[p * BANDS + band],
                                              what);
        }
    }
    figures_done(&t);
}

/* Every parameter has its own member. */
static void test_parameters(void)
{
    struct tissue t = { 1.0, 2.0, 3.0, 4.0, 5.0, 1.4, 6.0, 7.0 };
    for (size_t p = 0; p < TISSUE_PARAMETERS; p++)
        TEST_ASSERT_TRUE(*tissue_parameter(&t, (enum tissue_parameter)p) == (double)(p + 1));
}

/* Property: R as model_reflectance() gives it, to the last bit; and all is finite over the
 * corners of what a skin may be. */
static void test_corners(void)
{
    static const double thickness[] = { 0.0, 1e-9, 0.08, 1000.0 };
    for (int corner = 0; corner < 16 * 4 * 3; corner++) {
        struct tissue t = tissue_of(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
        t.gamma = (corner >> 3) & 1;
        t.epidermis_mm = thickness[(corner >> 4) & 3];
        t.scattering_a = corner < 64 ? 0.0 : corner < 128 ? 1e-6 : 1e6;
        t.scattering_b = corner < 128 ? -10.0 : 10.0;
        for (size_t i = 0; i < MODEL_COUNT; i++) {
            const struct model *model = &model_list[i];
            double R[BANDS], same[BANDS], J[TISSUE_PARAMETERS * BANDS];
            if (model->quick == MODEL_QUICK_NONE) /* closed forms; others take their time */
                continue;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, model_slopes(model, &t, &chromophores, scratch, R, J));
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  model_reflectance(model, &t, &chromophores, scratch, same));
            TEST_ASSERT_EQUAL_MEMORY(same, R, sizeof R);
            for (size_t k = 0; k < TISSUE_PARAMETERS * BANDS; k++)
                TEST_ASSERT_TRUE_MESSAGE(isfinite(J[k]), model->name);
        }
    }
}

static void test_refusals(void)
{
    struct tissue good = tissue_of(0.1, 0.5, 0.05), bad = good, glass = good;
    double R[BANDS] = { 77.0 }, J[TISSUE_PARAMETERS * BANDS] = { 77.0 };
    bad.gamma = 1.5;
    glass.eta = 3.9;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          model_slopes(model_find("paper"), &good, &chromophores, scratch, R, J));
    TEST_ASSERT_EQUAL_INT(
        STATUS_RANGE, model_slopes(model_find("two-layer"), &bad, &chromophores, scratch, R, J));
    TEST_ASSERT_EQUAL_INT(
        STATUS_RANGE, model_slopes(model_find("half-space"), &glass, &chromophores, scratch, R, J));
    TEST_ASSERT_TRUE(R[0] == 77.0 && J[0] == 77.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_reference);
    RUN_TEST(test_parameters);
    RUN_TEST(test_corners);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
