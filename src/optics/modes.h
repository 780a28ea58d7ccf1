/* modes.h - how scattered light dies away with depth: the eigen-solution of the N-stream
 * equations in one layer.
 *
 * With isotropic scattering, albedo a and optical depth t the equations
 *     +-mu_i dI_i/dt = -I_i + a/2 sum_j w_j (I_j+ + I_j-)
 * are, for s_i = sqrt(w_i) mu_i (I_i+ + I_i-),
 *     s'' = A s,   A = diag(1/mu_i^2) - a u u^T,   u_i = sqrt(w_i)/mu_i,
 * and sqrt(w_i) (I_i+ - I_i-) = -s_i'.  A is diagonal but for one term of rank one: its
 * eigenvalues k^2 are the roots of 1 = a sum w_i/(1 - k^2 mu_i^2) (Chandrasekhar, Radiative
 * Transfer, 1950), one below each pole 1/mu_i^2, and its eigenvectors follow from them
 * (Golub, Some modified matrix eigenvalue problems, 1973).  Distances from the poles are found to
 * full relative accuracy, so a may be as small as 1e-200, and as near to 1 as one likes. */
#ifndef SKINSPEC_OPTICS_MODES_H
#define SKINSPEC_OPTICS_MODES_H

#include "optics/streams.h"

struct modes {
    double albedo;
    double k[STREAMS_MAX];   /* falling with m; k[n-1], the slowest, is 0 where albedo is 1 */
    double hat[STREAMS_MAX]; /* u^T of eigenvector m: what a mode adds to the light at a point,
                              * sum_j w_j (I_j+ + I_j-) */
    double V[STREAMS_MAX * STREAMS_MAX]; /* n rows of n: direction i, mode m; orthogonal */
};

/* albedo above 0, up to 1; absorbed = 1 - albedo, given apart because the difference has no
 * digits near 1. */
void modes_init(const struct streams *s, double albedo, double absorbed, struct modes *ret);

#endif
