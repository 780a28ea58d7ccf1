/* ticket.c - the answer is made for the id, and given to the client if it is there. */
#include "station/ticket.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "station/station.h"

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
