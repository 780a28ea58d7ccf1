/* dipole.c - Eqs. 7-9 in the order of their derivation. */
#include "optics/dipole.h"

#include <math.h>

#include "base/units.h"

double dipole_F_dr(double eta)
{
    if (eta >= 1.0)
        return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
    /* Nested: of the terms apart, each larger than the sum, twice as much rounding is left. */
    double inverse = 1.0 / eta;
    return -0.4399 + inverse * (0.7099 + inverse * (-0.3319 + inverse * 0.0636));
}

enum status dipole_A(double eta, double *ret)
{
    if (!(eta > DIPOLE_ETA_ABOVE && eta < DIPOLE_ETA_BELOW)) /* NaN fails here too */
        return STATUS_RANGE;
    double F_dr = dipole_F_dr(eta);
    *ret = (1.0 + F_dr) / (1.0 - F_dr);
    return STATUS_OK;
}

double dipole_Rs(double eta)
{
    double root = (eta - 1.0) / (eta + 1.0);
    return root * root;
}

bool dipole_accepts(double sigma_a, double sigma_s_prime)
{
    return sigma_a >= 0.0 && sigma_a <= DIPOLE_COEFFICIENT_MAX &&
           sigma_s_prime >= DIPOLE_COEFFICIENT_MIN && sigma_s_prime <= DIPOLE_COEFFICIENT_MAX;
}

enum status dipole_init(double sigma_a, double sigma_s_prime, double eta, struct dipole *ret)
{
    double A;
    if (!dipole_accepts(sigma_a, sigma_s_prime) || dipole_A(eta, &A) != STATUS_OK)
        return STATUS_RANGE;
    double sigma_t_prime = sigma_a + sigma_s_prime;
    *ret = (struct dipole){
        .alpha_prime = sigma_s_prime / sigma_t_prime,
        .absorbed = sigma_a / sigma_t_prime,
        /* Two roots: the product of the coefficients may leave the range of a double. */
        .sigma_tr = sqrt(3.0 * sigma_a) * sqrt(sigma_t_prime),
        .z_r = 1.0 / sigma_t_prime,
        .z_v = (1.0 + 4.0 / 3.0 * A) / sigma_t_prime, /* z_r + 4 A D, D = 1/(3 σ't) */
        .A = A,
    };
    return STATUS_OK;
}

/* One source of Eq. 7 at depth z: z (1 + σtr d) e^(-σtr d) / d^3.  Divided step by
 * step, so that neither z nor d^3 overflows before the quotient is formed; and
 * with the exponential in two halves, so that it does not lose digits as a
 * denormal where 1/d^2 would have lifted it again. */
static double source_profile(double z, double sigma_tr, double r_mm)
{
    double d = hypot(z, r_mm);
    double x = sigma_tr * d;
    double half = exp(-0.5 * x);
    return z / d * ((1.0 + x) * half) / d / d * half;
}

void dipole_profile(const struct dipole *d, size_t n, const double *r_mm, double *rd)
{
    for (size_t i = 0; i < n; i++) {
        double sources = source_profile(d->z_r, d->sigma_tr, r_mm[i]) +
                         source_profile(d->z_v, d->sigma_tr, r_mm[i]);
        rd[i] = d->alpha_prime / (4.0 * UNITS_PI) * sources;
    }
}

/* e^(-σtr z) - (z/d) e^(-σtr d), written in δ = d - z = r^2/(d+z) so that the two
 * terms do not cancel near r = 0: e^(-σtr z) [(1 - e^(-σtr δ)) + (δ/d) e^(-σtr δ)]. */
static double source_cumulative(double z, double sigma_tr, double r_mm)
{
    double d = hypot(z, r_mm);
    double delta = r_mm * (r_mm / (d + z));
    double x = sigma_tr * delta;
    return exp(-sigma_tr * z) * (-expm1(-x) + delta / d * exp(-x));
}

void dipole_cumulative(const struct dipole *d, size_t n, const double *r_mm, double *share)
{
    for (size_t i = 0; i < n; i++) {
        double sources = source_cumulative(d->z_r, d->sigma_tr, r_mm[i]) +
                         source_cumulative(d->z_v, d->sigma_tr, r_mm[i]);
        share[i] = 0.5 * d->alpha_prime * sources;
    }
}

double dipole_total(const struct dipole *d)
{
    double s = sqrt(3.0 * d->absorbed);
    return 0.5 * d->alpha_prime * (1.0 + exp(-4.0 / 3.0 * d->A * s)) * exp(-s);
}

/* 1 - mu'/2 (e^-s + e^-v) with mu' = 1 - b: a sum of terms that are never negative. */
double dipole_absorbed_share(const struct dipole *d)
{
    double s = sqrt(3.0 * d->absorbed), v = (1.0 + 4.0 / 3.0 * d->A) * s;
    return d->absorbed - 0.5 * d->alpha_prime * (expm1(-s) + expm1(-v));
}
