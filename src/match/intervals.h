/* intervals.h - how far a parameter can move before the data speak against it.
 *
 * The 95 % interval of a parameter holds the values at which chi^2, minimised over all others
 * inside their bounds, exceeds its minimum by at most 3.841 (profile likelihood: Venzon and
 * Moolgavkar, Applied Statistics 37:87, 1988).  It bends with the model, ends at bounds, and
 * needs no bell curve; value +- 1.96 se fails at bounds and where pigment is dark. */
#ifndef SKINSPEC_MATCH_INTERVALS_H
#define SKINSPEC_MATCH_INTERVALS_H

#include <stdbool.h>
#include <stddef.h>

#include "match/misfit.h"

/* A minimum and its surroundings. */
struct minimum {
    double x[LEAST_SQUARES_MAX];
    struct normal normal;
    double covariance[LEAST_SQUARES_MAX * LEAST_SQUARES_MAX]; /* inverse of the curvature */
};

/* The covariance from the curvature; a direction that the data do not see counts as wide as
 * its bounds are apart. */
void minimum_covariance(const struct misfit *m, struct minimum *at);

/* Standard error of a free parameter (of the mean of its places), at most hi - lo. */
double minimum_se(const struct misfit *m, const struct minimum *at, enum skin_parameter i);

/* Ends of the interval of a free parameter, inside its bounds.  False where on the way a
 * point was met at which chi^2 is lower than at the minimum by more than 0.01: better[] is
 * that point, and the ends are not set. */
bool interval_find(struct misfit *m, const struct minimum *at, enum skin_parameter i, double *lo,
                   double *hi, double *better);

#endif
