/* protocol_rules.h - of the compiled description, what lines are written from; for protocol.c and
 * protocol_lines.c. */
#ifndef SKINSPEC_STATION_PROTOCOL_RULES_H
#define SKINSPEC_STATION_PROTOCOL_RULES_H

#include <stdbool.h>

#include "station/protocol.h"

struct reason_rules {
    int code;
    bool retryable;
    const char *meaning, *hint;
};

const struct reason_rules *protocol_reason_rules(const struct protocol *protocol,
                                                 enum reason reason);
const char *notification_name(enum notification notification); /* never NULL */

#endif
