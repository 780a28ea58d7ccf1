/* new_file.h - a file that appears under its name when it is complete, or not at all. */
#ifndef SKINSPEC_CLI_NEW_FILE_H
#define SKINSPEC_CLI_NEW_FILE_H

#include <stdbool.h>
#include <stdio.h>

#include "base/new_name.h"
#include "base/status.h"

struct new_file {
    const char *path;
    bool overwrite;
    FILE *stream; /* write here */
    char temporary[NEW_NAME_SIZE];
};

/* Without overwrite an existing file is refused, at once and again at the end; what is no
 * regular file (a device, a folder) always is.  STATUS_EXISTS, STATUS_IO, logged. */
enum status new_file_begin(const char *path, bool overwrite, struct new_file *ret);

/* keep: to the disk, then under its name; else it goes.  STATUS_IO, STATUS_EXISTS, logged;
 * nothing is left behind then. */
enum status new_file_end(struct new_file *file, bool keep);

#endif
