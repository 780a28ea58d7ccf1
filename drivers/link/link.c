/* link.c - which link an address means, and what all of them share. */
#include "drivers/link/link.h"

#include <string.h>
#include <time.h>

#include "drivers/link/kinds.h"

/* ---- opening ------------------------------------------------------------------------ */

static const char replay[] = "replay:";

bool link_is_replay(const char *address)
{
    return strncmp(address, replay, strlen(replay)) == 0;
}

/* Only what this driver would take is offered. */
static enum driver_result fail_address(const struct link_wanted *wanted, struct driver_error *error)
{
    bool none = wanted->address[0] == '\0';
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "%s%s%s: give %s%sreplay:FILE",
                       none ? "no address" : "'", wanted->address, none ? "" : "' is no address",
                       wanted->serial != NULL ? "a serial port (/dev/ttyACM0) or " : "",
                       wanted->usb != NULL ? "usb, usb:VID:PID, usb:BUS:DEVICE or " : "");
}

static enum driver_result open_by_address(const struct link_wanted *wanted, struct link **ret,
                                          struct driver_error *error)
{
    const char *address = wanted->address;
    if (link_is_replay(address))
        return link_open_replay(address + strlen(replay), wanted, ret, error);
    if (strcmp(address, "usb") == 0 || strncmp(address, "usb:", 4) == 0) {
        if (wanted->usb == NULL)
            return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                               "'%s': this driver speaks to a serial port: give one, "
                               "/dev/ttyACM0 or a link in /dev/serial/by-id",
                               address);
        return link_open_usb(wanted, ret, error);
    }
    if (address[0] == '/') {
        if (wanted->serial == NULL)
            return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                               "'%s': this driver speaks to a USB device: give usb, usb:VID:PID "
                               "or usb:BUS:DEVICE",
                               address);
        return link_open_serial(wanted, ret, error);
    }
    return fail_address(wanted, error);
}

enum driver_result link_open(const struct driver_options *options, const struct link_wanted *wanted,
                             struct link **ret, struct driver_error *error)
{
    struct link_wanted of_it = *wanted;
    struct link *link = NULL;
    if (of_it.address == NULL)
        of_it.address = options->address != NULL ? options->address : "";
    enum driver_result r = options->wire != NULL
                               ? options->wire->open(options->wire, &of_it, &link, error)
                               : open_by_address(&of_it, &link, error);
    if (r == DRIVER_OK && options->capture != NULL)
        r = link_record(link, options->capture, &link, error);
    if (r == DRIVER_OK)
        *ret = link;
    return r;
}

enum driver_result link_wait_for_permission(const struct link_wanted *wanted, int64_t began_ms,
                                            struct driver_error *error)
{
    int64_t now_ms = call_now_ms(), until_ms = began_ms + LINK_PERMISSION_MS;
    if (until_ms > wanted->deadline_ms)
        until_ms = wanted->deadline_ms;
    if (now_ms >= until_ms)
        return driver_fail(error, DRIVER_NO_PERMISSION, NULL,
                           "no permission to open %s: whoever runs this must belong to its group "
                           "(ls -l; dialout for serial ports), or a udev rule must allow it",
                           wanted->address);
    int64_t step_ms = now_ms + LINK_PERMISSION_STEP_MS;
    if (call_wait(wanted->call, -1, step_ms < until_ms ? step_ms : until_ms) == CALL_CANCELLED)
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    return DRIVER_OK;
}

/* ---- using -------------------------------------------------------------------------- */

void link_tell(struct link *link, const char *call)
{
    if (link->ops->begin != NULL)
        link->ops->begin(link, call);
}

void link_begin(struct link *link, const char *call)
{
    call_begin(link->call);
    link_tell(link, call);
}

void link_begin_waiting(struct link *link, const char *call)
{
    call_begin_waiting(link->call);
    link_tell(link, call);
}

enum driver_result link_pause(struct link *link, int64_t until_ms, struct driver_error *error)
{
    return call_wait(link->call, -1, until_ms) == CALL_CANCELLED
               ? driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled")
               : DRIVER_OK;
}

enum driver_result link_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                             int64_t deadline_ms, struct driver_error *error)
{
    return link->ops->send(link, channel, bytes, n, deadline_ms, error);
}

enum driver_result link_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    return link->ops->receive(link, channel, bytes, size, n, deadline_ms, error);
}

enum driver_result link_drain_by_receiving(struct link *link, uint8_t channel, int quiet_ms,
                                           int64_t deadline_ms, struct driver_error *error)
{
    for (;;) {
        uint8_t bytes[4096];
        size_t n;
        struct driver_error silence;
        int64_t quiet_until_ms = call_now_ms() + quiet_ms;
        bool in_time = quiet_until_ms <= deadline_ms;
        enum driver_result r = link_receive(link, channel, bytes, sizeof bytes, &n,
                                            in_time ? quiet_until_ms : deadline_ms, &silence);
        if (r == DRIVER_TIMEOUT && in_time)
            return DRIVER_OK;
        if (r == DRIVER_TIMEOUT || (r == DRIVER_OK && call_now_ms() >= deadline_ms))
            return driver_fail(error, DRIVER_TIMEOUT, NULL,
                               "the instrument does not stop sending: switch it off and on");
        if (r != DRIVER_OK) {
            *error = silence;
            return r;
        }
    }
}

enum driver_result link_drain(struct link *link, uint8_t channel, int quiet_ms, int64_t deadline_ms,
                              struct driver_error *error)
{
    if (link->ops->drain != NULL)
        return link->ops->drain(link, channel, quiet_ms, deadline_ms, error);
    return link_drain_by_receiving(link, channel, quiet_ms, deadline_ms, error);
}

int64_t link_realtime_s(struct link *link)
{
    struct timespec now;
    if (link->ops->realtime_s != NULL)
        return link->ops->realtime_s(link);
    clock_gettime(CLOCK_REALTIME, &now);
    return now.tv_sec;
}

void link_close(struct link *link)
{
    if (link != NULL)
        link->ops->close(link);
}
