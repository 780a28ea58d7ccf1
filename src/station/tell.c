/* tell.c - an event into the ring, and one line for all who hear it. */
#include "station/tell.h"

#include <stdlib.h>

#include "base/log.h"
#include "json/memory.h"
#include "json/print.h"
#include "station/station.h"

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
