/* instrument.h - which instrument, and the right to use it. */
#ifndef SKINSPEC_CLI_INSTRUMENT_H
#define SKINSPEC_CLI_INSTRUMENT_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "cli/remote.h"

/* What instrument.list says of the one with this name, or of the only one where the name is
 * NULL; the caller's to delete.  NULL, logged, with *exit_status 1 or, where there are
 * several to name one of, 2. */
cJSON *instrument_choose(struct remote *remote, const char *name, int *exit_status);

/* Take its lease, which is then held (cli/remote).  With wait it may take long: the place in
 * the queue is told on the way, for which events of leases must be subscribed to.
 * False: logged. */
bool instrument_acquire(struct remote *remote, const char *name, bool wait);

/* Give the lease back, if it is held; the end of the connection does it as well. */
void instrument_release(struct remote *remote);

#endif
