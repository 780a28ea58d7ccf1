/* spectra_line.c - a row of NDJSON, and what can be wrong with it. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "cli/spectra_private.h"

enum { LONGEST = 1 << 20 };

static bool bad_place(struct spectra_row *row, const char *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Always false, so that a check can end with it. */
static bool bad_place(struct spectra_row *row, const char *at, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    spectra_mark(row, row->line, (size_t)(at - row->line_text) + 1, format, args);
    va_end(args);
    return false;
}

static const char *fault_text(enum strict_json_fault fault)
{
    switch (fault) {
    case STRICT_JSON_UTF8:
        return "text is not UTF-8; save the file as UTF-8";
    case STRICT_JSON_NUL:
        return "a NUL in the text; expected an object of JSON a line";
    case STRICT_JSON_DUPLICATE:
        return "a name that stands twice in one object";
    case STRICT_JSON_DEPTH:
        return "more than 16 objects and arrays within each other";
    case STRICT_JSON_MEMBERS:
        return "more than 128 members in one object";
    case STRICT_JSON_NUMBER:
        return "a number beyond what a double holds, or of more than 63 bytes";
    default:
        return "not JSON; expected an object a line: {\"id\":\"a\",\"spectrum\":{\"first_nm\":400,"
               "\"step_nm\":10,\"values\":[0.2,...]}}";
    }
}

/* ---- the spectrum ------------------------------------------------------------------- */

static bool read_number(struct spectra_row *row, struct json_line *object, const char *place,
                        const char *name, double lo, double hi, double *ret)
{
    const struct json_member *member = json_line_member(object, name);
    if (member == NULL)
        return bad_place(row, place,
                         "the spectrum has no %s; expected first_nm, step_nm and values", name);
    if (!json_member_is_number(member) ||
        number_parse_n(member->value, member->n, ret) != STATUS_OK)
        return bad_place(row, member->value, "%s is not a number; expected %g..%g nm", name, lo,
                         hi);
    if (*ret < lo || *ret > hi)
        return bad_place(row, member->value, "%s is %g; expected %g..%g nm", name, *ret, lo, hi);
    return true;
}

static bool read_value(struct spectra_row *row, const char *item, size_t n)
{
    struct spectrum *s = &row->spectrum;
    char nm[NUMBER_TEXT_SIZE], why[SPECTRA_ERROR_SIZE];
    double x;
    if (s->n == SPECTRUM_MAX_BANDS)
        return bad_place(row, item, "more than %d values", SPECTRUM_MAX_BANDS);
    if (number_parse_n(item, n, &x) != STATUS_OK)
        return bad_place(row, item,
                         "the value at %s nm is not a number; expected a reflectance 0..1",
                         number_format(spectrum_nm(s, s->n), 6, nm));
    if (x < 0.0 || x > 2.0)
        return bad_place(row, item, "%s",
                         spectra_value_fault(x, number_format(spectrum_nm(s, s->n), 6, nm), why));
    s->flag[s->n] = 0;
    s->value[s->n++] = x;
    return true;
}

static bool read_values(struct spectra_row *row, struct json_line *object, const char *place)
{
    const struct json_member *values = json_line_member(object, "values");
    const char *item, *at;
    size_t n;
    if (values == NULL)
        return bad_place(row, place,
                         "the spectrum has no values; expected first_nm, step_nm and values");
    if (*values->value != '[')
        return bad_place(row, values->value, "values are no array; expected [0.2,0.21,...]");
    at = row->values = values->value;
    row->spectrum.n = 0;
    while ((item = json_item_next(&at, &n)) != NULL)
        if (!read_value(row, item, n))
            return false;
    if (row->spectrum.n < 2)
        return bad_place(row, values->value, "%zu value%s; expected those of 400 to 700 nm",
                         row->spectrum.n, row->spectrum.n == 1 ? "" : "s");
    return true;
}

/* It is taken out of what is carried. */
static bool read_spectrum(struct spectra_row *row, struct json_member *member)
{
    struct json_line object;
    struct spectrum *s = &row->spectrum;
    const char *place = member->value;
    if (*place != '{' || !json_line_split(member->value, member->n, &object))
        return bad_place(row, place,
                         "spectrum is no object; expected {\"first_nm\":400,\"step_nm\":10,"
                         "\"values\":[0.2,...]}");
    for (size_t i = 0; i < object.n; i++) {
        const char *name = object.member[i].name;
        char cut[SPECTRA_SHOWN_SIZE];
        if (strcmp(name, "first_nm") != 0 && strcmp(name, "step_nm") != 0 &&
            strcmp(name, "values") != 0)
            return bad_place(
                row, object.member[i].value,
                "the spectrum has a member '%s'; expected first_nm, step_nm and values",
                spectra_shown(name, cut));
    }
    return read_number(row, &object, place, "first_nm", 200.0, 2500.0, &s->first_nm) &&
           read_number(row, &object, place, "step_nm", 0.1, 100.0, &s->step_nm) &&
           read_values(row, &object, place);
}

/* ---- the line ----------------------------------------------------------------------- */

static bool read_id(struct spectra_row *row)
{
    struct json_member *id = json_line_member(&row->members, "id");
    if (id == NULL)
        return true;
    row->id_is_number = json_member_is_number(id);
    if (!row->id_is_number && !json_member_is_text(id))
        return bad_place(row, id->value, "id is neither a text nor a number");
    row->id = row->id_is_number ? id->value : json_member_text(id);
    if (*row->id == '\0')
        row->id = NULL;
    return true;
}

static bool read_specular(struct spectra_row *row)
{
    const struct json_member *specular = json_line_member(&row->members, "specular");
    char word[8] = "", cut[SPECTRA_SHOWN_SIZE];
    if (specular == NULL)
        return true;
    if (json_member_is_text(specular) && specular->n < sizeof word)
        memcpy(word, specular->value + 1, specular->n - 2);
    if (specular_parse(word, &row->spectrum.specular) == STATUS_OK)
        return true;
    return bad_place(row, specular->value, "specular is %s; expected \"sce\" or \"sci\"",
                     spectra_shown(specular->value, cut));
}

static bool read_members(struct spectra_row *row)
{
    struct json_member *spectrum = json_line_member(&row->members, "spectrum");
    bool id = read_id(row);
    if (!id || !read_specular(row))
        return false;
    if (spectrum == NULL)
        return bad_place(row, row->line_text,
                         "no spectrum; expected \"spectrum\":{\"first_nm\":400,\"step_nm\":10,"
                         "\"values\":[0.2,...]}");
    return read_spectrum(row, spectrum);
}

static void read_object(struct spectra_row *row, char *text, size_t n)
{
    size_t at = 0;
    enum strict_json_fault fault = strict_json_check(text, n, &at);
    if (fault != STRICT_JSON_FINE)
        bad_place(row, text + at, "%s", fault_text(fault));
    else if (!json_line_split(text, n, &row->members))
        bad_place(row, text, "no object; expected {\"id\":\"a\",\"spectrum\":{...}}");
    else
        read_members(row);
}

/* The next line that is not blank; its length without its end.  NULL at the end. */
static char *next_line(struct spectra_piece *piece, size_t *n)
{
    const char *end = piece->piece.text + piece->piece.n;
    while (piece->at < end) {
        char *text = piece->at;
        char *line_end = memchr(text, '\n', (size_t)(end - text));
        *n = (size_t)((line_end != NULL ? line_end : end) - text);
        piece->at = text + *n + 1;
        piece->line++;
        for (size_t i = 0; i < *n; i++)
            if (strchr(" \t\r", text[i]) == NULL || text[i] == '\0')
                return text;
    }
    return NULL;
}

enum status spectra_read_line(struct spectra_piece *piece, struct spectra_row *row)
{
    size_t n;
    char *text = next_line(piece, &n);
    if (text == NULL)
        return STATUS_NOT_FOUND;
    spectra_begin_row(row, piece->line - 1);
    row->line_text = text;
    if (n > LONGEST) {
        piece->error = "line longer than 1 MiB";
        piece->error_line = row->line;
        piece->error_column = LONGEST + 1;
        return STATUS_FORMAT;
    }
    read_object(row, text, n);
    return STATUS_OK;
}

size_t spectra_line_column(const struct spectra_row *row, int at)
{
    const char *place = row->line_text, *values = row->values;
    size_t n;
    for (int i = 0; at >= 0 && values != NULL && i <= at; i++)
        place = json_item_next(&values, &n);
    for (size_t i = 0; at == SPECTRA_AT_SPECULAR && i < row->members.n; i++)
        if (strcmp(row->members.member[i].name, "specular") == 0)
            place = row->members.member[i].value;
    return place != NULL ? (size_t)(place - row->line_text) + 1 : 1;
}
