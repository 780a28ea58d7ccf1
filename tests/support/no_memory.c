/* no_memory.c - SQLite's own allocator behind one that counts. */
#include "tests/support/no_memory.h"

#include <sqlite3.h>
#include <stdatomic.h>
#include <stddef.h>

static sqlite3_mem_methods usual;
static atomic_long left = -1;
static atomic_bool failed;

static bool may_allocate(void)
{
    if (left < 0)
        return true;
    if (left == 0) {
        failed = true;
        return false;
    }
    left--;
    return true;
}

static void *counted_malloc(int size)
{
    return may_allocate() ? usual.xMalloc(size) : NULL;
}

static void *counted_realloc(void *old, int size)
{
    return may_allocate() ? usual.xRealloc(old, size) : NULL;
}

bool no_memory_install(void)
{
    sqlite3_mem_methods counted;
    if (sqlite3_config(SQLITE_CONFIG_GETMALLOC, &usual) != SQLITE_OK)
        return false;
    counted = usual;
    counted.xMalloc = counted_malloc;
    counted.xRealloc = counted_realloc;
    /* Small allocations too: no pool of SQLite's own to take them from. */
    return sqlite3_config(SQLITE_CONFIG_MALLOC, &counted) == SQLITE_OK &&
           sqlite3_config(SQLITE_CONFIG_LOOKASIDE, 0, 0) == SQLITE_OK;
}

void no_memory_after(long allocations)
{
    left = allocations;
    failed = false;
}

bool no_memory_met(void)
{
    return failed;
}
