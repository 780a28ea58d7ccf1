/* sim_toy.h - a TOY-1 on a tty, from the description in its drivers/toy/captures alone.
 *
 * Options beside serial, delays, seed and lightness (65): helped=1, somebody places what a
 * calibration wants.  Actions: those of tests/sim/handheld.h and faults.h, and "reset". */
#ifndef SKINSPEC_DRIVERS_TOY_TESTS_SIM_TOY_H
#define SKINSPEC_DRIVERS_TOY_TESTS_SIM_TOY_H

#include "tests/sim/sim.h"

extern const struct sim_kind sim_toy;

#endif
