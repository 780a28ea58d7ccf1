/* driver_session.h - for fuzzers of drivers of a serial line: any bytes as what the instrument
 * sends, to a reader of lines, and to a whole session.
 *
 * In the bytes 0xfe is silence: a wait ends there in vain, and a drain takes all up to it.  When
 * the bytes are used up, or after many silences, the instrument is gone.  No wait takes time:
 * call_wait() and call_now_ms() are its own, by the linker's --wrap. */
#ifndef SKINSPEC_TESTS_FUZZ_DRIVER_SESSION_H
#define SKINSPEC_TESTS_FUZZ_DRIVER_SESSION_H

#include <stdbool.h>
#include <stddef.h>

#include "drivers/driver.h"

struct driver_session {
    const struct driver *driver;
    int open_timeout_ms;
    unsigned most_silences;
    bool (*may_send)(const char *bytes, size_t n);
};

/* Aborts, which is what a fuzzer finds, and says what was wrong. */
void driver_session_must(bool condition, const char *what);

/* Each line, without its line feed, cut to LINE_MAX_BYTES; read() may write to it. */
void driver_session_lines(const unsigned char *data, size_t size, void (*read)(char *line));

/* Open, status, calibrate, measure, button, configure, stored sample: what comes out as a reading
 * is a reflectance; what fails says why; nothing is sent that may not be. */
void driver_session_hold(const struct driver_session *session, const unsigned char *data,
                         size_t size);

#endif
