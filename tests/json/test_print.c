/* test_print.c - one line of JSON: exact numbers, limits, nothing that is not JSON. */
#include "json/print.h"

#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
    setlocale(LC_ALL, "C");
}

/* expect: RFC 8259, with no white space; NULL: as it came. */
static const struct print_case {
    const char *text, *expect;
} print_cases[] = {
    { "{}", NULL },
    { "[]", NULL },
    { "[true,false,null]", NULL },
    { "{\"a\":1,\"b\":[{\"c\":\"d\"},[]],\"\":0}", NULL },
    { "{ \"a\" : [ 1 , 2.50 ] }", "{\"a\":[1,2.5]}" },
    { "9007199254740991", NULL },
    { "-0.1", NULL },
    { "0.30000000000000004", NULL },
    { "-0", "0" },
    { "\"\\\"\\\\\\b\\f\\n\\r\\t\"", NULL },
    { "\"\\u0001\\u001f\"", NULL },
    { "\"\x7f \xc3\xa9 \xf0\x9f\x98\x80 /\"", NULL },
    { "{\"quo\\\"te\\n\":1}", NULL },
};

static void test_print(void)
{
    for (size_t i = 0; i < sizeof print_cases / sizeof *print_cases; i++) {
        const struct print_case *c = &print_cases[i];
        const char *expect = c->expect != NULL ? c->expect : c->text;
        char *text = NULL;
        size_t n = 0;
        cJSON *value = cJSON_Parse(c->text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, json_print(value, 1000, &text, &n), c->text);
        TEST_ASSERT_EQUAL_STRING(expect, text);
        TEST_ASSERT_EQUAL_size_t(strlen(expect), n);
        free(text);
        cJSON_Delete(value);
    }
}

/* Any double comes back as it was, whatever the locale. */
static void test_numbers_read_back(void)
{
    struct dice dice = { 7 };
    setlocale(LC_ALL, "de_DE.UTF-8"); /* where it is installed */
    for (int i = 0; i < 20000; i++) {
        double x = ldexp(dice_between(&dice, -1, 1), (int)dice_below(&dice, 2000) - 1000), back;
        char *text = NULL;
        cJSON *value = cJSON_CreateNumber(x);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, json_print(value, 100, &text, NULL));
        TEST_ASSERT_NULL(strchr(text, ','));
        cJSON_Delete(value);
        value = cJSON_Parse(text);
        back = value->valuedouble;
        TEST_ASSERT_EQUAL_MEMORY(&x, &back, sizeof x);
        cJSON_Delete(value);
        free(text);
    }
}

static void test_raw_is_taken_as_it_is(void)
{
    char *text = NULL;
    cJSON *object = cJSON_CreateObject();
    cJSON_AddRawToObject(object, "x", "[1.50]");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, json_print(object, 100, &text, NULL));
    TEST_ASSERT_EQUAL_STRING("{\"x\":[1.50]}", text);
    free(text);
    cJSON_Delete(object);
}

static void test_limit(void)
{
    char *text = NULL;
    cJSON *value = cJSON_Parse("{\"abc\":[1,2,\"\\n\"]}"); /* 18 bytes */
    for (size_t limit = 0; limit < 18; limit++)
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, json_print(value, limit, &text, NULL));
    TEST_ASSERT_NULL(text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, json_print(value, 18, &text, NULL));
    free(text);
    cJSON_Delete(value);
}

static void test_what_is_no_json(void)
{
    char *text = NULL;
    cJSON *list = cJSON_CreateArray();
    cJSON_AddItemToArray(list, cJSON_CreateNumber(NAN));
    cJSON_AddItemToArray(list, cJSON_CreateNumber(INFINITY));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, json_print(list, SIZE_MAX, &text, NULL));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, json_print(list, 0, &text, NULL)); /* the first cause */
    TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, json_print(NULL, SIZE_MAX, &text, NULL));
    TEST_ASSERT_NULL(text);
    cJSON_Delete(list);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_print);
    RUN_TEST(test_numbers_read_back);
    RUN_TEST(test_raw_is_taken_as_it_is);
    RUN_TEST(test_limit);
    RUN_TEST(test_what_is_no_json);
    return UNITY_END();
}
