/* test_export.c - records as csv, json and cgats: each column, and what is left empty or out.
 * test_export.py has other programs read such files. */
#include "station/export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/version.h"
#include "station/protocol.h"
#include "tests/station/export_tools.h"
#include "unity.h"

static struct protocol *protocol;

void setUp(void)
{
    export_set_up();
    if (protocol == NULL)
        TRY(protocol_open(&protocol));
}

void tearDown(void)
{
    export_tear_down();
}

static void check_whole(enum export_format format, const char *expect)
{
    char *text = whole(format);
    TEST_ASSERT_EQUAL_STRING(expect, text);
    free(text);
}

static void test_names(void)
{
    enum export_format format = EXPORT_CSV;
    TRY(export_format_parse("cgats", &format));
    TEST_ASSERT_EQUAL_INT(EXPORT_CGATS, format);
    TRY(export_format_parse("csv", &format));
    TEST_ASSERT_EQUAL_INT(EXPORT_CSV, format);
    TRY(export_format_parse("json", &format));
    TEST_ASSERT_EQUAL_INT(EXPORT_JSON, format);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, export_format_parse("CSV", &format));
    TEST_ASSERT_EQUAL_INT(EXPORT_JSON, format);
}

/* ---- csv ---------------------------------------------------------------------------- */

#define CSV_HEAD \
    "id,seq,taken_at,uuid,operator,instrument,serial,specular,aperture_mm,surface,subject,site," \
    "X,Y,Z,L,a,b,R,G,B,ITA,illuminant,observer,Cm,Bm,Ch,dE00,rms,by,table,match_flags,flags," \
    "corrects,calibration_id,fence,refine,SO2,epidermis_mm,scattering_a,scattering_b,Cm_se," \
    "Cm_lo,Cm_hi,Bm_se,Bm_lo,Bm_hi,Ch_se,Ch_lo,Ch_hi,SO2_se,SO2_lo,SO2_hi,epidermis_mm_se," \
    "epidermis_mm_lo,epidermis_mm_hi,scattering_a_se,scattering_a_lo,scattering_a_hi," \
    "scattering_b_se,scattering_b_lo,scattering_b_hi,chi_square,degrees,p,noise,placement,row," \
    "nearest_Cm,nearest_Bm,nearest_Ch,nm360,nm370,nm380,nm390,400,410,420,430,440,450,460,470," \
    "480," \
    "490,500,510,520,530,540,550,560,570,580,590,600,610,620,630,640,650,660,670,680,690,700," \
    "nm710,nm720,nm730,nm740\r\n"
#define NOT_REFINED ",,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,," /* 35 cells */
#define TEN_HALVES "0.5,0.5,0.5,0.5,0.5,0.5,0.5,0.5,0.5,0.5,"

static void test_csv_of_a_full_record(void)
{
    char expect[4096];
    struct store_subject subject = { .birth_year = 0 };
    struct store_calibration white = { .instrument = record.instrument, .aperture_mm = 8 };
    strcpy(white.step, "white");
    TRY(store_add_subject(store, &subject, "Ada"));
    TRY(store_add_calibration(store, &white));
    add();
    char first[STORE_UUID_SIZE];
    strcpy(first, record.id);
    strcpy(record.subject, subject.id);
    strcpy(record.calibration_id, white.id);
    strcpy(record.corrects, first);
    record.uuid[0] = 'f';
    add();
    snprintf(expect, sizeof expect,
             CSV_HEAD "%s,1,2031-05-06T07:08:09.123Z," UUID ",Ada,Acme S-1,0042,sce,8,0.04,,"
                      "left forearm,30.5,31.5,32.5,60.25,20.25,-19.75,255,254,253,41.5,D65,10,0.1,"
                      "0.3333333333333333,0.01,0.5,,de2000,two-layer,Cm_at_limit;tie,spread;single,"
                      ",,3" NOT_REFINED ",,,,," TEN_HALVES TEN_HALVES TEN_HALVES "0.5,,,,\r\n"
                      "%s,2,2031-05-06T07:08:09.123Z,f18f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b,Ada,"
                      "Acme S-1,0042,sce,8,0.04,%s,"
                      "left forearm,30.5,31.5,32.5,60.25,20.25,-19.75,255,254,253,41.5,D65,10,0.1,"
                      "0.3333333333333333,0.01,0.5,,de2000,two-layer,Cm_at_limit;tie,spread;single,"
                      "%s,%s,3" NOT_REFINED ",,,,," TEN_HALVES TEN_HALVES TEN_HALVES "0.5,,,,\r\n",
             first, record.id, subject.id, first, white.id);
    check_whole(EXPORT_CSV, expect);
}

/* Where nothing is known nothing stands: no 0, no NaN; bands by 20 nm, the 460 not measured. */
static void test_csv_of_the_least_record(void)
{
    char expect[2048];
    least_record();
    record.spectrum.value[3] = NAN;
    record.specular = record.spectrum.specular = SPECULAR_UNKNOWN;
    add();
    snprintf(expect, sizeof expect,
             CSV_HEAD
             "%s,1,2031-05-06T07:08:09.123Z,,,,,,,,,,,,,,,,,,,,D65,10,,,,,,,,,,,," NOT_REFINED
             ",,,,,"
             "0.25,,0.25,,0.25,,,,0.25,,0.25,,0.25,,0.25,,0.25,,0.25,,0.25,,0.25,,0.25,,"
             "0.25,,0.25,,0.25,,,,\r\n",
             record.id);
    check_whole(EXPORT_CSV, expect);
}

/* 360..740 by 5: every second band has a column; each value is its own wavelength. */
static void test_csv_of_finer_bands(void)
{
    set_bands(350, 5, 81, 0);
    for (size_t i = 0; i < 81; i++)
        record.spectrum.value[i] = (350 + 5 * (double)i) / 1000;
    add();
    char *text = whole(EXPORT_CSV);
    TEST_ASSERT_NOT_NULL(strstr(text, ",3" NOT_REFINED ",0.36,0.37,0.38,0.39,0.4,0.41,0.42,"));
    TEST_ASSERT_NOT_NULL(strstr(text, ",0.69,0.7,0.71,0.72,0.73,0.74\r\n"));
    free(text);
}

/* expect: RFC 4180, and an apostrophe before what a spreadsheet takes for a formula. */
static const struct cell_case {
    const char *text, *cell;
} cell_cases[] = {
    { "arm", "arm" },
    { "Zo\xc3\xab; DROP TABLE x; --", "Zo\xc3\xab; DROP TABLE x; --" },
    { "left, upper", "\"left, upper\"" },
    { "the \"good\" one", "\"the \"\"good\"\" one\"" },
    { "\"", "\"\"\"\"" },
    { "two\nlines", "\"two\nlines\"" },
    { "a\rb", "\"a\rb\"" },
    { " both ends ", "\" both ends \"" },
    { "end ", "\"end \"" },
    { "=1+1", "'=1+1" },
    { "+49 30", "'+49 30" },
    { "-1", "'-1" },
    { "@SUM(A1)", "'@SUM(A1)" },
    { "\t=1", "'\t=1" },
    { "\r=1", "\"'\r=1\"" },
    { "\n=1", "\"'\n=1\"" },
    { "=HYPERLINK(\"x\",\"y\")", "\"'=HYPERLINK(\"\"x\"\",\"\"y\"\")\"" },
    { "a=b", "a=b" },
    { "'=1", "'=1" },
};

static void test_csv_cells(void)
{
    record.uuid[0] = '\0';
    for (size_t i = 0; i < sizeof cell_cases / sizeof *cell_cases; i++) {
        strcpy(record.site, cell_cases[i].text);
        strcpy(record.operator_name, cell_cases[i].text);
        add();
    }
    char *text = whole(EXPORT_CSV), *at = text;
    for (size_t i = 0; i < sizeof cell_cases / sizeof *cell_cases; i++) {
        char expect[256];
        snprintf(expect, sizeof expect, ".123Z,,%s,Acme S-1,0042,sce,8,0.04,,%s,30.5,",
                 cell_cases[i].cell, cell_cases[i].cell);
        at = strstr(at, expect);
        TEST_ASSERT_NOT_NULL_MESSAGE(at, expect);
    }
    free(text);
}

/* A match or flags that are no JSON of ours: their cells stay empty, the others do not. */
static void test_csv_of_what_cannot_be_read(void)
{
    record.uuid[0] = '\0';
    strcpy(record.match_json, "{\"Cm\":0.1}");
    strcpy(record.flags, "spread");
    add();
    strcpy(record.match_json, "not JSON");
    strcpy(record.flags, "[1,\"spread\"]");
    add();
    char *text = whole(EXPORT_CSV);
    TEST_ASSERT_NOT_NULL(strstr(text, ",41.5,D65,10,,,,,,,,,,,,3" NOT_REFINED ",,,,,0.5,"));
    TEST_ASSERT_NOT_NULL(strstr(text, ",41.5,D65,10,,,,,,,,,;spread,,,3" NOT_REFINED ",,,,,0.5,"));
    free(text);
}

/* Of a refined match the fitted skin stands where the row's stood; the row has cells of its own. */
static void test_csv_of_a_refined_record(void)
{
    strcpy(record.refined_json,
           "{\"Cm\":0.031,\"Bm\":0.5,\"Ch\":0.011,\"L\":60,\"a\":10,\"b\":15,\"dE00\":0.25,"
           "\"rms\":0.002,\"by\":\"de2000\",\"table\":\"two-layer\",\"table_sha256\":\"" SHA "\","
           "\"refine\":\"three\",\"model\":\"two-layer\",\"fixed\":{\"Bm\":0.5},"
           "\"se\":{\"Cm\":0.002,\"Ch\":0.0005},"
           "\"interval\":{\"Cm\":[0.027,0.035],\"Ch\":[0.01,0.012]},\"chi_square\":30.5,"
           "\"degrees\":29,\"p\":0.375,"
           "\"noise\":{\"white\":0.003,\"placement\":0.008,\"from\":\"population\"},"
           "\"residual\":{\"first_nm\":400,\"step_nm\":10,\"values\":[0.001,-0.001]},"
           "\"nearest\":{\"row\":17,\"Cm\":0.1,\"Bm\":0.25,\"Ch\":0.01,\"L\":60,\"a\":10,\"b\":15,"
           "\"distance\":0.5,\"flags\":[\"tie\"]},\"words\":[],"
           "\"flags\":[\"second_solution\",\"no_colour\"]}");
    add();
    char *text = whole(EXPORT_CSV);
    TEST_ASSERT_NOT_NULL(strstr(text, ",0.031,0.5,0.011,0.25,0.002,de2000,two-layer,"
                                      "second_solution;no_colour,spread;single,,,3,three,,,,,"
                                      "0.002,0.027,0.035,,,,0.0005,0.01,0.012,,,,,,,,,,,,,30.5,29,"
                                      "0.375,0.003,0.008,17,0.1,0.25,0.01,,,,,0.5,"));
    free(text);
}

/* ---- json --------------------------------------------------------------------------- */

static void test_json(void)
{
    struct schema_error error = { "", "" };
    record.replicates = 1;
    record.replicate[0] = record.spectrum;
    add();
    least_record();
    add();
    char *text = whole(EXPORT_JSON);
    cJSON *array = cJSON_Parse(text), *one;
    TEST_ASSERT_EQUAL_INT(2, cJSON_GetArraySize(array));
    cJSON_ArrayForEach(one, array)
    {
        if (!protocol_check_result(protocol, METHOD_RECORD_GET, one, &error))
            TEST_FAIL_MESSAGE(error.what);
    }
    const cJSON *first = cJSON_GetArrayItem(array, 0), *second = cJSON_GetArrayItem(array, 1);
    TEST_ASSERT_EQUAL_STRING("left forearm", cJSON_GetObjectItem(first, "site")->valuestring);
    const cJSON *match = cJSON_GetObjectItem(first, "match");
    TEST_ASSERT_TRUE(cJSON_GetObjectItem(match, "Bm")->valuedouble == 0.3333333333333333);
    TEST_ASSERT_EQUAL_DOUBLE(2, cJSON_GetObjectItem(second, "seq")->valuedouble);
    TEST_ASSERT_NULL(cJSON_GetObjectItem(second, "XYZ"));
    TEST_ASSERT_EQUAL_STRING_LEN("[\n{\"id\":\"", text, 9);
    TEST_ASSERT_NOT_NULL(strstr(text, "},\n{\"id\":\""));
    TEST_ASSERT_EQUAL_STRING("}\n]\n", text + strlen(text) - 4);
    cJSON_Delete(array);
    free(text);
}

/* ---- cgats -------------------------------------------------------------------------- */

#define CGATS_HEAD(left_out, sets) \
    "SPECT\n\n" \
    "DESCRIPTOR \"Reflectance of skin\"\n" \
    "ORIGINATOR \"skinspec " SKINSPEC_VERSION "\"\n" \
    "MEAS_TYPE \"REFLECTIVE\"\n" \
    "WEIGHTING_FUNCTION \"ILLUMINANT, D65\"\n" \
    "WEIGHTING_FUNCTION \"OBSERVER, 10 degree\"\n" \
    "SPECTRAL_BANDS \"31\"\n" \
    "SPECTRAL_START_NM \"400.0\"\n" \
    "SPECTRAL_END_NM \"700.0\"\n" \
    "SPECTRAL_NORM \"100.0\"\n" \
    "# records left out for want of a band or a colour: " left_out "\n\n" \
    "NUMBER_OF_FIELDS 38\n" \
    "BEGIN_DATA_FORMAT\n" \
    "SAMPLE_ID XYZ_X XYZ_Y XYZ_Z LAB_L LAB_A LAB_B SPEC_400 SPEC_410 SPEC_420 SPEC_430 " \
    "SPEC_440 SPEC_450 SPEC_460 SPEC_470 SPEC_480 SPEC_490 SPEC_500 SPEC_510 SPEC_520 SPEC_530 " \
    "SPEC_540 SPEC_550 SPEC_560 SPEC_570 SPEC_580 SPEC_590 SPEC_600 SPEC_610 SPEC_620 SPEC_630 " \
    "SPEC_640 SPEC_650 SPEC_660 SPEC_670 SPEC_680 SPEC_690 SPEC_700\n" \
    "END_DATA_FORMAT\n\n" \
    "NUMBER_OF_SETS " sets "\n" \
    "BEGIN_DATA\n"
#define TEN_PERCENTS " 50.0 50.0 50.0 50.0 50.0 50.0 50.0 50.0 50.0 50.0"

/* Two that have all, with bands to spare; three that lack a band, one measured, or the colour. */
static void test_cgats(void)
{
    char expect[4096], first[STORE_UUID_SIZE];
    record.uuid[0] = '\0';
    record.spectrum.value[30] = 1e-7;
    record.Lab[1] = 20.0 / 3.0; /* nine digits of it */
    add();
    strcpy(first, record.id);
    set_bands(400, 20, 16, 0.5);
    add();
    set_bands(400, 10, 31, 0.5);
    record.spectrum.value[9] = NAN;
    add();
    set_bands(400, 10, 31, 0.5);
    record.XYZ[0] = NAN;
    add();
    record.XYZ[0] = 30;
    set_bands(380, 5, 71, 0.5);
    add();
    snprintf(expect, sizeof expect,
             CGATS_HEAD(
                 "3", "2") "\"%s\" 30.5 31.5 32.5 60.25 6.66666667 -19.75" TEN_PERCENTS TEN_PERCENTS
                 TEN_PERCENTS " 1e-05\n\"%s\" 30.0 31.5 32.5 60.25 6.66666667 "
                           "-19.75" TEN_PERCENTS TEN_PERCENTS TEN_PERCENTS " 50.0\nEND_DATA\n",
             first, record.id);
    check_whole(EXPORT_CGATS, expect);
}

static void test_empty_store(void)
{
    check_whole(EXPORT_CSV, CSV_HEAD);
    check_whole(EXPORT_JSON, "[\n]\n");
    check_whole(EXPORT_CGATS, CGATS_HEAD("0", "0") "END_DATA\n");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names);
    RUN_TEST(test_csv_of_a_full_record);
    RUN_TEST(test_csv_of_the_least_record);
    RUN_TEST(test_csv_of_finer_bands);
    RUN_TEST(test_csv_cells);
    RUN_TEST(test_csv_of_what_cannot_be_read);
    RUN_TEST(test_csv_of_a_refined_record);
    RUN_TEST(test_json);
    RUN_TEST(test_cgats);
    RUN_TEST(test_empty_store);
    int failures = UNITY_END();
    protocol_close(protocol);
    return failures;
}
