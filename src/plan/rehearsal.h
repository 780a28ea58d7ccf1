/* rehearsal.h - a fit tried on a few skins under a scene's own conditions: how far off it is, how
 * many steps it takes, and whether it ends at all.
 *
 * What costs (plan/costs.h) say was measured under one noise, on 31 bands, with nothing held.
 * Under other conditions the planner takes that figure times what a rehearsal says of the scene
 * over what it says of the measured conditions: the same skins, the same draws of noise. */
#ifndef SKINSPEC_PLAN_REHEARSAL_H
#define SKINSPEC_PLAN_REHEARSAL_H

#include <stddef.h>

#include "base/status.h"
#include "match/fit.h"
#include "match/noise.h"
#include "plan/scene.h"

struct rehearsal {
    struct fit fit;     /* by two-layer, half-space, or another model with derivatives */
    struct noise noise; /* that the spectra have */
    struct noise told;  /* that the fit weighs by */
    double first_nm, step_nm;
    size_t bands;
    struct scene_range range[3]; /* of the skins' Cm, Bm, Ch; lo = hi: all have it */
    bool closed_form;            /* nothing is fitted: match/start.h is the answer */
    bool colour;     /* nothing is fitted but the colour of the bands, as a row by colour does it */
    bool transport;  /* skins are what transport-8 says, on REHEARSAL_FEW of them; else what the
                      * fit's model says */
    bool from_there; /* the fit begins at the skin itself, as from a row near it; else without
                      * a start, from the closed form */
};

/* Skins as plan/costs.h has them, as far as they are in the range, spread evenly over it; but more
 * of the lightest and the darkest quarter, where errors vary most, which count less for it. */
enum { REHEARSAL_SKINS = 384, REHEARSAL_FEW = 48 };

struct rehearsed {
    double rmse[3]; /* of Cm, Bm, Ch */
    /* The skin found - the skin that was there: means over skins; colours of the 31 bands of
     * plan/costs.h, rms of the scene's. */
    double dE00, rms_R;
    double evaluations; /* of the model, mean */
    double unfinished;  /* share of fits that did not end: REFINE_NOT_CONVERGED */
};

/* The same for the same conditions, which are remembered: asked again it takes next to nothing.
 * Any thread may call.  STATUS_NO_MEMORY; statuses of refiner_open() and refiner_run(). */
enum status rehearse(const struct rehearsal *conditions, struct rehearsed *ret);

#endif
