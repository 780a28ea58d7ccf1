/* serve_measure.c - measure.start, measure.next, measure.cancel. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "station/answer_scene.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/reading.h"
#include "station/run.h"
#include "station/serve.h"
#include "station/station_record.h"
#include "station/station_store.h"
#include "station/station_table.h"
#include "station/ticket.h"
#include "station/wire.h"

/* ---- begun -------------------------------------------------------------------------- */

static struct run *find_run(const struct station *station, const char *uuid)
{
    for (size_t i = 0; i < station->benches_n; i++) {
        struct run *run = station->benches[i]->run;
        if (run != NULL && strcmp(run->record->uuid, uuid) == 0)
            return run;
    }
    return NULL;
}

/* A kiosk does not join in what another user measures. */
static void join(struct station *station, struct run *run, const struct client *client,
                 const struct ticket *ticket, const char *sha256)
{
    bool foreign =
        client->peer.right == RIGHT_KIOSK && run->record->owner_uid != (int64_t)client->peer.uid;
    if (foreign || strcmp(run->record->parameters_sha256, sha256) != 0)
        station_refuse_for(station, ticket, REASON_UUID_REUSED, NULL);
    else if (!run_join(run, ticket))
        station_refuse_for(station, ticket, REASON_MEASUREMENT_RUNNING, NULL);
}

static bool measures(const struct bench *bench, const struct request *request,
                     struct refusal *refusal)
{
    bool sci = params_specular(request) == SPECULAR_SCI;
    if (sci && !params_has(request, "surface")) {
        refusal_set(refusal, REASON_SURFACE_NEEDED, NULL);
        return false;
    }
    if (sci ? bench->identity.has_sci : bench->identity.has_sce)
        return true;
    refusal_set(refusal, REASON_INSTRUMENT_UNSUPPORTED, "it does not measure %s",
                sci ? "sci" : "sce");
    return false;
}

/* Whether what the scene wants can be had of the bands that the instrument is set to: said before
 * the first shot, as far as it can be. */
static bool has_plan(const struct bench *bench, struct loaded_table *table,
                     const struct scene *scene, struct refusal *refusal)
{
    const struct spectrum bands = bench_bands(bench);
    char why[SCENE_WHY_SIZE];
    if (answer_scene_check(table, scene, bands.first_nm, bands.step_nm, bands.n, why) == STATUS_OK)
        return true;
    params_refuse_scene(refusal, why);
    return false;
}

/* A default table that is missing is no hindrance, unless a scene wants a skin: the record has no
 * match then.  *loads: whether it can be refined is known only when the table is there. */
static bool has_table(struct station *station, const struct bench *bench,
                      const struct request *request, bool *loads, struct refusal *refusal)
{
    const char *name = params_text(request, "table");
    struct loaded_table *table;
    struct refine_wish wish;
    struct scene scene;
    bool has_scene;
    *loads = false;
    if (!params_scene(request, &scene, &has_scene, refusal) ||
        !params_wish(request, &wish, refusal))
        return false;
    bool searches = has_scene && scene_wants_skin(&scene);
    if (has_scene && !searches && !has_plan(bench, NULL, &scene, refusal))
        return false;
    if (name == NULL && wish.kind == REFINE_NOT && !searches)
        return true;
    enum status s = station_table(station, name, &table, refusal);
    *loads = s == STATUS_CANCELLED && (wish.kind != REFINE_NOT || searches);
    if (s == STATUS_OK && searches)
        return has_plan(bench, table, &scene, refusal);
    if (s == STATUS_OK)
        return station_table_refines(table, &wish, refusal);
    return (name == NULL && !searches) || s != STATUS_NOT_FOUND;
}

/* The uuid is new: all the rest has to be in order. */
static void start(struct station *station, struct client *client, struct request *request,
                  const char *sha256)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    struct run *running = find_run(station, params_text(request, "uuid"));
    if (running != NULL && !running->ended) {
        join(station, running, client, &ticket, sha256);
        return;
    }
    struct bench *bench = bench_of_lease(station, client, request, &refusal);
    if (bench != NULL && (bench_is_ending(bench) || bench->recalls > 0)) {
        station_park(station, client, request);
        return;
    }
    bool loads = false;
    bool may = bench != NULL && bench_is_free(bench, &refusal) &&
               measures(bench, request, &refusal) && run_is_calibrated(bench, &refusal) &&
               has_table(station, bench, request, &loads, &refusal);
    if (may && loads)
        station_park(station, client, request);
    else if (!may)
        station_refuse(station, &ticket, &refusal);
    else if (station_can_write(station, &ticket) &&
             run_begin(bench, client, request, sha256) == NULL)
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
}

/* ---- the uuid is looked up first ---------------------------------------------------- */

enum found { FOUND_NOTHING, FOUND_RECORD, FOUND_REASON };

struct lookup {
    struct request request; /* ours now */
    struct uuid_watch watch;
    char sha256[65];
    enum found found;
    struct refusal refusal;
};

static enum found refuse_with(struct lookup *lookup, enum reason reason)
{
    refusal_set(&lookup->refusal, reason, NULL);
    return FOUND_REASON;
}

static enum reason reason_of(enum status s)
{
    return s == STATUS_NO_MEMORY ? REASON_NO_MEMORY : REASON_STORE_FAILED;
}

static bool any(void *context, const struct store_subject *subject)
{
    (void)context;
    (void)subject;
    return false;
}

/* A kiosk sees its own records alone, also by their uuids. */
static bool is_foreign(const struct reading *reading, const struct store_record *record)
{
    return reading->kiosk && record->owner_uid != reading->uid;
}

/* What the record will refer to must be there before the first shot. */
static enum found look_at_references(struct lookup *lookup, const struct reading *reading,
                                     struct store_reader *reader, struct store_record *record)
{
    const char *subject = params_text(&lookup->request, "subject");
    const char *corrects = params_text(&lookup->request, "corrects");
    enum status s = subject != NULL ? store_list_subjects(reader, subject, any, NULL) : STATUS_OK;
    if (s == STATUS_NOT_FOUND)
        return refuse_with(lookup, REASON_SUBJECT_UNKNOWN);
    if (s == STATUS_OK && corrects != NULL) {
        s = store_get(reader, corrects, NULL, record);
        if (s == STATUS_NOT_FOUND || (s == STATUS_OK && is_foreign(reading, record)))
            return refuse_with(lookup, REASON_RECORD_UNKNOWN);
    }
    return s == STATUS_OK ? FOUND_NOTHING : refuse_with(lookup, reason_of(s));
}

static enum found look_up(struct lookup *lookup, const struct reading *reading,
                          struct store_reader *reader, struct store_record *record, cJSON **result)
{
    enum status s = store_get(reader, NULL, params_text(&lookup->request, "uuid"), record);
    if (s == STATUS_NOT_FOUND)
        return look_at_references(lookup, reading, reader, record);
    if (s != STATUS_OK)
        return refuse_with(lookup, reason_of(s));
    if (is_foreign(reading, record) || strcmp(record->parameters_sha256, lookup->sha256) != 0)
        return refuse_with(lookup, REASON_UUID_REUSED);
    s = wire_record(record, result);
    return s == STATUS_OK ? FOUND_RECORD : refuse_with(lookup, reason_of(s));
}

static void look_up_on_worker(struct job *job, void *thread)
{
    struct reading *reading = (struct reading *)job;
    struct lookup *lookup = reading->own;
    struct refusal no_memory;
    cJSON *result = NULL;
    refusal_set(&no_memory, REASON_NO_MEMORY, NULL);
    lookup->refusal = no_memory;
    struct store_reader *reader = reading_store(thread, &lookup->refusal);
    struct store_record *record = reader != NULL ? malloc(sizeof *record) : NULL;
    lookup->found =
        record != NULL ? look_up(lookup, reading, reader, record, &result) : FOUND_REASON;
    free(record);
    if (lookup->found == FOUND_RECORD &&
        protocol_reply(reading->station->protocol, &reading->ticket.id, result, &reading->line) !=
            STATUS_OK) {
        lookup->found = FOUND_REASON;
        lookup->refusal = no_memory;
    }
}

static void looked_up(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    struct lookup *lookup = reading->own;
    struct station *station = reading->station;
    struct client *client = clients_find(station->clients, reading->ticket.client);
    if (lookup->found == FOUND_NOTHING && lookup->watch.stored) { /* since it was looked for */
        lookup->watch.stored = false;
        reading_ask(reading, station->reader);
        return;
    }
    if (lookup->found == FOUND_RECORD)
        station_answer_line(station, &reading->ticket, &reading->line);
    else if (lookup->found == FOUND_REASON)
        station_refuse(station, &reading->ticket, &lookup->refusal);
    else if (station->stopping)
        station_refuse_for(station, &reading->ticket, REASON_SHUTTING_DOWN, NULL);
    else if (client != NULL)
        start(station, client, &lookup->request, lookup->sha256);
    reading_free(reading);
}

static void free_lookup(struct reading *reading)
{
    struct lookup *lookup = reading->own;
    station_unwatch_uuid(reading->station, &lookup->watch);
    request_done(&lookup->request);
}

void serve_measure_start(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    if (!station->store.told) {
        station_park(station, client, request);
        return;
    }
    struct reading *reading = reading_make(station, client, request, sizeof(struct lookup));
    if (reading == NULL)
        return;
    struct lookup *lookup = reading->own;
    if (params_sha256(request, lookup->sha256) != STATUS_OK) {
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        reading_free(reading);
        return;
    }
    lookup->request = *request;
    request->tree = NULL;
    params_copy(&lookup->request, "uuid", lookup->watch.uuid, sizeof lookup->watch.uuid);
    station_watch_uuid(station, &lookup->watch);
    reading->free = free_lookup;
    reading->job.run = look_up_on_worker;
    reading->job.done = looked_up;
    reading_ask(reading, station->reader);
}

/* ---- the one that runs -------------------------------------------------------------- */

/* That of the request's lease and uuid; NULL, and the ticket refused. */
static struct run *run_of(struct station *station, struct client *client,
                          const struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    struct bench *bench = bench_of_lease(station, client, request, &refusal);
    if (bench == NULL) {
        station_refuse(station, &ticket, &refusal);
        return NULL;
    }
    struct run *run = bench->run;
    if (run != NULL && run->record->fence == bench->lease.fence && !run->ended &&
        strcmp(run->record->uuid, params_text(request, "uuid")) == 0)
        return run;
    station_refuse_for(station, &ticket, REASON_MEASUREMENT_UNKNOWN, NULL);
    return NULL;
}

void serve_measure_next(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct run *run = run_of(station, client, request);
    if (run == NULL)
        return;
    if (run->phase != RUN_WAITING || run->next) {
        station_refuse_for(station, &ticket, REASON_MEASUREMENT_NOT_WAITING, NULL);
        return;
    }
    cJSON *result = cJSON_CreateObject();
    cJSON_AddStringToObject(result, "uuid", run->record->uuid);
    cJSON_AddNumberToObject(result, "shot", (double)(run->measuring.taken + 1));
    cJSON_AddNumberToObject(result, "replicates", (double)run->measuring.replicates);
    station_answer(station, &ticket, result);
    run_next(run);
}

void serve_measure_cancel(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct run *run = run_of(station, client, request);
    if (run == NULL)
        return;
    if (run->phase == RUN_STORING) {
        station_refuse_for(station, &ticket, REASON_MEASUREMENT_UNKNOWN,
                           "it is being stored already");
        return;
    }
    run->canceller = ticket;
    run->has_canceller = true;
    run_end(run->bench, run->record->fence, RUN_ASKED);
}
