/* test_front.c - who is beaten by none; and labels that do not lie on one another. */
#include <math.h>

#include "trial/front.h"
#include "trial/svg_labels.h"
#include "unity.h"

void setUp(void)
{
}
void tearDown(void)
{
}

static void test_front_of_a_few(void)
{
    static const double time[] = { 1, 2, 3, 3, 4, 5, 5, NAN, 0.1 };
    static const double error[] = { 9, 5, 6, 5, 4, 4, 1, 0.5, NAN };
    /* 2 is beaten by 1 in both; 3 as good as 1, but later; 5 as good as 4, but later. */
    static const bool expected[] = { true, true, false, false, true, false, true, false, false };
    bool front[9];
    trial_front(9, time, error, front);
    TEST_ASSERT_EQUAL_MEMORY(expected, front, sizeof front);
}

static void test_twins_are_both_on_it(void)
{
    static const double time[] = { 2, 2 }, error[] = { 3, 3 };
    bool front[2] = { false, false };
    trial_front(2, time, error, front);
    TEST_ASSERT_TRUE(front[0] && front[1]);
}

static void test_a_front_of_none(void)
{
    trial_front(0, NULL, NULL, NULL); /* touches nothing */
    TEST_PASS();
}

static void test_labels_keep_apart(void)
{
    struct svg_labels labels = { .inside = { 0, 0, 400, 300 } };
    double x, y;
    for (size_t i = 0; i < 6; i++)
        TEST_ASSERT_TRUE(svg_labels_place(&labels, 200, 150 + (double)i, 60, 12, true, &x, &y));
    TEST_ASSERT_EQUAL_size_t(6, labels.n);
    for (size_t i = 0; i < 6; i++) {
        const struct svg_box *a = &labels.taken[i];
        TEST_ASSERT_TRUE(a->left >= 0 && a->right <= 400 && a->top >= 0 && a->bottom <= 300);
        for (size_t k = 0; k < i; k++) {
            const struct svg_box *b = &labels.taken[k];
            TEST_ASSERT_TRUE(a->left >= b->right || b->left >= a->right || a->top >= b->bottom ||
                             b->top >= a->bottom);
        }
    }
}

static void test_a_label_that_need_not_be_gives_way(void)
{
    struct svg_labels labels = { .inside = { 0, 0, 400, 300 } };
    double x = -1, y = -1;
    svg_labels_take(&labels, (struct svg_box){ 0, 0, 400, 300 });
    TEST_ASSERT_FALSE(svg_labels_place(&labels, 200, 150, 60, 12, false, &x, &y));
    TEST_ASSERT_EQUAL_size_t(1, labels.n);
    TEST_ASSERT_EQUAL_DOUBLE(-1, x);
    TEST_ASSERT_TRUE(svg_labels_place(&labels, 200, 150, 60, 12, true, &x, &y));
}

/* Near the right edge a label goes to the left. */
static void test_labels_stay_inside(void)
{
    struct svg_labels labels = { .inside = { 0, 0, 400, 300 } };
    double x, y;
    TEST_ASSERT_TRUE(svg_labels_place(&labels, 395, 150, 60, 12, true, &x, &y));
    TEST_ASSERT_TRUE(x + 60 <= 400);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_front_of_a_few);
    RUN_TEST(test_twins_are_both_on_it);
    RUN_TEST(test_a_front_of_none);
    RUN_TEST(test_labels_keep_apart);
    RUN_TEST(test_a_label_that_need_not_be_gives_way);
    RUN_TEST(test_labels_stay_inside);
    return UNITY_END();
}
