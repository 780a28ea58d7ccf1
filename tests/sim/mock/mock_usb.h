/* mock_usb.h - a simulated USB instrument plugged into this machine, for unmodified programs.
 *
 * umockdev's preload library turns a program's /sys, uevents and /dev/bus/usb to those of a
 * testbed, and its ioctls to us: what the kernel's usbfs does for libusb is done here, on the
 * kernel's terms:
 *   - transfers are taken in turn at each endpoint, and end at a short packet or when full;
 *     one that is cut keeps what has come of it
 *   - an endpoint that stalled does so until its halt is cleared
 *   - an interface is claimed by one open node (EBUSY), until that is closed
 *   - unplugging ends what is under way, the node and its sysfs folder vanish, "remove" is
 *     announced, and everything later is ENODEV
 *
 * The instrument has the interface and the endpoints of Ocean's: bulk, 01 out, 81 82 86 in.
 *
 * A program must be started by umockdev-wrapper, or be linked with the preload library first;
 * it inherits UMOCKDEV_DIR.  So must the host: without it the testbed announces nothing.  TMPDIR
 * must be shorter than 64 characters.
 *
 * plug, unplug, free and set_mode: by the thread that owns the testbed; the rest by any.
 * Testbed and sim outlive the mock. */
#ifndef SKINSPEC_TESTS_SIM_MOCK_MOCK_USB_H
#define SKINSPEC_TESTS_SIM_MOCK_MOCK_USB_H

#include <umockdev.h>

#include "tests/sim/sim.h"

/* What poll() sees of the node, by which libusb learns that there is something to fetch. */
enum mock_usb_node {
    MOCK_USB_FIFO, /* after unplugging as before: programs learn it from ENODEV */
    MOCK_USB_PTY,  /* after unplugging POLLERR and POLLHUP, as of the kernel's; needs /dev/pts */
};

struct mock_usb_place {
    unsigned bus, device; /* 1 .. 127: /dev/bus/usb/001/002 */
    bool full_speed;      /* as the sim's own option says */
    const char *serial;   /* string descriptor, at most 126 characters; NULL: there is none */
    enum mock_usb_node node;
    unsigned mode; /* of the node, 0660; 0: nobody may open it */
};

struct mock_usb;

/* Plug it in, as if power came on ("reset").  To plug it in again elsewhere, make another one:
 * programs may have the old node open still.  Ends the program where the testbed fails. */
struct mock_usb *mock_usb_plug(UMockdevTestbed *testbed, const struct sim_kind *kind,
                               struct sim *sim, const struct mock_usb_place *place);

/* Pull it out; takes one that was. */
void mock_usb_unplug(struct mock_usb *mock);

/* Pulls it out if it is in.  Best once mock_usb_clients() is 0: who has it open then still is
 * told ENOTTY.  Takes NULL. */
void mock_usb_free(struct mock_usb *mock);

/* ---- what fate does meanwhile -------------------------------------------------------- */

/* The sim's act(), between two transfers. */
bool mock_usb_act(struct mock_usb *mock, const char *action);
double mock_usb_truth(struct mock_usb *mock, double nm, bool sci);

/* The sim itself has gone (-ENODEV): to programs it has; unplug it, for the node. */
bool mock_usb_gone(struct mock_usb *mock);

/* What claiming the interface ends with, EBUSY; 0: as it should. */
void mock_usb_set_claim_error(struct mock_usb *mock, int error);
void mock_usb_set_mode(struct mock_usb *mock, unsigned mode);

/* ---- what programs did --------------------------------------------------------------- */

unsigned mock_usb_clients(struct mock_usb *mock); /* that have the node open */

struct mock_usb_counts {
    unsigned long submitted, reaped, cut; /* transfers */
    unsigned long reaps_in_vain;          /* by which one sees a program that spins */
    unsigned long claims, releases, halts_cleared;
};
struct mock_usb_counts mock_usb_counts(struct mock_usb *mock);

#endif
