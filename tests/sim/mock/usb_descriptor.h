/* usb_descriptor.h - what a simulated device says of itself on endpoint 0. */
#ifndef SKINSPEC_TESTS_SIM_MOCK_USB_DESCRIPTOR_H
#define SKINSPEC_TESTS_SIM_MOCK_USB_DESCRIPTOR_H

#include "tests/sim/mock/mock_usb.h"

enum { USB_DESCRIPTOR_MOST = 256 };

/* Device and configuration descriptor one after the other, as in sysfs; the length. */
size_t usb_descriptor_all(const struct sim_kind *kind, const struct mock_usb_place *place,
                          uint8_t bytes[USB_DESCRIPTOR_MOST]);

/* A control transfer, by its setup packet: bytes of the data stage, at most n; or -errno. */
int usb_descriptor_control(const struct sim_kind *kind, const struct mock_usb_place *place,
                           const uint8_t setup[8], uint8_t *data, size_t n);

/* Of a bulk endpoint: bytes of its largest packet; 0: there is none. */
size_t usb_descriptor_packet(const struct mock_usb_place *place, uint8_t endpoint);

#endif
