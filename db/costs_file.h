/* costs_file.h - the costs of this machine, a file of text as plan/costs.h has it; made by
 * `skinspec bench --calibrate`. */
#ifndef SKINSPEC_DB_COSTS_FILE_H
#define SKINSPEC_DB_COSTS_FILE_H

#include <stdbool.h>

#include "base/status.h"
#include "plan/costs.h"

enum { COSTS_PATH_SIZE = 4096 };

/* Where a person's is: $XDG_STATE_HOME/skinspec/costs.csv, or ~/.local/state/skinspec/costs.csv.
 * STATUS_NOT_FOUND where neither variable is set to an absolute path, STATUS_RANGE where it is
 * too long. */
enum status costs_file_path(char ret[COSTS_PATH_SIZE]);

/* STATUS_NOT_FOUND, silently, where there is none; STATUS_FORMAT, STATUS_IO, STATUS_NO_MEMORY are
 * logged with file and line.  A file that does not say how many costs it has may have been cut
 * short: STATUS_FORMAT.  *ret is touched with STATUS_OK alone. */
enum status costs_file_read(const char *path, struct costs *ret);

/* Whether a file is of costs, or empty; silent. */
bool costs_file_is_one(const char *path);

#endif
