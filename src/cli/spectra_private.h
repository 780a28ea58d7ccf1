/* spectra_private.h - what the files of cli/spectra share: columns, rows of CSV and of NDJSON. */
#ifndef SKINSPEC_CLI_SPECTRA_PRIVATE_H
#define SKINSPEC_CLI_SPECTRA_PRIVATE_H

#include <stdarg.h>

#include "cli/spectra.h"

/* What a column of the file is. */
enum { NOT_A_BAND = -1 };

struct spectra {
    const char *path;
    int fd;
    bool is_csv;
    struct cutter cutter;
    struct spectra_piece current; /* of spectra_next() */
    bool has_current;
    char *header_text; /* what the fields of the header are texts of */
    struct csv_record header;
    int *band;       /* [header.n] index of the band, or NOT_A_BAND */
    size_t *carried; /* [carried_n] columns that are no bands */
    size_t carried_n;
    size_t id_column, specular_column; /* header.n where there is none */
    struct spectrum bands;
    bool has_bands; /* NDJSON: those of the first good row */
    char ahead_error[SPECTRA_ERROR_SIZE];
    size_t ahead_line, ahead_column; /* of it: the first row is bad for this; 0: there is no row */
};

enum { SPECTRA_SHOWN_SIZE = 48 };
/* Text of a field cut to what a message can show. */
const char *spectra_shown(const char *text, char cut[SPECTRA_SHOWN_SIZE]);

/* The columns of s->header. */
enum status spectra_read_columns(struct spectra *s);

/* A row is bad, for what stands there; the first such counts. */
void spectra_mark(struct spectra_row *row, size_t line, size_t column, const char *format,
                  va_list args) __attribute__((format(printf, 4, 0)));

/* Nothing is known of a row yet, but where it begins. */
void spectra_begin_row(struct spectra_row *row, size_t line);

/* Why a value at so many nm cannot be a reflectance, into text; NULL where it can.  A fraction may
 * exceed 1 a little (white calibration, fluorescence), not 2. */
const char *spectra_value_fault(double x, const char *nm, char text[SPECTRA_ERROR_SIZE]);

/* One row of a piece. */
void spectra_read_fields(const struct spectra *s, struct spectra_row *row);
enum status spectra_read_line(struct spectra_piece *piece, struct spectra_row *row);

/* The column of a line of NDJSON that a message is about. */
size_t spectra_line_column(const struct spectra_row *row, int at);

#endif
