/* measurement.h - a measurement under way: progress, prompts, Ctrl-C. */
#ifndef SKINSPEC_CLI_MEASUREMENT_H
#define SKINSPEC_CLI_MEASUREMENT_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "cli/remote.h"
#include "match/refined_match.h"

/* The params of measure.start; NULL and NAN are left out. */
struct measurement {
    const char *uuid, *specular, *pace;
    size_t replicates;
    double surface;
    const char *subject, *site, *table, *by;
    struct refine_wish wish; /* placement NAN: from the replicates */
};

/* Measure with the instrument whose lease is held and tell on standard error how it goes; events
 * of measurements must be subscribed to.  With pace prompt each further shot waits for
 * Enter or the instrument's button.  The record is the caller's to delete; NULL: logged.
 *
 * Ctrl-C, SIGTERM and SIGHUP cancel: the lease is given back, and the signal takes its usual
 * course. */
cJSON *measurement_take(struct remote *remote, const cJSON *instrument,
                        const struct measurement *measurement);

#endif
