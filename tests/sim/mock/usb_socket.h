/* usb_socket.h - a simulated USB instrument that can be plugged in again and again: each time
 * at an address of its own, as a new mock_usb of the same simulator. */
#ifndef SKINSPEC_TESTS_SIM_MOCK_USB_SOCKET_H
#define SKINSPEC_TESTS_SIM_MOCK_USB_SOCKET_H

#include <umockdev.h>

#include "tests/sim/sim.h"

struct usb_socket;

/* NULL, and why on stderr, for options that cannot be. */
struct usb_socket *usb_socket_make(UMockdevTestbed *bed, const struct sim_kind *kind,
                                   const char *options);

/* place: "BUS/DEVICE", 001/005, or on a pty instead of a FIFO (mock_usb.h) 001/005/pty. */
bool usb_socket_plug(struct usb_socket *socket, const char *place);
void usb_socket_unplug(struct usb_socket *socket);
bool usb_socket_act(struct usb_socket *socket, const char *action);
void usb_socket_free(struct usb_socket *socket);

#endif
