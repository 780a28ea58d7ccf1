/* csv.h - comma-separated records in a piece of text, with places for messages.
 * [RFC4180]: quoted fields, "" for a quote, line breaks inside quotes; LF or CRLF
 * ends a record; blanks around an unquoted field are dropped.  A UTF-8 byte order mark at the start
 * is passed over, and so are lines that begin with '#' and empty lines. */
#ifndef SKINSPEC_CLI_CSV_H
#define SKINSPEC_CLI_CSV_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

enum { CSV_MAX_FIELDS = 4096, CSV_MAX_RECORD = 1 << 20 };

struct csv_field {
    char *text;    /* in the text that is read, NUL at its end */
    size_t line;   /* of its first byte, from 1 */
    size_t column; /* bytes from 1 */
};

/* One record; its memory is used again by the next. */
struct csv_record {
    struct csv_field *field;
    size_t n, capacity;
};

struct csv {
    char *at, *end;         /* what is still to be read */
    const char *line_start; /* of the line that `at` is in */
    size_t line;
    size_t stored; /* bytes of the record so far */
    bool at_start; /* of the input: a byte order mark may stand here */
    /* On STATUS_FORMAT: where, and what was wrong. */
    size_t error_line, error_column;
    const char *error;
};

/* Read text[0 .. n - 1], which begins with this line of the input (from 1).  Fields are made
 * in place: the text is written to, text[n] too. */
void csv_init(struct csv *csv, char *text, size_t n, size_t line);
void csv_record_done(struct csv_record *record); /* takes a zeroed one */

/* The next record.  STATUS_NOT_FOUND at the end of the text; STATUS_FORMAT for
 * bytes that are not text, an open quote, too many fields or too long a record;
 * STATUS_NO_MEMORY.  After an error reading is over. */
enum status csv_read(struct csv *csv, struct csv_record *record);

#endif
