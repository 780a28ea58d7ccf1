/* connection.c - framing and back-pressure of one client. */
#include "station/connection.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* The longest line with CR and LF; in as many bytes without a LF a longer one shows. */
enum { IN_CAPACITY = CONNECTION_LINE_MAX + 2, OUT_FIRST = 4096 };

enum status connection_init(struct connection *c, int fd)
{
    char *in = malloc(IN_CAPACITY);
    if (in == NULL)
        return STATUS_NO_MEMORY;
    *c = (struct connection){ .fd = fd, .in = in };
    return STATUS_OK;
}

void connection_done(struct connection *c)
{
    if (c->fd >= 0)
        close(c->fd);
    free(c->in);
    free(c->out);
    *c = (struct connection){ .fd = -1 };
}

/* Without a CR at the end, which is no part of the line. */
static size_t length_of(const char *line, const char *end)
{
    size_t length = (size_t)(end - line);
    return length > 0 && line[length - 1] == '\r' ? length - 1 : length;
}

/* Hand out complete lines of the buffer, at most max, and keep the rest. */
static enum status hand_out(struct connection *c, size_t max, connection_line *on_line,
                            void *context)
{
    enum status s = STATUS_OK;
    char *from = c->in, *end = c->in + c->in_used, *feed;
    while ((feed = memchr(from, '\n', (size_t)(end - from))) != NULL && s == STATUS_OK && max > 0) {
        size_t length = length_of(from, feed);
        char *line = from;
        from = feed + 1;
        max--;
        if (length > CONNECTION_LINE_MAX)
            s = STATUS_RANGE;
        else if (!on_line(context, line, length))
            s = STATUS_CANCELLED;
    }
    if (s == STATUS_OK && feed == NULL && length_of(from, end) > CONNECTION_LINE_MAX)
        s = STATUS_RANGE;
    c->has_line = feed != NULL;
    c->in_used = (size_t)(end - from);
    memmove(c->in, from, c->in_used);
    return s;
}

enum status connection_read(struct connection *c, size_t max_lines, connection_line *on_line,
                            void *context)
{
    if (!c->has_line) {
        ssize_t n = recv(c->fd, c->in + c->in_used, IN_CAPACITY - c->in_used, MSG_DONTWAIT);
        if (n == 0)
            return STATUS_NOT_FOUND;
        if (n < 0)
            return errno == EAGAIN || errno == EINTR ? STATUS_OK : STATUS_IO;
        c->in_used += (size_t)n;
    }
    return hand_out(c, max_lines, on_line, context);
}

size_t connection_unsent(const struct connection *c)
{
    return c->out_end - c->out_begin;
}

int64_t connection_deadline_ms(const struct connection *c)
{
    return connection_unsent(c) > 0 ? c->unsent_since_ms + CONNECTION_UNSENT_MS : INT64_MAX;
}

/* Room for n more bytes behind the unsent ones. */
static enum status make_room(struct connection *c, size_t n)
{
    size_t unsent = connection_unsent(c), capacity = c->out_capacity;
    if (c->out_begin > 0)
        memmove(c->out, c->out + c->out_begin, unsent);
    c->out_begin = 0;
    c->out_end = unsent;
    if (capacity == 0)
        capacity = OUT_FIRST;
    while (capacity < unsent + n)
        capacity *= 2;
    if (capacity == c->out_capacity)
        return STATUS_OK;
    char *out = realloc(c->out, capacity);
    if (out == NULL)
        return STATUS_NO_MEMORY;
    c->out = out;
    c->out_capacity = capacity;
    return STATUS_OK;
}

/* A client that has caught up keeps no more than the first buffer. */
static void give_back(struct connection *c)
{
    c->out_begin = c->out_end = 0;
    if (c->out_capacity > OUT_FIRST) {
        free(c->out);
        c->out = NULL;
        c->out_capacity = 0;
    }
}

enum status connection_flush(struct connection *c, int64_t now_ms)
{
    while (connection_unsent(c) > 0) {
        ssize_t n =
            send(c->fd, c->out + c->out_begin, connection_unsent(c), MSG_DONTWAIT | MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno == EAGAIN ? STATUS_OK : STATUS_IO;
        c->out_begin += (size_t)n;
        c->unsent_since_ms = now_ms;
    }
    give_back(c);
    return STATUS_OK;
}

enum status connection_send(struct connection *c, const char *line, size_t length, int64_t now_ms)
{
    if (connection_unsent(c) + length + 1 > CONNECTION_UNSENT_MAX)
        return STATUS_RANGE;
    enum status s =
        c->out_capacity - c->out_end < length + 1 ? make_room(c, length + 1) : STATUS_OK;
    if (s != STATUS_OK)
        return s;
    if (connection_unsent(c) == 0)
        c->unsent_since_ms = now_ms;
    memcpy(c->out + c->out_end, line, length);
    c->out[c->out_end + length] = '\n';
    c->out_end += length + 1;
    return connection_flush(c, now_ms);
}
