/* connection.h - the bytes of one client: lines in, lines out, and limits on both.
 *
 * The descriptor is a stream socket that does not block; it is watched by the
 * caller, who reads when it is readable and flushes when it is writable.  A line in
 * is at most CONNECTION_LINE_MAX bytes without its end; what is out and not taken is at most
 * CONNECTION_UNSENT_MAX bytes and no older than CONNECTION_UNSENT_MS, or this client
 * is dropped: one that does not read never holds up the others. */
#ifndef SKINSPEC_STATION_CONNECTION_H
#define SKINSPEC_STATION_CONNECTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum { CONNECTION_LINE_MAX = 64 * 1024, CONNECTION_UNSENT_MS = 10000 };
#define CONNECTION_UNSENT_MAX ((size_t)4 * 1024 * 1024)

struct connection {
    int fd; /* owned: closed by connection_done() */
    char *in;
    size_t in_used;
    bool has_line; /* a complete line waits in the buffer: read again before polling */
    char *out;
    size_t out_begin, out_end, out_capacity; /* unsent: out[out_begin .. out_end) */
    int64_t unsent_since_ms;                 /* when the oldest unsent byte was put there */
};

/* Takes the descriptor over.  STATUS_NO_MEMORY: the descriptor stays the caller's. */
enum status connection_init(struct connection *c, int fd);
void connection_done(struct connection *c); /* takes a zeroed one with fd -1 */

/* A whole line without its LF (and CR before it); the text may hold NUL and is the
 * caller's to change until the callback returns.  Return false to stop reading: for now
 * (what is left waits), or because the connection was or will be dropped. */
typedef bool connection_line(void *context, char *line, size_t length);

/* Read what is there once, a bounded amount, and hand out complete lines, at most max_lines
 * of them (1 or more), so that no client holds the loop; what is left waits (has_line).
 * STATUS_OK; STATUS_NOT_FOUND: the client says no more (a last line without LF is dropped);
 * STATUS_RANGE: a line is too long, answer and close; STATUS_CANCELLED: the
 * callback stopped; STATUS_IO. */
enum status connection_read(struct connection *c, size_t max_lines, connection_line *on_line,
                            void *context);

/* Queue a line (LF is added) and send what the socket takes.  STATUS_OK even where
 * some remains; STATUS_RANGE: too much is unsent, drop this client; STATUS_IO: it is
 * gone; STATUS_NO_MEMORY. */
enum status connection_send(struct connection *c, const char *line, size_t length, int64_t now_ms);

/* Send more of what remains.  STATUS_OK or STATUS_IO. */
enum status connection_flush(struct connection *c, int64_t now_ms);

size_t connection_unsent(const struct connection *c);

/* When this client must have taken something, or be dropped; INT64_MAX while nothing
 * is unsent.  Any progress starts the time anew. */
int64_t connection_deadline_ms(const struct connection *c);

#endif
