/* test_nearest_many.c - nearest_find_many() against nearest_scan(), question by question: statuses,
 * rows and distances to the last bit, whatever stands beside a question and however many there
 * are. */
#include "match/nearest.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "match/kd_tree.h"
#include "match/match.h"
#include "tests/support/dice.h"
#include "unity.h"

enum { BY = 5, MOST = 4 * KD_TREE_TOGETHER + 3, MOST_K = 3 };

/* 60 x 20 x 60 = 72 000 rows, more than searches take in turns; every tenth there twice. */
static struct table skins;

static void copy_row(struct table *t, size_t from, size_t to)
{
    struct table_row row;
    table_get(t, from, &row);
    table_set(t, to, &row, table_spectrum(t, from));
}

void setUp(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    recipe.grid =
        (struct grid){ { 0.001, 0.5, 60, true }, { 0, 1, 20, false }, { 0.001, 0.1, 60, true } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, grid_rows(&recipe.grid), &skins));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&skins, 0, skins.n, 2));
    for (size_t row = 0; row + 5 < skins.n; row += 10)
        copy_row(&skins, row, row + 5);
}

void tearDown(void)
{
    table_done(&skins);
}

/* ---- questions ---------------------------------------------------------------------- */

static struct spectrum spectra[MOST];
static struct nearest_query questions[MOST];
static const struct nearest_range some = { { 0.002, 0.2, 0.002 }, { 0.3, 0.9, 0.06 } },
                                  nothing = { { 7.0, 7.0, 7.0 }, { 8.0, 8.0, 8.0 } },
                                  none = { { 0.3, 0.0, 0.0 }, { 0.1, 1.0, 1.0 } };

/* By turns: rows, near them, off them, far away, as no tree takes them; within ranges that hold
 * rows, none, or are none; with a band missing, with too few, without a colour. */
enum { SORTS = 12 };

static void make_question(const struct table *t, size_t number, struct dice *dice)
{
    static const double noise[SORTS] = { 0.0,  0.002, 0.05, 10.0,  1e18,  0.002,
                                         0.05, 0.002, 0.0,  0.002, 0.002, 0.0 };
    size_t sort = number % SORTS, row = dice_below(dice, t->n);
    struct spectrum *s = &spectra[number];
    struct nearest_query *q = &questions[number];
    double wide = noise[sort];
    *s = (struct spectrum){ .first_nm = t->recipe.first_nm,
                            .step_nm = t->recipe.step_nm,
                            .n = t->recipe.bands,
                            .specular = SPECULAR_SCE,
                            .aperture_mm = NAN };
    *q = (struct nearest_query){ .has_colour = sort != 10, .spectrum = s };
    for (size_t i = 0; i < s->n; i++)
        s->value[i] = (double)table_spectrum(t, row)[i] + dice_between(dice, -wide, wide);
    const double Lab[3] = { t->L[row], t->a[row], t->b[row] },
                 rgb[3] = { t->red[row], t->green[row], t->blue[row] };
    for (int i = 0; i < 3; i++) {
        q->Lab[i] = Lab[i] + 100.0 * dice_between(dice, -wide, wide);
        q->rgb[i] = rgb[i] + dice_between(dice, -wide, wide);
    }
    if (sort == 5 || sort == 6)
        q->range = &some;
    if (sort == 7 || sort == 8)
        q->range = sort == 7 ? &nothing : &none;
    for (size_t band = 0; band < (sort == 9 ? 1u : sort == 10 ? s->n - 3 : 0u); band++)
        s->value[(7 * band) % s->n] = NAN;
}

/* ---- answers ------------------------------------------------------------------------ */

struct answers {
    struct nearest_hit hits[MOST * MOST_K];
    size_t found[MOST];
    enum status status[MOST];
};

static void assert_answered(const struct nearest *nearest, size_t n, size_t k, const char *what)
{
    static struct answers got;
    struct nearest_work together = { 0 }, single = { 0 };
    memset(&got, 77, sizeof got);
    for (size_t i = 0; i < n; i++)
        questions[i].work = &together;
    nearest_find_many(nearest, n, questions, k, got.hits, got.found, got.status);
    for (size_t i = 0; i < n; i++) {
        struct nearest_hit expect[MOST_K];
        struct nearest_query q = questions[i];
        size_t found = 0;
        q.work = NULL;
        memset(expect, 77, sizeof expect);
        enum status s = nearest_scan(nearest, &q, k, expect, &found);
        TEST_ASSERT_EQUAL_INT_MESSAGE(s, got.status[i], what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(found, got.found[i], what);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect, got.hits + i * k, k * sizeof *expect, what);
        q.work = &single;
        (void)nearest_find(nearest, &q, k, expect, &found);
    }
    TEST_ASSERT_EQUAL_size_t_MESSAGE(single.rows, together.rows, what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(single.judged, together.judged, what);
}

static void ask(const struct table *t, enum match_by by, struct dice *dice)
{
    static const size_t numbers[] = {
        0, 1, 2, KD_TREE_TOGETHER - 1, KD_TREE_TOGETHER, KD_TREE_TOGETHER + 1, MOST
    };
    struct nearest *nearest;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(t, by, &nearest));
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        for (size_t k = 1; k <= MOST_K; k += 2) {
            char what[64];
            snprintf(what, sizeof what, "by %s, %zu questions, k %zu", match_by_name(by),
                     numbers[i], k);
            for (size_t number = 0; number < numbers[i]; number++)
                make_question(t, number, dice);
            assert_answered(nearest, numbers[i], k, what);
        }
    nearest_close(nearest);
}

static void test_as_one_by_one(void)
{
    struct dice dice = { 91 };
    for (int by = 0; by < BY; by++)
        ask(&skins, (enum match_by)by, &dice);
}

/* So few rows that a tree has no boxes; and rows that no tree takes. */
static void test_without_boxes_and_without_tree(void)
{
    struct dice dice = { 92 };
    size_t n = skins.n;
    skins.n = 20;
    for (int by = 0; by < BY; by++)
        ask(&skins, (enum match_by)by, &dice);
    skins.n = 300;
    skins.b[200] = skins.blue[200] = NAN;
    skins.spectrum[200 * skins.stride] = (float)INFINITY;
    for (int by = 0; by < BY; by++)
        ask(&skins, (enum match_by)by, &dice);
    skins.n = n;
}

/* The same question in all places gives the same answer in all. */
static void test_duplicates(void)
{
    struct dice dice = { 93 };
    struct nearest *nearest;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_SPECTRUM, &nearest));
    make_question(&skins, 2, &dice);
    for (size_t i = 0; i < MOST; i++)
        questions[i] = questions[2];
    assert_answered(nearest, MOST, 3, "alike");
    nearest_close(nearest);
}

static void test_k_0_is_refused(void)
{
    struct dice dice = { 94 };
    struct nearest *nearest;
    struct answers got = { .found = { 5, 5 } };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&skins, MATCH_LAB, &nearest));
    for (size_t i = 0; i < 2; i++)
        make_question(&skins, i, &dice);
    nearest_find_many(nearest, 2, questions, 0, got.hits, got.found, got.status);
    for (size_t i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, got.status[i]);
        TEST_ASSERT_EQUAL_size_t(0, got.found[i]);
    }
    nearest_close(nearest);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_as_one_by_one);
    RUN_TEST(test_without_boxes_and_without_tree);
    RUN_TEST(test_duplicates);
    RUN_TEST(test_k_0_is_refused);
    return UNITY_END();
}
