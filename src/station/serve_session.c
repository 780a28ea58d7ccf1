/* serve_session.c - session.open, session.close, events.subscribe. */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "json/give.h"
#include "station/bench.h"
#include "station/params.h"
#include "station/serve.h"
#include "station/strict_json.h"
#include "station/ticket.h"

void serve_session_open(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    int64_t major = params_integer(request, "major", 0);
    if (client->session) {
        station_refuse_for(station, &ticket, REASON_SESSION_EXISTS, NULL);
        return;
    }
    if (major != PROTOCOL_MAJOR) {
        station_refuse_for(station, &ticket, REASON_PROTOCOL_VERSION,
                           "the station speaks %d, the client %d", PROTOCOL_MAJOR, (int)major);
        return;
    }
    params_copy(request, "client", client->name, sizeof client->name);
    params_copy(request, "operator", client->operator_name, sizeof client->operator_name);
    client->session = true;
    log_debug("station: session of '%s', process %d, user %u", client->name, (int)client->peer.pid,
              (unsigned)client->peer.uid);
    cJSON *result = cJSON_CreateObject(), *version = cJSON_AddObjectToObject(result, "protocol");
    cJSON_AddNumberToObject(version, "major", PROTOCOL_MAJOR);
    cJSON_AddNumberToObject(version, "minor", PROTOCOL_MINOR);
    cJSON_AddStringToObject(result, "right", right_name(client->peer.right));
    cJSON_AddNumberToObject(result, "connection", (double)client->number);
    cJSON_AddNumberToObject(result, "event_seq", (double)station->events.last_seq);
    station_answer(station, &ticket, result);
}

void serve_session_close(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    bench_leave_all(station, client);
    client->session = false;
    cJSON *result = cJSON_CreateObject();
    cJSON_AddTrueToObject(result, "closed");
    station_answer(station, &ticket, result);
    client_leave(client);
}

/* ---- events ------------------------------------------------------------------------- */

static void send_kept(void *context, const struct event *event)
{
    struct client *client = context;
    struct line line;
    if (protocol_event(event, &line) != STATUS_OK) {
        client_leave(client); /* a gap would go unnoticed */
        return;
    }
    client_send(client, &line);
    free(line.text);
}

static void nothing(void *context, const struct event *event)
{
    (void)context;
    (void)event;
}

static void send_lost(struct station *station, struct client *client, int64_t since_seq)
{
    struct line line;
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "since_seq", (double)since_seq);
    cJSON_AddNumberToObject(params, "next_seq", (double)(station->events.last_seq + 1));
    json_give_member(params, "snapshot", status_json(station));
    if (protocol_notify(NOTIFICATION_EVENTS_LOST, params, &line) != STATUS_OK) {
        client_leave(client);
        return;
    }
    client_send(client, &line);
    free(line.text);
}

static unsigned topics_of(const struct request *request)
{
    const cJSON *names = strict_json_member(request->params, "topics"), *name;
    unsigned topics = 0;
    cJSON_ArrayForEach(name, names)
    {
        enum event_topic topic;
        if (event_topic_parse(name->valuestring, &topic) == STATUS_OK)
            topics |= 1u << topic;
    }
    return topics;
}

void serve_events_subscribe(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    int64_t last = station->events.last_seq;
    int64_t since = params_integer(request, "since_seq", last);
    client->topics = topics_of(request);
    bool lost = events_since(&station->events, since, 0, nothing, NULL);
    client_end_turn(client); /* a thousand events may follow */
    cJSON *result = cJSON_CreateObject();
    cJSON_AddStringToObject(result, "boot", station->boot);
    cJSON_AddNumberToObject(result, "event_seq", (double)last);
    cJSON_AddBoolToObject(result, "resumed", !lost);
    station_answer(station, &ticket, result); /* before the events */
    if (lost)
        send_lost(station, client, since);
    else
        events_since(&station->events, since, client->topics, send_kept, client);
}
