/* spectra.h - a spectrum file, row by row.
 *
 * CSV: a header whose numeric columns are wavelengths in nm, rising and evenly
 * spaced; one row per spectrum; reflectance as a fraction.  Other columns are
 * carried through; two of them mean something: `id`, and `specular` (sce or sci).
 *
 * Rows whose fields are all empty are passed over.
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

enum { SPECTRA_ERROR_SIZE = 320 };

struct spectra_row {
    size_t number;  /* of the row in the file, from 1 */
    size_t line;    /* where it begins */
    const char *id; /* text of the id column; NULL where there is none or it is empty */
    bool good;
    char error[SPECTRA_ERROR_SIZE]; /* why not; "" for a good row */
    struct spectrum spectrum;       /* specular as the column says, else unknown */
    struct csv_record record;       /* the fields; row memory, used again */
};

struct spectra;

/* path "-" is standard input.  Reads and checks the header.  The cause of any
 * failure is logged: STATUS_NOT_FOUND, STATUS_IO, STATUS_FORMAT. */
enum status spectra_open(const char *path, struct spectra **ret);
void spectra_close(struct spectra *spectra); /* takes NULL */

/* The next row into *row (zeroed before its first use).  STATUS_OK whether the row
 * is good or not; STATUS_NOT_FOUND at the end; STATUS_IO, STATUS_FORMAT,
 * STATUS_NO_MEMORY, logged, where no more can be read. */
enum status spectra_next(struct spectra *spectra, struct spectra_row *row);
void spectra_row_done(struct spectra_row *row);

/* What of a row a message is about: the row, its `specular` (the row where there is
 * no such column), or a band from 0 on. */
enum { SPECTRA_AT_ROW = -1, SPECTRA_AT_SPECULAR = -2 };

/* Log a message as file:line:column: and mark the row bad with it. */
void spectra_refuse(const struct spectra *spectra, struct spectra_row *row, int at,
                    const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Log a message about the wavelengths as file:line:column: of the first. */
void spectra_bands_error(const struct spectra *spectra, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The bands all rows have, in a spectrum without values. */
const struct spectrum *spectra_bands(const struct spectra *spectra);

/* Bytes read and in all, where the input is a file; both 0 for a pipe. */
void spectra_position(const struct spectra *spectra, size_t *done, size_t *total);

const char *spectra_path(const struct spectra *spectra); /* "<stdin>" for "-" */
bool spectra_has_specular(const struct spectra *spectra);

/* Columns that are not wavelengths: how many, their names, and their texts in a
 * row ("" where the row is too short to have them). */
size_t spectra_carried(const struct spectra *spectra);
const char *spectra_carried_name(const struct spectra *spectra, size_t i);
const char *spectra_carried_text(const struct spectra *spectra, const struct spectra_row *row,
                                 size_t i);
bool spectra_has_id(const struct spectra *spectra);

#endif
