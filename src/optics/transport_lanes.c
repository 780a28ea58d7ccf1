/* transport_lanes.c - roots, modes, and matrices taken apart, eight bands at a time.
 *
 * Innermost everywhere are loops over lanes, which become single vectors; matrices are arrays of
 * such rows.  Each loop is compiled for several kinds of vectors and does the same operations in
 * the same order in all of them. */
#include "optics/transport_lanes.h"

#include <math.h>
#include <string.h>

#include "optics/albedo_chain.h"
#include "optics/dipole.h"
#include "optics/quick_exp.h"
#include "optics/transport.h"

/* Before STEPS_LEAST hardly a root has come to rest: not worth asking. */
enum { LANES = VECTORS_LANES, MOST = TRANSPORT_LANES_STREAMS_MAX, STEPS_LEAST = 3, STEPS_MAX = 60 };

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
    transport_row hat[MOST];        /* u^T of mode m */
    transport_row V[MOST * MOST];   /* direction i, mode m */
};

/* ---- small things, by lanes --------------------------------------------------------- */

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

/* ---- modes: as modes_init() --------------------------------------------------------- */

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

/* Whether a lane goes on. */
VECTORS_INLINE bool any(const transport_row busy)
{
    double sum = 0.0;
    for (ptrdiff_t l = 0; l < LANES; l++)
        sum += busy[l];
    return sum > 0.0;
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
        ptrdiff_t at_work = 0;
        for (ptrdiff_t m = 0; m < n; m++) {
            if (step >= STEPS_LEAST && !any(busy[m]))
                continue;
            root_step(fused, t, m, o, o->x[m], busy[m]);
            at_work++;
        }
        if (at_work == 0)
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
        for (ptrdiff_t l = 0; l < LANES; l++) {
            norm[l] = 1.0 / sqrt(norm[l]);
            o->hat[m][l] = x[l] / o->albedo[l] * norm[l];
        }
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

/* ---- layers ------------------------------------------------------------------------- */

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
                              const transport_row tau, struct lane_epidermis *e, transport_row *ret)
{
    const ptrdiff_t n = t->streams.n;
    transport_row *U = e->C + n * n, *h = U + n * n, *v = h + n;
    transport_row *h_1 = ret + AT(n, 0), *v_1 = h_1 + n, *R_0 = v_1 + n, f[MOST], g[MOST];
    transport_row all;
    find_modes(fused, t, o);
    decay(fused, n, o, tau, e);
    compose(fused, t, o, e);
    factor(fused, n, 2 * n + 2, e->C, e->over);
    seen_from_below(fused, n, o, e, ret);
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        all[l] = -t->mirrored;
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            f[m][l] = h[m][l] * e->over[m][l];
            g[m][l] = v[m][l] * e->over[m][l];
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

/* B_2^-1 + M, h_1 and v_1, taken apart. */
struct lane_border {
    transport_row C[(MOST + 2) * MOST], over[MOST];
};

VECTORS_INLINE void join(bool fused, const struct transport_lanes *t,
                         const transport_row *restrict top, const transport_row *restrict dermis,
                         struct lane_border *b, double *restrict R)
{
    const ptrdiff_t n = t->streams.n;
    const double most = t->streams.entering;
    transport_row *C = b->C, *over = b->over;
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

/* ---- slopes: as layers.c ------------------------------------------------------------ */

/* Light and adjoint light by modes: of the epidermis at its top and bottom, with derivatives by
 * depth; of the dermis. */
struct lane_light {
    transport_row top[MOST], bottom[MOST], top_slope[MOST], bottom_slope[MOST], dermis[MOST];
    transport_row border; /* summed over all directions */
};

/* x = (L D L^T)^-1 of what L^-1 has been applied to, c. */
VECTORS_INLINE void substitute(bool fused, ptrdiff_t n, transport_row *C, transport_row *over,
                               transport_row *c, transport_row *x)
{
    for (ptrdiff_t j = n - 1; j >= 0; j--) {
        transport_row sum;
        memcpy(sum, c[j], sizeof sum);
        for (ptrdiff_t i = j + 1; i < n; i++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                sum[l] = vectors_sum(fused, -C[i * n + j][l], x[i][l], sum[l]);
        }
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            x[j][l] = sum[l] * over[j][l];
    }
}

/* ret_m = from_m + the sum over i of sign A_im x_i. */
VECTORS_INLINE void add_applied(bool fused, ptrdiff_t n, double sign, transport_row *A,
                                transport_row *x, transport_row *ret)
{
    for (ptrdiff_t i = 0; i < n; i++) {
        transport_row f;
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            f[l] = sign * x[i][l];
        for (ptrdiff_t m = 0; m < n; m++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                ret[m][l] = vectors_sum(fused, A[i * n + m][l], f[l], ret[m][l]);
        }
    }
}

/* The light whose right-hand side is row n + `which` of the border's matrix and 2n + `which` of the
 * epidermis': q = (B_2^-1 + M)^-1 v_1 goes into the dermis, and above it
 * y = G'^-1 (v - E V^T q),  z = E y - theta V^T q. */
VECTORS_INLINE void find_light(bool fused, ptrdiff_t n, ptrdiff_t which, struct lane_modes o[2],
                               struct lane_epidermis *e, struct lane_border *b,
                               struct lane_light *light)
{
    transport_row q[MOST], c[MOST], into[MOST];
    substitute(fused, n, b->C, b->over, b->C + (n + which) * n, q);
    memcpy(c, e->C[(2 * n + which) * n], (size_t)n * sizeof *c);
    add_applied(fused, n, -1.0, e->C + n * n, q, c);
    substitute(fused, n, e->C, e->over, c, light->top);
    memset(into, 0, sizeof into);
    add_applied(fused, n, 1.0, o[0].V, q, into);
    memset(light->dermis, 0, sizeof light->dermis);
    add_applied(fused, n, 1.0, o[1].V, q, light->dermis);
    memset(light->border, 0, sizeof light->border);
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            double E = e->E[m][l], theta = e->theta[m][l], over = 1.0 / theta;
            double top = light->top[m][l];
            double bottom = vectors_sum(fused, -theta, into[m][l], E * top);
            light->bottom[m][l] = bottom;
            light->top_slope[m][l] = vectors_sum(fused, E, bottom, -top) * over;
            light->bottom_slope[m][l] = vectors_sum(fused, -E, top, bottom) * over;
            light->border[l] = vectors_sum(fused, o[0].hat[m][l], bottom, light->border[l]);
            light->dermis[m][l] /= o[1].k[m][l];
        }
    }
}

/* The integral of light times adjoint light over the endless dermis. */
VECTORS_INLINE void slope_dermis(bool fused, ptrdiff_t n, const struct lane_modes *o,
                                 const struct lane_light *s, const struct lane_light *t,
                                 double *ret)
{
    transport_row all = { 0 };
    for (ptrdiff_t i = 0; i < n; i++) {
        transport_row d[MOST], over[MOST], sum = { 0 };
        for (ptrdiff_t j = 0; j < n; j++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                d[j][l] = o->k[i][l] + o->k[j][l];
        }
        invert(n, d, over);
        for (ptrdiff_t j = 0; j < n; j++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                sum[l] = vectors_sum(fused, o->hat[j][l] * t->dermis[j][l], over[j][l], sum[l]);
        }
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            all[l] = vectors_sum(fused, o->hat[i][l] * s->dermis[i][l], sum[l], all[l]);
    }
    memcpy(ret, all, sizeof all);
}

/* Of sinh(x y)/sinh(x) over 0 <= y <= 1, the mean of its square, and of it times its mirror image,
 * by powers of x^2: from those of x coth x and x/sinh x (Abramowitz and Stegun 4.5.65, 4.5.67); at
 * x = 1/2 what is left out is below 1e-15. */
enum { MEAN_TERMS = 11 };
static const double mean_square[MEAN_TERMS] = { 0.3333333333333333,     -0.044444444444444446,
                                                0.006349206349206349,   -0.0008465608465608466,
                                                0.00010688899577788467, -1.2986425684838382e-05,
                                                1.5348163496311645e-06, -1.7771687031983742e-07,
                                                2.0257061865128093e-08, -2.280515120459218e-09,
                                                2.5417075858902885e-10 };
static const double mean_mirror[MEAN_TERMS] = {
    0.16666666666666666,    -0.03888888888888889,    0.006150793650793651,  -0.00083994708994709,
    0.00010668022820800599, -1.2980084656671958e-05, 1.534628994119735e-06, -1.777114468313633e-07,
    2.025690731601108e-08,  -2.2805107707218213e-09, 2.5417063739096664e-10
};

VECTORS_INLINE double mean_of(bool fused, const double *term, double square)
{
    double sum = term[MEAN_TERMS - 1];
    for (ptrdiff_t i = MEAN_TERMS - 2; i >= 0; i--)
        sum = vectors_sum(fused, sum, square, term[i]);
    return sum;
}

/* Of the epidermis, where both are of one mode: its square and it times its mirror image. */
VECTORS_INLINE void slope_alike(bool fused, ptrdiff_t n, const struct lane_modes *o,
                                const transport_row tau, const struct lane_epidermis *e,
                                const struct lane_light *s, const struct lane_light *t, double *ret)
{
    for (ptrdiff_t m = 0; m < n; m++) {
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++) {
            double k = o->k[m][l], x = k * tau[l], over_tanh = 1.0 / (k * e->theta[m][l]);
            double over_sinh = e->E[m][l] * over_tanh, half = 0.5 / k, z = x < 0.5 ? x * x : 0.25;
            double far_square = vectors_sum(fused, -x * over_sinh, over_sinh, over_tanh) * half;
            double far_mirror = vectors_sum(fused, x, over_tanh, -1.0) * over_sinh * half;
            double near_square = tau[l] * mean_of(fused, mean_square, z);
            double near_mirror = tau[l] * mean_of(fused, mean_mirror, z);
            double square = x < 0.5 ? near_square : far_square;
            double mirror = x < 0.5 ? near_mirror : far_mirror;
            double s0 = s->top[m][l], s1 = s->bottom[m][l];
            double t0 = t->top[m][l], t1 = t->bottom[m][l];
            double same = vectors_sum(fused, s0, t0, s1 * t1);
            double crossed = vectors_sum(fused, s0, t1, s1 * t0);
            double both = vectors_sum(fused, square, same, mirror * crossed);
            ret[l] = vectors_sum(fused, o->hat[m][l] * o->hat[m][l], both, ret[l]);
        }
    }
}

/* a b - c d at the bottom less the same at the top: a', b of one mode and a, b' of the other. */
VECTORS_INLINE double ends(bool fused, const struct lane_light *s, ptrdiff_t i,
                           const struct lane_light *t, ptrdiff_t j, ptrdiff_t l)
{
    double bottom = vectors_sum(fused, s->bottom_slope[i][l], t->bottom[j][l],
                                -s->bottom[i][l] * t->bottom_slope[j][l]);
    double top =
        vectors_sum(fused, s->top_slope[i][l], t->top[j][l], -s->top[i][l] * t->top_slope[j][l]);
    return bottom - top;
}

VECTORS_INLINE void slope_epidermis(bool fused, ptrdiff_t n, const struct lane_modes *o,
                                    const transport_row tau, const struct lane_epidermis *e,
                                    const struct lane_light *s, const struct lane_light *t,
                                    double *ret)
{
    transport_row all = { 0 };
    slope_alike(fused, n, o, tau, e, s, t, all);
    for (ptrdiff_t i = 1; i < n; i++) {
        transport_row d[MOST], over[MOST], sum = { 0 };
        for (ptrdiff_t j = 0; j < i; j++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++)
                d[j][l] = (o->k[i][l] - o->k[j][l]) * (o->k[i][l] + o->k[j][l]);
        }
        invert(i, d, over);
        for (ptrdiff_t j = 0; j < i; j++) {
            VECTORS_LOOP
            for (ptrdiff_t l = 0; l < LANES; l++) {
                double both = ends(fused, s, i, t, j, l) + ends(fused, t, i, s, j, l);
                sum[l] = vectors_sum(fused, o->hat[j][l] * both, over[j][l], sum[l]);
            }
        }
        VECTORS_LOOP
        for (ptrdiff_t l = 0; l < LANES; l++)
            all[l] = vectors_sum(fused, o->hat[i][l], sum[l], all[l]);
    }
    memcpy(ret, all, sizeof all);
}

/* R and what its slopes are made of: by the albedos, and light times adjoint light between the
 * layers. */
struct lane_slopes {
    transport_row R, by_a1, by_a2, border;
};

/* What all of it is worked out in. */
struct lane_room {
    struct lane_modes modes[2]; /* epidermis, dermis */
    transport_row tau;
    struct lane_epidermis epidermis;
    struct lane_border border;
    struct lane_light light, adjoint;
    transport_row top[TRANSPORT_LANES_EPIDERMIS(MOST) / LANES];
    transport_row under[TRANSPORT_LANES_DERMIS(MOST) / LANES];
};

VECTORS_INLINE void slopes(bool fused, const struct transport_lanes *t, struct lane_room *r,
                           struct lane_slopes *ret)
{
    const ptrdiff_t n = t->streams.n;
    struct lane_epidermis *e = &r->epidermis;
    epidermis(fused, t, &r->modes[0], r->tau, e, r->top);
    dermis(fused, t, &r->modes[1], r->under);
    join(fused, t, (const transport_row *)r->top, (const transport_row *)r->under, &r->border,
         ret->R);
    find_light(fused, n, 0, r->modes, e, &r->border, &r->adjoint);
    find_light(fused, n, 1, r->modes, e, &r->border, &r->light);
    slope_epidermis(fused, n, &r->modes[0], r->tau, e, &r->light, &r->adjoint, ret->by_a1);
    slope_dermis(fused, n, &r->modes[1], &r->light, &r->adjoint, ret->by_a2);
    VECTORS_LOOP
    for (ptrdiff_t l = 0; l < LANES; l++)
        ret->border[l] = r->light.border[l] * r->adjoint.border[l];
}

/* ---- for each kind of vectors ------------------------------------------------------- */

/* What is to be made: one layer, R of two that are there, or R and slopes. */
enum lane_task { EPIDERMIS, DERMIS, JOIN, SLOPES };

struct lane_job {
    enum lane_task task;
    const struct transport_lanes *t;
    struct lane_room *room;
    const double *epidermis, *dermis; /* to be joined */
    double *ret;                      /* the layer, or R */
    struct lane_slopes *slopes;
};

VECTORS_INLINE void work(bool fused, const struct lane_job *job)
{
    struct lane_room *r = job->room;
    transport_row *layer = (transport_row *)job->ret;
    switch (job->task) {
    case EPIDERMIS:
        epidermis(fused, job->t, &r->modes[0], r->tau, &r->epidermis, layer);
        break;
    case DERMIS:
        dermis(fused, job->t, &r->modes[1], layer);
        break;
    case JOIN:
        join(fused, job->t, (const transport_row *)job->epidermis,
             (const transport_row *)job->dermis, &r->border, job->ret);
        break;
    case SLOPES:
        slopes(fused, job->t, r, job->slopes);
        break;
    }
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

/* ---- the contract ------------------------------------------------------------------- */

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

/* The bands that are not within, for which something stands that is; whatever the thickness. */
static unsigned take_layer(const double *sigma_a, const double *sigma_s_prime, struct lane_modes *o)
{
    unsigned beyond = 0;
    for (unsigned l = 0; l < LANES; l++) {
        double sigma_t = sigma_a[l] + sigma_s_prime[l];
        o->albedo[l] = sigma_s_prime[l] / sigma_t;
        o->absorbed[l] = sigma_a[l] / sigma_t;
        if (o->albedo[l] >= ALBEDO_LEAST && o->absorbed[l] >= ABSORBED_LEAST)
            continue;
        beyond |= 1u << l;
        o->albedo[l] = o->absorbed[l] = 0.5;
    }
    return beyond;
}

/* The same with a thickness. */
static unsigned take_epidermis(const double *sigma_a, const double *sigma_s_prime, double mm,
                               struct lane_room *r)
{
    unsigned beyond = take_layer(sigma_a, sigma_s_prime, &r->modes[0]);
    for (unsigned l = 0; l < LANES; l++) {
        r->tau[l] = (sigma_a[l] + sigma_s_prime[l]) * mm;
        if (r->tau[l] >= TAU_LEAST)
            continue;
        beyond |= 1u << l;
        r->tau[l] = 1.0;
    }
    return beyond;
}

unsigned transport_lanes_epidermis(const struct transport_lanes *t, const double *sigma_a,
                                   const double *sigma_s_prime, double mm, double *ret)
{
    struct lane_room room;
    unsigned beyond = take_epidermis(sigma_a, sigma_s_prime, mm, &room);
    run(&(struct lane_job){ .task = EPIDERMIS, .t = t, .room = &room, .ret = ret });
    return beyond;
}

unsigned transport_lanes_dermis(const struct transport_lanes *t, const double *sigma_a,
                                const double *sigma_s_prime, double *ret)
{
    struct lane_room room;
    unsigned beyond = take_layer(sigma_a, sigma_s_prime, &room.modes[1]);
    run(&(struct lane_job){ .task = DERMIS, .t = t, .room = &room, .ret = ret });
    return beyond;
}

static void join_in(struct lane_room *room, const struct transport_lanes *t,
                    const double *epidermis, const double *dermis, double *R)
{
    run(&(struct lane_job){
        .task = JOIN, .t = t, .room = room, .epidermis = epidermis, .dermis = dermis, .ret = R });
}

void transport_lanes_join(const struct transport_lanes *t, const double *epidermis,
                          const double *dermis, double *R)
{
    struct lane_room room;
    join_in(&room, t, epidermis, dermis, R);
}

/* Eight values from band `at` on; what is past the last band repeats it. */
static void take_bands(const double *from, size_t at, size_t n, transport_row to)
{
    for (size_t l = 0; l < LANES; l++)
        to[l] = from[at + l < n ? at + l : n - 1];
}

/* Both layers of a medium from band `at` on; the bands that are not within. */
static unsigned take_medium(const struct medium *m, size_t at, struct lane_room *r)
{
    transport_row a, s;
    take_bands(m->sigma_a_epidermis, at, m->n, a);
    take_bands(m->sigma_s_prime_epidermis, at, m->n, s);
    unsigned beyond = take_epidermis(a, s, m->epidermis_mm, r);
    take_bands(m->sigma_a_dermis, at, m->n, a);
    take_bands(m->sigma_s_prime_dermis, at, m->n, s);
    return beyond | take_layer(a, s, &r->modes[1]);
}

/* Band `at` alone. */
static struct medium one_band(const struct medium *m, size_t at)
{
    return (struct medium){ .n = 1,
                            .epidermis_mm = m->epidermis_mm,
                            .eta = m->eta,
                            .sigma_a_epidermis = m->sigma_a_epidermis + at,
                            .sigma_a_dermis = m->sigma_a_dermis + at,
                            .sigma_s_prime_epidermis = m->sigma_s_prime_epidermis + at,
                            .sigma_s_prime_dermis = m->sigma_s_prime_dermis + at };
}

static struct slopes slopes_of_one(const struct slopes *dR, size_t at)
{
    return (struct slopes){ .sigma_a_epidermis = dR->sigma_a_epidermis + at,
                            .sigma_a_dermis = dR->sigma_a_dermis + at,
                            .sigma_s_prime_epidermis = dR->sigma_s_prime_epidermis + at,
                            .sigma_s_prime_dermis = dR->sigma_s_prime_dermis + at,
                            .epidermis_mm = dR->epidermis_mm + at };
}

enum status transport_lanes_reflectance(const struct transport_lanes *t, const struct medium *m,
                                        double *R)
{
    double top[TRANSPORT_LANES_EPIDERMIS(MOST)], under[TRANSPORT_LANES_DERMIS(MOST)];
    struct lane_room room;
    enum status s = medium_check(m);
    for (size_t at = 0; at < m->n && s == STATUS_OK; at += LANES) {
        transport_row here = { 0 };
        unsigned beyond = take_medium(m, at, &room);
        run(&(struct lane_job){ .task = EPIDERMIS, .t = t, .room = &room, .ret = top });
        run(&(struct lane_job){ .task = DERMIS, .t = t, .room = &room, .ret = under });
        join_in(&room, t, top, under, here);
        for (size_t l = 0; l < LANES && at + l < m->n && s == STATUS_OK; l++) {
            struct medium one = one_band(m, at + l);
            if (beyond & 1u << l)
                s = transport_reflectance(t->streams.n, &one, R + at + l);
            else
                R[at + l] = here[l];
        }
    }
    return s;
}

enum status transport_lanes_slopes(const struct transport_lanes *t, const struct medium *m,
                                   double *R, const struct slopes *dR)
{
    struct lane_room room;
    enum status s = medium_check(m);
    for (size_t at = 0; at < m->n && s == STATUS_OK; at += LANES) {
        struct lane_slopes here = { .R = { 0 } };
        unsigned beyond = take_medium(m, at, &room);
        run(&(struct lane_job){ .task = SLOPES, .t = t, .room = &room, .slopes = &here });
        for (size_t l = 0; l < LANES && at + l < m->n && s == STATUS_OK; l++) {
            struct medium one = one_band(m, at + l);
            struct slopes by = slopes_of_one(dR, at + l);
            if (beyond & 1u << l) {
                s = transport_slopes(t->streams.n, &one, R + at + l, &by);
            } else {
                R[at + l] = here.R[l];
                albedo_chain(&one, here.by_a1[l], here.by_a2[l], here.border[l], &by);
            }
        }
    }
    return s;
}
