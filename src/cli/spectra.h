/* spectra.h - a spectrum file, row by row.
 *
 * CSV: a header whose numeric columns are wavelengths in nm, rising and evenly
 * spaced; one row per spectrum; reflectance as a fraction.  Other columns are
 * carried through; two of them mean something: `id`, and `specular` (sce or sci).
 * Rows whose fields are all empty are passed over.
 *
 * NDJSON, where it is asked for: an object a line, {"id", "spectrum": {"first_nm", "step_nm",
 * "values"}, "specular"}, the spectrum as the protocol has it, each with bands of its own; other
 * members are carried through.  Blank lines are passed over.
 *
 * What is wrong with the file stops the reading and is logged as
 * file:line:column: ...; what is wrong with a row is logged the same way and
 * kept with the row, and reading goes on. */
#ifndef SKINSPEC_CLI_SPECTRA_H
#define SKINSPEC_CLI_SPECTRA_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spectrum.h"
#include "base/status.h"
#include "cli/csv.h"
#include "cli/cutter.h"
#include "cli/json_line.h"
#include "cli/text.h"

enum { SPECTRA_ERROR_SIZE = 320 };

struct spectra_row {
    size_t number;     /* of the row in the file, from 1 */
    size_t line;       /* where it begins */
    const char *id;    /* its text; NULL where there is none or it is empty */
    bool id_is_number; /* in NDJSON */
    bool good;
    bool quiet; /* set by who reads: nothing is logged, see spectra_add_message() */
    char error[SPECTRA_ERROR_SIZE]; /* why not; "" for a good row */
    size_t error_line, error_column;
    struct spectrum spectrum; /* specular as the row says, else unknown */
    /* Texts of the file, until the row after it is read: */
    struct csv_record record; /* the fields of CSV; row memory, used again */
    struct json_line members; /* those of NDJSON; none after a line that is no object */
    const char *values;       /* of its spectrum, as JSON; NULL */
    const char *line_text;    /* where the line begins */
};

struct spectra;

enum spectra_format { SPECTRA_CSV, SPECTRA_NDJSON, SPECTRA_EITHER };

struct spectra_source {
    const char *path; /* "-" is standard input */
    /* EITHER: NDJSON where the first byte is '{'. */
    enum spectra_format format;
    const char
        *header; /* a CSV file whose header stands for the one that the input lacks; or NULL */
    size_t shard, shards; /* the shard-th of so many parts of a file, from 1; 0, 0: all of it */
    bool look_ahead;      /* NDJSON: for spectra_first_bands() */
};

/* CSV from here, all of it. */
struct spectra_source spectra_source_csv(const char *path);

/* Reads and checks the header.  The cause of any failure is logged: STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_FORMAT, STATUS_CANCELLED (not logged), STATUS_UNSUPPORTED for a part of what is no file.
 */
enum status spectra_open(const struct spectra_source *source, struct spectra **ret);
void spectra_close(struct spectra *spectra); /* takes NULL */

/* The next row into *row (zeroed before its first use).  STATUS_OK whether the row
 * is good or not; STATUS_NOT_FOUND at the end; STATUS_IO, STATUS_FORMAT,
 * STATUS_NO_MEMORY, logged, where no more can be read. */
enum status spectra_next(struct spectra *spectra, struct spectra_row *row);
void spectra_row_done(struct spectra_row *row);

/* ---- in pieces: taken one at a time, read by many threads -------------------------- */

struct spectra_piece { /* zeroed before its first use */
    struct piece piece;
    struct csv csv;
    char *at;         /* NDJSON: what is still to be read */
    size_t line, row; /* of it */
    size_t error_line, error_column;
    const char *error; /* with STATUS_FORMAT: why no more can be read */
};
void spectra_piece_done(struct spectra_piece *piece);

/* At most so many rows.  Statuses of cutter_next(), logged where that is due. */
enum status spectra_take(struct spectra *spectra, size_t rows, struct spectra_piece *ret);

/* The next row of a piece.  STATUS_NOT_FOUND at its end; STATUS_FORMAT (not logged: see piece),
 * STATUS_NO_MEMORY. */
enum status spectra_read(const struct spectra *spectra, struct spectra_piece *piece,
                         struct spectra_row *row);

/* Rows of the input that were taken or passed over. */
size_t spectra_rows(const struct spectra *spectra);

/* Pass over so many rows. */
enum status spectra_skip(struct spectra *spectra, size_t rows);

/* What would be logged of a row that was read quietly; of the end of reading a piece.  With a NUL
 * behind it. */
void spectra_add_message(const struct spectra *spectra, const struct spectra_row *row,
                         struct text *text);
void spectra_add_piece_message(const struct spectra *spectra, const struct spectra_piece *piece,
                               struct text *text);

/* What is to end the wait for more: see cli/cutter.h. */
void spectra_stop_on(struct spectra *spectra, const int fd[2]);

/* ---- about a row ------------------------------------------------------------------- */

/* What of a row a message is about: the row, its `specular` (the row where there is
 * no such column), or a band from 0 on. */
enum { SPECTRA_AT_ROW = -1, SPECTRA_AT_SPECULAR = -2 };

/* Log a message as file:line:column: and mark the row bad with it. */
void spectra_refuse(const struct spectra *spectra, struct spectra_row *row, int at,
                    const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Log a message about the wavelengths as file:line:column: of the first. */
void spectra_bands_error(const struct spectra *spectra, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The bands all rows have, in a spectrum without values; NULL for NDJSON. */
const struct spectrum *spectra_bands(const struct spectra *spectra);

/* Those of the first good row of all parts, without values, where that is among the first
 * SPECTRA_AHEAD rows; of NDJSON only where source.look_ahead was set.  NULL, logged with what is
 * wrong with the first row: there is none. */
enum { SPECTRA_AHEAD = 64 };
const struct spectrum *spectra_first_bands(const struct spectra *spectra);

/* Bytes read and in all, where the input is a file; both 0 for a pipe. */
void spectra_position(const struct spectra *spectra, size_t *done, size_t *total);

const char *spectra_path(const struct spectra *spectra);  /* "<stdin>" for "-" */
bool spectra_has_specular(const struct spectra *spectra); /* of NDJSON: a line may say so */

/* Columns that are not wavelengths: how many, their names, and their texts in a
 * row ("" where the row is too short to have them).  None for NDJSON. */
size_t spectra_carried(const struct spectra *spectra);
const char *spectra_carried_name(const struct spectra *spectra, size_t i);
const char *spectra_carried_text(const struct spectra *spectra, const struct spectra_row *row,
                                 size_t i);
bool spectra_has_id(const struct spectra *spectra);

#endif
