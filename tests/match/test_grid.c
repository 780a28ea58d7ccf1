/* test_grid.c - axes as text and values, refusals, and the order of rows. */
#include "match/grid.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: the three forms in grid.h, read by hand. */
static const struct parse_case {
    const char *text;
    enum status status;
    struct axis axis;
} parse_cases[] = {
    { "0:0.5:6", STATUS_OK, { 0.0, 0.5, 6, false } },
    { "log:0.001:0.5:50", STATUS_OK, { 0.001, 0.5, 50, true } },
    { "0.25", STATUS_OK, { 0.25, 0.25, 1, false } },
    { "0", STATUS_OK, { 0.0, 0.0, 1, false } },
    { "0.25:0.25:1", STATUS_OK, { 0.25, 0.25, 1, false } },
    { "log:0.25:0.25:1", STATUS_OK, { 0.25, 0.25, 1, true } },
    { "1e-3:5e-1:2", STATUS_OK, { 0.001, 0.5, 2, false } },
    { "-1:+1:3", STATUS_OK, { -1.0, 1.0, 3, false } }, /* ranges are grid_check()'s */
    { "0:1:10000", STATUS_OK, { 0.0, 1.0, 10000, false } },
    { "0:1:0002", STATUS_OK, { 0.0, 1.0, 2, false } },
    /* empty, reversed, numbers that do not go with the ends, no logarithm */
    { "0:1:0", STATUS_RANGE, { 0, 0, 0, false } },
    { "1:0:2", STATUS_RANGE, { 0, 0, 0, false } },
    { "1:0:1", STATUS_RANGE, { 0, 0, 0, false } },
    { "0:1:1", STATUS_RANGE, { 0, 0, 0, false } },
    { "0.5:0.5:2", STATUS_RANGE, { 0, 0, 0, false } },
    { "log:0:1:2", STATUS_RANGE, { 0, 0, 0, false } },
    { "log:0:0:1", STATUS_RANGE, { 0, 0, 0, false } },
    { "log:-1:1:2", STATUS_RANGE, { 0, 0, 0, false } },
    { "log:1e-320:0.5:3",
      STATUS_RANGE,
      { 0, 0, 0, false } }, /* the ratio of the ends is no double */
    { "0:1:10001", STATUS_RANGE, { 0, 0, 0, false } },
    { "0:1:99999999999999999999", STATUS_RANGE, { 0, 0, 0, false } },
    { "1e999", STATUS_RANGE, { 0, 0, 0, false } },
    { "0:1e999:2", STATUS_RANGE, { 0, 0, 0, false } },
    /* other text */
    { "", STATUS_FORMAT, { 0, 0, 0, false } },
    { ":", STATUS_FORMAT, { 0, 0, 0, false } },
    { "::", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:", STATUS_FORMAT, { 0, 0, 0, false } },
    { ":1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0::2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:2:3", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:2.5", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:-2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:+2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:2e0", STATUS_FORMAT, { 0, 0, 0, false } },
    { "a:1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:b:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { " 0:1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:1:2 ", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0, 1, 2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "log", STATUS_FORMAT, { 0, 0, 0, false } },
    { "log:", STATUS_FORMAT, { 0, 0, 0, false } },
    { "log:0.5", STATUS_FORMAT, { 0, 0, 0, false } },
    { "log:log:0.1:1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "LOG:0.1:1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "lin:0.1:1:2", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0x1:2:3", STATUS_FORMAT, { 0, 0, 0, false } },
    { "nan", STATUS_FORMAT, { 0, 0, 0, false } },
    { "0:inf:2", STATUS_FORMAT, { 0, 0, 0, false } },
};

static void test_parse(void)
{
    for (size_t i = 0; i < sizeof parse_cases / sizeof *parse_cases; i++) {
        const struct parse_case *c = &parse_cases[i];
        struct axis untouched = { 77.0, 78.0, 79, true }, got = untouched;
        const struct axis *expect = c->status == STATUS_OK ? &c->axis : &untouched;
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, axis_parse(c->text, &got), c->text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(expect->lo, got.lo, c->text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(expect->hi, got.hi, c->text);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(expect->n, got.n, c->text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect->log, got.log, c->text);
    }
}

/* A number may be long, but not without end: AXIS_TEXT_SIZE holds any that means it. */
static void test_parse_long_text(void)
{
    char text[300];
    struct axis got;
    for (size_t zeros = 1; zeros < sizeof text; zeros++) {
        memset(text, '0', zeros);
        text[zeros] = '\0';
        TEST_ASSERT_EQUAL_INT(zeros < AXIS_TEXT_SIZE ? STATUS_OK : STATUS_FORMAT,
                              axis_parse(text, &got));
    }
}

/* expect: written by hand. */
static const struct format_case {
    struct axis axis;
    const char *text;
} format_cases[] = {
    { { 0.0, 0.5, 6, false }, "0:0.5:6" },
    { { 0.001, 0.5, 50, true }, "log:0.001:0.5:50" },
    { { 0.25, 0.25, 1, false }, "0.25:0.25:1" },
    { { -0.0, 1.0 / 3.0, 10000, false }, "0:0.333333333333333:10000" },
};

static void test_format(void)
{
    char text[AXIS_TEXT_SIZE];
    for (size_t i = 0; i + 1 < sizeof format_cases / sizeof *format_cases; i++)
        TEST_ASSERT_EQUAL_STRING(format_cases[i].text, axis_format(&format_cases[i].axis, text));
    /* A third needs all its digits: only the beginning is fixed. */
    axis_format(&format_cases[3].axis, text);
    TEST_ASSERT_EQUAL_STRING_LEN(format_cases[3].text, text, 15);
}

/* Property: 2 000 axes by chance come back with the same bits. */
static void test_text_round_trip(void)
{
    struct dice dice = { 1 };
    for (int i = 0; i < 2000; i++) {
        char text[AXIS_TEXT_SIZE];
        struct axis axis, back;
        axis.log = dice_below(&dice, 2) == 1;
        axis.lo = exp(dice_between(&dice, -20.0, 0.0));
        axis.hi = axis.lo * dice_between(&dice, 1.001, 50.0);
        axis.n = 2 + dice_below(&dice, GRID_AXIS_MAX - 1);
        if (i % 10 == 0) {
            axis.hi = axis.lo;
            axis.n = 1;
        }
        TEST_ASSERT_TRUE(strlen(axis_format(&axis, text)) < AXIS_TEXT_SIZE);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, axis_parse(text, &back), text);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&axis.lo, &back.lo, sizeof axis.lo, text);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&axis.hi, &back.hi, sizeof axis.hi, text);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(axis.n, back.n, text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(axis.log, back.log, text);
    }
}

/* expect: lo (hi/lo)^(i/(n-1)) and lo + i (hi-lo)/(n-1) in 40-digit decimals. */
static const struct value_case {
    struct axis axis;
    size_t i;
    double expect;
} value_cases[] = {
    { { 0.001, 0.1, 3, true }, 1, 0.01 },
    { { 0.001, 0.5, 4, true }, 1, 0.007937005259840997373758528196361541 },
    { { 0.001, 0.5, 4, true }, 2, 0.06299605249474365823836053036391142 },
    { { 0.001, 0.5, 50, true }, 7, 0.002429781065806128427352854136822682 },
    { { 0.001, 0.1, 48, true }, 10, 0.002663985857258772001189497599079450 },
    { { 0.0, 1.0, 21, false }, 7, 0.35 },
    { { 0.2, 0.8, 4, false }, 1, 0.4 },
    { { 0.2, 0.8, 4, false }, 2, 0.6 },
    { { -1.0, 1.0, 3, false }, 1, 0.0 },
};

static void test_values(void)
{
    for (size_t i = 0; i < sizeof value_cases / sizeof *value_cases; i++) {
        const struct value_case *c = &value_cases[i];
        char text[AXIS_TEXT_SIZE];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4e-16 * fmax(fabs(c->expect), 0.25), c->expect,
                                          axis_value(&c->axis, c->i), axis_format(&c->axis, text));
    }
}

/* Property: both ends exact to the bit, values rising in between. */
static void test_values_rise_between_exact_ends(void)
{
    struct dice dice = { 2 };
    for (int i = 0; i < 200; i++) {
        struct axis axis = { dice_between(&dice, 1e-6, 0.01), dice_between(&dice, 0.02, 1.0),
                             2 + dice_below(&dice, 300), i % 2 == 0 };
        TEST_ASSERT_EQUAL_DOUBLE(axis.lo, axis_value(&axis, 0));
        TEST_ASSERT_EQUAL_DOUBLE(axis.hi, axis_value(&axis, axis.n - 1));
        for (size_t k = 1; k < axis.n; k++)
            TEST_ASSERT_TRUE(axis_value(&axis, k - 1) < axis_value(&axis, k));
    }
    struct axis one = { 0.3, 0.3, 1, true };
    TEST_ASSERT_EQUAL_DOUBLE(0.3, axis_value(&one, 0));
}

/* A zero with a sign is the same skin and must be the same bits: a database keeps
 * no sign of zero, and hashes are over bits. */
static void test_zero_has_no_sign(void)
{
    struct axis axis;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, axis_parse("-0:0.5:3", &axis));
    TEST_ASSERT_FALSE(signbit(axis_value(&axis, 0)));
    struct axis made = { -0.0, -0.0, 1, false };
    TEST_ASSERT_FALSE(signbit(axis_value(&made, 0)));
    struct axis upto = { -1.0, -0.0, 2, false };
    TEST_ASSERT_FALSE(signbit(axis_value(&upto, 1)));
}

/* expect: Cm 0..0.5, Bm 0..1, Ch 0.001..0.1 as tissue.h has the paper's ranges;
 * rows counted by hand: Ch values for Cm = 0, and Bm x Ch values for any other. */
static const struct grid_case {
    const char *what;
    struct grid grid;
    enum status status;
    size_t rows;
} grid_cases[] = {
    { "the default: 50 x 21 x 48",
      { { 0.001, 0.5, 50, true }, { 0, 1, 21, false }, { 0.001, 0.1, 48, true } },
      STATUS_OK,
      50400 },
    { "one row",
      { { 0.1, 0.1, 1, false }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_OK,
      1 },
    { "one Bm row where Cm = 0: 4 + 2 x 3 x 4",
      { { 0, 0.5, 3, false }, { 0, 1, 3, false }, { 0.001, 0.1, 4, false } },
      STATUS_OK,
      28 },
    { "no melanin at all: 4",
      { { 0, 0, 1, false }, { 0, 1, 3, false }, { 0.001, 0.1, 4, false } },
      STATUS_OK,
      4 },
    { "as many rows as there may be",
      { { 0.1, 0.5, 100, false }, { 0, 1, 1000, false }, { 0.001, 0.1, 1000, false } },
      STATUS_OK,
      100000000 },
    { "a few more",
      { { 0.1, 0.5, 101, false }, { 0, 1, 1000, false }, { 0.001, 0.1, 1000, false } },
      STATUS_RANGE,
      0 },
    { "many values, but half of them are one row: 5001 + 5001 x 10000",
      { { 0, 0.5, 2, false }, { 0, 1, 10000, false }, { 0.001, 0.1, 5001, false } },
      STATUS_OK,
      50015001 },
    { "1e12 rows",
      { { 0, 0.5, 10000, false }, { 0, 1, 10000, false }, { 0.001, 0.1, 10000, false } },
      STATUS_RANGE,
      0 },
    { "Cm too high",
      { { 0.1, 0.5000001, 2, false }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Cm below 0",
      { { -0.001, 0.5, 2, false }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Bm too high",
      { { 0.1, 0.1, 1, false }, { 0, 1.0000001, 2, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Bm below 0",
      { { 0.1, 0.1, 1, false }, { -0.1, 1, 2, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Ch too high",
      { { 0.1, 0.1, 1, false }, { 1, 1, 1, false }, { 0.01, 0.11, 2, false } },
      STATUS_RANGE,
      0 },
    { "Ch too low",
      { { 0.1, 0.1, 1, false }, { 1, 1, 1, false }, { 0.0009, 0.1, 2, false } },
      STATUS_RANGE,
      0 },
    { "Cm axis empty",
      { { 0.1, 0.1, 0, false }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Bm axis reversed",
      { { 0.1, 0.1, 1, false }, { 1, 0, 2, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "Ch axis unknown",
      { { 0.1, 0.1, 1, false }, { 1, 1, 1, false }, { NAN, NAN, 2, false } },
      STATUS_RANGE,
      0 },
    { "Cm logarithm of 0",
      { { 0, 0.5, 2, true }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
    { "too many on one axis",
      { { 0.1, 0.5, 10001, false }, { 1, 1, 1, false }, { 0.01, 0.01, 1, false } },
      STATUS_RANGE,
      0 },
};

static void test_grid_check_and_rows(void)
{
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid_case *c = &grid_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, grid_check(&c->grid), c->what);
        if (c->status == STATUS_OK)
            TEST_ASSERT_EQUAL_size_t_MESSAGE(c->rows, grid_rows(&c->grid), c->what);
    }
}

static void test_default_is_the_first_case(void)
{
    struct grid grid = grid_default();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, grid_check(&grid));
    const struct axis *got[3] = { &grid.Cm, &grid.Bm, &grid.Ch };
    const struct axis *expect[3] = { &grid_cases[0].grid.Cm, &grid_cases[0].grid.Bm,
                                     &grid_cases[0].grid.Ch };
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(expect[i]->lo, got[i]->lo);
        TEST_ASSERT_EQUAL_DOUBLE(expect[i]->hi, got[i]->hi);
        TEST_ASSERT_EQUAL_size_t(expect[i]->n, got[i]->n);
        TEST_ASSERT_EQUAL_INT(expect[i]->log, got[i]->log);
    }
}

/* Ch fastest, then Bm, then Cm; of Bm only the first where Cm is 0. */
static void test_row_order(void)
{
    for (size_t i = 0; i < sizeof grid_cases / sizeof *grid_cases; i++) {
        const struct grid *g = &grid_cases[i].grid;
        size_t row = 0;
        if (grid_cases[i].status != STATUS_OK || grid_cases[i].rows > 100000)
            continue;
        for (size_t cm = 0; cm < g->Cm.n; cm++) {
            for (size_t bm = 0; bm < g->Bm.n; bm++) {
                if (axis_value(&g->Cm, cm) == 0.0 && bm > 0)
                    continue;
                for (size_t ch = 0; ch < g->Ch.n; ch++, row++) {
                    double Cm, Bm, Ch;
                    grid_row(g, row, &Cm, &Bm, &Ch);
                    TEST_ASSERT_EQUAL_DOUBLE(axis_value(&g->Cm, cm), Cm);
                    TEST_ASSERT_EQUAL_DOUBLE(axis_value(&g->Bm, bm), Bm);
                    TEST_ASSERT_EQUAL_DOUBLE(axis_value(&g->Ch, ch), Ch);
                }
            }
        }
        TEST_ASSERT_EQUAL_size_t_MESSAGE(grid_cases[i].rows, row, grid_cases[i].what);
    }
}

/* A row far out, counted by hand: the last of 1e8, and the one before the last Bm. */
static void test_row_of_a_large_grid(void)
{
    struct grid g = { { 0.1, 0.5, 100, false },
                      { 0, 1, 1000, false },
                      { 0.001, 0.1, 1000, false } };
    double Cm, Bm, Ch;
    grid_row(&g, 99999999, &Cm, &Bm, &Ch);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, Cm);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, Bm);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, Ch);
    grid_row(&g, 99998999, &Cm, &Bm, &Ch);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 998.0 / 999.0, Bm);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, Ch);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_parse);
    RUN_TEST(test_parse_long_text);
    RUN_TEST(test_format);
    RUN_TEST(test_text_round_trip);
    RUN_TEST(test_values);
    RUN_TEST(test_values_rise_between_exact_ends);
    RUN_TEST(test_zero_has_no_sign);
    RUN_TEST(test_grid_check_and_rows);
    RUN_TEST(test_default_is_the_first_case);
    RUN_TEST(test_row_order);
    RUN_TEST(test_row_of_a_large_grid);
    return UNITY_END();
}
