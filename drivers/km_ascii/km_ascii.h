/* km_ascii.h - Konica Minolta CM-700d, and CM-2600d and CM-2500d: d/8 handhelds that give SCI and
 * SCE with one shot.  Addresses are those of a serial port; the instrument is found by its answer
 * to IDR, at 115200 baud and then at 9600 with RTS/CTS, and another is refused by name.
 *
 * apertures   [0] is where the slider stood at open(), [1] the other position: 8 mm (MAV), 3 mm
 *             (SAV).  configure() and measure() are DRIVER_REFUSED while it stands elsewhere.
 * averages    CM-700d 1 to 10 flashes; CM-2600d 1
 * delay       CM-700d up to 3 s, in steps of 0.1 s, rounded up; CM-2600d none
 * battery     the instruments tell three classes only: 100 is good, 15 low, 0 too low to
 *             measure
 * white step  with user_calibration (CM-700d) by USC, against the user's plate data
 * warnings    the instrument's OKnn, its state after the shot (battery, calibration
 *             recommended); of a CM-2600d what both lines of a shot say
 * clock       the CM-700d's is set to UTC at open(), for the dates of its stored samples; one
 *             that cannot be set keeps nobody from measuring
 * button      enabled by open().  The CM-2600d sends the shot that a press makes; the CM-700d is
 *             asked once a second whether there is a new one (nobody has published how it tells),
 *             so a press is seen up to a second late, and one whose 31 values are exactly those of
 *             the last is not seen.  That shot is what the next measure() returns, if
 *             wait_button() was waiting when it came, that is less than 2 s ago, and nothing was
 *             set or calibrated since; otherwise measure() flashes
 * stored      CM-700d.  A CM-2600d's are not read: of the codes that tell SCI from SCE in them
 *             there is one description, and it contradicts what CPS counts */
#ifndef SKINSPEC_DRIVERS_KM_ASCII_KM_ASCII_H
#define SKINSPEC_DRIVERS_KM_ASCII_KM_ASCII_H

#include "drivers/driver.h"

extern const struct driver km_ascii_driver;

#endif
