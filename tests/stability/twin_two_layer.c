/* twin_two_layer.c - the diffusion equation of two layers solved as a boundary-value
 * problem: in each layer a particular solution p e^(-tau) and homogeneous ones, their three
 * constants from the three conditions.  No closed form of the reflectance is used.
 *
 * p does not exist where 3 sigma_a = sigma_t' (a reduced albedo of 2/3).  There sigma_a is
 * changed by 2^-500 of itself, and enough bits are taken that p's 500 may be lost twice. */
#include "tests/stability/twins.h"

#include <string.h>

enum { BITS = 600, BITS_AT_POLE = 1800, NEAR_POLE = -100, NUDGE = -500 };

struct wide_layer {
    wide D, k, p, sigma_t;
};

/* Whether 3 sigma_a is sigma_t' to so many bits. */
static bool at_pole(wide sigma_a, wide sigma_s, long bits)
{
    wide sigma_t = w_add(sigma_a, sigma_s), off = w_sub(w_mul(w_int(3), sigma_a), sigma_t);
    return w_less(w_abs(off), w_mul(sigma_t, w_two_to(bits)));
}

static struct wide_layer layer_of(wide sigma_a, wide sigma_s)
{
    struct wide_layer l;
    if (at_pole(sigma_a, sigma_s, NUDGE))
        sigma_a = w_mul(sigma_a, w_add(w_int(1), w_two_to(NUDGE)));
    l.sigma_t = w_add(sigma_a, sigma_s);
    l.D = w_div(w_int(1), w_mul(w_int(3), l.sigma_t));
    l.k = w_sqrt(w_mul(w_int(3), w_mul(sigma_a, l.sigma_t)));
    l.p = w_div(sigma_s, w_sub(sigma_a, w_div(l.sigma_t, w_int(3))));
    return l;
}

/* Value and derivative at z of two homogeneous solutions.  Thin: cosh kz and sinh kz / k, which
 * become 1 and z; thick: decaying from either face. */
struct basis {
    wide f, f_slope, g, g_slope;
};

static struct basis basis_at(wide k, wide d, wide z)
{
    struct basis b;
    if (w_less(w_int(1), w_mul(k, d))) {
        b.f = w_exp(w_neg(w_mul(k, z)));
        b.f_slope = w_neg(w_mul(k, b.f));
        b.g = w_exp(w_neg(w_mul(k, w_sub(d, z))));
        b.g_slope = w_mul(k, b.g);
        return b;
    }
    wide up = w_exp(w_mul(k, z)), down = w_exp(w_neg(w_mul(k, z)));
    wide sinh_kz = w_div(w_sub(up, down), w_int(2));
    b.f = b.g_slope = w_div(w_add(up, down), w_int(2));
    b.f_slope = w_mul(k, sinh_kz);
    b.g = w_is_zero(w_mul(k, z)) ? z : w_div(sinh_kz, k);
    return b;
}

/* Gauss elimination with the largest of each column, rows scaled; three unknowns, the
 * right side in column 3. */
static void solve(wide m[3][4], wide x[3])
{
    for (int i = 0; i < 3; i++) {
        wide scale = w_max(w_abs(m[i][0]), w_max(w_abs(m[i][1]), w_abs(m[i][2])));
        for (int j = 0; j < 4; j++)
            m[i][j] = w_div(m[i][j], scale);
    }
    for (int i = 0; i < 3; i++) {
        int best = i;
        for (int j = i + 1; j < 3; j++)
            if (w_less(w_abs(m[best][i]), w_abs(m[j][i])))
                best = j;
        wide row[4];
        memcpy(row, m[i], sizeof row);
        memcpy(m[i], m[best], sizeof row);
        memcpy(m[best], row, sizeof row);
        for (int j = i + 1; j < 3; j++) {
            wide factor = w_div(m[j][i], m[i][i]);
            for (int l = i; l < 4; l++)
                m[j][l] = w_sub(m[j][l], w_mul(factor, m[i][l]));
        }
    }
    for (int i = 2; i >= 0; i--) {
        wide rest = m[i][3];
        for (int j = i + 1; j < 3; j++)
            rest = w_sub(rest, w_mul(m[i][j], x[j]));
        x[i] = w_div(rest, m[i][i]);
    }
}

static wide surface(const struct wide_layer *epi, const struct wide_layer *der, wide d, wide A)
{
    wide T = w_exp(w_neg(w_mul(epi->sigma_t, d))); /* of the source, left at the junction */
    struct basis top = basis_at(epi->k, d, w_int(0)), end = basis_at(epi->k, d, d);
    wide lost = w_mul(w_int(2), w_mul(A, epi->D));
    wide m[3][4] = {
        { w_sub(top.f, w_mul(lost, top.f_slope)), w_sub(top.g, w_mul(lost, top.g_slope)), w_int(0),
          w_neg(w_mul(epi->p, w_add(w_int(1), w_mul(lost, epi->sigma_t)))) },
        { end.f, end.g, w_int(-1), w_mul(w_sub(der->p, epi->p), T) },
        { w_mul(epi->D, end.f_slope), w_mul(epi->D, end.g_slope), w_mul(der->D, der->k),
          w_mul(T, w_sub(w_mul(epi->D, w_mul(epi->p, epi->sigma_t)),
                         w_mul(der->D, w_mul(der->p, der->sigma_t)))) },
    };
    wide x[3];
    solve(m, x);
    return w_add(epi->p, w_add(w_mul(x[0], top.f), w_mul(x[1], top.g)));
}

wide twin_two_layer(const wide *x)
{
    mpfr_prec_t narrow = wide_bits;
    bool pole = at_pole(x[0], x[1], NEAR_POLE) || at_pole(x[2], x[3], NEAR_POLE);
    wide_bits += pole ? BITS_AT_POLE : BITS;
    struct wide_layer epi = layer_of(w_copy(x[0]), w_copy(x[1]));
    struct wide_layer der = layer_of(w_copy(x[2]), w_copy(x[3]));
    wide eta = w_copy(x[5]), A = twin_A(eta);
    wide phi = surface(&epi, &der, w_copy(x[4]), A);
    wide entering = w_sub(w_int(1), twin_Rs(eta));
    wide R = w_div(w_mul(entering, phi), w_mul(w_int(2), A));
    wide_bits = narrow;
    return R;
}
