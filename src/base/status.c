/* status.c - names and texts of enum status, one row each. */
#include "base/status.h"

#include <stddef.h>

static const struct status_row {
    enum status status;
    const char *name, *text;
} status_rows[] = {
    { STATUS_OK, "ok", "done" },
    { STATUS_RANGE, "range", "a value is outside its range or not finite" },
    { STATUS_TIMEOUT, "timeout", "no answer in time" },
    { STATUS_DB, "db", "the database failed" },
    { STATUS_NO_MEMORY, "no_memory", "not enough memory" },
    { STATUS_IO, "io", "reading or writing failed" },
    { STATUS_FORMAT, "format", "not in the expected form" },
    { STATUS_VERSION, "version", "made by another version" },
    { STATUS_DAMAGED, "damaged", "damaged: its hash does not match" },
    { STATUS_EXISTS, "exists", "exists already" },
    { STATUS_NOT_FOUND, "not_found", "not found" },
    { STATUS_CANCELLED, "cancelled", "stopped on request" },
    { STATUS_UNSUPPORTED, "unsupported", "not available with this model or table" },
    { STATUS_FULL, "full", "no room on the disk" },
    { STATUS_READ_ONLY, "read_only", "the file system or the folder cannot be written" },
};

static const struct status_row *row_of(enum status s)
{
    for (size_t i = 0; i < sizeof status_rows / sizeof *status_rows; i++)
        if (status_rows[i].status == s)
            return &status_rows[i];
    return NULL;
}

const char *status_name(enum status s)
{
    const struct status_row *row = row_of(s);
    return row != NULL ? row->name : "unknown";
}

const char *status_text(enum status s)
{
    const struct status_row *row = row_of(s);
    return row != NULL ? row->text : "unknown status";
}
