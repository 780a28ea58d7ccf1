/* few.c - up to how many points judging all of them is quicker than a tree's boxes.
 *
 *     few [HEADER]
 *
 * Trees over parts of a table of skins, searched both ways by turns for the nearest two (as a match
 * does); nanoseconds of CPU time, medians.  The most rows up to which all sizes favour judging all,
 * on the surface and off it together, go into HEADER (src/match/kd_few.h). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "match/components.h"
#include "match/kd_layout.h"
#include "tests/support/dice.h"
#include "tests/support/skin_queries.h"

enum { QUERIES = 4000, ROUNDS = 9, MOST = 2048, SIDE = 20 };

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *value)
{
    qsort(value, ROUNDS, sizeof *value, compare);
    return value[ROUNDS / 2];
}

static _Noreturn void fail(const char *what)
{
    fprintf(stderr, "few: %s\n", what);
    exit(2);
}

/* ---- points ----------------------------------------------------------------------------- */

/* Of the rows, in an order by chance, and of the questions. */
struct points {
    size_t dims;
    double row[SIDE * SIDE * SIDE][COMPONENTS_DIMS], query[2 * QUERIES][COMPONENTS_DIMS];
};

static void shuffle(struct points *p)
{
    struct dice dice = { 11 };
    for (size_t i = SIDE * SIDE * SIDE - 1; i > 0; i--) {
        double kept[COMPONENTS_DIMS];
        size_t j = dice_below(&dice, i + 1);
        memcpy(kept, p->row[i], sizeof kept);
        memcpy(p->row[i], p->row[j], sizeof kept);
        memcpy(p->row[j], kept, sizeof kept);
    }
}

static void make_points(const struct table *t, bool spectra, struct points *ret)
{
    static struct skin_query query[2 * QUERIES];
    struct components *c;
    if (components_open(t, &c) != STATUS_OK)
        fail("no memory");
    skin_queries(t, false, QUERIES, query);
    skin_queries(t, true, QUERIES, query + QUERIES);
    ret->dims = spectra ? COMPONENTS_DIMS : 3;
    for (size_t i = 0; i < t->n; i++) {
        const double Lab[3] = { t->L[i], t->a[i], t->b[i] };
        components_row_point(c, table_spectrum(t, i), ret->row[i]);
        if (!spectra)
            memcpy(ret->row[i], Lab, sizeof Lab);
    }
    for (size_t i = 0; i < (size_t)2 * QUERIES; i++) {
        components_point(c, query[i].spectrum.value, ret->query[i]);
        if (!spectra)
            memcpy(ret->query[i], query[i].query.Lab, sizeof query[i].query.Lab);
    }
    components_close(c);
    shuffle(ret);
}

static void point_of(void *context, size_t row, double *point)
{
    const struct points *p = context;
    memcpy(point, p->row[row], p->dims * sizeof *point);
}

/* ---- searches --------------------------------------------------------------------------- */

struct nearest_two {
    const struct points *points;
    const double *query;
    double first, second;
};

static double look(void *context, size_t row)
{
    struct nearest_two *two = context;
    double sum = 0.0;
    for (size_t i = 0; i < two->points->dims; i++) {
        double d = two->points->row[row][i] - two->query[i];
        sum += d * d;
    }
    double distance = sqrt(sum);
    if (distance < two->second)
        two->second = fmax(distance, two->first);
    two->first = fmin(distance, two->first);
    return two->second;
}

static double time_searches(const struct kd_tree *tree, const struct points *p)
{
    double start = now_s(), sum = 0.0;
    for (size_t i = 0; i < (size_t)2 * QUERIES; i++) {
        struct nearest_two two = { p, p->query[i], (double)INFINITY, (double)INFINITY };
        struct kd_tree_task task = { .query = p->query[i], .look = look, .context = &two };
        if (!kd_tree_search(tree, &task))
            fail("a question that no tree takes");
        sum += two.first;
    }
    if (!(sum >= 0.0))
        fail("no distances");
    return 1e9 * (now_s() - start) / (2.0 * QUERIES);
}

/* The most rows for which judging all was quicker, with none below for which it was not. */
static size_t crossing(struct points *p)
{
    size_t few = 16; /* one group: there are no boxes */
    bool crossed = false;
    for (size_t n = 32; n <= MOST; n += n < 128 ? 16 : n / 4 / 16 * 16) {
        const struct kd_tree_rows rows = {
            .n = n, .dims = p->dims, .threads = 1, .point = point_of, .rounding = 1e-9, .context = p
        };
        double boxes[ROUNDS], all[ROUNDS];
        struct kd_tree *tree;
        if (kd_tree_open(&rows, &tree) != STATUS_OK)
            fail("no memory");
        for (int round = 0; round < ROUNDS; round++) {
            tree->few = false;
            boxes[round] = time_searches(tree, p);
            tree->few = true;
            all[round] = time_searches(tree, p);
        }
        kd_tree_close(tree);
        double by_boxes = median(boxes), by_all = median(all);
        printf("%2zu dimensions %6zu rows: boxes %7.1f ns, all %7.1f ns\n", p->dims, n, by_boxes,
               by_all);
        crossed = crossed || by_all > by_boxes;
        few = crossed ? few : n;
    }
    return few;
}

static void write_header(const char *path, size_t colours, size_t spectra)
{
    FILE *f = fopen(path, "w");
    if (f == NULL)
        fail("cannot write the header");
    fprintf(f,
            "/* kd_few.h - up to how many points a tree is not worth its boxes: all are judged, "
            "sixteen at once.\n"
            " *\n"
            " * Written by `make calibrate-search` (tests/bench/few.c); docs/decisions/0013. */\n"
            "#ifndef SKINSPEC_MATCH_KD_FEW_H\n"
            "#define SKINSPEC_MATCH_KD_FEW_H\n\n"
            "/* Of three dimensions, and of more. */\n"
            "#define KD_FEW_COLOURS %zuu\n"
            "#define KD_FEW_SPECTRA %zuu\n\n"
            "#endif\n",
            colours, spectra);
    if (fclose(f) != 0)
        fail("cannot write the header");
}

int main(int argc, char **argv)
{
    static struct points points;
    struct table table;
    size_t few[2];
    if (skin_table(SIDE, &table) != STATUS_OK)
        fail("no memory");
    for (int spectra = 0; spectra < 2; spectra++) {
        make_points(&table, spectra == 1, &points);
        few[spectra] = crossing(&points);
    }
    table_done(&table);
    printf("all are judged up to %zu colours, %zu spectra\n", few[0], few[1]);
    if (argc > 1)
        write_header(argv[1], few[0], few[1]);
    return 0;
}
