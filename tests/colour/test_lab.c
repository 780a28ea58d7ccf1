/* test_lab.c - L*a*b*, LCh and ITA. */
#include "colour/lab.h"

#include <math.h>
#include <stdlib.h>

#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* Y of a grey under white Y = 100: CIE 15 8.2.1 with (6/29)^3 = 216/24389 and
 * 24389/27 = 903.2963, and Lindbloom's note on the two constants. */
static const struct grey_case {
    const char *what;
    double Y, L, tol;
} grey_cases[] = {
    { "black", 0.0, 0.0, 1e-14 },
    { "white", 100.0, 100.0, 1e-13 },
    { "middle grey: 100 ((50 + 16)/116)^3", 18.418651851244415, 50.0, 1e-12 },
    { "line meets cube root at L = 8 (kappa epsilon = 8)", 21600.0 / 24389.0, 8.0, 1e-12 },
    { "on the line: kappa Y/Yn = 0.9032963", 0.1, 0.90329629629629629, 1e-13 },
    { "above white: 2^3 is the cube of 2", 800.0, 216.0, 1e-12 },
    { "below black the line goes on", -0.1, -0.90329629629629629, 1e-13 },
};

static void test_grey_scale(void)
{
    static const double white[3] = { 95.047, 100.0, 108.883 };
    for (size_t i = 0; i < sizeof grey_cases / sizeof *grey_cases; i++) {
        const struct grey_case *c = &grey_cases[i];
        double XYZ[3] = { white[0] * c->Y / 100.0, c->Y, white[2] * c->Y / 100.0 }, Lab[3];
        lab_from_xyz(XYZ, white, Lab);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->tol, c->L, Lab[0], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, Lab[1], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, Lab[2], c->what);
    }
}

/* Exact to both sides of the threshold: with the rounded 0.008856 and 903.3 of
 * older texts the curve would jump by 1e-5 here. */
static void test_no_step_at_the_threshold(void)
{
    static const double white[3] = { 100.0, 100.0, 100.0 };
    double t = 21600.0 / 24389.0, below[3], above[3];
    lab_from_xyz((double[]){ t * (1 - 1e-15), t * (1 - 1e-15), t * (1 - 1e-15) }, white, below);
    lab_from_xyz((double[]){ t * (1 + 1e-15), t * (1 + 1e-15), t * (1 + 1e-15) }, white, above);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, below[0], above[0]);
}

/* The sRGB primaries under D65 (95.047, 100, 108.883): XYZ are the columns of
 * Lindbloom's seven-digit sRGB matrix, Lab what his calculator prints. */
static const struct lab_case {
    const char *what;
    double XYZ[3], Lab[3];
} lab_cases[] = {
    { "red", { 41.24564, 21.26729, 1.93339 }, { 53.2408, 80.0925, 67.2032 } },
    { "green", { 35.75761, 71.51522, 11.91920 }, { 87.7347, -86.1827, 83.1793 } },
    { "blue", { 18.04375, 7.21750, 95.03041 }, { 32.2970, 79.1875, -107.8602 } },
};

static void test_published_colours(void)
{
    static const double white[3] = { 95.047, 100.0, 108.883 };
    for (size_t i = 0; i < sizeof lab_cases / sizeof *lab_cases; i++) {
        const struct lab_case *c = &lab_cases[i];
        double Lab[3];
        lab_from_xyz(c->XYZ, white, Lab);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(6e-5, c->Lab[k], Lab[k], c->what);
    }
}

/* Property: there and back again, both branches of f in every channel. */
static void test_round_trip(void)
{
    static const double white[3] = { 109.85, 100.0, 35.585 };
    for (int i = -1; i <= 12; i++) {
        for (int j = -1; j <= 12; j++) {
            for (int k = -1; k <= 12; k++) {
                double XYZ[3] = { 0.3 * i * abs(i), 0.8 * j * abs(j), 0.2 * k * abs(k) };
                double Lab[3], back[3];
                lab_from_xyz(XYZ, white, Lab);
                lab_to_xyz(Lab, white, back);
                for (int c = 0; c < 3; c++)
                    TEST_ASSERT_DOUBLE_WITHIN(2e-13, XYZ[c], back[c]);
            }
        }
    }
}

/* Angles by geometry. */
static const struct lch_case {
    const char *what;
    double a, b, C, h;
} lch_cases[] = {
    { "+a is 0", 3.0, 0.0, 3.0, 0.0 },
    { "+b is 90", 0.0, 3.0, 3.0, 90.0 },
    { "-a is 180", -3.0, 0.0, 3.0, 180.0 },
    { "-b is 270, not -90", 0.0, -3.0, 3.0, 270.0 },
    { "3-4-5 triangle", 3.0, 4.0, 5.0, 53.130102354155980 },
    { "fourth quadrant", 3.0, -4.0, 5.0, 306.86989764584402 },
    { "grey has hue 0", 0.0, 0.0, 0.0, 0.0 },
    { "so has grey with negative zeros", -0.0, -0.0, 0.0, 0.0 },
    { "a hair below 0 is not 360", 1.0, -1e-20, 1.0, 0.0 },
};

static void test_lch(void)
{
    for (size_t i = 0; i < sizeof lch_cases / sizeof *lch_cases; i++) {
        const struct lch_case *c = &lch_cases[i];
        double Lab[3] = { 61.0, c->a, c->b }, LCh[3], back[3];
        lab_to_lch(Lab, LCh);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(61.0, LCh[0], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, c->C, LCh[1], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, c->h, LCh[2], c->what);
        TEST_ASSERT_TRUE_MESSAGE(LCh[2] >= 0.0 && LCh[2] < 360.0, c->what);
        lab_from_lch(LCh, back);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, Lab[k], back[k], c->what);
    }
}

/* ITA = atan((L* - 50)/b*) 180/pi, by hand. */
static const struct ita_case {
    const char *what;
    double L, b, expect;
} ita_cases[] = {
    { "45 degrees", 60.0, 10.0, 45.0 },
    { "L* = 50 is 0", 50.0, 10.0, 0.0 },
    { "dark skin: atan(-1)", 40.0, 10.0, -45.0 },
    { "atan(sqrt 3)", 67.320508075688773, 10.0, 60.0 },
    { "b* = 0 is 90, not a division by zero", 70.0, 0.0, 90.0 },
    { "bluish and light: past 90, so still the lightest", 60.0, -10.0, 135.0 },
    { "bluish and dark: so still the darkest", 40.0, -10.0, -135.0 },
};

static void test_ita(void)
{
    for (size_t i = 0; i < sizeof ita_cases / sizeof *ita_cases; i++) {
        const struct ita_case *c = &ita_cases[i];
        double Lab[3] = { c->L, 12.0, c->b };
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, c->expect, lab_ita_deg(Lab), c->what);
    }
}

/* Del Bino and Bernerd 2013: > 55 very light, > 41 light, > 28 intermediate,
 * > 10 tan, > -30 brown, <= -30 dark. */
static const struct class_case {
    double ita_deg;
    const char *expect;
} class_cases[] = {
    { 90.0, "very light" },   { 55.001, "very light" },   { 55.0, "light" },    { 41.001, "light" },
    { 41.0, "intermediate" }, { 28.001, "intermediate" }, { 28.0, "tan" },      { 10.001, "tan" },
    { 10.0, "brown" },        { 0.0, "brown" },           { -29.999, "brown" }, { -30.0, "dark" },
    { -90.0, "dark" },        { 135.0, "very light" },    { NAN, "unknown" },
};

static void test_ita_classes(void)
{
    for (size_t i = 0; i < sizeof class_cases / sizeof *class_cases; i++)
        TEST_ASSERT_EQUAL_STRING(class_cases[i].expect, lab_ita_class(class_cases[i].ita_deg));
    TEST_ASSERT_EQUAL_STRING("del-bino-2013", LAB_ITA_SCHEME);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grey_scale);
    RUN_TEST(test_no_step_at_the_threshold);
    RUN_TEST(test_published_colours);
    RUN_TEST(test_round_trip);
    RUN_TEST(test_lch);
    RUN_TEST(test_ita);
    RUN_TEST(test_ita_classes);
    return UNITY_END();
}
