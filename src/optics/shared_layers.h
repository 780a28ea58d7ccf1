/* shared_layers.h - R of many skins made of few epidermises and few dermises, as a table's are.
 *
 * The rows of a table pair every epidermis (Cm, Bm) with every dermis (Ch).  What a layer adds to
 * the formulas is computed once for it, and a pair then costs a few products and one root or one
 * division a band: optics/half_space.h and optics/two_layer.h, taken apart.
 *
 *   half-space   q = sigma_a/sigma_s' is a sum over the layers, v = sqrt(q/(1+q)), 0 <= v < 1,
 *                R = (1-Rs)/2 (1 - v^2) P(v),  P = e^(-sqrt(3) v) + e^(-(1+4A/3) sqrt(3) v)
 *                as a polynomial of degree 23; eta up to about 1.45, q up to 1000
 *   two-layer    R = H + (r1 - r2) (G + G' u)/(L + L' r2) with r = k/sigma_t' of each layer,
 *                u = 1/(1 + r2) and H, G, G', L, L' of the epidermis; the range of optics/quick.h
 *   transport-N  matrices of optics/transport_lanes.h, and its range
 *
 * R is within 1e-12 of the plain one, on human skin 2e-14; the same bits whatever is paired in one
 * call and with AVX2 and AVX-512, and within 1e-13 of them without (docs/decisions/0012). */
#ifndef SKINSPEC_OPTICS_SHARED_LAYERS_H
#define SKINSPEC_OPTICS_SHARED_LAYERS_H

#include <stdbool.h>
#include <stddef.h>

#include "base/vectors.h"
#include "optics/model.h"
#include "optics/transport_lanes.h"

/* A row of n bands takes so many doubles; what is past n repeats the last band. */
#define SHARED_LAYERS_STRIDE(n) (((n) + VECTORS_LANES - 1) / VECTORS_LANES * VECTORS_LANES)

enum { SHARED_LAYERS_TERMS = 24 };

struct shared_layers {
    enum model_quick kind; /* MODEL_QUICK_NONE: transport */
    const struct chromophores *c;
    size_t stride;
    size_t epidermis_size, dermis_size; /* doubles that stand for one layer */
    double gamma, d, A, entering;
    double P[SHARED_LAYERS_TERMS]; /* of 2 v - 1, times (1-Rs)/2 */
    struct transport_lanes transport;
    enum vectors vectors; /* the widest the processor has; a test may take others, of both */
};

/* What all skins have in common: model, bands, and of the tissue its gamma, epidermis_mm and eta.
 * The chromophores are used as long as *ret is.  STATUS_UNSUPPORTED for a model or an eta without
 * such formulas and for scattering of its own; STATUS_RANGE as tissue_check(). */
enum status shared_layers_init(const struct model *model, const struct chromophores *c,
                               const struct tissue *t, struct shared_layers *ret);

/* One layer; false, with what was written of no use, where the formulas do not reach: then the
 * skins that have it are the plain model's.  0 <= Cm, Bm, Ch <= 1. */
bool shared_epidermis(const struct shared_layers *s, double Cm, double Bm, double *epidermis);
bool shared_dermis(const struct shared_layers *s, double Ch, double *dermis);

/* R[i * stride + band] of one epidermis over dermis i of n, which lie one after the other at
 * dermis_size. */
void shared_reflectance(const struct shared_layers *s, const double *epidermis, size_t n,
                        const double *dermis, double *R);

#endif
