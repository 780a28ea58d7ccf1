/* serial.c - a tty by libserialport, waited for by our own poll().
 *
 * libserialport 0.1.1 names, opens and sets the port.  It is not asked to wait: after an
 * unplugging its reads spin and then give 0, as if nothing had come.  The kernel says it
 * clearly: POLLHUP or POLLERR, or something to read that is nothing.
 *
 * From top to bottom: the port's name, holding it alone, its settings, the link. */
#define _DEFAULT_SOURCE /* CRTSCTS */
#include <errno.h>
#include <fcntl.h>
#include <libserialport.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include "drivers/link/kinds.h"

struct serial {
    struct link link;
    struct sp_port *port;
    int fd;   /* the port's */
    int lock; /* a descriptor of the same tty, which holds the lock; -1: none yet */
    bool is_open, gone;
};

/* ---- the port's name ---------------------------------------------------------------- */

enum { LINKS_FOLLOWED = 8 };

/* "/dev/serial/by-id/../../ttyACM0" -> "/dev/ttyACM0", without asking the file system. */
static void fold_dots(char *path)
{
    char *up;
    while ((up = strstr(path, "/../")) != NULL) {
        char *parent = up;
        while (parent > path && *--parent != '/')
            ;
        memmove(parent, up + 3, strlen(up + 3) + 1);
    }
}

/* What the link at path points to, in its place; false, and errno, where it is none. */
static bool follow_link(char path[PATH_MAX])
{
    char target[PATH_MAX], joined[2 * PATH_MAX];
    ssize_t n = readlink(path, target, sizeof target - 1);
    if (n < 0)
        return false;
    target[n] = '\0';
    int folder = (int)(strrchr(path, '/') - path);
    snprintf(joined, sizeof joined, "%.*s/%s", folder, path, target);
    fold_dots(joined);
    const char *to = target[0] == '/' ? target : joined;
    if (strlen(to) >= PATH_MAX) {
        errno = ENAMETOOLONG;
        return false;
    }
    memcpy(path, to, strlen(to) + 1);
    return true;
}

static enum driver_result fail_no_such_port(const char *address, int why,
                                            struct driver_error *error)
{
    if (why == ENOENT || why == ENOTDIR)
        return driver_fail(error, DRIVER_GONE, NULL,
                           "there is no %s: connect the instrument and switch it on; "
                           "ls /dev/serial/by-id shows what is connected",
                           address);
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                       "%s is no serial port of this system (%s): give /dev/ttyACM0 or a link in "
                       "/dev/serial/by-id",
                       address, why == EINVAL ? "not in /sys/class/tty" : strerror(why));
}

/* libserialport refuses links, and realpath() is not to be used on devices: one link after
 * the other until libserialport knows the name. */
static enum driver_result find_port(const char *address, struct sp_port **ret,
                                    struct driver_error *error)
{
    char path[PATH_MAX];
    if (strlen(address) >= sizeof path)
        return fail_no_such_port("this address", ENAMETOOLONG, error);
    memcpy(path, address, strlen(address) + 1);
    fold_dots(path);
    for (int i = 0; i < LINKS_FOLLOWED; i++) {
        enum sp_return found = sp_get_port_by_name(path, ret);
        if (found == SP_OK)
            return DRIVER_OK;
        if (found == SP_ERR_MEM)
            return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
        if (!follow_link(path))
            return fail_no_such_port(address, errno, error);
    }
    return fail_no_such_port(address, ELOOP, error);
}

/* ---- holding it alone --------------------------------------------------------------- */

static enum driver_result fail_busy(const char *address, long pid, struct driver_error *error)
{
    char who[48] = "another program";
    if (pid > 0)
        snprintf(who, sizeof who, "process %ld", pid);
    return driver_fail(error, DRIVER_BUSY, NULL,
                       "%s is held by %s: close that one first (fuser -v %s names it)", address,
                       who, address);
}

static enum driver_result fail_to_open(const char *address, int why, struct driver_error *error)
{
    switch (why) {
    case EBUSY:
        return fail_busy(address, 0, error);
    case ENOENT:
    case ENXIO:
    case ENODEV:
    case EIO:
        return driver_fail(error, DRIVER_GONE, NULL,
                           "%s is gone: connect the instrument and switch it on", address);
    case ENOTTY:
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "%s is no serial port", address);
    default:
        return driver_fail(error, DRIVER_FAULT, NULL, "cannot open %s: %s", address, strerror(why));
    }
}

/* minicom, lockdev and others leave their process id in a file.  Its owner may be dead. */
static long holder_by_file(const char *port_name)
{
    char path[PATH_MAX], text[32] = "";
    const char *name = strrchr(port_name, '/');
    snprintf(path, sizeof path, "/run/lock/LCK..%s", name != NULL ? name + 1 : port_name);
    FILE *file = fopen(path, "re");
    if (file == NULL)
        return 0;
    size_t n = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[n] = '\0';
    long pid = strtol(text, NULL, 10);
    bool alive = pid > 0 && pid <= INT_MAX && (kill((pid_t)pid, 0) == 0 || errno == EPERM);
    return alive ? pid : 0;
}

/* A descriptor of its own, before anything is set: a port that another holds is not touched.
 * The lock is on the device itself, not on a file beside it: it needs no folder that can be
 * written, and it ends with its process.  pyserial, picocom and tio take the same. */
static enum driver_result take_lock(const struct link_wanted *wanted, const char *port_name,
                                    int *ret, struct driver_error *error)
{
    int64_t began_ms = call_now_ms();
    long pid = holder_by_file(port_name);
    if (pid > 0)
        return fail_busy(wanted->address, pid, error);
    int fd;
    while ((fd = open(port_name, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) < 0) {
        enum driver_result r = errno == EACCES || errno == EPERM
                                   ? link_wait_for_permission(wanted, began_ms, error)
                                   : fail_to_open(wanted->address, errno, error);
        if (r != DRIVER_OK)
            return r;
    }
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
        int why = errno == EWOULDBLOCK ? EBUSY : errno;
        close(fd);
        return fail_to_open(wanted->address, why, error);
    }
    *ret = fd;
    return DRIVER_OK;
}

/* ---- its settings ------------------------------------------------------------------- */

static enum sp_return fill_config(struct sp_port_config *config, unsigned baud)
{
    enum sp_return failed = SP_OK;
    failed |= sp_set_config_baudrate(config, (int)baud);
    failed |= sp_set_config_bits(config, 8);
    failed |= sp_set_config_parity(config, SP_PARITY_NONE);
    failed |= sp_set_config_stopbits(config, 1);
    failed |= sp_set_config_flowcontrol(config, SP_FLOWCONTROL_NONE);
    failed |= sp_set_config_dtr(config, SP_DTR_ON);
    failed |= sp_set_config_rts(config, SP_RTS_ON);
    return failed;
}

/* libserialport 0.1.1 reports success and writes CRTSCTS into the wrong word of the termios. */
static int set_rts_cts(int fd, bool rts_cts)
{
    struct termios is;
    if (tcgetattr(fd, &is) != 0)
        return errno;
    is.c_cflag = rts_cts ? is.c_cflag | CRTSCTS : is.c_cflag & ~(tcflag_t)CRTSCTS;
    if (tcsetattr(fd, TCSANOW, &is) != 0 || tcgetattr(fd, &is) != 0)
        return errno;
    return ((is.c_cflag & CRTSCTS) != 0) == rts_cts ? 0 : EINVAL;
}

static enum driver_result configure(struct serial *serial, const struct link_wanted *wanted,
                                    struct driver_error *error)
{
    struct sp_port_config *config;
    if (sp_new_config(&config) != SP_OK)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    enum sp_return r = fill_config(config, wanted->serial->baud);
    if (r == SP_OK)
        r = sp_set_config(serial->port, config);
    int why = r == SP_OK         ? set_rts_cts(serial->fd, wanted->serial->rts_cts)
              : r == SP_ERR_FAIL ? sp_last_error_code()
                                 : EINVAL;
    sp_free_config(config);
    if (why == 0)
        return DRIVER_OK;
    if (why == EINVAL)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "%s cannot be set to %u baud, 8N1%s",
                           wanted->address, wanted->serial->baud,
                           wanted->serial->rts_cts ? " with RTS/CTS" : "");
    return fail_to_open(wanted->address, why, error);
}

/* ---- the link ----------------------------------------------------------------------- */

static enum driver_result fail_gone(struct serial *serial, struct driver_error *error)
{
    serial->gone = true;
    return driver_fail(error, DRIVER_GONE, NULL,
                       "the instrument is gone: connect it or switch it on");
}

static enum driver_result fail_cancelled(struct driver_error *error)
{
    return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
}

/* A port whose device went away fails with these, a port that is well never. */
static enum driver_result fail_io(struct serial *serial, int why, struct driver_error *error)
{
    if (why == EIO || why == ENXIO || why == ENODEV || why == EPIPE)
        return fail_gone(serial, error);
    return driver_fail(error, DRIVER_FAULT, NULL, "the serial port fails: %s", strerror(why));
}

static enum driver_result serial_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct serial *serial = (struct serial *)link;
    const uint8_t *from = bytes;
    (void)channel;
    if (serial->gone)
        return fail_gone(serial, error);
    while (n > 0) {
        struct pollfd on = { .fd = serial->fd, .events = POLLOUT };
        enum call_end_of_wait end = call_wait_any(link->call, &on, 1, deadline_ms);
        if (end == CALL_CANCELLED)
            return fail_cancelled(error);
        if (end == CALL_DEADLINE)
            return driver_fail(error, DRIVER_TIMEOUT, NULL,
                               "the instrument takes no bytes: is it on, and its cable right?");
        if ((on.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
            return fail_gone(serial, error);
        ssize_t wrote = write(serial->fd, from, n);
        if (wrote < 0 && errno != EAGAIN && errno != EINTR)
            return fail_io(serial, errno, error);
        if (wrote > 0) {
            from += wrote;
            n -= (size_t)wrote;
        }
    }
    return DRIVER_OK;
}

/* POLLIN and a read of nothing: another program may have taken the bytes, and then poll() does
 * not say it again. */
static bool is_hung_up(const struct serial *serial, short revents)
{
    struct pollfd again = { .fd = serial->fd, .events = POLLIN };
    if ((revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
        return true;
    return poll(&again, 1, 0) > 0 && (again.revents & POLLIN) != 0;
}

static enum driver_result serial_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    struct serial *serial = (struct serial *)link;
    (void)channel;
    if (serial->gone)
        return fail_gone(serial, error);
    for (;;) {
        struct pollfd on = { .fd = serial->fd, .events = POLLIN };
        enum call_end_of_wait end = call_wait_any(link->call, &on, 1, deadline_ms);
        if (end == CALL_CANCELLED)
            return fail_cancelled(error);
        if (end == CALL_DEADLINE)
            return driver_fail(error, DRIVER_TIMEOUT, NULL,
                               "nothing came: is the instrument on and connected?");
        ssize_t got = read(serial->fd, bytes, size); /* first what came before it went */
        if (got > 0) {
            *n = (size_t)got;
            return DRIVER_OK;
        }
        if (got < 0 && errno != EAGAIN && errno != EINTR)
            return fail_io(serial, errno, error);
        if (is_hung_up(serial, on.revents))
            return fail_gone(serial, error);
    }
}

/* What the instrument does not take must not hold the close() up, which waits 30 s for it. */
static void serial_close(struct link *link)
{
    struct serial *serial = (struct serial *)link;
    if (serial->is_open) {
        sp_flush(serial->port, SP_BUF_BOTH);
        ioctl(serial->fd, TIOCNXCL);
        sp_close(serial->port);
    }
    if (serial->port != NULL)
        sp_free_port(serial->port);
    if (serial->lock >= 0)
        close(serial->lock);
    free(serial);
}

static const struct link_ops serial_ops = {
    .kind = "serial",
    .send = serial_send,
    .receive = serial_receive,
    .drain = link_drain_by_receiving,
    .close = serial_close,
};

static enum driver_result open_port(struct serial *serial, const struct link_wanted *wanted,
                                    struct driver_error *error)
{
    enum driver_result r = find_port(wanted->address, &serial->port, error);
    if (r == DRIVER_OK)
        r = take_lock(wanted, sp_get_port_name(serial->port), &serial->lock, error);
    if (r != DRIVER_OK)
        return r;
    if (sp_open(serial->port, SP_MODE_READ_WRITE) != SP_OK)
        return fail_to_open(wanted->address, sp_last_error_code(), error);
    serial->is_open = true;
    if (sp_get_port_handle(serial->port, &serial->fd) != SP_OK ||
        ioctl(serial->fd, TIOCEXCL) != 0) /* who opens it from now on is told; root is not */
        return fail_to_open(wanted->address, errno, error);
    r = configure(serial, wanted, error);
    if (r == DRIVER_OK)
        sp_flush(serial->port, SP_BUF_BOTH); /* what came before it was ours */
    return r;
}

enum driver_result link_open_serial(const struct link_wanted *wanted, struct link **ret,
                                    struct driver_error *error)
{
    struct serial *serial = calloc(1, sizeof *serial);
    if (serial == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    serial->link = (struct link){ &serial_ops, wanted->call };
    serial->lock = -1;
    enum driver_result r = open_port(serial, wanted, error);
    if (r != DRIVER_OK) {
        serial_close(&serial->link);
        return r;
    }
    *ret = &serial->link;
    return DRIVER_OK;
}
