/* test_overlap.c - spectra laid on a table's bands, and their distances by any vectors. */
#include "match/overlap.h"

#include <math.h>

#include "tests/support/dice.h"
#include "unity.h"

enum { BANDS = 31 };

static struct table table;

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid =
        (struct grid){ { 0.001, 0.5, 5, true }, { 0, 1, 4, false }, { 0.001, 0.1, 5, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 100, &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&table, 0, 100, 1));
}

void tearDown(void)
{
    table_done(&table);
}

/* `n` bands from first_nm on, each its own number; with `missing` one that was not measured. */
static struct spectrum bands_from(double first_nm, size_t n, size_t missing)
{
    struct spectrum s = { .first_nm = first_nm, .step_nm = 10.0, .n = n };
    for (size_t i = 0; i < n; i++)
        s.value[i] = i == missing ? (double)NAN : first_nm + 10.0 * (double)i;
    return s;
}

/* Of 400 .. 700 nm by 10.  expect: by hand; a band's value is its own wavelength. */
static const struct overlap_case {
    const char *what;
    double first_nm;
    size_t n, missing, first_band, last_band, count;
} cases[] = {
    { "the same bands", 400, 31, 99, 0, 30, 31 },
    { "more on both sides", 360, 41, 99, 0, 30, 31 },
    { "one not measured", 360, 41, 14, 0, 30, 30 },
    { "it begins later", 430, 40, 99, 3, 30, 28 },
    { "it ends sooner", 380, 31, 99, 0, 28, 29 },
    { "it ends sooner, one not measured", 380, 31, 12, 0, 28, 28 },
};

static void test_bands_in_common(void)
{
    TEST_ASSERT_EQUAL_size_t(BANDS, table.recipe.bands);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct spectrum s = bands_from(cases[c].first_nm, cases[c].n, cases[c].missing);
        double missing_nm = cases[c].first_nm + 10.0 * (double)cases[c].missing;
        struct overlap o;
        overlap_init(&table, &s, &o);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(cases[c].count, o.n, cases[c].what);
        TEST_ASSERT_EQUAL_size_t(32, o.padded);
        for (size_t i = 0; i < o.padded; i++) {
            double nm = 400.0 + 10.0 * (double)i;
            bool both = i >= cases[c].first_band && i <= cases[c].last_band && nm != missing_nm;
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(both ? nm : 0.0, o.value[i], cases[c].what);
            TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(both ? 1.0 : 0.0, o.weight[i], cases[c].what);
        }
    }
}

/* expect: the plain sum, to the last bit; above a limit only that it is above. */
static void test_same_bits(void)
{
    struct dice dice = { 17 };
    for (int number = 0; number < 2000; number++) {
        struct spectrum s = bands_from(400, BANDS, dice_below(&dice, 2 * BANDS));
        struct overlap o;
        const float *row = table_spectrum(&table, dice_below(&dice, 100));
        for (size_t i = 0; i < BANDS; i++)
            s.value[i] = isnan(s.value[i]) ? s.value[i] : dice_between(&dice, 0.0, 1.0);
        overlap_init(&table, &s, &o);
        double expect = overlap_sum_by(VECTORS_PLAIN)(&o, row, (double)INFINITY);
        for (int kind = 0; kind < VECTORS_KINDS; kind++) {
            if (!vectors_has((enum vectors)kind))
                continue;
            overlap_sum *sum = overlap_sum_by((enum vectors)kind);
            double got = sum(&o, row, expect), above = sum(&o, row, 0.3 * expect);
            TEST_ASSERT_EQUAL_MEMORY(&expect, &got, sizeof got);
            TEST_ASSERT_TRUE(above > 0.3 * expect);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bands_in_common);
    RUN_TEST(test_same_bits);
    return UNITY_END();
}
