/* housekeeping.h - what is due now and then: checkpoints, an eye on the WAL, erasing, pruning,
 * a store that could not be written, and calibrations that expire unasked. */
#ifndef SKINSPEC_STATION_HOUSEKEEPING_H
#define SKINSPEC_STATION_HOUSEKEEPING_H

#include "station/station.h"

struct housekeeping;

/* A timer of the station's loop; sets station->housekeeping.  STATUS_NO_MEMORY. */
enum status housekeeping_start(struct station *station);

/* Look at its size now, and checkpoint, unless that is being done. */
void housekeeping_look_at_wal(struct housekeeping *keeping);
void housekeeping_stop(struct housekeeping *keeping); /* after the threads; takes NULL */

#endif
