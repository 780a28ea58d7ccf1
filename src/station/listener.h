/* listener.h - the socket clients connect to. */
#ifndef SKINSPEC_STATION_LISTENER_H
#define SKINSPEC_STATION_LISTENER_H

#include <stdbool.h>
#include <sys/types.h>

#include "base/status.h"

struct listener {
    int fd;
    bool ours;      /* made here, not handed over by systemd: its name goes with us */
    char path[108]; /* room of sun_path */
    dev_t device;   /* of the name, so that only our own is removed */
    ino_t inode;
};

/* The socket that systemd hands over, or else a new one at path with mode 0600.  A name that a
 * dead daemon left is taken over; one that is answered, or is no socket, is left
 * alone.  Logged.  STATUS_EXISTS: taken; STATUS_RANGE: the path is too long; STATUS_IO. */
enum status listener_open(const char *path, struct listener *ret);
void listener_close(struct listener *listener); /* takes one with fd -1 */

#endif
