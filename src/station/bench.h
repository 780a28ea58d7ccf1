/* bench.h - one instrument as the station sees it: what it is, who holds it, whether its
 * calibration is good, and the measurement that runs on it.
 *
 * The thread that talks to it is behind unit.h; leases and their queue are state of
 * lease.h; a measurement is run.h. */
#ifndef SKINSPEC_STATION_BENCH_H
#define SKINSPEC_STATION_BENCH_H

#include "station/calibration.h"
#include "station/checks.h"
#include "station/lease.h"
#include "station/station.h"
#include "station/ticket.h"
#include "station/unit.h"

struct run;

enum { BENCH_NAME_SIZE = 64 };

struct bench {
    struct station *station;
    char name[BENCH_NAME_SIZE]; /* "": no bench, a place for one */
    const struct driver *driver;
    struct unit *unit;       /* of its seat; NULL while it has none */
    struct capture *capture; /* what its last seat's unit is recorded to; NULL: it is not */

    bool known;       /* it was opened once: identity and setup are set */
    bool provisional; /* it is there to show why something does not open */
    bool open;
    struct driver_identity identity;
    struct driver_setup setup;
    struct driver_status status;
    struct driver_error error;        /* why it is not open; text "" while it is tried first */
    uint64_t connection, connections; /* the present one; as many as there were */
    uint64_t connections_before;      /* by other units than this one */

    struct lease lease;
    char lease_name[CLIENTS_LEASE_SIZE]; /* of the holder; "" */
    sd_event_source *lease_timer;
    struct ticket waiting[LEASE_QUEUE_MAX]; /* the acquire of each in the queue, by place */

    struct calibration_made made[CALIBRATION_STEPS];
    char calibration_id[CALIBRATION_STEPS][STORE_UUID_SIZE];
    char calibrated_at[CALIBRATION_STEPS][STORE_TIME_SIZE];
    struct checks checks;
    unsigned recalls;                /* of calibrations and checks, that are under way */
    bool was_due[CALIBRATION_STEPS]; /* as told by events */
    bool at_work;                    /* calibrating, measuring a check tile or being configured */
    const char *told_state;          /* by events */
    bool restoring;                  /* its unit is being set as `was`, its setup before (seat.c) */
    struct driver_setup was;
    struct run *run; /* NULL: none */
};

/* One more, without a unit.  STATUS_FULL: there are SETTINGS_MAX_INSTRUMENTS (logged). */
enum status bench_make(struct station *station, const struct driver *driver, const char *name,
                       struct bench **ret);
void bench_forget(struct bench *bench); /* a provisional one: it is gone, and told so */
void bench_close(struct bench *bench);

struct bench *bench_find(struct station *station, const char *name);

/* ---- what its unit tells (through seat.c) ------------------------------------------- */

void bench_opened(struct bench *bench, const struct driver_identity *identity,
                  const struct driver_status *status, uint64_t connection);
void bench_lost(struct bench *bench, const struct driver_error *error);
void bench_pressed(struct bench *bench);
void bench_status_changed(struct bench *bench, const struct driver_status *status);

/* ---- what its unit is asked --------------------------------------------------------- */

/* As unit_ask() and unit_cancel(), also while it has none: the job comes back, gone. */
void bench_ask(struct bench *bench, struct unit_job *job);
void bench_cancel(struct bench *bench);

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

/* Something runs on it, or it is being set as it was. */
bool bench_is_at_work(const struct bench *bench);

/* False with *refusal where it is not there, or at work already. */
bool bench_is_free(const struct bench *bench, struct refusal *refusal);

/* Whether what runs on it has been ended, or is a former holder's last shot, and is only
 * being waited for: a new holder's request is parked until then. */
bool bench_is_ending(const struct bench *bench);
struct refusal bench_refusal(const struct driver_error *error);

/* Whether checks say so of the port that is set: its records carry the flag then. */
bool bench_drift(const struct bench *bench);
void bench_note_check(struct bench *bench, struct checked *checked); /* given away; told */

/* Ask the store for the calibrations and checks of earlier runs (bench_recall.c).  Nothing is
 * asked while the instrument is not known.  Until all answers are there, a measurement waits:
 * it might lack a flag. */
void bench_recall(struct bench *bench);
/* And checks: the store has no such rows any more, or it is another unit. */
void bench_forget_calibrations(struct bench *bench);

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
