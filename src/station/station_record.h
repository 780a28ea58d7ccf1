/* station_record.h - records on their way into the store, and what is told of them after. */
#ifndef SKINSPEC_STATION_STATION_RECORD_H
#define SKINSPEC_STATION_STATION_RECORD_H

#include <stdbool.h>

#include "db/store.h"

struct station;

/* A record with everything absent.  It is too large to be made anew for each request;
 * give it back.  NULL: no memory. */
struct store_record *station_record(struct station *station);
void station_record_back(struct station *station, struct store_record *record);

void station_free_records(struct station *station);

/* A uuid that is being looked up in the store: what is stored under it meanwhile the one
 * who looks may have missed. */
struct uuid_watch {
    struct uuid_watch *next;
    char uuid[STORE_UUID_SIZE];
    bool stored;
};

/* From before the question until its answer was looked at. */
void station_watch_uuid(struct station *station, struct uuid_watch *watch);
void station_unwatch_uuid(struct station *station, const struct uuid_watch *watch);

/* After a commit. */
void station_tell_record(struct station *station, const struct store_record *record);

#endif
