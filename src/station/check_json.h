/* check_json.h - checks and check tiles as the objects of the protocol.  What could not be made
 * for want of memory is seen by json/memory.h, as elsewhere. */
#ifndef SKINSPEC_STATION_CHECK_JSON_H
#define SKINSPEC_STATION_CHECK_JSON_H

#include <cjson/cJSON.h>

#include "db/store_check.h"

cJSON *check_json(const struct store_check *check);
cJSON *check_tile_json(const struct store_check_tile *tile);

#endif
