/* answers.h - where the answers of a long run go: standard output, or a file that a run which was
 * stopped can go on with.
 *
 * Of such a file the complete rows are counted and one that was cut off is forgotten.  The last of
 * them are made again and must come out the same to the byte: then input, table and options are
 * those of the first run, and the whole will be what one run had made.
 *
 * One process at a time writes to it.  An array cannot be gone on with: it appears under its name
 * when it is whole, or not at all. */
#ifndef SKINSPEC_CLI_ANSWERS_H
#define SKINSPEC_CLI_ANSWERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/status.h"
#include "cli/new_file.h"
#include "cli/text.h"

enum answers_mode {
    ANSWERS_NEW,     /* a file that is there is refused */
    ANSWERS_REPLACE, /* it is written anew */
    ANSWERS_RESUME,  /* it is gone on with; one that is not there is begun */
};

enum answers_kind { ANSWERS_CSV, ANSWERS_LINES, ANSWERS_ARRAY };

struct answers {
    const char *path; /* NULL: standard output */
    enum answers_mode mode;
    enum answers_kind kind;
    FILE *stream;
    struct new_file file; /* that an array is written to */
    size_t rows_again;    /* what was there already: rows that come again, */
    size_t rows_before;   /* and those before them, which the input is to pass over */
    struct text again;    /* their text */
    size_t same;          /* bytes of it that came and were the same */
    uint64_t whole;       /* bytes of complete rows: what follows is cut off */
};

/* How a run goes on: "with --resume". */
const char *answers_how_to_go_on(enum answers_mode mode);

/* path NULL: standard output.  begin: what the text begins with; in a file that is gone on with it
 * must be there.  An array is not gone on with.  STATUS_EXISTS, STATUS_IO, STATUS_FORMAT,
 * STATUS_NO_MEMORY, logged. */
enum status answers_open(const char *path, enum answers_mode mode, const struct text *begin,
                         enum answers_kind kind, struct answers *ret);

/* Text of whole rows; it is there when this returns.  STATUS_IO, or STATUS_FORMAT where it is not
 * what was there, logged. */
enum status answers_write(struct answers *answers, const struct text *text);

/* ended: the input was read to its end; STATUS_FORMAT, logged, where there are more rows than it
 * has.  whole: an array appears; else nothing is left of it.  STATUS_IO, STATUS_EXISTS. */
enum status answers_close(struct answers *answers, bool ended, bool whole);

#endif
