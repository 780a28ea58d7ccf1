/* tissue.h - a skin: what is in it, and the coefficients of its two layers.
 * [paper] Eqs. 4 and 5; half of Eq. 6 in the dermis, as its text has it.
 *
 *   parameter      meaning                                 paper's range   accepted
 *   Cm             volume fraction of melanin, epidermis   0 .. 0.5        0 .. 1
 *   Bm             eumelanin share of the melanin          0 .. 1          0 .. 1
 *   Ch             volume fraction of blood, dermis        0.001 .. 0.1    0 .. 1
 *   gamma          oxygenated share of the haemoglobin     0.75            0 .. 1
 *   epidermis_mm   thickness of the epidermis              (0.08)          0 .. 1000
 *   eta            refractive index, skin over air         1.4             see optics/dipole.h
 *   scattering_a   mm^-1 at 500 nm, both layers            (none)          1e-6 .. 1e6, or 0: Eq. 6
 *   scattering_b   slope: sigma_s' = a (l/500)^-b          (none)          -10 .. 10
 * Bm multiplies eumelanin, as Eq. 4 is printed (the sentence below it has it the
 * other way round).  The paper gives no thickness; 0.08 mm is ours.
 * Where scattering_a is 0 the paper's constants hold: Eq. 6, half of it in the dermis, and
 * scattering_b is not looked at.  Real skin needs its own (docs/inversion.md). */
#ifndef SKINSPEC_OPTICS_TISSUE_H
#define SKINSPEC_OPTICS_TISSUE_H

#include <stddef.h>

#include "base/status.h"
#include "optics/chromophores.h"

#define TISSUE_CM_MAX 0.5
#define TISSUE_CH_MIN 0.001
#define TISSUE_CH_MAX 0.1
#define TISSUE_EPIDERMIS_MM_MAX 1000.0
#define TISSUE_SCATTERING_A_MIN 1e-6
#define TISSUE_SCATTERING_A_MAX 1e6
#define TISSUE_SCATTERING_B_MAX 10.0

struct tissue {
    double Cm, Bm, Ch, gamma;
    double epidermis_mm, eta;
    double scattering_a, scattering_b;
};

/* gamma 0.75, epidermis 0.08 mm, eta 1.4, the paper's scattering, with the given fractions. */
struct tissue tissue_of(double Cm, double Bm, double Ch);

/* STATUS_RANGE where a member is outside "accepted" (eta is left to the models). */
enum status tissue_check(const struct tissue *t);

/* Both layers at n bands, mm^-1; what every spectral model takes in.
 *   sigma_a_* >= 0, sigma_s_prime_* > 0; limits in optics/dipole.h */
struct medium {
    size_t n;
    double epidermis_mm, eta;
    double *sigma_a_epidermis, *sigma_a_dermis;
    double *sigma_s_prime_epidermis, *sigma_s_prime_dermis;
};

/* STATUS_RANGE where a coefficient or the thickness is outside what the models of two layers
 * accept (eta is left to them). */
enum status medium_check(const struct medium *m);

/* Doubles of scratch for a medium of n bands. */
#define MEDIUM_SCRATCH(n) (4 * (n))

/* Coefficients of a skin on the chromophores' band grid, in the caller's
 * scratch[MEDIUM_SCRATCH(c->n)].  STATUS_RANGE as tissue_check(). */
enum status tissue_medium(const struct tissue *t, const struct chromophores *c, double *scratch,
                          struct medium *ret);

#endif
