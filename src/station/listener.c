/* listener.c - a Unix stream socket, made or handed over. */
#include "station/listener.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include "base/log.h"

enum { BACKLOG = 128 };

static int new_socket(void)
{
    return socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

static enum status failed(const char *what, const char *path)
{
    log_error("station: cannot %s '%s': %s", what, path, strerror(errno));
    return STATUS_IO;
}

/* ---- handed over -------------------------------------------------------------------- */

/* STATUS_NOT_FOUND where nothing was. */
static enum status take_over(struct listener *ret)
{
    int n = sd_listen_fds(1);
    if (n == 0)
        return STATUS_NOT_FOUND;
    if (n != 1 || sd_is_socket_unix(SD_LISTEN_FDS_START, SOCK_STREAM, 1, NULL, 0) <= 0) {
        log_error("station: systemd must hand over one listening Unix stream socket");
        return STATUS_IO;
    }
    *ret = (struct listener){ .fd = SD_LISTEN_FDS_START };
    int flags = fcntl(ret->fd, F_GETFL);
    if (flags < 0 || fcntl(ret->fd, F_SETFL, flags | O_NONBLOCK) != 0)
        return failed("use", "the socket of systemd");
    return STATUS_OK;
}

/* ---- made here ---------------------------------------------------------------------- */

/* Is anybody there?  STATUS_EXISTS: yes; STATUS_OK: the name is free, or a dead one's. */
static enum status probe(const struct sockaddr_un *address)
{
    struct stat st;
    if (lstat(address->sun_path, &st) != 0)
        return errno == ENOENT ? STATUS_OK : failed("look at", address->sun_path);
    if (!S_ISSOCK(st.st_mode)) {
        log_error("station: '%s' is there and no socket; it is left alone, name another with "
                  "--socket",
                  address->sun_path);
        return STATUS_EXISTS;
    }
    int fd = new_socket();
    if (fd < 0)
        return failed("make a socket for", address->sun_path);
    bool refused = connect(fd, (const struct sockaddr *)address, sizeof *address) != 0 &&
                   errno == ECONNREFUSED;
    close(fd);
    if (!refused) {
        log_error("station: '%s' is answered by another program; stop it, or name another socket "
                  "with --socket",
                  address->sun_path);
        return STATUS_EXISTS;
    }
    log_info("station: taking over '%s', which a dead one left", address->sun_path);
    return unlink(address->sun_path) == 0 ? STATUS_OK : failed("remove", address->sun_path);
}

/* The mode is the socket's from its first moment: nobody slips in between. */
static enum status bind_and_listen(int fd, const struct sockaddr_un *address)
{
    mode_t before = umask(0177);
    int e = bind(fd, (const struct sockaddr *)address, sizeof *address);
    umask(before);
    if (e == 0 && listen(fd, BACKLOG) == 0)
        return STATUS_OK;
    log_error("station: cannot listen on '%s': %s; make its folder, writable for this account, or "
              "name another path with --socket",
              address->sun_path, strerror(errno));
    return STATUS_IO;
}

static enum status make(const char *path, struct listener *ret)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    struct stat st;
    if (strlen(path) >= sizeof address.sun_path) {
        log_error("station: the socket's path has %zu bytes, the system takes %zu; name a shorter "
                  "one with --socket",
                  strlen(path), sizeof address.sun_path - 1);
        return STATUS_RANGE;
    }
    strcpy(address.sun_path, path);
    enum status s = probe(&address);
    if (s != STATUS_OK)
        return s;
    int fd = new_socket();
    if (fd < 0)
        return failed("make a socket for", path);
    s = bind_and_listen(fd, &address);
    if (s == STATUS_OK && lstat(path, &st) != 0)
        s = failed("find", path);
    if (s != STATUS_OK) {
        close(fd);
        return s;
    }
    *ret = (struct listener){ .fd = fd, .ours = true, .device = st.st_dev, .inode = st.st_ino };
    strcpy(ret->path, path);
    return STATUS_OK;
}

enum status listener_open(const char *path, struct listener *ret)
{
    enum status s = take_over(ret);
    return s == STATUS_NOT_FOUND ? make(path, ret) : s;
}

void listener_close(struct listener *listener)
{
    struct stat st;
    if (listener->fd < 0)
        return;
    if (listener->ours && lstat(listener->path, &st) == 0 && st.st_dev == listener->device &&
        st.st_ino == listener->inode)
        (void)unlink(listener->path);
    close(listener->fd);
    listener->fd = -1;
}
