/* chromophores.h - what absorbs and scatters light in skin, per nm.
 * [paper] Moon, Lee, Chin, Physiological Parameters for Skin Rendering Using
 * Spectrophotometer, Eqs. 1-3 and 6.  [PRAHL] S. Prahl's compilation of molar
 * extinction of haemoglobin (data of W. B. Gratzer and N. Kollias).
 *
 * All coefficients are mm^-1 of the pure substance; a tissue holds a fraction
 * of it (optics/tissue.h).  Whole blood: 150 g haemoglobin per litre, 64 500
 * g/mol.  Wavelengths 250..1000 nm, where the haemoglobin table reaches. */
#ifndef SKINSPEC_OPTICS_CHROMOPHORES_H
#define SKINSPEC_OPTICS_CHROMOPHORES_H

#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"

#define CHROMOPHORES_MIN_NM 250.0
#define CHROMOPHORES_MAX_NM 1000.0
#define CHROMOPHORES_LOG_NM 500.0

double eumelanin_sigma_a(double nm);   /* [paper] Eq. 2 */
double pheomelanin_sigma_a(double nm); /* [paper] Eq. 1 */
double base_sigma_a(double nm);        /* [paper] Eq. 3: tissue without pigment and blood */
double skin_sigma_s_prime(double nm);  /* [paper] Eq. 6: Mie and Rayleigh part */

/* Molar extinction, cm^-1/M, linear between the table's 2 nm points; NAN
 * outside the table. */
double oxyhaemoglobin_epsilon(double nm);
double deoxyhaemoglobin_epsilon(double nm);

/* Whole blood: 2.303 epsilon 150 / 64500, cm^-1 to mm^-1. */
double oxyhaemoglobin_sigma_a(double nm);
double deoxyhaemoglobin_sigma_a(double nm);

/* The same on a band grid, computed once and used for many skins.  After the last band its
 * values stand again, up to a multiple of CHROMOPHORES_LANES: vectors read past the end. */
#define CHROMOPHORES_LANES 8
struct chromophores {
    double eumelanin[SPECTRUM_MAX_BANDS], pheomelanin[SPECTRUM_MAX_BANDS];
    double base[SPECTRUM_MAX_BANDS];
    double oxy[SPECTRUM_MAX_BANDS], deoxy[SPECTRUM_MAX_BANDS];
    double sigma_s_prime[SPECTRUM_MAX_BANDS];
    double log_nm[SPECTRUM_MAX_BANDS]; /* ln(l / CHROMOPHORES_LOG_NM), for power laws */
    size_t n;                          /* bands; last, so that the rows lie as the struct does */
};

/* STATUS_RANGE where a band lies outside 250..1000 nm, n is 0 or too large, or
 * step_nm is not above 0. */
enum status chromophores_init(double first_nm, double step_nm, size_t n, struct chromophores *ret);

#endif
