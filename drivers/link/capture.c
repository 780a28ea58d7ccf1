/* capture.c - writing a conversation down, one write() a line. */
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

struct capture {
    pthread_mutex_t lock; /* of all below */
    int fd;
    bool failed;
    off_t size; /* the file ends here, after a whole line */
    struct timespec began;
    char *path; /* for messages */
};

/* ---- a line ------------------------------------------------------------------------- */

/* What could not be written whole is taken back. */
static bool append(struct capture *capture, const char *line, size_t n)
{
    for (size_t done = 0; done < n;) {
        ssize_t wrote = write(capture->fd, line + done, n - done);
        if (wrote < 0 && errno == EINTR)
            continue;
        if (wrote <= 0) {
            int failed = wrote < 0 ? errno : EIO;
            if (ftruncate(capture->fd, capture->size) != 0)
                log_error("%s: its last line is not whole: %s", capture->path, strerror(errno));
            errno = failed;
            return false;
        }
        done += (size_t)wrote;
    }
    capture->size += (off_t)n;
    return true;
}

static void give_up(struct capture *capture, const char *why)
{
    capture->failed = true;
    log_error("%s: %s: the capture ends here and is not whole", capture->path, why);
}

/* A line is made in memory, by whichever of the functions below. */
struct line {
    char *text;
    size_t n;
    FILE *to; /* NULL: no memory */
};

static void begin_line(struct capture *capture, struct line *line, bool timed)
{
    *line = (struct line){ NULL, 0, NULL };
    pthread_mutex_lock(&capture->lock);
    line->to = open_memstream(&line->text, &line->n);
    if (line->to == NULL || !timed)
        return;
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    long long us = (long long)(now.tv_sec - capture->began.tv_sec) * 1000000 +
                   (now.tv_nsec - capture->began.tv_nsec) / 1000;
    fprintf(line->to, "%lld.%06lld ", us / 1000000, us % 1000000);
}

static void end_line(struct capture *capture, struct line *line)
{
    bool made = line->to != NULL;
    if (made) {
        putc('\n', line->to);
        made = fflush(line->to) == 0 && !ferror(line->to);
        made = fclose(line->to) == 0 && made;
    }
    if (!capture->failed) {
        if (!made)
            give_up(capture, "no memory");
        else if (!append(capture, line->text, line->n))
            give_up(capture, strerror(errno));
    }
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
    begin_line(capture, &line, timed);
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
    begin_line(capture, &line, true);
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

static void capture_free_memory(struct capture *capture)
{
    pthread_mutex_destroy(&capture->lock);
    free(capture->path);
    free(capture);
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
    pthread_mutex_init(&capture->lock, NULL);
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
    write_header(capture, driver);
    if (capture->failed) {
        unlink(path); /* nothing is in it */
        return capture_close(capture);
    }
    *ret = capture;
    return STATUS_OK;
}

enum status capture_close(struct capture *capture)
{
    if (capture == NULL)
        return STATUS_OK;
    bool whole = !capture->failed;
    if (close(capture->fd) != 0 && whole) { /* where a network disk says that it was full */
        log_error("%s: %s: the capture is not whole", capture->path, strerror(errno));
        whole = false;
    }
    capture_free_memory(capture);
    return whole ? STATUS_OK : STATUS_IO;
}
