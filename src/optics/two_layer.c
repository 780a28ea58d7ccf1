/* two_layer.c - closed-form two-layer diffusion without a singular point.
 *
 * The usual form divides by 3 sigma_a - sigma_t' (zero at a reduced albedo of
 * 2/3) and, as it stands, by u1 (zero where the epidermis absorbs nothing).
 * Multiplied by (u1 + u2)/u1 and with the source integrals named, neither is
 * left.  k = sqrt(3 sigma_a sigma_t'), u = k/(3 sigma_t') per layer, and in units
 * of the thickness x = sigma_t1' d, y = k1 d (so u1 = y/(3 x)):
 *
 *   a = int_0^1 e^(-(x+y) s) ds          scattered once, straight to the surface
 *   b = int_0^1 e^(-x s - y (2-s)) ds    scattered once, by way of the dermis
 *   c = (a - b)/(2 y),  p = (1 - e^-2y)/(2 y)
 *
 *                   sigma_s1' d [a + b + 6 x u2 c] + 2 sigma_s2' e^-(x+y)/(sigma_t2' + k2)
 *   R = (1-Rs) --------------------------------------------------------------------------
 *                1 + e^-2y + 6 x u2 p + 2A [u1 (1 - e^-2y) + u2 (1 + e^-2y)]            */
#include "optics/two_layer.h"

#include <math.h>

#include "optics/dipole.h"

struct layer {
    double sigma_s_prime, sigma_t_prime;
    double k, u;
};

static struct layer layer_of(double sigma_a, double sigma_s_prime)
{
    double sigma_t_prime = sigma_a + sigma_s_prime;
    double root = sqrt(3.0 * (sigma_a / sigma_t_prime)); /* k/σt', 0 .. √3 */
    return (struct layer){ sigma_s_prime, sigma_t_prime, root * sigma_t_prime, root / 3.0 };
}

/* (1 - e^-z)/z, the mean of e^-zs over 0 <= s <= 1; z >= 0. */
static double mean_decay(double z)
{
    return z > 0.0 ? -expm1(-z) / z : 1.0;
}

/* c for a thin, weakly absorbing epidermis, where a and b are nearly equal:
 * e^-y int_0^1 e^(-x (1-s)) sinh(y s)/y ds by 8-point Gauss-Legendre, exact to
 * rounding for x <= 1, y <= 1/4.  Nodes and weights: Abramowitz and Stegun 25.4.30. */
static double thin_difference(double x, double y)
{
    static const double node[4] = { 0.18343464249564980494, 0.52553240991632898582,
                                    0.79666647741362673959, 0.96028985649753623168 };
    static const double weight[4] = { 0.36268378337836198297, 0.31370664587788728734,
                                      0.22238103445337447054, 0.10122853629037625915 };
    double sum = 0.0;
    for (int i = 0; i < 4; i++) {
        for (int side = -1; side <= 1; side += 2) {
            double s = 0.5 * (1.0 + side * node[i]);
            double sinh_ratio = y > 0.0 ? sinh(y * s) / y : s;
            sum += 0.5 * weight[i] * exp(-x * (1.0 - s)) * sinh_ratio;
        }
    }
    return exp(-y) * sum;
}

/* c, by whichever form does not cancel. */
static double source_difference(double x, double y, double a, double b)
{
    if (y > 0.25)
        return (a - b) / (2.0 * y);
    if (x < 1.0)
        return thin_difference(x, y);
    /* a and b over their common denominator x^2 - y^2, which is at least 0.9 here. */
    double bracket = 2.0 * x * mean_decay(2.0 * y) - (1.0 + exp(-2.0 * y)) + 2.0 * exp(-(x + y));
    return bracket / (2.0 * (x - y) * (x + y));
}

static double band_reflectance(struct layer epi, struct layer der, double d, double A)
{
    double x = epi.sigma_t_prime * d, y = epi.k * d;
    double a = mean_decay(x + y);
    double b = exp(-(y + fmin(x, y))) * mean_decay(fabs(x - y));
    double c = source_difference(x, y, a, b);
    double p = mean_decay(2.0 * y);
    double gone = -expm1(-2.0 * y), left = 1.0 + exp(-2.0 * y); /* 1 -+ e^-2y */

    double from_epidermis = epi.sigma_s_prime * d * (a + b + 6.0 * x * der.u * c);
    double from_dermis = 2.0 * der.sigma_s_prime * exp(-(x + y)) / (der.sigma_t_prime + der.k);
    double losses = left + 6.0 * x * der.u * p + 2.0 * A * (epi.u * gone + der.u * left);
    return (from_epidermis + from_dermis) / losses;
}

enum status two_layer_reflectance(const struct medium *m, double *R)
{
    double A;
    if (medium_check(m) != STATUS_OK || dipole_A(m->eta, &A) != STATUS_OK)
        return STATUS_RANGE;
    double entering = 1.0 - dipole_Rs(m->eta);
    for (size_t i = 0; i < m->n; i++) {
        struct layer epi = layer_of(m->sigma_a_epidermis[i], m->sigma_s_prime_epidermis[i]);
        struct layer der = layer_of(m->sigma_a_dermis[i], m->sigma_s_prime_dermis[i]);
        /* Where nothing absorbs, rounding alone may carry the quotient past 1. */
        R[i] = entering * fmin(band_reflectance(epi, der, m->epidermis_mm, A), 1.0);
    }
    return STATUS_OK;
}
