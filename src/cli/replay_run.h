/* replay_run.h - the steps of a part, asked of a station that has the capture for an instrument. */
#ifndef SKINSPEC_CLI_REPLAY_RUN_H
#define SKINSPEC_CLI_REPLAY_RUN_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "cli/remote.h"
#include "cli/replay_script.h"
#include "cli/stop.h"

/* Do them in order, and add for each an object to `told`: {"step","line","outcome","differences"};
 * outcome "done", "same", "differs" or "not compared" (the capture ends before it says what came
 * of it).  Each is also given to tell(), as it is added.
 *
 * False: what is left could not be done (logged), or Ctrl-C: stop->signal. */
bool replay_run(struct remote *remote, struct stop *stop, const struct replay_part *part,
                cJSON *told, void (*tell)(const cJSON *step));

#endif
