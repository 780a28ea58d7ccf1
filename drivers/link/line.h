/* line.h - lines of text from a serial link.
 *
 * What comes behind the end of a line is kept for the next: an instrument may speak without
 * being asked.  A line is at most LINE_MAX_BYTES with its end; a longer one, or one with a byte
 * that is no printable ASCII, is DRIVER_PROTOCOL and thrown away up to the next end: one call of
 * line_read() is one line, bad ones too.  Where an over-long line does not end by the deadline
 * it is DRIVER_PROTOCOL already, and again once it has ended. */
#ifndef SKINSPEC_DRIVERS_LINK_LINE_H
#define SKINSPEC_DRIVERS_LINK_LINE_H

#include <stdbool.h>

#include "drivers/link/link.h"

enum { LINE_MAX_BYTES = 1024 };

struct line_reader {
    struct link *link;
    const char *end; /* "\r\n" */
    size_t filled;
    bool overlong; /* the first bytes of the line were thrown away */
    char bytes[LINE_MAX_BYTES];
};

/* end: one byte or more, which outlive the reader. */
void line_reader_init(struct line_reader *reader, struct link *link, const char *end);

/* The next line without its end, with a NUL.  DRIVER_TIMEOUT also where it began but did not
 * end by then; its beginning is kept. */
enum driver_result line_read(struct line_reader *reader, char line[LINE_MAX_BYTES],
                             int64_t deadline_ms, struct driver_error *error);

/* Forget what was kept and drain the link: before a question, so that a late answer to the last
 * one is not taken for this one's. */
enum driver_result line_resync(struct line_reader *reader, int quiet_ms, int64_t deadline_ms,
                               struct driver_error *error);

/* Whether anything is kept: something has come unasked. */
bool line_is_kept(const struct line_reader *reader);

#endif
