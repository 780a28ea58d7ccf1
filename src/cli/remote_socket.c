/* remote_socket.c - find the socket, connect, read lines. */
#include "cli/remote_socket.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/out.h"
#include "station/protocol.h"

/* ---- finding and connecting --------------------------------------------------------- */

/* A descriptor, or -1 with errno. */
static int connect_to(const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    /* A station that does not read must not hold us for ever. */
    const struct timeval patience = { .tv_sec = 10 };
    if (strlen(path) >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    strcpy(address.sun_path, path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return -1;
    if (setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
        connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
        return fd;
    int error = errno;
    close(fd);
    errno = error;
    return -1;
}

enum { PATHS = 2, PATH_SIZE = 512 };

/* Where to look: what was said, or the usual places; how many. */
static size_t places(const char *said, char path[PATHS][PATH_SIZE])
{
    const char *set = getenv("SKINSPEC_SOCKET"), *user = getenv("XDG_RUNTIME_DIR");
    size_t n = 0;
    if (said == NULL && set != NULL && *set != '\0')
        said = set;
    if (said != NULL) {
        snprintf(path[0], PATH_SIZE, "%s", said);
        return 1;
    }
    if (user != NULL && *user != '\0')
        snprintf(path[n++], PATH_SIZE, "%s/skinspec.sock", user);
    snprintf(path[n++], PATH_SIZE, "/run/skinspec/skinspecd.sock");
    return n;
}

static const char *what_to_do(bool forbidden)
{
    return forbidden ? "an administrator can add you to the group of its socket, skinspec as a rule"
                     : "start one by 'systemctl start skinspecd', or by hand: skinspecd --socket "
                       "PATH --state DIR --instrument simulated";
}

enum status remote_socket_open(const char *said, struct remote_socket *ret)
{
    char path[PATHS][PATH_SIZE], tried[PATHS * (PATH_SIZE + 64)] = "";
    struct remote_socket s = { .fd = -1 };
    size_t n = places(said, path);
    bool forbidden = false;
    for (size_t i = 0; i < n && s.fd < 0; i++) {
        size_t used = strlen(tried);
        s.fd = connect_to(path[i]);
        if (s.fd < 0) {
            forbidden = forbidden || errno == EACCES;
            snprintf(tried + used, sizeof tried - used, "%s%s: %s", i > 0 ? ", " : "", path[i],
                     strerror(errno));
        }
    }
    if (s.fd < 0) {
        log_error("no station answers (%s); %s", tried, what_to_do(forbidden));
        return STATUS_NOT_FOUND;
    }
    s.in = malloc(PROTOCOL_MAX_LINE);
    if (s.in == NULL)
        out_of_memory();
    *ret = s;
    return STATUS_OK;
}

void remote_socket_close(struct remote_socket *s)
{
    close(s->fd);
    free(s->in);
}

/* ---- bytes -------------------------------------------------------------------------- */

enum status remote_socket_write(struct remote_socket *s, const char *text, size_t n)
{
    while (n > 0) {
        ssize_t sent = send(s->fd, text, n, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent < 0) {
            log_error("cannot write to the station: %s",
                      errno == EAGAIN ? "it does not read" : strerror(errno));
            return STATUS_IO;
        }
        text += sent;
        n -= (size_t)sent;
    }
    return STATUS_OK;
}

const char *remote_socket_line(struct remote_socket *s, size_t *n)
{
    const char *begin = s->in + s->begin, *end = memchr(begin, '\n', s->end - s->begin);
    if (end == NULL)
        return NULL;
    *n = (size_t)(end - begin);
    s->begin += *n + 1;
    return begin;
}

enum status remote_socket_read(struct remote_socket *s)
{
    memmove(s->in, s->in + s->begin, s->end - s->begin);
    s->end -= s->begin;
    s->begin = 0;
    if (s->end == PROTOCOL_MAX_LINE)
        return STATUS_FORMAT;
    ssize_t got = recv(s->fd, s->in + s->end, PROTOCOL_MAX_LINE - s->end, MSG_DONTWAIT);
    if (got < 0)
        return errno == EAGAIN || errno == EINTR ? STATUS_OK : STATUS_IO;
    s->end += (size_t)got;
    return got > 0 ? STATUS_OK : STATUS_NOT_FOUND;
}
