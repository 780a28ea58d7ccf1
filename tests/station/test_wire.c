/* test_wire.c - spectra, matches and records there and back. */
#include "station/wire.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/print.h"
#include "station/protocol.h"
#include "unity.h"

#define U "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b"
#define SHA "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static struct protocol *protocol;
static struct store_record record, again;
static long allocations_left = -1; /* of cJSON; -1: never fail */

static void *test_malloc(size_t size)
{
    if (allocations_left == 0)
        return NULL;
    if (allocations_left > 0)
        allocations_left--;
    return malloc(size);
}

static struct spectrum some_spectrum(double level, enum specular specular)
{
    struct spectrum s = { .first_nm = 400, .step_nm = 10, .n = 3, .specular = specular };
    s.aperture_mm = 8;
    for (size_t i = 0; i < s.n; i++)
        s.value[i] = level + (double)i / 3.0;
    return s;
}

static const char match_text[] =
    "{\"Cm\":0.1,\"Bm\":0.3333333333333333,\"Ch\":0.01,\"L\":60,\"a\":10,\"b\":15,\"dE00\":0.5,"
    "\"distance\":0.5,\"by\":\"de2000\",\"table\":\"two-layer\",\"table_sha256\":\"" SHA
    "\",\"flags\":[\"tie\"]}";

static void full_record(void)
{
    memset(&record, 0, sizeof record);
    struct store_instrument instrument = {
        "simulated", "Acme", "S-1", "0042", "1.0",
    };
    record.instrument = instrument;
    strcpy(record.id, U);
    record.seq = 12;
    strcpy(record.uuid, U);
    strcpy(record.taken_at, "2031-05-06T07:08:09.123Z");
    strcpy(record.operator_name, "Ada");
    record.specular = SPECULAR_SCE;
    record.aperture_mm = 8;
    record.surface = 0.04;
    record.replicates = 2;
    for (size_t i = 0; i < 2; i++) {
        record.replicate[i] = some_spectrum(0.1 * (double)(i + 1), SPECULAR_SCE);
        record.replicate_sci[i] = some_spectrum(0.2 * (double)(i + 1), SPECULAR_SCI);
    }
    record.spectrum = some_spectrum(0.15, SPECULAR_SCE);
    for (size_t i = 0; i < 3; i++) {
        record.XYZ[i] = 30.1 + (double)i;
        record.Lab[i] = 60.2 - 20.0 * (double)i;
        record.sRGB[i] = 255 - (int)i;
    }
    record.ITA = 41.5;
    strcpy(record.ita_scheme, "D65/10");
    strcpy(record.illuminant, "D65");
    strcpy(record.observer, "10");
    strcpy(record.calibration_id, U);
    record.fence = 3;
    strcpy(record.subject, U);
    strcpy(record.site, "left forearm");
    strcpy(record.corrects, U);
    strcpy(record.flags, "[\"spread\",\"single\"]");
    strcpy(record.match_json, match_text);
}

void setUp(void)
{
    cJSON_Hooks hooks = { test_malloc, free };
    allocations_left = -1;
    cJSON_InitHooks(&hooks);
    if (protocol == NULL)
        TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_open(&protocol));
    full_record();
}

void tearDown(void)
{
    allocations_left = -1;
    cJSON_InitHooks(NULL);
}

static char *text_of(const cJSON *value)
{
    char *text = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, json_print(value, 1 << 20, &text, NULL));
    return text;
}

/* ---- spectra ------------------------------------------------------------------------ */

static void test_spectrum(void)
{
    struct spectrum s = some_spectrum(0.1, SPECULAR_SCE), back;
    cJSON *object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_spectrum(&s, &object));
    char *text = text_of(object);
    TEST_ASSERT_EQUAL_STRING("{\"first_nm\":400,\"step_nm\":10,\"values\":[0.1,0.43333333333333335,"
                             "0.7666666666666666]}",
                             text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_spectrum(object, &back));
    TEST_ASSERT_EQUAL_size_t(3, back.n);
    TEST_ASSERT_EQUAL_MEMORY(s.value, back.value, sizeof s.value);
    TEST_ASSERT_EQUAL_INT(SPECULAR_UNKNOWN, back.specular);
    TEST_ASSERT_TRUE(isnan(back.aperture_mm));
    free(text);
    cJSON_Delete(object);
}

static void test_spectrum_not_measured(void)
{
    struct spectrum s = some_spectrum(0.1, SPECULAR_SCE);
    cJSON *object = NULL;
    s.value[1] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_spectrum(&s, &object));
    s.value[1] = 0;
    s.step_nm = INFINITY;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_spectrum(&s, &object));
    TEST_ASSERT_NULL(object);
}

static void test_spectra_that_are_none(void)
{
    static const char *const texts[] = {
        "1",
        "{}",
        "{\"first_nm\":400,\"step_nm\":10}",
        "{\"first_nm\":400,\"step_nm\":10,\"values\":[]}",
        "{\"first_nm\":400,\"step_nm\":10,\"values\":[\"0.1\"]}",
        "{\"first_nm\":400,\"step_nm\":0,\"values\":[0.1]}",
        "{\"first_nm\":\"400\",\"step_nm\":10,\"values\":[0.1]}",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct spectrum s;
        cJSON *object = cJSON_Parse(texts[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, wire_read_spectrum(object, &s), texts[i]);
        cJSON_Delete(object);
    }
}

static void test_spectrum_of_too_many_bands(void)
{
    struct spectrum s;
    double values[SPECTRUM_MAX_BANDS + 1] = { 0 };
    cJSON *object = cJSON_Parse("{\"first_nm\":400,\"step_nm\":1}");
    cJSON_AddItemToObject(object, "values", cJSON_CreateDoubleArray(values, SPECTRUM_MAX_BANDS));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_spectrum(object, &s));
    cJSON_ReplaceItemInObject(object, "values",
                              cJSON_CreateDoubleArray(values, SPECTRUM_MAX_BANDS + 1));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, wire_read_spectrum(object, &s));
    cJSON_Delete(object);
}

/* ---- matches ------------------------------------------------------------------------ */

static double Cm[] = { 0.1, 0.2 }, Bm[] = { 0.3, 0.4 }, Ch[] = { 0.01, 0.02 }, zero[] = { 0, 0 };
static const struct table table = { .name = "two-layer",
                                    .sha256 = SHA,
                                    .recipe = { .model = &model_list[0] },
                                    .n = 2,
                                    .Cm = Cm,
                                    .Bm = Bm,
                                    .Ch = Ch,
                                    .L = zero,
                                    .a = zero,
                                    .b = zero,
                                    .red = zero,
                                    .green = zero,
                                    .blue = zero };
static const struct nearest_hit hits[] = { { 1, 0.25 }, { 0, 0.5 } };

static struct match some_match(void)
{
    struct match m = { .row = { 0.2, 0.4, 0.02, { 60, 10, 15 }, { 0.5, 0.4, 0.3 } },
                       .row_index = 1,
                       .distance = 0.25,
                       .by = MATCH_RGB_FLOAT,
                       .dE00 = NAN,
                       .rms = 0.01,
                       .flags = MATCH_TIE | MATCH_NO_COLOUR,
                       .found = 2 };
    return m;
}

static void test_match(void)
{
    struct match m = some_match();
    struct wire_match back;
    struct schema_error error = { "", "" };
    cJSON *object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_match(&table, &m, hits, 5, &object));
    char *text = text_of(object);
    TEST_ASSERT_EQUAL_STRING(
        "{\"Cm\":0.2,\"Bm\":0.4,\"Ch\":0.02,\"L\":60,\"a\":10,\"b\":15,\"rms\":0.01,\"distance\":"
        "0.25,\"by\":\"rgb-float\",\"table\":\"two-layer\",\"table_sha256\":\"" SHA
        "\",\"nearest\":[{\"row\":2,\"Cm\":0.2,\"Bm\":0.4,\"Ch\":0.02,\"distance\":0.25},{\"row\":"
        "1,"
        "\"Cm\":0.1,\"Bm\":0.3,\"Ch\":0.01,\"distance\":0.5}],\"flags\":[\"tie\",\"no_colour\"]}",
        text);
    TEST_ASSERT_TRUE_MESSAGE(protocol_check_result(protocol, METHOD_MATCH_SPECTRUM, object, &error),
                             error.what);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_match(object, &back));
    TEST_ASSERT_EQUAL_DOUBLE(m.row.Ch, back.match.row.Ch);
    TEST_ASSERT_EQUAL_DOUBLE(m.row.Lab[2], back.match.row.Lab[2]);
    TEST_ASSERT_TRUE(isnan(back.match.dE00));
    TEST_ASSERT_EQUAL_INT(MATCH_RGB_FLOAT, back.match.by);
    TEST_ASSERT_EQUAL_UINT(m.flags, back.match.flags);
    TEST_ASSERT_EQUAL_size_t(1, back.match.row_index);
    TEST_ASSERT_EQUAL_size_t(2, back.match.found);
    TEST_ASSERT_EQUAL_STRING("two-layer", back.table);
    TEST_ASSERT_EQUAL_STRING(SHA, back.table_sha256);
    free(text);
    cJSON_Delete(object);
}

static void test_match_without_nearest(void)
{
    struct match m = some_match();
    struct wire_match back;
    cJSON *object = NULL;
    m.flags = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_match(&table, &m, hits, 0, &object));
    TEST_ASSERT_NULL(cJSON_GetObjectItem(object, "nearest"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_match(object, &back));
    TEST_ASSERT_EQUAL_size_t(0, back.match.found);
    cJSON_Delete(object);
    object = NULL;
    m.row.Bm = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_match(&table, &m, hits, 0, &object));
    TEST_ASSERT_NULL(object);
}

/* A member replaced (NULL: removed) in a match that is right otherwise. */
static void test_matches_that_are_none(void)
{
    static const struct {
        const char *member, *value;
    } cases[] = {
        { "Cm", NULL },
        { "Cm", "\"0.1\"" },
        { "distance", NULL },
        { "by", "\"RGB\"" },
        { "by", "1" },
        { "by", "\"a name longer than any of ours\"" },
        { "by", NULL },
        { "table", NULL },
        { "table_sha256", "\"" SHA "0\"" },
        { "nearest", "[{\"row\":0}]" },
        { "nearest", "[{\"row\":1e300}]" },
        { "nearest", "[1]" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct wire_match m;
        cJSON *object = cJSON_Parse(match_text);
        cJSON_DeleteItemFromObjectCaseSensitive(object, cases[i].member);
        if (cases[i].value != NULL)
            cJSON_AddItemToObject(object, cases[i].member, cJSON_Parse(cases[i].value));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, wire_read_match(object, &m), cases[i].member);
        cJSON_Delete(object);
    }
}

/* ---- refined matches ---------------------------------------------------------------- */

/* All that can be told: every parameter another number, all free but Bm, which is held. */
static struct refined_match some_refined(enum refine_kind kind)
{
    struct refined_match m = { .nearest = some_match(), .wish = refine_wish_none() };
    struct refined *r = &m.refined;
    m.wish.kind = kind;
    m.wish.fix[SKIN_BM] = 0.5;
    m.source = NOISE_REPLICATES;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++) {
        double x = 0.125 * (double)(i + 1);
        r->value[i] = x;
        r->se[i] = x / 64;
        r->repeat_se[i] = x / 96;
        r->lo[i] = x / 2;
        r->hi[i] = 2 * x;
        r->second[i] = x / 3;
    }
    r->free = ((1u << SKIN_PARAMETERS) - 1) & ~(1u << SKIN_BM);
    if (kind == REFINE_THREE)
        r->free &= 7u;
    r->flags = REFINE_AT_BOUND << SKIN_CM | REFINE_SECOND_SOLUTION;
    r->first_nm = 400;
    r->step_nm = 10;
    r->bands = 31;
    for (size_t i = 0; i < r->bands; i++)
        r->residual[i] = 0.001 / (double)(i + 3);
    r->rms = 0.0021;
    r->dE00 = 0.3;
    r->chi_square = 27.5;
    r->degrees = 26;
    r->chi_square_p = 0.375;
    r->noise = (struct noise){ 0.003, 0.008 / 3, 0.4 };
    r->has_second = true;
    r->second_chi_square = 28.25;
    m.Lab[0] = 60.5;
    m.Lab[1] = 10.25;
    m.Lab[2] = 14.125;
    return m;
}

static void check_parameter(const struct refined *r, const struct refined *back, size_t i,
                            bool is_told)
{
    if (!is_told) {
        TEST_ASSERT_TRUE(isnan(back->value[i]) && isnan(back->se[i]) && isnan(back->second[i]));
        return;
    }
    TEST_ASSERT_EQUAL_DOUBLE(r->value[i], back->value[i]);
    TEST_ASSERT_EQUAL_DOUBLE(r->second[i], back->second[i]);
    bool free = (r->free & 1u << i) != 0;
    TEST_ASSERT_EQUAL(free, (back->free & 1u << i) != 0);
    TEST_ASSERT_EQUAL(free, !isnan(back->se[i]));
    if (!free)
        return;
    TEST_ASSERT_EQUAL_DOUBLE(r->se[i], back->se[i]);
    TEST_ASSERT_EQUAL_DOUBLE(r->repeat_se[i], back->repeat_se[i]);
    TEST_ASSERT_EQUAL_DOUBLE(r->lo[i], back->lo[i]);
    TEST_ASSERT_EQUAL_DOUBLE(r->hi[i], back->hi[i]);
}

static void check_refined(const struct refined_match *m, const struct wire_match *back)
{
    const struct refined *r = &m->refined, *b = &back->refined.refined;
    size_t parameters = m->wish.kind == REFINE_THREE ? 3 : SKIN_PARAMETERS;
    TEST_ASSERT_TRUE(back->is_refined);
    TEST_ASSERT_EQUAL_INT(m->wish.kind, back->refined.wish.kind);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, back->refined.wish.fix[SKIN_BM]);
    TEST_ASSERT_TRUE(isnan(back->refined.wish.fix[SKIN_CM]));
    TEST_ASSERT_TRUE(isnan(back->refined.wish.white)); /* found out again, as the source says */
    TEST_ASSERT_EQUAL_INT(NOISE_REPLICATES, back->refined.source);
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        check_parameter(r, b, i, i < parameters);
    TEST_ASSERT_EQUAL_UINT(r->flags, b->flags);
    TEST_ASSERT_EQUAL_MEMORY(r->residual, b->residual, 31 * sizeof *r->residual);
    TEST_ASSERT_EQUAL_MEMORY(m->Lab, back->refined.Lab, sizeof m->Lab);
    TEST_ASSERT_TRUE(b->rms == r->rms && b->dE00 == r->dE00 && b->chi_square == r->chi_square);
    TEST_ASSERT_TRUE(b->degrees == r->degrees && b->chi_square_p == r->chi_square_p);
    TEST_ASSERT_TRUE(b->noise.white == 0.003 && b->noise.placement == 0.008 / 3);
    TEST_ASSERT_TRUE(b->has_second && b->second_chi_square == r->second_chi_square);
    TEST_ASSERT_EQUAL_size_t(m->nearest.row_index, back->match.row_index);
    TEST_ASSERT_EQUAL_DOUBLE(m->nearest.row.Cm, back->match.row.Cm);
    TEST_ASSERT_EQUAL_DOUBLE(m->nearest.distance, back->match.distance);
    TEST_ASSERT_EQUAL_UINT(m->nearest.flags, back->match.flags);
    TEST_ASSERT_EQUAL_INT(m->nearest.by, back->match.by);
}

static void test_refined(void)
{
    for (int kind = REFINE_THREE; kind < REFINE_KINDS; kind++) {
        struct refined_match m = some_refined((enum refine_kind)kind);
        struct schema_error error = { "", "" };
        struct wire_match back;
        cJSON *object = NULL;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_refined_match(&table, &m, hits, 2, &object));
        if (!protocol_check_result(protocol, METHOD_MATCH_SPECTRUM, object, &error))
            TEST_FAIL_MESSAGE(error.what);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_match(object, &back));
        check_refined(&m, &back);
        cJSON_Delete(object);
    }
}

/* A member replaced (NULL: removed) in a refined match that is right otherwise. */
static void test_refined_that_are_none(void)
{
    static const struct {
        const char *member, *value;
    } cases[] = {
        { "Cm", "\"0.1\"" },
        { "refine", "\"four\"" },
        { "se", NULL },
        { "se", "{\"Cm\":\"1\"}" },
        { "interval", NULL },
        { "interval", "{\"Cm\":[1]}" },
        { "interval", "{\"Cm\":[1,2,3]}" },
        { "noise", NULL },
        { "noise", "{\"white\":0.1,\"placement\":0,\"from\":\"somewhere\"}" },
        { "residual", NULL },
        { "nearest", NULL },
        { "nearest", "[]" },
        { "second", "{\"Cm\":0.1}" },
        { "degrees", "-1" },
        { "degrees", "1e300" },
        { "p", NULL },
        { "rms", NULL },
        { "by", NULL },
    };
    struct refined_match right = some_refined(REFINE_THREE);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct wire_match m;
        cJSON *object = NULL;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_refined_match(&table, &right, hits, 0, &object));
        cJSON_DeleteItemFromObjectCaseSensitive(object, cases[i].member);
        if (cases[i].value != NULL)
            cJSON_AddItemToObject(object, cases[i].member, cJSON_Parse(cases[i].value));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, wire_read_match(object, &m), cases[i].member);
        cJSON_Delete(object);
    }
    right.refined.residual[3] = NAN;
    cJSON *object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_refined_match(&table, &right, hits, 0, &object));
    TEST_ASSERT_NULL(object);
}

/* ---- records ------------------------------------------------------------------------ */

static void check_round_trip(void)
{
    struct schema_error error = { "", "" };
    cJSON *object = NULL, *second = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&record, &object));
    if (!protocol_check_result(protocol, METHOD_RECORD_GET, object, &error))
        TEST_FAIL_MESSAGE(error.what);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_record(object, &again));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&again, &second));
    char *a = text_of(object), *b = text_of(second);
    TEST_ASSERT_EQUAL_STRING(a, b);
    free(a);
    free(b);
    cJSON_Delete(object);
    cJSON_Delete(second);
}

static void test_record(void)
{
    check_round_trip();
    TEST_ASSERT_EQUAL_STRING(record.flags, again.flags);
    TEST_ASSERT_EQUAL_STRING(match_text, again.match_json);
    TEST_ASSERT_EQUAL_STRING("de2000", again.method);
    TEST_ASSERT_EQUAL_STRING("Acme S-1", again.instrument.model);
    TEST_ASSERT_EQUAL_MEMORY(&record.replicate[1], &again.replicate[1], sizeof record.spectrum);
    TEST_ASSERT_EQUAL_MEMORY(&record.replicate_sci, &again.replicate_sci,
                             sizeof record.replicate_sci);
    TEST_ASSERT_EQUAL_MEMORY(record.XYZ, again.XYZ, sizeof record.XYZ);
    TEST_ASSERT_EQUAL_MEMORY(record.sRGB, again.sRGB, sizeof record.sRGB);
    TEST_ASSERT_TRUE(again.fence == 3 && again.seq == 12);
}

/* A record's match is the refined one where there is one. */
static void test_record_that_was_refined(void)
{
    struct refined_match m = some_refined(REFINE_THREE);
    cJSON *object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_refined_match(&table, &m, hits, 0, &object));
    char *text = text_of(object);
    strcpy(record.refined_json, text);
    check_round_trip();
    TEST_ASSERT_EQUAL_STRING(text, again.refined_json);
    TEST_ASSERT_EQUAL_STRING("", again.match_json);
    free(text);
    cJSON_Delete(object);
}

/* A spectrum that a client sent: nothing of an instrument, no colour, no match. */
static void test_least_record(void)
{
    memset(&record, 0, sizeof record);
    strcpy(record.id, U);
    record.seq = 1;
    strcpy(record.taken_at, "2031-05-06T07:08:09.123Z");
    record.specular = SPECULAR_SCI;
    record.aperture_mm = record.surface = record.ITA = NAN;
    record.XYZ[0] = NAN;
    record.spectrum = some_spectrum(0.2, SPECULAR_SCI);
    strcpy(record.illuminant, "D65");
    strcpy(record.observer, "10");
    check_round_trip();
    TEST_ASSERT_TRUE(isnan(again.aperture_mm) && isnan(again.XYZ[0]) && isnan(again.ITA));
    TEST_ASSERT_EQUAL_STRING("[]", again.flags);
    TEST_ASSERT_EQUAL_STRING("", again.match_json);
}

static void test_record_of_sci_alone(void)
{
    memset(record.replicate, 0, sizeof record.replicate);
    check_round_trip();
    TEST_ASSERT_EQUAL_size_t(2, again.replicates);
    TEST_ASSERT_EQUAL_size_t(0, again.replicate[0].n);
}

/* The maker and model together are longer than a model may be. */
static void test_record_of_a_long_name(void)
{
    memset(record.instrument.maker, 'm', sizeof record.instrument.maker - 1);
    memset(record.instrument.model, 'n', sizeof record.instrument.model - 1);
    cJSON *object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&record, &object));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_record(object, &again));
    TEST_ASSERT_EQUAL_size_t(sizeof again.instrument.model - 1, strlen(again.instrument.model));
    cJSON_Delete(object);
}

static void test_records_that_cannot_be_sent(void)
{
    cJSON *object = NULL;
    strcpy(record.match_json, "{\"Cm\":");
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_record(&record, &object));
    full_record();
    strcpy(record.flags, "[1,]");
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_record(&record, &object));
    full_record();
    record.Lab[1] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_record(&record, &object));
    full_record();
    record.replicate[1].value[0] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_record(&record, &object));
    full_record();
    record.spectrum.value[0] = NAN;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_record(&record, &object));
    TEST_ASSERT_NULL(object);
}

static void test_records_that_are_none(void)
{
    static const struct {
        const char *member, *value;
    } cases[] = {
        { "id", NULL },
        { "id", "1" },
        { "id", "\"" U "0\"" },
        { "seq", NULL },
        { "seq", "1e300" },
        { "taken_at", NULL },
        { "specular", NULL },
        { "specular", "\"mirror\"" },
        { "spectrum", NULL },
        { "spectrum", "{\"values\":[1]}" },
        { "replicates", "[1]" },
        { "replicates", "[{\"first_nm\":1,\"step_nm\":1,\"values\":[1]}]" },
        { "XYZ", "[1,2]" },
        { "XYZ", "[1,2,3,4]" },
        { "Lab", NULL },
        { "sRGB", "[0,0,256]" },
        { "sRGB", "[0,-1,0]" },
        { "sRGB", "[0,0,\"0\"]" },
        { "ITA", NULL },
        { "ita_scheme", NULL },
        { "fence", "\"3\"" },
        { "match", "{}" },
        { "illuminant", NULL },
        { "serial", "5" },
        { "instrument", "5" },
        { "aperture_mm", "\"8\"" },
    };
    cJSON *whole = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&record, &whole));
    memset(&again, 77, sizeof again);
    record = again;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        cJSON *object = cJSON_Duplicate(whole, true);
        cJSON_DeleteItemFromObjectCaseSensitive(object, cases[i].member);
        if (cases[i].value != NULL)
            cJSON_AddItemToObject(object, cases[i].member, cJSON_Parse(cases[i].value));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, wire_read_record(object, &again),
                                      cases[i].member);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&record, &again, sizeof again, cases[i].member);
        cJSON_Delete(object);
    }
    cJSON_Delete(whole);
}

static void test_record_with_too_much(void)
{
    cJSON *object = NULL, *list = cJSON_CreateArray();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&record, &object));
    for (int i = 0; i <= STORE_MAX_REPLICATES; i++)
        cJSON_AddItemToArray(list, cJSON_Parse("{\"first_nm\":1,\"step_nm\":1,\"values\":[1]}"));
    cJSON_ReplaceItemInObjectCaseSensitive(object, "replicates", list);
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, wire_read_record(object, &again));
    cJSON_Delete(object);
    object = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_record(&record, &object));
    char flag[1200];
    memset(flag, 'f', sizeof flag - 1);
    flag[sizeof flag - 1] = '\0';
    cJSON_AddItemToArray(cJSON_GetObjectItem(object, "flags"), cJSON_CreateString(flag));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, wire_read_record(object, &again));
    cJSON_Delete(object);
}

/* A scene that was settled before a rule was made is read all the same. */
static void test_kept_scenes(void)
{
    static const char *const texts[] = { "{\"want\":[\"lab\"],\"noise\":0.003}",
                                         "{\"want\":[\"refined\"],\"illuminant\":\"A\"}" };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        char why[SCENE_WHY_SIZE] = "";
        struct scene scene;
        cJSON *object = cJSON_Parse(texts[i]);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, wire_read_kept_scene(object, &scene, why));
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, wire_read_scene(object, &scene, why));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, "nothing that is wanted uses"), why);
        cJSON_Delete(object);
    }
}

/* Each allocation of cJSON fails in its turn; nothing leaks (seen under AddressSanitizer). */
static void test_no_memory(void)
{
    struct match m = some_match();
    for (int kind = 0; kind < 2; kind++) {
        for (long enough = 0;; enough++) {
            cJSON *object = NULL;
            allocations_left = enough;
            enum status s = kind == 0 ? wire_record(&record, &object)
                                      : wire_match(&table, &m, hits, 2, &object);
            allocations_left = -1;
            if (s == STATUS_OK) {
                cJSON_Delete(object);
                break;
            }
            TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
            TEST_ASSERT_NULL(object);
        }
    }
}

static void test_done(void)
{
    protocol_close(protocol);
    protocol = NULL;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_spectrum);
    RUN_TEST(test_spectrum_not_measured);
    RUN_TEST(test_spectra_that_are_none);
    RUN_TEST(test_spectrum_of_too_many_bands);
    RUN_TEST(test_match);
    RUN_TEST(test_match_without_nearest);
    RUN_TEST(test_matches_that_are_none);
    RUN_TEST(test_refined);
    RUN_TEST(test_refined_that_are_none);
    RUN_TEST(test_record);
    RUN_TEST(test_record_that_was_refined);
    RUN_TEST(test_least_record);
    RUN_TEST(test_record_of_sci_alone);
    RUN_TEST(test_record_of_a_long_name);
    RUN_TEST(test_records_that_cannot_be_sent);
    RUN_TEST(test_records_that_are_none);
    RUN_TEST(test_record_with_too_much);
    RUN_TEST(test_kept_scenes);
    RUN_TEST(test_no_memory);
    RUN_TEST(test_done);
    return UNITY_END();
}
