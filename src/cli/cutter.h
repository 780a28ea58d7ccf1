/* cutter.h - an input as pieces of whole records, for several threads to read.
 *
 * A piece ends where a record does, so that each can be read without the others; which rows of the
 * input it holds, and on which line it begins, is counted while it is cut.  Memory does not grow
 * with the input: a piece is cut when it is full, and when a pipe has no more for now. */
#ifndef SKINSPEC_CLI_CUTTER_H
#define SKINSPEC_CLI_CUTTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum cutter_records {
    CUTTER_CSV,   /* as cli/csv.h reads them: comments, quotes with line breaks inside; no row is
                   * made of fields that are all empty */
    CUTTER_LINES, /* one a line; blank lines are no rows */
};

/* A record longer than this ends the input: no reader takes it. */
enum { CUTTER_LONGEST = 4 << 20 };

struct piece {
    char *text; /* n bytes, and room for one more */
    size_t n, capacity;
    size_t line;        /* of the input, that it begins on, from 1 */
    size_t rows_before; /* rows of the input before it */
    size_t rows;        /* in it */
};
void piece_done(struct piece *piece); /* takes a zeroed one */

struct cutter {
    int fd; /* borrowed */
    enum cutter_records records;
    int stop_fd[2]; /* readable: no more is to be read; -1 for none */
    char *text;     /* text[kept .. end - 1]: of the piece in hand, and from `at` on of none */
    size_t kept, at, end, capacity;
    uint64_t offset;    /* of text[at] in the input */
    size_t line, row;   /* of text[at]; rows before it */
    uint64_t last_from; /* records that begin there or later are not this reader's */
    bool ended;         /* nothing comes after text[end - 1] */
    bool open;          /* the record last seen has no end: the input ended in it */
    enum status failed; /* reading did, with this errno */
    int error;
};

void cutter_init(struct cutter *cutter, int fd);
void cutter_done(struct cutter *cutter);

/* The first byte, without taking it; 0 at the end of an empty input.  STATUS_IO (errno tells). */
enum status cutter_peek(struct cutter *cutter, char *ret);

/* The next piece, of at most so many rows.  *piece is zeroed before its first use; its memory is
 * used again.  STATUS_NOT_FOUND at the end of the input; STATUS_CANCELLED where stop_fd said so
 * while there was nothing to read; STATUS_IO (errno tells); STATUS_NO_MEMORY. */
enum status cutter_next(struct cutter *cutter, size_t rows, struct piece *piece);

/* The next so many rows, waited for, without taking them: as cutter_next() has a piece, but of
 * fewer rows only where the input has no more. */
enum status cutter_look_ahead(struct cutter *cutter, size_t rows, struct piece *piece);

/* Pass over so many rows, or those that begin before an offset.  Statuses of cutter_next(); an
 * input that has no more than that is no error. */
enum status cutter_skip_rows(struct cutter *cutter, size_t rows);
enum status cutter_skip_to(struct cutter *cutter, uint64_t offset);

#endif
