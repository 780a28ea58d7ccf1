/* test_strict_json.c - what a client may send: [R8259]'s grammar at its edges, and less. */
#include "station/strict_json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: RFC 8259's grammar read by hand; UTF-8 from RFC 3629; doubles from IEEE 754. */
static const struct check_case {
    const char *what, *text;
    enum strict_json_fault expect;
    size_t offset;
} check_cases[] = {
    /* values */
    { "object", "{}", STRICT_JSON_FINE, 2 },
    { "array", "[]", STRICT_JSON_FINE, 2 },
    { "white space of all kinds around", " \t\r\n{ \t\r\n} \t\r\n", STRICT_JSON_FINE, 14 },
    { "true", "true", STRICT_JSON_FINE, 4 },
    { "false", "false", STRICT_JSON_FINE, 5 },
    { "null", "null", STRICT_JSON_FINE, 4 },
    { "members", "{\"a\":1,\"b\":[1,2,{}]}", STRICT_JSON_FINE, 20 },
    { "white space everywhere", "{ \"a\" : [ 1 , 2 ] , \"b\" : { } }", STRICT_JSON_FINE, 31 },
    { "nothing", "", STRICT_JSON_SYNTAX, 0 },
    { "only white space", "  ", STRICT_JSON_SYNTAX, 2 },
    { "two objects", "{}{}", STRICT_JSON_SYNTAX, 2 },
    { "something after", "{} x", STRICT_JSON_SYNTAX, 3 },
    { "a comma after", "{},", STRICT_JSON_SYNTAX, 2 },
    { "vertical tab is no white space", "\v{}", STRICT_JSON_SYNTAX, 0 },
    { "form feed is no white space", "{\f}", STRICT_JSON_SYNTAX, 1 },
    { "no-break space is no white space", "\xc2\xa0{}", STRICT_JSON_SYNTAX, 0 },
    { "byte order mark", "\xef\xbb\xbf{}", STRICT_JSON_SYNTAX, 0 },
    { "comment", "/**/{}", STRICT_JSON_SYNTAX, 0 },
    { "True", "True", STRICT_JSON_SYNTAX, 0 },
    { "truE", "truE", STRICT_JSON_SYNTAX, 0 },
    { "tru", "tru", STRICT_JSON_SYNTAX, 0 },
    { "truex", "truex", STRICT_JSON_SYNTAX, 4 },
    { "fals", "[fals]", STRICT_JSON_SYNTAX, 1 },
    { "nul", "nul", STRICT_JSON_SYNTAX, 0 },
    { "NaN", "NaN", STRICT_JSON_SYNTAX, 0 },
    { "Infinity", "[Infinity]", STRICT_JSON_SYNTAX, 1 },
    /* lists */
    { "comma at the end of an array", "[1,]", STRICT_JSON_SYNTAX, 3 },
    { "comma at the start", "[,1]", STRICT_JSON_SYNTAX, 1 },
    { "two commas", "[1,,2]", STRICT_JSON_SYNTAX, 3 },
    { "no comma", "[1 2]", STRICT_JSON_SYNTAX, 3 },
    { "open array", "[1", STRICT_JSON_SYNTAX, 2 },
    { "open array after a comma", "[1,", STRICT_JSON_SYNTAX, 3 },
    { "only a bracket", "[", STRICT_JSON_SYNTAX, 1 },
    { "wrong bracket", "[1}", STRICT_JSON_SYNTAX, 2 },
    { "closing only", "]", STRICT_JSON_SYNTAX, 0 },
    { "comma at the end of an object", "{\"a\":1,}", STRICT_JSON_SYNTAX, 7 },
    { "no colon", "{\"a\" 1}", STRICT_JSON_SYNTAX, 5 },
    { "no value", "{\"a\":}", STRICT_JSON_SYNTAX, 5 },
    { "no name", "{:1}", STRICT_JSON_SYNTAX, 1 },
    { "bare name", "{a:1}", STRICT_JSON_SYNTAX, 1 },
    { "number for a name", "{1:1}", STRICT_JSON_SYNTAX, 1 },
    { "single quotes", "{'a':1}", STRICT_JSON_SYNTAX, 1 },
    { "open object", "{\"a\":1", STRICT_JSON_SYNTAX, 6 },
    /* names twice */
    { "twice", "{\"a\":1,\"a\":1}", STRICT_JSON_DUPLICATE, 7 },
    { "twice by an escape", "{\"a\":1,\"\\u0061\":1}", STRICT_JSON_DUPLICATE, 7 },
    { "twice, escaped first", "{\"\\u0061\":1,\"a\":1}", STRICT_JSON_DUPLICATE, 12 },
    { "twice by different escapes", "{\"\\n\":1,\"\\u000A\":1}", STRICT_JSON_DUPLICATE, 8 },
    { "slash and escaped slash", "{\"/\":1,\"\\/\":1}", STRICT_JSON_DUPLICATE, 7 },
    { "two bytes and an escape", "{\"\xc3\xa9\":1,\"\\u00e9\":1}", STRICT_JSON_DUPLICATE, 8 },
    { "three bytes and an escape", "{\"\xe2\x82\xac\":1,\"\\u20AC\":1}", STRICT_JSON_DUPLICATE, 9 },
    { "four bytes and surrogates", "{\"\xf0\x9f\x98\x80\":1,\"\\ud83d\\ude00\":1}",
      STRICT_JSON_DUPLICATE, 10 },
    { "the empty name twice", "{\"\":1,\"\":1}", STRICT_JSON_DUPLICATE, 6 },
    { "not the nearest", "{\"a\":1,\"b\":1,\"c\":1,\"a\":1}", STRICT_JSON_DUPLICATE, 19 },
    { "inside an inner object", "[{\"x\":{\"a\":1,\"a\":2}}]", STRICT_JSON_DUPLICATE, 13 },
    { "another case is another name", "{\"a\":1,\"A\":1}", STRICT_JSON_FINE, 13 },
    { "one longer", "{\"a\":1,\"ab\":1}", STRICT_JSON_FINE, 14 },
    { "composed and decomposed differ", "{\"\xc3\xa9\":1,\"e\\u0301\":1}", STRICT_JSON_FINE, 20 },
    { "the same in two objects", "[{\"a\":1},{\"a\":1}]", STRICT_JSON_FINE, 17 },
    { "the same in and around", "{\"a\":{\"a\":1}}", STRICT_JSON_FINE, 13 },
    /* strings */
    { "empty string", "\"\"", STRICT_JSON_FINE, 2 },
    { "all escapes", "\"\\\"\\\\\\/\\b\\f\\n\\r\\t\\u00e9\"", STRICT_JSON_FINE, 24 },
    { "hexadecimal of both cases", "\"\\uABCD\\uabcd\"", STRICT_JSON_FINE, 14 },
    { "surrogates", "\"\\ud83d\\ude00\"", STRICT_JSON_FINE, 14 },
    { "DEL", "\"\x7f\"", STRICT_JSON_FINE, 3 },
    { "U+2028", "\"\xe2\x80\xa8\"", STRICT_JSON_FINE, 5 },
    { "open string", "\"a", STRICT_JSON_SYNTAX, 2 },
    { "backslash at the end", "\"a\\", STRICT_JSON_SYNTAX, 3 },
    { "escaped quote, then the end", "\"\\\"", STRICT_JSON_SYNTAX, 3 },
    { "a tab", "\"\t\"", STRICT_JSON_SYNTAX, 1 },
    { "U+001F", "\"\x1f\"", STRICT_JSON_SYNTAX, 1 },
    { "a line feed", "\"a\nb\"", STRICT_JSON_SYNTAX, 2 },
    { "\\v", "\"\\v\"", STRICT_JSON_SYNTAX, 3 },
    { "\\x41", "\"\\x41\"", STRICT_JSON_SYNTAX, 3 },
    { "\\U", "\"\\U0041\"", STRICT_JSON_SYNTAX, 3 },
    { "three digits", "\"\\u004\"", STRICT_JSON_SYNTAX, 3 },
    { "digits cut off", "\"\\u00", STRICT_JSON_SYNTAX, 3 },
    { "no digits", "\"\\u00g0\"", STRICT_JSON_SYNTAX, 3 },
    { "high surrogate alone", "\"\\ud83d\"", STRICT_JSON_SYNTAX, 7 },
    { "high surrogate, then a letter", "\"\\ud83dabcdef\"", STRICT_JSON_SYNTAX, 7 },
    { "high surrogate, then another escape", "\"\\ud83d\\nabcd\"", STRICT_JSON_SYNTAX, 7 },
    { "two high surrogates", "\"\\ud83d\\ud83d\"", STRICT_JSON_SYNTAX, 7 },
    { "low surrogate alone", "\"\\ude00\"", STRICT_JSON_SYNTAX, 3 },
    { "\\u0000", "\"\\u0000\"", STRICT_JSON_NUL, 7 },
    { "\\u0000 in a name", "{\"a\\u0000b\":1}", STRICT_JSON_NUL, 9 },
    { "\\u0001", "\"\\u0001\"", STRICT_JSON_FINE, 8 },
    /* numbers */
    { "0", "0", STRICT_JSON_FINE, 1 },
    { "-0", "-0", STRICT_JSON_FINE, 2 },
    { "10", "10", STRICT_JSON_FINE, 2 },
    { "-1.5e-7", "-1.5e-7", STRICT_JSON_FINE, 7 },
    { "1E+2", "1E+2", STRICT_JSON_FINE, 4 },
    { "0e0", "0e0", STRICT_JSON_FINE, 3 },
    { "the largest double", "1.7976931348623157e308", STRICT_JSON_FINE, 22 },
    { "too small is 0", "1e-400", STRICT_JSON_FINE, 6 },
    { "01", "01", STRICT_JSON_SYNTAX, 2 },
    { "-01", "-01", STRICT_JSON_SYNTAX, 3 },
    { "00", "[00]", STRICT_JSON_SYNTAX, 3 },
    { "+1", "+1", STRICT_JSON_SYNTAX, 0 },
    { ".5", ".5", STRICT_JSON_SYNTAX, 0 },
    { "5.", "5.", STRICT_JSON_SYNTAX, 2 },
    { "5.e1", "5.e1", STRICT_JSON_SYNTAX, 2 },
    { "1e", "1e", STRICT_JSON_SYNTAX, 2 },
    { "1e+", "1e+", STRICT_JSON_SYNTAX, 3 },
    { "- alone", "-", STRICT_JSON_SYNTAX, 1 },
    { "-x", "-x", STRICT_JSON_SYNTAX, 1 },
    { "0x10", "0x10", STRICT_JSON_SYNTAX, 1 },
    { "1_000", "1_000", STRICT_JSON_SYNTAX, 1 },
    { "-Infinity", "-Infinity", STRICT_JSON_SYNTAX, 1 },
    { "1e400", "[1e400]", STRICT_JSON_NUMBER, 6 },
    { "-1e400", "-1e400", STRICT_JSON_NUMBER, 6 },
    { "just beyond the largest double", "1.7976931348623159e308", STRICT_JSON_NUMBER, 22 },
    { "63 digits", "123456789012345678901234567890123456789012345678901234567890123",
      STRICT_JSON_FINE, 63 },
    { "64 digits", "1234567890123456789012345678901234567890123456789012345678901234",
      STRICT_JSON_NUMBER, 64 },
    /* UTF-8: the whole text is looked at before anything else */
    { "a continuation alone", "\"\x80\"", STRICT_JSON_UTF8, 0 },
    { "cut at the end", "\"\xc3", STRICT_JSON_UTF8, 0 },
    { "overlong slash", "\"\xc0\xaf\"", STRICT_JSON_UTF8, 0 },
    { "overlong, three bytes", "\"\xe0\x80\xaf\"", STRICT_JSON_UTF8, 0 },
    { "a surrogate", "\"\xed\xa0\x80\"", STRICT_JSON_UTF8, 0 },
    { "beyond U+10FFFF", "\"\xf4\x90\x80\x80\"", STRICT_JSON_UTF8, 0 },
    { "five bytes", "\"\xf8\x88\x80\x80\x80\"", STRICT_JSON_UTF8, 0 },
    { "Latin-1", "\"caf\xe9\"", STRICT_JSON_UTF8, 0 },
    { "U+10FFFF", "\"\xf4\x8f\xbf\xbf\"", STRICT_JSON_FINE, 6 },
};

static void test_grammar(void)
{
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++) {
        const struct check_case *c = &check_cases[i];
        size_t offset = 999, n = strlen(c->text);
        char *exact = malloc(n + (n == 0)); /* no NUL after it: sanitizers see a read beyond */
        memcpy(exact, c->text, n);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, strict_json_check(exact, n, &offset), c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->offset, offset, c->what);
        free(exact);
    }
}

/* What is taken is what cJSON takes, and nothing passes that it would read otherwise. */
static void test_parse_agrees_with_check(void)
{
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++) {
        const struct check_case *c = &check_cases[i];
        enum strict_json_fault fault;
        cJSON *value = NULL;
        enum status s = strict_json_parse(c->text, strlen(c->text), &value, &fault, NULL);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect == STRICT_JSON_FINE ? STATUS_OK : STATUS_FORMAT, s,
                                      c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, fault, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(s == STATUS_OK, value != NULL, c->what);
        cJSON_Delete(value);
    }
}

/* The same tree as cJSON's own parser makes, to the bits, and linked as its functions want it. */
static void assert_same_tree(const cJSON *expect, const cJSON *got, const char *text)
{
    const cJSON *last = NULL, *a, *b;
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect->type, got->type, text);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(expect->string, got->string, text);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(expect->valuestring, got->valuestring, text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect->valueint, got->valueint, text);
    TEST_ASSERT_TRUE_MESSAGE(
        memcmp(&expect->valuedouble, &got->valuedouble, sizeof got->valuedouble) == 0, text);
    for (a = expect->child, b = got->child; a != NULL && b != NULL; a = a->next, b = b->next) {
        TEST_ASSERT_TRUE_MESSAGE(last == NULL || b->prev == last, text);
        assert_same_tree(a, b, text);
        last = b;
    }
    TEST_ASSERT_TRUE_MESSAGE(a == NULL && b == NULL, text);
    TEST_ASSERT_TRUE_MESSAGE(last == NULL || got->child->prev == last, text);
}

static void assert_parsed_as_cjson_does(const char *text)
{
    size_t n = strlen(text);
    enum strict_json_fault fault;
    char *exact = malloc(n);
    cJSON *expect = cJSON_ParseWithLength(text, n), *got = NULL;
    memcpy(exact, text, n);
    TEST_ASSERT_NOT_NULL_MESSAGE(expect, text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, strict_json_parse(exact, n, &got, &fault, NULL), text);
    assert_same_tree(expect, got, text);
    free(exact);
    cJSON_Delete(expect);
    cJSON_Delete(got);
}

static char *put_any_string(struct dice *dice, char *to, size_t number)
{
    static const char *const pieces[] = { "a",
                                          "Z",
                                          " ",
                                          "\\n",
                                          "\\\"",
                                          "\\\\",
                                          "\\/",
                                          "\\u0041",
                                          "\\u00e9",
                                          "\\u20AC",
                                          "\\ud83d\\ude00",
                                          "\xc3\xa9",
                                          "\xf0\x9f\x98\x80",
                                          "\\b\\f\\r\\t",
                                          "\x7f" };
    to += sprintf(to, "\"");
    for (size_t i = dice_below(dice, 6); i > 0; i--)
        to += sprintf(to, "%s", pieces[dice_below(dice, sizeof pieces / sizeof *pieces)]);
    return to + sprintf(to, "#%zu\"", number); /* names once in an object */
}

static char *put_any(struct dice *dice, char *to, int depth)
{
    static const char *const words[] = {
        "true", "false",  "null", "0", "-0", "-0.0", "1e308", "-1E-3", "123456789012345678",
        "0.1",  "1e-400", "[]",   "{}"
    };
    size_t kind = dice_below(dice, depth > 0 ? 6 : 4), n = dice_below(dice, 5);
    if (kind == 0)
        return put_any_string(dice, to, n);
    if (kind == 1)
        return to + sprintf(to, "%s", words[dice_below(dice, sizeof words / sizeof *words)]);
    if (kind < 4)
        return to + sprintf(to, "%.*f", (int)dice_below(dice, 18), dice_between(dice, -2.0, 2e5));
    to += sprintf(to, kind == 4 ? "[ " : "{ ");
    for (size_t i = 0; i < n; i++) {
        if (kind == 5)
            to = put_any_string(dice, to, i);
        if (kind == 5)
            to += sprintf(to, " :\t");
        to = put_any(dice, to, depth - 1);
        to += sprintf(to, i + 1 < n ? " ,\n" : "");
    }
    return to + sprintf(to, kind == 4 ? "]" : "}");
}

static void test_tree_is_that_of_cjson(void)
{
    static char text[200000];
    struct dice dice = { 20260722 };
    for (size_t i = 0; i < sizeof check_cases / sizeof *check_cases; i++)
        if (check_cases[i].expect == STRICT_JSON_FINE)
            assert_parsed_as_cjson_does(check_cases[i].text);
    for (int i = 0; i < 20000; i++) {
        put_any(&dice, text, 4);
        assert_parsed_as_cjson_does(text);
    }
}

static void test_nul_bytes(void)
{
    static const char inside[] = "{\"a\0b\":1}", after[] = "{}\0";
    size_t offset;
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_NUL, strict_json_check(inside, sizeof inside - 1, &offset));
    TEST_ASSERT_EQUAL_size_t(3, offset);
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_NUL, strict_json_check(after, sizeof after - 1, NULL));
}

/* Every prefix of a value is refused. */
static void test_cut_anywhere(void)
{
    static const char whole[] =
        "{\"a\":[-1.5e+3,\"\\ud83d\\ude00\\n\xc3\xa9\",true,null],\"b\":{}}";
    for (size_t n = 0; n < sizeof whole - 1; n++)
        TEST_ASSERT_NOT_EQUAL_INT(STRICT_JSON_FINE, strict_json_check(whole, n, NULL));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, strict_json_check(whole, sizeof whole - 1, NULL));
}

static enum strict_json_fault nested(size_t depth, const char *open, const char *inside, char close)
{
    char *text = malloc(strlen(inside) + depth * (strlen(open) + 1) + 1);
    TEST_ASSERT_NOT_NULL(text);
    char *at = text;
    for (size_t i = 0; i < depth; i++, at += strlen(open))
        memcpy(at, open, strlen(open));
    memcpy(at, inside, strlen(inside));
    at += strlen(inside);
    memset(at, close, depth);
    enum strict_json_fault fault = strict_json_check(text, (size_t)(at - text) + depth, NULL);
    free(text);
    return fault;
}

static void test_depth(void)
{
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, nested(16, "[", "", ']'));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_DEPTH, nested(17, "[", "", ']'));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, nested(15, "{\"a\":", "{}", '}'));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, nested(16, "{\"a\":", "1", '}'));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_DEPTH, nested(17, "{\"a\":", "1", '}'));
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_DEPTH, nested(10000, "[", "", ']'));
    /* beside each other is not within each other */
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, nested(15, "[[],{},", "[]", ']'));
}

static void test_members(void)
{
    char text[4096] = "{";
    for (int i = 0; i < 128; i++)
        sprintf(text + strlen(text), "%s\"m%d\":%d", i > 0 ? "," : "", i, i);
    size_t n = strlen(text);
    strcpy(text + n, "}");
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, strict_json_check(text, strlen(text), NULL));
    strcpy(text + n, ",\"x\":1}");
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_MEMBERS, strict_json_check(text, strlen(text), NULL));
    strcpy(text + n, ",\"m0\":1}");
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_DUPLICATE, strict_json_check(text, strlen(text), NULL));
}

static void test_members_by_exact_name(void)
{
    cJSON *object = cJSON_Parse("{\"Lab\":1}");
    TEST_ASSERT_NOT_NULL(strict_json_member(object, "Lab"));
    TEST_ASSERT_NULL(strict_json_member(object, "lab"));
    TEST_ASSERT_NULL(strict_json_member(NULL, "lab"));
    cJSON_Delete(object);
}

#define TEN "0123456789"

/* expect: 64 bytes of text at most, by hand. */
static const struct echo_case {
    const char *what, *text, *expect;
} echo_cases[] = {
    { "nothing", "", "\"\"" },
    { "a word", "measure.stop", "\"measure.stop\"" },
    { "letters of other scripts", "na\xc3\xafve \xe2\x82\xac \xf0\x9f\x98\x80",
      "\"na\xc3\xafve \xe2\x82\xac \xf0\x9f\x98\x80\"" },
    { "a terminal's escape", "\x1b[31m", "\"\\u001b[31m\"" },
    { "a second line of a log", "a\nb", "\"a\\u000ab\"" },
    { "DEL and C1", "\x7f\xc2\x9b", "\"\\u007f\\u009b\"" },
    { "no-break space is shown", "\xc2\xa0", "\"\xc2\xa0\"" },
    { "quote and backslash", "\"\\", "\"\\u0022\\u005c\"" },
    { "arabic letter mark", "\xd8\x9c", "\"\\u061c\"" },
    { "zero width space", "\xe2\x80\x8b", "\"\\u200b\"" },
    { "line separator", "\xe2\x80\xa8", "\"\\u2028\"" },
    { "right-to-left override", "\xe2\x80\xae", "\"\\u202e\"" },
    { "isolate", "\xe2\x81\xa6", "\"\\u2066\"" },
    { "byte order mark", "\xef\xbb\xbf", "\"\\ufeff\"" },
    { "a dash is shown", "\xe2\x80\x93", "\"\xe2\x80\x93\"" },
    { "64 bytes", TEN TEN TEN TEN TEN TEN "0123", "\"" TEN TEN TEN TEN TEN TEN "0123\"" },
    { "65 bytes", TEN TEN TEN TEN TEN TEN "01234", "\"" TEN TEN TEN TEN TEN TEN "0123\"..." },
    { "cut before a character, not in it", TEN TEN TEN TEN TEN TEN "012\xc3\xa9",
      "\"" TEN TEN TEN TEN TEN TEN "012\"..." },
    { "a character that just fits", TEN TEN TEN TEN TEN TEN "01\xc3\xa9",
      "\"" TEN TEN TEN TEN TEN TEN "01\xc3\xa9\"" },
};

static void test_echo(void)
{
    for (size_t i = 0; i < sizeof echo_cases / sizeof *echo_cases; i++) {
        char into[STRICT_JSON_ECHO_SIZE];
        TEST_ASSERT_EQUAL_STRING_MESSAGE(
            echo_cases[i].expect, strict_json_echo(echo_cases[i].text, into), echo_cases[i].what);
    }
}

/* The longest there can be: everything by number. */
static void test_echo_has_room(void)
{
    char text[101], into[STRICT_JSON_ECHO_SIZE];
    memset(text, 1, 100);
    text[100] = '\0';
    TEST_ASSERT_EQUAL_size_t(STRICT_JSON_ECHO_SIZE - 1, strlen(strict_json_echo(text, into)));
}

static int allocations_left;

static void *take_if_any(size_t size)
{
    return allocations_left-- > 0 ? malloc(size) : NULL;
}

/* Each allocation fails once, and nothing leaks; a fault comes before want of memory. */
static void test_no_memory(void)
{
    static const char good[] = "{\"a\":[1,2e3,\"x\\ny\",{\"b\":null}],\"c\":true}";
    static const char bad[] = "{\"a\":[1,2e3,\"x\\ny\",{\"b\":null}],\"c\":true]";
    cJSON_Hooks hooks = { take_if_any, free };
    enum strict_json_fault fault;
    enum status s = STATUS_NO_MEMORY;
    int enough;
    for (enough = 0; s != STATUS_OK; enough++) {
        cJSON *value = NULL, *none = NULL;
        cJSON_InitHooks(&hooks);
        allocations_left = enough;
        s = strict_json_parse(good, sizeof good - 1, &value, &fault, NULL);
        TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, fault);
        allocations_left = enough;
        enum status faulty = strict_json_parse(bad, sizeof bad - 1, &none, &fault, NULL);
        cJSON_InitHooks(NULL);
        TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, faulty);
        TEST_ASSERT_EQUAL_INT(STRICT_JSON_SYNTAX, fault);
        TEST_ASSERT_NULL(none);
        TEST_ASSERT_EQUAL_INT(s == STATUS_OK, value != NULL);
        TEST_ASSERT_TRUE(s == STATUS_OK || s == STATUS_NO_MEMORY);
        cJSON_Delete(value);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(8 + 4, enough - 1, "8 values, 3 names, 1 text");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grammar);
    RUN_TEST(test_parse_agrees_with_check);
    RUN_TEST(test_tree_is_that_of_cjson);
    RUN_TEST(test_nul_bytes);
    RUN_TEST(test_cut_anywhere);
    RUN_TEST(test_depth);
    RUN_TEST(test_members);
    RUN_TEST(test_members_by_exact_name);
    RUN_TEST(test_echo);
    RUN_TEST(test_echo_has_room);
    RUN_TEST(test_no_memory);
    return UNITY_END();
}
