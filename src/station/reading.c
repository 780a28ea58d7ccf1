/* reading.c - there and back again: loop, worker, loop. */
#include "station/reading.h"

#include <stdlib.h>

#include "station/station_store.h"
#include "station/ticket.h"

/* ---- a damage, told to the loop ----------------------------------------------------- */

struct damage {
    struct job job;
    struct station *station;
};

static void damage_met(struct job *job)
{
    struct damage *damage = (struct damage *)job;
    station_note_write(damage->station, STATUS_DAMAGED);
    free(damage);
}

/* reading_failed() is told of a worker and not of a station; the two meet on its thread. */
static _Thread_local bool has_met_damage;

/* An old reading may still meet it in the file that was moved aside when an empty store has
 * taken its place. */
static void tell_damage(const struct reading *reading)
{
    struct station *station = reading->station;
    bool is_news = has_met_damage && !reading->damaged;
    struct damage *damage = is_news ? calloc(1, sizeof *damage) : NULL;
    has_met_damage = false;
    if (damage == NULL)
        return; /* the next reading tells */
    damage->job.done = damage_met;
    damage->station = station;
    inbox_put(&station->inbox, &damage->job);
}

/* ---- a reading ---------------------------------------------------------------------- */

static void run(struct job *job, void *thread)
{
    struct reading *reading = (struct reading *)job;
    const struct protocol *protocol = reading->station->protocol;
    struct refusal refusal;
    refusal_set(&refusal, REASON_NO_MEMORY, NULL);
    cJSON *result = reading->read(reading, thread, &refusal);
    tell_damage(reading);
    reading->made = result != NULL
                        ? protocol_reply(protocol, &reading->ticket.id, result, &reading->line)
                        : protocol_refuse(protocol, &reading->ticket.id, &refusal, &reading->line);
}

void reading_free(struct reading *reading)
{
    if (reading->free != NULL)
        reading->free(reading);
    free(reading->own);
    free(reading);
}

void reading_done(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    if (reading->made == STATUS_OK)
        station_answer_line(reading->station, &reading->ticket, &reading->line);
    else
        station_refuse_for(reading->station, &reading->ticket, REASON_NO_MEMORY, NULL);
    reading_free(reading);
}

struct reading *reading_of_ticket(struct station *station, const struct ticket *ticket,
                                  size_t own_size)
{
    struct reading *reading = calloc(1, sizeof *reading);
    if (reading != NULL && own_size > 0)
        reading->own = calloc(1, own_size);
    if (reading == NULL || (own_size > 0 && reading->own == NULL)) {
        free(reading);
        station_refuse_for(station, ticket, REASON_NO_MEMORY, NULL);
        return NULL;
    }
    reading->job.run = run;
    reading->job.done = reading_done;
    reading->station = station;
    reading->ticket = *ticket;
    reading->damaged = station->store.status == STATUS_DAMAGED;
    return reading;
}

struct reading *reading_make(struct station *station, const struct client *client,
                             const struct request *request, size_t own_size)
{
    struct ticket ticket = ticket_of(client, request);
    struct reading *reading = reading_of_ticket(station, &ticket, own_size);
    if (reading != NULL) {
        reading->kiosk = client->peer.right == RIGHT_KIOSK;
        reading->uid = client->peer.uid;
    }
    return reading;
}

void reading_ask(struct reading *reading, struct worker *worker)
{
    worker_ask(worker, &reading->job);
}

void reading_ask_again(struct reading *reading, struct worker *worker)
{
    reading->job.run = run;
    reading->job.done = reading_done;
    reading_ask(reading, worker);
}

void reading_failed(struct worker *worker, enum status s, struct refusal *refusal)
{
    has_met_damage = has_met_damage || s == STATUS_DAMAGED;
    refusal_set(refusal,
                s == STATUS_CANCELLED   ? REASON_SHUTTING_DOWN
                : s == STATUS_NO_MEMORY ? REASON_NO_MEMORY
                                        : REASON_STORE_FAILED,
                NULL);
    worker_forget_reader(worker);
}

struct store_reader *reading_store(struct worker *worker, struct refusal *refusal)
{
    struct store_reader *reader;
    enum status s = worker_reader(worker, &reader);
    if (s == STATUS_OK)
        return reader;
    reading_failed(worker, s, refusal);
    return NULL;
}

struct store_record *reading_record(struct reading *reading, struct worker *worker,
                                    struct refusal *refusal)
{
    struct store_reader *reader = reading_store(worker, refusal);
    struct store_record *record = reader != NULL ? malloc(sizeof *record) : NULL;
    tell_damage(reading);
    if (record == NULL)
        return NULL;
    enum status s = store_get(reader, reading->id, NULL, record);
    if (s == STATUS_OK && reading->kiosk && record->owner_uid != reading->uid)
        s = STATUS_NOT_FOUND; /* as if it were not there */
    if (s == STATUS_OK)
        return record;
    if (s == STATUS_NOT_FOUND)
        refusal_set(refusal, REASON_RECORD_UNKNOWN, NULL);
    else
        reading_failed(worker, s, refusal);
    tell_damage(reading); /* run() may be another's */
    free(record);
    return NULL;
}
