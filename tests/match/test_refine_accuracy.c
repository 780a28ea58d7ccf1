/* test_refine_accuracy.c - the short form of `make accuracy`: 400 skins of each model with
 * white noise of 0.003, made by tests/reference/inversion.py, against the Cramer-Rao bounds
 * that it computed for them. */
#include <math.h>
#include <stdio.h>

#include "match/refine.h"
#include "tests/support/figures.h"
#include "unity.h"

enum { BANDS = 31 };

static struct figures bounds, spectra;
static struct refiner *refiner;

void setUp(void)
{
    refiner = NULL;
    spectra = (struct figures){ 0 };
    TEST_ASSERT_TRUE(figures_read("tests/reference/inversion.csv", &bounds));
}

void tearDown(void)
{
    refiner_close(refiner);
    figures_done(&spectra);
    figures_done(&bounds);
}

/* Each error in units of its own bound, so that all skins count alike.  Bars of the long form,
 * widened by three times the standard error that they have here: 5 % over the 200 skins or more
 * that lie away from bounds, 1.1 % of a coverage over 400. */
static void check(const char *model, const char *file, size_t column)
{
    static const double lowest[3] = { 0.0, 0.0, TISSUE_CH_MIN },
                        highest[3] = { TISSUE_CM_MAX, 1.0, TISSUE_CH_MAX };
    struct recipe recipe = recipe_default(model_find(model));
    struct fit fit = fit_three(&recipe);
    const struct noise noise = noise_white(0.003);
    double error[3] = { 0 };
    size_t held[3] = { 0 }, inner[3] = { 0 };
    TEST_ASSERT_TRUE(figures_read(file, &spectra));
    TEST_ASSERT_EQUAL_size_t(400, spectra.rows);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
    for (size_t row = 0; row < spectra.rows; row++) {
        static struct refined a;
        struct spectrum s = {
            .first_nm = 400, .step_nm = 10, .n = BANDS, .specular = SPECULAR_SCE
        };
        for (size_t i = 0; i < BANDS; i++)
            s.value[i] = figures_at(&spectra, row, 3 + i);
        TEST_ASSERT_EQUAL_INT(
            STATUS_OK, refiner_run(refiner, &noise, &s, 1, NULL, 0, REFINE_INTERVALS, &a, NULL));
        for (size_t i = 0; i < 3; i++) {
            double truth = figures_at(&spectra, row, i), sd = figures_at(&bounds, row, column + i);
            TEST_ASSERT_EQUAL_DOUBLE(figures_at(&bounds, row, i), truth);
            /* Away from bounds: there the bound is one. */
            if (truth - lowest[i] > 3.0 * sd && highest[i] - truth > 3.0 * sd) {
                error[i] += (a.value[i] - truth) * (a.value[i] - truth) / (sd * sd);
                inner[i]++;
            }
            held[i] += truth >= a.lo[i] && truth <= a.hi[i];
        }
    }
    for (size_t i = 0; i < 3; i++) {
        double ratio = sqrt(error[i] / (double)inner[i]), rate = (double)held[i] / 400.0;
        printf("%s %s: rms error %.3f of Cramer-Rao's, %.1f %% held\n", model,
               skin_parameter_name(i), ratio, 100.0 * rate);
        TEST_ASSERT_TRUE(inner[i] >= 200);
        TEST_ASSERT_TRUE(ratio > 0.82 && ratio < 1.20);
        TEST_ASSERT_TRUE(rate > 0.93 - 0.033);
    }
}

static void test_half_space(void)
{
    check("half-space", "tests/reference/inversion_noisy_half_space.csv", 3);
}

static void test_two_layers(void)
{
    check("two-layer", "tests/reference/inversion_noisy_two_layer.csv", 6);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_half_space);
    RUN_TEST(test_two_layers);
    return UNITY_END();
}
