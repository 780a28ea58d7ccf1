/* memory.h - whether all that was asked of cJSON since a moment was made.
 *
 * cJSON_AddNumberToObject() and the like leave a member out where there is no memory.  Whoever
 * makes an object of many members looks here once, at its end, instead of at each of them. */
#ifndef SKINSPEC_JSON_MEMORY_H
#define SKINSPEC_JSON_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/* Once, before cJSON is used by any thread: it allocates through here from then on. */
void json_memory_watch(void);

/* For the calling thread: from here on nothing was missing yet. */
void json_memory_begin(void);

/* malloc(), and a note where it refuses. */
void *json_memory_allocate(size_t size);

/* Since then cJSON was refused memory on the calling thread. */
bool json_memory_was_short(void);

#endif
