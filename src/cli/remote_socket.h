/* remote_socket.h - where the station listens, and lines to and from it. */
#ifndef SKINSPEC_CLI_REMOTE_SOCKET_H
#define SKINSPEC_CLI_REMOTE_SOCKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

struct remote_socket {
    int fd;
    char *in; /* [PROTOCOL_MAX_LINE] */
    size_t begin, end;
};

/* As remote_open() says.  STATUS_NOT_FOUND where nobody answers: logged, with what was
 * tried and how to start a station. */
enum status remote_socket_open(const char *path, struct remote_socket *ret);
void remote_socket_close(struct remote_socket *s);

/* Write all of it.  STATUS_IO, logged. */
enum status remote_socket_write(struct remote_socket *s, const char *text, size_t n);

/* A line that is there already, without its line feed, valid until the next call; NULL
 * where there is none yet. */
const char *remote_socket_line(struct remote_socket *s, size_t *n);

/* Read what has come.  STATUS_NOT_FOUND where the other side closed, STATUS_IO, STATUS_FORMAT
 * for a line beyond the protocol's limit; not logged. */
enum status remote_socket_read(struct remote_socket *s);

#endif
