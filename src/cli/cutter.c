/* cutter.c - where records end, found without reading what is in them. */
#include "cli/cutter.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Bytes of a piece, more or less; and what is read at a time. */
enum { PIECE_BYTES = 64 << 10, READ_BYTES = 256 << 10 };

void piece_done(struct piece *piece)
{
    free(piece->text);
    memset(piece, 0, sizeof *piece);
}

void cutter_init(struct cutter *cutter, int fd)
{
    *cutter =
        (struct cutter){ .fd = fd, .stop_fd = { -1, -1 }, .line = 1, .last_from = UINT64_MAX };
}

void cutter_done(struct cutter *cutter)
{
    free(cutter->text);
    cutter->text = NULL;
}

/* ---- bytes -------------------------------------------------------------------------- */

/* Something to read, the end of the input among it. */
static enum status wait_for_bytes(const struct cutter *c)
{
    struct pollfd fds[] = { { c->fd, POLLIN, 0 },
                            { c->stop_fd[0], POLLIN, 0 },
                            { c->stop_fd[1], POLLIN, 0 } };
    while (poll(fds, sizeof fds / sizeof *fds, -1) < 0)
        if (errno != EINTR)
            return STATUS_IO;
    return fds[1].revents != 0 || fds[2].revents != 0 ? STATUS_CANCELLED : STATUS_OK;
}

static bool has_more_now(const struct cutter *c)
{
    struct pollfd fd = { c->fd, POLLIN, 0 };
    return poll(&fd, 1, 0) > 0;
}

/* Room for READ_BYTES more after text[end - 1], and for a byte to mark the end. */
static enum status make_room(struct cutter *c)
{
    if (c->kept > 0) {
        memmove(c->text, c->text + c->kept, c->end - c->kept);
        c->end -= c->kept;
        c->at -= c->kept;
        c->kept = 0;
    }
    if (c->end + READ_BYTES + 1 > c->capacity) {
        size_t capacity = 2 * c->end + READ_BYTES + 1;
        char *text = realloc(c->text, capacity);
        if (text == NULL)
            return STATUS_NO_MEMORY;
        c->text = text;
        c->capacity = capacity;
    }
    return STATUS_OK;
}

static enum status read_bytes(struct cutter *c)
{
    ssize_t n;
    enum status s = make_room(c);
    if (s == STATUS_OK)
        s = wait_for_bytes(c);
    if (s != STATUS_OK)
        return s;
    do
        n = read(c->fd, c->text + c->end, READ_BYTES);
    while (n < 0 && errno == EINTR);
    if (n < 0)
        return STATUS_IO;
    c->end += (size_t)n;
    c->ended = n == 0;
    return STATUS_OK;
}

/* A failure comes again with the next call: the one that sees it first may have a piece to give. */
static enum status read_more(struct cutter *c)
{
    if (c->failed == STATUS_OK) {
        c->failed = read_bytes(c);
        c->error = errno;
    }
    errno = c->error;
    return c->failed;
}

enum status cutter_peek(struct cutter *cutter, char *ret)
{
    enum status s = STATUS_OK;
    while (s == STATUS_OK && cutter->at == cutter->end && !cutter->ended)
        s = read_more(cutter);
    if (s == STATUS_OK)
        *ret = cutter->at < cutter->end ? cutter->text[cutter->at] : '\0';
    return s;
}

/* ---- records ------------------------------------------------------------------------ */

/* A record, a comment or an empty line. */
struct extent {
    size_t n, lines; /* bytes and ends of lines in it */
    bool is_row;
};

static size_t span_of(const char *at, const char *end, const char *these)
{
    const char *from = at;
    while (at < end && strchr(these, *at) != NULL && *at != '\0')
        at++;
    return (size_t)(at - from);
}

/* A CSV record with a quote in it.  What is no CSV is the reader's to refuse: it stops there,
 * and so no matter where this ends. */
static bool quoted_extent(const char *at, const char *end, struct extent *ret)
{
    const char *from = at;
    struct extent e = { 0, 0, false };
    for (bool open = false, begins = true; at < end; at++) {
        if (open) {
            if (*at == '"' && at + 1 < end && at[1] == '"')
                at++; /* a quote in the text */
            else if (*at == '"')
                open = false;
            else
                e.lines += *at == '\n';
            e.is_row = e.is_row || open;
            continue;
        }
        if (*at == '\n') {
            e.lines++;
            e.n = (size_t)(at + 1 - from);
            *ret = e;
            return true;
        }
        open = *at == '"' && begins;
        e.is_row = e.is_row || (!open && strchr(", \t\r", *at) == NULL);
        begins = *at == ',';
    }
    e.n = (size_t)(end - from);
    *ret = e;
    return false;
}

/* What begins at `at`; false where its end is not among these bytes: it then has them all. */
static bool csv_extent(const char *at, const char *end, struct extent *ret)
{
    const char *line_end = memchr(at, '\n', (size_t)(end - at));
    const char *to = line_end != NULL ? line_end + 1 : end;
    bool comment = *at == '#' || *at == '\n' || *at == '\r';
    if (!comment && memchr(at, '"', (size_t)(to - at)) != NULL)
        return quoted_extent(at, end, ret);
    bool blank = comment || at + span_of(at, to, ", \t\r\n") == to;
    *ret = (struct extent){ (size_t)(to - at), line_end != NULL ? 1 : 0, !blank };
    return line_end != NULL;
}

static bool line_extent(const char *at, const char *end, struct extent *ret)
{
    const char *line_end = memchr(at, '\n', (size_t)(end - at));
    const char *to = line_end != NULL ? line_end + 1 : end;
    *ret = (struct extent){ (size_t)(to - at), line_end != NULL ? 1 : 0,
                            at + span_of(at, to, " \t\r\n") != to };
    return line_end != NULL;
}

/* A record that is too long for any reader ends the input; a comment goes on as a shorter one. */
static void cut_short(struct cutter *c)
{
    if (c->records == CUTTER_CSV && (c->text[c->at] == '#' || c->text[c->at] == '\r')) {
        c->offset += c->end - c->at - 1;
        c->end = c->at + 1;
    } else {
        c->ended = true;
    }
}

/* The record at text[at], read as far as needed.  STATUS_NOT_FOUND at the end of the input;
 * STATUS_TIMEOUT where it would have to be waited for and is not to be. */
static enum status look(struct cutter *c, bool wait, struct extent *ret)
{
    for (;;) {
        const char *at = c->text + c->at, *end = c->text + c->end;
        bool whole = false;
        if (at < end)
            whole = c->records == CUTTER_CSV ? csv_extent(at, end, ret) : line_extent(at, end, ret);
        c->open = !whole;
        if (whole || (c->ended && at < end))
            return STATUS_OK;
        if (c->ended)
            return STATUS_NOT_FOUND;
        if (c->end - c->at > CUTTER_LONGEST) {
            cut_short(c);
            continue;
        }
        if (!wait && !has_more_now(c))
            return STATUS_TIMEOUT;
        enum status s = read_more(c);
        if (s != STATUS_OK)
            return s;
    }
}

static void pass(struct cutter *c, const struct extent *e)
{
    c->at += e->n;
    c->offset += e->n;
    c->line += e->lines;
    c->row += e->is_row ? 1 : 0;
}

/* ---- pieces ------------------------------------------------------------------------- */

/* What was kept, with room for one byte more. */
static enum status copy_kept(const struct cutter *c, struct piece *piece)
{
    size_t n = c->at - c->kept;
    if (n + 1 > piece->capacity) {
        char *text = realloc(piece->text, n + 1);
        if (text == NULL)
            return STATUS_NO_MEMORY;
        piece->text = text;
        piece->capacity = n + 1;
    }
    memcpy(piece->text, c->text + c->kept, n);
    piece->n = n;
    return STATUS_OK;
}

enum status cutter_next(struct cutter *c, size_t rows, struct piece *piece)
{
    struct extent e;
    c->kept = c->at;
    piece->line = c->line;
    piece->rows_before = c->row;
    enum status s = look(c, true, &e);
    while (s == STATUS_OK && c->offset < c->last_from) {
        pass(c, &e);
        if (c->row - piece->rows_before == rows || c->at - c->kept >= PIECE_BYTES)
            break;
        s = look(c, false, &e);
    }
    piece->rows = c->row - piece->rows_before;
    if (c->at > c->kept)
        return copy_kept(c, piece);
    return s == STATUS_OK ? STATUS_NOT_FOUND : s;
}

enum status cutter_look_ahead(struct cutter *c, size_t rows, struct piece *piece)
{
    struct extent e;
    uint64_t offset = c->offset;
    c->kept = c->at;
    piece->line = c->line;
    piece->rows_before = c->row;
    enum status s = look(c, true, &e);
    while (s == STATUS_OK) {
        pass(c, &e);
        if (c->row - piece->rows_before == rows)
            break;
        s = look(c, true, &e);
    }
    piece->rows = c->row - piece->rows_before;
    if (c->at > c->kept)
        s = copy_kept(c, piece);
    c->at = c->kept;
    c->offset = offset;
    c->line = piece->line;
    c->row = piece->rows_before;
    return s;
}

enum status cutter_skip_rows(struct cutter *c, size_t rows)
{
    struct extent e;
    enum status s = STATUS_OK;
    for (size_t last = c->row + rows; s == STATUS_OK && c->row < last; c->kept = c->at) {
        s = look(c, true, &e);
        if (s == STATUS_OK && c->offset >= c->last_from)
            break;
        if (s == STATUS_OK)
            pass(c, &e);
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

enum status cutter_skip_to(struct cutter *c, uint64_t offset)
{
    struct extent e;
    enum status s = STATUS_OK;
    for (; s == STATUS_OK && c->offset < offset; c->kept = c->at) {
        s = look(c, true, &e);
        if (s == STATUS_OK)
            pass(c, &e);
    }
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}
