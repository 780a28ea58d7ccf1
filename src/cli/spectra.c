/* spectra.c - header and rows of a spectrum file, and what can be wrong with them. */
#include "cli/spectra.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/number.h"
#include "base/utf8.h"

/* What a column of the file is. */
enum { NOT_A_BAND = -1 };

struct spectra {
    const char *path;
    FILE *stream;
    struct csv csv;
    struct csv_record header;
    int *band;       /* [header.n] index of the band, or NOT_A_BAND */
    size_t *carried; /* [carried_n] columns that are no bands */
    size_t carried_n;
    size_t id_column, specular_column; /* header.n where there is none */
    struct spectrum bands;
    size_t rows;
};

const struct spectrum *spectra_bands(const struct spectra *spectra)
{
    return &spectra->bands;
}

const char *spectra_path(const struct spectra *spectra)
{
    return spectra->path;
}

void spectra_position(const struct spectra *spectra, size_t *done, size_t *total)
{
    struct stat st;
    off_t at = ftello(spectra->stream);
    bool known = at >= 0 && fstat(fileno(spectra->stream), &st) == 0 && S_ISREG(st.st_mode);
    *done = known ? (size_t)at : 0;
    *total = known ? (size_t)st.st_size : 0;
}

bool spectra_has_specular(const struct spectra *spectra)
{
    return spectra->specular_column < spectra->header.n;
}

bool spectra_has_id(const struct spectra *spectra)
{
    return spectra->id_column < spectra->header.n;
}

size_t spectra_carried(const struct spectra *spectra)
{
    return spectra->carried_n;
}

const char *spectra_carried_name(const struct spectra *spectra, size_t i)
{
    return spectra->header.field[spectra->carried[i]].text;
}

const char *spectra_carried_text(const struct spectra *spectra, const struct spectra_row *row,
                                 size_t i)
{
    size_t column = spectra->carried[i];
    return column < row->record.n ? row->record.field[column].text : "";
}

/* Text of a field cut to what a message can show. */
static const char *shown(const char *text, char cut[48])
{
    if (strlen(text) < 40)
        return text;
    size_t n = 36;
    while (n > 0 && ((unsigned char)text[n] & 0xc0) == 0x80)
        n--; /* not inside a UTF-8 sequence */
    snprintf(cut, 48, "%.*s...", (int)n, text);
    return cut;
}

/* ---- header ------------------------------------------------------------------------- */

static void log_at_header(const struct spectra *s, size_t field, const char *format, va_list args)
    __attribute__((format(printf, 3, 0)));

static void log_at_header(const struct spectra *s, size_t field, const char *format, va_list args)
{
    char text[SPECTRA_ERROR_SIZE];
    const struct csv_field *f = &s->header.field[field];
    vsnprintf(text, sizeof text, format, args);
    log_error("%s:%zu:%zu: %s", s->path, f->line, f->column, text);
}

static enum status header_error(const struct spectra *s, size_t field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static enum status header_error(const struct spectra *s, size_t field, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    log_at_header(s, field, format, args);
    va_end(args);
    return STATUS_FORMAT;
}

void spectra_bands_error(const struct spectra *spectra, const char *format, ...)
{
    va_list args;
    size_t field = 0;
    while (spectra->band[field] != 0) /* a file without bands was not opened */
        field++;
    va_start(args, format);
    log_at_header(spectra, field, format, args);
    va_end(args);
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* A file from a place where the comma is the decimal point and ';' separates. */
static enum status check_separator(const struct spectra *s)
{
    const char *text = s->header.field[0].text;
    if (s->header.n > 1)
        return STATUS_OK;
    if (strchr(text, ';') != NULL || strchr(text, '\t') != NULL)
        return header_error(s, 0,
                            "columns are separated by '%s'; expected commas, and points as "
                            "decimal marks (export as CSV with these)",
                            strchr(text, ';') != NULL ? ";" : "tab");
    return STATUS_OK;
}

static enum status read_column_name(struct spectra *s, size_t column, double *last_nm)
{
    double nm;
    char cut[48];
    const char *name = s->header.field[column].text;
    s->band[column] = NOT_A_BAND;
    if (!utf8_is_valid(name))
        return header_error(s, column, "column name is not UTF-8; save the file as UTF-8");
    if (number_parse(name, &nm) != STATUS_OK) {
        s->carried[s->carried_n++] = column;
        if (strcasecmp(name, "id") == 0 && s->id_column == s->header.n)
            s->id_column = column;
        if (strcasecmp(name, "specular") == 0 && s->specular_column == s->header.n)
            s->specular_column = column;
        return STATUS_OK;
    }
    if (s->bands.n == SPECTRUM_MAX_BANDS)
        return header_error(s, column, "more than %d wavelengths", SPECTRUM_MAX_BANDS);
    if (s->bands.n > 0 && nm == *last_nm)
        return header_error(s, column, "wavelength %s stands twice; expected each once",
                            shown(name, cut));
    if (s->bands.n > 0 && nm < *last_nm)
        return header_error(s, column, "wavelength %s after %g; expected them to rise",
                            shown(name, cut), *last_nm);
    if (s->bands.n == 0)
        s->bands.first_nm = nm;
    else if (s->bands.n == 1)
        s->bands.step_nm = nm - *last_nm;
    else if (fabs(spectrum_nm(&s->bands, s->bands.n) - nm) > 1e-3 * s->bands.step_nm)
        return header_error(s, column, "wavelength %s breaks the even step of %g nm; expected %g",
                            shown(name, cut), s->bands.step_nm, spectrum_nm(&s->bands, s->bands.n));
    *last_nm = nm;
    s->band[column] = (int)s->bands.n++;
    return STATUS_OK;
}

static enum status check_bands(struct spectra *s, double last_nm)
{
    if (s->bands.n == 0)
        return header_error(s, 0,
                            "no wavelengths in the header; expected one row per spectrum and "
                            "columns named by the nm alone: id,400,410,...,700");
    if (s->bands.n < 2)
        return header_error(s, 0, "only one wavelength in the header; expected 400 to 700 nm");
    /* Printed steps are rounded, 3.3333: the ends tell the step better. */
    s->bands.step_nm = (last_nm - s->bands.first_nm) / (double)(s->bands.n - 1);
    if (s->bands.first_nm < 100.0 || last_nm > 10000.0)
        return header_error(s, 0, "wavelengths %g..%g; expected nanometres, as 400,410,...,700",
                            s->bands.first_nm, last_nm);
    return STATUS_OK;
}

static enum status read_header(struct spectra *s)
{
    double last_nm = 0.0;
    size_t n = s->header.n;
    s->band = calloc(n, sizeof *s->band);
    s->carried = calloc(n, sizeof *s->carried);
    if (s->band == NULL || s->carried == NULL)
        return STATUS_NO_MEMORY;
    s->id_column = s->specular_column = n;
    enum status status = check_separator(s);
    for (size_t i = 0; i < n && status == STATUS_OK; i++)
        status = read_column_name(s, i, &last_nm);
    return status == STATUS_OK ? check_bands(s, last_nm) : status;
}

/* Why the stream gave no record. */
static enum status stream_error(const struct spectra *s, enum status status)
{
    if (status == STATUS_FORMAT)
        log_error("%s:%zu:%zu: %s", s->path, s->csv.error_line, s->csv.error_column, s->csv.error);
    else if (status == STATUS_IO && errno == EINTR)
        ; /* whoever pressed Ctrl-C knows */
    else if (status == STATUS_IO)
        log_error("%s: %s", s->path, strerror(errno));
    else if (status != STATUS_NOT_FOUND)
        log_error("%s: %s", s->path, status_text(status));
    return status;
}

enum status spectra_open(const char *path, struct spectra **ret)
{
    struct spectra *s = calloc(1, sizeof *s);
    if (s == NULL)
        return STATUS_NO_MEMORY;
    bool standard_input = strcmp(path, "-") == 0;
    s->bands.aperture_mm = NAN;
    s->path = standard_input ? "<stdin>" : path;
    s->stream = standard_input ? stdin : fopen(path, "re");
    enum status status = STATUS_OK;
    if (s->stream == NULL) {
        status = errno == ENOENT ? STATUS_NOT_FOUND : STATUS_IO;
        log_error("%s: %s", path, strerror(errno));
    } else {
        csv_init(&s->csv, s->stream);
        status = csv_read(&s->csv, &s->header);
        if (status == STATUS_NOT_FOUND) {
            log_error("%s: empty; expected a header as id,400,410,...,700 and a row per spectrum",
                      s->path);
            status = STATUS_FORMAT;
        } else {
            status = status == STATUS_OK ? read_header(s) : stream_error(s, status);
        }
    }
    if (status != STATUS_OK) {
        spectra_close(s);
        return status;
    }
    *ret = s;
    return STATUS_OK;
}

void spectra_close(struct spectra *spectra)
{
    if (spectra == NULL)
        return;
    if (spectra->stream != NULL && spectra->stream != stdin)
        fclose(spectra->stream);
    csv_record_done(&spectra->header);
    free(spectra->band);
    free(spectra->carried);
    free(spectra);
}

/* ---- rows --------------------------------------------------------------------------- */

static void refuse_at(const struct spectra *s, struct spectra_row *row, size_t field,
                      const char *format, va_list args) __attribute__((format(printf, 4, 0)));

static void refuse_at(const struct spectra *s, struct spectra_row *row, size_t field,
                      const char *format, va_list args)
{
    const struct csv_field *f = &row->record.field[field];
    vsnprintf(row->error, sizeof row->error, format, args);
    row->good = false;
    log_error("%s:%zu:%zu: %s", s->path, f->line, f->column, row->error);
}

/* The column a message points to; the row is as wide as the header, or it would
 * have been refused before. */
static size_t column_of(const struct spectra *s, int at)
{
    if (at == SPECTRA_AT_SPECULAR && spectra_has_specular(s))
        return s->specular_column;
    for (size_t i = 0; at >= 0 && i < s->header.n; i++)
        if (s->band[i] == at)
            return i;
    return 0;
}

void spectra_refuse(const struct spectra *spectra, struct spectra_row *row, int at,
                    const char *format, ...)
{
    va_list args;
    va_start(args, format);
    refuse_at(spectra, row, column_of(spectra, at), format, args);
    va_end(args);
}

static bool bad_field(const struct spectra *s, struct spectra_row *row, size_t column,
                      const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Always false, so that a check can end with it. */
static bool bad_field(const struct spectra *s, struct spectra_row *row, size_t column,
                      const char *format, ...)
{
    va_list args;
    va_start(args, format);
    refuse_at(s, row, column, format, args);
    va_end(args);
    return false;
}

/* "0,35" or "12,5e-3": digits around one comma. */
static bool has_decimal_comma(const char *text)
{
    const char *comma = strchr(text, ',');
    return comma != NULL && comma > text && is_digit(comma[-1]) && is_digit(comma[1]);
}

/* All wavelength columns hold whole numbers: what "0,35" becomes when it is split. */
static bool looks_split_at_commas(const struct spectra_row *row)
{
    size_t whole = 0;
    for (size_t i = 0; i < row->record.n; i++) {
        const char *text = row->record.field[i].text;
        whole += *text != '\0' && text[strspn(text, "0123456789")] == '\0';
    }
    return 2 * whole > row->record.n;
}

static bool check_width(const struct spectra *s, struct spectra_row *row)
{
    if (row->record.n == s->header.n)
        return true;
    size_t last = row->record.n - 1;
    if (row->record.n > s->header.n && looks_split_at_commas(row))
        return bad_field(s, row, s->header.n,
                         "%zu fields where the header has %zu; these look like decimal commas: "
                         "write numbers with a point",
                         row->record.n, s->header.n);
    return bad_field(s, row, last, "%zu field%s where the header has %zu", row->record.n,
                     row->record.n == 1 ? "" : "s", s->header.n);
}

static bool bad_number(const struct spectra *s, struct spectra_row *row, size_t column,
                       enum status status)
{
    char cut[48];
    const char *text = row->record.field[column].text, *nm = s->header.field[column].text;
    if (*text == '\0')
        return bad_field(s, row, column, "no value at %s nm; expected a reflectance 0..1", nm);
    if (has_decimal_comma(text))
        return bad_field(s, row, column, "'%s' at %s nm has a decimal comma; write it with a point",
                         shown(text, cut), nm);
    if (strchr(text, '%') != NULL)
        return bad_field(s, row, column,
                         "'%s' at %s nm is in percent; expected a fraction 0..1: divide by 100",
                         shown(text, cut), nm);
    if (status == STATUS_RANGE || strcasecmp(text, "nan") == 0 || strcasecmp(text, "inf") == 0 ||
        strcasecmp(text, "-inf") == 0)
        return bad_field(s, row, column, "'%s' at %s nm is not a finite number", shown(text, cut),
                         nm);
    return bad_field(s, row, column, "'%s' at %s nm is not a number; expected a reflectance 0..1",
                     shown(text, cut), nm);
}

/* A fraction may exceed 1 a little (white calibration, fluorescence), not 2. */
static bool read_value(const struct spectra *s, struct spectra_row *row, size_t column)
{
    double x;
    const char *text = row->record.field[column].text, *nm = s->header.field[column].text;
    enum status status = number_parse(text, &x);
    if (status != STATUS_OK)
        return bad_number(s, row, column, status);
    if (x < 0.0)
        return bad_field(s, row, column, "%g at %s nm is negative; expected a reflectance 0..1", x,
                         nm);
    if (x > 2.0 && x <= 200.0)
        return bad_field(s, row, column,
                         "%g at %s nm is above 2; this looks like percent: divide by 100", x, nm);
    if (x > 2.0)
        return bad_field(s, row, column, "%g at %s nm is above 2; expected a reflectance 0..1", x,
                         nm);
    row->spectrum.value[s->band[column]] = x;
    return true;
}

static bool read_specular(const struct spectra *s, struct spectra_row *row)
{
    char cut[48];
    if (!spectra_has_specular(s))
        return true;
    const char *text = row->record.field[s->specular_column].text;
    if (*text == '\0' || specular_parse(text, &row->spectrum.specular) == STATUS_OK)
        return true;
    return bad_field(s, row, s->specular_column, "specular is '%s'; expected sce or sci",
                     shown(text, cut));
}

static bool check_texts(const struct spectra *s, struct spectra_row *row)
{
    size_t first_bad = row->record.n;
    for (size_t i = row->record.n; i-- > 0;) {
        if (!utf8_is_valid(row->record.field[i].text)) {
            row->record.field[i].text[0] = '\0'; /* nor can it be carried through */
            first_bad = i;
        }
    }
    if (first_bad < row->record.n)
        return bad_field(s, row, first_bad, "text is not UTF-8; save the file as UTF-8");
    return true;
}

static void read_row(const struct spectra *s, struct spectra_row *row)
{
    row->good = true;
    row->error[0] = '\0';
    row->line = row->record.field[0].line;
    row->spectrum = s->bands;
    row->id = NULL;
    bool texts = check_texts(s, row);
    if (s->id_column < row->record.n && *row->record.field[s->id_column].text != '\0')
        row->id = row->record.field[s->id_column].text;
    if (!texts || !check_width(s, row) || !read_specular(s, row))
        return;
    for (size_t i = 0; i < row->record.n && row->good; i++)
        if (s->band[i] != NOT_A_BAND)
            read_value(s, row, i);
}

/* What spreadsheets leave below their data: ",,,," */
static bool is_blank(const struct csv_record *record)
{
    for (size_t i = 0; i < record->n; i++)
        if (*record->field[i].text != '\0')
            return false;
    return true;
}

enum status spectra_next(struct spectra *spectra, struct spectra_row *row)
{
    enum status status;
    do
        status = csv_read(&spectra->csv, &row->record);
    while (status == STATUS_OK && is_blank(&row->record));
    if (status != STATUS_OK)
        return stream_error(spectra, status);
    row->number = ++spectra->rows;
    read_row(spectra, row);
    return STATUS_OK;
}

void spectra_row_done(struct spectra_row *row)
{
    csv_record_done(&row->record);
}
