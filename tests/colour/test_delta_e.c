/* test_delta_e.c - colour differences against published pairs, and the bound that
 * searches prune with. */
#include "colour/delta_e.h"

#include <math.h>
#include <stdio.h>

#include "tests/support/sharma_pairs.h"
#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

static void test_sharma_pairs_both_ways(void)
{
    for (size_t i = 0; i < sizeof sharma_cases / sizeof *sharma_cases; i++) {
        const struct sharma_case *c = &sharma_cases[i];
        char what[32];
        snprintf(what, sizeof what, "pair %d", c->pair);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-5, c->expect, delta_e_2000(c->Lab1, c->Lab2), what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-5, c->expect, delta_e_2000(c->Lab2, c->Lab1), what);
    }
}

/* A repeatable stream of colours: L -20..120, a and b -130..130. */
static unsigned long stream = 1;
static double next(double low, double high)
{
    stream = (stream * 1103515245UL + 12345UL) & 0x7fffffffUL; /* C11 7.22.2.2, example */
    return low + (high - low) * (double)(stream >> 8) / (double)(0x7fffffffUL >> 8);
}
static void next_Lab(double Lab[3])
{
    Lab[0] = next(-20.0, 120.0);
    Lab[1] = next(-130.0, 130.0);
    Lab[2] = next(-130.0, 130.0);
}

/* Properties on 20 000 pairs: symmetric, 0 for the same colour, and never below its
 * own lightness term, to the last bit. */
static void test_symmetry_and_bound(void)
{
    for (int i = 0; i < 20000; i++) {
        double p[3], q[3], d;
        next_Lab(p);
        next_Lab(q);
        d = delta_e_2000(p, q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, d, delta_e_2000(q, p));
        TEST_ASSERT_EQUAL_DOUBLE(0.0, delta_e_2000(p, p));
        TEST_ASSERT_TRUE(d >= delta_e_2000_lightness(p[0], q[0]));
    }
}

/* By hand from CIE 142: with a = b = 0 only dL/S_L is left. */
static const struct lightness_case {
    const char *what;
    double L1, L2, expect, tol;
} lightness_cases[] = {
    { "around 50, S_L = 1", 45.0, 55.0, 10.0, 1e-14 },
    { "equal", 30.0, 30.0, 0.0, 0.0 },
    { "mean 60: 10/(1 + 1.5/sqrt(120))", 55.0, 65.0, 8.7956113184581763, 1e-13 },
    { "mean 40, the same by symmetry", 45.0, 35.0, 8.7956113184581763, 1e-13 },
    { "black and white, mean 50", 0.0, 100.0, 100.0, 1e-13 },
};

static void test_lightness_alone(void)
{
    for (size_t i = 0; i < sizeof lightness_cases / sizeof *lightness_cases; i++) {
        const struct lightness_case *c = &lightness_cases[i];
        double grey1[3] = { c->L1, 0.0, 0.0 }, grey2[3] = { c->L2, 0.0, 0.0 };
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->tol, c->expect, delta_e_2000_lightness(c->L1, c->L2),
                                          c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->tol, c->expect, delta_e_2000(grey1, grey2), c->what);
    }
}

/* Does the term grow with distance from L1, both ways, while both stay in
 * low .. high?  Scanned by 1/4 in both. */
static int grows_within(double low, double high)
{
    for (double L1 = low; L1 <= high; L1 += 0.25) {
        double last = 0.0;
        for (double L2 = L1 + 0.25; L2 <= high; L2 += 0.25) {
            double now = delta_e_2000_lightness(L1, L2);
            if (now <= last)
                return 0;
            last = now;
        }
        last = 0.0;
        for (double L2 = L1 - 0.25; L2 >= low; L2 -= 0.25) {
            double now = delta_e_2000_lightness(L1, L2);
            if (now <= last)
                return 0;
            last = now;
        }
    }
    return 1;
}

/* The range the header claims, and that it is not a modest one. */
static void test_lightness_grows_in_its_range(void)
{
    TEST_ASSERT_TRUE(grows_within(-20.0, 120.0));
    TEST_ASSERT_FALSE(grows_within(-21.0, 121.0));
    TEST_ASSERT_TRUE(delta_e_2000_lightness(-90.0, 200.0) < delta_e_2000_lightness(-90.0, 199.0));
}

/* Far outside any gamut the hue and chroma terms nearly cancel (R_T -> -2); the sum
 * must stay a number and not below its lightness term. */
static void test_enormous_chroma_stays_finite(void)
{
    for (int i = 0; i < 360; i++) {
        double t = i * 3.14159265358979323846 / 180.0;
        double p[3] = { 50.0, 1e5 * cos(t), 1e5 * sin(t) };
        double q[3] = { 51.0, 1.1e5 * cos(t + 0.1), 1.1e5 * sin(t + 0.1) };
        double d = delta_e_2000(p, q);
        TEST_ASSERT_TRUE(isfinite(d));
        TEST_ASSERT_TRUE(d >= delta_e_2000_lightness(50.0, 51.0));
    }
}

/* CIE 1976: Euclid, by hand. */
static void test_delta_e_ab(void)
{
    static const double p[3] = { 50.0, 10.0, -5.0 }, q[3] = { 52.0, 13.0, 1.0 };
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 7.0, delta_e_ab(p, q));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 7.0, delta_e_ab(q, p));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, delta_e_ab(p, p));
}

/* Not measured stays not measured. */
static void test_nan_passes_through(void)
{
    static const double p[3] = { 50.0, 10.0, -5.0 };
    for (int k = 0; k < 3; k++) {
        double q[3] = { 50.0, 10.0, -5.0 };
        q[k] = NAN;
        TEST_ASSERT_TRUE(isnan(delta_e_2000(p, q)));
        TEST_ASSERT_TRUE(isnan(delta_e_2000(q, p)));
        TEST_ASSERT_TRUE(isnan(delta_e_ab(p, q)));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sharma_pairs_both_ways);
    RUN_TEST(test_symmetry_and_bound);
    RUN_TEST(test_lightness_alone);
    RUN_TEST(test_lightness_grows_in_its_range);
    RUN_TEST(test_enormous_chroma_stays_finite);
    RUN_TEST(test_delta_e_ab);
    RUN_TEST(test_nan_passes_through);
    return UNITY_END();
}
