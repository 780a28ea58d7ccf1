/* table_build.h - carry out a recipe into a table file, all of it or nothing.
 *
 * The file is written under a temporary name beside its place, synced, and only
 * then given its name; when anything stops the work - an error, a full disk, the
 * caller - nothing is left behind and what was there before is untouched. */
#ifndef SKINSPEC_DB_TABLE_BUILD_H
#define SKINSPEC_DB_TABLE_BUILD_H

#include <stdbool.h>

#include "base/progress.h"
#include "base/status.h"
#include "match/recipe.h"

struct table_build_options {
    bool rtree;       /* an R*Tree on Lab, for people who query the file by SQL */
    bool overwrite;   /* an existing file is replaced; else STATUS_EXISTS */
    unsigned threads; /* at least 1 */
    struct progress progress;
};

/* STATUS_RANGE and STATUS_UNSUPPORTED as recipe_check(); STATUS_EXISTS, STATUS_READ_ONLY,
 * STATUS_FULL, STATUS_IO (no such folder, a disk that fails), STATUS_CANCELLED, STATUS_DB,
 * STATUS_NO_MEMORY.  The cause is logged, except for STATUS_CANCELLED. */
enum status table_build(const char *path, const struct recipe *recipe,
                        const struct table_build_options *options);

#endif
