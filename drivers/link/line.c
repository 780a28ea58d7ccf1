/* line.c - lines out of a stream of bytes. */
#include "drivers/link/line.h"

#include <string.h>

void line_reader_init(struct line_reader *reader, struct link *link, const char *end)
{
    reader->link = link;
    reader->end = end;
    reader->filled = 0;
    reader->overlong = false;
}

bool line_is_kept(const struct line_reader *reader)
{
    return reader->filled > 0;
}

/* Where the end of the first line begins; NULL where it has not come. */
static char *find_end(struct line_reader *reader)
{
    size_t n = strlen(reader->end);
    for (size_t i = 0; i + n <= reader->filled; i++)
        if (memcmp(reader->bytes + i, reader->end, n) == 0)
            return reader->bytes + i;
    return NULL;
}

static void forget(struct line_reader *reader, size_t n)
{
    reader->filled -= n;
    memmove(reader->bytes, reader->bytes + n, reader->filled);
}

static enum driver_result doubt_bytes(const char *line, size_t n, struct driver_error *error)
{
    for (size_t i = 0; i < n; i++)
        if ((unsigned char)line[i] < 0x20 || (unsigned char)line[i] > 0x7e)
            return driver_fail(error, DRIVER_PROTOCOL, NULL,
                               "byte %zu of a line is 0x%02x, which is no text: is this the right "
                               "instrument, at the right speed?",
                               i + 1, (unsigned char)line[i]);
    return DRIVER_OK;
}

static enum driver_result fail_overlong(struct driver_error *error)
{
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "a line of more than %d bytes: is this the right instrument?",
                       LINE_MAX_BYTES);
}

/* The first line has ended: out of the buffer with it. */
static enum driver_result take_line(struct line_reader *reader, const char *end,
                                    char line[LINE_MAX_BYTES], struct driver_error *error)
{
    size_t n = (size_t)(end - reader->bytes);
    bool overlong = reader->overlong;
    enum driver_result r = overlong ? fail_overlong(error) : doubt_bytes(reader->bytes, n, error);
    if (r == DRIVER_OK) {
        memcpy(line, reader->bytes, n);
        line[n] = '\0';
    }
    reader->overlong = false;
    forget(reader, n + strlen(reader->end));
    return r;
}

/* Room for more of a line that has not ended in a whole buffer; its end may have begun. */
static void make_room(struct line_reader *reader)
{
    if (reader->filled < sizeof reader->bytes)
        return;
    reader->overlong = true;
    forget(reader, reader->filled - (strlen(reader->end) - 1));
}

enum driver_result line_read(struct line_reader *reader, char line[LINE_MAX_BYTES],
                             int64_t deadline_ms, struct driver_error *error)
{
    for (;;) {
        const char *end = find_end(reader);
        if (end != NULL)
            return take_line(reader, end, line, error);
        make_room(reader);
        size_t n = 0;
        enum driver_result r =
            link_receive(reader->link, LINK_SERIAL, reader->bytes + reader->filled,
                         sizeof reader->bytes - reader->filled, &n, deadline_ms, error);
        if (r == DRIVER_TIMEOUT && reader->overlong)
            return fail_overlong(error); /* and thrown away up to its end by the next */
        if (r != DRIVER_OK)
            return r;
        reader->filled += n;
    }
}

enum driver_result line_resync(struct line_reader *reader, int quiet_ms, int64_t deadline_ms,
                               struct driver_error *error)
{
    reader->filled = 0;
    reader->overlong = false;
    return link_drain(reader->link, LINK_SERIAL, quiet_ms, deadline_ms, error);
}
