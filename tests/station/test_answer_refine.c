/* test_answer_refine.c - the skin between the rows of a record's replicates, kept, read back and
 * computed again. */
#include "station/answer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/station/answer_tools.h"
#include "unity.h"

static struct refine_wish wish;

void setUp(void)
{
    answer_set_up();
    wish = refine_wish_none();
    wish.kind = REFINE_THREE;
}

void tearDown(void)
{
    answer_tear_down();
}

/* Between rows of the small table, as the optics have it. */
static struct spectrum skin(double Cm, double Bm, double Ch, size_t n)
{
    struct spectrum s = bands(400, 10, n, 0);
    struct tissue t = tissue_of(Cm, Bm, Ch);
    struct chromophores c;
    static double scratch[MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)];
    TRY(chromophores_init(s.first_nm, s.step_nm, s.n, &c));
    TRY(model_reflectance(model_find("two-layer"), &t, &c, scratch, s.value));
    return s;
}

static const double Cm = 0.043, Bm = 0.37, Ch = 0.0217;

/* n shots of that skin, each put down a little differently; their mean is the spectrum. */
static void take_shots(size_t n)
{
    record.replicates = n;
    record.spectrum = skin(Cm, Bm, Ch, 31);
    for (size_t r = 0; r < n; r++) {
        record.replicate[r] = skin(Cm, Bm, Ch, 31);
        for (size_t i = 0; i < 31; i++)
            record.replicate[r].value[i] += 0.002 * ((double)r - 0.5 * (double)(n - 1));
    }
}

/* As a measurement is answered; the refined reply, the caller's. */
static cJSON *answered(size_t k)
{
    struct nearest_hit hits[8];
    const char *why;
    cJSON *reply = NULL;
    answer_colour(&weights, &record);
    TRY(answer_match(two_layer, MATCH_SPECTRUM, 0, hits, &record, NULL));
    TRY(answer_refine(two_layer, MATCH_SPECTRUM, &wish, k, hits, &record, &reply, &why));
    TEST_ASSERT_NULL(why);
    check_reply(METHOD_MATCH_SPECTRUM, reply);
    return reply;
}

static void store_and_read(void)
{
    struct store *store = NULL;
    struct store_reader *reader = NULL;
    bool known;
    TRY(store_open(folder, NULL, &store));
    TRY(store_add_record(store, &record, &known));
    TRY(store_reader_open(folder, &reader));
    TRY(store_get(reader, record.id, NULL, &record));
    store_reader_close(reader);
    store_close(store);
}

static void check_recomputed(bool same_bits, double difference, double tol, const char *what)
{
    cJSON *result = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK,
                                  answer_recompute(&weights, two_layer, &record, &result), what);
    check_reply(METHOD_RECORD_RECOMPUTE, result);
    TEST_ASSERT_EQUAL_MESSAGE(same_bits, cJSON_IsTrue(cJSON_GetObjectItem(result, "same_bits")),
                              what);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tol, difference, number_of(result, "difference"), what);
    char *stored = text_of(cJSON_GetObjectItem(result, "stored"));
    TEST_ASSERT_EQUAL_STRING_MESSAGE(record.refined_json, stored, what);
    free(stored);
    cJSON_Delete(result);
}

static double pair_of(const cJSON *object, const char *of, const char *name, int i)
{
    const cJSON *pairs = cJSON_GetObjectItemCaseSensitive(object, of);
    return cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(pairs, name), i)->valuedouble;
}

/* ---- what it says ------------------------------------------------------------------- */

/* expect: the skin that the spectra are of; shots that differ in level alone are placement. */
static void test_the_skin_of_the_shots(void)
{
    take_shots(3);
    cJSON *reply = answered(2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * Cm, Cm, number_of(reply, "Cm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * Bm, Bm, number_of(reply, "Bm"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * Ch, Ch, number_of(reply, "Ch"));
    TEST_ASSERT_TRUE(pair_of(reply, "interval", "Cm", 0) < Cm);
    TEST_ASSERT_TRUE(pair_of(reply, "interval", "Cm", 1) > Cm);
    TEST_ASSERT_EQUAL_DOUBLE(90, number_of(reply, "degrees"));
    const cJSON *noise = cJSON_GetObjectItem(reply, "noise");
    TEST_ASSERT_EQUAL_STRING("replicates", cJSON_GetObjectItem(noise, "from")->valuestring);
    /* What is kept has all but the rows that were asked for. */
    cJSON *nearest = cJSON_GetObjectItem(reply, "nearest");
    TEST_ASSERT_EQUAL_INT(2, cJSON_GetArraySize(cJSON_GetObjectItem(nearest, "rows")));
    cJSON_DeleteItemFromObject(nearest, "rows");
    char *text = text_of(reply);
    TEST_ASSERT_EQUAL_STRING(text, record.refined_json);
    free(text);
    cJSON_Delete(reply);
}

/* A shot that the mean leaves out is not fitted either. */
static void test_an_outlier_is_not_fitted(void)
{
    take_shots(4);
    for (size_t i = 0; i < 31; i++)
        record.replicate[3].value[i] += 0.1;
    wish.white = 0.001;
    cJSON *reply = answered(0);
    TEST_ASSERT_EQUAL_DOUBLE(90, number_of(reply, "degrees"));
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, Cm, number_of(reply, "Cm"));
    cJSON_Delete(reply);
}

/* Shots that were measured with the mirror reflection: fitted without it. */
static void test_the_surface_comes_off(void)
{
    take_shots(3);
    for (size_t r = 0; r < 3; r++) {
        record.replicate_sci[r] = record.replicate[r];
        record.replicate_sci[r].specular = SPECULAR_SCI;
        record.replicate[r].n = 0;
        for (size_t i = 0; i < 31; i++)
            record.replicate_sci[r].value[i] += 0.04;
    }
    record.surface = 0.04;
    cJSON *reply = answered(0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * Cm, Cm, number_of(reply, "Cm"));
    cJSON_Delete(reply);
    store_and_read();
    check_recomputed(true, 0, 0, "sci");
}

static void test_what_cannot_be_refined(void)
{
    struct nearest_hit hits[REFINE_STARTS];
    const char *why = NULL;
    take_shots(1);
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          answer_refine(paper, MATCH_RGB, &wish, 0, hits, &record, NULL, &why));
    TEST_ASSERT_NOT_NULL(why);
    wish.fix[SKIN_BM] = 1.5;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, answer_refine(two_layer, MATCH_SPECTRUM, &wish, 0, hits,
                                                      &record, NULL, &why));
    TEST_ASSERT_NOT_NULL(strstr(why, "Bm"));
    TEST_ASSERT_EQUAL_STRING("", record.refined_json);
}

/* SPECTRUM_MAX_BANDS residuals of as many digits as there are have room in a record. */
static void test_the_largest_has_room(void)
{
    struct chromophores c;
    struct tissue t = tissue_of(Cm, Bm, Ch);
    double *scratch = malloc(MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS) * sizeof *scratch);
    TEST_ASSERT_NOT_NULL(scratch);
    record.spectrum = bands(300, 0.5, SPECTRUM_MAX_BANDS, 0);
    TRY(chromophores_init(300, 0.5, SPECTRUM_MAX_BANDS, &c));
    TRY(model_reflectance(model_find("two-layer"), &t, &c, scratch, record.spectrum.value));
    free(scratch);
    for (size_t i = 0; i < SPECTRUM_MAX_BANDS; i++)
        record.spectrum.value[i] += 1e-3 * sin((double)(i * i));
    cJSON *reply = answered(0);
    TEST_ASSERT_TRUE(strlen(record.refined_json) > 20000);
    cJSON_Delete(reply);
    store_and_read();
    check_recomputed(true, 0, 0, "1024 bands");
}

/* ---- again -------------------------------------------------------------------------- */

static void test_recomputed_is_the_same(void)
{
    static const struct {
        const char *what;
        size_t shots;
        double white, placement, Bm;
        enum refine_kind kind;
    } cases[] = {
        { "replicates", 5, NAN, NAN, NAN, REFINE_THREE },
        { "population", 1, NAN, NAN, NAN, REFINE_THREE },
        { "noise stated", 3, 1e-3, NAN, NAN, REFINE_THREE },
        { "placement stated", 3, NAN, 0.01 / 3, NAN, REFINE_THREE },
        { "both, and Bm held", 3, 7e-4, 0.003, 1.0 / 3, REFINE_THREE },
        { "skin", 3, NAN, NAN, NAN, REFINE_SKIN },
        { "skin, one shot", 1, NAN, NAN, 0.0, REFINE_SKIN },
        { "skin, noise stated", 3, 1e-3, 0.01 / 3, NAN, REFINE_SKIN },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        take_shots(cases[i].shots);
        wish.kind = cases[i].kind;
        wish.white = cases[i].white;
        wish.placement = cases[i].placement;
        wish.fix[SKIN_BM] = cases[i].Bm;
        cJSON_Delete(answered(0));
        store_and_read();
        memset(&weights, 0, sizeof weights);
        check_recomputed(true, 0, 0, cases[i].what);
    }
}

/* A number of the stored answer replaced. */
static void edit(const char *object, const char *member, const char *value)
{
    cJSON *match = cJSON_Parse(record.refined_json);
    cJSON *in = *object != '\0' ? cJSON_GetObjectItemCaseSensitive(match, object) : match;
    cJSON_DeleteItemFromObjectCaseSensitive(in, member);
    if (value != NULL)
        cJSON_AddItemToObject(in, member, cJSON_Parse(value));
    char *text = text_of(match);
    strcpy(record.refined_json, text);
    free(text);
    cJSON_Delete(match);
}

static void test_recomputed_differs(void)
{
    static const struct {
        const char *object, *member, *value;
        double difference;
    } cases[] = {
        { "", "Cm", "0.0215", 0.5 },
        { "", "dE00", NULL, 1 },
        { "", "rms", "1e9", 1 },
        { "", "L", "0", 1 },
        { "", "flags", "[]", 1 },
        { "", "degrees", "5", 1 },
        { "se", "Bm", "1e9", 1 },
        { "se", "Bm", NULL, 1 },
        { "interval", "Ch", "[0.0,1e9]", 1 },
        { "noise", "white", "1e9", 1 },
        { "nearest", "row", "1", 1 },
        { "residual", "values", "[1e9]", 1 },
    };
    struct store_record *right = malloc(sizeof *right);
    TEST_ASSERT_NOT_NULL(right);
    take_shots(3);
    record.replicate[1].value[4] += 0.001; /* a residual, and what goes with it */
    cJSON_Delete(answered(0));
    *right = record;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        edit(cases[i].object, cases[i].member, cases[i].value);
        check_recomputed(false, cases[i].difference, 1e-3, cases[i].member);
        record = *right;
    }
    record.Lab[1] *= 2;
    check_recomputed(false, 0.5, 1e-12, "the colour is looked at as well");
    free(right);
}

static void test_not_recomputed(void)
{
    static const char *const texts[] = { "{", "{}", "[]", "{\"refine\":\"four\"}" };
    cJSON *result = NULL;
    take_shots(2);
    cJSON_Delete(answered(0));
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        strcpy(record.refined_json, texts[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_FORMAT, answer_recompute(&weights, two_layer, &record, &result), texts[i]);
        TEST_ASSERT_NULL(result);
    }
    strcpy(record.refined_json, record.match_json); /* which is not refined */
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, answer_recompute(&weights, two_layer, &record, &result));
}

static void test_without_memory(void)
{
    struct nearest_hit hits[REFINE_STARTS];
    const char *why;
    enum status s = STATUS_NO_MEMORY;
    cJSON *reply = NULL;
    long n = 0;
    take_shots(2);
    TRY(answer_match(two_layer, MATCH_SPECTRUM, 0, hits, &record, NULL));
    for (; n < 2000; n++) {
        allocations_left = n;
        s = answer_refine(two_layer, MATCH_SPECTRUM, &wish, 0, hits, &record, &reply, &why);
        allocations_left = -1;
        if (s == STATUS_OK)
            break;
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_NULL(reply);
        TEST_ASSERT_EQUAL_STRING("", record.refined_json);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    TEST_ASSERT_GREATER_THAN(100, n);
    cJSON_Delete(reply);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_skin_of_the_shots);
    RUN_TEST(test_an_outlier_is_not_fitted);
    RUN_TEST(test_the_surface_comes_off);
    RUN_TEST(test_what_cannot_be_refined);
    RUN_TEST(test_the_largest_has_room);
    RUN_TEST(test_recomputed_is_the_same);
    RUN_TEST(test_recomputed_differs);
    RUN_TEST(test_not_recomputed);
    RUN_TEST(test_without_memory);
    int failures = UNITY_END();
    protocol_close(protocol);
    return failures;
}
