/* kubelka_munk.c - the two fluxes in closed form without a singular point.
 *
 * With g = sqrt(K (K+2S)) per layer, rho = S/(K+S+g) the reflectance of an endless layer,
 * e = e^(-2 g d) and q = (1-e)/g of the epidermis, and R2 = rho of the dermis,
 *
 *          S q (1 - rho R2) + 2 e R2
 *   R_in = -----------------------------  = N/D
 *          1 + e + (K + S (1 - R2)) q
 *
 * in which nothing is subtracted: 1 - rho R2 = (1-rho) + rho (1-R2), 1 - rho = (K+g)/(K+S+g).
 *
 * Slopes.  A sheet added below gives dR_in/dd = dR_in/dR2 (S (1-R2)^2 - 2 K R2), and
 * dR_in/dR2 = 4 e/D^2.  By K and S of the epidermis there are two ways, as each cancels where
 * the other does not: in t = tanh(g d)/g, which knows g only by its square and so has no pole at
 * K = 0, and, where K > S in a thick layer, of N and D as they stand. */
#include "optics/kubelka_munk.h"

#include <math.h>
#include <stdbool.h>

#include "optics/dipole.h"

struct layer {
    double K, S, g;
    double endless, lost; /* rho, 1 - rho */
};

static struct layer layer_of(double sigma_a, double sigma_s_prime)
{
    double K = 2.0 * sigma_a, S = 0.75 * sigma_s_prime;
    double g = sqrt(K) * sqrt(K + 2.0 * S);
    return (struct layer){ K, S, g, S / (K + S + g), (K + g) / (K + S + g) };
}

/* d rho/dK, -INFINITY where nothing absorbs; d rho/dS. */
static double endless_by_K(struct layer l)
{
    return -l.endless / l.g;
}

static double endless_by_S(struct layer l)
{
    return sqrt(l.K / (l.K + 2.0 * l.S)) / (l.K + l.S + l.g);
}

/* (1 - e^-z)/z; z >= 0. */
static double mean_decay(double z)
{
    return z > 0.0 ? -expm1(-z) / z : 1.0;
}

/* An epidermis over a dermis, without the surface. */
struct sheet {
    struct layer epi, der;
    double d;
    double z, e, q; /* 2 g d, e^-z, (1-e)/g */
    double D;
    double R, lost; /* R_in, 1 - R_in */
};

static struct sheet sheet_of(struct layer epi, struct layer der, double d)
{
    double z = 2.0 * epi.g * d, e = exp(-z), q = 2.0 * d * mean_decay(z);
    double D = 1.0 + e + (epi.K + epi.S * der.lost) * q;
    double both_lost = epi.lost + epi.endless * der.lost; /* 1 - rho R2 */
    double N = epi.S * q * both_lost + 2.0 * e * der.endless;
    /* Rounding alone may carry either past 1. */
    double lost = (der.lost * (1.0 + e) + epi.K * q * (1.0 + der.endless)) / D;
    return (struct sheet){ epi, der, d, z, e, q, D, fmin(N / D, 1.0), fmin(lost, 1.0) };
}

struct slope_pair {
    double by_K, by_S;
};

/* (sinh z - z)/z^3 for 0 <= z <= 1: terms to z^14, below rounding. */
static double sinh_excess(double z)
{
    double z2 = z * z, term = 1.0 / 6.0, sum = term;
    for (int k = 1; k <= 7; k++) {
        term *= z2 / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
        sum += term;
    }
    return sum;
}

/* R_in by t and by what stands beside it.  dt/d(g^2) = -2 d^3 (sinh z - z)/z^3 / cosh^2(z/2),
 * and dR_in/dt = added/D_t^2 with D = D_t (1+e); together by_g2, for thick layers without sinh. */
static struct slope_pair slopes_in_t(const struct sheet *s, double added)
{
    double K = s->epi.K, S = s->epi.S, g = s->epi.g, by_g2;
    double direct = s->q / s->D; /* t/D_t */
    if (s->z < 1.0) {
        double reach = s->d / s->D;
        by_g2 = -8.0 * s->d * s->e * sinh_excess(s->z) * reach * (reach * added);
    } else {
        double excess = 0.5 * (1.0 - s->e * s->e) - s->z * s->e; /* (sinh z - z) e^-z */
        by_g2 = -excess / g / (g * s->D) * (added / (g * s->D));
    }
    return (struct slope_pair){
        .by_K = -direct * (s->der.endless + s->R) + 2.0 * (K + S) * by_g2,
        .by_S = direct * s->der.lost * s->lost + 2.0 * K * by_g2,
    };
}

/* N and D by g, K and S in turn; everything with a 1/g taken as a ratio to g. */
static struct slope_pair slopes_as_it_stands(const struct sheet *s)
{
    const struct layer *l = &s->epi;
    double R2 = s->der.endless, both_lost = l->lost + l->endless * s->der.lost;
    double g_by_K = (l->K + l->S) / l->g, g_by_S = l->K / l->g;
    double e_by_g = -2.0 * s->d * s->e, q_by_g = -(s->q + e_by_g) / l->g;
    double rho_by_K = endless_by_K(*l), rho_by_S = endless_by_S(*l);
    double within = l->K + l->S * s->der.lost;

    double N_by_g = l->S * q_by_g * both_lost + 2.0 * e_by_g * R2;
    double D_by_g = e_by_g + within * q_by_g;
    double N_by_K = N_by_g * g_by_K - l->S * s->q * rho_by_K * R2;
    double N_by_S = N_by_g * g_by_S - l->S * s->q * rho_by_S * R2 + s->q * both_lost;
    double D_by_K = D_by_g * g_by_K + s->q;
    double D_by_S = D_by_g * g_by_S + s->der.lost * s->q;
    return (struct slope_pair){ (N_by_K - s->R * D_by_K) / s->D, (N_by_S - s->R * D_by_S) / s->D };
}

/* What stands for a half space where the layer above lets nothing through is no slope. */
static double through(double share, double slope)
{
    return share > 0.0 ? share * slope : 0.0;
}

struct surface {
    double entering, Ri; /* 1 - Rs; internal diffuse reflectance */
};

static double leaving(const struct surface *f, const struct sheet *s)
{
    return f->entering * (1.0 - f->Ri) * s->R / (s->lost + (1.0 - f->Ri) * s->R);
}

static void band_slopes(const struct surface *f, const struct sheet *s, size_t i,
                        const struct slopes *dR)
{
    double inside = s->lost + (1.0 - f->Ri) * s->R; /* 1 - Ri R_in */
    double out = f->entering * ((1.0 - f->Ri) / inside) / inside;
    double from_dermis = 4.0 * s->e / s->D / s->D;
    double added = s->epi.S * s->der.lost * s->der.lost - 2.0 * s->epi.K * s->der.endless;
    bool in_t = s->z < 1.0 || s->epi.K < s->epi.S;
    struct slope_pair epi = in_t ? slopes_in_t(s, added) : slopes_as_it_stands(s);
    dR->sigma_a_epidermis[i] = 2.0 * out * epi.by_K;
    dR->sigma_s_prime_epidermis[i] = 0.75 * out * epi.by_S;
    dR->sigma_a_dermis[i] = through(2.0 * out * from_dermis, endless_by_K(s->der));
    dR->sigma_s_prime_dermis[i] = through(0.75 * out * from_dermis, endless_by_S(s->der));
    dR->epidermis_mm[i] = through(out * from_dermis, added);
}

static enum status surface_of(const struct medium *m, struct surface *ret)
{
    double A;
    if (dipole_A(m->eta, &A) != STATUS_OK || medium_check(m) != STATUS_OK)
        return STATUS_RANGE;
    *ret = (struct surface){ 1.0 - dipole_Rs(m->eta), dipole_F_dr(m->eta) };
    return STATUS_OK;
}

static struct sheet band_sheet(const struct medium *m, size_t i)
{
    return sheet_of(layer_of(m->sigma_a_epidermis[i], m->sigma_s_prime_epidermis[i]),
                    layer_of(m->sigma_a_dermis[i], m->sigma_s_prime_dermis[i]), m->epidermis_mm);
}

enum status kubelka_munk_reflectance(const struct medium *m, double *R)
{
    struct surface f;
    if (surface_of(m, &f) != STATUS_OK)
        return STATUS_RANGE;
    for (size_t i = 0; i < m->n; i++) {
        struct sheet s = band_sheet(m, i);
        R[i] = leaving(&f, &s);
    }
    return STATUS_OK;
}

enum status kubelka_munk_slopes(const struct medium *m, double *R, const struct slopes *dR)
{
    struct surface f;
    if (surface_of(m, &f) != STATUS_OK)
        return STATUS_RANGE;
    for (size_t i = 0; i < m->n; i++) {
        struct sheet s = band_sheet(m, i);
        R[i] = leaving(&f, &s);
        band_slopes(&f, &s, i, dR);
    }
    return STATUS_OK;
}
