/* blocks.c - a list of freed blocks of one size, threaded through the blocks themselves. */
#include "json/blocks.h"

#include <cjson/cJSON.h>
#include <malloc.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

#include "json/memory.h"

enum { BLOCK_SIZE = sizeof(cJSON) > 64 ? sizeof(cJSON) : 64, MOST = 1024 };

struct block {
    struct block *next;
};

static _Thread_local struct {
    bool on;
    size_t usable; /* of a block: how it is known again */
    struct block *first;
    size_t n;
} kept;

static void *take(size_t size)
{
    struct block *block = kept.first;
    if (!kept.on || size > BLOCK_SIZE)
        return json_memory_allocate(size);
    if (block == NULL)
        return json_memory_allocate(BLOCK_SIZE);
    kept.first = block->next;
    kept.n--;
    return block;
}

static void give_back(void *memory)
{
    struct block *block = memory;
    if (block == NULL || !kept.on || kept.n == MOST || malloc_usable_size(block) != kept.usable) {
        free(block);
        return;
    }
    block->next = kept.first;
    kept.first = block;
    kept.n++;
}

/* How much of a block of ours malloc() lets use; 0 without memory: none is ever kept. */
static size_t measure_block(void)
{
    void *block = malloc(BLOCK_SIZE);
    size_t usable = block != NULL ? malloc_usable_size(block) : 0;
    free(block);
    return usable;
}

static bool is_watched(void)
{
#if defined __SANITIZE_ADDRESS__
    return true;
#elif defined __has_feature
#if __has_feature(address_sanitizer)
    return true;
#endif
#endif
    return false;
}

void json_keep_blocks(void)
{
    cJSON_Hooks hooks = { take, give_back };
    if (is_watched())
        return;
    kept.usable = measure_block();
    kept.on = true;
    cJSON_InitHooks(&hooks);
}

void json_keep_no_blocks(void)
{
    while (kept.first != NULL) {
        struct block *next = kept.first->next;
        free(kept.first);
        kept.first = next;
    }
    kept.n = 0;
    kept.on = false;
}
