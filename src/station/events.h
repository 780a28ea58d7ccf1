/* events.h - what happened, numbered, kept for those who come back.
 *
 * A ring of the last EVENTS_KEPT events.  Numbers run from 1 without a gap and
 * start anew with each boot of the daemon.  A subscriber that returns with the last
 * number it saw gets what it missed; where the ring has gone past it, it is told
 * so and needs a fresh snapshot. */
#ifndef SKINSPEC_STATION_EVENTS_H
#define SKINSPEC_STATION_EVENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum { EVENTS_KEPT = 1024 };

enum event_topic {
    EVENT_INSTRUMENT,
    EVENT_CALIBRATION,
    EVENT_LEASE,
    EVENT_MEASUREMENT,
    EVENT_STORE,
    EVENT_TOPICS
};

/* "instrument" ... "store"; anything else is STATUS_NOT_FOUND. */
const char *event_topic_name(enum event_topic topic);
enum status event_topic_parse(const char *text, enum event_topic *ret);

struct event {
    int64_t seq;
    enum event_topic topic;
    const char *type; /* a constant, "waiting" */
    char *data;       /* JSON object, owned by the ring */
};

struct events {
    struct event kept[EVENTS_KEPT];
    int64_t last_seq; /* 0 before the first */
};

void events_init(struct events *events);
void events_done(struct events *events);

/* Add an event; data is copied.  *ret (may be NULL) is its number.
 * STATUS_NO_MEMORY: nothing was added. */
enum status events_add(struct events *events, enum event_topic topic, const char *type,
                       const char *data, int64_t *ret);

/* The newest; there is one. */
const struct event *events_last(const struct events *events);

/* Those after since_seq on the topics of the mask (1 << topic), oldest first.  True
 * where some between since_seq and the oldest kept one are gone, whatever their
 * topic, or where since_seq was never given out (another boot's). */
typedef void event_visit(void *context, const struct event *event);
bool events_since(const struct events *events, int64_t since_seq, unsigned topics,
                  event_visit *visit, void *context);

#endif
