/* test_protocol.c - lines to requests, answers to lines. */
#include "station/protocol.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "station/connection.h"
#include "station/calibration.h"
#include "station/lease.h"
#include "station/strict_json.h"
#include "tests/support/heard.h"
#include "unity.h"

static struct protocol *protocol;
static long allocations_left = -1; /* of cJSON; -1: never fail */

static void *test_malloc(size_t size)
{
    if (allocations_left == 0)
        return NULL;
    if (allocations_left > 0)
        allocations_left--;
    return malloc(size);
}

void setUp(void)
{
    cJSON_Hooks hooks = { test_malloc, free };
    allocations_left = -1;
    cJSON_InitHooks(&hooks);
    if (protocol == NULL)
        TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_open(&protocol));
}

void tearDown(void)
{
    allocations_left = -1;
    cJSON_InitHooks(NULL);
}

#define U "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b"
#define LINE(id, method, params) \
    "{\"jsonrpc\":\"2.0\",\"id\":" id ",\"method\":\"" method "\",\"params\":" params "}"

/* ---- what is refused, and what is said ---------------------------------------------- */

/* expect: JSON-RPC 2.0 (its own examples are marked), DESIGN of the protocol; by hand. */
static const struct refuse_case {
    const char *what, *line;
    enum reason reason;
    const char *id, *path, *detail;
} refuse_cases[] = {
    /* [JSON-RPC 2.0] section 7 */
    { "the standard's: invalid JSON",
      "{\"jsonrpc\": \"2.0\", \"method\": \"foobar, \"params\": \"bar\", \"baz]",
      REASON_JSON_INVALID, "null", "", "at byte 39" },
    { "the standard's: invalid request",
      "{\"jsonrpc\": \"2.0\", \"method\": 1, \"params\": \"bar\"}", REASON_ID_MISSING, "null", "",
      "" },
    { "the standard's: unknown method",
      "{\"jsonrpc\": \"2.0\", \"method\": \"foobar\", \"id\": \"1\"}", REASON_METHOD_UNKNOWN,
      "\"1\"", "/method", "\"foobar\"" },
    { "the standard's: by position",
      "{\"jsonrpc\": \"2.0\", \"method\": \"status.get\", \"params\": [42, 23], \"id\": 1}",
      REASON_PARAMS_INVALID, "1", "/params", "/params must be an object, not an array" },
    { "the standard's: notification",
      "{\"jsonrpc\": \"2.0\", \"method\": \"update\", \"params\": [1,2,3,4,5]}", REASON_ID_MISSING,
      "null", "", "" },
    { "the standard's: invalid batch",
      "[{\"jsonrpc\": \"2.0\", \"method\": \"sum\", \"params\": [1,2,4], \"id\": \"1\"},"
      "{\"jsonrpc\": \"2.0\", \"method\"]",
      REASON_JSON_INVALID, "null", "", "at byte 94" },
    { "the standard's: empty batch", "[]", REASON_BATCH_REFUSED, "null", "", "" },
    { "the standard's: batch of nonsense", "[1,2,3]", REASON_BATCH_REFUSED, "null", "", "" },
    /* the front */
    { "empty line", "", REASON_JSON_INVALID, "null", "", "at byte 0" },
    { "UTF-8", "{\"id\":1,\"method\":\"\xff\"}", REASON_UTF8_INVALID, "null", "", "" },
    { "\\u0000", "{\"id\":1,\"method\":\"\\u0000\"}", REASON_NUL_REFUSED, "null", "",
      "at byte 24" },
    { "a member twice", "{\"id\":1,\"id\":2}", REASON_DUPLICATE_MEMBER, "null", "", "at byte 8" },
    { "too deep", "[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]", REASON_TOO_DEEP, "null", "", "at byte 16" },
    { "1e400", LINE("1e400", "status.get", "{}"), REASON_NUMBER_RANGE, "null", "", "at byte 27" },
    { "two objects", "{}{}", REASON_JSON_INVALID, "null", "", "at byte 2" },
    /* the envelope */
    { "a string", "\"status.get\"", REASON_REQUEST_INVALID, "null", "", "it is not an object" },
    { "null", "null", REASON_REQUEST_INVALID, "null", "", "it is not an object" },
    { "nothing in it", "{}", REASON_ID_MISSING, "null", "", "" },
    { "id null", LINE("null", "status.get", "{}"), REASON_ID_INVALID, "null", "/id", "" },
    { "id true", LINE("true", "status.get", "{}"), REASON_ID_INVALID, "null", "/id", "" },
    { "id an object", LINE("{}", "status.get", "{}"), REASON_ID_INVALID, "null", "/id", "" },
    { "id a fraction", LINE("1.5", "status.get", "{}"), REASON_ID_INVALID, "null", "/id", "" },
    { "id 2^53", LINE("9007199254740992", "status.get", "{}"), REASON_ID_INVALID, "null", "/id",
      "" },
    { "id -2^53", LINE("-9007199254740992", "status.get", "{}"), REASON_ID_INVALID, "null", "/id",
      "" },
    { "id of 65 bytes",
      LINE("\"01234567890123456789012345678901234567890123456789012345678901234\"", "status.get",
           "{}"),
      REASON_ID_INVALID, "null", "/id", "" },
    { "ID is not id", "{\"jsonrpc\":\"2.0\",\"ID\":1,\"method\":\"status.get\"}", REASON_ID_MISSING,
      "null", "", "" },
    { "no jsonrpc", "{\"id\":1,\"method\":\"status.get\"}", REASON_REQUEST_INVALID, "1", "/jsonrpc",
      "jsonrpc must be \"2.0\"" },
    { "jsonrpc 1.0", "{\"jsonrpc\":\"1.0\",\"id\":1,\"method\":\"status.get\"}",
      REASON_REQUEST_INVALID, "1", "/jsonrpc", "jsonrpc must be \"2.0\"" },
    { "jsonrpc as a number", "{\"jsonrpc\":2.0,\"id\":1,\"method\":\"status.get\"}",
      REASON_REQUEST_INVALID, "1", "/jsonrpc", "jsonrpc must be \"2.0\"" },
    { "no method", "{\"jsonrpc\":\"2.0\",\"id\":\"x\"}", REASON_REQUEST_INVALID, "\"x\"", "/method",
      "method must be a string" },
    { "method 1", "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":1}", REASON_REQUEST_INVALID, "1",
      "/method", "method must be a string" },
    { "a member beside", "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status.get\",\"param\":{}}",
      REASON_REQUEST_INVALID, "1", "", "it has a member \"param\" that is not known" },
    /* the method */
    { "another case", LINE("1", "Status.get", "{}"), REASON_METHOD_UNKNOWN, "1", "/method",
      "\"Status.get\"" },
    { "empty", LINE("1", "", "{}"), REASON_METHOD_UNKNOWN, "1", "/method", "\"\"" },
    { "a method that would steer a terminal", LINE("1", "\\u001b[31m\\n", "{}"),
      REASON_METHOD_UNKNOWN, "1", "/method", "\"\\u001b[31m\\u000a\"" },
    /* the parameters */
    { "params null", LINE("1", "status.get", "null"), REASON_PARAMS_INVALID, "1", "/params",
      "/params must be an object, not null" },
    { "a typo", LINE("1", "session.open", "{\"major\":1,\"client\":\"c\",\"operater\":\"x\"}"),
      REASON_PARAMS_INVALID, "1", "/params",
      "/params has a member \"operater\" that is not known" },
    { "something lacks", LINE("1", "session.open", "{\"major\":1}"), REASON_PARAMS_INVALID, "1",
      "/params", "/params lacks the member \"client\"" },
    { "no params where some are needed",
      "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.open\"}", REASON_PARAMS_INVALID, "1",
      "/params", "/params lacks the member \"major\"" },
    { "control characters", LINE("1", "subject.add", "{\"label\":\"a\\u0007b\"}"),
      REASON_PARAMS_INVALID, "1", "/params/label",
      "/params/label must be one line without control characters, not \"a\\u0007b\"" },
    { "deep in the spectrum",
      LINE("1", "match.spectrum",
           "{\"spectrum\":{\"first_nm\":400,\"step_nm\":10,\"values\":[0.1,20]},"
           "\"specular\":\"sce\",\"store\":false}"),
      REASON_PARAMS_INVALID, "1", "/params/spectrum/values/1",
      "/params/spectrum/values/1 must be a number from 0 to 2, not 20" },
    { "a table by its path", LINE("1", "table.info", "{\"table\":\"../../etc/passwd\"}"),
      REASON_PARAMS_INVALID, "1", "/params/table",
      "/params/table must be made of letters, digits, - and _, not beginning with -, not "
      "\"../../etc/passwd\"" },
    { "a time to live of zero",
      LINE("1", "instrument.acquire", "{\"instrument\":\"i\",\"ttl_ms\":0,\"wait\":true}"),
      REASON_PARAMS_INVALID, "1", "/params/ttl_ms",
      "/params/ttl_ms must be an integer from 1000 to 600000, not 0" },
    { "a topic twice", LINE("1", "events.subscribe", "{\"topics\":[\"store\",\"store\"]}"),
      REASON_PARAMS_INVALID, "1", "/params/topics", "/params/topics must name each item once" },
    { "no UUID", LINE("1", "record.get", "{\"id\":\"1 OR 1=1\"}"), REASON_PARAMS_INVALID, "1",
      "/params/id", "/params/id must be a UUID, not \"1 OR 1=1\"" },
};

static struct answer answer_of(const struct line *line, const char *what)
{
    struct answer answer;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STRICT_JSON_FINE, strict_json_check(line->text, line->n, NULL),
                                  what);
    TEST_ASSERT_NULL_MESSAGE(strchr(line->text, '\n'), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, protocol_read_answer(line->text, line->n, &answer),
                                  what);
    return answer;
}

static const char *text_of(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(strict_json_member(object, name));
    return text != NULL ? text : "";
}

/* {"jsonrpc":"2.0","id":ID,"error":..} */
static void check_error_line(const struct refuse_case *c, const struct line *line)
{
    char head[128];
    struct answer a = answer_of(line, c->what);
    snprintf(head, sizeof head, "{\"jsonrpc\":\"2.0\",\"id\":%s,\"error\":{\"code\":-32", c->id);
    TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(head, line->text, strlen(head), c->what);
    const cJSON *data = strict_json_member(a.error, "data");
    TEST_ASSERT_EQUAL_STRING_MESSAGE(reason_name(c->reason), text_of(data, "reason"), c->what);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(c->path, text_of(data, "path"), c->what);
    TEST_ASSERT_TRUE_MESSAGE(strlen(text_of(data, "hint")) > 0, c->what);
    TEST_ASSERT_TRUE_MESSAGE(cJSON_IsBool(strict_json_member(data, "retryable")), c->what);
    const char *message = text_of(a.error, "message");
    if (*c->detail != '\0')
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->detail, message + strlen(message) - strlen(c->detail),
                                         c->what);
    cJSON_Delete(a.tree);
}

static void test_refusals(void)
{
    for (size_t i = 0; i < sizeof refuse_cases / sizeof *refuse_cases; i++) {
        const struct refuse_case *c = &refuse_cases[i];
        struct request request;
        struct refusal refusal;
        struct line line;
        bool good = protocol_read(protocol, c->line, strlen(c->line), &request, &refusal);
        TEST_ASSERT_FALSE_MESSAGE(good, c->what);
        TEST_ASSERT_NULL_MESSAGE(request.tree, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(reason_name(c->reason), reason_name(refusal.reason),
                                         c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->path, refusal.path, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->detail, refusal.detail, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, protocol_refuse(protocol, &request.id, &refusal, &line), c->what);
        check_error_line(c, &line);
        free(line.text);
    }
}

/* A request of exactly n bytes, filled up with white space. */
static bool read_padded(size_t n, struct refusal *refusal)
{
    static const char text[] = LINE("1", "status.get", "{}");
    struct request request;
    char *line = malloc(n);
    memset(line, ' ', n);
    memcpy(line, text, sizeof text - 1);
    bool good = protocol_read(protocol, line, n, &request, refusal);
    free(line);
    request_done(&request);
    return good;
}

static void test_longest_line(void)
{
    struct refusal refusal;
    TEST_ASSERT_TRUE(read_padded(PROTOCOL_MAX_REQUEST - 1, &refusal));
    TEST_ASSERT_TRUE(read_padded(PROTOCOL_MAX_REQUEST, &refusal));
    TEST_ASSERT_FALSE(read_padded(PROTOCOL_MAX_REQUEST + 1, &refusal));
    TEST_ASSERT_EQUAL_INT(REASON_LINE_TOO_LONG, refusal.reason);
}

static void test_too_many_members(void)
{
    char line[4096] = "{\"jsonrpc\":\"2.0\"";
    struct request request;
    struct refusal refusal;
    for (int i = 0; i < 128; i++)
        sprintf(line + strlen(line), ",\"m%d\":0", i);
    strcat(line, "}");
    TEST_ASSERT_FALSE(protocol_read(protocol, line, strlen(line), &request, &refusal));
    TEST_ASSERT_EQUAL_INT(REASON_TOO_MANY_MEMBERS, refusal.reason);
}

/* ---- what is accepted --------------------------------------------------------------- */

/* expect: the id as it was; an integer stays one, a string a string. */
static const struct id_case {
    const char *line_id, *reply_id;
    enum request_id_kind kind;
} id_cases[] = {
    { "1", "1", REQUEST_ID_INTEGER },
    { "0", "0", REQUEST_ID_INTEGER },
    { "-0", "0", REQUEST_ID_INTEGER },
    { "-7", "-7", REQUEST_ID_INTEGER },
    { "1.0", "1", REQUEST_ID_INTEGER },
    { "1e3", "1000", REQUEST_ID_INTEGER },
    { "9007199254740991", "9007199254740991", REQUEST_ID_INTEGER },
    { "-9007199254740991", "-9007199254740991", REQUEST_ID_INTEGER },
    { "\"\"", "\"\"", REQUEST_ID_STRING },
    { "\"1\"", "\"1\"", REQUEST_ID_STRING },
    { "\"a\\u0022\\\\\\n\\u0001\\u00e9\"", "\"a\\\"\\\\\\n\\u0001\xc3\xa9\"", REQUEST_ID_STRING },
    { "\"0123456789012345678901234567890123456789012345678901234567890123\"",
      "\"0123456789012345678901234567890123456789012345678901234567890123\"", REQUEST_ID_STRING },
};

static void test_ids_come_back(void)
{
    for (size_t i = 0; i < sizeof id_cases / sizeof *id_cases; i++) {
        const struct id_case *c = &id_cases[i];
        struct request request;
        struct refusal refusal;
        struct line line;
        char text[512], expect[512];
        snprintf(text, sizeof text, LINE("%s", "status.get", "{}"), c->line_id);
        TEST_ASSERT_TRUE_MESSAGE(protocol_read(protocol, text, strlen(text), &request, &refusal),
                                 c->line_id);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->kind, request.id.kind, c->line_id);
        request_done(&request);
        TEST_ASSERT_EQUAL_INT(STATUS_OK,
                              protocol_reply(protocol, &request.id, cJSON_CreateObject(), &line));
        snprintf(expect, sizeof expect, "{\"jsonrpc\":\"2.0\",\"id\":%s,\"result\":{}}",
                 c->reply_id);
        TEST_ASSERT_EQUAL_STRING(expect, line.text);
        TEST_ASSERT_EQUAL_size_t(strlen(expect), line.n);
        free(line.text);
    }
}

/* expect: rights and needs as the design of the protocol has them. */
static const struct accept_case {
    const char *line;
    enum method method;
    enum right right;
    bool session, lease;
} accept_cases[] = {
    { LINE("1", "session.open", "{\"major\":1,\"client\":\"c\",\"operator\":\"Ada\"}"),
      METHOD_SESSION_OPEN, RIGHT_KIOSK, false, false },
    { "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status.get\"}", METHOD_STATUS_GET, RIGHT_KIOSK,
      true, false },
    { "{\"method\":\"\\u0073tatus.get\",\"id\":1,\"jsonrpc\":\"2.0\"}\r", METHOD_STATUS_GET,
      RIGHT_KIOSK, true, false },
    { LINE("1", "instrument.acquire", "{\"instrument\":\"sim:1\",\"ttl_ms\":1000,\"wait\":false}"),
      METHOD_INSTRUMENT_ACQUIRE, RIGHT_KIOSK, true, false },
    { LINE("1", "instrument.configure", "{\"lease\":\"" U "\",\"aperture_mm\":8}"),
      METHOD_INSTRUMENT_CONFIGURE, RIGHT_ADMIN, true, true },
    { LINE("1", "instrument.calibrate", "{\"lease\":\"" U "\",\"step\":\"white\"}"),
      METHOD_INSTRUMENT_CALIBRATE, RIGHT_KIOSK, true, true },
    { LINE("1", "measure.start",
           "{\"lease\":\"" U "\",\"uuid\":\"" U "\",\"specular\":\"sce\",\"replicates\":3,"
           "\"pace\":\"prompt\",\"subject\":\"" U "\",\"site\":\"left forearm\"}"),
      METHOD_MEASURE_START, RIGHT_KIOSK, true, true },
    { LINE("1", "match.spectrum",
           "{\"spectrum\":{\"first_nm\":400,\"step_nm\":10,\"values\":[0,0.5,2]},"
           "\"specular\":\"sci\",\"surface\":0.04,\"k\":3,\"store\":true,\"uuid\":\"" U "\"}"),
      METHOD_MATCH_SPECTRUM, RIGHT_KIOSK, true, false },
    { LINE("1", "record.export", "{\"format\":\"cgats\"}"), METHOD_RECORD_EXPORT, RIGHT_CLINIC,
      true, false },
    { LINE("1", "subject.add",
           "{\"person\":{\"name\":\"Robert'); DROP TABLE subject;--\",\"birth_year\":1990,"
           "\"notes\":\"a\\nb\"}}"),
      METHOD_SUBJECT_ADD, RIGHT_CLINIC, true, false },
    { LINE("1", "subject.list", "{}"), METHOD_SUBJECT_LIST, RIGHT_CLINIC, true, false },
    { LINE("1", "subject.forget", "{\"id\":\"" U "\"}"), METHOD_SUBJECT_FORGET, RIGHT_ADMIN, true,
      false },
    { LINE("1", "store.verify", "{}"), METHOD_STORE_VERIFY, RIGHT_ADMIN, true, false },
    { LINE("1", "events.subscribe", "{\"topics\":[\"lease\",\"store\"],\"since_seq\":7}"),
      METHOD_EVENTS_SUBSCRIBE, RIGHT_KIOSK, true, false },
};

static void test_requests(void)
{
    for (size_t i = 0; i < sizeof accept_cases / sizeof *accept_cases; i++) {
        const struct accept_case *c = &accept_cases[i];
        struct request r;
        struct refusal refusal;
        bool good = protocol_read(protocol, c->line, strlen(c->line), &r, &refusal);
        TEST_ASSERT_TRUE_MESSAGE(good, good ? "" : refusal.detail);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(method_name(c->method), method_name(r.method), c->line);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(right_name(c->right), right_name(r.right), c->line);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->session, r.needs_session, c->line);
        TEST_ASSERT_TRUE_MESSAGE(cJSON_IsObject(r.params), c->line);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->lease, strict_json_member(r.params, "lease") != NULL,
                                      c->line);
        request_done(&r);
    }
}

/* ---- what is sent ------------------------------------------------------------------- */

static const struct request_id one = { .kind = REQUEST_ID_INTEGER, .integer = 1 };

/* expect: the shortest decimal that reads back; IEEE 754 by hand. */
static void test_numbers_are_exact(void)
{
    static const double x[] = { 0.1, 1.0 / 3.0, 9007199254740991.0, 1e22, 5e-324, -0.0, 255 };
    struct line line;
    cJSON *result = cJSON_CreateObject();
    cJSON_AddItemToObject(result, "x", cJSON_CreateDoubleArray(x, 7));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply(protocol, &one, result, &line));
    TEST_ASSERT_EQUAL_STRING("{\"jsonrpc\":\"2.0\",\"id\":1,\"result\":{\"x\":[0.1,"
                             "0.3333333333333333,9007199254740991,1e+22,4.94065645841247e-324,0,"
                             "255]}}",
                             line.text);
    free(line.text);
}

/* Reply to a result that must not leave as it is: the reason that leaves instead. */
static void check_reply_becomes(cJSON *result, const char *reason)
{
    struct line line;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply(protocol, &one, result, &line));
    struct answer a = answer_of(&line, reason);
    TEST_ASSERT_EQUAL_STRING(reason, text_of(strict_json_member(a.error, "data"), "reason"));
    TEST_ASSERT_EQUAL_INT(1, a.id.integer);
    cJSON_Delete(a.tree);
    free(line.text);
}

static cJSON *result_with(cJSON *value)
{
    cJSON *result = cJSON_CreateObject();
    cJSON_AddItemToObject(result, "x", value);
    return result;
}

static cJSON *long_text(size_t n)
{
    char *text = malloc(n + 1);
    memset(text, 'x', n);
    text[n] = '\0';
    cJSON *value = cJSON_CreateString(text);
    free(text);
    return value;
}

static void test_replies_that_cannot_leave(void)
{
    cJSON *deep = cJSON_CreateArray();
    cJSON_AddItemToArray(deep, cJSON_CreateNull());
    check_reply_becomes(result_with(cJSON_CreateNull()), "internal");
    check_reply_becomes(result_with(deep), "internal");
    check_reply_becomes(result_with(cJSON_CreateNumber(NAN)), "internal");
    check_reply_becomes(result_with(cJSON_CreateNumber(-INFINITY)), "internal");
    check_reply_becomes(result_with(cJSON_CreateString("caf\xe9")), "internal");
    check_reply_becomes(NULL, "no_memory");
    check_reply_becomes(result_with(long_text(1024 * 1024)), "reply_too_large");
}

/* Text as a result makes the line that a tree of it makes, whatever the id, and the same errors. */
static void test_reply_of_text(void)
{
    static const char *const results[] = { "{}", "{\"x\":[0.1,\"\xc3\xa9\"]}",
                                           "{\"x\":\"caf\xe9\"}" };
    const struct request_id ids[] = {
        one,
        { .kind = REQUEST_ID_NONE },
        { .kind = REQUEST_ID_INTEGER, .integer = -PROTOCOL_MAX_INTEGER },
        { .kind = REQUEST_ID_STRING, .text = "a\"\n\xc3\xa9" },
    };
    for (size_t i = 0; i < sizeof results / sizeof *results; i++) {
        for (size_t j = 0; j < sizeof ids / sizeof *ids; j++) {
            struct line expect, line;
            cJSON *raw = cJSON_CreateRaw(results[i]);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply(protocol, &ids[j], raw, &expect));
            TEST_ASSERT_EQUAL_INT(STATUS_OK,
                                  protocol_reply_text(protocol, &ids[j], results[i], &line));
            TEST_ASSERT_EQUAL_size_t(expect.n, line.n);
            TEST_ASSERT_EQUAL_STRING(expect.text, line.text);
            free(expect.text);
            free(line.text);
        }
    }
}

static void test_longest_reply_of_text(void)
{
    static const char around[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"result\":}";
    size_t fits = PROTOCOL_MAX_LINE - 1 - (sizeof around - 1);
    char *text = malloc(fits + 2);
    struct line line;
    memset(text, ' ', fits + 1); /* nobody looks into it */
    text[fits + 1] = '\0';
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply_text(protocol, &one, text + 1, &line));
    TEST_ASSERT_EQUAL_size_t(PROTOCOL_MAX_LINE - 1, line.n);
    TEST_ASSERT_EQUAL_size_t(line.n, strlen(line.text));
    free(line.text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply_text(protocol, &one, text, &line));
    TEST_ASSERT_NOT_NULL(strstr(line.text, "\"reply_too_large\""));
    free(line.text);
    free(text);
}

/* 1 MiB with the line feed that the connection adds is the longest. */
static void test_longest_reply(void)
{
    static const char around[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"result\":{\"x\":\"\"}}";
    size_t fits = PROTOCOL_MAX_LINE - 1 - (sizeof around - 1);
    struct line line;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          protocol_reply(protocol, &one, result_with(long_text(fits)), &line));
    TEST_ASSERT_EQUAL_size_t(PROTOCOL_MAX_LINE - 1, line.n);
    free(line.text);
    check_reply_becomes(result_with(long_text(fits + 1)), "reply_too_large");
}

static void test_errors(void)
{
    struct refusal refusal;
    struct line line;
    refusal_set(&refusal, REASON_INSTRUMENT_FAULT, "%s", "lamp");
    strcpy(refusal.device_code, "ER21");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_refuse(protocol, &one, &refusal, &line));
    TEST_ASSERT_EQUAL_STRING(
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"error\":{\"code\":-32000,\"message\":\"the instrument "
        "reports damage: lamp\",\"data\":{\"reason\":\"instrument_fault\",\"hint\":\"Have it "
        "repaired; the message names the part.\",\"retryable\":false,\"device_code\":\"ER21\"}}}",
        line.text);
    free(line.text);
}

/* An instrument's text may be anything; a cut one ends within a character. */
static void test_errors_are_valid_utf8(void)
{
    static const struct {
        const char *detail, *expect;
    } cases[] = {
        { "lamp \xe2\x82", "the instrument says no: lamp " },
        { "lamp \xf0\x9f\x98", "the instrument says no: lamp " },
        { "\xff\xfe lamp \xe9!", "the instrument says no: ?? lamp ?!" },
        { "\xff", "the instrument says no" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct refusal refusal;
        struct line line;
        refusal_set(&refusal, REASON_INSTRUMENT_REFUSED, "%s", cases[i].detail);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_refuse(protocol, &one, &refusal, &line));
        struct answer a = answer_of(&line, cases[i].detail);
        TEST_ASSERT_EQUAL_STRING_LEN(cases[i].expect, text_of(a.error, "message"),
                                     strlen(cases[i].expect));
        cJSON_Delete(a.tree);
        free(line.text);
    }
}

/* Every reason makes an error as it is described. */
static void test_every_reason(void)
{
    for (int i = 0; i < REASONS; i++) {
        const struct request_id none = { .kind = REQUEST_ID_NONE };
        struct refusal refusal;
        struct line line;
        refusal_set(&refusal, (enum reason)i, NULL);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_refuse(protocol, &none, &refusal, &line));
        struct answer a = answer_of(&line, reason_name((enum reason)i));
        TEST_ASSERT_EQUAL_INT(REQUEST_ID_NONE, a.id.kind);
        int code = strict_json_member(a.error, "code")->valueint;
        TEST_ASSERT_TRUE(code == -32000 || code == -32700 || (code <= -32600 && code >= -32602));
        cJSON_Delete(a.tree);
        free(line.text);
    }
}

static void test_hello(void)
{
    struct hello hello = { "skinspecd 0.1.0", "", U };
    struct schema_error error;
    struct line line;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_hello(&hello, &line));
    TEST_ASSERT_EQUAL_STRING(
        "{\"jsonrpc\":\"2.0\",\"method\":\"hello\",\"params\":{\"protocol\":{\"major\":1,"
        "\"minor\":0},\"server\":\"skinspecd 0.1.0\",\"capabilities\":[],\"limits\":{"
        "\"request_bytes\":65536,\"reply_bytes\":1048576,\"depth\":16,\"events\":1024},"
        "\"boot\":\"" U "\"}}",
        line.text);
    free(line.text);
    hello.station_id = U;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_hello(&hello, &line));
    struct answer a = answer_of(&line, "hello");
    TEST_ASSERT_EQUAL_STRING("hello", a.method);
    TEST_ASSERT_TRUE_MESSAGE(
        protocol_check_notification(protocol, NOTIFICATION_HELLO, a.params, &error), error.what);
    cJSON_Delete(a.tree);
    free(line.text);
}

static void test_event(void)
{
    char data[] = "{\"id\":\"" U "\",\"seq\":3}";
    struct event event = { .seq = 9, .topic = EVENT_STORE, .type = "record", .data = data };
    struct schema_error error;
    struct line line;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_event(&event, &line));
    TEST_ASSERT_EQUAL_STRING("{\"jsonrpc\":\"2.0\",\"method\":\"event\",\"params\":{\"seq\":9,"
                             "\"topic\":\"store\",\"type\":\"record\",\"data\":{\"id\":\"" U
                             "\",\"seq\":3}}}",
                             line.text);
    struct answer a = answer_of(&line, "event");
    const cJSON *inside = strict_json_member(a.params, "data");
    TEST_ASSERT_TRUE(protocol_check_notification(protocol, NOTIFICATION_EVENT, a.params, &error));
    TEST_ASSERT_TRUE(protocol_check_event(protocol, EVENT_STORE, "record", inside, &error));
    TEST_ASSERT_FALSE(protocol_check_event(protocol, EVENT_STORE, "state", inside, &error));
    TEST_ASSERT_FALSE(protocol_check_event(protocol, EVENT_STORE, "waiting", inside, &error));
    TEST_ASSERT_EQUAL_STRING("/params/type", error.path);
    cJSON_Delete(a.tree);
    free(line.text);
}

static void test_notifications_that_cannot_leave(void)
{
    struct line line;
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, protocol_notify(NOTIFICATION_EVENTS_LOST,
                                                         result_with(cJSON_CreateNull()), &line));
    TEST_ASSERT_EQUAL_INT(
        STATUS_FORMAT,
        protocol_notify(NOTIFICATION_EVENT, result_with(cJSON_CreateNumber(NAN)), &line));
    TEST_ASSERT_EQUAL_INT(
        STATUS_FORMAT,
        protocol_notify(NOTIFICATION_EVENT, result_with(cJSON_CreateString("\xe9")), &line));
    TEST_ASSERT_EQUAL_INT(
        STATUS_RANGE,
        protocol_notify(NOTIFICATION_EVENT, result_with(long_text(1024 * 1024)), &line));
    TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, protocol_notify(NOTIFICATION_EVENT, NULL, &line));
}

/* ---- the description ---------------------------------------------------------------- */

static void test_describe(void)
{
    const char *text = protocol_describe(protocol);
    TEST_ASSERT_NULL(strchr(text, '\n'));
    TEST_ASSERT_TRUE(strlen(text) < PROTOCOL_MAX_LINE / 2);
    struct schema_error error;
    struct line line;
    cJSON *result = cJSON_CreateObject();
    cJSON_AddRawToObject(result, "schema", text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_reply(protocol, &one, result, &line));
    struct answer a;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_read_answer(line.text, line.n, &a));
    TEST_ASSERT_TRUE(protocol_check_result(protocol, METHOD_RPC_DESCRIBE, a.result, &error));
    const cJSON *methods = strict_json_member(strict_json_member(a.result, "schema"), "methods");
    TEST_ASSERT_EQUAL_INT(METHODS, cJSON_GetArraySize(methods));
    cJSON_Delete(a.tree);
    free(line.text);
}

/* One thing in the description changed (NULL: removed), and what the log says of it. */
static const struct spoil_case {
    const char *part, *entry, *member, *value, *log;
} spoil_cases[] = {
    { "methods", NULL, NULL, NULL,
      "protocol: 'methods' of the description: 'nothing' where "
      "'session.open' was expected" },
    { "methods", "store.begin_anew", NULL, NULL,
      "protocol: 'methods' of the description: 'nothing' where 'store.begin_anew' was expected" },
    { "methods", "status.get", NULL, NULL,
      "protocol: 'methods' of the description: 'metrics.get' where 'status.get' was expected" },
    { "methods", "one.more", "x", "1",
      "protocol: 'methods' of the description: 'one.more' where 'nothing' was expected" },
    { "methods", "status.get", "right", "\"root\"",
      "protocol: 'status.get' of the description lacks its right or session" },
    { "methods", "status.get", "right", NULL,
      "protocol: 'status.get' of the description lacks its right or session" },
    { "methods", "status.get", "session", NULL,
      "protocol: 'status.get' of the description lacks its right or session" },
    { "methods", "status.get", "params", "{\"type\":\"objekt\"}",
      "protocol: params of 'status.get' in the description: #/type: no such type" },
    { "methods", "status.get", "result", NULL,
      "protocol: result of 'status.get' in the description: #: must be an object" },
    { "errors", NULL, NULL, NULL,
      "protocol: 'errors' of the description: 'nothing' where 'json_invalid' was expected" },
    { "errors", "internal", "code", NULL,
      "protocol: 'internal' of the description lacks its code, meaning, hint or retryable" },
    { "errors", "internal", "hint", NULL,
      "protocol: 'internal' of the description lacks its code, meaning, hint or retryable" },
    { "errors", "internal", "meaning", "1",
      "protocol: 'internal' of the description lacks its code, meaning, hint or retryable" },
    { "errors", "internal", "retryable", NULL,
      "protocol: 'internal' of the description lacks its code, meaning, hint or retryable" },
    { "notifications", NULL, NULL, NULL,
      "protocol: 'notifications' of the description: 'nothing' where 'hello' was expected" },
    { "notifications", "hello", "params", NULL,
      "protocol: params of 'hello' in the description: #: must be an object" },
    { "events", NULL, NULL, NULL,
      "protocol: 'events' of the description: 'nothing' where 'instrument' was expected" },
    { "events", "lease", "freed", "{}",
      "protocol: data of 'freed' in the description: #: must be an object" },
};

static void spoil(cJSON *doc, const struct spoil_case *c)
{
    cJSON *part = cJSON_GetObjectItem(doc, c->part);
    cJSON *entry = c->entry != NULL ? cJSON_GetObjectItem(part, c->entry) : NULL;
    if (c->entry == NULL) {
        cJSON_DeleteItemFromObject(doc, c->part);
    } else if (c->member == NULL) {
        cJSON_DeleteItemFromObject(part, c->entry);
    } else {
        if (entry == NULL)
            entry = cJSON_AddObjectToObject(part, c->entry);
        cJSON_DeleteItemFromObject(entry, c->member);
        if (c->value != NULL)
            cJSON_AddItemToObject(entry, c->member, cJSON_Parse(c->value));
    }
}

static void check_spoilt(cJSON *doc, const char *log)
{
    struct protocol *other = NULL;
    char *text = cJSON_PrintUnformatted(doc);
    heard_start();
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, protocol_open_text(text, &other), log);
    TEST_ASSERT_NULL(other);
    TEST_ASSERT_EQUAL_STRING(log, heard_last());
    heard_stop();
    cJSON_free(text);
    cJSON_Delete(doc);
}

static void test_description_and_sources_must_agree(void)
{
    for (size_t i = 0; i < sizeof spoil_cases / sizeof *spoil_cases; i++) {
        cJSON *doc = cJSON_Parse(protocol_describe(protocol));
        spoil(doc, &spoil_cases[i]);
        check_spoilt(doc, spoil_cases[i].log);
    }
}

static void test_too_many_types_of_events(void)
{
    cJSON *doc = cJSON_Parse(protocol_describe(protocol));
    cJSON *lease = cJSON_GetObjectItem(cJSON_GetObjectItem(doc, "events"), "lease");
    for (int i = 0; i < 16; i++) {
        char name[32];
        sprintf(name, "type_%d", i);
        cJSON_AddItemToObject(lease, name, cJSON_Parse("{\"data\":{\"type\":\"object\"}}"));
    }
    check_spoilt(doc, "protocol: 'lease' of the description lacks its end: it has too many types");
}

static double limit(const cJSON *doc, const char *name)
{
    const cJSON *one_limit = strict_json_member(strict_json_member(doc, "limits"), name);
    TEST_ASSERT_NOT_NULL_MESSAGE(one_limit, name);
    return strict_json_member(one_limit, "value")->valuedouble;
}

/* What the page promises is what the sources hold to. */
static void test_limits_are_as_described(void)
{
    const char *described = protocol_describe(protocol);
    cJSON *doc = cJSON_Parse(described);
    /* Who reads as strictly as we do can read it too. */
    TEST_ASSERT_EQUAL_INT(STRICT_JSON_FINE, strict_json_check(described, strlen(described), NULL));
    const struct {
        const char *name;
        double value;
    } limits[] = {
        { "request_bytes", PROTOCOL_MAX_REQUEST },
        { "request_bytes", CONNECTION_LINE_MAX },
        { "reply_bytes", PROTOCOL_MAX_LINE },
        { "depth", STRICT_JSON_MAX_DEPTH },
        { "members", STRICT_JSON_MAX_MEMBERS },
        { "number_bytes", STRICT_JSON_MAX_NUMBER },
        { "id_bytes", PROTOCOL_MAX_ID },
        { "echo_bytes", STRICT_JSON_ECHO },
        { "events", EVENTS_KEPT },
        { "unsent_bytes", (double)CONNECTION_UNSENT_MAX },
        { "unsent_ms", CONNECTION_UNSENT_MS },
    };
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(limits[i].value, limit(doc, limits[i].name),
                                         limits[i].name);
    const cJSON *version = strict_json_member(doc, "protocol");
    TEST_ASSERT_EQUAL_INT(PROTOCOL_MAJOR, strict_json_member(version, "major")->valueint);
    TEST_ASSERT_EQUAL_INT(PROTOCOL_MINOR, strict_json_member(version, "minor")->valueint);
    const cJSON *ttl = strict_json_member(strict_json_member(doc, "$defs"), "ttl_ms");
    TEST_ASSERT_EQUAL_INT(LEASE_TTL_MIN_MS, strict_json_member(ttl, "minimum")->valueint);
    TEST_ASSERT_EQUAL_INT(LEASE_TTL_MAX_MS, strict_json_member(ttl, "maximum")->valueint);
    cJSON_Delete(doc);
}

static bool names(const cJSON *list, const char *name)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, list) if (strcmp(item->valuestring, name) == 0) return true;
    return false;
}

/* Topics to subscribe to, causes of a calibration: the words that the sources use. */
static void test_words_are_as_described(void)
{
    cJSON *doc = cJSON_Parse(protocol_describe(protocol));
    const cJSON *defs = strict_json_member(doc, "$defs");
    const cJSON *topics = strict_json_member(strict_json_member(defs, "topic"), "enum");
    const cJSON *state = strict_json_member(defs, "calibration_state");
    const cJSON *cause = strict_json_member(strict_json_member(state, "properties"), "cause");
    for (int i = 0; i < EVENT_TOPICS; i++)
        TEST_ASSERT_TRUE(names(topics, event_topic_name((enum event_topic)i)));
    for (int i = CALIBRATION_NEVER; i <= CALIBRATION_EARLIER_STEP; i++)
        TEST_ASSERT_TRUE(names(strict_json_member(cause, "enum"),
                               calibration_due_name((enum calibration_due)i)));
    cJSON_Delete(doc);
}

static void test_names(void)
{
    TEST_ASSERT_EQUAL_STRING("session.open", method_name(METHOD_SESSION_OPEN));
    TEST_ASSERT_EQUAL_STRING("unknown", method_name(METHODS));
    TEST_ASSERT_EQUAL_STRING("internal", reason_name(REASON_INTERNAL));
    TEST_ASSERT_EQUAL_STRING("unknown", reason_name(REASONS));
    TEST_ASSERT_EQUAL_STRING("admin", right_name(RIGHT_ADMIN));
    TEST_ASSERT_EQUAL_STRING("unknown", right_name(RIGHTS));
}

/* ---- for clients -------------------------------------------------------------------- */

static void test_ask(void)
{
    struct line line;
    struct request request;
    struct refusal refusal;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "major", 1);
    cJSON_AddStringToObject(params, "client", "test");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_ask(7, METHOD_SESSION_OPEN, params, &line));
    TEST_ASSERT_EQUAL_STRING(LINE("7", "session.open", "{\"major\":1,\"client\":\"test\"}"),
                             line.text);
    TEST_ASSERT_TRUE(protocol_read(protocol, line.text, line.n, &request, &refusal));
    request_done(&request);
    free(line.text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, protocol_ask(8, METHOD_STATUS_GET, NULL, &line));
    TEST_ASSERT_EQUAL_STRING(LINE("8", "status.get", "{}"), line.text);
    free(line.text);
    TEST_ASSERT_EQUAL_INT(
        STATUS_RANGE, protocol_ask(9, METHOD_SUBJECT_ADD, result_with(long_text(65536)), &line));
}

/* expect: JSON-RPC 2.0, section 5. */
static void test_what_is_no_answer(void)
{
    static const char *const lines[] = {
        "",
        "1",
        "{}",
        "{\"id\":1}",
        "{\"id\":1,\"result\":1}",
        "{\"id\":1,\"result\":{},\"error\":{}}",
        "{\"id\":1,\"result\":{},\"method\":\"x\"}",
        "{\"id\":null,\"result\":{}}",
        "{\"id\":[],\"error\":{}}",
        "{\"method\":\"event\"}",
        "{\"method\":1,\"params\":{}}",
        "{\"params\":{}}",
    };
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        struct answer answer = { .tree = NULL };
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_FORMAT, protocol_read_answer(lines[i], strlen(lines[i]), &answer), lines[i]);
        TEST_ASSERT_NULL(answer.tree);
    }
}

/* ---- no memory ---------------------------------------------------------------------- */

/* Each allocation of cJSON fails in its turn: said, and nothing leaks (seen under
 * AddressSanitizer). */
static void test_no_memory_for_lines(void)
{
    struct refusal refusal;
    struct hello hello = { "s", U, U };
    char data[] = "{}";
    struct event event = { .seq = 1, .topic = EVENT_LEASE, .type = "freed", .data = data };
    refusal_set(&refusal, REASON_INTERNAL, "%s", "x");
    strcpy(refusal.path, "/x");
    strcpy(refusal.device_code, "c");
    for (int kind = 0; kind < 4; kind++) {
        for (long enough = 0;; enough++) {
            struct line line;
            allocations_left = enough;
            enum status s = kind == 0   ? protocol_refuse(protocol, &one, &refusal, &line)
                            : kind == 1 ? protocol_hello(&hello, &line)
                            : kind == 2 ? protocol_event(&event, &line)
                                        : protocol_ask(1, METHOD_STATUS_GET, NULL, &line);
            allocations_left = -1;
            if (s == STATUS_OK) {
                free(line.text);
                break;
            }
            TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
            TEST_ASSERT_TRUE(enough < 100);
        }
    }
}

static void test_no_memory_for_a_reply(void)
{
    for (long enough = 0; enough < 6; enough++) {
        struct line line;
        cJSON *result = cJSON_CreateObject();
        allocations_left = enough;
        enum status s = protocol_reply(protocol, &one, result, &line);
        allocations_left = -1;
        if (s == STATUS_OK)
            free(line.text);
        else
            TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        allocations_left = enough;
        s = protocol_reply_text(protocol, &one, "{}", &line);
        allocations_left = -1;
        if (s == STATUS_OK)
            free(line.text);
        else
            TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
    }
}

static void test_no_memory_for_a_request(void)
{
    static const char line[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status.get\"}";
    for (long enough = 0;; enough++) {
        struct request request;
        struct refusal refusal;
        allocations_left = enough;
        bool good = protocol_read(protocol, line, sizeof line - 1, &request, &refusal);
        allocations_left = -1;
        request_done(&request);
        if (good)
            break;
        TEST_ASSERT_EQUAL_INT(REASON_NO_MEMORY, refusal.reason);
    }
}

static void test_no_memory_for_the_description(void)
{
    for (long enough = 0; enough < 50; enough += 7) {
        struct protocol *other = NULL;
        allocations_left = enough;
        enum status s = protocol_open(&other);
        allocations_left = -1;
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
        TEST_ASSERT_NULL(other);
    }
    protocol_close(NULL);
}

static void test_done(void)
{
    protocol_close(protocol); /* the last test: leaks show under AddressSanitizer */
    protocol = NULL;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_refusals);
    RUN_TEST(test_longest_line);
    RUN_TEST(test_too_many_members);
    RUN_TEST(test_ids_come_back);
    RUN_TEST(test_requests);
    RUN_TEST(test_numbers_are_exact);
    RUN_TEST(test_replies_that_cannot_leave);
    RUN_TEST(test_longest_reply);
    RUN_TEST(test_reply_of_text);
    RUN_TEST(test_longest_reply_of_text);
    RUN_TEST(test_errors);
    RUN_TEST(test_errors_are_valid_utf8);
    RUN_TEST(test_every_reason);
    RUN_TEST(test_hello);
    RUN_TEST(test_event);
    RUN_TEST(test_notifications_that_cannot_leave);
    RUN_TEST(test_describe);
    RUN_TEST(test_description_and_sources_must_agree);
    RUN_TEST(test_too_many_types_of_events);
    RUN_TEST(test_limits_are_as_described);
    RUN_TEST(test_words_are_as_described);
    RUN_TEST(test_names);
    RUN_TEST(test_ask);
    RUN_TEST(test_what_is_no_answer);
    RUN_TEST(test_no_memory_for_lines);
    RUN_TEST(test_no_memory_for_a_reply);
    RUN_TEST(test_no_memory_for_a_request);
    RUN_TEST(test_no_memory_for_the_description);
    RUN_TEST(test_done);
    return UNITY_END();
}
