/* toy_wire.h - the TOY-1's commands: bytes <-> values, pure.
 *
 *   line        9600 8N1, no handshake; every line ends with CR LF
 *   identity    ID?      TOY1,00042     model and serial number
 *   calibrated  CAL?     CAL,1,0        zero, white
 *   calibrate   ZERO     OK             after 1 s; on the black trap
 *               WHITE    OK             the same; on the white tile
 *   shot        SHOT     3012,...,5120  after 1 s: 31 integers, 0.01 %, SCE, 400..700 nm by 10
 *   error                ERR 1          instead of any answer but that to ID?
 *
 * No checksum, and the answer to SHOT comes once: plausibility is all that guards it. */
#ifndef SKINSPEC_DRIVERS_TOY_TOY_WIRE_H
#define SKINSPEC_DRIVERS_TOY_TOY_WIRE_H

#include "drivers/reading.h"

enum { TOY_BANDS = 31 };

#define TOY_FIRST_NM 400.0
#define TOY_STEP_NM 10.0
#define TOY_RAW_UNIT 1e-4 /* 0.01 % */

/* Lines come without their end.  False, and *ret untouched, for one that is no such answer. */
bool toy_read_identity(const char *line, char serial[DRIVER_NAME_SIZE]);
bool toy_read_calibrated(const char *line, bool ret[DRIVER_CALIBRATIONS]);
bool toy_read_done(const char *line);

/* NULL for a line that is no error. */
struct toy_code {
    const char *line;
    enum driver_result result;
    const char *text; /* what is wrong and what to do */
};
const struct toy_code *toy_find_error(const char *line);

enum doubt toy_read_shot(const char *line, int32_t raw[TOY_BANDS]);

#endif
