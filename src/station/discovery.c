/* discovery.c - udev's list of devices at the start, and its messages from then on. */
#include "station/discovery.h"

#include <libudev.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

#include "base/log.h"

struct found {
    struct found *next;
    char *syspath; /* what udev knows it by, also when it is gone */
    char address[DISCOVERY_ADDRESS_SIZE];
};

struct discovery {
    const struct driver *const *drivers;
    struct discovery_events events;
    struct udev *udev;
    struct udev_monitor *monitor;
    sd_event_source *source;
    struct found *found;
};

/* ---- which driver's ----------------------------------------------------------------- */

/* A number of sysfs in hexadecimal, "132b"; 0 where there is none. */
static unsigned hex_attribute(struct udev_device *device, const char *name)
{
    const char *text = udev_device_get_sysattr_value(device, name);
    return text != NULL ? (unsigned)strtoul(text, NULL, 16) & 0xffff : 0;
}

static const struct driver *driver_of(const struct discovery *d, struct udev_device *usb, int bus)
{
    unsigned vid = hex_attribute(usb, "idVendor"), pid = hex_attribute(usb, "idProduct");
    for (size_t i = 0; vid != 0 && d->drivers[i] != NULL; i++)
        for (const struct driver_match *m = d->drivers[i]->matches; m != NULL && m->vid != 0; m++)
            if ((int)m->bus == bus && m->vid == vid && (m->pid == 0 || m->pid == pid))
                return d->drivers[i];
    return NULL;
}

static bool is_usb_device(struct udev_device *device)
{
    const char *subsystem = udev_device_get_subsystem(device);
    const char *type = udev_device_get_devtype(device);
    return subsystem != NULL && strcmp(subsystem, "usb") == 0 && type != NULL &&
           strcmp(type, "usb_device") == 0;
}

static bool is_tty(struct udev_device *device)
{
    const char *subsystem = udev_device_get_subsystem(device);
    return subsystem != NULL && strcmp(subsystem, "tty") == 0;
}

/* The driver it is for, and its address; NULL: none of ours. */
static const struct driver *identify(const struct discovery *d, struct udev_device *device,
                                     char address[DISCOVERY_ADDRESS_SIZE])
{
    if (is_usb_device(device)) {
        const char *bus = udev_device_get_sysattr_value(device, "busnum");
        const char *number = udev_device_get_sysattr_value(device, "devnum");
        if (bus == NULL || number == NULL)
            return NULL;
        snprintf(address, DISCOVERY_ADDRESS_SIZE, "usb:%03lu:%03lu", strtoul(bus, NULL, 10) % 1000,
                 strtoul(number, NULL, 10) % 1000);
        return driver_of(d, device, DRIVER_BUS_USB);
    }
    const char *node = udev_device_get_devnode(device);
    struct udev_device *usb =
        is_tty(device) ? udev_device_get_parent_with_subsystem_devtype(device, "usb", "usb_device")
                       : NULL;
    if (usb == NULL || node == NULL || strlen(node) >= DISCOVERY_ADDRESS_SIZE)
        return NULL;
    strcpy(address, node);
    return driver_of(d, usb, DRIVER_BUS_TTY);
}

/* ---- what there is ------------------------------------------------------------------ */

static struct found **find(struct discovery *d, const char *syspath)
{
    struct found **at = &d->found;
    while (*at != NULL && strcmp((*at)->syspath, syspath) != 0)
        at = &(*at)->next;
    return at;
}

static void free_found(struct found *found)
{
    free(found->syspath);
    free(found);
}

static void vanish(struct discovery *d, struct found **at)
{
    struct found *found = *at;
    *at = found->next;
    d->events.vanished(d->events.context, found->address);
    free_found(found);
}

/* udev tells of one device several times: added, bound to its kernel driver, changed. */
static void appear(struct discovery *d, struct udev_device *device)
{
    char address[DISCOVERY_ADDRESS_SIZE];
    const char *syspath = udev_device_get_syspath(device);
    const struct driver *driver = identify(d, device, address);
    if (driver == NULL || syspath == NULL)
        return;
    struct found **at = find(d, syspath);
    if (*at != NULL && strcmp((*at)->address, address) == 0)
        return;
    if (*at != NULL) /* its going was missed */
        vanish(d, at);
    struct found *found = calloc(1, sizeof *found);
    if (found != NULL)
        found->syspath = strdup(syspath);
    if (found == NULL || found->syspath == NULL) {
        free(found);
        log_error("discovery: not enough memory for the instrument at %s", address);
        return;
    }
    strcpy(found->address, address);
    found->next = d->found;
    d->found = found;
    d->events.appeared(d->events.context, driver, address);
}

static void take_message(struct discovery *d, struct udev_device *device)
{
    const char *action = udev_device_get_action(device), *syspath = udev_device_get_syspath(device);
    if (action == NULL || syspath == NULL)
        return;
    if (strcmp(action, "remove") == 0) {
        struct found **at = find(d, syspath);
        if (*at != NULL)
            vanish(d, at);
        if (is_tty(device) || is_usb_device(device))
            d->events.something_went(d->events.context);
        return;
    }
    appear(d, device);
    if (is_tty(device) || is_usb_device(device))
        d->events.something_came(d->events.context);
}

static int on_message(sd_event_source *source, int fd, uint32_t events, void *userdata)
{
    struct discovery *d = userdata;
    struct udev_device *device;
    (void)source;
    (void)fd;
    (void)events;
    while ((device = udev_monitor_receive_device(d->monitor)) != NULL) {
        take_message(d, device);
        udev_device_unref(device);
    }
    return 0;
}

/* ---- life --------------------------------------------------------------------------- */

static enum status list_devices(struct discovery *d)
{
    struct udev_list_entry *entry;
    if (d->drivers[0] == NULL)
        return STATUS_OK; /* none of them would be taken */
    struct udev_enumerate *list = udev_enumerate_new(d->udev);
    if (list == NULL)
        return STATUS_NO_MEMORY;
    enum status s = STATUS_OK;
    if (udev_enumerate_add_match_subsystem(list, "tty") < 0 ||
        udev_enumerate_add_match_subsystem(list, "usb") < 0 ||
        udev_enumerate_scan_devices(list) < 0)
        s = STATUS_IO;
    udev_list_entry_foreach(entry, udev_enumerate_get_list_entry(list))
    {
        const char *syspath = udev_list_entry_get_name(entry);
        struct udev_device *device = udev_device_new_from_syspath(d->udev, syspath);
        if (device != NULL) /* it may have gone since */
            appear(d, device);
        udev_device_unref(device);
    }
    udev_enumerate_unref(list);
    return s;
}

/* udev's messages come when it has set the node's mode; without it only the kernel speaks. */
static enum status listen(struct discovery *d, sd_event *event)
{
    const char *speaker = access("/run/udev/control", F_OK) == 0 ? "udev" : "kernel";
    d->monitor = udev_monitor_new_from_netlink(d->udev, speaker);
    if (d->monitor == NULL)
        return STATUS_IO;
    if (udev_monitor_filter_add_match_subsystem_devtype(d->monitor, "tty", NULL) < 0 ||
        udev_monitor_filter_add_match_subsystem_devtype(d->monitor, "usb", "usb_device") < 0 ||
        udev_monitor_enable_receiving(d->monitor) < 0)
        return STATUS_IO;
    if (sd_event_add_io(event, &d->source, udev_monitor_get_fd(d->monitor), EPOLLIN, on_message,
                        d) < 0)
        return STATUS_NO_MEMORY;
    return STATUS_OK;
}

enum status discovery_open(sd_event *event, const struct driver *const *drivers,
                           const struct discovery_events *events, struct discovery **ret)
{
    struct discovery *d = calloc(1, sizeof *d);
    if (d == NULL)
        return STATUS_NO_MEMORY;
    d->drivers = drivers;
    d->events = *events;
    d->udev = udev_new();
    enum status s = d->udev != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = listen(d, event); /* before the list: what comes in between is in both */
    if (s == STATUS_OK)
        s = list_devices(d);
    if (s != STATUS_OK) {
        log_error("discovery: cannot watch for instruments by udev: %s", status_text(s));
        discovery_close(d);
        return s;
    }
    *ret = d;
    return STATUS_OK;
}

void discovery_close(struct discovery *d)
{
    if (d == NULL)
        return;
    sd_event_source_disable_unref(d->source);
    udev_monitor_unref(d->monitor);
    udev_unref(d->udev);
    while (d->found != NULL) {
        struct found *next = d->found->next;
        free_found(d->found);
        d->found = next;
    }
    free(d);
}
