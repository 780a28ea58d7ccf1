/* usb.c - bulk endpoints by libusb, one context and one transfer at a time.
 *
 * A transfer is submitted without a timeout of libusb's and waited for by poll() on libusb's
 * descriptors and the call's: the deadline or a cancellation takes it back.  Until libusb has
 * given it back its memory is libusb's: one that does not come in time is left `late`, and the
 * next transfer waits for it first.
 *
 * From top to bottom: finding the device, opening it, one transfer, the link. */
#include <errno.h>
#include <fcntl.h>
#include <libusb.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/link/kinds.h"

enum {
    REAP_MS = 100, /* for a transfer taken back: a cancel() is to be noticed within 200 ms */
    LEAST_MS = 5,  /* on the bus: a deadline that has passed still looks what is there */
};

struct transfer {
    struct libusb_transfer *usb;
    int done; /* libusb has given it back */
};

struct usb {
    struct link link;
    libusb_context *context;
    libusb_device_handle *handle;
    uint8_t interface;
    bool claimed, gone;
    struct transfer *late; /* taken back, but not given back yet; NULL */
};

/* ---- finding the device ------------------------------------------------------------- */

/* What an address asks for: 0 is any. */
struct sought {
    unsigned vid, pid, bus, device;
};

/* One to most digits at *at, which moves behind them; -1 where there are none. */
static long take_number(const char **at, int base, size_t most)
{
    static const char all[] = "0123456789abcdefABCDEF";
    char digits[8] = "";
    size_t n = strspn(*at, base == 16 ? all : "0123456789");
    if (n == 0 || n > most)
        return -1;
    memcpy(digits, *at, n);
    *at += n;
    return strtol(digits, NULL, base);
}

static bool parse_address(const char *address, struct sought *ret)
{
    if (strcmp(address, "usb") == 0) {
        *ret = (struct sought){ 0, 0, 0, 0 };
        return true;
    }
    bool by_model = strlen(address) == strlen("usb:2457:101e");
    const char *at = address + strlen("usb:"); /* which link_open() has seen */
    long first = take_number(&at, by_model ? 16 : 10, by_model ? 4 : 3);
    if (first <= 0 || *at++ != ':')
        return false;
    long second = take_number(&at, by_model ? 16 : 10, by_model ? 4 : 3);
    if (second < 0 || *at != '\0' || (!by_model && second == 0))
        return false;
    unsigned a = (unsigned)first, b = (unsigned)second;
    *ret =
        by_model ? (struct sought){ .vid = a, .pid = b } : (struct sought){ .bus = a, .device = b };
    return true;
}

static bool is_model(const struct link_usb *wanted, unsigned vid, unsigned pid)
{
    for (const struct link_usb_model *m = wanted->models; m->vid != 0; m++)
        if (m->vid == vid && m->pid == pid)
            return true;
    return false;
}

static bool is_sought(const struct sought *sought, libusb_device *device,
                      const struct libusb_device_descriptor *descriptor)
{
    return (sought->vid == 0 ||
            (sought->vid == descriptor->idVendor && sought->pid == descriptor->idProduct)) &&
           (sought->bus == 0 || (sought->bus == libusb_get_bus_number(device) &&
                                 sought->device == libusb_get_device_address(device)));
}

static void name_device(libusb_device *device, char *text, size_t size)
{
    snprintf(text, size, "usb:%03u:%03u", libusb_get_bus_number(device),
             libusb_get_device_address(device));
}

static enum driver_result fail_two(libusb_device *one, libusb_device *other, const char *address,
                                   struct driver_error *error)
{
    char a[32], b[32];
    name_device(one, a, sizeof a);
    name_device(other, b, sizeof b);
    return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                       "two instruments match '%s': give the address of one, %s or %s", address, a,
                       b);
}

/* The one device of the list that is sought, and of a model that may be opened. */
static enum driver_result pick_device(const struct link_wanted *wanted, libusb_device **list,
                                      libusb_device **ret, struct driver_error *error)
{
    struct sought sought;
    libusb_device *found = NULL;
    uint16_t pid = 0;
    if (!parse_address(wanted->address, &sought))
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "'%s' is no address: give usb, usb:VID:PID (four hex digits each) or "
                           "usb:BUS:DEVICE",
                           wanted->address);
    if (sought.vid != 0 && !is_model(wanted->usb, sought.vid, sought.pid))
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "%04x:%04x is no instrument of this driver", sought.vid, sought.pid);
    for (; *list != NULL; list++) {
        struct libusb_device_descriptor d;
        if (libusb_get_device_descriptor(*list, &d) != 0 || !is_sought(&sought, *list, &d))
            continue;
        bool may_open = is_model(wanted->usb, d.idVendor, d.idProduct);
        if (!may_open && sought.bus != 0)
            return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                               "%s is %04x:%04x, which is no instrument of this driver",
                               wanted->address, d.idVendor, d.idProduct);
        if (may_open && found != NULL)
            return fail_two(found, *list, wanted->address, error);
        if (may_open) {
            found = *list;
            pid = d.idProduct;
        }
    }
    if (found == NULL)
        return driver_fail(error, DRIVER_GONE, NULL,
                           "no instrument at '%s': connect it and switch it on; lsusb shows what "
                           "is connected",
                           wanted->address);
    if (wanted->usb->pid != NULL)
        *wanted->usb->pid = pid;
    *ret = found;
    return DRIVER_OK;
}

/* ---- opening it --------------------------------------------------------------------- */

/* libusb calls EPERM, which a device cgroup gives, an error like any other. */
static bool is_permission(libusb_device *device, int failed)
{
    char node[64];
    if (failed != LIBUSB_ERROR_IO)
        return failed == LIBUSB_ERROR_ACCESS;
    snprintf(node, sizeof node, "/dev/bus/usb/%03u/%03u", libusb_get_bus_number(device),
             libusb_get_device_address(device));
    int fd = open(node, O_RDWR | O_CLOEXEC);
    bool denied = fd < 0 && (errno == EPERM || errno == EACCES);
    if (fd >= 0)
        close(fd);
    return denied;
}

static enum driver_result fail_usb(struct usb *usb, int failed, const char *what,
                                   struct driver_error *error)
{
    switch (failed) {
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_IO: /* of the bus: unplugged, and the kernel has not heard of it yet */
        usb->gone = true;
        return driver_fail(error, DRIVER_GONE, NULL,
                           "the instrument is gone (%s: %s): connect it again", what,
                           libusb_error_name(failed));
    case LIBUSB_ERROR_BUSY:
        return driver_fail(error, DRIVER_BUSY, NULL,
                           "another program holds the instrument (%s): close that one first", what);
    case LIBUSB_ERROR_NOT_FOUND:
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "this device has no such interface (%s): is it the right driver?", what);
    default:
        return driver_fail(error, DRIVER_FAULT, NULL, "%s: %s", what, libusb_error_name(failed));
    }
}

static enum driver_result open_device(struct usb *usb, libusb_device *device,
                                      const struct link_wanted *wanted, struct driver_error *error)
{
    int64_t began_ms = call_now_ms();
    int failed;
    while ((failed = libusb_open(device, &usb->handle)) != 0) {
        usb->handle = NULL;
        enum driver_result r = is_permission(device, failed)
                                   ? link_wait_for_permission(wanted, began_ms, error)
                                   : fail_usb(usb, failed, "open", error);
        if (r != DRIVER_OK)
            return r;
    }
    failed = libusb_claim_interface(usb->handle, usb->interface);
    if (failed != 0)
        return fail_usb(usb, failed, "claim", error);
    usb->claimed = true;
    return DRIVER_OK;
}

static enum driver_result find_and_open(struct usb *usb, const struct link_wanted *wanted,
                                        struct driver_error *error)
{
    libusb_device **list, *device = NULL;
    ssize_t n = libusb_get_device_list(usb->context, &list);
    if (n < 0)
        return fail_usb(usb, (int)n, "list of devices", error);
    enum driver_result r = pick_device(wanted, list, &device, error);
    if (r == DRIVER_OK)
        r = open_device(usb, device, wanted, error);
    libusb_free_device_list(list, 1);
    return r;
}

/* ---- one transfer ------------------------------------------------------------------- */

static void LIBUSB_CALL given_back(struct libusb_transfer *of)
{
    *(int *)of->user_data = 1;
}

static void free_transfer(struct transfer *transfer)
{
    if (transfer == NULL)
        return;
    if (transfer->usb != NULL)
        free(transfer->usb->buffer);
    libusb_free_transfer(transfer->usb);
    free(transfer);
}

/* With a zeroed buffer of n bytes. */
static struct transfer *make_transfer(struct usb *usb, uint8_t endpoint, size_t n)
{
    struct transfer *transfer = calloc(1, sizeof *transfer);
    unsigned char *buffer = calloc(1, n > 0 ? n : 1);
    if (transfer != NULL)
        transfer->usb = libusb_alloc_transfer(0);
    if (transfer == NULL || buffer == NULL || transfer->usb == NULL) {
        free(buffer);
        free_transfer(transfer);
        return NULL;
    }
    libusb_fill_bulk_transfer(transfer->usb, usb->handle, endpoint, buffer, (int)n, given_back,
                              &transfer->done, 0);
    return transfer;
}

/* Let libusb do what it can without waiting. */
static void handle_events(struct usb *usb, struct transfer *transfer)
{
    struct timeval none = { 0, 0 };
    (void)libusb_handle_events_timeout_completed(usb->context, &none, &transfer->done);
}

static size_t fill_fds(struct usb *usb, struct pollfd fds[CALL_MAX_FDS])
{
    size_t n = 0;
    const struct libusb_pollfd **list = libusb_get_pollfds(usb->context);
    for (size_t i = 0; list != NULL && list[i] != NULL && n < CALL_MAX_FDS; i++)
        fds[n++] = (struct pollfd){ .fd = list[i]->fd, .events = list[i]->events };
    libusb_free_pollfds(list);
    return n;
}

/* Until the transfer is given back, the deadline or a cancellation. */
static enum call_end_of_wait wait_for(struct usb *usb, struct call *call, struct transfer *transfer,
                                      int64_t deadline_ms)
{
    enum call_end_of_wait end = CALL_READABLE;
    handle_events(usb, transfer);
    while (!transfer->done && end == CALL_READABLE) {
        struct pollfd fds[CALL_MAX_FDS];
        size_t n = fill_fds(usb, fds);
        end = call_wait_any(call, fds, n, deadline_ms);
        handle_events(usb, transfer);
    }
    return transfer->done ? CALL_READABLE : end;
}

/* Wait for what was taken back, which no cancellation may shorten. */
static bool reap(struct usb *usb, struct transfer *transfer, int64_t deadline_ms)
{
    struct call none = { .cancelled_fd = -1, .cancelled = false };
    return wait_for(usb, &none, transfer, deadline_ms) == CALL_READABLE;
}

/* The transfer before this one, if it was left. */
static enum driver_result reap_late(struct usb *usb, int64_t deadline_ms,
                                    struct driver_error *error)
{
    int64_t least_ms = call_now_ms() + REAP_MS;
    if (usb->late == NULL)
        return DRIVER_OK;
    if (!reap(usb, usb->late, deadline_ms > least_ms ? deadline_ms : least_ms)) {
        usb->gone = true;
        return driver_fail(error, DRIVER_GONE, NULL,
                           "the system does not give a transfer back: connect the instrument "
                           "again");
    }
    free_transfer(usb->late);
    usb->late = NULL;
    return DRIVER_OK;
}

/* How it ended, of one that was given back. */
static enum driver_result judge(struct usb *usb, const struct transfer *transfer,
                                enum call_end_of_wait end, struct driver_error *error)
{
    const struct libusb_transfer *of = transfer->usb;
    bool in = (of->endpoint & LIBUSB_ENDPOINT_IN) != 0;
    switch (of->status) {
    case LIBUSB_TRANSFER_COMPLETED:
        if (in || of->actual_length == of->length)
            return DRIVER_OK;
        return driver_fail(error, DRIVER_PROTOCOL, NULL, "the instrument took %d of %d bytes",
                           of->actual_length, of->length);
    case LIBUSB_TRANSFER_CANCELLED:
    case LIBUSB_TRANSFER_TIMED_OUT:
        if (end == CALL_CANCELLED)
            return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
        if (in && of->actual_length > 0)
            return DRIVER_OK;
        return driver_fail(error, DRIVER_TIMEOUT, NULL, "%s: is the instrument on and connected?",
                           in ? "nothing came" : "the instrument takes no bytes");
    case LIBUSB_TRANSFER_STALL:
    case LIBUSB_TRANSFER_OVERFLOW: {
        int failed = libusb_clear_halt(usb->handle, of->endpoint);
        if (failed != 0)
            return fail_usb(usb, failed, "clear halt", error);
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           of->status == LIBUSB_TRANSFER_STALL
                               ? "the instrument refuses on endpoint %02x: is it the right driver?"
                               : "the instrument sent more than was asked for on endpoint %02x",
                           of->endpoint);
    }
    case LIBUSB_TRANSFER_NO_DEVICE:
        return fail_usb(usb, LIBUSB_ERROR_NO_DEVICE, "transfer", error);
    default: /* LIBUSB_TRANSFER_ERROR */
        return fail_usb(usb, LIBUSB_ERROR_IO, "transfer", error);
    }
}

/* Submit, wait, take back where it has to be; *transfer becomes NULL where it is left late. */
static enum driver_result run(struct usb *usb, struct transfer **transfer, int64_t deadline_ms,
                              struct driver_error *error)
{
    int64_t least_ms = call_now_ms() + LEAST_MS;
    int failed = libusb_submit_transfer((*transfer)->usb);
    if (failed != 0)
        return fail_usb(usb, failed, "submit", error);
    enum call_end_of_wait end =
        wait_for(usb, usb->link.call, *transfer, deadline_ms > least_ms ? deadline_ms : least_ms);
    if (end == CALL_READABLE)
        return judge(usb, *transfer, end, error);
    (void)libusb_cancel_transfer((*transfer)->usb); /* fails where it has just ended */
    if (reap(usb, *transfer, call_now_ms() + REAP_MS))
        return judge(usb, *transfer, end, error);
    usb->late = *transfer;
    *transfer = NULL;
    return end == CALL_CANCELLED
               ? driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled")
               : driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing came, and the transfer stays");
}

/* ---- the link ----------------------------------------------------------------------- */

/* out or in is NULL. */
static enum driver_result transfer_bulk(struct usb *usb, uint8_t endpoint, const void *out,
                                        void *in, size_t size, size_t *n, int64_t deadline_ms,
                                        struct driver_error *error)
{
    if (usb->gone)
        return driver_fail(error, DRIVER_GONE, NULL, "the instrument is gone: connect it again");
    if (call_wait(usb->link.call, -1, 0) == CALL_CANCELLED)
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    enum driver_result r = reap_late(usb, deadline_ms, error);
    if (r != DRIVER_OK)
        return r;
    struct transfer *transfer = make_transfer(usb, endpoint, size);
    if (transfer == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    if (out != NULL && size > 0)
        memcpy(transfer->usb->buffer, out, size);
    r = run(usb, &transfer, deadline_ms, error);
    if (r == DRIVER_OK && in != NULL && transfer != NULL) { /* NULL: late, and not OK */
        *n = (size_t)transfer->usb->actual_length;
        memcpy(in, transfer->usb->buffer, *n);
    }
    free_transfer(transfer);
    return r;
}

static enum driver_result usb_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                                   int64_t deadline_ms, struct driver_error *error)
{
    return transfer_bulk((struct usb *)link, channel, bytes, NULL, n, NULL, deadline_ms, error);
}

static enum driver_result usb_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                      size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    return transfer_bulk((struct usb *)link, channel, NULL, bytes, size, n, deadline_ms, error);
}

/* A late transfer is free to go once its device is closed: the system has no way to it then. */
static void usb_close(struct link *link)
{
    struct usb *usb = (struct usb *)link;
    if (usb->late != NULL)
        (void)reap(usb, usb->late, call_now_ms() + REAP_MS);
    if (usb->claimed)
        libusb_release_interface(usb->handle, usb->interface);
    if (usb->handle != NULL)
        libusb_close(usb->handle);
    free_transfer(usb->late);
    libusb_exit(usb->context);
    free(usb);
}

static const struct link_ops usb_ops = {
    .kind = "usb",
    .send = usb_send,
    .receive = usb_receive,
    .drain = link_drain_by_receiving,
    .close = usb_close,
};

enum driver_result link_open_usb(const struct link_wanted *wanted, struct link **ret,
                                 struct driver_error *error)
{
    struct usb *usb = calloc(1, sizeof *usb);
    if (usb == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    usb->link = (struct link){ &usb_ops, wanted->call };
    usb->interface = wanted->usb->interface;
    int failed = libusb_init(&usb->context);
    if (failed != 0) {
        free(usb);
        return driver_fail(error, DRIVER_FAULT, NULL, "USB cannot be used: %s",
                           libusb_error_name(failed));
    }
    enum driver_result r = find_and_open(usb, wanted, error);
    if (r != DRIVER_OK) {
        usb_close(&usb->link);
        return r;
    }
    *ret = &usb->link;
    return DRIVER_OK;
}
