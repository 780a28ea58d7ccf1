/* cm700d.h - a Konica Minolta CM-700d or CM-600d at the end of its virtual COM port.
 *
 * Requests are three letters, fields with commas, CR LF; one reply line each, `OKnn` or `ERnn`
 * first.  Known: IDR STR CPR CPS ZRC CAL USC USR USS CIR CIS CDR CDS UCR UCS MES MDR RDR COR RCR
 * SWS SPR SDR SDD SAD DTR DTS DFS.
 *
 * Options beside serial, delays, seed and lightness (65):
 *   id=0100         the model as IDR tells it
 *   variant=cm600d  no slider: the large port alone.  Its id is not known: it is 0100 too unless
 *                   id= says another
 *   rom=104  plate=12345678  noise=0.0003  samples=0 (stored, at most 50)
 *   first_area=1    the small port's number, 0 or 1: the sources do not agree
 *   index=fixed     MDR,1 is SCI and MDR,2 SCE always; `running`: MDR,1 is the first selected
 *   notify=silent   a press is learnt by RDR alone; `line`: its line comes unasked
 *   keep=once       RDR gives each line of a press once; `stays`: until SWS or MES
 *   user=0          1: data of a user calibration are stored
 *   careful=1       0: a calibration on what cannot be is not refused (ER11)
 *   operator=0      1: somebody places what a calibration wants, and takes it away after
 *   binary_serial=0 1: the serial number is 1 kB of bytes that are no text
 *   asleep=0        1: what comes first only wakes it
 *
 * Actions beside those of handheld.h and faults.h: "press", "store" (a shot into its memory, as by
 * its own menu), "recalibrate 0|1" (it recommends a white calibration), "clock lost", "sleep",
 * "forget" (all calibrations), "reset", "expect writes N": false where the commands that change
 * factory data or delete samples (CDS UCS CIS SDD SAD) did not come N times, "expect averages N".
 *
 * Where the sources say nothing, assumed: an empty line is answered ER00; a zero calibration
 * counts for the port it was made through and makes the white due again; ZRC comes before CAL
 * and USC (ER07); with more than one manual average a measurement has data only after that many
 * MES; a command during a measurement is answered ER35; COR knows X Y Z x y L* a* b* C* h for A,
 * C, D50, D65, F2, F7 and F11. */
#ifndef SKINSPEC_TESTS_SIM_CM700D_H
#define SKINSPEC_TESTS_SIM_CM700D_H

#include "tests/sim/sim.h"

#endif
