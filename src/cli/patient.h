/* patient.h - a request whose answer may take as long as an instrument does, and that Ctrl-C
 * ends. */
#ifndef SKINSPEC_CLI_PATIENT_H
#define SKINSPEC_CLI_PATIENT_H

#include <stdbool.h>

#include "cli/remote.h"
#include "cli/stop.h"

/* params are given away.  *ret is the reply, whether result or error; events are passed over
 * meanwhile.  False: stopped (stop->signal is set), or logged: the station went, or was silent for
 * timeout_ms. */
bool patient_ask(struct remote *remote, struct stop *stop, enum method method, cJSON *params,
                 int timeout_ms, struct answer *ret);

/* Let time pass; false: stopped, or the station went. */
bool patient_wait(struct remote *remote, struct stop *stop, int ms);

/* What instrument.list says of the only instrument, once it is no longer being opened, within
 * timeout_ms: the caller's to delete.  NULL: as above, or there is none (logged). */
cJSON *patient_instrument(struct remote *remote, struct stop *stop, int timeout_ms);

#endif
