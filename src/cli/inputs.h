/* inputs.h - the files that a command reads, none of which it may write over: told by device and
 * inode, whatever names and links lead to them. */
#ifndef SKINSPEC_CLI_INPUTS_H
#define SKINSPEC_CLI_INPUTS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/stat.h>

#include "base/status.h"

enum { INPUTS_MAX = 8 };

struct inputs { /* zeroed before its first use */
    size_t n;
    struct {
        const char *what; /* for messages, as "the cube"; borrowed */
        dev_t device;
        ino_t inode;
    } file[INPUTS_MAX];
};

/* At most INPUTS_MAX.  Only a regular file can be written over: others are passed over, and so is
 * a path that is NULL or leads nowhere. */
void inputs_add(struct inputs *inputs, const char *what, const struct stat *file);
void inputs_add_path(struct inputs *inputs, const char *what, const char *path);
void inputs_add_file(struct inputs *inputs, const char *path); /* FILE, "-": standard input */

/* Before a file is opened for writing: STATUS_EXISTS, logged, where it is one of them.  path NULL:
 * what goes to standard output. */
enum status inputs_check(const struct inputs *inputs, const char *path);

/* Whether two names are of one file, be it there or yet to be made. */
bool inputs_same(const char *path, const char *other);

#endif
