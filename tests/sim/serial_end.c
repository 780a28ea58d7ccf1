/* serial_end.c - a list of replies, each with the time of its first byte and of each further one.
 */
#include "tests/sim/serial_end.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct serial_reply {
    struct serial_reply *next;
    int64_t due_us, byte_us;
    size_t n, given;
    uint8_t bytes[];
};

static struct serial_reply *reply_new(size_t n)
{
    struct serial_reply *r = calloc(1, sizeof *r + n);
    if (r == NULL) {
        perror("simulator");
        abort();
    }
    r->n = n;
    return r;
}

void serial_end_done(struct serial_end *end)
{
    while (end->first != NULL) {
        struct serial_reply *next = end->first->next;
        free(end->first);
        end->first = next;
    }
    free(end->late);
    end->late = NULL;
    end->filled = 0;
    end->too_long = false;
    end->free_us = 0;
}

/* ---- lines of the host -------------------------------------------------------------- */

static bool is_text(const char *line, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (line[i] < ' ' || line[i] > '~')
            return false;
    return true;
}

static void line_is_whole(struct serial_end *end, int64_t now_us, serial_end_line *line,
                          void *owner)
{
    char text[SERIAL_END_LINE];
    size_t n = end->filled;
    if (end->host_end == '\n' && n > 0 && end->line[n - 1] == '\r')
        n--;
    bool good = !end->too_long && is_text(end->line, n);
    memcpy(text, end->line, n);
    text[n] = '\0';
    end->filled = 0;
    end->too_long = false;
    line(owner, good ? text : NULL, now_us);
}

static void take_byte(struct serial_end *end, char c, int64_t now_us, serial_end_line *line,
                      void *owner)
{
    bool after_end = end->after_end;
    end->after_end = end->host_end == '\r' && c == '\r';
    if (after_end && c == '\n')
        return;
    if (c == end->host_end)
        line_is_whole(end, now_us, line, owner);
    else if (end->filled < sizeof end->line - 1)
        end->line[end->filled++] = c;
    else
        end->too_long = true;
}

void serial_end_take(struct serial_end *end, const uint8_t *bytes, size_t n, int64_t now_us,
                     serial_end_line *line, void *owner)
{
    /* A command begins. */
    if (n > 0 && end->filled == 0 &&
        faults_next(&end->faults, FAULT_AT_COMMAND).kind == FAULT_PROBER)
        for (const char *c = "AT\r"; *c != '\0'; c++)
            take_byte(end, *c, now_us, line, owner);
    for (size_t i = 0; i < n; i++)
        take_byte(end, (char)bytes[i], now_us, line, owner);
}

/* ---- replies ------------------------------------------------------------------------ */

static size_t place_in(const struct serial_reply *r, long k)
{
    long at = k < 0 ? (long)r->n + k : k;
    return at < 0 ? 0 : (size_t)at;
}

static struct serial_reply *make(const struct serial_end *end, const void *bytes, size_t n,
                                 size_t more)
{
    size_t tail = strlen(end->own_end);
    struct serial_reply *r = reply_new(n + more + tail);
    memcpy(r->bytes, bytes, n);
    memset(r->bytes + n, '7', more);
    memcpy(r->bytes + n + more, end->own_end, tail);
    return r;
}

static struct serial_reply *garbage(struct serial_end *end, size_t n)
{
    struct serial_reply *r = reply_new(n);
    for (size_t i = 0; i < n; i++)
        r->bytes[i] = (uint8_t)dice_bits(&end->dice);
    return r;
}

static void put(struct serial_end *end, struct serial_reply *r, int64_t from_us)
{
    struct serial_reply **last = &end->first;
    while (*last != NULL)
        last = &(*last)->next;
    *last = r;
    r->due_us = from_us > end->free_us ? from_us : end->free_us;
    end->free_us = r->due_us + (int64_t)r->n * r->byte_us;
}

static struct serial_reply *spoil(struct serial_end *end, const struct fault *f, const void *bytes,
                                  size_t n)
{
    struct serial_reply *r;
    if (f->kind == FAULT_GARBAGE)
        return garbage(end, (size_t)f->a);
    if (f->kind == FAULT_REPLY)
        r = make(end, f->text, strlen(f->text), 0);
    else
        r = make(end, bytes, n, f->kind == FAULT_LONGER ? (size_t)f->a : 0);
    size_t at = place_in(r, f->a);
    if (f->kind == FAULT_TRUNCATED && at < r->n)
        r->n = at;
    if (f->kind == FAULT_XOR && at < r->n)
        r->bytes[at] ^= (uint8_t)f->b;
    if (f->kind == FAULT_REPLACE && at < r->n)
        r->bytes[at] = (uint8_t)f->b;
    return r;
}

void serial_end_reply(struct serial_end *end, const void *bytes, size_t n, int64_t now_us,
                      int64_t after_us)
{
    struct fault f = faults_next(&end->faults, FAULT_AT_REPLY);
    struct serial_reply *r = spoil(end, &f, bytes, n);
    r->byte_us = f.kind == FAULT_SLOW ? (int64_t)f.a * 1000 : end->byte_us;
    if (f.kind == FAULT_SILENCE) {
        free(r);
        return;
    }
    if (f.kind == FAULT_LATE && end->late == NULL) {
        end->late = r;
        return;
    }
    if (end->late != NULL) {
        struct serial_reply *late = end->late;
        end->late = NULL;
        put(end, late, now_us);
    }
    put(end, r, now_us + after_us + (f.kind == FAULT_DELAY ? (int64_t)f.a * 1000 : 0));
    if (f.kind == FAULT_TWICE)
        put(end, make(end, bytes, n, 0), now_us + after_us);
}

void serial_end_echo(struct serial_end *end, const uint8_t *bytes, size_t n, int64_t now_us)
{
    struct serial_reply *r = reply_new(n);
    memcpy(r->bytes, bytes, n);
    put(end, r, now_us);
}

static size_t due_bytes(const struct serial_reply *r, int64_t now_us)
{
    if (now_us < r->due_us)
        return 0;
    if (r->byte_us <= 0)
        return r->n;
    int64_t out = 1 + (now_us - r->due_us) / r->byte_us;
    return out < (int64_t)r->n ? (size_t)out : r->n;
}

ssize_t serial_end_give(struct serial_end *end, uint8_t *bytes, size_t size, int64_t now_us,
                        int64_t *due_us)
{
    size_t given = 0;
    *due_us = INT64_MAX;
    while (end->first != NULL && given < size) {
        struct serial_reply *r = end->first;
        size_t n = due_bytes(r, now_us) - r->given;
        n = n < size - given ? n : size - given;
        memcpy(bytes + given, r->bytes + r->given, n);
        given += n;
        r->given += n;
        if (r->given < r->n) {
            *due_us = r->due_us + (int64_t)r->given * r->byte_us;
            break;
        }
        end->first = r->next;
        free(r);
    }
    return (ssize_t)given;
}
