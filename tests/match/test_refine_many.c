/* Many spectra at once: the answers of one at a time, the same bits however they are handed over.
 */
#include "match/refine_many.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/skin_fit.h"
#include "optics/model.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, SKINS = 20000, FREE = 3 };
#define NOISE 0.003
#define FIRST_NM 400.0
#define STEP_NM 10.0

static struct chromophores chromophores;
static double R[SKINS][BANDS];
static float R_float[SKINS][BANDS + 5]; /* rows further apart than they are long */
static double truth[SKINS][FREE];

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(FIRST_NM, STEP_NM, BANDS, &chromophores));
}

void tearDown(void)
{
}

/* ---- skins ------------------------------------------------------------------------------- */

/* Some 12 % of each end: answers come to rest on bounds. */
static double up_to_the_ends(struct dice *dice, double lo, double hi, bool decades)
{
    double x = dice_between(dice, -0.12, 1.12);
    if (x <= 0.0)
        return lo;
    if (x >= 1.0)
        return hi;
    double least = lo > 0.0 ? lo : 1e-3 * hi;
    return decades ? least * pow(hi / least, x) : lo + x * (hi - lo);
}

/* Sum of 12 even ones: normal enough. */
static double normal(struct dice *dice)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++)
        sum += dice_between(dice, 0.0, 1.0);
    return sum;
}

static void make_skins(const struct fit *fit, size_t n, double white, uint64_t seed)
{
    static double scratch[MEDIUM_SCRATCH(BANDS)];
    struct dice dice = { seed };
    for (size_t k = 0; k < n; k++) {
        double value[SKIN_PARAMETERS];
        for (size_t i = 0; i < SKIN_PARAMETERS; i++)
            value[i] = fit->role[i].value;
        for (size_t i = 0; i < FREE; i++)
            truth[k][i] = value[i] =
                up_to_the_ends(&dice, fit->role[i].lo, fit->role[i].hi, i != SKIN_BM);
        struct tissue t = fit_tissue(fit, value);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              model_reflectance(fit->model, &t, &chromophores, scratch, R[k]));
        for (size_t i = 0; i < BANDS; i++) {
            R[k][i] += white * normal(&dice);
            R_float[k][i] = (float)R[k][i];
        }
    }
}

static struct fit three(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    return fit_three(&recipe);
}

/* ---- runs --------------------------------------------------------------------------------- */

struct answer {
    double value[FREE], se[FREE], chi_square, rms;
    uint32_t flags;
};

static struct refine_many *open(const struct fit *fit, const struct noise *noise)
{
    struct refine_many *many = NULL;
    const char *why = "";
    enum status s = refine_many_open(fit, FIRST_NM, STEP_NM, BANDS, noise, &many, &why);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, s, why);
    return many;
}

static void run(const struct refine_many *many, const struct refine_rows *rows, unsigned threads,
                struct answer *ret)
{
    static double value[FREE][SKINS], se[FREE][SKINS], chi_square[SKINS], rms[SKINS];
    static uint32_t flags[SKINS];
    struct refine_answers answers = { .chi_square = chi_square, .rms = rms, .flags = flags };
    for (size_t i = 0; i < FREE; i++) {
        answers.value[i] = value[i];
        answers.se[i] = se[i];
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_many_run(many, rows, threads, &answers));
    for (size_t k = 0; k < rows->n; k++) {
        memset(&ret[k], 0, sizeof ret[k]);
        for (size_t i = 0; i < FREE; i++) {
            ret[k].value[i] = value[i][k];
            ret[k].se[i] = se[i][k];
        }
        ret[k].chi_square = chi_square[k];
        ret[k].rms = rms[k];
        ret[k].flags = flags[k];
    }
}

static struct refine_rows rows_of(size_t n)
{
    return (struct refine_rows){ .R = R[0], .stride = BANDS, .n = n };
}

static struct refine_rows rows_of_float(size_t n)
{
    return (struct refine_rows){ .R_float = R_float[0], .stride = BANDS + 5, .n = n };
}

/* ---- as one at a time ----------------------------------------------------------------------- */

static const struct compared {
    const char *model;
    double made_with, white, placement; /* the noise drawn, and that stated */
    size_t n;
    double moved; /* standard errors, at most */
} compared[] = {
    { "half-space", NOISE, NOISE, 0.0, SKINS, 1e-3 },
    { "two-layer", NOISE, NOISE, 0.0, SKINS, 1e-3 },
    /* Nothing explains these: large residuals, slow steps. */
    { "half-space", 0.03, NOISE, 0.0, 4000, 1e-3 },
    { "two-layer", 0.03, NOISE, 0.0, 4000, 1e-3 },
    /* A noise much too large, and hardly any. */
    { "half-space", NOISE, 0.02, 0.0, 4000, 1e-3 },
    { "two-layer", 1e-6, 1e-6, 0.0, 4000, 1e-3 },
    { "half-space", NOISE, NOISE, 0.009, 4000, 1e-3 },
    { "two-layer", NOISE, NOISE, 0.009, 4000, 1e-3 },
    { "kubelka-munk", NOISE, NOISE, 0.0, 60, 1e-3 },
};

/* An answer on a bound by a hair is on it by one way and beside it by the other. */
static uint32_t told_apart(const struct fit *fit, const struct answer *a, const struct refined *b)
{
    uint32_t apart = a->flags ^ b->flags;
    for (size_t i = 0; i < FREE; i++) {
        double lo = fit->role[i].lo, hi = fit->role[i].hi;
        double room = fmin(fmin(a->value[i] - lo, hi - a->value[i]),
                           fmin(b->value[i] - lo, hi - b->value[i]));
        if (room < 1e-3 * b->se[i])
            apart &= ~((uint32_t)REFINE_AT_BOUND << i);
    }
    return apart;
}

static void hold_against_one(const struct compared *c)
{
    static struct answer got[SKINS];
    static struct refined one;
    struct fit fit = three(c->model);
    struct noise noise = { c->white, c->placement, 0.47 };
    struct refiner *refiner;
    char what[200];
    size_t flags = 0, higher = 0, far = 0;
    double worst = 0.0, worst_chi = 0.0;
    make_skins(&fit, c->n, c->made_with, 3);
    struct refine_rows rows = rows_of(c->n);
    struct refine_many *many = open(&fit, &noise);
    run(many, &rows, 1, got);
    refine_many_close(many);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, FIRST_NM, STEP_NM, BANDS, &refiner, NULL));
    struct spectrum s = {
        .first_nm = FIRST_NM, .step_nm = STEP_NM, .n = BANDS, .specular = SPECULAR_SCE
    };
    for (size_t k = 0; k < c->n; k++) {
        memcpy(s.value, R[k], sizeof R[k]);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &one, NULL));
        double rise = (got[k].chi_square - one.chi_square) / (one.chi_square + 1e-3);
        worst_chi = fmax(worst_chi, rise);
        higher += rise > 1e-6 ? 1u : 0u;
        flags += told_apart(&fit, &got[k], &one) != 0 ? 1u : 0u;
        double moved = 0.0;
        for (size_t i = 0; i < FREE; i++)
            moved = fmax(moved, fabs(got[k].value[i] - one.value[i]) / one.se[i]);
        /* A lower minimum is another skin. */
        if (got[k].chi_square < one.chi_square - 1e-3 * (1.0 + one.chi_square))
            continue;
        worst = fmax(worst, moved);
        far += moved > c->moved ? 1u : 0u;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5 * one.rms + 1e-12, one.rms, got[k].rms, c->model);
        for (size_t i = 0; i < FREE; i++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-3 * one.se[i], one.se[i], got[k].se[i], c->model);
    }
    refiner_close(refiner);
    snprintf(what, sizeof what,
             "%s, %g stated %g: %zu far (most %.1e se), %zu higher (most %.1e), %zu other flags",
             c->model, c->made_with, c->white, far, worst, higher, worst_chi, flags);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, far + higher + flags, what);
    if (getenv("VERBOSE") != NULL)
        TEST_MESSAGE(what);
}

static void test_answers_are_those_of_one_at_a_time(void)
{
    for (size_t i = 0; i < sizeof compared / sizeof *compared; i++)
        hold_against_one(&compared[i]);
}

/* The truth, which no fit was asked for: spectra without noise. */
static void test_the_skin_a_spectrum_was_made_of_is_found(void)
{
    static struct answer got[SKINS];
    static const char *const model[] = { "half-space", "two-layer" };
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(model[m]);
        struct noise noise = noise_white(1e-5);
        enum { N = 2000 };
        make_skins(&fit, N, 0.0, 7);
        struct refine_rows rows = rows_of(N);
        struct refine_many *many = open(&fit, &noise);
        run(many, &rows, 1, got);
        refine_many_close(many);
        for (size_t k = 0; k < N; k++) {
            TEST_ASSERT_EQUAL_HEX32(0, got[k].flags & (REFINE_MANY_REFUSED | REFINE_NOT_CONVERGED |
                                                       REFINE_RESIDUAL_TOO_LARGE));
            for (size_t i = 0; i < FREE; i++)
                if (truth[k][SKIN_CM] > 0.0 || i != SKIN_BM) /* no melanin, nothing to blend */
                    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-3 * got[k].se[i] + 1e-12, truth[k][i],
                                                      got[k].value[i], model[m]);
        }
    }
}

/* ---- the same bits --------------------------------------------------------------------------- */

static void assert_same(const struct answer *a, const struct answer *b, const char *what)
{
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(a, b, sizeof *a, what);
}

static void test_the_same_bits_however_rows_are_handed_over(void)
{
    static struct answer all[SKINS], again[SKINS];
    static const char *const model[] = { "half-space", "two-layer" };
    for (size_t m = 0; m < 2; m++) {
        enum { N = 3001 };
        struct fit fit = three(model[m]);
        struct noise noise = noise_white(NOISE);
        struct refine_many *many = open(&fit, &noise);
        make_skins(&fit, N, NOISE, 5);
        struct refine_rows rows = rows_of(N), one = rows_of(1);
        run(many, &rows, 1, all);
        run(many, &rows, 3, again);
        for (size_t k = 0; k < N; k++)
            assert_same(&all[k], &again[k], "threads");
        for (size_t k = 0; k < N; k += 7) {
            one.R = R[k];
            run(many, &one, 1, again);
            assert_same(&all[k], again, "one alone");
        }
        rows.n = 777;
        rows.R = R[1234];
        run(many, &rows, 1, again);
        for (size_t k = 0; k < rows.n; k++)
            assert_same(&all[1234 + k], &again[k], "a part");
        /* Float rows are the doubles that they hold. */
        for (size_t k = 0; k < N; k++)
            for (size_t i = 0; i < BANDS; i++)
                R[k][i] = (double)R_float[k][i];
        rows = rows_of(N);
        run(many, &rows, 1, all);
        rows = rows_of_float(N);
        run(many, &rows, 1, again);
        for (size_t k = 0; k < N; k++)
            assert_same(&all[k], &again[k], "float");
        refine_many_close(many);
    }
}

/* ---- what cannot be fitted --------------------------------------------------------------------
 */

static void test_what_cannot_be_fitted_is_flagged_and_its_neighbours_are_not(void)
{
    static struct answer good[SKINS], got[SKINS];
    static const double bad[] = { NAN, INFINITY, -INFINITY, 10.5, -11.0, 1e300 };
    enum { N = 200, KINDS = sizeof bad / sizeof *bad };
    static const char *const model[] = { "half-space", "two-layer" };
    for (size_t m = 0; m < 2; m++) {
        struct fit fit = three(model[m]);
        struct noise noise = noise_white(NOISE);
        struct refine_many *many = open(&fit, &noise);
        struct refine_rows rows = rows_of(N);
        make_skins(&fit, N, NOISE, 9);
        run(many, &rows, 1, good);
        for (size_t k = 0; k < N; k += 3)
            R[k][k % BANDS] = bad[k / 3 % KINDS];
        run(many, &rows, 1, got);
        for (size_t k = 0; k < N; k++) {
            if (k % 3 != 0) {
                assert_same(&good[k], &got[k], "beside one that is refused");
                continue;
            }
            TEST_ASSERT_EQUAL_HEX32(REFINE_MANY_REFUSED, got[k].flags);
            TEST_ASSERT_TRUE(isnan(got[k].value[SKIN_CM]) && isnan(got[k].se[SKIN_CH]));
            TEST_ASSERT_TRUE(isnan(got[k].chi_square) && isnan(got[k].rms));
        }
        refine_many_close(many);
    }
}

/* Odd but allowed: answers are numbers inside the bounds. */
static void test_spectra_that_are_no_skin_have_answers_inside_the_bounds(void)
{
    static struct answer got[SKINS];
    static const char *const model[] = { "half-space", "two-layer" };
    for (size_t m = 0; m < 2; m++) {
        enum { N = 500 };
        struct dice dice = { 21 };
        struct fit fit = three(model[m]);
        struct noise noise = noise_white(NOISE);
        struct refine_many *many = open(&fit, &noise);
        struct refine_rows rows = rows_of(N);
        for (size_t k = 0; k < N; k++)
            for (size_t i = 0; i < BANDS; i++)
                R[k][i] = k % 5 == 0   ? 0.0
                          : k % 5 == 1 ? 1.0
                          : k % 5 == 2 ? dice_between(&dice, -10.0, 10.0)
                          : k % 5 == 3 ? dice_between(&dice, 0.0, 1.0)
                                       : -0.01;
        run(many, &rows, 1, got);
        for (size_t k = 0; k < N; k++) {
            TEST_ASSERT_EQUAL_HEX32(0, got[k].flags & REFINE_MANY_REFUSED);
            TEST_ASSERT_TRUE(isfinite(got[k].chi_square) && isfinite(got[k].rms));
            for (size_t i = 0; i < FREE; i++)
                TEST_ASSERT_TRUE(got[k].value[i] >= fit.role[i].lo &&
                                 got[k].value[i] <= fit.role[i].hi && isfinite(got[k].se[i]));
        }
        refine_many_close(many);
    }
}

static void test_bad_arguments_are_refused(void)
{
    struct fit fit = three("two-layer");
    struct noise noise = noise_white(NOISE), none = noise_white(0.0);
    struct refine_many *many = NULL;
    const char *why = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          refine_many_open(&fit, FIRST_NM, STEP_NM, BANDS, &none, &many, &why));
    TEST_ASSERT_NOT_NULL(why);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          refine_many_open(&fit, 100.0, STEP_NM, BANDS, &noise, &many, &why));
    many = open(&fit, &noise);
    struct refine_answers nothing = { .chi_square = NULL };
    struct refine_rows rows = rows_of(2);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_many_run(many, &rows, 1, &nothing));
    rows.R_float = R_float[0];
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_many_run(many, &rows, 1, &nothing));
    rows.R = NULL;
    rows.stride = BANDS - 1;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_many_run(many, &rows, 1, &nothing));
    rows.stride = BANDS;
    rows.n = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_many_run(many, &rows, 1, &nothing));
    refine_many_close(many);
    refine_many_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_answers_are_those_of_one_at_a_time);
    RUN_TEST(test_the_skin_a_spectrum_was_made_of_is_found);
    RUN_TEST(test_the_same_bits_however_rows_are_handed_over);
    RUN_TEST(test_what_cannot_be_fitted_is_flagged_and_its_neighbours_are_not);
    RUN_TEST(test_spectra_that_are_no_skin_have_answers_inside_the_bounds);
    RUN_TEST(test_bad_arguments_are_refused);
    return UNITY_END();
}
