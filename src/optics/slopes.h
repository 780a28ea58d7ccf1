/* slopes.h - how the reflectance of a band changes with what a model takes in: the first
 * derivatives of R by the coefficients of that band and by the thickness.
 *
 * All five are always given.  Where a derivative is infinite (by sigma_a of a half space
 * where nothing absorbs: R falls as its square root) it is -INFINITY, and the model's header
 * says so.  Of skins whose coefficients are multiplied and thickness divided by one number
 * R is the same, so for every model
 *     d dR/dd = sum of x dR/dx over the four coefficients, the dermis being without an end. */
#ifndef SKINSPEC_OPTICS_SLOPES_H
#define SKINSPEC_OPTICS_SLOPES_H

#include <stddef.h>

struct slopes {
    double *sigma_a_epidermis, *sigma_a_dermis;             /* [n], mm */
    double *sigma_s_prime_epidermis, *sigma_s_prime_dermis; /* [n], mm */
    double *epidermis_mm; /* [n], mm^-1; 0 where has_thickness is not */
};

/* Doubles of scratch for the slopes of n bands. */
#define SLOPES_SCRATCH(n) (5 * (n))

static inline struct slopes slopes_in(double *scratch, size_t n)
{
    return (struct slopes){ scratch, scratch + n, scratch + 2 * n, scratch + 3 * n,
                            scratch + 4 * n };
}

#endif
