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
        return STATUS_FULL;
    case SQLITE_READONLY:
        return STATUS_READ_ONLY;
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
        return STATUS_IO;
    case SQLITE_CORRUPT:
        return STATUS_DAMAGED;
    case SQLITE_NOTADB:
        return STATUS_FORMAT;
    default:
        return STATUS_DB;
    }
}

enum status sql_errno_status(int cause)
{
    switch (cause) {
    case ENOSPC:
    case EDQUOT:
        return STATUS_FULL;
    case EROFS:
    case EACCES:
    case EPERM:
        return STATUS_READ_ONLY;
    default:
        return STATUS_IO;
    }
}

/* Of a failed read, write or open.  A COMMIT that fails does not note the cause; it is still
 * in errno then. */
static int system_cause(sqlite3 *db)
{
    int noted = sqlite3_system_errno(db);
    return noted != 0 ? noted : errno;
}

enum status sql_status_of(sqlite3 *db, int code)
{
    enum status s = sql_status(code);
    return s == STATUS_IO ? sql_errno_status(system_cause(db)) : s;
}

enum status sql_run(sqlite3 *db, const char *sql)
{
    return sql_status_of(db, sqlite3_exec(db, sql, NULL, NULL, NULL));
}

enum status sql_prepare(sqlite3 *db, const char *sql, sqlite3_stmt **ret)
{
    return sql_status_of(db, sqlite3_prepare_v2(db, sql, -1, ret, NULL));
}

enum status sql_step_done(sqlite3_stmt *statement)
{
    int stepped = sqlite3_step(statement);
    int reset = sqlite3_reset(statement);
    if (stepped == SQLITE_DONE)
        return STATUS_OK;
    return sql_status_of(sqlite3_db_handle(statement), reset != SQLITE_OK ? reset : SQLITE_ERROR);
}

const char *sql_reason(sqlite3 *db)
{
    int code = sqlite3_errcode(db);
    if (code == SQLITE_FULL)
        return strerror(ENOSPC);
    if (code == SQLITE_IOERR || code == SQLITE_CANTOPEN) {
        int cause = system_cause(db);
        if (cause != 0)
            return strerror(cause);
    }
    return sqlite3_errmsg(db);
}
