/* spectra_fields.c - a row of CSV, and what can be wrong with it. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/number.h"
#include "base/utf8.h"
#include "cli/spectra_private.h"

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool bad_field(struct spectra_row *row, size_t column, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Always false, so that a check can end with it. */
static bool bad_field(struct spectra_row *row, size_t column, const char *format, ...)
{
    const struct csv_field *f = &row->record.field[column];
    va_list args;
    va_start(args, format);
    spectra_mark(row, f->line, f->column, format, args);
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
        return bad_field(row, s->header.n,
                         "%zu fields where the header has %zu; these look like decimal commas: "
                         "write numbers with a point",
                         row->record.n, s->header.n);
    return bad_field(row, last, "%zu field%s where the header has %zu", row->record.n,
                     row->record.n == 1 ? "" : "s", s->header.n);
}

static bool bad_number(const struct spectra *s, struct spectra_row *row, size_t column,
                       enum status status)
{
    char cut[SPECTRA_SHOWN_SIZE];
    const char *text = row->record.field[column].text, *nm = s->header.field[column].text;
    if (*text == '\0')
        return bad_field(row, column, "no value at %s nm; expected a reflectance 0..1", nm);
    if (has_decimal_comma(text))
        return bad_field(row, column, "'%s' at %s nm has a decimal comma; write it with a point",
                         spectra_shown(text, cut), nm);
    if (strchr(text, '%') != NULL)
        return bad_field(row, column,
                         "'%s' at %s nm is in percent; expected a fraction 0..1: divide by 100",
                         spectra_shown(text, cut), nm);
    if (status == STATUS_RANGE || strcasecmp(text, "nan") == 0 || strcasecmp(text, "inf") == 0 ||
        strcasecmp(text, "-inf") == 0)
        return bad_field(row, column, "'%s' at %s nm is not a finite number",
                         spectra_shown(text, cut), nm);
    return bad_field(row, column, "'%s' at %s nm is not a number; expected a reflectance 0..1",
                     spectra_shown(text, cut), nm);
}

static bool read_value(const struct spectra *s, struct spectra_row *row, size_t column)
{
    double x;
    char why[SPECTRA_ERROR_SIZE];
    const char *text = row->record.field[column].text, *nm = s->header.field[column].text;
    size_t n = strlen(text);
    enum status status = n < NUMBER_LONGEST ? number_parse_n(text, n, &x) : number_parse(text, &x);
    if (status != STATUS_OK)
        return bad_number(s, row, column, status);
    if (spectra_value_fault(x, nm, why) != NULL)
        return bad_field(row, column, "%s", why);
    row->spectrum.value[s->band[column]] = x;
    return true;
}

static bool read_specular(const struct spectra *s, struct spectra_row *row)
{
    char cut[SPECTRA_SHOWN_SIZE];
    if (!spectra_has_specular(s))
        return true;
    const char *text = row->record.field[s->specular_column].text;
    if (*text == '\0' || specular_parse(text, &row->spectrum.specular) == STATUS_OK)
        return true;
    return bad_field(row, s->specular_column, "specular is '%s'; expected sce or sci",
                     spectra_shown(text, cut));
}

static bool check_texts(struct spectra_row *row)
{
    size_t first_bad = row->record.n;
    for (size_t i = row->record.n; i-- > 0;) {
        if (!utf8_is_valid(row->record.field[i].text)) {
            row->record.field[i].text[0] = '\0'; /* nor can it be carried through */
            first_bad = i;
        }
    }
    if (first_bad < row->record.n)
        return bad_field(row, first_bad, "text is not UTF-8; save the file as UTF-8");
    return true;
}

static void take_bands(const struct spectrum *bands, struct spectrum *ret)
{
    ret->first_nm = bands->first_nm;
    ret->step_nm = bands->step_nm;
    ret->n = bands->n;
    memset(ret->flag, 0, bands->n * sizeof *ret->flag);
}

void spectra_read_fields(const struct spectra *s, struct spectra_row *row)
{
    spectra_begin_row(row, row->record.field[0].line);
    take_bands(&s->bands, &row->spectrum);
    bool texts = check_texts(row);
    if (spectra_has_id(s) && s->id_column < row->record.n &&
        *row->record.field[s->id_column].text != '\0')
        row->id = row->record.field[s->id_column].text;
    if (!texts || !check_width(s, row) || !read_specular(s, row))
        return;
    for (size_t i = 0; i < row->record.n && row->good; i++)
        if (s->band[i] != NOT_A_BAND)
            read_value(s, row, i);
}
