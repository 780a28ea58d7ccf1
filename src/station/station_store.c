/* station_store.c - opened, tried, told; what is remembered of it and what is forgotten. */
#include "station/station_store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "station/bench.h"
#include "station/fences.h"
#include "station/parking.h"
#include "station/tell.h"

const char *store_state_name(enum store_state state)
{
    static const char *const names[] = { "ok", "opening", "full", "read_only", "damaged" };
    return names[state];
}

/* ---- how it stands ------------------------------------------------------------------ */

static enum store_state state_of(enum status s)
{
    switch (s) {
    case STATUS_OK:
        return STORE_OK;
    case STATUS_FULL:
        return STORE_FULL;
    case STATUS_DAMAGED:
        return STORE_DAMAGED;
    default:
        return STORE_READ_ONLY;
    }
}

static const char *text_of_damage(bool in_use)
{
    return in_use ? "station.db is damaged; nothing is stored in it any more. Restart, and it is "
                    "checked and moved aside; or begin an empty one now: skinspec store "
                    "begin-anew, which keeps the damaged file beside it"
                  : "station.db is damaged; it was moved aside, beside where it was, and what can "
                    "be read from it is shown; restore a backup and restart, or begin an empty "
                    "one: skinspec store begin-anew";
}

static const char *text_of(const struct store_standing *store)
{
    switch (store->status) {
    case STATUS_OK:
        return "";
    case STATUS_FULL:
        return "there is no room on the disk of the state folder; free some, and readings are "
               "kept again";
    case STATUS_DAMAGED:
        return text_of_damage(store->in_use);
    case STATUS_READ_ONLY:
        return "the state folder cannot be written; make it writable, and readings are kept again";
    default:
        return store->moved ? "station.db or its -wal was moved or deleted while it was in use; "
                              "put it back and restart the station"
                            : "station.db cannot be written, the station's log says why; it is "
                              "tried again every few seconds";
    }
}

static void tell_state(struct station *station)
{
    cJSON *data = cJSON_CreateObject();
    cJSON_AddStringToObject(data, "store", store_state_name(station->store.state));
    if (station->store.error[0] != '\0')
        cJSON_AddStringToObject(data, "error", station->store.error);
    station_tell(station, EVENT_STORE, "state", data);
}

/* What the store says comes before the size of its WAL, except for a full disk: that may be
 * the WAL's doing. */
static void show_state(struct station *station)
{
    struct store_standing *store = &station->store;
    enum store_state before = store->state;
    char error[sizeof store->error];
    store->state = state_of(store->status);
    snprintf(error, sizeof error, "%s", text_of(store));
    if (station->wal_limited && (store->state == STORE_OK || store->state == STORE_FULL)) {
        store->state = STORE_FULL;
        snprintf(error, sizeof error,
                 "station.db-wal has grown beyond %zu MB because some program keeps reading "
                 "station.db; end it, and readings are kept again",
                 station->settings->wal_limit_mb);
    }
    bool is_news = store->state != before || strcmp(store->error, error) != 0;
    memcpy(store->error, error, sizeof error);
    if (is_news)
        tell_state(station);
}

void station_note_write(struct station *station, enum status s)
{
    struct store_standing *store = &station->store;
    /* Only opening it anew mends these; what was asked before may still come back. */
    if (store->status == STATUS_DAMAGED || store->moved)
        return;
    switch (s) {
    case STATUS_OK:
    case STATUS_FULL:
    case STATUS_READ_ONLY:
    case STATUS_DAMAGED:
    case STATUS_IO:
    case STATUS_DB:
        store->status = s;
        store->in_use = s == STATUS_DAMAGED;
        show_state(station);
        break;
    default: /* about this one job */
        break;
    }
    if (s == STATUS_IO)
        station_try_store(station); /* which tells whether the file was moved */
}

void station_note_verified(struct station *station, bool sound)
{
    cJSON *data = cJSON_CreateObject();
    station->store.verified = true;
    station->store.sound = sound;
    cJSON_AddBoolToObject(data, "sound", sound);
    station_tell(station, EVENT_STORE, "verified", data);
}

void station_note_wal(struct station *station, int64_t wal_bytes)
{
    bool limited = wal_bytes > (int64_t)station->settings->wal_limit_mb << 20;
    if (limited == station->wal_limited)
        return;
    station->wal_limited = limited;
    show_state(station);
    if (limited)
        log_error("station: %s", station->store.error);
}

bool station_can_write(struct station *station, const struct ticket *ticket)
{
    /* A full disk may have room again: only trying tells. */
    if (station->store.state == STORE_OK || station->store.state == STORE_OPENING ||
        (station->store.state == STORE_FULL && station->writer != NULL && !station->wal_limited))
        return true;
    station_refuse_for(station, ticket,
                       station->store.state == STORE_FULL ? REASON_STORE_FULL
                                                          : REASON_STORE_READ_ONLY,
                       "%s", station->store.error);
    return false;
}

struct refusal station_store_refusal(const struct station *station, enum status s,
                                     const char *bad_member)
{
    struct refusal refusal;
    enum reason reason = REASON_STORE_FAILED;
    const char *detail = "";
    if (s == STATUS_FULL)
        reason = REASON_STORE_FULL;
    else if (s == STATUS_READ_ONLY || s == STATUS_DAMAGED)
        reason = REASON_STORE_READ_ONLY, detail = station->store.error;
    else if (s == STATUS_NO_MEMORY)
        reason = REASON_NO_MEMORY;
    else if (s == STATUS_CANCELLED)
        reason = REASON_SHUTTING_DOWN;
    else if (s == STATUS_EXISTS)
        reason = REASON_UUID_REUSED;
    else if (s == STATUS_NOT_FOUND && strcmp(bad_member, "subject") == 0)
        reason = REASON_SUBJECT_UNKNOWN;
    else if (s == STATUS_NOT_FOUND)
        reason = REASON_RECORD_UNKNOWN;
    else if (s == STATUS_RANGE)
        reason = REASON_INTERNAL, detail = bad_member;
    refusal_set(&refusal, reason, "%s", detail);
    return refusal;
}

/* ---- opening ------------------------------------------------------------------------ */

/* Take the folder and start the writer, as far as that goes. */
static enum status claim(struct station *station)
{
    enum status s = STATUS_OK;
    if (station->claim == NULL)
        s = store_claim(station->settings->state, &station->claim);
    return s == STATUS_OK ? writer_open(station->claim, &station->inbox, &station->writer) : s;
}

enum status station_claim_store(struct station *station)
{
    enum status s = claim(station);
    station->store.state = STORE_OPENING;
    if (s != STATUS_READ_ONLY && s != STATUS_FULL)
        return s;
    station->store.status = s;
    show_state(station);
    station->store.told = true;
    return STATUS_OK;
}

/* What the store says of itself, once there is one to read. */
struct newest {
    struct job job;
    struct station *station;
    char known_id[STORE_UUID_SIZE]; /* when it was asked; "" */
    char station_id[STORE_UUID_SIZE];
    int64_t seq, fence;
};

static void read_newest(struct job *job, void *thread)
{
    struct newest *newest = (struct newest *)job;
    struct store_reader *reader;
    worker_forget_reader(thread); /* it may be another store than before */
    if (worker_reader(thread, &reader) != STATUS_OK ||
        store_read_station_id(reader, newest->station_id) != STATUS_OK)
        return; /* nothing is known of it, and that is shown */
    (void)store_newest(reader, &newest->seq);
    (void)store_max_fence(reader, &newest->fence);
}

static void newest_read(struct job *job)
{
    struct newest *newest = (struct newest *)job;
    struct station *station = newest->station;
    struct store_standing *store = &station->store;
    bool is_same = strcmp(newest->known_id, store->station_id) == 0;
    if (is_same && newest->seq > store->last_seq)
        store->last_seq = newest->seq;
    if (is_same && *newest->known_id == '\0') /* the writer has not opened it, nor may ever */
        memcpy(store->station_id, newest->station_id, sizeof store->station_id);
    if (station->writer == NULL)
        fences_go_on_above(station, newest->fence);
    free(newest);
}

static void ask_for_newest(struct station *station, struct worker *worker)
{
    struct newest *newest = calloc(1, sizeof *newest);
    if (newest == NULL) { /* the next record tells */
        if (station->writer == NULL)
            fences_go_on_above(station, 0);
        return;
    }
    newest->job.run = read_newest;
    newest->job.done = newest_read;
    newest->station = station;
    memcpy(newest->known_id, station->store.station_id, sizeof newest->known_id);
    worker_ask(worker, &newest->job);
}

/* Nothing that is remembered of the store before holds for this one. */
static void forget_store(struct station *station)
{
    station->store.last_seq = 0;
    station->store.verified = false;
    for (size_t i = 0; i < station->benches_n; i++)
        bench_forget_calibrations(station->benches[i]);
}

static void read_store(struct station *station)
{
    ask_for_newest(station, station->reader);
    ask_for_newest(station, station->chores); /* for its reader alone */
    for (size_t i = 0; i < station->benches_n; i++)
        bench_recall(station->benches[i]);
}

void station_take_opened(struct station *station, const struct write_job *write)
{
    struct store_standing *store = &station->store;
    bool asked_anew = write->kind == WRITE_BEGIN_ANEW;
    bool is_sound = asked_anew && write->status == STATUS_NOT_FOUND;
    bool is_open = write->status == STATUS_OK || is_sound;
    bool is_new = is_open && (asked_anew || !store->open);
    store->status = is_sound ? STATUS_OK : write->status;
    store->moved = write->moved;
    store->in_use = store->open && !asked_anew;
    store->open = is_open || (store->open && !asked_anew);
    if (is_open) {
        snprintf(store->station_id, sizeof store->station_id, "%s", write->opened.station_id);
    }
    show_state(station);
    if (is_new && asked_anew && !is_sound)
        forget_store(station);
    if (is_new || !store->told) /* what is damaged can be read as well */
        read_store(station);
    if (is_new) /* it may have records with fences that were not reserved here */
        station->fences.reserved = 0;
    fences_keep(station);
}

static void opened(struct job *job)
{
    struct write_job *write = (struct write_job *)job;
    struct station *station = write->context;
    struct store_standing *store = &station->store;
    bool first = !store->told;
    bool hopeless = write->status == STATUS_VERSION || write->status == STATUS_FORMAT;
    store->trying = false;
    if (write->status != STATUS_CANCELLED)
        station_take_opened(station, write);
    store->told = true;
    free(write);
    if (first)
        station->store_opened(station, hopeless);
    station_serve_parked(station);
}

static bool ask_to_open(struct station *station)
{
    struct write_job *write = station->writer != NULL ? calloc(1, sizeof *write) : NULL;
    if (write == NULL)
        return false;
    write->job.done = opened;
    write->kind = WRITE_OPEN;
    write->context = station;
    station->store.trying = true;
    writer_ask(station->writer, write);
    return true;
}

void station_look_at_store(struct station *station)
{
    if (ask_to_open(station))
        return;
    station->store.told = true;
    read_store(station); /* for that no writer is needed */
    station->store_opened(station, false);
}

void station_try_store(struct station *station)
{
    const struct store_standing *store = &station->store;
    if (store->status == STATUS_OK || store->status == STATUS_DAMAGED || store->moved ||
        store->trying || station->stopping)
        return;
    if (station->writer == NULL && claim(station) != STATUS_OK)
        return; /* logged; next time */
    (void)ask_to_open(station);
}
