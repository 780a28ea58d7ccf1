/* tissue.c - Eqs. 4 and 5: fractions of chromophores -> coefficients. */
#include "optics/tissue.h"

#include <math.h>
#include <stdbool.h>

#include "optics/dipole.h"

struct tissue tissue_of(double Cm, double Bm, double Ch)
{
    return (struct tissue){
        .Cm = Cm, .Bm = Bm, .Ch = Ch, .gamma = 0.75, .epidermis_mm = 0.08, .eta = 1.4
    };
}

static bool is_fraction(double x)
{
    return x >= 0.0 && x <= 1.0;
}

static bool is_scattering(const struct tissue *t)
{
    return t->scattering_a == 0.0 || (t->scattering_a >= TISSUE_SCATTERING_A_MIN &&
                                      t->scattering_a <= TISSUE_SCATTERING_A_MAX &&
                                      fabs(t->scattering_b) <= TISSUE_SCATTERING_B_MAX);
}

enum status tissue_check(const struct tissue *t)
{
    bool good = is_fraction(t->Cm) && is_fraction(t->Bm) && is_fraction(t->Ch) &&
                is_fraction(t->gamma) && t->epidermis_mm >= 0.0 &&
                t->epidermis_mm <= TISSUE_EPIDERMIS_MM_MAX && is_scattering(t);
    return good ? STATUS_OK : STATUS_RANGE;
}

enum status medium_check(const struct medium *m)
{
    if (!(m->epidermis_mm >= 0.0 && m->epidermis_mm <= TISSUE_EPIDERMIS_MM_MAX))
        return STATUS_RANGE;
    for (size_t i = 0; i < m->n; i++)
        if (!dipole_accepts(m->sigma_a_epidermis[i], m->sigma_s_prime_epidermis[i]) ||
            !dipole_accepts(m->sigma_a_dermis[i], m->sigma_s_prime_dermis[i]))
            return STATUS_RANGE;
    return STATUS_OK;
}

/* The paper's constants, or a power law that both layers share. */
static void scattering(const struct tissue *t, const struct chromophores *c, struct medium *m)
{
    for (size_t i = 0; i < c->n; i++) {
        bool paper = t->scattering_a == 0.0;
        double s =
            paper ? c->sigma_s_prime[i] : t->scattering_a * exp(-t->scattering_b * c->log_nm[i]);
        m->sigma_s_prime_epidermis[i] = s;
        m->sigma_s_prime_dermis[i] = paper ? 0.5 * s : s;
    }
}

enum status tissue_medium(const struct tissue *t, const struct chromophores *c, double *scratch,
                          struct medium *ret)
{
    size_t n = c->n;
    if (tissue_check(t) != STATUS_OK)
        return STATUS_RANGE;
    *ret = (struct medium){
        .n = n,
        .epidermis_mm = t->epidermis_mm,
        .eta = t->eta,
        .sigma_a_epidermis = scratch,
        .sigma_a_dermis = scratch + n,
        .sigma_s_prime_epidermis = scratch + 2 * n,
        .sigma_s_prime_dermis = scratch + 3 * n,
    };
    for (size_t i = 0; i < n; i++) {
        double melanin = t->Bm * c->eumelanin[i] + (1.0 - t->Bm) * c->pheomelanin[i];
        double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i];
        ret->sigma_a_epidermis[i] = t->Cm * melanin + (1.0 - t->Cm) * c->base[i];
        ret->sigma_a_dermis[i] = t->Ch * blood + (1.0 - t->Ch) * c->base[i];
    }
    scattering(t, c, ret);
    return STATUS_OK;
}
