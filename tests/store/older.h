/* older.h - a store as a program before this one left it. */
#ifndef SKINSPEC_TESTS_STORE_OLDER_H
#define SKINSPEC_TESTS_STORE_OLDER_H

#include "tests/store/tools.h"

/* Version 1 from a closed store of version 4: without what steps 2 and 4 added, which has to be
 * NULL in all its rows, and the tables of step 3, which have to be empty, so that the chain
 * holds. */
static inline bool older_make(const char *folder)
{
    return tool_edit(folder, "DROP INDEX measurement_owner; DROP INDEX measurement_fence;"
                             "ALTER TABLE measurement DROP COLUMN owner_uid;"
                             "ALTER TABLE calibration DROP COLUMN aperture_mm;"
                             "ALTER TABLE match DROP COLUMN refined;"
                             "DROP TABLE check_reading; DROP TABLE check_tile;"
                             "PRAGMA user_version = 1; PRAGMA wal_checkpoint(TRUNCATE);");
}

#endif
