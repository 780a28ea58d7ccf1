/* toy.h - the TOY-1, which nobody makes: a d/8 handheld on a tty that gives SCE.
 *
 * It is here to show what adding an instrument takes.  Its tty has USB numbers of its own,
 * 1209:0001, so that it is found by itself.
 *
 * aperture    8 mm
 * grid        400..700 nm by 10, 0.01 %
 * calibrate   zero on the black trap, then white on the white tile; it forgets both when switched
 *             off, and CAL? tells
 * button      none; nor a battery, nor stored samples */
#ifndef SKINSPEC_DRIVERS_TOY_TOY_H
#define SKINSPEC_DRIVERS_TOY_TOY_H

#include "drivers/driver.h"

extern const struct driver toy_driver;

#endif
