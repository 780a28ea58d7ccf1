/* lattice.c - samples of each axis, its nodes, the rows at all nodes, and sums of those. */
#include "match/lattice.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "match/skeleton.h"

enum {
    LANES = VECTORS_LANES,
    ALIGNMENT = 64,
    AXIS_SHARE = 256, /* at least so many rows for a value of an axis */
    LOOKED_AT = 4,    /* values of the other axes: the ends and some between */
    COMBINATIONS = LOOKED_AT * LOOKED_AT,
    SAMPLE_BANDS = 48,  /* at most: spectra are smooth on finer grids */
    COMPARED = 8,       /* epidermises */
    COMPARED_ROWS = 64, /* of each, at most; no less than SKELETON_MAX */
};

/* What may be missing of a value, of the largest: what rounding leaves to be seen. */
static const double missing_max = 3e-15;

enum along { ALONG_CM, ALONG_BM, ALONG_CH, AXES };

struct lattice {
    struct grid grid;
    enum vectors vectors;
    struct skeleton axis[AXES];
    size_t nodes_stride; /* of nodes along Ch: their number rounded up to LANES */
    size_t plane;        /* three times that: X, Y and Z of the nodes along Ch */
    double *XYZ;         /* [node along Cm][node along Bm][plane] */
    size_t rows_stride;
    double *along_Ch; /* weights, [node][rows_stride], LANES of 0 and more past the last */
};

struct lattice_sums {
    size_t Cm, Bm; /* what the sums are of; SIZE_MAX: none yet */
    double *of_Cm; /* [node along Bm][plane] */
    double *of_Bm; /* [plane] */
};

/* Scratch of opening. */
struct opening {
    const struct lattice_source *of;
    struct lattice *l;
    const double *value[AXES];
    size_t n[AXES], stride, bands;
    double *epidermis, *dermises, *R; /* one, nodes along Ch or COMPARED_ROWS of each other */
};

static double *aligned(size_t doubles)
{
    size_t bytes = (doubles * sizeof(double) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    double *p = aligned_alloc(ALIGNMENT, bytes);
    if (p != NULL)
        memset(p, 0, bytes);
    return p;
}

static size_t up(size_t n)
{
    return (n + LANES - 1) / LANES * LANES;
}

/* ---- sums --------------------------------------------------------------------------- */

/* to[j] = sum over k of weight[k] from[k * step + j], j below n, a multiple of LANES. */
struct sum {
    size_t n, terms, step;
    const double *restrict weight, *restrict from;
    double *restrict to;
};

VECTORS_INLINE void sum_up(const struct sum *s, bool fused)
{
    for (size_t at = 0; at < s->n; at += LANES) {
        double sum[LANES] = { 0.0 };
        for (size_t k = 0; k < s->terms; k++) {
            const double *restrict from = s->from + k * s->step + at;
            VECTORS_LOOP
            for (int l = 0; l < LANES; l++)
                sum[l] = vectors_sum(fused, from[l], s->weight[k], sum[l]);
        }
        memcpy(s->to + at, sum, sizeof sum);
    }
}

/* The rows of one epidermis: three sums with the same weights, which differ from row to row. */
struct rows {
    size_t n, terms, step;
    const double *restrict weight;                      /* [terms][step] */
    const double *restrict X, *restrict Y, *restrict Z; /* [terms] */
    double *restrict to_X, *restrict to_Y, *restrict to_Z;
};

VECTORS_INLINE void sum_rows(const struct rows *r, bool fused)
{
    for (size_t at = 0; at < r->n; at += LANES) {
        double X[LANES] = { 0.0 }, Y[LANES] = { 0.0 }, Z[LANES] = { 0.0 };
        for (size_t k = 0; k < r->terms; k++) {
            const double *restrict w = r->weight + k * r->step + at;
            VECTORS_LOOP
            for (int l = 0; l < LANES; l++) {
                X[l] = vectors_sum(fused, w[l], r->X[k], X[l]);
                Y[l] = vectors_sum(fused, w[l], r->Y[k], Y[l]);
                Z[l] = vectors_sum(fused, w[l], r->Z[k], Z[l]);
            }
        }
        memcpy(r->to_X + at, X, sizeof X);
        memcpy(r->to_Y + at, Y, sizeof Y);
        memcpy(r->to_Z + at, Z, sizeof Z);
    }
}

static void sum_up_plain(const struct sum *s)
{
    sum_up(s, false);
}

static void sum_rows_plain(const struct rows *r)
{
    sum_rows(r, false);
}

VECTORS_AVX2 static void sum_up_avx2(const struct sum *s)
{
    sum_up(s, true);
}

VECTORS_AVX2 static void sum_rows_avx2(const struct rows *r)
{
    sum_rows(r, true);
}

VECTORS_AVX512 static void sum_up_avx512(const struct sum *s)
{
    sum_up(s, true);
}

VECTORS_AVX512 static void sum_rows_avx512(const struct rows *r)
{
    sum_rows(r, true);
}

static void weighted(enum vectors v, const struct sum *s)
{
    if (v == VECTORS_WITH_AVX512)
        sum_up_avx512(s);
    else if (v == VECTORS_WITH_AVX2)
        sum_up_avx2(s);
    else
        sum_up_plain(s);
}

/* The sums along Cm and Bm, unless they are those of the row before. */
static void move_to(const struct lattice *l, struct lattice_sums *sums, size_t Cm, size_t Bm)
{
    const struct skeleton *c = &l->axis[ALONG_CM], *b = &l->axis[ALONG_BM];
    struct sum along_Cm = { .n = b->nodes * l->plane,
                            .terms = c->nodes,
                            .step = b->nodes * l->plane,
                            .weight = c->weight + Cm * SKELETON_MAX,
                            .from = l->XYZ,
                            .to = sums->of_Cm };
    struct sum along_Bm = { .n = l->plane,
                            .terms = b->nodes,
                            .step = l->plane,
                            .weight = b->weight + Bm * SKELETON_MAX,
                            .from = sums->of_Cm,
                            .to = sums->of_Bm };
    if (sums->Cm != Cm)
        weighted(l->vectors, &along_Cm);
    if (sums->Cm != Cm || sums->Bm != Bm)
        weighted(l->vectors, &along_Bm);
    sums->Cm = Cm;
    sums->Bm = Bm;
}

void lattice_xyz(const struct lattice *l, struct lattice_sums *sums, struct grid_place place,
                 size_t n, double *const XYZ[3])
{
    move_to(l, sums, place.Cm, place.Bm);
    struct rows rows = { .n = n,
                         .terms = l->axis[ALONG_CH].nodes,
                         .step = l->rows_stride,
                         .weight = l->along_Ch + place.Ch,
                         .X = sums->of_Bm,
                         .Y = sums->of_Bm + l->nodes_stride,
                         .Z = sums->of_Bm + 2 * l->nodes_stride,
                         .to_X = XYZ[0],
                         .to_Y = XYZ[1],
                         .to_Z = XYZ[2] };
    if (l->vectors == VECTORS_WITH_AVX512)
        sum_rows_avx512(&rows);
    else if (l->vectors == VECTORS_WITH_AVX2)
        sum_rows_avx2(&rows);
    else
        sum_rows_plain(&rows);
}

/* ---- samples of an axis ------------------------------------------------------------- */

/* The samples of one combination of the other two axes, which is number `which`: every band where
 * it is the first, of the others every fourth, beginning elsewhere. */
struct taking {
    double *F;
    size_t value, stride; /* of the axis */
    size_t samples;       /* so many are in F before */
};

static size_t take_samples(const struct opening *o, const struct taking *to, size_t which,
                           const double *R)
{
    size_t step = (o->bands + SAMPLE_BANDS - 1) / SAMPLE_BANDS, at = to->samples;
    for (size_t band = which % 4 * step; band < o->bands; band += which == 0 ? step : 4 * step)
        to->F[at++ * to->stride + to->value] = R[band];
    return at;
}

/* The ends of an axis and values between, more of them where R changes most. */
static size_t looked_at(const struct opening *o, enum along along, size_t which)
{
    static const size_t eighths[LOOKED_AT] = { 0, 1, 4, 8 };
    return eighths[which] * (o->n[along] - 1) / 8;
}

static bool epidermis_at(const struct opening *o, size_t Cm, size_t Bm)
{
    return shared_epidermis(o->of->layers, o->value[ALONG_CM][Cm], o->value[ALONG_BM][Bm],
                            o->epidermis);
}

static const double *dermis_at(const struct opening *o, size_t Ch)
{
    return o->of->dermis + Ch * o->of->layers->dermis_size;
}

/* R of the epidermis made last over dermis Ch. */
static const double *pair(const struct opening *o, size_t Ch)
{
    shared_reflectance(o->of->layers, o->epidermis, 1, dermis_at(o, Ch), o->R);
    return o->R;
}

/* Along Cm (other: Bm) or Bm (other: Cm): each epidermis over three dermises. */
static size_t sample_epidermises(const struct opening *o, enum along along, double *F)
{
    enum along other = along == ALONG_CM ? ALONG_BM : ALONG_CM;
    struct taking to = { .F = F, .stride = SKELETON_STRIDE(o->n[along]) };
    size_t begun = 0, samples = 0;
    for (size_t k = 0; k < LOOKED_AT; k++, begun = samples)
        for (to.value = 0; to.value < o->n[along]; to.value++) {
            size_t fixed = looked_at(o, other, k);
            if (along == ALONG_CM)
                epidermis_at(o, to.value, fixed);
            else
                epidermis_at(o, fixed, to.value);
            samples = begun;
            for (size_t j = 0; j < LOOKED_AT; j++) {
                to.samples = samples;
                samples =
                    take_samples(o, &to, k * LOOKED_AT + j, pair(o, looked_at(o, ALONG_CH, j)));
            }
        }
    return samples;
}

static size_t sample_dermises(const struct opening *o, double *F)
{
    struct taking to = { .F = F, .stride = SKELETON_STRIDE(o->n[ALONG_CH]) };
    size_t samples = 0;
    for (size_t k = 0; k < COMBINATIONS; k++, to.samples = samples) {
        epidermis_at(o, looked_at(o, ALONG_CM, k / LOOKED_AT),
                     looked_at(o, ALONG_BM, k % LOOKED_AT));
        for (to.value = 0; to.value < o->n[ALONG_CH]; to.value++)
            samples = take_samples(o, &to, k, pair(o, to.value));
    }
    return samples;
}

static enum status find_axis(const struct opening *o, enum along along)
{
    size_t n = o->n[along], most = (size_t)COMBINATIONS * SAMPLE_BANDS;
    double *F = aligned(most * SKELETON_STRIDE(n));
    if (F == NULL)
        return STATUS_NO_MEMORY;
    size_t samples = along == ALONG_CH ? sample_dermises(o, F) : sample_epidermises(o, along, F);
    enum status s = skeleton_init(n, samples, F, missing_max, o->l->vectors, &o->l->axis[along]);
    free(F);
    return s;
}

/* ---- the rows at all nodes ---------------------------------------------------------- */

static void gather_dermises(const struct opening *o)
{
    const struct skeleton *c = &o->l->axis[ALONG_CH];
    size_t size = o->of->layers->dermis_size;
    for (size_t k = 0; k < c->nodes; k++)
        memcpy(o->dermises + k * size, dermis_at(o, c->node[k]), size * sizeof(double));
}

static enum status fill(const struct opening *o)
{
    struct lattice *l = o->l;
    const struct skeleton *axis = l->axis;
    const size_t n_Ch = axis[ALONG_CH].nodes;
    l->nodes_stride = up(n_Ch);
    l->plane = 3 * l->nodes_stride;
    l->rows_stride = up(o->n[ALONG_CH]) + LANES;
    l->XYZ = aligned(axis[ALONG_CM].nodes * axis[ALONG_BM].nodes * l->plane);
    l->along_Ch = aligned(n_Ch * l->rows_stride);
    if (l->XYZ == NULL || l->along_Ch == NULL)
        return STATUS_NO_MEMORY;
    for (size_t k = 0; k < n_Ch; k++)
        for (size_t i = 0; i < o->n[ALONG_CH]; i++)
            l->along_Ch[k * l->rows_stride + i] = axis[ALONG_CH].weight[i * SKELETON_MAX + k];
    gather_dermises(o);
    double *to = l->XYZ;
    for (size_t i = 0; i < axis[ALONG_CM].nodes; i++)
        for (size_t j = 0; j < axis[ALONG_BM].nodes; j++, to += l->plane) {
            double *const XYZ[3] = { to, to + l->nodes_stride, to + 2 * l->nodes_stride };
            epidermis_at(o, axis[ALONG_CM].node[i], axis[ALONG_BM].node[j]);
            shared_reflectance(o->of->layers, o->epidermis, n_Ch, o->dermises, o->R);
            colour_many_xyz(o->of->colour, n_Ch, o->R, XYZ);
        }
    return STATUS_OK;
}

/* ---- the comparison ----------------------------------------------------------------- */

struct colours {
    double XYZ[3][COMPARED_ROWS + LANES], of[6][COMPARED_ROWS];
};

static void colours_of(const struct opening *o, size_t n, struct colours *c)
{
    const double *const XYZ[3] = { c->XYZ[0], c->XYZ[1], c->XYZ[2] };
    const struct colour_columns to = { c->of[0], c->of[1], c->of[2], c->of[3], c->of[4], c->of[5] };
    colour_many_of_xyz(o->of->colour, n, XYZ, &to);
}

static double furthest(size_t n, const double *x, const double *y)
{
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i] - y[i]));
    return most;
}

/* Rows of one epidermis: from a place in Ch that differs from one epidermis to the next. */
static bool agrees(const struct opening *o, struct lattice_sums *sums, struct grid_place place,
                   struct colours room[2])
{
    size_t n = o->n[ALONG_CH] - place.Ch;
    if (n > COMPARED_ROWS)
        n = COMPARED_ROWS;
    double *const computed[3] = { room[0].XYZ[0], room[0].XYZ[1], room[0].XYZ[2] };
    double *const summed[3] = { room[1].XYZ[0], room[1].XYZ[1], room[1].XYZ[2] };
    epidermis_at(o, place.Cm, place.Bm);
    shared_reflectance(o->of->layers, o->epidermis, n, dermis_at(o, place.Ch), o->R);
    colour_many_xyz(o->of->colour, n, o->R, computed);
    lattice_xyz(o->l, sums, place, n, summed);
    colours_of(o, n, &room[0]);
    colours_of(o, n, &room[1]);
    for (int k = 0; k < 6; k++)
        if (!(furthest(n, room[0].of[k], room[1].of[k]) <=
              (k < 3 ? 1.0 : 0.01) * LATTICE_TOLERANCE))
            return false;
    return true;
}

/* Place `part` of as many as are compared: spread over an axis, and closer together where R changes
 * most, with the value next to the first. */
static size_t compared_at(size_t n, size_t part)
{
    const size_t odd = 2 * part + 1, whole = 4 * (size_t)COMPARED * COMPARED;
    return n < 2 ? 0 : 1 + (n - 2) * odd * odd / whole;
}

/* In another order along each axis. */
static enum status compare(const struct opening *o)
{
    struct colours *room = calloc(2, sizeof *room);
    struct lattice_sums *sums = NULL;
    enum status s = room != NULL ? lattice_sums_open(o->l, &sums) : STATUS_NO_MEMORY;
    for (size_t k = 0; k < COMPARED && s == STATUS_OK; k++) {
        size_t rest = o->n[ALONG_CH] > COMPARED_ROWS ? o->n[ALONG_CH] - COMPARED_ROWS : 0;
        struct grid_place place = { compared_at(o->n[ALONG_CM], k),
                                    compared_at(o->n[ALONG_BM], k * 3 % COMPARED),
                                    (k * 5 % COMPARED) * rest / (COMPARED - 1) };
        if (!agrees(o, sums, place, room))
            s = STATUS_UNSUPPORTED;
    }
    lattice_sums_close(sums);
    free(room);
    return s;
}

/* ---- the contract ------------------------------------------------------------------- */

static bool worth_it(const struct grid *grid)
{
    size_t rows = grid_rows(grid);
    return rows >= LATTICE_ROWS_MIN && rows / grid->Cm.n >= AXIS_SHARE &&
           rows / grid->Bm.n >= AXIS_SHARE && rows / grid->Ch.n >= AXIS_SHARE;
}

/* sigma_a of an epidermis is linear in Cm and in Bm, so its extremes are at the corners; and what
 * formulas reach is a range of it (optics/shared_layers.c). */
static bool all_in_reach(const struct opening *o)
{
    for (size_t corner = 0; corner < 4; corner++)
        if (!epidermis_at(o, corner / 2 * (o->n[ALONG_CM] - 1), corner % 2 * (o->n[ALONG_BM] - 1)))
            return false;
    return true;
}

static enum status open_by(struct opening *o)
{
    o->epidermis = aligned(o->of->layers->epidermis_size);
    o->dermises = aligned(SKELETON_MAX * o->of->layers->dermis_size);
    o->R = aligned(COMPARED_ROWS * o->stride);
    if (o->epidermis == NULL || o->dermises == NULL || o->R == NULL)
        return STATUS_NO_MEMORY;
    if (!all_in_reach(o))
        return STATUS_UNSUPPORTED;
    enum status s = STATUS_OK;
    for (enum along along = ALONG_CM; along < AXES && s == STATUS_OK; along++)
        s = find_axis(o, along);
    if (s == STATUS_OK)
        s = fill(o);
    return s == STATUS_OK ? compare(o) : s;
}

enum status lattice_open(const struct lattice_source *source, struct lattice **ret)
{
    if (!worth_it(source->grid) || source->layers->kind == MODEL_QUICK_NONE)
        return STATUS_OK;
    struct lattice *l = calloc(1, sizeof *l);
    if (l == NULL)
        return STATUS_NO_MEMORY;
    const struct grid *grid = source->grid;
    struct opening o = { .of = source,
                         .l = l,
                         .value = { source->Cm, source->Bm, source->Ch },
                         .n = { grid->Cm.n, grid->Bm.n, grid->Ch.n },
                         .stride = source->layers->stride,
                         .bands = source->layers->c->n };
    l->grid = *grid;
    l->vectors = source->colour->vectors;
    enum status s = open_by(&o);
    free(o.epidermis);
    free(o.dermises);
    free(o.R);
    if (s == STATUS_OK) {
        *ret = l;
        return STATUS_OK;
    }
    lattice_close(l);
    return s == STATUS_UNSUPPORTED ? STATUS_OK : s; /* then all rows are computed */
}

void lattice_close(struct lattice *l)
{
    if (l == NULL)
        return;
    for (enum along along = ALONG_CM; along < AXES; along++)
        skeleton_done(&l->axis[along]);
    free(l->XYZ);
    free(l->along_Ch);
    free(l);
}

enum status lattice_sums_open(const struct lattice *l, struct lattice_sums **ret)
{
    struct lattice_sums *s = calloc(1, sizeof *s);
    if (s == NULL)
        return STATUS_NO_MEMORY;
    s->Cm = s->Bm = SIZE_MAX;
    s->of_Cm = aligned(l->axis[ALONG_BM].nodes * l->plane);
    s->of_Bm = aligned(l->plane);
    if (s->of_Cm == NULL || s->of_Bm == NULL) {
        lattice_sums_close(s);
        return STATUS_NO_MEMORY;
    }
    *ret = s;
    return STATUS_OK;
}

void lattice_sums_close(struct lattice_sums *s)
{
    if (s == NULL)
        return;
    free(s->of_Cm);
    free(s->of_Bm);
    free(s);
}

size_t lattice_nodes(const struct lattice *l)
{
    return l->axis[ALONG_CM].nodes * l->axis[ALONG_BM].nodes * l->axis[ALONG_CH].nodes;
}
