/* capture.h - a conversation with an instrument as a text file.
 *
 *   # skinspec capture 1
 *   # model: Konica Minolta CM-700d      firmware: 1.04
 *   # date: 2026-11-22T09:30:00Z         by: a wire simulator
 *   # done: calibrated, three shots
 *   # simulated, not seen on hardware
 *   0.000000 driver km_ascii
 *   0.000010 open serial
 *   0.000100 = measure                   a function of the driver begins
 *   0.000200 > 00 MES,1\r\n              to the instrument, on this channel (hex)
 *   0.004300 < 00 OK00\r\n               from it
 *   0.504400 ~ 00                        waited for it until the deadline in vain
 *   0.504500 ! gone                      the link failed, a name of driver_result
 *   0.600000 @ measure {...}             what the station was asked, JSON
 *   0.700000 clock 1763803801            the driver asked for the time (link_realtime_s)
 *
 * Times are seconds since the capture was made.  Bytes are themselves where they are printable
 * ASCII, \r, \n and \\, and \xHH else; a transfer of more than 64 bytes most of which are
 * not printable is written `:` and hex.  So are a `:` at the beginning and a space at either end
 * written \xHH.  A transfer of no bytes ends after the channel.  A line of a capture has no
 * limit.
 *
 * A send that failed is its `!` alone: what reached the instrument is not known.  `! cancelled`
 * stands where the call was cancelled.
 *
 * Lines are written whole, in the order of the calls, from any thread.  The calls never wait for
 * the disk: a thread of the capture's own writes, at once, what waits in memory, up to 16 MiB. What
 * a crash leaves can be read, and lacks what the disk had not taken by then.  After a line that
 * could not be written, or for which there was no room, no other is, for a hole would be mistaken
 * for what the instrument did. */
#ifndef SKINSPEC_DRIVERS_LINK_CAPTURE_H
#define SKINSPEC_DRIVERS_LINK_CAPTURE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "base/status.h"

/* ---- writing ------------------------------------------------------------------------ */

struct capture;

/* path is made anew (0600) and may not exist; its first lines are written: the version, the date,
 * by which program, and the driver.  Model and firmware are notes, once they are known.  Logged.
 * STATUS_EXISTS, STATUS_IO, STATUS_FULL, STATUS_NO_MEMORY. */
enum status capture_create(const char *path, const char *driver, struct capture **ret);
void capture_note(struct capture *capture, const char *format, ...) /* a line "# ..." */
    __attribute__((format(printf, 2, 3)));
void capture_call(struct capture *capture, const char *call);    /* = */
void capture_asked(struct capture *capture, const char *what);   /* @ */
void capture_event(struct capture *capture, const char *event);  /* "open serial", "! gone" */
void capture_clock(struct capture *capture, int64_t realtime_s); /* clock */
void capture_bytes(struct capture *capture, char direction, uint8_t channel, /* > < ~ */
                   const void *bytes, size_t n);

/* Wait until all that was said before is in the file; false: it was not within that time, or the
 * capture is not whole. */
bool capture_flush(struct capture *capture, int within_ms);

/* After all that was said has been written, however long that takes.
 * STATUS_IO where any line could not be written (disk full): the capture is not whole, which has
 * been logged.  Takes NULL. */
enum status capture_close(struct capture *capture);

/* ---- reading ------------------------------------------------------------------------ */

enum capture_kind {
    CAPTURE_DRIVER,  /* text: its name */
    CAPTURE_OPEN,    /* text: the kind of link */
    CAPTURE_CALL,    /* text */
    CAPTURE_SENT,    /* channel, bytes, n */
    CAPTURE_CAME,    /* channel, bytes, n */
    CAPTURE_SILENCE, /* channel */
    CAPTURE_FAILED,  /* text: a name of driver_result */
    CAPTURE_ASKED,   /* text */
    CAPTURE_CLOCK,   /* text: seconds since 1970 */
};

struct capture_line {
    enum capture_kind kind;
    double at_s;
    unsigned line; /* of the file, from 1, for messages */
    uint8_t channel;
    uint8_t *bytes; /* NULL where n is 0 */
    size_t n;
    char *text; /* NULL where the kind has none */
};

struct capture_file {
    int64_t realtime_s; /* of its "date:"; 0 without one */
    struct capture_line *lines;
    size_t n;
};

/* Logged with file:line.  STATUS_FORMAT for a file that is no capture or has a line that is
 * none of the above, STATUS_VERSION for one of another version, STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_NO_MEMORY.  A last line without its end, which a crash leaves, is passed over with a
 * warning. */
enum status capture_read(const char *path, struct capture_file *ret);
void capture_free(struct capture_file *file);

#endif
