/* test_stability.c - every study of `make stability` over a part of its cases, and that a
 * study can fail. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/stability/levels.h"
#include "tests/stability/rooms.h"
#include "tests/stability/whole.h"
#include "tests/support/folder.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
    wide_release(0);
}

enum { EVERY = 41 }; /* a prime: no axis is met at one value only */

static void test_every_study_meets_its_bar(void)
{
    for (size_t i = 0; i < study_room_count; i++) {
        for (size_t j = 0; j < study_rooms[i]->n; j++) {
            const struct study *s = &study_rooms[i]->studies[j];
            struct verdict v = study_run(s, EVERY, NULL);
            char what[256];
            snprintf(what, sizeof what, "%s: %g of %g ulp, %s %.17g for %.17g; twin %g bits",
                     s->name, v.judged, s->bar, s->output[v.output], v.ours, v.exact, v.twin_bits);
            TEST_ASSERT_TRUE_MESSAGE(v.met, what);
            TEST_ASSERT_GREATER_THAN_MESSAGE(0, v.cases - v.refused, s->name);
        }
    }
}

/* ---- the judgement itself, on functions whose errors and conditions are known ------ */

static void one_to_two(struct cases *c)
{
    for (int i = 0; i < 64; i++) {
        double x = 1.0 + i / 64.0;
        cases_add(c, &x);
    }
}

static void exponential(const wide *x, wide *y)
{
    y[0] = w_exp(x[0]);
}

static bool exp_right(const double *x, double *y)
{
    y[0] = exp(x[0]);
    return true;
}

static bool exp_20_ulp_off(const double *x, double *y)
{
    y[0] = exp(x[0]) * (1.0 + 20.0 * 0x1p-52);
    return true;
}

static bool exp_of_nan(const double *x, double *y)
{
    y[0] = x[0] > 1.5 ? (double)NAN : exp(x[0]);
    return true;
}

static bool exp_refused(const double *x, double *y)
{
    (void)x;
    (void)y;
    return false;
}

/* x - 1 at 1 + 2^-40: condition 2^40, and the bits lost before the subtraction show. */
static void near_one(struct cases *c)
{
    double x = 1.0 + 0x1p-40;
    cases_add(c, &x);
}

static void less_one(const wide *x, wide *y)
{
    y[0] = w_sub(x[0], w_int(1));
}

static bool less_one_3_ulp_off(const double *x, double *y)
{
    y[0] = (x[0] + 3.0 * 0x1p-52) - 1.0;
    return true;
}

static struct verdict verdict_on(bool (*ours)(const double *, double *),
                                 void (*cases)(struct cases *), void (*twin)(const wide *, wide *))
{
    struct study s = { "known", { "x" }, 1, { "y" }, 8.0, ours, twin, cases, NULL };
    return study_run(&s, 1, NULL);
}

static void test_a_right_function_is_met(void)
{
    struct verdict v = verdict_on(exp_right, one_to_two, exponential);
    TEST_ASSERT_TRUE(v.met);
    TEST_ASSERT_EQUAL_size_t(64, v.cases);
    TEST_ASSERT_TRUE(v.most_ulp <= 1.0); /* what glibc says of its exp */
}

static void test_an_error_is_counted_in_ulps_and_divided_by_the_condition(void)
{
    struct verdict v = verdict_on(exp_20_ulp_off, one_to_two, exponential);
    TEST_ASSERT_FALSE(v.met);
    /* 20 parts in 2^52 are 20 to 40 units of the last place; the condition of e^x is x. */
    TEST_ASSERT_TRUE(v.most_ulp > 19.0 && v.most_ulp < 41.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, v.x[0], v.condition);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, v.ulp / v.condition, v.judged);
}

static void test_cancellation_is_the_inputs_fault(void)
{
    struct verdict v = verdict_on(less_one_3_ulp_off, near_one, less_one);
    TEST_ASSERT_TRUE(v.met);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 0x1p40, v.condition);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3.0, v.judged);
}

static void test_no_number_is_no_answer(void)
{
    TEST_ASSERT_FALSE(verdict_on(exp_of_nan, one_to_two, exponential).met);
    TEST_ASSERT_FALSE(verdict_on(exp_refused, one_to_two, exponential).met);
}

/* ---- two builds --------------------------------------------------------------------- */

static void test_ulps_between_two_doubles(void)
{
    TEST_ASSERT_EQUAL_DOUBLE(0.0, levels_ulp(0.7, 0.7));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, levels_ulp(0.7, nextafter(0.7, 1.0)));
    TEST_ASSERT_EQUAL_DOUBLE(3.0, levels_ulp(-1.5 - 3.0 * 0x1p-52, -1.5));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, levels_ulp(NAN, NAN));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, levels_ulp(1e-301, -1e-310));
    TEST_ASSERT_TRUE(isinf(levels_ulp(NAN, 1.0)));
    TEST_ASSERT_TRUE(isinf(levels_ulp(INFINITY, 1.0)));
}

/* Else a difference between builds would say nothing. */
static void test_what_has_no_twin_is_the_same_twice_and_not_refused(void)
{
    for (size_t i = 0; i < whole_count; i++) {
        uint64_t n = 0, again = 0;
        double *x = whole_list[i].outputs(&n), *y = whole_list[i].outputs(&again);
        TEST_ASSERT_NOT_NULL_MESSAGE(x, whole_list[i].name);
        TEST_ASSERT_NOT_NULL_MESSAGE(y, whole_list[i].name);
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(n, again, whole_list[i].name);
        TEST_ASSERT_TRUE_MESSAGE(n > 1000, whole_list[i].name);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(x, y, n * sizeof *x, whole_list[i].name);
        for (uint64_t k = 0; k < n; k++)
            TEST_ASSERT_FALSE_MESSAGE(isnan(x[k]), whole_list[i].name);
        free(x);
        free(y);
    }
}

/* The next double after the last output that is not 0. */
static void change_last(unsigned char *bytes, size_t size)
{
    double last = 0.0;
    while (fabs(last) < 1e-300) {
        TEST_ASSERT_TRUE(size >= sizeof last);
        size -= sizeof last;
        memcpy(&last, bytes + size, sizeof last);
    }
    last = nextafter(last, INFINITY);
    memcpy(bytes + size, &last, sizeof last);
}

static void test_one_bit_of_difference_is_found(void)
{
    char folder[FOLDER_PATH_SIZE], a[FOLDER_PATH_SIZE], b[FOLDER_PATH_SIZE];
    size_t size = 0;
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "a", a);
    folder_path(folder, "b", b);
    TEST_ASSERT_EQUAL_INT(0, levels_write(a));
    unsigned char *bytes = file_bytes(a, &size);
    TEST_ASSERT_NOT_NULL(bytes);
    TEST_ASSERT_TRUE(file_write(b, bytes, size));
    TEST_ASSERT_EQUAL_INT(0, levels_compare(a, b));
    change_last(bytes, size);
    TEST_ASSERT_TRUE(file_write(b, bytes, size));
    TEST_ASSERT_EQUAL_INT(1, levels_compare(a, b));
    TEST_ASSERT_TRUE(file_write(b, bytes, size - sizeof(double)));
    TEST_ASSERT_EQUAL_INT(1, levels_compare(a, b)); /* shorter */
    free(bytes);
    folder_remove(folder);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_study_meets_its_bar);
    RUN_TEST(test_a_right_function_is_met);
    RUN_TEST(test_an_error_is_counted_in_ulps_and_divided_by_the_condition);
    RUN_TEST(test_cancellation_is_the_inputs_fault);
    RUN_TEST(test_no_number_is_no_answer);
    RUN_TEST(test_ulps_between_two_doubles);
    RUN_TEST(test_what_has_no_twin_is_the_same_twice_and_not_refused);
    RUN_TEST(test_one_bit_of_difference_is_found);
    int failed = UNITY_END();
    wide_done();
    return failed;
}
