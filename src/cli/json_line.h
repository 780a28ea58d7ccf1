/* json_line.h - an object of a line, taken apart in place: its members as texts, nothing made.
 *
 * station/strict_json says whether a line is one JSON value; this is for a line that is. */
#ifndef SKINSPEC_CLI_JSON_LINE_H
#define SKINSPEC_CLI_JSON_LINE_H

#include <stdbool.h>
#include <stddef.h>

#include "station/strict_json.h"

struct json_member {
    const char *name; /* escapes resolved */
    char *value;      /* n bytes of JSON, as they stand there, and a NUL */
    size_t n;
};

struct json_line {
    size_t n;
    struct json_member member[STRICT_JSON_MAX_MEMBERS];
};

/* Take an object apart: n bytes that strict_json_check() finds fine, between which NULs are put.
 * False, and nothing done, where the value is no object. */
bool json_line_split(char *text, size_t n, struct json_line *ret);

/* NULL where there is none of that name. */
struct json_member *json_line_member(struct json_line *line, const char *name);

/* What a member is. */
bool json_member_is_text(const struct json_member *member);
bool json_member_is_number(const struct json_member *member);

/* The text of a string, escapes resolved, in place of it.  The member's value is then no more. */
const char *json_member_text(struct json_member *member);

/* Each item of an array in turn: *at is the array's value at first, then past the item that was
 * given; its length in *n.  NULL at the end. */
const char *json_item_next(const char **at, size_t *n);

#endif
