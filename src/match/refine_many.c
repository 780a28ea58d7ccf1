/* refine_many.c - rows handed out to threads, a piece at a time. */
#include "match/refine_many.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "base/vectors.h"
#include "match/chi_square.h"
#include "match/refine_lanes.h"

/* Rows a thread takes at a time. */
enum { PIECE = 1024 };
/* As match/refine.c has them. */
#define P_TOO_LARGE 0.001
#define P_TOO_SMALL 0.999
#define Z_95 1.959963984540054

struct refine_many {
    struct refiner *refiner;
    struct noise noise;
    double first_nm, step_nm;
    size_t bands;
    bool by_lanes;
    struct refine_lanes lanes;
    struct fit fit;
    double half_range[LANES_PARAMETERS];      /* of each, on its scale */
    double chi_square_least, chi_square_most; /* beyond them chance is not to blame */
};

/* An amount is judged by its root, as in match/refine.c. */
static double on_scale(size_t i, double x)
{
    return i == SKIN_CM || i == SKIN_CH ? sqrt(x) : x;
}

/* The first chi^2 so large that what chi_square_above() says is below p. */
static double chi_square_beyond(double p, size_t degrees)
{
    double low = 0.0, high = 1e4 + 100.0 * (double)degrees;
    while (low < high) {
        double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high)
            break;
        if (chi_square_above(middle, degrees) < p)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* What lanes need; the bands are ones that refiner_open() takes. */
static enum status prepare(struct refine_many *m)
{
    struct chromophores c;
    double nm[SPECTRUM_MAX_BANDS];
    enum status s = chromophores_init(m->first_nm, m->step_nm, m->bands, &c);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < m->bands; i++)
        nm[i] = m->first_nm + (double)i * m->step_nm;
    s = refine_lanes_init(&m->fit, &m->noise, &c, nm, &m->lanes);
    if (s == STATUS_NO_MEMORY)
        return s;
    m->by_lanes = s == STATUS_OK;
    for (size_t i = 0; i < LANES_PARAMETERS; i++)
        m->half_range[i] = 0.5 * (on_scale(i, m->fit.role[i].hi) - on_scale(i, m->fit.role[i].lo));
    size_t degrees = m->bands - LANES_PARAMETERS;
    m->chi_square_least = INFINITY;
    if (m->by_lanes && degrees > 0) {
        m->chi_square_least =
            m->fit.model_error == 0.0 ? chi_square_beyond(P_TOO_SMALL, degrees) : 0.0;
        m->chi_square_most = chi_square_beyond(P_TOO_LARGE, degrees);
    }
    return STATUS_OK;
}

enum status refine_many_open(const struct fit *fit, double first_nm, double step_nm, size_t bands,
                             const struct noise *noise, struct refine_many **ret, const char **why)
{
    enum status s = noise_check(noise, why);
    if (s != STATUS_OK)
        return s;
    struct refine_many *m = calloc(1, sizeof *m);
    if (m == NULL) {
        if (why != NULL)
            *why = "there is no memory left";
        return STATUS_NO_MEMORY;
    }
    m->noise = *noise;
    m->first_nm = first_nm;
    m->step_nm = step_nm;
    m->bands = bands;
    m->fit = *fit;
    s = refiner_open(fit, first_nm, step_nm, bands, &m->refiner, why);
    if (s == STATUS_OK)
        s = prepare(m);
    if (s != STATUS_OK) {
        refine_many_close(m);
        return s;
    }
    *ret = m;
    return STATUS_OK;
}

void refine_many_close(struct refine_many *many)
{
    if (many == NULL)
        return;
    refiner_close(many->refiner);
    free(many);
}

/* ---- one by one ------------------------------------------------------------------------ */

struct job {
    const struct refine_many *many;
    const struct refine_rows *rows;
    size_t band_stride; /* never 0 */
    const struct refine_answers *ret;
};

static void put(double *array, size_t i, double x)
{
    if (array != NULL)
        array[i] = x;
}

static void answer_refused(const struct refine_answers *ret, size_t i)
{
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        put(ret->value[p], i, NAN);
        put(ret->se[p], i, NAN);
    }
    put(ret->chi_square, i, NAN);
    put(ret->rms, i, NAN);
    if (ret->flags != NULL)
        ret->flags[i] = REFINE_MANY_REFUSED;
}

static void answer(const struct refine_answers *ret, size_t i, const struct refined *r)
{
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        put(ret->value[p], i, r->value[p]);
        put(ret->se[p], i, r->se[p]);
    }
    put(ret->chi_square, i, r->chi_square);
    put(ret->rms, i, r->rms);
    if (ret->flags != NULL)
        ret->flags[i] = r->flags;
}

static void run_one(const struct job *job, size_t i)
{
    const struct refine_many *m = job->many;
    struct spectrum s = {
        .first_nm = m->first_nm, .step_nm = m->step_nm, .n = m->bands, .specular = SPECULAR_SCE
    };
    struct refined r;
    double sum = 0.0;
    for (size_t k = 0; k < m->bands; k++) {
        size_t at = i * job->rows->stride + k * job->band_stride;
        s.value[k] = job->rows->R != NULL ? job->rows->R[at] : (double)job->rows->R_float[at];
        sum += s.value[k];
    }
    if (isnan(sum) || refiner_run(m->refiner, &m->noise, &s, 1, NULL, 0, 0, &r, NULL) != STATUS_OK)
        answer_refused(job->ret, i);
    else
        answer(job->ret, i, &r);
}

/* ---- by lanes -------------------------------------------------------------------------- */

/* Whether the interval of an amount takes up half of its range or more. */
static bool undetermined(const struct refine_many *m, const struct lanes_answer *a, size_t i,
                         size_t l)
{
    const struct skin_role *role = &m->fit.role[i];
    double half = Z_95 * a->se[i][l];
    double lo = fmax(a->value[i][l] - half, role->lo), hi = fmin(a->value[i][l] + half, role->hi);
    return on_scale(i, hi) - on_scale(i, lo) >= m->half_range[i];
}

/* One after the other, whole groups of lanes.  Roots are no farther apart than the root of the
 * difference, so that hardly an amount's interval need be looked at on its own scale. */
static void add_flags_of_parameter(const struct refine_many *m, const struct lanes_answer *a,
                                   size_t i, size_t n, uint32_t *flags)
{
    const uint32_t at_bound = (uint32_t)REFINE_AT_BOUND << i;
    const uint32_t unknown = (uint32_t)REFINE_UNDETERMINED << i;
    const double lo = m->fit.role[i].lo, hi = m->fit.role[i].hi, range = m->half_range[i];
    const double wide = i == SKIN_BM ? range : 0.999 * range * range;
    for (size_t g = 0; g < n; g += LANES) {
        VECTORS_LOOP
        for (size_t l = g; l < g + LANES; l++) {
            double value = a->value[i][l], half = Z_95 * a->se[i][l];
            double from = value - half > lo ? value - half : lo;
            double to = value + half < hi ? value + half : hi;
            flags[l] |= ((value == lo) | (value == hi)) != 0 ? at_bound : 0;
            flags[l] |= to - from >= wide ? unknown : 0;
        }
    }
    for (size_t l = 0; l < n && i != SKIN_BM; l++)
        if ((flags[l] & unknown) != 0 && a->state[l] == LANES_FITTED && !undetermined(m, a, i, l))
            flags[l] &= ~unknown;
}

/* Of n lanes; what is told of those that are not fitted does not matter. */
static void find_flags(const struct refine_many *m, const struct lanes_answer *a, size_t n,
                       uint32_t flags[LANES_MOST])
{
    memset(flags, 0, LANES_MOST * sizeof *flags);
    for (size_t i = 0; i < LANES_PARAMETERS; i++)
        add_flags_of_parameter(m, a, i, n, flags);
    if (m->bands == LANES_PARAMETERS) /* nothing can be said */
        return;
    for (size_t l = 0; l < n; l++) {
        flags[l] |=
            a->chi_square[l] >= m->chi_square_most ? (uint32_t)REFINE_RESIDUAL_TOO_LARGE : 0;
        flags[l] |=
            a->chi_square[l] < m->chi_square_least ? (uint32_t)REFINE_RESIDUAL_TOO_SMALL : 0;
    }
}

static void answer_lane(const struct job *job, size_t i, const struct lanes_answer *a, size_t l,
                        uint32_t flags)
{
    const struct refine_answers *ret = job->ret;
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        bool lane = p < LANES_PARAMETERS;
        put(ret->value[p], i, lane ? a->value[p][l] : job->many->fit.role[p].value);
        put(ret->se[p], i, lane ? a->se[p][l] : 0.0);
    }
    put(ret->chi_square, i, a->chi_square[l]);
    put(ret->rms, i, a->rms[l]);
    if (ret->flags != NULL)
        ret->flags[i] = flags;
}

static void copy_or_fill(double *array, size_t i, size_t n, const double *from, double all)
{
    if (array != NULL && from != NULL)
        memcpy(array + i, from, n * sizeof *from);
    for (size_t l = 0; l < n && array != NULL && from == NULL; l++)
        array[i + l] = all;
}

/* Rows i..i+n, all of which are fitted. */
static void answer_lanes(const struct job *job, size_t i, size_t n, const struct lanes_answer *a,
                         const uint32_t *flags)
{
    const struct refine_answers *ret = job->ret;
    for (size_t p = 0; p < SKIN_PARAMETERS; p++) {
        bool lane = p < LANES_PARAMETERS;
        copy_or_fill(ret->value[p], i, n, lane ? a->value[p] : NULL, job->many->fit.role[p].value);
        copy_or_fill(ret->se[p], i, n, lane ? a->se[p] : NULL, 0.0);
    }
    copy_or_fill(ret->chi_square, i, n, a->chi_square, NAN);
    copy_or_fill(ret->rms, i, n, a->rms, NAN);
    if (ret->flags != NULL)
        memcpy(ret->flags + i, flags, n * sizeof *flags);
}

/* Whole groups of rows that are neighbours in each band, into lanes. */
VECTORS_INLINE void widen(const float *from, size_t band_stride, size_t bands, size_t groups,
                          double *R)
{
    for (size_t k = 0; k < bands; k++)
        for (size_t g = 0; g < groups; g++) {
            const float *value = from + k * band_stride + g * LANES;
            double *restrict to = R + (g * bands + k) * LANES;
            for (size_t l = 0; l < LANES; l++)
                to[l] = (double)value[l];
        }
}

typedef void widen_function(const float *from, size_t band_stride, size_t bands, size_t groups,
                            double *R);

static void widen_plain(const float *from, size_t band_stride, size_t bands, size_t groups,
                        double *R)
{
    widen(from, band_stride, bands, groups, R);
}

VECTORS_AVX2 static void widen_avx2(const float *from, size_t band_stride, size_t bands,
                                    size_t groups, double *R)
{
    widen(from, band_stride, bands, groups, R);
}

VECTORS_AVX512 static void widen_avx512(const float *from, size_t band_stride, size_t bands,
                                        size_t groups, double *R)
{
    widen(from, band_stride, bands, groups, R);
}

/* Rows from..from+n, neighbours in each band, into lanes. */
static void lay_out_bands(const struct job *job, size_t from, size_t n, double *R)
{
    static widen_function *const by[VECTORS_KINDS] = { widen_plain, widen_avx2, widen_avx512 };
    size_t bands = job->many->bands;
    if (job->rows->R == NULL)
        by[vectors_best()](job->rows->R_float + from, job->band_stride, bands, n / LANES, R);
    for (size_t k = 0; k < bands; k++) {
        size_t at = k * job->band_stride + from;
        for (size_t g = 0; g < n / LANES && job->rows->R != NULL; g++)
            memcpy(R + (g * bands + k) * LANES, job->rows->R + at + g * LANES, LANES * sizeof *R);
        for (size_t l = n / LANES * LANES; l < n; l++)
            R[(l / LANES * bands + k) * LANES + l % LANES] =
                job->rows->R != NULL ? job->rows->R[at + l] : (double)job->rows->R_float[at + l];
    }
}

/* Rows from..from+n, each by itself. */
static void lay_out_rows(const struct job *job, size_t from, size_t n, double *R)
{
    size_t bands = job->many->bands, stride = job->rows->stride;
    for (size_t l = 0; l < n; l++) {
        double *at = R + l / LANES * bands * LANES + l % LANES;
        if (job->rows->R != NULL)
            for (size_t k = 0; k < bands; k++)
                at[k * LANES] = job->rows->R[(from + l) * stride + k];
        else
            for (size_t k = 0; k < bands; k++)
                at[k * LANES] = (double)job->rows->R_float[(from + l) * stride + k];
    }
}

static void lay_out(const struct job *job, size_t from, size_t n, double *R)
{
    size_t bands = job->many->bands;
    if (job->band_stride == 1)
        lay_out_rows(job, from, n, R);
    else
        lay_out_bands(job, from, n, R);
    for (size_t l = n; l % LANES != 0; l++) /* the rest of the last group: any spectrum */
        for (size_t k = 0; k < bands; k++)
            R[l / LANES * bands * LANES + l % LANES + k * LANES] = 0.3;
}

static void run_lanes(const struct job *job, size_t from, size_t to)
{
    double R[SPECTRUM_MAX_BANDS * LANES];
    struct lanes_answer a;
    size_t room = SPECTRUM_MAX_BANDS / job->many->bands * LANES;
    size_t most = room < LANES_MOST ? room : LANES_MOST;
    for (size_t i = from; i < to; i += most) {
        size_t n = to - i < most ? to - i : most;
        lay_out(job, i, n, R);
        refine_lanes_run(&job->many->lanes, R, n, &a);
        uint32_t flags[LANES_MOST];
        size_t fitted = 0;
        find_flags(job->many, &a, n, flags);
        for (size_t l = 0; l < n; l++)
            fitted += a.state[l] == LANES_FITTED ? 1 : 0;
        if (fitted == n)
            answer_lanes(job, i, n, &a, flags);
        for (size_t l = 0; l < n && fitted < n; l++)
            if (a.state[l] == LANES_FITTED)
                answer_lane(job, i + l, &a, l, flags[l]);
            else if (a.state[l] == LANES_REFUSED)
                answer_refused(job->ret, i + l);
            else
                run_one(job, i + l);
    }
}

/* ---- all ------------------------------------------------------------------------------- */

static enum status run_piece(size_t piece, unsigned worker, void *context)
{
    const struct job *job = context;
    size_t from = piece * PIECE, n = job->rows->n, to = n - from < PIECE ? n : from + PIECE;
    (void)worker;
    if (job->many->by_lanes)
        run_lanes(job, from, to);
    else
        for (size_t i = from; i < to; i++)
            run_one(job, i);
    return STATUS_OK;
}

enum status refine_many_run(const struct refine_many *many, const struct refine_rows *rows,
                            unsigned threads, const struct refine_answers *ret)
{
    struct job job = { many, rows, rows->band_stride > 0 ? rows->band_stride : 1, ret };
    bool together = job.band_stride == 1 && rows->stride >= many->bands;
    bool by_band = job.band_stride > 1 && job.band_stride >= rows->n && rows->stride == 1;
    if ((!together && !by_band) || (rows->R == NULL) == (rows->R_float == NULL))
        return STATUS_RANGE;
    return parallel_run((rows->n + PIECE - 1) / PIECE, threads, run_piece, &job);
}
