/* bench.c - one search, by each kind of distance: the index beside looking at every row.
 *
 *     bench TABLE.db [MEASURED.csv ...]
 *
 * Three sorts of queries: `near` a row of the table; `off` it by a smooth rms of 0.02 to 0.05,
 * as real skin is; and, by name, the spectra of files (columns of wavelengths in nm).
 * Medians in microseconds.  Ends with status 1 where the two answers differ. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/number.h"
#include "db/table_file.h"
#include "match/match.h"
#include "tests/support/dice.h"
#include "tests/support/figures.h"

enum { QUERIES = 400, K = 5, ROUNDS = 5 };

/* Of one sort: spectra, and their colours under the table's light. */
struct queries {
    const char *what;
    size_t n;
    struct spectrum spectrum[QUERIES];
    struct nearest_query query[QUERIES];
};

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(double *took, size_t n, size_t percent)
{
    qsort(took, n, sizeof *took, compare);
    return took[n * percent / 100];
}

/* ---- queries ---------------------------------------------------------------------------- */

static void add_query(struct queries *q, const struct table *table, const struct spectrum *s)
{
    if (q->n == QUERIES)
        return;
    struct nearest_query *query = &q->query[q->n];
    q->spectrum[q->n] = *s;
    *query = (struct nearest_query){ .spectrum = &q->spectrum[q->n] };
    query->has_colour = matcher_colour(table, s, query->Lab, query->rgb) == STATUS_OK;
    if (query->has_colour)
        q->n++;
}

/* A row, or for a table without spectra a straight line. */
static double row_value(const struct table *table, size_t row, size_t band)
{
    const float *spectrum = table_spectrum(table, row);
    return spectrum != NULL ? (double)spectrum[band]
                            : 0.1 + 0.01 * (double)band * (double)row / (double)table->n;
}

/* Rows plus three slow waves of chance phase, `rms_low` to `rms_high` in all, and a little
 * noise. */
static void make_queries(struct queries *q, const struct table *table, double rms_low,
                         double rms_high)
{
    struct dice dice = { 3 };
    static struct spectrum s;
    while (q->n < QUERIES) {
        size_t row = dice_below(&dice, table->n);
        double rms = dice_between(&dice, rms_low, rms_high), phase[3];
        s = (struct spectrum){
            .first_nm = 400, .step_nm = 10, .n = 31, .specular = SPECULAR_SCE, .aperture_mm = 8
        };
        for (int i = 0; i < 3; i++)
            phase[i] = dice_between(&dice, 0.0, 6.28);
        for (size_t band = 0; band < s.n; band++) {
            double wave = 0.0;
            for (int i = 0; i < 3; i++)
                wave += sin(phase[i] + 0.1 * (i + 1) * (double)band);
            s.value[band] = row_value(table, row, band) + rms * wave * sqrt(2.0 / 3.0) +
                            dice_between(&dice, -0.002, 0.002);
        }
        add_query(q, table, &s);
    }
}

/* Spectra of a file from 400 nm on, by the step of its first two columns of wavelengths. */
static void read_queries(struct queries *q, const struct table *table, const char *path)
{
    struct figures f;
    static struct spectrum s;
    if (!figures_read(path, &f)) {
        fprintf(stderr, "bench: cannot read %s\n", path);
        exit(2);
    }
    size_t first = figures_column(&f, "400");
    double next = 0.0;
    if (first + 1 >= f.columns || number_parse(f.name[first + 1], &next) != STATUS_OK) {
        fprintf(stderr, "bench: %s: no columns from 400 nm on\n", path);
        exit(2);
    }
    for (size_t row = 0; row < f.rows; row++) {
        s = (struct spectrum){ .first_nm = 400,
                               .step_nm = next - 400.0,
                               .n = f.columns - first,
                               .specular = SPECULAR_SCE,
                               .aperture_mm = 8 };
        for (size_t band = 0; band < s.n; band++)
            s.value[band] = figures_at(&f, row, first + band);
        add_query(q, table, &s);
    }
    figures_done(&f);
}

/* ---- searches --------------------------------------------------------------------------- */

typedef enum status search(const struct nearest *, const struct nearest_query *, size_t,
                           struct nearest_hit *, size_t *);

static void time_search(search *find, const struct nearest *nearest, const struct queries *q,
                        int rounds, double *took, struct nearest_hit (*hits)[K])
{
    size_t found;
    for (int round = 0; round < rounds; round++)
        for (size_t i = 0; i < q->n; i++) {
            double start = now_us();
            if (find(nearest, &q->query[i], K, hits[i], &found) != STATUS_OK || found < K)
                exit(1);
            took[(size_t)round * q->n + i] = now_us() - start;
        }
}

static bool compare_searches(const struct table *table, enum match_by by, const struct queries *q)
{
    static double took[ROUNDS * QUERIES];
    static struct nearest_hit scanned[QUERIES][K], found[QUERIES][K];
    struct nearest *nearest;
    double start = now_us();
    if (nearest_open(table, by, &nearest) != STATUS_OK)
        return by == MATCH_SPECTRUM; /* a table without spectra */
    double made_us = now_us() - start;
    time_search(nearest_scan, nearest, q, 1, took, scanned);
    double scan_us = quantile(took, q->n, 50);
    time_search(nearest_find, nearest, q, ROUNDS, took, found);
    size_t n = ROUNDS * q->n;
    double p50 = quantile(took, n, 50), p99 = quantile(took, n, 99);
    bool same = memcmp(scanned, found, q->n * sizeof *found) == 0;
    printf("%-10s %-28s %8.1f %8.2f %8.2f %7.0f x %8.1f  %s\n", match_by_name(by), q->what, scan_us,
           p50, p99, scan_us / p50, 1e-3 * made_us, same ? "" : "DIFFERENT");
    nearest_close(nearest);
    return same;
}

/* ---- the rest of an answer -------------------------------------------------------------- */

static void time_match(const struct table *table, const struct queries *q)
{
    static double took[ROUNDS * QUERIES];
    struct matcher matcher;
    struct nearest_hit hits[K];
    struct match match;
    enum match_by by = matcher_default_by(table);
    if (matcher_open(table, by, &matcher) != STATUS_OK)
        exit(1);
    for (size_t i = 0; i < ROUNDS * q->n; i++) {
        double start = now_us();
        if (matcher_match(&matcher, &q->spectrum[i % q->n], K, hits, &match) != STATUS_OK)
            exit(1);
        took[i] = now_us() - start;
    }
    printf("whole answer by %-12s %-17s %8.2f us\n", match_by_name(by), q->what,
           quantile(took, ROUNDS * q->n, 50));
    matcher_close(&matcher);
}

/* Nanoseconds a number: measured (three decimals), by chance, and whole. */
static void time_numbers(void)
{
    enum { NUMBERS = 100000 };
    static double number[NUMBERS];
    static const char *const what[] = { "of three decimals", "of all digits", "whole" };
    for (int kind = 0; kind < 3; kind++) {
        struct dice dice = { 17 };
        char text[NUMBER_TEXT_SIZE];
        size_t length = 0;
        for (size_t i = 0; i < NUMBERS; i++) {
            double x = dice_between(&dice, 0.0, 1.0);
            number[i] = kind == 1 ? x : round(1000.0 * x) / (kind == 0 ? 1000.0 : 1.0);
        }
        double start = now_us();
        for (size_t i = 0; i < NUMBERS; i++)
            length += strlen(number_format_exact(number[i], text));
        printf("number %-20s %8.1f ns  (%.1f characters)\n", what[kind],
               1e3 * (now_us() - start) / NUMBERS, (double)length / NUMBERS);
    }
}

int main(int argc, char **argv)
{
    static struct queries sorts[2 + 8];
    struct table table;
    size_t n = 2;
    bool same = true;
    if (argc < 2 || table_file_read(argv[1], &table) != STATUS_OK)
        return 2;
    sorts[0].what = "near";
    make_queries(&sorts[0], &table, 0.0, 0.0);
    sorts[1].what = "off";
    make_queries(&sorts[1], &table, 0.02, 0.05);
    for (int i = 2; i < argc && n < sizeof sorts / sizeof *sorts; i++, n++) {
        const char *slash = strrchr(argv[i], '/');
        sorts[n].what = slash != NULL ? slash + 1 : argv[i];
        read_queries(&sorts[n], &table, argv[i]);
    }
    printf("%zu rows, k = %d; microseconds\n", table.n, K);
    printf("%-10s %-28s %8s %8s %8s %9s %8s\n", "by", "queries", "scan", "index", "p99", "ratio",
           "made ms");
    for (int by = MATCH_RGB; by <= MATCH_SPECTRUM; by++)
        for (size_t i = 0; i < n; i++)
            same = compare_searches(&table, (enum match_by)by, &sorts[i]) && same;
    for (size_t i = 0; i < n; i++)
        time_match(&table, &sorts[i]);
    time_numbers();
    table_done(&table);
    return same ? 0 : 1;
}
