/* test_table.c - a table's memory, and its rows whoever computes them. */
#include "match/table.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

enum { ALIGNMENT = 64, COLUMNS = 9 };

/* A Cm of 0 and more rows than one piece of work: 13 + 6 x 9 x 13 = 715. */
static struct recipe recipe_small(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    recipe.grid =
        (struct grid){ { 0.0, 0.5, 7, false }, { 0.0, 1.0, 9, false }, { 0.001, 0.1, 13, true } };
    return recipe;
}
enum { SMALL_ROWS = 715 };

static void columns_of(const struct table *t, const double *column[COLUMNS])
{
    const double *all[COLUMNS] = {
        t->Cm, t->Bm, t->Ch, t->L, t->a, t->b, t->red, t->green, t->blue
    };
    memcpy(column, all, sizeof all);
}

/* Bit for bit, spectra with their padding included. */
static void assert_rows_equal(const struct table *x, size_t x_row, const struct table *y,
                              size_t y_row, size_t n, const char *what)
{
    const double *p[COLUMNS], *q[COLUMNS];
    columns_of(x, p);
    columns_of(y, q);
    for (int c = 0; c < COLUMNS; c++)
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(p[c] + x_row, q[c] + y_row, n * sizeof(double), what);
    if (x->spectrum != NULL)
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(table_spectrum(x, x_row), table_spectrum(y, y_row),
                                         n * x->stride * sizeof(float), what);
}

/* expect: stride is the bands rounded up to 8. */
static const struct memory_case {
    const char *what, *model;
    size_t n, bands, stride;
} memory_cases[] = {
    { "one row", "two-layer", 1, 31, 32 },       { "seven", "two-layer", 7, 31, 32 },
    { "eight", "two-layer", 8, 32, 32 },         { "nine", "half-space", 9, 33, 40 },
    { "many bands", "half-space", 3, 301, 304 }, { "no spectra", "paper", 5, 0, 0 },
};

static void test_memory(void)
{
    for (size_t i = 0; i < sizeof memory_cases / sizeof *memory_cases; i++) {
        const struct memory_case *c = &memory_cases[i];
        struct recipe recipe = recipe_default(model_find(c->model));
        struct table t;
        const double *column[COLUMNS];
        recipe.bands = c->bands;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, table_init(&recipe, c->n, &t), c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->n, t.n, c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->stride, t.stride, c->what);
        TEST_ASSERT_EQUAL_STRING("", t.name);
        TEST_ASSERT_EQUAL_STRING("", t.sha256);
        TEST_ASSERT_EQUAL_PTR(recipe.model, t.recipe.model);
        TEST_ASSERT_EQUAL_size_t(c->bands, t.recipe.bands);
        columns_of(&t, column);
        for (int k = 0; k < COLUMNS; k++)
            TEST_ASSERT_EQUAL_INT_MESSAGE(0, (int)((uintptr_t)column[k] % ALIGNMENT), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->bands > 0, t.spectrum != NULL, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, (int)((uintptr_t)t.spectrum % ALIGNMENT), c->what);
        if (c->bands == 0)
            TEST_ASSERT_NULL(table_spectrum(&t, 0));
        table_done(&t);
        TEST_ASSERT_NULL(t.Cm);
        TEST_ASSERT_NULL(t.spectrum);
        table_done(&t); /* a zeroed one */
    }
}

/* What is set is what is got, each column its own; past the bands there is 0, and
 * neighbours keep what they hold. */
static void test_set_and_get(void)
{
    enum { ROWS = 11 };
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table t;
    float spectrum[31];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &t));
    memset(t.spectrum, 0x7f, ROWS * t.stride * sizeof *t.spectrum);
    for (size_t step = 0; step < ROWS; step++) {
        size_t row = (step * 7) % ROWS; /* in no order */
        double x = 100.0 * (double)row;
        struct table_row values = {
            x + 1, x + 2, x + 3, { x + 4, x + 5, x + 6 }, { x + 7, x + 8, x + 9 }
        };
        for (int i = 0; i < 31; i++)
            spectrum[i] = (float)(x + 10 + i);
        table_set(&t, row, &values, spectrum);
    }
    for (size_t row = 0; row < ROWS; row++) {
        double x = 100.0 * (double)row;
        struct table_row got;
        const double *column[COLUMNS];
        columns_of(&t, column);
        table_get(&t, row, &got);
        TEST_ASSERT_EQUAL_DOUBLE(x + 1, got.Cm);
        TEST_ASSERT_EQUAL_DOUBLE(x + 2, got.Bm);
        TEST_ASSERT_EQUAL_DOUBLE(x + 3, got.Ch);
        for (int i = 0; i < 3; i++) {
            TEST_ASSERT_EQUAL_DOUBLE(x + 4 + i, got.Lab[i]);
            TEST_ASSERT_EQUAL_DOUBLE(x + 7 + i, got.rgb[i]);
        }
        for (int k = 0; k < COLUMNS; k++)
            TEST_ASSERT_EQUAL_DOUBLE(x + 1 + k, column[k][row]);
        for (size_t i = 0; i < t.stride; i++)
            TEST_ASSERT_EQUAL_FLOAT(i < 31 ? (float)(x + 10 + (double)i) : 0.0f,
                                    table_spectrum(&t, row)[i]);
    }
    table_done(&t);
}

static void compute_all(const struct recipe *recipe, unsigned threads, struct table *t)
{
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(recipe, SMALL_ROWS, t));
    if (t->spectrum != NULL)
        memset(t->spectrum, 0x7f, SMALL_ROWS * t->stride * sizeof *t->spectrum);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(t, 0, SMALL_ROWS, threads));
}

/* Property: the same bits for any number of threads, and in any pieces. */
static void test_same_rows_for_any_threads_and_chunks(void)
{
    static const char *const models[] = { "two-layer", "half-space", "paper" };
    static const unsigned threads[] = { 0, 2, 3, 7, 1000 };
    static const size_t chunks[] = { 1, 100, 256, 257, 714 };
    for (size_t m = 0; m < 3; m++) {
        struct recipe recipe = recipe_small(models[m]);
        struct table expect, got;
        TEST_ASSERT_EQUAL_size_t(SMALL_ROWS, grid_rows(&recipe.grid));
        compute_all(&recipe, 1, &expect);
        for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
            compute_all(&recipe, threads[i], &got);
            assert_rows_equal(&expect, 0, &got, 0, SMALL_ROWS, models[m]);
            table_done(&got);
        }
        for (size_t i = 0; i < sizeof chunks / sizeof *chunks; i++) {
            TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, chunks[i], &got));
            for (size_t first = 0; first < SMALL_ROWS; first += chunks[i]) {
                size_t rest = SMALL_ROWS - first, count = rest < chunks[i] ? rest : chunks[i];
                TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&got, first, count, 3));
                assert_rows_equal(&expect, first, &got, 0, count, models[m]);
            }
            table_done(&got);
        }
        table_done(&expect);
    }
}

/* Floats as numbers that neighbours differ by 1 in; those of spectra are not negative. */
static int32_t order_of(float x)
{
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Property: every row is the row maker's own, to the bit where the model has no other way. */
static const struct maker_case {
    const char *what, *model;
    double epidermis_mm, eta;
    bool to_the_bit;
} maker_cases[] = {
    { "two layers", "two-layer", 0.08, 1.4, false },
    { "a half space", "half-space", 0.08, 1.4, false },
    { "rows in and out of the formulas' range", "two-layer", 0.01, 1.4, false },
    { "all out of it", "two-layer", 0.0, 1.4, true },
    { "no polynomial", "half-space", 0.08, 1.6, true },
    { "no formulas", "kubelka-munk", 0.08, 1.4, true },
    { "no spectra", "paper", 0.08, 1.4, true },
};

static void assert_makers_row(const struct maker_case *c, struct row_maker *maker, size_t row,
                              const struct table *t)
{
    struct table_row expect, got;
    float spectrum[31];
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, row_maker_make(maker, row, &expect, spectrum),
                                  c->what);
    table_get(t, row, &got);
    if (c->to_the_bit)
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect, &got, sizeof got, c->what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect.Cm, &got.Cm, sizeof(double), c->what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect.Bm, &got.Bm, sizeof(double), c->what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expect.Ch, &got.Ch, sizeof(double), c->what);
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-11, expect.Lab[i], got.Lab[i], c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, expect.rgb[i], got.rgb[i], c->what);
    }
    if (t->spectrum == NULL)
        return;
    const float *stored = table_spectrum(t, row);
    for (int i = 0; i < 31; i++)
        TEST_ASSERT_INT32_WITHIN_MESSAGE(c->to_the_bit ? 0 : 1, order_of(spectrum[i]),
                                         order_of(stored[i]), c->what);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, stored[31]); /* padding */
}

static void test_rows_are_the_makers(void)
{
    for (size_t i = 0; i < sizeof maker_cases / sizeof *maker_cases; i++) {
        const struct maker_case *c = &maker_cases[i];
        struct recipe recipe = recipe_small(c->model);
        struct row_maker *maker;
        struct table t;
        recipe.epidermis_mm = c->epidermis_mm;
        recipe.eta = c->eta;
        compute_all(&recipe, 2, &t);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&recipe, &maker));
        for (size_t row = 0; row < SMALL_ROWS; row++)
            assert_makers_row(c, maker, row, &t);
        row_maker_close(maker);
        table_done(&t);
    }
}

/* Property: without spectra the same parameters and colours. */
static void test_without_spectra(void)
{
    struct recipe recipe = recipe_small("two-layer");
    struct table whole, colours;
    compute_all(&recipe, 1, &whole);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init_without_spectra(&recipe, SMALL_ROWS, &colours));
    TEST_ASSERT_NULL(colours.spectrum);
    TEST_ASSERT_EQUAL_size_t(720 * 72, table_bytes(&colours)); /* 715, by eights */
    TEST_ASSERT_EQUAL_size_t(720 * 72 + 715 * 128, table_bytes(&whole));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&colours, 0, SMALL_ROWS, 2));
    const double *p[COLUMNS], *q[COLUMNS];
    columns_of(&whole, p);
    columns_of(&colours, q);
    for (int c = 0; c < COLUMNS; c++)
        TEST_ASSERT_EQUAL_MEMORY(p[c], q[c], SMALL_ROWS * sizeof(double));
    table_done(&whole);
    table_done(&colours);
}

static void test_refusals(void)
{
    struct recipe recipe = recipe_small("two-layer");
    struct table t, before;
    memset(&t, 77, sizeof t);
    before = t;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_init(&recipe, 0, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_init(&recipe, (size_t)GRID_ROWS_MAX + 1, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_init(&recipe, SIZE_MAX, &t));
    TEST_ASSERT_EQUAL_MEMORY(&before, &t, sizeof t);

    /* A recipe that has no row maker, and one whose rows cannot be made. */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, SMALL_ROWS, &t));
    t.recipe.step_nm = 7.0;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, table_compute(&t, 0, SMALL_ROWS, 3));
    t.recipe = recipe;
    t.recipe.eta = 3.9;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_compute(&t, 0, SMALL_ROWS, 3));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&t, 0, 0, 3)); /* no row, nothing to refuse */
    table_done(&t);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_memory);
    RUN_TEST(test_set_and_get);
    RUN_TEST(test_same_rows_for_any_threads_and_chunks);
    RUN_TEST(test_rows_are_the_makers);
    RUN_TEST(test_without_spectra);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
