/* test_kubelka_munk.c - the closed form and its slopes against the differential equations,
 * against radiative transfer, and at its limits. */
#include "optics/kubelka_munk.h"

#include <math.h>
#include <stdio.h>

#include "optics/dipole.h"
#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* sigma_a1, sigma_s1, sigma_a2, sigma_s2, d_mm; then eta. */
struct skin {
    double x[5], eta;
};

/* R and the slopes by x[], of one band. */
static enum status answer(struct skin s, double *R, double slope[5])
{
    struct medium m = { 1, s.x[4], s.eta, &s.x[0], &s.x[2], &s.x[1], &s.x[3] };
    struct slopes dR = { &slope[0], &slope[2], &slope[1], &slope[3], &slope[4] };
    return kubelka_munk_slopes(&m, R, &dR);
}

static double good_answer(struct skin s, double slope[5], const char *what)
{
    double R = NAN, alone = NAN;
    struct medium m = { 1, s.x[4], s.eta, &s.x[0], &s.x[2], &s.x[1], &s.x[3] };
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, answer(s, &R, slope), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, kubelka_munk_reflectance(&m, &alone), what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&R, &alone, sizeof R, what); /* to the last bit */
    return R;
}

/* expect: tests/reference/kubelka_munk.csv, the two-flux equations by a matrix exponential and
 * differences in hundreds of digits.   Beside the limits of eta 1 - F_dr is a small difference:
 * 0.0005 at 3.84. */
static void test_reference(void)
{
    struct figures t;
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/kubelka_munk.csv", &t),
                             "tests/reference/kubelka_munk.csv");
    TEST_ASSERT_EQUAL_size_t(12, t.columns);
    TEST_ASSERT_EQUAL_STRING("dR_dd_mm", t.name[11]);
    TEST_ASSERT_GREATER_THAN(250, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        char what[64];
        struct skin s = { .eta = figures_at(&t, i, 5) };
        double slope[5], expect = figures_at(&t, i, 6);
        for (size_t k = 0; k < 5; k++)
            s.x[k] = figures_at(&t, i, k);
        snprintf(what, sizeof what, "kubelka_munk.csv, row %zu", i + 1);
        double tol = s.eta > 3.0 || s.eta < 0.3 ? 1e-12 : 2e-15;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol * expect, expect, good_answer(s, slope, what), what);
        for (size_t k = 0; k < 5; k++) {
            double by = figures_at(&t, i, 7 + k);
            snprintf(what, sizeof what, "kubelka_munk.csv, row %zu, slope %zu", i + 1, k + 1);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(fmax(tol, 1e-13) * fabs(by), by, slope[k], what);
        }
    }
    figures_done(&t);
}

enum { TRANSPORT_BANDS = 37, TRANSPORT_FIRST = 4 }; /* 380..740 nm by 10, after 4 columns */

/* expect: what two fluxes cost over human skin (docs/physics.md); the reference is
 * tests/reference/transport_64.csv, adding-doubling with 64 directions. */
static void test_transport(void)
{
    static struct chromophores c;
    struct figures t;
    double squares = 0.0, most = 0.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(380.0, 10.0, TRANSPORT_BANDS, &c));
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/transport_64.csv", &t),
                             "tests/reference/transport_64.csv");
    TEST_ASSERT_EQUAL_size_t(TRANSPORT_FIRST + TRANSPORT_BANDS, t.columns);
    for (size_t i = 0; i < t.rows; i++) {
        double scratch[MEDIUM_SCRATCH(TRANSPORT_BANDS)], R[TRANSPORT_BANDS];
        struct tissue tissue =
            tissue_of(figures_at(&t, i, 0), figures_at(&t, i, 1), figures_at(&t, i, 2));
        struct medium m;
        tissue.epidermis_mm = figures_at(&t, i, 3);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, tissue_medium(&tissue, &c, scratch, &m));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, kubelka_munk_reflectance(&m, R));
        for (size_t k = 0; k < TRANSPORT_BANDS; k++) {
            double difference = R[k] - figures_at(&t, i, TRANSPORT_FIRST + k);
            squares += difference * difference;
            most = fmax(most, fabs(difference));
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.0273, sqrt(squares / (double)(t.rows * TRANSPORT_BANDS)));
    TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.0587, most);
    figures_done(&t);
}

/* Where nothing absorbs, all that came in leaves again; the dermis's slope by absorption has
 * then no bottom, all others are finite. */
static void test_no_absorption(void)
{
    static const double scattering[] = { 1e-100, 1e-3, 5.0, 1e5, 1e100 };
    static const double any_mm[] = { 0.0, 1e-100, 0.08, 1000.0 };
    for (size_t i = 0; i < 5; i++) {
        for (size_t j = 0; j < 5; j++) {
            for (size_t k = 0; k < 4; k++) {
                struct skin s = { { 0.0, scattering[i], 0.0, scattering[j], any_mm[k] }, 1.4 };
                double slope[5];
                TEST_ASSERT_DOUBLE_WITHIN(1e-14, 35.0 / 36.0,
                                          good_answer(s, slope, "nothing absorbs"));
                TEST_ASSERT_TRUE(slope[2] == -INFINITY);
                TEST_ASSERT_TRUE(isfinite(slope[0]) && slope[0] <= 0.0);
                TEST_ASSERT_EQUAL_DOUBLE(0.0, slope[1]);
                TEST_ASSERT_EQUAL_DOUBLE(0.0, slope[3]);
                TEST_ASSERT_EQUAL_DOUBLE(0.0, slope[4]);
            }
        }
    }
}

static double decade(unsigned *state, double low, double high)
{
    *state = *state * 1664525u + 1013904223u; /* Numerical Recipes' quick generator */
    return pow(10.0, low + (high - low) * (double)(*state >> 8) / 0x1p24);
}

/* Property: for every accepted medium R is a reflectance and no slope is NAN; by absorption
 * none is positive; and d dR/dd is the sum of x dR/dx over the epidermis, those of the dermis
 * being opposite: only ratios count. */
static void test_every_medium(void)
{
    unsigned state = 17;
    for (int i = 0; i < 100000; i++) {
        double span = i % 2 == 0 ? 3.0 : 99.9;
        struct skin s = { { decade(&state, -span, span), decade(&state, -span, span),
                            decade(&state, -span, span), decade(&state, -span, span),
                            decade(&state, -span, 3.0) },
                          decade(&state, -0.58, 0.58) };
        double slope[5], R = good_answer(s, slope, "some medium");
        char what[256];
        snprintf(what, sizeof what, "{ %.17g, %.17g, %.17g, %.17g, %.17g }, %.17g", s.x[0], s.x[1],
                 s.x[2], s.x[3], s.x[4], s.eta);
        TEST_ASSERT_TRUE_MESSAGE(R >= 0.0 && R <= 1.0, what);
        for (int k = 0; k < 5; k++)
            TEST_ASSERT_FALSE_MESSAGE(isnan(slope[k]), what);
        TEST_ASSERT_TRUE_MESSAGE(slope[0] <= 0.0 && slope[2] <= 0.0 && slope[3] >= 0.0, what);
        if (span > 3.0)
            continue; /* products may leave the range of a double */
        double above = s.x[0] * slope[0] + s.x[1] * slope[1], below = s.x[2] * slope[2];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12 * R, above, s.x[4] * slope[4], what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12 * R, -below, s.x[3] * slope[3], what);
    }
}

/* Three bands, of which the last is shown: bad input there leaves everything untouched.
 * expect: the limits of optics/dipole.h and optics/tissue.h. */
static const struct range_case {
    const char *what;
    struct skin skin;
    enum status status;
} range_cases[] = {
    { "good", { { 0.5, 5.0, 0.1, 2.5, 0.08 }, 1.4 }, STATUS_OK },
    { "at the limits", { { 1e100, 1e-100, 1e100, 1e-100, 1000.0 }, 1.4 }, STATUS_OK },
    { "absorbs less than nothing", { { -0.5, 5.0, 0.1, 2.5, 0.08 }, 1.4 }, STATUS_RANGE },
    { "so does the dermis", { { 0.5, 5.0, -1e-300, 2.5, 0.08 }, 1.4 }, STATUS_RANGE },
    { "epidermis does not scatter", { { 0.5, 0.0, 0.1, 2.5, 0.08 }, 1.4 }, STATUS_RANGE },
    { "dermis's scattering unknown", { { 0.5, 5.0, 0.1, NAN, 0.08 }, 1.4 }, STATUS_RANGE },
    { "too much", { { 0.5, 5.0, 0.1, 1.1e100, 0.08 }, 1.4 }, STATUS_RANGE },
    { "negative thickness", { { 0.5, 5.0, 0.1, 2.5, -0.08 }, 1.4 }, STATUS_RANGE },
    { "more than a metre thick", { { 0.5, 5.0, 0.1, 2.5, 1000.1 }, 1.4 }, STATUS_RANGE },
    { "index too high", { { 0.5, 5.0, 0.1, 2.5, 0.08 }, 3.8481 }, STATUS_RANGE },
    { "index unknown", { { 0.5, 5.0, 0.1, 2.5, 0.08 }, NAN }, STATUS_RANGE },
};

static void test_ranges(void)
{
    for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
        const struct range_case *c = &range_cases[i];
        const double *x = c->skin.x;
        double a1[] = { 0.5, 0.5, x[0] }, s1[] = { 5.0, 5.0, x[1] };
        double a2[] = { 0.1, 0.1, x[2] }, s2[] = { 2.5, 2.5, x[3] };
        double R[] = { 77.0, 77.0, 77.0 }, scratch[SLOPES_SCRATCH(3)];
        struct medium m = { 3, x[4], c->skin.eta, a1, a2, s1, s2 };
        struct slopes dR = slopes_in(scratch, 3);
        for (int k = 0; k < SLOPES_SCRATCH(3); k++)
            scratch[k] = 77.0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, kubelka_munk_slopes(&m, R, &dR), c->what);
        for (int k = 0; k < SLOPES_SCRATCH(3); k++)
            TEST_ASSERT_MESSAGE((scratch[k] == 77.0) == (c->status != STATUS_OK), c->what);
        R[0] = R[1] = R[2] = 77.0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, kubelka_munk_reflectance(&m, R), c->what);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_MESSAGE((R[k] == 77.0) == (c->status != STATUS_OK), c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_reference);
    RUN_TEST(test_transport);
    RUN_TEST(test_no_absorption);
    RUN_TEST(test_every_medium);
    RUN_TEST(test_ranges);
    return UNITY_END();
}
