/* cm2600d.h - a Konica Minolta CM-2600d or CM-2500d on RS-232 (9600 8N1, RTS/CTS).
 *
 * The dialect before the CM-700d's: no MDR, the data are the reply to MES.  Known: IDR STR CPR CPS
 * UZC CAL SWE MES SDR CDR WMS CDS.
 *
 * MES in mode 0 answers with one line, SCI; in 1 with two, SCI and SCE; in 2 with three, those and
 * SCI with UV cut; in 3 with four.  Modes 4 and 5 (UV adjusted) are ER03: no source says what they
 * answer.  39 values, 360..740 by 10, five characters each.
 *
 * Options beside serial, delays, seed and lightness (65):
 *   type=03         13: a CM-2500d
 *   rom=104  noise=0.0003  samples=0 (stored in environment 1, at most 50)
 *   dot=1           percent with a dot, " 9.87" as 09.87; 0: without, 0.01 %, 00987
 *   careful=1  operator=0  binary_serial=0  asleep=0   as cm700d.h
 *
 * Actions as cm700d.h: "press" (after SWE its MES lines come unasked), "store", "forget",
 * "sleep", "reset", "expect writes N" (CDS and WMS); and "differ 0|1": the conditions are not
 * those of its target (OK05).
 *
 * Assumed where the sources are silent: a flash not charged is ER27; a slider at another place
 * than CPS says is what CPS then says, as CPR (nothing tells of a slider on this line: ER25 is a
 * mismatch of targets here); SDR tells status, gloss and UV code, then the SCE line; the stored
 * samples have no name. */
#ifndef SKINSPEC_TESTS_SIM_CM2600D_H
#define SKINSPEC_TESTS_SIM_CM2600D_H

#include "tests/sim/sim.h"

#endif
