/* doctor_walk.h - a person is led through everything an instrument can do, while every byte of it
 * is recorded. */
#ifndef SKINSPEC_CLI_DOCTOR_WALK_H
#define SKINSPEC_CLI_DOCTOR_WALK_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "cli/remote.h"
#include "cli/stop.h"

/* Each step is told and asked for on standard error and answered on standard input: Enter does
 * it, "s" skips it, "q" ends.  What came of it is added to `notes`, an array of
 * {"step","outcome"}: "done", "skipped", "failed: ...", or an answer.
 *
 * False: the person, a signal, or the end of the station or of standard input ended it early. */
bool doctor_walk(struct remote *remote, struct stop *stop, const char *driver, cJSON *notes);

#endif
