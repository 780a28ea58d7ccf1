/* brute.c - blocks of rows that stay in the cache, against blocks of questions. */
#include "tests/support/brute.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/parallel.h"
#include "base/vectors.h"
#include "tests/support/textbook.h"

enum { LANES = 16, GROUPS = 32, QUESTIONS = 50, MOST = 8 };

struct brute {
    const struct table *table;
    enum match_by by;
    size_t dims, groups;
    double norm;  /* of the largest row */
    float *value; /* [groups][dims][LANES]; past the end 1e18, which is far from all */
};

/* ---- rows and questions as numbers ---------------------------------------------------------- */

static double code_of(double linear)
{
    return fmin(fmax(round(textbook_code(linear)), 0.0), 255.0);
}

static void row_values(const struct brute *b, size_t row, double *ret)
{
    const struct table *t = b->table;
    const double *Lab[3] = { t->L, t->a, t->b }, *rgb[3] = { t->red, t->green, t->blue };
    for (size_t i = 0; i < b->dims; i++)
        if (b->by == MATCH_SPECTRUM)
            ret[i] = (double)t->spectrum[row * t->stride + i];
        else
            ret[i] = b->by == MATCH_LAB ? Lab[i][row] : code_of(rgb[i][row]);
}

static void query_values(const struct brute *b, const struct skin_query *q, double *ret)
{
    for (size_t i = 0; i < b->dims; i++)
        if (b->by == MATCH_SPECTRUM)
            ret[i] = q->spectrum.value[i];
        else
            ret[i] = b->by == MATCH_LAB ? q->query.Lab[i] : code_of(q->query.rgb[i]);
}

static double norm_of(size_t n, const double *value)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += value[i] * value[i];
    return sqrt(sum);
}

struct brute *brute_open(const struct table *table, enum match_by by)
{
    struct brute *b = calloc(1, sizeof *b);
    if (b == NULL)
        return NULL;
    *b = (struct brute){ .table = table, .by = by, .groups = (table->n + LANES - 1) / LANES };
    b->dims = by == MATCH_SPECTRUM ? table->recipe.bands : 3;
    b->value = calloc(b->groups * b->dims, LANES * sizeof *b->value);
    if (b->value == NULL) {
        free(b);
        return NULL;
    }
    for (size_t row = 0; row < b->groups * LANES; row++) {
        double value[SPECTRUM_MAX_BANDS];
        if (row < table->n) {
            row_values(b, row, value);
            b->norm = fmax(b->norm, norm_of(b->dims, value));
        }
        for (size_t i = 0; i < b->dims; i++)
            b->value[(row / LANES * b->dims + i) * LANES + row % LANES] =
                row < table->n ? (float)value[i] : 1e18f;
    }
    return b;
}

void brute_close(struct brute *b)
{
    if (b == NULL)
        return;
    free(b->value);
    free(b);
}

/* ---- distances ---------------------------------------------------------------------------- */

static double distance(const struct brute *b, const double *query, size_t row)
{
    double value[SPECTRUM_MAX_BANDS], sum = 0.0;
    row_values(b, row, value);
    for (size_t i = 0; i < b->dims; i++)
        sum += (value[i] - query[i]) * (value[i] - query[i]);
    return sqrt(b->by == MATCH_SPECTRUM ? sum / (double)b->dims : sum);
}

double brute_distance(const struct brute *b, const struct skin_query *q, size_t row)
{
    double query[SPECTRUM_MAX_BANDS];
    query_values(b, q, query);
    return distance(b, query, row);
}

/* Squares of sixteen rows, and whether any is up to a limit. */
VECTORS_INLINE int squares_any(size_t dims, const float *value, const float *query, float limit,
                               float *square)
{
    float sum[LANES] = { 0.0f };
    int near = 0;
    for (size_t dim = 0; dim < dims; dim++)
        for (size_t i = 0; i < LANES; i++)
            sum[i] += (value[dim * LANES + i] - query[dim]) * (value[dim * LANES + i] - query[dim]);
    for (size_t i = 0; i < LANES; i++)
        near |= sum[i] <= limit ? 1 : 0;
    memcpy(square, sum, sizeof sum);
    return near;
}

typedef int squares_of(size_t dims, const float *value, const float *query, float limit,
                       float *square);

static int squares_plain(size_t dims, const float *value, const float *query, float limit,
                         float *square)
{
    return squares_any(dims, value, query, limit, square);
}

VECTORS_AVX2 static int squares_avx2(size_t dims, const float *value, const float *query,
                                     float limit, float *square)
{
    return squares_any(dims, value, query, limit, square);
}

VECTORS_AVX512 static int squares_avx512(size_t dims, const float *value, const float *query,
                                         float limit, float *square)
{
    return squares_any(dims, value, query, limit, square);
}

static squares_of *best_squares(void)
{
    static squares_of *const kind[VECTORS_KINDS] = { squares_plain, squares_avx2, squares_avx512 };
    return kind[vectors_best()];
}

/* ---- all rows, many questions -----------------------------------------------------------------
 */

struct question {
    double query[SPECTRUM_MAX_BANDS], margin;
    float as_float[SPECTRUM_MAX_BANDS], limit;
    size_t n, k;
    struct nearest_hit hit[MOST];
};

/* Above it no float square can be of one of the k: each value is rounded by 2^-24 of itself, and
 * the sum by less than 64 such of itself. */
static float limit_of(const struct brute *b, const struct question *q)
{
    if (q->n < q->k)
        return 1e30f;
    double whole = q->hit[q->n - 1].distance;
    whole *= b->by == MATCH_SPECTRUM ? sqrt((double)b->dims) : 1.0;
    whole += q->margin;
    return (float)(whole * whole * (1.0 + 1e-5));
}

static void offer(const struct brute *b, struct question *q, size_t row)
{
    double d = distance(b, q->query, row);
    size_t place = q->n;
    while (place > 0 && d < q->hit[place - 1].distance) /* rows come in order: ties stay behind */
        place--;
    if (place == q->k)
        return;
    q->n += q->n < q->k ? 1 : 0;
    memmove(q->hit + place + 1, q->hit + place, (q->n - 1 - place) * sizeof *q->hit);
    q->hit[place] = (struct nearest_hit){ row, d };
    q->limit = limit_of(b, q);
}

struct finding {
    const struct brute *brute;
    const struct skin_query *query;
    size_t n, k;
    struct nearest_hit *hits;
};

static void against_rows(const struct brute *b, struct question *q, size_t group, size_t end)
{
    squares_of *squares = best_squares();
    for (; group < end; group++) {
        float square[LANES];
        if (!squares(b->dims, b->value + group * b->dims * LANES, q->as_float, q->limit, square))
            continue;
        for (size_t i = 0; i < LANES; i++)
            if (square[i] <= q->limit && group * LANES + i < b->table->n)
                offer(b, q, group * LANES + i);
    }
}

static enum status find_piece(size_t piece, unsigned worker, void *context)
{
    const struct finding *f = context;
    const struct brute *b = f->brute;
    size_t first = piece * QUESTIONS, n = f->n - first < QUESTIONS ? f->n - first : QUESTIONS;
    struct question *q = calloc(n, sizeof *q);
    (void)worker;
    if (q == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < n; i++) {
        query_values(b, &f->query[first + i], q[i].query);
        for (size_t dim = 0; dim < b->dims; dim++)
            q[i].as_float[dim] = (float)q[i].query[dim];
        q[i].margin = 0x1p-23 * (b->norm + norm_of(b->dims, q[i].query));
        q[i].limit = 1e30f;
        q[i].k = f->k;
    }
    for (size_t group = 0; group < b->groups; group += GROUPS)
        for (size_t i = 0; i < n; i++)
            against_rows(b, &q[i], group, group + GROUPS < b->groups ? group + GROUPS : b->groups);
    for (size_t i = 0; i < n; i++)
        memcpy(f->hits + (first + i) * f->k, q[i].hit, f->k * sizeof *f->hits);
    free(q);
    return STATUS_OK;
}

void brute_find(const struct brute *b, const struct skin_query *query, size_t n, size_t k,
                struct nearest_hit *hits)
{
    struct finding f = { b, query, n, k, hits };
    if (k > MOST || parallel_run((n + QUESTIONS - 1) / QUESTIONS, parallel_cores(), find_piece,
                                 &f) != STATUS_OK)
        abort();
}

/* ---- the verdict ---------------------------------------------------------------------------- */

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void judge(const struct brute *b, const struct nearest *nearest, const struct skin_query *q,
                  size_t k, const struct nearest_hit *expect, struct brute_verdict *ret)
{
    struct nearest_hit got[MOST];
    size_t found = 0;
    bool wrong = nearest_find(nearest, &q->query, k, got, &found) != STATUS_OK || found != k;
    bool rounding = false;
    for (size_t i = 0; i < k && !wrong; i++) {
        double d = brute_distance(b, q, got[i].row), slack = 1e-13 * (1.0 + expect[i].distance);
        wrong = fabs(d - expect[i].distance) > slack || fabs(d - got[i].distance) > slack;
        rounding = rounding || got[i].row != expect[i].row;
    }
    ret->wrong += wrong ? 1 : 0;
    ret->rounding += rounding && !wrong ? 1 : 0;
}

struct brute_verdict brute_judge(const struct brute *b, const struct nearest *nearest,
                                 const struct skin_query *query, size_t n, size_t k)
{
    struct brute_verdict verdict = { 0 };
    struct nearest_hit *hits = calloc(n * k, sizeof *hits);
    if (hits == NULL)
        abort();
    double start = now_s();
    brute_find(b, query, n, k, hits);
    verdict.seconds = now_s() - start;
    for (size_t i = 0; i < n; i++)
        judge(b, nearest, &query[i], k, hits + i * k, &verdict);
    free(hits);
    return verdict;
}
