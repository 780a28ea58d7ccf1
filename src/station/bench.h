/* bench.h - one instrument as the station sees it: what it is, who holds it, whether its
 * calibration is good, and the measurement that runs on it.
 *
 * The thread that talks to it is behind unit.h; leases and their queue are state of
 * lease.h; a measurement is run.h. */
#ifndef SKINSPEC_STATION_BENCH_H
#define SKINSPEC_STATION_BENCH_H

#include "station/calibration.h"
#include "station/lease.h"
#include "station/station.h"
#include "station/unit.h"

struct run;

struct bench {
    struct station *station;
    char name[64];
    const struct driver *driver;
    struct unit *unit;

    bool known; /* it was opened once: identity and setup are set */
    bool open;
    struct driver_identity identity;
    struct driver_setup setup;
    struct driver_status status;
    struct driver_error error; /* why it is not open; text "" while it is tried first */
    uint64_t connection;

    struct lease lease;
    char lease_name[CLIENTS_LEASE_SIZE]; /* of the holder; "" */
    sd_event_source *lease_timer;
    struct ticket waiting[LEASE_QUEUE_MAX]; /* the acquire of each in the queue, by place */

    struct calibration_made made[CALIBRATION_STEPS];
    char calibration_id[CALIBRATION_STEPS][STORE_UUID_SIZE];
    char calibrated_at[CALIBRATION_STEPS][STORE_TIME_SIZE];
    bool was_due[CALIBRATION_STEPS]; /* as told by events */
    bool at_work;                    /* calibrating or being configured */
    const char *told_state;          /* by events */
    struct run *run;                 /* NULL: none */
};

/* text: "DRIVER[:ADDRESS]".  Starts its thread. */
enum status bench_open(struct station *station, const char *text, struct bench **ret);
/* End its thread; false: it had not ended after that time (0: it is only told to). */
bool bench_stop(struct bench *bench, int patience_ms);
void bench_close(struct bench *bench);

struct bench *bench_find(struct station *station, const char *name);

/* ---- how it stands ------------------------------------------------------------------ */

cJSON *bench_json(struct bench *bench);
cJSON *bench_list_json(struct station *station);
struct calibration_state bench_calibration(const struct bench *bench);
cJSON *bench_calibration_json(const struct bench *bench);

/* The grid it is set to, and its aperture; no values. */
struct spectrum bench_bands(const struct bench *bench);

/* {"instrument":NAME}: how the data of events about it begin. */
cJSON *bench_named(const struct bench *bench);

/* Tell by events what has changed: state, a calibration that is due. */
void bench_tell_changes(struct bench *bench);

/* False with *refusal where it is not there, or at work already. */
bool bench_is_free(const struct bench *bench, struct refusal *refusal);

/* Whether what runs on it has been ended, or is a former holder's last shot, and is only
 * being waited for: a new holder's request is parked until then. */
bool bench_is_ending(const struct bench *bench);
struct refusal bench_refusal(const struct driver_error *error);

/* Ask the store for the calibrations of earlier runs (bench_recall.c).  Nothing is asked
 * while the instrument is not known. */
void bench_recall(struct bench *bench);
void bench_forget_calibrations(struct bench *bench); /* the store has no such rows any more */

/* As the records name it. */
struct store_instrument bench_instrument(const struct bench *bench);

/* ---- leases (bench_lease.c) --------------------------------------------------------- */

/* The bench whose lease the request's params name, renewed by this use; else NULL with
 * *refusal. */
struct bench *bench_of_lease(struct station *station, struct client *client,
                             const struct request *request, struct refusal *refusal);

/* The client has gone, or has closed its session. */
void bench_leave_all(struct station *station, struct client *client);
void bench_send_queue_away(struct bench *bench); /* shutting_down */
enum status bench_lease_init(struct bench *bench);

#endif
