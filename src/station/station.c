/* station.c - the parts put together; requests to their functions, answers to their clients. */
#include "station/station.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/version.h"
#include "json/memory.h"
#include "json/print.h"
#include "station/bench.h"
#include "station/params.h"
#include "station/run.h"
#include "station/seat.h"
#include "station/serve.h"

enum { STOP_PATIENCE_MS = 400 };

/* ---- answers ------------------------------------------------------------------------ */

struct ticket ticket_of(const struct client *client, const struct request *request)
{
    return (struct ticket){ client->number, request->id, request->method };
}

static void send_and_free(struct client *client, struct line *line)
{
    if (client != NULL)
        client_send(client, line);
    free(line->text);
}

void station_answer_line(struct station *station, const struct ticket *ticket, struct line *line)
{
    struct client *client = clients_find(station->clients, ticket->client);
    if (client != NULL)
        client->open_requests--;
    send_and_free(client, line);
}

/* Without the memory for an answer the client is let go: it sees that none comes. */
static void answer_or_drop(struct station *station, const struct ticket *ticket, enum status s,
                           struct line *line)
{
    struct client *client = clients_find(station->clients, ticket->client);
    if (s == STATUS_OK)
        station_answer_line(station, ticket, line);
    else if (client != NULL)
        client_leave(client);
}

/* A session, a lease or events that somebody has and was told not to have would be in the way of
 * every retry: he is let go, and they with him. */
static bool stays_untold(enum method method)
{
    return method == METHOD_SESSION_OPEN || method == METHOD_INSTRUMENT_ACQUIRE ||
           method == METHOD_EVENTS_SUBSCRIBE;
}

void station_answer(struct station *station, const struct ticket *ticket, cJSON *result)
{
    struct line line;
    enum status s = stays_untold(ticket->method)
                        ? protocol_result(&ticket->id, result, &line)
                        : protocol_reply(station->protocol, &ticket->id, result, &line);
    answer_or_drop(station, ticket, s, &line);
}

void station_answer_text(struct station *station, const struct ticket *ticket, const char *result)
{
    struct line line;
    enum status s = protocol_reply_text(station->protocol, &ticket->id, result, &line);
    answer_or_drop(station, ticket, s, &line);
}

void station_refuse(struct station *station, const struct ticket *ticket,
                    const struct refusal *refusal)
{
    struct line line;
    station->counters.refused++;
    enum status s = protocol_refuse(station->protocol, &ticket->id, refusal, &line);
    answer_or_drop(station, ticket, s, &line);
}

void station_refuse_for(struct station *station, const struct ticket *ticket, enum reason reason,
                        const char *format, ...)
{
    struct refusal refusal;
    char detail[sizeof refusal.detail] = "";
    va_list arguments;
    if (format != NULL) {
        va_start(arguments, format);
        vsnprintf(detail, sizeof detail, format, arguments);
        va_end(arguments);
    }
    refusal_set(&refusal, reason, "%s", detail);
    station_refuse(station, ticket, &refusal);
}

/* ---- requests to their functions ---------------------------------------------------- */

static serve *const serves[METHODS] = {
    [METHOD_SESSION_OPEN] = serve_session_open,
    [METHOD_SESSION_CLOSE] = serve_session_close,
    [METHOD_INSTRUMENT_LIST] = serve_instrument_list,
    [METHOD_INSTRUMENT_ACQUIRE] = serve_instrument_acquire,
    [METHOD_INSTRUMENT_WITHDRAW] = serve_instrument_withdraw,
    [METHOD_INSTRUMENT_RENEW] = serve_instrument_renew,
    [METHOD_INSTRUMENT_RELEASE] = serve_instrument_release,
    [METHOD_INSTRUMENT_CONFIGURE] = serve_instrument_configure,
    [METHOD_INSTRUMENT_CALIBRATE] = serve_instrument_calibrate,
    [METHOD_MEASURE_START] = serve_measure_start,
    [METHOD_MEASURE_NEXT] = serve_measure_next,
    [METHOD_MEASURE_CANCEL] = serve_measure_cancel,
    [METHOD_MATCH_SPECTRUM] = serve_match_spectrum,
    [METHOD_RECORD_GET] = serve_record_get,
    [METHOD_RECORD_LIST] = serve_record_list,
    [METHOD_RECORD_EXPORT] = serve_record_export,
    [METHOD_RECORD_RECOMPUTE] = serve_record_recompute,
    [METHOD_SUBJECT_ADD] = serve_subject_add,
    [METHOD_SUBJECT_LIST] = serve_subject_list,
    [METHOD_SUBJECT_FORGET] = serve_subject_forget,
    [METHOD_SITE_LIST] = serve_site_list,
    [METHOD_TABLE_LIST] = serve_table_list,
    [METHOD_TABLE_INFO] = serve_table_info,
    [METHOD_STATUS_GET] = serve_status_get,
    [METHOD_METRICS_GET] = serve_metrics_get,
    [METHOD_RPC_DESCRIBE] = serve_rpc_describe,
    [METHOD_EVENTS_SUBSCRIBE] = serve_events_subscribe,
    [METHOD_STORE_VERIFY] = serve_store_verify,
    [METHOD_STORE_BEGIN_ANEW] = serve_store_begin_anew,
};

/* REASONS where nothing speaks against it. */
static enum reason why_not(const struct station *station, const struct client *client,
                           const struct request *request)
{
    if (station->stopping)
        return REASON_SHUTTING_DOWN;
    if (request->needs_session && !client->session)
        return REASON_SESSION_NEEDED;
    if (!client->peer.may || client->peer.right < request->right)
        return REASON_RIGHT_NEEDED;
    return client->open_requests >= STATION_OPEN_REQUESTS ? REASON_TOO_MANY_REQUESTS : REASONS;
}

void station_line(void *context, struct client *client, const char *line, size_t n)
{
    struct station *station = context;
    struct request request;
    struct refusal refusal;
    json_memory_begin();
    bool good = protocol_read(station->protocol, line, n, &request, &refusal);
    struct ticket ticket = ticket_of(client, &request);
    enum reason reason = good ? why_not(station, client, &request) : REASONS;
    client->open_requests++; /* the answer takes it back */
    if (!good) {
        station_refuse(station, &ticket, &refusal);
        return;
    }
    station->counters.requests[request.method]++;
    params_lower_uuids(&request);
    if (reason != REASONS)
        station_refuse_for(station, &ticket, reason, NULL);
    else
        serves[request.method](station, client, &request);
    request_done(&request);
}

/* ---- events ------------------------------------------------------------------------- */

struct telling {
    unsigned topic_bit;
    struct line line;
};

static void note_hearer(void *context, struct client *client)
{
    *(unsigned *)context |= client->session ? client->topics : 0;
}

static void tell(void *context, struct client *client)
{
    const struct telling *telling = context;
    if (client->session && (client->topics & telling->topic_bit) != 0)
        client_send(client, &telling->line);
}

/* Before there is a listener, events count too: a subscriber may ask for them. */
static void send_event(struct station *station, const struct event *event)
{
    struct telling telling = { .topic_bit = 1u << event->topic };
    unsigned heard = 0;
    if (station->clients != NULL)
        clients_each(station->clients, note_hearer, &heard);
    if ((heard & telling.topic_bit) == 0 || protocol_event(event, &telling.line) != STATUS_OK)
        return;
    clients_each(station->clients, tell, &telling);
    free(telling.line.text);
}

static void lose_event(enum event_topic topic, const char *type, enum status s)
{
    log_error("station: event %s/%s is lost: %s", event_topic_name(topic), type, status_text(s));
}

void station_tell_text(struct station *station, enum event_topic topic, const char *type,
                       const char *data)
{
    enum status s = events_add(&station->events, topic, type, data, NULL);
    if (s != STATUS_OK) {
        lose_event(topic, type, s);
        return;
    }
    station->counters.events++;
    send_event(station, events_last(&station->events));
}

void station_tell(struct station *station, enum event_topic topic, const char *type, cJSON *data)
{
    char *text;
    enum status s = STATUS_NO_MEMORY;
    if (!json_memory_was_short())
        s = json_print(data, PROTOCOL_MAX_LINE / 2, &text, NULL);
    json_memory_begin();
    cJSON_Delete(data);
    if (s != STATUS_OK) {
        lose_event(topic, type, s);
        return;
    }
    station_tell_text(station, topic, type, text);
    free(text);
}

/* ---- tables ------------------------------------------------------------------------- */

struct parked {
    struct parked *next;
    uint64_t client;
    struct request request;
};

enum status station_table(struct station *station, const char *name, struct loaded_table **ret,
                          struct refusal *refusal)
{
    switch (tables_get(station->tables, name, ret)) {
    case TABLES_READY:
        return STATUS_OK;
    case TABLES_LOADING:
    case TABLES_AVAILABLE:
        return STATUS_CANCELLED;
    case TABLES_FAILED:
        refusal_set(refusal, REASON_TABLE_UNSUITABLE, "%s", tables_error(station->tables, name));
        return STATUS_NOT_FOUND;
    default:
        refusal_set(refusal, name == NULL ? REASON_TABLE_MISSING : REASON_TABLE_UNKNOWN, "%s",
                    name == NULL ? tables_error(station->tables, NULL) : "");
        return STATUS_NOT_FOUND;
    }
}

void station_park(struct station *station, const struct client *client, struct request *request)
{
    struct parked **end = &station->parked, *parked = malloc(sizeof *parked);
    if (parked == NULL) {
        struct ticket ticket = ticket_of(client, request);
        station_refuse_for(station, &ticket, REASON_NO_MEMORY, NULL);
        return;
    }
    *parked = (struct parked){ .client = client->number, .request = *request };
    request->tree = NULL; /* ours now */
    while (*end != NULL)
        end = &(*end)->next;
    *end = parked;
}

static void unpark(struct station *station, struct parked *parked, bool serve_it)
{
    struct client *client = clients_find(station->clients, parked->client);
    if (client != NULL && serve_it) {
        serves[parked->request.method](station, client, &parked->request);
    } else if (client != NULL) {
        struct ticket ticket = ticket_of(client, &parked->request);
        station_refuse_for(station, &ticket, REASON_SHUTTING_DOWN, NULL);
    }
    request_done(&parked->request);
    free(parked);
}

static void unpark_all(struct station *station, bool serve_them)
{
    struct parked *list = station->parked;
    station->parked = NULL; /* one that still has to wait parks again */
    while (list != NULL) {
        struct parked *next = list->next;
        unpark(station, list, serve_them);
        list = next;
    }
}

static int on_unpark(sd_event_source *source, void *userdata)
{
    (void)source;
    unpark_all(userdata, true);
    return 0;
}

/* Soon: whoever says so may be in the middle of something. */
void station_serve_parked(struct station *station)
{
    if (station->parked != NULL)
        sd_event_source_set_enabled(station->unpark, SD_EVENT_ONESHOT);
}

static const char *const table_state_names[] = { "ready", "loading", "loading", "failed",
                                                 "missing" };

void station_table_changed(void *context, const char *name)
{
    struct station *station = context;
    if (strcmp(name, station->settings->table) == 0) {
        enum tables_state state = tables_look(station->tables, NULL);
        cJSON *data = cJSON_CreateObject();
        cJSON_AddStringToObject(data, "table", table_state_names[state]);
        if (state == TABLES_FAILED || state == TABLES_UNKNOWN)
            cJSON_AddStringToObject(data, "error", tables_error(station->tables, NULL));
        station_tell(station, EVENT_STORE, "table", data);
    }
    station_serve_parked(station);
    for (size_t i = 0; i < station->benches_n; i++)
        run_table_changed(station->benches[i]);
}

/* ---- life --------------------------------------------------------------------------- */

static int on_inbox(sd_event_source *source, int fd, uint32_t events, void *userdata)
{
    struct station *station = userdata;
    (void)source;
    (void)fd;
    (void)events;
    inbox_drain(&station->inbox);
    return 0;
}

/* Before the loop looks for what is next: what was asked of the writer meanwhile. */
static int before_next(sd_event_source *source, void *userdata)
{
    struct station *station = userdata;
    (void)source;
    writer_hand_over(station->writer);
    return 0;
}

static bool watch_inbox(struct station *station)
{
    sd_event_source *source = NULL;
    bool good = sd_event_add_io(station->event, &source, station->inbox.fd, EPOLLIN, on_inbox,
                                station) >= 0 &&
                sd_event_source_set_prepare(source, before_next) >= 0 &&
                sd_event_source_set_floating(source, 1) >= 0;
    sd_event_source_unref(source); /* floating: it is the loop's now */
    return good;
}

/* The kernel makes it anew with every start of the machine: CLOCK_BOOTTIME counts from there. */
static void read_machine_boot(char text[UUID_TEXT_SIZE])
{
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "re");
    char line[64] = "";
    if (file != NULL && fgets(line, sizeof line, file) != NULL)
        line[strcspn(line, "\n")] = '\0';
    if (file != NULL)
        fclose(file);
    snprintf(text, UUID_TEXT_SIZE, "%.36s", line);
    if (uuid_is_text(text))
        return;
    text[0] = '\0'; /* records then do not tell which start their boottime_ms counts from */
    log_warning("station: the machine does not tell its boot id");
}

static enum status open_tables(struct station *station)
{
    static char beside_state[SETTINGS_PATH_SIZE + 16];
    snprintf(beside_state, sizeof beside_state, "%s/tables", station->settings->state);
    struct tables_settings settings = {
        .default_name = station->settings->table,
        .queue = worker_queue(station->chores),
        .changed = station_table_changed,
        .context = station,
    };
    size_t n = 0;
    if (station->settings->tables != NULL)
        settings.folder[n++] = station->settings->tables;
    settings.folder[n++] = beside_state;
    settings.folder[n++] = "/var/lib/skinspec/tables";
    settings.folder[n++] = "build/tables";
    return tables_open(&settings, &station->tables);
}

enum status station_open(struct station *station)
{
    const struct settings *settings = station->settings;
    station->started_ms = clock_boottime_ms();
    events_init(&station->events);
    read_machine_boot(station->machine_boot);
    enum status s = inbox_init(&station->inbox);
    station->is_open = s == STATUS_OK;
    if (s == STATUS_OK)
        s = uuid4_make(station->boot);
    if (s == STATUS_OK)
        s = protocol_open(&station->protocol);
    if (s == STATUS_OK)
        s = station_claim_store(station);
    if (s == STATUS_OK)
        s = worker_open(settings->state, false, &station->inbox, &station->reader);
    if (s == STATUS_OK)
        s = worker_open(settings->state, true, &station->inbox, &station->chores);
    if (s == STATUS_OK)
        s = open_tables(station);
    if (s == STATUS_OK)
        s = seats_open(station);
    if (s == STATUS_OK &&
        (!watch_inbox(station) ||
         sd_event_add_defer(station->event, &station->unpark, on_unpark, station) < 0))
        s = STATUS_NO_MEMORY;
    return s;
}

/* ---- clients come and go ------------------------------------------------------------ */

static bool greet(void *context, struct client *client)
{
    struct station *station = context;
    const struct hello hello = { .server = "skinspecd " SKINSPEC_VERSION,
                                 .station_id = station->store.station_id,
                                 .boot = station->boot };
    struct line line;
    if (protocol_hello(&hello, &line) != STATUS_OK)
        return false;
    send_and_free(client, &line);
    return true;
}

static void gone(void *context, struct client *client)
{
    bench_leave_all(context, client);
}

enum status station_listen(struct station *station, int listener_fd)
{
    const char *const group[RIGHTS] = { [RIGHT_KIOSK] = station->settings->kiosk_group,
                                        [RIGHT_CLINIC] = station->settings->clinic_group,
                                        [RIGHT_ADMIN] = station->settings->admin_group };
    struct clients_settings settings = {
        .event = station->event,
        .listener_fd = listener_fd,
        .max = station->settings->max_clients,
        .max_per_user = station->settings->max_per_user,
        .max_per_process = station->settings->max_per_process,
        .protocol = station->protocol,
        .greet = greet,
        .line = station_line,
        .gone = gone,
        .context = station,
    };
    rights_init(&settings.rights, group);
    enum status s = clients_open(&settings, &station->clients);
    if (s == STATUS_OK)
        station_look_at_store(station); /* ready is told when it is: the socket is there before */
    return s;
}

void station_stop(struct station *station)
{
    station->stopping = true;
    clients_stop_accepting(station->clients);
    for (size_t i = 0; i < station->benches_n; i++) {
        struct bench *bench = station->benches[i];
        if (bench->run != NULL)
            run_end(bench, bench->run->record->fence, RUN_STOPPING);
        if (bench->at_work)
            bench_cancel(bench);
        bench_send_queue_away(bench);
    }
    unpark_all(station, false);
}

static void note_busy(void *context, struct client *client)
{
    bool *quiet = context;
    *quiet = *quiet && client->open_requests == 0 && connection_unsent(&client->connection) == 0;
}

bool station_is_quiet(struct station *station)
{
    bool quiet = true;
    for (size_t i = 0; i < station->benches_n; i++)
        quiet = quiet && station->benches[i]->run == NULL && !station->benches[i]->at_work;
    clients_each(station->clients, note_busy, &quiet);
    return quiet;
}

/* What is done may ask for more, which then ends at once. */
static void drain(struct station *station)
{
    while (inbox_has_jobs(&station->inbox))
        inbox_drain(&station->inbox);
}

/* Those who ask before those who are asked. */
static bool stop_threads(struct station *station)
{
    bool all = seats_stop(station, STOP_PATIENCE_MS);
    drain(station);
    worker_stop(station->reader);
    worker_stop(station->chores);
    drain(station);
    writer_stop(station->writer);
    drain(station);
    return all;
}

void station_close(struct station *station)
{
    bool all_ended = !station->is_open || stop_threads(station);
    if (station->clients != NULL)
        unpark_all(station, false); /* while there is somebody to tell */
    clients_close(station->clients);
    store_claim_release(station->claim);
    if (!all_ended) /* a thread still uses what follows; the process ends anyway */
        return;
    seats_close(station);
    for (size_t i = 0; i < station->benches_n; i++)
        bench_close(station->benches[i]);
    tables_close(station->tables);
    sd_event_source_disable_unref(station->unpark);
    worker_close(station->reader);
    worker_close(station->chores);
    writer_close(station->writer);
    station_free_records(station);
    events_done(&station->events);
    protocol_close(station->protocol);
    if (station->is_open)
        inbox_done(&station->inbox);
}
