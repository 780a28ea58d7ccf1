/* params.h - members of a request that was checked against the description. */
#ifndef SKINSPEC_STATION_PARAMS_H
#define SKINSPEC_STATION_PARAMS_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/spectrum.h"
#include "match/nearest.h"
#include "match/refined_match.h"
#include "plan/scene.h"
#include "station/protocol.h"

const char *params_text(const struct request *request, const char *name); /* NULL: absent */
double params_number(const struct request *request, const char *name, double absent);
int64_t params_integer(const struct request *request, const char *name, int64_t absent);
bool params_is_true(const struct request *request, const char *name); /* absent: false */
bool params_has(const struct request *request, const char *name);

/* Text into room that the description's maxBytes fits; "" where it is absent. */
void params_copy(const struct request *request, const char *name, char *into, size_t size);

/* Ids as they are kept: hexadecimal digits of either case are the same id. */
void params_lower_uuids(struct request *request);

enum specular params_specular(const struct request *request);
bool params_by(const struct request *request, enum match_by *ret); /* false: absent */

/* refine, noise, placement, fix.  False with *refusal where one of the last three is there without
 * the first. */
bool params_wish(const struct request *request, struct refine_wish *ret, struct refusal *refusal);

/* `scene`; *has: whether there is one.  False, with *refusal, for one that is none, contradicts
 * itself, or stands beside what belongs into it. */
bool params_scene(const struct request *request, struct scene *ret, bool *has,
                  struct refusal *refusal);

/* params_invalid at /params/scene. */
void params_refuse_scene(struct refusal *refusal, const char *why);

/* SHA-256 of what is asked, to tell a retry from another request with the same uuid: all
 * members but `lease` and `uuid`, whatever their order.  STATUS_NO_MEMORY. */
enum status params_sha256(const struct request *request, char hex[65]);

#endif
