/* test_answer_recompute.c - colour and match again, from what the store gives back. */
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

/* ---- recompute ---------------------------------------------------------------------- */

static void colour_and_match(struct loaded_table *table, enum match_by by)
{
    struct nearest_hit hit;
    cJSON *reply = NULL;
    answer_colour(&weights, &record);
    TRY(answer_match(table, by, 0, &hit, &record, &reply));
    cJSON_Delete(reply);
}

/* By way of the store, as records come: bits must survive it. */
static void store_and_read(struct store_record *r)
{
    struct store *store = NULL;
    struct store_reader *reader = NULL;
    bool known;
    TRY(store_open(folder, NULL, &store));
    TRY(store_add_record(store, r, &known));
    TRY(store_reader_open(folder, &reader));
    TRY(store_get(reader, r->id, NULL, r));
    store_reader_close(reader);
    store_close(store);
}

static void check_recomputed(struct loaded_table *table, bool same_bits, double difference,
                             double tol, const char *what)
{
    cJSON *result = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, answer_recompute(&weights, table, &record, &result),
                                  what);
    check_reply(METHOD_RECORD_RECOMPUTE, result);
    TEST_ASSERT_EQUAL_STRING(record.id, cJSON_GetObjectItem(result, "id")->valuestring);
    TEST_ASSERT_EQUAL_MESSAGE(same_bits, cJSON_IsTrue(cJSON_GetObjectItem(result, "same_bits")),
                              what);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol, difference, number_of(result, "difference"), what);
    char *stored = text_of(cJSON_GetObjectItem(result, "stored"));
    TEST_ASSERT_EQUAL_STRING_MESSAGE(record.match_json, stored, what);
    free(stored);
    cJSON_Delete(result);
}

static void test_recomputed_is_the_same(void)
{
    static const enum match_by ways[] = { MATCH_RGB, MATCH_RGB_FLOAT, MATCH_LAB, MATCH_DE2000,
                                          MATCH_SPECTRUM };
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        record.spectrum = near_row(7 * i + 3, 0.01 / 3.0); /* a number that does not end */
        colour_and_match(two_layer, ways[i]);
        store_and_read(&record);
        memset(&weights, 0, sizeof weights);
        check_recomputed(two_layer, true, 0, 0, match_by_name(ways[i]));
    }
}

/* What is not there is the same as what is not there; and the flag of a band that was set to
 * 0, and with it the match's, is known again. */
static void test_recomputed_without_colour(void)
{
    record.spectrum = near_row(9, 0);
    record.spectrum.value[0] = NAN;
    record.spectrum.value[1] = 0;
    record.spectrum.flag[1] = SPECTRUM_BAND_ZEROED;
    colour_and_match(two_layer, MATCH_SPECTRUM);
    TEST_ASSERT_NOT_NULL(strstr(record.match_json, "\"no_colour\",\"bands_zeroed\""));
    store_and_read(&record);
    check_recomputed(two_layer, true, 0, 0, "no colour");
}

/* A number of the record changed: expect |new - old| / max(|new|, |old|) by hand. */
static void test_recomputed_colour_differs(void)
{
    static const struct {
        const char *what;
        double factor, difference, tol;
    } cases[] = {
        { "a millionth less", 1 - 1e-6, 1e-6, 1e-15 },
        { "twice as much", 2, 0.5, 0 },
        { "the other sign", -1, 2, 0 },
        { "0 instead", 0, 1, 0 },
        { "the last bit", 1 + 0x1p-52, 0x1p-52, 0x1p-52 },
        { "far out", -1e305, 1, 0 },
        { "not known", NAN, 1, 0 },
    };
    record.spectrum = near_row(33, 0);
    colour_and_match(two_layer, MATCH_LAB);
    double *members[] = { &record.XYZ[0], &record.Lab[2], &record.ITA };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        for (size_t k = 0; k < sizeof members / sizeof *members; k++) {
            double right = *members[k];
            *members[k] *= cases[i].factor;
            check_recomputed(two_layer, false, cases[i].difference, cases[i].tol, cases[i].what);
            *members[k] = right;
        }
    }
    record.sRGB[1] *= 2;
    check_recomputed(two_layer, false, 0.5, 0, "an sRGB code");
}

/* A member of the stored match replaced, or removed where value is NULL. */
static void edit_match(const char *member, const char *value)
{
    cJSON *match = cJSON_Parse(record.match_json);
    cJSON_DeleteItemFromObjectCaseSensitive(match, member);
    if (value != NULL)
        cJSON_AddItemToObject(match, member, cJSON_Parse(value));
    char *text = text_of(match);
    strcpy(record.match_json, text);
    free(text);
    cJSON_Delete(match);
}

static void test_recomputed_match_differs(void)
{
    static const struct {
        const char *member, *value;
        double difference;
    } cases[] = {
        { "Cm", "0.1", 1 }, /* another row */
        { "Bm", "0.75", 1 },
        { "Ch", "0.001000000000000001", 1 },
        { "flags", "[]", 1 },
        { "flags", "[\"Bm_at_limit\",\"Ch_at_limit\",\"tie\"]", 1 },
        { "dE00", NULL, 1 },
        { "rms", "0.0005", 0.5 }, /* was 0.001 */
        { "distance", "0.0005", 0.5 },
        { "L", "0", 1 },
    };
    struct store_record *right = malloc(sizeof *right);
    TEST_ASSERT_NOT_NULL(right);
    record.spectrum = near_row(40, 0.001);
    colour_and_match(two_layer, MATCH_SPECTRUM);
    *right = record;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        edit_match(cases[i].member, cases[i].value);
        check_recomputed(two_layer, false, cases[i].difference, 1e-12, cases[i].member);
        record = *right;
    }
    edit_match("flags", "[\"Ch_at_limit\",\"Bm_at_limit\",\"of_a_later_version\"]");
    check_recomputed(two_layer, true, 0, 0, "flags in another order, and one that is not known");
    free(right);
}

static void test_not_recomputed(void)
{
    static const char *const texts[] = { "", "{", "{}", "[]", "{\"by\":\"lab\"}" };
    cJSON *result = NULL;
    record.spectrum = near_row(1, 0);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        strcpy(record.match_json, texts[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_FORMAT, answer_recompute(&weights, two_layer, &record, &result), texts[i]);
        TEST_ASSERT_NULL(result);
    }
    colour_and_match(two_layer, MATCH_SPECTRUM); /* and by a table that has no spectra: */
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, answer_recompute(&weights, paper, &record, &result));
    TEST_ASSERT_NULL(result);
}

static void test_recomputed_without_memory(void)
{
    enum status s = STATUS_NO_MEMORY;
    cJSON *result = NULL;
    long n = 0;
    record.spectrum = near_row(5, 0);
    colour_and_match(two_layer, MATCH_LAB);
    for (; n < 1000; n++) {
        allocations_left = n;
        s = answer_recompute(&weights, two_layer, &record, &result);
        allocations_left = -1;
        if (s == STATUS_OK)
            break;
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_NULL(result);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    TEST_ASSERT_GREATER_THAN(20, n);
    cJSON_Delete(result);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_recomputed_is_the_same);
    RUN_TEST(test_recomputed_without_colour);
    RUN_TEST(test_recomputed_colour_differs);
    RUN_TEST(test_recomputed_match_differs);
    RUN_TEST(test_not_recomputed);
    RUN_TEST(test_recomputed_without_memory);
    int failures = UNITY_END();
    protocol_close(protocol);
    return failures;
}
