/* schema.h - JSON values against a schema, compiled once.
 *
 * The subset of JSON Schema 2020-12 that protocol.schema.json is written in; any other
 * keyword is refused when it is compiled, so that a typo cannot loosen a check.
 *
 *   for                keywords
 *   any value          type (one of string, integer, number, boolean, object, array),
 *                      $ref to #/$defs/NAME: it may have the four last beside it, no cycles;
 *                      anyOf, of schemas of different types, in place of type: the value's own
 *                      type says which of them it is held to
 *   string             enum; minLength, maxLength in characters; format
 *   integer, number    minimum, maximum.  5.0 is an integer; 2^53 and above is none
 *   object             properties, required, additionalProperties (false, or absent)
 *   array              items, minItems, maxItems, uniqueItems (of strings)
 *   ours               maxBytes of a string as UTF-8
 *   for people         description, unit, when (why a member may be absent), title
 *
 *   format             a string that is
 *   uuid               32 hexadecimal digits of either case and four dashes
 *   sha256             64 hexadecimal digits, lower case
 *   date-time          RFC 3339 in UTC: 2031-05-06T07:08:09.123Z, fraction optional
 *   token              letters, digits and _
 *   name               letters, digits, - and _, no - at the front: never a path or an option
 *   text               one line without control characters
 *   notes              text that may have line feeds and tabs */
#ifndef SKINSPEC_STATION_SCHEMA_H
#define SKINSPEC_STATION_SCHEMA_H

#include <cjson/cJSON.h>
#include <stdbool.h>

#include "base/status.h"

enum { SCHEMA_PATH_SIZE = 128, SCHEMA_WHAT_SIZE = 512 };

struct schema;

/* Where a value is wrong and what was expected: "/params/k", "must be an integer from 1
 * to 1000".  Of the value itself at most STRICT_JSON_ECHO bytes are shown.  A member that
 * is not known or missing is named in what[], and the path is that of its object. */
struct schema_error {
    char path[SCHEMA_PATH_SIZE]; /* JSON Pointer, cut where it is too long */
    char what[SCHEMA_WHAT_SIZE];
};

/* defs: the object that #/$defs/ points into, may be NULL.  Both must outlive the schema.
 * closed: objects that list properties have no others, whatever they say: for checking
 * what we send.  STATUS_FORMAT, with *error saying where and why; STATUS_NO_MEMORY. */
enum status schema_compile(const cJSON *json, const cJSON *defs, bool closed, struct schema **ret,
                           struct schema_error *error);
void schema_close(struct schema *schema); /* takes NULL */

/* Whether the value is as the schema says; *error is filled where it is not.  at: the
 * value's own path, "/params". */
bool schema_check(const struct schema *schema, const cJSON *value, const char *at,
                  struct schema_error *error);

#endif
