/* ocean.h - an Ocean Optics spectrometer with lamp and sphere, as its host sees it.
 *
 *   kind     instrument            pixels  full scale  integration time, us
 *   usb2000  USB2000+, Flame-S       2048       65535      1000 .. 65 535 000
 *   usb4000  USB4000, Flame-T        3840       65535        10 .. 65 535 000
 *   hr2000   HR2000+                 2048       16383      1000 .. 65 535 000
 *   hr4000   HR4000                  3840       16383        10 .. 65 535 000
 *
 * After the makers' data sheets of USB2000+ and USB4000 and after what others found out by
 * driving them.  What no description says was chosen, and is marked so:
 *   - the counts that the non-linearity corrects are those after scaling to full scale
 *   - 01 stops what is being exposed, but what lies in an endpoint stays there
 *   - a request during a request waits its turn
 *   - a register of the FPGA that was never written is 0, but for the version
 *
 * Options, all numbers:
 *   serial=TEXT      of slot 0 (SIM00042)
 *   speed=high|full  of USB (high)
 *   flame=0|1        the FPGA's version is that of a Flame (0)
 *   delays=X         factor on every time it takes; 0: none (1)
 *   seed=N           of noise and fixed pattern (1)
 *   noise=X          factor on the noise of a real one, 0: none (1)
 *   lightness=L      of the skin, L* roughly (62)
 *   under=WHAT       what lies under the port first: white black skin (white)
 *   lamp=X           factor on the lamp's light (1)
 *   line=0|1         0: the lamp is not switched by the lamp line, but always on (1)
 *   drift=X          percent that the lamp's light rises in a minute; it stays after ten (0)
 *   substitution=F   share of the sphere that the port is: what lies there changes the light
 *                    in the whole sphere, at each wavelength by its reflectance there;
 *                    0 .. 0.3 (0)
 *   level=N          saturation level of slot 17; 0: none is set (60000; 14 bits: 0)
 *   temperature=C    of the board (31.5)
 *
 * Actions: "place white|black|skin", "place grey PERCENT", "lightness L", "lamp X" (as the
 * option), "reset", "unwritten" (true while nobody has sent 06, the writing of a slot) and
 * faults.  ONCE happens to the next of its kind; the others stay until "fault none", which
 * ends them all.
 *   fault mute            no answer to anything
 *   fault silent EP       what endpoint EP (hexadecimal) has to give stays there
 *   fault delay MS        every answer and spectrum comes later, also with delays=0
 *   fault stall EP        ONCE: the next transfer stalls (-EPIPE) if EP is 0 or its endpoint
 *   fault sync            ONCE: a spectrum ends with 0x96, not 0x69
 *   fault truncate N      ONCE: of a spectrum come N bytes; a multiple of 512 ends no transfer
 *   fault overlong N      ONCE: N bytes more follow on a spectrum
 *   fault hang            ONCE: of a spectrum one packet comes, and no end ever
 *   fault stale           ONCE: an answer comes with the next one, before it
 *   fault twice           ONCE: an answer comes twice
 *   fault short           ONCE: of an answer come two bytes
 *   fault slots           the slots' texts are no texts
 *   fault slot N TEXT     slot N has this text, or none; "hex:00ff.." for bytes
 *   fault lamp            the lamp gives no light
 *   fault gone            the next spectrum ends after one packet: it was unplugged (-ENODEV)
 *
 * A short packet ends a transfer.  A give() that returns a multiple of the packet, less than the
 * size, is a transfer that has not ended yet. */
#ifndef SKINSPEC_TESTS_SIM_OCEAN_H
#define SKINSPEC_TESTS_SIM_OCEAN_H

#include "tests/sim/sim.h"

/* How often 06 was sent. */
unsigned ocean_writes(const struct sim *sim);

/* Spectra that the detector has taken since it was made or reset, and those of them that
 * began without a request. */
unsigned ocean_exposures(const struct sim *sim);
unsigned ocean_unasked_exposures(const struct sim *sim);

/* The last command byte that came; 0: none. */
uint8_t ocean_last_command(const struct sim *sim);

/* What a perfect detector counts of pixel i above its dark, on the scale of the
 * non-linearity, with what lies under the port now and this integration time. */
double ocean_light(const struct sim *sim, size_t i, uint32_t integration_us);

#endif
