/* find_table.h - which file `--table T` means.
 *
 * T with a '/' or ending in ".db" is a path.  Any other T is a name: the file
 * table-T.db in --tables DIR, else in STATE/tables (SKINSPEC_STATE), else in
 * /var/lib/skinspec/tables, else in build/tables. */
#ifndef SKINSPEC_CLI_FIND_TABLE_H
#define SKINSPEC_CLI_FIND_TABLE_H

#include <stdbool.h>

#include "base/status.h"

#define FIND_TABLE_DEFAULT "two-layer"

enum { FIND_TABLE_PATH_SIZE = 4096 };

/* STATUS_NOT_FOUND, logged with the command that makes the table. */
enum status find_table(const char *table, const char *tables_folder,
                       char path[FIND_TABLE_PATH_SIZE]);

/* The same without a word where it is not there: false. */
bool find_table_if_there(const char *table, const char *tables_folder,
                         char path[FIND_TABLE_PATH_SIZE]);

#endif
