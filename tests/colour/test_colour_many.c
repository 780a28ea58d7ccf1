/* test_colour_many.c - many colours at a time against one at a time, which has references of its
 * own: light, dark, black and on the edge where L*'s root meets its line. */
#include "colour/colour_many.h"

#include <math.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/srgb.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { ROWS = 203, STRIDE_MAX = 304 };

static double R[ROWS * STRIDE_MAX], column[6][ROWS + 1], other[6][ROWS + 1];

static struct colour_columns columns_in(double c[6][ROWS + 1])
{
    return (struct colour_columns){ c[0], c[1], c[2], c[3], c[4], c[5] };
}

/* Spectra that rise and fall, the later the darker: from 1 to 1e-9, then 0; two that lie on the
 * edge, (6/29)^3. */
static void fill(size_t bands, size_t stride)
{
    for (size_t row = 0; row < ROWS; row++) {
        double level = row + 3 > ROWS ? 0.0 : pow(10.0, -9.0 * (double)row / ROWS);
        for (size_t i = 0; i < stride; i++) {
            double wave = 0.5 + 0.5 * sin(0.11 * (double)(i * (row % 7 + 1)) + (double)row);
            double edge = 216.0 / 24389.0 * (row % 2 == 0 ? 1.0 - 1e-14 : 1.0 + 1e-14);
            double value = row / 2 == 20 ? edge : level * wave;
            R[row * stride + i] = i < bands ? value : R[row * stride + bands - 1];
        }
    }
}

static const struct grid_case {
    const char *what;
    double first_nm, step_nm;
    size_t bands;
    enum illuminant illuminant;
    enum observer observer;
} cases[] = {
    { "a table's", 400, 10, 31, ILLUMINANT_D65, OBSERVER_10DEG },
    { "whole vectors", 380, 10, 40, ILLUMINANT_A, OBSERVER_2DEG },
    { "by 1 nm", 400, 1, 301, ILLUMINANT_D50, OBSERVER_2DEG },
};

static void test_as_one_at_a_time(void)
{
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const struct grid_case *c = &cases[k];
        static struct colour_many many;
        struct xyz_weights w;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, xyz_weights_init(c->illuminant, c->observer, c->first_nm,
                                                          c->step_nm, c->bands, &w));
        colour_many_init(&w, &many);
        TEST_ASSERT_EQUAL_size_t((c->bands + 7) / 8 * 8, many.stride);
        fill(c->bands, many.stride);
        struct colour_columns to = columns_in(column), again = columns_in(other);
        for (int i = 0; i < 6; i++)
            column[i][ROWS] = 77.0;
        colour_many(&many, ROWS, R, &to);
        for (int i = 0; i < 6; i++) /* nothing past the last */
            TEST_ASSERT_EQUAL_DOUBLE(77.0, column[i][ROWS]);
        for (size_t row = 0; row < ROWS; row++) {
            double XYZ[3], Lab[3], rgb[3];
            xyz_from_reflectance(&w, R + row * many.stride, XYZ);
            lab_from_xyz(XYZ, w.white, Lab);
            srgb_linear_from_xyz(XYZ, w.white, rgb);
            for (int i = 0; i < 3; i++) {
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, Lab[i], column[i][row], c->what);
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4e-15, rgb[i], column[3 + i][row], c->what);
            }
        }
        /* In the dark its own digits: black is 0, and L* is a line. */
        TEST_ASSERT_EQUAL_DOUBLE(0.0, column[0][ROWS - 1]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, column[1][ROWS - 1]);

        for (size_t row = 0; row < ROWS; row++) { /* in other company */
            struct colour_columns one = { again.L + row,   again.a + row,     again.b + row,
                                          again.red + row, again.green + row, again.blue + row };
            colour_many(&many, 1, R + row * many.stride, &one);
        }
        for (int i = 0; i < 6; i++)
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(column[i], other[i], ROWS * sizeof(double), c->what);
    }
}

/* Property: the same bits by either kind of fused vectors, 1e-12 without. */
static void test_same_by_any_vectors(void)
{
    static struct colour_many many;
    struct xyz_weights w;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          xyz_weights_init(ILLUMINANT_D65, OBSERVER_10DEG, 400.0, 10.0, 31, &w));
    colour_many_init(&w, &many);
    enum vectors best = many.vectors;
    fill(31, many.stride);
    struct colour_columns to = columns_in(column), again = columns_in(other);
    colour_many(&many, ROWS, R, &to);
    for (many.vectors = VECTORS_PLAIN; many.vectors < VECTORS_KINDS; many.vectors++) {
        if (!vectors_has(many.vectors))
            continue;
        bool same = many.vectors != VECTORS_PLAIN && best != VECTORS_PLAIN;
        colour_many(&many, ROWS, R, &again);
        for (int i = 0; i < 6; i++)
            for (size_t row = 0; row < ROWS; row++)
                TEST_ASSERT_DOUBLE_WITHIN(same ? 0.0 : 1e-12, column[i][row], other[i][row]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_as_one_at_a_time);
    RUN_TEST(test_same_by_any_vectors);
    return UNITY_END();
}
