/* estimate.h - how long a way takes and how wrong it is, for the scene at hand: an inner part of
 * plan/plan.h.
 *
 * Costs (plan/costs.h) were measured under one noise, on 31 bands, with k 1 and nothing held.
 * Where the scene says so too they are taken as they are.  Elsewhere each part of an error goes by
 * what it depends on; f is the figure measured, S and M what plan/rehearsal.h says of the scene's
 * conditions and of the measured ones:
 *   a fit, closed form  f S/M                              by its own model's skins
 *   rows by spectrum    sqrt(grid^2 + (fit S/M)^2)         grid^2 = f^2 - fit^2; S of a fit that
 *                                                          takes all noise for white, as rows do
 *   rows by colour      the same with a fit of the colour  fit: M
 *   any model           sqrt(own^2 + (f^2 - f_own^2) t^2)  f, t = S/M by skins of transport, t
 *                                                          without noise
 *   dE00, rms           sqrt((f^2 - M^2) t^2 + S^2)
 * What cannot be rehearsed has no error then: NAN.  A model other than two-layer and half-space is
 * rehearsed by two-layer.  Times:
 *   k rows              the search times 1 + c (k - 1), c as measured of the search
 *   a scan              rows times ESTIMATE_SCAN_US, where the bands lack one of the table's
 *   a fit               times a + (1 - a) bands/31, S/M of evaluations, and what placement costs
 * docs/decisions/0018 says why, and how near to the truth that comes. */
#ifndef SKINSPEC_PLAN_ESTIMATE_H
#define SKINSPEC_PLAN_ESTIMATE_H

#include "plan/plan_choice.h"

/* A row looked at where no index helps, whatever the bands: 0.009 to 0.015 measured; Intel Xeon
 * (family 6, model 207), gcc 12.2. */
#define ESTIMATE_SCAN_US 0.011

/* Fits that do not end in more cases than this are none to choose. */
#define ESTIMATE_UNFINISHED 0.01

/* way->cost, way->expected and way->unfinished from the rest of it; what is not known is NAN.
 * STATUS_NO_MEMORY. */
enum status estimate_way(const struct choice *choice, struct way *way);

#endif
