/* test_spread.c - what a fit says of other placements of the probe, where it can be said by hand.
 */
#include <math.h>

#include "match/refine.h"
#include "match/skin_fit.h"
#include "match/spread.h"
#include "unity.h"

enum { BANDS = 31, REPLICATES = 3 };
static const double quiet = 1e-7; /* white noise beside which every spread is large */

static struct fit fit;
static struct spectrum replicate[REPLICATES];
static struct refined answer;

/* A skin by the model itself: only what is said about its answer is looked at here. */
static void reflect(double Cm, double Ch, double SO2, double a, double b, double *R)
{
    double scratch[MEDIUM_SCRATCH(BANDS)];
    struct chromophores c;
    struct tissue t = tissue_of(Cm, SKIN_FIT_BM, Ch);
    t.gamma = SO2;
    t.epidermis_mm = SKIN_FIT_EPIDERMIS_MM;
    t.scattering_a = a;
    t.scattering_b = b;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400, 10, BANDS, &c));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_reflectance(model_find("two-layer"), &t, &c, scratch, R));
}

void setUp(void)
{
    fit = fit_skin(model_find("two-layer"));
    for (size_t k = 0; k < REPLICATES; k++) {
        replicate[k] = (struct spectrum){ .first_nm = 400, .step_nm = 10, .n = BANDS };
        replicate[k].specular = SPECULAR_SCE;
        reflect(0.03, 0.02, 0.6, 9, 1.2, replicate[k].value);
    }
}
void tearDown(void)
{
}

static void run(double white, size_t replicates)
{
    struct noise noise = noise_white(white);
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          refine(&fit, &noise, replicate, replicates, NULL, 0, &answer, NULL));
}

/* Inside its bounds and without a prior a parameter moves by just its spread. */
static void expect_spreads(double factor, size_t replicates)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &fit.role[i];
        double own = role->spread * (role->spread_relative ? answer.value[i] : 1.0);
        double expect = role->free ? own * sqrt(factor / (double)replicates) : 0.0;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4 * expect, expect, answer.repeat_se[i],
                                          skin_parameter_name(i));
        TEST_ASSERT_TRUE(answer.se[i] >= answer.repeat_se[i]);
    }
}

static void test_one_placement_counts_as_known_beforehand(void)
{
    run(quiet, 1);
    expect_spreads(4.0 / (4.0 - 2.0), 1);
    fit.spread_degrees = 0.0;
    run(quiet, 1);
    expect_spreads(1.0, 1);
}

static void test_a_steady_site_lowers_the_factor(void)
{
    run(quiet, REPLICATES);
    expect_spreads(4.0 / (4.0 + 2 * BANDS - 2.0), REPLICATES);
    replicate[1].value[3] = NAN; /* not measured: one band less to judge by */
    run(quiet, REPLICATES);
    expect_spreads(4.0 / (4.0 + 2 * (BANDS - 1) - 2.0), REPLICATES);
}

/* Differences in one band alone, no spread but one of SO2 that hardly reaches it: q is the
 * square of them over the white noise's. */
static void test_an_unsteady_site_raises_the_factor(void)
{
    const double white = 1e-4, off = 3e-3;
    fit.model_error = 0.01;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fit.role[i].spread = i == SKIN_SO2 ? 1e-4 : 0.0;
    replicate[0].value[0] += off;
    replicate[1].value[0] -= off;
    run(white, REPLICATES);
    double q = 2.0 * off * off / (white * white);
    double spread = 1e-4 * sqrt((4.0 + q) / (4.0 + 2 * BANDS - 2.0) / REPLICATES);
    double drawn_anew = answer.repeat_se[SKIN_SO2];
    fit.role[SKIN_SO2].spread = 0.0;
    run(white, REPLICATES);
    double without = answer.repeat_se[SKIN_SO2];
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * spread, spread,
                              sqrt(drawn_anew * drawn_anew - without * without));
}

/* Along a spread the same difference is hardly strange: q counts it in units of the spread. */
static void test_what_a_spread_explains_is_not_strange(void)
{
    const double step = 0.01; /* of SO2, whose spread is that of the skin fit */
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (i != SKIN_SO2)
            fit.role[i].spread = 0.0;
    reflect(0.03, 0.02, 0.6 + step, 9, 1.2, replicate[0].value);
    reflect(0.03, 0.02, 0.6 - step, 9, 1.2, replicate[1].value);
    run(1e-5, REPLICATES);
    double q = 2.0 * step * step / (SKIN_FIT_SO2_SPREAD * SKIN_FIT_SO2_SPREAD);
    double factor = (4.0 + q) / (4.0 + 2 * BANDS - 2.0);
    /* The model bends by about step^2: what is left of it counts in white noise. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * SKIN_FIT_SO2_SPREAD * sqrt(factor / REPLICATES),
                              SKIN_FIT_SO2_SPREAD * sqrt(factor / REPLICATES),
                              answer.repeat_se[SKIN_SO2]);
}

static void test_at_a_bound_a_parameter_keeps_its_spread(void)
{
    fit.role[SKIN_CH].hi = 0.011;
    run(quiet, 1);
    TEST_ASSERT_EQUAL_DOUBLE(0.011, answer.value[SKIN_CH]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, SKIN_FIT_CH_SPREAD * 0.011 * sqrt(2.0),
                              answer.repeat_se[SKIN_CH]);
    TEST_ASSERT_EQUAL_DOUBLE(0.011, answer.hi[SKIN_CH]);
    TEST_ASSERT_TRUE(answer.lo[SKIN_CH] < 0.011 && answer.lo[SKIN_CH] >= fit.role[SKIN_CH].lo);
}

/* A tight prior holds the answer wherever the probe stands. */
static void test_a_prior_holds_against_placements(void)
{
    fit.role[SKIN_SO2].prior_mean = 0.6;
    fit.role[SKIN_SO2].prior_sd = 1e-5;
    run(0.003, 1);
    TEST_ASSERT_TRUE(answer.repeat_se[SKIN_SO2] < 1e-5);
    TEST_ASSERT_TRUE((answer.flags & (unsigned)REFINE_BY_PRIOR << SKIN_SO2) != 0);
}

/* White noise is averaged by replicates, the model's error is not. */
static void test_model_error(void)
{
    double se[SKIN_PARAMETERS];
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fit.role[i].spread = 0.0;
    fit.model_error = 0.0;
    run(0.005, 1);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        se[i] = answer.se[i];
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, se[i], answer.repeat_se[i]); /* all of it comes anew */
    }
    fit.model_error = 0.004; /* 0.003^2 + 0.004^2 = 0.005^2 */
    run(0.003, 1);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * se[i], se[i], answer.se[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * se[i], 0.6 * se[i], answer.repeat_se[i]);
    }
    run(0.003 * sqrt(3.0), REPLICATES);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * se[i], se[i], answer.se[i]);
}

/* Three replicates far apart: their differences are the spread's, not the model's fault. */
static void test_the_residual_is_the_model_s_alone(void)
{
    reflect(0.032, 0.025, 0.65, 9.5, 1.3, replicate[0].value);
    reflect(0.028, 0.016, 0.55, 8.5, 1.1, replicate[1].value);
    run(SKIN_FIT_WHITE, REPLICATES);
    TEST_ASSERT_EQUAL_size_t(BANDS - 5, answer.degrees);
    TEST_ASSERT_TRUE((answer.flags & REFINE_RESIDUAL_TOO_LARGE) == 0);
    /* Far below the model's usual error: no sign of a noise that was stated too large. */
    TEST_ASSERT_TRUE(answer.chi_square_p > 0.999);
    TEST_ASSERT_TRUE((answer.flags & REFINE_RESIDUAL_TOO_SMALL) == 0);
    fit.role[SKIN_CM].spread = fit.role[SKIN_CH].spread = fit.role[SKIN_SO2].spread = 0.0;
    fit.role[SKIN_SCATTERING_A].spread = fit.role[SKIN_SCATTERING_B].spread = 0.0;
    run(SKIN_FIT_WHITE, REPLICATES);
    TEST_ASSERT_EQUAL_size_t(REPLICATES * BANDS - 5, answer.degrees);
    TEST_ASSERT_TRUE((answer.flags & REFINE_RESIDUAL_TOO_LARGE) != 0);
}

static void refused(const char *what)
{
    const char *why = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_RANGE, fit_check(&fit, &why), what);
    TEST_ASSERT_NOT_NULL_MESSAGE(why, what);
    fit = fit_skin(model_find("two-layer"));
}

static void test_refusals(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, fit_check(&fit, NULL));
    fit.role[SKIN_CM].spread = -0.1;
    refused("a spread below 0");
    fit.role[SKIN_CM].spread = NAN;
    refused("a spread that is no number");
    fit.role[SKIN_CH].per_replicate = true;
    refused("a spread beside parameters of each replicate");
    fit.model_error = -1e-3;
    refused("a model error below 0");
    fit.model_error = NAN;
    refused("a model error that is no number");
    fit.spread_degrees = 2.0;
    refused("a variance that has no mean");
    fit.spread_degrees = INFINITY;
    refused("infinite degrees");
    TEST_ASSERT_TRUE(spread_any(&fit));
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        fit.role[i].spread = 0.0;
    TEST_ASSERT_FALSE(spread_any(&fit));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_placement_counts_as_known_beforehand);
    RUN_TEST(test_a_steady_site_lowers_the_factor);
    RUN_TEST(test_an_unsteady_site_raises_the_factor);
    RUN_TEST(test_what_a_spread_explains_is_not_strange);
    RUN_TEST(test_at_a_bound_a_parameter_keeps_its_spread);
    RUN_TEST(test_a_prior_holds_against_placements);
    RUN_TEST(test_model_error);
    RUN_TEST(test_the_residual_is_the_model_s_alone);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
