/* test_xrite_rci_wire.c - answers of an SP62, transcribed from the descriptions, and what is none.
 */
#include "drivers/xrite_rci/xrite_rci_wire.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* ---- answers ------------------------------------------------------------------------ */

/* expect: data, then the status in angle brackets, two hexadecimal digits */
static const struct answer_case {
    const char *what, *line;
    bool good;
    size_t n;
    unsigned status;
} answer_cases[] = {
    { "success", "<00>", true, 0, 0x00 },
    { "needs calibration", "<28>", true, 0, 0x28 },
    { "a letter", "<2A>", true, 0, 0x2A },
    { "a serial number", "001234<00>", true, 6, 0x00 },
    { "highest", "<FF>", true, 0, 0xFF },
    { "empty", "", false, 0, 0 },
    { "no status", "001234", false, 0, 0 },
    { "cut", "<00", false, 0, 0 },
    { "cut in front", "00>", false, 0, 0 },
    { "lower case", "<2a>", false, 0, 0 },
    { "one digit", "<0>", false, 0, 0 },
    { "three digits", "<000>", false, 0, 0 },
    { "no digit", "<0G>", false, 0, 0 },
    { "behind it", "<00> ", false, 0, 0 },
    { "two of them", "<00><00>", false, 0, 0 },
    { "a bracket in the data", "1<2<00>", false, 0, 0 },
    { "another bracket in the data", "1>2<00>", false, 0, 0 },
};

static void test_answers(void)
{
    for (size_t i = 0; i < sizeof answer_cases / sizeof *answer_cases; i++) {
        const struct answer_case *c = &answer_cases[i];
        struct rci_reply reply = { .n = 77 };
        TEST_ASSERT_EQUAL_MESSAGE(c->good, rci_read_reply(c->line, &reply), c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->good ? c->n : 77, reply.n, c->what);
        if (c->good)
            TEST_ASSERT_EQUAL_HEX_MESSAGE(c->status, reply.status, c->what);
    }
}

/* expect: which answers belong to which question */
static const struct kind_case {
    const char *line;
    bool is[4]; /* status, text, count, spectrum */
} kind_cases[] = {
    { "<00>", { true, true, false, false } },
    { "<01>", { true, true, false, false } },
    { "001234<00>", { false, true, true, false } },
    { "SP62-7<00>", { false, true, false, false } },
    { "20.1,20.2<00>", { false, false, false, true } },
    { "<14>", { true, true, true, true } },
    { "<28>", { true, true, true, true } },
    { "3<28>", { false, false, false, false } },
    { "<05>", { false, false, false, false } }, /* in no table */
};

static void test_kinds(void)
{
    for (size_t i = 0; i < sizeof kind_cases / sizeof *kind_cases; i++) {
        struct rci_reply reply;
        TEST_ASSERT_TRUE(rci_read_reply(kind_cases[i].line, &reply));
        for (int kind = 0; kind < 4; kind++)
            TEST_ASSERT_EQUAL_MESSAGE(kind_cases[i].is[kind],
                                      rci_is_kind(&reply, (enum rci_kind)kind), kind_cases[i].line);
    }
}

/* expect: the table of the descriptions, and what each asks a person to do */
static const struct code_case {
    unsigned status;
    enum driver_result result;
    const char *text; /* part of it */
} code_cases[] = {
    { 0x00, DRIVER_OK, "" },
    { 0x01, DRIVER_OK, "" },
    { 0x02, DRIVER_OK, "" },
    { 0x03, DRIVER_OK, "" },
    { 0x04, DRIVER_GONE, "default settings" },
    { 0x11, DRIVER_PROTOCOL, "command" },
    { 0x12, DRIVER_PROTOCOL, "command" },
    { 0x13, DRIVER_REFUSED, "no such" },
    { 0x14, DRIVER_BUSY, "busy" },
    { 0x15, DRIVER_REFUSED, "keys" },
    { 0x16, DRIVER_REFUSED, "measure first" },
    { 0x20, DRIVER_FAULT, "measure again" },
    { 0x21, DRIVER_TIMEOUT, "pressed" },
    { 0x27, DRIVER_IMPLAUSIBLE, "bad reading" },
    { 0x28, DRIVER_REFUSED, "calibrate" },
    { 0x29, DRIVER_IMPLAUSIBLE, "white tile first" },
    { 0x2A, DRIVER_TIMEOUT, "display" },
    { 0x30, DRIVER_FAULT, "internal" },
    { 0x31, DRIVER_FAULT, "lamp" },
    { 0x32, DRIVER_FAULT, "filter" },
    { 0x33, DRIVER_FAULT, "motor" },
    { 0x35, DRIVER_FAULT, "keypad" },
    { 0x36, DRIVER_FAULT, "display" },
    { 0x37, DRIVER_FAULT, "memory" },
    { 0x38, DRIVER_FAULT, "A/D" },
    { 0x39, DRIVER_FAULT, "processor" },
    { 0x3A, DRIVER_BATTERY, "battery" },
    { 0x3B, DRIVER_BATTERY, "charge" },
    { 0x3C, DRIVER_FAULT, "charger" },
    { 0x3D, DRIVER_REFUSED, "cool" },
    { 0x3E, DRIVER_BATTERY, "no battery" },
    { 0x3F, DRIVER_FAULT, "transmission lamp" },
    { 0x40, DRIVER_REFUSED, "mode" },
    { 0x41, DRIVER_REFUSED, "memory" },
    { 0x47, DRIVER_REFUSED, "memory" },
    { 0x48, DRIVER_BATTERY, "temperature" },
};

static void test_codes(void)
{
    for (size_t i = 0; i < sizeof code_cases / sizeof *code_cases; i++) {
        char what[8];
        const struct code_case *c = &code_cases[i];
        const struct rci_code *code = rci_find_code(c->status);
        snprintf(what, sizeof what, "<%02X>", c->status);
        TEST_ASSERT_NOT_NULL_MESSAGE(code, what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->result, code->result, what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->result == DRIVER_OK, code->reaction == RCI_DONE, what);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(code->text, c->text), what);
        TEST_ASSERT_EQUAL_MESSAGE(c->result == DRIVER_OK, code->text[0] == '\0', what);
    }
    static const unsigned unknown[] = { 0x05, 0x10, 0x17, 0x34, 0x49, 0xFF };
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        TEST_ASSERT_NULL(rci_find_code(unknown[i]));
}

/* ---- values ------------------------------------------------------------------------- */

static void test_counts(void)
{
    static const struct {
        const char *line;
        bool good;
        unsigned expect;
    } rows[] = {
        { "0<00>", true, 0 },      { "9<00>", true, 9 },
        { "0012<00>", true, 12 },  { "9999<00>", true, 9999 },
        { "10000<00>", false, 0 }, { "<00>", false, 0 },
        { "-1<00>", false, 0 },    { "1 <00>", false, 0 },
        { "1F<00>", false, 0 },    { "99999999999999999999<00>", false, 0 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct rci_reply reply;
        unsigned n = 77;
        TEST_ASSERT_TRUE(rci_read_reply(rows[i].line, &reply));
        TEST_ASSERT_EQUAL_MESSAGE(rows[i].good, rci_read_count(&reply, &n), rows[i].line);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(rows[i].good ? rows[i].expect : 77, n, rows[i].line);
    }
}

/* n values, of which number `at` is `text`; the others 20.5. */
static enum doubt read_with(size_t n, size_t at, const char *text, int32_t raw[RCI_BANDS])
{
    static char line[512];
    struct rci_reply reply;
    line[0] = '\0';
    for (size_t i = 0; i < n; i++) {
        strcat(line, i > 0 ? "," : "");
        strcat(line, i == at ? text : "20.5");
    }
    strcat(line, "<00>");
    TEST_ASSERT_TRUE(rci_read_reply(line, &reply));
    return rci_read_spectrum(&reply, raw);
}

/* expect: percent, in counts of 0.0001 % */
static const struct value_case {
    const char *text;
    enum doubt doubt;
    int32_t expect;
} value_cases[] = {
    { "20.1234", DOUBT_NONE, 201234 },
    { "0.0001", DOUBT_NONE, 1 },
    { "4.5", DOUBT_NONE, 45000 },
    { "4.56", DOUBT_NONE, 45600 },
    { "4.567", DOUBT_NONE, 45670 },
    { " 4.5", DOUBT_NONE, 45000 },
    { "4.5 ", DOUBT_NONE, 45000 },
    { "100.0000", DOUBT_NONE, 1000000 },
    { "999.9999", DOUBT_NONE, 9999999 },
    { "-0.02", DOUBT_NONE, -200 },
    { "0.0", DOUBT_NONE, 0 },
    { "", DOUBT_NO_NUMBER, 0 },
    { " ", DOUBT_NO_NUMBER, 0 },
    { "20", DOUBT_NO_NUMBER, 0 },
    { "20.", DOUBT_NO_NUMBER, 0 },
    { ".5", DOUBT_NO_NUMBER, 0 },
    { "2012.3", DOUBT_NO_NUMBER, 0 },
    { "20.12345", DOUBT_NO_NUMBER, 0 },
    { "20.1.2", DOUBT_NO_NUMBER, 0 },
    { "20.1e1", DOUBT_NO_NUMBER, 0 },
    { "nan", DOUBT_NO_NUMBER, 0 },
    { "inf", DOUBT_NO_NUMBER, 0 },
    { "--1.0", DOUBT_NO_NUMBER, 0 },
    { "+1.0", DOUBT_NO_NUMBER, 0 },
    { "2 0.1", DOUBT_NO_NUMBER, 0 },
    { "-", DOUBT_NO_NUMBER, 0 },
    { "0x1.0", DOUBT_NO_NUMBER, 0 },
    { "20,1", DOUBT_WRONG_COUNT, 0 },
};

static void test_values(void)
{
    for (size_t i = 0; i < sizeof value_cases / sizeof *value_cases; i++) {
        const struct value_case *c = &value_cases[i];
        static const size_t places[] = { 0, 14, RCI_BANDS - 1 };
        for (size_t p = 0; p < 3; p++) {
            int32_t raw[RCI_BANDS];
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->doubt, read_with(RCI_BANDS, places[p], c->text, raw),
                                          c->text);
            if (c->doubt != DOUBT_NONE)
                continue;
            TEST_ASSERT_EQUAL_INT32_MESSAGE(c->expect, raw[places[p]], c->text);
            TEST_ASSERT_EQUAL_INT32(205000, raw[places[p] == 0 ? 1 : 0]);
        }
    }
}

static void test_numbers_of_bands(void)
{
    int32_t raw[RCI_BANDS];
    static const size_t wrong[] = { 0, 1, 30, 32, 62 };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        TEST_ASSERT_EQUAL_INT(DOUBT_WRONG_COUNT, read_with(wrong[i], 99, "", raw));
    TEST_ASSERT_EQUAL_INT(DOUBT_NONE, read_with(31, 99, "", raw));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_answers);
    RUN_TEST(test_kinds);
    RUN_TEST(test_codes);
    RUN_TEST(test_counts);
    RUN_TEST(test_values);
    RUN_TEST(test_numbers_of_bands);
    return UNITY_END();
}
