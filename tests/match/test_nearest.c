/* test_nearest.c - every way of searching against a search that looks at every row
 * and sorts them all, with distances of its own (tests/support/textbook.h). */
#include "match/nearest.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/dice.h"
#include "tests/support/textbook.h"
#include "unity.h"

enum { TABLES = 3, BY = 5, QUERIES = 240 };

/* Coarse two-layer: 9 x 5 x 12 = 540 rows.  Paper: 20 x 6 x 15 = 1 800 rows; of
 * its 8-bit codes many agree.  Half-space with a Cm of 0: 15 + 5 x 4 x 15 = 315. */
static struct table tables[TABLES];
static const char *const table_names[TABLES] = { "two-layer", "paper", "half-space with Cm 0" };

static void make(struct table *t, const char *model, struct grid grid)
{
    struct recipe recipe = recipe_default(model_find(model));
    recipe.grid = grid;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, grid_rows(&grid), t));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(t, 0, t->n, 2));
}

void setUp(void)
{
    make(&tables[0], "two-layer",
         (struct grid){ { 0.001, 0.5, 9, true }, { 0, 1, 5, false }, { 0.001, 0.1, 12, true } });
    make(&tables[1], "paper",
         (struct grid){ { 0.001, 0.5, 20, true }, { 0, 1, 6, false }, { 0.001, 0.1, 15, true } });
    make(&tables[2], "half-space",
         (struct grid){ { 0.0, 0.5, 6, false }, { 0, 1, 4, false }, { 0.001, 0.1, 15, false } });
}

void tearDown(void)
{
    for (int i = 0; i < TABLES; i++)
        table_done(&tables[i]);
}

/* ---- the search that looks at everything ------------------------------------------ */

static double code_of(double linear, bool rounded)
{
    double code = textbook_code(linear);
    return rounded ? fmin(fmax(round(code), 0.0), 255.0) : code;
}

static double distance_to(const struct table *t, size_t row, enum match_by by,
                          const struct nearest_query *q)
{
    double rgb[3] = { t->red[row], t->green[row], t->blue[row] };
    double Lab[3] = { t->L[row], t->a[row], t->b[row] }, sum = 0.0;
    switch (by) {
    case MATCH_RGB:
    case MATCH_RGB_FLOAT:
        for (int i = 0; i < 3; i++)
            sum += pow(code_of(rgb[i], by == MATCH_RGB) - code_of(q->rgb[i], by == MATCH_RGB), 2.0);
        return sqrt(sum);
    case MATCH_LAB:
        for (int i = 0; i < 3; i++)
            sum += pow(Lab[i] - q->Lab[i], 2.0);
        return sqrt(sum);
    case MATCH_DE2000:
        return textbook_de2000(q->Lab, Lab);
    case MATCH_SPECTRUM:
        return textbook_rms(q->spectrum, t->recipe.first_nm, t->recipe.step_nm, t->recipe.bands,
                            table_spectrum(t, row), NULL);
    }
    return NAN;
}

static int by_distance_then_row(const void *a, const void *b)
{
    const struct nearest_hit *x = a, *y = b;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return x->row < y->row ? -1 : 1;
}

static void sort_all(const struct table *t, enum match_by by, const struct nearest_query *q,
                     struct nearest_hit *all)
{
    for (size_t i = 0; i < t->n; i++)
        all[i] = (struct nearest_hit){ i, distance_to(t, i, by, q) };
    qsort(all, t->n, sizeof *all, by_distance_then_row);
}

/* Same rows in the same order; where two rows differ by less than the roundings of
 * two formulas, either order is right.  8-bit codes leave no such room. */
static void assert_same(const struct table *t, enum match_by by, const struct nearest_query *q,
                        const struct nearest_hit *all, const struct nearest_hit *hits, size_t found,
                        const char *what)
{
    for (size_t i = 0; i < found; i++) {
        double expect = all[i].distance, slack = by == MATCH_RGB ? 0.0 : 1e-10 * (1.0 + expect);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(slack, expect, hits[i].distance, what);
        if (hits[i].row != all[i].row) {
            TEST_ASSERT_MESSAGE(hits[i].row < t->n && by != MATCH_RGB, what);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(slack, expect, distance_to(t, hits[i].row, by, q),
                                              what);
        }
        if (i > 0)
            TEST_ASSERT_MESSAGE(by_distance_then_row(&hits[i - 1], &hits[i]) < 0, what);
    }
}

/* ---- queries ---------------------------------------------------------------------- */

struct question {
    struct spectrum spectrum;
    struct nearest_query query;
};

/* By turns: a row of the table itself, near one, anywhere (L -40..140, colours
 * that no screen has, noise for a spectrum), and the far ends. */
static void ask(const struct table *t, size_t number, struct dice *dice, struct question *ret)
{
    size_t row = dice_below(dice, t->n);
    double spread = number % 4 == 1 ? 0.02 : 0.0;
    bool anywhere = number % 4 >= 2;
    ret->spectrum = (struct spectrum){ .first_nm = t->recipe.first_nm,
                                       .step_nm = t->recipe.step_nm,
                                       .n = t->recipe.bands,
                                       .specular = SPECULAR_SCE,
                                       .aperture_mm = NAN };
    for (size_t i = 0; i < t->recipe.bands; i++)
        ret->spectrum.value[i] =
            anywhere ? dice_between(dice, 0.0, number % 4 == 3 ? 1.5 : 0.6)
                     : (double)table_spectrum(t, row)[i] + dice_between(dice, -spread, spread);
    ret->query = (struct nearest_query){ .has_colour = true, .spectrum = &ret->spectrum };
    double Lab[3] = { t->L[row], t->a[row], t->b[row] };
    double rgb[3] = { t->red[row], t->green[row], t->blue[row] };
    for (int i = 0; i < 3; i++) {
        double half = i == 0 ? 90.0 : 150.0, middle = i == 0 ? 50.0 : 0.0;
        ret->query.Lab[i] = anywhere ? dice_between(dice, middle - half, middle + half)
                                     : Lab[i] + dice_between(dice, -100 * spread, 100 * spread);
        ret->query.rgb[i] =
            anywhere ? dice_between(dice, -0.5, 1.5) : rgb[i] + dice_between(dice, -spread, spread);
    }
    if (number % 8 == 3)
        ret->query.Lab[0] = number % 16 == 3 ? -40.0 : 140.0;
    if (number % 8 == 7) /* between the table's colours, but paler or redder */
        ret->query.Lab[0] = t->L[row];
}

static void test_against_sorting_everything(void)
{
    for (int table = 0; table < TABLES; table++) {
        const struct table *t = &tables[table];
        struct nearest_hit *all = calloc(t->n, sizeof *all);
        struct nearest_hit *hits = calloc(t->n + 5, sizeof *hits);
        TEST_ASSERT_TRUE(all != NULL && hits != NULL);
        for (int by = 0; by < BY; by++) {
            struct dice dice = { 1000u * (unsigned)table + (unsigned)by };
            struct nearest *nearest;
            char what[96];
            if (by == MATCH_SPECTRUM && t->spectrum == NULL)
                continue;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(t, (enum match_by)by, &nearest));
            for (size_t number = 0; number < QUERIES; number++) {
                static struct question q;
                const size_t ks[] = { 1, 3, 17, t->n + 5 };
                ask(t, number, &dice, &q);
                sort_all(t, (enum match_by)by, &q.query, all);
                for (size_t i = 0; i < (number % 20 == 0 ? 4u : 3u); i++) {
                    size_t found = 77, expect = ks[i] < t->n ? ks[i] : t->n;
                    snprintf(what, sizeof what, "%s by %s, query %zu, k = %zu", table_names[table],
                             match_by_name((enum match_by)by), number, ks[i]);
                    TEST_ASSERT_EQUAL_INT_MESSAGE(
                        STATUS_OK, nearest_find(nearest, &q.query, ks[i], hits, &found), what);
                    TEST_ASSERT_EQUAL_size_t_MESSAGE(expect, found, what);
                    assert_same(t, (enum match_by)by, &q.query, all, hits, found, what);
                }
            }
            nearest_close(nearest);
        }
        free(all);
        free(hits);
    }
}

/* ---- ties ------------------------------------------------------------------------- */

/* 8-bit codes tie often, also in the middle of a list of k; that they do here is
 * shown, so that the test above has met them. */
static void test_codes_tie(void)
{
    const struct table *t = &tables[1];
    struct dice dice = { 7 };
    struct nearest *nearest;
    int tied = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(t, MATCH_RGB, &nearest));
    for (size_t number = 0; number < QUERIES; number++) {
        static struct question q;
        struct nearest_hit hits[3];
        size_t found;
        ask(t, number, &dice, &q);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q.query, 3, hits, &found));
        tied += hits[0].distance == hits[1].distance || hits[1].distance == hits[2].distance;
    }
    nearest_close(nearest);
    TEST_ASSERT_TRUE(tied > QUERIES / 20);
}

/* A handful of rows set by hand; spectra constant at `value`. */
static void set_rows(struct table *t, size_t n, const double (*Lab)[3], const double *value)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    float spectrum[31];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, n, t));
    for (size_t i = 0; i < n; i++) {
        struct table_row row = {
            0.1, 0.5, 0.05, { Lab[i][0], Lab[i][1], Lab[i][2] }, { 0.2, 0.2, 0.2 }
        };
        for (int band = 0; band < 31; band++)
            spectrum[band] = (float)value[i];
        table_set(t, i, &row, spectrum);
    }
}

/* expect: all rows alike, so the order is that of the ids. */
static void test_equal_rows_come_by_id(void)
{
    static const double Lab[6][3] = { { 50, 10, 10 }, { 50, 10, 10 }, { 50, 10, 10 },
                                      { 50, 10, 10 }, { 50, 10, 10 }, { 50, 10, 10 } };
    static const double value[6] = { 0.25, 0.25, 0.25, 0.25, 0.25, 0.25 };
    static struct spectrum s = { .first_nm = 400, .step_nm = 10, .n = 31 };
    struct nearest_query q = { true, { 55, 12, 9 }, { 0.3, 0.1, 0.2 }, &s, NULL, NULL };
    struct table t;
    for (size_t i = 0; i < 31; i++)
        s.value[i] = 0.5;
    set_rows(&t, 6, Lab, value);
    for (int by = 0; by < BY; by++) {
        struct nearest *nearest;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, (enum match_by)by, &nearest));
        for (size_t k = 1; k <= 6; k++) {
            struct nearest_hit hits[6];
            size_t found;
            TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, k, hits, &found));
            TEST_ASSERT_EQUAL_size_t(k, found);
            for (size_t i = 0; i < k; i++)
                TEST_ASSERT_EQUAL_size_t_MESSAGE(i, hits[i].row, match_by_name((enum match_by)by));
        }
        nearest_close(nearest);
    }
    table_done(&t);
}

/* Two sums of squares may differ in the last bit and have the same root: distances
 * are then equal, and it is the lower id that counts. */
static void test_equal_roots_come_by_id(void)
{
    /* 1 + 2^-52 and 1: both roots are 1. */
    static const double Lab[2][3] = { { 1.0, 0x1p-26, 0.0 }, { 1.0, 0.0, 0.0 } };
    static const double value[2] = { 0.25, 0.25 };
    struct nearest_query q = { .has_colour = true };
    struct nearest_hit hits[2];
    struct nearest *nearest;
    struct table t;
    size_t found;
    TEST_ASSERT_EQUAL_DOUBLE(1.0, sqrt(1.0 + 0x1p-52));
    set_rows(&t, 2, Lab, value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, MATCH_LAB, &nearest));
    for (size_t k = 1; k <= 2; k++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, k, hits, &found));
        TEST_ASSERT_EQUAL_size_t(0, hits[0].row);
        TEST_ASSERT_EQUAL_DOUBLE(1.0, hits[0].distance);
    }
    TEST_ASSERT_EQUAL_size_t(1, hits[1].row);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, hits[1].distance);
    nearest_close(nearest);
    table_done(&t);
}

/* expect: |dL|/S_L by hand, CIE 142: from L* -90 to 140, 190 and 1000 it is 168.0,
 * 280.0 and 154.1.  Nobody's skin, but the nearest is the last, behind a farther one. */
static void test_lightness_far_outside_its_range(void)
{
    static const double Lab[3][3] = { { 140.0, 0, 0 }, { 190.0, 0, 0 }, { 1000.0, 0, 0 } };
    static const double value[3] = { 0.25, 0.25, 0.25 };
    struct nearest_query q = { .has_colour = true, .Lab = { -90.0, 0, 0 } };
    struct nearest_hit hits[3];
    struct nearest *nearest;
    struct table t;
    size_t found;
    set_rows(&t, 3, Lab, value);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, MATCH_DE2000, &nearest));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, 1, hits, &found));
    TEST_ASSERT_EQUAL_size_t(2, hits[0].row);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 154.1, hits[0].distance);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, 3, hits, &found));
    TEST_ASSERT_EQUAL_size_t(0, hits[1].row);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 168.0, hits[1].distance);
    TEST_ASSERT_EQUAL_size_t(1, hits[2].row);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 280.0, hits[2].distance);
    nearest_close(nearest);
    table_done(&t);
}

/* ---- bands in common -------------------------------------------------------------- */

/* expect: multiples counted by hand; the table has 400..700 by 10.  Bands `skip`
 * on are not measured. */
static const struct bands_case {
    const char *what;
    double first_nm, step_nm;
    size_t n, missing, common;
} bands_cases[] = {
    { "the same", 400, 10, 31, 0, 31 },
    { "wider", 360, 10, 39, 0, 31 },
    { "narrower", 450, 10, 20, 0, 20 },
    { "half past the end", 600, 10, 20, 0, 11 },
    { "by 5 nm: every other", 380, 5, 81, 0, 31 },
    { "by 1 nm: every tenth", 390, 1, 321, 0, 31 },
    { "by 20 nm", 400, 20, 16, 0, 16 },
    { "3 nm from 358: 400, 430 .. 700", 358, 3, 140, 0, 11 },
    { "3 nm from 358 up to 670: 400 .. 670", 358, 3, 105, 0, 10 },
    { "one short of that", 358, 3, 104, 0, 9 },
    { "twelve bands, two not measured", 450, 10, 12, 2, 10 },
    { "twelve bands, three not measured", 450, 10, 12, 3, 9 },
    { "nothing measured", 400, 10, 31, 31, 0 },
    { "all in between", 405, 10, 30, 0, 0 },
    { "elsewhere", 710, 10, 31, 0, 0 },
    { "no bands", 400, 10, 0, 0, 0 },
};

static void test_common_bands(void)
{
    const struct table *t = &tables[0];
    struct nearest *nearest;
    struct dice dice = { 11 };
    struct nearest_hit *all = calloc(t->n, sizeof *all);
    TEST_ASSERT_NOT_NULL(all);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(t, MATCH_SPECTRUM, &nearest));
    for (size_t i = 0; i < sizeof bands_cases / sizeof *bands_cases; i++) {
        const struct bands_case *c = &bands_cases[i];
        static struct spectrum s;
        struct nearest_query q = { .spectrum = &s };
        struct nearest_hit hits[5];
        size_t found = 77;
        s = (struct spectrum){ .first_nm = c->first_nm, .step_nm = c->step_nm, .n = c->n };
        for (size_t band = 0; band < c->n; band++)
            s.value[band] = dice_between(&dice, 0.05, 0.6);
        for (size_t band = 0; band < c->missing; band++)
            s.value[(3 * band) % c->n] = NAN;
        for (size_t band = 0; c->missing == c->n && band < c->n; band++)
            s.value[band] = NAN;
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->common, nearest_common_bands(t, &s), c->what);
        enum status got = nearest_find(nearest, &q, 5, hits, &found);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->common >= NEAREST_MIN_BANDS ? STATUS_OK : STATUS_UNSUPPORTED, got, c->what);
        if (got == STATUS_OK) {
            sort_all(t, MATCH_SPECTRUM, &q, all);
            assert_same(t, MATCH_SPECTRUM, &q, all, hits, found, c->what);
        } else {
            TEST_ASSERT_EQUAL_size_t_MESSAGE(77, found, c->what);
        }
        /* nearest_rms() wants no ten bands. */
        for (size_t row = 0; row < t->n; row += 97) {
            double expect = textbook_rms(&s, 400.0, 10.0, 31, table_spectrum(t, row), NULL);
            double rms = nearest_rms(t, row, &s);
            if (c->common == 0)
                TEST_ASSERT_MESSAGE(isnan(rms), c->what);
            else
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, expect, rms, c->what);
        }
    }
    nearest_close(nearest);
    free(all);
}

/* A table by 5 nm and a spectrum by 10: the other way round. */
static void test_common_bands_of_a_finer_table(void)
{
    static struct spectrum s = { .first_nm = 360, .step_nm = 10, .n = 43 };
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct nearest *nearest;
    struct nearest_hit all[8], hits[8];
    struct nearest_query q = { .spectrum = &s };
    struct table t;
    size_t found;
    recipe.step_nm = 5.0;
    recipe.bands = 61;
    recipe.grid =
        (struct grid){ { 0.1, 0.5, 2, false }, { 0, 1, 2, false }, { 0.01, 0.1, 2, false } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, 8, &t));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&t, 0, 8, 1));
    for (size_t i = 0; i < s.n; i++)
        s.value[i] = 0.01 * (double)i;
    TEST_ASSERT_EQUAL_size_t(31, nearest_common_bands(&t, &s));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&t, MATCH_SPECTRUM, &nearest));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, 8, hits, &found));
    sort_all(&t, MATCH_SPECTRUM, &q, all);
    assert_same(&t, MATCH_SPECTRUM, &q, all, hits, 8, "table by 5 nm");
    nearest_close(nearest);
    table_done(&t);
}

static void test_table_without_spectra_has_no_bands(void)
{
    static struct spectrum s = { .first_nm = 400, .step_nm = 10, .n = 31 };
    TEST_ASSERT_EQUAL_size_t(0, nearest_common_bands(&tables[1], &s));
    TEST_ASSERT_TRUE(isnan(nearest_rms(&tables[1], 0, &s)));
}

/* ---- refusals, names, threads ------------------------------------------------------ */

static void test_refusals(void)
{
    static struct spectrum s = { .first_nm = 400, .step_nm = 10, .n = 31 };
    struct nearest_query colourless = { .has_colour = false, .spectrum = &s };
    struct nearest_hit hit = { 77, 78.0 };
    struct nearest *nearest, *untouched = (struct nearest *)&s;
    size_t found = 79;
    for (int by = 0; by < BY; by++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&tables[0], (enum match_by)by, &nearest));
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, nearest_find(nearest, &colourless, 0, &hit, &found));
        if (by != MATCH_SPECTRUM)
            TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED,
                                  nearest_find(nearest, &colourless, 1, &hit, &found));
        TEST_ASSERT_EQUAL_size_t(77, hit.row);
        TEST_ASSERT_EQUAL_size_t(79, found);
        nearest_close(nearest);
    }
    nearest = untouched;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, nearest_open(&tables[1], MATCH_SPECTRUM, &nearest));
    TEST_ASSERT_EQUAL_PTR(untouched, nearest);
    nearest_close(NULL);
}

/* expect: the words that --by takes. */
static void test_names(void)
{
    TEST_ASSERT_EQUAL_STRING("rgb", match_by_name(MATCH_RGB));
    TEST_ASSERT_EQUAL_STRING("rgb-float", match_by_name(MATCH_RGB_FLOAT));
    TEST_ASSERT_EQUAL_STRING("lab", match_by_name(MATCH_LAB));
    TEST_ASSERT_EQUAL_STRING("de2000", match_by_name(MATCH_DE2000));
    TEST_ASSERT_EQUAL_STRING("spectrum", match_by_name(MATCH_SPECTRUM));
}

struct asker {
    const struct nearest *nearest[BY];
    struct nearest_hit hits[BY][QUERIES][3];
    bool good;
};

static void *ask_everything(void *argument)
{
    struct asker *a = argument;
    a->good = true;
    for (int by = 0; by < BY; by++) {
        struct dice dice = { 99 };
        for (size_t number = 0; number < QUERIES; number++) {
            struct question q;
            size_t found;
            ask(&tables[0], number, &dice, &q);
            a->good = a->good && nearest_find(a->nearest[by], &q.query, 3, a->hits[by][number],
                                              &found) == STATUS_OK;
        }
    }
    return NULL;
}

/* Property: threads that search at a time get what one alone gets. */
static void test_threads_share_a_search(void)
{
    enum { THREADS = 4 };
    static struct asker asker[THREADS + 1];
    struct nearest *nearest[BY];
    pthread_t thread[THREADS];
    for (int by = 0; by < BY; by++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&tables[0], (enum match_by)by, &nearest[by]));
        for (int i = 0; i <= THREADS; i++)
            asker[i].nearest[by] = nearest[by];
    }
    ask_everything(&asker[THREADS]);
    for (int i = 0; i < THREADS; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread[i], NULL, ask_everything, &asker[i]));
    for (int i = 0; i < THREADS; i++)
        pthread_join(thread[i], NULL);
    for (int i = 0; i <= THREADS; i++) {
        TEST_ASSERT_TRUE(asker[i].good);
        TEST_ASSERT_EQUAL_MEMORY(asker[THREADS].hits, asker[i].hits, sizeof asker[i].hits);
    }
    for (int by = 0; by < BY; by++)
        nearest_close(nearest[by]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_against_sorting_everything);
    RUN_TEST(test_codes_tie);
    RUN_TEST(test_equal_rows_come_by_id);
    RUN_TEST(test_equal_roots_come_by_id);
    RUN_TEST(test_lightness_far_outside_its_range);
    RUN_TEST(test_common_bands);
    RUN_TEST(test_common_bands_of_a_finer_table);
    RUN_TEST(test_table_without_spectra_has_no_bands);
    RUN_TEST(test_refusals);
    RUN_TEST(test_names);
    RUN_TEST(test_threads_share_a_search);
    return UNITY_END();
}
