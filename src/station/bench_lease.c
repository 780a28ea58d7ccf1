/* bench_lease.c - instrument.acquire, withdraw, renew, release: who holds a bench, who is next. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/uuid.h"
#include "station/bench.h"
#include "station/fences.h"
#include "station/params.h"
#include "station/parking.h"
#include "station/run.h"
#include "station/serve.h"
#include "station/tell.h"
#include "station/ticket.h"

/* ---- granted ------------------------------------------------------------------------ */

static cJSON *lease_json(const struct bench *bench)
{
    cJSON *result = cJSON_CreateObject();
    int64_t left = bench->lease.expires_ms - clock_boottime_ms();
    cJSON_AddStringToObject(result, "lease", bench->lease_name);
    cJSON_AddNumberToObject(result, "fence", (double)bench->lease.fence);
    cJSON_AddNumberToObject(result, "expires_in_ms", left > 0 ? (double)left : 0.0);
    return result;
}

static void set_timer(struct bench *bench)
{
    int64_t at_ms = lease_deadline_ms(&bench->lease);
    if (at_ms == INT64_MAX) {
        sd_event_source_set_enabled(bench->lease_timer, SD_EVENT_OFF);
        return;
    }
    sd_event_source_set_time(bench->lease_timer, (uint64_t)at_ms * 1000);
    sd_event_source_set_enabled(bench->lease_timer, SD_EVENT_ONESHOT);
}

/* Random, so that a guess is no lease. */
static void name_lease(struct bench *bench)
{
    if (uuid4_make(bench->lease_name) != STATUS_OK)
        snprintf(bench->lease_name, sizeof bench->lease_name, "lease-%" PRId64, bench->lease.fence);
}

static void granted(struct bench *bench, const struct ticket *ticket)
{
    fences_keep(bench->station);
    name_lease(bench);
    station_answer(bench->station, ticket, lease_json(bench));
    cJSON *data = bench_named(bench);
    cJSON_AddNumberToObject(data, "fence", (double)bench->lease.fence);
    cJSON_AddNumberToObject(data, "connection", (double)ticket->client);
    station_tell(bench->station, EVENT_LEASE, "granted", data);
    set_timer(bench);
}

static void tell_place(struct bench *bench, uint64_t client, size_t place)
{
    cJSON *data = bench_named(bench);
    cJSON_AddNumberToObject(data, "connection", (double)client);
    cJSON_AddNumberToObject(data, "position", (double)place);
    station_tell(bench->station, EVENT_LEASE, "queued", data);
}

/* ---- freed -------------------------------------------------------------------------- */

static struct ticket take_waiting(struct bench *bench, size_t place, size_t waiting_before)
{
    struct ticket ticket = bench->waiting[place - 1];
    memmove(&bench->waiting[place - 1], &bench->waiting[place],
            (waiting_before - place) * sizeof ticket);
    return ticket;
}

static void tell_places(struct bench *bench)
{
    for (size_t i = 0; i < bench->lease.waiting; i++)
        tell_place(bench, bench->lease.queue[i].client, i + 1);
}

static void tell_freed(struct bench *bench, int64_t fence, const char *cause)
{
    cJSON *data = bench_named(bench);
    cJSON_AddNumberToObject(data, "fence", (double)fence);
    cJSON_AddStringToObject(data, "cause", cause);
    station_tell(bench->station, EVENT_LEASE, "freed", data);
    bench->lease_name[0] = '\0';
}

static size_t place_of(const struct bench *bench)
{
    size_t i = 0;
    while (bench->station->benches[i] != bench)
        i++;
    return i;
}

static void note_expired(struct bench *bench, uint64_t holder, int64_t fence)
{
    struct client *client = clients_find(bench->station->clients, holder);
    if (client != NULL)
        memcpy(client->lost_lease[place_of(bench)], bench->lease_name, sizeof bench->lease_name);
    tell_freed(bench, fence, "expired");
    run_end(bench, fence, RUN_EXPIRED);
}

/* What time has brought, and a free bench to the next in line. */
static void tick(struct bench *bench)
{
    uint64_t expired, next;
    size_t waiting = bench->lease.waiting;
    int64_t fence = bench->lease.fence; /* of the one that may have expired */
    lease_tick(&bench->lease, clock_boottime_ms(), &expired, &next);
    if (expired != 0)
        note_expired(bench, expired, fence);
    if (next != 0) {
        struct ticket ticket = take_waiting(bench, 1, waiting);
        granted(bench, &ticket);
        tell_places(bench);
    }
    set_timer(bench);
}

static int on_timer(sd_event_source *source, uint64_t at_us, void *userdata)
{
    (void)source;
    (void)at_us;
    tick(userdata);
    return 0;
}

enum status bench_lease_init(struct bench *bench)
{
    lease_init(&bench->lease, &bench->station->fences.last);
    if (sd_event_add_time(bench->station->event, &bench->lease_timer, CLOCK_BOOTTIME, UINT64_MAX,
                          1000, on_timer, bench) < 0)
        return STATUS_NO_MEMORY;
    sd_event_source_set_enabled(bench->lease_timer, SD_EVENT_OFF);
    return STATUS_OK;
}

static void leave(struct bench *bench, struct client *client, enum run_cause cause)
{
    bool held = bench->lease.holder == client->number;
    size_t waiting = bench->lease.waiting, place = lease_place(&bench->lease, client->number);
    if (!lease_leave(&bench->lease, client->number))
        return;
    if (place > 0) {
        (void)take_waiting(bench, place, waiting);
        tell_places(bench);
    }
    if (held) {
        tell_freed(bench, bench->lease.fence, cause == RUN_RELEASED ? "released" : "disconnected");
        run_end(bench, bench->lease.fence, cause);
    }
    tick(bench);
}

void bench_leave_all(struct station *station, struct client *client)
{
    for (size_t i = 0; i < station->benches_n; i++)
        leave(station->benches[i], client, RUN_DISCONNECTED);
}

void bench_send_queue_away(struct bench *bench)
{
    while (bench->lease.waiting > 0) {
        size_t waiting = bench->lease.waiting;
        (void)lease_leave(&bench->lease, bench->lease.queue[0].client);
        struct ticket ticket = take_waiting(bench, 1, waiting);
        station_refuse_for(bench->station, &ticket, REASON_SHUTTING_DOWN, NULL);
    }
}

/* ---- asked -------------------------------------------------------------------------- */

static bool has_lost(const struct station *station, const struct client *client, const char *lease)
{
    for (size_t i = 0; i < station->benches_n; i++)
        if (*lease != '\0' && strcmp(client->lost_lease[i], lease) == 0)
            return true;
    return false;
}

struct bench *bench_of_lease(struct station *station, struct client *client,
                             const struct request *request, struct refusal *refusal)
{
    const char *name = params_text(request, "lease");
    for (size_t i = 0; i < station->benches_n; i++) {
        struct bench *bench = station->benches[i];
        if (strcmp(bench->lease_name, name) != 0)
            continue;
        tick(bench); /* it may be over before its timer is */
        if (strcmp(bench->lease_name, name) == 0 &&
            lease_use(&bench->lease, client->number, bench->lease.fence, clock_boottime_ms())) {
            set_timer(bench);
            return bench;
        }
    }
    refusal_set(refusal,
                has_lost(station, client, name) ? REASON_LEASE_EXPIRED : REASON_LEASE_UNKNOWN,
                NULL);
    return NULL;
}

static void acquire(struct bench *bench, const struct client *client, const struct request *request)
{
    struct station *station = bench->station;
    struct ticket ticket = ticket_of(client, request);
    enum lease_outcome outcome = LEASE_HELD;
    size_t place = 0;
    tick(bench);
    if (bench->lease.holder == client->number || lease_place(&bench->lease, client->number) > 0) {
        station_refuse_for(station, &ticket, REASON_LEASE_EXISTS, NULL);
        return;
    }
    (void)lease_acquire(&bench->lease, client->number, params_integer(request, "ttl_ms", 0),
                        params_is_true(request, "wait"), clock_boottime_ms(), &outcome, &place);
    if (outcome == LEASE_GRANTED) {
        granted(bench, &ticket);
    } else if (outcome == LEASE_QUEUED) {
        bench->waiting[place - 1] = ticket;
        tell_place(bench, client->number, place);
    } else {
        station_refuse_for(station, &ticket,
                           outcome == LEASE_FULL ? REASON_QUEUE_FULL : REASON_INSTRUMENT_BUSY,
                           "'%s' is leased for another %" PRId64 " s", bench->name,
                           (bench->lease.expires_ms - clock_boottime_ms() + 999) / 1000);
    }
}

void serve_instrument_acquire(struct station *station, struct client *client,
                              struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct bench *bench = bench_find(station, params_text(request, "instrument"));
    if (bench == NULL) {
        station_refuse_for(station, &ticket, REASON_INSTRUMENT_UNKNOWN, NULL);
    } else if (bench->provisional) { /* it may have another name once it opens */
        struct refusal refusal = bench_refusal(&bench->error);
        station_refuse(station, &ticket, &refusal);
    } else if (!station->fences.known) {
        station_park(station, client, request);
    } else {
        acquire(bench, client, request);
    }
}

/* Only who waits is in the queue: an acquire is answered, or stands there once. */
static bool withdraw(struct bench *bench, const struct client *client)
{
    size_t waiting = bench->lease.waiting, place = lease_place(&bench->lease, client->number);
    if (place == 0)
        return false;
    (void)lease_leave(&bench->lease, client->number);
    struct ticket waiter = take_waiting(bench, place, waiting);
    station_refuse_for(bench->station, &waiter, REASON_LEASE_WITHDRAWN, NULL);
    tell_places(bench);
    return true;
}

void serve_instrument_withdraw(struct station *station, struct client *client,
                               struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct bench *bench = bench_find(station, params_text(request, "instrument"));
    if (bench == NULL) {
        station_refuse_for(station, &ticket, REASON_INSTRUMENT_UNKNOWN, NULL);
    } else if (!station->fences.known) { /* behind the acquire, which waits for that */
        station_park(station, client, request);
    } else if (!withdraw(bench, client)) {
        station_refuse_for(station, &ticket, REASON_LEASE_NOT_AWAITED, NULL);
    } else {
        cJSON *result = cJSON_CreateObject();
        cJSON_AddTrueToObject(result, "withdrawn");
        station_answer(station, &ticket, result);
    }
}

void serve_instrument_renew(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    struct bench *bench = bench_of_lease(station, client, request, &refusal);
    if (bench == NULL) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    (void)lease_renew(&bench->lease, client->number, bench->lease.fence,
                      params_integer(request, "ttl_ms", 0), clock_boottime_ms());
    set_timer(bench);
    station_answer(station, &ticket, lease_json(bench));
}

void serve_instrument_release(struct station *station, struct client *client,
                              struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct refusal refusal;
    struct bench *bench = bench_of_lease(station, client, request, &refusal);
    if (bench == NULL) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    cJSON *result = cJSON_CreateObject();
    cJSON_AddTrueToObject(result, "released");
    station_answer(station, &ticket, result);
    leave(bench, client, RUN_RELEASED);
}
