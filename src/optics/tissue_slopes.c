/* tissue_slopes.c - Eqs. 4 and 5 and the power law, differentiated. */
#include "optics/tissue_slopes.h"

double *tissue_parameter(struct tissue *t, enum tissue_parameter p)
{
    double *const member[TISSUE_PARAMETERS] = { &t->Cm,          &t->Bm,           &t->Ch,
                                                &t->gamma,       &t->epidermis_mm, &t->scattering_a,
                                                &t->scattering_b };
    return member[p];
}

void tissue_slopes(const struct tissue *t, const struct chromophores *c, const struct medium *m,
                   const struct slopes *dR, double *J)
{
    size_t n = c->n;
    for (size_t i = 0; i < n; i++) {
        double by_epidermis = dR->sigma_a_epidermis[i], by_dermis = dR->sigma_a_dermis[i];
        double melanin = t->Bm * c->eumelanin[i] + (1.0 - t->Bm) * c->pheomelanin[i];
        double blood = t->gamma * c->oxy[i] + (1.0 - t->gamma) * c->deoxy[i];
        J[TISSUE_CM * n + i] = by_epidermis * (melanin - c->base[i]);
        J[TISSUE_BM * n + i] = by_epidermis * (t->Cm * (c->eumelanin[i] - c->pheomelanin[i]));
        J[TISSUE_CH * n + i] = by_dermis * (blood - c->base[i]);
        J[TISSUE_GAMMA * n + i] = by_dermis * (t->Ch * (c->oxy[i] - c->deoxy[i]));
        J[TISSUE_EPIDERMIS_MM * n + i] = dR->epidermis_mm[i];
    }
    for (size_t i = 0; i < n; i++) {
        /* One sigma_s' in both layers: the two add. */
        double by_both = dR->sigma_s_prime_epidermis[i] + dR->sigma_s_prime_dermis[i];
        double sigma_s = t->scattering_a > 0.0 ? m->sigma_s_prime_epidermis[i] : 0.0;
        J[TISSUE_SCATTERING_A * n + i] =
            sigma_s > 0.0 ? by_both * (sigma_s / t->scattering_a) : 0.0;
        J[TISSUE_SCATTERING_B * n + i] = -by_both * (c->log_nm[i] * sigma_s);
    }
}
