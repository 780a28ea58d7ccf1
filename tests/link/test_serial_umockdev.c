/* test_serial_umockdev.c - a serial link on a tty of umockdev: a pseudo-terminal that has the
 * modem lines libserialport asks for and a place in /sys. */
#define _GNU_SOURCE /* openpty(), and credentials of one thread: syscall() */
#include "drivers/link/kinds.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <pty.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <umockdev.h>
#include <unistd.h>

#include "tests/support/patience.h"
#include "unity.h"

enum { NOBODY = 65534 };

/* ---- the port ----------------------------------------------------------------------- */

static UMockdevTestbed *testbed;
static char *root;
static UMockdevIoctlBase *handler;
static int modem_lines, ports;
static int master;    /* the instrument's end; -1: unplugged */
static char port[32]; /* "/dev/ttyACM3" */
static char node[64]; /* the terminal behind it, "/dev/pts/5" */

/* Modem lines here; everything else is the terminal's own business. */
static gboolean on_ioctl(UMockdevIoctlBase *base, UMockdevIoctlClient *client, gpointer none)
{
    gulong request = umockdev_ioctl_client_get_request(client);
    int failed = 0;
    (void)base, (void)none;
    if (request != TIOCMGET && request != TIOCMSET && request != TIOCMBIS && request != TIOCMBIC) {
        int r = umockdev_ioctl_client_execute(client, &failed, NULL);
        umockdev_ioctl_client_complete(client, r, r < 0 ? failed : 0);
        return TRUE;
    }
    UMockdevIoctlData *lines =
        umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(int), NULL);
    int *bits = (int *)(void *)lines->data;
    if (request == TIOCMGET)
        *bits = modem_lines | TIOCM_CTS | TIOCM_DSR;
    else if (request == TIOCMSET)
        modem_lines = *bits;
    else
        modem_lines = request == TIOCMBIS ? modem_lines | *bits : modem_lines & ~*bits;
    umockdev_ioctl_client_complete(client, 0, 0);
    g_object_unref(lines);
    return TRUE;
}

static void plug(void)
{
    char record[1024];
    int n = ports++; /* another each time: the last may be held */
    snprintf(port, sizeof port, "/dev/ttyACM%d", n);
    snprintf(record, sizeof record,
             "P: /devices/pci0000:00/0000:00:14.0/usb1/1-%d/1-%d:1.0/tty/ttyACM%d\n"
             "N: ttyACM%d\nE: DEVNAME=/dev/ttyACM%d\nE: SUBSYSTEM=tty\nE: MAJOR=166\nE: MINOR=%d\n"
             "A: dev=166:%d\n",
             n, n, n, n, n, n, n);
    TEST_ASSERT_TRUE(umockdev_testbed_add_from_string(testbed, record, NULL));
    TEST_ASSERT_TRUE(umockdev_testbed_attach_ioctl(testbed, port, handler, NULL));
    master = umockdev_testbed_get_dev_fd(testbed, port);
    TEST_ASSERT_TRUE(master >= 0);
    TEST_ASSERT_EQUAL_INT(0, ptsname_r(master, node, sizeof node));
    modem_lines = 0;
}

/* umockdev keeps a name for each terminal, and the next may be of the same number. */
static void unplug(void)
{
    char name[64], path[512];
    snprintf(name, sizeof name, "%s", node);
    for (char *c = name; *c != '\0'; c++)
        *c = *c == '/' ? '_' : *c;
    snprintf(path, sizeof path, "%s/dev/.ptymap/%s", root, name);
    close(master);
    unlink(path);
    master = -1;
}

/* ---- the link ----------------------------------------------------------------------- */

static struct call call;
static struct link *wire;
static struct driver_error error;
static char bytes[256];
static size_t n;

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
    wire = NULL;
    plug();
}

void tearDown(void)
{
    link_close(wire);
    call_done(&call);
}

static enum driver_result open_address(const char *address, unsigned baud, bool rts_cts,
                                       int within_ms, struct link **ret)
{
    const struct link_serial serial = { baud, rts_cts };
    const struct driver_options options = { .address = address };
    const struct link_wanted wanted = { .call = &call,
                                        .serial = &serial,
                                        .deadline_ms = call_now_ms() + within_ms };
    return link_open(&options, &wanted, ret, &error);
}

static void open_port(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, open_address(port, 9600, false, 3000, &wire),
                                  error.text);
    call_begin(&call);
}

static enum driver_result hear(int within_ms)
{
    n = 0;
    enum driver_result r = link_receive(wire, LINK_SERIAL, bytes, sizeof bytes - 1, &n,
                                        call_now_ms() + within_ms, &error);
    bytes[n] = '\0';
    return r;
}

static void say(const char *text)
{
    TEST_ASSERT_EQUAL_INT((int)strlen(text), (int)write(master, text, strlen(text)));
}

/* ---- what fate does meanwhile ------------------------------------------------------- */

struct later {
    int after_ms;
    void (*does)(void);
    pthread_t thread;
    int64_t at_us;
};

static int64_t now_us(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L }, NULL);
}

static void *do_later(void *of)
{
    struct later *later = of;
    sleep_ms(later->after_ms);
    later->at_us = now_us(CLOCK_MONOTONIC);
    later->does();
    return NULL;
}

static void begin_later(struct later *later)
{
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&later->thread, NULL, do_later, later));
}

/* Milliseconds between it and now. */
static double since(struct later *later)
{
    int64_t now = now_us(CLOCK_MONOTONIC);
    pthread_join(later->thread, NULL);
    return (double)(now - later->at_us) / 1e3;
}

static void cancel(void)
{
    call_cancel(&call);
}

static void allow(void)
{
    TEST_ASSERT_EQUAL_INT(0, chmod(node, 0666));
}

/* This thread alone: the others stay who they are. */
static void become(uid_t uid)
{
    if (getuid() == 0)
        TEST_ASSERT_EQUAL_INT(0, (int)syscall(SYS_setresuid, -1, uid, -1));
}

/* ---- tests -------------------------------------------------------------------------- */

static void test_settings(void)
{
    static const struct {
        unsigned baud;
        speed_t speed;
        bool rts_cts;
    } cases[] = { { 9600, B9600, false }, { 115200, B115200, true }, { 4800, B4800, false } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct termios is;
        modem_lines = 0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            DRIVER_OK, open_address(port, cases[i].baud, cases[i].rts_cts, 1000, &wire),
            error.text);
        TEST_ASSERT_EQUAL_STRING("serial", wire->ops->kind);
        TEST_ASSERT_EQUAL_INT(0, tcgetattr(master, &is));
        TEST_ASSERT_EQUAL_INT(cases[i].speed, cfgetospeed(&is));
        TEST_ASSERT_EQUAL_HEX(CS8, is.c_cflag & (CSIZE | PARENB | CSTOPB));
        TEST_ASSERT_EQUAL_INT(cases[i].rts_cts, (is.c_cflag & CRTSCTS) != 0);
        TEST_ASSERT_EQUAL_HEX(0, is.c_lflag & (ICANON | ECHO | ISIG));
        TEST_ASSERT_EQUAL_HEX(0, is.c_iflag & (IXON | IXOFF | ICRNL | ISTRIP));
        TEST_ASSERT_EQUAL_HEX(0, is.c_oflag & OPOST);
        TEST_ASSERT_TRUE(modem_lines & TIOCM_DTR);
        TEST_ASSERT_TRUE(cases[i].rts_cts || (modem_lines & TIOCM_RTS) != 0);
        link_close(wire);
        wire = NULL;
    }
}

static void test_bytes_both_ways(void)
{
    char all[256];
    for (int i = 0; i < 256; i++)
        all[i] = (char)i;
    open_port();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK,
                          link_send(wire, LINK_SERIAL, all, 256, call_now_ms() + 1000, &error));
    TEST_ASSERT_EQUAL_INT(256, (int)read(master, bytes, 256));
    TEST_ASSERT_EQUAL_MEMORY(all, bytes, 256);
    TEST_ASSERT_EQUAL_INT(256, (int)write(master, all, 256));
    for (size_t at = 0; at < 256; at += n) {
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
        TEST_ASSERT_EQUAL_MEMORY(all + at, bytes, n);
    }
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(60));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 60);
}

static void test_what_came_before_is_not_ours(void)
{
    int fd = open(port, O_RDWR | O_NOCTTY); /* somebody else's, and a modem's answer to him */
    say("AT\r\n");
    open_port();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(20));
    say("late");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK,
                          link_drain(wire, LINK_SERIAL, 20, call_now_ms() + 1000, &error));
    say("new");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
    TEST_ASSERT_EQUAL_STRING("new", bytes);
    close(fd);
}

static void test_links_are_followed(void)
{
    char folder[256], link[300];
    snprintf(folder, sizeof folder, "%s/dev/serial/by-id", root);
    TEST_ASSERT_EQUAL_INT(0, g_mkdir_with_parents(folder, 0755));
    snprintf(link, sizeof link, "%s/usb-KM-if00", folder);
    char target[64];
    snprintf(target, sizeof target, "../..%s", port + strlen("/dev"));
    TEST_ASSERT_EQUAL_INT(0, symlink(target, link));
    snprintf(link, sizeof link, "%s/alias", folder);
    TEST_ASSERT_EQUAL_INT(0, symlink("usb-KM-if00", link));
    static const char *const names[] = { "/dev/serial/by-id/usb-KM-if00", "/dev/serial/by-id/alias",
                                         "/dev/serial/../serial/by-id/alias" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, open_address(names[i], 9600, false, 1000, &wire),
                                      error.text);
        say("x");
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
        link_close(wire);
        wire = NULL;
    }
}

static void test_no_port_of_this_system(void)
{
    int other_master, slave;
    char name[64];
    TEST_ASSERT_EQUAL_INT(0, openpty(&other_master, &slave, name, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, open_address(name, 9600, false, 100, &wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, open_address("/dev/ttyACM99", 9600, false, 100, &wire));
    TEST_ASSERT_NULL(wire);
    close(other_master);
    close(slave);
    open_port(); /* what failed holds nothing */
}

static void test_held_alone(void)
{
    struct link *second = NULL;
    open_port();
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, open_address(port, 9600, false, 1000, &second));
    TEST_ASSERT_NOT_NULL(strstr(error.text, port));
    allow();
    become(NOBODY); /* TIOCEXCL, which root may pass over */
    int fd = open(port, O_RDWR | O_NOCTTY);
    int why = errno;
    become(0);
    TEST_ASSERT_EQUAL_INT(-1, fd);
    TEST_ASSERT_EQUAL_INT(EBUSY, why);
    say("x"); /* and the first is none the worse */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
    link_close(wire);
    open_port();
}

/* A holder that was killed leaves nothing behind. */
static void test_lock_of_the_dead(void)
{
    int ready[2], fd = open(port, O_RDWR | O_NOCTTY | O_CLOEXEC);
    char c;
    TEST_ASSERT_EQUAL_INT(0, pipe(ready));
    pid_t child = fork();
    if (child == 0) {
        alarm(20); /* should the test end before it */
        int mine = open(node, O_RDWR | O_NOCTTY);
        if (mine < 0 || flock(mine, LOCK_EX | LOCK_NB) != 0 || write(ready[1], "x", 1) != 1)
            _exit(1);
        for (;;)
            pause();
    }
    TEST_ASSERT_EQUAL_INT(1, (int)read(ready[0], &c, 1));
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, open_address(port, 9600, false, 1000, &wire));
    kill(child, SIGKILL);
    waitpid(child, NULL, 0);
    open_port();
    close(fd);
    close(ready[0]);
    close(ready[1]);
}

static void write_lock_file(const char *path, long pid)
{
    FILE *file = fopen(path, "we");
    if (file == NULL)
        TEST_IGNORE_MESSAGE("/run/lock cannot be written here");
    fprintf(file, "%10ld\n", pid);
    fclose(file);
}

/* minicom's way. */
static void test_lock_files_of_others(void)
{
    char path[64];
    pid_t child = fork();
    if (child == 0)
        _exit(0);
    waitpid(child, NULL, 0); /* nobody has its number now */
    snprintf(path, sizeof path, "/run/lock/LCK..%s", strrchr(port, '/') + 1);
    write_lock_file(path, getpid());
    enum driver_result r = open_address(port, 9600, false, 1000, &wire);
    write_lock_file(path, child);
    enum driver_result dead = open_address(port, 9600, false, 1000, &wire);
    unlink(path);
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, r);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, dead);
}

static void test_permission_comes_later(void)
{
    struct later later = { .after_ms = 500, .does = allow };
    TEST_ASSERT_EQUAL_INT(0, chmod(node, 0));
    begin_later(&later);
    become(NOBODY);
    int64_t began_ms = call_now_ms();
    enum driver_result r = open_address(port, 9600, false, 5000, &wire);
    int64_t took_ms = call_now_ms() - began_ms;
    become(0);
    (void)since(&later);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, r, error.text);
    TEST_ASSERT_TRUE(took_ms >= 450 && took_ms < 600 + SLACK_MS);
}

static void test_permission_never_comes(void)
{
    static const int within_ms[] = { 5000, 300 };
    for (int i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL_INT(0, chmod(node, 0));
        become(NOBODY);
        int64_t began_ms = call_now_ms();
        enum driver_result r = open_address(port, 9600, false, within_ms[i], &wire);
        int64_t took_ms = call_now_ms() - began_ms;
        become(0);
        TEST_ASSERT_EQUAL_INT(DRIVER_NO_PERMISSION, r);
        TEST_ASSERT_TRUE(took_ms >= (i == 0 ? LINK_PERMISSION_MS : 300) - 10);
        TEST_ASSERT_TRUE(took_ms < (i == 0 ? LINK_PERMISSION_MS : 300) + SLACK_MS);
    }
}

static void test_unplugged_while_idle(void)
{
    struct later later = { .after_ms = 60, .does = unplug };
    open_port();
    begin_later(&later);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(10000));
    double ms = since(&later);
    printf("idle: gone %.1f ms after the unplugging\n", ms);
    TEST_ASSERT_TRUE(ms < 100.0);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, error.result);

    int64_t cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID), began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(10000));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, link_send(wire, 0, "x", 1, call_now_ms() + 10000, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, link_drain(wire, 0, 50, call_now_ms() + 10000, &error));
    cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_us;
    printf("after it: three calls took %lld ms and %lld us of CPU\n",
           (long long)(call_now_ms() - began_ms), (long long)cpu_us);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 100);
    TEST_ASSERT_TRUE(cpu_us < 20000);
}

static void test_unplugged_before_a_call(void)
{
    open_port();
    unplug();
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, link_send(wire, 0, "MES", 3, call_now_ms() + 1000, &error));
    link_close(wire);
    plug(); /* under another name */
    open_port();
    unplug();
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(1000));
}

/* Fill what the instrument does not read. */
static enum driver_result send_too_much(int within_ms)
{
    static char much[1 << 20];
    return link_send(wire, LINK_SERIAL, much, sizeof much, call_now_ms() + within_ms, &error);
}

static void test_an_instrument_that_takes_nothing(void)
{
    struct later cancels = { .after_ms = 50, .does = cancel },
                 unplugs = { .after_ms = 50, .does = unplug };
    open_port();
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, send_too_much(60));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 60 + SLACK_MS);
    begin_later(&cancels);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, send_too_much(10000));
    TEST_ASSERT_TRUE(since(&cancels) < 200.0);
    began_ms = call_now_ms();
    link_close(wire); /* with all that waiting to go out */
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < SLACK_MS);
    open_port();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, send_too_much(10));
    begin_later(&unplugs);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, send_too_much(10000));
    TEST_ASSERT_TRUE(since(&unplugs) < 100.0);
}

static void test_cancelled(void)
{
    struct later later = { .after_ms = 60, .does = cancel };
    open_port();
    int64_t cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID);
    begin_later(&later);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, hear(10000));
    double ms = since(&later);
    printf("cancelled %.1f ms after the cancel, waiting took %lld us of CPU\n", ms,
           (long long)(now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_us));
    TEST_ASSERT_TRUE(ms < 200.0);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, hear(10000)); /* the whole call is */
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, link_send(wire, 0, "x", 1, call_now_ms() + 9, &error));
    link_begin(wire, "measure");
    say("x");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
}

/* Nothing is left open by opening, failing and closing. */
static void test_descriptors(void)
{
    struct link *second;
    int before = -1;
    for (int i = 0; i < 50; i++) {
        open_port();
        TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, open_address(port, 9600, false, 100, &second));
        link_close(wire);
        wire = NULL;
        int next = dup(0);
        close(next);
        if (i == 10)
            before = next;
        if (i > 10)
            TEST_ASSERT_TRUE(next <= before); /* umockdev may close some of its own meanwhile */
    }
}

int main(void)
{
    umask(0); /* for whom become() makes of us */
    testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) {
        fprintf(stderr, "libumockdev-preload is not the first library\n");
        return 1;
    }
    root = umockdev_testbed_get_root_dir(testbed);
    chmod(root, 0755);
    handler = umockdev_ioctl_base_new();
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(on_ioctl), NULL);
    UNITY_BEGIN();
    RUN_TEST(test_settings);
    RUN_TEST(test_bytes_both_ways);
    RUN_TEST(test_what_came_before_is_not_ours);
    RUN_TEST(test_links_are_followed);
    RUN_TEST(test_no_port_of_this_system);
    RUN_TEST(test_held_alone);
    RUN_TEST(test_lock_of_the_dead);
    RUN_TEST(test_lock_files_of_others);
    RUN_TEST(test_permission_comes_later);
    RUN_TEST(test_permission_never_comes);
    RUN_TEST(test_unplugged_while_idle);
    RUN_TEST(test_unplugged_before_a_call);
    RUN_TEST(test_an_instrument_that_takes_nothing);
    RUN_TEST(test_cancelled);
    RUN_TEST(test_descriptors);
    for (int i = patience_number("PLUGS"); i > 1; i--) {
        RUN_TEST(test_unplugged_while_idle);
        RUN_TEST(test_unplugged_before_a_call);
    }
    int failed = UNITY_END();
    g_object_unref(handler);
    g_object_unref(testbed);
    g_free(root);
    return failed;
}
