/* usb_node.h - the file that stands for a USB device, of which poll() says when there is
 * something to fetch.
 *
 * umockdev would make a plain file, always ready: libusb would spin.  So it is a FIFO, full
 * or empty, or a terminal whose output is held or not. */
#ifndef SKINSPEC_TESTS_SIM_MOCK_USB_NODE_H
#define SKINSPEC_TESTS_SIM_MOCK_USB_NODE_H

#include <stdbool.h>

#include "tests/sim/mock/mock_usb.h"

struct usb_node {
    enum mock_usb_node kind;
    char path[512]; /* below the testbed's root */
    int fifo, master, slave;
    bool ready;
};

/* Make it, not ready.  Ends the program where it cannot. */
void usb_node_make(struct usb_node *node, const char *path, enum mock_usb_node kind, unsigned mode);
void usb_node_set_mode(struct usb_node *node, unsigned mode);
void usb_node_set_ready(struct usb_node *node, bool ready);

/* The path vanishes; who has it open still sees whether it is ready, or on a terminal that the
 * other end has hung up. */
void usb_node_unlink(struct usb_node *node);
void usb_node_close(struct usb_node *node);

#endif
