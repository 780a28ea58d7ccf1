/* xrite_rci.h - X-Rite SP60, SP62 and SP64: d/8 handhelds that give SCI and SCE with one shot.
 *
 * Their RS-232 line hangs on some USB-to-serial adaptor that says nothing about the instrument, so
 * that one is configured by hand: `/dev/ttyUSB0`, better a link in /dev/serial/by-id.
 *
 * model       the line does not tell the three apart
 * aperture    nor does it tell that: [0] 8 mm is fitted to most, [1] 4 mm is the other position of
 *             an SP64.  What is configured is taken as said, and calibrations become due with it
 * grid        400..700 nm by 10, percent with four decimals
 * averages    up to 9 readings (more would need to know whether the number is hexadecimal)
 * calibrate   the instrument's own runs on its display and ends with success or failure.
 *               zero   runs it: the display asks for the white tile and then for the black
 *                      trap, a press each; the instrument allows 120 s for each
 *               white  proves it: the white tile once more, measured, has to be white.  Tiles that
 *                      were swapped, which not every instrument notices, are found here
 *             Whether it is calibrated cannot be asked: both are due after open(), after another
 *             aperture, and when the instrument says so (<28>)
 * battery     it tells only that it is too low to measure; after a battery that died in a shot
 *             there is silence
 * status      asks for the serial number, twice: another one, or the line's settings lost, is
 *             DRIVER_GONE, because it was switched off or exchanged
 * button      wait_button() brings it to its screen "get ready" (01XD), where it stays until the
 *             next other call; a press measures, and is told when that is done.  That shot is what
 *             the next measure() returns if wait_button() was waiting when it came, less than 2 s
 *             ago, and nothing was set or calibrated since; otherwise measure() flashes.  Before
 *             calibration there is nothing to press for: the wait just passes
 * stored      samples 1 to 9 */
#ifndef SKINSPEC_DRIVERS_XRITE_RCI_XRITE_RCI_H
#define SKINSPEC_DRIVERS_XRITE_RCI_XRITE_RCI_H

#include "drivers/driver.h"

extern const struct driver xrite_rci_driver;

#endif
