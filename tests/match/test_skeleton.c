/* test_skeleton.c - functions at all values of an axis from those at its nodes. */
#include "match/skeleton.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { VALUES = 45, STRIDE = SKELETON_STRIDE(VALUES), SAMPLES = 60 };

static double F[SAMPLES * STRIDE];

/* 0 .. 1 */
static double at(size_t i)
{
    return (double)i / (VALUES - 1);
}

static double power(double x, size_t k)
{
    return k == 0 ? 1.0 : x * power(x, k - 1);
}

/* 1/(x+s) for s from 0.01 to 10 */
static double cauchy(double x, double k)
{
    return 0.01 / (x + 0.01 * pow(1000.0, k));
}

static void fill_cauchy(void)
{
    memset(F, 0, sizeof F);
    for (size_t k = 0; k < SAMPLES; k++)
        for (size_t i = 0; i < VALUES; i++)
            F[k * STRIDE + i] = cauchy(at(i), (double)k / (SAMPLES - 1));
}

/* expect: a polynomial of degree 4 by its values at 5 nodes, whatever they are, and no 6th. */
static void test_polynomials(void)
{
    struct skeleton s;
    memset(F, 0, sizeof F);
    for (size_t k = 0; k < SAMPLES; k++)
        for (size_t i = 0; i < VALUES; i++)
            F[k * STRIDE + i] = power(at(i), k % 5) + 0.1 * (double)k;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, skeleton_init(VALUES, SAMPLES, F, 1e-13, vectors_best(), &s));
    TEST_ASSERT_EQUAL_size_t(5, s.nodes);
    for (size_t i = 0; i < VALUES; i++) {
        const double *w = s.weight + i * SKELETON_MAX;
        for (size_t k = 0; k < 5; k++) {
            double sum = 0.0;
            for (size_t m = 0; m < s.nodes; m++)
                sum += w[m] * power(at(s.node[m]), k);
            TEST_ASSERT_DOUBLE_WITHIN(1e-13, power(at(i), k), sum);
        }
        /* Lagrange's polynomials of these nodes. */
        for (size_t m = 0; m < s.nodes; m++) {
            double product = 1.0;
            for (size_t j = 0; j < s.nodes; j++)
                if (j != m)
                    product *= (at(i) - at(s.node[j])) / (at(s.node[m]) - at(s.node[j]));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, product, w[m]);
        }
    }
    skeleton_done(&s);
    TEST_ASSERT_NULL(s.weight);
}

/* Property: functions between the samples follow as those do, and nodes are themselves. */
static void test_between_the_samples(void)
{
    struct skeleton s;
    fill_cauchy();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, skeleton_init(VALUES, SAMPLES, F, 3e-15, vectors_best(), &s));
    TEST_ASSERT_TRUE(s.nodes >= 8 && s.nodes <= 20);
    for (size_t k = 0; k < 977; k++)
        for (size_t i = 0; i < VALUES; i++) {
            double sum = 0.0;
            for (size_t m = 0; m < s.nodes; m++)
                sum += s.weight[i * SKELETON_MAX + m] * cauchy(at(s.node[m]), (double)k / 976.0);
            TEST_ASSERT_DOUBLE_WITHIN(2e-14, cauchy(at(i), (double)k / 976.0), sum);
        }
    for (size_t m = 0; m < s.nodes; m++)
        for (size_t j = 0; j < s.nodes; j++)
            TEST_ASSERT_EQUAL_DOUBLE(j == m ? 1.0 : 0.0, s.weight[s.node[m] * SKELETON_MAX + j]);
    skeleton_done(&s);
}

static void test_same_by_any_vectors(void)
{
    struct skeleton of[VECTORS_KINDS] = { { .n = 0 } };
    for (enum vectors v = VECTORS_WITH_AVX2; v < VECTORS_KINDS; v++) {
        if (!vectors_has(v))
            continue;
        fill_cauchy();
        TEST_ASSERT_EQUAL_INT(STATUS_OK, skeleton_init(VALUES, SAMPLES, F, 3e-15, v, &of[v]));
    }
    const struct skeleton *x = &of[VECTORS_WITH_AVX2], *y = &of[VECTORS_WITH_AVX512];
    if (x->n > 0 && y->n > 0) {
        TEST_ASSERT_EQUAL_MEMORY(x->node, y->node, sizeof x->node);
        TEST_ASSERT_EQUAL_MEMORY(x->weight, y->weight, sizeof *x->weight * VALUES * SKELETON_MAX);
    }
    for (enum vectors v = VECTORS_PLAIN; v < VECTORS_KINDS; v++)
        skeleton_done(&of[v]);
}

/* As many functions as values, each of one value only: nothing follows from anything. */
static void test_refuses_what_does_not_follow(void)
{
    struct skeleton s;
    memset(F, 0, sizeof F);
    for (size_t i = 0; i < VALUES; i++)
        F[i * STRIDE + i] = 1.0;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                          skeleton_init(VALUES, SAMPLES, F, 1e-13, vectors_best(), &s));
    TEST_ASSERT_NULL(s.weight);
    skeleton_done(&s);
}

static void test_one_value(void)
{
    struct skeleton s;
    double one[2][SKELETON_STRIDE(1)] = { { 3.0 }, { 4.0 } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, skeleton_init(1, 2, one[0], 1e-13, vectors_best(), &s));
    TEST_ASSERT_EQUAL_size_t(1, s.nodes);
    TEST_ASSERT_EQUAL_size_t(0, s.node[0]);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, s.weight[0]);
    skeleton_done(&s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_polynomials);
    RUN_TEST(test_between_the_samples);
    RUN_TEST(test_same_by_any_vectors);
    RUN_TEST(test_refuses_what_does_not_follow);
    RUN_TEST(test_one_value);
    return UNITY_END();
}
