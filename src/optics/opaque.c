/* opaque.c - the epidermis alone, and what a dermis could change. */
#include "optics/opaque.h"

#include <math.h>

#include "optics/chromophores.h"
#include "optics/dipole.h"

/* The epidermis of a band. */
struct epidermis {
    double sigma_s_prime, sigma_t_prime, k, u;
};

static struct epidermis epidermis_of(const struct medium *m, size_t i)
{
    double sigma_a = m->sigma_a_epidermis[i], sigma_s_prime = m->sigma_s_prime_epidermis[i];
    double sigma_t_prime = sigma_a + sigma_s_prime;
    double root = sqrt(3.0 * (sigma_a / sigma_t_prime)); /* k/σt' */
    return (struct epidermis){ sigma_s_prime, sigma_t_prime, root * sigma_t_prime, root / 3.0 };
}

enum status opaque_reflectance(const struct medium *m, double *R)
{
    double A;
    if (medium_check(m) != STATUS_OK || dipole_A(m->eta, &A) != STATUS_OK)
        return STATUS_RANGE;
    double entering = 1.0 - dipole_Rs(m->eta);
    for (size_t i = 0; i < m->n; i++) {
        struct epidermis e = epidermis_of(m, i);
        R[i] = entering * e.sigma_s_prime / ((e.sigma_t_prime + e.k) * (1.0 + 2.0 * A * e.u));
    }
    return STATUS_OK;
}

/* With c = sigma_a/sigma_t', r = sqrt(3c) = k/sigma_t': R = entering (1-c)/((1+r)(1 + 2A r/3)), so
 * all goes by c, and dr/dc = 3/(2r). */
enum status opaque_slopes(const struct medium *m, double *R, const struct slopes *dR)
{
    double A;
    if (opaque_reflectance(m, R) != STATUS_OK || dipole_A(m->eta, &A) != STATUS_OK)
        return STATUS_RANGE;
    double entering = 1.0 - dipole_Rs(m->eta), surface = 2.0 / 3.0 * A;
    for (size_t i = 0; i < m->n; i++) {
        struct epidermis e = epidermis_of(m, i);
        double sigma_a = m->sigma_a_epidermis[i], st = e.sigma_t_prime, r = 3.0 * e.u;
        double losses = (1.0 + r) * (1.0 + surface * r), mu = e.sigma_s_prime / st;
        double losses_by_r = 1.0 + surface + 2.0 * surface * r;
        /* -INFINITY at r = 0, by the division. */
        double by_c = -entering / losses * (1.0 + mu * losses_by_r / losses * 1.5 / r);
        dR->sigma_a_epidermis[i] = by_c * mu / st; /* dc/dsigma_a = sigma_s'/sigma_t'^2 */
        dR->sigma_s_prime_epidermis[i] = sigma_a > 0.0 ? -by_c * (sigma_a / st) / st : 0.0;
        dR->sigma_a_dermis[i] = dR->sigma_s_prime_dermis[i] = dR->epidermis_mm[i] = 0.0;
    }
    return STATUS_OK;
}

const struct model opaque_model = {
    .name = "epidermis",
    .summary = "two-layer without its dermis, for an epidermis that lets nothing through",
    .trust = "as two-layer, within the bound of optics/opaque.h",
    .reflectance = opaque_reflectance,
    .slopes = opaque_slopes,
    .quick = MODEL_QUICK_EPIDERMIS,
};

/* ---- the bound ---------------------------------------------------------------------- */

/* (1 - e^-z)/z; z >= 0. */
static double mean_decay(double z)
{
    return z > 0.0 ? -expm1(-z) / z : 1.0;
}

static double bound_of(struct epidermis e, double d, double A, double entering)
{
    double x = e.sigma_t_prime * d, y = e.k * d;
    double b = exp(-(y + fmin(x, y))) * mean_decay(fabs(x - y));
    double w = e.sigma_s_prime / (e.sigma_t_prime + e.k), S = 1.0 + 2.0 * A * e.u;
    double seen = e.sigma_s_prime * d * b + 2.0 * exp(-(x + y)) + w * exp(-2.0 * y);
    return y > 0.0 ? entering * seen / (S * -expm1(-2.0 * y)) : INFINITY;
}

enum status opaque_bound(const struct medium *m, double *most)
{
    double A;
    if (medium_check(m) != STATUS_OK || dipole_A(m->eta, &A) != STATUS_OK)
        return STATUS_RANGE;
    for (size_t i = 0; i < m->n; i++)
        most[i] = bound_of(epidermis_of(m, i), m->epidermis_mm, A, 1.0 - dipole_Rs(m->eta));
    return STATUS_OK;
}

enum status opaque_most(const struct tissue *lightest, double Bm_hi, double first_nm,
                        double step_nm, size_t n, double *ret)
{
    struct chromophores c;
    struct tissue other = *lightest;
    double scratch[2][MEDIUM_SCRATCH(SPECTRUM_MAX_BANDS)],
        most[2][SPECTRUM_MAX_BANDS] = { { 0.0 } };
    double sum = 0.0;
    struct medium m[2];
    enum status s = chromophores_init(first_nm, step_nm, n, &c);
    other.Bm = Bm_hi;
    if (s == STATUS_OK)
        s = tissue_medium(lightest, &c, scratch[0], &m[0]);
    if (s == STATUS_OK)
        s = tissue_medium(&other, &c, scratch[1], &m[1]);
    for (size_t i = 0; i < 2 && s == STATUS_OK; i++)
        s = opaque_bound(&m[i], most[i]);
    if (s != STATUS_OK)
        return s;
    for (size_t i = 0; i < n; i++) {
        double more = fmax(most[0][i], most[1][i]);
        sum += more * more;
    }
    *ret = sqrt(sum / (double)n);
    return STATUS_OK;
}
