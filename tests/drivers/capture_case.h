/* capture_case.h - a handheld's capture in drivers/NAME/captures, replayed through the driver: the
 * readings are those of the simulator that it was made from, bit for bit.
 *
 * tests/station/make_captures.py makes the captures; what a station asked for in them is
 * capture_case_hold(). */
#ifndef SKINSPEC_TESTS_DRIVERS_CAPTURE_CASE_H
#define SKINSPEC_TESTS_DRIVERS_CAPTURE_CASE_H

#include "drivers/driver.h"
#include "tests/drivers/cue.h"

enum { CAPTURE_CASE_SHOTS = 4 };

struct capture_case {
    const struct driver *driver;
    const struct sim_kind *kind;
    const char *options;             /* of the simulator: those of make_captures.py */
    const char *path;                /* of the capture */
    void (*cue)(struct cued_wire *); /* what a person does; NULL: nobody */
    bool press;                      /* the button is; else the simulator's operator does it */
    bool stored;                     /* the first stored sample is read at the end */
};

struct capture_session {
    struct driver_identity identity;
    struct driver_status before, after; /* the calibrations */
    struct driver_reading shot[CAPTURE_CASE_SHOTS], press, stored;
    bool pressed;
};

/* Identity, both calibrations, shots, a press of the button and its reading; fails the test where
 * any of it fails. */
void capture_case_hold(const struct capture_case *c, const struct driver_options *options,
                       struct capture_session *ret);

/* With the simulator; capture: where it is written down, or NULL. */
void capture_case_hold_live(const struct capture_case *c, struct capture *capture,
                            struct capture_session *ret);

/* The simulator's session, and that of the capture at c->path: alike. */
void capture_case_replays(const struct capture_case *c);

void capture_case_tear_down(void);

#endif
