/* station_record.c - one is used again and again; who looks for a uuid hears of it. */
#include "station/station_record.h"

#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "station/housekeeping.h"
#include "station/station.h"
#include "station/tell.h"

enum { RECORDS_PER_CHECK = 2048 };

struct spare_record {
    struct store_record record; /* first: it is handed out as this */
    struct spare_record *next;
};

/* Replicates beyond record->replicates are not looked at: they stay as they are. */
static void make_absent(struct store_record *r)
{
    const size_t head = offsetof(struct store_record, replicate);
    const size_t tail = offsetof(struct store_record, raw);
    memset(r, 0, head);
    r->replicate[0].n = r->replicate_sci[0].n = 0;
    memset((char *)r + tail, 0, sizeof *r - tail);
    r->owner_uid = -1;
    r->aperture_mm = r->raw_unit = r->surface = r->ITA = NAN;
}

struct store_record *station_record(struct station *station)
{
    struct spare_record *spare = station->spare_records;
    if (spare != NULL)
        station->spare_records = spare->next;
    else
        spare = malloc(sizeof *spare);
    if (spare == NULL)
        return NULL;
    make_absent(&spare->record);
    return &spare->record;
}

void station_record_back(struct station *station, struct store_record *record)
{
    struct spare_record *spare = (struct spare_record *)record;
    if (record == NULL)
        return;
    free((void *)record->raw);
    spare->next = station->spare_records;
    station->spare_records = spare;
}

void station_free_records(struct station *station)
{
    while (station->spare_records != NULL) {
        struct spare_record *next = station->spare_records->next;
        free(station->spare_records);
        station->spare_records = next;
    }
}

void station_watch_uuid(struct station *station, struct uuid_watch *watch)
{
    watch->stored = false;
    watch->next = station->watched;
    station->watched = watch;
}

void station_unwatch_uuid(struct station *station, const struct uuid_watch *watch)
{
    struct uuid_watch **at = &station->watched;
    while (*at != NULL && *at != watch)
        at = &(*at)->next;
    if (*at != NULL)
        *at = watch->next;
}

static void note_stored(struct station *station, const char *uuid)
{
    for (struct uuid_watch *watch = station->watched; watch != NULL; watch = watch->next)
        watch->stored = watch->stored || strcmp(watch->uuid, uuid) == 0;
}

void station_tell_record(struct station *station, const struct store_record *record)
{
    char data[STORE_UUID_SIZE + 64];
    if (++station->counters.records % RECORDS_PER_CHECK == 0 && station->housekeeping != NULL)
        housekeeping_look_at_wal(station->housekeeping);
    if (record->seq > station->store.last_seq)
        station->store.last_seq = record->seq;
    note_stored(station, record->uuid);
    snprintf(data, sizeof data, "{\"id\":\"%s\",\"seq\":%" PRId64 "}", record->id, record->seq);
    station_tell_text(station, EVENT_STORE, "record", data);
}
