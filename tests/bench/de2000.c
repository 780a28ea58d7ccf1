/* de2000.c - the exact nearest rows by CIEDE2000: speed beside looking at every row by the
 * vectorised formula, and the answers against the textbook formula's of every row.
 *
 *     de2000 SPEED-QUERIES CHECKED-QUERIES [ROWS ...]
 *
 * Tables of the two-layer model of about so many rows (10 000, 100 000 and 1 000 000), Cm and Ch
 * evenly spaced in the logarithm, made in memory.  Queries: a row and a step of chance direction,
 * 0.5 to 1 dE*ab long (`typical`) or 3 to 10 (`off`).  The check takes every row's distance by
 * delta_e_2000_squares() and by delta_e_2000() where that could be among the nearest, and shares no
 * code with the search.  Ends with status 1 where a row or a distance differs. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "colour/delta_e.h"
#include "colour/delta_e_many.h"
#include "match/nearest.h"
#include "tests/support/dice.h"

enum { K = 5, PIECE = 4096, NEAR = 256, MOST_SPEED = 20000 };

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int compare(const void *left, const void *right)
{
    double x = *(const double *)left, y = *(const double *)right;
    return (x > y) - (x < y);
}

static double quantile(double *took, size_t n, size_t percent)
{
    qsort(took, n, sizeof *took, compare);
    return took[n * percent / 100];
}

static void fail(const char *what)
{
    fprintf(stderr, "de2000: %s\n", what);
    exit(1);
}

/* ---- the table and what is asked of it ------------------------------------------------------ */

static void make_table(size_t rows, struct table *t)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    size_t side = (size_t)lround(cbrt((double)rows));
    recipe.grid = (struct grid){ { 0.001, 0.5, side, true },
                                 { 0, 1, (rows + side * side / 2) / (side * side), false },
                                 { 0.001, 0.1, side, true } };
    if (table_init(&recipe, grid_rows(&recipe.grid), t) != STATUS_OK ||
        table_compute(t, 0, t->n, parallel_cores()) != STATUS_OK)
        fail("no table");
}

static const struct sort {
    const char *what;
    double low, high; /* of the step, dE*ab */
} sorts[] = { { "typical", 0.5, 1.0 }, { "off", 3.0, 10.0 } };

/* A number's query is the same whoever asks for it. */
static void make_query(const struct table *t, const struct sort *sort, size_t number,
                       struct nearest_query *ret)
{
    struct dice dice = { 1000003u * (number + 1) + (sort->low > 1.0) };
    size_t row = dice_below(&dice, t->n);
    double step[3], length;
    do {
        for (int i = 0; i < 3; i++)
            step[i] = dice_between(&dice, -1.0, 1.0);
        length = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    } while (length > 1.0 || length < 0.1);
    double by = dice_between(&dice, sort->low, sort->high) / length;
    *ret = (struct nearest_query){ .has_colour = true,
                                   .Lab = { t->L[row] + by * step[0], t->a[row] + by * step[1],
                                            t->b[row] + by * step[2] } };
}

/* A third of each parameter's range, on its scale; of every third query. */
static void make_range(size_t number, struct nearest_range *ret)
{
    struct dice dice = { 7919u * number };
    double Cm = dice_between(&dice, -3.0, -1.2), Bm = dice_between(&dice, 0.0, 0.7);
    double Ch = dice_between(&dice, -3.0, -1.7);
    *ret = (struct nearest_range){ { pow(10.0, Cm), Bm, pow(10.0, Ch) },
                                   { pow(10.0, Cm + 0.9), Bm + 0.33, pow(10.0, Ch + 0.7) } };
}

/* ---- speed ----------------------------------------------------------------------------------- */

/* The nearest by every row's square. */
static size_t look_at_all(const struct table *t, const double Lab[3])
{
    static double square[PIECE];
    double least = (double)INFINITY;
    size_t nearest = 0;
    for (size_t first = 0; first < t->n; first += PIECE) {
        size_t n = t->n - first < PIECE ? t->n - first : PIECE;
        delta_e_2000_squares(Lab, n, t->L + first, t->a + first, t->b + first, square);
        for (size_t i = 0; i < n; i++)
            if (square[i] < least) {
                least = square[i];
                nearest = first + i;
            }
    }
    return nearest;
}

/* Every row and the search in turns: 25 searches to a look at every row. */
static void time_sort(const struct nearest *nearest, const struct table *t, const struct sort *sort,
                      size_t n, size_t k)
{
    static double took[MOST_SPEED], took_all[MOST_SPEED];
    struct nearest_work work = { 0 };
    struct nearest_hit hits[K];
    size_t found, all = 0;
    for (size_t i = 0; i < n; i++) {
        struct nearest_query query;
        make_query(t, sort, i, &query);
        query.work = &work;
        double start = now_us();
        if (nearest_find(nearest, &query, k, hits, &found) != STATUS_OK)
            fail("no answer");
        took[i] = now_us() - start;
        if (i % 25 != 0)
            continue;
        start = now_us();
        size_t row = look_at_all(t, query.Lab);
        took_all[all++] = now_us() - start;
        if (row != hits[0].row &&
            fabs(delta_e_2000(query.Lab, (double[3]){ t->L[row], t->a[row], t->b[row] }) -
                 hits[0].distance) > 1e-9)
            fail("another row by the vectorised formula");
    }
    double median = quantile(took, n, 50), every = quantile(took_all, all, 50);
    printf("%8zu rows  %-7s k %zu: %8.2f us, 99 %% below %8.2f; every row %8.0f us (%.1f ns a "
           "row); ratio "
           "%.0f; rows looked at %.1f, judged %.0f\n",
           t->n, sort->what, k, median, quantile(took, n, 99), every, 1e3 * every / (double)t->n,
           every / median, (double)work.rows / (double)n, (double)work.judged / (double)n);
    fflush(stdout);
}

/* ---- the check ---------------------------------------------------------------------------------
 */

struct check {
    const struct nearest *nearest;
    const struct table *table;
    size_t queries;
    size_t wrong[PARALLEL_MAX_THREADS], limited[PARALLEL_MAX_THREADS];
};

struct judged {
    double distance;
    size_t row;
};

static int compare_judged(const void *left, const void *right)
{
    const struct judged *x = left, *y = right;
    if (x->distance != y->distance)
        return x->distance < y->distance ? -1 : 1;
    return (x->row > y->row) - (x->row < y->row);
}

static bool inside(const struct table *t, const struct nearest_range *range, size_t row)
{
    const double value[3] = { t->Cm[row], t->Bm[row], t->Ch[row] };
    for (int i = 0; range != NULL && i < 3; i++)
        if (value[i] < range->lo[i] || value[i] > range->hi[i])
            return false;
    return true;
}

/* Rows that may be among the K nearest, judged by the textbook's formula and sorted; `near` is cut
 * down to the K nearest when it is full. */
static size_t judge_all(const struct table *t, const struct nearest_query *query,
                        struct judged near[NEAR])
{
    double square[PIECE], limit = (double)INFINITY;
    size_t count = 0;
    for (size_t first = 0; first < t->n; first += PIECE) {
        size_t n = t->n - first < PIECE ? t->n - first : PIECE;
        delta_e_2000_squares(query->Lab, n, t->L + first, t->a + first, t->b + first, square);
        for (size_t i = 0; i < n; i++) {
            size_t row = first + i;
            if (square[i] > limit || !inside(t, query->range, row))
                continue;
            const double Lab[3] = { t->L[row], t->a[row], t->b[row] };
            near[count++] = (struct judged){ delta_e_2000(query->Lab, Lab), row };
            if (count < NEAR && !(count == K && limit == (double)INFINITY))
                continue;
            qsort(near, count, sizeof *near, compare_judged);
            count = K;
            double reach = near[K - 1].distance * (1.0 + 1e-9) + 1e-11;
            limit = reach * reach;
        }
    }
    qsort(near, count, sizeof *near, compare_judged);
    return count < K ? count : K;
}

static enum status check_one(size_t number, unsigned worker, void *context)
{
    struct check *check = context;
    const struct table *t = check->table;
    struct judged near[NEAR];
    struct nearest_hit hits[K];
    struct nearest_query query;
    struct nearest_range range;
    size_t found = 0;
    make_query(t, &sorts[number % 2], number, &query);
    make_range(number, &range);
    if (number % 6 >= 4) /* two in six, one of each sort */
        query.range = &range;
    enum status s = nearest_find(check->nearest, &query, number % 4 < 2 ? 1 : K, hits, &found);
    size_t expect = judge_all(t, &query, near);
    if (number % 4 < 2 && expect > 1)
        expect = 1;
    bool good = s == (expect > 0 ? STATUS_OK : STATUS_NOT_FOUND) && found == expect;
    for (size_t i = 0; good && i < expect; i++)
        good = hits[i].row == near[i].row && hits[i].distance == near[i].distance;
    check->wrong[worker] += good ? 0 : 1;
    check->limited[worker] += query.range != NULL ? 1 : 0;
    return STATUS_OK;
}

static bool check_answers(const struct nearest *nearest, const struct table *t, size_t queries)
{
    static struct check check;
    size_t wrong = 0, limited = 0;
    double start = now_us();
    check = (struct check){ .nearest = nearest, .table = t };
    if (parallel_run(queries, parallel_cores(), check_one, &check) != STATUS_OK)
        fail("no check");
    for (size_t i = 0; i < PARALLEL_MAX_THREADS; i++) {
        wrong += check.wrong[i];
        limited += check.limited[i];
    }
    printf("%8zu rows  %zu queries, half typical, half off, half k 1, half k %d, %zu of them "
           "within a range: "
           "%zu wrong (%.0f s)\n",
           t->n, queries, K, limited, wrong, 1e-6 * (now_us() - start));
    fflush(stdout);
    return wrong == 0;
}

int main(int argc, char **argv)
{
    static const char *const usual[] = { "10000", "100000", "1000000" };
    bool good = true;
    if (argc < 3)
        fail("usage: de2000 SPEED-QUERIES CHECKED-QUERIES [ROWS ...]");
    size_t speed = strtoul(argv[1], NULL, 10), checked = strtoul(argv[2], NULL, 10);
    for (int i = 0; i < (argc > 3 ? argc - 3 : 3); i++) {
        struct nearest *nearest;
        struct table t;
        make_table(strtoul(argc > 3 ? argv[3 + i] : usual[i], NULL, 10), &t);
        double start = now_us();
        if (nearest_open(&t, MATCH_DE2000, &nearest) != STATUS_OK)
            fail("no index");
        printf("%8zu rows  index made in %.0f ms\n", t.n, 1e-3 * (now_us() - start));
        for (size_t sort = 0; sort < 2 && speed > 0; sort++)
            for (size_t k = 1; k <= K; k += K - 1)
                time_sort(nearest, &t, &sorts[sort], speed < MOST_SPEED ? speed : MOST_SPEED, k);
        good = (checked == 0 || check_answers(nearest, &t, checked)) && good;
        nearest_close(nearest);
        table_done(&t);
    }
    return good ? 0 : 1;
}
