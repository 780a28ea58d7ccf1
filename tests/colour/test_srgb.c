/* test_srgb.c - sRGB both ways, its transfer curve, codes, and Bradford. */
#include "colour/srgb.h"

#include <math.h>
#include <stddef.h>

#include "unity.h"

#include "colour/xyz.h"

void setUp(void)
{
}
void tearDown(void)
{
}

/* W3C, CSS Color 4, sample code: the same matrices as exact fractions. */
static const double w3c_xyz_of_rgb[3][3] = {
    { 506752.0 / 1228815, 87881.0 / 245763, 12673.0 / 70218 },
    { 87098.0 / 409605, 175762.0 / 245763, 12673.0 / 175545 },
    { 7918.0 / 409605, 87881.0 / 737289, 1001167.0 / 1053270 },
};
static const double w3c_rgb_of_xyz[3][3] = {
    { 12831.0 / 3959, -329.0 / 214, -1974.0 / 3959 },
    { -851781.0 / 878810, 1648619.0 / 878810, 36519.0 / 878810 },
    { 705.0 / 12673, -2585.0 / 12673, 705.0 / 667 },
};

/* IEC 61966-2-1: the same with the four decimals it prints. */
static const double iec_xyz_of_rgb[3][3] = {
    { 0.4124, 0.3576, 0.1805 },
    { 0.2126, 0.7152, 0.0722 },
    { 0.0193, 0.1192, 0.9505 },
};

static void test_matrices(void)
{
    double white[3];
    srgb_linear_to_xyz((double[]){ 1.0, 1.0, 1.0 }, (double[3]){ 0.0 }, white);
    for (int j = 0; j < 3; j++) {
        double unit[3] = { 0.0, 0.0, 0.0 }, XYZ[3], rgb[3];
        unit[j] = 1.0;
        srgb_linear_to_xyz(unit, XYZ, NULL);
        for (int i = 0; i < 3; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-13, 100.0 * w3c_xyz_of_rgb[i][j], XYZ[i]);
            TEST_ASSERT_DOUBLE_WITHIN(5.1e-3, 100.0 * iec_xyz_of_rgb[i][j], XYZ[i]);
        }
        srgb_linear_from_xyz(unit, white, rgb);
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-16 * 100.0, w3c_rgb_of_xyz[i][j] / 100.0, rgb[i]);
    }
}

/* (x, y) = (0.3127, 0.3290), IEC 61966-2-1. */
static void test_white_of_srgb(void)
{
    double XYZ[3], white[3];
    srgb_linear_to_xyz((double[]){ 1.0, 1.0, 1.0 }, XYZ, white);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.3127, white[0] / (white[0] + white[1] + white[2]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.3290, white[1] / (white[0] + white[1] + white[2]));
    TEST_ASSERT_EQUAL_DOUBLE(100.0, white[1]);
    for (int k = 0; k < 3; k++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-13, white[k], XYZ[k]);
}

/* Property: whatever the light, its white is (1, 1, 1), shows as 255 255 255 and
 * counts as unclipped. */
static void test_every_white_is_white(void)
{
    for (int il = 0; il < ILLUMINANT_COUNT; il++) {
        for (int o = 0; o < OBSERVER_COUNT; o++) {
            struct xyz_weights w;
            double linear[3];
            int code[3];
            TEST_ASSERT_EQUAL_INT(STATUS_OK, xyz_weights_init((enum illuminant)il, (enum observer)o,
                                                              400.0, 10.0, 31, &w));
            srgb_linear_from_xyz(w.white, w.white, linear);
            for (int k = 0; k < 3; k++)
                TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1.0, linear[k]);
            TEST_ASSERT_FALSE(srgb_code(linear, code));
            for (int k = 0; k < 3; k++)
                TEST_ASSERT_EQUAL_INT(255, code[k]);
        }
    }
}

static void test_xyz_round_trip(void)
{
    for (int i = 0; i < 125; i++) {
        double linear[3] = { i % 5 * 0.3 - 0.1, i / 5 % 5 * 0.3 - 0.1, i / 25 * 0.3 - 0.1 };
        double XYZ[3], white[3], back[3];
        srgb_linear_to_xyz(linear, XYZ, white);
        srgb_linear_from_xyz(XYZ, white, back);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_DOUBLE_WITHIN(2e-15, linear[k], back[k]);
    }
}

/* The standard's formulas with 40-digit decimals. */
static const struct curve_case {
    const char *what;
    double linear, coded, tol;
} curve_cases[] = {
    { "black", 0.0, 0.0, 0.0 },
    { "white", 1.0, 1.0, 1e-15 },
    { "half", 0.5, 0.73535698305244945, 1e-15 },
    { "grey card", 0.18, 0.46135612950044164, 1e-15 },
    { "half, backwards", 0.21404114048223244, 0.5, 1e-15 },
    { "on the line: 12.92 x", 0.001, 0.01292, 1e-17 },
    { "threshold belongs to the line", 0.0031308, 0.040449936, 1e-17 },
    { "just above: the curve", 0.0031315945526889902, 0.04046, 1e-16 },
    { "mirrored below 0", -0.5, -0.73535698305244945, 1e-15 },
    { "mirrored on the line", -0.001, -0.01292, 1e-17 },
};

static void test_transfer_curve(void)
{
    for (size_t i = 0; i < sizeof curve_cases / sizeof *curve_cases; i++) {
        const struct curve_case *c = &curve_cases[i];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->tol, c->coded, srgb_encode(c->linear), c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(c->tol, c->linear, srgb_decode(c->coded), c->what);
    }
    /* The standard's threshold for the way back, on either side. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-17, 0.0031308049535603713, srgb_decode(0.04045));
}

/* Property: the curve grows, and every code value returns as itself. */
static void test_every_code_returns(void)
{
    for (int v = 0; v < 256; v++) {
        double x = srgb_decode(v / 255.0), linear[3] = { x, x, x };
        int code[3];
        TEST_ASSERT_FALSE(srgb_code(linear, code));
        TEST_ASSERT_EQUAL_INT(v, code[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, v / 255.0, srgb_encode(x));
        TEST_ASSERT_TRUE(srgb_decode((v + 1) / 255.0) > x);
    }
}

/* linear: the decoding formula with 40-digit decimals, at the codes named. */
static const struct code_case {
    const char *what;
    double linear[3];
    int code[3];
    bool clipped;
} code_cases[] = {
    { "red primary", { 1.0, 0.0, 0.0 }, { 255, 0, 0 }, false },
    { "cyan", { 0.0, 1.0, 1.0 }, { 0, 255, 255 }, false },
    { "grey card: 255 x 0.46136 = 117.6", { 0.18, 0.18, 0.18 }, { 118, 118, 118 }, false },
    { "255.4 rounds to 255", { 1.0035721563486044, 0.5, 0.5 }, { 255, 188, 188 }, false },
    { "255.6 is clipped", { 1.0053610214162414, 0.5, 0.5 }, { 255, 188, 188 }, true },
    { "-0.4 rounds to 0", { 0.5, -0.00012141079341953499, 0.5 }, { 188, 0, 188 }, false },
    { "-0.6 is clipped", { 0.5, 0.5, -0.00018211619130249302 }, { 188, 188, 0 }, true },
    { "far out both ways", { 9.0, -9.0, 0.0 }, { 255, 0, 0 }, true },
    { "infinities", { INFINITY, -INFINITY, 0.0 }, { 255, 0, 0 }, true },
    { "NaN is black and clipped", { NAN, 0.5, 1.0 }, { 0, 188, 255 }, true },
};

static void test_codes(void)
{
    for (size_t i = 0; i < sizeof code_cases / sizeof *code_cases; i++) {
        const struct code_case *c = &code_cases[i];
        int code[3] = { -1, -1, -1 };
        bool clipped = srgb_code(c->linear, code);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->clipped, clipped, c->what);
        for (int k = 0; k < 3; k++)
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->code[k], code[k], c->what);
    }
}

/* Bradford between the ASTM E308 whites D65 and D50, as Lindbloom prints the
 * two matrices (seven decimals). */
static void test_bradford_as_published(void)
{
    static const double D65[3] = { 0.95047, 1.0, 1.08883 }, D50[3] = { 0.96422, 1.0, 0.82521 };
    static const double D65_to_D50[3][3] = {
        { 1.0478112, 0.0228866, -0.0501270 },
        { 0.0295424, 0.9904844, -0.0170491 },
        { -0.0092345, 0.0150436, 0.7521316 },
    };
    static const double D50_to_D65[3][3] = {
        { 0.9555766, -0.0230393, 0.0631636 },
        { -0.0282895, 1.0099416, 0.0210077 },
        { 0.0122982, -0.0204830, 1.3299098 },
    };
    for (int j = 0; j < 3; j++) {
        double unit[3] = { 0.0, 0.0, 0.0 }, got[3];
        unit[j] = 1.0;
        bradford_adapt(unit, D65, D50, got);
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(6e-8, D65_to_D50[i][j], got[i]);
        bradford_adapt(unit, D50, D65, got);
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(6e-8, D50_to_D65[i][j], got[i]);
    }
}

/* Property: white goes to white, back again is the same, and the result may
 * overwrite the input. */
static void test_bradford_there_and_back(void)
{
    static const double A[3] = { 109.85, 100.0, 35.585 }, D65[3] = { 95.047, 100.0, 108.883 };
    double v[3] = { 40.0, 30.0, 12.0 };
    bradford_adapt(v, A, D65, v);
    bradford_adapt(v, D65, A, v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, 40.0, v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, 30.0, v[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, 12.0, v[2]);
    bradford_adapt(A, A, D65, v);
    for (int k = 0; k < 3; k++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-13, D65[k], v[k]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_matrices);
    RUN_TEST(test_white_of_srgb);
    RUN_TEST(test_every_white_is_white);
    RUN_TEST(test_xyz_round_trip);
    RUN_TEST(test_transfer_curve);
    RUN_TEST(test_every_code_returns);
    RUN_TEST(test_codes);
    RUN_TEST(test_bradford_as_published);
    RUN_TEST(test_bradford_there_and_back);
    return UNITY_END();
}
