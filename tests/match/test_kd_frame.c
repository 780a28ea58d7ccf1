/* test_kd_frame.c - points in a frame are never further apart than they are, hardly nearer where
 * they lie on a small surface, and the same by any kind of vectors. */
#include "match/kd_frame.h"

#include <math.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

enum { DIMS = KD_TREE_MAX_DIMS, POINTS = 256, QUERIES = 200 };

static float point[POINTS][DIMS];

void setUp(void)
{
}

void tearDown(void)
{
}

static double distance(size_t dims, const float *x, const float *y)
{
    long double sum = 0.0L;
    for (size_t i = 0; i < dims; i++) {
        long double d = (long double)x[i] - (long double)y[i];
        sum += d * d;
    }
    return (double)sqrtl(sum);
}

/* Points of three parameters on a surface bent in all dimensions, somewhat off it by `noise`. */
static void make_points(struct dice *dice, size_t dims, double scale, double bend, double noise)
{
    memset(point, 0, sizeof point);
    for (size_t number = 0; number < POINTS; number++) {
        double u = dice_between(dice, -1, 1), v = dice_between(dice, -1, 1),
               w = dice_between(dice, -1, 1);
        for (size_t i = 0; i < dims; i++) {
            double k = (double)i + 1.0;
            double flat = u * sin(k) + v * cos(2.0 * k) + w * sin(3.0 * k);
            point[number][i] = (float)(scale * (0.5 + flat + bend * sin(k * (u + v * w)) +
                                                noise * dice_between(dice, -1, 1)));
        }
    }
}

static void make_frame(size_t dims, struct kd_frame *ret)
{
    kd_frame_make(dims, POINTS, point[0], DIMS, ret);
}

static const struct frame_case {
    const char *what;
    size_t dims;
    double scale, bend, noise;
} cases[] = {
    { "flat", 14, 1.0, 0.0, 0.0 },         { "bent", 14, 1.0, 0.1, 0.0 },
    { "a cloud", 16, 1.0, 0.1, 2.0 },      { "few dimensions", 3, 1.0, 0.3, 0.1 },
    { "one dimension", 1, 1.0, 0.1, 0.1 }, { "huge", 14, 1e14, 0.1, 0.1 },
    { "tiny", 14, 1e-30, 0.1, 0.1 },       { "all the same", 14, 0.0, 0.0, 0.0 },
};

static double framed_distance(const struct kd_frame *frame, const float *x, const float *y)
{
    float at_x[KD_FRAME_DIMS], at_y[KD_FRAME_DIMS];
    kd_frame_point(vectors_best(), frame, x, at_x);
    kd_frame_point(vectors_best(), frame, y, at_y);
    return distance(KD_FRAME_DIMS, at_x, at_y);
}

/* expect: the header's inequality, distances in long double. */
static void test_never_further_apart(void)
{
    struct dice dice = { 7 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct frame_case *c = &cases[i];
        struct kd_frame frame;
        make_points(&dice, c->dims, c->scale, c->bend, c->noise);
        make_frame(c->dims, &frame);
        for (int number = 0; number < QUERIES; number++) {
            float query[DIMS] = { 0.0f };
            double away = number % 2 == 0 ? 1e-3 : 3.0;
            const float *near = point[dice_below(&dice, POINTS)];
            const float *x = point[dice_below(&dice, POINTS)];
            for (size_t dim = 0; dim < c->dims; dim++)
                query[dim] =
                    (float)((double)near[dim] + c->scale * away * dice_between(&dice, -1, 1));
            double slack =
                0x1p-23 * (distance(DIMS, query, frame.centre) + distance(DIMS, x, frame.centre));
            TEST_ASSERT_TRUE_MESSAGE(framed_distance(&frame, query, x) <=
                                         distance(DIMS, query, x) * (1.0 + 0x1p-20) + slack,
                                     c->what);
        }
    }
}

/* Or it would be no use.  expect: three parameters and what they bend need no more directions than
 * there are; a point off the surface is as far from it as it is. */
static void test_surfaces_keep_distances(void)
{
    struct dice dice = { 11 };
    struct kd_frame frame;
    make_points(&dice, 14, 1.0, 0.001, 0.0);
    make_frame(14, &frame);
    for (size_t i = 1; i < POINTS; i++) {
        double own = distance(DIMS, point[i - 1], point[i]);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * own, own, framed_distance(&frame, point[i - 1], point[i]));
        float off[DIMS];
        memcpy(off, point[i], sizeof off);
        off[i % 14] += 1.0f;
        TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, framed_distance(&frame, off, point[i]));
    }
}

static void test_same_bits(void)
{
    struct dice dice = { 13 };
    struct kd_frame frame;
    make_points(&dice, 14, 1.0, 0.1, 0.5);
    make_frame(14, &frame);
    for (size_t i = 0; i < POINTS; i++)
        for (int kind = 0; kind < VECTORS_KINDS; kind++) {
            float expect[KD_FRAME_DIMS], got[KD_FRAME_DIMS];
            if (!vectors_has((enum vectors)kind))
                continue;
            kd_frame_point(VECTORS_PLAIN, &frame, point[i], expect);
            kd_frame_point((enum vectors)kind, &frame, point[i], got);
            TEST_ASSERT_EQUAL_MEMORY(expect, got, sizeof got);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_never_further_apart);
    RUN_TEST(test_surfaces_keep_distances);
    RUN_TEST(test_same_bits);
    return UNITY_END();
}
