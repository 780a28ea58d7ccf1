/* least_squares.h - the least sum of squares inside a box, by Gauss-Newton steps with
 * Levenberg's and Marquardt's damping where they fail.
 *
 * Each step is the exact minimum of the quadratic model inside the box (an active-set
 * method), so that parameters come to rest on their bounds and leave them again.  chi^2
 * never rises.  No allocation; the same answer for the same input; a point at which chi^2 or
 * a derivative is not finite counts as worse than any other. */
#ifndef SKINSPEC_MATCH_LEAST_SQUARES_H
#define SKINSPEC_MATCH_LEAST_SQUARES_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

enum { LEAST_SQUARES_MAX = 40 };

/* chi^2 = |r|^2 at a point, and what Gauss-Newton needs: with J = dr/dx
 *     gradient = J^T r  (half of dchi^2/dx),   curvature = J^T J,
 * the lower triangle row by row: element (i, j <= i) at i (i + 1) / 2 + j. */
struct normal {
    double chi_square;
    double gradient[LEAST_SQUARES_MAX];
    double curvature[LEAST_SQUARES_MAX * (LEAST_SQUARES_MAX + 1) / 2];
};

struct least_squares {
    size_t n;              /* 1 .. LEAST_SQUARES_MAX */
    const double *lo, *hi; /* lo <= hi, finite; equal where a parameter is held */
    void (*evaluate)(void *context, const double *x, struct normal *ret);
    void *context;
    double tolerance; /* ends where a step would lower chi^2 by less (or by 1e-10 of itself) */
    /* A whole step that promises to lower chi^2 by less than this is taken without a look at
     * where it leads, the fit ends there, and *at holds the quadratic's chi^2 and the curvature
     * of the point before; 0: every step is looked at.  After a step of gain g such a one
     * misses the minimum by a small part of g. */
    double unseen;
    /* What the step to x, which somebody else took, promised to take off chi^2; 0: none did.  A
     * first step from x that promises less than a hundredth of it may be taken unseen too. */
    double promised;
    size_t steps; /* at most so many */
};

struct least_squares_run {
    bool converged; /* false: the step limit was reached */
    /* By how much chi^2 could still fall after a last step that was not looked at, if the steps
     * after it shrank only as much as it has; INFINITY where the last step was looked at. */
    double left;
    size_t iterations, evaluations;
};

/* From x[n], clamped into the box, to the minimum; *at is what evaluate() gave there (but see
 * unseen). STATUS_RANGE with x clamped where chi^2 at the start is not finite. */
enum status least_squares_run(const struct least_squares *problem, double *x, struct normal *at,
                              struct least_squares_run *run);

/* From x inside the box to the exact minimum there of the quadratic that has this gradient and
 * curvature at x; by how much it falls. */
double least_squares_step(size_t n, const double *lo, const double *hi, const struct normal *normal,
                          double *x);

/* The inverse of a curvature into inverse[n][n], as a table of n * n.  Directions that the
 * data do not see at all (pivot lost to rounding) get the variance `unseen`[i] on their
 * diagonal and no covariance. */
void normal_covariance(const struct normal *normal, size_t n, const double *unseen,
                       double *inverse);

#endif
