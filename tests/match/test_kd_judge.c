/* test_kd_judge.c - every kind of vectors judges a group to the same keys, and they are right. */
#include "match/kd_judge.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "match/kd_tree.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { WIDTH = KD_TREE_WIDTH };

void setUp(void)
{
}

void tearDown(void)
{
}

/* Values that a comparison or a sum could stumble over, and any others. */
static float any_float(struct dice *dice)
{
    static const float edges[] = { 0.0f,     -0.0f,     1.0f,  -1.0f,  FLT_MIN,
                                   -FLT_MIN, 0x1p-149f, 1e15f, -1e15f, 0.1f };
    size_t i = dice_below(dice, 20);
    return i < sizeof edges / sizeof *edges ? edges[i] : (float)dice_between(dice, -2.0, 2.0);
}

struct group {
    size_t dims;
    float low[KD_TREE_MAX_DIMS * WIDTH], high[KD_TREE_MAX_DIMS * WIDTH];
    float query[KD_TREE_MAX_DIMS];
};

static void make_group(struct dice *dice, struct group *ret)
{
    bool points = dice_below(dice, 2) == 0;
    ret->dims = 1 + dice_below(dice, KD_TREE_MAX_DIMS);
    for (size_t i = 0; i < ret->dims * WIDTH; i++) {
        float a = any_float(dice), b = any_float(dice);
        ret->low[i] = a < b ? a : b;
        ret->high[i] = points ? ret->low[i] : (a < b ? b : a);
    }
    for (size_t i = 0; i < ret->dims; i++)
        ret->query[i] = any_float(dice);
}

/* expect: qsort(). */
static int compare_keys(const void *a, const void *b)
{
    int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

/* Each is the least of those above the one before; then there is none. */
static void assert_in_order(const struct kd_judge *judge, const int32_t key[WIDTH])
{
    int32_t sorted[WIDTH], after = KD_KEY_BEFORE;
    memcpy(sorted, key, sizeof sorted);
    qsort(sorted, WIDTH, sizeof *sorted, compare_keys);
    for (size_t i = 0; i < WIDTH; i++) {
        after = judge->least(key, after);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(sorted[i], after, judge->name);
    }
    TEST_ASSERT_EQUAL_INT32_MESSAGE(KD_KEY_NONE, judge->least(key, after), judge->name);
}

static void test_same_bits(void)
{
    struct dice dice = { 20260722 };
    const struct kd_judge *plain = kd_judge_of(VECTORS_PLAIN);
    if (vectors_best() == VECTORS_PLAIN)
        TEST_IGNORE_MESSAGE("this processor has no wide instructions");
    for (int number = 0; number < 20000; number++) {
        static struct group g;
        int32_t expect[WIDTH], key[WIDTH];
        make_group(&dice, &g);
        int32_t least = plain->group(g.dims, g.low, g.high, g.query, expect);
        for (int kind = 0; kind < VECTORS_KINDS; kind++) {
            if (!vectors_has((enum vectors)kind))
                continue;
            const struct kd_judge *judge = kd_judge_of((enum vectors)kind);
            TEST_ASSERT_EQUAL_INT32_MESSAGE(
                least, judge->group(g.dims, g.low, g.high, g.query, key), judge->name);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect, key, sizeof key, judge->name);
            assert_in_order(judge, key);
        }
    }
}

/* expect: squares in long double; a key says its entry's number and at most 2^-19 and the rounding
 * of a sum of floats less than the square. */
static void test_keys_are_squares(void)
{
    struct dice dice = { 20260723 };
    for (int number = 0; number < 5000; number++) {
        static struct group g;
        int32_t key[WIDTH], least = INT32_MAX;
        make_group(&dice, &g);
        int32_t told = kd_judge_of(vectors_best())->group(g.dims, g.low, g.high, g.query, key);
        for (int32_t i = 0; i < WIDTH; i++) {
            long double sum = 0.0L;
            for (size_t dim = 0; dim < g.dims; dim++) {
                long double q = (long double)g.query[dim];
                long double below = (long double)g.low[dim * WIDTH + (size_t)i] - q;
                long double above = q - (long double)g.high[dim * WIDTH + (size_t)i];
                long double outside = below > above ? below : above;
                sum += outside > 0.0L ? outside * outside : 0.0L;
            }
            float square = (float)sum;
            TEST_ASSERT_EQUAL_INT32(i, key[i] & KD_KEY_NUMBER);
            TEST_ASSERT_TRUE(key[i] <= kd_key_limit(square * (1.0f + 2e-6f) + 1e-43f));
            TEST_ASSERT_TRUE(key[i] >= (kd_key_limit(square * (1.0f - 4e-6f)) & ~KD_KEY_NUMBER) ||
                             square < 2.0f * FLT_MIN);
            least = key[i] < least ? key[i] : least;
        }
        TEST_ASSERT_EQUAL_INT32(least, told);
    }
}

/* expect: by hand. */
static void test_sides(void)
{
    float low[2 * WIDTH] = { 0.0f }, high[2 * WIDTH] = { 0.0f }, query[2] = { 3.0f, -2.0f };
    static const float expect[4] = { 5.0f, 4.0f, 4.0f, 13.0f };
    int32_t key[WIDTH];
    low[0] = 1.0f, high[0] = 2.0f; /* 1 beyond, and 2 below */
    low[1] = 2.0f, high[1] = 4.0f; /* within, and 2 below */
    low[2] = 5.0f, high[2] = 6.0f; /* 2 before, and within */
    low[WIDTH + 2] = -3.0f;
    TEST_ASSERT_EQUAL_INT32(1, kd_judge_of(vectors_best())->group(2, low, high, query, key) &
                                   KD_KEY_NUMBER);
    for (int32_t i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_INT32((kd_key_limit(expect[i]) & ~KD_KEY_NUMBER) | i, key[i]);
}

static void test_limits(void)
{
    TEST_ASSERT_TRUE(kd_key_limit((float)INFINITY) < KD_KEY_NONE);
    TEST_ASSERT_TRUE(kd_key_limit(0.0f) == KD_KEY_NUMBER);
    TEST_ASSERT_TRUE(kd_key_limit(1.0f) < kd_key_limit(1.0f + 4.0f * FLT_EPSILON * 8.0f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_same_bits);
    RUN_TEST(test_keys_are_squares);
    RUN_TEST(test_sides);
    RUN_TEST(test_limits);
    return UNITY_END();
}
