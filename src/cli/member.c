/* member.c - look-ups that cannot fail. */
#include "cli/member.h"

#include <math.h>

const cJSON *member(const cJSON *object, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(object, name);
}

const char *member_text(const cJSON *object, const char *name)
{
    const char *text = cJSON_GetStringValue(member(object, name));
    return text != NULL ? text : "";
}

double member_number(const cJSON *object, const char *name)
{
    const cJSON *value = member(object, name);
    return cJSON_IsNumber(value) ? value->valuedouble : NAN;
}

int64_t member_integer(const cJSON *object, const char *name)
{
    double x = member_number(object, name);
    return fabs(x) < 9007199254740992.0 ? (int64_t)x : 0; /* 2^53; NAN is 0 too */
}

bool member_true(const cJSON *object, const char *name)
{
    return cJSON_IsTrue(member(object, name));
}
