/* test_dipole.c - Eqs. 7-9 against 60-digit decimals, and what ties them together. */
#include "optics/dipole.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/units.h"
#include "tests/support/figures.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: the two fits and Eq. 8 in 40-digit decimals; Rs by hand. */
static const struct index_case {
    const char *what;
    double eta, F_dr, A, Rs;
} index_cases[] = {
    { "light into a thinner medium", 0.5, 0.1611, 1.384074383120753371, 1.0 / 9.0 },
    { "less so", 0.75, 0.067344444444444444, 1.144414396168646375, 1.0 / 49.0 },
    { "no surface: the fit misses 0", 1.0, 0.0016, 1.003205128205128205, 0.0 },
    { "water", 1.33, 0.472357348182486314, 2.790444144556577744, 0.020059312199524764 },
    { "skin", 1.4, 0.529488979591836735, 3.250697461379377541, 1.0 / 36.0 },
    { "glass", 1.5, 0.596733333333333333, 3.959497437592990554, 0.04 },
    { "diamond and more", 3.0, 0.935466666666666667, 29.991735537190082645, 0.25 },
};

static void test_index(void)
{
    for (size_t i = 0; i < sizeof index_cases / sizeof *index_cases; i++) {
        const struct index_case *c = &index_cases[i];
        double A = 0.0;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, c->F_dr, dipole_F_dr(c->eta), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, dipole_A(c->eta, &A), c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-13 * c->A, c->A, A, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-16, c->Rs, dipole_Rs(c->eta), c->what);
    }
}

/* expect: the table on top of dipole.h.  F_dr = 1 at eta = 3.848096418926 and
 * 0.259951157152, the roots of the fits in 40-digit decimals: just outside. */
static const struct range_case {
    const char *what;
    double sigma_a, sigma_s_prime, eta;
    enum status status;
} range_cases[] = {
    { "skin", 0.3, 2.5, 1.4, STATUS_OK },
    { "nothing absorbs", 0.0, 2.5, 1.4, STATUS_OK },
    { "least scattering", 0.3, 1e-100, 1.4, STATUS_OK },
    { "most of both", 1e100, 1e100, 1.4, STATUS_OK },
    { "nothing scatters", 0.3, 0.0, 1.4, STATUS_RANGE },
    { "next to nothing scatters", 0.3, 0.9e-100, 1.4, STATUS_RANGE },
    { "too much scatters", 0.3, 1.1e100, 1.4, STATUS_RANGE },
    { "too much absorbs", 1.1e100, 2.5, 1.4, STATUS_RANGE },
    { "absorbs less than nothing", -1e-300, 2.5, 1.4, STATUS_RANGE },
    { "scatters less than nothing", 0.3, -2.5, 1.4, STATUS_RANGE },
    { "absorption unknown", NAN, 2.5, 1.4, STATUS_RANGE },
    { "scattering unknown", 0.3, NAN, 1.4, STATUS_RANGE },
    { "index unknown", 0.3, 2.5, NAN, STATUS_RANGE },
    { "absorption without limit", INFINITY, 2.5, 1.4, STATUS_RANGE },
    { "scattering without limit", 0.3, INFINITY, 1.4, STATUS_RANGE },
    { "index without limit", 0.3, 2.5, INFINITY, STATUS_RANGE },
    { "and the other way", 0.3, 2.5, -INFINITY, STATUS_RANGE },
    { "just below the highest index", 0.3, 2.5, 3.8479999999999, STATUS_OK },
    { "the highest index", 0.3, 2.5, 3.848, STATUS_RANGE },
    { "far above", 0.3, 2.5, 1e300, STATUS_RANGE },
    { "just above the lowest index", 0.3, 2.5, 0.2600000000001, STATUS_OK },
    { "the lowest index", 0.3, 2.5, 0.26, STATUS_RANGE },
    { "far below", 0.3, 2.5, 1e-300, STATUS_RANGE },
    { "no index", 0.3, 2.5, 0.0, STATUS_RANGE },
    { "negative index", 0.3, 2.5, -1.4, STATUS_RANGE },
};

static void test_ranges(void)
{
    for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
        const struct range_case *c = &range_cases[i];
        static const struct dipole before = { .A = 77.0 };
        struct dipole d = before;
        enum status s = dipole_init(c->sigma_a, c->sigma_s_prime, c->eta, &d);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, s, c->what);
        if (s != STATUS_OK) {
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &d, sizeof d, c->what);
        } else {
            double R = dipole_total(&d);
            TEST_ASSERT_MESSAGE(R >= 0.0 && R <= 1.0, c->what);
        }
    }
}

/* A alone refuses the same indices, and leaves its result alone. */
static void test_A_refuses(void)
{
    static const double bad[] = { 3.848, 0.26, 0.0, -1.4, NAN, INFINITY };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        double A = 77.0;
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, dipole_A(bad[i], &A));
        TEST_ASSERT_TRUE(A == 77.0);
    }
}

/* expect: by hand for sigma_a = 1, sigma_s' = 3, eta = 1 with A = 313/312 as above. */
static void test_members(void)
{
    struct dipole d;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(1.0, 3.0, 1.0, &d));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.75, d.alpha_prime);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.25, d.absorbed);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, sqrt(12.0), d.sigma_tr);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.25, d.z_r);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.25 + 4.0 * (313.0 / 312.0) / 12.0, d.z_v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 313.0 / 312.0, d.A);
    /* 3 sigma_a sigma_t' is no double here, its root is. */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(1e-300, 1e-100, 1.0, &d));
    TEST_ASSERT_DOUBLE_WITHIN(1e-213, 1.7320508075688773e-200, d.sigma_tr);
}

/* Within tol of expect, relatively; where expect is below what a double holds
 * with all its digits, anything as small will do. */
static void assert_relative(double tol, double expect, double got, const char *what)
{
    if (expect < 1e-300)
        TEST_ASSERT_MESSAGE(got >= 0.0 && got <= 1.1e-300, what);
    else
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol * expect, expect, got, what);
}

/* expect: tests/reference/dipole.csv, 60-digit decimals by tests/reference/dipole.py. */
static void test_reference(void)
{
    struct figures t;
    TEST_ASSERT_TRUE_MESSAGE(figures_read("tests/reference/dipole.csv", &t),
                             "tests/reference/dipole.csv");
    TEST_ASSERT_EQUAL_size_t(7, t.columns);
    TEST_ASSERT_EQUAL_STRING("cumulative", t.name[6]);
    TEST_ASSERT_GREATER_THAN(300, t.rows);
    for (size_t i = 0; i < t.rows; i++) {
        struct dipole d;
        double r_mm = figures_at(&t, i, 3), rd, share;
        char what[64];
        snprintf(what, sizeof what, "dipole.csv, row %zu", i + 1);
        enum status s =
            dipole_init(figures_at(&t, i, 0), figures_at(&t, i, 1), figures_at(&t, i, 2), &d);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, s, what);
        dipole_profile(&d, 1, &r_mm, &rd);
        dipole_cumulative(&d, 1, &r_mm, &share);
        assert_relative(1e-12, figures_at(&t, i, 4), dipole_total(&d), what);
        assert_relative(1e-12, figures_at(&t, i, 5), rd, what);
        assert_relative(1e-12, figures_at(&t, i, 6), share, what);
    }
    figures_done(&t);
}

/* Media for the properties below. */
static const struct medium_case {
    const char *what;
    double sigma_a, sigma_s_prime, eta;
} medium_cases[] = {
    { "skin, red", 0.03, 2.5, 1.4 },         { "skin, blue", 5.0, 7.0, 1.4 },
    { "milk", 0.0001, 2.5, 1.33 },           { "more absorbing than scattering", 20.0, 0.5, 1.4 },
    { "hardly absorbing", 1e-9, 1.0, 1.4 },  { "no surface", 0.1, 1.0, 1.0 },
    { "from dense to thin", 0.1, 1.0, 0.6 }, { "diamond", 0.1, 1.0, 2.4 },
    { "fog over a city", 1e-12, 1e-6, 1.4 }, { "soot", 1e6, 1e3, 1.4 },
};
enum { MEDIUM_CASES = sizeof medium_cases / sizeof *medium_cases };

/* 2 pi times the integral of r R_d by the trapezoidal rule in ln r, r R_d dr =
 * r^2 R_d d(ln r), from first_mm to last_mm.  What lies below first_mm adds
 * about half of its last term's r^2. */
static double integral(const struct dipole *d, double first_mm, double last_mm, int n)
{
    double step = log(last_mm / first_mm) / (n - 1), sum = 0.0;
    for (int i = 0; i < n; i++) {
        double r = first_mm * exp(step * i), rd;
        dipole_profile(d, 1, &r, &rd);
        sum += (i == 0 || i == n - 1 ? 0.5 : 1.0) * r * r * rd;
    }
    return 2.0 * UNITS_PI * step * sum;
}

/* Property: Eq. 7 integrates to Eq. 9. */
static void test_profile_integrates_to_total(void)
{
    for (size_t i = 0; i < MEDIUM_CASES; i++) {
        const struct medium_case *c = &medium_cases[i];
        struct dipole d;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(c->sigma_a, c->sigma_s_prime, c->eta, &d));
        double total = dipole_total(&d);
        /* 64 points are enough for 2e-8 where the profile spans few decades (1e-8 is
         * lost below the first point); ... */
        if (d.sigma_tr * d.z_r > 0.01)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(
                2e-8 * total, total, integral(&d, 1e-4 * d.z_r, 25.0 / d.sigma_tr, 64), c->what);
        /* ... many points and a wide span show that nothing but rounding is left. */
        double reach = 60.0 / d.sigma_tr + 60.0 * d.z_v;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-13 * total, total,
                                          integral(&d, 1e-8 * d.z_r, reach, 4000), c->what);
    }
}

/* Property: the cumulative is the integral up to r, starts at 0, never falls, and
 * ends at Eq. 9. */
static void test_cumulative(void)
{
    for (size_t i = 0; i < MEDIUM_CASES; i++) {
        const struct medium_case *c = &medium_cases[i];
        struct dipole d;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(c->sigma_a, c->sigma_s_prime, c->eta, &d));
        const double ends[] = { 0.0, 1e100 };
        double share[2], before = 0.0;
        dipole_cumulative(&d, 2, ends, share);
        TEST_ASSERT_MESSAGE(share[0] == 0.0, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, dipole_total(&d), share[1], c->what);
        for (int k = -60; k <= 60; k++) {
            double r = d.z_r * pow(10.0, k / 10.0), now;
            dipole_cumulative(&d, 1, &r, &now);
            TEST_ASSERT_MESSAGE(now >= before && now <= share[1] * (1.0 + 1e-15), c->what);
            before = now;
        }
        double r = 3.0 * d.z_r, now;
        dipole_cumulative(&d, 1, &r, &now);
        /* The rule's last panel ends inside the profile: its error is the square of
         * the step times the slope there. */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5 * now, now, integral(&d, 1e-6 * d.z_r, r, 4000),
                                          c->what);
    }
}

/* Eq. 9 without absorption returns everything, however it is cut. */
static void test_no_absorption_returns_all(void)
{
    static const double scattering[] = { 1e-100, 1e-6, 0.3, 7.0, 1e6, 1e100 };
    for (size_t i = 0; i < sizeof scattering / sizeof *scattering; i++) {
        struct dipole d;
        double far = 1e100, share;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(0.0, scattering[i], 1.4, &d));
        TEST_ASSERT_TRUE(dipole_total(&d) == 1.0);
        dipole_cumulative(&d, 1, &far, &share);
        if (scattering[i] > 1e-6) /* 1e100 mm are far away */
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1.0, share);
    }
}

/* Property: only ratios count.  Coefficients times c and lengths by c leave Eq. 9,
 * and the cumulative; R_d goes with c^2.  c is a power of two: no rounding. */
static void test_lengths_scale_out(void)
{
    static const double scale[] = { 0x1p-200, 0x1p-20, 0x1p20, 0x1p200 };
    struct dipole d, e;
    double r = 0.625, rd, share, rd_scaled, share_scaled;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(0.25, 3.0, 1.4, &d));
    dipole_profile(&d, 1, &r, &rd);
    dipole_cumulative(&d, 1, &r, &share);
    for (size_t i = 0; i < sizeof scale / sizeof *scale; i++) {
        double c = scale[i], near = r / c;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(0.25 * c, 3.0 * c, 1.4, &e));
        dipole_profile(&e, 1, &near, &rd_scaled);
        dipole_cumulative(&e, 1, &near, &share_scaled);
        TEST_ASSERT_TRUE(dipole_total(&d) == dipole_total(&e));
        TEST_ASSERT_DOUBLE_WITHIN(1e-15 * share, share, share_scaled);
        TEST_ASSERT_DOUBLE_WITHIN(1e-14 * rd, rd, rd_scaled / c / c);
    }
}

/* Property: finite and never negative wherever input is accepted. */
static void test_extremes_stay_finite(void)
{
    static const double sigma_a[] = { 0.0, 1e-300, 1e-100, 1.0, 1e100 };
    static const double sigma_s_prime[] = { 1e-100, 1.0, 1e100 };
    static const double eta[] = { 0.26001, 1.0, 1.4, 3.84799 };
    static const double r_mm[] = { 0.0, 1e-308, 1e-100, 1.0, 1e100 };
    for (size_t i = 0; i < 5; i++) {
        for (size_t j = 0; j < 3; j++) {
            for (size_t k = 0; k < 4; k++) {
                struct dipole d;
                double rd[5], share[5];
                TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                      dipole_init(sigma_a[i], sigma_s_prime[j], eta[k], &d));
                dipole_profile(&d, 5, r_mm, rd);
                dipole_cumulative(&d, 5, r_mm, share);
                double total = dipole_total(&d);
                TEST_ASSERT_TRUE(total >= 0.0 && total <= 1.0);
                for (size_t n = 0; n < 5; n++) {
                    TEST_ASSERT_TRUE(isfinite(rd[n]) && rd[n] >= 0.0);
                    TEST_ASSERT_TRUE(share[n] >= 0.0 && share[n] <= total + 1e-15);
                }
            }
        }
    }
}

/* The results may take the place of the distances; no distance is fine too. */
static void test_in_place(void)
{
    static const double r_mm[] = { 0.0, 0.01, 0.3, 2.0, 40.0 };
    double rd[5], share[5], place[5];
    struct dipole d;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(0.3, 2.5, 1.4, &d));
    dipole_profile(&d, 5, r_mm, rd);
    dipole_cumulative(&d, 5, r_mm, share);
    memcpy(place, r_mm, sizeof place);
    dipole_profile(&d, 5, place, place);
    TEST_ASSERT_EQUAL_MEMORY(rd, place, sizeof place);
    memcpy(place, r_mm, sizeof place);
    dipole_cumulative(&d, 5, place, place);
    TEST_ASSERT_EQUAL_MEMORY(share, place, sizeof place);
    dipole_profile(&d, 0, NULL, NULL);
    dipole_cumulative(&d, 0, NULL, NULL);
}

/* expect: 1 - Eq. 9 in 60-digit decimals. */
static const struct absorbed_case {
    const char *what;
    double sigma_a, sigma_s_prime, eta, expect;
} absorbed_cases[] = {
    { "nothing absorbs", 0.0, 5.0, 1.4, 0.0 },
    { "next to nothing: 1 - R has one digit", 1e-16, 5.0, 1.4, 2.4532495779240772464e-8 },
    { "little", 1e-12, 5.0, 1.4, 2.4532454019560911563e-6 },
    { "moderate", 0.1, 1.0, 1.3, 0.68632078983537982016 },
    { "nothing else", 1e12, 1e-6, 1.0, 1.0 },
};

static void test_absorbed_share_keeps_its_digits(void)
{
    for (size_t i = 0; i < sizeof absorbed_cases / sizeof *absorbed_cases; i++) {
        const struct absorbed_case *c = &absorbed_cases[i];
        struct dipole d;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, dipole_init(c->sigma_a, c->sigma_s_prime, c->eta, &d));
        assert_relative(2e-15, c->expect, dipole_absorbed_share(&d), c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_index);
    RUN_TEST(test_ranges);
    RUN_TEST(test_A_refuses);
    RUN_TEST(test_members);
    RUN_TEST(test_reference);
    RUN_TEST(test_profile_integrates_to_total);
    RUN_TEST(test_cumulative);
    RUN_TEST(test_no_absorption_returns_all);
    RUN_TEST(test_lengths_scale_out);
    RUN_TEST(test_extremes_stay_finite);
    RUN_TEST(test_in_place);
    RUN_TEST(test_absorbed_share_keeps_its_digits);
    return UNITY_END();
}
