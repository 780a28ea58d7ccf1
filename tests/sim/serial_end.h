/* serial_end.h - the instrument's end of a serial line: bytes of the host into lines, replies with
 * their times, and what can go wrong with both (faults.h).
 *
 * Replies come one after the other, in order: one that is asked for while another is still on
 * its way comes after it. */
#ifndef SKINSPEC_TESTS_SIM_SERIAL_END_H
#define SKINSPEC_TESTS_SIM_SERIAL_END_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "tests/sim/faults.h"
#include "tests/support/dice.h"

struct serial_reply; /* one on its way */

enum { SERIAL_END_LINE = 512 };

struct serial_end {
    /* Set by its owner: what ends a line of the host ('\n': a '\r' before it goes too; '\r': a
     * '\n' after it), what ends one of the instrument, and a byte's time on the line. */
    char host_end;
    const char *own_end;
    int64_t byte_us;
    struct faults faults;
    struct dice dice;

    struct serial_reply *first, *late;
    char line[SERIAL_END_LINE];
    size_t filled;
    bool too_long, after_end;
    int64_t free_us; /* when the last reply will be out */
};

void serial_end_done(struct serial_end *end); /* all replies go */

/* A whole line without its end; NULL: one too long, or with a byte that is no text. */
typedef void serial_end_line(void *owner, const char *line, int64_t now_us);

void serial_end_take(struct serial_end *end, const uint8_t *bytes, size_t n, int64_t now_us,
                     serial_end_line *line, void *owner);

/* n bytes and the end of a line, after_us from now at the earliest. */
void serial_end_reply(struct serial_end *end, const void *bytes, size_t n, int64_t now_us,
                      int64_t after_us);

/* The host's own bytes back to it at once. */
void serial_end_echo(struct serial_end *end, const uint8_t *bytes, size_t n, int64_t now_us);

/* As give() of sim.h. */
ssize_t serial_end_give(struct serial_end *end, uint8_t *bytes, size_t size, int64_t now_us,
                        int64_t *due_us);

#endif
