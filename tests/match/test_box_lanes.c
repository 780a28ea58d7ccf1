/* Sixteen quadratics in a box at a time: each has the least that one at a time has. */
#include "match/box_lanes.h"

#include <math.h>
#include <string.h>

#include "match/least_squares.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { N = BOX_PARAMETERS, GROUPS = 4000 };
static const double lo[N] = { 0.0, 0.0, 0.001 }, hi[N] = { 0.5, 1.0, 0.1 };

void setUp(void)
{
}

void tearDown(void)
{
}

static size_t packed(size_t i, size_t j)
{
    return i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
}

/* J^T J of `rows` rows by chance: of fewer than three it is singular. */
static void make_curvature(struct dice *dice, size_t rows, size_t l, struct box_lanes *b)
{
    double scale = exp(dice_between(dice, -3.0, 12.0));
    for (size_t k = 0; k < BOX_TRIANGLE; k++)
        b->curvature[k][l] = 0.0;
    for (size_t r = 0; r < rows; r++) {
        double J[N];
        for (size_t i = 0; i < N; i++)
            J[i] = scale * dice_between(dice, -1.0, 1.0) / (hi[i] - lo[i]);
        for (size_t i = 0; i < N; i++)
            for (size_t j = 0; j <= i; j++)
                b->curvature[packed(i, j)][l] += J[i] * J[j];
    }
}

/* Places inside, on faces, edges and corners; least ones anywhere. */
static void make_lanes(struct dice *dice, size_t rows, struct box_lanes *b)
{
    for (size_t l = 0; l < BOX_LANES; l++) {
        double to[N];
        make_curvature(dice, rows, l, b);
        for (size_t i = 0; i < N; i++) {
            double at = fmin(fmax(dice_between(dice, -0.5, 1.5), 0.0), 1.0);
            b->x[i][l] = at == 0.0 ? lo[i] : at == 1.0 ? hi[i] : lo[i] + at * (hi[i] - lo[i]);
            to[i] = lo[i] + dice_between(dice, -1.0, 2.0) * (hi[i] - lo[i]) - b->x[i][l];
        }
        for (size_t i = 0; i < N; i++) {
            b->gradient[i][l] = 0.0;
            for (size_t j = 0; j < N; j++)
                b->gradient[i][l] -= b->curvature[packed(i, j)][l] * to[j];
        }
    }
}

/* Half the slope of lane l by parameter i after its step. */
static double slope_after(const struct box_lanes *b, size_t i, size_t l)
{
    double slope = b->gradient[i][l];
    for (size_t j = 0; j < N; j++)
        slope += b->curvature[packed(i, j)][l] * b->step[j][l];
    return slope;
}

static double gain_of_one(const struct box_lanes *b, size_t l)
{
    struct normal normal;
    double x[N];
    for (size_t k = 0; k < BOX_TRIANGLE; k++)
        normal.curvature[k] = b->curvature[k][l];
    for (size_t i = 0; i < N; i++) {
        normal.gradient[i] = b->gradient[i][l];
        x[i] = b->x[i][l];
    }
    return least_squares_step(N, lo, hi, &normal, x);
}

/* Karush, Kuhn and Tucker: no slope inside, outwards on a bound; in units of what the slope was. */
static void assert_least(const struct box_lanes *b, size_t l)
{
    for (size_t i = 0; i < N; i++) {
        double x = b->x[i][l] + b->step[i][l], range = hi[i] - lo[i], slope = slope_after(b, i, l);
        double small = 1e-7 * fabs(b->gradient[i][l]) +
                       2e-6 * sqrt(fmax(b->curvature[packed(i, i)][l], 0.0)) +
                       1e-9 * b->curvature[packed(i, i)][l] * range;
        TEST_ASSERT_TRUE(x >= lo[i] - 1e-14 * range && x <= hi[i] + 1e-14 * range);
        if (x > lo[i] + 1e-12 * range)
            TEST_ASSERT_TRUE_MESSAGE(slope <= small, "pulled down");
        if (x < hi[i] - 1e-12 * range)
            TEST_ASSERT_TRUE_MESSAGE(slope >= -small, "pulled up");
    }
}

static void test_each_lane_has_the_least_inside_the_box(void)
{
    struct dice dice = { 5 };
    size_t on_bounds = 0, off_bounds = 0;
    for (size_t g = 0; g < GROUPS; g++) {
        struct box_lanes b;
        make_lanes(&dice, 5, &b);
        box_lanes_step(QUICK_PLAIN, lo, hi, &b);
        for (size_t l = 0; l < BOX_LANES; l++) {
            double one = gain_of_one(&b, l);
            bool bound = false;
            TEST_ASSERT_DOUBLE_WITHIN(1e-8 * one + 1e-9, one, b.gain[l]);
            assert_least(&b, l);
            for (size_t i = 0; i < N; i++) {
                double x = b.x[i][l] + b.step[i][l];
                bound = bound || x <= lo[i] || x >= hi[i];
            }
            on_bounds += bound ? 1u : 0u;
            off_bounds += bound ? 0u : 1u;
        }
    }
    TEST_ASSERT_TRUE(on_bounds > GROUPS && off_bounds > GROUPS); /* both were met */
}

/* What is not seen stays where it is or goes along; the gain is that of the least all the same. */
static void test_directions_that_are_not_seen_do_no_harm(void)
{
    struct dice dice = { 7 };
    for (size_t rows = 0; rows < 3; rows++)
        for (size_t g = 0; g < GROUPS / 10; g++) {
            struct box_lanes b;
            make_lanes(&dice, rows, &b);
            box_lanes_step(QUICK_PLAIN, lo, hi, &b);
            for (size_t l = 0; l < BOX_LANES; l++) {
                double one = gain_of_one(&b, l);
                TEST_ASSERT_DOUBLE_WITHIN(1e-4 * one + 1e-9, one, b.gain[l]);
                for (size_t i = 0; i < N; i++)
                    TEST_ASSERT_TRUE(isfinite(b.step[i][l]));
            }
        }
}

/* Gradients of a true quadratic, curvature known less what residuals add: after three steps that
 * differ the sum is the whole. */
static void test_secants_tell_the_curvature_that_is_missing(void)
{
    struct dice dice = { 9 };
    struct box_lanes b, whole;
    struct box_secant secant;
    double missing[BOX_TRIANGLE][BOX_LANES];
    memset(&secant, 0, sizeof secant);
    memset(&b, 0, sizeof b);
    make_lanes(&dice, 6, &whole);
    for (size_t l = 0; l < BOX_LANES; l++)
        for (size_t k = 0; k < BOX_TRIANGLE; k++) /* a third of what is there, in each direction */
            missing[k][l] = (l % 2 == 0 ? -1.0 : 1.0) / 3.0 * whole.curvature[k][l];
    for (size_t turn = 0; turn < 4; turn++) {
        for (size_t l = 0; l < BOX_LANES; l++) {
            for (size_t k = 0; k < BOX_TRIANGLE; k++)
                b.curvature[k][l] = whole.curvature[k][l] - missing[k][l];
            for (size_t i = 0; i < N; i++)
                b.x[i][l] += (turn == i + 1 ? 0.03 : 0.01) * (hi[i] - lo[i]);
            for (size_t i = 0; i < N; i++) {
                b.gradient[i][l] = 0.0;
                for (size_t j = 0; j < N; j++)
                    b.gradient[i][l] += whole.curvature[packed(i, j)][l] * b.x[j][l];
            }
        }
        box_lanes_bend(QUICK_PLAIN, 0.2, &secant, &b);
    }
    for (size_t l = 0; l < BOX_LANES; l++)
        for (size_t k = 0; k < BOX_TRIANGLE; k++) {
            double scale =
                1e-9 * (whole.curvature[0][l] + whole.curvature[2][l] + whole.curvature[5][l]);
            TEST_ASSERT_DOUBLE_WITHIN(scale, missing[k][l], secant.more[k][l]);
            TEST_ASSERT_DOUBLE_WITHIN(scale, whole.curvature[k][l], b.curvature[k][l]);
        }
}

/* A parameter that rests on a bound: of the others all is told, and the sum is mostly that
 * of a minimum even where it would not be with the part that is known of the one that rests. */
static void test_what_rests_is_left_out(void)
{
    struct dice dice = { 15 };
    size_t least = 0, some = 0;
    for (size_t g = 0; g < GROUPS / 10; g++) {
        struct box_lanes b;
        struct box_secant secant;
        double share[BOX_LANES];
        make_lanes(&dice, 4, &b);
        memset(&secant, 0, sizeof secant);
        memcpy(secant.curvature, b.curvature, sizeof b.curvature);
        for (size_t l = 0; l < BOX_LANES; l++) {
            size_t rests = l % N;
            share[l] = dice_between(&dice, -0.9, 3.0);
            for (size_t i = 0; i < N; i++)
                secant.x[i][l] = b.x[i][l] - (i == rests ? 0.0 : 0.01 * (hi[i] - lo[i]));
            for (size_t i = 0; i < N; i++) { /* curvature 1 + share of what is known */
                secant.gradient[i][l] = b.gradient[i][l];
                for (size_t j = 0; j < N; j++)
                    secant.gradient[i][l] -= (1.0 + share[l]) * b.curvature[packed(i, j)][l] *
                                             (b.x[j][l] - secant.x[j][l]);
            }
        }
        struct box_lanes before = b;
        box_lanes_bend(QUICK_PLAIN, 0.2, &secant, &b);
        for (size_t l = 0; l < BOX_LANES; l++) {
            double told = 0.0, known = 0.0, x[N] = { 0.0 };
            for (size_t i = 0; i < N; i++)
                x[i] = i == l % N ? 0.0 : 0.01 * (hi[i] - lo[i]);
            for (size_t i = 0; i < N; i++)
                for (size_t j = 0; j < N; j++) {
                    told += x[i] * x[j] * secant.more[packed(i, j)][l];
                    known += x[i] * x[j] * before.curvature[packed(i, j)][l];
                }
            for (size_t j = 0; j < N; j++)
                TEST_ASSERT_TRUE(secant.more[packed(l % N, j)][l] == 0.0);
            if (told != 0.0) /* else it was no minimum's */
                TEST_ASSERT_DOUBLE_WITHIN(1e-6 * known, share[l] * known, told);
            /* Positive pivots: by cofactors. */
            double h00 = b.curvature[0][l], h10 = b.curvature[1][l], h11 = b.curvature[2][l];
            double h20 = b.curvature[3][l], h21 = b.curvature[4][l], h22 = b.curvature[5][l];
            double det = h00 * (h11 * h22 - h21 * h21) - h10 * (h10 * h22 - h21 * h20) +
                         h20 * (h10 * h21 - h11 * h20);
            least += h00 > 0.0 && h00 * h11 - h10 * h10 > 0.0 && det > 0.0 ? 1u : 0u;
            some += told != 0.0 ? 1u : 0u;
        }
    }
    TEST_ASSERT_TRUE(least > GROUPS / 10 * BOX_LANES * 19 / 20);
    TEST_ASSERT_TRUE(some > GROUPS / 10 * BOX_LANES / 2);
}

/* A hill is no place to step from: the curvature stays what Gauss and Newton take it for. */
static void test_a_sum_that_is_no_minimum_s_is_forgotten(void)
{
    struct dice dice = { 11 };
    struct box_lanes b, before;
    struct box_secant secant;
    memset(&secant, 0, sizeof secant);
    make_lanes(&dice, 6, &b);
    before = b;
    for (size_t l = 0; l < BOX_LANES; l++)
        for (size_t i = 0; i < N; i++) {
            secant.x[i][l] = b.x[i][l] - 0.01;
            secant.gradient[i][l] = b.gradient[i][l];
            for (size_t j = 0; j < N; j++) /* falls where it was to rise */
                secant.gradient[i][l] += 0.01 * b.curvature[packed(i, j)][l];
        }
    box_lanes_bend(QUICK_PLAIN, 0.2, &secant, &b);
    TEST_ASSERT_EQUAL_MEMORY(before.curvature, b.curvature, sizeof b.curvature);
    for (size_t l = 0; l < BOX_LANES; l++)
        TEST_ASSERT_TRUE(secant.more[0][l] == 0.0 && secant.more[4][l] == 0.0);
    TEST_ASSERT_EQUAL_MEMORY(b.x, secant.x, sizeof b.x);
}

static void test_the_same_bits_by_any_vectors(void)
{
    for (int v = 0; v < QUICK_VECTORS; v++) {
        struct dice dice = { 13 };
        if (!quick_has((enum quick_vectors)v))
            continue;
        for (size_t g = 0; g < GROUPS / 10; g++) {
            struct box_lanes a, b;
            struct box_secant from, to;
            memset(&a, 0, sizeof a);
            make_lanes(&dice, g % 7, &a);
            b = a;
            memset(&from, 0, sizeof from);
            memcpy(from.x, a.x, sizeof a.x);
            for (size_t l = 0; l < BOX_LANES; l++)
                from.x[l % N][l] += 0.01;
            to = from;
            box_lanes_bend(QUICK_PLAIN, 0.2, &from, &a);
            box_lanes_bend((enum quick_vectors)v, 0.2, &to, &b);
            box_lanes_step(QUICK_PLAIN, lo, hi, &a);
            box_lanes_step((enum quick_vectors)v, lo, hi, &b);
            TEST_ASSERT_EQUAL_MEMORY(&from, &to, sizeof from);
            TEST_ASSERT_EQUAL_MEMORY(&a, &b, sizeof a);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_lane_has_the_least_inside_the_box);
    RUN_TEST(test_directions_that_are_not_seen_do_no_harm);
    RUN_TEST(test_secants_tell_the_curvature_that_is_missing);
    RUN_TEST(test_what_rests_is_left_out);
    RUN_TEST(test_a_sum_that_is_no_minimum_s_is_forgotten);
    RUN_TEST(test_the_same_bits_by_any_vectors);
    return UNITY_END();
}
