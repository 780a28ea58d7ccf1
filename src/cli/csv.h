/* csv.h - comma-separated records from a stream, with places for messages.
 * [RFC4180]: quoted fields, "" for a quote, line breaks inside quotes; LF or CRLF
 * ends a record; blanks around an unquoted field are dropped.  A UTF-8 byte order mark at the start
 * is passed over, and so are lines that begin with '#' and empty lines. */
#ifndef SKINSPEC_CLI_CSV_H
#define SKINSPEC_CLI_CSV_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "base/status.h"

enum { CSV_MAX_FIELDS = 4096, CSV_MAX_RECORD = 1 << 20 };

struct csv_field {
    char *text;    /* in the record's buffer, NUL at its end */
    size_t line;   /* of its first byte, from 1 */
    size_t column; /* bytes from 1 */
    bool quoted;
};

/* One record; its memory is used again by the next. */
struct csv_record {
    struct csv_field *field;
    size_t n;
    char *buffer;
    size_t size, capacity, field_capacity;
};

struct csv {
    FILE *stream; /* borrowed */
    size_t line, column;
    bool started;
    /* On STATUS_FORMAT: where, and what was wrong. */
    size_t error_line, error_column;
    const char *error;
};

void csv_init(struct csv *csv, FILE *stream);
void csv_record_done(struct csv_record *record); /* takes a zeroed one */

/* The next record.  STATUS_NOT_FOUND at the end of the stream; STATUS_FORMAT for
 * bytes that are not text, an open quote, too many fields or too long a record;
 * STATUS_IO (errno tells); STATUS_NO_MEMORY.  After an error reading is over. */
enum status csv_read(struct csv *csv, struct csv_record *record);

#endif
