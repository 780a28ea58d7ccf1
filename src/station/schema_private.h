/* schema_private.h - the tree that a schema is compiled to, and the place in a value that a
 * message names: for the files of station/schema.h only. */
#ifndef SKINSPEC_STATION_SCHEMA_PRIVATE_H
#define SKINSPEC_STATION_SCHEMA_PRIVATE_H

#include <stddef.h>

#include "station/schema.h"

enum schema_type { TYPE_STRING, TYPE_INTEGER, TYPE_NUMBER, TYPE_BOOLEAN, TYPE_OBJECT, TYPE_ARRAY };
enum { SCHEMA_TYPES = 6 };

/* Integers beyond are not told apart by a double. */
#define SCHEMA_MAX_INTEGER 9007199254740991.0

struct schema_format {
    const char *name;
    bool (*check)(const char *text);
    const char *expected;
};

struct schema {
    enum schema_type type;
    const cJSON *choices;                     /* array of strings, or NULL */
    size_t min_length, max_length, max_bytes; /* strings */
    const struct schema_format *format;       /* or NULL */
    double minimum, maximum;                  /* numbers */
    struct schema *items;                     /* arrays */
    size_t min_items, max_items;
    bool unique;
    struct schema_property *properties; /* objects; [n] */
    size_t n;
    bool closed;         /* no other members */
    struct schema **any; /* [any_n], of different types; then nothing above is looked at */
    size_t any_n;
};

struct schema_property {
    const char *name;
    bool required;
    struct schema *schema;
};

struct schema_place {
    const struct schema_place *above;
    const char *name; /* NULL: an index */
    size_t index;
};

/* false, and *error says where and what. */
bool schema_fail(struct schema_error *error, const struct schema_place *place, const char *format,
                 ...) __attribute__((format(printf, 3, 4)));

/* NULL where there is none of that name. */
struct schema_property *schema_property_of(const struct schema *s, const char *name);

/* By its name in "format"; NULL where there is none. */
const struct schema_format *schema_format_of(const char *name);

#endif
