/* dipole.h - diffuse reflectance of a semi-infinite scattering medium.
 * [J01] Jensen et al., A Practical Model for Subsurface Light Transport, 2001;
 * [paper] Eqs. 7-9, with its misprints put right (docs/physics.md lists them).
 *
 *   here             [J01]  tissue optics   unit     accepted
 *   sigma_a          σa     mu_a            mm^-1    0 .. 1e100
 *   sigma_s_prime    σ's    mu_s'           mm^-1    1e-100 .. 1e100
 *   eta              η      n_rel           -        above 0.260, below 3.848
 *   r_mm             r      rho             mm       0 .. 1e100
 * The limits of eta are where F_dr reaches 1 (0.25995 and 3.84810), rounded inwards.
 * Trust: diffusion wants sigma_s_prime > 10 sigma_a.  Below that it still
 * computes; compare with a transport model or with data before using it. */
#ifndef SKINSPEC_OPTICS_DIPOLE_H
#define SKINSPEC_OPTICS_DIPOLE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

#define DIPOLE_COEFFICIENT_MAX 1e100
#define DIPOLE_COEFFICIENT_MIN 1e-100
#define DIPOLE_ETA_ABOVE 0.260
#define DIPOLE_ETA_BELOW 3.848

struct dipole {
    double alpha_prime; /* reduced albedo σ's/σ't, 0 .. 1 */
    double absorbed;    /* 1 - alpha_prime, as σa/σ't: the subtraction loses every digit */
    double sigma_tr;    /* effective transport coefficient, mm^-1 */
    double z_r, z_v;    /* depth of the real, height of the virtual source, mm */
    double A;           /* internal reflection; 1.0032 at eta = 1, as the fit has it */
};

/* Diffuse Fresnel reflectance from inside, a fit in eta: [J01] §2.1 for
 * eta >= 1, Egan and Hilgeman's for eta < 1.  Not limited to F_dr < 1. */
double dipole_F_dr(double eta);

/* A = (1+F_dr)/(1-F_dr).  STATUS_RANGE outside the limits of eta: beyond them A
 * would be negative. */
enum status dipole_A(double eta, double *ret);

/* Specular reflectance at normal incidence, ((eta-1)/(eta+1))^2. */
double dipole_Rs(double eta);

/* Whether the coefficients are ones the functions here accept. */
bool dipole_accepts(double sigma_a, double sigma_s_prime);

/* Derive a dipole from the medium.  Returns STATUS_OK, or STATUS_RANGE with
 * *ret untouched.  A: [paper] Eq. 8; z_r, z_v, σtr: around [J01] Eq. 4. */
enum status dipole_init(double sigma_a, double sigma_s_prime, double eta, struct dipole *ret);

/* Profile R_d(r), mm^-2, at n distances r_mm[n]; rd[n] may be r_mm itself.
 * Falls below the smallest double to 0.  Cannot fail.  [J01] Eq. 4. */
void dipole_profile(const struct dipole *d, size_t n, const double *r_mm, double *rd);

/* Share of the reflectance that leaves within distance r_mm[n] of the entry
 * point: 2 pi times the integral of r R_d(r), in closed form; reaches
 * dipole_total() as r grows.  share[n] may be r_mm itself.  Cannot fail. */
void dipole_cumulative(const struct dipole *d, size_t n, const double *r_mm, double *share);

/* Total diffuse reflectance, 0 .. 1, of light that is already inside: the
 * surface integral of R_d(r).  Cannot fail.  [paper] Eq. 9. */
double dipole_total(const struct dipole *d);

/* What does not come back, 1 - dipole_total(), with all its digits however little that
 * is: the subtraction loses them as sigma_a -> 0.  Cannot fail. */
double dipole_absorbed_share(const struct dipole *d);

#endif
