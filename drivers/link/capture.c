/* capture.c - writing a conversation down.
 *
 * Lines are made by whoever has something to say, and wait in memory for a thread that writes them:
 * neither the station's loop nor an instrument's thread waits for the disk. */
#include "drivers/link/capture.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/log.h"
#include "base/version.h"

/* From here on a transfer that is not text is easier to read as hex. */
enum { LONG_TRANSFER = 64 };

/* More is not kept for a disk that takes nothing. */
enum { MOST_WAITING = 16 << 20, FIRST_ROOM = 4096 };

struct text {
    char *bytes;
    size_t n, room;
};

struct capture {
    pthread_mutex_t lock;   /* of all up to closing */
    pthread_cond_t changed; /* lines came, were written, or it is closing; by CLOCK_MONOTONIC */
    struct text waiting;    /* whole lines, in order, for the thread to write */
    size_t in_hand;         /* bytes that it is writing */
    bool failed;            /* no further line is taken */
    bool closing;
    struct timespec began;
    char *path; /* for messages */

    pthread_t thread;
    bool runs;  /* it was started */
    int fd;     /* the thread's own, once it runs */
    off_t size; /* the file ends here, after a whole line */
};

/* ---- to the file: on the thread ----------------------------------------------------- */

/* A line that could not be written whole is taken back, and those behind it are not written. */
static void take_back(struct capture *capture, const char *lines, size_t done)
{
    while (done > 0 && lines[done - 1] != '\n')
        done--;
    capture->size += (off_t)done;
    if (ftruncate(capture->fd, capture->size) != 0)
        log_error("%s: its last line is not whole: %s", capture->path, strerror(errno));
}

/* False, and errno. */
static bool append(struct capture *capture, const char *lines, size_t n)
{
    for (size_t done = 0; done < n;) {
        ssize_t wrote = write(capture->fd, lines + done, n - done);
        if (wrote < 0 && errno == EINTR)
            continue;
        if (wrote <= 0) {
            int failed = wrote < 0 ? errno : EIO;
            take_back(capture, lines, done);
            errno = failed;
            return false;
        }
        done += (size_t)wrote;
    }
    capture->size += (off_t)n;
    return true;
}

/* With the lock held. */
static void give_up(struct capture *capture, const char *why)
{
    if (!capture->failed)
        log_error("%s: %s: the capture ends here and is not whole", capture->path, why);
    capture->failed = true;
}

/* With the lock held, which is free while the disk takes its time: all that waits, by `taken`,
 * which is empty before and after. */
static void write_waiting(struct capture *capture, struct text *taken)
{
    struct text empty = *taken;
    *taken = capture->waiting;
    capture->waiting = empty;
    capture->in_hand = taken->n;
    pthread_mutex_unlock(&capture->lock);
    bool wrote = append(capture, taken->bytes, taken->n);
    int why = errno;
    pthread_mutex_lock(&capture->lock);
    taken->n = capture->in_hand = 0;
    if (!wrote) {
        give_up(capture, strerror(why));
        capture->waiting.n = 0;
    }
    pthread_cond_broadcast(&capture->changed);
}

static void *write_lines(void *of)
{
    struct capture *capture = of;
    struct text taken = { NULL, 0, 0 };
    pthread_mutex_lock(&capture->lock);
    for (;;) {
        while (capture->waiting.n == 0 && !capture->closing)
            pthread_cond_wait(&capture->changed, &capture->lock);
        if (capture->waiting.n == 0)
            break;
        write_waiting(capture, &taken);
    }
    pthread_mutex_unlock(&capture->lock);
    free(taken.bytes);
    return NULL;
}

/* ---- a line ------------------------------------------------------------------------- */

/* With the lock held; room for n more bytes, or NULL: no memory. */
static char *room_for(struct text *text, size_t n)
{
    size_t room = text->room > 0 ? text->room : FIRST_ROOM;
    while (room < text->n + n)
        room *= 2;
    if (room != text->room) {
        char *bytes = realloc(text->bytes, room);
        if (bytes == NULL)
            return NULL;
        text->bytes = bytes;
        text->room = room;
    }
    return text->bytes + text->n;
}

/* "12.000345 ", seconds since it was made; its length. */
static size_t stamp(const struct capture *capture, char text[32])
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    long long us = (long long)(now.tv_sec - capture->began.tv_sec) * 1000000 +
                   (now.tv_nsec - capture->began.tv_nsec) / 1000;
    return (size_t)snprintf(text, 32, "%lld.%06lld ", us / 1000000, us % 1000000);
}

/* With the lock held, so that times rise from line to line. */
static void put_waiting(struct capture *capture, bool timed, const char *line, size_t n)
{
    char time[32];
    size_t time_n = timed ? stamp(capture, time) : 0, all = time_n + n;
    if (capture->waiting.n + capture->in_hand + all > MOST_WAITING) {
        give_up(capture, "the disk takes too long");
        return;
    }
    char *to = room_for(&capture->waiting, all);
    if (to == NULL) {
        give_up(capture, "no memory");
        return;
    }
    memcpy(to, time, time_n);
    memcpy(to + time_n, line, n);
    capture->waiting.n += all;
    pthread_cond_broadcast(&capture->changed);
}

/* A line is made in memory, by whichever of the functions below. */
struct line {
    char *text;
    size_t n;
    FILE *to; /* NULL: no memory */
    bool timed;
};

static void begin_line(struct line *line, bool timed)
{
    *line = (struct line){ .timed = timed };
    line->to = open_memstream(&line->text, &line->n);
}

static void end_line(struct capture *capture, struct line *line)
{
    bool made = line->to != NULL;
    if (made) {
        putc('\n', line->to);
        made = fflush(line->to) == 0 && !ferror(line->to);
        made = fclose(line->to) == 0 && made;
    }
    pthread_mutex_lock(&capture->lock);
    if (!made)
        give_up(capture, "no memory");
    else if (!capture->failed)
        put_waiting(capture, line->timed, line->text, line->n);
    pthread_mutex_unlock(&capture->lock);
    free(line->text);
}

/* Text of others' making may not end the line. */
static void put_text(FILE *to, const char *text)
{
    if (to == NULL)
        return;
    for (; *text != '\0'; text++)
        putc((unsigned char)*text < ' ' ? ' ' : *text, to);
}

static void put_line(struct capture *capture, bool timed, const char *before, const char *text)
{
    struct line line;
    begin_line(&line, timed);
    put_text(line.to, before);
    put_text(line.to, text);
    end_line(capture, &line);
}

/* ---- bytes -------------------------------------------------------------------------- */

static bool is_printable(uint8_t byte)
{
    return byte >= 0x20 && byte <= 0x7e;
}

static bool is_better_as_hex(const uint8_t *bytes, size_t n)
{
    size_t printable = 0;
    for (size_t i = 0; i < n; i++)
        printable += is_printable(bytes[i]) || bytes[i] == '\r' || bytes[i] == '\n';
    return n > LONG_TRANSFER && printable < n - printable;
}

/* An editor may take spaces at the end away, and `:` begins hex. */
static bool needs_escape(const uint8_t *bytes, size_t n, size_t i)
{
    bool at_an_end = i == 0 || i == n - 1;
    return !is_printable(bytes[i]) || (bytes[i] == ' ' && at_an_end) || (bytes[i] == ':' && i == 0);
}

static void put_bytes(FILE *to, const uint8_t *bytes, size_t n)
{
    if (is_better_as_hex(bytes, n)) {
        putc(':', to);
        for (size_t i = 0; i < n; i++)
            fprintf(to, "%02x", bytes[i]);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        if (bytes[i] == '\r')
            fputs("\\r", to);
        else if (bytes[i] == '\n')
            fputs("\\n", to);
        else if (bytes[i] == '\\')
            fputs("\\\\", to);
        else if (needs_escape(bytes, n, i))
            fprintf(to, "\\x%02x", bytes[i]);
        else
            putc(bytes[i], to);
    }
}

void capture_bytes(struct capture *capture, char direction, uint8_t channel, const void *bytes,
                   size_t n)
{
    struct line line;
    begin_line(&line, true);
    if (line.to != NULL) {
        fprintf(line.to, "%c %02x", direction, channel);
        if (n > 0) {
            putc(' ', line.to);
            put_bytes(line.to, bytes, n);
        }
    }
    end_line(capture, &line);
}

/* ---- the other lines ---------------------------------------------------------------- */

void capture_note(struct capture *capture, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    put_line(capture, false, "# ", text);
}

void capture_call(struct capture *capture, const char *call)
{
    put_line(capture, true, "= ", call);
}

void capture_asked(struct capture *capture, const char *what)
{
    put_line(capture, true, "@ ", what);
}

void capture_event(struct capture *capture, const char *event)
{
    put_line(capture, true, "", event);
}

void capture_clock(struct capture *capture, int64_t realtime_s)
{
    char text[32];
    snprintf(text, sizeof text, "%lld", (long long)realtime_s);
    put_line(capture, true, "clock ", text);
}

/* ---- its life ----------------------------------------------------------------------- */

static void write_header(struct capture *capture, const char *driver)
{
    struct timespec now;
    struct tm utc;
    char date[32];
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &utc);
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%SZ", &utc);
    capture_note(capture, "skinspec capture 1");
    capture_note(capture, "date: %s         by: skinspec " SKINSPEC_VERSION, date);
    put_line(capture, true, "driver ", driver);
}

static void init_locks(struct capture *capture)
{
    pthread_condattr_t by_monotonic;
    pthread_condattr_init(&by_monotonic);
    pthread_condattr_setclock(&by_monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&capture->changed, &by_monotonic);
    pthread_condattr_destroy(&by_monotonic);
    pthread_mutex_init(&capture->lock, NULL);
}

static void capture_free_memory(struct capture *capture)
{
    pthread_mutex_destroy(&capture->lock);
    pthread_cond_destroy(&capture->changed);
    free(capture->waiting.bytes);
    free(capture->path);
    free(capture);
}

/* The first lines are in the file before anything else happens; then the thread. */
static void begin_writing(struct capture *capture, const char *driver)
{
    struct text taken = { NULL, 0, 0 };
    write_header(capture, driver);
    pthread_mutex_lock(&capture->lock);
    write_waiting(capture, &taken);
    if (!capture->failed) {
        int e = pthread_create(&capture->thread, NULL, write_lines, capture);
        capture->runs = e == 0;
        if (e != 0)
            give_up(capture, strerror(e));
    }
    pthread_mutex_unlock(&capture->lock);
    free(taken.bytes);
}

enum status capture_create(const char *path, const char *driver, struct capture **ret)
{
    struct capture *capture = calloc(1, sizeof *capture);
    char *copy = strdup(path);
    if (capture == NULL || copy == NULL) {
        log_error("%s: no memory for a capture", path);
        free(copy);
        free(capture);
        return STATUS_NO_MEMORY;
    }
    init_locks(capture);
    capture->path = copy;
    clock_gettime(CLOCK_MONOTONIC, &capture->began);
    capture->fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC | O_NOCTTY,
                       S_IRUSR | S_IWUSR);
    if (capture->fd < 0) {
        bool exists = errno == EEXIST;
        log_error("%s: %s", path,
                  exists ? "there is such a file: a capture is never written over"
                         : strerror(errno));
        enum status s = exists ? STATUS_EXISTS : errno == ENOSPC ? STATUS_FULL : STATUS_IO;
        capture_free_memory(capture);
        return s;
    }
    begin_writing(capture, driver);
    if (capture->failed) {
        unlink(path); /* nothing is in it */
        return capture_close(capture);
    }
    *ret = capture;
    return STATUS_OK;
}

bool capture_flush(struct capture *capture, int within_ms)
{
    struct timespec until;
    int e = 0;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += within_ms / 1000;
    until.tv_nsec += within_ms % 1000 * 1000000L;
    if (until.tv_nsec >= 1000000000L) {
        until.tv_sec++;
        until.tv_nsec -= 1000000000L;
    }
    pthread_mutex_lock(&capture->lock);
    while (capture->waiting.n + capture->in_hand > 0 && e == 0)
        e = pthread_cond_timedwait(&capture->changed, &capture->lock, &until);
    bool whole = capture->waiting.n + capture->in_hand == 0 && !capture->failed;
    pthread_mutex_unlock(&capture->lock);
    return whole;
}

enum status capture_close(struct capture *capture)
{
    if (capture == NULL)
        return STATUS_OK;
    if (capture->runs) {
        pthread_mutex_lock(&capture->lock);
        capture->closing = true;
        pthread_cond_broadcast(&capture->changed);
        pthread_mutex_unlock(&capture->lock);
        pthread_join(capture->thread, NULL);
    }
    bool whole = !capture->failed;
    if (close(capture->fd) != 0 && whole) { /* where a network disk says that it was full */
        log_error("%s: %s: the capture is not whole", capture->path, strerror(errno));
        whole = false;
    }
    capture_free_memory(capture);
    return whole ? STATUS_OK : STATUS_IO;
}
