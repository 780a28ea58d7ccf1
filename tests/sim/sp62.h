/* sp62.h - an X-Rite SP60, SP62 or SP64 on a serial line (9600 8N1, no handshake), "RCI".
 *
 * Hex digits, two letters, CR or CR LF; data, if any, then `<hh>` and the delimiter.  Known: CF BR
 * SN XD RM GM GS SM CE.  At first the delimiter is CR and the separator a space; a spectrum is 31
 * values of percent with four decimals, 400..700 by 10.
 *
 * Options beside serial, delays, seed and lightness (65):
 *   variant=sp62    sp60, sp64: no source tells them apart on the line; an sp64 has a slider
 *   noise=0.0003  samples=0 (stored, at most 9)  careful=1 (else no <29>)  binary_serial=0
 *   echo=0          1: every byte of the host comes back until 0009CF
 *   operator_ms=0   > 0: somebody follows the display: what is asked for lies under the port, and
 *                   the button is pressed, after that time; the skin afterwards
 *
 * Actions beside those of handheld.h and faults.h: "press" (what 10XD and 01XD wait for), "store",
 * "forget", "reset", "operator leaves" (operator_ms=0), "expect writes N" (nothing here writes
 * factory data: always 0).
 *
 * 10XD: white under the port, press; black, press; then <00>, or <29> where it was not so, or <2A>
 * after 120 s.  01XD: <00> after the press, which measured; <21> after 320 s.
 * Assumed: an empty line is answered <00>; after <20>..<48> RM, XD, GM and GS answer the same
 * until CE; a command while 10XD or 01XD wait is <14>, but CE ends them with <15>. */
#ifndef SKINSPEC_TESTS_SIM_SP62_H
#define SKINSPEC_TESTS_SIM_SP62_H

#include "tests/sim/sim.h"

#endif
