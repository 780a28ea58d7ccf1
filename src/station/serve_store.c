/* serve_store.c - store.verify, store.begin_anew. */
#include <stdlib.h>

#include "station/reading.h"
#include "station/serve.h"
#include "station/station_store.h"
#include "station/ticket.h"

struct verifying {
    bool found, sound;
};

static cJSON *verify(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    struct store_verify_report report = { 0 };
    struct verifying *verifying = reading->own;
    struct store_reader *reader = reading_store(worker, refusal);
    if (reader == NULL)
        return NULL;
    enum status s = store_verify(reader, &report);
    if (s != STATUS_OK && s != STATUS_DAMAGED) {
        reading_failed(worker, s, refusal);
        return NULL;
    }
    *verifying = (struct verifying){ .found = true, .sound = s == STATUS_OK };
    cJSON *result = cJSON_CreateObject();
    cJSON_AddBoolToObject(result, "sound", s == STATUS_OK);
    if (s == STATUS_DAMAGED)
        cJSON_AddStringToObject(result, "what", report.what);
    cJSON_AddNumberToObject(result, "records", (double)report.records);
    cJSON_AddNumberToObject(result, "audit_rows", (double)report.audit_rows);
    cJSON_AddNumberToObject(result, "first_seq", (double)report.first_seq);
    cJSON_AddNumberToObject(result, "last_seq", (double)report.last_seq);
    if (report.last_hash[0] != '\0')
        cJSON_AddStringToObject(result, "last_hash", report.last_hash);
    return result;
}

static void verified(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    const struct verifying *verifying = reading->own;
    if (verifying->found)
        station_note_verified(reading->station, verifying->sound);
    reading_done(job);
}

void serve_store_verify(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, sizeof(struct verifying));
    if (reading == NULL)
        return;
    reading->read = verify;
    reading->job.done = verified;
    reading_ask(reading, station->chores);
}

/* ---- an empty store ----------------------------------------------------------------- */

struct anew {
    struct write_job write;
    struct station *station;
    struct ticket ticket;
};

static void begun(struct job *job)
{
    struct anew *anew = (struct anew *)job;
    struct station *station = anew->station;
    enum status s = anew->write.status;
    if (s != STATUS_CANCELLED)
        station_take_opened(station, &anew->write);
    if (s == STATUS_OK) {
        cJSON *result = cJSON_CreateObject();
        cJSON_AddStringToObject(result, "station_id", station->store.station_id);
        station_answer(station, &anew->ticket, result);
    } else if (s == STATUS_NOT_FOUND) {
        station_refuse_for(station, &anew->ticket, REASON_STORE_NOT_DAMAGED, NULL);
    } else if (anew->write.moved) {
        station_refuse_for(station, &anew->ticket, REASON_STORE_READ_ONLY, "%s",
                           station->store.error);
    } else {
        struct refusal refusal = station_store_refusal(station, s, "");
        station_refuse(station, &anew->ticket, &refusal);
    }
    free(anew);
}

void serve_store_begin_anew(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    if (station->writer == NULL) {
        station_refuse_for(station, &ticket, REASON_STORE_READ_ONLY, "%s", station->store.error);
        return;
    }
    struct anew *anew = calloc(1, sizeof *anew);
    if (anew == NULL) {
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    anew->write.job.done = begun;
    anew->write.kind = WRITE_BEGIN_ANEW;
    anew->station = station;
    anew->ticket = ticket;
    writer_ask(station->writer, &anew->write);
}
