/* asked.h - what the station was asked, and what came of it, in the capture of an instrument.
 *
 * skinspecd --record FILE writes every byte of one instrument down (drivers/link/capture.h) and
 * between them, as lines "@ WORD {...}", what the same conversation needs to be had again:
 *
 *   station {..}     how the station was set: policy, default table, and what stood after the
 *                address, its files without their folders
 *   configure {..}   the members of instrument.configure
 *   calibrate {"step"}
 *   measure {..}     those of measure.start that say how
 *   next {}          a shot that waited, by measure.next
 *   button {}        a shot that waited, by the instrument's button
 *   refused {"of","reason"}    how the last configure, calibrate or measure failed
 *   cancelled {"cause"}        how the last measure ended early
 *   record {..}      what became of the last measure: spectra, colour, match, flags
 *
 * Only what reached the instrument is there.  A capture leaves the house: operator, subject, site,
 * ids and times of records are left out.
 *
 * On the loop's thread, which does not wait for the disk.  A bench that is not recorded, or a line
 * there is no memory for, is nothing and a line in the log. */
#ifndef SKINSPEC_STATION_ASKED_H
#define SKINSPEC_STATION_ASKED_H

#include "db/store.h"
#include "station/bench.h"

/* The capture the settings ask for, in station->recording; its first lines.  Logged. */
enum status asked_open(struct station *station);
void asked_close(struct station *station);
void asked_flush(struct station *station, int within_ms); /* where it cannot be closed */

void asked_identity(const struct bench *bench); /* as notes */

void asked_configure(const struct bench *bench, const struct request *request);
void asked_calibrate(const struct bench *bench, enum driver_calibration step);
void asked_measure(const struct bench *bench, const struct request *request);
void asked_next(const struct bench *bench);
void asked_button(const struct bench *bench);

void asked_refused(const struct bench *bench, const char *of, const struct refusal *refusal);
void asked_cancelled(const struct bench *bench, const char *cause);
void asked_record(const struct bench *bench, const struct store_record *record);

#endif
