/* private_station.c - a folder, a socket handed over as systemd does, and a child. */
#define _XOPEN_SOURCE 700 /* nftw() */
#include "cli/private_station.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"

enum {
    STOP_MS = 5000, /* it promises 2 s; then it is killed */
    LOOK_MS = 20,
    MAX_OPTIONS = 32,
    FIRST_HANDED_OVER = 3, /* sd_listen_fds(3) */
};

/* ---- places ------------------------------------------------------------------------- */

/* Beside this program, else by PATH. */
static void find_program(char program[PRIVATE_PATH_SIZE])
{
    static const char name[] = "skinspecd";
    ssize_t n = readlink("/proc/self/exe", program, PRIVATE_PATH_SIZE - sizeof name);
    if (n > 0) {
        program[n] = '\0';
        char *end = strrchr(program, '/');
        strcpy(end != NULL ? end + 1 : program, name);
        if (access(program, X_OK) == 0)
            return;
    }
    strcpy(program, name);
}

void private_station_path(const struct private_station *station, const char *name,
                          char ret[PRIVATE_PATH_SIZE])
{
    snprintf(ret, PRIVATE_PATH_SIZE, "%.400s/%.100s", station->folder, name);
}

enum status private_station_begin(struct private_station *ret)
{
    struct private_station station = { .pid = 0 };
    const char *tmp = getenv("TMPDIR");
    char state[PRIVATE_PATH_SIZE];
    struct sockaddr_un address;
    snprintf(station.folder, sizeof station.folder, "%.300s/skinspec.XXXXXX",
             tmp != NULL && *tmp != '\0' ? tmp : "/tmp");
    if (mkdtemp(station.folder) == NULL) {
        log_error("cannot make a folder '%s': %s; TMPDIR names another place", station.folder,
                  strerror(errno));
        return STATUS_IO;
    }
    find_program(station.program);
    private_station_path(&station, "socket", station.socket);
    private_station_path(&station, "state", state);
    enum status s = STATUS_OK;
    if (strlen(station.socket) >= sizeof address.sun_path) {
        log_error("the path of TMPDIR is too long for a socket in it: set TMPDIR=/tmp");
        s = STATUS_RANGE;
    } else if (mkdir(state, 0700) != 0) {
        log_error("cannot make '%s': %s", state, strerror(errno));
        s = STATUS_IO;
    }
    if (s != STATUS_OK) {
        private_station_end(&station);
        return s;
    }
    *ret = station;
    return STATUS_OK;
}

/* ---- the child ---------------------------------------------------------------------- */

/* In the child, which ends with its parent. */
static void forget_parent(pid_t parent)
{
    static const char *const others[] = { "LISTEN_FDS",     "LISTEN_PID",   "LISTEN_FDNAMES",
                                          "NOTIFY_SOCKET",  "WATCHDOG_PID", "WATCHDOG_USEC",
                                          "STATE_DIRECTORY" };
    sigset_t none;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent)
        _exit(EXIT_FAILURE);
    setpgid(0, 0); /* a Ctrl-C is ours to hear first */
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        unsetenv(others[i]);
}

static void become(const struct private_station *station, const char *const *argv)
{
    execvp(station->program, (char *const *)argv); /* it does not write them */
    dprintf(STDERR_FILENO, "skinspec: cannot run %s: %s; 'make all' builds it\n", station->program,
            strerror(errno));
    _exit(EXIT_FAILURE);
}

static int listen_at(const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    strcpy(address.sun_path, path);
    unlink(path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 &&
        (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 || listen(fd, 8) != 0)) {
        int why = errno;
        close(fd);
        errno = why;
        return -1;
    }
    return fd;
}

static void run_child(const struct private_station *station, const char *const *argv, int listener,
                      pid_t parent)
{
    char log[PRIVATE_PATH_SIZE], pid[32];
    private_station_path(station, "log", log);
    forget_parent(parent);
    int nothing = open("/dev/null", O_RDONLY);
    int to = open(log, O_WRONLY | O_CREAT | O_APPEND, 0600);
    if (to >= 0) {
        dup2(to, STDOUT_FILENO);
        dup2(to, STDERR_FILENO);
    }
    dup2(nothing, STDIN_FILENO);
    if (listener == FIRST_HANDED_OVER)
        fcntl(listener, F_SETFD, 0);
    else
        dup2(listener, FIRST_HANDED_OVER);
    snprintf(pid, sizeof pid, "%ld", (long)getpid());
    setenv("LISTEN_FDS", "1", 1);
    setenv("LISTEN_PID", pid, 1);
    become(station, argv);
}

static size_t add(const char **argv, size_t n, const char *text)
{
    if (n < MAX_OPTIONS)
        argv[n++] = text;
    return n;
}

enum status private_station_start(struct private_station *station, const char *const *options)
{
    char state[PRIVATE_PATH_SIZE];
    const char *argv[MAX_OPTIONS + 1];
    size_t n = 0;
    private_station_path(station, "state", state);
    n = add(argv, n, station->program);
    n = add(argv, n, "--socket");
    n = add(argv, n, station->socket);
    n = add(argv, n, "--state");
    n = add(argv, n, state);
    for (; *options != NULL; options++)
        n = add(argv, n, *options);
    argv[n] = NULL;
    int listener = listen_at(station->socket);
    pid_t parent = getpid(), pid = listener >= 0 ? fork() : -1;
    if (pid == 0)
        run_child(station, argv, listener, parent);
    if (pid < 0)
        log_error("cannot start a station at '%s': %s", station->socket, strerror(errno));
    if (listener >= 0)
        close(listener);
    if (pid < 0)
        return STATUS_IO;
    station->pid = pid;
    return STATUS_OK;
}

void private_station_show_log(const struct private_station *station)
{
    char path[PRIVATE_PATH_SIZE], line[1024];
    private_station_path(station, "log", path);
    FILE *log = fopen(path, "re");
    if (log == NULL)
        return;
    fputs("the station's log:\n", stderr);
    while (fgets(line, sizeof line, log) != NULL)
        fprintf(stderr, "  %s", line);
    fclose(log);
}

/* ---- its end ------------------------------------------------------------------------ */

static bool has_ended(pid_t pid, int64_t until_ms)
{
    for (;;) {
        pid_t ended = waitpid(pid, NULL, WNOHANG);
        if (ended != 0 && !(ended < 0 && errno == EINTR))
            return true;
        if (clock_monotonic_ms() >= until_ms)
            return false;
        poll(NULL, 0, LOOK_MS);
    }
}

void private_station_stop(struct private_station *station)
{
    if (station->pid == 0)
        return;
    kill(station->pid, SIGTERM);
    if (!has_ended(station->pid, clock_monotonic_ms() + STOP_MS)) {
        kill(station->pid, SIGKILL);
        waitpid(station->pid, NULL, 0);
    }
    station->pid = 0;
}

static int remove_one(const char *path, const struct stat *st, int kind, struct FTW *where)
{
    (void)st, (void)kind, (void)where;
    (void)remove(path);
    return 0;
}

void private_station_end(struct private_station *station)
{
    private_station_stop(station);
    if (station->folder[0] != '\0')
        (void)nftw(station->folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    station->folder[0] = '\0';
}

/* ---- asking the program ------------------------------------------------------------- */

static char *read_all(int fd)
{
    char *text = NULL;
    size_t n = 0;
    FILE *to = open_memstream(&text, &n);
    char some[4096];
    ssize_t got;
    while (to != NULL && (got = read(fd, some, sizeof some)) != 0) {
        if (got > 0)
            fwrite(some, 1, (size_t)got, to);
        else if (errno != EINTR)
            break;
    }
    if (to == NULL || fclose(to) != 0)
        return NULL;
    return text;
}

char *private_station_ask(const struct private_station *station, const char *option)
{
    int ends[2], status = -1;
    const char *argv[3] = { NULL };
    size_t n = add(argv, 0, station->program);
    (void)add(argv, n, option);
    if (pipe(ends) != 0) {
        log_error("no pipe: %s", strerror(errno));
        return NULL;
    }
    pid_t parent = getpid(), pid = fork();
    if (pid == 0) {
        forget_parent(parent);
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        close(ends[1]);
        become(station, argv);
    }
    close(ends[1]);
    char *text = pid > 0 ? read_all(ends[0]) : NULL;
    close(ends[0]);
    if (pid < 0 || waitpid(pid, &status, 0) != pid || status != 0) {
        log_error("%s %s does not work: is it of this version?", station->program, option);
        free(text);
        return NULL;
    }
    return text;
}
