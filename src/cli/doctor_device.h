/* doctor_device.h - what the system sees: ttys and USB devices, by /sys, /dev and /proc alone.
 * Nothing is opened, so no instrument hears of it. */
#ifndef SKINSPEC_CLI_DOCTOR_DEVICE_H
#define SKINSPEC_CLI_DOCTOR_DEVICE_H

#include <cjson/cJSON.h>
#include <stdbool.h>
#include <stddef.h>

/* What discovery takes, from the lines of `skinspecd --drivers`: "NAME VID:PID tty ...". */
struct doctor_match {
    char driver[32], number[16]; /* "132b:*" */
    bool usb;
};
enum { DOCTOR_MATCHES = 64 };
size_t doctor_read_matches(const char *drivers, struct doctor_match matches[DOCTOR_MATCHES]);

/* An array of {"node","kind","usb","maker","product","serial","owner","group","mode","driver",
 * "by_id","problems":[{"what","do"}]}: each tty with a USB parent, and each USB device that a
 * driver takes.  "driver" is absent where none does; other members where they are not known. */
cJSON *doctor_devices(const struct doctor_match *matches, size_t n);

/* An array of {"what","do"}: programs that take hold of devices, without a rule against it. */
cJSON *doctor_disturbers(void);

#endif
