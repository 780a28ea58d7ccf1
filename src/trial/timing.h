/* timing.h - how long a piece of work takes, beside others on a machine that does other things
 * as well: in turns, each piece many times, medians.
 *
 * Groups below 0.1 ms go by the monotonic clock, so short that others seldom come between; longer
 * ones by the thread's own time, which others do not count in: the work waits for nothing. */
#ifndef SKINSPEC_TRIAL_TIMING_H
#define SKINSPEC_TRIAL_TIMING_H

#include <stddef.h>
#include <time.h>

#include "base/status.h"

/* Work on item i; what it does must depend on nothing but that. */
typedef enum status trial_work(const void *context, size_t item);

/* One contestant.  Items are done in groups so long that the clock sees them. */
struct trial_timing {
    trial_work *work;
    const void *context;
    size_t group, groups; /* items are 0 .. group * groups - 1 */
    clockid_t clock;
    size_t rounds, done;
    double *us; /* [groups][rounds] an item */
};

/* A first look at the work decides how many of `items` items a round of about budget_us takes.
 * STATUS_NO_MEMORY; statuses of the work. */
enum status trial_timing_init(trial_work *work, const void *context, size_t items, size_t rounds,
                              double budget_us, struct trial_timing *ret);
void trial_timing_done(struct trial_timing *timing); /* takes a zeroed one */

/* One round; at most `rounds` of them.  The first is not warm: do one more and forget it. */
enum status trial_timing_round(struct trial_timing *timing);

/* Forget what was measured. */
void trial_timing_again(struct trial_timing *timing);

/* Of each group the median of its rounds; of those the median and the 95th percentile. */
void trial_timing_result(const struct trial_timing *timing, double *us, double *us_p95);

#endif
