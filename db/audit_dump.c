/* audit_dump.c - NAME "=" TYPE LENGTH ":" BYTES "\n", column after column. */
#include "db/audit_dump.h"

#include <string.h>

static void add(struct audit_dump *dump, const void *bytes, size_t n)
{
    sha256_update(&dump->sha256, n, bytes);
}

/* Digits of x, ending before `end`; gives their start.  By hand: with snprintf the dump is a
 * tenth of the time of a record. */
static char *digits(char *end, uint64_t x)
{
    do
        *--end = (char)('0' + x % 10);
    while ((x /= 10) > 0);
    return end;
}

static void add_value(struct audit_dump *dump, const char *name, char type, const void *bytes,
                      size_t n)
{
    char head[24], *end = head + sizeof head, *at = end;
    *--at = ':';
    at = digits(at, n);
    *--at = type;
    *--at = '=';
    add(dump, name, strlen(name));
    add(dump, at, (size_t)(end - at));
    add(dump, bytes, n);
    add(dump, "\n", 1);
}

void audit_dump_begin(struct audit_dump *dump, const uint8_t before[AUDIT_HASH_SIZE],
                      const char *table)
{
    sha256_init(&dump->sha256);
    if (before != NULL)
        add(dump, before, AUDIT_HASH_SIZE);
    add(dump, table, strlen(table));
    add(dump, "\n", 1);
}

void audit_dump_end(struct audit_dump *dump, uint8_t ret[AUDIT_HASH_SIZE])
{
    sha256_digest(&dump->sha256, AUDIT_HASH_SIZE, ret);
}

void audit_dump_integer(struct audit_dump *dump, const char *name, int64_t x)
{
    char text[24], *end = text + sizeof text;
    char *at = digits(end, x < 0 ? 0 - (uint64_t)x : (uint64_t)x);
    if (x < 0)
        *--at = '-';
    add_value(dump, name, 'i', at, (size_t)(end - at));
}

void audit_dump_float(struct audit_dump *dump, const char *name, double x)
{
    char hex[16];
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (int i = 15; i >= 0; i--, bits >>= 4)
        hex[i] = "0123456789abcdef"[bits & 15];
    add_value(dump, name, 'f', hex, sizeof hex);
}

void audit_dump_text(struct audit_dump *dump, const char *name, const char *text, size_t n)
{
    add_value(dump, name, 't', text, n);
}

void audit_dump_blob(struct audit_dump *dump, const char *name, const void *bytes, size_t n)
{
    add_value(dump, name, 'b', bytes, n);
}

static void add_column(struct audit_dump *dump, sqlite3_stmt *row, int i)
{
    const char *name = sqlite3_column_name(row, i);
    switch (sqlite3_column_type(row, i)) {
    case SQLITE_INTEGER:
        audit_dump_integer(dump, name, sqlite3_column_int64(row, i));
        break;
    case SQLITE_FLOAT:
        audit_dump_float(dump, name, sqlite3_column_double(row, i));
        break;
    case SQLITE_TEXT: {
        const void *text = sqlite3_column_text(row, i);
        audit_dump_text(dump, name, text, (size_t)sqlite3_column_bytes(row, i));
        break;
    }
    case SQLITE_BLOB: {
        const void *blob = sqlite3_column_blob(row, i);
        audit_dump_blob(dump, name, blob, (size_t)sqlite3_column_bytes(row, i));
        break;
    }
    default:
        break;
    }
}

void audit_dump_row(struct audit_dump *dump, sqlite3_stmt *row, int columns)
{
    for (int i = 0; i < columns; i++)
        add_column(dump, row, i);
}
