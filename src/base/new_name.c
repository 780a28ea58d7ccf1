/* new_name.c - a random word in it, and a rename that replaces nothing unasked. */
#define _GNU_SOURCE /* renameat2 */
#include "base/new_name.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

enum status new_name_make(const char *path, char ret[NEW_NAME_SIZE])
{
    const char *slash = strrchr(path, '/');
    int folder = slash != NULL ? (int)(slash + 1 - path) : 0;
    uint64_t random;
    if (path[folder] == '\0')
        return STATUS_RANGE;
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random)
        return STATUS_IO;
    int n = snprintf(ret, NEW_NAME_SIZE, "%.*s.%s.%016" PRIx64 ".tmp", folder, path, path + folder,
                     random);
    return n > 0 && n < NEW_NAME_SIZE ? STATUS_OK : STATUS_RANGE;
}

int new_name_take(const char *temporary, const char *path, bool overwrite)
{
    unsigned flags = overwrite ? 0 : RENAME_NOREPLACE;
    if (renameat2(AT_FDCWD, temporary, AT_FDCWD, path, flags) == 0)
        return 0;
    /* Some file systems cannot promise that; a second name can be had on most. */
    if (errno != EINVAL || flags == 0 || link(temporary, path) != 0)
        return -1;
    return unlink(temporary);
}
