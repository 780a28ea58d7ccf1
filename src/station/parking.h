/* parking.h - requests that wait for something which others bring about. */
#ifndef SKINSPEC_STATION_PARKING_H
#define SKINSPEC_STATION_PARKING_H

#include "base/status.h"
#include "station/clients.h"
#include "station/protocol.h"

struct station;

/* Keep a request, which is taken, until something it may wait for has come (a table, the
 * store's opening, the end of a run): station_serve_parked() serves all of them again. */
void station_park(struct station *station, const struct client *client, struct request *request);
void station_serve_parked(struct station *station);

enum status parking_open(struct station *station);
void parking_close(struct station *station); /* nothing is parked */

/* Nobody waits any more: all are refused. */
void parking_send_away(struct station *station);

#endif
