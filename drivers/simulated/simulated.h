/* simulated.h - an instrument that is not there: a handheld d/8 sphere for skin.
 *
 * It behaves as such a handheld does: zero, then white calibration before the
 * first shot and again after a while; a flash that charges; a battery that runs
 * down; SCE and SCI in one shot; a button; a memory.  What it sees is a skin
 * computed by src/optics, or the rows of a file.  All of it can fail on demand.
 * The same options give the same numbers, shot by shot.
 *
 * The address is a list of options, with or without the driver's name before it:
 * "simulated:serial=SIM-1,cm=0.03,seed=7,fault=measure:3:silence".  Nothing at all
 * is a sound instrument.  A text (a path) cannot hold a comma.
 *
 *   option            accepted                default    meaning
 *   serial            printable, up to 47     SIM-1      may be empty
 *   the skin at the port
 *   model             two-layer, half-space   two-layer  which of src/optics
 *   cm, bm, ch        0..1                    .03 .7 .01 melanin, eumelanin share, blood
 *   epidermis_mm      0..10                   0.08
 *   spectra           path                    -          play this file instead, see skin.h
 *   replicates        1..1000                 1          shots on one skin; then the next row
 *   pressure          0..1                    0          share of the blood that the last of
 *                                                        the replicates has pressed out
 *   surface           0..0.1                  0.04       SCI - SCE at 550 nm
 *   the measurement
 *   seed              0..2^53                 1          of all that is by chance
 *   noise             0..0.1                  0.0005     sd per band, as reflectance
 *   placement         0..0.2                  0.02       sd of one factor per shot: 0.008 at a
 *                                                        reflectance of 0.4, as skin repeats
 *   unit              0..0.1                  0.004      sd of what makes one serial number
 *                                                        differ from another: level and tilt
 *   drift             -0.1..0.1               0          what each shot since the calibration adds
 *                                                        to the level of the next, as a share
 *   time, in ms
 *   speed             0.1..1000, instant      1          divides all of the following
 *   shot_ms           0..60000                600
 *   charge_ms         0..60000                1000       of the flash after a shot
 *   calibrate_ms      0..60000                2000       one step
 *   slow_ms           0..600000               1500       what the fault "slow" adds
 *   its life
 *   calibration_shots    1..1000000           1000       after that many shots or minutes
 *   calibration_minutes  0..100000            480        (CLOCK_BOOTTIME) white is due again
 *   overdue           refuse, warn            refuse     what a shot does then
 *   battery           0..100                  100        percent when switched on
 *   drain             0..100                  0.05       percent per flash
 *   temperature       -40..80                 24         degrees C; trusted from 10 to 40
 *   stored            0..9999                 0          samples in its memory
 *   button_ms         0..3600000              0          pressed every so often, / speed; 0: not
 *   button_file       path                    -          pressed by `touch`, or by a byte
 *                                                        written to it where it is a FIFO
 *   fault             OPERATION:N:KIND        -          up to 8 times, see below
 *
 * A fault happens at the Nth call of open, configure, status, calibrate, measure,
 * wait_button, stored_count or stored_read; "3+" is the third and every later one.
 *
 *   at any            silence        never answers                     -> timeout
 *                     slow           answers after slow_ms more        -> ok, or timeout
 *                     gone           unplugged, and stays so           -> gone
 *                     garbage        bytes that are no answer          -> protocol
 *   open              busy, no_permission                              -> the same
 *   calibrate         swapped        black lies where white should     -> implausible
 *   calibrate         lamp           does not flash                    -> fault
 *   and measure       battery        dies under the load               -> battery
 *   measure           charge         the flash never gets ready        -> busy
 *                     weak_lamp      flashes weakly                    -> ok with a warning
 *                     expired        calibration lost under way        -> refused, white due
 *   measure and       wrong_bands    one band too few                  -> protocol
 *   stored_read       nan, all_zero                                    -> implausible
 *
 * Grids: 0 is 400..700 nm by 10, 1 is 360..740 by 10.  Apertures: 0 is 8 mm, 1 is
 * 3 mm; through the small one less of the red light that wanders in skin comes
 * back.  One count is 0.0001 of reflectance.  Another aperture makes both
 * calibrations due, another grid none: the sensor sees all bands anyway.  Codes
 * mean what they mean on the CM-700d. */
#ifndef SKINSPEC_DRIVERS_SIMULATED_SIMULATED_H
#define SKINSPEC_DRIVERS_SIMULATED_SIMULATED_H

#include "drivers/driver.h"

#define SIMULATED_RAW_UNIT 1e-4

extern const struct driver simulated_driver;

#endif
