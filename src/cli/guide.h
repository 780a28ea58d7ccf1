/* guide.h - a person is guided through the calibration, step by step. */
#ifndef SKINSPEC_CLI_GUIDE_H
#define SKINSPEC_CLI_GUIDE_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdio.h>

#include "cli/remote.h"

struct guide {
    bool all;     /* every step, else those that are due */
    bool yes;     /* what a step needs lies there: nobody is asked */
    FILE *to;     /* what is told and asked goes there */
    cJSON *steps; /* results of instrument.calibrate are added; NULL: not kept */
};

/* Whether a step is due, by what instrument.list says of the instrument. */
bool guide_is_due(const cJSON *instrument);

/* "never made", "made before the machine was started", ...: why a step is due, from its
 * calibration_state; "" where it is not. */
const char *guide_cause(const cJSON *state);

/* "23 min", "7 h 59 min", "3 days 2 h". */
enum { GUIDE_TIME_SIZE = 48 };
const char *guide_duration(double seconds, char text[GUIDE_TIME_SIZE]);

/* Zero, then white, of the instrument whose lease is held.  What is placed wrongly is asked
 * for again, unless nobody is asked.  False: logged, or the person gave up. */
bool guide_calibrate(struct remote *remote, const cJSON *instrument, const struct guide *guide);

/* What is due before a measurement, with a person at the terminal.  False: logged; so is that
 * something is due and nobody is there to be guided. */
bool guide_ready(struct remote *remote, const cJSON *instrument);

/* Say what to do and wait for Enter, the lease kept meanwhile.  False: logged, nobody answers. */
bool guide_place(struct remote *remote, FILE *to, const char *what);

#endif
