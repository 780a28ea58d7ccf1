/* memory.c - malloc(), and a note where it refuses. */
#include "json/memory.h"

#include <cjson/cJSON.h>
#include <stdlib.h>

static _Thread_local bool was_short;

void *json_memory_allocate(size_t size)
{
    void *memory = malloc(size);
    was_short = was_short || memory == NULL;
    return memory;
}

void json_memory_watch(void)
{
    cJSON_InitHooks(&(cJSON_Hooks){ .malloc_fn = json_memory_allocate, .free_fn = free });
}

void json_memory_begin(void)
{
    was_short = false;
}

bool json_memory_was_short(void)
{
    return was_short;
}
