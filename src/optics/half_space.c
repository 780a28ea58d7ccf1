/* half_space.c - Eq. 9 per band on the summed absorption. */
#include "optics/half_space.h"

#include <math.h>

#include "optics/dipole.h"

static enum status band(const struct medium *m, size_t i, struct dipole *ret)
{
    double sigma_a = m->sigma_a_epidermis[i] + m->sigma_a_dermis[i];
    return dipole_init(sigma_a, m->sigma_s_prime_epidermis[i], m->eta, ret);
}

enum status half_space_reflectance(const struct medium *m, double *R)
{
    struct dipole d;
    double entering = 1.0 - dipole_Rs(m->eta);
    for (size_t i = 0; i < m->n; i++)
        if (band(m, i, &d) != STATUS_OK)
            return STATUS_RANGE;
    for (size_t i = 0; i < m->n; i++) {
        (void)band(m, i, &d); /* just accepted */
        R[i] = entering * dipole_total(&d);
    }
    return STATUS_OK;
}

/* R = (1-Rs) mu'/2 g(s), g = e^-s + e^-(1+4A/3)s, with mu' = sigma_s'/sigma_t', b = 1-mu' and
 * s = sqrt(3 b).  In what follows all terms of a derivative have one sign:
 *   dR/dsigma_a  = -(1-Rs) mu'/(2 sigma_t') [g + 3 mu' |g'|/(2 s)]
 *   dR/dsigma_s' =  (1-Rs) b/(2 sigma_t') [g + 3 mu' |g'|/(2 s)]      (b 3/(2 s) = s/2) */
enum status half_space_slopes(const struct medium *m, double *R, const struct slopes *dR)
{
    struct dipole d;
    double entering = 1.0 - dipole_Rs(m->eta);
    enum status status = half_space_reflectance(m, R);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < m->n; i++) {
        (void)band(m, i, &d); /* just accepted */
        double s = sqrt(3.0 * d.absorbed), steeper = 1.0 + 4.0 / 3.0 * d.A;
        double slow = exp(-s), fast = exp(-steeper * s);
        double g = slow + fast, fall = slow + steeper * fast; /* |g'| */
        double outside = 0.5 * entering * d.z_r;              /* z_r = 1/sigma_t' */
        double by_sigma_a =
            s > 0.0 ? -outside * d.alpha_prime * (g + 1.5 * d.alpha_prime * (fall / s)) : -INFINITY;
        dR->sigma_a_epidermis[i] = dR->sigma_a_dermis[i] = by_sigma_a;
        dR->sigma_s_prime_epidermis[i] =
            outside * (d.absorbed * g + 0.5 * d.alpha_prime * s * fall);
        dR->sigma_s_prime_dermis[i] = dR->epidermis_mm[i] = 0.0;
    }
    return STATUS_OK;
}
