/* check_fit.h - may an instrument be judged by these shots of a check tile?
 *
 * A record is kept with its warnings beside it, and whoever reads it sees them.  Of a check there
 * is left whether it passed, and of a reference the mean: so neither is made of shots that say by
 * themselves, or one against the other, that something was wrong with them. */
#ifndef SKINSPEC_STATION_CHECK_FIT_H
#define SKINSPEC_STATION_CHECK_FIT_H

#include "station/measuring.h"

/* All shots of m are there, and *set is quality_of_set() of them.  False with *refusal
 * (check_unfit), which names what was found by its token and says what to do: a quality flag of a
 * shot (sci_below_sce); outlier, spread (QUALITY_OUTLIER_RMS, QUALITY_SPREAD_RMS: what skin does,
 * and a tile by far not); any warning of the instrument but battery_low, with which it
 * measures as it does without.  One shot has no spread. */
bool check_fit(const struct measuring *m, const struct quality_set *set, struct refusal *refusal);

#endif
