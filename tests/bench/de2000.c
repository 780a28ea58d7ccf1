/* de2000.c - the exact nearest rows by CIEDE2000: speed beside looking at every row by the
 * vectorised formula, and the answers against the textbook formula's of every row.
 *
 *     de2000 SPEED-QUERIES CHECKED-QUERIES [ROWS ...]
 *
 * Tables of the two-layer model (10 000, 100 000 and 1 000 000 rows), made in memory; queries and
 * the check as tests/support/de2000_rows.h says.  Ends with status 1 where a row or a distance
 * differs. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "colour/delta_e.h"
#include "colour/delta_e_many.h"
#include "match/nearest.h"
#include "tests/support/de2000_rows.h"

enum { K = 5, PIECE = 4096, MOST_SPEED = 20000 };

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

/* Of this thread: what takes milliseconds others interrupt. */
static double cpu_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
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

/* ---- speed -------------------------------------------------------------------------- */

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

/* Every row (CPU time) and the search (by the clock) in turns: 25 searches to a look at all. */
static void time_sort(const struct nearest *nearest, const struct table *t, enum de2000_sort sort,
                      size_t n, size_t k)
{
    static double took[MOST_SPEED], took_all[MOST_SPEED];
    struct nearest_work work = { 0 };
    struct nearest_hit hits[K];
    size_t found, all = 0;
    for (size_t i = 0; i < n; i++) {
        struct nearest_query query;
        de2000_query(t, sort, i, &query);
        query.work = &work;
        double start = now_us();
        if (nearest_find(nearest, &query, k, hits, &found) != STATUS_OK)
            fail("no answer");
        took[i] = now_us() - start;
        if (i % 25 != 0)
            continue;
        start = cpu_us();
        size_t row = look_at_all(t, query.Lab);
        took_all[all++] = cpu_us() - start;
        if (row != hits[0].row &&
            fabs(delta_e_2000(query.Lab, (double[3]){ t->L[row], t->a[row], t->b[row] }) -
                 hits[0].distance) > 1e-9)
            fail("another row by the vectorised formula");
    }
    double median = quantile(took, n, 50), every = quantile(took_all, all, 50);
    printf("%8zu rows  %-7s k %zu: %8.2f us, 99 %% below %8.2f; every row %8.0f us (%.1f ns a "
           "row); ratio "
           "%.0f; rows looked at %.1f, judged %.0f\n",
           t->n, sort == DE2000_OFF ? "off" : "typical", k, median, quantile(took, n, 99), every,
           1e3 * every / (double)t->n, every / median, (double)work.rows / (double)n,
           (double)work.judged / (double)n);
    fflush(stdout);
}

/* ---- the check ---------------------------------------------------------------------------------
 */

struct check {
    const struct nearest *nearest;
    const struct table *table;
    size_t wrong[PARALLEL_MAX_THREADS], limited[PARALLEL_MAX_THREADS];
};

static enum status check_one(size_t number, unsigned worker, void *context)
{
    struct check *check = context;
    if (!de2000_agrees(check->nearest, check->table, number, &check->limited[worker]))
        check->wrong[worker]++;
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
        if (de2000_table(strtoul(argc > 3 ? argv[3 + i] : usual[i], NULL, 10), &t) != STATUS_OK)
            fail("no table");
        double start = now_us();
        if (nearest_open(&t, MATCH_DE2000, &nearest) != STATUS_OK)
            fail("no index");
        printf("%8zu rows  index made in %.0f ms\n", t.n, 1e-3 * (now_us() - start));
        for (int sort = 0; sort < DE2000_SORTS && speed > 0; sort++)
            for (size_t k = 1; k <= K; k += K - 1)
                time_sort(nearest, &t, (enum de2000_sort)sort,
                          speed < MOST_SPEED ? speed : MOST_SPEED, k);
        good = (checked == 0 || check_answers(nearest, &t, checked)) && good;
        nearest_close(nearest);
        table_done(&t);
    }
    return good ? 0 : 1;
}
