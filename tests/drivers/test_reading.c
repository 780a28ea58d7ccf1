/* test_reading.c - what is doubted in a spectrum, and what is not: skin, tiles, black and white. */
#include "drivers/reading.h"

#include <string.h>

#include "unity.h"

enum { N = 5 };
#define UNIT 1e-4 /* 100 counts are one percent */

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: the limits of reading.h, counted by hand at 10000 counts for a perfect white */
static const struct spectrum_case {
    const char *what;
    int32_t raw[N];
    enum doubt expect;
} spectrum_cases[] = {
    { "skin", { 1800, 2000, 2600, 3600, 5400 }, DOUBT_NONE },
    { "white", { 9900, 9900, 10100, 9900, 9900 }, DOUBT_NONE },
    { "black but for one band", { 0, 0, 1, 0, 0 }, DOUBT_NONE },
    { "edge of a red tile", { 300, 300, 4300, 8300, 8300 }, DOUBT_NONE },
    { "steeper than any", { 300, 300, 4301, 8300, 8300 }, DOUBT_JUMP },
    { "and downwards", { 8300, 8300, 4299, 300, 300 }, DOUBT_JUMP },
    { "one digit", { 2000, 2100, 8000, 2200, 2300 }, DOUBT_JUMP },
    { "brightest", { 20000, 20000, 20000, 20000, 20000 }, DOUBT_NONE },
    { "brighter", { 20000, 20000, 20000, 20000, 20001 }, DOUBT_OUT_OF_RANGE },
    { "negative", { -1, 20, 20, 20, 20 }, DOUBT_OUT_OF_RANGE },
    { "nothing", { 0, 0, 0, 0, 0 }, DOUBT_ALL_ZERO },
};

static void test_one_spectrum(void)
{
    for (size_t i = 0; i < sizeof spectrum_cases / sizeof *spectrum_cases; i++) {
        const struct spectrum_case *c = &spectrum_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, doubt_spectrum(N, c->raw, UNIT), c->what);
    }
}

static const struct pair_case {
    const char *what;
    int32_t sci[N], sce[N];
    enum doubt expect, with_gloss;
} pair_cases[] = {
    { "skin",
      { 2200, 2400, 3000, 4000, 5800 },
      { 1800, 2000, 2600, 3600, 5400 },
      DOUBT_NONE,
      DOUBT_NONE },
    { "matte, within noise",
      { 2000, 2000, 2000, 2000, 2000 },
      { 2000, 2030, 2000, 2000, 2000 },
      DOUBT_NONE,
      DOUBT_NONE },
    { "the wrong way round",
      { 2000, 2000, 2000, 2000, 2000 },
      { 2000, 2031, 2000, 2000, 2000 },
      DOUBT_ORDER,
      DOUBT_ORDER },
    { "the same twice",
      { 2000, 2000, 2000, 2000, 2001 },
      { 2000, 2000, 2000, 2000, 2001 },
      DOUBT_SAME,
      DOUBT_SAME },
    { "dull",
      { 2001, 2100, 3000, 3500, 5400 },
      { 2000, 2100, 3000, 3500, 5400 },
      DOUBT_NONE,
      DOUBT_NONE },
    { "gloss jumps at the beginning",
      { 2301, 2400, 3000, 4000, 5800 },
      { 1800, 2000, 2600, 3600, 5400 },
      DOUBT_NONE,
      DOUBT_GLOSS },
    { "in the middle",
      { 2200, 2400, 3101, 4000, 5800 },
      { 1800, 2000, 2600, 3600, 5400 },
      DOUBT_NONE,
      DOUBT_GLOSS },
    { "and at the end",
      { 2200, 2400, 3000, 4000, 5901 },
      { 1800, 2000, 2600, 3600, 5400 },
      DOUBT_NONE,
      DOUBT_GLOSS },
};

static void test_two_spectra(void)
{
    for (size_t i = 0; i < sizeof pair_cases / sizeof *pair_cases; i++) {
        const struct pair_case *c = &pair_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, doubt_pair(N, c->sci, c->sce, UNIT, false),
                                      c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->with_gloss, doubt_pair(N, c->sci, c->sce, UNIT, true),
                                      c->what);
    }
}

/* At counts of 0.001 % too, and each alone before the pair. */
static void test_both_spectra(void)
{
    static const int32_t skin[N] = { 18000, 20000, 26000, 36000, 54000 };
    static const int32_t glossy[N] = { 22000, 24000, 30000, 40000, 58000 };
    static const int32_t damaged[N] = { 22000, 24000, 31001, 40000, 58000 };
    static const int32_t jumps[N] = { 22000, 24000, 30000, 71000, 58000 };
    static const int32_t bright[N] = { 200001, 200000, 200000, 200000, 200000 };
    static const int32_t nothing[N] = { 0 };
    const double unit = 1e-5;
    TEST_ASSERT_EQUAL_INT(DOUBT_NONE, doubt_both(N, glossy, skin, unit, true));
    TEST_ASSERT_EQUAL_INT(DOUBT_NONE, doubt_both(N, damaged, skin, unit, false));
    TEST_ASSERT_EQUAL_INT(DOUBT_GLOSS, doubt_both(N, damaged, skin, unit, true));
    TEST_ASSERT_EQUAL_INT(DOUBT_ORDER, doubt_both(N, skin, glossy, unit, true));
    TEST_ASSERT_EQUAL_INT(DOUBT_JUMP, doubt_both(N, jumps, skin, unit, false));
    TEST_ASSERT_EQUAL_INT(DOUBT_JUMP, doubt_both(N, glossy, jumps, unit, false));
    TEST_ASSERT_EQUAL_INT(DOUBT_OUT_OF_RANGE, doubt_both(N, bright, skin, unit, false));
    TEST_ASSERT_EQUAL_INT(DOUBT_ALL_ZERO, doubt_both(N, nothing, nothing, unit, false));
}

static void test_failing(void)
{
    struct driver_error error;
    memset(&error, 0x77, sizeof error);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, doubt_fail(DOUBT_NONE, &error));
    TEST_ASSERT_EQUAL_HEX8(0x77, error.text[0]);
    for (int doubt = DOUBT_WRONG_COUNT; doubt <= DOUBT_SAME; doubt++) {
        bool bytes = doubt == DOUBT_WRONG_COUNT || doubt == DOUBT_NO_NUMBER ||
                     doubt == DOUBT_GLOSS || doubt == DOUBT_SAME;
        TEST_ASSERT_EQUAL_INT(bytes ? DRIVER_PROTOCOL : DRIVER_IMPLAUSIBLE,
                              doubt_fail((enum doubt)doubt, &error));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "measure again"), error.text);
        /* As open air or a dark trap under the port looks: nothing, or noise about nothing. */
        bool open_air =
            doubt == DOUBT_NO_NUMBER || doubt == DOUBT_OUT_OF_RANGE || doubt == DOUBT_ALL_ZERO;
        TEST_ASSERT_EQUAL_MESSAGE(open_air, strstr(error.text, "under the port") != NULL,
                                  error.text);
    }
}

static void test_filling(void)
{
    static struct driver_reading reading;
    const struct driver_grid grid = { 400.0, 10.0, N };
    const int32_t raw[N] = { 1800, 2000, 2600, 3600, 5400 };
    memset(&reading, 0x55, sizeof reading);
    reading_init(UNIT, DRIVER_WARNING_LAMP_WEAK, &reading);
    TEST_ASSERT_FALSE(reading.has_sce || reading.has_sci);
    reading_add(&grid, raw, SPECULAR_SCE, 8.0, &reading);
    TEST_ASSERT_TRUE(reading.has_sce && !reading.has_sci);
    reading_add(&grid, raw, SPECULAR_SCI, 8.0, &reading);
    TEST_ASSERT_TRUE(reading.has_sci);
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_LAMP_WEAK, reading.warnings);
    TEST_ASSERT_EQUAL_STRING("", reading.sample);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, reading.sce.specular);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCI, reading.sci.specular);
    for (size_t i = 0; i < N; i++) {
        TEST_ASSERT_EQUAL_INT32(raw[i], reading.raw_sce[i]);
        TEST_ASSERT_TRUE(reading.sci.value[i] == raw[i] * UNIT);
        TEST_ASSERT_EQUAL_UINT8(0, reading.sce.flag[i]);
    }
    TEST_ASSERT_EQUAL_DOUBLE(440.0, spectrum_nm(&reading.sce, N - 1));
    TEST_ASSERT_EQUAL_DOUBLE(8.0, reading.sci.aperture_mm);
}

static void test_plain_text(void)
{
    static const struct {
        const char *bytes;
        size_t n;
        const char *expect;
    } rows[] = {
        { "001234", 6, "001234" },
        { "", 0, "" },
        { "  12 34  ", 9, "12 34" },
        { "\0\x01"
          "A\xff"
          "B\n",
          6, "AB" },
        { "0123456789", 10, "0123456" },
        { "      7", 7, "7" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[8];
        memset(text, 0x55, sizeof text);
        reading_plain_text(rows[i].bytes, rows[i].n, text, sizeof text);
        TEST_ASSERT_EQUAL_STRING(rows[i].expect, text);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_spectrum);
    RUN_TEST(test_two_spectra);
    RUN_TEST(test_both_spectra);
    RUN_TEST(test_failing);
    RUN_TEST(test_filling);
    RUN_TEST(test_plain_text);
    return UNITY_END();
}
