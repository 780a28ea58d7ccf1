/* member.h - members of an object that the station sent.  One that is absent, or of
 * another type, is "", NAN, false or NULL; so are those of an object that is NULL. */
#ifndef SKINSPEC_CLI_MEMBER_H
#define SKINSPEC_CLI_MEMBER_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stdint.h>

const cJSON *member(const cJSON *object, const char *name);
const char *member_text(const cJSON *object, const char *name);
double member_number(const cJSON *object, const char *name);
int64_t member_integer(const cJSON *object, const char *name); /* 0 where absent */
bool member_true(const cJSON *object, const char *name);

#endif
