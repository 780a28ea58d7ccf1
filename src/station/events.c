/* events.c - the ring: event number n stands at place n modulo its size. */
#include "station/events.h"

#include <stdlib.h>
#include <string.h>

static const char *const topic_names[EVENT_TOPICS] = { "instrument", "calibration", "lease",
                                                       "measurement", "store" };

const char *event_topic_name(enum event_topic topic)
{
    return topic_names[topic];
}

enum status event_topic_parse(const char *text, enum event_topic *ret)
{
    for (size_t i = 0; i < EVENT_TOPICS; i++) {
        if (strcmp(topic_names[i], text) == 0) {
            *ret = (enum event_topic)i;
            return STATUS_OK;
        }
    }
    return STATUS_NOT_FOUND;
}

void events_init(struct events *events)
{
    memset(events, 0, sizeof *events);
}

void events_done(struct events *events)
{
    for (size_t i = 0; i < EVENTS_KEPT; i++)
        free(events->kept[i].data);
    events_init(events);
}

enum status events_add(struct events *events, enum event_topic topic, const char *type,
                       const char *data, int64_t *ret)
{
    char *copy = strdup(data);
    if (copy == NULL)
        return STATUS_NO_MEMORY;
    int64_t seq = events->last_seq + 1;
    struct event *place = &events->kept[seq % EVENTS_KEPT];
    free(place->data);
    place->seq = seq;
    place->topic = topic;
    place->type = type;
    place->data = copy;
    events->last_seq = seq;
    if (ret != NULL)
        *ret = seq;
    return STATUS_OK;
}

const struct event *events_last(const struct events *events)
{
    return &events->kept[events->last_seq % EVENTS_KEPT];
}

bool events_since(const struct events *events, int64_t since_seq, unsigned topics,
                  event_visit *visit, void *context)
{
    int64_t oldest = events->last_seq < EVENTS_KEPT ? 1 : events->last_seq - EVENTS_KEPT + 1;
    bool foreign = since_seq < 0 || since_seq > events->last_seq;
    bool lost = foreign || since_seq < oldest - 1;
    for (int64_t seq = lost ? oldest : since_seq + 1; seq <= events->last_seq; seq++) {
        const struct event *event = &events->kept[seq % EVENTS_KEPT];
        if (topics & 1u << event->topic)
            visit(context, event);
    }
    return lost;
}
