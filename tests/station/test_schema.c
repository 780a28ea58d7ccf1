/* test_schema.c - each keyword: what it takes, what it refuses, and what it says then. */
#include "station/schema.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

static cJSON *defs;

void setUp(void)
{
    defs =
        cJSON_Parse("{\"id\":{\"type\":\"string\",\"format\":\"uuid\"},"
                    "\"loop\":{\"$ref\":\"#/$defs/loop\"},"
                    "\"point\":{\"type\":\"object\",\"properties\":{\"x\":{\"type\":\"number\"}},"
                    "\"required\":[\"x\"]}}");
}

void tearDown(void)
{
    cJSON_Delete(defs);
}

/* expect: JSON Schema 2020-12 (core, validation) read by hand; NULL: accepted. */
static const struct check_case {
    const char *schema, *value, *path, *what;
} check_cases[] = {
    /* types */
    { "{\"type\":\"string\"}", "\"\"", NULL, NULL },
    { "{\"type\":\"string\"}", "1", "/p", "must be a string, not a number" },
    { "{\"type\":\"string\"}", "null", "/p", "must be a string, not null" },
    { "{\"type\":\"number\"}", "1.5", NULL, NULL },
    { "{\"type\":\"number\"}", "\"1\"", "/p", "must be a number, not a string" },
    { "{\"type\":\"boolean\"}", "true", NULL, NULL },
    { "{\"type\":\"boolean\"}", "0", "/p", "must be true or false, not a number" },
    { "{\"type\":\"object\"}", "{\"any\":1}", NULL, NULL },
    { "{\"type\":\"object\"}", "[]", "/p", "must be an object, not an array" },
    { "{\"type\":\"array\"}", "[1,\"a\"]", NULL, NULL },
    { "{\"type\":\"array\"}", "{}", "/p", "must be an array, not an object" },
    { "{\"type\":\"array\"}", "true", "/p", "must be an array, not true" },
    { "{\"type\":\"array\"}", "false", "/p", "must be an array, not false" },
    /* integers */
    { "{\"type\":\"integer\"}", "-3", NULL, NULL },
    { "{\"type\":\"integer\"}", "5.0", NULL, NULL },
    { "{\"type\":\"integer\"}", "1e2", NULL, NULL },
    { "{\"type\":\"integer\"}", "9007199254740991", NULL, NULL },
    { "{\"type\":\"integer\"}", "-9007199254740991", NULL, NULL },
    { "{\"type\":\"integer\"}", "9007199254740992", "/p",
      "must be an integer, not 9007199254740992" },
    { "{\"type\":\"integer\"}", "9007199254740993", "/p",
      "must be an integer, not 9007199254740992" },
    { "{\"type\":\"integer\"}", "1.5", "/p", "must be an integer, not 1.5" },
    { "{\"type\":\"integer\"}", "\"5\"", "/p", "must be an integer, not a string" },
    /* ranges */
    { "{\"type\":\"integer\",\"minimum\":1,\"maximum\":32}", "1", NULL, NULL },
    { "{\"type\":\"integer\",\"minimum\":1,\"maximum\":32}", "32", NULL, NULL },
    { "{\"type\":\"integer\",\"minimum\":1,\"maximum\":32}", "0", "/p",
      "must be an integer from 1 to 32, not 0" },
    { "{\"type\":\"integer\",\"minimum\":1,\"maximum\":32}", "33", "/p",
      "must be an integer from 1 to 32, not 33" },
    { "{\"type\":\"number\",\"minimum\":0}", "-0.1", "/p",
      "must be a number of at least 0, not -0.1" },
    { "{\"type\":\"number\",\"maximum\":0.1}", "0.11", "/p",
      "must be a number of at most 0.1, not 0.11" },
    { "{\"type\":\"number\",\"maximum\":0.1}", "0.1", NULL, NULL },
    { "{\"type\":\"number\",\"minimum\":0}", "-0", NULL, NULL },
    /* strings */
    { "{\"type\":\"string\",\"enum\":[\"sce\",\"sci\"]}", "\"sci\"", NULL, NULL },
    { "{\"type\":\"string\",\"enum\":[\"sce\",\"sci\"]}", "\"SCI\"", "/p",
      "must be one of sce, sci, not \"SCI\"" },
    { "{\"type\":\"string\",\"minLength\":1}", "\"\"", "/p", "must not be empty" },
    { "{\"type\":\"string\",\"minLength\":2}", "\"\xc3\xa9\"", "/p",
      "must have 2 characters or more" },
    { "{\"type\":\"string\",\"minLength\":2}", "\"\xc3\xa9\xc3\xa9\"", NULL, NULL },
    { "{\"type\":\"string\",\"maxLength\":2}", "\"\xc3\xa9\xc3\xa9\"", NULL, NULL },
    { "{\"type\":\"string\",\"maxLength\":2}", "\"abc\"", "/p", "must have at most 2 characters" },
    { "{\"type\":\"string\",\"maxBytes\":3}", "\"abc\"", NULL, NULL },
    { "{\"type\":\"string\",\"maxBytes\":3}", "\"\xc3\xa9\xc3\xa9\"", "/p",
      "must have at most 3 bytes" },
    /* formats */
    { "{\"type\":\"string\",\"format\":\"uuid\"}", "\"018F2C3A-5b6d-7e8f-9a0b-1c2d3e4f5a6b\"", NULL,
      NULL },
    { "{\"type\":\"string\",\"format\":\"uuid\"}", "\"018f2c3a\"", "/p",
      "must be a UUID, not \"018f2c3a\"" },
    { "{\"type\":\"string\",\"format\":\"sha256\"}",
      "\"0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"sha256\"}", "\"ABC\"", "/p",
      "must be 64 hexadecimal digits in lower case, not \"ABC\"" },
    { "{\"type\":\"string\",\"format\":\"sha256\"}",
      "\"0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef\"", "/p",
      "must be 64 hexadecimal digits in lower case, not "
      "\"0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef\"" },
    { "{\"type\":\"string\",\"format\":\"token\"}", "\"Cm_at_limit\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"token\"}", "\"a-b\"", "/p",
      "must be made of letters, digits and _, not \"a-b\"" },
    { "{\"type\":\"string\",\"format\":\"name\"}", "\"two-layer\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"name\"}", "\"../etc\"", "/p",
      "must be made of letters, digits, - and _, not beginning with -, not \"../etc\"" },
    { "{\"type\":\"string\",\"format\":\"name\"}", "\"-rf\"", "/p",
      "must be made of letters, digits, - and _, not beginning with -, not \"-rf\"" },
    { "{\"type\":\"string\",\"format\":\"text\"}", "\"'; DROP TABLE subject; --\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"text\"}", "\"\xc2\xa0\xe2\x82\xac\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"text\"}", "\"a\\tb\"", "/p",
      "must be one line without control characters, not \"a\\u0009b\"" },
    { "{\"type\":\"string\",\"format\":\"text\"}", "\"\x7f\"", "/p",
      "must be one line without control characters, not \"\\u007f\"" },
    { "{\"type\":\"string\",\"format\":\"text\"}", "\"\xc2\x85\"", "/p",
      "must be one line without control characters, not \"\\u0085\"" },
    { "{\"type\":\"string\",\"format\":\"notes\"}", "\"a\\n\\tb\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"notes\"}", "\"\\r\"", "/p",
      "must be text without control characters but line feeds and tabs, not \"\\u000d\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T07:08:09Z\"", NULL, NULL },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-12-31T23:59:60.123Z\"", NULL,
      NULL },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-13-06T07:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-13-06T07:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-00-06T07:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-00-06T07:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-00T07:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-00T07:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-32T07:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-32T07:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T24:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06T24:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T07:60:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06T07:60:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T07:08:61Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06T07:08:61Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T07:08:09.Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06T07:08:09.Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06T07:08:09\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06T07:08:09\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05-06 07:08:09Z\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05-06 07:08:09Z\"" },
    { "{\"type\":\"string\",\"format\":\"date-time\"}", "\"2031-05\"", "/p",
      "must be a time of RFC 3339 in UTC, not \"2031-05\"" },
    /* arrays */
    { "{\"type\":\"array\",\"items\":{\"type\":\"number\"}}", "[]", NULL, NULL },
    { "{\"type\":\"array\",\"items\":{\"type\":\"number\"}}", "[1,2,\"3\"]", "/p/2",
      "must be a number, not a string" },
    { "{\"type\":\"array\",\"minItems\":1}", "[]", "/p", "must have 1 items or more, not 0" },
    { "{\"type\":\"array\",\"maxItems\":2}", "[1,2,3]", "/p", "must have at most 2 items, not 3" },
    { "{\"type\":\"array\",\"minItems\":3,\"maxItems\":3}", "[1,2]", "/p",
      "must have 3 items, not 2" },
    { "{\"type\":\"array\",\"items\":{\"type\":\"string\"},\"uniqueItems\":true}",
      "[\"a\",\"b\",\"A\"]", NULL, NULL },
    { "{\"type\":\"array\",\"items\":{\"type\":\"string\"},\"uniqueItems\":true}",
      "[\"a\",\"b\",\"a\"]", "/p", "must name each item once" },
    /* one of several types */
    { "{\"anyOf\":[{\"type\":\"array\"},{\"$ref\":\"#/$defs/point\"}],\"when\":\"asked\"}",
      "{\"x\":1}", NULL, NULL },
    { "{\"anyOf\":[{\"type\":\"array\"},{\"$ref\":\"#/$defs/point\"}]}", "[1]", NULL, NULL },
    { "{\"anyOf\":[{\"type\":\"array\"},{\"$ref\":\"#/$defs/point\"}]}", "{\"x\":\"1\"}", "/p/x",
      "must be a number, not a string" },
    { "{\"anyOf\":[{\"type\":\"array\"},{\"$ref\":\"#/$defs/point\"}]}", "true", "/p",
      "must be an array or an object, not true" },
    { "{\"anyOf\":[{\"type\":\"array\",\"maxItems\":1},{\"type\":\"string\"}]}", "[1,2]", "/p",
      "must have at most 1 items, not 2" },
    /* objects */
    { "{\"type\":\"object\",\"properties\":{\"k\":{\"type\":\"integer\"}}}", "{\"x\":1}", NULL,
      NULL },
    { "{\"type\":\"object\",\"properties\":{\"k\":{\"type\":\"integer\"}}}", "{\"k\":\"1\"}",
      "/p/k", "must be an integer, not a string" },
    { "{\"type\":\"object\",\"properties\":{\"k\":{\"type\":\"integer\"}},"
      "\"additionalProperties\":false}",
      "{\"K\":1}", "/p", "has a member \"K\" that is not known" },
    { "{\"type\":\"object\",\"properties\":{},\"additionalProperties\":false}",
      "{\"\\u001b[2J0123456789012345678901234567890123456789012345678901234567890\":1}", "/p",
      "has a member \"\\u001b[2J012345678901234567890123456789012345678901234567890123456789\"... "
      "that is not known" },
    { "{\"type\":\"object\",\"properties\":{\"k\":{\"type\":\"integer\"}},\"required\":[\"k\"]}",
      "{}", "/p", "lacks the member \"k\"" },
    { "{\"type\":\"object\",\"properties\":{\"k\":{\"type\":\"integer\"}},\"required\":[\"k\"]}",
      "{\"k\":null}", "/p/k", "must be an integer, not null" },
    { "{\"type\":\"object\",\"properties\":{\"a\":{\"type\":\"array\",\"items\":"
      "{\"type\":\"object\",\"properties\":{\"b\":{\"type\":\"boolean\"}}}}}}",
      "{\"a\":[{},{\"b\":1}]}", "/p/a/1/b", "must be true or false, not a number" },
    /* references */
    { "{\"$ref\":\"#/$defs/id\",\"description\":\"here\"}", "\"x\"", "/p",
      "must be a UUID, not \"x\"" },
    { "{\"type\":\"array\",\"items\":{\"$ref\":\"#/$defs/point\"}}", "[{\"x\":1},{}]", "/p/1",
      "lacks the member \"x\"" },
};

static void test_check(void)
{
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++) {
        const struct check_case *c = &check_cases[i];
        struct schema *schema = NULL;
        struct schema_error error = { "", "" };
        cJSON *json = cJSON_Parse(c->schema), *value = cJSON_Parse(c->value);
        TEST_ASSERT_NOT_NULL_MESSAGE(json, c->schema);
        TEST_ASSERT_NOT_NULL_MESSAGE(value, c->value);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, schema_compile(json, defs, false, &schema, &error),
                                      error.what);
        bool good = schema_check(schema, value, "/p", &error);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->path == NULL, good, c->value);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(good ? "" : c->path, error.path, c->value);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(good ? "" : c->what, error.what, c->value);
        schema_close(schema);
        cJSON_Delete(json);
        cJSON_Delete(value);
    }
}

/* expect: schema.h's table of keywords. */
static const struct refuse_case {
    const char *what, *schema, *path, *why;
} refuse_cases[] = {
    { "no object", "[]", "#", "must be an object" },
    { "a string", "\"string\"", "#", "must be an object" },
    { "no type", "{}", "#", "has no type" },
    { "no such type", "{\"type\":\"text\"}", "#/type", "no such type" },
    { "any of one", "{\"anyOf\":[{\"type\":\"array\"}]}", "#/anyOf",
      "must list two schemas or more" },
    { "any of what is no list", "{\"anyOf\":{\"type\":\"array\"}}", "#/anyOf",
      "must list two schemas or more" },
    { "any of two alike", "{\"anyOf\":[{\"type\":\"array\"},{\"type\":\"array\"}]}", "#/anyOf/1",
      "must be of a type of its own" },
    { "any of any",
      "{\"anyOf\":[{\"type\":\"array\"},{\"anyOf\":[{\"type\":\"string\"},{\"type\":\"object\"}]}]"
      "}",
      "#/anyOf/1", "must be of a type of its own" },
    { "any of what is wrong", "{\"anyOf\":[{\"type\":\"array\"},{\"type\":\"x\"}]}",
      "#/anyOf/1/type", "no such type" },
    { "a type beside any", "{\"type\":\"array\",\"anyOf\":[]}", "#/type", "not beside anyOf" },
    { "several types", "{\"type\":[\"string\"]}", "#/type", "no such type" },
    { "a typo", "{\"type\":\"number\",\"minimun\":1}", "#/minimun", "no such keyword" },
    { "a keyword we do not have", "{\"type\":\"string\",\"pattern\":\"a\"}", "#/pattern",
      "no such keyword" },
    { "keyword of another type", "{\"type\":\"string\",\"minimum\":1}", "#/minimum",
      "not for this type" },
    { "length of a number", "{\"type\":\"number\",\"maxLength\":1}", "#/maxLength",
      "not for this type" },
    { "no such format", "{\"type\":\"string\",\"format\":\"e-mail\"}", "#/format",
      "no such format" },
    { "format 1", "{\"type\":\"string\",\"format\":1}", "#/format", "no such format" },
    { "empty enum", "{\"type\":\"string\",\"enum\":[]}", "#/enum", "must list strings" },
    { "enum of numbers", "{\"type\":\"string\",\"enum\":[1]}", "#/enum", "must list strings" },
    { "enum alone", "{\"type\":\"string\",\"enum\":\"a\"}", "#/enum", "must list strings" },
    { "negative length", "{\"type\":\"string\",\"minLength\":-1}", "#/minLength",
      "must be a count" },
    { "half a length", "{\"type\":\"string\",\"maxLength\":1.5}", "#/maxLength",
      "must be a count" },
    { "length as text", "{\"type\":\"string\",\"maxBytes\":\"1\"}", "#/maxBytes",
      "must be a count" },
    { "endless items", "{\"type\":\"array\",\"maxItems\":1e300}", "#/maxItems", "must be a count" },
    { "negative items", "{\"type\":\"array\",\"minItems\":-1}", "#/minItems", "must be a count" },
    { "minimum as text", "{\"type\":\"number\",\"minimum\":\"0\"}", "#/minimum",
      "must be a number" },
    { "maximum as text", "{\"type\":\"number\",\"maximum\":\"0\"}", "#/maximum",
      "must be a number" },
    { "not unique", "{\"type\":\"array\",\"uniqueItems\":false}", "#/uniqueItems",
      "must be true, beside items that are strings" },
    { "unique of anything", "{\"type\":\"array\",\"uniqueItems\":true}", "#/uniqueItems",
      "must be true, beside items that are strings" },
    { "unique numbers", "{\"type\":\"array\",\"items\":{\"type\":\"number\"},\"uniqueItems\":true}",
      "#/uniqueItems", "must be true, beside items that are strings" },
    { "additional members allowed", "{\"type\":\"object\",\"additionalProperties\":true}",
      "#/additionalProperties", "must be false" },
    { "properties as a list", "{\"type\":\"object\",\"properties\":[]}", "#/properties",
      "must be an object" },
    { "a property that is wrong",
      "{\"type\":\"object\",\"properties\":{\"a\":{\"type\":\"string\"},\"b\":{\"type\":\"x\"}}}",
      "#/properties/b/type", "no such type" },
    { "items that are wrong", "{\"type\":\"array\",\"items\":{\"type\":\"x\"}}", "#/items/type",
      "no such type" },
    { "required member that is none", "{\"type\":\"object\",\"required\":[\"a\"]}", "#/required",
      "names a member that is no property" },
    { "required numbers", "{\"type\":\"object\",\"required\":[1]}", "#/required",
      "must list strings" },
    { "description 1", "{\"type\":\"string\",\"description\":1}", "#/description",
      "must be a string" },
    { "$ref to nothing", "{\"$ref\":\"#/$defs/x\"}", "#/$ref", "points nowhere" },
    { "$ref elsewhere", "{\"$ref\":\"other.json\"}", "#/$ref", "points nowhere" },
    { "$ref 1", "{\"$ref\":1}", "#/$ref", "points nowhere" },
    { "$ref and a check", "{\"$ref\":\"#/$defs/id\",\"minLength\":1}", "#/minLength",
      "not beside $ref" },
};

static void test_compile_refuses(void)
{
    for (size_t i = 0; i < sizeof refuse_cases / sizeof *refuse_cases; i++) {
        const struct refuse_case *c = &refuse_cases[i];
        struct schema *schema = NULL;
        struct schema_error error = { "", "" };
        cJSON *json = cJSON_Parse(c->schema);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT,
                                      schema_compile(json, defs, false, &schema, &error), c->what);
        TEST_ASSERT_NULL_MESSAGE(schema, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->path, error.path, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->why, error.what, c->what);
        cJSON_Delete(json);
    }
}

static void test_a_cycle_is_refused(void)
{
    struct schema *schema = NULL;
    struct schema_error error;
    cJSON *json = cJSON_Parse("{\"$ref\":\"#/$defs/loop\"}");
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, schema_compile(json, defs, false, &schema, &error));
    TEST_ASSERT_EQUAL_STRING("nested too deep", error.what);
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, schema_compile(json, NULL, false, &schema, &error));
    TEST_ASSERT_EQUAL_STRING("points nowhere", error.what);
    cJSON_Delete(json);
}

static void test_closed(void)
{
    static const char text[] =
        "{\"type\":\"object\",\"properties\":{\"free\":{\"type\":\"object\"}}}";
    struct schema *schema = NULL;
    struct schema_error error;
    cJSON *json = cJSON_Parse(text), *known = cJSON_Parse("{\"free\":{\"x\":1}}"),
          *other = cJSON_Parse("{\"x\":1}");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, schema_compile(json, defs, true, &schema, &error));
    TEST_ASSERT_TRUE(schema_check(schema, known, "", &error)); /* nothing is said of its members */
    TEST_ASSERT_FALSE(schema_check(schema, other, "", &error));
    TEST_ASSERT_EQUAL_STRING("", error.path);
    schema_close(schema);
    cJSON_Delete(json);
    cJSON_Delete(known);
    cJSON_Delete(other);
}

/* A number that JSON cannot write, made by a mistake of ours. */
static void test_not_finite(void)
{
    struct schema *schema = NULL;
    struct schema_error error;
    cJSON *json = cJSON_Parse("{\"type\":\"number\"}"), *value = cJSON_CreateNumber(0.0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, schema_compile(json, defs, true, &schema, &error));
    value->valuedouble = strtod("inf", NULL);
    TEST_ASSERT_FALSE(schema_check(schema, value, "", &error));
    value->valuedouble = strtod("nan", NULL);
    TEST_ASSERT_FALSE(schema_check(schema, value, "", &error));
    schema_close(schema);
    cJSON_Delete(json);
    cJSON_Delete(value);
}

/* A path that is too long is cut, a list of choices too. */
static void test_long_messages(void)
{
    char name[201], text[1024];
    struct schema *schema = NULL;
    struct schema_error error;
    memset(name, 'n', 200);
    name[200] = '\0';
    snprintf(text, sizeof text,
             "{\"type\":\"object\",\"properties\":{\"%s\":{\"type\":\"object\",\"properties\":"
             "{\"e\":{\"type\":\"string\",\"enum\":[\"%s\",\"%s\"]}}}}}",
             name, name, name);
    cJSON *json = cJSON_Parse(text);
    snprintf(text, sizeof text, "{\"%s\":{\"e\":\"\"}}", name);
    cJSON *value = cJSON_Parse(text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, schema_compile(json, defs, true, &schema, &error));
    TEST_ASSERT_FALSE(schema_check(schema, value, "/params", &error));
    TEST_ASSERT_EQUAL_size_t(SCHEMA_PATH_SIZE - 1, strlen(error.path));
    TEST_ASSERT_EQUAL_STRING_LEN("/params/nnn", error.path, 11);
    TEST_ASSERT_EQUAL_STRING_LEN("must be one of nnn", error.what, 18);
    schema_close(schema);
    cJSON_Delete(json);
    cJSON_Delete(value);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_check);
    RUN_TEST(test_compile_refuses);
    RUN_TEST(test_a_cycle_is_refused);
    RUN_TEST(test_closed);
    RUN_TEST(test_not_finite);
    RUN_TEST(test_long_messages);
    return UNITY_END();
}
