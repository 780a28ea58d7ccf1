/* run.h - a measurement on its way from measure.start to the record.
 *
 *   SHOOTING -> (WAITING -> SHOOTING)* -> MATCHING -> STORING -> answered
 *
 * It ends early by measure.cancel, and while shots are being taken also by the lease's release
 * or when the holder goes: then nothing is stored.  A lease that expires during a shot ends it
 * after that shot, and what was taken is stored, flagged lease_expired, without being delivered as
 * the answer: a request with the same uuid gets it. */
#ifndef SKINSPEC_STATION_RUN_H
#define SKINSPEC_STATION_RUN_H

#include "plan/scene.h"
#include "station/bench.h"
#include "station/measuring.h"
#include "station/ticket.h"

enum { RUN_ASKERS = 8 };
enum run_phase { RUN_SHOOTING, RUN_WAITING, RUN_MATCHING, RUN_STORING };
enum run_cause { RUN_ASKED, RUN_RELEASED, RUN_EXPIRED, RUN_DISCONNECTED, RUN_STOPPING };

struct run {
    union { /* one at a time */
        struct job job;
        struct unit_job unit;
        struct write_job write;
    };
    struct bench *bench;
    enum run_phase phase;
    bool under_way; /* the job above is with a thread */
    bool ended;     /* nothing is to be stored; told when the job is back */
    enum run_cause cause;
    bool expired;   /* the lease did, during a shot */
    bool next;      /* the shot that waits was asked for */
    bool no_button; /* it failed: only measure.next takes the next shot */
    struct driver_error error;

    struct ticket askers[RUN_ASKERS]; /* measure.start, and its retries */
    size_t askers_n;
    struct ticket canceller;
    bool has_canceller;

    struct measuring measuring;
    struct store_record *record; /* what is known of it so far */
    char table[TABLE_NAME_SIZE]; /* "": the default one */
    bool has_by;
    enum match_by by;
    struct refine_wish wish;
    bool has_scene; /* then by and wish are not looked at */
    struct scene scene;
    struct loaded_table *loaded;
};

/* From a checked request, on a bench that is free; sha256: of its parameters.  The first
 * shot begins.  NULL: no memory. */
struct run *run_begin(struct bench *bench, const struct client *client,
                      const struct request *request, const char *sha256);

/* Another request for the same.  False: too many. */
bool run_join(struct run *run, const struct ticket *asker);

/* Take the shot that waits. */
void run_next(struct run *run);

/* End what runs on the bench under the lease of this fence, if anything does: a later
 * holder has no say in it. */
void run_end(struct bench *bench, int64_t fence, enum run_cause cause);

void run_table_changed(struct bench *bench); /* a load has ended */

/* Whether the calibration is good, or due so that the policy `warn` measures all the same; false
 * with *refusal. */
bool run_is_calibrated(const struct bench *bench, struct refusal *refusal);

#endif
