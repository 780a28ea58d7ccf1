/* search.c - exact nearest rows of a large table: ours beside nanoflann, in one program by turns.
 *
 *     search ROWS [FOLDER [turns]]
 *
 * ROWS is a cube (100 for 1 000 000): two-layer skins, Cm and Ch evenly in the logarithm.  Two
 * sorts of queries: `near` a row (dE*ab 0.5 to 1, or spectra with noise of 0.002) and `off` the
 * surface (dE*ab 3 to 10, or smoothly by 0.02 to 0.05 rms), as real skin is.  Nanoseconds a
 * query of CPU time, the median of the rounds, one thread: asked one by one, and all in one call
 * (`many`), as peers in Python are.  With FOLDER the spectra and queries are
 * left there as floats, for peers that are other programs.  With NO_PEER set spectra only.  With
 * `turns` only the nearest by spectrum is timed, a round for each line of its input after it has
 * said "ready": so a peer can have the other turns. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/huge_pages.h"
#include "match/nearest.h"
#include "tests/bench/peers/nanoflann.h"
#include "tests/support/skin_queries.h"

enum { QUERIES = 20000, ROUNDS = 7, MOST_K = 5 };

static double now_s(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *value, size_t n)
{
    qsort(value, n, sizeof *value, compare);
    return value[n / 2];
}

static _Noreturn void fail(const char *what)
{
    fprintf(stderr, "search: %s\n", what);
    exit(2);
}

/* ---- table and queries ------------------------------------------------------------------ */

static void make_table(size_t side, struct table *ret)
{
    double start = now_s(CLOCK_MONOTONIC);
    if (skin_table(side, ret) != STATUS_OK)
        fail("no memory for so many rows");
    printf("%zu rows computed in %.1f s\n", ret->n, now_s(CLOCK_MONOTONIC) - start);
}

struct queries {
    const char *what;
    struct skin_query query[QUERIES];
    struct nearest_query asked[QUERIES]; /* the same, without the spectra between them */
};

/* ---- searches --------------------------------------------------------------------------- */

static void time_ours(const struct nearest *nearest, const struct queries *q, size_t k,
                      double *took, double *rows, double *judged)
{
    struct nearest_hit hits[MOST_K];
    struct nearest_work work = { 0 };
    size_t found;
    double start = now_s(CLOCK_THREAD_CPUTIME_ID);
    for (size_t i = 0; i < QUERIES; i++)
        if (nearest_find(nearest, &q->query[i].query, k, hits, &found) != STATUS_OK)
            fail("no answer");
    *took = 1e9 * (now_s(CLOCK_THREAD_CPUTIME_ID) - start) / QUERIES;
    for (size_t i = 0; i < QUERIES; i++) {
        struct nearest_query counted = q->query[i].query;
        counted.work = &work;
        (void)nearest_find(nearest, &counted, k, hits, &found);
    }
    *rows = (double)work.rows / QUERIES;
    *judged = (double)work.judged / QUERIES;
}

static double time_many(const struct nearest *nearest, const struct queries *q, size_t k)
{
    static struct nearest_hit hits[QUERIES * MOST_K];
    static size_t found[QUERIES];
    static enum status status[QUERIES];
    double start = now_s(CLOCK_THREAD_CPUTIME_ID);
    nearest_find_many(nearest, QUERIES, q->asked, k, hits, found, status);
    double took = 1e9 * (now_s(CLOCK_THREAD_CPUTIME_ID) - start) / QUERIES;
    for (size_t i = 0; i < QUERIES; i++)
        if (status[i] != STATUS_OK)
            fail("no answer");
    return took;
}

static double time_peer(const struct peer_tree *tree, const struct queries *q, uint32_t *row)
{
    double start = now_s(CLOCK_THREAD_CPUTIME_ID);
    for (size_t i = 0; i < QUERIES; i++) {
        const double *Lab = q->query[i].query.Lab;
        row[i] = peer_tree_find(tree, (float[3]){ (float)Lab[0], (float)Lab[1], (float)Lab[2] });
    }
    return 1e9 * (now_s(CLOCK_THREAD_CPUTIME_ID) - start) / QUERIES;
}

static struct nearest *open_ours(const struct table *t, enum match_by by)
{
    struct nearest *nearest;
    double start = now_s(CLOCK_MONOTONIC);
    if (nearest_open(t, by, &nearest) != STATUS_OK)
        fail("no memory for an index");
    printf("index by %s made in %.2f s\n", match_by_name(by), now_s(CLOCK_MONOTONIC) - start);
    return nearest;
}

static void show_ours(const struct table *t, enum match_by by, const struct queries *q)
{
    struct nearest *nearest = open_ours(t, by);
    for (int sort = 0; sort < 2; sort++)
        for (size_t k = 1; k <= 5; k += 4) {
            double took[ROUNDS], many[ROUNDS], rows, judged;
            for (int round = 0; round < ROUNDS; round++) {
                time_ours(nearest, &q[sort], k, &took[round], &rows, &judged);
                many[round] = time_many(nearest, &q[sort], k);
            }
            printf("%-10s %-5s k=%zu %9.0f ns  many %9.0f ns  %7.1f rows %7.1f judged\n",
                   match_by_name(by), q[sort].what, k, median(took, ROUNDS), median(many, ROUNDS),
                   rows, judged);
        }
    nearest_close(nearest);
}

/* Leaves of 10, 16 and 32 points; its best counts. */
static void show_beside_peer(const struct table *t, const struct queries *q)
{
    static const size_t leaf[] = { 10, 16, 32 };
    enum { LEAVES = 3 };
    static uint32_t row[QUERIES];
    struct nearest *nearest = open_ours(t, MATCH_LAB);
    float *point = calloc(t->n, 3 * sizeof *point);
    struct peer_tree *tree[LEAVES];
    if (point == NULL)
        fail("no memory");
    for (size_t i = 0; i < t->n; i++) {
        point[3 * i] = (float)t->L[i];
        point[3 * i + 1] = (float)t->a[i];
        point[3 * i + 2] = (float)t->b[i];
    }
    for (int i = 0; i < LEAVES; i++) {
        double start = now_s(CLOCK_MONOTONIC);
        tree[i] = peer_tree_open(t->n, point, leaf[i]);
        printf("nanoflann, leaf %zu, made in %.2f s\n", leaf[i], now_s(CLOCK_MONOTONIC) - start);
    }
    for (int sort = 0; sort < 2; sort++) {
        double ours[ROUNDS], many[ROUNDS], peer[LEAVES][ROUNDS], rows, judged, best = INFINITY;
        for (int round = 0; round < ROUNDS; round++) {
            time_ours(nearest, &q[sort], 1, &ours[round], &rows, &judged);
            many[round] = time_many(nearest, &q[sort], 1);
            for (int i = 0; i < LEAVES; i++)
                peer[i][round] = time_peer(tree[i], &q[sort], row);
        }
        double own = median(ours, ROUNDS), together = median(many, ROUNDS);
        for (int i = 0; i < LEAVES; i++)
            best = fmin(best, median(peer[i], ROUNDS));
        printf("lab        %-5s k=1 %9.0f ns  many %9.0f ns  nanoflann %9.0f ns  ratio %.2f\n",
               q[sort].what, own, together, best, best / own);
    }
    for (int i = 0; i < LEAVES; i++)
        peer_tree_close(tree[i]);
    free(point);
    nearest_close(nearest);
}

/* A round for each line of the input. */
static void take_turns(const struct table *t, const struct queries *q)
{
    char line[64];
    struct nearest *nearest = open_ours(t, MATCH_SPECTRUM);
    puts("ready");
    fflush(stdout);
    while (fgets(line, sizeof line, stdin) != NULL) {
        for (int sort = 0; sort < 2; sort++) {
            double took, rows, judged;
            time_ours(nearest, &q[sort], 1, &took, &rows, &judged);
            printf("%s %.0f %.0f ", q[sort].what, time_many(nearest, &q[sort], 1), took);
        }
        puts("");
        fflush(stdout);
    }
    nearest_close(nearest);
}

static void show_all(const struct table *t, const struct queries *q)
{
    if (getenv("NO_PEER") == NULL) {
        show_beside_peer(t, q);
        show_ours(t, MATCH_LAB, q);
    }
    show_ours(t, MATCH_SPECTRUM, q);
}

/* ---- for other programs ----------------------------------------------------------------- */

static void leave(const char *folder, const char *name, size_t n, size_t stride, size_t bands,
                  const float *value)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.f32", folder, name);
    FILE *f = fopen(path, "wb");
    if (f == NULL)
        fail("cannot write into the folder");
    for (size_t i = 0; i < n; i++)
        if (fwrite(value + i * stride, sizeof *value, bands, f) != bands)
            fail("cannot write into the folder");
    if (fclose(f) != 0)
        fail("cannot write into the folder");
}

static void leave_queries(const char *folder, const struct queries *q)
{
    static float value[QUERIES][SPECTRUM_MAX_BANDS];
    for (size_t i = 0; i < QUERIES; i++)
        for (size_t band = 0; band < q->query[i].spectrum.n; band++)
            value[i][band] = (float)q->query[i].spectrum.value[band];
    leave(folder, q->what, QUERIES, SPECTRUM_MAX_BANDS, q->query[0].spectrum.n, value[0]);
}

int main(int argc, char **argv)
{
    /* On large pages, as rows are: it is not the look-up of a question's page that is timed. */
    struct queries *q = huge_pages_alloc(2, sizeof *q);
    struct table table;
    size_t side = argc > 1 ? strtoul(argv[1], NULL, 10) : 0;
    if (side < 2 || side > 400)
        fail("say how many values an axis has: 100 for a million rows");
    if (q == NULL)
        fail("no memory for questions");
    q[0].what = "near";
    q[1].what = "off";
    make_table(side, &table);
    for (int sort = 0; sort < 2; sort++) {
        skin_queries(&table, sort == 1, QUERIES, q[sort].query);
        for (size_t i = 0; i < QUERIES; i++)
            q[sort].asked[i] = q[sort].query[i].query;
    }
    if (argc > 2) {
        leave(argv[2], "rows", table.n, table.stride, table.recipe.bands, table.spectrum);
        leave_queries(argv[2], &q[0]);
        leave_queries(argv[2], &q[1]);
    }
    if (argc > 3)
        take_turns(&table, q);
    else
        show_all(&table, q);
    free(q);
    table_done(&table);
    return 0;
}
