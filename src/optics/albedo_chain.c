/* albedo_chain.c - albedo and optical depth by coefficients. */
#include "optics/albedo_chain.h"

#include <math.h>

/* a1 - a2 to full relative accuracy, also of layers nearly alike: Kahan's difference of products
 * (Jeannerod, Louvet, Muller, Math. Comp. 82, 2245, 2013). */
static double albedo_step(double a1, double s1, double a2, double s2)
{
    double product = s2 * a1, lost = fma(-s2, a1, product);
    return (fma(s1, a2, -product) + lost) / (a1 + s1) / (a2 + s2);
}

void albedo_chain(const struct medium *m, double by_a1, double by_a2, double border,
                  const struct slopes *dR)
{
    double sigma_a = m->sigma_a_epidermis[0], sigma_s = m->sigma_s_prime_epidermis[0];
    double by_tau = albedo_step(sigma_a, sigma_s, m->sigma_a_dermis[0], m->sigma_s_prime_dermis[0]);
    double sigma_t = sigma_a + sigma_s, d = m->epidermis_mm;
    by_tau *= border;
    dR->sigma_a_epidermis[0] = d * by_tau - sigma_s / sigma_t * (by_a1 / sigma_t);
    dR->sigma_s_prime_epidermis[0] = d * by_tau + sigma_a / sigma_t * (by_a1 / sigma_t);
    dR->epidermis_mm[0] = sigma_t * by_tau;
    sigma_a = m->sigma_a_dermis[0];
    sigma_s = m->sigma_s_prime_dermis[0];
    sigma_t = sigma_a + sigma_s;
    if (sigma_a / sigma_t > 0.0) {
        dR->sigma_a_dermis[0] = -(sigma_s / sigma_t) * (by_a2 / sigma_t);
        dR->sigma_s_prime_dermis[0] = sigma_a / sigma_t * (by_a2 / sigma_t);
    } else {
        dR->sigma_a_dermis[0] = -INFINITY;
        dR->sigma_s_prime_dermis[0] = 0.0;
    }
}
