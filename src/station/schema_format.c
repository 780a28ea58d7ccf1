/* schema_format.c - what a string may be held to. */
#include <string.h>

#include "base/uuid.h"
#include "station/schema_private.h"

enum { SHA256_DIGITS = 64 };

static bool only(const char *text, const char *allowed)
{
    return text[strspn(text, allowed)] == '\0';
}

#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
#define DIGITS "0123456789"

static bool is_sha256(const char *text)
{
    return strlen(text) == SHA256_DIGITS && only(text, DIGITS "abcdef");
}

static bool is_token(const char *text)
{
    return only(text, LETTERS DIGITS "_");
}

static bool is_name(const char *text)
{
    return only(text, LETTERS DIGITS "_-") && *text != '-';
}

/* U+0000..U+001F, U+007F..U+009F but those allowed; the text is valid UTF-8. */
static bool has_control(const char *text, const char *allowed)
{
    for (const unsigned char *p = (const unsigned char *)text; *p != '\0'; p++)
        if (((*p < 0x20 || *p == 0x7f) && strchr(allowed, *p) == NULL) ||
            (*p == 0xc2 && p[1] < 0xa0))
            return true;
    return false;
}

static bool is_text(const char *text)
{
    return !has_control(text, "");
}

static bool is_notes(const char *text)
{
    return !has_control(text, "\n\t");
}

/* Of two digits. */
static int two(const char *text)
{
    return (text[0] - '0') * 10 + (text[1] - '0');
}

/* Digits at their places, and no month 13; days are not counted. */
static bool is_date_time(const char *text)
{
    static const char shape[] = "0000-00-00T00:00:00";
    size_t n = strlen(shape);
    for (size_t i = 0; i < n; i++)
        if (shape[i] == '0' ? strchr(DIGITS, text[i]) == NULL || text[i] == '\0'
                            : text[i] != shape[i])
            return false;
    int month = two(text + 5), day = two(text + 8), hour = two(text + 11);
    int minute = two(text + 14), second = two(text + 17);
    if (text[n] == '.') {
        size_t digits = strspn(text + n + 1, DIGITS);
        n += 1 + digits;
        if (digits == 0)
            return false;
    }
    return strcmp(text + n, "Z") == 0 && month >= 1 && month <= 12 && day >= 1 && day <= 31 &&
           hour < 24 && minute < 60 && second <= 60;
}

static const struct schema_format formats[] = {
    { "uuid", uuid_is_text, "a UUID" },
    { "sha256", is_sha256, "64 hexadecimal digits in lower case" },
    { "date-time", is_date_time, "a time of RFC 3339 in UTC" },
    { "token", is_token, "made of letters, digits and _" },
    { "name", is_name, "made of letters, digits, - and _, not beginning with -" },
    { "text", is_text, "one line without control characters" },
    { "notes", is_notes, "text without control characters but line feeds and tabs" },
};

const struct schema_format *schema_format_of(const char *name)
{
    for (size_t i = 0; i < sizeof formats / sizeof *formats; i++)
        if (strcmp(name, formats[i].name) == 0)
            return &formats[i];
    return NULL;
}
