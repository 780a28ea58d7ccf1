/* huge_pages.h - memory for large arrays that are read here and there: on large pages where the
 * system has them, so that finding the page does not cost more than reading the value. */
#ifndef SKINSPEC_BASE_HUGE_PAGES_H
#define SKINSPEC_BASE_HUGE_PAGES_H

#include <stddef.h>

/* As aligned_alloc(64, count * size), contents undefined; NULL where there is no memory or the
 * product is no size.  For free().  What is below a few megabytes lies on ordinary pages. */
void *huge_pages_alloc(size_t count, size_t size);

#endif
