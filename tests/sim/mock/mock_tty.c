/* mock_tty.c - one thread carries bytes between the pty's master and the simulator. */
#define _GNU_SOURCE /* openpty(), cfmakeraw() */
#include "tests/sim/mock/mock_tty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <pty.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "tests/sim/sim_options.h"

enum { PATH_SIZE = 160, SERIAL_SIZE = 128, OUT_SIZE = 4096 };

struct mock_tty {
    UMockdevTestbed *bed;
    const struct sim_kind *kind;
    char serial[SERIAL_SIZE];
    pthread_mutex_t lock; /* for the simulator */
    struct sim *sim;

    bool plugged;
    char node[32], usb[PATH_SIZE], interface[PATH_SIZE], tty[PATH_SIZE];
    char pty[32];           /* "/dev/pts/3" */
    int master, changed_fd; /* changed_fd: the pump should look again */
    pthread_t pump;
    bool stop; /* locked */
    UMockdevIoctlBase *handler;
    int modem; /* TIOCM_*; the worker thread's */
};

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* ---- modem lines -------------------------------------------------------------------- */

static void answer_modem(struct mock_tty *tty, UMockdevIoctlClient *client, gulong request)
{
    UMockdevIoctlData *arg = umockdev_ioctl_client_get_arg(client);
    UMockdevIoctlData *bits = umockdev_ioctl_data_resolve(arg, 0, sizeof(int), NULL);
    int lines;
    if (bits == NULL) {
        umockdev_ioctl_client_complete(client, -1, EFAULT);
        return;
    }
    memcpy(&lines, bits->data, sizeof lines);
    if (request == TIOCMGET)
        umockdev_ioctl_data_update(bits, 0, (guint8 *)&tty->modem, sizeof tty->modem);
    else if (request == TIOCMSET)
        tty->modem = lines;
    else if (request == TIOCMBIS)
        tty->modem |= lines;
    else
        tty->modem &= ~lines;
    umockdev_ioctl_client_complete(client, 0, 0);
    g_object_unref(bits);
}

static gboolean answer_ioctl(UMockdevIoctlBase *base, UMockdevIoctlClient *client, gpointer user)
{
    gint error_number = 0;
    gulong request = umockdev_ioctl_client_get_request(client);
    (void)base;
    switch (request) {
    case TIOCMGET:
    case TIOCMSET:
    case TIOCMBIS:
    case TIOCMBIC:
        answer_modem(user, client, request);
        return TRUE;
    case TIOCSBRK:
    case TIOCCBRK:
        umockdev_ioctl_client_complete(client, 0, 0);
        return TRUE;
    default:
        break;
    }
    gint result = umockdev_ioctl_client_execute(client, &error_number, NULL);
    umockdev_ioctl_client_complete(client, result, result < 0 ? error_number : 0);
    return TRUE;
}

/* ---- the pump ----------------------------------------------------------------------- */

struct outgoing {
    uint8_t bytes[OUT_SIZE];
    size_t n;
};

/* Due bytes into out; when there may be more. */
static bool fetch(struct mock_tty *tty, struct outgoing *out, int64_t *due_us)
{
    pthread_mutex_lock(&tty->lock);
    bool stop = tty->stop;
    *due_us = INT64_MAX;
    ssize_t n = 1;
    while (n > 0 && out->n < sizeof out->bytes) {
        n = tty->kind->give(tty->sim, 0, out->bytes + out->n, sizeof out->bytes - out->n, now_us(),
                            due_us);
        out->n += n > 0 ? (size_t)n : 0;
    }
    pthread_mutex_unlock(&tty->lock);
    return !stop;
}

static void put(const struct mock_tty *tty, struct outgoing *out)
{
    ssize_t n = out->n > 0 ? write(tty->master, out->bytes, out->n) : 0;
    if (n <= 0)
        return; /* full: POLLOUT says when */
    out->n -= (size_t)n;
    memmove(out->bytes, out->bytes + n, out->n);
}

/* What the host wrote; false: nobody has it open. */
static bool get(struct mock_tty *tty)
{
    uint8_t bytes[1024];
    ssize_t n = read(tty->master, bytes, sizeof bytes);
    if (n <= 0)
        return n < 0 && errno == EAGAIN;
    pthread_mutex_lock(&tty->lock);
    (void)tty->kind->take(tty->sim, 0, bytes, (size_t)n, now_us());
    pthread_mutex_unlock(&tty->lock);
    return true;
}

static int wait_ms(int64_t due_us)
{
    int64_t ms = due_us == INT64_MAX ? 1000 : (due_us - now_us()) / 1000 + 1;
    return ms < 0 ? 0 : ms > 1000 ? 1000 : (int)ms;
}

static void *pump(void *of)
{
    struct mock_tty *tty = of;
    struct outgoing out = { .n = 0 };
    int64_t due_us;
    while (fetch(tty, &out, &due_us)) {
        put(tty, &out);
        struct pollfd on[2] = { { .fd = tty->changed_fd, .events = POLLIN },
                                { .fd = tty->master,
                                  .events = (short)(POLLIN | (out.n > 0 ? POLLOUT : 0)) } };
        (void)poll(on, 2, wait_ms(due_us));
        eventfd_t forgotten;
        (void)eventfd_read(tty->changed_fd, &forgotten);
        if ((on[1].revents & (POLLIN | POLLHUP)) == 0 || get(tty))
            continue;
        /* Nobody has it open: what it says is lost, and poll() would not wait. */
        out.n = 0;
        nanosleep(&(struct timespec){ .tv_nsec = 10000000 }, NULL);
    }
    return NULL;
}

/* ---- the bus ------------------------------------------------------------------------ */

/* No newline may stand in a record; umockdev takes the attribute as text. */
static void printable_serial(const char *options, char *serial)
{
    if (!sim_options_value(options, "serial", serial, SERIAL_SIZE))
        serial[0] = '\0';
    for (char *c = serial; *c != '\0'; c++)
        if (*c < ' ' || *c > '~' || *c == '\\')
            *c = '?';
}

static bool add(struct mock_tty *tty, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static bool add(struct mock_tty *tty, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    gchar *record = g_strdup_vprintf(format, list);
    va_end(list);
    GError *why = NULL;
    bool added = umockdev_testbed_add_from_string(tty->bed, record, &why);
    if (!added)
        fprintf(stderr, "mock_tty: %s\n", why->message);
    g_clear_error(&why);
    g_free(record);
    return added;
}

static bool add_records(struct mock_tty *tty, unsigned place)
{
    snprintf(tty->usb, sizeof tty->usb, "/devices/pci0000:00/0000:00:14.0/usb1/1-%u", place);
    snprintf(tty->interface, sizeof tty->interface, "%.100s/1-%u:1.0", tty->usb, place);
    snprintf(tty->tty, sizeof tty->tty, "%.110s/tty/%s", tty->interface, tty->node);
    char serial[SERIAL_SIZE + 32] = "";
    if (tty->serial[0] != '\0')
        snprintf(serial, sizeof serial, "A: serial=%s\\n\n", tty->serial);
    return add(tty,
               "P: %s\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=001\nE: DEVNUM=%03u\n"
               "E: PRODUCT=%x/%x/100\n"
               "A: busnum=1\\n\nA: devnum=%u\\n\nA: idVendor=%04x\\n\nA: idProduct=%04x\\n\n"
               "A: product=%s\\n\n%s",
               tty->usb, place, tty->kind->vid, tty->kind->pid, place, tty->kind->vid,
               tty->kind->pid, tty->kind->product, serial) &&
           add(tty,
               "P: %s\nE: DEVTYPE=usb_interface\nE: SUBSYSTEM=usb\nA: bInterfaceNumber=00\\n\n",
               tty->interface) &&
           add(tty,
               "P: %s\nE: DEVNAME=/dev/%s\nE: SUBSYSTEM=tty\nE: MAJOR=166\nE: MINOR=%u\n"
               "A: dev=166:%u\nL: device=../../../1-%u:1.0\n",
               tty->tty, tty->node, place, place, place);
}

/* ---- the node ----------------------------------------------------------------------- */

/* "ROOT/dev/FOLDER/NAME" with its slashes, but the first, as `_`; folder may be "". */
static gchar *below_dev(const struct mock_tty *tty, const char *folder, const char *name)
{
    gchar *root = umockdev_testbed_get_root_dir(tty->bed);
    gchar *flat = g_strdelimit(g_strdup(name), "/", '_');
    gchar *path = g_strdup_printf("%s/dev%s/%s", root, folder, flat);
    gchar *above = g_path_get_dirname(path);
    (void)g_mkdir_with_parents(above, 0755);
    g_free(above);
    g_free(flat);
    g_free(root);
    return path;
}

static bool link_to(gchar *path, const char *target)
{
    bool linked = symlink(target, path) == 0;
    if (!linked)
        perror(path);
    g_free(path);
    return linked;
}

static void unlink_and_free(gchar *path)
{
    (void)unlink(path);
    g_free(path);
}

/* What a line `N:` of a record would make.  Done here because umockdev 0.17.16 never gives a tty's
 * name back, nor its pty's. */
static bool make_node(struct mock_tty *tty, unsigned place)
{
    struct termios raw;
    char number[24];
    int slave;
    if (openpty(&tty->master, &slave, tty->pty, NULL, NULL) != 0) {
        perror("openpty");
        return false;
    }
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    close(slave);
    fcntl(tty->master, F_SETFD, FD_CLOEXEC);
    fcntl(tty->master, F_SETFL, O_RDWR | O_NONBLOCK);
    snprintf(number, sizeof number, "166:%u", place);
    return link_to(below_dev(tty, "", tty->node), tty->pty) &&
           link_to(below_dev(tty, "/.ptymap", tty->pty), number);
}

/* The pty hangs up: whoever has it open reads its end. */
static void remove_node(struct mock_tty *tty)
{
    if (tty->master >= 0)
        close(tty->master);
    tty->master = -1;
    unlink_and_free(below_dev(tty, "", tty->node));
    unlink_and_free(below_dev(tty, "/.ptymap", tty->pty));
}

static void take_off(struct mock_tty *tty, const char *syspath)
{
    gchar *sys = g_strdup_printf("/sys%s", syspath);
    umockdev_testbed_uevent(tty->bed, sys, "remove");
    umockdev_testbed_remove_device(tty->bed, sys);
    g_free(sys);
}

/* ---- plugging ----------------------------------------------------------------------- */

/* Where a client's preload library will look for the ioctls of a node: a socket's path. */
enum { SOCKET_PATH_MAX = 107 };

static bool can_be(const struct mock_tty *tty, const char *node)
{
    gchar *root = umockdev_testbed_get_root_dir(tty->bed);
    gchar *path = g_strdup_printf("%s/dev/%s", root, node);
    size_t length = strlen(root) + strlen("/ioctl//dev/") + strlen(node);
    const char *why = NULL;
    if (tty->plugged)
        why = "is plugged in already";
    else if (strlen(node) >= sizeof tty->node || strspn(node, "abcdefghijklmnopqrstuvwxyz"
                                                              "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                              "0123456789") != strlen(node))
        why = "is no name of a tty";
    else if (length > SOCKET_PATH_MAX)
        why = "gets too long a path: use a shorter TMPDIR";
    else if (g_file_test(path, G_FILE_TEST_EXISTS | G_FILE_TEST_IS_SYMLINK))
        why = "is there already";
    if (why != NULL)
        fprintf(stderr, "mock_tty: %s %s\n", node, why);
    g_free(path);
    g_free(root);
    return why == NULL;
}

static bool attach(struct mock_tty *tty, const char *dev)
{
    GError *why = NULL;
    tty->handler = umockdev_ioctl_base_new();
    g_signal_connect(tty->handler, "handle-ioctl", G_CALLBACK(answer_ioctl), tty);
    bool attached = umockdev_testbed_attach_ioctl(tty->bed, dev, tty->handler, &why);
    if (!attached)
        fprintf(stderr, "mock_tty: %s: %s\n", dev, why->message);
    g_clear_error(&why);
    return attached;
}

bool mock_tty_plug(struct mock_tty *tty, const char *node)
{
    static unsigned places = 1; /* 1-1 is the root hub's */
    char dev[48];
    if (!can_be(tty, node))
        return false;
    snprintf(tty->node, sizeof tty->node, "%s", node);
    snprintf(dev, sizeof dev, "/dev/%s", node);
    tty->modem = TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;
    tty->stop = false;
    places++;
    tty->plugged = make_node(tty, places) && attach(tty, dev) && add_records(tty, places) &&
                   pthread_create(&tty->pump, NULL, pump, tty) == 0;
    if (!tty->plugged) {
        fprintf(stderr, "mock_tty: no tty for %s\n", dev);
        remove_node(tty);
    }
    return tty->plugged;
}

static void wake(struct mock_tty *tty)
{
    (void)eventfd_write(tty->changed_fd, 1);
}

void mock_tty_unplug(struct mock_tty *tty)
{
    char dev[48];
    if (!tty->plugged)
        return;
    pthread_mutex_lock(&tty->lock);
    tty->stop = true;
    pthread_mutex_unlock(&tty->lock);
    wake(tty);
    pthread_join(tty->pump, NULL);
    tty->plugged = false;
    remove_node(tty);
    snprintf(dev, sizeof dev, "/dev/%s", tty->node);
    (void)umockdev_testbed_detach_ioctl(tty->bed, dev, NULL);
    take_off(tty, tty->tty);
    take_off(tty, tty->interface);
    take_off(tty, tty->usb);
    g_clear_object(&tty->handler);
}

struct mock_tty *mock_tty_make(UMockdevTestbed *bed, const struct sim_kind *kind,
                               const char *options)
{
    struct mock_tty *tty = calloc(1, sizeof *tty);
    if (tty == NULL)
        return NULL;
    tty->bed = bed;
    tty->master = -1;
    tty->kind = kind;
    printable_serial(options, tty->serial);
    pthread_mutex_init(&tty->lock, NULL);
    tty->changed_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    tty->sim = kind->make(options);
    if (tty->sim != NULL && tty->changed_fd >= 0)
        return tty;
    mock_tty_free(tty);
    return NULL;
}

void mock_tty_free(struct mock_tty *tty)
{
    if (tty == NULL)
        return;
    mock_tty_unplug(tty);
    if (tty->sim != NULL)
        tty->kind->free(tty->sim);
    if (tty->changed_fd >= 0)
        close(tty->changed_fd);
    pthread_mutex_destroy(&tty->lock);
    free(tty);
}

bool mock_tty_act(struct mock_tty *tty, const char *action)
{
    pthread_mutex_lock(&tty->lock);
    bool done = tty->kind->act(tty->sim, action, now_us());
    pthread_mutex_unlock(&tty->lock);
    wake(tty);
    return done;
}
