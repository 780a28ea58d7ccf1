/* taker.h - members of an object one by one; a failure sticks and is seen at the end.
 *
 *     struct taker t = { object, false };
 *     double Cm = taker_number(&t, "Cm");
 *     return t.failed ? STATUS_FORMAT : STATUS_OK;
 *
 * `known`: a member that is absent is NAN or "", and no failure.  Names in their own case. */
#ifndef SKINSPEC_JSON_TAKER_H
#define SKINSPEC_JSON_TAKER_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct taker {
    const cJSON *object; /* NULL: has no members */
    bool failed;
};

const cJSON *taker_member(const struct taker *t, const char *name); /* NULL: absent */

double taker_number(struct taker *t, const char *name);
double taker_known_number(struct taker *t, const char *name);

/* One that a double holds; others are a failure and 0. */
int64_t taker_integer(struct taker *t, const char *name);

/* A text that is too long for into[size] is a failure. */
void taker_text(struct taker *t, const char *name, char *into, size_t size);
void taker_known_text(struct taker *t, const char *name, char *into, size_t size);

/* Numbers of an array, at most max; how many. */
size_t taker_numbers(struct taker *t, const char *name, double *into, size_t max);

/* A member as JSON text again; into[] stays as it is where it is absent. */
void taker_json(struct taker *t, const char *name, char *into, size_t size);

#endif
