/* test_chromophores.c - spot values, the haemoglobin table, and band grids. */
#include "optics/chromophores.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "optics/haemoglobin_table.h"
#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void assert_relative(double tol, double expect, double got, const char *what)
{
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol * fabs(expect), expect, got, what);
}

/* expect: Eqs. 1-3 and 6 as printed in the paper, in 40-digit decimals. */
static const struct formula_case {
    double nm, eumelanin, pheomelanin, base, sigma_s_prime;
} formula_cases[] = {
    { 250.0, 682.97326989795567, 1180.81797807331691, 2.02498233184480, 60.69472423066254 },
    { 380.0, 169.38094783964038, 161.59425399400149, 0.30514516156823, 14.54061511215425 },
    { 420.0, 121.37347842917985, 100.45322139078023, 0.17782590582281, 10.97295639756708 },
    { 500.0, 67.91626920415234, 43.88241065774736, 0.07022173481201, 7.27598701839360 },
    { 555.0, 47.97868070179462, 26.73045357085553, 0.04436424308693, 5.98946798216206 },
    { 740.0, 18.40781787582530, 6.81627854112590, 0.02562064681473, 4.17927468488556 },
    { 1000.0, 6.75373374905298, 1.63078984305201, 0.02442403818785, 3.44476063370164 },
};

static void test_formulas(void)
{
    for (size_t i = 0; i < sizeof formula_cases / sizeof *formula_cases; i++) {
        const struct formula_case *c = &formula_cases[i];
        char what[32];
        snprintf(what, sizeof what, "%g nm", c->nm);
        assert_relative(1e-12, c->eumelanin, eumelanin_sigma_a(c->nm), what);
        assert_relative(1e-12, c->pheomelanin, pheomelanin_sigma_a(c->nm), what);
        assert_relative(1e-12, c->base, base_sigma_a(c->nm), what);
        assert_relative(1e-12, c->sigma_s_prime, skin_sigma_s_prime(c->nm), what);
    }
}

/* expect: the spot values of docs/physics.md, with the digits given there; half a
 * unit of the last digit is the tolerance. */
static const struct blood_case {
    double nm, oxy, oxy_tol, deoxy, deoxy_tol;
} blood_cases[] = {
    { 420.0, 257.27, 5e-3, 218.28, 5e-3 }, { 542.0, 28.54, 5e-3, 25.79, 5e-3 },
    { 576.0, 29.75, 5e-3, 21.47, 5e-3 },   { 600.0, 1.714, 5e-4, 7.861, 5e-4 },
    { 650.0, 0.1971, 5e-5, 2.0085, 5e-5 }, { 740.0, 0.2389, 5e-5, 0.5976, 5e-5 },
};

static void test_whole_blood(void)
{
    for (size_t i = 0; i < sizeof blood_cases / sizeof *blood_cases; i++) {
        const struct blood_case *c = &blood_cases[i];
        char what[32];
        snprintf(what, sizeof what, "%g nm", c->nm);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->oxy_tol, c->oxy, oxyhaemoglobin_sigma_a(c->nm), what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->deoxy_tol, c->deoxy, deoxyhaemoglobin_sigma_a(c->nm),
                                          what);
    }
}

/* expect: Prahl's table at its points, a straight line between them by hand. */
static const struct epsilon_case {
    const char *what;
    double nm, oxy, deoxy;
} epsilon_cases[] = {
    { "first point", 250.0, 106112.0, 112736.0 },
    { "a point", 420.0, 480360.0, 407560.0 },
    { "half-way to the next", 421.0, 456120.0, 418720.0 },
    { "a quarter of the way", 420.5, 468240.0, 413140.0 },
    { "last point", 1000.0, 1024.0, 206.784 },
    { "half-way before it", 999.0, 1029.6, 214.428 },
    { "just below the table", 249.99999999999997, NAN, NAN },
    { "just above it", 1000.0000000000001, NAN, NAN },
    { "nowhere", NAN, NAN, NAN },
    { "infinitely long", INFINITY, NAN, NAN },
    { "negative", -420.0, NAN, NAN },
};

static void test_epsilon(void)
{
    for (size_t i = 0; i < sizeof epsilon_cases / sizeof *epsilon_cases; i++) {
        const struct epsilon_case *c = &epsilon_cases[i];
        double oxy = oxyhaemoglobin_epsilon(c->nm), deoxy = deoxyhaemoglobin_epsilon(c->nm);
        if (isnan(c->oxy)) {
            TEST_ASSERT_MESSAGE(isnan(oxy) && isnan(deoxy), c->what);
            TEST_ASSERT_MESSAGE(isnan(oxyhaemoglobin_sigma_a(c->nm)), c->what);
            TEST_ASSERT_MESSAGE(isnan(deoxyhaemoglobin_sigma_a(c->nm)), c->what);
        } else {
            assert_relative(1e-14, c->oxy, oxy, c->what);
            assert_relative(1e-14, c->deoxy, deoxy, c->what);
        }
    }
}

/* The whole table against the published one, where that is at hand. */
static void test_haemoglobin_table_is_the_published_one(void)
{
    char path[4096];
    struct figures published;
    const char *folder = getenv("SKINSPEC_FIGURES");
    snprintf(path, sizeof path, "%s/hemoglobin.csv", folder != NULL ? folder : "../shared/figures");
    if (!figures_read(path, &published))
        TEST_IGNORE_MESSAGE("no hemoglobin.csv: name its folder in SKINSPEC_FIGURES");
    size_t nm = figures_column(&published, "wavelength_nm");
    size_t oxy = figures_column(&published, "epsilon_HbO2_cm-1_M-1");
    size_t deoxy = figures_column(&published, "epsilon_Hb_cm-1_M-1");
    TEST_ASSERT_EQUAL_size_t(3, published.columns);
    TEST_ASSERT_EQUAL_size_t(3, nm + oxy + deoxy); /* 0, 1 and 2: all are there */
    TEST_ASSERT_EQUAL_size_t(HAEMOGLOBIN_TABLE_N, published.rows);
    for (size_t i = 0; i < published.rows; i++) {
        char what[32];
        snprintf(what, sizeof what, "row %zu", i);
        double place = HAEMOGLOBIN_TABLE_FIRST_NM + HAEMOGLOBIN_TABLE_STEP_NM * (double)i;
        /* Both were read from the same decimals, so they are the same doubles. */
        TEST_ASSERT_MESSAGE(place == figures_at(&published, i, nm), what);
        TEST_ASSERT_MESSAGE(haemoglobin_table[i].oxy == figures_at(&published, i, oxy), what);
        TEST_ASSERT_MESSAGE(haemoglobin_table[i].deoxy == figures_at(&published, i, deoxy), what);
    }
    figures_done(&published);
}

static struct chromophores chromophores;

/* Property: a grid holds what the functions give at its wavelengths. */
static void test_grid_holds_the_functions(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, chromophores_init(380.0, 2.5, 145, &chromophores));
    TEST_ASSERT_EQUAL_size_t(145, chromophores.n);
    for (size_t i = 0; i < chromophores.n; i++) {
        double nm = 380.0 + 2.5 * (double)i; /* exact */
        TEST_ASSERT_TRUE(chromophores.eumelanin[i] == eumelanin_sigma_a(nm));
        TEST_ASSERT_TRUE(chromophores.pheomelanin[i] == pheomelanin_sigma_a(nm));
        TEST_ASSERT_TRUE(chromophores.base[i] == base_sigma_a(nm));
        TEST_ASSERT_TRUE(chromophores.oxy[i] == oxyhaemoglobin_sigma_a(nm));
        TEST_ASSERT_TRUE(chromophores.deoxy[i] == deoxyhaemoglobin_sigma_a(nm));
        TEST_ASSERT_TRUE(chromophores.sigma_s_prime[i] == skin_sigma_s_prime(nm));
    }
}

/* expect: 250..1000 nm, 1..SPECTRUM_MAX_BANDS bands, step above 0. */
static const struct grid_case {
    const char *what;
    double first_nm, step_nm;
    size_t n;
    enum status status;
} grid_cases[] = {
    { "the whole table", 250.0, 1.0, 751, STATUS_OK },
    { "as many bands as there are places", 400.0, 0.25, SPECTRUM_MAX_BANDS, STATUS_OK },
    { "one band", 1000.0, 10.0, 1, STATUS_OK },
    { "no band", 400.0, 10.0, 0, STATUS_RANGE },
    { "one band too many", 400.0, 0.25, SPECTRUM_MAX_BANDS + 1, STATUS_RANGE },
    { "begins below the table", 249.0, 1.0, 10, STATUS_RANGE },
    { "ends above it", 991.0, 1.0, 11, STATUS_RANGE },
    { "stands still", 400.0, 0.0, 10, STATUS_RANGE },
    { "runs backwards", 700.0, -10.0, 31, STATUS_RANGE },
    { "first unknown", NAN, 10.0, 31, STATUS_RANGE },
    { "step unknown", 400.0, NAN, 31, STATUS_RANGE },
    { "endless step", 400.0, INFINITY, 31, STATUS_RANGE },
    { "endless step, one band", 400.0, INFINITY, 1, STATUS_RANGE },
};

static void test_grid_ranges(void)
{
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        chromophores.n = 77;
        enum status s = chromophores_init(c->first_nm, c->step_nm, c->n, &chromophores);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, s, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(s == STATUS_OK ? c->n : 77, chromophores.n, c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_formulas);
    RUN_TEST(test_whole_blood);
    RUN_TEST(test_epsilon);
    RUN_TEST(test_haemoglobin_table_is_the_published_one);
    RUN_TEST(test_grid_holds_the_functions);
    RUN_TEST(test_grid_ranges);
    return UNITY_END();
}
