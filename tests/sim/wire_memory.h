/* wire_memory.h - a simulator and a driver inside one program, in real time.
 *
 * wire_memory_source() goes into driver_options.wire (or a fixture's wire()).  The wire is
 * held alone: a second link on it is DRIVER_BUSY.  Everything here may be called while a
 * driver waits on its own thread. */
#ifndef SKINSPEC_TESTS_SIM_WIRE_MEMORY_H
#define SKINSPEC_TESTS_SIM_WIRE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/link/link.h"
#include "tests/sim/sim.h"

struct wire_memory;

/* The simulator made with these options; NULL where they cannot be or memory is short. */
struct wire_memory *wire_memory_make(const struct sim_kind *kind, const char *options);
void wire_memory_free(struct wire_memory *wire); /* every link is closed; takes NULL */

const struct link_source *wire_memory_source(struct wire_memory *wire);

/* act() and truth() of the simulator. */
bool wire_memory_act(struct wire_memory *wire, const char *action);
double wire_memory_truth(struct wire_memory *wire, double nm, bool sci);

/* Links find the instrument gone (DRIVER_GONE), at once if they wait, until they are closed and
 * it is plugged again; then it is as it was left, but what it sent meanwhile is lost. */
void wire_memory_unplug(struct wire_memory *wire);
void wire_memory_plug(struct wire_memory *wire);

/* Unplugged as soon as the host has sent `sends` times more (1: the next time), and n bytes of
 * what comes back then were received: 0 between command and reply, else in mid-frame. */
void wire_memory_unplug_at(struct wire_memory *wire, unsigned sends, size_t n);

/* On a line: of what comes back after each send, and of each line, the bytes behind the first k
 * come ms later.  ms 0: no longer. */
void wire_memory_split(struct wire_memory *wire, size_t k, int ms);

/* How often the host has sent, and whether a link is open. */
unsigned wire_memory_sends(struct wire_memory *wire);
bool wire_memory_is_open(struct wire_memory *wire);

#endif
