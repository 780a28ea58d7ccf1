/* test_quantiles.c - against sorting. */
#include "cube/quantiles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unity.h>

void setUp(void)
{
}

void tearDown(void)
{
}

static struct quantiles q;

static const double shares[] = { 0.01, 0.5, 0.99, 1.0 };

static void find(const float *value, size_t n, size_t part)
{
    quantiles_begin(&q, shares, 4);
    for (size_t i = 0; i < n; i += part)
        quantiles_first(&q, value + i, n - i < part ? n - i : part);
    quantiles_between(&q);
    for (size_t i = 0; i < n; i += part)
        quantiles_second(&q, value + i, n - i < part ? n - i : part);
}

static int rising(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Many alike, many near each other, both signs, and NaN between them. */
static void test_against_sorting(void)
{
    enum { N = 5000 };
    static float value[N], sorted[N];
    uint32_t random = 1;
    for (size_t n = 1; n <= N; n += n < 20 ? 1 : 997) {
        size_t numbers = 0;
        for (size_t i = 0; i < n; i++) {
            random = random * 1664525u + 1013904223u;
            float x = (float)(int)(random >> 12 & 0xfff) / 4096.0f - 0.3f;
            value[i] = random >> 28 == 0 ? NAN : random >> 28 < 4 ? 0.25f : x * x * x;
            if (!isnan(value[i]))
                sorted[numbers++] = value[i];
        }
        qsort(sorted, numbers, sizeof *sorted, rising);
        find(value, n, 777);
        TEST_ASSERT_EQUAL_UINT64(numbers, q.count);
        for (size_t k = 0; k < 4 && numbers > 0; k++) {
            size_t rank = (size_t)ceil(shares[k] * (double)numbers);
            TEST_ASSERT_EQUAL_DOUBLE((double)sorted[rank > 0 ? rank - 1 : 0], quantiles_end(&q, k));
        }
    }
}

static float of_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* NaN whose upper half is that of an infinity, of either sign, next to what is a number: by sorting
 * -inf, 11 times -0, 11 times 0, inf. */
static void test_not_a_number(void)
{
    float value[24 + 23];
    for (size_t i = 0; i < 24 + 23; i++)
        value[i] = of_bits(i % 2 != 0 ? 0x7f800001u : 0xff80ffffu);
    for (size_t i = 0; i < 22; i++)
        value[2 * i + 1] = i < 11 ? 0.0f : -0.0f;
    value[0] = of_bits(0x7f800000u);
    value[24 + 22] = of_bits(0xff800000u);
    find(value, 24 + 23, 24 + 23);
    TEST_ASSERT_EQUAL_UINT64(24, q.count);
    TEST_ASSERT_EQUAL_DOUBLE(-(double)INFINITY, quantiles_end(&q, 0)); /* rank 1 of 24 */
    TEST_ASSERT_TRUE(quantiles_end(&q, 1) == 0.0 && signbit(quantiles_end(&q, 1)) != 0); /* 12 */
    TEST_ASSERT_EQUAL_DOUBLE((double)INFINITY, quantiles_end(&q, 2));
}

static void test_nothing(void)
{
    const float none[] = { NAN, NAN };
    find(none, 2, 2);
    TEST_ASSERT_TRUE(isnan(quantiles_end(&q, 1)));
    find(none, 0, 1);
    TEST_ASSERT_TRUE(isnan(quantiles_end(&q, 0)));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_against_sorting);
    RUN_TEST(test_not_a_number);
    RUN_TEST(test_nothing);
    return UNITY_END();
}
