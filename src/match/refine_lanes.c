/* refine_lanes.c - loops over lanes inside loops over bands, compiled for several kinds of vectors.
 */
#include "match/refine_lanes.h"

#include <math.h>
#include <string.h>

#include "match/least_squares.h"
#include "match/refine.h"
#include "optics/dipole.h"
#include "optics/quick_band.h"
#include "optics/quick_band_float.h"

#if defined(__clang__)
#define LANES_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define LANES_WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define LANES_LOOP _Pragma("GCC ivdep")
#define LANES_WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

/* Steps in single precision, for all; at most so many more for those that are far; and at most so
 * many in double precision. */
enum { FLOAT_ROUNDS = 2, FAR_ROUNDS = 8, DOUBLE_ROUNDS = 14 };
/* Far is whose last step promised more than this. */
#define FAR 1.0
/* Secants count where the curvature changed by no more than this share along the way; after so many
 * rounds, where steps go to and fro, all of them. */
#define STEADY 0.2
enum { STEADY_ROUNDS = 3 };
/* A step that promises less than the first may be taken unseen, where no more than the second
 * can be left of chi^2 after it: 3e-4 standard errors.  As match/refine.c has it. */
#define UNSEEN 1e-3
#define LEFT 1e-7
#define TOLERANCE 1e-9
#define SHARE 1e-10

/* Sums over bands, the derivatives being those by Cm, Cm Bm and Ch. */
enum { CC, CM, MM, CH, MH, HH, GC, GM, GH, RR, ALONG, SUMS = ALONG + 4 * NOISE_RANK };

/* What all lanes are at; those at work stand at positions 0, 1, ... of these rows. */
struct work {
    double x[LANES_PARAMETERS][LANES_MOST];
    double sum[SUMS][LANES_MOST];
    double beyond[LANES_MOST]; /* above 0: a band lies outside the formulas' range */
    double step[LANES_PARAMETERS][LANES_MOST], gain[LANES_MOST], last_gain[LANES_MOST];
    double curvature[6][LANES_MOST], gradient[LANES_PARAMETERS][LANES_MOST];
    double variance[LANES_PARAMETERS][LANES_MOST];
    double chi_square[LANES_MOST],
        square[LANES_MOST];    /* after the step; of the bands as they are */
    double inside[LANES_MOST]; /* above 0: the step ends inside the bounds */
    struct box_secant secant[LANES_MOST / LANES];
};

/* ---- sums over bands --------------------------------------------------------------------- */

/* One lane's, while the bands go by; rows of LANES. */
typedef double lane_sums[SUMS][LANES];

/* Products of the derivatives C, M, H and the residual r of lane l with one another. */
QUICK_INLINE void add_products(bool fused, bool placed, const double direction[NOISE_RANK],
                               double C, double M, double H, double r, lane_sums sum, size_t l)
{
    sum[CC][l] = quick_sum(fused, C, C, sum[CC][l]);
    sum[CM][l] = quick_sum(fused, C, M, sum[CM][l]);
    sum[MM][l] = quick_sum(fused, M, M, sum[MM][l]);
    sum[CH][l] = quick_sum(fused, C, H, sum[CH][l]);
    sum[MH][l] = quick_sum(fused, M, H, sum[MH][l]);
    sum[HH][l] = quick_sum(fused, H, H, sum[HH][l]);
    sum[GC][l] = quick_sum(fused, C, r, sum[GC][l]);
    sum[GM][l] = quick_sum(fused, M, r, sum[GM][l]);
    sum[GH][l] = quick_sum(fused, H, r, sum[GH][l]);
    sum[RR][l] = quick_sum(fused, r, r, sum[RR][l]);
    if (!placed)
        return;
    double u = direction[0], v = direction[1];
    sum[ALONG][l] = quick_sum(fused, u, C, sum[ALONG][l]);
    sum[ALONG + 1][l] = quick_sum(fused, u, M, sum[ALONG + 1][l]);
    sum[ALONG + 2][l] = quick_sum(fused, u, H, sum[ALONG + 2][l]);
    sum[ALONG + 3][l] = quick_sum(fused, u, r, sum[ALONG + 3][l]);
    sum[ALONG + 4][l] = quick_sum(fused, v, C, sum[ALONG + 4][l]);
    sum[ALONG + 5][l] = quick_sum(fused, v, M, sum[ALONG + 5][l]);
    sum[ALONG + 6][l] = quick_sum(fused, v, H, sum[ALONG + 6][l]);
    sum[ALONG + 7][l] = quick_sum(fused, v, r, sum[ALONG + 7][l]);
}

static void keep_sums(lane_sums sum, bool placed, size_t at, struct work *w)
{
    for (size_t k = 0; k < (placed ? SUMS : ALONG); k++)
        memcpy(&w->sum[k][at], sum[k], sizeof sum[k]);
}

/* Of LANES lanes from position `at` on, whose spectra are R[bands][LANES]. */
QUICK_INLINE void sums_double(const struct refine_lanes *f, bool fused, bool two, bool placed,
                              const double *restrict R, size_t at, struct work *w)
{
    double Cm[LANES], M[LANES], Ch[LANES], out[LANES] = { 0 };
    double A = f->A, entering = f->entering, d = f->d;
    lane_sums sum = { { 0 } };
    for (size_t l = 0; l < LANES; l++) {
        Cm[l] = w->x[0][at + l];
        M[l] = w->x[0][at + l] * w->x[1][at + l];
        Ch[l] = w->x[2][at + l];
    }
    for (size_t i = 0; i < f->bands; i++) {
        const struct lanes_band *b = &f->band[i];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            double sa1 =
                quick_sum(fused, M[l], b->by_Cm_Bm, quick_sum(fused, Cm[l], b->by_Cm, b->without1));
            double sa2 = quick_sum(fused, Ch[l], b->by_Ch, b->without2);
            struct quick_band y =
                two ? quick_two_layer(fused, true, false, A, entering, d, sa1, b->ss1, sa2, b->ss2)
                    : quick_half_space(fused, A, entering, sa1 + sa2, 1.0);
            add_products(fused, placed, b->direction, y.by_sa1 * b->by_Cm, y.by_sa1 * b->by_Cm_Bm,
                         y.by_sa2 * b->by_Ch, y.R - R[i * LANES + l], sum, l);
            out[l] += y.beyond == 0 ? 0.0 : 1.0;
        }
    }
    keep_sums(sum, placed, at, w);
    memcpy(&w->beyond[at], out, sizeof out);
}

/* The same by single precision, sums too: where equations are so nearly singular that they show
 * it, steps in double precision mend what these have left. */
QUICK_INLINE void sums_float(const struct refine_lanes *f, bool fused, bool two, bool placed,
                             const float *restrict R, size_t at, struct work *w)
{
    float Cm[LANES], Cm_Bm[LANES], Ch[LANES], sum[SUMS][LANES] = { { 0 } };
    float A = (float)f->A, entering = (float)f->entering, d = (float)f->d;
    for (size_t l = 0; l < LANES; l++) {
        Cm[l] = (float)w->x[0][at + l];
        Cm_Bm[l] = (float)(w->x[0][at + l] * w->x[1][at + l]);
        Ch[l] = (float)w->x[2][at + l];
    }
    for (size_t i = 0; i < f->bands; i++) {
        const struct lanes_band_float b = f->band_float[i];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            float sa1 = quick_sum_float(fused, Cm_Bm[l], b.by_Cm_Bm,
                                        quick_sum_float(fused, Cm[l], b.by_Cm, b.without1));
            float sa2 = quick_sum_float(fused, Ch[l], b.by_Ch, b.without2);
            struct quick_band_float y =
                two ? quick_two_layer_float(fused, A, entering, d, sa1, b.ss1, sa2, b.ss2)
                    : quick_half_space_float(fused, A, entering, sa1 + sa2, 1.0f);
            float C = y.by_sa1 * b.by_Cm, M = y.by_sa1 * b.by_Cm_Bm, H = y.by_sa2 * b.by_Ch;
            float r = y.R - R[i * LANES + l];
            sum[CC][l] = quick_sum_float(fused, C, C, sum[CC][l]);
            sum[CM][l] = quick_sum_float(fused, C, M, sum[CM][l]);
            sum[MM][l] = quick_sum_float(fused, M, M, sum[MM][l]);
            sum[CH][l] = quick_sum_float(fused, C, H, sum[CH][l]);
            sum[MH][l] = quick_sum_float(fused, M, H, sum[MH][l]);
            sum[HH][l] = quick_sum_float(fused, H, H, sum[HH][l]);
            sum[GC][l] = quick_sum_float(fused, C, r, sum[GC][l]);
            sum[GM][l] = quick_sum_float(fused, M, r, sum[GM][l]);
            sum[GH][l] = quick_sum_float(fused, H, r, sum[GH][l]);
            if (placed) {
                float u = b.direction[0], v = b.direction[1];
                sum[ALONG][l] = quick_sum_float(fused, u, C, sum[ALONG][l]);
                sum[ALONG + 1][l] = quick_sum_float(fused, u, M, sum[ALONG + 1][l]);
                sum[ALONG + 2][l] = quick_sum_float(fused, u, H, sum[ALONG + 2][l]);
                sum[ALONG + 3][l] = quick_sum_float(fused, u, r, sum[ALONG + 3][l]);
                sum[ALONG + 4][l] = quick_sum_float(fused, v, C, sum[ALONG + 4][l]);
                sum[ALONG + 5][l] = quick_sum_float(fused, v, M, sum[ALONG + 5][l]);
                sum[ALONG + 6][l] = quick_sum_float(fused, v, H, sum[ALONG + 6][l]);
                sum[ALONG + 7][l] = quick_sum_float(fused, v, r, sum[ALONG + 7][l]);
            }
        }
    }
    for (size_t k = 0; k < (placed ? SUMS : ALONG); k++)
        for (size_t l = 0; l < LANES; l++)
            w->sum[k][at + l] = (double)sum[k][l];
}

/* ---- the start ----------------------------------------------------------------------------- */

/* Clamped, and where that is not a number the lower bound. */
QUICK_INLINE double inside(double x, double lo, double hi)
{
    return x > lo ? (x < hi ? x : hi) : lo;
}

/* Where the polynomial tells no guess, the straight one. */
QUICK_INLINE void start_linearly(const struct guess *g, bool fused,
                                 float component[GUESS_PARAMETERS][LANES],
                                 float value[GUESS_PARAMETERS][LANES])
{
    float away[LANES] = { 0 };
    for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
        float least = g->least[k], most = g->most[k];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            float x = value[k][l], less = x < least ? 1.0f : 0.0f;
            away[l] += x > most ? 1.0f : less;
        }
    }
    for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
        float at = g->linear[0][k], by0 = g->linear[1][k], by1 = g->linear[2][k];
        float by2 = g->linear[3][k];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            float x = quick_sum_float(fused, by0, component[0][l], at);
            x = quick_sum_float(fused, by1, component[1][l], x);
            x = quick_sum_float(fused, by2, component[2][l], x);
            value[k][l] = away[l] > 0.0f ? x : value[k][l];
        }
    }
}

/* By match/guess.h, of LANES lanes from position `at` on. */
QUICK_INLINE void starts(const struct refine_lanes *f, bool fused, const float *restrict R,
                         size_t at, struct work *w)
{
    const struct guess *g = &f->guess;
    float component[GUESS_PARAMETERS][LANES], value[GUESS_PARAMETERS][LANES];
    float term[GUESS_TERMS][LANES];
    for (size_t l = 0; l < LANES; l++) {
        for (size_t k = 0; k < GUESS_PARAMETERS; k++) {
            component[k][l] = -g->offset[k];
            value[k][l] = g->term[0][k];
        }
        term[0][l] = 1.0f;
    }
    for (size_t i = 0; i < f->bands; i++) {
        const float *by = g->direction[i];
        float by0 = by[0], by1 = by[1], by2 = by[2];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            float straight = guess_straight(R[i * LANES + l]);
            component[0][l] = quick_sum_float(fused, by0, straight, component[0][l]);
            component[1][l] = quick_sum_float(fused, by1, straight, component[1][l]);
            component[2][l] = quick_sum_float(fused, by2, straight, component[2][l]);
        }
    }
    for (size_t i = 1; i < GUESS_TERMS; i++) {
        const float *by = component[g->by[i]], *before = term[g->before[i]], *share = g->term[i];
        float share0 = share[0], share1 = share[1], share2 = share[2];
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++) {
            float x = before[l] * by[l];
            term[i][l] = x;
            value[0][l] = quick_sum_float(fused, share0, x, value[0][l]);
            value[1][l] = quick_sum_float(fused, share1, x, value[1][l]);
            value[2][l] = quick_sum_float(fused, share2, x, value[2][l]);
        }
    }
    double lo0 = f->lo[0], hi0 = f->hi[0], lo1 = f->lo[1], hi1 = f->hi[1], lo2 = f->lo[2];
    double hi2 = f->hi[2];
    start_linearly(g, fused, component, value);
    LANES_LOOP
    for (size_t l = 0; l < LANES; l++) {
        double Cm = (double)value[0][l], Bm = (double)value[1][l], Ch = (double)value[2][l];
        w->x[0][at + l] = inside(Cm > 0.0 ? Cm * Cm : 0.0, lo0, hi0);
        w->x[1][at + l] = inside(Bm, lo1, hi1);
        w->x[2][at + l] = inside(Ch > 0.0 ? Ch * Ch : 0.0, lo2, hi2);
    }
}

/* ---- steps --------------------------------------------------------------------------------- */

/* From sums by Cm, Cm Bm and Ch to gradient and curvature by Cm, Bm and Ch, whitened, and the step
 * to the quadratic's minimum without bounds. */
QUICK_INLINE void free_steps(const struct refine_lanes *f, bool placed, size_t at,
                             struct work *restrict w)
{
    double weight = 1.0 / f->white2;
    double lo0 = f->lo[0], hi0 = f->hi[0], lo1 = f->lo[1], hi1 = f->hi[1], lo2 = f->lo[2];
    double hi2 = f->hi[2], taken0 = f->taken[0], taken1 = f->taken[1];
    LANES_LOOP
    for (size_t l = at; l < at + LANES; l++) {
        double cc = w->sum[CC][l], cm = w->sum[CM][l], mm = w->sum[MM][l], ch = w->sum[CH][l];
        double mh = w->sum[MH][l], hh = w->sum[HH][l], gc = w->sum[GC][l], gm = w->sum[GM][l];
        double gh = w->sum[GH][l], rr = w->sum[RR][l];
        if (placed) {
            double u0 = w->sum[ALONG][l], u1 = w->sum[ALONG + 1][l], u2 = w->sum[ALONG + 2][l];
            double u3 = w->sum[ALONG + 3][l], v0 = w->sum[ALONG + 4][l], v1 = w->sum[ALONG + 5][l];
            double v2 = w->sum[ALONG + 6][l], v3 = w->sum[ALONG + 7][l];
            double u0_ = taken0 * u0, u1_ = taken0 * u1, u2_ = taken0 * u2, u3_ = taken0 * u3;
            double v0_ = taken1 * v0, v1_ = taken1 * v1, v2_ = taken1 * v2, v3_ = taken1 * v3;
            cc -= u0_ * u0 + v0_ * v0;
            cm -= u0_ * u1 + v0_ * v1;
            mm -= u1_ * u1 + v1_ * v1;
            ch -= u0_ * u2 + v0_ * v2;
            mh -= u1_ * u2 + v1_ * v2;
            hh -= u2_ * u2 + v2_ * v2;
            gc -= u3_ * u0 + v3_ * v0;
            gm -= u3_ * u1 + v3_ * v1;
            gh -= u3_ * u2 + v3_ * v2;
            rr -= u3_ * u3 + v3_ * v3;
        }
        double Cm = w->x[0][l], Bm = w->x[1][l], Ch = w->x[2][l];
        double a00 = weight * (cc + 2.0 * Bm * cm + Bm * Bm * mm),
               a10 = weight * Cm * (cm + Bm * mm);
        double a11 = weight * Cm * Cm * mm, a20 = weight * (ch + Bm * mh), a21 = weight * Cm * mh;
        double a22 = weight * hh, g0 = weight * (gc + Bm * gm), g1 = weight * Cm * gm;
        double g2 = weight * gh;
        /* L D L^T; a pivot that rounding has eaten is a direction that is not seen. */
        double i0 = 1.0 / a00, l10 = a10 * i0, l20 = a20 * i0;
        double d1 = a11 - l10 * a10, i1 = d1 > 1e-14 * a11 ? 1.0 / d1 : 0.0;
        double w21 = a21 - l20 * a10, l21 = w21 * i1;
        double d2 = a22 - l20 * a20 - l21 * w21, i2 = d2 > 1e-14 * a22 ? 1.0 / d2 : 0.0;
        double y1 = l10 * g0 - g1, y2 = l20 * g0 - g2 - l21 * y1;
        double p2 = y2 * i2, p1 = y1 * i1 - l21 * p2, p0 = -g0 * i0 - l10 * p1 - l20 * p2;
        w->gradient[0][l] = g0;
        w->gradient[1][l] = g1;
        w->gradient[2][l] = g2;
        w->curvature[0][l] = a00;
        w->curvature[1][l] = a10;
        w->curvature[2][l] = a11;
        w->curvature[3][l] = a20;
        w->curvature[4][l] = a21;
        w->curvature[5][l] = a22;
        w->step[0][l] = p0;
        w->step[1][l] = p1;
        w->step[2][l] = p2;
        w->gain[l] = -(p0 * g0 + p1 * g1 + p2 * g2);
        w->chi_square[l] = weight * rr;
        /* 0 where it is not a number either. */
        double room0 = Cm + p0 > hi0 ? -1.0 : Cm + p0 - lo0,
               room1 = Bm + p1 > hi1 ? -1.0 : Bm + p1 - lo1;
        double room2 = Ch + p2 > hi2 ? -1.0 : Ch + p2 - lo2;
        double less = room0 < room1 ? room0 : room1, least = less < room2 ? less : room2;
        w->inside[l] = least >= 0.0 ? 1.0 : 0.0;
        double m20 = l10 * l21 - l20;
        w->variance[0][l] = i1 * i2 > 0.0 ? i0 + l10 * l10 * i1 + m20 * m20 * i2 : 0.0;
        w->variance[1][l] = i1 + l21 * l21 * i2;
        w->variance[2][l] = i2;
    }
}

/* Position l into lane k of a box, and back. */
static void into_box(const struct work *w, size_t l, size_t k, struct box_lanes *b)
{
    for (size_t i = 0; i < LANES_PARAMETERS; i++) {
        b->x[i][k] = w->x[i][l];
        b->gradient[i][k] = w->gradient[i][l];
    }
    for (size_t i = 0; i < BOX_TRIANGLE; i++)
        b->curvature[i][k] = w->curvature[i][l];
}

static void out_of_box(const struct box_lanes *b, size_t k, size_t l, struct work *w)
{
    for (size_t i = 0; i < LANES_PARAMETERS; i++)
        w->step[i][l] = b->step[i][k];
    w->gain[l] = b->gain[k];
}

/* The steps that would leave the bounds: to the quadratic's minimum inside. */
static void bounded_steps(const struct refine_lanes *f, enum quick_vectors v, size_t n,
                          struct work *w)
{
    unsigned short out[LANES_MOST];
    struct box_lanes b;
    size_t found = 0;
    for (size_t l = 0; l < n; l++)
        if (w->inside[l] == 0.0)
            out[found++] = (unsigned short)l;
    for (size_t at = 0; at < found; at += LANES) {
        for (size_t k = 0; k < LANES; k++) /* the last one again */
            into_box(w, out[at + k < found ? at + k : found - 1], k, &b);
        box_lanes_step(v, f->lo, f->hi, &b);
        for (size_t k = 0; k < LANES && at + k < found; k++)
            out_of_box(&b, k, out[at + k], w);
    }
}

/* The same of all of n, with what their ways have told of the residuals' own curvature. */
static void bent_steps(const struct refine_lanes *f, enum quick_vectors v, double steady, size_t n,
                       struct work *w)
{
    struct box_lanes b;
    for (size_t at = 0; at < n; at += LANES) {
        for (size_t k = 0; k < LANES; k++)
            into_box(w, at + k, k, &b);
        box_lanes_bend(v, steady, &w->secant[at / LANES], &b);
        box_lanes_step(v, f->lo, f->hi, &b);
        for (size_t k = 0; k < LANES; k++)
            out_of_box(&b, k, at + k, w);
    }
}

/* From where they are by their steps. */
QUICK_INLINE void take_steps(const struct refine_lanes *f, size_t n, struct work *restrict w)
{
    for (size_t i = 0; i < LANES_PARAMETERS; i++) {
        double lo = f->lo[i], hi = f->hi[i];
        for (size_t at = 0; at < n; at += LANES) {
            LANES_LOOP
            for (size_t l = at; l < at + LANES; l++)
                w->x[i][l] = inside(w->x[i][l] + w->step[i][l], lo, hi);
        }
    }
}

/* Of n lanes, whole groups of them. */
QUICK_INLINE void steps(const struct refine_lanes *f, enum quick_vectors v, bool placed, size_t n,
                        struct work *w)
{
    for (size_t at = 0; at < n; at += LANES)
        free_steps(f, placed, at, w);
    bounded_steps(f, v, n, w);
}

/* ---- a call --------------------------------------------------------------------------------- */

/* What is no spectrum is refused, and another stands in its place. */
QUICK_INLINE void check(const struct refine_lanes *f, size_t group, double *restrict R,
                        float *restrict single, struct lanes_answer *ret)
{
    double wrong[LANES] = { 0 };
    for (size_t i = 0; i < f->bands; i++) {
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++)
            wrong[l] += fabs(R[i * LANES + l]) <= REFINE_R_MAX ? 0.0 : 1.0;
        LANES_LOOP
        for (size_t l = 0; l < LANES; l++)
            single[i * LANES + l] = (float)R[i * LANES + l];
    }
    for (size_t l = 0; l < LANES; l++) {
        ret->state[group * LANES + l] =
            (unsigned char)(wrong[l] > 0.0 ? LANES_REFUSED : LANES_GIVEN_UP);
        for (size_t i = 0; wrong[l] > 0.0 && i < f->bands; i++)
            R[i * LANES + l] = (double)(single[i * LANES + l] = 0.3f);
    }
}

/* The lane at position l has come to rest where its step leads. */
static void tell(const struct refine_lanes *f, const struct work *w, size_t l, size_t lane,
                 struct lanes_answer *ret)
{
    double square = w->sum[RR][l], Cm = w->x[0][l], Bm = w->x[1][l];
    const double *p[LANES_PARAMETERS] = { w->step[0], w->step[1], w->step[2] };
    if (!f->placed) {
        square -= w->gain[l] * f->white2;
    } else { /* the change of what is not whitened, by Cm, Cm Bm and Ch */
        double C = p[0][l], M = Bm * p[0][l] + Cm * p[1][l], H = p[2][l];
        square += 2.0 * (C * w->sum[GC][l] + M * w->sum[GM][l] + H * w->sum[GH][l]) +
                  C * (C * w->sum[CC][l] + 2.0 * M * w->sum[CM][l] + 2.0 * H * w->sum[CH][l]) +
                  M * (M * w->sum[MM][l] + 2.0 * H * w->sum[MH][l]) + H * H * w->sum[HH][l];
    }
    ret->rms[lane] = sqrt(fmax(square, 0.0) / (double)f->bands);
    ret->chi_square[lane] = fmax(w->chi_square[l] - w->gain[l], 0.0);
    bool seen = w->variance[0][l] > 0.0;
    double covariance[LANES_PARAMETERS * LANES_PARAMETERS];
    if (!seen) {
        struct normal normal;
        double unseen[LANES_PARAMETERS];
        for (size_t k = 0; k < 6; k++)
            normal.curvature[k] = w->curvature[k][l];
        for (size_t i = 0; i < LANES_PARAMETERS; i++)
            unseen[i] = (f->hi[i] - f->lo[i]) * (f->hi[i] - f->lo[i]);
        normal_covariance(&normal, LANES_PARAMETERS, unseen, covariance);
    }
    for (size_t i = 0; i < LANES_PARAMETERS; i++) {
        double most = f->hi[i] - f->lo[i];
        double se = sqrt(seen ? w->variance[i][l] : covariance[(LANES_PARAMETERS + 1) * i]);
        ret->value[i][lane] = inside(w->x[i][l] + p[i][l], f->lo[i], f->hi[i]);
        ret->se[i][lane] = se < most ? se : most;
    }
    ret->state[lane] = LANES_FITTED;
}

static bool at_rest(const struct work *w, size_t l)
{
    double gain = w->gain[l], last = w->last_gain[l];
    return gain <= TOLERANCE + SHARE * w->chi_square[l] ||
           (gain < UNSEEN && gain < last && gain * gain < LEFT * last);
}

/* Group `to` of positions from the lanes that are listed, their spectra into R. */
static void gather(const struct refine_lanes *f, const double *from, const unsigned short *lane,
                   double *restrict R)
{
    size_t group = f->bands * LANES;
    for (size_t l = 0; l < LANES; l++) {
        const double *at = from + lane[l] / LANES * group + lane[l] % LANES;
        for (size_t i = 0; i < f->bands; i++)
            R[i * LANES + l] = at[i * LANES];
    }
}

static void gather_float(const struct refine_lanes *f, const float *from,
                         const unsigned short *lane, float *restrict R)
{
    size_t group = f->bands * LANES;
    for (size_t l = 0; l < LANES; l++) {
        const float *at = from + lane[l] / LANES * group + lane[l] % LANES;
        for (size_t i = 0; i < f->bands; i++)
            R[i * LANES + l] = at[i * LANES];
    }
}

/* A lane that goes on moves from position l to position `to`; bent: with what its way has told. */
static void move(bool bent, size_t l, size_t to, struct work *w)
{
    struct box_secant *secant = &w->secant[to / LANES];
    const struct box_secant *from = &w->secant[l / LANES];
    size_t a = l % LANES, b = to % LANES;
    for (size_t i = 0; i < LANES_PARAMETERS; i++) {
        secant->x[i][b] = bent ? from->x[i][a] : w->x[i][l];
        secant->gradient[i][b] = bent ? from->gradient[i][a] : w->gradient[i][l];
        w->x[i][to] = w->x[i][l];
        w->step[i][to] = w->step[i][l];
    }
    for (size_t k = 0; k < BOX_TRIANGLE; k++) {
        secant->curvature[k][b] = bent ? from->curvature[k][a] : w->curvature[k][l];
        secant->more[k][b] = bent ? from->more[k][a] : 0.0;
    }
    w->gain[to] = w->gain[l];
}

/* Those of `left` lanes that are at rest are told, those beyond the formulas given up; the rest
 * move up, and the last of them fills its group.  How many they are. */
static size_t sort_out(const struct refine_lanes *f, bool bent, size_t left, unsigned short *lane,
                       struct work *w, struct lanes_answer *ret)
{
    size_t more = 0;
    for (size_t l = 0; l < left; l++) {
        if (ret->state[lane[l]] == LANES_REFUSED || w->beyond[l] > 0.0 || !isfinite(w->gain[l]))
            continue;
        if (at_rest(w, l)) {
            tell(f, w, l, lane[l], ret);
            continue;
        }
        lane[more] = lane[l];
        move(bent, l, more++, w);
    }
    for (size_t l = more; l % LANES != 0; l++) {
        lane[l] = lane[more - 1];
        move(true, more - 1, l, w);
    }
    return more;
}

/* Steps in single precision: all of `lanes`, whole groups. */
QUICK_INLINE void approach(const struct refine_lanes *f, enum quick_vectors v, bool two,
                           bool placed, const float *single, size_t lanes, struct work *w)
{
    size_t group = f->bands * LANES;
    for (int round = 0; round < FLOAT_ROUNDS; round++) {
        for (size_t at = 0; at < lanes; at += LANES)
            sums_float(f, v != QUICK_PLAIN, two, placed, single + at / LANES * group, at, w);
        steps(f, v, placed, lanes, w);
        memcpy(w->last_gain, w->gain, lanes * sizeof *w->gain);
        take_steps(f, lanes, w);
    }
}

/* Those whose last step was long go on in single precision, closed up. */
QUICK_INLINE void pursue(const struct refine_lanes *f, enum quick_vectors v, bool two, bool placed,
                         const float *single, size_t n, struct work *w)
{
    unsigned short lane[LANES_MOST];
    float gathered[SPECTRUM_MAX_BANDS * LANES];
    double x[LANES_PARAMETERS][LANES_MOST], gain[LANES_MOST];
    size_t left = 0;
    for (size_t l = 0; l < n; l++)
        if (w->gain[l] > FAR)
            lane[left++] = (unsigned short)l;
    if (left == 0)
        return;
    memcpy(x, w->x, sizeof x);
    memcpy(gain, w->gain, sizeof gain);
    for (size_t l = 0; l < left; l++)
        for (size_t i = 0; i < LANES_PARAMETERS; i++)
            w->x[i][l] = x[i][lane[l]];
    for (int round = 0; round < FAR_ROUNDS && left > 0; round++) {
        size_t whole = (left + LANES - 1) / LANES * LANES, more = 0;
        for (size_t l = left; l < whole; l++) { /* the last one again */
            lane[l] = lane[left - 1];
            for (size_t i = 0; i < LANES_PARAMETERS; i++)
                w->x[i][l] = w->x[i][left - 1];
        }
        for (size_t at = 0; at < whole; at += LANES) {
            gather_float(f, single, lane + at, gathered);
            sums_float(f, v != QUICK_PLAIN, two, placed, gathered, at, w);
        }
        steps(f, v, placed, whole, w);
        take_steps(f, whole, w);
        for (size_t l = 0; l < left; l++) {
            gain[lane[l]] = w->gain[l];
            for (size_t i = 0; i < LANES_PARAMETERS; i++)
                x[i][lane[l]] = w->x[i][more] = w->x[i][l];
            lane[more] = lane[l];
            more += w->gain[l] > FAR ? 1 : 0;
        }
        left = more;
    }
    memcpy(w->x, x, sizeof x);
    memcpy(w->last_gain, gain, sizeof gain);
}

/* Constant arguments, so that each of the loops is made for its own. */
QUICK_INLINE void run(const struct refine_lanes *f, enum quick_vectors v, bool two, bool placed,
                      double *R, size_t n, struct lanes_answer *ret)
{
    struct work w;
    float single[SPECTRUM_MAX_BANDS * LANES];
    double gathered[SPECTRUM_MAX_BANDS * LANES];
    unsigned short lane[LANES_MOST];
    bool fused = v != QUICK_PLAIN;
    size_t groups = (n + LANES - 1) / LANES, group = f->bands * LANES, left = n;
    memset(w.x, 0, sizeof w.x);
    for (size_t g = 0; g < groups; g++) {
        check(f, g, R + g * group, single + g * group, ret);
        starts(f, fused, single + g * group, g * LANES, &w);
    }
    approach(f, v, two, placed, single, groups * LANES, &w);
    pursue(f, v, two, placed, single, n, &w);
    for (size_t l = 0; l < LANES_MOST; l++)
        lane[l] = (unsigned short)l;
    for (int round = 0; round < DOUBLE_ROUNDS && left > 0; round++) {
        size_t whole = (left + LANES - 1) / LANES * LANES;
        for (size_t at = 0; at < whole; at += LANES) {
            const double *spectra = R + at / LANES * group;
            if (round > 0) {
                gather(f, R, lane + at, gathered);
                spectra = gathered;
            }
            sums_double(f, fused, two, placed, spectra, at, &w);
        }
        for (size_t at = 0; at < whole; at += LANES)
            free_steps(f, placed, at, &w);
        if (round == 0)
            bounded_steps(f, v, whole, &w);
        else
            bent_steps(f, v, round < STEADY_ROUNDS ? STEADY : INFINITY, whole, &w);
        left = sort_out(f, round > 0, left, lane, &w, ret);
        whole = (left + LANES - 1) / LANES * LANES;
        memcpy(w.last_gain, w.gain, whole * sizeof *w.gain);
        take_steps(f, whole, &w);
    }
}

/* ---- for each kind of vectors ---------------------------------------------------------------- */

QUICK_INLINE void run_kind(const struct refine_lanes *f, enum quick_vectors v, double *R, size_t n,
                           struct lanes_answer *ret)
{
    if (f->two_layer && f->placed)
        run(f, v, true, true, R, n, ret);
    else if (f->two_layer)
        run(f, v, true, false, R, n, ret);
    else if (f->placed)
        run(f, v, false, true, R, n, ret);
    else
        run(f, v, false, false, R, n, ret);
}

static void run_plain(const struct refine_lanes *f, double *R, size_t n, struct lanes_answer *ret)
{
    run_kind(f, QUICK_PLAIN, R, n, ret);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static void run_avx2(const struct refine_lanes *f, double *R,
                                                         size_t n, struct lanes_answer *ret)
{
    run_kind(f, QUICK_AVX2, R, n, ret);
}

__attribute__((target(LANES_WIDE))) static void run_avx512(const struct refine_lanes *f, double *R,
                                                           size_t n, struct lanes_answer *ret)
{
    run_kind(f, QUICK_AVX512, R, n, ret);
}
#else
#define run_avx2 run_plain
#define run_avx512 run_plain
#endif

void refine_lanes_run_by(enum quick_vectors v, const struct refine_lanes *fit, double *R, size_t n,
                         struct lanes_answer *ret)
{
    if (v == QUICK_AVX512)
        run_avx512(fit, R, n, ret);
    else if (v == QUICK_AVX2)
        run_avx2(fit, R, n, ret);
    else
        run_plain(fit, R, n, ret);
}

void refine_lanes_run(const struct refine_lanes *fit, double *R, size_t n, struct lanes_answer *ret)
{
    refine_lanes_run_by(fit->vectors, fit, R, n, ret);
}

/* ---- what fits share ------------------------------------------------------------------------- */

/* Nothing but the three free, each with room, no priors, no spread: what lanes know of. */
static bool for_lanes(const struct fit *fit)
{
    const unsigned three = 1u << SKIN_CM | 1u << SKIN_BM | 1u << SKIN_CH;
    bool model =
        fit->model->quick == MODEL_QUICK_HALF_SPACE || fit->model->quick == MODEL_QUICK_TWO_LAYER;
    if (!model || fit_free(fit) != three)
        return false;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        if (isfinite(fit->role[i].prior_sd) || fit->role[i].spread > 0.0)
            return false;
    return true;
}

static void bands(const struct fit *fit, const struct tissue *t, const struct chromophores *c,
                  struct refine_lanes *ret)
{
    bool two = ret->two_layer;
    for (size_t i = 0; i < c->n; i++) {
        double law = fit->own_scattering ? t->scattering_a * exp(-t->scattering_b * c->log_nm[i])
                                         : c->sigma_s_prime[i];
        double unit = two ? 1.0 : 1.0 / law; /* the half space knows their ratio alone */
        double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i];
        ret->band[i] = (struct lanes_band){
            .without1 = unit * c->base[i],
            .without2 = unit * c->base[i],
            .by_Cm = unit * (c->pheomelanin[i] - c->base[i]),
            .by_Cm_Bm = unit * (c->eumelanin[i] - c->pheomelanin[i]),
            .by_Ch = unit * (blood - c->base[i]),
            .ss1 = law,
            .ss2 = fit->own_scattering ? law : 0.5 * law,
        };
        const struct lanes_band *b = &ret->band[i];
        ret->band_float[i] = (struct lanes_band_float){
            .without1 = (float)b->without1,
            .without2 = (float)b->without2,
            .by_Cm = (float)b->by_Cm,
            .by_Cm_Bm = (float)b->by_Cm_Bm,
            .by_Ch = (float)b->by_Ch,
            .ss1 = (float)b->ss1,
            .ss2 = (float)b->ss2,
        };
    }
}

/* False where next to nothing is left along a direction: sums would cancel. */
static bool noise_for_lanes(const struct noise *noise, double white2, const double *nm, size_t n,
                            struct refine_lanes *ret)
{
    double weight[SPECTRUM_MAX_BANDS];
    struct whitener whitener;
    struct noise all = *noise;
    all.white = sqrt(white2);
    for (size_t i = 0; i < n; i++)
        weight[i] = 1.0;
    whitener_init(&all, 1, nm, weight, n, ret->directions, &whitener);
    ret->white2 = whitener.white2;
    ret->placed = whitener.rank > 0;
    for (size_t k = 0; k < whitener.rank; k++) {
        double keep2 = whitener.keep[k] * whitener.keep[k];
        if (keep2 < 1e-5)
            return false;
        ret->taken[k] = 1.0 - keep2;
        for (size_t i = 0; i < n; i++)
            ret->band_float[i].direction[k] =
                (float)(ret->band[i].direction[k] = whitener.direction[k][i]);
    }
    return true;
}

enum status refine_lanes_init(const struct fit *fit, const struct noise *noise,
                              const struct chromophores *c, const double *nm,
                              struct refine_lanes *ret)
{
    static const enum skin_parameter which[LANES_PARAMETERS] = { SKIN_CM, SKIN_BM, SKIN_CH };
    double value[SKIN_PARAMETERS];
    struct quick quick;
    quick_init(fit->model, c, fit->eta, &quick);
    if (!for_lanes(fit) || !quick.formulas)
        return STATUS_UNSUPPORTED;
    for (size_t i = 0; i < SKIN_PARAMETERS; i++)
        value[i] = fit->role[i].value;
    struct tissue t = fit_tissue(fit, value);
    ret->bands = c->n;
    ret->two_layer = fit->model->quick == MODEL_QUICK_TWO_LAYER;
    ret->A = quick.A;
    ret->entering = quick.entering;
    ret->d = t.epidermis_mm;
    ret->vectors = quick.vectors;
    for (size_t i = 0; i < LANES_PARAMETERS; i++) {
        ret->value[i] = fit->role[which[i]].value;
        ret->lo[i] = fit->role[which[i]].lo;
        ret->hi[i] = fit->role[which[i]].hi;
    }
    bands(fit, &t, c, ret);
    double white2 = noise->white * noise->white + fit->model_error * fit->model_error;
    if (!noise_for_lanes(noise, white2, nm, c->n, ret))
        return STATUS_UNSUPPORTED;
    return guess_init(fit, &quick, &ret->guess);
}
