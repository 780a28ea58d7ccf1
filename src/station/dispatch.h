/* dispatch.h - lines of clients to the functions that serve them. */
#ifndef SKINSPEC_STATION_DISPATCH_H
#define SKINSPEC_STATION_DISPATCH_H

#include "station/clients.h"
#include "station/protocol.h"

struct station;

/* A line of a client: read, checked, and served. */
void station_line(void *station, struct client *client, const char *line, size_t n);

/* One that was read and may be served, now or again after it was parked: given to the function
 * of its method. */
void dispatch(struct station *station, struct client *client, struct request *request);

#endif
