/* layers.h - light in a stack of scattering layers under a surface: the N-stream equations
 * added up from below, exactly for layers of any thickness.
 *
 * Where doubling starts from a layer so thin that 1 - T has lost its digits, here the modes of a
 * layer (optics/modes.h) say at once what it does, as functions of the symmetric matrix A:
 * with -s' = B s at its bottom, at its top
 *     B_top = k tanh(k tau) + E (B^-1 + theta)^-1 E,  E = 1/cosh(k tau), theta = tanh(k tau)/k.
 * B is symmetric and never negative: what the part of the stack below lets in.  An endless layer
 * has B = k, a surface g/mu with g = (1-r)/(1+r).  All of it are sums of positive matrices, so
 * there is nothing to cancel, with absorption or without, from no thickness to 1e100. */
#ifndef SKINSPEC_OPTICS_LAYERS_H
#define SKINSPEC_OPTICS_LAYERS_H

#include "optics/modes.h"

enum { LAYERS_MAX = 8 };

/* One layer while it is worked on; s is the light at its top, t that of the adjoint problem:
 * light that comes the other way, from where the reflectance is looked at. */
struct layer {
    double tau; /* optical thickness; INFINITY: endless */
    struct modes modes;
    double E[STREAMS_MAX], theta[STREAMS_MAX]; /* by mode */
    /* (1 + theta B)^-1, by modes: s at the bottom is this times E times s at the top. */
    double down[STREAMS_MAX * STREAMS_MAX];
    double s_top[STREAMS_MAX], s_bottom[STREAMS_MAX]; /* by mode */
    double t_top[STREAMS_MAX], t_bottom[STREAMS_MAX];
};

struct layers {
    int count; /* 1 .. LAYERS_MAX; only the last may be endless */
    struct layer layer[LAYERS_MAX];
    double s_out[STREAMS_MAX]; /* s at the bottom of all, by direction; 0 of an endless one */
    double scratch[4][STREAMS_MAX * STREAMS_MAX];
};

/* Light at all borders, for light that comes in along the normal, and the adjoint one.  tau and
 * modes of each layer are given.  Under the last layer, if not endless, is the same surface as on
 * top.  Cannot fail. */
void layers_solve(const struct streams *s, struct layers *l);

/* What leaves upwards, per incident light, without the mirror reflection; and downwards. */
double layers_reflectance(const struct streams *s, const struct layers *l);
double layers_transmittance(const struct streams *s, const struct layers *l);

/* dR/da of one layer at the same tau: the integral over its depth of light times adjoint light,
 * each summed over all directions.  INFINITY for an endless layer in which nothing absorbs. */
double layers_slope_albedo(const struct streams *s, const struct layer *layer);

/* Light times adjoint light at a layer's bottom, seen by its modes; R changes by that and by the
 * difference of the albedos where the border to the next layer moves down by dtau. */
double layers_at_bottom(const struct streams *s, const struct layer *layer);

#endif
