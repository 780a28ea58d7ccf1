/* transport_lanes.h - the N-stream equations of epidermis over dermis for eight bands side by side,
 * each layer for itself: what skins share is computed once.
 *
 * Of a layer remain a symmetric matrix and little else.  With s, B and A of optics/layers.h, B_2 of
 * the endless dermis, and G = g/mu of the surface, light at the surface solves
 *     (G' + E (B_2'^-1 + theta)^-1 E) y = v,   G' = V^T G V + k tanh(k tau),  y = V^T s,
 * by modes of the epidermis; and R = h y - g_n (1-Rs), for up_i = s_i/(mu_i (1 + r_i)) where no
 * light enters.  Taken apart (Woodbury, 1950; Schur's complement of the border between the layers)
 *     R = R_0 - h_1^T (B_2^-1 + M)^-1 v_1,
 *     M = V (theta + E G'^-1 E) V^T,  h_1 = V E G'^-1 h,  v_1 = V E G'^-1 v,  R_0 = h G'^-1 v - ...
 * of which B_2^-1 = V_2 k_2^-1 V_2^T is the dermis' and all else the epidermis'.  All matrices are
 * positive; R_0 is what would come back from above a dermis that takes nothing.
 *
 *   within    albedo at least 2^-10, of what meets the layer at least 2^-14 absorbed, epidermis of
 *             optical thickness 2^-5 or more, eta up to 1 or from 1.01 to 3, streams 4 .. 32
 *   R         within 1e-12 of itself of what optics/transport.h has where R is 0.002 or more,
 * within 2e-15 where it is less; on human skin within 1e-13
 *
 * Nothing is allocated; a call takes about 0.5 MB of stack.  The same bits whatever stands beside a
 * band and with AVX2 and AVX-512, and within 1e-13 of R of them without (docs/decisions/0012). */
#ifndef SKINSPEC_OPTICS_TRANSPORT_LANES_H
#define SKINSPEC_OPTICS_TRANSPORT_LANES_H

#include <stddef.h>

#include "base/status.h"
#include "base/vectors.h"
#include "optics/slopes.h"
#include "optics/streams.h"
#include "optics/tissue.h"

enum { TRANSPORT_LANES_STREAMS_MAX = 32 };

/* Doubles that stand for one layer at eight bands. */
#define TRANSPORT_LANES_DERMIS(n) (VECTORS_LANES * ((n) * ((n) + 1) / 2))
#define TRANSPORT_LANES_EPIDERMIS(n) (TRANSPORT_LANES_DERMIS(n) + VECTORS_LANES * (2 * (n) + 1))

/* What streams and surface are; only read once it is made. */
struct transport_lanes {
    struct streams streams;
    enum vectors vectors;         /* the widest the processor has; a test may take others */
    double pole[STREAMS_MAX + 1]; /* 1/mu^2, and a 0 behind */
    double u[STREAMS_MAX];        /* sqrt(w)/mu */
    double open[STREAMS_MAX];     /* g/mu */
    double escape[STREAMS_MAX];   /* g sqrt(w): h */
    double entering, mirrored;    /* v, in the last direction; g_n (1-Rs) */
};

/* STATUS_RANGE as streams_init(); STATUS_UNSUPPORTED for more streams or another eta than are
 * within; *ret is then untouched. */
enum status transport_lanes_init(int streams, double eta, struct transport_lanes *ret);

/* One layer at VECTORS_LANES bands, mm^-1 and mm, into the doubles that stand for it.  Returned is
 * the set of bands, as bits 1 << lane, that are not within; what is written of these is finite and
 * of no use. */
unsigned transport_lanes_epidermis(const struct transport_lanes *t, const double *sigma_a,
                                   const double *sigma_s_prime, double mm, double *ret);
unsigned transport_lanes_dermis(const struct transport_lanes *t, const double *sigma_a,
                                const double *sigma_s_prime, double *ret);

/* R of one over the other, R[VECTORS_LANES].  Cannot fail. */
void transport_lanes_join(const struct transport_lanes *t, const double *epidermis,
                          const double *dermis, double *R);

/* R[m->n] as transport_reflectance(), bands that are not within by that itself; m->eta is what *t
 * was made for.  STATUS_RANGE as there. */
enum status transport_lanes_reflectance(const struct transport_lanes *t, const struct medium *m,
                                        double *R);

/* The same R to the last bit, and its derivatives: within 1e-11 of those of transport_slopes(), or
 * of R (0.002 where it is less) per relative change of the layer's coefficients or thickness. */
enum status transport_lanes_slopes(const struct transport_lanes *t, const struct medium *m,
                                   double *R, const struct slopes *dR);

#endif
