/* flow.h - pieces of work taken one after the other, done on several cores, and given away in the
 * order they were taken.
 *
 * Unlike base/parallel, where all pieces are there from the start: here they come from an input
 * and go to an output, so that neither waits for the other and memory holds but a few of them.
 * No thread is set apart for input or output: each takes what is next to be done, so one thread
 * does all of it on one core. */
#ifndef SKINSPEC_BASE_FLOW_H
#define SKINSPEC_BASE_FLOW_H

#include <stddef.h>

#include "base/status.h"

struct flow {
    /* The next piece into a slot.  One call at a time, in order.  STATUS_NOT_FOUND at the end. */
    enum status (*take)(void *context, size_t slot);
    /* On any thread; worker: 0 .. threads-1, for scratch memory of its own. */
    void (*work)(void *context, size_t slot, unsigned worker);
    /* One call at a time, in the order they were taken; the slot is then free. */
    enum status (*give)(void *context, size_t slot);
    /* A take() that waits is to come back: nothing more will be given. */
    void (*stop)(void *context);
    void *context;
};

/* Slots that so many threads use. */
size_t flow_slots(unsigned threads);

/* Run it on at most `threads` threads (the calling one among them, PARALLEL_MAX_THREADS at most)
 * and wait.  What was taken when take() fails is still worked on and given; after a give() that
 * failed nothing is given any more.  Returns the status of the give() that failed, else that of
 * take() which ended it: STATUS_NOT_FOUND, where all went well.  Where threads cannot be started
 * the work is done by those that could. */
enum status flow_run(const struct flow *flow, unsigned threads);

#endif
