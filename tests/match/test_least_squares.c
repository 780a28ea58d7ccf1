/* test_least_squares.c - minima inside a box: published problems, quadratics against all
 * active sets tried one after the other, and functions that are not finite everywhere. */
#include "match/least_squares.h"

#include <math.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

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

/* Sums from m residuals and their derivatives, J[m][n]. */
static void sum_up(const double *r, const double *J, size_t m, size_t n, struct normal *ret)
{
    memset(ret, 0, sizeof *ret);
    for (size_t k = 0; k < m; k++) {
        ret->chi_square += r[k] * r[k];
        for (size_t i = 0; i < n; i++) {
            ret->gradient[i] += J[k * n + i] * r[k];
            for (size_t j = 0; j <= i; j++)
                ret->curvature[packed(i, j)] += J[k * n + i] * J[k * n + j];
        }
    }
}

static struct least_squares problem_of(void (*evaluate)(void *, const double *, struct normal *),
                                       void *context, size_t n, const double *lo, const double *hi)
{
    return (struct least_squares){ .n = n,
                                   .lo = lo,
                                   .hi = hi,
                                   .evaluate = evaluate,
                                   .context = context,
                                   .tolerance = 1e-9,
                                   .steps = 200 };
}

/* ---- published problems ---------------------------------------------------------------- */

/* NIST StRD Misra1a: y = b1 (1 - e^(-b2 x)), with its certified values. */
static void misra(void *context, const double *b, struct normal *ret)
{
    static const double y[14] = { 10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02,
                                  44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78 };
    static const double x[14] = { 77.6,  114.9, 141.1, 190.8, 239.9, 289.0, 332.8,
                                  378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0 };
    double r[14], J[28], unit = *(const double *)context; /* of residuals */
    for (size_t k = 0; k < 14; k++) {
        r[k] = unit * (b[0] * -expm1(-b[1] * x[k]) - y[k]);
        J[2 * k] = unit * -expm1(-b[1] * x[k]);
        J[2 * k + 1] = unit * b[0] * x[k] * exp(-b[1] * x[k]);
    }
    sum_up(r, J, 14, 2, ret);
}

static void test_certified_values_from_both_starts(void)
{
    static const double start[2][2] = { { 500.0, 1e-4 }, { 250.0, 5e-4 } };
    double lo[2] = { 0.0, 0.0 }, hi[2] = { 1e4, 1.0 }, unit = 1e3;
    struct least_squares p = problem_of(misra, &unit, 2, lo, hi);
    for (int i = 0; i < 2; i++) {
        double x[2] = { start[i][0], start[i][1] };
        struct normal at;
        struct least_squares_run run;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
        TEST_ASSERT_TRUE(run.converged);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7 * 238.94212918, 238.94212918, x[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7 * 5.5015643181e-4, 5.5015643181e-4, x[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.12455138894, at.chi_square / unit / unit);
    }
}

/* Rosenbrock's valley: 10 (y - x^2), 1 - x.  In a box the minimum is where its wall meets
 * the valley. */
static void valley(void *context, const double *x, struct normal *ret)
{
    double r[2] = { 10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0] };
    double J[4] = { -20.0 * x[0], 10.0, -1.0, 0.0 };
    (void)context;
    sum_up(r, J, 2, 2, ret);
}

static void test_valley_with_and_without_walls(void)
{
    static const struct {
        double lo[2], hi[2], start, x, y;
    } row[] = {
        { { -2, -2 }, { 2, 2 }, -1.2, 1.0, 1.0 },
        { { -2, -2 }, { 0.5, 2 }, -1.2, 0.5, 0.25 },
        { { -2, 1.5 }, { 0.9, 2 }, 0.5, 0.9, 1.5 }, /* a corner */
        { { -2, 1.5 },
          { 0.9, 2 },
          -1.2,
          -1.221027,
          1.5 }, /* the other arm: 200 x (x^2 - 1.5) = 1 - x */
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        double x[2] = { row[i].start, 1.0 };
        struct normal at;
        struct least_squares_run run;
        struct least_squares p = problem_of(valley, NULL, 2, row[i].lo, row[i].hi);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
        TEST_ASSERT_TRUE(run.converged);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, row[i].x, x[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, row[i].y, x[1]);
    }
}

/* ---- quadratics ------------------------------------------------------------------------ */

enum { N = 4, M = 7 };

struct linear {
    double J[M * N], y[M];
};

static void linear(void *context, const double *x, struct normal *ret)
{
    const struct linear *l = context;
    double r[M];
    for (size_t k = 0; k < M; k++) {
        r[k] = -l->y[k];
        for (size_t i = 0; i < N; i++)
            r[k] += l->J[k * N + i] * x[i];
    }
    sum_up(r, l->J, M, N, ret);
}

/* Minimum with each parameter at its lower bound, its upper bound or free, as the digits of
 * `set` in base 3 say; INFINITY where that leaves the box.  Gauss's elimination. */
static double with_set(struct linear *l, const double *lo, const double *hi, int set)
{
    double x[N], A[N][N + 1], side[N];
    struct normal at;
    for (size_t i = 0; i < N; i++, set /= 3) {
        side[i] = set % 3;
        x[i] = set % 3 == 0 ? 0.0 : set % 3 == 1 ? lo[i] : hi[i];
    }
    linear(l, x, &at); /* the gradient with the free ones at 0 */
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j <= N; j++)
            A[i][j] = side[i] != 0.0 ? (double)(i == j)
                      : j == N       ? -at.gradient[i]
                                     : (side[j] == 0.0 ? at.curvature[packed(i, j)] : 0.0);
    for (size_t i = 0; i < N; i++) {
        if (side[i] != 0.0)
            A[i][N] = 0.0;
        for (size_t k = 0; k < N; k++) {
            double factor = k == i ? 0.0 : A[k][i] / A[i][i];
            for (size_t j = 0; j <= N; j++)
                A[k][j] -= factor * A[i][j];
        }
    }
    for (size_t i = 0; i < N; i++) {
        x[i] = side[i] == 0.0 ? A[i][N] / A[i][i] : x[i];
        if (x[i] < lo[i] || x[i] > hi[i])
            return INFINITY;
    }
    linear(l, x, &at);
    return at.chi_square;
}

static void test_quadratics_reach_the_best_active_set(void)
{
    struct dice dice = { 11 };
    static const double lo[N] = { -0.3, 0.0, -1.0, 0.2 }, hi[N] = { 0.5, 1.0, 0.1, 0.9 };
    for (int turn = 0; turn < 2000; turn++) {
        struct linear l;
        double best = INFINITY, x[N];
        for (size_t i = 0; i < M * N; i++)
            l.J[i] = dice_between(&dice, -1.0, 1.0) + (i % N == 2 ? 3.0 * l.J[i - i % N] : 0.0);
        for (size_t i = 0; i < M; i++)
            l.y[i] = dice_between(&dice, -2.0, 2.0);
        for (int set = 0; set < 81; set++)
            best = fmin(best, with_set(&l, lo, hi, set));
        for (size_t i = 0; i < N; i++)
            x[i] = dice_between(&dice, -2.0, 2.0);
        struct normal at;
        struct least_squares_run run;
        struct least_squares p = problem_of(linear, &l, N, lo, hi);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
        TEST_ASSERT_TRUE(run.converged);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, best, at.chi_square);
        TEST_ASSERT_TRUE_MESSAGE(run.evaluations <= 3, "a quadratic takes one step");
        for (size_t i = 0; i < N; i++)
            TEST_ASSERT_TRUE(x[i] >= lo[i] && x[i] <= hi[i]);
    }
}

/* ---- what must not happen -------------------------------------------------------------- */

/* log x - 2: no number below 0, without end at 0.  Counts rises of what was accepted. */
static void logarithm(void *context, const double *x, struct normal *ret)
{
    double r = log(x[0]) - 2.0, J = 1.0 / x[0];
    (void)context;
    sum_up(&r, &J, 1, 1, ret);
}

static void test_steps_into_nowhere_are_taken_back(void)
{
    double lo = -10.0, hi = 100.0, x = 60.0; /* the first step leads to -66 */
    struct normal at;
    struct least_squares_run run;
    struct least_squares p = problem_of(logarithm, NULL, 1, &lo, &hi);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, &x, &at, &run));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, exp(2.0), x);
    x = -3.0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, least_squares_run(&p, &x, &at, &run));
}

/* Two columns are one: the data see only their sum. */
static void twins(void *context, const double *x, struct normal *ret)
{
    double r[1] = { x[0] + x[1] - 1.0 }, J[2] = { 1.0, 1.0 };
    (void)context;
    sum_up(r, J, 1, 2, ret);
}

static void test_what_the_data_do_not_see_stays(void)
{
    double lo[2] = { 0.0, 0.0 }, hi[2] = { 2.0, 2.0 }, x[2] = { 0.3, 0.3 }, inverse[4];
    double unseen[2] = { 4.0, 9.0 };
    struct normal at;
    struct least_squares_run run;
    struct least_squares p = problem_of(twins, NULL, 2, lo, hi);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
    TEST_ASSERT_TRUE(run.converged);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, x[0] + x[1]);
    normal_covariance(&at, 2, unseen, inverse);
    TEST_ASSERT_EQUAL_DOUBLE(9.0, inverse[3]);
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_TRUE(isfinite(inverse[i]));
}

/* Close by, the last step is not looked at: one evaluation less, and nearly the same end. */
static void test_the_last_step_may_be_unseen(void)
{
    double lo[2] = { 0.0, 0.0 }, hi[2] = { 1e4, 1.0 }, unit = 1e3, seen[2], unseen[2];
    struct least_squares p = problem_of(misra, &unit, 2, lo, hi);
    struct least_squares_run run[2];
    struct normal at;
    seen[0] = unseen[0] = 250.0;
    seen[1] = unseen[1] = 5e-4;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, seen, &at, &run[0]));
    double chi_square = at.chi_square;
    p.unseen = 100.0; /* of 124 551 */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, unseen, &at, &run[1]));
    TEST_ASSERT_TRUE(run[1].converged && run[1].evaluations < run[0].evaluations);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, chi_square, at.chi_square);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * seen[0], seen[0], unseen[0]);
}

static void test_steps_are_limited(void)
{
    double lo[2] = { -2, -2 }, hi[2] = { 2, 2 }, x[2] = { -1.2, 1.0 };
    struct normal at;
    struct least_squares_run run;
    struct least_squares p = problem_of(valley, NULL, 2, lo, hi);
    p.steps = 1;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
    TEST_ASSERT_FALSE(run.converged);
    TEST_ASSERT_TRUE(at.chi_square <= 24.2); /* where it began */
}

static void test_a_held_parameter_stays(void)
{
    double lo[2] = { 0.3, -2 }, hi[2] = { 0.3, 2 }, x[2] = { 1.0, 1.0 };
    struct normal at;
    struct least_squares_run run;
    struct least_squares p = problem_of(valley, NULL, 2, lo, hi);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, least_squares_run(&p, x, &at, &run));
    TEST_ASSERT_EQUAL_DOUBLE(0.3, x[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.09, x[1]);
}

/* ---- the covariance -------------------------------------------------------------------- */

/* expect: a curvature times its inverse is 1, for sizes with loops of their own and without. */
static void test_covariance_inverts(void)
{
    enum { MOST = 7, ROWS = 9 };
    struct dice dice = { 12 };
    double J[ROWS * MOST], r[ROWS] = { 0.0 }, inverse[MOST * MOST];
    const double unseen[MOST] = { 0.0 };
    for (size_t n = 1; n <= MOST; n++) {
        struct normal at;
        for (size_t i = 0; i < ROWS * n; i++)
            J[i] = dice_between(&dice, -1.0, 1.0);
        sum_up(r, J, ROWS, n, &at);
        normal_covariance(&at, n, unseen, inverse);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++) {
                double sum = 0.0;
                for (size_t k = 0; k < n; k++)
                    sum += at.curvature[packed(i, k)] * inverse[k * n + j];
                TEST_ASSERT_DOUBLE_WITHIN(1e-11, i == j ? 1.0 : 0.0, sum);
            }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_certified_values_from_both_starts);
    RUN_TEST(test_valley_with_and_without_walls);
    RUN_TEST(test_quadratics_reach_the_best_active_set);
    RUN_TEST(test_steps_into_nowhere_are_taken_back);
    RUN_TEST(test_what_the_data_do_not_see_stays);
    RUN_TEST(test_the_last_step_may_be_unseen);
    RUN_TEST(test_steps_are_limited);
    RUN_TEST(test_a_held_parameter_stays);
    RUN_TEST(test_covariance_inverts);
    return UNITY_END();
}
