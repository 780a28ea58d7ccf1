/* box_lanes.h - steps of sixteen fits of three parameters, side by side.
 *
 * The quadratic's least inside a box, as least_squares_step() finds it for one fit; and, for fits
 * that steps of Gauss and Newton lead slowly, what those leave out of the curvature.
 * [D81] Dennis, Gay and Welsch, An Adaptive Nonlinear Least-Squares Algorithm, 1981. */
#ifndef SKINSPEC_MATCH_BOX_LANES_H
#define SKINSPEC_MATCH_BOX_LANES_H

#include "optics/quick.h"

enum { BOX_LANES = 16, BOX_PARAMETERS = 3, BOX_TRIANGLE = 6 };

struct box_lanes {
    double x[BOX_PARAMETERS][BOX_LANES]; /* inside the box */
    /* There, of chi^2, as struct normal of match/least_squares.h has them. */
    double gradient[BOX_PARAMETERS][BOX_LANES], curvature[BOX_TRIANGLE][BOX_LANES];
    double step[BOX_PARAMETERS][BOX_LANES], gain[BOX_LANES]; /* of chi^2 by the step */
};

/* step and gain of all lanes, each by itself; lo < hi.  A parameter rests on its bound where
 * letting it go would lower chi^2 by less than 1e-12. Without fused operations: the same bits by
 * any vectors. */
void box_lanes_step(enum quick_vectors v, const double lo[BOX_PARAMETERS],
                    const double hi[BOX_PARAMETERS], struct box_lanes *lanes);

/* Where a fit was, the curvature that was known there, and what its steps have told of the
 * residuals' own so far: at first nothing, 0. */
struct box_secant {
    double x[BOX_PARAMETERS][BOX_LANES], gradient[BOX_PARAMETERS][BOX_LANES];
    double curvature[BOX_TRIANGLE][BOX_LANES], more[BOX_TRIANGLE][BOX_LANES];
};

/* The way from there to where the lanes are now tells more of it ([D81], by the symmetric update of
 * rank 1), if the curvature known changed along it by no more than the share `steady` of the sum of
 * both.  It is added to the lanes' curvature, and forgotten where the sum is not that of a minimum;
 * of a parameter that rests nothing is told.  *secant is then where the lanes are. */
void box_lanes_bend(enum quick_vectors v, double steady, struct box_secant *secant,
                    struct box_lanes *lanes);

#endif
