/* strict_json.h - the front door for text of a client: what becomes a cJSON tree.
 *
 * [R8259] RFC 8259, The JavaScript Object Notation, 2017.
 *
 * cJSON's parser takes what we do not want: 1e400, names given twice, garbage after the value,
 * bytes that are no UTF-8, control characters in strings, 01.  So the text is read here, in
 * one pass; what passes means the same to everybody, cJSON's parser included, which is
 * what the tree is tested against. */
#ifndef SKINSPEC_STATION_STRICT_JSON_H
#define SKINSPEC_STATION_STRICT_JSON_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "base/status.h"

enum {
    STRICT_JSON_MAX_DEPTH = 16,    /* objects and arrays within each other */
    STRICT_JSON_MAX_MEMBERS = 128, /* of one object: names are compared each with each */
    STRICT_JSON_MAX_NUMBER = 63,   /* bytes of one number: cJSON's own buffer */
};

enum strict_json_fault {
    STRICT_JSON_FINE,
    STRICT_JSON_UTF8,      /* not well-formed UTF-8 */
    STRICT_JSON_NUL,       /* a NUL byte or \u0000 */
    STRICT_JSON_SYNTAX,    /* not [R8259], a lone surrogate, or something after the value */
    STRICT_JSON_DUPLICATE, /* a name twice in one object, once escapes are resolved */
    STRICT_JSON_DEPTH,
    STRICT_JSON_MEMBERS,
    STRICT_JSON_NUMBER, /* beyond a double, or longer than STRICT_JSON_MAX_NUMBER */
};

/* Whether n bytes are exactly one JSON value and white space around it, without an
 * allocation.  *offset (may be
 * NULL) is the byte where the first fault was seen. */
enum strict_json_fault strict_json_check(const char *text, size_t n, size_t *offset);

/* The value as a tree, the same as of cJSON_ParseWithLength(): STATUS_FORMAT with *fault and
 * *offset, as strict_json_check() has them, or STATUS_NO_MEMORY.  The value is given back by
 * cJSON_Delete(). */
enum status strict_json_parse(const char *text, size_t n, cJSON **ret,
                              enum strict_json_fault *fault, size_t *offset);

/* Member of an object, by its name exactly; NULL where there is none. */
const cJSON *strict_json_member(const cJSON *object, const char *name);

/* A client's text to be shown to a person: at most STRICT_JSON_ECHO bytes of it, cut
 * between characters ("..." says so), in quotes; control characters, marks that turn the
 * direction of writing, quotes and backslashes as \uXXXX, so that it
 * cannot steer a terminal or pretend to be ours. */
enum { STRICT_JSON_ECHO = 64, STRICT_JSON_ECHO_SIZE = 6 * STRICT_JSON_ECHO + 6 };
const char *strict_json_echo(const char *text, char into[STRICT_JSON_ECHO_SIZE]);

#endif
