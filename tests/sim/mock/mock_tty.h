/* mock_tty.h - a simulator behind a tty of umockdev: an unmodified program opens it, sets its line,
 * finds its USB parent in /sys, and loses it when it is pulled out.
 *
 * A tty is a pty; the lines of a modem, which ptys lack, are answered here (TIOCMGET, TIOCMSET,
 * TIOCMBIS, TIOCMBIC, breaks), every other ioctl is made on the client's own descriptor.
 *
 * realpath() on such a tty overruns the heap of whoever calls it (umockdev 0.17.16 takes its root
 * off a result that has none): readlink() is safe. */
#ifndef SKINSPEC_TESTS_SIM_MOCK_MOCK_TTY_H
#define SKINSPEC_TESTS_SIM_MOCK_MOCK_TTY_H

#include <stdbool.h>
#include <umockdev.h>

#include "tests/sim/sim.h"

struct mock_tty;

/* The simulator, not plugged in; NULL where its options cannot be.  Its USB parent has the option
 * `serial` for its serial number, where that is given. */
struct mock_tty *mock_tty_make(UMockdevTestbed *bed, const struct sim_kind *kind,
                               const char *options);
void mock_tty_free(struct mock_tty *tty); /* unplugs; takes NULL */

/* As /dev/NODE ("ttyACM0"), each time on another place of the bus.  false, and why on stderr, where
 * it is plugged in already, the node is taken, or the testbed's folder has too long a name. */
bool mock_tty_plug(struct mock_tty *tty, const char *node);

/* The node hangs up, then goes, with its uevents; the instrument keeps its state. */
void mock_tty_unplug(struct mock_tty *tty);

/* act() of the simulator. */
bool mock_tty_act(struct mock_tty *tty, const char *action);

#endif
