/* box_lanes.c - the active-set method of match/least_squares.c with a mask for each choice. */
#include "match/box_lanes.h"

#include <math.h>
#include <string.h>

#if defined(__clang__)
#define BOX_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define BOX_WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define BOX_LOOP _Pragma("GCC ivdep")
#define BOX_WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif
#define BOX_INLINE static inline __attribute__((always_inline))

/* Ends by itself long before; the limit is for rounding. */
enum { TURNS = 16 };
/* A pivot below this share of what it was before elimination is not seen. */
#define PIVOT 1e-14
/* Nothing is let go for less. */
#define WORTH 1e-12
/* Secants count that differ by this share of the curvature known; a sum that keeps less than this
 * share of a pivot is no minimum's. */
#define TELLS 1e-3
#define KEPT 0.02

/* Masks are 1 and 0, for numbers become vectors where truth values do not. */
struct walkers {
    double p[BOX_PARAMETERS][BOX_LANES], held[BOX_PARAMETERS][BOX_LANES], busy[BOX_LANES];
};

/* ---- the least inside a box -------------------------------------------------------------- */

/* What rests on a bound and is pulled outwards; nobody has walked yet. */
BOX_INLINE void hold(const double *lo, const double *hi, const struct box_lanes *b,
                     struct walkers *restrict w)
{
    for (size_t i = 0; i < BOX_PARAMETERS; i++) {
        const double least = lo[i], most = hi[i], *restrict x = b->x[i];
        const double *restrict g = b->gradient[i];
        double *restrict held = w->held[i];
        BOX_LOOP
        for (size_t l = 0; l < BOX_LANES; l++) {
            double below = x[l] <= least ? g[l] : -1.0, above = x[l] >= most ? -g[l] : -1.0;
            double outwards = below > above ? below : above;
            held[l] = outwards >= 0.0 ? 1.0 : 0.0;
        }
    }
    for (size_t l = 0; l < BOX_LANES; l++)
        w->busy[l] = 1.0;
}

/* The share of a way of length d, from p, that stays inside. */
BOX_INLINE double share_inside(double d, double below, double above)
{
    double room = d < 0.0 ? -below : above, way = fabs(d);
    room = room > 0.0 ? room : 0.0;
    return way > room ? room / way : 1.0;
}

/* What letting one go that is held would take off chi^2; 0 where it stays. */
BOX_INLINE double worth(double held, double slope, double curvature, double below)
{
    double inwards = below >= 0.0 ? -slope : slope;
    double pull = inwards > 0.0 ? held * inwards : 0.0;
    return curvature > 0.0 ? pull * pull / curvature : 0.0;
}

/* One walk of those that are busy: towards the least over what is not held, to rest at the first
 * bound met; who went all the way lets one go, or is done. */
BOX_INLINE void walk(const double *lo, const double *hi, const struct box_lanes *b,
                     struct walkers *restrict w)
{
    double lo0 = lo[0], lo1 = lo[1], lo2 = lo[2], hi0 = hi[0], hi1 = hi[1], hi2 = hi[2];
    BOX_LOOP
    for (size_t l = 0; l < BOX_LANES; l++) {
        double a00 = b->curvature[0][l], a10 = b->curvature[1][l], a11 = b->curvature[2][l];
        double a20 = b->curvature[3][l], a21 = b->curvature[4][l], a22 = b->curvature[5][l];
        double g0 = b->gradient[0][l], g1 = b->gradient[1][l], g2 = b->gradient[2][l];
        double low0 = lo0 - b->x[0][l], low1 = lo1 - b->x[1][l], low2 = lo2 - b->x[2][l];
        double high0 = hi0 - b->x[0][l], high1 = hi1 - b->x[1][l], high2 = hi2 - b->x[2][l];
        double p0 = w->p[0][l], p1 = w->p[1][l], p2 = w->p[2][l];
        double held0 = w->held[0][l], held1 = w->held[1][l], held2 = w->held[2][l];
        double busy = w->busy[l];
        /* L D L^T of what is free; a pivot that rounding has eaten is not seen. */
        double b0 = held0 > 0.0 ? 0.0 : -(g0 + a00 * p0 + a10 * p1 + a20 * p2);
        double b1 = held1 > 0.0 ? 0.0 : -(g1 + a10 * p0 + a11 * p1 + a21 * p2);
        double b2 = held2 > 0.0 ? 0.0 : -(g2 + a20 * p0 + a21 * p1 + a22 * p2);
        double c10 = held0 + held1 > 0.0 ? 0.0 : a10, c20 = held0 + held2 > 0.0 ? 0.0 : a20;
        double c21 = held1 + held2 > 0.0 ? 0.0 : a21;
        double i0 = a00 > 0.0 ? 1.0 / a00 : 0.0, l10 = c10 * i0, l20 = c20 * i0;
        double d1 = a11 - l10 * c10, i1 = d1 > PIVOT * fabs(a11) ? 1.0 / d1 : 0.0;
        double w21 = c21 - l20 * c10, l21 = w21 * i1;
        double d2 = a22 - l20 * c20 - l21 * w21, i2 = d2 > PIVOT * fabs(a22) ? 1.0 / d2 : 0.0;
        double y1 = b1 - l10 * b0, y2 = b2 - l20 * b0 - l21 * y1;
        double z2 = y2 * i2, z1 = y1 * i1 - l21 * z2, z0 = b0 * i0 - l10 * z1 - l20 * z2;
        /* As far as the first bound. */
        double share0 = share_inside(z0, low0 - p0, high0 - p0);
        double share1 = share_inside(z1, low1 - p1, high1 - p1);
        double share2 = share_inside(z2, low2 - p2, high2 - p2);
        double first = share0 < share1 ? share0 : share1, share = first < share2 ? first : share2;
        double met = share < 1.0 ? 1.0 : 0.0;
        double stays0 = share0 <= share ? met : 0.0;
        double stays1 = share1 <= share ? met - stays0 : 0.0;
        double stays2 = share2 <= share ? met - stays0 - stays1 : 0.0;
        double end0 = z0 < 0.0 ? low0 : high0, end1 = z1 < 0.0 ? low1 : high1;
        double end2 = z2 < 0.0 ? low2 : high2;
        p0 = stays0 > 0.0 ? end0 : p0 + share * z0;
        p1 = stays1 > 0.0 ? end1 : p1 + share * z1;
        p2 = stays2 > 0.0 ? end2 : p2 + share * z2;
        /* Who has met none lets go of what would lower chi^2 most. */
        double worth0 = worth(held0, g0 + a00 * p0 + a10 * p1 + a20 * p2, a00, low0 - p0);
        double worth1 = worth(held1, g1 + a10 * p0 + a11 * p1 + a21 * p2, a11, low1 - p1);
        double worth2 = worth(held2, g2 + a20 * p0 + a21 * p1 + a22 * p2, a22, low2 - p2);
        double more = worth0 > worth1 ? worth0 : worth1, most = more > worth2 ? more : worth2;
        double some = most > WORTH ? 1.0 - met : 0.0;
        double goes0 = worth0 >= most ? some : 0.0;
        double goes1 = worth1 >= most ? some - goes0 : 0.0;
        double goes2 = worth2 >= most ? some - goes0 - goes1 : 0.0;
        held0 += stays0 - goes0;
        held1 += stays1 - goes1;
        held2 += stays2 - goes2;
        w->p[0][l] = busy > 0.0 ? p0 : w->p[0][l];
        w->p[1][l] = busy > 0.0 ? p1 : w->p[1][l];
        w->p[2][l] = busy > 0.0 ? p2 : w->p[2][l];
        w->held[0][l] = held0;
        w->held[1][l] = held1;
        w->held[2][l] = held2;
        w->busy[l] = met + some > 0.0 ? busy : 0.0;
    }
}

BOX_INLINE void gains(const struct walkers *w, struct box_lanes *restrict b)
{
    BOX_LOOP
    for (size_t l = 0; l < BOX_LANES; l++) {
        double p0 = w->p[0][l], p1 = w->p[1][l], p2 = w->p[2][l];
        double a00 = b->curvature[0][l], a10 = b->curvature[1][l], a11 = b->curvature[2][l];
        double a20 = b->curvature[3][l], a21 = b->curvature[4][l], a22 = b->curvature[5][l];
        double s0 = 2.0 * b->gradient[0][l] + a00 * p0 + a10 * p1 + a20 * p2;
        double s1 = 2.0 * b->gradient[1][l] + a10 * p0 + a11 * p1 + a21 * p2;
        double s2 = 2.0 * b->gradient[2][l] + a20 * p0 + a21 * p1 + a22 * p2;
        b->step[0][l] = p0;
        b->step[1][l] = p1;
        b->step[2][l] = p2;
        b->gain[l] = -(p0 * s0 + p1 * s1 + p2 * s2);
    }
}

BOX_INLINE void step(const double *lo, const double *hi, struct box_lanes *b)
{
    struct walkers w = { .p = { { 0.0 } } };
    double busy = 1.0;
    hold(lo, hi, b, &w);
    for (int turn = 0; turn < TURNS && busy > 0.0; turn++) {
        walk(lo, hi, b, &w);
        busy = 0.0;
        for (size_t l = 0; l < BOX_LANES; l++)
            busy += w.busy[l];
    }
    gains(&w, b);
}

/* ---- curvature from secants --------------------------------------------------------------- */

/* Which parameters have moved, 1 or 0; what was told of others is forgotten, for it counts no more
 * where they rest. */
BOX_INLINE void find_moves(const struct box_lanes *b, struct box_secant *restrict secant,
                           double moves[BOX_PARAMETERS][BOX_LANES])
{
    for (size_t i = 0; i < BOX_PARAMETERS; i++) {
        const double *restrict x = b->x[i], *restrict was = secant->x[i];
        double *restrict to = moves[i];
        BOX_LOOP
        for (size_t l = 0; l < BOX_LANES; l++)
            to[l] = x[l] == was[l] ? 0.0 : 1.0;
    }
    for (size_t i = 0, k = 0; i < BOX_PARAMETERS; i++)
        for (size_t j = 0; j <= i; j++, k++) {
            double *restrict more = secant->more[k];
            BOX_LOOP
            for (size_t l = 0; l < BOX_LANES; l++)
                more[l] *= moves[i][l] * moves[j][l];
        }
}

/* What the gradient changed by, less what was known of it, is told of what moves. */
BOX_INLINE void learn(double steady, const struct box_lanes *b,
                      double moves[BOX_PARAMETERS][BOX_LANES], struct box_secant *restrict secant)
{
    BOX_LOOP
    for (size_t l = 0; l < BOX_LANES; l++) {
        double m00 = secant->more[0][l], m10 = secant->more[1][l], m11 = secant->more[2][l];
        double m20 = secant->more[3][l], m21 = secant->more[4][l], m22 = secant->more[5][l];
        double a00 = b->curvature[0][l], a10 = b->curvature[1][l], a11 = b->curvature[2][l];
        double a20 = b->curvature[3][l], a21 = b->curvature[4][l], a22 = b->curvature[5][l];
        double o00 = secant->curvature[0][l], o10 = secant->curvature[1][l];
        double o11 = secant->curvature[2][l], o20 = secant->curvature[3][l];
        double o21 = secant->curvature[4][l], o22 = secant->curvature[5][l];
        double s0 = b->x[0][l] - secant->x[0][l], s1 = b->x[1][l] - secant->x[1][l];
        double s2 = b->x[2][l] - secant->x[2][l];
        double old0 = o00 * s0 + o10 * s1 + o20 * s2, new0 = a00 * s0 + a10 * s1 + a20 * s2;
        double old1 = o10 * s0 + o11 * s1 + o21 * s2, new1 = a10 * s0 + a11 * s1 + a21 * s2;
        double old2 = o20 * s0 + o21 * s1 + o22 * s2, new2 = a20 * s0 + a21 * s1 + a22 * s2;
        double was = old0 * s0 + old1 * s1 + old2 * s2, is = new0 * s0 + new1 * s1 + new2 * s2;
        /* Of the curvature known the mean along the way. */
        double known0 = 0.5 * (old0 + new0) + m00 * s0 + m10 * s1 + m20 * s2;
        double known1 = 0.5 * (old1 + new1) + m10 * s0 + m11 * s1 + m21 * s2;
        double known2 = 0.5 * (old2 + new2) + m20 * s0 + m21 * s1 + m22 * s2;
        double v0 = moves[0][l] * (b->gradient[0][l] - secant->gradient[0][l] - known0);
        double v1 = moves[1][l] * (b->gradient[1][l] - secant->gradient[1][l] - known1);
        double v2 = moves[2][l] * (b->gradient[2][l] - secant->gradient[2][l] - known2);
        double along = v0 * s0 + v1 * s1 + v2 * s2;
        double by = fabs(along) > 0.5 * TELLS * (was + is) ? 1.0 / along : 0.0;
        by = fabs(is - was) < steady * (is + was) ? by : 0.0;
        secant->more[0][l] = m00 + v0 * v0 * by;
        secant->more[1][l] = m10 + v1 * v0 * by;
        secant->more[2][l] = m11 + v1 * v1 * by;
        secant->more[3][l] = m20 + v2 * v0 * by;
        secant->more[4][l] = m21 + v2 * v1 * by;
        secant->more[5][l] = m22 + v2 * v2 * by;
    }
}

/* The least share that a pivot over what moves keeps when what was told is added; below 0 where
 * that is no minimum. */
BOX_INLINE void find_left(const struct box_lanes *b, const struct box_secant *secant,
                          double moves[BOX_PARAMETERS][BOX_LANES], double *restrict left)
{
    BOX_LOOP
    for (size_t l = 0; l < BOX_LANES; l++) {
        double moves0 = moves[0][l], moves1 = moves[1][l], moves2 = moves[2][l];
        double a00 = b->curvature[0][l], a10 = moves0 * moves1 * b->curvature[1][l];
        double a11 = b->curvature[2][l], a20 = moves0 * moves2 * b->curvature[3][l];
        double a21 = moves1 * moves2 * b->curvature[4][l], a22 = b->curvature[5][l];
        double h00 = a00 + secant->more[0][l], h10 = a10 + secant->more[1][l];
        double h11 = a11 + secant->more[2][l], h20 = a20 + secant->more[3][l];
        double h21 = a21 + secant->more[4][l], h22 = a22 + secant->more[5][l];
        double d1 = a11 - a10 * a10 / a00, w21 = a21 - a20 * a10 / a00;
        double d2 = a22 - a20 * a20 / a00 - (d1 > 0.0 ? w21 * w21 / d1 : 0.0);
        double e1 = h11 - h10 * h10 / h00, f21 = h21 - h20 * h10 / h00;
        double e2 = h22 - h20 * h20 / h00 - (e1 > 0.0 ? f21 * f21 / e1 : 0.0);
        double left0 = h00 / a00, left1 = d1 > 0.0 ? e1 / d1 : 1.0,
               left2 = d2 > 0.0 ? e2 / d2 : 1.0;
        left1 = left1 < 1.0 ? left1 : 1.0;
        left2 = left2 < left1 ? left2 : left1;
        double least = left0 < left2 ? left0 : left2;
        left[l] = least > KEPT ? least : -1.0; /* nor where it is no number */
    }
}

/* The sum into the lanes' curvature.  What rests grows by as much as pivots of the rest shrink, so
 * that the whole mostly remains that of a minimum; else walk() sees no such pivot. */
BOX_INLINE void add(const double *restrict left, double moves[BOX_PARAMETERS][BOX_LANES],
                    struct box_secant *restrict secant, struct box_lanes *restrict b)
{
    for (size_t i = 0, k = 0; i < BOX_PARAMETERS; i++)
        for (size_t j = 0; j <= i; j++, k++) {
            double *restrict more = secant->more[k], *restrict old = secant->curvature[k];
            double *restrict curvature = b->curvature[k], diagonal = i == j ? 1.0 : 0.0;
            BOX_LOOP
            for (size_t l = 0; l < BOX_LANES; l++) {
                double kept = left[l] > 0.0 ? more[l] : 0.0;
                double stiffer = left[l] > 0.0 ? diagonal * (1.0 / left[l] - 1.0) : 0.0;
                old[l] = curvature[l];
                more[l] = kept;
                curvature[l] += kept + (1.0 - moves[i][l]) * stiffer * curvature[l];
            }
        }
}

BOX_INLINE void bend(double steady, struct box_secant *secant, struct box_lanes *b)
{
    double moves[BOX_PARAMETERS][BOX_LANES], left[BOX_LANES];
    find_moves(b, secant, moves);
    learn(steady, b, moves, secant);
    find_left(b, secant, moves, left);
    add(left, moves, secant, b);
    memcpy(secant->x, b->x, sizeof b->x);
    memcpy(secant->gradient, b->gradient, sizeof b->gradient);
}

/* ---- for each kind of vectors ---------------------------------------------------------------- */

static void step_plain(const double *lo, const double *hi, struct box_lanes *b)
{
    step(lo, hi, b);
}

static void bend_plain(double steady, struct box_secant *secant, struct box_lanes *b)
{
    bend(steady, secant, b);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2,fma"))) static void step_avx2(const double *lo, const double *hi,
                                                          struct box_lanes *b)
{
    step(lo, hi, b);
}

__attribute__((target("avx2,fma"))) static void bend_avx2(double steady, struct box_secant *secant,
                                                          struct box_lanes *b)
{
    bend(steady, secant, b);
}

__attribute__((target(BOX_WIDE))) static void step_avx512(const double *lo, const double *hi,
                                                          struct box_lanes *b)
{
    step(lo, hi, b);
}

__attribute__((target(BOX_WIDE))) static void bend_avx512(double steady, struct box_secant *secant,
                                                          struct box_lanes *b)
{
    bend(steady, secant, b);
}
#else
#define step_avx2 step_plain
#define bend_avx2 bend_plain
#define step_avx512 step_plain
#define bend_avx512 bend_plain
#endif

void box_lanes_step(enum quick_vectors v, const double lo[BOX_PARAMETERS],
                    const double hi[BOX_PARAMETERS], struct box_lanes *lanes)
{
    if (v == QUICK_AVX512)
        step_avx512(lo, hi, lanes);
    else if (v == QUICK_AVX2)
        step_avx2(lo, hi, lanes);
    else
        step_plain(lo, hi, lanes);
}

void box_lanes_bend(enum quick_vectors v, double steady, struct box_secant *secant,
                    struct box_lanes *lanes)
{
    if (v == QUICK_AVX512)
        bend_avx512(steady, secant, lanes);
    else if (v == QUICK_AVX2)
        bend_avx2(steady, secant, lanes);
    else
        bend_plain(steady, secant, lanes);
}
