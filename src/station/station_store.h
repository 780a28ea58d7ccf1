/* station_store.h - how the store stands, as the loop knows it. */
#ifndef SKINSPEC_STATION_STATION_STORE_H
#define SKINSPEC_STATION_STATION_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "station/station.h"
#include "station/ticket.h"
#include "station/writer.h"

/* "ok", "opening", ... */
const char *store_state_name(enum store_state state);

/* Take the state folder for this process and start the writer.
 * STATUS_EXISTS where another has it; where the folder cannot be written the service is
 * read-only, and that is STATUS_OK. */
enum status station_claim_store(struct station *station);

/* Open the store on the writer's thread; station->store and store_opened() tell the end. */
void station_look_at_store(struct station *station);

/* Where it cannot be written for a cause that may pass: see whether that has passed. */
void station_try_store(struct station *station);

/* What WRITE_OPEN or WRITE_BEGIN_ANEW has told, whatever that is. */
void station_take_opened(struct station *station, const struct write_job *write);

/* What a write or a read has shown about the store, told to all where it is new. */
void station_note_write(struct station *station, enum status status);

/* What store.verify has found. */
void station_note_verified(struct station *station, bool sound);

/* The WAL has this size: above the limit nothing is stored until it is below again. */
void station_note_wal(struct station *station, int64_t wal_bytes);

/* False, and the ticket refused, where the store takes nothing. */
bool station_can_write(struct station *station, const struct ticket *ticket);

/* The reason for a status of the store, when reading (or writing) a record. */
struct refusal station_store_refusal(const struct station *station, enum status status,
                                     const char *bad_member);

#endif
