/* maker.h - an object or an array made member by member; a failure sticks and is seen at the end.
 *
 *     struct maker m = maker_begin();
 *     maker_number(&m, "Cm", 0.03);
 *     return maker_end(&m, &object);
 *
 * STATUS_RANGE where a number that is always present is not finite, STATUS_NO_MEMORY; whatever
 * happens, values that are given away are gone. */
#ifndef SKINSPEC_JSON_MAKER_H
#define SKINSPEC_JSON_MAKER_H

#include <cjson/cJSON.h>
#include <stddef.h>

#include "base/status.h"

struct maker {
    cJSON *object;
    enum status status; /* the first that was not STATUS_OK */
};

struct maker maker_begin(void);
struct maker maker_begin_array(void);

/* *ret is set with STATUS_OK only; else what was made is deleted. */
enum status maker_end(struct maker *m, cJSON **ret);

void maker_fail(struct maker *m, enum status status);

/* Given away; NULL is no memory. */
void maker_put(struct maker *m, const char *name, cJSON *value);
void maker_append(struct maker *m, enum status s, cJSON *value);

/* What another function made, or its status; an object or an array that was filled likewise. */
void maker_made(struct maker *m, const char *name, enum status s, cJSON *made);
void maker_nested(struct maker *m, const char *name, struct maker *filled);

/* `known`: NAN and "" are left out. */
void maker_number(struct maker *m, const char *name, double x);
void maker_known_number(struct maker *m, const char *name, double x);
void maker_numbers(struct maker *m, const char *name, const double *x, size_t n);
void maker_text(struct maker *m, const char *name, const char *text);
void maker_known_text(struct maker *m, const char *name, const char *text);

#endif
