/* csv.c - fields made in place: a NUL where each ends. */
#include "cli/csv.h"

#include <stdlib.h>
#include <string.h>

void csv_init(struct csv *csv, char *text, size_t n, size_t line)
{
    text[n] = '\n'; /* so that a search for the end of a line always finds one */
    *csv = (struct csv){
        .at = text, .end = text + n, .line_start = text, .line = line, .at_start = line == 1
    };
}

void csv_record_done(struct csv_record *record)
{
    free(record->field);
    memset(record, 0, sizeof *record);
}

static size_t column_of(const struct csv *csv, const char *at)
{
    return (size_t)(at - csv->line_start) + 1;
}

static enum status fail(struct csv *csv, size_t line, size_t column, const char *why)
{
    csv->error_line = line;
    csv->error_column = column;
    csv->error = why;
    return STATUS_FORMAT;
}

static enum status fail_at(struct csv *csv, const char *at, const char *why)
{
    return fail(csv, csv->line, column_of(csv, at), why);
}

static const char not_text[] = "this is not a text file; expected CSV";

/* What a byte is to a field that is not quoted. */
enum { PLAIN, ENDS, CARRIAGE_RETURN, BINARY };

static int class_of(char c)
{
    /* Control characters that no text file holds are BINARY; bytes from 128 on are PLAIN. */
    static const unsigned char class[256] = {
        [0] = BINARY,  [1] = BINARY,  [2] = BINARY,  [3] = BINARY,  [4] = BINARY,
        [5] = BINARY,  [6] = BINARY,  [7] = BINARY,  [8] = BINARY,  ['\n'] = ENDS,
        [11] = BINARY, [14] = BINARY, [15] = BINARY, [16] = BINARY, [17] = BINARY,
        [18] = BINARY, [19] = BINARY, [20] = BINARY, [21] = BINARY, [22] = BINARY,
        [23] = BINARY, [24] = BINARY, [25] = BINARY, [26] = BINARY, [27] = BINARY,
        [28] = BINARY, [29] = BINARY, [30] = BINARY, [31] = BINARY, ['\r'] = CARRIAGE_RETURN,
        [','] = ENDS,  [127] = BINARY
    };
    return class[(unsigned char)c];
}

/* n bytes from `at` on belong to the record. */
static enum status store(struct csv *csv, const char *at, size_t n)
{
    if (n > CSV_MAX_RECORD - csv->stored)
        return fail(csv, csv->line, column_of(csv, at + (CSV_MAX_RECORD - csv->stored)) + 1,
                    "record longer than 1 MiB");
    csv->stored += n;
    return STATUS_OK;
}

static enum status add_field(struct csv *csv, struct csv_record *r)
{
    if (r->n == CSV_MAX_FIELDS)
        return fail_at(csv, csv->at, "more than 4096 fields");
    if (r->n == r->capacity) {
        size_t capacity = r->capacity > 0 ? 2 * r->capacity : 64;
        struct csv_field *field = realloc(r->field, capacity * sizeof *field);
        if (field == NULL)
            return STATUS_NO_MEMORY;
        r->field = field;
        r->capacity = capacity;
    }
    r->field[r->n++] = (struct csv_field){ csv->at, csv->line, column_of(csv, csv->at) };
    return STATUS_OK;
}

/* The rest of a quoted field, after its opening quote: moved to `to`, whose end is *ret. */
static enum status read_quoted(struct csv *csv, char *to, char **ret)
{
    const size_t line = csv->line, column = column_of(csv, csv->at - 1);
    for (;; csv->at++) {
        const char c = *csv->at;
        if (csv->at == csv->end)
            return fail(csv, line, column, "quote is opened here and never closed");
        if (c == '"' && *++csv->at != '"')
            break;
        if (class_of(c) == BINARY)
            return fail_at(csv, csv->at, not_text);
        if (c == '\n') {
            csv->line++;
            csv->line_start = csv->at + 1;
        }
        if (store(csv, csv->at, 1) != STATUS_OK)
            return STATUS_FORMAT;
        *to++ = c;
    }
    *ret = to;
    return STATUS_OK;
}

/* What a quoted field is followed by, which is nothing or a carriage return. */
static enum status check_after_quote(struct csv *csv)
{
    char c = *csv->at;
    if (csv->at == csv->end || c == ',' || c == '\n' || c == '\r')
        return STATUS_OK;
    return fail_at(csv, csv->at, "expected a comma after the closing quote");
}

/* Past what ends the field, from csv->at on: plain bytes without a copy. */
static enum status find_end(struct csv *csv)
{
    char *from = csv->at, *at = from;
    const char *why = NULL;
    for (int class; why == NULL && (class = class_of(*at)) != ENDS;) {
        if (class == BINARY)
            why = not_text;
        else if (class == CARRIAGE_RETURN && at[1] != '\n')
            why = "a carriage return alone ends this line; expected LF or CRLF";
        else
            at++;
    }
    enum status s = store(csv, from, (size_t)(at - from));
    if (s == STATUS_OK && why != NULL)
        s = fail_at(csv, at, why);
    if (s == STATUS_OK)
        s = store(csv, at, 1); /* its NUL */
    csv->at = at;
    return s;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

/* Blanks around a field that is not quoted are no part of it, nor is the CR of CRLF. */
static void trim(char **from, char **end)
{
    if (*end > *from && **end == '\n' && (*end)[-1] == '\r')
        --*end;
    while (*end > *from && is_blank((*end)[-1]))
        --*end;
    while (*from < *end && is_blank(**from))
        ++*from;
}

/* One field from csv->at on; csv->at is then what ended it, and *more whether that was a comma.
 * What ended it may be its NUL by then. */
static enum status read_field(struct csv *csv, struct csv_record *r, bool *more)
{
    char *from = csv->at, *end = NULL;
    bool quoted = *from == '"' && from < csv->end;
    enum status s = add_field(csv, r);
    if (s == STATUS_OK && quoted) {
        csv->at++;
        s = read_quoted(csv, from, &end);
        if (s == STATUS_OK)
            s = check_after_quote(csv);
    }
    if (s == STATUS_OK)
        s = find_end(csv);
    if (s != STATUS_OK)
        return s;
    if (!quoted) {
        end = csv->at;
        trim(&from, &end);
        r->field[r->n - 1].text = from;
    }
    *more = *csv->at == ',';
    *end = '\0';
    return STATUS_OK;
}

static void next_line(struct csv *csv)
{
    csv->at++;
    csv->line++;
    csv->line_start = csv->at;
}

static enum status skip_mark(struct csv *csv)
{
    const unsigned char *at = (const unsigned char *)csv->at;
    if (*at == 0xff || *at == 0xfe)
        return fail(csv, 1, 1, "this looks like UTF-16; save it as UTF-8 text");
    if (*at != 0xef)
        return STATUS_OK;
    if (csv->end - csv->at < 3 || at[1] != 0xbb || at[2] != 0xbf)
        return fail(csv, 1, 1, not_text);
    csv->at += 3;
    csv->line_start = csv->at;
    return STATUS_OK;
}

/* Past byte order mark, comments and empty lines. */
static enum status skip_to_record(struct csv *csv)
{
    if (csv->at_start && csv->at < csv->end && skip_mark(csv) != STATUS_OK)
        return STATUS_FORMAT;
    csv->at_start = false;
    while (csv->at < csv->end && (*csv->at == '#' || *csv->at == '\n' || *csv->at == '\r')) {
        csv->at = memchr(csv->at, '\n', (size_t)(csv->end - csv->at) + 1);
        if (csv->at < csv->end)
            next_line(csv);
    }
    return STATUS_OK;
}

enum status csv_read(struct csv *csv, struct csv_record *record)
{
    bool more = true;
    record->n = csv->stored = 0;
    enum status s = skip_to_record(csv);
    if (s == STATUS_OK && csv->at == csv->end)
        return STATUS_NOT_FOUND;
    while (s == STATUS_OK && more) {
        s = read_field(csv, record, &more);
        if (s == STATUS_OK && more)
            csv->at++;
    }
    if (s == STATUS_OK && csv->at < csv->end)
        next_line(csv);
    return s;
}
