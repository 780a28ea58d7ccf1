/* seat.h - the places where instruments are: an address, the thread that talks to what is
 * there, and the bench that this is.
 *
 * A seat that was configured has its bench from the start, and keeps it.  One that was
 * discovered learns from the instrument's serial number which bench it is: the same one
 * comes back to its bench under whatever port it was plugged in, with its name, its lease
 * and its history.  A seat whose instrument was pulled out is left, and is closed as soon as
 * its thread has ended.
 *
 * A bench's name is "km_ascii-12345678", driver and serial number; where there is no such
 * number, or another unit with the same is there already, "km_ascii@ttyACM0". */
#ifndef SKINSPEC_STATION_SEAT_H
#define SKINSPEC_STATION_SEAT_H

#include "station/bench.h"
#include "station/discovery.h"

/* Seats for all instruments of the settings, and discovery where they ask for it. */
enum status seats_open(struct station *station);

/* End all threads within patience_ms (0: they are only told to); false: some have not. */
bool seats_stop(struct station *station, int patience_ms);
void seats_close(struct station *station);

#endif
