/* csv.c - one byte at a time; the stream's own buffer makes that fast enough. */
#include "cli/csv.h"

#include <stdlib.h>
#include <string.h>

void csv_init(struct csv *csv, FILE *stream)
{
    *csv = (struct csv){ .stream = stream, .line = 1, .column = 1 };
}

void csv_record_done(struct csv_record *record)
{
    free(record->field);
    free(record->buffer);
    memset(record, 0, sizeof *record);
}

static int next_byte(struct csv *csv)
{
    int c = getc_unlocked(csv->stream);
    csv->column++;
    return c;
}

static enum status fail(struct csv *csv, size_t line, size_t column, const char *why)
{
    csv->error_line = line;
    csv->error_column = column;
    csv->error = why;
    return STATUS_FORMAT;
}

/* Fields hold offsets while the buffer may still move; see fix_texts(). */
static enum status put(struct csv *csv, struct csv_record *r, int c)
{
    if (r->size == r->capacity) {
        size_t capacity = r->capacity > 0 ? 2 * r->capacity : 4096;
        char *buffer = realloc(r->buffer, capacity);
        if (buffer == NULL)
            return STATUS_NO_MEMORY;
        r->buffer = buffer;
        r->capacity = capacity;
    }
    if (r->size >= CSV_MAX_RECORD)
        return fail(csv, csv->line, csv->column, "record longer than 1 MiB");
    r->buffer[r->size++] = (char)c;
    return STATUS_OK;
}

static enum status add_field(struct csv *csv, struct csv_record *r)
{
    if (r->n == CSV_MAX_FIELDS)
        return fail(csv, csv->line, csv->column, "more than 4096 fields");
    if (r->n == r->field_capacity) {
        size_t capacity = r->field_capacity > 0 ? 2 * r->field_capacity : 64;
        struct csv_field *field = realloc(r->field, capacity * sizeof *field);
        if (field == NULL)
            return STATUS_NO_MEMORY;
        r->field = field;
        r->field_capacity = capacity;
    }
    r->field[r->n++] = (struct csv_field){ NULL, csv->line, csv->column, false };
    return STATUS_OK;
}

/* Where each text begins, now that the buffer stays; blanks around a field that
 * is not quoted are no part of it. */
static void fix_texts(struct csv_record *r)
{
    char *text = r->buffer;
    for (size_t i = 0; i < r->n; i++) {
        size_t n = strlen(text);
        char *next = text + n + 1;
        if (!r->field[i].quoted) {
            while (n > 0 && (text[n - 1] == ' ' || text[n - 1] == '\t'))
                text[--n] = '\0';
            text += strspn(text, " \t");
        }
        r->field[i].text = text;
        text = next;
    }
}

/* Control characters that no text file holds. */
static bool is_binary(int c)
{
    return (c < 32 && c != '\t' && c != '\n' && c != '\r' && c != '\f') || c == 127;
}

static const char not_text[] = "this is not a text file; expected CSV";

/* The rest of a quoted field, after its opening quote.  *c is the byte after the
 * closing one. */
static enum status read_quoted(struct csv *csv, struct csv_record *r, int *c)
{
    size_t line = csv->line, column = csv->column - 1;
    for (;;) {
        *c = next_byte(csv);
        if (*c == EOF)
            return fail(csv, line, column, "quote is opened here and never closed");
        if (*c == '"') {
            *c = next_byte(csv);
            if (*c != '"')
                return STATUS_OK;
        } else if (is_binary(*c)) {
            return fail(csv, csv->line, csv->column - 1, not_text);
        } else if (*c == '\n') {
            csv->line++;
            csv->column = 1;
        }
        enum status s = put(csv, r, *c);
        if (s != STATUS_OK)
            return s;
    }
}

/* One field; *c is its first byte on entry, what ended it on return. */
static enum status read_field(struct csv *csv, struct csv_record *r, int *c)
{
    enum status s = STATUS_OK;
    csv->column--; /* *c is read already */
    s = add_field(csv, r);
    csv->column++;
    if (s == STATUS_OK && *c == '"') {
        r->field[r->n - 1].quoted = true;
        s = read_quoted(csv, r, c);
        if (s == STATUS_OK && *c != ',' && *c != '\n' && *c != '\r' && *c != EOF)
            return fail(csv, csv->line, csv->column - 1,
                        "expected a comma after the closing quote");
    }
    while (s == STATUS_OK && *c != ',' && *c != '\n' && *c != EOF) {
        if (is_binary(*c))
            return fail(csv, csv->line, csv->column - 1, not_text);
        bool cr = *c == '\r';
        s = put(csv, r, *c);
        *c = next_byte(csv);
        if (s == STATUS_OK && cr && *c != '\n' && *c != EOF)
            return fail(csv, csv->line, csv->column - 2,
                        "a carriage return alone ends this line; expected LF or CRLF");
    }
    /* CRLF: the carriage return is no part of the last field. */
    if (s == STATUS_OK && (*c == '\n' || *c == EOF) && r->size > 0 &&
        r->buffer[r->size - 1] == '\r')
        r->size--;
    return s == STATUS_OK ? put(csv, r, '\0') : s;
}

/* Past byte order mark, comments and empty lines; the first byte of a record, or
 * EOF. */
static enum status skip_to_record(struct csv *csv, int *c)
{
    *c = next_byte(csv);
    if (!csv->started) {
        csv->started = true;
        if (*c == 0xff || *c == 0xfe)
            return fail(csv, 1, 1, "this looks like UTF-16; save it as UTF-8 text");
        if (*c == 0xef) {
            int second = next_byte(csv), third = next_byte(csv);
            if (second != 0xbb || third != 0xbf)
                return fail(csv, 1, 1, not_text);
            csv->column = 1;
            *c = next_byte(csv);
        }
    }
    while (*c == '#' || *c == '\n' || *c == '\r') {
        while (*c != '\n' && *c != EOF)
            *c = next_byte(csv);
        if (*c == EOF)
            break;
        csv->line++;
        csv->column = 1;
        *c = next_byte(csv);
    }
    return STATUS_OK;
}

enum status csv_read(struct csv *csv, struct csv_record *record)
{
    int c;
    record->n = record->size = 0;
    enum status s = skip_to_record(csv, &c);
    if (s != STATUS_OK)
        return s;
    if (c == EOF)
        return ferror(csv->stream) ? STATUS_IO : STATUS_NOT_FOUND;
    for (;;) {
        s = read_field(csv, record, &c);
        if (s != STATUS_OK)
            return s;
        if (c != ',')
            break;
        c = next_byte(csv);
    }
    if (c == '\n') {
        csv->line++;
        csv->column = 1;
    }
    if (ferror(csv->stream))
        return STATUS_IO;
    fix_texts(record);
    return STATUS_OK;
}
