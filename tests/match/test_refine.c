/* test_refine.c - skins found again from spectra that an independent program made
 * (tests/reference/inversion.py), what is refused, and what is said about an answer. */
#include "match/refine.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/dice.h"
#include "tests/support/figures.h"
#include "unity.h"

enum { BANDS = 31 };

static const char *const models[2] = { "half-space", "two-layer" };
static const char *const exact[2] = { "tests/reference/inversion_exact_half_space.csv",
                                      "tests/reference/inversion_exact_two_layer.csv" };
static const char *const noisy[2] = { "tests/reference/inversion_noisy_half_space.csv",
                                      "tests/reference/inversion_noisy_two_layer.csv" };
static struct figures table;
static struct refiner *refiner;
static struct refined answer;

void setUp(void)
{
    refiner = NULL;
    table = (struct figures){ 0 };
}

void tearDown(void)
{
    refiner_close(refiner);
    figures_done(&table);
}

static struct fit three(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    return fit_three(&recipe);
}

static struct spectrum blank(void)
{
    return (struct spectrum){
        .first_nm = 400, .step_nm = 10, .n = BANDS, .specular = SPECULAR_SCE, .aperture_mm = NAN
    };
}

/* Row of a table: Cm, Bm, Ch, then the bands. */
static struct spectrum spectrum_of(const struct figures *f, size_t row)
{
    struct spectrum s = blank();
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = figures_at(f, row, 3 + i);
    return s;
}

static struct spectrum constant(double value)
{
    struct spectrum s = blank();
    for (size_t i = 0; i < BANDS; i++)
        s.value[i] = value;
    return s;
}

static enum status run(const struct fit *fit, const struct noise *noise, const struct spectrum *s,
                       size_t replicates, const char **why)
{
    return refine(fit, noise, s, replicates, NULL, 0, &answer, why);
}

/* ---- what is found --------------------------------------------------------------------- */

static void test_spectra_without_noise_give_the_skin_back(void)
{
    const struct noise noise = noise_white(1e-6);
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(models[m]);
        TEST_ASSERT_TRUE(figures_read(exact[m], &table));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
        for (size_t row = 0; row < table.rows; row++) {
            struct spectrum s = spectrum_of(&table, row);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_run(refiner, &noise, &s, 1, NULL, 0,
                                                         REFINE_COLOUR, &answer, NULL));
            for (size_t i = 0; i < 3; i++)
                TEST_ASSERT_DOUBLE_WITHIN(1e-6, figures_at(&table, row, i), answer.value[i]);
            TEST_ASSERT_TRUE(answer.rms < 1e-9 && answer.dE00 < 1e-6);
            TEST_ASSERT_EQUAL_HEX(REFINE_RESIDUAL_TOO_SMALL, answer.flags);
            TEST_ASSERT_EQUAL_HEX(7, answer.free);
            TEST_ASSERT_EQUAL_size_t(BANDS - 3, answer.degrees);
            TEST_ASSERT_EQUAL_DOUBLE(0.75, answer.value[SKIN_SO2]);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, answer.se[SKIN_SO2]);
            TEST_ASSERT_EQUAL_DOUBLE(0.75, answer.hi[SKIN_SO2]);
        }
        refiner_close(refiner);
        refiner = NULL;
        figures_done(&table);
    }
}

/* From the far corners of the box as from near. */
static void test_the_start_does_not_matter(void)
{
    static const double corner[5][SKIN_PARAMETERS] = {
        { 0.5, 0, 0.1 },   { 0.5, 1, 0.001 }, { 0.001, 0, 0.001 },
        { 0.001, 1, 0.1 }, { 9, -9, 9 }, /* outside: taken to the nearest inside */
    };
    const struct noise noise = noise_white(0.003);
    TEST_ASSERT_TRUE(figures_read(noisy[1], &table));
    struct fit fit = three("two-layer");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
    for (size_t row = 0; row < 100; row++) {
        static struct refined other;
        struct spectrum s = spectrum_of(&table, row);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &answer, NULL));
        for (size_t k = 0; k < 5; k++) {
            TEST_ASSERT_EQUAL_INT(
                STATUS_OK, refiner_run(refiner, &noise, &s, 1, corner + k, 1, 0, &other, NULL));
            for (size_t i = 0; i < 3; i++)
                TEST_ASSERT_DOUBLE_WITHIN(0.001 * answer.se[i], answer.value[i], other.value[i]);
        }
    }
}

/* Residual and chi^2 are those of the answer, though the last step is not looked at.  expect: the
 * model's plain reflectance there.  Measured: within 3e-7 and 4e-6. */
static void test_residuals_are_those_of_the_answer(void)
{
    static const double start[2][SKIN_PARAMETERS] = { { 0.05, 0.5, 0.01 }, { 0.2, 0.1, 0.05 } };
    const struct noise noises[2] = { { .white = 0.003 }, { 0.003, 0.009, 0.4 } };
    static struct chromophores c;
    double scratch[MEDIUM_SCRATCH(BANDS)], R[BANDS];
    TEST_ASSERT_TRUE(figures_read(noisy[1], &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400, 10, BANDS, &c));
    struct fit fit = three("two-layer");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
    for (size_t k = 0; k < 400; k++) {
        struct spectrum s = spectrum_of(&table, k / 4);
        double sum = 0.0;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_run(refiner, &noises[k & 1], &s, 1,
                                                     start + (k / 2 & 1), 1, 0, &answer, NULL));
        struct tissue t = fit_tissue(&fit, answer.value);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_reflectance(fit.model, &t, &c, scratch, R));
        for (size_t i = 0; i < BANDS; i++) {
            double r = s.value[i] - R[i];
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, r, answer.residual[i]);
            sum += r * r / (0.003 * 0.003);
        }
        if ((k & 1) == 0)
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, sum, answer.chi_square);
    }
}

/* The end of an interval, held there: the best of the rest is worse by 3.841. */
static void test_interval_ends_are_where_chi_square_has_risen(void)
{
    const struct noise noise = { 0.003, 0.006, 0.4 };
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(models[m]);
        TEST_ASSERT_TRUE(figures_read(noisy[m], &table));
        for (size_t row = 0; row < 60; row++) {
            static struct refined full;
            struct spectrum s = spectrum_of(&table, row);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, refine(&fit, &noise, &s, 1, NULL, 0, &full, NULL));
            for (size_t i = 0; i < 6; i++) {
                struct fit held = fit;
                double end = i < 3 ? full.lo[i] : full.hi[i - 3];
                held.role[i % 3].free = false;
                held.role[i % 3].value = end;
                TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&held, &noise, &s, 1, NULL));
                double rise = answer.chi_square - full.chi_square;
                bool bound = end == fit.role[i % 3].lo || end == fit.role[i % 3].hi;
                TEST_ASSERT_TRUE(bound ? rise <= 3.85 : fabs(rise - 3.841459) < 0.01);
                TEST_ASSERT_TRUE(full.lo[i % 3] <= full.value[i % 3] &&
                                 full.value[i % 3] <= full.hi[i % 3]);
            }
        }
        figures_done(&table);
    }
}

/* Four replicates alike are one with half the noise; of the scatter there is none. */
static void test_replicates_count_as_their_mean(void)
{
    const struct noise noise = { 0.003, 0.006, 0.4 }, half = { 0.0015, 0.003, 0.4 };
    static struct spectrum four[4];
    static struct refined one;
    struct fit fit = three("two-layer");
    TEST_ASSERT_TRUE(figures_read(noisy[1], &table));
    for (size_t k = 0; k < 4; k++)
        four[k] = spectrum_of(&table, 8);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &half, four, 1, NULL));
    one = answer;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, four, 4, NULL));
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, one.value[i], answer.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, one.hi[i], answer.hi[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, one.chi_square, answer.chi_square);
    TEST_ASSERT_EQUAL_size_t(4 * BANDS - 3, answer.degrees);

    /* Two that stray by +-x at one band add 2 x^2/white^2 (white noise alone). */
    four[0].value[5] += 0.01;
    four[1].value[5] -= 0.01;
    const struct noise white = noise_white(0.003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &white, four, 2, NULL));
    double together = answer.chi_square;
    four[0] = four[1] = four[2];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &white, four, 2, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.0 * 1e-4 / 9e-6, together - answer.chi_square);
}

/* ---- what is refused ------------------------------------------------------------------- */

static void refused(enum status expect, const struct fit *fit, const struct noise *noise,
                    const struct spectrum *s, size_t replicates, const char *what)
{
    const char *why = NULL;
    answer.bands = 77;
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, run(fit, noise, s, replicates, &why), what);
    TEST_ASSERT_NOT_NULL_MESSAGE(why, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, run(fit, noise, s, replicates, NULL), what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(77, answer.bands, what);
}

static void test_fits_that_make_no_sense_are_refused(void)
{
    const struct fit good = three("two-layer");
    const struct noise noise = noise_default();
    struct spectrum s = constant(0.3);
    struct fit fit;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, fit_check(&good, NULL));

    fit = good, fit.model = model_find("paper");
    refused(STATUS_UNSUPPORTED, &fit, &noise, &s, 1, "a model without derivatives");
    fit = good, fit.model = model_find("monte-carlo");
    refused(STATUS_UNSUPPORTED, &fit, &noise, &s, 1, "a model with noise of its own");
    fit = good, fit.role[SKIN_BM].free = false, fit.role[SKIN_BM].value = 1.2;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "held beyond the bounds");
    fit = good, fit.role[SKIN_CM].free = false, fit.role[SKIN_CM].value = NAN;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "held at no number");
    fit = good, fit.role[SKIN_SO2].value = -0.1, fit.role[SKIN_SO2].lo = -1;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "SO2 below 0");
    fit = good, fit.role[SKIN_CM].lo = 0.6;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "lower bound above the upper");
    fit = good, fit.role[SKIN_CM].lo = fit.role[SKIN_CM].hi = fit.role[SKIN_CM].value;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "free without room");
    fit = good, fit.role[SKIN_CM].hi = 1.5;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a bound that is no skin");
    fit = good, fit.role[SKIN_CM].hi = INFINITY;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "no bound");
    fit = good, fit.role[SKIN_BM].prior_sd = 0.0, fit.role[SKIN_BM].prior_mean = 0.5;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a prior without width");
    fit = good, fit.role[SKIN_BM].prior_sd = -1.0, fit.role[SKIN_BM].prior_mean = 0.5;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a prior of negative width");
    fit = good, fit.role[SKIN_BM].prior_sd = NAN;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a prior of no width");
    fit = good, fit.role[SKIN_BM].prior_sd = 0.1, fit.role[SKIN_BM].prior_mean = 1.5;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a prior that contradicts the bounds");
    fit = good, fit.role[SKIN_SO2].per_replicate = true;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "held and each replicate's own");
    fit = good, fit.role[SKIN_SCATTERING_B].free = true;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "scattering free under Eq. 6");
    fit = good, fit.own_scattering = true;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "scattering of its own of 0");
    fit = good, fit.eta = 5.0;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "an index no model takes");
    fit = three("half-space"), fit.role[SKIN_EPIDERMIS_MM].free = true;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "a thickness that the model does not have");
    fit = good;
    for (size_t i = 0; i < 3; i++)
        fit.role[i].free = false;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "nothing free");
}

static void test_data_that_cannot_be_fitted_are_refused(void)
{
    struct fit fit = three("two-layer");
    struct noise noise = noise_default();
    struct spectrum s = constant(0.3);
    static struct spectrum many[41];

    refused(STATUS_RANGE, &fit, &noise, &s, 0, "no spectrum");
    s.specular = SPECULAR_SCI;
    refused(STATUS_UNSUPPORTED, &fit, &noise, &s, 1, "SCI");
    s = constant(30.0);
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "percent");
    s = constant(0.3), s.value[7] = -INFINITY;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "infinite");
    s = constant(0.3), s.first_nm = 240;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "ultraviolet");
    s = constant(0.3), s.n = 2;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "two bands");
    s = constant(NAN), s.value[0] = s.value[30] = 0.3;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "two measured");
    many[0] = many[1] = constant(0.3);
    many[1].step_nm = 5;
    refused(STATUS_RANGE, &fit, &noise, many, 2, "replicates on other bands");
    s = constant(0.3);
    static const double none[] = { 0.0, -0.003, NAN, INFINITY };
    for (size_t i = 0; i < 4; i++) {
        noise.white = none[i];
        refused(STATUS_RANGE, &fit, &noise, &s, 1, "noise");
    }
    noise = noise_default();
    noise.placement = -0.001;
    refused(STATUS_RANGE, &fit, &noise, &s, 1, "placement");

    noise = noise_default();
    const double start[1][SKIN_PARAMETERS] = { { 0.1, NAN, 0.01 } };
    const char *why = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine(&fit, &noise, &s, 1, start, 1, &answer, &why));
    TEST_ASSERT_NOT_NULL(why);

    fit.role[SKIN_CH].per_replicate = true;
    for (size_t i = 0; i < 41; i++)
        many[i] = constant(0.3);
    refused(STATUS_UNSUPPORTED, &fit, &noise, many, 39, "no room for so many");
    refused(STATUS_UNSUPPORTED, &fit, &noise, many, 41, "nor for that many");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, many, 38, NULL));
}

/* ---- whatever comes -------------------------------------------------------------------- */

static struct spectrum hostile(struct dice *dice)
{
    static const double level[] = { 0.0, 1.0, 0.5, -0.5, 2.0, 10.0, -10.0, 1e-300 };
    struct spectrum s = constant(level[dice_below(dice, 8)]);
    size_t kind = dice_below(dice, 6);
    for (size_t i = 0; i < BANDS; i++) {
        if (kind == 1)
            s.value[i] = dice_between(dice, 0.0, 1.0); /* nothing but noise */
        else if (kind == 2)
            s.value[i] = (double)(i % 2);
        else if (kind == 3)
            s.value[i] = 0.1 + 0.5 * (double)(i * i) / 900.0 + dice_between(dice, -0.02, 0.02);
        else if (kind == 4)
            s.value[i] = 0.7 - 0.6 * (double)i / BANDS; /* falls towards the red */
        if (dice_below(dice, 10) == 0)
            s.value[i] = dice_below(dice, 2) == 0 ? NAN : dice_between(dice, -10.0, 10.0);
    }
    if (dice_below(dice, 4) == 0)
        s.step_nm = 0.001; /* as if one band were measured 31 times */
    if (dice_below(dice, 4) == 0)
        s.n = 10;
    for (size_t i = 0; i < 7; i++) /* enough of them to be fitted */
        s.value[i] = isnan(s.value[i]) ? 0.2 : s.value[i];
    return s;
}

static struct fit any_fit(struct dice *dice)
{
    struct fit fit = three(models[dice_below(dice, 2)]);
    if (dice_below(dice, 2) == 0) {
        fit.own_scattering = true;
        fit.role[SKIN_SCATTERING_A].value = 10.0;
        fit.role[SKIN_SCATTERING_A].lo = 0.1;
        fit.role[SKIN_SCATTERING_A].hi = 100.0;
        fit.role[SKIN_SCATTERING_B].value = 1.0;
        fit.role[SKIN_SCATTERING_A].free = dice_below(dice, 2) == 0;
        fit.role[SKIN_SCATTERING_B].free = dice_below(dice, 2) == 0;
    }
    fit.role[SKIN_SO2].free = dice_below(dice, 2) == 0;
    fit.role[SKIN_EPIDERMIS_MM].free = fit.model->has_thickness && dice_below(dice, 4) == 0;
    fit.role[SKIN_BM].free = dice_below(dice, 4) != 0;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        if (fit.role[i].free && dice_below(dice, 5) == 0) {
            fit.role[i].prior_mean = fit.role[i].value;
            fit.role[i].prior_sd = dice_between(dice, 1e-6, 1.0);
        }
        fit.role[i].per_replicate = fit.role[i].free && dice_below(dice, 5) == 0;
    }
    return fit;
}

static void check_answer(const struct fit *fit)
{
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        const struct skin_role *role = &fit->role[i];
        TEST_ASSERT_TRUE(answer.value[i] >= role->lo && answer.value[i] <= role->hi);
        TEST_ASSERT_TRUE(answer.lo[i] >= role->lo && answer.hi[i] <= role->hi);
        TEST_ASSERT_TRUE(answer.lo[i] <= answer.value[i] && answer.value[i] <= answer.hi[i]);
        TEST_ASSERT_TRUE(answer.se[i] >= 0.0 && answer.se[i] <= role->hi - role->lo);
    }
    TEST_ASSERT_TRUE(isfinite(answer.chi_square) && answer.chi_square >= 0.0);
    TEST_ASSERT_TRUE(answer.chi_square_p >= 0.0 && answer.chi_square_p <= 1.0);
    TEST_ASSERT_TRUE(isfinite(answer.rms));
    for (size_t i = 0; answer.has_second && i < SKIN_PARAMETERS; i++)
        TEST_ASSERT_TRUE(answer.second[i] >= fit->role[i].lo &&
                         answer.second[i] <= fit->role[i].hi);
}

static void test_always_inside_finite_and_the_same(void)
{
    struct dice dice = { 20261122 };
    static struct spectrum site[3];
    static struct refined first;
    size_t limited = 0;
    for (int turn = 0; turn < 400; turn++) {
        struct fit fit = any_fit(&dice);
        struct noise noise = { pow(10.0, dice_between(&dice, -6.0, -1.0)),
                               dice_below(&dice, 2) == 0 ? 0.0 : dice_between(&dice, 0.0, 0.1),
                               dice_between(&dice, 0.0, 2.0) };
        size_t replicates = 1 + dice_below(&dice, 3);
        for (size_t k = 0; k < replicates; k++) {
            site[k] = hostile(&dice);
            site[k].n = site[0].n;
            site[k].step_nm = site[0].step_nm;
        }
        const char *why = "";
        enum status s = run(&fit, &noise, site, replicates, &why);
        if (s == STATUS_RANGE && strstr(why, "fewer bands") != NULL)
            continue; /* replicates that lack different bands */
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, s, why);
        check_answer(&fit);
        limited += (answer.flags & REFINE_NOT_CONVERGED) != 0;
        memcpy(&first, &answer, sizeof first);
        memset(&answer, 0x55, sizeof answer);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, site, replicates, NULL));
        TEST_ASSERT_EQUAL_MEMORY(first.value, answer.value, sizeof first.value);
        TEST_ASSERT_EQUAL_MEMORY(first.lo, answer.lo, sizeof first.lo);
        TEST_ASSERT_EQUAL_MEMORY(first.hi, answer.hi, sizeof first.hi);
        TEST_ASSERT_EQUAL_HEX(first.flags, answer.flags);
    }
    printf("steps ran out in %zu of 400\n", limited);
    TEST_ASSERT_TRUE(limited < 40);
}

/* ---- what is said ---------------------------------------------------------------------- */

static bool says(const char *part)
{
    const char *sentence;
    for (size_t i = 0; (sentence = refine_words(&answer, i)) != NULL; i++)
        if (strstr(sentence, part) != NULL)
            return true;
    return false;
}

/* A skin of Cm, Bm, Ch by the model itself, with a little noise that is the same each time. */
static struct spectrum skin_of(double Cm, double Bm, double Ch, double noise)
{
    static struct chromophores c;
    double scratch[MEDIUM_SCRATCH(BANDS)];
    struct dice dice = { 4 };
    struct spectrum s = blank();
    struct tissue t = tissue_of(Cm, Bm, Ch);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(400, 10, BANDS, &c));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_reflectance(model_find("two-layer"), &t, &c, scratch, s.value));
    for (size_t i = 0; i < BANDS; i++) /* of this standard deviation: even over +-sqrt(3) of it */
        s.value[i] += noise * dice_between(&dice, -sqrt(3.0), sqrt(3.0));
    return s;
}

static void test_what_cannot_be_told_is_said(void)
{
    struct fit fit = three("two-layer");
    const struct noise noise = noise_white(0.003);
    struct spectrum s = skin_of(0.002, 0.5, 0.02, 0.003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_UNDETERMINED << SKIN_BM);
    TEST_ASSERT_FALSE(answer.flags & (unsigned)REFINE_UNDETERMINED << SKIN_CH);
    TEST_ASSERT_TRUE(says("Bm cannot be told at this melanin"));

    s = skin_of(0.45, 0.5, 0.005, 0.003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_UNDETERMINED << SKIN_CH);
    TEST_ASSERT_TRUE(says("Ch cannot be told in skin this dark"));

    const struct noise loud = noise_white(0.05);
    s = skin_of(0.05, 0.5, 0.02, 0.0); /* melanin enough, but for such a noise */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &loud, &s, 1, NULL));
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_UNDETERMINED << SKIN_BM);
    TEST_ASSERT_TRUE(says("Bm cannot be told from this spectrum"));
    TEST_ASSERT_FALSE(says("at this melanin"));

    s = skin_of(0.05, 0.5, 0.02, 0.003); /* an everyday skin: nothing to say */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    TEST_ASSERT_EQUAL_HEX(0, answer.flags);
    TEST_ASSERT_NULL(refine_words(&answer, 0));
}

static void test_bounds_and_residuals_are_said(void)
{
    struct fit fit = three("two-layer");
    const struct noise noise = noise_white(0.003), loud = noise_white(0.03),
                       quiet = noise_white(0.0003);
    struct spectrum s = skin_of(0.05, 0.5, 0.02, 0.003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &loud, &s, 1, NULL));
    TEST_ASSERT_TRUE(answer.flags & REFINE_RESIDUAL_TOO_SMALL);
    TEST_ASSERT_TRUE(says("intervals are too wide"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &quiet, &s, 1, NULL));
    TEST_ASSERT_TRUE(answer.flags & REFINE_RESIDUAL_TOO_LARGE);
    TEST_ASSERT_TRUE(says("intervals are too narrow"));
    TEST_ASSERT_TRUE(answer.chi_square_p < 1e-3);

    s = constant(0.9); /* lighter than skin can be */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, answer.value[SKIN_CM]);
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_AT_BOUND << SKIN_CM);
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_AT_BOUND << SKIN_CH);
    TEST_ASSERT_TRUE(says("Cm came to rest at the end of its range"));
    TEST_ASSERT_TRUE(says("Bm cannot be told"));
}

static void test_flags_have_names_of_their_own(void)
{
    TEST_ASSERT_EQUAL_STRING("Cm_at_bound", refine_flag_name(0));
    TEST_ASSERT_EQUAL_STRING("Bm_undetermined", refine_flag_name(8));
    TEST_ASSERT_EQUAL_STRING("SO2_by_prior", refine_flag_name(17));
    TEST_ASSERT_EQUAL_STRING("residual_too_large", refine_flag_name(21));
    TEST_ASSERT_EQUAL_STRING("not_converged", refine_flag_name(24));
    TEST_ASSERT_EQUAL_STRING("unknown", refine_flag_name(REFINE_FLAG_COUNT));
    TEST_ASSERT_EQUAL_STRING("unknown", skin_parameter_name(SKIN_PARAMETERS));
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) { /* bits and names go together */
        char name[64];
        snprintf(name, sizeof name, "%s_at_bound", skin_parameter_name(i));
        TEST_ASSERT_EQUAL_STRING(name, refine_flag_name(i));
        snprintf(name, sizeof name, "%s_undetermined", skin_parameter_name(i));
        TEST_ASSERT_EQUAL_STRING(name, refine_flag_name(i + 7));
        snprintf(name, sizeof name, "%s_by_prior", skin_parameter_name(i));
        TEST_ASSERT_EQUAL_STRING(name, refine_flag_name(i + 14));
    }
    /* Every flag has something to say, and for one flag there is one sentence. */
    for (size_t i = 0; i < REFINE_FLAG_COUNT; i++) {
        answer.flags = 1u << i;
        TEST_ASSERT_NOT_NULL(refine_words(&answer, 0));
        TEST_ASSERT_NULL(refine_words(&answer, 1));
    }
}

/* ---- priors, and parameters of each replicate's own ------------------------------------- */

/* A prior is one more measurement: of a parameter that the data see as a Gaussian of variance
 * v, the two together have 1/(1/v + 1/p) and their weighted mean. */
static void test_a_prior_counts_as_a_measurement(void)
{
    struct fit fit = three("two-layer");
    const struct noise noise = noise_white(0.0003);
    struct spectrum s = skin_of(0.05, 0.5, 0.02, 0.0003);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    double value = answer.value[SKIN_BM], v = answer.se[SKIN_BM] * answer.se[SKIN_BM];
    double p = 0.25 * v, mean = value + 2.0 * sqrt(v);
    fit.role[SKIN_BM].prior_mean = mean;
    fit.role[SKIN_BM].prior_sd = sqrt(p);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * sqrt(v), (value / v + mean / p) / (1.0 / v + 1.0 / p),
                              answer.value[SKIN_BM]);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * sqrt(v), sqrt(1.0 / (1.0 / v + 1.0 / p)), answer.se[SKIN_BM]);
    TEST_ASSERT_TRUE(answer.flags & (unsigned)REFINE_BY_PRIOR << SKIN_BM);
    TEST_ASSERT_FALSE(answer.flags & (unsigned)REFINE_BY_PRIOR << SKIN_CM);
    TEST_ASSERT_TRUE(says("Bm is what was assumed"));
    TEST_ASSERT_EQUAL_size_t(BANDS + 1 - 3, answer.degrees);
}

/* Three replicates whose blood differs: shared it does not fit; each its own, it does, and
 * the answer is the mean. */
static void test_each_replicate_its_own_blood(void)
{
    static struct spectrum three_shots[3];
    struct fit fit = three("two-layer");
    const struct noise noise = noise_white(0.001);
    three_shots[0] = skin_of(0.05, 0.5, 0.015, 0.0);
    three_shots[1] = skin_of(0.05, 0.5, 0.020, 0.0);
    three_shots[2] = skin_of(0.05, 0.5, 0.031, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, three_shots, 3, NULL));
    TEST_ASSERT_TRUE(answer.flags & REFINE_RESIDUAL_TOO_LARGE);
    fit.role[SKIN_CH].per_replicate = true;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, three_shots, 3, NULL));
    TEST_ASSERT_FALSE(answer.flags & REFINE_RESIDUAL_TOO_LARGE);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.022, answer.value[SKIN_CH]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.05, answer.value[SKIN_CM]);
    TEST_ASSERT_EQUAL_size_t(3 * BANDS - 5, answer.degrees);
    /* Its interval is about +-1.96 se of the mean: so far from bounds the two agree. */
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * answer.se[SKIN_CH],
                              answer.value[SKIN_CH] + 1.96 * answer.se[SKIN_CH],
                              answer.hi[SKIN_CH]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * answer.se[SKIN_CH],
                              answer.value[SKIN_CH] - 1.96 * answer.se[SKIN_CH],
                              answer.lo[SKIN_CH]);
    double se = answer.se[SKIN_CH];

    /* And a prior is about the mean, not about each of them. */
    fit.role[SKIN_CH].prior_mean = 0.022;
    fit.role[SKIN_CH].prior_sd = se;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, three_shots, 3, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * se, se / sqrt(2.0), answer.se[SKIN_CH]);
}

static void test_bands_that_were_not_measured(void)
{
    struct fit fit = three("two-layer");
    const struct noise noise = noise_white(0.003);
    TEST_ASSERT_TRUE(figures_read(exact[1], &table));
    for (size_t row = 0; row < 10; row++) {
        struct spectrum s = spectrum_of(&table, row);
        s.value[0] = s.value[15] = NAN; /* not measured */
        TEST_ASSERT_EQUAL_INT(STATUS_OK, run(&fit, &noise, &s, 1, NULL));
        for (size_t i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, figures_at(&table, row, i), answer.value[i]);
        TEST_ASSERT_TRUE(isnan(answer.residual[0]) && isnan(answer.residual[15]));
        TEST_ASSERT_TRUE(isnan(answer.dE00)); /* no colour without all bands */
        TEST_ASSERT_EQUAL_size_t(BANDS - 2 - 3, answer.degrees);
    }
}

/* Scattering left free as well leaves some skins in doubt between two.  What is told as second
 * is a minimum of its own: a fit from there stays there, and it is the worse one. */
static void test_a_second_solution_is_one(void)
{
    const struct noise noise = noise_white(0.003);
    struct fit fit = three("half-space");
    size_t seconds = 0;
    fit.own_scattering = true;
    fit.role[SKIN_SCATTERING_A] = (struct skin_role){
        .free = true, .value = 5.0, .lo = 0.5, .hi = 100.0, .prior_sd = INFINITY
    };
    fit.role[SKIN_SCATTERING_B] = (struct skin_role){
        .free = true, .value = 1.0, .lo = -1.0, .hi = 5.0, .prior_sd = INFINITY
    };
    TEST_ASSERT_TRUE(figures_read(noisy[0], &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, 400, 10, BANDS, &refiner, NULL));
    for (size_t row = 0; row < table.rows; row++) {
        static struct refined other;
        struct spectrum s = spectrum_of(&table, row);
        TEST_ASSERT_EQUAL_INT(
            STATUS_OK, refiner_run(refiner, &noise, &s, 1, NULL, 0, REFINE_SECOND, &answer, NULL));
        TEST_ASSERT_EQUAL_INT(answer.has_second, (answer.flags & REFINE_SECOND_SOLUTION) != 0);
        if (!answer.has_second)
            continue;
        seconds++;
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1,
                                          (const double(*)[SKIN_PARAMETERS])answer.second, 1, 0,
                                          &other, NULL));
        TEST_ASSERT_TRUE(answer.second_chi_square >= answer.chi_square);
        TEST_ASSERT_TRUE(answer.second_chi_square - answer.chi_square < 10.83);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, answer.second_chi_square, other.chi_square);
        for (size_t i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(0.05 * other.se[i], answer.second[i], other.value[i]);
    }
    printf("%zu of %zu have a second solution\n", seconds, table.rows);
    TEST_ASSERT_TRUE(seconds > 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_spectra_without_noise_give_the_skin_back);
    RUN_TEST(test_the_start_does_not_matter);
    RUN_TEST(test_residuals_are_those_of_the_answer);
    RUN_TEST(test_interval_ends_are_where_chi_square_has_risen);
    RUN_TEST(test_replicates_count_as_their_mean);
    RUN_TEST(test_fits_that_make_no_sense_are_refused);
    RUN_TEST(test_data_that_cannot_be_fitted_are_refused);
    RUN_TEST(test_always_inside_finite_and_the_same);
    RUN_TEST(test_what_cannot_be_told_is_said);
    RUN_TEST(test_bounds_and_residuals_are_said);
    RUN_TEST(test_flags_have_names_of_their_own);
    RUN_TEST(test_a_prior_counts_as_a_measurement);
    RUN_TEST(test_each_replicate_its_own_blood);
    RUN_TEST(test_bands_that_were_not_measured);
    RUN_TEST(test_a_second_solution_is_one);
    return UNITY_END();
}
