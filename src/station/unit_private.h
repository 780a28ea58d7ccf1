/* unit_private.h - what the files of unit share, and nobody else includes: unit.c opens,
 * loses and is called, unit_work.c serves, unit_tell.c tells the loop. */
#ifndef SKINSPEC_STATION_UNIT_PRIVATE_H
#define SKINSPEC_STATION_UNIT_PRIVATE_H

#include "station/unit.h"

struct unit {
    const struct driver *driver;
    struct driver_options options;
    char *address;
    struct inbox *inbox;
    struct unit_events events;
    pthread_t thread;

    pthread_mutex_t lock;          /* of all up to why_down, and held where a job is put */
    pthread_cond_t changed;        /* cancelled, closing or ended; by CLOCK_MONOTONIC */
    struct job_queue queue;        /* empty while down */
    struct instrument *instrument; /* NULL: none to cancel.  Set by the thread alone */
    bool idle;                     /* in a wait for the button that the next job ends */
    uint64_t asked, begun;         /* jobs put, and taken or given back: in the same order */
    uint64_t cancelled_to;         /* jobs up to the one of this number are */
    bool under_way;                /* job `begun` is */
    bool cancelled;                /* and was cancelled */
    bool closing, ended;
    bool try_now; /* do not wait before it is opened again */
    bool down;    /* could not be opened, or was lost */
    struct driver_error why_down;

    /* The thread's own. */
    struct driver_identity identity;
    uint64_t connection;
    bool has_setup; /* one was configured */
    struct driver_setup setup;
    struct driver_status told; /* last */
    int64_t status_at_ms;      /* when it is to be asked again */
    int64_t press_until_ms;    /* a UNIT_WAIT told of one: its reading waits to be fetched; 0 */
    bool watches_button;
    bool replays; /* a capture, whose presses are those of its shots: they wait for them */
};

/* ---- unit.c ------------------------------------------------------------------------- */

/* Wait for one of the flags under the lock; false: it was not raised by then. */
bool unit_wait_for(struct unit *unit, const bool *flag, int64_t until_ms);
bool unit_is(struct unit *unit, const bool *flag); /* at once */

/* ---- unit_work.c: on the thread ----------------------------------------------------- */

/* Until the instrument is lost, *error says how, or the unit is closed. */
void unit_serve(struct unit *unit, struct driver_error *error);

/* With the lock held: the job goes back, undone, as the unit is down, or else cancelled. */
void unit_give_back(struct unit *unit, struct unit_job *job);

/* This is how it is; when to ask again follows from it. */
void unit_keep_status(struct unit *unit, const struct driver_status *status);

/* ---- unit_tell.c: on the thread ----------------------------------------------------- */

/* Events, of what the members say now.  One that there is no memory for is lost, and logged; false
 * for the first of them, without which nobody would use the instrument. */
bool unit_tell_opened(struct unit *unit);
void unit_tell_lost(struct unit *unit, const struct driver_error *error);
void unit_tell_button(struct unit *unit);
void unit_tell_status(struct unit *unit);

#endif
