/* tissue_slopes.h - how the reflectance of a skin changes with what is in it: the chain rule from
 * a model's derivatives by coefficients (optics/slopes.h) to those by a skin's parameters.
 *
 *   parameter      sigma_a, epidermis         sigma_a, dermis     sigma_s', both layers
 *   Cm             melanin - base
 *   Bm             Cm (eumelanin - pheomelanin)
 *   Ch                                        blood - base
 *   gamma                                     Ch (oxy - deoxy)
 *   scattering_a                                                  (l/500)^-b
 *   scattering_b                                                  -ln(l/500) sigma_s'
 * and epidermis_mm as it is.  Where scattering_a is 0 (Eq. 6) neither it nor scattering_b is
 * looked at: both rows are 0. */
#ifndef SKINSPEC_OPTICS_TISSUE_SLOPES_H
#define SKINSPEC_OPTICS_TISSUE_SLOPES_H

#include "optics/chromophores.h"
#include "optics/slopes.h"
#include "optics/tissue.h"

enum tissue_parameter {
    TISSUE_CM,
    TISSUE_BM,
    TISSUE_CH,
    TISSUE_GAMMA,
    TISSUE_EPIDERMIS_MM,
    TISSUE_SCATTERING_A,
    TISSUE_SCATTERING_B,
    TISSUE_PARAMETERS
};

/* The member of *t. */
double *tissue_parameter(struct tissue *t, enum tissue_parameter p);

/* J[p * c->n + band] = dR/dparameter p for TISSUE_PARAMETERS rows; dR at the medium m that
 * tissue_medium() made of t.  Cannot fail.  In tissue every sigma_a is above 0 (base and blood
 * absorb everywhere), so every row is finite where the model's derivatives are. */
void tissue_slopes(const struct tissue *t, const struct chromophores *c, const struct medium *m,
                   const struct slopes *dR, double *J);

#endif
