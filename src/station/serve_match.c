/* serve_match.c - match.spectrum: matched here or on a worker, then stored if asked. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "station/answer_scene.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/reading.h"
#include "station/serve.h"
#include "station/station_record.h"
#include "station/station_store.h"
#include "station/station_table.h"
#include "station/strict_json.h"
#include "station/ticket.h"
#include "station/wire.h"

/* One request on its way; first a job of a worker where matching takes long, then one of
 * the writer where it is to be stored. */
struct matching {
    union {
        struct job job;
        struct write_job write;
    };
    struct station *station;
    struct ticket ticket;
    struct store_record *record;
    struct loaded_table *table;
    enum match_by by;
    size_t k;
    struct refine_wish wish;
    bool has_scene; /* then by, k and wish are not looked at */
    struct scene scene;
    char scene_why[SCENE_WHY_SIZE];
    bool store;
    enum status matched;
    const char *why; /* it could not be refined; NULL: matched says it all */
    cJSON *result;
    struct nearest_hit hits[]; /* max(k, REFINE_STARTS) */
};

static void matching_free(struct matching *m)
{
    station_record_back(m->station, m->record);
    cJSON_Delete(m->result);
    free(m);
}

/* ---- what is told of a record ------------------------------------------------------- */

static void add_record(cJSON *match, const struct store_record *record)
{
    cJSON *where = cJSON_AddObjectToObject(match, "record");
    cJSON_AddStringToObject(where, "id", record->id);
    cJSON_AddNumberToObject(where, "seq", (double)record->seq);
    cJSON_AddStringToObject(where, "taken_at", record->taken_at);
}

/* What the client gets of a record: the refined match where there is one. */
static const char *match_text(const struct store_record *record)
{
    return record->refined_json[0] != '\0' ? record->refined_json : record->match_json;
}

/* Without `nearest` the answer is what is stored, and it is text already: printing the
 * same numbers a second time would cost more than finding the match did. */
static void answer_stored_text(const struct matching *m)
{
    const struct store_record *record = m->record;
    const char *match = match_text(record);
    char text[sizeof record->refined_json + 256];
    int end = (int)strlen(match) - 1; /* of the brace */
    snprintf(text, sizeof text,
             "%.*s,\"record\":{\"id\":\"%s\",\"seq\":%" PRId64 ",\"taken_at\":\"%s\"}}", end, match,
             record->id, record->seq, record->taken_at);
    station_answer_text(m->station, &m->ticket, text);
}

/* ---- a retry ------------------------------------------------------------------------ */

/* A uuid that may be there already. */
struct lookup {
    char uuid[STORE_UUID_SIZE], sha256[65];
    struct request request; /* ours now; without a tree where the uuid is known to be there */
    bool found;
};

/* The match as it was stored, whatever the table says by now. */
static cJSON *match_of(const struct reading *reading, const struct store_record *record,
                       struct refusal *refusal)
{
    const struct lookup *lookup = reading->own;
    const char *text = match_text(record);
    cJSON *match = NULL;
    enum strict_json_fault fault;
    bool is_other = strcmp(record->parameters_sha256, lookup->sha256) != 0;
    if (is_other || (reading->kiosk && record->owner_uid != reading->uid)) {
        refusal_set(refusal, REASON_UUID_REUSED, NULL);
        return NULL;
    }
    enum status s = strict_json_parse(text, strlen(text), &match, &fault, NULL);
    if (s == STATUS_OK)
        add_record(match, record);
    else if (s != STATUS_NO_MEMORY) /* which it says already */
        refusal_set(refusal, REASON_RECORD_WITHOUT_MATCH, NULL);
    return match;
}

static cJSON *read_stored_match(struct reading *reading, struct worker *worker,
                                struct refusal *refusal)
{
    struct lookup *lookup = reading->own;
    struct store_reader *reader = reading_store(worker, refusal);
    struct store_record *record = reader != NULL ? malloc(sizeof *record) : NULL;
    cJSON *match = NULL;
    if (record == NULL)
        return NULL;
    enum status s = store_get(reader, NULL, lookup->uuid, record);
    lookup->found = s == STATUS_OK;
    if (lookup->found)
        match = match_of(reading, record, refusal);
    else if (s != STATUS_NOT_FOUND)
        reading_failed(worker, s, refusal);
    free(record);
    return match;
}

static void free_lookup(struct reading *reading)
{
    request_done(&((struct lookup *)reading->own)->request);
}

/* The writer has found the uuid. */
static void answer_as_stored(struct matching *m)
{
    struct station *station = m->station;
    const struct client *client = clients_find(station->clients, m->ticket.client);
    if (client == NULL)
        return;
    struct reading *reading = reading_of_ticket(station, &m->ticket, sizeof(struct lookup));
    if (reading == NULL)
        return;
    struct lookup *lookup = reading->own;
    memcpy(lookup->uuid, m->record->uuid, sizeof lookup->uuid);
    memcpy(lookup->sha256, m->record->parameters_sha256, sizeof lookup->sha256);
    reading->kiosk = client->peer.right == RIGHT_KIOSK;
    reading->uid = client->peer.uid;
    reading->read = read_stored_match;
    reading_ask(reading, station->reader);
}

/* ---- stored ------------------------------------------------------------------------- */

static void answer_stored(struct matching *m)
{
    cJSON *result = m->result;
    m->result = NULL;
    if (m->k == 0) {
        answer_stored_text(m);
        return;
    }
    add_record(result, m->record);
    station_answer(m->station, &m->ticket, result);
}

static void stored(struct job *job)
{
    struct matching *m = (struct matching *)job;
    struct station *station = m->station;
    station_note_write(station, m->write.status);
    if (m->write.status != STATUS_OK) {
        struct refusal refusal =
            station_store_refusal(station, m->write.status, m->write.bad_member);
        station_refuse(station, &m->ticket, &refusal);
    } else if (m->write.known) {
        answer_as_stored(m);
    } else {
        answer_stored(m);
        station_tell_record(station, m->record);
    }
    matching_free(m);
}

/* ---- matched ------------------------------------------------------------------------ */

static void match_scene(struct matching *m, struct answer_weights *weights)
{
    m->matched = answer_scene(m->table, &m->scene, m->store, m->record, &m->result, m->scene_why);
    if (m->matched == STATUS_OK && m->store)
        answer_colour(weights, m->record);
}

static void match(struct matching *m, struct answer_weights *weights)
{
    if (m->has_scene) {
        match_scene(m, weights);
        return;
    }
    bool refine = m->wish.kind != REFINE_NOT;
    cJSON **result = m->k > 0 ? &m->result : NULL;
    m->matched = answer_match(m->table, m->by, m->k, m->hits, m->record, refine ? NULL : result);
    if (m->matched == STATUS_OK && refine)
        m->matched =
            answer_refine(m->table, m->by, &m->wish, m->k, m->hits, m->record, result, &m->why);
    if (m->matched == STATUS_OK && m->store)
        answer_colour(weights, m->record);
}

/* What of a scene could not be done, in words where there are any. */
static void refuse_scene(struct matching *m)
{
    struct refusal refusal;
    if (m->matched == STATUS_NO_MEMORY)
        refusal_set(&refusal, REASON_NO_MEMORY, NULL);
    else if (m->matched == STATUS_CANCELLED)
        refusal_set(&refusal, REASON_SHUTTING_DOWN, NULL);
    else if (m->scene_why[0] != '\0')
        params_refuse_scene(&refusal, m->scene_why);
    else
        refusal_set(&refusal, REASON_SPECTRUM_UNSUITABLE, NULL);
    station_refuse(m->station, &m->ticket, &refusal);
    matching_free(m);
}

static void go_on(struct matching *m)
{
    struct station *station = m->station;
    if (m->matched != STATUS_OK && m->has_scene) {
        refuse_scene(m);
    } else if (m->matched != STATUS_OK) {
        bool no_spectra = m->by == MATCH_SPECTRUM && loaded_table(m->table)->spectrum == NULL;
        enum reason reason = m->matched == STATUS_NO_MEMORY   ? REASON_NO_MEMORY
                             : m->matched == STATUS_CANCELLED ? REASON_SHUTTING_DOWN
                             : no_spectra                     ? REASON_TABLE_UNSUITABLE
                                                              : REASON_SPECTRUM_UNSUITABLE;
        if (m->why != NULL)
            station_refuse_for(station, &m->ticket, reason, "%s", m->why);
        else
            station_refuse_for(station, &m->ticket, reason, NULL);
        matching_free(m);
    } else if (m->store) {
        m->write = (struct write_job){ .job.done = stored, .kind = WRITE_RECORD };
        m->write.record = m->record;
        writer_ask(station->writer, &m->write);
    } else {
        if (m->k > 0)
            station_answer(station, &m->ticket, m->result);
        else
            station_answer_text(station, &m->ticket, match_text(m->record));
        m->result = NULL; /* given away */
        matching_free(m);
    }
}

static void cancel_match(struct job *job)
{
    ((struct matching *)job)->matched = STATUS_CANCELLED;
}

static void match_on_worker(struct job *job, void *thread)
{
    match((struct matching *)job, worker_weights(thread));
}

static void matched(struct job *job)
{
    go_on((struct matching *)job);
}

/* ---- asked -------------------------------------------------------------------------- */

/* The spectrum as it is matched: SCE.  False with *refusal. */
static bool take_spectrum(const struct request *request, struct store_record *record,
                          struct refusal *refusal)
{
    struct spectrum *spectrum = &record->spectrum;
    size_t band = 0;
    refusal_set(refusal, REASON_SPECTRUM_UNSUITABLE, NULL);
    if (wire_read_spectrum(strict_json_member(request->params, "spectrum"), spectrum) != STATUS_OK)
        return false;
    spectrum->specular = params_specular(request);
    spectrum->aperture_mm = record->aperture_mm = params_number(request, "aperture_mm", NAN);
    if (spectrum->specular == SPECULAR_SCI) {
        record->surface = params_number(request, "surface", NAN);
        if (isnan(record->surface)) {
            refusal_set(refusal, REASON_SURFACE_NEEDED, NULL);
            return false;
        }
        if (spectrum_remove_surface(spectrum, record->surface, &band) != STATUS_OK) {
            refusal_set(refusal, REASON_SPECTRUM_UNSUITABLE,
                        "the surface exceeds the reading at %g nm", spectrum_nm(spectrum, band));
            return false;
        }
    }
    record->specular = spectrum->specular;
    return true;
}

static void take_circumstances(const struct station *station, const struct client *client,
                               const struct request *request, struct store_record *record)
{
    params_copy(request, "uuid", record->uuid, sizeof record->uuid);
    params_copy(request, "subject", record->subject, sizeof record->subject);
    params_copy(request, "site", record->site, sizeof record->site);
    snprintf(record->operator_name, sizeof record->operator_name, "%s", client->operator_name);
    snprintf(record->boot_id, sizeof record->boot_id, "%s", station->machine_boot);
    record->boottime_ms = clock_boottime_ms();
    record->owner_uid = client->peer.uid;
    strcpy(record->flags, "[]");
}

static struct matching *make(struct station *station, const struct client *client,
                             const struct request *request)
{
    size_t k = (size_t)params_integer(request, "k", 0);
    size_t room = k > REFINE_STARTS ? k : REFINE_STARTS;
    struct matching *m = calloc(1, sizeof *m + room * sizeof *m->hits);
    if (m == NULL)
        return NULL;
    m->station = station;
    m->ticket = ticket_of(client, request);
    m->k = k;
    m->store = params_is_true(request, "store");
    m->record = station_record(station);
    if (m->record == NULL || (params_has(request, "uuid") &&
                              params_sha256(request, m->record->parameters_sha256) != STATUS_OK)) {
        matching_free(m);
        return NULL;
    }
    take_circumstances(station, client, request, m->record);
    return m;
}

static void begin(struct matching *m, const struct request *request, struct loaded_table *table)
{
    struct refusal refusal;
    bool refines = m->has_scene || station_table_refines(table, &m->wish, &refusal);
    if (!refines || !take_spectrum(request, m->record, &refusal)) {
        station_refuse(m->station, &m->ticket, &refusal);
        matching_free(m);
        return;
    }
    m->table = table;
    if (!m->has_scene && !params_by(request, &m->by))
        m->by = matcher_default_by(loaded_table(table));
    if (!m->has_scene && m->wish.kind == REFINE_NOT && answer_is_quick(table, m->by, m->k)) {
        match(m, &m->station->weights);
        go_on(m);
    } else {
        m->job.run = match_on_worker;
        m->job.cancel = cancel_match;
        m->job.done = matched;
        /* Not the reader: every look at the store would wait behind all the matches that its
         * queue can hold, and these may well wait for a check of the store instead. */
        worker_ask(m->station->chores, &m->job);
    }
}

static void match_anew(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct loaded_table *table = NULL;
    struct refine_wish wish;
    struct refusal refusal;
    struct scene scene;
    bool has_scene;
    if (!params_scene(request, &scene, &has_scene, &refusal) ||
        !params_wish(request, &wish, &refusal)) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    if (params_is_true(request, "store") && !station_can_write(station, &ticket))
        return;
    enum status s = STATUS_OK;
    if (!has_scene || scene_wants_skin(&scene)) /* colours alone take no table */
        s = station_table(station, params_text(request, "table"), &table, &refusal);
    if (s == STATUS_CANCELLED) {
        station_park(station, client, request);
        return;
    }
    if (s != STATUS_OK) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    struct matching *m = make(station, client, request);
    if (m == NULL) {
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    m->wish = wish;
    m->has_scene = has_scene;
    if (has_scene) {
        m->scene = scene;
        m->k = scene.k; /* the reply is more than what is stored */
    }
    begin(m, request, table);
}

/* Not found, or the store cannot be read: the writer looks for the uuid again. */
static void looked_up(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    struct lookup *lookup = reading->own;
    struct station *station = reading->station;
    struct client *client = clients_find(station->clients, reading->ticket.client);
    if (lookup->found && reading->made == STATUS_OK) {
        station_answer_line(station, &reading->ticket, &reading->line);
    } else {
        free(reading->line.text);
        if (lookup->found)
            station_refuse_for(station, &reading->ticket, REASON_NO_MEMORY, NULL);
        else if (station->stopping)
            station_refuse_for(station, &reading->ticket, REASON_SHUTTING_DOWN, NULL);
        else if (client != NULL)
            match_anew(station, client, &lookup->request);
    }
    reading_free(reading);
}

/* Before anything else: a retry gets its answer though the table is gone by now, or the store
 * takes nothing more. */
static void look_up(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct reading *reading = reading_make(station, client, request, sizeof(struct lookup));
    if (reading == NULL)
        return;
    struct lookup *lookup = reading->own;
    if (params_sha256(request, lookup->sha256) != STATUS_OK) {
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        reading_free(reading);
        return;
    }
    params_copy(request, "uuid", lookup->uuid, sizeof lookup->uuid);
    lookup->request = *request;
    request->tree = NULL;
    reading->free = free_lookup;
    reading->read = read_stored_match;
    reading->job.done = looked_up;
    reading_ask(reading, station->reader);
}

void serve_match_spectrum(struct station *station, struct client *client, struct request *request)
{
    if (!params_is_true(request, "store") || !params_has(request, "uuid"))
        match_anew(station, client, request);
    else if (!station->store.told) /* there may be a store to look into soon */
        station_park(station, client, request);
    else
        look_up(station, client, request);
}
