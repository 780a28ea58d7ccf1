/* test_xyz.c - spectra to XYZ: whites, folding, grids, published and measured
 * colours.  SKINSPEC_MEASURED names the folder with expected_colorimetry.csv. */
#include "colour/xyz.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

#include "colour/lab.h"

void setUp(void)
{
}
void tearDown(void)
{
}

static const struct {
    const char *what;
    double first_nm, step_nm;
    size_t n;
} grids[] = {
    { "10 nm, wider than the tables", 300.0, 10.0, 61 },
    { "10 nm, the tables' range", 360.0, 10.0, 43 },
    { "10 nm, 380..730", 380.0, 10.0, 36 },
    { "10 nm, the narrowest", 400.0, 10.0, 31 },
    { "5 nm, wider than the tables", 300.0, 5.0, 121 },
    { "5 nm, 380..780", 380.0, 5.0, 81 },
    { "5 nm, the narrowest", 400.0, 5.0, 61 },
    { "1 nm, wider than the tables", 300.0, 1.0, 601 },
    { "1 nm, an odd start", 383.0, 1.0, 391 },
    { "1 nm, the narrowest", 400.0, 1.0, 301 },
};
enum { GRIDS = sizeof grids / sizeof *grids };

static struct xyz_weights weights_of(enum illuminant illuminant, enum observer observer,
                                     double first_nm, double step_nm, size_t n)
{
    struct xyz_weights w;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          xyz_weights_init(illuminant, observer, first_nm, step_nm, n, &w));
    TEST_ASSERT_EQUAL_UINT(n, w.n);
    return w;
}

/* White points as published.  x, y: CIE 15:2004 (A, C, D; FL with 2 degrees) and CIE
 * 15:2018 (LED-B3 with 2 degrees); E: 1/3 by definition; FL with 10 degrees: the list of white
 * points in Wikipedia's "Standard illuminant"; LED-B3 with 10 degrees: the colour-science package.
 * CIE prints 5 nm sums (met to 3e-5, FL to their four decimals); Wikipedia's FL rows
 * are 10 nm sums.  Between 5 and 10 nm lie up to 2.2e-4 (FL: lines between bands). */
static const struct white_case {
    enum illuminant illuminant;
    enum observer observer;
    double x, y, tol_5nm, tol_10nm;
} white_cases[] = {
    { ILLUMINANT_A, OBSERVER_2DEG, 0.44758, 0.40745, 3e-5, 3e-5 },
    { ILLUMINANT_C, OBSERVER_2DEG, 0.31006, 0.31616, 3e-5, 7e-5 },
    { ILLUMINANT_D50, OBSERVER_2DEG, 0.34567, 0.35851, 3e-5, 3e-5 },
    { ILLUMINANT_D55, OBSERVER_2DEG, 0.33243, 0.34744, 3e-5, 3e-5 },
    { ILLUMINANT_D65, OBSERVER_2DEG, 0.31272, 0.32903, 3e-5, 3e-5 },
    { ILLUMINANT_D75, OBSERVER_2DEG, 0.29903, 0.31488, 4e-5, 3e-5 },
    { ILLUMINANT_E, OBSERVER_2DEG, 1.0 / 3, 1.0 / 3, 5e-5, 5e-5 },
    { ILLUMINANT_FL2, OBSERVER_2DEG, 0.3721, 0.3751, 6e-5, 2.5e-4 },
    { ILLUMINANT_FL7, OBSERVER_2DEG, 0.3129, 0.3292, 6e-5, 2.5e-4 },
    { ILLUMINANT_FL11, OBSERVER_2DEG, 0.3805, 0.3769, 6e-5, 2.5e-4 },
    { ILLUMINANT_LED_B3, OBSERVER_2DEG, 0.3756, 0.3723, 6e-5, 2.5e-4 },
    { ILLUMINANT_A, OBSERVER_10DEG, 0.45117, 0.40594, 3e-5, 3e-5 },
    { ILLUMINANT_C, OBSERVER_10DEG, 0.31039, 0.31905, 3e-5, 8e-5 },
    { ILLUMINANT_D50, OBSERVER_10DEG, 0.34773, 0.35952, 3e-5, 3e-5 },
    { ILLUMINANT_D55, OBSERVER_10DEG, 0.33412, 0.34877, 3e-5, 3e-5 },
    { ILLUMINANT_D65, OBSERVER_10DEG, 0.31382, 0.33100, 3e-5, 3e-5 },
    { ILLUMINANT_D75, OBSERVER_10DEG, 0.29968, 0.31740, 3e-5, 4e-5 },
    { ILLUMINANT_E, OBSERVER_10DEG, 1.0 / 3, 1.0 / 3, 5e-5, 5e-5 },
    { ILLUMINANT_FL2, OBSERVER_10DEG, 0.37925, 0.36733, 1.5e-4, 1e-5 },
    { ILLUMINANT_FL7, OBSERVER_10DEG, 0.31569, 0.32960, 1.5e-4, 1e-5 },
    { ILLUMINANT_FL11, OBSERVER_10DEG, 0.38541, 0.37123, 1.5e-4, 1e-5 },
    { ILLUMINANT_LED_B3, OBSERVER_10DEG, 0.380852, 0.368519, 1e-5, 2.5e-4 },
};

static void check_white(const struct white_case *c, double step_nm, size_t n, double tol)
{
    struct xyz_weights w = weights_of(c->illuminant, c->observer, 380.0, step_nm, n);
    double sum = w.white[0] + w.white[1] + w.white[2];
    char what[64];
    snprintf(what, sizeof what, "%s, %s degrees, %.0f nm", illuminant_name(c->illuminant),
             observer_name(c->observer), step_nm);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol, c->x, w.white[0] / sum, what);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol, c->y, w.white[1] / sum, what);
}

static void test_whites_as_published(void)
{
    TEST_ASSERT_EQUAL_UINT(ILLUMINANT_COUNT * OBSERVER_COUNT,
                           sizeof white_cases / sizeof *white_cases);
    for (size_t i = 0; i < sizeof white_cases / sizeof *white_cases; i++) {
        check_white(&white_cases[i], 1.0, 401, 2.5e-4);
        check_white(&white_cases[i], 5.0, 81, white_cases[i].tol_5nm);
        check_white(&white_cases[i], 10.0, 41, white_cases[i].tol_10nm);
    }
}

/* ASTM E308 Table 5's white points, X and Z for Y = 100; the 10 nm sums there carry
 * three decimals per weight. */
static const struct e308_case {
    enum illuminant illuminant;
    enum observer observer;
    double X, Z;
} e308_cases[] = {
    { ILLUMINANT_A, OBSERVER_2DEG, 109.850, 35.585 },
    { ILLUMINANT_C, OBSERVER_2DEG, 98.074, 118.232 },
    { ILLUMINANT_D50, OBSERVER_2DEG, 96.422, 82.521 },
    { ILLUMINANT_D55, OBSERVER_2DEG, 95.682, 92.149 },
    { ILLUMINANT_D65, OBSERVER_2DEG, 95.047, 108.883 },
    { ILLUMINANT_D75, OBSERVER_2DEG, 94.972, 122.638 },
    { ILLUMINANT_A, OBSERVER_10DEG, 111.144, 35.200 },
    { ILLUMINANT_C, OBSERVER_10DEG, 97.285, 116.145 },
    { ILLUMINANT_D50, OBSERVER_10DEG, 96.720, 81.427 },
    { ILLUMINANT_D55, OBSERVER_10DEG, 95.799, 90.926 },
    { ILLUMINANT_D65, OBSERVER_10DEG, 94.811, 107.304 },
    { ILLUMINANT_D75, OBSERVER_10DEG, 94.416, 120.641 },
};

static void test_whites_as_E308_prints_them(void)
{
    for (size_t i = 0; i < sizeof e308_cases / sizeof *e308_cases; i++) {
        const struct e308_case *c = &e308_cases[i];
        struct xyz_weights fine = weights_of(c->illuminant, c->observer, 380.0, 5.0, 81);
        struct xyz_weights bands = weights_of(c->illuminant, c->observer, 380.0, 10.0, 41);
        const char *what = illuminant_name(c->illuminant);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.002, c->X, fine.white[0], what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.021, c->Z, fine.white[2], what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.013, c->X, bands.white[0], what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.06, c->Z, bands.white[2], what);
    }
}

/* Property: at one step, the white is the same on every grid, its Y is 100
 * (10 nm: 43 weights of six decimals), and a perfect white measures as it exactly. */
static void test_folding_leaves_the_white(void)
{
    for (int il = 0; il < ILLUMINANT_COUNT; il++) {
        for (int o = 0; o < OBSERVER_COUNT; o++) {
            double white[3] = { 0.0, 0.0, 0.0 }, step_nm = 0.0, ones[SPECTRUM_MAX_BANDS], XYZ[3];
            for (size_t i = 0; i < SPECTRUM_MAX_BANDS; i++)
                ones[i] = 1.0;
            for (size_t g = 0; g < GRIDS; g++) {
                struct xyz_weights w = weights_of((enum illuminant)il, (enum observer)o,
                                                  grids[g].first_nm, grids[g].step_nm, grids[g].n);
                double tol = grids[g].step_nm > 5.0 ? 43 * 5e-7 : 1e-11;
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol, 100.0, w.white[1], grids[g].what);
                xyz_from_reflectance(&w, ones, XYZ);
                for (int k = 0; k < 3; k++) {
                    if (grids[g].step_nm == step_nm)
                        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-11, white[k], w.white[k],
                                                          grids[g].what);
                    else
                        white[k] = w.white[k];
                    TEST_ASSERT_TRUE(XYZ[k] == w.white[k]);
                }
                step_nm = grids[g].step_nm;
            }
        }
    }
}

/* The first and last band of 400..700, added by hand from the given tables. */
static void test_folding_adds_to_the_end_bands(void)
{
    struct xyz_weights w = weights_of(ILLUMINANT_D65, OBSERVER_10DEG, 400.0, 10.0, 31);
    static const double first[3] = { 0.143926, 0.015129, 0.643103 };
    static const double inner[3] = { 4.732429, 8.854550, 0.034538 }; /* 550 nm, as given */
    static const double last[3] = { 0.110484, 0.042935, 0.0 };
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, first[k], w.weight[0][k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, inner[k], w.weight[15][k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, last[k], w.weight[30][k]);
    }
}

static void test_bands_beyond_the_tables_weigh_nothing(void)
{
    struct xyz_weights ten = weights_of(ILLUMINANT_E, OBSERVER_2DEG, 300.0, 10.0, 61);
    struct xyz_weights one = weights_of(ILLUMINANT_E, OBSERVER_2DEG, 300.0, 1.0, 601);
    struct xyz_weights lamp = weights_of(ILLUMINANT_FL2, OBSERVER_2DEG, 360.0, 1.0, 471);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, ten.weight[5][0]);          /* 350 nm */
    TEST_ASSERT_TRUE(ten.weight[6][0] != 0.0);                /* 360 nm */
    TEST_ASSERT_TRUE(ten.weight[48][0] != 0.0);               /* 780 nm */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, ten.weight[49][0]);         /* 790 nm */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, one.weight[59][0]);         /* 359 nm */
    TEST_ASSERT_TRUE(one.weight[60][0] > 0.0);                /* 360 nm */
    TEST_ASSERT_TRUE(one.weight[530][0] > 0.0);               /* 830 nm */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, one.weight[531][0]);        /* 831 nm */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, lamp.weight[379 - 360][0]); /* no ramp up to 380 */
    TEST_ASSERT_TRUE(lamp.weight[380 - 360][0] > 0.0);
    TEST_ASSERT_TRUE(lamp.weight[780 - 360][0] > 0.0);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, lamp.weight[781 - 360][0]); /* nor down from 780 */
}

/* Direct sums by hand.  E, 2 degrees: ybar(555) = 1, and the 5 nm sum of ybar over
 * 360..830 is 21.371408.  Inside 5 nm D65 goes straight: at 501 nm one fifth from
 * 109.354 to 108.578 is 109.1988, against 100 at 560; A is Planck's law, 0.604702777492
 * at 501 by 40-digit decimals; CIE 15 has ybar 0.3384021 and 0.995 there. */
static void test_direct_sums(void)
{
    struct xyz_weights five = weights_of(ILLUMINANT_E, OBSERVER_2DEG, 360.0, 5.0, 95);
    struct xyz_weights one = weights_of(ILLUMINANT_D65, OBSERVER_2DEG, 360.0, 1.0, 471);
    struct xyz_weights lamp = weights_of(ILLUMINANT_A, OBSERVER_2DEG, 360.0, 1.0, 471);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 100.0 / 21.371408, five.weight[39][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.091988 * 0.3384021 / 0.995,
                              one.weight[501 - 360][1] / one.weight[560 - 360][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.604702777492 * 0.3384021 / 0.995,
                              lamp.weight[501 - 360][1] / lamp.weight[560 - 360][1]);
}

/* A smooth reflectance the shape of skin: a rise through the red and a dip. */
static double smooth(double nm)
{
    return 0.25 + 0.30 / (1.0 + exp(-(nm - 590.0) / 18.0)) -
           0.06 * exp(-pow((nm - 555.0) / 22.0, 2.0)) - 0.05 * exp(-pow((nm - 418.0) / 20.0, 2.0));
}

/* The steps must agree where the reflectance is smooth: E2022 weights were made so
 * that 10 nm data stand for 1 nm (0.003 but for lamps with lines, 0.009; they keep
 * power below 380 nm that the sums have not).  5 nm carries no interpolation, so
 * lines tell it from 1 nm by up to 0.04. */
static void test_steps_agree_on_a_smooth_spectrum(void)
{
    double value[3][SPECTRUM_MAX_BANDS];
    for (size_t i = 0; i < 43; i++)
        value[0][i] = smooth(360.0 + 10.0 * (double)i);
    for (size_t i = 0; i < 85; i++)
        value[1][i] = smooth(360.0 + 5.0 * (double)i);
    for (size_t i = 0; i < 421; i++)
        value[2][i] = smooth(360.0 + (double)i);
    for (int il = 0; il < ILLUMINANT_COUNT; il++) {
        for (int o = 0; o < OBSERVER_COUNT; o++) {
            enum illuminant illuminant = (enum illuminant)il;
            struct xyz_weights w10 = weights_of(illuminant, (enum observer)o, 360.0, 10.0, 43);
            struct xyz_weights w5 = weights_of(illuminant, (enum observer)o, 360.0, 5.0, 85);
            struct xyz_weights w1 = weights_of(illuminant, (enum observer)o, 360.0, 1.0, 421);
            double X10[3], X5[3], X1[3];
            xyz_from_reflectance(&w10, value[0], X10);
            xyz_from_reflectance(&w5, value[1], X5);
            xyz_from_reflectance(&w1, value[2], X1);
            for (int k = 0; k < 3; k++) {
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01, X1[k], X10[k], illuminant_name(illuminant));
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.05, X1[k], X5[k], illuminant_name(illuminant));
            }
        }
    }
}

/* NaN must show, even where the weight is 0. */
static void test_nan_shows(void)
{
    struct xyz_weights w = weights_of(ILLUMINANT_D65, OBSERVER_10DEG, 350.0, 10.0, 44);
    double value[44] = { 0.0 }, XYZ[3];
    value[0] = NAN;
    xyz_from_reflectance(&w, value, XYZ);
    for (int k = 0; k < 3; k++)
        TEST_ASSERT_TRUE(isnan(XYZ[k]));
}

/* Every refusal the header promises. */
static const struct refusal_case {
    const char *what;
    double first_nm, step_nm;
    size_t n;
    enum status expect;
} refusal_cases[] = {
    { "no bands", 400.0, 10.0, 0, STATUS_RANGE },
    { "too many bands", 0.0, 1.0, SPECTRUM_MAX_BANDS + 1, STATUS_RANGE },
    { "first is NaN", NAN, 10.0, 31, STATUS_RANGE },
    { "first is infinite", -INFINITY, 10.0, 31, STATUS_RANGE },
    { "step is NaN", 400.0, NAN, 31, STATUS_RANGE },
    { "step is infinite", 400.0, INFINITY, 31, STATUS_RANGE },
    { "20 nm", 400.0, 20.0, 16, STATUS_UNSUPPORTED },
    { "0 nm", 400.0, 0.0, 31, STATUS_UNSUPPORTED },
    { "backwards", 700.0, -10.0, 31, STATUS_UNSUPPORTED },
    { "10.1 nm", 400.0, 10.1, 31, STATUS_UNSUPPORTED },
    { "10 nm on fives", 395.0, 10.0, 32, STATUS_UNSUPPORTED },
    { "5 nm off the fives", 398.0, 5.0, 62, STATUS_UNSUPPORTED },
    { "1 nm on halves", 399.5, 1.0, 302, STATUS_UNSUPPORTED },
    { "starts at 410", 410.0, 10.0, 31, STATUS_RANGE },
    { "starts at 401", 401.0, 1.0, 301, STATUS_RANGE },
    { "ends at 690", 400.0, 10.0, 30, STATUS_RANGE },
    { "ends at 695", 400.0, 5.0, 60, STATUS_RANGE },
    { "absurdly far away", -1e300, 10.0, 31, STATUS_RANGE },
    { "a rounding of 400 and 10 is forgiven", 399.9999999, 10.0000001, 31, STATUS_OK },
    { "the most bands", 0.0, 1.0, SPECTRUM_MAX_BANDS, STATUS_OK },
};

static void test_refusals(void)
{
    static struct xyz_weights w, before;
    memset(&before, 0x5a, sizeof before);
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        w = before;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->expect,
            xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, c->first_nm, c->step_nm, c->n, &w),
            c->what);
        if (c->expect != STATUS_OK)
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &w, sizeof w, c->what);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          xyz_weights_init(ILLUMINANT_COUNT, OBSERVER_2DEG, 400.0, 10.0, 31, &w));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE,
                          xyz_weights_init(ILLUMINANT_A, OBSERVER_COUNT, 400.0, 10.0, 31, &w));
}

/* ColorChecker, BabelColor's average of 30 charts (D. Pascale, 2012): reflectance
 * 380..730 by 10, three decimals, and x, y, Y under D50, 2 degrees as he prints them.
 * The rounding of dark patches alone moves x and y by 0.0005 and Y by 0.03. */
/* clang-format off */
static const struct patch_case {
    const char *what;
    double x, y, Y;
    double value[36];
} patch_cases[] = {
    { "dark skin", 0.4325, 0.3788, 10.34,
      { 0.055, 0.058, 0.061, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.063,
        0.065, 0.07, 0.076, 0.079, 0.081, 0.084, 0.091, 0.103, 0.119, 0.134, 0.143, 0.147,
        0.151, 0.158, 0.168, 0.179, 0.188, 0.19, 0.186, 0.181, 0.182, 0.187, 0.196, 0.209 } },
    { "light skin", 0.4191, 0.3748, 35.25,
      { 0.117, 0.143, 0.175, 0.191, 0.196, 0.199, 0.204, 0.213, 0.228, 0.251, 0.28, 0.309,
        0.329, 0.333, 0.315, 0.286, 0.273, 0.276, 0.277, 0.289, 0.339, 0.42, 0.488, 0.525,
        0.546, 0.562, 0.578, 0.595, 0.612, 0.625, 0.638, 0.656, 0.678, 0.7, 0.717, 0.734 } },
    { "blue sky", 0.2761, 0.3004, 18.47,
      { 0.13, 0.177, 0.251, 0.306, 0.324, 0.33, 0.333, 0.331, 0.323, 0.311, 0.298, 0.285,
        0.269, 0.25, 0.231, 0.214, 0.199, 0.185, 0.169, 0.157, 0.149, 0.145, 0.142, 0.141,
        0.141, 0.141, 0.143, 0.147, 0.152, 0.154, 0.15, 0.144, 0.136, 0.132, 0.135, 0.147 } },
    { "foliage", 0.3700, 0.4501, 13.35,
      { 0.051, 0.054, 0.056, 0.057, 0.058, 0.059, 0.06, 0.061, 0.062, 0.063, 0.065, 0.067,
        0.075, 0.101, 0.145, 0.178, 0.184, 0.17, 0.149, 0.133, 0.122, 0.115, 0.109, 0.105,
        0.104, 0.106, 0.109, 0.112, 0.114, 0.114, 0.112, 0.112, 0.115, 0.12, 0.125, 0.13 } },
    { "blue", 0.2040, 0.1696, 5.79,
      { 0.066, 0.079, 0.102, 0.146, 0.2, 0.244, 0.282, 0.309, 0.308, 0.278, 0.231, 0.178,
        0.13, 0.094, 0.07, 0.054, 0.046, 0.042, 0.039, 0.038, 0.038, 0.038, 0.038, 0.039,
        0.039, 0.04, 0.041, 0.042, 0.044, 0.045, 0.046, 0.046, 0.048, 0.052, 0.057, 0.065 } },
    { "green", 0.3270, 0.5033, 23.07,
      { 0.052, 0.053, 0.054, 0.055, 0.057, 0.059, 0.061, 0.066, 0.075, 0.093, 0.125, 0.178,
        0.246, 0.307, 0.337, 0.334, 0.317, 0.293, 0.262, 0.23, 0.198, 0.165, 0.135, 0.115,
        0.104, 0.098, 0.094, 0.092, 0.093, 0.097, 0.102, 0.108, 0.113, 0.115, 0.114, 0.114 } },
    { "red", 0.5709, 0.3298, 12.68,
      { 0.05, 0.049, 0.048, 0.047, 0.047, 0.047, 0.047, 0.047, 0.046, 0.045, 0.044, 0.044,
        0.045, 0.046, 0.047, 0.048, 0.049, 0.05, 0.054, 0.06, 0.072, 0.104, 0.178, 0.312,
        0.467, 0.581, 0.644, 0.675, 0.69, 0.698, 0.706, 0.715, 0.724, 0.73, 0.734, 0.738 } },
    { "yellow", 0.4694, 0.4732, 60.81,
      { 0.058, 0.054, 0.052, 0.052, 0.053, 0.054, 0.056, 0.059, 0.067, 0.081, 0.107, 0.152,
        0.225, 0.336, 0.462, 0.559, 0.616, 0.65, 0.672, 0.694, 0.71, 0.723, 0.731, 0.739,
        0.746, 0.752, 0.758, 0.764, 0.769, 0.771, 0.776, 0.782, 0.79, 0.796, 0.799, 0.804 } },
    { "cyan", 0.2151, 0.3037, 19.03,
      { 0.108, 0.141, 0.192, 0.236, 0.261, 0.286, 0.317, 0.353, 0.39, 0.426, 0.446, 0.444,
        0.423, 0.385, 0.337, 0.283, 0.231, 0.185, 0.146, 0.118, 0.101, 0.09, 0.082, 0.076,
        0.074, 0.073, 0.073, 0.074, 0.076, 0.077, 0.076, 0.075, 0.073, 0.072, 0.074, 0.079 } },
};
/* clang-format on */

static void test_colorchecker_patches(void)
{
    struct xyz_weights w = weights_of(ILLUMINANT_D50, OBSERVER_2DEG, 380.0, 10.0, 36);
    for (size_t i = 0; i < sizeof patch_cases / sizeof *patch_cases; i++) {
        const struct patch_case *c = &patch_cases[i];
        double XYZ[3], sum;
        xyz_from_reflectance(&w, c->value, XYZ);
        sum = XYZ[0] + XYZ[1] + XYZ[2];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.0006, c->x, XYZ[0] / sum, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.0006, c->y, XYZ[1] / sum, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03, c->Y, XYZ[1], c->what);
    }
}

/* Real skin: expected_colorimetry.csv, 100 spectra of 31 bands with XYZ and Lab from
 * an independent implementation (colour-science), five and four decimals. */
enum { COLUMNS_MAX = 96, BANDS = 31 };

struct csv_row {
    char text[8192];
    char *cell[COLUMNS_MAX];
    size_t n;
};

static int csv_next(FILE *f, struct csv_row *row)
{
    if (fgets(row->text, sizeof row->text, f) == NULL)
        return 0;
    row->text[strcspn(row->text, "\r\n")] = '\0';
    row->n = 0;
    for (char *p = row->text; p != NULL && row->n < COLUMNS_MAX;) {
        char *comma = strchr(p, ',');
        row->cell[row->n++] = p;
        if (comma != NULL)
            *comma++ = '\0';
        p = comma;
    }
    return 1;
}

static double csv_number(const struct csv_row *head, const struct csv_row *row, const char *name)
{
    for (size_t i = 0; i < head->n && i < row->n; i++)
        if (strcmp(head->cell[i], name) == 0)
            return strtod(row->cell[i], NULL);
    TEST_FAIL_MESSAGE(name);
    return NAN;
}

static const struct light_case {
    const char *suffix;
    enum illuminant illuminant;
    enum observer observer;
    double XYZ_tol, Lab_tol;
} light_cases[] = {
    { "D65_10deg", ILLUMINANT_D65, OBSERVER_10DEG, 1e-4, 0.001 },
    { "D65_2deg", ILLUMINANT_D65, OBSERVER_2DEG, 1e-4, 0.001 },
    { "D50_2deg", ILLUMINANT_D50, OBSERVER_2DEG, 1e-4, 0.001 },
    { "A_10deg", ILLUMINANT_A, OBSERVER_10DEG, 1e-4, 0.001 },
};

static void check_measured_row(const struct csv_row *head, const struct csv_row *row,
                               const struct light_case *c, const struct xyz_weights *w)
{
    static const char *const names[6] = { "X", "Y", "Z", "L", "a", "b" };
    double value[BANDS], got[6];
    char column[32];

    for (int i = 0; i < BANDS; i++) {
        snprintf(column, sizeof column, "R%d", 400 + 10 * i);
        value[i] = csv_number(head, row, column);
    }
    xyz_from_reflectance(w, value, got);
    lab_from_xyz(got, w->white, got + 3);
    for (int k = 0; k < 6; k++) {
        snprintf(column, sizeof column, "%s_%s", names[k], c->suffix);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(k < 3 ? c->XYZ_tol : c->Lab_tol,
                                          csv_number(head, row, column), got[k], row->cell[1]);
    }
}

static void test_measured_skin(void)
{
    static struct csv_row head, row;
    const char *folder = getenv("SKINSPEC_MEASURED");
    char path[4096];
    int rows = 0;
    FILE *f;

    snprintf(path, sizeof path, "%s/expected_colorimetry.csv",
             folder != NULL ? folder : "../shared/measured");
    f = fopen(path, "r");
    if (f == NULL)
        TEST_IGNORE_MESSAGE("expected_colorimetry.csv: not here, set SKINSPEC_MEASURED");
    TEST_ASSERT_TRUE(csv_next(f, &head));
    while (csv_next(f, &row)) {
        for (size_t i = 0; i < sizeof light_cases / sizeof *light_cases; i++) {
            const struct light_case *c = &light_cases[i];
            struct xyz_weights w = weights_of(c->illuminant, c->observer, 400.0, 10.0, BANDS);
            check_measured_row(&head, &row, c, &w);
        }
        rows++;
    }
    fclose(f);
    TEST_ASSERT_EQUAL_INT(100, rows);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_whites_as_published);
    RUN_TEST(test_whites_as_E308_prints_them);
    RUN_TEST(test_folding_leaves_the_white);
    RUN_TEST(test_folding_adds_to_the_end_bands);
    RUN_TEST(test_bands_beyond_the_tables_weigh_nothing);
    RUN_TEST(test_direct_sums);
    RUN_TEST(test_steps_agree_on_a_smooth_spectrum);
    RUN_TEST(test_nan_shows);
    RUN_TEST(test_refusals);
    RUN_TEST(test_colorchecker_patches);
    RUN_TEST(test_measured_skin);
    return UNITY_END();
}
