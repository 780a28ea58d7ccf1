/* test_envi_header.c - what a header says, and what is refused of one. */
#include "cube/envi_header.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

void setUp(void)
{
}

void tearDown(void)
{
}

/* Fields as [ENVI] prints them, in its own mixture of cases and spaces. */
static const char usual[] = "ENVI\n"
                            "description = {\n  A hand, = and ; within {braces are text.}\n"
                            "; a comment = nothing\n"
                            "Samples = 7\n"
                            "  lines   =  5 \r\n"
                            "bands\t= 3\n"
                            "header  offset = 16\n"
                            "file type = ENVI Standard\n"
                            "data type = 12\n"
                            "interleave = BIP\n"
                            "byte order = 1\n"
                            "wavelength units = Micrometers\n"
                            "wavelength = {\n 0.4,\n 0.55 , 0.7}\n"
                            "bbl = {1, 0, 1}\n"
                            "reflectance scale factor = 10000.0\n"
                            "data ignore value = -9999\n"
                            "sensor type = Unknown\n";

static struct envi_header header;
static struct envi_fault fault;

static enum status parse(const char *text)
{
    return envi_header_parse(text, strlen(text), &header, &fault);
}

static void test_usual_header(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, parse(usual), fault.text);
    TEST_ASSERT_EQUAL_UINT(7, header.samples);
    TEST_ASSERT_EQUAL_UINT(5, header.lines);
    TEST_ASSERT_EQUAL_UINT(3, header.bands);
    TEST_ASSERT_EQUAL_UINT64(16, header.offset);
    TEST_ASSERT_EQUAL_INT(ENVI_UINT16, header.type);
    TEST_ASSERT_EQUAL_INT(ENVI_BIP, header.interleave);
    TEST_ASSERT_TRUE(header.big_endian);
    TEST_ASSERT_EQUAL_DOUBLE(400.0, header.nm[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 550.0, header.nm[1]);
    TEST_ASSERT_EQUAL_DOUBLE(700.0, header.nm[2]);
    TEST_ASSERT_FALSE(header.bad[0]);
    TEST_ASSERT_TRUE(header.bad[1]);
    TEST_ASSERT_FALSE(header.bad[2]);
    TEST_ASSERT_EQUAL_DOUBLE(10000.0, header.scale);
    TEST_ASSERT_TRUE(header.has_ignore);
    TEST_ASSERT_EQUAL_DOUBLE(-9999.0, header.ignore);
    TEST_ASSERT_EQUAL_UINT64(7 * 5 * 3 * 2, envi_data_size(&header));
}

/* A header with one line in place of another, "" for none. */
static const char *altered(const char *line, const char *instead)
{
    static char text[2 * sizeof usual + 4096];
    const char *at = strstr(usual, line);
    TEST_ASSERT_NOT_NULL_MESSAGE(at, line);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at - usual), usual, instead, at + strlen(line));
    return text;
}

/* expect: what [ENVI] lets each field be, and what the header says is taken */
static const struct fault_case {
    const char *line, *instead;
    enum status expect;
    size_t at;        /* line; 0: of the whole */
    const char *says; /* part of the sentence */
} fault_cases[] = {
    { "ENVI\n", "", STATUS_FORMAT, 1, "'ENVI'" },
    { "ENVI\n", "ENVIRONMENT\n", STATUS_FORMAT, 1, "'ENVI'" },
    { "Samples = 7\n", "", STATUS_FORMAT, 0, "'samples' is missing" },
    { "Samples = 7\n", "samples = 0\n", STATUS_FORMAT, 5, "samples is '0'" },
    { "Samples = 7\n", "samples = -7\n", STATUS_FORMAT, 5, "samples is '-7'" },
    { "Samples = 7\n", "samples = 7.5\n", STATUS_FORMAT, 5, "whole number" },
    { "Samples = 7\n", "samples = 99999999999999999999\n", STATUS_FORMAT, 5, "whole number" },
    { "Samples = 7\n", "samples\n", STATUS_FORMAT, 5, "no 'name = value'" },
    { "Samples = 7\n", "samples = 7\nSAMPLES = 8\n", STATUS_FORMAT, 6, "second time" },
    { "  lines   =  5 \r\n", "", STATUS_FORMAT, 0, "'lines' is missing" },
    { "bands\t= 3\n", "", STATUS_FORMAT, 0, "'bands' is missing" },
    { "bands\t= 3\n", "bands = 5000\n", STATUS_FORMAT, 7, "bands is '5000'" },
    { "bands\t= 3\n", "bands = 4\n", STATUS_FORMAT, 14,
      "wavelength has 3 values, but there are 4" },
    { "header  offset = 16\n", "header offset = -1\n", STATUS_FORMAT, 8, "header offset" },
    { "data type = 12\n", "", STATUS_FORMAT, 0, "'data type' is missing" },
    { "data type = 12\n", "data type = 5\n", STATUS_UNSUPPORTED, 10, "5 (float64) is not taken" },
    { "data type = 12\n", "data type = 99\n", STATUS_FORMAT, 10, "data type is '99'" },
    { "interleave = BIP\n", "", STATUS_FORMAT, 0, "'interleave' is missing" },
    { "interleave = BIP\n", "interleave = tile\n", STATUS_UNSUPPORTED, 11, "'tile'; bil, bip" },
    { "byte order = 1\n", "", STATUS_FORMAT, 0, "'byte order' is missing" },
    { "byte order = 1\n", "byte order = 2\n", STATUS_FORMAT, 12, "byte order is '2'" },
    { "= Micrometers", "= Wavenumber", STATUS_UNSUPPORTED, 13, "'Wavenumber'" },
    { "wavelength = {\n 0.4,\n 0.55 , 0.7}\n", "", STATUS_FORMAT, 0, "'wavelength' is missing" },
    { "0.55 ,", "0.4 ,", STATUS_FORMAT, 14, "must increase" },
    { "0.55 ,", "nan ,", STATUS_FORMAT, 14, "wavelength 2 is 'nan'" },
    { "0.55 ,", ",", STATUS_FORMAT, 14, "wavelength 2 is ''" },
    { "0.7}\n", "0.7\n", STATUS_FORMAT, 14, "wavelength 3" },
    { "bbl = {1, 0, 1}\n", "bbl = {1, 0}\n", STATUS_FORMAT, 17, "bbl has 2 values" },
    { "bbl = {1, 0, 1}\n", "bbl = {1, 0\n", STATUS_FORMAT, 17, "never closed" },
    { "= 10000.0", "= 0", STATUS_FORMAT, 18, "must be above 0" },
    { "= 10000.0", "= many", STATUS_FORMAT, 18, "'many'" },
    { "= -9999", "= none", STATUS_FORMAT, 19, "data ignore value is 'none'" },
    { "sensor type", "file compression = 1\nx", STATUS_UNSUPPORTED, 20, "'file compression'" },
    { "sensor type", "data gain values = {1, 2, 3}\nx", STATUS_UNSUPPORTED, 20, "'data gain" },
    { "Samples = 7\n  lines   =  5 \r\n", "samples = 2147483647\nlines = 2147483647\n",
      STATUS_FORMAT, 5, "more than a file can hold" },
};

static void test_faults(void)
{
    for (size_t i = 0; i < sizeof fault_cases / sizeof *fault_cases; i++) {
        const struct fault_case *c = &fault_cases[i];
        char what[512];
        header.samples = 77;
        enum status s = parse(altered(c->line, c->instead));
        snprintf(what, sizeof what, "%s -> %s: %s", c->line, c->instead, fault.text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, s, what);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->at, fault.line, what);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(fault.text, c->says), what);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(77, header.samples, "untouched");
    }
}

static void test_what_may_be_missing(void)
{
    static const char *const optional[] = { "header  offset = 16\n", "bbl = {1, 0, 1}\n",
                                            "reflectance scale factor = 10000.0\n",
                                            "data ignore value = -9999\n",
                                            "wavelength units = Micrometers\n" };
    for (size_t i = 0; i < sizeof optional / sizeof *optional; i++) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, parse(altered(optional[i], "")), fault.text);
        TEST_ASSERT_EQUAL_DOUBLE(400.0, header.nm[0]); /* units told by size */
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, parse(altered(optional[2], "")));
    TEST_ASSERT_TRUE(isnan(header.scale));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, parse(altered(optional[3], "data ignore value = NaN\n")));
    TEST_ASSERT_FALSE(header.has_ignore);
}

/* Cut at each byte, and each byte another: an answer or a fault with words, nothing else. */
static void test_any_text_has_an_answer(void)
{
    char text[sizeof usual];
    for (size_t n = 0; n < sizeof usual; n++) {
        memcpy(text, usual, n);
        if (envi_header_parse(text, n, &header, &fault) != STATUS_OK)
            TEST_ASSERT_GREATER_THAN(0, strlen(fault.text));
    }
    for (size_t i = 0; i + 1 < sizeof usual; i++) {
        for (size_t k = 0; k < 5; k++) {
            memcpy(text, usual, sizeof usual);
            text[i] = "{}=\0\xff"[k];
            if (envi_header_parse(text, sizeof usual - 1, &header, &fault) != STATUS_OK)
                TEST_ASSERT_GREATER_THAN(0, strlen(fault.text));
        }
    }
}

/* Each value of a cube of 2 lines, 3 samples and 4 bands numbered line, sample, band: places are
 * all different, and go as the interleave's name says. */
static void test_places(void)
{
    static const enum envi_interleave all[] = { ENVI_BIL, ENVI_BIP, ENVI_BSQ };
    for (size_t k = 0; k < 3; k++) {
        struct envi_header h = { .samples = 3,
                                 .lines = 2,
                                 .bands = 4,
                                 .offset = 100,
                                 .type = ENVI_UINT16,
                                 .interleave = all[k] };
        uint64_t expect = 100;
        for (size_t i = 0; i < 24; i++, expect += 2) {
            size_t line, sample, band;
            if (all[k] == ENVI_BIL)
                sample = i % 3, band = i / 3 % 4, line = i / 12;
            else if (all[k] == ENVI_BIP)
                band = i % 4, sample = i / 4 % 3, line = i / 12;
            else
                sample = i % 3, line = i / 3 % 2, band = i / 6;
            TEST_ASSERT_EQUAL_UINT64(expect, envi_place(&h, line, sample, band));
        }
    }
}

/* expect: the numbers these bytes are by IEEE 754 and by place */
static void test_values(void)
{
    static const unsigned char floats[] = { 0x3f, 0x80, 0, 0, 0xc0, 0x20, 0, 0, 0x7f, 0xc0, 0, 0 };
    static const unsigned char counts[] = { 0x01, 0x02, 0xff, 0xfe, 0x00, 0x80 };
    struct envi_header h = { .type = ENVI_FLOAT32, .big_endian = true };
    unsigned char turned[sizeof floats + 1];
    float value[3];
    envi_values(&h, floats, 3, 1, value);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, value[0]);
    TEST_ASSERT_EQUAL_FLOAT(-2.5f, value[1]);
    TEST_ASSERT_TRUE(isnan(value[2]));
    for (size_t i = 0; i < sizeof floats; i++)
        turned[1 + i] = floats[i / 4 * 4 + 3 - i % 4];
    h.big_endian = false;
    envi_values(&h, turned + 1, 2, 1, value); /* not aligned */
    TEST_ASSERT_EQUAL_FLOAT(-2.5f, value[1]);
    envi_values(&h, turned + 1, 2, 2, value); /* every other */
    TEST_ASSERT_EQUAL_FLOAT(1.0f, value[0]);
    TEST_ASSERT_TRUE(isnan(value[1]));
    h.type = ENVI_UINT16;
    envi_values(&h, counts, 3, 1, value);
    TEST_ASSERT_EQUAL_FLOAT(513.0f, value[0]);
    TEST_ASSERT_EQUAL_FLOAT(65279.0f, value[1]);
    TEST_ASSERT_EQUAL_FLOAT(32768.0f, value[2]);
    h.big_endian = true;
    envi_values(&h, counts, 2, 2, value);
    TEST_ASSERT_EQUAL_FLOAT(258.0f, value[0]);
    TEST_ASSERT_EQUAL_FLOAT(128.0f, value[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_usual_header);
    RUN_TEST(test_faults);
    RUN_TEST(test_what_may_be_missing);
    RUN_TEST(test_any_text_has_an_answer);
    RUN_TEST(test_places);
    RUN_TEST(test_values);
    return UNITY_END();
}
