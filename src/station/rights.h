/* rights.h - who is at the other end of the socket, and what they may do. */
#ifndef SKINSPEC_STATION_RIGHTS_H
#define SKINSPEC_STATION_RIGHTS_H

#include <stdbool.h>
#include <sys/types.h>

#include "station/protocol.h"

/* Groups by number; (gid_t)-1 where there is no such group. */
struct rights {
    uid_t own; /* the daemon's: admin */
    gid_t group[RIGHTS];
};

/* Look the names up, once at the start. */
void rights_init(struct rights *rights, const char *const group[RIGHTS]);

struct peer {
    pid_t pid;
    uid_t uid;
    enum right right;
    bool may; /* false: in none of the groups */
};

/* From the kernel's word (SO_PEERCRED, SO_PEERGROUPS) for a connected Unix socket.  False
 * where it has none. */
bool rights_of_peer(const struct rights *rights, int fd, struct peer *ret);

#endif
