/* stop.h - Ctrl-C as something to wait for beside the station.
 *
 * From stop_begin() to stop_end() SIGINT, SIGTERM and SIGHUP do not end the program but
 * make the descriptor readable.  Those that were ignored (nohup) stay so.  One at a
 * time: signals are the process's. */
#ifndef SKINSPEC_CLI_STOP_H
#define SKINSPEC_CLI_STOP_H

#include <signal.h>

#include "base/status.h"

struct stop {
    int fd;
    int signal; /* the one that came; 0 */
    sigset_t before;
};

/* STATUS_IO, logged. */
enum status stop_begin(struct stop *stop);

/* Take the signal that made the descriptor readable. */
void stop_take(struct stop *stop);

void stop_end(struct stop *stop);

/* After stop_end(): the signal that came takes its usual course; returns where none did. */
void stop_as_asked(const struct stop *stop);

#endif
