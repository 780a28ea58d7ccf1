/* spectra_columns.c - the header of a spectrum file, and what can be wrong with it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/log.h"
#include "base/number.h"
#include "base/utf8.h"
#include "cli/spectra_private.h"

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
    char cut[SPECTRA_SHOWN_SIZE];
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
                            spectra_shown(name, cut));
    if (s->bands.n > 0 && nm < *last_nm)
        return header_error(s, column, "wavelength %s after %g; expected them to rise",
                            spectra_shown(name, cut), *last_nm);
    if (s->bands.n == 0)
        s->bands.first_nm = nm;
    else if (s->bands.n == 1)
        s->bands.step_nm = nm - *last_nm;
    else if (fabs(spectrum_nm(&s->bands, s->bands.n) - nm) > 1e-3 * s->bands.step_nm)
        return header_error(s, column, "wavelength %s breaks the even step of %g nm; expected %g",
                            spectra_shown(name, cut), s->bands.step_nm,
                            spectrum_nm(&s->bands, s->bands.n));
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

enum status spectra_read_columns(struct spectra *s)
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
