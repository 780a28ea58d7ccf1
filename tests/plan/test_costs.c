/* test_costs.c - costs as text: read back as written, refused with the line of the fault. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plan/costs.h"
#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

#define HEADER \
    "model,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,Bm_transport,Ch_transport," \
    "dE00,rms_R,bytes\n"
#define LINE "two-layer,50400,spectrum,three,1,30,38.5,.002,0.05,0.0023,,,,0.2,0.004,12300000\n"

static struct costs costs, again;

static void test_what_each_column_is(void)
{
    size_t line = 99;
    TEST_ASSERT_EQUAL_INT(
        STATUS_OK, costs_parse("# machine: a lathe\n# and more\n\n" HEADER LINE, &costs, &line));
    TEST_ASSERT_EQUAL_size_t(1, costs.n);
    TEST_ASSERT_EQUAL_STRING("a lathe", costs.machine);
    TEST_ASSERT_FALSE(costs.counted);
    const struct cost *c = &costs.cost[0];
    TEST_ASSERT_EQUAL_PTR(model_find("two-layer"), c->model);
    TEST_ASSERT_EQUAL_size_t(50400, c->rows);
    TEST_ASSERT_EQUAL_INT(MATCH_SPECTRUM, c->by);
    TEST_ASSERT_EQUAL_INT(REFINE_THREE, c->refine);
    TEST_ASSERT_TRUE(c->interval);
    TEST_ASSERT_EQUAL_DOUBLE(30.0, c->us);
    TEST_ASSERT_EQUAL_DOUBLE(38.5, c->us_p95);
    TEST_ASSERT_EQUAL_DOUBLE(0.002, c->rmse[0]);
    TEST_ASSERT_EQUAL_DOUBLE(0.05, c->rmse[1]);
    TEST_ASSERT_EQUAL_DOUBLE(0.0023, c->rmse[2]);
    for (size_t i = 0; i < 3; i++)
        TEST_ASSERT_DOUBLE_IS_NAN(c->rmse_transport[i]);
    TEST_ASSERT_EQUAL_DOUBLE(0.2, c->dE00);
    TEST_ASSERT_EQUAL_DOUBLE(0.004, c->rms_R);
    TEST_ASSERT_EQUAL_DOUBLE(12300000.0, c->bytes);
}

static const struct bad_case {
    const char *what, *text;
    size_t line;
} bad_cases[] = {
    { "nothing", "", 1 },
    { "no cost", "# machine: x\n" HEADER, 3 },
    { "cut short", "# costs: 3\n" HEADER LINE LINE, 5 },
    { "cut short after its head", "# machine: x\n# costs: 3\n" HEADER, 4 },
    { "more than it says", "# costs: 1\n" HEADER LINE LINE, 4 },
    { "a count that is no number", "# costs: many\n" HEADER LINE, 1 },
    { "no names", LINE, 1 },
    { "other names", "model,rows\n" LINE, 1 },
    { "a field too few", HEADER LINE "two-layer,50400\n", 3 },
    { "a field too many",
      HEADER "two-layer,1,spectrum,three,1,30,38,0.1,0.1,0.1,,,,0.2,0.004,1,1\n", 2 },
    { "no such model", HEADER "three-layer,1,spectrum,three,1,1,1,,,,,,,,,1\n", 2 },
    { "no such way", HEADER "two-layer,1,smell,three,1,1,1,,,,,,,,,1\n", 2 },
    { "no such fit", HEADER "two-layer,1,rgb,four,1,1,1,,,,,,,,,1\n", 2 },
    { "a fit without its name", HEADER "two-layer,1,rgb,,1,1,1,,,,,,,,,1\n", 2 },
    { "interval neither 0 nor 1", HEADER "two-layer,1,rgb,three,yes,1,1,,,,,,,,,1\n", 2 },
    { "no time", HEADER "two-layer,1,rgb,three,1,,1,,,,,,,,,1\n", 2 },
    { "a time below 0", HEADER "two-layer,1,rgb,three,1,-1,1,,,,,,,,,1\n", 2 },
    { "an error that is no number", HEADER "two-layer,1,rgb,three,1,1,1,nan,,,,,,,,1\n", 2 },
    { "rows that are no number", HEADER "two-layer,-1,rgb,three,1,1,1,,,,,,,,,1\n", 2 },
};

static void test_refuses_with_the_line(void)
{
    for (size_t i = 0; i < sizeof bad_cases / sizeof *bad_cases; i++) {
        const struct bad_case *c = &bad_cases[i];
        size_t line = 99;
        costs.n = 77;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT, costs_parse(c->text, &costs, &line), c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->line, line, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(77, costs.n, "untouched");
    }
}

static void test_refuses_more_than_there_is_room_for(void)
{
    static char text[sizeof HEADER + (COSTS_MAX + 1) * sizeof LINE];
    size_t line = 0;
    strcpy(text, HEADER);
    for (size_t i = 0; i < COSTS_MAX; i++)
        strcat(text, LINE);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_parse(text, &costs, &line));
    strcat(text, LINE);
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_parse(text, &costs, &line));
    TEST_ASSERT_EQUAL_size_t(COSTS_MAX + 2, line);
}

static void test_a_line_without_end_is_refused(void)
{
    static char text[5000];
    size_t line = 0;
    memset(text, 'x', sizeof text - 1);
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_parse(text, &costs, &line));
    TEST_ASSERT_EQUAL_size_t(1, line);
}

/* What bench writes is what the planner reads: same names, same blanks, 4 digits. */
static void test_reads_back_as_written(void)
{
    char *text = NULL;
    size_t size = 0, line = 0;
    const struct costs *builtin = costs_builtin();
    FILE *stream = open_memstream(&text, &size);
    TEST_ASSERT_NOT_NULL(stream);
    costs_print(stream, builtin);
    fclose(stream);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_parse(text, &again, &line));
    TEST_ASSERT_EQUAL_size_t(builtin->n, again.n);
    TEST_ASSERT_TRUE(again.counted);
    TEST_ASSERT_EQUAL_STRING(builtin->machine, again.machine);
    for (size_t i = 0; i < again.n; i++) {
        const struct cost *a = &builtin->cost[i], *b = &again.cost[i];
        TEST_ASSERT_EQUAL_PTR(a->model, b->model);
        TEST_ASSERT_EQUAL_size_t(a->rows, b->rows);
        TEST_ASSERT_EQUAL_INT(a->by, b->by);
        TEST_ASSERT_EQUAL_INT(a->refine, b->refine);
        TEST_ASSERT_EQUAL_INT(a->interval, b->interval);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * a->us, a->us, b->us);
        TEST_ASSERT_EQUAL_DOUBLE(a->bytes, b->bytes);
        for (size_t k = 0; k < 3; k++) {
            TEST_ASSERT_EQUAL_INT(isnan(a->rmse[k]), isnan(b->rmse[k]));
            TEST_ASSERT_EQUAL_INT(isnan(a->rmse_transport[k]), isnan(b->rmse_transport[k]));
        }
    }
    free(text);
}

/* What the planner cannot do without: every row of it is a way that there is. */
static void test_the_builtin_is_whole(void)
{
    const struct costs *builtin = costs_builtin();
    bool nearest = false, closed = false, interval = false;
    TEST_ASSERT_EQUAL_PTR(builtin, costs_builtin());
    for (size_t i = 0; i < builtin->n; i++) {
        const struct cost *c = &builtin->cost[i];
        TEST_ASSERT_TRUE(c->us > 0.0 && c->us_p95 >= c->us && c->bytes > 0.0);
        TEST_ASSERT_TRUE(c->rows > 0 || c->by == MATCH_SPECTRUM);
        TEST_ASSERT_TRUE(c->refine != REFINE_NOT || !c->interval);
        nearest = nearest || (c->rows > 0 && c->refine == REFINE_NOT);
        closed = closed || (c->rows == 0 && c->refine == REFINE_THREE);
        interval = interval || c->interval;
    }
    TEST_ASSERT_TRUE(nearest && closed && interval);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_each_column_is);
    RUN_TEST(test_refuses_with_the_line);
    RUN_TEST(test_refuses_more_than_there_is_room_for);
    RUN_TEST(test_a_line_without_end_is_refused);
    RUN_TEST(test_reads_back_as_written);
    RUN_TEST(test_the_builtin_is_whole);
    return UNITY_END();
}
