/* huge_pages.c - advice to the kernel, which may not take it: nothing but time depends on that. */
#define _DEFAULT_SOURCE 1 /* madvise() */
#include "base/huge_pages.h"

#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

/* A page of x86-64 and of most others; and what is worth rounding up to whole ones. */
enum { LINE = 64, HUGE_PAGE = 2 << 20, WORTH = 2 * HUGE_PAGE };

void *huge_pages_alloc(size_t count, size_t size)
{
    if (size == 0 || count > SIZE_MAX / 2 / size)
        return NULL;
    size_t unit = count * size >= WORTH ? HUGE_PAGE : LINE;
    size_t bytes = (count * size + unit - 1) / unit * unit;
    void *memory = aligned_alloc(unit, bytes);
#if defined MADV_HUGEPAGE
    if (memory != NULL && unit == HUGE_PAGE)
        (void)madvise(memory, bytes, MADV_HUGEPAGE); /* refused: ordinary pages then */
#endif
    return memory;
}
