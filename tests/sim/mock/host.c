/* host.c - simhost: simulated instruments for unmodified programs, in a testbed of umockdev.
 *
 *   umockdev-wrapper build/simhost [-- PROGRAM ARGUMENTS]
 *
 * The program, if any, runs inside the testbed; any other does with
 * LD_PRELOAD=libumockdev-preload.so.0 and UMOCKDEV_DIR as `root` says.  It reads nothing, and what
 * it prints goes to standard error: standard output has an answer, `ok` or `error WHY`, to each
 * line of standard input:
 *
 *   plug KIND NAME NODE [OPTIONS]   plug cm700d one ttyACM0 serial=00012345,delays=0
 *                                   a NAME that was unplugged: the same instrument, no options;
 *                                   USB: plug usb2000 two 001/005
 *   unplug NAME
 *   act NAME ACTION                 act one press
 *   mode NODE MODE                  mode ttyACM0 0600
 *   root                            ok and the testbed's root folder
 *   wait                            ok and the program's exit status, once it ended
 *   quit                            also at the end of the input; the program gets SIGTERM first */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <umockdev.h>
#include <unistd.h>

#include "tests/sim/mock/mock_tty.h"
#include "tests/sim/mock/usb_socket.h"
#include "tests/sim/sim.h"

/* ---- what can be plugged in: one bus, one row --------------------------------------- */

/* A simulator on its bus.  plug()'s place is a node's name for a tty, BUS/DEVICE for USB. */
struct bus {
    const char *const *kinds; /* ends with NULL; NULL: all that no other row has */
    void *(*make)(UMockdevTestbed *bed, const struct sim_kind *kind, const char *options);
    bool (*plug)(void *device, const char *node);
    void (*unplug)(void *device);
    bool (*act)(void *device, const char *action);
    void (*free)(void *device);
};

struct instrument {
    char name[32];
    const struct sim_kind *kind;
    const struct bus *bus;
    void *device;
    bool plugged;
};

static void *tty_make(UMockdevTestbed *bed, const struct sim_kind *kind, const char *options)
{
    return mock_tty_make(bed, kind, options);
}

static bool tty_plug(void *device, const char *node)
{
    return mock_tty_plug(device, node);
}

static void tty_unplug(void *device)
{
    mock_tty_unplug(device);
}

static bool tty_act(void *device, const char *action)
{
    return mock_tty_act(device, action);
}

static void tty_free(void *device)
{
    mock_tty_free(device);
}

static void *usb_make(UMockdevTestbed *bed, const struct sim_kind *kind, const char *options)
{
    return usb_socket_make(bed, kind, options);
}

static bool usb_plug(void *device, const char *place)
{
    return usb_socket_plug(device, place);
}

static void usb_unplug(void *device)
{
    usb_socket_unplug(device);
}

static bool usb_act(void *device, const char *action)
{
    return usb_socket_act(device, action);
}

static void usb_free(void *device)
{
    usb_socket_free(device);
}

static const char *const usb_kinds[] = { "usb2000", "usb4000", "hr2000", "hr4000", NULL };

static const struct bus buses[] = {
    { usb_kinds, usb_make, usb_plug, usb_unplug, usb_act, usb_free },
    { NULL, tty_make, tty_plug, tty_unplug, tty_act, tty_free },
};

static const struct bus *bus_of(const struct sim_kind *kind)
{
    const struct bus *other = NULL;
    for (size_t i = 0; i < sizeof buses / sizeof *buses; i++) {
        const char *const *name = buses[i].kinds;
        if (name == NULL)
            other = &buses[i];
        for (; name != NULL && *name != NULL; name++)
            if (strcmp(*name, kind->name) == 0)
                return &buses[i];
    }
    return other;
}

/* ---- the testbed and what is in it -------------------------------------------------- */

enum { INSTRUMENTS = 16, WORDS = 5 };

struct host {
    UMockdevTestbed *bed;
    struct instrument list[INSTRUMENTS];
    size_t n;
    pid_t program; /* 0: none, or it ended */
    int status;
};

static void answer(const char *format, ...) __attribute__((format(printf, 1, 2)));
static void answer(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vprintf(format, list);
    va_end(list);
    putchar('\n');
    fflush(stdout);
}

static struct instrument *find(struct host *host, const char *name)
{
    for (size_t i = 0; i < host->n; i++)
        if (strcmp(host->list[i].name, name) == 0)
            return &host->list[i];
    return NULL;
}

/* Answers where it fails. */
static struct instrument *make(struct host *host, const char *kind, const char *name,
                               const char *options)
{
    struct instrument *one = &host->list[host->n];
    if (host->n == INSTRUMENTS || strlen(name) >= sizeof one->name) {
        answer("error too many instruments, or too long a name: %s", name);
        return NULL;
    }
    memset(one, 0, sizeof *one);
    one->kind = sim_find(kind);
    if (one->kind == NULL) {
        answer("error there is no simulator %s", kind);
        return NULL;
    }
    one->bus = bus_of(one->kind);
    one->device = one->bus->make(host->bed, one->kind, options);
    if (one->device == NULL) {
        answer("error %s cannot be made with %s: standard error says why", kind, options);
        return NULL;
    }
    memcpy(one->name, name, strlen(name) + 1);
    host->n++;
    return one;
}

static void plug(struct host *host, char **word, int words)
{
    struct instrument *one = words < 4 ? NULL : find(host, word[2]);
    if (words < 4) {
        answer("error plug KIND NAME NODE [OPTIONS]");
        return;
    }
    bool made = one == NULL;
    if (made)
        one = make(host, word[1], word[2], words == 5 ? word[4] : "");
    else if (words == 5 || strcmp(one->kind->name, word[1]) != 0) {
        answer("error %s is known already: as a %s, and without options", word[2], one->kind->name);
        return;
    }
    if (one == NULL)
        return;
    if (one->plugged || !one->bus->plug(one->device, word[3])) {
        if (made)
            one->bus->free(host->list[--host->n].device);
        answer("error cannot plug %s in as %s: standard error says why", word[2], word[3]);
        return;
    }
    one->plugged = true;
    answer("ok");
}

static void unplug(struct host *host, char **word, int words)
{
    struct instrument *one = words == 2 ? find(host, word[1]) : NULL;
    if (one == NULL || !one->plugged) {
        answer("error unplug NAME, one that is plugged in");
        return;
    }
    one->bus->unplug(one->device);
    one->plugged = false;
    answer("ok");
}

static void act(struct host *host, const char *line)
{
    char name[64];
    int at = 0;
    struct instrument *one = NULL;
    if (sscanf(line, "act %63s %n", name, &at) == 1 && at > 0)
        one = find(host, name);
    if (one == NULL)
        answer("error act NAME ACTION");
    else if (one->bus->act(one->device, line + at))
        answer("ok");
    else
        answer("error not so: %s", line + at);
}

static void mode(struct host *host, char **word, int words)
{
    char *end = "x";
    unsigned long bits = words == 3 ? strtoul(word[2], &end, 8) : 0;
    if (words != 3 || *end != '\0' || bits > 07777 || strstr(word[1], "..") != NULL) {
        answer("error mode NODE MODE, octal");
        return;
    }
    gchar *root = umockdev_testbed_get_root_dir(host->bed);
    gchar *path = g_strdup_printf("%s/dev/%s", root, word[1]);
    if (chmod(path, (mode_t)bits) == 0)
        answer("ok");
    else
        answer("error %s: %s", word[1], strerror(errno));
    g_free(path);
    g_free(root);
}

static void root(struct host *host)
{
    gchar *folder = umockdev_testbed_get_root_dir(host->bed);
    answer("ok %s", folder);
    g_free(folder);
}

/* ---- the program -------------------------------------------------------------------- */

static bool start(struct host *host, char **arguments)
{
    host->program = fork();
    if (host->program < 0)
        return false;
    if (host->program > 0)
        return true;
    int nothing = open("/dev/null", O_RDONLY);
    if (nothing < 0 || dup2(nothing, STDIN_FILENO) < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0)
        _exit(126);
    close(nothing);
    execvp(arguments[0], arguments);
    fprintf(stderr, "simhost: %s: %s\n", arguments[0], strerror(errno));
    _exit(127);
}

static void reap(struct host *host)
{
    int status;
    while (host->program > 0 && waitpid(host->program, &status, 0) < 0 && errno == EINTR)
        continue;
    if (host->program > 0)
        host->status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    host->program = 0;
}

/* It would abort() if the simulators went first. */
static void end_program(struct host *host)
{
    int status;
    if (host->program <= 0)
        return;
    kill(host->program, SIGTERM);
    for (int i = 0; i < 500; i++) {
        if (waitpid(host->program, &status, WNOHANG) != 0) {
            host->program = 0;
            return;
        }
        nanosleep(&(struct timespec){ .tv_nsec = 10000000 }, NULL);
    }
    kill(host->program, SIGKILL);
    reap(host);
}

/* ---- commands ----------------------------------------------------------------------- */

/* false: quit. */
static bool obey(struct host *host, char *line)
{
    char copy[512], *word[WORDS] = { "" }, *rest;
    int words = 0;
    line[strcspn(line, "\n")] = '\0';
    snprintf(copy, sizeof copy, "%s", line);
    for (char *w = strtok_r(copy, " ", &rest); w != NULL && words < WORDS;
         w = strtok_r(NULL, " ", &rest))
        word[words++] = w;
    if (strcmp(word[0], "plug") == 0)
        plug(host, word, words);
    else if (strcmp(word[0], "unplug") == 0)
        unplug(host, word, words);
    else if (strcmp(word[0], "act") == 0)
        act(host, line);
    else if (strcmp(word[0], "mode") == 0)
        mode(host, word, words);
    else if (strcmp(word[0], "root") == 0)
        root(host);
    else if (strcmp(word[0], "wait") == 0) {
        reap(host);
        answer("ok %d", host->status);
    } else if (strcmp(word[0], "quit") == 0) {
        answer("ok");
        return false;
    } else
        answer("error plug, unplug, act, mode, root, wait or quit; not %s", word[0]);
    return true;
}

static void only_interrupt(int signal_number)
{
    (void)signal_number; /* getline() ends, and with it the loop */
}

int main(int argc, char **argv)
{
    struct host host = { .n = 0 };
    char *line = NULL;
    size_t size = 0;
    if (argc > 1 && (strcmp(argv[1], "--") != 0 || argc == 2)) {
        fprintf(stderr, "usage: umockdev-wrapper %s [-- PROGRAM ARGUMENTS]\n", argv[0]);
        return 2;
    }
    host.bed = umockdev_testbed_new();
    /* umockdev's own answer is yes where there is no /sys at all (a bare chroot). */
    const char *preload = getenv("LD_PRELOAD");
    if (!umockdev_in_mock_environment() || preload == NULL ||
        strstr(preload, "umockdev-preload") == NULL) {
        fprintf(stderr, "simhost: has to run under umockdev-wrapper\n");
        return 1;
    }
    sigaction(SIGTERM, &(struct sigaction){ .sa_handler = only_interrupt }, NULL);
    sigaction(SIGPIPE, &(struct sigaction){ .sa_handler = SIG_IGN }, NULL);
    if (argc > 2 && !start(&host, argv + 2)) {
        perror("simhost: fork");
        return 1;
    }
    while (getline(&line, &size, stdin) > 0 && obey(&host, line))
        ;
    free(line);
    end_program(&host);
    for (size_t i = 0; i < host.n; i++)
        host.list[i].bus->free(host.list[i].device);
    g_object_unref(host.bed);
    return 0;
}
