/* test_transport.c - the N-stream equations against 220-digit solutions of them, and what must
 * hold for every skin. */
#include "optics/transport.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "optics/dipole.h"
#include "tests/support/figures.h"
#include "tests/support/legal_skin.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* In the order of transport_exact.csv. */
enum { BY_SIGMA_A1, BY_SIGMA_S1, BY_SIGMA_A2, BY_SIGMA_S2, BY_D, SLOPES };

static enum status solve(int streams, struct skin s, double *R, double by[SLOPES])
{
    struct medium m = { 1, s.d_mm, s.eta, &s.sigma_a1, &s.sigma_a2, &s.sigma_s1, &s.sigma_s2 };
    struct slopes dR = { .sigma_a_epidermis = &by[BY_SIGMA_A1],
                         .sigma_a_dermis = &by[BY_SIGMA_A2],
                         .sigma_s_prime_epidermis = &by[BY_SIGMA_S1],
                         .sigma_s_prime_dermis = &by[BY_SIGMA_S2],
                         .epidermis_mm = &by[BY_D] };
    return transport_slopes(streams, &m, R, &dR);
}

static double good_reflectance(int streams, struct skin s, const char *what)
{
    double R = NAN, by[SLOPES];
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, solve(streams, s, &R, by), what);
    return R;
}

static void assert_relative(double tol, double expect, double got, const char *what)
{
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol * fabs(expect), expect, got, what);
}

/* ---- exact solutions of the same equations ----------------------------------------- */

/* A slope.  By a coefficient two effects may balance: 1e-14 of R per relative change of the layer's
 * coefficients.  What is below 1e-50 of R the reference shows as 0. */
static void assert_slope(struct skin s, double R, int which, double expect, double got,
                         const char *what)
{
    const double size[SLOPES] = { s.sigma_a1 + s.sigma_s1, s.sigma_a1 + s.sigma_s1,
                                  s.sigma_a2 + s.sigma_s2, s.sigma_a2 + s.sigma_s2, s.d_mm };
    char text[96];
    snprintf(text, sizeof text, "%s, slope %d", what, which);
    if (isinf(expect)) {
        TEST_ASSERT_TRUE_MESSAGE(got == expect, text);
        return;
    }
    double balanced = which == BY_D ? 1e-50 : 1e-14;
    double small = size[which] > 0.0 ? balanced * R / size[which] : 0.0;
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(fmax(1e-11 * fabs(expect), small), expect, got, text);
}

/* expect: tests/reference/transport_exact.csv: the boundary-value problem as one linear system in
 * 220 digits, slopes by differences, by tests/reference/transport_exact.py. */
static void test_exact(void)
{
    struct figures t;
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/transport_exact.csv", &t),
                             "tests/reference/transport_exact.csv");
    TEST_ASSERT_EQUAL_size_t(13, t.columns);
    TEST_ASSERT_EQUAL_STRING("R", t.name[7]);
    TEST_ASSERT_EQUAL_STRING("R_d", t.name[12]);
    TEST_ASSERT_GREATER_THAN(200, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        char what[64];
        double R = NAN, by[SLOPES];
        struct skin s = { figures_at(&t, i, 1), figures_at(&t, i, 2), figures_at(&t, i, 3),
                          figures_at(&t, i, 4), figures_at(&t, i, 5), figures_at(&t, i, 6) };
        snprintf(what, sizeof what, "transport_exact.csv, row %zu", i + 1);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, solve((int)figures_at(&t, i, 0), s, &R, by), what);
        assert_relative(1e-12, figures_at(&t, i, 7), R, what);
        for (int k = 0; k < SLOPES; k++)
            assert_slope(s, R, k, figures_at(&t, i, 8 + (size_t)k), by[k], what);
    }
    figures_done(&t);
}

/* ---- properties -------------------------------------------------------------------- */

/* Property: a number from 0 to 1 for every skin that is accepted, and slopes that are numbers,
 * infinite only where the header says so; they keep to the identity of optics/slopes.h, and more
 * absorption in the dermis never makes a skin brighter. */
static void test_every_legal_skin(void)
{
    struct dice dice = { 20140501 };
    for (int i = 0; i < 20000; i++) {
        struct skin s = legal_skin(&dice);
        double R = NAN, by[SLOPES] = { NAN, NAN, NAN, NAN, NAN };
        char what[256];
        skin_describe(what, sizeof what, s);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, solve(i % 5 == 0 ? 8 : 4, s, &R, by), what);
        TEST_ASSERT_TRUE_MESSAGE(R >= 0.0 && R <= 1.0, what);
        for (int k = 0; k < SLOPES; k++)
            TEST_ASSERT_FALSE_MESSAGE(isnan(by[k]), what);
        TEST_ASSERT_TRUE_MESSAGE((s.sigma_a2 / (s.sigma_a2 + s.sigma_s2) == 0.0) ==
                                     (by[BY_SIGMA_A2] == -INFINITY),
                                 what);
        TEST_ASSERT_TRUE_MESSAGE(by[BY_SIGMA_A2] <= 0.0 && by[BY_SIGMA_S2] >= 0.0, what);
    }
}

static void test_slopes_scale(void)
{
    struct dice dice = { 20140502 };
    for (int i = 0; i < 2000; i++) {
        struct skin s = { dice_decades(&dice, -3.0, 3.0), dice_decades(&dice, -2.0, 3.0),
                          dice_decades(&dice, -3.0, 3.0), dice_decades(&dice, -2.0, 3.0),
                          dice_decades(&dice, -4.0, 1.0), dice_between(&dice, 0.9, 2.0) };
        double R = NAN, by[SLOPES];
        char what[256];
        skin_describe(what, sizeof what, s);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, solve(8, s, &R, by), what);
        double sum = s.sigma_a1 * by[BY_SIGMA_A1] + s.sigma_s1 * by[BY_SIGMA_S1] +
                     s.sigma_a2 * by[BY_SIGMA_A2] + s.sigma_s2 * by[BY_SIGMA_S2];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-11 * R, sum, s.d_mm * by[BY_D], what);
    }
}

/* Property: where nothing absorbs, all that came in leaves again, whatever the layers are. */
static void test_no_absorption_returns_all(void)
{
    static const double scattering[] = { 1e-100, 1e-3, 5.0, 1e5, 1e100 };
    static const double any_mm[] = { 0.0, 1e-100, 1e-3, 0.08, 1000.0 };
    static const int streams[] = { 4, 8, 16, 32 };
    for (size_t n = 0; n < 4; n++)
        for (size_t i = 0; i < 5; i++)
            for (size_t j = 0; j < 5; j++)
                for (size_t k = 0; k < 5; k++) {
                    struct skin s = { 0.0, scattering[i], 0.0, scattering[j], any_mm[k], 1.4 };
                    assert_relative(1e-13, 35.0 / 36.0, good_reflectance(streams[n], s, "white"),
                                    "no absorption");
                }
}

/* Property: an epidermis of dermis is dermis, however thick; one of no thickness is not there, and
 * of one that is thick nothing below shows. */
static void test_limits_of_thickness(void)
{
    static const double any_mm[] = { 0.0, 1e-300, 1e-12, 1e-3, 0.02, 0.08, 1.0, 30.0, 1000.0 };
    for (int streams = 4; streams <= 64; streams *= 2) {
        struct skin s = { 0.5, 5.0, 0.1, 2.5, 0.0, 1.4 };
        struct skin dermis = { 0.1, 2.5, 0.1, 2.5, 0.0, 1.4 };
        struct skin epidermis = { 0.5, 5.0, 0.5, 5.0, 0.0, 1.4 };
        double R_dermis = good_reflectance(streams, dermis, "dermis");
        double R_epidermis = good_reflectance(streams, epidermis, "epidermis");
        assert_relative(1e-14, R_dermis, good_reflectance(streams, s, "bare"), "bare");
        s.d_mm = 1e-15;
        assert_relative(1e-12, R_dermis, good_reflectance(streams, s, "nearly bare"),
                        "nearly bare");
        s.d_mm = 1000.0;
        assert_relative(1e-12, R_epidermis, good_reflectance(streams, s, "covered"), "covered");
        for (size_t i = 0; i < sizeof any_mm / sizeof *any_mm; i++) {
            dermis.d_mm = any_mm[i];
            assert_relative(1e-12, R_dermis, good_reflectance(streams, dermis, "alike"), "alike");
        }
    }
}

/* The model's function and slopes() give the same bits, at all numbers of streams; bands do not
 * know of each other. */
static void test_same_bits(void)
{
    static const struct {
        int streams;
        enum status (*reflectance)(const struct medium *m, double *R);
        enum status (*slopes)(const struct medium *m, double *R, const struct slopes *dR);
    } models[] = { { 4, transport_4_reflectance, transport_4_slopes },
                   { 8, transport_8_reflectance, transport_8_slopes },
                   { 16, transport_16_reflectance, transport_16_slopes },
                   { 32, transport_32_reflectance, transport_32_slopes } };
    double a1[] = { 20.0, 3.0, 0.4 }, s1[] = { 14.0, 8.0, 5.0 };
    double a2[] = { 5.0, 0.7, 0.03 }, s2[] = { 7.0, 4.0, 2.5 };
    struct medium m = { 3, 0.08, 1.4, a1, a2, s1, s2 };
    for (size_t i = 0; i < 4; i++) {
        double R[3], with[3], memory[SLOPES_SCRATCH(3)], own[3], by[3][SLOPES];
        struct slopes dR = slopes_in(memory, 3);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, models[i].reflectance(&m, R));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, models[i].slopes(&m, with, &dR));
        for (size_t k = 0; k < 3; k++) {
            struct skin s = { a1[k], s1[k], a2[k], s2[k], 0.08, 1.4 };
            TEST_ASSERT_EQUAL_INT(STATUS_OK, solve(models[i].streams, s, &own[k], by[k]));
            TEST_ASSERT_TRUE(by[k][BY_SIGMA_S1] == dR.sigma_s_prime_epidermis[k]);
            TEST_ASSERT_TRUE(by[k][BY_D] == dR.epidermis_mm[k]);
        }
        TEST_ASSERT_EQUAL_MEMORY(R, with, sizeof R);
        TEST_ASSERT_EQUAL_MEMORY(R, own, sizeof R);
    }
}

/* ---- stacks ------------------------------------------------------------------------ */

/* Property: a stack of an epidermis and an endless dermis is the model; cutting a layer in pieces
 * changes nothing; turned over it lets the same through (reciprocity); and what absorbs nothing
 * loses nothing. */
static void test_stacks(void)
{
    struct skin s = { 0.5, 5.0, 0.1, 2.5, 0.08, 1.4 };
    struct transport_layer skin[] = { { 0.5, 5.0, 0.08 }, { 0.1, 2.5, INFINITY } };
    struct transport_layer cut[] = {
        { 0.5, 5.0, 1e-9 }, { 0.5, 5.0, 0.0 },  { 0.5, 5.0, 0.03 },
        { 0.5, 5.0, 0.05 }, { 0.1, 2.5, 20.0 }, { 0.1, 2.5, INFINITY }
    };
    struct transport_layer slab[] = { { 0.5, 5.0, 0.2 }, { 0.01, 9.0, 0.1 }, { 0.0, 2.0, 0.3 } };
    struct transport_layer turned[] = { slab[2], slab[1], slab[0] };
    struct transport_layer white[] = { { 0.0, 1e6, 10.0 }, { 0.0, 1e-6, 1.0 }, { 0.0, 3.0, 0.5 } };
    struct transport_flux f, g;
    for (int streams = 4; streams <= 64; streams *= 2) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(streams, 1.4, skin, 2, &f));
        TEST_ASSERT_EQUAL_DOUBLE(good_reflectance(streams, s, "skin"), f.R_diffuse);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, f.T_total);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(streams, 1.4, cut, 6, &g));
        assert_relative(2e-9, f.R_diffuse, g.R_diffuse, "cut"); /* 1e-9 mm thicker */
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(streams, 1.4, slab, 3, &f));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(streams, 1.4, turned, 3, &g));
        assert_relative(1e-12, f.R_diffuse + 1.0 / 36.0, f.R_total, "total");
        TEST_ASSERT_TRUE(f.R_total + f.T_total < 1.0);
        TEST_ASSERT_TRUE(fabs(f.R_diffuse - g.R_diffuse) > 1e-3);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(streams, 1.4, white, 3, &g));
        assert_relative(1e-12, 1.0, g.R_total + g.T_total, "white");
    }
}

/* Property: of any stack no more comes out than went in, and all of it where nothing absorbs. */
static void test_every_legal_stack(void)
{
    struct dice dice = { 20140503 };
    for (int i = 0; i < 3000; i++) {
        struct transport_layer l[TRANSPORT_LAYERS_MAX];
        struct transport_flux f = { NAN, NAN, NAN };
        size_t count = 1 + (size_t)dice_between(&dice, 0.0, TRANSPORT_LAYERS_MAX);
        bool white = i % 3 == 0;
        char what[64];
        snprintf(what, sizeof what, "stack %d of %zu layers", i, count);
        for (size_t k = 0; k < count; k++) {
            struct skin s = legal_skin(&dice);
            l[k] = (struct transport_layer){ white ? 0.0 : s.sigma_a1, s.sigma_s1, s.d_mm };
        }
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK,
            transport_stack(i % 2 == 0 ? 4 : 8, dice_between(&dice, 0.3, 3.8), l, count, &f), what);
        TEST_ASSERT_TRUE_MESSAGE(f.R_diffuse >= 0.0 && f.T_total >= 0.0, what);
        TEST_ASSERT_TRUE_MESSAGE(f.R_total + f.T_total <= 1.0 + 1e-12, what);
        if (white)
            assert_relative(1e-11, 1.0, f.R_total + f.T_total, what);
    }
}

static void test_stack_ranges(void)
{
    struct transport_layer l[9];
    struct transport_flux f = { 77.0, 77.0, 77.0 };
    for (int i = 0; i < 9; i++)
        l[i] = (struct transport_layer){ 0.5, 5.0, 0.08 };
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 1.4, l, 0, &f));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 1.4, l, 9, &f));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(6, 1.4, l, 2, &f));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(0, 1.4, l, 2, &f));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(68, 1.4, l, 2, &f));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 3.9, l, 2, &f));
    l[0].thickness_mm = INFINITY;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 1.4, l, 2, &f));
    l[0].thickness_mm = -INFINITY;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 1.4, l, 1, &f));
    l[0] = (struct transport_layer){ -0.5, 5.0, 0.08 };
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, transport_stack(8, 1.4, l, 2, &f));
    TEST_ASSERT_EQUAL_DOUBLE(77.0, f.R_diffuse);
    TEST_ASSERT_EQUAL_DOUBLE(77.0, f.T_total);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, transport_stack(8, 1.4, l + 1, 8, &f));
}

/* ---- refusals ---------------------------------------------------------------------- */

/* Three bands, of which the last is shown: bad input there leaves R and slopes untouched.
 * expect: the limits of optics/dipole.h and optics/tissue.h. */
static const struct range_case {
    const char *what;
    struct skin skin;
    enum status status;
} range_cases[] = {
    { "good", { 0.5, 5.0, 0.1, 2.5, 0.08, 1.4 }, STATUS_OK },
    { "at the limits", { 1e100, 1e-100, 1e100, 1e-100, 1000.0, 1.4 }, STATUS_OK },
    { "epidermis absorbs less than nothing", { -0.5, 5.0, 0.1, 2.5, 0.08, 1.4 }, STATUS_RANGE },
    { "so does the dermis", { 0.5, 5.0, -1e-300, 2.5, 0.08, 1.4 }, STATUS_RANGE },
    { "epidermis does not scatter", { 0.5, 0.0, 0.1, 2.5, 0.08, 1.4 }, STATUS_RANGE },
    { "dermis does not scatter", { 0.5, 5.0, 0.1, 0.0, 0.08, 1.4 }, STATUS_RANGE },
    { "the dermis's absorption unknown", { 0.5, 5.0, NAN, 2.5, 0.08, 1.4 }, STATUS_RANGE },
    { "too much", { 0.5, 5.0, 0.1, 1.1e100, 0.08, 1.4 }, STATUS_RANGE },
    { "negative thickness", { 0.5, 5.0, 0.1, 2.5, -0.08, 1.4 }, STATUS_RANGE },
    { "thickness unknown", { 0.5, 5.0, 0.1, 2.5, NAN, 1.4 }, STATUS_RANGE },
    { "more than a metre thick", { 0.5, 5.0, 0.1, 2.5, 1000.1, 1.4 }, STATUS_RANGE },
    { "index too high", { 0.5, 5.0, 0.1, 2.5, 0.08, 3.8481 }, STATUS_RANGE },
    { "index too low", { 0.5, 5.0, 0.1, 2.5, 0.08, 0.2599 }, STATUS_RANGE },
    { "index unknown", { 0.5, 5.0, 0.1, 2.5, 0.08, NAN }, STATUS_RANGE },
};

static void test_ranges(void)
{
    for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
        const struct range_case *c = &range_cases[i];
        const struct skin *s = &c->skin;
        double epi[] = { 0.5, 0.5, s->sigma_a1 }, s_epi[] = { 5.0, 5.0, s->sigma_s1 };
        double der[] = { 0.1, 0.1, s->sigma_a2 }, s_der[] = { 2.5, 2.5, s->sigma_s2 };
        double R[] = { 77.0, 77.0, 77.0 }, memory[SLOPES_SCRATCH(3)];
        struct slopes dR = slopes_in(memory, 3);
        struct medium m = { 3, s->d_mm, s->eta, epi, der, s_epi, s_der };
        for (size_t k = 0; k < SLOPES_SCRATCH(3); k++)
            memory[k] = 77.0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, transport_slopes(8, &m, R, &dR), c->what);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_MESSAGE((R[k] == 77.0) == (c->status != STATUS_OK), c->what);
        for (size_t k = 0; k < SLOPES_SCRATCH(3); k++)
            TEST_ASSERT_MESSAGE((memory[k] == 77.0) == (c->status != STATUS_OK), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, transport_reflectance(8, &m, R), c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_exact);
    RUN_TEST(test_every_legal_skin);
    RUN_TEST(test_slopes_scale);
    RUN_TEST(test_no_absorption_returns_all);
    RUN_TEST(test_limits_of_thickness);
    RUN_TEST(test_same_bits);
    RUN_TEST(test_stacks);
    RUN_TEST(test_every_legal_stack);
    RUN_TEST(test_stack_ranges);
    RUN_TEST(test_ranges);
    return UNITY_END();
}
