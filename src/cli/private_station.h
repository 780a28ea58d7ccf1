/* private_station.h - a skinspecd of a command's own: a private folder, a private socket, and
 * nothing left of either afterwards.
 *
 * The program is the skinspecd beside this one, else the one in PATH.  It is told to end when this
 * process does, however that happens; after a SIGKILL the folder alone is left. */
#ifndef SKINSPEC_CLI_PRIVATE_STATION_H
#define SKINSPEC_CLI_PRIVATE_STATION_H

#include <sys/types.h>

#include "base/status.h"

enum { PRIVATE_PATH_SIZE = 512 };

struct private_station {
    char folder[PRIVATE_PATH_SIZE]; /* in TMPDIR or /tmp; "" none */
    char socket[PRIVATE_PATH_SIZE];
    char program[PRIVATE_PATH_SIZE];
    pid_t pid; /* 0: not running */
};

/* The folder, and where the program is.  STATUS_IO, STATUS_RANGE, logged. */
enum status private_station_begin(struct private_station *ret);

/* Start it with these options, ended by NULL, after --socket and --state; the socket is there
 * when this returns.  STATUS_IO, logged. */
enum status private_station_start(struct private_station *station, const char *const *options);

/* What it wrote to its log, to standard error: where it did not do what it should. */
void private_station_show_log(const struct private_station *station);

void private_station_stop(struct private_station *station); /* it alone; takes a stopped one */
void private_station_end(struct private_station *station);  /* and the folder */

/* FOLDER/NAME; ret as large as the folder's path. */
void private_station_path(const struct private_station *station, const char *name,
                          char ret[PRIVATE_PATH_SIZE]);

/* The standard output of the program, run with one option, up to its end: to be freed.  NULL:
 * logged. */
char *private_station_ask(const struct private_station *station, const char *option);

#endif
