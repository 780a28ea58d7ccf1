/* test_answer.c - colour against another program's, and matches into records. */
#include "station/answer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/station/answer_tools.h"
#include "unity.h"

void setUp(void)
{
    answer_set_up();
}

void tearDown(void)
{
    answer_tear_down();
}

/* ---- colour ------------------------------------------------------------------------- */

/* ColorChecker: BabelColor's average (D. Pascale, 2012), 380..730 by 10.  expect: XYZ and Lab
 * by ArgyllCMS 2.3.1, `spec2cie -i D65 -o 1964_10`, which sums by 1 nm: 0.01 apart at most.
 * Grey: the white of ASTM E308 and the formulas of CIE 15.  sRGB and ITA: from those by hand,
 * Bradford to (0.3127, 0.3290). */
/* clang-format off */
static const struct colour_case {
    const char *what;
    double first_nm;
    size_t n;
    double value[36], XYZ[3], Lab[3];
    int sRGB[3];
    double ITA;
} colour_cases[] = {
    { "dark skin", 380, 36,
      { 0.055, 0.058, 0.061, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.062, 0.063,
        0.065, 0.07, 0.076, 0.079, 0.081, 0.084, 0.091, 0.103, 0.119, 0.134, 0.143, 0.147,
        0.151, 0.158, 0.168, 0.179, 0.188, 0.19, 0.186, 0.181, 0.182, 0.187, 0.196, 0.209 },
      { 10.884, 9.816, 6.686 }, { 37.509, 12.360, 12.969 }, { 114, 81, 68 }, -43.92 },
    { "light skin", 380, 36,
      { 0.117, 0.143, 0.175, 0.191, 0.196, 0.199, 0.204, 0.213, 0.228, 0.251, 0.28, 0.309,
        0.329, 0.333, 0.315, 0.286, 0.273, 0.276, 0.277, 0.289, 0.339, 0.42, 0.488, 0.525,
        0.546, 0.562, 0.578, 0.595, 0.612, 0.625, 0.638, 0.656, 0.678, 0.7, 0.717, 0.734 },
      { 36.216, 34.169, 24.407 }, { 65.096, 13.235, 17.736 }, { 192, 149, 127 }, 40.40 },
    { "light skin, 400..700 nm alone", 400, 31,
      { 0.175, 0.191, 0.196, 0.199, 0.204, 0.213, 0.228, 0.251, 0.28, 0.309, 0.329, 0.333,
        0.315, 0.286, 0.273, 0.276, 0.277, 0.289, 0.339, 0.42, 0.488, 0.525, 0.546, 0.562,
        0.578, 0.595, 0.612, 0.625, 0.638, 0.656, 0.678 },
      { 36.215, 34.168, 24.410 }, { 65.096, 13.233, 17.730 }, { 192, 149, 127 }, 40.40 },
    { "a fifth of white", 400, 31,
      { 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2,
        0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2, 0.2 },
      { 18.962, 20.0, 21.461 }, { 51.8372, 0, 0 }, { 124, 124, 124 }, 90 },
};
/* clang-format on */

static void test_colour(void)
{
    for (size_t i = 0; i < sizeof colour_cases / sizeof *colour_cases; i++) {
        const struct colour_case *c = &colour_cases[i];
        record.spectrum = bands(c->first_nm, 10, c->n, 0);
        memcpy(record.spectrum.value, c->value, c->n * sizeof *c->value);
        answer_colour(&weights, &record);
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01, c->XYZ[k], record.XYZ[k], c->what);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01, c->Lab[k], record.Lab[k], c->what);
            TEST_ASSERT_INT_WITHIN_MESSAGE(1, c->sRGB[k], record.sRGB[k], c->what);
        }
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03, c->ITA, record.ITA, c->what);
        TEST_ASSERT_EQUAL_STRING("del-bino-2013", record.ita_scheme);
        TEST_ASSERT_EQUAL_STRING("D65", record.illuminant);
        TEST_ASSERT_EQUAL_STRING("10", record.observer);
    }
}

/* Bands by 20 nm, too few, and one that was not measured. */
static void test_no_colour(void)
{
    struct spectrum none[] = { bands(400, 20, 16, 0.3), bands(410, 10, 30, 0.3),
                               bands(400, 10, 31, 0.3), bands(400, 10, 0, 0.3) };
    none[2].value[7] = NAN;
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
        record.spectrum = none[i];
        record.sRGB[0] = record.sRGB[1] = record.sRGB[2] = 1;
        strcpy(record.ita_scheme, "before");
        answer_colour(&weights, &record);
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_TRUE(isnan(record.XYZ[k]) && isnan(record.Lab[k]));
            TEST_ASSERT_EQUAL_INT(0, record.sRGB[k]);
        }
        TEST_ASSERT_TRUE(isnan(record.ITA));
        TEST_ASSERT_EQUAL_STRING("", record.ita_scheme);
        TEST_ASSERT_EQUAL_STRING("D65", record.illuminant);
        TEST_ASSERT_EQUAL_STRING("10", record.observer);
    }
}

/* A perfect white has a* 0 by definition on every grid, whatever was asked for before. */
static void test_weights_follow_the_bands(void)
{
    static const struct {
        double first_nm, step_nm;
        size_t n;
        bool usable;
    } grids[] = {
        { 400, 10, 31, true },  { 400, 20, 31, false }, { 400, 10, 31, true },
        { 390, 10, 31, false }, { 390, 10, 32, true },  { 390, 10, 32, true },
        { 400, 5, 61, true },   { 400, 10, 61, true },
    };
    for (size_t i = 0; i < sizeof grids / sizeof *grids; i++) {
        record.spectrum = bands(grids[i].first_nm, grids[i].step_nm, grids[i].n, 1);
        answer_colour(&weights, &record);
        if (grids[i].usable)
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, record.Lab[1]);
        else
            TEST_ASSERT_TRUE(isnan(record.Lab[1]));
    }
}

/* ---- quick -------------------------------------------------------------------------- */

static const struct quick_case {
    enum match_by by;
    size_t k;
    bool expect;
} quick_cases[] = {
    { MATCH_RGB, 0, true },      { MATCH_RGB_FLOAT, 1, true },  { MATCH_LAB, 32, true },
    { MATCH_SPECTRUM, 1, true }, { MATCH_SPECTRUM, 33, false }, { MATCH_DE2000, 1, false },
};

static void test_quick(void)
{
    const struct matcher *matcher;
    for (size_t i = 0; i < sizeof quick_cases / sizeof *quick_cases; i++)
        TEST_ASSERT_FALSE(answer_is_quick(two_layer, quick_cases[i].by, quick_cases[i].k));
    for (size_t i = 0; i < sizeof quick_cases / sizeof *quick_cases; i++)
        TRY(loaded_matcher(two_layer, quick_cases[i].by, &matcher));
    for (size_t i = 0; i < sizeof quick_cases / sizeof *quick_cases; i++)
        TEST_ASSERT_EQUAL_MESSAGE(quick_cases[i].expect,
                                  answer_is_quick(two_layer, quick_cases[i].by, quick_cases[i].k),
                                  match_by_name(quick_cases[i].by));
}

/* ---- match -------------------------------------------------------------------------- */

/* small_recipe(): Cm 0, .1, .2, .3; Bm 0 .. 1 by .25; Ch .001 .. .1 by 4, even in the logarithm.
 * Four rows at Cm 0, then 20 a Cm: row 40 is Cm .2, Bm 1, Ch .001. */
static void test_match(void)
{
    struct nearest_hit hits[3];
    cJSON *reply = NULL, *kept;
    record.spectrum = near_row(40, 0.001);
    TRY(answer_match(two_layer, MATCH_SPECTRUM, 3, hits, &record, &reply));
    check_reply(METHOD_MATCH_SPECTRUM, reply);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.2, number_of(reply, "Cm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1, number_of(reply, "Bm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.001, number_of(reply, "Ch"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.001, number_of(reply, "rms")); /* the offset in each band */
    const cJSON *nearest = cJSON_GetObjectItem(reply, "nearest");
    TEST_ASSERT_EQUAL_INT(3, cJSON_GetArraySize(nearest));
    TEST_ASSERT_EQUAL_DOUBLE(41, number_of(nearest->child, "row"));
    TEST_ASSERT_EQUAL_STRING("two-layer", record.table_name);
    TEST_ASSERT_EQUAL_STRING(loaded_table(two_layer)->sha256, record.table_sha256);
    TEST_ASSERT_EQUAL_STRING("spectrum", record.method);
    kept = cJSON_Parse(record.match_json);
    TEST_ASSERT_NULL(cJSON_GetObjectItem(kept, "nearest"));
    TEST_ASSERT_TRUE(number_of(kept, "dE00") == number_of(reply, "dE00"));
    TEST_ASSERT_TRUE(number_of(kept, "distance") == number_of(reply, "distance"));
    cJSON_Delete(kept);
    cJSON_Delete(reply);
}

static void test_match_without_nearest(void)
{
    struct nearest_hit hit;
    cJSON *reply = NULL;
    record.spectrum = near_row(21, 0);
    TRY(answer_match(paper, MATCH_RGB, 0, &hit, &record, &reply));
    check_reply(METHOD_MATCH_SPECTRUM, reply);
    char *text = text_of(reply);
    TEST_ASSERT_EQUAL_STRING(text, record.match_json);
    TEST_ASSERT_EQUAL_STRING("rgb", record.method);
    TEST_ASSERT_EQUAL_STRING("paper", record.table_name);
    free(text);
    cJSON_Delete(reply);
}

static void test_match_that_cannot_be(void)
{
    struct nearest_hit hit;
    struct spectrum sci = near_row(0, 0), few = bands(400, 10, 9, 0.3);
    sci.specular = SPECULAR_SCI;
    const struct {
        const char *what;
        struct loaded_table *table;
        enum match_by by;
        struct spectrum spectrum;
    } cases[] = {
        { "by spectrum in a table without", paper, MATCH_SPECTRUM, near_row(0, 0) },
        { "SCI", two_layer, MATCH_SPECTRUM, sci },
        { "too few bands", two_layer, MATCH_SPECTRUM, few },
        { "no colour", two_layer, MATCH_LAB, few },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        cJSON *reply = NULL;
        record.spectrum = cases[i].spectrum;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_UNSUPPORTED, answer_match(cases[i].table, cases[i].by, 1, &hit, &record, &reply),
            cases[i].what);
        TEST_ASSERT_NULL_MESSAGE(reply, cases[i].what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("", record.match_json, cases[i].what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("", record.table_name, cases[i].what);
    }
}

/* Every number of allocations up to the one that is enough. */
static void test_match_without_memory(void)
{
    struct nearest_hit hits[2];
    enum status s = STATUS_NO_MEMORY;
    cJSON *reply = NULL;
    long n = 0;
    record.spectrum = near_row(5, 0);
    for (; s != STATUS_OK && n < 1000; n++) {
        allocations_left = n;
        s = answer_match(two_layer, MATCH_LAB, 2, hits, &record, &reply);
        allocations_left = -1;
        if (s == STATUS_OK)
            break;
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_NULL(reply);
        TEST_ASSERT_EQUAL_STRING("", record.match_json);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    TEST_ASSERT_GREATER_THAN(20, n); /* a dozen members, twice */
    cJSON_Delete(reply);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_colour);
    RUN_TEST(test_no_colour);
    RUN_TEST(test_weights_follow_the_bands);
    RUN_TEST(test_quick);
    RUN_TEST(test_match);
    RUN_TEST(test_match_without_nearest);
    RUN_TEST(test_match_that_cannot_be);
    RUN_TEST(test_match_without_memory);
    int failures = UNITY_END();
    protocol_close(protocol);
    return failures;
}
