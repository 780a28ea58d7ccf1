/* streams.h - the directions in which the transport models let light travel, and the surface
 * seen from inside in each of them.
 *
 * N streams are N directions of the downward hemisphere and their mirror images.  Where
 * eta > 1 half of them are Gauss points of [0, mu_c] and half Radau points of [mu_c, 1],
 * mu_c = sqrt(1 - 1/eta^2) being the cosine of total reflection: the kink of Fresnel's curve
 * lies between the halves, and the last direction is the normal (Prahl, van Gemert, Welch,
 * Appl. Opt. 32, 559, 1993).  Where eta <= 1 nothing is totally reflected inside: Radau points
 * of [0, 1]. */
#ifndef SKINSPEC_OPTICS_STREAMS_H
#define SKINSPEC_OPTICS_STREAMS_H

#include "base/status.h"

enum { STREAMS_MAX = 64 };

struct streams {
    int n;
    double eta;
    double mu[STREAMS_MAX];     /* cosines, rising; mu[n-1] = 1 */
    double w[STREAMS_MAX];      /* weights; their sum is 1 */
    double inside[STREAMS_MAX]; /* Fresnel's reflectance from inside, 0 .. 1 */
    double entering;            /* 1 - Rs: what comes in of light along the normal */
};

/* n a multiple of 4, 4 .. STREAMS_MAX; eta within the limits of optics/dipole.h, so that every
 * model takes the same skins.  STATUS_RANGE else, with *ret untouched. */
enum status streams_init(int n, double eta, struct streams *ret);

#endif
