/* test_delta_e_many.c - CIEDE2000 to many rows against delta_e_2000(), which test_delta_e and
 * tests/stability hold to the published pairs and to MPFR, and against those pairs. */
#include "colour/delta_e_many.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "colour/delta_e.h"
#include "tests/support/dice.h"
#include "tests/support/sharma_pairs.h"
#include "unity.h"

enum { ROWS = 8192, PAIRS = sizeof sharma_cases / sizeof *sharma_cases };

static double L[ROWS], a[ROWS], b[ROWS], square[ROWS];

void setUp(void)
{
}
void tearDown(void)
{
}

static double one(enum delta_e_vectors v, const double p[3], const double q[3])
{
    double ret;
    delta_e_2000_squares_by(v, p, 1, &q[0], &q[1], &q[2], &ret);
    return sqrt(ret);
}

static void test_sharma_pairs_both_ways(void)
{
    for (int v = 0; v < DELTA_E_VECTORS; v++)
        for (size_t i = 0; i < PAIRS && delta_e_has((enum delta_e_vectors)v); i++) {
            const struct sharma_case *c = &sharma_cases[i];
            char what[32];
            snprintf(what, sizeof what, "pair %d by %d", c->pair, v);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-5, c->expect,
                                              one((enum delta_e_vectors)v, c->Lab1, c->Lab2), what);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-5, c->expect,
                                              one((enum delta_e_vectors)v, c->Lab2, c->Lab1), what);
        }
}

/* ---- chance, and where the formula has its edges ------------------------------------ */

static void turn(const double p[3], double by_deg, double times, size_t row)
{
    double t = by_deg * 3.14159265358979323846 / 180.0;
    a[row] = times * (p[1] * cos(t) - p[2] * sin(t));
    b[row] = times * (p[1] * sin(t) + p[2] * cos(t));
}

/* Row `row` for a colour p: one of 12 kinds, of chromas about `size`. */
static void make_row(struct dice *dice, const double p[3], double size, size_t row)
{
    L[row] = dice_between(dice, 0.0, 100.0);
    a[row] = dice_between(dice, -size, size);
    b[row] = dice_between(dice, -size, size);
    double times = dice_between(dice, 0.0, 2.0);
    switch (row % 12) {
    case 0: /* opposite, exactly where products are */
        a[row] = -2.0 * p[1];
        b[row] = -2.0 * p[2];
        break;
    case 1: /* opposite but for rounding */
        turn(p, 180.0, times, row);
        break;
    case 2: /* nearly opposite */
        turn(p, 180.0 + dice_between(dice, -1e-6, 1e-6), times, row);
        break;
    case 3: /* a right angle, where the formula changes over */
        turn(p, row % 24 < 12 ? 90.0 : -90.0, times, row);
        break;
    case 4: /* the same */
        L[row] = p[0];
        a[row] = p[1];
        b[row] = p[2];
        break;
    case 5: /* nearly the same */
        L[row] = p[0] + dice_between(dice, -1e-3, 1e-3);
        a[row] = p[1] * (1.0 + dice_between(dice, -1e-4, 1e-4));
        b[row] = p[2] * (1.0 + dice_between(dice, -1e-4, 1e-4));
        break;
    case 6: /* grey */
        a[row] = b[row] = row % 24 < 12 ? 0.0 : -0.0;
        break;
    case 7: /* mean hue 0, where Eq. 16 has an edge, and beside it */
        a[row] = p[1];
        b[row] = -p[2] + (row % 24 < 12 ? 0.0 : dice_between(dice, -1e-9, 1e-9));
        break;
    case 8: /* on an axis */
        *(row % 24 < 12 ? &a[row] : &b[row]) = 0.0;
        break;
    default: /* chance */
        break;
    }
}

/* Largest error over what the header allows. */
static double worst_share(enum delta_e_vectors v, const double p[3], size_t n)
{
    double worst = 0.0;
    delta_e_2000_squares_by(v, p, n, L, a, b, square);
    for (size_t i = 0; i < n; i++) {
        double d = delta_e_2000(p, (double[3]){ L[i], a[i], b[i] });
        double share =
            fabs(sqrt(square[i]) - d) / (DELTA_E_MANY_RELATIVE * d + DELTA_E_MANY_ABSOLUTE);
        if (!(share <= worst)) /* as NaN is not */
            worst = share;
    }
    return worst;
}

static const double sizes[] = { 1000.0, 128.0, 40.0, 15.0, 1.0, 1e-3, 1e-9, 1e-60 };

static void test_error_is_what_the_header_says(void)
{
    struct dice dice = { 11 };
    for (size_t round = 0; round < 160; round++) {
        double size = sizes[round % 8];
        double p[3] = { dice_between(&dice, 0.0, 100.0), dice_between(&dice, -size, size),
                        dice_between(&dice, -size, size) };
        if (round % 5 == 4)
            p[1 + round / 5 % 2] = 0.0;
        if (round % 16 == 9)
            p[1] = p[2] = 0.0;
        for (size_t i = 0; i < ROWS; i++)
            make_row(&dice, p, size, i);
        for (int v = 0; v < DELTA_E_VECTORS; v++) {
            char what[64];
            snprintf(what, sizeof what, "round %zu by %d", round, v);
            if (delta_e_has((enum delta_e_vectors)v))
                TEST_ASSERT_TRUE_MESSAGE(worst_share((enum delta_e_vectors)v, p, ROWS) <= 1.0,
                                         what);
        }
    }
}

/* Both colours blue: R_T at its largest. */
static void test_error_in_the_blue(void)
{
    struct dice dice = { 12 };
    for (int round = 0; round < 40; round++) {
        double p[3] = { 40.0, dice_between(&dice, -20.0, 40.0), dice_between(&dice, -90.0, -10.0) };
        for (size_t i = 0; i < ROWS; i++) {
            L[i] = dice_between(&dice, 38.0, 42.0);
            a[i] = dice_between(&dice, -20.0, 40.0);
            b[i] = dice_between(&dice, -90.0, -10.0);
        }
        for (int v = 0; v < DELTA_E_VECTORS; v++)
            if (delta_e_has((enum delta_e_vectors)v))
                TEST_ASSERT_TRUE(worst_share((enum delta_e_vectors)v, p, ROWS) <= 1.0);
    }
}

/* ---- the same bits ------------------------------------------------------------------ */

/* Fused kinds agree; and a row does not know its neighbours nor its place. */
static void test_bits(void)
{
    static double wide[ROWS], piece[ROWS];
    struct dice dice = { 13 };
    double p[3] = { 50.0, 12.0, -3.0 };
    for (size_t i = 0; i < ROWS; i++)
        make_row(&dice, p, 40.0, i);
    for (int v = 0; v < DELTA_E_VECTORS; v++) {
        if (!delta_e_has((enum delta_e_vectors)v))
            continue;
        delta_e_2000_squares_by((enum delta_e_vectors)v, p, ROWS, L, a, b, square);
        for (size_t first = 0, n = 1; first + n < ROWS; first += n, n = (5 * n + 1) % 131)
            delta_e_2000_squares_by((enum delta_e_vectors)v, p, n, L + first, a + first, b + first,
                                    piece + first);
        TEST_ASSERT_EQUAL_MEMORY(square, piece, (ROWS - 131) * sizeof *piece);
        if (v == DELTA_E_AVX512)
            TEST_ASSERT_EQUAL_MEMORY(wide, square, sizeof wide);
        memcpy(wide, square, sizeof wide);
    }
    delta_e_2000_squares(p, ROWS, L, a, b, square);
    TEST_ASSERT_EQUAL_MEMORY(wide, square, sizeof wide);
}

static void test_nan_passes_through(void)
{
    static const double p[3] = { 50.0, 10.0, -5.0 };
    for (int v = 0; v < DELTA_E_VECTORS; v++)
        for (int k = 0; k < 3 && delta_e_has((enum delta_e_vectors)v); k++) {
            double q[3] = { 50.0, 10.0, -5.0 };
            q[k] = NAN;
            TEST_ASSERT_TRUE(isnan(one((enum delta_e_vectors)v, p, q)));
            TEST_ASSERT_TRUE(isnan(one((enum delta_e_vectors)v, q, p)));
        }
}

static void test_no_rows(void)
{
    static const double p[3] = { 50.0, 10.0, -5.0 };
    square[0] = 77.0;
    delta_e_2000_squares(p, 0, L, a, b, square);
    TEST_ASSERT_EQUAL_DOUBLE(77.0, square[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sharma_pairs_both_ways);
    RUN_TEST(test_error_is_what_the_header_says);
    RUN_TEST(test_error_in_the_blue);
    RUN_TEST(test_bits);
    RUN_TEST(test_nan_passes_through);
    RUN_TEST(test_no_rows);
    return UNITY_END();
}
