#define _GNU_SOURCE
#include "tests/sim/mock/usb_node.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

enum { PIPE_BYTES = 4096 };

/* System calls, not functions: the preload library must not take our end for a client's. */
static int open_really(const char *path, int flags)
{
    return (int)syscall(SYS_openat, AT_FDCWD, path, flags | O_CLOEXEC | O_NOCTTY);
}

static void close_really(int *fd)
{
    if (*fd >= 0)
        syscall(SYS_close, *fd);
    *fd = -1;
}

static void make_fifo(struct usb_node *node)
{
    if (mkfifo(node->path, 0600) != 0)
        g_error("mock_usb: cannot make %s: %s", node->path, g_strerror(errno));
    node->fifo = open_really(node->path, O_RDWR | O_NONBLOCK);
    if (node->fifo < 0 || fcntl(node->fifo, F_SETPIPE_SZ, PIPE_BYTES) < 0)
        g_error("mock_usb: cannot use %s: %s", node->path, g_strerror(errno));
}

static void make_pty(struct usb_node *node)
{
    int locked = 0, number = 0;
    char slave[32];
    node->master = open_really("/dev/ptmx", O_RDWR);
    if (node->master < 0 || syscall(SYS_ioctl, node->master, TIOCSPTLCK, &locked) != 0 ||
        syscall(SYS_ioctl, node->master, TIOCGPTN, &number) != 0)
        g_error("mock_usb: no pseudo-terminal: %s", g_strerror(errno));
    snprintf(slave, sizeof slave, "/dev/pts/%d", number);
    node->slave = open_really(slave, O_RDWR);
    if (node->slave < 0 || symlink(slave, node->path) != 0)
        g_error("mock_usb: cannot use %s: %s", slave, g_strerror(errno));
}

void usb_node_make(struct usb_node *node, const char *path, enum mock_usb_node kind, unsigned mode)
{
    *node = (struct usb_node){ .kind = kind, .fifo = -1, .master = -1, .slave = -1, .ready = true };
    snprintf(node->path, sizeof node->path, "%s", path);
    unlink(path); /* of an earlier one */
    if (kind == MOCK_USB_FIFO)
        make_fifo(node);
    else
        make_pty(node);
    usb_node_set_mode(node, mode);
    usb_node_set_ready(node, false);
}

void usb_node_set_mode(struct usb_node *node, unsigned mode)
{
    if (chmod(node->path, mode) != 0)
        g_error("mock_usb: chmod %s: %s", node->path, g_strerror(errno));
}

void usb_node_set_ready(struct usb_node *node, bool ready)
{
    static const char nothing[PIPE_BYTES];
    char drained[PIPE_BYTES];
    if (node->ready == ready)
        return;
    node->ready = ready;
    if (node->slave >= 0)
        syscall(SYS_ioctl, node->slave, TCXONC, ready ? TCOON : TCOOFF);
    while (node->fifo >= 0 && ready && syscall(SYS_read, node->fifo, drained, PIPE_BYTES) > 0)
        ;
    while (node->fifo >= 0 && !ready && syscall(SYS_write, node->fifo, nothing, PIPE_BYTES) > 0)
        ;
}

void usb_node_unlink(struct usb_node *node)
{
    unlink(node->path);
    close_really(&node->slave);
    close_really(&node->master);
}

void usb_node_close(struct usb_node *node)
{
    close_really(&node->slave);
    close_really(&node->master);
    close_really(&node->fifo);
}
