/* give.h - a value given to an object or an array, which it belongs to from then on.
 *
 * Unlike cJSON_AddItemToObject() and cJSON_AddItemToArray(): where it cannot be taken (one of the
 * two was not made, or there is no memory for the name) it is deleted, not lost.  That memory was
 * short is seen by json_memory_was_short(). */
#ifndef SKINSPEC_JSON_GIVE_H
#define SKINSPEC_JSON_GIVE_H

#include <cjson/cJSON.h>

/* Any of the two may be NULL: then nothing is given. */
void json_give_member(cJSON *object, const char *name, cJSON *value);
void json_give_item(cJSON *array, cJSON *value);

#endif
