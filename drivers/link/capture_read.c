/* capture_read.c - a capture back into what was said. */
#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

#include "drivers/link/capture.h"
#include "drivers/driver.h"

#include "base/log.h"
#include "base/number.h"

/* Of a capture, seconds: thirty years. */
#define MOST_S 1e9

/* What is being read, for messages. */
struct reader {
    const char *path;
    unsigned line;
};

static enum status refuse(const struct reader *reader, const char *why)
{
    log_error("%s:%u: %s", reader->path, reader->line, why);
    return STATUS_FORMAT;
}

static enum status no_memory(const struct reader *reader)
{
    log_error("%s:%u: no memory", reader->path, reader->line);
    return STATUS_NO_MEMORY;
}

/* ---- bytes -------------------------------------------------------------------------- */

/* Two hex digits; -1 where they are none. */
static int hex_byte(const char *digits)
{
    static const char all[] = "0123456789abcdef";
    int byte = 0;
    for (int i = 0; i < 2; i++) {
        const char *digit =
            digits[i] == '\0' ? NULL : strchr(all, tolower((unsigned char)digits[i]));
        if (digit == NULL)
            return -1;
        byte = byte * 16 + (int)(digit - all);
    }
    return byte;
}

/* One byte of text, and how many characters it takes; -1 where that is none. */
static int text_byte(const char *text, size_t *taken)
{
    *taken = 1;
    if (text[0] != '\\')
        return (unsigned char)text[0] >= 0x20 && (unsigned char)text[0] <= 0x7e ? text[0] : -1;
    *taken = 2;
    switch (text[1]) {
    case 'r':
        return '\r';
    case 'n':
        return '\n';
    case '\\':
        return '\\';
    case 'x':
        *taken = 4;
        return hex_byte(text + 2);
    default:
        return -1;
    }
}

/* Text is never shorter than the bytes it stands for. */
static enum status read_bytes(const struct reader *reader, const char *text,
                              struct capture_line *line)
{
    bool hex = *text == ':';
    text += hex;
    if (*text == '\0')
        return hex ? refuse(reader, "no hex follows the ':'") : STATUS_OK;
    line->bytes = malloc(strlen(text));
    if (line->bytes == NULL)
        return no_memory(reader);
    while (*text != '\0') {
        size_t taken = 2;
        int byte = hex ? hex_byte(text) : text_byte(text, &taken);
        if (byte < 0)
            return refuse(reader, hex ? "hex digits come in pairs after ':'"
                                      : "bytes are printable ASCII, \\r, \\n, \\\\ or \\xHH");
        line->bytes[line->n++] = (uint8_t)byte;
        text += taken;
    }
    return STATUS_OK;
}

/* "00 BYTES" */
static enum status read_transfer(const struct reader *reader, const char *text,
                                 struct capture_line *line)
{
    int channel = hex_byte(text);
    if (channel < 0 || (text[2] != '\0' && text[2] != ' '))
        return refuse(reader, "a channel is two hex digits and a space");
    line->channel = (uint8_t)channel;
    text += text[2] == ' ' ? 3 : 2;
    if (line->kind == CAPTURE_SILENCE && *text != '\0')
        return refuse(reader, "silence has a channel and no bytes");
    return read_bytes(reader, text, line);
}

/* ---- lines -------------------------------------------------------------------------- */

static bool is_result(const char *name)
{
    for (enum driver_result result = DRIVER_CANCELLED; result <= DRIVER_NO_PERMISSION; result++)
        if (strcmp(driver_result_name(result), name) == 0)
            return true;
    return false;
}

static enum status read_text(const struct reader *reader, const char *text,
                             struct capture_line *line)
{
    size_t seconds;
    if (*text == '\0')
        return refuse(reader, "a name is missing");
    if (line->kind == CAPTURE_FAILED && !is_result(text))
        return refuse(reader, "after '!' comes how the link failed: gone, timeout, protocol ...");
    if (line->kind == CAPTURE_CLOCK && number_parse_count(text, SIZE_MAX, &seconds) != STATUS_OK)
        return refuse(reader, "after 'clock' come seconds since 1970");
    line->text = strdup(text);
    return line->text != NULL ? STATUS_OK : no_memory(reader);
}

static const struct kind {
    const char *word;
    enum capture_kind kind;
    bool is_transfer;
} kinds[] = {
    { "driver ", CAPTURE_DRIVER, false }, { "open ", CAPTURE_OPEN, false },
    { "= ", CAPTURE_CALL, false },        { "> ", CAPTURE_SENT, true },
    { "< ", CAPTURE_CAME, true },         { "~ ", CAPTURE_SILENCE, true },
    { "! ", CAPTURE_FAILED, false },      { "@ ", CAPTURE_ASKED, false },
    { "clock ", CAPTURE_CLOCK, false },
};

/* "SECONDS WORD REST"; text is cut apart. */
static enum status read_line(const struct reader *reader, char *text, struct capture_line *line)
{
    char *rest = strchr(text, ' ');
    if (rest == NULL)
        return refuse(reader, "neither '# ...' nor a time in seconds and what happened");
    *rest++ = '\0';
    if (number_parse(text, &line->at_s) != STATUS_OK ||
        !(line->at_s >= 0.0 && line->at_s <= MOST_S))
        return refuse(reader, "a line begins with '#' or with a time in seconds");
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        size_t n = strlen(kinds[i].word);
        if (strncmp(rest, kinds[i].word, n) != 0)
            continue;
        line->kind = kinds[i].kind;
        return kinds[i].is_transfer ? read_transfer(reader, rest + n, line)
                                    : read_text(reader, rest + n, line);
    }
    return refuse(reader, "after the time comes one of driver, open, clock, = > < ~ ! @");
}

/* ---- notes -------------------------------------------------------------------------- */

/* Days from 1970-01-01 to a day of the Gregorian calendar; the year begins in March, so that
 * the day of leap years is its last. */
static int64_t days_since_1970(int year, int month, int day)
{
    int64_t y = month <= 2 ? year - 1 : year, m = (month + 9) % 12;
    return 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 1 - 719468;
}

static int number_at(const char *digits, size_t at, size_t n)
{
    int number = 0;
    for (size_t i = at; i < at + n; i++)
        number = number * 10 + digits[i] - '0';
    return number;
}

/* "2026-11-22T09:30:00Z", with anything behind it. */
static bool read_date(const char *text, int64_t *ret)
{
    static const char form[] = "dddd-dd-ddTdd:dd:ddZ";
    for (size_t i = 0; form[i] != '\0'; i++)
        if (form[i] != 'd' ? text[i] != form[i] : !isdigit((unsigned char)text[i]))
            return false; /* at the end of the text at the latest */
    int year = number_at(text, 0, 4), month = number_at(text, 5, 2), day = number_at(text, 8, 2);
    int hour = number_at(text, 11, 2), minute = number_at(text, 14, 2);
    int second = number_at(text, 17, 2);
    if (year < 1970 || month < 1 || month > 12 || day < 1 || day > 31 || hour > 23 || minute > 59 ||
        second > 60)
        return false;
    *ret = ((days_since_1970(year, month, day) * 24 + hour) * 60 + minute) * 60 + second;
    return true;
}

static enum status read_note(const struct reader *reader, const char *note,
                             struct capture_file *file)
{
    static const char date[] = "# date: ";
    if (strncmp(note, date, strlen(date)) == 0 &&
        !read_date(note + strlen(date), &file->realtime_s))
        return refuse(reader, "a date is written 2026-11-22T09:30:00Z");
    return STATUS_OK;
}

static enum status read_first_line(const struct reader *reader, const char *text)
{
    static const char head[] = "# skinspec capture ";
    if (strncmp(text, head, strlen(head)) != 0)
        return refuse(reader, "no capture: one begins with '# skinspec capture 1'");
    if (strcmp(text + strlen(head), "1") != 0) {
        log_error("%s:%u: a capture of another version of this program: '%s'", reader->path,
                  reader->line, text);
        return STATUS_VERSION;
    }
    return STATUS_OK;
}

/* ---- the file ----------------------------------------------------------------------- */

static enum status add_line(const struct reader *reader, char *text, struct capture_file *file,
                            size_t *room)
{
    if (file->n == *room) {
        size_t more = *room > 0 ? *room * 2 : 64;
        struct capture_line *lines = realloc(file->lines, more * sizeof *lines);
        if (lines == NULL)
            return no_memory(reader);
        file->lines = lines;
        *room = more;
    }
    struct capture_line *line = &file->lines[file->n++]; /* capture_free() gives it back */
    *line = (struct capture_line){ .line = reader->line };
    return read_line(reader, text, line);
}

static enum status read_one(const struct reader *reader, char *text, size_t n,
                            struct capture_file *file, size_t *room)
{
    if (strlen(text) != n)
        return refuse(reader, "a NUL: no text");
    if (reader->line == 1)
        return read_first_line(reader, text);
    if (text[0] == '#' || text[0] == '\0')
        return read_note(reader, text, file);
    return add_line(reader, text, file, room);
}

static enum status read_all(struct reader *reader, FILE *from, struct capture_file *file)
{
    enum status s = STATUS_OK;
    char *text = NULL;
    size_t text_room = 0, room = 0;
    ssize_t n;
    errno = 0;
    while (s == STATUS_OK && (n = getline(&text, &text_room, from)) > 0) {
        reader->line++;
        if (text[n - 1] != '\n') {
            log_warning("%s:%u: the last line has no end and is passed over", reader->path,
                        reader->line);
            break;
        }
        text[n - 1] = '\0';
        s = read_one(reader, text, (size_t)n - 1, file, &room);
    }
    if (s == STATUS_OK && (ferror(from) || errno == ENOMEM)) {
        log_error("%s: %s", reader->path, strerror(errno));
        s = errno == ENOMEM ? STATUS_NO_MEMORY : STATUS_IO;
    } else if (s == STATUS_OK && reader->line == 0) {
        log_error("%s:1: no capture: the file is empty", reader->path);
        s = STATUS_FORMAT;
    }
    free(text);
    return s;
}

enum status capture_read(const char *path, struct capture_file *ret)
{
    struct reader reader = { path, 0 };
    struct capture_file file = { 0, NULL, 0 };
    FILE *from = fopen(path, "re");
    if (from == NULL) {
        log_error("%s: %s", path, strerror(errno));
        return errno == ENOENT ? STATUS_NOT_FOUND : STATUS_IO;
    }
    enum status s = read_all(&reader, from, &file);
    fclose(from);
    if (s == STATUS_OK)
        *ret = file;
    else
        capture_free(&file);
    return s;
}

void capture_free(struct capture_file *file)
{
    for (size_t i = 0; i < file->n; i++) {
        free(file->lines[i].bytes);
        free(file->lines[i].text);
    }
    free(file->lines);
    *file = (struct capture_file){ 0, NULL, 0 };
}
