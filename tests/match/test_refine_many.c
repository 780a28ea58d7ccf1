/* Many spectra at once: the answers of one at a time, the same bits however they are handed over.
 */
#include "match/refine_many.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "match/least_squares.h"
#include "match/refine_lanes.h"
#include "optics/model.h"
#include "optics/opaque.h"
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

/* Skins of the fit, and what a model makes of them. */
static void make_spectra(const struct fit *fit, const struct model *by, size_t n, double white,
                         uint64_t seed)
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
        TEST_ASSERT_EQUAL_INT(STATUS_OK, model_reflectance(by, &t, &chromophores, scratch, R[k]));
        for (size_t i = 0; i < BANDS; i++) {
            R[k][i] += white * normal(&dice);
            R_float[k][i] = (float)R[k][i];
        }
    }
}

static void make_skins(const struct fit *fit, size_t n, double white, uint64_t seed)
{
    make_spectra(fit, fit->model, n, white, seed);
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

/* Bands apart, rows together. */
static double by_band[BANDS][SKINS];
static float by_band_float[BANDS][SKINS];

static void turn(size_t n)
{
    for (size_t k = 0; k < n; k++) {
        for (size_t i = 0; i < BANDS; i++) {
            by_band[i][k] = R[k][i];
            by_band_float[i][k] = R_float[k][i];
        }
    }
}

static struct refine_rows rows_of_float(size_t n)
{
    return (struct refine_rows){ .R_float = R_float[0], .stride = BANDS + 5, .n = n };
}

/* ---- as one at a time ----------------------------------------------------------------------- */

/* The minimum itself, by the plain formulas and many more steps than any answer takes. */
struct place {
    const struct fit *fit;
    const double *R;
    double white;
};

static void evaluate(void *context, const double *x, struct normal *ret)
{
    static double scratch[MODEL_SLOPES_SCRATCH(BANDS)], fitted[BANDS];
    static double J[TISSUE_PARAMETERS][BANDS];
    const struct place *p = context;
    double value[SKIN_PARAMETERS], weight = 1.0 / (p->white * p->white);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = i < FREE ? x[i] : p->fit->role[i].value;
    struct tissue t = fit_tissue(p->fit, value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          model_slopes(p->fit->model, &t, &chromophores, scratch, fitted, J[0]));
    memset(ret, 0, sizeof *ret);
    for (size_t k = 0; k < BANDS; k++) {
        double r = fitted[k] - p->R[k];
        ret->chi_square += weight * r * r;
        for (size_t i = 0; i < FREE; i++) {
            ret->gradient[i] += weight * J[i][k] * r;
            for (size_t j = 0; j <= i; j++)
                ret->curvature[i * (i + 1) / 2 + j] += weight * J[i][k] * J[j][k];
        }
    }
}

/* From x down; chi^2 there. */
static double polish(const struct fit *fit, const double *spectrum, double white, double *x)
{
    double lo[FREE], hi[FREE];
    struct place place = { fit, spectrum, white };
    struct normal at;
    struct least_squares_run run;
    for (size_t i = 0; i < FREE; i++) {
        lo[i] = fit->role[i].lo;
        hi[i] = fit->role[i].hi;
    }
    struct least_squares problem = { .n = FREE,
                                     .lo = lo,
                                     .hi = hi,
                                     .evaluate = evaluate,
                                     .context = &place,
                                     .tolerance = 1e-13,
                                     .steps = 60 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&problem, x, &at, &run));
    return at.chi_square;
}

/* At most so many of n: answers further from the minimum than 1e-3 standard errors; where
 * refiner_run() found a lower one; flags other than its, at the same minimum. */
static const struct compared {
    const char *model, *by;  /* the fit's, and that of the spectra */
    double made_with, white; /* the noise drawn, and that stated */
    size_t n, far, higher;
} compared[] = {
    { "half-space", "half-space", NOISE, NOISE, SKINS, 0, 0 },
    { "two-layer", "two-layer", NOISE, NOISE, SKINS, SKINS / 400, SKINS / 1000 },
    /* Nothing explains these: large residuals, slow steps. */
    { "half-space", "half-space", 0.03, NOISE, 4000, 20, 4 },
    { "two-layer", "two-layer", 0.03, NOISE, 4000, 40, 8 },
    /* Skin as it is lies beyond the bounds of simple models: on faces, edges and corners. */
    { "half-space", "two-layer", NOISE, NOISE, SKINS, SKINS / 400, SKINS / 1000 },
    { "half-space", "transport-8", NOISE, NOISE, 4000, 20, 4 },
    { "two-layer", "half-space", NOISE, NOISE, SKINS, SKINS / 200, SKINS / 50 },
    { "two-layer", "transport-8", NOISE, NOISE, 4000, 20, 4 },
    /* A noise much too large, and hardly any. */
    { "half-space", "half-space", NOISE, 0.02, 4000, 8, 4 },
    { "two-layer", "two-layer", 1e-6, 1e-6, 4000, 40, 8 },
    { "kubelka-munk", "kubelka-munk", NOISE, NOISE, 60, 60, 0 }, /* one by one */
};

/* What a value or an end of its interval on an edge by a hair says is left to chance. */
static uint32_t told_apart(const struct fit *fit, const struct answer *a, const struct refined *b)
{
    uint32_t apart = a->flags ^ b->flags;
    if ((a->flags & REFINE_NOT_CONVERGED) == 0) /* lanes come to rest where one by one steps tire */
        apart &= ~(uint32_t)REFINE_NOT_CONVERGED;
    for (size_t i = 0; i < FREE; i++) {
        double lo = fit->role[i].lo, hi = fit->role[i].hi, root = i == SKIN_BM ? 1.0 : 0.5;
        double room = fmin(fmin(a->value[i] - lo, hi - a->value[i]),
                           fmin(b->value[i] - lo, hi - b->value[i]));
        double width =
            (pow(b->hi[i], root) - pow(b->lo[i], root)) / (pow(hi, root) - pow(lo, root));
        if (room < 1e-2 * b->se[i])
            apart &= ~((uint32_t)REFINE_AT_BOUND << i);
        if (fabs(width - 0.5) < 0.02)
            apart &= ~((uint32_t)REFINE_UNDETERMINED << i);
    }
    return apart;
}

static void hold_against_one(const struct compared *c)
{
    static struct answer got[SKINS];
    static struct refined one;
    struct fit fit = three(c->model);
    struct noise noise = noise_white(c->white);
    struct refiner *refiner;
    char what[200];
    size_t flags = 0, higher = 0, far = 0, chi = 0, wide = 0, on_bounds = 0;
    make_spectra(&fit, model_find(c->by), c->n, c->made_with, 3);
    struct refine_rows rows = rows_of(c->n);
    struct refine_many *many = open(&fit, &noise);
    run(many, &rows, 1, got);
    refine_many_close(many);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, FIRST_NM, STEP_NM, BANDS, &refiner, NULL));
    struct spectrum s = {
        .first_nm = FIRST_NM, .step_nm = STEP_NM, .n = BANDS, .specular = SPECULAR_SCE
    };
    for (size_t k = 0; k < c->n; k++) {
        double x[FREE], moved = 0.0, apart = 0.0;
        memcpy(s.value, R[k], sizeof R[k]);
        memcpy(x, got[k].value, sizeof x);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &one, NULL));
        double lowest = polish(&fit, R[k], c->white, x);
        for (size_t i = 0; i < FREE; i++) {
            moved = fmax(moved, fabs(got[k].value[i] - x[i]) / got[k].se[i]);
            apart = fmax(apart, fabs(got[k].value[i] - one.value[i]) / one.se[i]);
        }
        far += moved > 1e-3 ? 1u : 0u;
        on_bounds += (got[k].flags & (7u * REFINE_AT_BOUND)) != 0 ? 1u : 0u;
        higher += got[k].chi_square > one.chi_square + 1e-3 * (1.0 + one.chi_square) ? 1u : 0u;
        chi += moved <= 1e-3 && fabs(got[k].chi_square - lowest) > 1e-5 + 1e-6 * lowest ? 1u : 0u;
        if (apart > 0.03) /* another minimum, or one of the two not quite there */
            continue;
        flags += told_apart(&fit, &got[k], &one) != 0 ? 1u : 0u;
        if (apart < 1e-3)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-3 * one.rms + 1e-12, one.rms, got[k].rms,
                                              c->model);
        for (size_t i = 0; i < FREE; i++)
            wide += fabs(got[k].se[i] / one.se[i] - 1.0) > 0.05 ? 1u : 0u;
    }
    refiner_close(refiner);
    snprintf(what, sizeof what,
             "%s by %s, %g stated %g: far %zu, higher %zu, chi^2 %zu, flags %zu, se %zu, on bounds "
             "%zu",
             c->by, c->model, c->made_with, c->white, far, higher, chi, flags, wide, on_bounds);
    if (getenv("VERBOSE") != NULL)
        puts(what);
    TEST_ASSERT_TRUE_MESSAGE(far <= c->far && higher <= c->higher, what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, chi + flags, what);
    TEST_ASSERT_TRUE_MESSAGE(wide <= c->n / 100, what);
}

static void test_answers_are_those_of_one_at_a_time(void)
{
    for (size_t i = 0; i < sizeof compared / sizeof *compared; i++)
        hold_against_one(&compared[i]);
}

/* With placement: refiner_run()'s own answers, which has been whitened band by band. */
static void test_placement_is_weighed_as_one_at_a_time(void)
{
    static struct answer got[SKINS];
    static struct refined one;
    static const char *const model[] = { "half-space", "two-layer" };
    for (size_t m = 0; m < 2; m++) {
        enum { N = 2000 };
        struct fit fit = three(model[m]);
        struct noise noise = noise_default();
        struct refiner *refiner;
        size_t far = 0, apart = 0;
        make_skins(&fit, N, NOISE, 13);
        struct refine_rows rows = rows_of(N);
        struct refine_many *many = open(&fit, &noise);
        run(many, &rows, 1, got);
        refine_many_close(many);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_open(&fit, FIRST_NM, STEP_NM, BANDS, &refiner, NULL));
        struct spectrum s = {
            .first_nm = FIRST_NM, .step_nm = STEP_NM, .n = BANDS, .specular = SPECULAR_SCE
        };
        for (size_t k = 0; k < N; k++) {
            memcpy(s.value, R[k], sizeof R[k]);
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &one, NULL));
            double off = fabs(got[k].chi_square - one.chi_square);
            far += off > 1e-4 * (1.0 + one.chi_square) ? 1u : 0u;
            /* Without melanin there is nothing to blend. */
            for (size_t i = 0; i < FREE; i++)
                if (i != SKIN_BM || one.value[SKIN_CM] > 3.0 * one.se[SKIN_CM])
                    apart += fabs(got[k].value[i] - one.value[i]) > 0.01 * one.se[i] ? 1u : 0u;
        }
        refiner_close(refiner);
        TEST_ASSERT_TRUE_MESSAGE(far <= N / 100 && apart <= N / 50, model[m]);
        if (getenv("VERBOSE") != NULL)
            printf("%s: placed, far %zu, apart %zu\n", model[m], far, apart);
    }
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

/* Fits of skins of their own, and of such as no skin of the model explains. */
static const struct bits_case {
    const char *model, *by;
} bits_cases[] = { { "half-space", "half-space" },
                   { "two-layer", "two-layer" },
                   { "half-space", "two-layer" },
                   { "two-layer", "half-space" } };
enum { BITS_CASES = sizeof bits_cases / sizeof *bits_cases };

static void assert_same(const struct answer *a, const struct answer *b, const char *what)
{
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(a, b, sizeof *a, what);
}

static void test_the_same_bits_however_rows_are_handed_over(void)
{
    static struct answer all[SKINS], again[SKINS];
    for (size_t m = 0; m < BITS_CASES; m++) {
        enum { N = 3001 };
        struct fit fit = three(bits_cases[m].model);
        struct noise noise = noise_white(NOISE);
        struct refine_many *many = open(&fit, &noise);
        make_spectra(&fit, model_find(bits_cases[m].by), N, NOISE, 5);
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
        turn(N);
        struct refine_rows bands = { .R = by_band[0], .stride = 1, .band_stride = SKINS, .n = N };
        run(many, &bands, 2, again);
        for (size_t k = 0; k < N; k++)
            assert_same(&all[k], &again[k], "by band");
        bands.R = NULL;
        bands.R_float = by_band_float[0] + 5; /* and not aligned */
        bands.n = N - 5;
        run(many, &bands, 1, again);
        for (size_t k = 0; k < bands.n; k++)
            assert_same(&all[k + 5], &again[k], "by band, float");
        refine_many_close(many);
    }
}

static void test_the_same_bits_by_all_fused_vectors_and_nearly_those_without(void)
{
    static struct refine_lanes lanes;
    static struct lanes_answer got[QUICK_VECTORS];
    static double laid_out[BANDS * LANES_MOST];
    for (size_t m = 0; m < BITS_CASES; m++) {
        struct fit fit = three(bits_cases[m].model);
        struct noise noise = noise_white(NOISE);
        double nm[BANDS];
        for (size_t i = 0; i < BANDS; i++)
            nm[i] = FIRST_NM + STEP_NM * (double)i;
        make_spectra(&fit, model_find(bits_cases[m].by), LANES_MOST, NOISE, 31);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refine_lanes_init(&fit, &noise, &chromophores, nm, &lanes));
        for (int v = 0; v < QUICK_VECTORS; v++) {
            if (!quick_has((enum quick_vectors)v))
                continue;
            for (size_t k = 0; k < LANES_MOST; k++)
                for (size_t i = 0; i < BANDS; i++)
                    laid_out[(k / LANES * BANDS + i) * LANES + k % LANES] = R[k][i];
            memset(&got[v], 0, sizeof got[v]);
            refine_lanes_run_by((enum quick_vectors)v, &lanes, laid_out, LANES_MOST, &got[v]);
        }
        if (quick_has(QUICK_AVX512))
            TEST_ASSERT_EQUAL_MEMORY(&got[QUICK_AVX2], &got[QUICK_AVX512], sizeof got[0]);
        size_t others = 0;
        for (size_t k = 0; quick_has(QUICK_AVX2) && k < LANES_MOST; k++) {
            const struct lanes_answer *a = &got[QUICK_PLAIN], *b = &got[QUICK_AVX2];
            others += a->state[k] != b->state[k] ? 1u : 0u;
            for (size_t i = 0; a->state[k] == LANES_FITTED && i < FREE; i++)
                others += fabs(a->value[i][k] - b->value[i][k]) > 1e-3 * b->se[i][k] ? 1u : 0u;
        }
        TEST_ASSERT_TRUE_MESSAGE(others <= LANES_MOST / 100, bits_cases[m].model);
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

/* Quick formulas that lanes do not have. */
static void test_a_fit_by_another_model_goes_one_by_one(void)
{
    static struct answer got[SKINS];
    static struct refined one;
    enum { N = 40 };
    struct fit fit = three("two-layer");
    struct noise noise = noise_white(NOISE);
    struct refiner *refiner;
    make_skins(&fit, N, NOISE, 17);
    fit.model = &opaque_model;
    struct refine_rows rows = rows_of(N);
    struct refine_many *many = open(&fit, &noise);
    run(many, &rows, 1, got);
    refine_many_close(many);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refiner_open(&fit, FIRST_NM, STEP_NM, BANDS, &refiner, NULL));
    struct spectrum s = {
        .first_nm = FIRST_NM, .step_nm = STEP_NM, .n = BANDS, .specular = SPECULAR_SCE
    };
    for (size_t k = 0; k < N; k++) {
        memcpy(s.value, R[k], sizeof R[k]);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              refiner_run(refiner, &noise, &s, 1, NULL, 0, 0, &one, NULL));
        TEST_ASSERT_EQUAL_HEX32(one.flags, got[k].flags);
        for (size_t i = 0; i < FREE; i++)
            TEST_ASSERT_EQUAL_MEMORY(&one.value[i], &got[k].value[i], sizeof one.value[i]);
    }
    refiner_close(refiner);
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
    rows.stride = 1;
    rows.band_stride = 1; /* two rows are in the way of each other */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_many_run(many, &rows, 1, &nothing));
    rows.stride = 2;
    rows.band_stride = 4;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, refine_many_run(many, &rows, 1, &nothing));
    rows.stride = BANDS;
    rows.band_stride = 0;
    rows.n = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, refine_many_run(many, &rows, 1, &nothing));
    refine_many_close(many);
    refine_many_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_answers_are_those_of_one_at_a_time);
    RUN_TEST(test_placement_is_weighed_as_one_at_a_time);
    RUN_TEST(test_the_skin_a_spectrum_was_made_of_is_found);
    RUN_TEST(test_the_same_bits_however_rows_are_handed_over);
    RUN_TEST(test_the_same_bits_by_all_fused_vectors_and_nearly_those_without);
    RUN_TEST(test_what_cannot_be_fitted_is_flagged_and_its_neighbours_are_not);
    RUN_TEST(test_a_fit_by_another_model_goes_one_by_one);
    RUN_TEST(test_spectra_that_are_no_skin_have_answers_inside_the_bounds);
    RUN_TEST(test_bad_arguments_are_refused);
    return UNITY_END();
}
