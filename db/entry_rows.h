/* entry_rows.h - rows of a table in memory as a table of SQLite's, so that one statement inserts
 * them all: binding and stepping row by row costs twice as much (docs/decisions/0014). [VTAB]
 * https://www.sqlite.org/vtab.html */
#ifndef SKINSPEC_DB_ENTRY_ROWS_H
#define SKINSPEC_DB_ENTRY_ROWS_H

#include <stddef.h>

#include <sqlite3.h>

#include "base/status.h"
#include "match/table.h"

/* Rows 0 .. n-1 of `table`. */
struct entry_rows {
    const struct table *table;
    size_t n;
};

/* Makes the virtual table `entry_rows` known to a connection, its columns those of `entry` but the
 * id, in their order: SQLite numbers rows that it appends, and looks up every id that it is given.
 * A SELECT from it reads what *rows is meanwhile, which the caller may change between two.
 * STATUS_NO_MEMORY, STATUS_DB. */
enum status entry_rows_register(sqlite3 *db, const struct entry_rows *rows);

#endif
