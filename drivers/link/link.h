/* link.h - bytes to and from one instrument, whatever the wire.
 *
 * A driver has two layers: its dialect (NAME_wire.[ch], bytes <-> values, pure) and the
 * conversation (NAME.c), which sends and receives over a link.  The links:
 *
 *   serial   a tty, by libserialport           usb      bulk endpoints, by libusb
 *   replay   a capture instead of an instrument
 *   record   another link, every byte both ways written to a capture
 *   fault    another link, and what can go wrong on a wire, at a stated byte
 *
 * The instrument's thread owns its link and uses it from nowhere else.  All waiting goes
 * through the driver's struct call, so that its cancel() ends it; deadlines are those of
 * call_now_ms().  As in driver.h, a function that does not return DRIVER_OK has filled
 * *error and left its other outputs untouched. */
#ifndef SKINSPEC_DRIVERS_LINK_LINK_H
#define SKINSPEC_DRIVERS_LINK_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/call.h"
#include "drivers/driver.h"

struct link;

/* A channel is an endpoint's address on USB (0x01 out, 0x81 in), LINK_SERIAL on a line. */
enum { LINK_SERIAL = 0 };

struct link_ops {
    const char *kind; /* "serial", "usb", ... */

    /* All n bytes, or an error: how many of them went is not known then. */
    enum driver_result (*send)(struct link *link, uint8_t channel, const void *bytes, size_t n,
                               int64_t deadline_ms, struct driver_error *error);

    /* Wait for bytes: a line gives what is there, 1 to size of them, usb one transfer of at
     * most size, which a short packet ends (*n may be 0) and the deadline may cut: what came is
     * given (a deadline that has passed gives the bus 5 ms).
     * DRIVER_TIMEOUT where nothing came; DRIVER_GONE within 100 ms of the unplugging;
     * DRIVER_PROTOCOL where the device stalls or sends more than size: the endpoint is
     * ready again. */
    enum driver_result (*receive)(struct link *link, uint8_t channel, void *bytes, size_t size,
                                  size_t *n, int64_t deadline_ms, struct driver_error *error);

    /* Throw away what comes on the channel until it was quiet for quiet_ms: the way back
     * into step.  DRIVER_TIMEOUT where it does not become quiet before the deadline.  NULL:
     * link_drain() receives. */
    enum driver_result (*drain)(struct link *link, uint8_t channel, int quiet_ms,
                                int64_t deadline_ms, struct driver_error *error);

    /* A function of the driver begins, "measure", "calibrate zero"; NULL: of no interest.
     * A capture is made of such calls, and is replayed by them. */
    void (*begin)(struct link *link, const char *call);

    /* Seconds since 1970 for an instrument's clock; NULL: the system's.  A replay gives the
     * time of the capture, so that the bytes are the same. */
    int64_t (*realtime_s)(struct link *link);

    void (*close)(struct link *link);
};

/* Each link begins with this. */
struct link {
    const struct link_ops *ops;
    struct call *call; /* of the driver; outlives the link */
};

/* ---- opening ------------------------------------------------------------------------ */

/* 8N1 always. */
struct link_serial {
    unsigned baud;
    bool rts_cts;
};

struct link_usb_model {
    uint16_t vid, pid;
};

struct link_usb {
    const struct link_usb_model *models; /* ends with vid 0: what else may not be opened */
    uint8_t interface;
    uint16_t *pid; /* which of the models it was; untouched where the link cannot tell.  NULL */
};

/* What a driver asks for. */
struct link_wanted {
    /* "/dev/ttyACM0", or a link in /dev/serial/by-id; "usb:001:005", bus and device; "usb" or
     * "usb:2457:101e", the only such instrument there is; "replay:FILE".  driver_options. */
    const char *address;
    struct call *call;
    const struct link_serial *serial; /* NULL: the driver speaks no serial line */
    const struct link_usb *usb;       /* NULL: nor USB */
    int64_t deadline_ms;
};

/* Where links come from, if not from the address: tests connect a simulator or a fault. */
struct link_source {
    enum driver_result (*open)(const struct link_source *source, const struct link_wanted *wanted,
                               struct link **ret, struct driver_error *error);
};

/* Open what wanted->address (NULL: options->address) names, or what options->wire gives, with
 * options->capture (if any) written to.
 *
 * A port is held alone, else DRIVER_BUSY: TIOCEXCL, which root is not held up by, and an flock() on
 * the tty itself, which ends with its process and needs no folder that can be written; the
 * lock files of others in /run/lock are respected.  RTS and DTR are raised.  EACCES and EPERM are
 * tried again for 2 s, as udev may not have set the mode yet, then DRIVER_NO_PERMISSION;
 * DRIVER_GONE where there is no such port; DRIVER_UNSUPPORTED for one that is no tty, another
 * model, an address of another kind, or one that two match.  The text says what to do. */
enum driver_result link_open(const struct driver_options *options, const struct link_wanted *wanted,
                             struct link **ret, struct driver_error *error);

/* Whether the address is a capture's, "replay:FILE": there is nobody at its button but the
 * capture, and it says when. */
bool link_is_replay(const char *address);

/* ---- using -------------------------------------------------------------------------- */

/* How each function of a driver that talks begins: call_begin() and ops->begin(). */
void link_begin(struct link *link, const char *call);
void link_begin_waiting(struct link *link, const char *call); /* call_begin_waiting() */

/* A call that begins out of step says where its way back into step begins (LINK_WAY_BACK), and
 * where it ends: by its own name again.  A replay that is in step leaves it out. */
#define LINK_WAY_BACK "way back"
void link_tell(struct link *link, const char *call);

/* Wait without listening; DRIVER_CANCELLED where the call is cancelled by then.  A time in the
 * past: just look. */
enum driver_result link_pause(struct link *link, int64_t until_ms, struct driver_error *error);

enum driver_result link_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                             int64_t deadline_ms, struct driver_error *error);
enum driver_result link_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                size_t *n, int64_t deadline_ms, struct driver_error *error);
enum driver_result link_drain(struct link *link, uint8_t channel, int quiet_ms, int64_t deadline_ms,
                              struct driver_error *error);

/* Whoever sends an instrument the time asks here, and once for each sending: a record keeps the
 * answer for its replay. */
int64_t link_realtime_s(struct link *link);
void link_close(struct link *link); /* takes NULL */

#endif
