/* test_spectrum.c - bands, specular modes, and taking off the surface. */
#include "base/spectrum.h"

#include <math.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static struct spectrum grid(double first_nm, double step_nm, size_t n)
{
    return (struct spectrum){ .first_nm = first_nm,
                              .step_nm = step_nm,
                              .n = n,
                              .specular = SPECULAR_SCI,
                              .aperture_mm = NAN };
}

/* expect: place = (nm - first)/step counted by hand; 99 stands for "no band". */
static const struct band_case {
    const char *what;
    double first_nm, step_nm, nm;
    size_t n, expect;
} band_cases[] = {
    { "first", 400.0, 10.0, 400.0, 31, 0 },
    { "last", 400.0, 10.0, 700.0, 31, 30 },
    { "one past the last", 400.0, 10.0, 710.0, 31, 99 },
    { "one before the first", 400.0, 10.0, 390.0, 31, 99 },
    { "between two bands", 400.0, 10.0, 405.0, 31, 99 },
    { "almost, but not", 400.0, 10.0, 410.00001, 31, 99 },
    { "within a millionth", 400.0, 10.0, 410.0000009, 31, 1 },
    { "below the first by less than that", 400.0, 10.0, 399.9999995, 31, 0 },
    { "steps that are no binary fraction", 380.0, 0.1, 380.7, 31, 7 },
    { "thirds of a nanometre", 400.0, 1.0 / 3.0, 410.0, 31, 30 },
    { "nowhere", 400.0, 10.0, NAN, 31, 99 },
    { "at the end of the world", 400.0, 10.0, INFINITY, 31, 99 },
    { "and at the other", 400.0, 10.0, -INFINITY, 31, 99 },
    { "a spectrum without bands", 400.0, 10.0, 400.0, 0, 99 },
};

static void test_band(void)
{
    for (size_t i = 0; i < sizeof band_cases / sizeof *band_cases; i++) {
        const struct band_case *c = &band_cases[i];
        struct spectrum s = grid(c->first_nm, c->step_nm, c->n);
        size_t expect = c->expect == 99 ? c->n : c->expect;
        TEST_ASSERT_EQUAL_size_t_MESSAGE(expect, spectrum_band(&s, c->nm), c->what);
    }
}

/* Property: every band is found at its own wavelength. */
static void test_band_inverts_nm(void)
{
    static const double steps[] = { 0.1, 1.0 / 3.0, 1.0, 2.0, 3.3, 5.0, 10.0, 20.0 };
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++) {
        struct spectrum s = grid(360.0, steps[k], SPECTRUM_MAX_BANDS);
        for (size_t i = 0; i < s.n; i++)
            TEST_ASSERT_EQUAL_size_t(i, spectrum_band(&s, spectrum_nm(&s, i)));
    }
}

static const struct specular_case {
    const char *text;
    enum status status;
    enum specular specular;
} specular_cases[] = {
    { "sce", STATUS_OK, SPECULAR_SCE },
    { "SCE", STATUS_OK, SPECULAR_SCE },
    { "sci", STATUS_OK, SPECULAR_SCI },
    { "ScI", STATUS_OK, SPECULAR_SCI },
    { "unknown", STATUS_FORMAT, SPECULAR_UNKNOWN },
    { "", STATUS_FORMAT, SPECULAR_UNKNOWN },
    { "sci ", STATUS_FORMAT, SPECULAR_UNKNOWN },
    { "sc", STATUS_FORMAT, SPECULAR_UNKNOWN },
};

static void test_specular_parse(void)
{
    for (size_t i = 0; i < sizeof specular_cases / sizeof *specular_cases; i++) {
        const struct specular_case *c = &specular_cases[i];
        enum specular untouched = (enum specular)77, got = untouched;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, specular_parse(c->text, &got), c->text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status == STATUS_OK ? c->specular : untouched, got,
                                      c->text);
    }
}

static void test_specular_name(void)
{
    TEST_ASSERT_EQUAL_STRING("sce", specular_name(SPECULAR_SCE));
    TEST_ASSERT_EQUAL_STRING("sci", specular_name(SPECULAR_SCI));
    TEST_ASSERT_EQUAL_STRING("unknown", specular_name(SPECULAR_UNKNOWN));
    TEST_ASSERT_EQUAL_STRING("unknown", specular_name((enum specular)77));
}

/* Three bands, of which the second is shown; the others are 0.5 and 0.25.
 * expect: value - surface by hand; at most 0.005 below 0 becomes 0 with a flag. */
static const struct surface_case {
    const char *what;
    enum specular specular;
    double value, surface;
    enum status status;
    double expect;
    int flag;
} surface_cases[] = {
    { "plain", SPECULAR_SCI, 0.3125, 0.0625, STATUS_OK, 0.25, 0 },
    { "nothing to take off", SPECULAR_SCI, 0.3125, 0.0, STATUS_OK, 0.3125, 0 },
    { "just black", SPECULAR_SCI, 0.0625, 0.0625, STATUS_OK, 0.0, 0 },
    { "slightly negative", SPECULAR_SCI, 0.0615, 0.0625, STATUS_OK, 0.0, SPECTRUM_BAND_ZEROED },
    { "at the edge: -0.005", SPECULAR_SCI, 0.0, 0.005, STATUS_OK, 0.0, SPECTRUM_BAND_ZEROED },
    { "at the edge in decimals", SPECULAR_SCI, 0.011, 0.016, STATUS_OK, 0.0, SPECTRUM_BAND_ZEROED },
    { "past the edge", SPECULAR_SCI, 0.0, 0.00500001, STATUS_RANGE, 0.0, 0 },
    { "largest surface", SPECULAR_SCI, 0.25, 0.1, STATUS_OK, 0.15, 0 },
    { "above the largest", SPECULAR_SCI, 0.25, 0.1000001, STATUS_RANGE, 0.0, 0 },
    { "a surface that adds", SPECULAR_SCI, 0.25, -0.01, STATUS_RANGE, 0.0, 0 },
    { "a surface not known", SPECULAR_SCI, 0.25, NAN, STATUS_RANGE, 0.0, 0 },
    { "not measured stays so", SPECULAR_SCI, NAN, 0.04, STATUS_OK, NAN, 0 },
    { "no surface in it", SPECULAR_SCE, 0.25, 0.04, STATUS_UNSUPPORTED, 0.0, 0 },
    { "nobody knows", SPECULAR_UNKNOWN, 0.25, 0.04, STATUS_UNSUPPORTED, 0.0, 0 },
};

static void test_remove_surface(void)
{
    for (size_t i = 0; i < sizeof surface_cases / sizeof *surface_cases; i++) {
        const struct surface_case *c = &surface_cases[i];
        static struct spectrum s, before;
        size_t band = 77;
        s = grid(400.0, 10.0, 3);
        s.specular = c->specular;
        s.value[0] = 0.5;
        s.value[1] = c->value;
        s.value[2] = 0.25;
        before = s;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, spectrum_remove_surface(&s, c->surface, &band),
                                      c->what);
        if (c->status != STATUS_OK) {
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &s, sizeof s, c->what);
            continue;
        }
        TEST_ASSERT_EQUAL_INT_MESSAGE(SPECULAR_SCE, s.specular, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(77, band, c->what);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.5 - c->surface, s.value[0], c->what);
        if (isnan(c->expect))
            TEST_ASSERT_MESSAGE(isnan(s.value[1]), c->what);
        else
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-15, c->expect, s.value[1], c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->flag, s.flag[1], c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, s.flag[0] | s.flag[2], c->what);
    }
}

/* The first band that is too dark is named; asking for it is optional. */
static void test_remove_surface_names_the_band(void)
{
    static struct spectrum s;
    size_t band = 77;
    s = grid(400.0, 10.0, 5);
    const double value[] = { 0.3, NAN, 0.039, 0.01, 0.02 };
    memcpy(s.value, value, sizeof value);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, spectrum_remove_surface(&s, 0.04, &band));
    TEST_ASSERT_EQUAL_size_t(3, band);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, spectrum_remove_surface(&s, 0.04, NULL));
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCI, s.specular);
}

/* A flag that a band already has stays, and a second removal is refused. */
static void test_remove_surface_keeps_flags_and_works_once(void)
{
    static struct spectrum s;
    s = grid(400.0, 10.0, 1);
    s.value[0] = 0.002;
    s.flag[0] = 1 << 6;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, spectrum_remove_surface(&s, 0.004, NULL));
    TEST_ASSERT_EQUAL_INT((1 << 6) | SPECTRUM_BAND_ZEROED, s.flag[0]);
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, spectrum_remove_surface(&s, 0.004, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_band);
    RUN_TEST(test_band_inverts_nm);
    RUN_TEST(test_specular_parse);
    RUN_TEST(test_specular_name);
    RUN_TEST(test_remove_surface);
    RUN_TEST(test_remove_surface_names_the_band);
    RUN_TEST(test_remove_surface_keeps_flags_and_works_once);
    return UNITY_END();
}
