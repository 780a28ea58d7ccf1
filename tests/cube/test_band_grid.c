/* test_band_grid.c - which grid a cube's bands are laid on, and what becomes of spectra there. */
#include "cube/band_grid.h"

#include <math.h>
#include <string.h>
#include <unity.h>

void setUp(void)
{
}

void tearDown(void)
{
}

static struct envi_header header;
static struct band_grid grid;
static struct envi_fault fault;

/* Bands from lo by so much, each off by up to `jitter` times that, back and forth. */
static void bands(double lo, double step, size_t n, double jitter)
{
    memset(&header, 0, sizeof header);
    header.bands = n;
    for (size_t i = 0; i < n; i++)
        header.nm[i] = lo + step * ((double)i + jitter * sin(7.0 * (double)i));
}

static enum status init(void)
{
    return band_grid_init(&header, BAND_GRID_LO, BAND_GRID_HI, &grid, &fault);
}

/* R of the grid where the cube's bands are `of` their wavelength. */
static void lay(double (*of)(double), float *out)
{
    static float in[ENVI_MAX_BANDS];
    for (size_t i = 0; i < grid.used; i++)
        in[i] = (float)of(header.nm[grid.band[i]]);
    band_grid_apply(&grid, in, 1, 1, 1, 1.0f, out);
}

/* expect: the rule in the header of band_grid.h, worked out by hand */
static const struct grid_case {
    const char *what;
    double lo, step;
    size_t n;
    double jitter;
    bool as_is;
    double first_nm, step_nm;
    size_t expect_n;
} grid_cases[] = {
    { "a spectrophotometer's", 360, 10, 39, 0, true, 400, 10, 31 },
    { "by 5 nm, off the tens", 402, 5, 100, 0, true, 402, 5, 60 },
    { "by 20 nm", 390, 20, 20, 0, true, 410, 20, 15 },
    { "by 1 nm: too fine", 350, 1, 600, 0, false, 400, 10, 31 },
    /* 700 nm is told by 698 and 700.5 */
    { "by 2.5 nm from 403", 403, 2.5, 200, 0, false, 410, 10, 30 },
    { "uneven by 8 nm", 380, 8, 60, 0.2, false, 400, 10, 31 },
    { "uneven by 14 nm", 380, 14, 40, 0.1, false, 405, 15, 20 },
};

static void test_grids(void)
{
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        bands(c->lo, c->step, c->n, c->jitter);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, init(), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->as_is, grid.as_is, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, c->first_nm, grid.first_nm, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, c->step_nm, grid.step_nm, c->what);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->expect_n, grid.n, c->what);
    }
}

static double straight(double nm)
{
    return 0.9 - 0.001 * (nm - 400.0);
}

/* What is straight comes out as it is, on every grid, to its ends. */
static void test_straight_stays(void)
{
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        float R[BAND_GRID_MOST];
        bands(c->lo, c->step, c->n, c->jitter);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
        lay(straight, R);
        for (size_t g = 0; g < grid.n; g++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(
                5e-7, straight(grid.first_nm + (double)g * grid.step_nm), (double)R[g], c->what);
    }
}

static double bent(double nm)
{
    return 1e-4 * (nm - 550.0) * (nm - 550.0);
}

/* A parabola a x^2 seen through a triangle of half width h is higher by a h^2/6; straight lines
 * between bands s apart are so by a (s^2/6) on average, at a band not at all. */
static void test_blur(void)
{
    float R[BAND_GRID_MOST];
    bands(400.0, 1.0, 301, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
    lay(bent, R);
    for (size_t g = 1; g + 1 < grid.n; g++) {
        double at = grid.first_nm + (double)g * grid.step_nm;
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, bent(at) + 1e-4 * 100.0 / 6.0, (double)R[g]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, bent(400.0), (double)R[0]); /* nothing beyond the end */
}

static void test_bad_bands_are_not_used(void)
{
    bands(400.0, 10.0, 31, 0.0);
    header.bad[5] = true;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
    TEST_ASSERT_EQUAL_UINT(30, grid.used);
    TEST_ASSERT_FALSE(grid.as_is);
    for (size_t i = 0; i < grid.used; i++)
        TEST_ASSERT_NOT_EQUAL(5, grid.band[i]);
    bands(400.0, 10.0, 31, 0.0);
    header.bad[30] = true; /* at the end: still even */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
    TEST_ASSERT_TRUE(grid.as_is);
    TEST_ASSERT_EQUAL_UINT(30, grid.n);
}

static void test_refused(void)
{
    bands(900.0, 10.0, 50, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, init());
    TEST_ASSERT_NOT_NULL(strstr(fault.text, "0 of 50 bands"));
    bands(400.0, 10.0, 9, 0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, init());
    TEST_ASSERT_NOT_NULL(strstr(fault.text, "a fit needs 10"));
    bands(400.0, 10.0, 31, 0.0);
    for (size_t i = 10; i < 13; i++)
        header.bad[i] = true;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, init());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(fault.text, "between 490 and 530"), fault.text);
    /* Beyond a gap outside of the range nothing is asked. */
    bands(410.0, 8.0, 31, 0.1);
    header.bands = 32;
    header.nm[31] = 705.0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
    TEST_ASSERT_EQUAL_UINT(31, grid.used);
    bands(500.0, 2.0, 20, 0.0); /* fine, but narrow */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, init());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(fault.text, "give 4 values"), fault.text);
}

/* As many bands as there can be. */
static void test_most_bands(void)
{
    float R[BAND_GRID_MOST];
    bands(399.0, 302.0 / ENVI_MAX_BANDS, ENVI_MAX_BANDS, 0.3);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, init());
    size_t last = grid.n - 1;
    TEST_ASSERT_LESS_OR_EQUAL(sizeof grid.weight / sizeof *grid.weight,
                              grid.first[last] + grid.count[last]);
    lay(straight, R);
    TEST_ASSERT_EQUAL_DOUBLE(400.0, grid.first_nm);
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, straight(500.0), (double)R[10]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grids);
    RUN_TEST(test_straight_stays);
    RUN_TEST(test_blur);
    RUN_TEST(test_bad_bands_are_not_used);
    RUN_TEST(test_refused);
    RUN_TEST(test_most_bands);
    return UNITY_END();
}
