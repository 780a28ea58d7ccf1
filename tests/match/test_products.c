/* test_products.c - sums of products against sums added one by one. */
#include "match/products.h"

#include <math.h>

#include "tests/support/dice.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { LENGTH = 40 };

/* expect: by long doubles, one after the other. */
static void test_all_pairs(void)
{
    static double value[PRODUCTS_ROWS][LENGTH];
    const double *row[PRODUCTS_ROWS];
    struct dice dice = { 9 };
    for (size_t i = 0; i < PRODUCTS_ROWS; i++) {
        row[i] = value[i];
        for (size_t k = 0; k < LENGTH; k++)
            value[i][k] = dice_between(&dice, -1.0, 1.0);
    }
    for (size_t rows = 1; rows <= PRODUCTS_ROWS; rows++)
        for (size_t length = 0; length <= LENGTH; length += PRODUCTS_LANES) {
            double sum[PRODUCTS_ROWS * (PRODUCTS_ROWS + 1) / 2 + 1], *at = sum;
            sum[rows * (rows + 1) / 2] = 77.0;
            products(row, rows, length, sum);
            for (size_t i = 0; i < rows; i++)
                for (size_t j = 0; j <= i; j++) {
                    long double expect = 0.0L;
                    for (size_t k = 0; k < length; k++)
                        expect += (long double)value[i][k] * (long double)value[j][k];
                    TEST_ASSERT_DOUBLE_WITHIN(1e-14, (double)expect, *at++);
                }
            TEST_ASSERT_TRUE(*at == 77.0);
        }
}

/* The order of addition is part of the contract: the same bits by any vectors.  expect: 1 is
 * lost beside 1e16 where it is added to it, and is not where the two big ones meet first. */
static void test_order(void)
{
    double one[PRODUCTS_LANES] = { 1e16, 1.0, 0.0, 0.0, -1e16, 0.0, 0.0, 0.0 };
    double other[PRODUCTS_LANES] = { 1e16, 1.0, -1e16, 0.0, 0.0, 0.0, 0.0, 0.0 };
    double lost[PRODUCTS_LANES] = { 1e16, 0.0, 1.0, 0.0, 0.0, -1e16, 0.0, 0.0 };
    double weight[PRODUCTS_LANES] = { 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0 }, sum[3];
    const double *rows[2] = { one, weight };
    products(rows, 2, PRODUCTS_LANES, sum);
    TEST_ASSERT_TRUE(sum[1] == 1.0);
    rows[0] = other;
    products(rows, 2, PRODUCTS_LANES, sum);
    TEST_ASSERT_TRUE(sum[1] == 1.0);
    rows[0] = lost;
    products(rows, 2, PRODUCTS_LANES, sum);
    TEST_ASSERT_TRUE(sum[1] == 0.0);
}

/* However many rows are summed at once, each pair's sum has the same bits. */
static void test_rows_at_once(void)
{
    static double value[PRODUCTS_ROWS][LENGTH];
    const double *row[PRODUCTS_ROWS], *two[2];
    double sum[PRODUCTS_ROWS * (PRODUCTS_ROWS + 1) / 2], alone[3];
    struct dice dice = { 10 };
    for (size_t i = 0; i < PRODUCTS_ROWS; i++) {
        row[i] = value[i];
        for (size_t k = 0; k < LENGTH; k++)
            value[i][k] = dice_between(&dice, -1.0, 1.0);
    }
    for (size_t rows = 2; rows <= PRODUCTS_ROWS; rows++) {
        products(row, rows, LENGTH, sum);
        for (size_t i = 0; i < rows; i++)
            for (size_t j = 0; j < i; j++) {
                two[0] = row[j];
                two[1] = row[i];
                products(two, 2, LENGTH, alone);
                TEST_ASSERT_TRUE(sum[j * (j + 1) / 2 + j] == alone[0]);
                TEST_ASSERT_TRUE(sum[i * (i + 1) / 2 + j] == alone[1]);
                TEST_ASSERT_TRUE(sum[i * (i + 1) / 2 + i] == alone[2]);
            }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_pairs);
    RUN_TEST(test_order);
    RUN_TEST(test_rows_at_once);
    return UNITY_END();
}
