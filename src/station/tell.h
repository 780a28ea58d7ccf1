/* tell.h - events to those who subscribed to their topic. */
#ifndef SKINSPEC_STATION_TELL_H
#define SKINSPEC_STATION_TELL_H

#include <cjson/cJSON.h>

#include "station/events.h"

struct station;

/* An event for all who subscribed to its topic; data is given away.  type is a constant. */
void station_tell(struct station *station, enum event_topic topic, const char *type, cJSON *data);
void station_tell_text(struct station *station, enum event_topic topic, const char *type,
                       const char *data); /* JSON already */

#endif
