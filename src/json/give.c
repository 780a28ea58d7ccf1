/* give.c - cJSON_AddItemTo...(), and the end of what it did not take. */
#include "json/give.h"

void json_give_member(cJSON *object, const char *name, cJSON *value)
{
    if (!cJSON_AddItemToObject(object, name, value))
        cJSON_Delete(value);
}

void json_give_item(cJSON *array, cJSON *value)
{
    if (!cJSON_AddItemToArray(array, value))
        cJSON_Delete(value);
}
