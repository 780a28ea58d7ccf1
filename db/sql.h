/* sql.h - the few steps that every piece of SQL here takes. */
#ifndef SKINSPEC_DB_SQL_H
#define SKINSPEC_DB_SQL_H

#include <sqlite3.h>

#include "base/status.h"

/* What an SQLite result code means for our caller.  SQLITE_OK, _ROW and _DONE are
 * STATUS_OK; failed reads and writes are STATUS_IO. */
enum status sql_status(int code);

/* The same for the last call on a connection, which may know more: a failed write or open
 * that was refused for want of room or of the right to write is STATUS_FULL or
 * STATUS_READ_ONLY.  To be asked at once after the call. */
enum status sql_status_of(sqlite3 *db, int code);

/* An errno of a call that writes, or opens to write: STATUS_FULL, STATUS_READ_ONLY or STATUS_IO. */
enum status sql_errno_status(int cause);

/* Run constant SQL without results. */
enum status sql_run(sqlite3 *db, const char *sql);

/* Prepare one constant statement; on failure *ret is NULL. */
enum status sql_prepare(sqlite3 *db, const char *sql, sqlite3_stmt **ret);

/* Step a statement that gives no row, and make it ready for the next. */
enum status sql_step_done(sqlite3_stmt *statement);

/* Why the last call failed, for a person: the operating system's words where it
 * was the cause ("No space left on device"), else SQLite's. */
const char *sql_reason(sqlite3 *db);

#endif
