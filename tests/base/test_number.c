/* test_number.c - numbers as text: what is one, and the same in every locale. */
#include "base/number.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
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
    setlocale(LC_ALL, "C");
}

/* expect: read by hand; IEEE 754 double for the edges. */
static const struct parse_case {
    const char *text;
    enum status status;
    double expect;
} parse_cases[] = {
    { "0", STATUS_OK, 0.0 },
    { "-0", STATUS_OK, 0.0 },
    { "1", STATUS_OK, 1.0 },
    { "+1", STATUS_OK, 1.0 },
    { "-1.5", STATUS_OK, -1.5 },
    { ".5", STATUS_OK, 0.5 },
    { "5.", STATUS_OK, 5.0 },
    { "007", STATUS_OK, 7.0 },
    { "1e3", STATUS_OK, 1000.0 },
    { "1E+3", STATUS_OK, 1000.0 },
    { "25e-2", STATUS_OK, 0.25 },
    { "0.1", STATUS_OK, 0x1.999999999999ap-4 },
    { "1.7976931348623157e308", STATUS_OK, DBL_MAX },
    { "-1.7976931348623157e308", STATUS_OK, -DBL_MAX },
    { "2.2250738585072014e-308", STATUS_OK, DBL_MIN },
    { "4.9406564584124654e-324", STATUS_OK, 0x1p-1074 },
    { "1e-310", STATUS_OK, 1e-310 }, /* denormal, and a number */
    { "1e-400", STATUS_OK, 0.0 },    /* too small for a double is nothing */
    { "0000000000000000000000000000000000000000000000000000000000000000000000.25", STATUS_OK,
      0.25 },
    { "1.7976931348623159e308", STATUS_RANGE, 0 },
    { "1e309", STATUS_RANGE, 0 },
    { "-1e309", STATUS_RANGE, 0 },
    { "1e99999999999999999999", STATUS_RANGE, 0 },
    { "", STATUS_FORMAT, 0 },
    { " 1", STATUS_FORMAT, 0 },
    { "1 ", STATUS_FORMAT, 0 },
    { "1\n", STATUS_FORMAT, 0 },
    { "\t1", STATUS_FORMAT, 0 },
    { "1,5", STATUS_FORMAT, 0 },
    { "1.000,5", STATUS_FORMAT, 0 },
    { "1'000", STATUS_FORMAT, 0 },
    { "1_000", STATUS_FORMAT, 0 },
    { "1.2.3", STATUS_FORMAT, 0 },
    { "--1", STATUS_FORMAT, 0 },
    { "+-1", STATUS_FORMAT, 0 },
    { "1-", STATUS_FORMAT, 0 },
    { "+", STATUS_FORMAT, 0 },
    { "-", STATUS_FORMAT, 0 },
    { ".", STATUS_FORMAT, 0 },
    { "e5", STATUS_FORMAT, 0 },
    { "1e", STATUS_FORMAT, 0 },
    { "1e+", STATUS_FORMAT, 0 },
    { "1e5.5", STATUS_FORMAT, 0 },
    { "1d5", STATUS_FORMAT, 0 },
    { "1f", STATUS_FORMAT, 0 },
    { "0x10", STATUS_FORMAT, 0 },
    { "0x1p3", STATUS_FORMAT, 0 },
    { "inf", STATUS_FORMAT, 0 },
    { "-inf", STATUS_FORMAT, 0 },
    { "Infinity", STATUS_FORMAT, 0 },
    { "nan", STATUS_FORMAT, 0 },
    { "NaN", STATUS_FORMAT, 0 },
    { "nan(1)", STATUS_FORMAT, 0 },
    { "NULL", STATUS_FORMAT, 0 },
    { "one", STATUS_FORMAT, 0 },
    { "1\xc2\xa0", STATUS_FORMAT, 0 },    /* a no-break space */
    { "\xef\xbc\x91", STATUS_FORMAT, 0 }, /* a full-width 1 */
    { "\xe2\x88\x92"
      "1",
      STATUS_FORMAT, 0 }, /* a typographic minus */
};

static void assert_parse_cases(void)
{
    for (size_t i = 0; i < sizeof parse_cases / sizeof *parse_cases; i++) {
        const struct parse_case *c = &parse_cases[i];
        double got = 77.0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, number_parse(c->text, &got), c->text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->status == STATUS_OK ? c->expect : 77.0, got, c->text);
    }
}

static void test_parse(void)
{
    assert_parse_cases();
}

/* expect: decimal digits and nothing else, at most `max`. */
static const struct count_case {
    const char *text;
    size_t max;
    enum status status;
    size_t expect;
} count_cases[] = {
    { "0", 10, STATUS_OK, 0 },
    { "10", 10, STATUS_OK, 10 },
    { "010", 10, STATUS_OK, 10 }, /* not octal */
    { "0", 0, STATUS_OK, 0 },
    { "18446744073709551615", SIZE_MAX, STATUS_OK, SIZE_MAX },
    { "11", 10, STATUS_RANGE, 0 },
    { "1", 0, STATUS_RANGE, 0 },
    { "18446744073709551616", SIZE_MAX, STATUS_RANGE, 0 },
    { "99999999999999999999999999", SIZE_MAX, STATUS_RANGE, 0 },
    { "", 10, STATUS_FORMAT, 0 },
    { "-1", 10, STATUS_FORMAT, 0 },
    { "+1", 10, STATUS_FORMAT, 0 },
    { "1.0", 10, STATUS_FORMAT, 0 },
    { "1e0", 10, STATUS_FORMAT, 0 },
    { " 1", 10, STATUS_FORMAT, 0 },
    { "1 ", 10, STATUS_FORMAT, 0 },
    { "0x1", 10, STATUS_FORMAT, 0 },
    { "one", 10, STATUS_FORMAT, 0 },
};

static void test_parse_count(void)
{
    for (size_t i = 0; i < sizeof count_cases / sizeof *count_cases; i++) {
        const struct count_case *c = &count_cases[i];
        size_t got = 77;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, number_parse_count(c->text, c->max, &got),
                                      c->text);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->status == STATUS_OK ? c->expect : 77, got, c->text);
    }
}

/* expect: rounded by hand, half to even on the binary value. */
static const struct format_case {
    double x;
    int digits;
    const char *text;
} format_cases[] = {
    { 0.08, 3, "0.08" },
    { 0.0, 3, "0" },
    { -0.0, 3, "0" },
    { 1234.5678, 6, "1234.57" },
    { 1234567.0, 3, "1.23e+06" },
    { 0.00001234, 2, "1.2e-05" },
    { -12.5, 1, "-1e+01" },
    { 2.0 / 3.0, 17, "0.66666666666666663" },
    { -DBL_MAX, 17, "-1.7976931348623157e+308" },
    { -0x1p-1074, 17, "-4.9406564584124654e-324" },
    { 100.0, 17, "100" },
    { 0.5, 1, "0.5" },
};

static void assert_format_cases(void)
{
    char text[NUMBER_TEXT_SIZE];
    for (size_t i = 0; i < sizeof format_cases / sizeof *format_cases; i++) {
        const struct format_case *c = &format_cases[i];
        TEST_ASSERT_EQUAL_PTR(text, number_format(c->x, c->digits, text));
        TEST_ASSERT_EQUAL_STRING(c->text, text);
    }
}

static void test_format(void)
{
    assert_format_cases();
}

/* expect: the shortest decimal of 15 to 17 digits that is that double, by hand. */
static const struct exact_case {
    double x;
    const char *text;
} exact_cases[] = {
    { 0.1, "0.1" },
    { 0.3, "0.3" },
    { 0.1 + 0.2, "0.30000000000000004" },
    { 1.0 / 3.0, "0.3333333333333333" },
    { 123456789012345680.0, "1.2345678901234568e+17" },
    { 400.0, "400" },
    { -0.0, "0" },
    { 1.0, "1" },
    { -8.0, "-8" },
    { -0.25, "-0.25" },
    { 1000.0, "1000" },
    { 120.5, "120.5" },
    { 0.001, "0.001" },
    { 0.0001, "0.0001" },
    { 0x1.a36e2eb1c432cp-14, "9.999999999999999e-05" },   /* the double before that */
    { 0.00012207031250000003, "0.00012207031250000003" }, /* the double after 2^-13 */
    { 0x1.fffffffffffffp-1, "0.9999999999999999" },
    { 1.0000000000000002, "1.0000000000000002" },
    { 999999999999999.9, "999999999999999.9" },
    { 1e15, "1e+15" },
    { 999999999999999.0, "999999999999999" },
    { 0x1p-1074, "4.94065645841247e-324" },
    { DBL_MAX, "1.7976931348623157e+308" },
};

static void assert_exact_cases(void)
{
    char text[NUMBER_TEXT_SIZE];
    for (size_t i = 0; i < sizeof exact_cases / sizeof *exact_cases; i++) {
        TEST_ASSERT_EQUAL_PTR(text, number_format_exact(exact_cases[i].x, text));
        TEST_ASSERT_EQUAL_STRING(exact_cases[i].text, text);
    }
}

static void test_format_exact(void)
{
    char text[NUMBER_TEXT_SIZE];
    assert_exact_cases();
    /* What is no number has a text as well, which does not read back. */
    TEST_ASSERT_EQUAL_STRING("inf", number_format_exact((double)INFINITY, text));
    TEST_ASSERT_EQUAL_STRING("-inf", number_format_exact(-(double)INFINITY, text));
}

/* The C library's digits, the first of 15, 16 and 17 that read back. */
static const char *by_the_library(double x, char text[NUMBER_TEXT_SIZE])
{
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, NUMBER_TEXT_SIZE, "%.*g", digits, x);
        if (strtod(text, NULL) == x)
            break;
    }
    return text;
}

static double moved(double x, int places)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits += (uint64_t)(int64_t)places;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* By turns: any bits; a denormal; 0 to 1; few decimals; any digits about 1e-5 to 1e16;
 * and next to a power of 2 or of 10, where gaps and digits change. */
static double some_number(int turn, struct dice *dice)
{
    uint64_t bits = dice_bits(dice);
    int places = (int)dice_below(dice, 9) - 4;
    double x = 0.0;
    switch (turn % 7) {
    case 0:
        memcpy(&x, &bits, sizeof x);
        return x;
    case 1:
        bits &= 0x800fffffffffffffu;
        memcpy(&x, &bits, sizeof x);
        return x;
    case 2:
        return dice_between(dice, -1.0, 1.0);
    case 3:
        return round(dice_between(dice, -1e6, 1e6)) / pow(10.0, (double)dice_below(dice, 9));
    case 4:
        return ldexp(dice_between(dice, 1.0, 2.0), (int)dice_below(dice, 70) - 17);
    case 5:
        return moved(ldexp(1.0, (int)dice_below(dice, 70) - 17), places);
    default:
        return moved(pow(10.0, (double)dice_below(dice, 21) - 5.0), places);
    }
}

/* Property, 1 400 000 numbers: they come back with the same bits, and are the text
 * that the C library finds by trying. */
static void test_exact_by_chance(void)
{
    struct dice dice = { 23 };
    int numbers = 0;
    for (int turn = 0; turn < 1400000; turn++) {
        char text[NUMBER_TEXT_SIZE], expect[NUMBER_TEXT_SIZE];
        double back, x = some_number(turn, &dice);
        if (!isfinite(x) || x == 0.0)
            continue;
        numbers++;
        number_format_exact(x, text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, number_parse(text, &back), text);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&x, &back, sizeof x, text);
        if (strcmp(by_the_library(x, expect), text) != 0)
            TEST_ASSERT_EQUAL_STRING(expect, text);
    }
    TEST_ASSERT_TRUE(numbers > 1390000);
}

/* Any count of digits, against printf: ties (a half in binary), digits of nines, and the edges
 * where an exponent begins. */
static void test_format_by_chance(void)
{
    struct dice dice = { 29 };
    int numbers = 0;
    for (int turn = 0; turn < 1400000; turn++) {
        char text[NUMBER_TEXT_SIZE], expect[NUMBER_TEXT_SIZE];
        double x = some_number(turn, &dice);
        int digits = 1 + turn / 7 % 17;
        if (!isfinite(x) || x == 0.0)
            continue;
        numbers++;
        snprintf(expect, sizeof expect, "%.*g", digits, x);
        if (strcmp(expect, number_format(x, digits, text)) != 0)
            TEST_ASSERT_EQUAL_STRING(expect, text);
    }
    TEST_ASSERT_TRUE(numbers > 1390000);
}

static void test_format_edges(void)
{
    static const double edges[] = { 0.5,           1.5,          2.5,         0.125,
                                    0.375,         9.5,          99.5,        999.5,
                                    999999999.5,   999999999.4,  99999999.95, 9.9999999995,
                                    1e-4,          0.00099999,   1e14,        999999999999999.9,
                                    0.00010000001, 123456789.25, 1e9 };
    char text[NUMBER_TEXT_SIZE], expect[NUMBER_TEXT_SIZE];
    for (size_t i = 0; i < sizeof edges / sizeof *edges; i++) {
        for (int digits = 1; digits <= 17; digits++) {
            snprintf(expect, sizeof expect, "%.*g", digits, edges[i]);
            TEST_ASSERT_EQUAL_STRING(expect, number_format(edges[i], digits, text));
        }
    }
}

/* ---- locales ------------------------------------------------------------------------- */

static bool has_comma(const char *name)
{
    return setlocale(LC_ALL, name) != NULL && strcmp(localeconv()->decimal_point, ",") == 0;
}

/* A locale of this machine whose decimal point is a comma; NULL where there is none.
 * `locale -a` does not know those in LOCPATH. */
static const char *comma_locale(void)
{
    static char name[128] = "de_DE.UTF-8";
    bool found = has_comma(name);
    FILE *f = popen("locale -a 2>/dev/null", "r");
    while (!found && f != NULL && fgets(name, sizeof name, f) != NULL) {
        name[strcspn(name, "\n")] = '\0';
        found = has_comma(name);
    }
    if (f != NULL)
        pclose(f);
    setlocale(LC_ALL, "C");
    return found ? name : NULL;
}

static void test_comma_locale(void)
{
    const char *name = comma_locale();
    char text[16];
    if (name == NULL)
        TEST_IGNORE_MESSAGE("locale -a names none with a decimal comma");
    TEST_ASSERT_NOT_NULL(setlocale(LC_ALL, name));
    snprintf(text, sizeof text, "%g", 0.5);
    TEST_ASSERT_EQUAL_STRING("0,5", text); /* so it is in force */
    assert_parse_cases();
    assert_format_cases();
    assert_exact_cases();
    snprintf(text, sizeof text, "%g", 0.5);
    TEST_ASSERT_EQUAL_STRING("0,5", text); /* and still is */
}

/* Threads convert without getting in each other's way. */
static void *convert(void *argument)
{
    struct dice dice = { 31 };
    bool *good = argument;
    *good = true;
    for (int i = 0; i < 20000; i++) {
        double x = dice_between(&dice, -1e6, 1e6), back;
        char text[NUMBER_TEXT_SIZE];
        *good =
            *good && number_parse(number_format_exact(x, text), &back) == STATUS_OK && back == x;
    }
    return NULL;
}

static void test_threads(void)
{
    pthread_t thread[4];
    bool good[4];
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread[i], NULL, convert, &good[i]));
    for (int i = 0; i < 4; i++)
        pthread_join(thread[i], NULL);
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_TRUE(good[i]);
}

/* Bytes without a NUL behind them, read as number_parse() reads them with one. */
static void assert_read_alike(const char *text)
{
    size_t n = strlen(text);
    char *exact = malloc(n + (n == 0)); /* sanitizers see a read beyond */
    double expect = 7.0, x = 7.0;
    memcpy(exact, text, n);
    enum status s = number_parse(text, &expect);
    TEST_ASSERT_EQUAL_INT_MESSAGE(s, number_parse_n(exact, n, &x), text);
    TEST_ASSERT_TRUE_MESSAGE(memcmp(&expect, &x, sizeof x) == 0, text); /* -0 too */
    free(exact);
}

static void test_parse_n(void)
{
    static const char *const edges[] = {
        "",
        "-",
        ".",
        "-.",
        "0",
        "-0",
        "-0.0",
        "00",
        "007",
        "+1",
        ".5",
        "5.",
        "-.5",
        "-5.",
        "1..2",
        "1-2",
        "--1",
        "1.2.3",
        " 1",
        "1 ",
        "0x1",
        "1e5",
        "1e",
        "e1",
        "1e-5",
        "1e400",
        "nan",
        "1,5",
        "1e-400",
        "0.1",
        "0.3",
        "2.675",
        "1.5-",
        "999999999999999",
        "9999999999999999",
        "-999999999999999",
        "99999999.9999999",
        "0.00000000000001",
        "0.000000000000001",
        "-0.12345678901234",
        "0.123456789012345",
        "9007199254740993",
        "123456789012345.6",
        "1234567890123456.",
    };
    static const char with_nul[] = { '1', '\0', '2' };
    struct dice dice = { 11 };
    char text[100];
    double x;
    for (size_t i = 0; i < sizeof edges / sizeof *edges; i++)
        assert_read_alike(edges[i]);
    for (int i = 0; i < 200000; i++) {
        int decimals = (int)dice_below(&dice, 18);
        double scale = pow(10.0, (double)dice_below(&dice, 16));
        snprintf(text, sizeof text, "%.*f", decimals, dice_between(&dice, -scale, scale));
        assert_read_alike(text);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, number_parse_n(with_nul, sizeof with_nul, &x));
    memset(text, '1', sizeof text);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, number_parse_n(text, NUMBER_LONGEST - 1, &x));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, number_parse_n(text, NUMBER_LONGEST, &x));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_parse);
    RUN_TEST(test_parse_n);
    RUN_TEST(test_parse_count);
    RUN_TEST(test_format);
    RUN_TEST(test_format_exact);
    RUN_TEST(test_exact_by_chance);
    RUN_TEST(test_format_by_chance);
    RUN_TEST(test_format_edges);
    RUN_TEST(test_comma_locale);
    RUN_TEST(test_threads);
    return UNITY_END();
}
