/* half_space.c - Eq. 9 per band on the summed absorption. */
#include "optics/half_space.h"

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
