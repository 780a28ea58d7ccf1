/* uuid.h - random ids, and ids that sort by the time they were made.
 *
 * [R9562] RFC 9562, Universally Unique IDentifiers, 2024: version 4 is random, version
 * 7 begins with the milliseconds since 1970. */
#ifndef SKINSPEC_BASE_UUID_H
#define SKINSPEC_BASE_UUID_H

#include <stdbool.h>
#include <stdint.h>

#include "base/status.h"

enum { UUID_TEXT_SIZE = 37 };

/* 32 hexadecimal digits of either case and four dashes, of any version. */
bool uuid_is_text(const char *text);

/* A random one, lower case.  STATUS_IO where the system has no random numbers. */
enum status uuid4_make(char text[UUID_TEXT_SIZE]);

/* The last id given out; {0} before the first.  Random words are drawn from the system many at a
 * time. */
enum { UUID7_WORDS = 32 };
struct uuid7 {
    uint64_t ms; /* 48 bits, since 1970 */
    uint64_t hi; /* the 12 random bits that follow */
    uint64_t lo; /* the last 62 */
    uint64_t word[UUID7_WORDS];
    unsigned words; /* of them not used yet: the first ones */
};

/* The next id, greater as text than all before, whatever the clock does: where it
 * stands still or goes back, the id goes on from the last one by a random step.
 * A clock before 1970 counts as 1970.  STATUS_IO as above. */
enum status uuid7_make(struct uuid7 *last, int64_t realtime_ms, char text[UUID_TEXT_SIZE]);

/* Go on above this id as well.  Text that is none is STATUS_FORMAT, and no change. */
enum status uuid7_continue(struct uuid7 *last, const char *text);

#endif
