/* unit.h - one instrument and the thread that owns it.
 *
 * The thread opens the instrument, and opens it again when it is gone (waiting 200 ms at
 * first, twice as long after each failure, 5 s at most), does what the loop asks for, one
 * job after the other, and in between watches the button and asks for the status: every
 * UNIT_STATUS_MS, but UNIT_SOON_MS after a shot or a failed step and while the flash charges.
 * After a UNIT_WAIT that was pressed it leaves the instrument alone until the next job has fetched
 * the reading of that press, DRIVER_PRESS_FRESH_MS at most: a new wait would give it up.
 * Everything it has to say comes back on the loop's thread. */
#ifndef SKINSPEC_STATION_UNIT_H
#define SKINSPEC_STATION_UNIT_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/driver.h"
#include "station/job.h"

enum { UNIT_STATUS_MS = 30000, UNIT_SOON_MS = 1000 };

enum unit_command {
    UNIT_CONFIGURE, /* setup in; status out */
    UNIT_STATUS,    /* status out */
    UNIT_CALIBRATE, /* step in; status out */
    UNIT_MEASURE,   /* reading out, at once; the status follows as an event */
    UNIT_WAIT,      /* for the button, up to timeout_ms; pressed out.  Presses from before do
                       not count.  Without a button: until cancelled or time is up */
};

struct unit_job {
    struct job job; /* done() is the caller's; run() is not used */
    enum unit_command command;
    struct driver_setup setup;
    enum driver_calibration step;
    int timeout_ms;
    /* out */
    enum driver_result result; /* DRIVER_GONE, with the last error, while it is not open */
    struct driver_error error; /* where result is not DRIVER_OK; its own result is the cause */
    struct driver_status status;
    bool status_known; /* false where the step was done, but no status could be had */
    struct driver_reading reading;
    bool pressed;
    uint64_t connection; /* it was done over; 0: not done */
    void *context;       /* the caller's */
};

/* On the loop's thread, whenever it happens.  No pointer outlives the call. */
struct unit_events {
    /* Opened; the first connection is 1.  A setup that was configured before is set again
     * first (where that fails the instrument counts as lost). */
    void (*opened)(void *context, const struct driver_identity *identity,
                   const struct driver_status *status, uint64_t connection);
    /* It is gone, or cannot be opened: told once for each cause, not for each attempt. */
    void (*lost)(void *context, const struct driver_error *error);
    /* Pressed while no UNIT_WAIT was under way. */
    void (*button)(void *context);
    /* The status that was asked for in between; only where it differs in due[], charging or
     * by 1 in battery_percent from the last one told. */
    void (*status)(void *context, const struct driver_status *status);
    void *context;
};

struct unit;

/* Start the thread.  Options and events are copied.  STATUS_NO_MEMORY, STATUS_IO. */
enum status unit_open(const struct driver *driver, const struct driver_options *options,
                      struct inbox *inbox, const struct unit_events *events, struct unit **ret);

/* Jobs are done in order; each comes back through the inbox, whatever happens: while the
 * instrument is not open, or the unit is being closed, at once.  From any thread. */
void unit_ask(struct unit *unit, struct unit_job *job);

/* Every job that was asked and has not come back ends with DRIVER_CANCELLED, unless its
 * answer is there already: the one under way, those that wait, and the one in between, of
 * which the caller cannot know.  One asked later is not touched.  A driver's call that begins at
 * this very instant may miss it, but for a wait: it is then done to its end.  From any
 * thread. */
void unit_cancel(struct unit *unit);

/* Where it waits before it opens the instrument again: do it now.  From any thread. */
void unit_try_now(struct unit *unit);

/* Cancel, finish what is asked (DRIVER_CANCELLED), close the instrument, end the thread.
 * False where the thread was still stuck after patience_ms: unit and inbox must stay, jobs are
 * refused, and it may be tried again.  Takes NULL.  Events and jobs may be drained afterwards. */
bool unit_close(struct unit *unit, int patience_ms);

#endif
