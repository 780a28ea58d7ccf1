/* no_memory.h - SQLite's allocations fail after so many. */
#ifndef SKINSPEC_TESTS_SUPPORT_NO_MEMORY_H
#define SKINSPEC_TESTS_SUPPORT_NO_MEMORY_H

#include <stdbool.h>

/* Once, before anything uses SQLite; false where it does not take that. */
bool no_memory_install(void);

/* So many more succeed, then every one fails; negative: none fails. */
void no_memory_after(long allocations);
bool no_memory_met(void); /* one has failed since then */

#endif
