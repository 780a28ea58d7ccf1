/* discovery.h - instruments that are plugged in and pulled out, by udev.
 *
 * Taken are devices that a driver's matches name: a USB device of that maker and product,
 * or a tty whose USB parent is one.  Nothing is opened here, and no other tty is ever
 * touched.  On the loop's thread. */
#ifndef SKINSPEC_STATION_DISCOVERY_H
#define SKINSPEC_STATION_DISCOVERY_H

#include <systemd/sd-event.h>

#include "base/status.h"
#include "drivers/driver.h"

enum { DISCOVERY_ADDRESS_SIZE = 64 };

struct discovery_events {
    /* There is one: "/dev/ttyACM0" or "usb:001:005" for this driver.  Those that are there at
     * the start are told before discovery_open() returns. */
    void (*appeared)(void *context, const struct driver *driver, const char *address);
    void (*vanished)(void *context, const char *address); /* each that appeared, once */
    /* Some tty or USB device has come: whoever waits for one need not wait longer. */
    void (*something_came)(void *context);
    /* Some tty or USB device was pulled out: whoever has one looks whether it was that. */
    void (*something_went)(void *context);
    void *context;
};

struct discovery;

/* drivers: ends with NULL; its matches outlive it.  Where there is no udev (a container)
 * the kernel's own messages are used.  Logged.  STATUS_IO, STATUS_NO_MEMORY. */
enum status discovery_open(sd_event *event, const struct driver *const *drivers,
                           const struct discovery_events *events, struct discovery **ret);
void discovery_close(struct discovery *discovery); /* takes NULL; nothing is told */

#endif
