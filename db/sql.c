/* sql.c - SQLite's result codes in our terms. */
#include "db/sql.h"

#include <errno.h>
#include <string.h>

enum status sql_status(int code)
{
    switch (code & 0xff) {
    case SQLITE_OK:
    case SQLITE_ROW:
    case SQLITE_DONE:
        return STATUS_OK;
    case SQLITE_NOMEM:
        return STATUS_NO_MEMORY;
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
        return STATUS_IO;
    case SQLITE_CORRUPT:
        return STATUS_DAMAGED;
    case SQLITE_NOTADB:
        return STATUS_FORMAT;
    default:
        return STATUS_DB;
    }
}

enum status sql_run(sqlite3 *db, const char *sql)
{
    return sql_status(sqlite3_exec(db, sql, NULL, NULL, NULL));
}

enum status sql_prepare(sqlite3 *db, const char *sql, sqlite3_stmt **ret)
{
    return sql_status(sqlite3_prepare_v2(db, sql, -1, ret, NULL));
}

enum status sql_step_done(sqlite3_stmt *statement)
{
    int stepped = sqlite3_step(statement);
    int reset = sqlite3_reset(statement);
    if (stepped == SQLITE_DONE)
        return STATUS_OK;
    return sql_status(reset != SQLITE_OK ? reset : SQLITE_ERROR);
}

const char *sql_reason(sqlite3 *db)
{
    int code = sqlite3_errcode(db);
    if (code == SQLITE_FULL)
        return strerror(ENOSPC);
    if (code == SQLITE_IOERR || code == SQLITE_CANTOPEN) {
        /* A COMMIT that fails does not note the cause; it is still in errno then. */
        int cause = sqlite3_system_errno(db) != 0 ? sqlite3_system_errno(db) : errno;
        if (cause != 0)
            return strerror(cause);
    }
    return sqlite3_errmsg(db);
}
