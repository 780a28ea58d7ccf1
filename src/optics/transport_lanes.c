/* transport_lanes.c - roots, modes, and matrices taken apart, eight bands at a time.
 *
 * Innermost everywhere are loops over lanes, which become single vectors; matrices are arrays of
 * such rows.  Each loop is compiled for several kinds of vectors and does the same operations in
 * the same order in all of them. */
#include "optics/transport_lanes.h"

#include <math.h>
#include <string.h>

#include "optics/dipole.h"
#include "optics/quick_exp.h"
#include "optics/transport.h"

enum { LANES = VECTORS_LANES, MOST = TRANSPORT_LANES_STREAMS_MAX, STEPS_MAX = 60 };

#define ALBEDO_LEAST 0x1p-10
#define ABSORBED_LEAST 0x1p-14
#define TAU_LEAST 0x1p-5
/* Beyond, nothing comes through that counts, and exponentials would leave their range. */
#define DECAY_MOST 300.0

/* Place of row i, column j in the lower half of a symmetric matrix. */
#define AT(i, j) ((i) * ((i) + 1) / 2 + (j))

typedef double transport_row[LANES];

/* Of one layer at eight bands. */
struct lane_modes {
    transport_row albedo, absorbed;
    transport_row x[MOST], k[MOST]; /* distance of k^2 from the pole above it; k */
    transport_row V[MOST * MOST];   /* direction i, mode m */
};

/* ---- small things, by lanes -------------------------------------------------------------- */

/* over[i] = 1/d[i] for n rows, by one division: the inverse of all, multiplied by what is before
 * and behind. */
VECTORS_INLINE void invert(ptrdiff_t n, transport_row *d, transport_row *over)
{
    transport_row all;
    for (ptrdiff_t l = 0; l < LANES; l++)
        all[l] = 1.0;
    for (ptrdiff_t i = 0; i < n; i++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            over[i][l] = all[l];
            all[l] *= d[i][l];
        }
    }
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        all[l] = 1.0 / all[l];
    for (ptrdiff_t i = n - 1; i >= 0; i--) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            over[i][l] *= all[l];
            all[l] *= d[i][l];
        }
    }
}

/* C = L D L^T of the first n of `rows` rows of n, lower half; what stands below these is solved
 * for: L D there.  over = 1/D. */
VECTORS_INLINE void factor(bool fused, ptrdiff_t n, ptrdiff_t rows, transport_row *C,
                           transport_row *over)
{
    transport_row L[MOST];
    for (ptrdiff_t j = 0; j < n; j++) {
        for (ptrdiff_t k = 0; k < j; k++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                L[k][l] = -C[j * n + k][l] * over[k][l];
        }
        for (ptrdiff_t i = j; i < rows; i++) {
            double *restrict sum = C[i * n + j];
            for (ptrdiff_t k = 0; k < j; k++) {
                VECTORS_LOOP
                for (ptrdiff_t l = 0; l < LANES; l++)
                    sum[l] = vectors_sum(fused, C[i * n + k][l], L[k][l], sum[l]);
            }
        }
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            over[j][l] = 1.0 / C[j * n + j][l];
    }
}

/* ---- modes: as modes_init() -------------------------------------------------------------- */

/* One step of every lane towards root m: optics/modes.c, where what a pole adds to the constant
 * is written without a difference.  busy: 1 where it goes on, else 0. */
VECTORS_INLINE void root_step(bool fused, const struct transport_lanes *t, ptrdiff_t m,
                              const struct lane_modes *o, transport_row x, transport_row busy)
{
    const ptrdiff_t n = t->streams.n;
    const double *p = t->pole, *w = t->streams.w;
    const double gap = p[m] - p[m + 1], own = w[m] * p[m];
    const double next_own = m + 1 < n ? w[m + 1] * p[m + 1] : 0.0;
    transport_row d[MOST], over[MOST], constant, above, below;
    ptrdiff_t others = 0;
    for (ptrdiff_t i = 0; i < n; i++) {
        if (i == m || i == m + 1)
            continue;
        const double apart = fabs(p[i] - p[m]), sign = i < m ? 1.0 : -1.0;
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            d[others][l] = apart + sign * x[l];
        others++;
    }
    invert(others, d, over);
    memset(constant, 0, sizeof constant);
    memset(above, 0, sizeof above);
    memset(below, 0, sizeof below);
    for (ptrdiff_t i = 0; i < m; i++) {
        const double weight = w[i] * p[i], left = -weight * (p[i] - p[m]);
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            double square = over[i][l] * over[i][l];
            constant[l] = vectors_sum(fused, left, square, constant[l]);
            above[l] = vectors_sum(fused, weight, square, above[l]);
        }
    }
    for (ptrdiff_t i = m + 2; i < n; i++) {
        const double weight = w[i] * p[i], left = weight * (p[m + 1] - p[i]);
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            double square = over[i - 2][l] * over[i - 2][l];
            constant[l] = vectors_sum(fused, left, square, constant[l]);
            below[l] = vectors_sum(fused, weight, square, below[l]);
        }
    }
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++) {
        double a = o->albedo[l], y = gap - x[l];
        double c = vectors_sum(fused, a, constant[l], 1.0);
        double S = a * vectors_sum(fused, x[l] * x[l], above[l], own);
        double s = a * vectors_sum(fused, y * y, below[l], next_own);
        double B = vectors_sum(fused, c, gap, s + S), less = vectors_sum(fused, c, gap, s - S);
        double root = sqrt(vectors_sum(fused, less, less, 4.0 * s * S));
        double above_0 = B > 0.0 ? 2.0 * S * gap : B - root;
        double next = above_0 / (B > 0.0 ? B + root : 2.0 * c);
        double room = gap - next < next ? gap - next : next;
        double moved = fabs(next - x[l]);
        x[l] = busy[l] > 0.0 ? next : x[l];
        busy[l] = busy[l] > 0.0 && moved > 1e-8 * room ? 1.0 : 0.0;
    }
}

VECTORS_INLINE void find_roots(bool fused, const struct transport_lanes *t, struct lane_modes *o)
{
    const ptrdiff_t n = t->streams.n;
    transport_row busy[MOST];
    for (ptrdiff_t m = 0; m < n; m++)
        for (ptrdiff_t l = 0; l < LANES; l++) {
            o->x[m][l] = 0.5 * (t->pole[m] - t->pole[m + 1]);
            busy[m][l] = 1.0;
        }
    for (ptrdiff_t step = 0; step < STEPS_MAX; step++) {
        double left = 0.0;
        for (ptrdiff_t m = 0; m < n; m++)
            root_step(fused, t, m, o, o->x[m], busy[m]);
        for (ptrdiff_t m = 0; m < n; m++)
            for (ptrdiff_t l = 0; l < LANES; l++)
                left += busy[m][l];
        if (left == 0.0)
            break;
    }
}

/* k; of the slowest one more step of l sum w/(p - l) = (1-a)/a, from which l, where it is small,
 * has the digits of what is absorbed. */
VECTORS_INLINE void find_k(bool fused, const struct transport_lanes *t, struct lane_modes *o)
{
    const ptrdiff_t n = t->streams.n;
    double *restrict x = o->x[n - 1];
    transport_row d[MOST], over[MOST], h = { 0 }, slope = { 0 };
    for (ptrdiff_t m = 0; m + 1 < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            o->k[m][l] = sqrt(t->pole[m] - o->x[m][l]);
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        const double apart = t->pole[i] - t->pole[n - 1];
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            d[i][l] = apart + x[l];
    }
    invert(n, d, over);
    for (ptrdiff_t i = 0; i < n; i++) {
        const double w = t->streams.w[i], weight = w * t->pole[i];
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            h[l] = vectors_sum(fused, w, over[i][l], h[l]);
            slope[l] = vectors_sum(fused, weight, over[i][l] * over[i][l], slope[l]);
        }
    }
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++) {
        double far = 1.0 - x[l], e = o->absorbed[l] / o->albedo[l];
        double near = far - (far * h[l] - e) / slope[l];
        bool is_near = x[l] > 0.5;
        o->k[n - 1][l] = sqrt(is_near ? near : far);
        x[l] = is_near ? 1.0 - near : x[l];
    }
}

/* v_i = u_i x/(p_i - k^2), then of length 1. */
VECTORS_INLINE void find_vectors(bool fused, const struct transport_lanes *t, struct lane_modes *o)
{
    const ptrdiff_t n = t->streams.n;
    for (ptrdiff_t m = 0; m < n; m++) {
        const double *restrict x = o->x[m];
        transport_row d[MOST], over[MOST], norm = { 0 };
        for (ptrdiff_t i = 0; i < n; i++) {
            const double apart = t->pole[i] - t->pole[m];
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                d[i][l] = apart + x[l];
        }
        invert(n, d, over);
        for (ptrdiff_t i = 0; i < n; i++) {
            const double u = t->u[i];
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++) {
                over[i][l] *= u * x[l];
                norm[l] = vectors_sum(fused, over[i][l], over[i][l], norm[l]);
            }
        }
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            norm[l] = 1.0 / sqrt(norm[l]);
        for (ptrdiff_t i = 0; i < n; i++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                o->V[i * n + m][l] = over[i][l] * norm[l];
        }
    }
}

VECTORS_INLINE void find_modes(bool fused, const struct transport_lanes *t, struct lane_modes *o)
{
    find_roots(fused, t, o);
    find_k(fused, t, o);
    find_vectors(fused, t, o);
}

/* ---- layers ------------------------------------------------------------------------------ */

/* B^-1 = V k^-1 V^T */
VECTORS_INLINE void dermis(bool fused, const struct transport_lanes *t, struct lane_modes *o,
                           transport_row *ret)
{
    const ptrdiff_t n = t->streams.n;
    transport_row over[MOST], row[MOST];
    find_modes(fused, t, o);
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            over[m][l] = 1.0 / o->k[m][l];
    }
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t m = 0; m < n; m++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                row[m][l] = o->V[i * n + m][l] * over[m][l];
        }
        for (ptrdiff_t j = 0; j <= i; j++) {
            transport_row sum = { 0 };
            for (ptrdiff_t m = 0; m < n; m++) {
                VECTORS_LOOP
                for (ptrdiff_t l = 0; l < LANES; l++)
                    sum[l] = vectors_sum(fused, row[m][l], o->V[j * n + m][l], sum[l]);
            }
            memcpy(ret[AT(i, j)], sum, sizeof sum);
        }
    }
}

/* While an epidermis is worked on: G' (n rows), V E (n), h and v, rows of n. */
struct lane_epidermis {
    transport_row E[MOST], theta[MOST];
    transport_row C[(2 * MOST + 2) * MOST], over[MOST];
};

/* E, theta, and k tanh(k tau) into the diagonal of C. */
VECTORS_INLINE void decay(bool fused, ptrdiff_t n, const struct lane_modes *o,
                          const transport_row tau, struct lane_epidermis *e)
{
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            double k = o->k[m][l], x = k * tau[l];
            struct quick_parts p = quick_parts_of(fused, x < DECAY_MOST ? -x : -DECAY_MOST);
            double grown = quick_grown(fused, p),
                   once = vectors_sum(fused, p.scale, grown, p.scale);
            double lost = -vectors_sum(fused, p.scale, grown, p.scale - 1.0); /* 1 - e^-x */
            double over = 1.0 / vectors_sum(fused, once, once, 1.0);
            double tanh_x = lost * (1.0 + once) * over;
            e->E[m][l] = 2.0 * once * over;
            e->theta[m][l] = tanh_x / k;
            e->C[m * n + m][l] = k * tanh_x;
        }
    }
}

/* C as its structure says; open directions alone let light out. */
VECTORS_INLINE void compose(bool fused, const struct transport_lanes *t, const struct lane_modes *o,
                            struct lane_epidermis *e)
{
    const ptrdiff_t n = t->streams.n;
    transport_row *C = e->C, *below = e->C + n * n, *h = below + n * n, *v = h + n;
    for (ptrdiff_t m = 0; m < n; m++)
        for (ptrdiff_t j = 0; j < m; j++)
            memset(C[m * n + j], 0, sizeof *C);
    memset(h, 0, (size_t)n * sizeof *h);
    for (ptrdiff_t i = 0; i < n; i++) {
        const transport_row *V = o->V + i * n;
        const double open = t->open[i], escape = t->escape[i];
        for (ptrdiff_t m = 0; m < n; m++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                below[i * n + m][l] = V[m][l] * e->E[m][l];
        }
        if (open == 0.0)
            continue;
        for (ptrdiff_t m = 0; m < n; m++) {
            transport_row f;
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++) {
                f[l] = open * V[m][l];
                h[m][l] = vectors_sum(fused, escape, V[m][l], h[m][l]);
            }
            for (ptrdiff_t j = 0; j <= m; j++) {
                VECTORS_LOOP
                for (ptrdiff_t l = 0; l < LANES; l++)
                    C[m * n + j][l] = vectors_sum(fused, f[l], V[j][l], C[m * n + j][l]);
            }
        }
    }
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            v[m][l] = t->entering * o->V[(n - 1) * n + m][l];
    }
}

/* M, its lower half, from U = V E L^-T D of C. */
VECTORS_INLINE void seen_from_below(bool fused, ptrdiff_t n, const struct lane_modes *o,
                                    const struct lane_epidermis *e, transport_row *M)
{
    const transport_row *U = e->C + n * n;
    transport_row f[MOST], g[MOST];
    for (ptrdiff_t i = 0; i < n; i++) {
        for (ptrdiff_t m = 0; m < n; m++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++) {
                f[m][l] = o->V[i * n + m][l] * e->theta[m][l];
                g[m][l] = U[i * n + m][l] * e->over[m][l];
            }
        }
        for (ptrdiff_t j = 0; j <= i; j++) {
            transport_row straight = { 0 }, back = { 0 };
            for (ptrdiff_t m = 0; m < n; m++) {
                VECTORS_LOOP
                for (ptrdiff_t l = 0; l < LANES; l++) {
                    straight[l] = vectors_sum(fused, f[m][l], o->V[j * n + m][l], straight[l]);
                    back[l] = vectors_sum(fused, g[m][l], U[j * n + m][l], back[l]);
                }
            }
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                M[AT(i, j)][l] = straight[l] + back[l];
        }
    }
}

/* ret: M, then h_1, v_1, and R_0. */
VECTORS_INLINE void epidermis(bool fused, const struct transport_lanes *t, struct lane_modes *o,
                              const transport_row tau, transport_row *ret)
{
    const ptrdiff_t n = t->streams.n;
    struct lane_epidermis e;
    transport_row *U = e.C + n * n, *h = U + n * n, *v = h + n;
    transport_row *h_1 = ret + AT(n, 0), *v_1 = h_1 + n, *R_0 = v_1 + n, f[MOST], g[MOST];
    transport_row all;
    find_modes(fused, t, o);
    decay(fused, n, o, tau, &e);
    compose(fused, t, o, &e);
    factor(fused, n, 2 * n + 2, e.C, e.over);
    seen_from_below(fused, n, o, &e, ret);
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        all[l] = -t->mirrored;
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            f[m][l] = h[m][l] * e.over[m][l];
            g[m][l] = v[m][l] * e.over[m][l];
            all[l] = vectors_sum(fused, f[m][l], v[m][l], all[l]);
        }
    }
    memcpy(*R_0, all, sizeof all);
    for (ptrdiff_t i = 0; i < n; i++) {
        transport_row by_h = { 0 }, by_v = { 0 };
        for (ptrdiff_t m = 0; m < n; m++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++) {
                by_h[l] = vectors_sum(fused, U[i * n + m][l], f[m][l], by_h[l]);
                by_v[l] = vectors_sum(fused, U[i * n + m][l], g[m][l], by_v[l]);
            }
        }
        memcpy(h_1[i], by_h, sizeof by_h);
        memcpy(v_1[i], by_v, sizeof by_v);
    }
}

VECTORS_INLINE void join(bool fused, const struct transport_lanes *t,
                         const transport_row *restrict top, const transport_row *restrict dermis,
                         double *restrict R)
{
    const ptrdiff_t n = t->streams.n;
    const double most = t->streams.entering;
    transport_row C[(MOST + 2) * MOST], over[MOST];
    for (ptrdiff_t i = 0; i < n; i++)
        for (ptrdiff_t j = 0; j <= i; j++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                C[i * n + j][l] = top[AT(i, j)][l] + dermis[AT(i, j)][l];
        }
    memcpy(C[n * n], top[AT(n, 0)], (size_t)(2 * n) * sizeof *C);
    factor(fused, n, n + 2, C, over);
    transport_row *h = C + n * n, *v = h + n;
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        R[l] = top[AT(n, 0) + 2 * n][l];
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            R[l] = vectors_sum(fused, -h[m][l] * over[m][l], v[m][l], R[l]);
    }
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        R[l] = R[l] < most ? R[l] : most;
}

/* ---- for each kind of vectors ------------------------------------------------------------ */

/* What is to be made: of modes an epidermis, or where tau is NULL a dermis; or of both R. */
struct lane_job {
    const struct transport_lanes *t;
    struct lane_modes *modes;
    const double *tau;
    const double *epidermis, *dermis;
    double *ret;
};

VECTORS_INLINE void work(bool fused, const struct lane_job *job)
{
    if (job->modes == NULL)
        join(fused, job->t, (const transport_row *)job->epidermis,
             (const transport_row *)job->dermis, job->ret);
    else if (job->tau == NULL)
        dermis(fused, job->t, job->modes, (transport_row *)job->ret);
    else
        epidermis(fused, job->t, job->modes, job->tau, (transport_row *)job->ret);
}

static void work_plain(const struct lane_job *job)
{
    work(false, job);
}

VECTORS_AVX2 static void work_avx2(const struct lane_job *job)
{
    work(true, job);
}

VECTORS_AVX512 static void work_avx512(const struct lane_job *job)
{
    work(true, job);
}

static void run(const struct lane_job *job)
{
    if (job->t->vectors == VECTORS_WITH_AVX512)
        work_avx512(job);
    else if (job->t->vectors == VECTORS_WITH_AVX2)
        work_avx2(job);
    else
        work_plain(job);
}

/* ---- the contract ------------------------------------------------------------------------ */

enum status transport_lanes_init(int streams, double eta, struct transport_lanes *ret)
{
    struct transport_lanes t = { .vectors = vectors_best() };
    struct streams *s = &t.streams;
    if (streams_init(streams, eta, s) != STATUS_OK)
        return STATUS_RANGE;
    if (streams > TRANSPORT_LANES_STREAMS_MAX || (eta > 1.0 && eta < 1.01) || eta > 3.0)
        return STATUS_UNSUPPORTED;
    for (int i = 0; i < s->n; i++) {
        double g = (1.0 - s->inside[i]) / (1.0 + s->inside[i]);
        t.pole[i] = 1.0 / (s->mu[i] * s->mu[i]);
        t.u[i] = sqrt(s->w[i]) / s->mu[i];
        t.open[i] = g / s->mu[i];
        t.escape[i] = g * sqrt(s->w[i]);
        t.mirrored = g * s->entering;
        t.entering = 2.0 * s->entering / ((1.0 + s->inside[i]) * sqrt(s->w[i]));
    }
    *ret = t;
    return STATUS_OK;
}

/* The bands that are not within, for which something stands that is. */
static unsigned take_layer(const double *sigma_a, const double *sigma_s_prime, double mm,
                           struct lane_modes *o, double *tau)
{
    unsigned beyond = 0;
    for (unsigned l = 0; l < LANES; l++) {
        double sigma_t = sigma_a[l] + sigma_s_prime[l];
        o->albedo[l] = sigma_s_prime[l] / sigma_t;
        o->absorbed[l] = sigma_a[l] / sigma_t;
        tau[l] = sigma_t * mm;
        if (o->albedo[l] >= ALBEDO_LEAST && o->absorbed[l] >= ABSORBED_LEAST && tau[l] >= TAU_LEAST)
            continue;
        beyond |= 1u << l;
        o->albedo[l] = o->absorbed[l] = 0.5;
        tau[l] = 1.0;
    }
    return beyond;
}

unsigned transport_lanes_epidermis(const struct transport_lanes *t, const double *sigma_a,
                                   const double *sigma_s_prime, double mm, double *ret)
{
    struct lane_modes modes;
    transport_row tau;
    unsigned beyond = take_layer(sigma_a, sigma_s_prime, mm, &modes, tau);
    run(&(struct lane_job){ .t = t, .modes = &modes, .tau = tau, .ret = ret });
    return beyond;
}

unsigned transport_lanes_dermis(const struct transport_lanes *t, const double *sigma_a,
                                const double *sigma_s_prime, double *ret)
{
    struct lane_modes modes;
    transport_row tau;
    unsigned beyond = take_layer(sigma_a, sigma_s_prime, INFINITY, &modes, tau);
    run(&(struct lane_job){ .t = t, .modes = &modes, .ret = ret });
    return beyond;
}

void transport_lanes_join(const struct transport_lanes *t, const double *epidermis,
                          const double *dermis, double *R)
{
    run(&(struct lane_job){ .t = t, .epidermis = epidermis, .dermis = dermis, .ret = R });
}

/* Eight values from band `at` on; what is past the last band repeats it. */
static void take_bands(const double *from, size_t at, size_t n, transport_row to)
{
    for (size_t l = 0; l < LANES; l++)
        to[l] = from[at + l < n ? at + l : n - 1];
}

/* One band by the plain model. */
static enum status plain_band(const struct transport_lanes *t, const struct medium *m, size_t at,
                              double *R)
{
    struct medium one = *m;
    one.n = 1;
    one.sigma_a_epidermis += at;
    one.sigma_s_prime_epidermis += at;
    one.sigma_a_dermis += at;
    one.sigma_s_prime_dermis += at;
    return transport_reflectance(t->streams.n, &one, R + at);
}

enum status transport_lanes_reflectance(const struct transport_lanes *t, const struct medium *m,
                                        double *R)
{
    double top[TRANSPORT_LANES_EPIDERMIS(MOST)], under[TRANSPORT_LANES_DERMIS(MOST)];
    transport_row sigma_a, sigma_s_prime, here;
    enum status s = medium_check(m);
    for (size_t at = 0; at < m->n && s == STATUS_OK; at += LANES) {
        take_bands(m->sigma_a_epidermis, at, m->n, sigma_a);
        take_bands(m->sigma_s_prime_epidermis, at, m->n, sigma_s_prime);
        unsigned beyond =
            transport_lanes_epidermis(t, sigma_a, sigma_s_prime, m->epidermis_mm, top);
        take_bands(m->sigma_a_dermis, at, m->n, sigma_a);
        take_bands(m->sigma_s_prime_dermis, at, m->n, sigma_s_prime);
        beyond |= transport_lanes_dermis(t, sigma_a, sigma_s_prime, under);
        transport_lanes_join(t, top, under, here);
        for (size_t l = 0; l < LANES && at + l < m->n && s == STATUS_OK; l++) {
            if (beyond & 1u << l)
                s = plain_band(t, m, at + l, R);
            else
                R[at + l] = here[l];
        }
    }
    return s;
}
