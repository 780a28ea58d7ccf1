/* spread.h - what setting the probe down again does to an answer.
 *
 * Each placement sees a slightly other skin: parameter k moves by a standard deviation s_k
 * (struct skin_role), the spectrum by p_k = s_k dR/dx_k.  A fit that answers to a spectrum v by
 * G v, G = (J^T W J + priors)^-1 J^T W over what is free and not at a bound, then moves by G p_k.
 * Sites differ in how much, by a factor f^2 of the variance which is known beforehand as
 * nu/chi^2 of nu degrees (struct fit) and better from the site's own n replicates:
 *     f^2 = (nu + q)/(nu + (n-1) bands - 2),   q = sum of (y - mean)^T C^-1 (y - mean),
 *     C = the noise of one replicate + sum of p_k p_k^T
 * The answer is for the mean of n, so its variance is f^2/n. */
#ifndef SKINSPEC_MATCH_SPREAD_H
#define SKINSPEC_MATCH_SPREAD_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "match/intervals.h"
#include "match/noise.h"

/* Whether any parameter of the fit has a spread. */
bool spread_any(const struct fit *fit);

/* Standard deviation of each parameter's value, 0 where it is held; of one at its bound its
 * own spread.  m: with one group, at its minimum; noise: of one replicate; nm[bands] and
 * spectra[replicates] of the bands of m.  The model takes the skin: it was fitted. */
void spread_find(const struct misfit *m, const struct minimum *at, const struct noise *noise,
                 const double *nm, const struct spectrum *spectra, size_t replicates,
                 double sd[SKIN_PARAMETERS]);

#endif
