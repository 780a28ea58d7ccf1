/* noise.h - how far a replicate's bands stray from the skin's own spectrum, and together.
 *
 *   C = white^2 I + placement^2 (level level^T + slope_ratio^2 slope slope^T)
 *
 *   white        the instrument's own, each band for itself: standard deviation of R
 *   placement    the probe set down again: all bands together; size of R
 *   slope_ratio  size of the slope beside that of the level
 *   level        1 at all bands
 *   slope        straight in wavelength, 0 at 550 nm, mean square 1 over 400..700 nm
 * Placement is one replicate's: of n replicates the mean strays by 1/sqrt(n) of it.  As C is
 * a multiple of 1 but for two directions, whitening costs two dot products (Woodbury's
 * identity, written for the square root, which does not cancel). */
#ifndef SKINSPEC_MATCH_NOISE_H
#define SKINSPEC_MATCH_NOISE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"

struct noise {
    double white;       /* 1e-9 .. 1 */
    double placement;   /* 0 .. 1 */
    double slope_ratio; /* 0 .. 100 */
};

#define NOISE_WHITE_MIN 1e-9

/* White noise alone. */
struct noise noise_white(double white);

/* What sets three placements of a probe on one forearm apart, as far as a level and a slope
 * tell: the most likely sizes for 50 of 100 people (Cooksey, Allen, Tsai, J. Res. NIST 122:26,
 * 2017); the same within 10 % for the others.  White is then what blood and melanin change as
 * well; match/skin_fit.h, whose parameters follow them, has less. */
struct noise noise_default(void);
#define NOISE_DEFAULT_WHITE 0.0038
#define NOISE_DEFAULT_PLACEMENT 0.0090
#define NOISE_DEFAULT_SLOPE_RATIO 0.47

/* STATUS_RANGE where a member is outside its range or not finite; *why (may be NULL) then
 * says which, in a constant sentence without full stop. */
enum status noise_check(const struct noise *noise, const char **why);

/* Placement from the replicates of one site, shrunk to the population's: the variance seen
 * with 2 (n-1) degrees of freedom (level, and slope / slope_ratio) is averaged with
 * population->placement^2, which counts NOISE_POPULATION_DEGREES; the share that white noise
 * explains is taken off first.  n = 1 gives the population's.  The replicates share one band
 * grid; bands that one of them lacks are left out.  STATUS_RANGE for n = 0, other grids, or
 * fewer than 2 bands that all have (apart in wavelength); as noise_check() for the population. */
#define NOISE_POPULATION_DEGREES 8.0 /* foretells a third placement best: 6 to 20 do */
enum status noise_from_replicates(const struct noise *population, const struct spectrum *replicate,
                                  size_t n, struct noise *ret);

/* C^-1/2 on a set of bands, made once for many vectors. */
enum { NOISE_RANK = 2 };
struct whitener {
    size_t n, rank;
    double white2;                 /* white^2 over the number of replicates */
    double keep[NOISE_RANK];       /* white/sqrt(white^2 + variance along the direction) */
    double shrink[NOISE_RANK];     /* 1 - keep */
    bool faint;                    /* so little is kept of one that it takes more care */
    double *direction[NOISE_RANK]; /* orthonormal, [n] each, in the caller's scratch */
};
#define WHITENER_SCRATCH(n) (NOISE_RANK * (n))

/* For n bands at wavelengths nm[n], of the mean of `replicates` replicates; a noise that
 * noise_check() takes.  weight[n]: 1, or 0 where a band was not measured; vectors to be
 * whitened are 0 there. */
void whitener_init(const struct noise *noise, size_t replicates, const double *nm,
                   const double *weight, size_t n, double *scratch, struct whitener *ret);

/* v[n] becomes white C^-1/2 v: products of such vectors are still to be divided by white2. */
void whitener_apply(const struct whitener *w, double *v);

/* And back. */
void whitener_undo(const struct whitener *w, double *v);

#endif
