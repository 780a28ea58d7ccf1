/* test_kd_tree_wide.c - wide instructions judge a group to the same bits as plain ones.
 *
 * The source is compiled into this test, to get at both. */
#include "match/kd_tree.c"

#include "tests/support/dice.h"
#include "unity.h"

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

static void test_same_bits(void)
{
    float low[KD_TREE_MAX_DIMS * WIDTH], high[KD_TREE_MAX_DIMS * WIDTH];
    float query[KD_TREE_MAX_DIMS], plain[WIDTH], wide[WIDTH];
    struct dice dice = { 20260722 };
    if (best_judge() == judge_plain)
        TEST_IGNORE_MESSAGE("this processor has no wide instructions");
    for (int i = 0; i < 20000; i++) {
        size_t dims = 1 + dice_below(&dice, KD_TREE_MAX_DIMS);
        bool points = dice_below(&dice, 2) == 0;
        for (size_t j = 0; j < dims * WIDTH; j++) {
            float a = any_float(&dice), b = any_float(&dice);
            low[j] = lower(a, b);
            high[j] = points ? low[j] : higher(a, b);
        }
        for (size_t j = 0; j < dims; j++)
            query[j] = any_float(&dice);
        judge_plain(dims, low, high, query, plain);
        best_judge()(dims, low, high, query, wide);
        TEST_ASSERT_EQUAL_MEMORY(plain, wide, sizeof plain);
    }
}

/* expect: by hand. */
static void test_sides(void)
{
    float low[2 * WIDTH] = { 0.0f }, high[2 * WIDTH] = { 0.0f }, query[2] = { 3.0f, -2.0f };
    float square[WIDTH];
    low[0] = 1.0f, high[0] = 2.0f; /* 1 beyond, and 2 below */
    low[1] = 2.0f, high[1] = 4.0f; /* within, and 2 below */
    low[2] = 5.0f, high[2] = 6.0f; /* 2 before, and within */
    low[WIDTH + 2] = -3.0f;
    best_judge()(2, low, high, query, square);
    TEST_ASSERT_EQUAL_FLOAT(5.0f, square[0]);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, square[1]);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, square[2]);
    TEST_ASSERT_EQUAL_FLOAT(13.0f, square[3]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_same_bits);
    RUN_TEST(test_sides);
    return UNITY_END();
}
