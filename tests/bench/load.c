/* load.c - how many requests a second a service on a Unix socket answers, and how soon.
 *
 *     load SOCKET REQUESTS SECONDS CONNECTIONS
 *
 * Every connection sends a line of the file REQUESTS, waits for its answer, and sends
 * the next.  A line with the member "uuid" is sent with a new one each time.  One JSON
 * object on standard output; ends with status 1 at the first answer that is an error.
 * It shares the machine with the service, so it does next to nothing itself: lines are
 * made before, and of an answer only its beginning is looked at. */
#define _GNU_SOURCE /* memmem() */
#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "base/number.h"

enum {
    MOST_CONNECTIONS = 1024,
    MOST_REQUESTS = 4096,
    ANSWER_SIZE = 4096,
    WARM_UP_MS = 500,   /* answered, but not counted */
    PATIENCE_MS = 5000, /* without any answer */
    UUID_TAIL = 12,     /* the digits behind the last dash */
};

struct line {
    char *text; /* with its line feed */
    size_t size;
    char *uuid_tail; /* NULL without a uuid */
};

struct connection {
    int fd;
    int64_t sent_ns;
    size_t filled;
    char answer[ANSWER_SIZE];
};

static struct line lines[MOST_REQUESTS];
static struct connection connections[MOST_CONNECTIONS];
static size_t lines_n;

/* What was counted; took_us grows as needed. */
static struct {
    uint64_t sent, answered;
    size_t n, size;
    uint32_t *took_us;
} tally;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void give_up(const char *what)
{
    fprintf(stderr, "load: %s%s%s\n", what, errno != 0 ? ": " : "",
            errno != 0 ? strerror(errno) : "");
    exit(1);
}

/* ---- requests ------------------------------------------------------------------------- */

static void add_line(char *text, size_t size)
{
    static const char member[] = "\"uuid\":\"";
    struct line *line = &lines[lines_n++];
    char *uuid = memmem(text, size, member, sizeof member - 1);
    *line = (struct line){ .text = text, .size = size };
    if (uuid != NULL)
        line->uuid_tail = uuid + sizeof member - 1 + 36 - UUID_TAIL;
}

static void read_lines(const char *path)
{
    struct stat status;
    FILE *file = fopen(path, "r");
    if (file == NULL || fstat(fileno(file), &status) != 0)
        give_up(path);
    size_t size = (size_t)status.st_size;
    char *text = malloc(size + 1); /* until the program ends */
    if (text == NULL || fread(text, 1, size, file) != size)
        give_up(path);
    fclose(file);
    for (char *end; size > 0 && lines_n < MOST_REQUESTS; text = end) {
        end = memchr(text, '\n', size);
        if (end == NULL)
            break;
        end++;
        add_line(text, (size_t)(end - text));
        size -= (size_t)(end - text);
    }
    if (lines_n == 0)
        give_up("no requests");
}

static void renew_uuid(const struct line *line)
{
    char tail[UUID_TAIL + 1];
    snprintf(tail, sizeof tail, "%012" PRIx64, tally.sent & 0xffffffffffff);
    memcpy(line->uuid_tail, tail, UUID_TAIL);
}

/* ---- connections ------------------------------------------------------------------------ */

static void send_all(struct connection *c, const char *text, size_t size)
{
    while (size > 0) {
        ssize_t sent = send(c->fd, text, size, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR)
            give_up("cannot send");
        if (sent > 0) {
            text += sent;
            size -= (size_t)sent;
        }
    }
}

/* What has come, behind what came before.  True at the end of a line. */
static bool receive(struct connection *c)
{
    ssize_t got = recv(c->fd, c->answer + c->filled, sizeof c->answer - c->filled, 0);
    if (got == 0)
        errno = 0;
    if (got <= 0)
        give_up("the service closed a connection");
    c->filled += (size_t)got;
    if (c->answer[c->filled - 1] == '\n')
        return true;
    if (c->filled == sizeof c->answer)
        give_up("an answer is too long");
    return false;
}

static void check_result(struct connection *c)
{
    static const char result[] = "\"result\":";
    size_t head = c->filled < 64 ? c->filled : 64;
    if (memmem(c->answer, head, result, sizeof result - 1) == NULL) {
        fprintf(stderr, "load: refused: %.*s", (int)c->filled, c->answer);
        exit(1);
    }
    c->filled = 0;
}

static void open_session(struct connection *c, const char *path)
{
    static const char open[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"session.open\","
                               "\"params\":{\"major\":1,\"client\":\"load\","
                               "\"operator\":\"bench\"}}\n";
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (c->fd < 0 || connect(c->fd, (struct sockaddr *)&address, sizeof address) != 0)
        give_up(path);
    while (!receive(c)) /* hello */
        ;
    c->filled = 0;
    send_all(c, open, sizeof open - 1);
    while (!receive(c))
        ;
    check_result(c);
}

static void send_next(struct connection *c)
{
    struct line *line = &lines[tally.sent % lines_n];
    if (line->uuid_tail != NULL)
        renew_uuid(line);
    tally.sent++;
    c->sent_ns = now_ns();
    send_all(c, line->text, line->size);
}

/* ---- the run -------------------------------------------------------------------------------- */

static void note(int64_t took_ns)
{
    if (tally.n == tally.size) {
        tally.size = tally.size > 0 ? 2 * tally.size : 65536;
        tally.took_us = realloc(tally.took_us, tally.size * sizeof *tally.took_us);
        if (tally.took_us == NULL)
            give_up("no memory");
    }
    tally.took_us[tally.n++] = (uint32_t)(took_ns / 1000);
}

/* Until end_ns, then until the last answer is there: what was asked is then stored. */
static void run(int epoll, int64_t count_from_ns, int64_t end_ns)
{
    struct epoll_event ready[64];
    while (tally.answered < tally.sent) {
        int n = epoll_wait(epoll, ready, sizeof ready / sizeof *ready, PATIENCE_MS);
        if (n == 0)
            give_up("no answer");
        for (int i = 0; i < n; i++) {
            struct connection *c = ready[i].data.ptr;
            if (!receive(c))
                continue;
            int64_t at_ns = now_ns();
            check_result(c);
            tally.answered++;
            if (at_ns >= count_from_ns && at_ns < end_ns)
                note(at_ns - c->sent_ns);
            if (at_ns < end_ns)
                send_next(c);
        }
    }
}

static int compare(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void print_tally(double seconds)
{
    if (tally.n == 0)
        give_up("nothing was counted");
    qsort(tally.took_us, tally.n, sizeof *tally.took_us, compare);
    printf("{\"answered\":%" PRIu64 ",\"per_s\":%.1f,\"p50_us\":%" PRIu32 ",\"p99_us\":%" PRIu32
           ",\"max_us\":%" PRIu32 "}\n",
           tally.answered, (double)tally.n / seconds, tally.took_us[tally.n / 2],
           tally.took_us[tally.n * 99 / 100], tally.took_us[tally.n - 1]);
}

int main(int argc, char **argv)
{
    double seconds;
    size_t n;
    if (argc != 5 || number_parse(argv[3], &seconds) != STATUS_OK || !(seconds > 0.0) ||
        number_parse_count(argv[4], MOST_CONNECTIONS, &n) != STATUS_OK || n == 0) {
        fprintf(stderr, "usage: load SOCKET REQUESTS SECONDS CONNECTIONS\n");
        return 2;
    }
    read_lines(argv[2]);
    int epoll = epoll_create1(EPOLL_CLOEXEC);
    for (size_t i = 0; i < n; i++) {
        struct connection *c = &connections[i];
        struct epoll_event event = { .events = EPOLLIN, .data.ptr = c };
        open_session(c, argv[1]);
        if (epoll_ctl(epoll, EPOLL_CTL_ADD, c->fd, &event) != 0)
            give_up("epoll");
    }
    int64_t count_from_ns = now_ns() + WARM_UP_MS * INT64_C(1000000);
    for (size_t i = 0; i < n; i++)
        send_next(&connections[i]);
    run(epoll, count_from_ns, count_from_ns + (int64_t)(seconds * 1e9));
    print_tally(seconds);
    free(tally.took_us);
    return 0;
}
