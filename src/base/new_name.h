/* new_name.h - the names of a file that is to appear as a whole: one while it is written,
 * its own when it is complete. */
#ifndef SKINSPEC_BASE_NEW_NAME_H
#define SKINSPEC_BASE_NEW_NAME_H

#include <stdbool.h>

#include "base/status.h"

enum { NEW_NAME_SIZE = 4096 };

/* ".NAME.RANDOM.tmp" beside path: the same file system, hidden, and nobody else's, not even that
 * of a process with our number in another container.  STATUS_RANGE where path names no file (it
 * ends with a slash) or is too long, STATUS_IO where the system has no random numbers. */
enum status new_name_make(const char *path, char ret[NEW_NAME_SIZE]);

/* Rename, replacing what is there only with overwrite.  0; or -1 with errno (EEXIST). */
int new_name_take(const char *temporary, const char *path, bool overwrite);

#endif
