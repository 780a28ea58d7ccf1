/* test_ocean_ooi_maths.c - bands, radiometry and substitution against
 * tests/reference/ocean_ooi.py (exact fractions) and rows worked by hand. */
#include <math.h>
#include <string.h>

#include "drivers/ocean_ooi/bands.h"
#include "drivers/ocean_ooi/radiometry.h"
#include "drivers/ocean_ooi/substitution.h"
#include "tests/support/dice.h"
#include "unity.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static struct ooi_bands bands;
static double nm[OOI_MAX_PIXELS], value[OOI_MAX_PIXELS], out[OOI_MAX_PIXELS];

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- bands -------------------------------------------------------------------------- */

static size_t make_grid(double first, double step, double last)
{
    size_t n = 0;
    while (first + step * (double)n <= last && n < OOI_MAX_PIXELS) {
        nm[n] = first + step * (double)n;
        n++;
    }
    return n;
}

/* expect: tests/reference/ocean_ooi.py, bands at 400, 410, 550, 690 and 700 nm */
static const struct band_case {
    double first, step, expect[5];
} band_cases[] = {
    { 380.0,
      0.25,
      { 0.000140634765625, 0.0004453271484375, 0.076898520507812498, 0.4657267138671875,
        0.51225015625000003 } },
    { 381.0,
      3.5,
      { 0.00014254239746093751, 0.00044818797363281251, 0.076914718247070316, 0.46575624852050779,
        0.51228060583496093 } },
    { 385.0,
      13.0,
      { 0.00016743874999999999, 0.00048259171874999999, 0.077126357031249995, 0.46615224921874998,
        0.51267414109374998 } },
    { 371.0,
      37.0,
      { 0.00026767000000000002, 0.00063928624999999995, 0.078240276250000004, 0.47011815624999997,
        0.51432478250000002 } },
};

static void test_bands_match_reference(void)
{
    static const size_t at[] = { 0, 1, 15, 29, 30 };
    for (size_t i = 0; i < COUNT(band_cases); i++) {
        const struct band_case *c = &band_cases[i];
        size_t n = make_grid(c->first, c->step, 790.0);
        for (size_t p = 0; p < n; p++)
            value[p] = pow((nm[p] - 380.0) / 400.0, 3.0);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_bands_init(n, nm, &bands));
        ooi_bands_apply(&bands, value, out);
        for (size_t b = 0; b < COUNT(at); b++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, c->expect[b], out[at[b]]);
    }
}

/* By hand: the integral of the triangle times the hat of a pixel at its middle.  Pixels 10 nm
 * apart: 2/3, and 1/6 for each neighbour.  20 nm apart: 5/6 and 1/12. */
static void test_weights_of_coarse_pixels(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_bands_init(make_grid(380.0, 10.0, 720.0), nm, &bands));
    TEST_ASSERT_EQUAL_size_t(3, bands.n[0]); /* 390, 400, 410 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 2.0 / 3.0, bands.weight[bands.at[15] + 1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.0 / 6.0, bands.weight[bands.at[15]]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.0 / 6.0, bands.weight[bands.at[15] + 2]);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_bands_init(make_grid(380.0, 20.0, 720.0), nm, &bands));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 5.0 / 6.0, bands.weight[bands.at[2] + 1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.0 / 12.0, bands.weight[bands.at[2]]);
}

/* Whatever the pixels: none negative, sum 1, straight lines come out as they are. */
static void test_weights_of_any_pixels(void)
{
    struct dice dice = { 7 };
    for (int round = 0; round < 300; round++) {
        double widest = pow(10.0, -0.6 + 2.4 * dice_between(&dice, 0.0, 1.0));
        size_t n = 0;
        for (nm[n++] = 300.0 + 90.0 * dice_between(&dice, 0.0, 1.0); nm[n - 1] < 710.0; n++) {
            nm[n] = nm[n - 1] + widest * (0.3 + 0.7 * dice_between(&dice, 0.0, 1.0));
            TEST_ASSERT_TRUE(n < OOI_MAX_PIXELS - 1);
        }
        TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_bands_init(n, nm, &bands));
        ooi_bands_apply(&bands, nm, out);
        for (size_t b = 0; b < OOI_BANDS; b++) {
            double sum = 0.0;
            for (size_t p = 0; p < bands.n[b]; p++) {
                TEST_ASSERT_TRUE(bands.weight[bands.at[b] + p] >= 0.0);
                sum += bands.weight[bands.at[b] + p];
            }
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, sum);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 400.0 + 10.0 * (double)b, out[b]);
            TEST_ASSERT_TRUE(bands.first[b] + bands.n[b] <= n);
        }
    }
}

static void test_bands_refuse(void)
{
    size_t n = make_grid(390.0, 1.0, 710.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_bands_init(n, nm, &bands));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_bands_init(n - 1, nm, &bands));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_bands_init(n - 1, nm + 1, &bands));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_bands_init(1, nm, &bands));
    nm[100] = nm[99];
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_bands_init(n, nm, &bands));
    nm[100] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_bands_init(n, nm, &bands));
}

/* By hand: 340 + 0.38 x 10 - 2e-5 x 100 + 1e-9 x 1000 */
static void test_wavelengths(void)
{
    const double c[4] = { 340.0, 0.38, -2e-5, 1e-9 };
    ooi_wavelengths(c, 9, 2, nm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 343.798001, nm[1]);
}

/* ---- radiometry ---------------------------------------------------------------------------------
 */

static const double bent[OOI_NONLINEARITY] = { 0.97, 1.5e-6, -2e-11, 1e-16 };
static uint16_t counts[OOI_MAX_PIXELS];
static struct ooi_detector detector;

static void make_detector(const char *option, uint16_t level)
{
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, ooi_detector_init(ooi_model_of_option(option), level, 7, bent, &detector));
    for (size_t p = 0; p < OOI_MAX_PIXELS; p++)
        counts[p] = 1500;
}

/* expect: tests/reference/ocean_ooi.py */
static const struct linear_case {
    uint16_t raw, level;
    double expect;
} linear_cases[] = {
    { 1500, 65535, 0 },
    { 2000, 65535, 515.06831718076944 },
    { 30000, 65535, 28533.672229927633 },
    { 65535, 65535, 63382.144452283734 },
    { 59999, 60000, 63245.573356015724 },
    { 60000, 60000, 63246.642941537531 },
    { 65535, 60000, 63246.642941537531 },
};

static void test_linearise_matches_reference(void)
{
    for (size_t i = 0; i < COUNT(linear_cases); i++) {
        const struct linear_case *c = &linear_cases[i];
        double fill = -1.0;
        make_detector("usb2000+", c->level);
        counts[20 + 7] = c->raw;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_linearise(&detector, counts, out, &fill));
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, c->expect, out[7]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, out[8]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, (double)c->raw / c->level, fill);
        TEST_ASSERT_EQUAL_INT(c->raw >= c->level, fill >= 1.0);
    }
}

static void test_black_pixels_must_be_black(void)
{
    double fill = -1.0;
    for (size_t p = 6; p <= 17; p++) {
        make_detector("usb2000+", 0);
        counts[p] = 1500 + 390;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_linearise(&detector, counts, out, &fill));
        counts[p] = 1500 + 410;
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_linearise(&detector, counts, out, &fill));
        counts[p] = 1500 - 410;
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_linearise(&detector, counts, out, &fill));
    }
    make_detector("usb2000+", 0);
    for (size_t p = 0; p < 20; p++)
        counts[p] = 13200; /* above a fifth of the range: light in the housing */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_linearise(&detector, counts, out, &fill));
}

static const struct detector_case {
    const char *what, *option;
    uint16_t level;
    size_t order;
    double n0, n1;
    enum status expect;
} detector_cases[] = {
    { "sound", "usb2000+", 60000, 7, 0.97, 1e-6, STATUS_OK },
    { "no level", "usb2000+", 0, 7, 0.97, 1e-6, STATUS_OK },
    { "erased", "hr4000", 65535, 7, 0.97, 1e-6, STATUS_OK },
    { "never calibrated", "usb2000+", 0, 7, 0.0, 0.0, STATUS_OK },
    { "level above the scale", "hr4000", 16384, 7, 0.97, 1e-6, STATUS_RANGE },
    { "level far too low", "usb2000+", 1000, 7, 0.97, 1e-6, STATUS_RANGE },
    { "order", "usb2000+", 0, 8, 0.97, 1e-6, STATUS_RANGE },
    { "leaves 0.5 .. 1.5", "usb2000+", 0, 7, 0.97, 1e-5, STATUS_RANGE },
    { "the same, but above the order", "usb2000+", 0, 0, 0.97, 1e-5, STATUS_OK },
    { "divides by nothing", "usb2000+", 0, 7, 0.0, 1e-6, STATUS_RANGE },
    { "not a number", "usb2000+", 0, 7, NAN, 0.0, STATUS_RANGE },
};

static void test_detectors(void)
{
    for (size_t i = 0; i < COUNT(detector_cases); i++) {
        const struct detector_case *c = &detector_cases[i];
        const double n[OOI_NONLINEARITY] = { c->n0, c->n1 };
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->expect,
            ooi_detector_init(ooi_model_of_option(c->option), c->level, c->order, n, &detector),
            c->what);
    }
    make_detector("hr2000+", 0);
    TEST_ASSERT_EQUAL_UINT(16383, detector.level);
}

/* expect: tests/reference/ocean_ooi.py */
static const struct reflectance_case {
    double sample, white, dark, rstd, expect;
} reflectance_cases[] = {
    { 20150, 51030, 310, 0.9812, 0.38381324921135646 },
    { 310, 51030, 310, 0.9812, 0 },
    { 51030, 51030, 310, 0.9812, 0.98119999999999996 },
    { 2433, 2911, 402, 0.9421, 0.7626166201673974 },
};

static void test_reflectance_matches_reference(void)
{
    for (size_t i = 0; i < COUNT(reflectance_cases); i++) {
        const struct reflectance_case *c = &reflectance_cases[i];
        double gain, R;
        ooi_gain(1, &c->white, &c->dark, &c->rstd, &gain);
        ooi_reflectance(1, &c->sample, &c->dark, &gain, &R);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, c->expect, R);
    }
}

/* By hand: 100 at 10 ms and 500 at 50 ms are 10 a millisecond. */
static void test_dark_is_a_line_in_time(void)
{
    static struct ooi_dark dark = { .at_us = { 10000, 50000 } };
    double at;
    dark.value[0][0] = 100.0;
    dark.value[1][0] = 500.0;
    ooi_dark_at(&dark, 1, 10000, &at);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 100.0, at);
    ooi_dark_at(&dark, 1, 23000, &at);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 230.0, at);
    ooi_dark_at(&dark, 1, 1000, &at);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0, at);
    dark.at_us[1] = 10000;
    ooi_dark_at(&dark, 1, 10000, &at);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 100.0, at);
}

static void test_means_and_unlike_frames(void)
{
    static struct ooi_mean mean;
    const struct ooi_model *m = ooi_model_of_option("usb2000+");
    ooi_mean_clear(&mean);
    ooi_mean_add(&mean, 2, (const double[]){ 100.0, 10000.0 });
    ooi_mean_add(&mean, 2, (const double[]){ 300.0, 10000.0 });
    ooi_mean_add(&mean, 2, (const double[]){ 200.0, 11500.0 });
    ooi_mean_take(&mean, 2, out);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 200.0, out[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10500.0, out[1]);
    TEST_ASSERT_EQUAL_size_t(2, ooi_mean_unlike(&mean, m, 2));
    ooi_mean_add(&mean, 2, (const double[]){ 200.0, 12500.0 }); /* 1.5 (400 + 8 sqrt(11000)) */
    TEST_ASSERT_EQUAL_size_t(1, ooi_mean_unlike(&mean, m, 2));
}

static void test_spikes(void)
{
    const struct ooi_model *m = ooi_model_of_option("usb2000+");
    static double dark[100], gain[100];
    for (size_t p = 0; p < 100; p++) {
        dark[p] = 200.0;
        gain[p] = 1.0 / (40000.0 * (p % 2 == 0 ? 1.0 : 0.9)); /* every other pixel is less able */
        value[p] = 200.0 + (0.3 + 0.004 * (double)p) / gain[p];
    }
    TEST_ASSERT_EQUAL_size_t(100, ooi_spike(m, 100, value, dark, gain));
    value[50] += 3000.0;
    TEST_ASSERT_TRUE(ooi_spike(m, 100, value, dark, gain) <= 50);
    value[50] -= 6000.0;
    TEST_ASSERT_TRUE(ooi_spike(m, 100, value, dark, gain) <= 51);
}

/* ---- substitution
 * ---------------------------------------------------------------------------------- */

/* expect: tests/reference/ocean_ooi.py, from the light in the sphere itself */
static const struct sphere_case {
    double k, rstd, R, read;
} sphere_cases[] = {
    { 0.20000000000000001, 0.98, 0.05, 0.040606060606060604 },
    { 0.20000000000000001, 0.98, 0.5, 0.44666666666666666 },
    { 0.2857142857142857, 0.9, 0.2, 0.15757575757575756 },
    { 0.16666666666666666, 0.99, 0.02, 0.016755852842809366 },
};

static void test_correction_matches_reference(void)
{
    for (size_t i = 0; i < COUNT(sphere_cases); i++) {
        const struct sphere_case *c = &sphere_cases[i];
        struct ooi_substitution s;
        double rstd[OOI_BANDS], R[OOI_BANDS];
        for (size_t b = 0; b < OOI_BANDS; b++) {
            s.k[b] = c->k;
            rstd[b] = c->rstd;
            R[b] = c->read;
        }
        ooi_substitution_correct(&s, rstd, R);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, c->R, R[7]);
    }
}

static double measured[4][OOI_BANDS], certified[4][OOI_BANDS], rstd[OOI_BANDS];

static double k_at(size_t b, double k0, double k1)
{
    return k0 + k1 * ((double)b - 15.0) / 15.0;
}

static void make_greys(const double *greys, size_t n, double k0, double k1)
{
    for (size_t b = 0; b < OOI_BANDS; b++) {
        rstd[b] = 0.98 - 0.001 * (30.0 - (double)b);
        for (size_t i = 0; i < n; i++) {
            double k = k_at(b, k0, k1), R = greys[i];
            certified[i][b] = R;
            measured[i][b] = R * (1.0 - k * rstd[b]) / (1.0 - k * R);
        }
    }
}

static void test_fit_finds_the_sphere(void)
{
    static const double greys[] = { 0.1, 0.35, 0.6 };
    struct ooi_substitution s;
    make_greys(greys, 3, 0.25, 0.03);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_substitution_fit(3, measured, certified, rstd, &s));
    for (size_t b = 0; b < OOI_BANDS; b++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, k_at(b, 0.25, 0.03), s.k[b]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0, s.residual);
    make_greys(greys, 1, 0.25, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, ooi_substitution_fit(1, measured, certified, rstd, &s));
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.25, s.k[3]);
}

static void test_fit_refuses(void)
{
    static const double greys[] = { 0.1, 0.35, 0.6 };
    struct ooi_substitution s;
    make_greys(greys, 3, 0.2, 0.0);
    for (size_t b = 0; b < OOI_BANDS; b++)
        certified[1][b] = 0.42; /* not this grey's certificate */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_substitution_fit(3, measured, certified, rstd, &s));
    make_greys(greys, 3, -0.2, 0.0); /* a sphere that darkness brightens */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_substitution_fit(3, measured, certified, rstd, &s));
    make_greys(greys, 3, 0.95, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_substitution_fit(3, measured, certified, rstd, &s));
    for (size_t b = 0; b < OOI_BANDS; b++) /* greys that are the white tile: nothing to learn */
        measured[0][b] = certified[0][b] = rstd[b];
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, ooi_substitution_fit(1, measured, certified, rstd, &s));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bands_match_reference);
    RUN_TEST(test_weights_of_coarse_pixels);
    RUN_TEST(test_weights_of_any_pixels);
    RUN_TEST(test_bands_refuse);
    RUN_TEST(test_wavelengths);
    RUN_TEST(test_linearise_matches_reference);
    RUN_TEST(test_black_pixels_must_be_black);
    RUN_TEST(test_detectors);
    RUN_TEST(test_reflectance_matches_reference);
    RUN_TEST(test_dark_is_a_line_in_time);
    RUN_TEST(test_means_and_unlike_frames);
    RUN_TEST(test_spikes);
    RUN_TEST(test_correction_matches_reference);
    RUN_TEST(test_fit_finds_the_sphere);
    RUN_TEST(test_fit_refuses);
    return UNITY_END();
}
