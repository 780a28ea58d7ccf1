/* test_components.c - points are never further apart than their spectra, and for
 * spectra like the table's hardly nearer. */
#include "match/components.h"

#include <math.h>
#include <stdbool.h>

#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31, ROWS = 540 };

static struct table skins;

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid =
        (struct grid){ { 0.001, 0.5, 9, true }, { 0, 1, 5, false }, { 0.001, 0.1, 12, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &skins));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&skins, 0, ROWS, 2));
}

void tearDown(void)
{
    table_done(&skins);
}

static double distance(size_t n, const double *x, const double *y)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum);
}

static void widen(const float *row, double *value)
{
    for (size_t i = 0; i < BANDS; i++)
        value[i] = (double)row[i];
}

/* Of two spectra: the distance of their points by their own. */
static double ratio(const struct components *c, const double *x, const double *y)
{
    double p[COMPONENTS_DIMS], q[COMPONENTS_DIMS];
    components_point(c, x, p);
    components_point(c, y, q);
    double own = distance(BANDS, x, y);
    return own > 0.0 ? distance(COMPONENTS_DIMS, p, q) / own : 0.0;
}

/* By how much the points' distance is more than the spectra's own, in shares of their norms. */
static double excess(const struct components *c, const double *x, const double *y)
{
    static const double zero[COMPONENTS_DIMS];
    double p[COMPONENTS_DIMS], q[COMPONENTS_DIMS];
    components_point(c, x, p);
    components_point(c, y, q);
    double norms = distance(COMPONENTS_DIMS, p, zero) + distance(COMPONENTS_DIMS, q, zero);
    return (distance(COMPONENTS_DIMS, p, q) - distance(BANDS, x, y)) / (norms + 1e-300);
}

/* expect: at most 1; for skins nearly that, least so where two differ by 1e-4 only. */
static void test_skins_keep_their_distances(void)
{
    struct dice dice = { 3 };
    struct components *c;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, components_open(&skins, &c));
    for (int number = 0; number < 3000; number++) {
        double x[BANDS], y[BANDS];
        size_t row = dice_below(&dice, ROWS - 1);
        widen(table_spectrum(&skins, row), x);
        widen(table_spectrum(&skins, row + 1 + dice_below(&dice, ROWS - row - 1)), y);
        double r = ratio(c, x, y);
        TEST_ASSERT_TRUE(excess(c, x, y) <= COMPONENTS_ROUNDING);
        TEST_ASSERT_TRUE(r > 0.95);
    }
    components_close(c);
}

/* Whatever the spectra: noise of any size, on a skin or on nothing. */
static void test_points_are_never_further_apart(void)
{
    struct dice dice = { 5 };
    struct components *c;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, components_open(&skins, &c));
    for (int number = 0; number < 5000; number++) {
        double x[BANDS], y[BANDS], size = pow(10.0, dice_between(&dice, -6.0, 6.0));
        widen(table_spectrum(&skins, dice_below(&dice, ROWS)), x);
        for (size_t i = 0; i < BANDS; i++) {
            y[i] = x[i] + dice_between(&dice, -size, size);
            x[i] = number % 2 == 0 ? x[i] : dice_between(&dice, -size, size);
        }
        TEST_ASSERT_TRUE(excess(c, x, y) <= COMPONENTS_ROUNDING);
    }
    components_close(c);
}

/* ---- tables with little in them ------------------------------------------------------------ */

/* Rows 0.2 + factor x a wave of row's number, or of chance. */
static const struct poor_case {
    const char *what;
    size_t rows;
    double factor;
    size_t ways; /* in how many waves rows differ; 0: in every band by chance */
} poor_cases[] = {
    { "one row", 1, 0.1, 1 },
    { "two rows", 2, 0.1, 1 },
    { "rows all alike", 50, 0.0, 1 },
    { "one way to differ", 50, 0.1, 1 },
    { "two ways", 50, 0.1, 2 },
    { "seven ways", 50, 0.1, 7 },
    { "every way, fewer rows than directions", 5, 0.1, 0 },
    { "every way", 300, 0.1, 0 },
    { "differing by a float's last bit", 50, 1e-8, 2 },
};

static void make_poor(const struct poor_case *c, struct dice *dice, struct table *ret)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_row row = { .Cm = 0.1, .Bm = 0.5, .Ch = 0.01 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, c->rows, ret));
    for (size_t i = 0; i < c->rows; i++) {
        float spectrum[BANDS];
        size_t way = c->ways > 0 ? dice_below(dice, c->ways) : 0;
        double size = dice_between(dice, -1.0, 1.0);
        for (size_t j = 0; j < BANDS; j++)
            spectrum[j] =
                (float)(0.2 + c->factor * (c->ways > 0 ? size * sin((double)((way + 1) * j))
                                                       : dice_between(dice, -1.0, 1.0)));
        table_set(ret, i, &row, spectrum);
    }
}

static void test_tables_with_little_in_them(void)
{
    struct dice dice = { 7 };
    for (size_t i = 0; i < sizeof poor_cases / sizeof *poor_cases; i++) {
        const struct poor_case *poor = &poor_cases[i];
        struct components *c;
        struct table t;
        make_poor(poor, &dice, &t);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, components_open(&t, &c), poor->what);
        for (int number = 0; number < 500; number++) {
            double x[BANDS], y[BANDS];
            widen(table_spectrum(&t, dice_below(&dice, t.n)), x);
            widen(table_spectrum(&t, dice_below(&dice, t.n)), y);
            for (size_t j = 0; j < BANDS && number % 2 == 0; j++)
                y[j] += dice_between(&dice, -0.1, 0.1);
            double r = ratio(c, x, y);
            TEST_ASSERT_MESSAGE(excess(c, x, y) <= COMPONENTS_ROUNDING, poor->what);
            /* Rows that differ in no more ways than there are directions lose nothing. */
            bool held = poor->ways > 0 && number % 2 == 1 && distance(BANDS, x, y) > 1e-6;
            TEST_ASSERT_MESSAGE(!held || r > 1.0 - 1e-6, poor->what);
        }
        components_close(c);
        table_done(&t);
    }
}

/* ---- the rest of the contract ---------------------------------------------------------------- */

static void test_same_table_same_points(void)
{
    struct components *c, *again;
    double p[COMPONENTS_DIMS], q[COMPONENTS_DIMS], wide[BANDS];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, components_open(&skins, &c));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, components_open(&skins, &again));
    for (size_t row = 0; row < ROWS; row++) {
        components_row_point(c, table_spectrum(&skins, row), p);
        widen(table_spectrum(&skins, row), wide);
        components_point(again, wide, q);
        TEST_ASSERT_EQUAL_MEMORY(p, q, sizeof p);
    }
    components_close(c);
    components_close(again);
    components_close(NULL);
}

static void test_nan_shows(void)
{
    struct components *c;
    double value[BANDS] = { [12] = NAN }, point[COMPONENTS_DIMS];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, components_open(&skins, &c));
    components_point(c, value, point);
    TEST_ASSERT_TRUE(isnan(point[COMPONENTS]));
    components_close(c);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_skins_keep_their_distances);
    RUN_TEST(test_points_are_never_further_apart);
    RUN_TEST(test_tables_with_little_in_them);
    RUN_TEST(test_same_table_same_points);
    RUN_TEST(test_nan_shows);
    return UNITY_END();
}
