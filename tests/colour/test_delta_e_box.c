/* test_delta_e_box.c - bounds against delta_e_2000() of colours in the box: chance, corners, the
 * point nearest in Lab, and where CIEDE2000 has its edges.  None may be above. */
#include "colour/delta_e_box.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colour/delta_e.h"
#include "tests/support/dice.h"
#include "tests/support/sharma_pairs.h"
#include "unity.h"

enum { PAIRS = sizeof sharma_cases / sizeof *sharma_cases, POINTS = 12 };

void setUp(void)
{
}
void tearDown(void)
{
}

struct boxes {
    float low[3][DELTA_E_BOXES], high[3][DELTA_E_BOXES], bound[DELTA_E_BOXES];
};

/* Coordinates from low to high, kept to what bounds are for; a box that would be turned inside
 * out is a point. */
static void set_box(struct boxes *b, int i, const double low[3], const double high[3])
{
    for (int k = 0; k < 3; k++) {
        double least = k == 0 ? DELTA_E_LIGHTNESS_MIN : -DELTA_E_BOX_MAX;
        double most = k == 0 ? DELTA_E_LIGHTNESS_MAX : DELTA_E_BOX_MAX;
        b->low[k][i] = (float)fmin(fmax(low[k], least), most);
        b->high[k][i] = fmaxf((float)fmin(fmax(high[k], least), most), b->low[k][i]);
    }
}

static double extent_of(const struct boxes *b)
{
    double extent = 0.0;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < DELTA_E_BOXES; i++)
            extent = fmax(extent, fmax(fabs((double)b->low[k][i]), fabs((double)b->high[k][i])));
    return extent;
}

/* A point of box i: a corner, the nearest to p, one on an axis or a diagonal of hues, or any. */
static void choose_point(struct dice *dice, const struct boxes *b, int i, const double p[3],
                         int kind, double point[3])
{
    for (int k = 0; k < 3; k++) {
        double low = (double)b->low[k][i], high = (double)b->high[k][i];
        double share = dice_between(dice, 0.0, 1.0);
        if (kind < 4)
            share = share < 0.5 ? 0.0 : 1.0;
        point[k] = low + share * (high - low);
        if (kind == 4)
            point[k] = fmin(fmax(p[k], low), high);
        if (kind == 5 && k > 0)
            point[k] = fmin(fmax(0.0, low), high);
        if (kind == 6 && k > 0) /* opposite */
            point[k] = fmin(fmax(-p[k] * share, low), high);
        /* Half of a float's rounding may have brought the corner inwards. */
        if (kind == 7)
            point[k] = share < 0.5 ? low - 0x1p-24 * fabs(low) : high + 0x1p-24 * fabs(high);
    }
    point[0] = fmin(fmax(point[0], DELTA_E_LIGHTNESS_MIN), DELTA_E_LIGHTNESS_MAX);
}

static void assert_below(struct dice *dice, const double p[3], struct boxes *b, const char *what)
{
    struct delta_e_box q;
    TEST_ASSERT_TRUE(delta_e_box_init(p, extent_of(b), &q));
    delta_e_box_bound(&q, &b->low[0][0], &b->high[0][0], b->bound);
    for (int i = 0; i < DELTA_E_BOXES; i++)
        for (int kind = 0; kind < POINTS; kind++) {
            double point[3];
            choose_point(dice, b, i, p, kind, point);
            double d = delta_e_2000(p, point);
            if ((double)b->bound[i] <= d * d)
                continue;
            char text[256];
            snprintf(text, sizeof text,
                     "%s: %.9g from %.17g %.17g %.17g to %.17g %.17g %.17g, box at most %.9g wide",
                     what, sqrt((double)b->bound[i]), p[0], p[1], p[2], point[0], point[1],
                     point[2], (double)(b->high[1][i] - b->low[1][i]));
            TEST_ASSERT_TRUE_MESSAGE((double)b->bound[i] <= d * d, text);
        }
}

/* ---- chance -----------------------------------------------------------------------------------
 */

static const struct place_case {
    const char *what;
    double a, b, spread; /* colours about (a, b), and boxes about them */
    double most_log;     /* of the distance of boxes, powers of 10 */
} place_cases[] = {
    { "skin", 9.0, 15.0, 9.0, 1.0 },     { "anywhere", 0.0, 0.0, 130.0, 2.2 },
    { "near grey", 0.0, 0.0, 5.0, 1.0 }, { "grey to the last digits", 0.0, 0.0, 1e-5, -2.0 },
    { "blue", 5.0, -50.0, 40.0, 1.5 },   { "hue 0", 30.0, 0.0, 3.0, 1.0 },
    { "hue 180", -30.0, 0.0, 3.0, 1.6 }, { "far outside", 0.0, 0.0, 1000.0, 3.0 },
};

static void ask_place(const struct place_case *c, struct dice *dice)
{
    struct boxes b;
    double p[3] = { dice_between(dice, 0.0, 100.0), c->a + dice_between(dice, -1, 1) * c->spread,
                    c->b + dice_between(dice, -1, 1) * c->spread };
    uint64_t kind = dice_below(dice, 12);
    if (kind == 0)
        p[1] = p[2] = 0.0;
    if (kind == 1)
        p[1 + dice_below(dice, 2)] = 0.0;
    double size = kind < 5 ? 0.0 : pow(10.0, dice_between(dice, -4.0, c->most_log));
    for (int i = 0; i < DELTA_E_BOXES; i++) {
        double low[3], high[3], far = pow(10.0, dice_between(dice, -4.0, c->most_log));
        for (int k = 0; k < 3; k++) {
            double middle = p[k] + dice_between(dice, -far, far);
            if (i == 0 && k > 0) /* around grey */
                middle = 0.0;
            if (i == 1 && k > 0) /* the other side of it */
                middle = -p[k];
            double wide = size * dice_between(dice, 0.0, 1.0);
            low[k] = middle - wide;
            high[k] = middle + wide;
        }
        set_box(&b, i, low, high);
    }
    p[0] = fmin(fmax(p[0], 0.0), 100.0);
    p[1] = fmin(fmax(p[1], -DELTA_E_BOX_MAX), DELTA_E_BOX_MAX);
    p[2] = fmin(fmax(p[2], -DELTA_E_BOX_MAX), DELTA_E_BOX_MAX);
    assert_below(dice, p, &b, c->what);
}

/* 8 places x 3 000 x 16 boxes x 12 colours: 4.6 million; SKINSPEC_BOXES times as many. */
static void test_never_above(void)
{
    const char *times = getenv("SKINSPEC_BOXES");
    long rounds = 3000 * (times != NULL ? strtol(times, NULL, 10) : 1);
    struct dice dice = { 21 };
    for (size_t i = 0; i < sizeof place_cases / sizeof *place_cases; i++)
        for (long round = 0; round < rounds; round++)
            ask_place(&place_cases[i], &dice);
}

/* The published pairs as points, and boxes just about them. */
static void test_sharma_pairs(void)
{
    struct dice dice = { 22 };
    for (size_t n = 0; n < 2 * PAIRS; n++) {
        const struct sharma_case *c = &sharma_cases[n / 2];
        const double *p = n % 2 == 0 ? c->Lab1 : c->Lab2, *q = n % 2 == 0 ? c->Lab2 : c->Lab1;
        struct boxes b;
        for (int i = 0; i < DELTA_E_BOXES; i++) {
            double wide = i == 0 ? 0.0 : pow(10.0, i - 10.0), low[3], high[3];
            for (int k = 0; k < 3; k++) {
                low[k] = q[k] - wide * dice_between(&dice, 0.0, 1.0);
                high[k] = q[k] + wide * dice_between(&dice, 0.0, 1.0);
            }
            set_box(&b, i, low, high);
        }
        assert_below(&dice, p, &b, "pair");
        for (int i = 0; i < DELTA_E_BOXES; i++) /* by the printed figure, too */
            TEST_ASSERT_TRUE(sqrt((double)b.bound[i]) <= c->expect + 6e-5);
    }
}

/* ---- not too low ------------------------------------------------------------------------------
 */

static int compare(const void *left, const void *right)
{
    double x = *(const double *)left, y = *(const double *)right;
    return (x > y) - (x < y);
}

/* A bound of 0 would pass all of the above.  Shares of dE00 of points up to 10 from skin. */
static void test_near_what_it_bounds(void)
{
    enum { MANY = 2000 * DELTA_E_BOXES };
    static double share[MANY];
    struct dice dice = { 23 };
    for (size_t n = 0; n < MANY; n += DELTA_E_BOXES) {
        double p[3] = { dice_between(&dice, 15.0, 80.0), dice_between(&dice, 2.0, 16.0),
                        dice_between(&dice, 4.0, 28.0) };
        struct delta_e_box q;
        struct boxes b;
        for (int i = 0; i < DELTA_E_BOXES; i++) {
            double at[3];
            for (int k = 0; k < 3; k++)
                at[k] = p[k] + dice_between(&dice, -10.0, 10.0);
            set_box(&b, i, at, at);
        }
        TEST_ASSERT_TRUE(delta_e_box_init(p, 100.0, &q));
        delta_e_box_bound(&q, &b.low[0][0], &b.high[0][0], b.bound);
        for (int i = 0; i < DELTA_E_BOXES; i++) {
            double point[3] = { (double)b.low[0][i], (double)b.low[1][i], (double)b.low[2][i] };
            share[n + (size_t)i] = sqrt((double)b.bound[i]) / delta_e_2000(p, point);
        }
    }
    qsort(share, MANY, sizeof *share, compare);
    TEST_ASSERT_TRUE(share[0] > 0.8);
    TEST_ASSERT_TRUE(share[MANY / 10] > 0.995);
    TEST_ASSERT_TRUE(share[MANY / 2] > 0.9995);
}

/* ---- the rest ---------------------------------------------------------------------------------
 */

static void test_same_bits_by_all_vectors(void)
{
    struct dice dice = { 24 };
    for (int round = 0; round < 500; round++) {
        double p[3] = { 50.0, dice_between(&dice, -90, 90), dice_between(&dice, -90, 90) };
        float plain[DELTA_E_BOXES];
        struct delta_e_box q;
        struct boxes b;
        for (int i = 0; i < DELTA_E_BOXES; i++) {
            double low[3], high[3];
            for (int k = 0; k < 3; k++) {
                low[k] = dice_between(&dice, -90, 90);
                high[k] = low[k] + dice_between(&dice, 0, 9);
            }
            set_box(&b, i, low, high);
        }
        TEST_ASSERT_TRUE(delta_e_box_init(p, 120.0, &q));
        delta_e_box_bound_by(DELTA_E_PLAIN, &q, &b.low[0][0], &b.high[0][0], plain);
        for (int v = DELTA_E_AVX2; v < DELTA_E_VECTORS; v++) {
            if (!delta_e_has((enum delta_e_vectors)v))
                continue;
            delta_e_box_bound_by((enum delta_e_vectors)v, &q, &b.low[0][0], &b.high[0][0], b.bound);
            TEST_ASSERT_EQUAL_MEMORY(plain, b.bound, sizeof plain);
        }
    }
}

static void test_refuses_what_it_is_not_for(void)
{
    static const double beyond[][3] = {
        { -20.1, 0, 0 }, { 120.1, 0, 0 }, { 50, 1000.1, 0 }, { 50, 0, -1000.1 },
        { NAN, 0, 0 },   { 50, NAN, 0 },  { 50, 0, NAN },    { 50, INFINITY, 0 },
    };
    struct delta_e_box q;
    for (size_t i = 0; i < sizeof beyond / sizeof *beyond; i++) {
        TEST_ASSERT_FALSE(delta_e_box_takes(beyond[i]));
        TEST_ASSERT_FALSE(delta_e_box_init(beyond[i], 100.0, &q));
    }
    TEST_ASSERT_TRUE(delta_e_box_init((double[3]){ 120.0, -1000.0, 1000.0 }, 1000.0, &q));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_never_above);
    RUN_TEST(test_sharma_pairs);
    RUN_TEST(test_near_what_it_bounds);
    RUN_TEST(test_same_bits_by_all_vectors);
    RUN_TEST(test_refuses_what_it_is_not_for);
    return UNITY_END();
}
