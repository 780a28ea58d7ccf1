/* test_nearest_range.c - answers within a range of Cm, Bm and Ch, and what they cost.
 *
 * expect: every row in order of distance, as nearest_scan() has them without a range (which
 * test_nearest holds to distances of its own), and of those the first k that lie in it. */
#include "match/nearest.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/dice.h"
#include "unity.h"

enum { BY = 5, ROWS = 25 * 9 * 24 };

static struct table skins;

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid =
        (struct grid){ { 0.001, 0.5, 25, true }, { 0, 1, 9, false }, { 0.001, 0.1, 24, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, ROWS, &skins));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&skins, 0, ROWS, 2));
}

void tearDown(void)
{
    table_done(&skins);
}

/* ---- queries and ranges ----------------------------------------------------------------- */

struct question {
    struct spectrum spectrum;
    struct nearest_query query;
};

/* A row, and noise of a size relative to 1. */
static void ask_near(size_t row, double noise, struct dice *dice, struct question *ret)
{
    ret->spectrum = (struct spectrum){ .first_nm = skins.recipe.first_nm,
                                       .step_nm = skins.recipe.step_nm,
                                       .n = skins.recipe.bands,
                                       .specular = SPECULAR_SCE,
                                       .aperture_mm = NAN };
    for (size_t i = 0; i < ret->spectrum.n; i++)
        ret->spectrum.value[i] =
            (double)table_spectrum(&skins, row)[i] + dice_between(dice, -noise, noise);
    ret->query = (struct nearest_query){
        .has_colour = true,
        .Lab = { skins.L[row], skins.a[row], skins.b[row] },
        .rgb = { skins.red[row], skins.green[row], skins.blue[row] },
        .spectrum = &ret->spectrum,
    };
    for (int i = 0; i < 3; i++) {
        ret->query.Lab[i] += 100.0 * dice_between(dice, -noise, noise);
        ret->query.rgb[i] += dice_between(dice, -noise, noise);
    }
}

static const struct range_case {
    const char *what;
    struct nearest_range range;
} range_cases[] = {
    { "all of it", { { -INFINITY, -INFINITY, -INFINITY }, { INFINITY, INFINITY, INFINITY } } },
    { "no pheomelanin", { { -INFINITY, 1.0, -INFINITY }, { INFINITY, 1.0, INFINITY } } },
    { "light skin", { { 0.0, 0.0, 0.0 }, { 0.01, 1.0, 1.0 } } },
    { "much blood", { { 0.0, 0.0, 0.05 }, { 1.0, 1.0, 1.0 } } },
    { "a corner", { { 0.3, 0.8, 0.05 }, { 0.5, 1.0, 0.1 } } },
    { "ends that are a row's", { { 0.001, 0.125, 0.001 }, { 0.5, 0.25, 0.001 } } },
    { "one row", { { 0.5, 1.0, 0.1 }, { 0.5, 1.0, 0.1 } } },
    { "thin in all ways", { { 0.02, 0.3, 0.01 }, { 0.03, 0.6, 0.02 } } },
    { "none", { { 0.6, 0.0, 0.0 }, { 0.7, 1.0, 1.0 } } },
    { "none between two rows", { { 0.0, 0.13, 0.0 }, { 1.0, 0.24, 1.0 } } },
};

static bool has(const struct nearest_range *r, size_t row)
{
    return skins.Cm[row] >= r->lo[0] && skins.Cm[row] <= r->hi[0] && skins.Bm[row] >= r->lo[1] &&
           skins.Bm[row] <= r->hi[1] && skins.Ch[row] >= r->lo[2] && skins.Ch[row] <= r->hi[2];
}

/* ---- the same rows as without an index ------------------------------------------------------ */

typedef enum status search(const struct nearest *, const struct nearest_query *, size_t,
                           struct nearest_hit *, size_t *);

static void assert_answer(search *find, const struct nearest *nearest, struct question *q, size_t k,
                          const struct nearest_hit *sorted, const char *what)
{
    static struct nearest_hit expect[ROWS], got[ROWS];
    size_t n = 0, found = 77;
    for (size_t i = 0; i < ROWS && n < k; i++)
        if (has(q->query.range, sorted[i].row))
            expect[n++] = sorted[i];
    memset(got, 0x55, sizeof got);
    enum status s = find(nearest, &q->query, k, got, &found);
    TEST_ASSERT_EQUAL_INT_MESSAGE(n == 0 ? STATUS_NOT_FOUND : STATUS_OK, s, what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(n == 0 ? 77 : n, found, what);
    if (n > 0)
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect, got, n * sizeof *got, what);
}

static void test_answers_lie_in_range(void)
{
    static const size_t ks[] = { 1, 2, 7, 300, ROWS };
    static struct nearest_hit sorted[ROWS];
    struct dice dice = { 91 };
    for (int by = 0; by < BY; by++) {
        struct nearest *nearest;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, (enum match_by)by, &nearest));
        for (size_t number = 0; number < 10; number++) {
            static struct question q;
            size_t n;
            ask_near(dice_below(&dice, ROWS), number % 2 == 0 ? 0.002 : 0.05, &dice, &q);
            TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_scan(nearest, &q.query, ROWS, sorted, &n));
            for (size_t i = 0; i < sizeof range_cases / sizeof *range_cases; i++) {
                char what[96];
                snprintf(what, sizeof what, "by %s: %s", match_by_name((enum match_by)by),
                         range_cases[i].what);
                q.query.range = &range_cases[i].range;
                assert_answer(nearest_find, nearest, &q, ks[number % 5], sorted, what);
                assert_answer(nearest_scan, nearest, &q, ks[number % 5], sorted, what);
            }
        }
        nearest_close(nearest);
    }
}

/* ---- work left out -------------------------------------------------------------------------- */

static struct nearest_work work_of(const struct nearest *nearest, struct question *q,
                                   const struct nearest_range *range)
{
    struct nearest_work work = { 0 };
    struct nearest_hit hit;
    size_t found;
    q->query.range = range;
    q->query.work = &work;
    (void)nearest_find(nearest, &q->query, 1, &hit, &found);
    return work;
}

/* expect: with an index no distance outside the range is ever taken, and where nothing lies
 * in it hardly a box is judged: the top's, and those that stand between rows. */
static void test_what_lies_outside_costs_nothing(void)
{
    static const struct nearest_range none = { { 0.6, 0, 0 }, { 0.7, 1, 1 } };
    static const struct nearest_range dark = { { 0.3, 0, 0 }, { 0.5, 1, 1 } };
    struct dice dice = { 92 };
    for (int by = 0; by < BY; by++) {
        struct nearest *nearest;
        size_t judged = 0, in_all = 0;
        if (by == MATCH_DE2000)
            continue; /* goes by lightness */
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, (enum match_by)by, &nearest));
        for (size_t number = 0; number < 50; number++) {
            static struct question q;
            size_t row = dice_below(&dice, ROWS / 5); /* light */
            ask_near(row, 0.03, &dice, &q);
            struct nearest_work work = work_of(nearest, &q, &none);
            TEST_ASSERT_EQUAL_size_t(0, work.rows);
            TEST_ASSERT_TRUE(work.judged <= 16);
            work = work_of(nearest, &q, &dark);
            TEST_ASSERT_TRUE(work.rows >= 1);
            TEST_ASSERT_TRUE(work.rows < 300);
            judged += work.judged;
            in_all += ROWS;
            TEST_ASSERT_TRUE(work_of(nearest, &q, NULL).rows >= 1);
        }
        TEST_ASSERT_TRUE(judged < in_all / 8);
        nearest_close(nearest);
    }
}

/* expect: added to what stands there; a scan judges all and takes the distance of those in it. */
static void test_work_adds_up(void)
{
    struct nearest_work work = { 1000000, 2000000 };
    struct dice dice = { 93 };
    static struct question q;
    struct nearest *nearest;
    struct nearest_hit hit;
    size_t found, inside = 0;
    for (size_t row = 0; row < ROWS; row++)
        inside += has(&range_cases[3].range, row) ? 1 : 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_LAB, &nearest));
    ask_near(5, 0.01, &dice, &q);
    q.query.work = &work;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_scan(nearest, &q.query, 1, &hit, &found));
    TEST_ASSERT_EQUAL_size_t(1000000 + ROWS, work.rows);
    q.query.range = &range_cases[3].range;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_scan(nearest, &q.query, 1, &hit, &found));
    TEST_ASSERT_EQUAL_size_t(1000000 + ROWS + inside, work.rows);
    TEST_ASSERT_EQUAL_size_t(2000000 + ROWS, work.judged);
    nearest_close(nearest);
}

/* ---- odd ones ------------------------------------------------------------------------------- */

/* A row whose Bm is no number lies in no range, and is found without one. */
static void test_rows_without_a_number(void)
{
    static const struct nearest_range any = { { -INFINITY, -INFINITY, -INFINITY },
                                              { INFINITY, INFINITY, INFINITY } };
    struct dice dice = { 94 };
    static struct question q;
    struct nearest *nearest;
    struct nearest_hit hit;
    size_t found;
    skins.Bm[1234] = NAN;
    for (int by = 0; by < BY; by++) {
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, (enum match_by)by, &nearest));
        ask_near(1234, 0.0, &dice, &q);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q.query, 1, &hit, &found));
        TEST_ASSERT_EQUAL_DOUBLE(0.0, hit.distance);
        q.query.range = &any;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q.query, 1, &hit, &found));
        TEST_ASSERT_TRUE(hit.row != 1234);
        nearest_close(nearest);
    }
}

static const struct nearest_range refused[] = {
    { { 0.2, 0, 0 }, { 0.1, 1, 1 } },
    { { 0, 0, NAN }, { 1, 1, 1 } },
    { { 0, 0, 0 }, { 1, NAN, 1 } },
    { { 0, 0, INFINITY }, { 1, 1, -INFINITY } },
};

static void test_refusals(void)
{
    struct dice dice = { 95 };
    static struct question q;
    struct nearest *nearest;
    struct nearest_hit hit = { 77, 78.0 };
    size_t found = 79;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_LAB, &nearest));
    ask_near(5, 0.01, &dice, &q);
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        q.query.range = &refused[i];
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, nearest_find(nearest, &q.query, 1, &hit, &found));
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, nearest_scan(nearest, &q.query, 1, &hit, &found));
        TEST_ASSERT_EQUAL_size_t(77, hit.row);
        TEST_ASSERT_EQUAL_size_t(79, found);
    }
    nearest_close(nearest);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_answers_lie_in_range);
    RUN_TEST(test_what_lies_outside_costs_nothing);
    RUN_TEST(test_work_adds_up);
    RUN_TEST(test_rows_without_a_number);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
