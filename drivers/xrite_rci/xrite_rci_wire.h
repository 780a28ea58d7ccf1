/* xrite_rci_wire.h - X-Rite's RCI commands, as an SP60, SP62 or SP64 knows them: bytes <-> values,
 * pure.
 *
 * A command is hexadecimal digits and two letters, CR LF; the answer data, if any, then the status
 * `<hh>`, CR LF.  No checksum: the readers here take everything strictly, and whoever asks
 * reads twice.
 *
 *   line        9600 8N1, no handshake
 *   wake        CR LF alone; the answer, if any, may be anything
 *   error       CE       <00>; <15> where it ended something.  Before each action
 *   settings    0005CF   <00>    nothing is sent unasked
 *               0107CF   <00>    comma between values
 *               0108CF   <00>    CR LF ends an answer (CR before that)
 *               0009CF   <00>    no echo
 *               0040CF   <00>    no emulation of another model
 *               0020CF   <00>    the read switch works
 *               014BCF   <00>    01 reading in an average
 *   serial      00SN     001234<00>
 *   calibrate   10XD     <00> when the operator has followed the display, white and then black;
 * <29> failed, <2A> nobody came a shot      RM       <00>, or <01>; <28> not calibrated button 01XD
 * <00> when the operator has pressed, which measures spectrum    0001GM   20.1234,...,31.0000<00>
 * SCI of the last shot, percent, 31 values 0101GM                              SCE stored      00GM
 * 3<00>                      how many 1001GM, 1101GM                      SCI and SCE of sample 1
 *
 * From two programs, color4j's xrite/sp62 and a German colour software, and X-Rite's page on RCI
 * switches.  Not seen on hardware.  Whether RM and XD answer when all is done or at once, the
 * number being then asked for with <14>, differs by description and perhaps by firmware: both are
 * taken.  Whether the number in a command is decimal or hexadecimal is not said, so none above 9
 * is sent.
 *
 * Never sent: BR (another baud rate, which outlasts the power), SM, GS, and whatever writes. */
#ifndef SKINSPEC_DRIVERS_XRITE_RCI_XRITE_RCI_WIRE_H
#define SKINSPEC_DRIVERS_XRITE_RCI_XRITE_RCI_WIRE_H

#include "drivers/reading.h"

enum { RCI_BANDS = 31, RCI_MAX_NUMBER = 9, RCI_MAX_COUNT = 9999, RCI_COMMAND_SIZE = 16 };

#define RCI_FIRST_NM 400.0
#define RCI_STEP_NM 10.0
#define RCI_RAW_UNIT 1e-6 /* 0.0001 %: four decimals */

/* ---- an answer ---------------------------------------------------------------------- */

struct rci_reply {
    const char *data; /* into the line */
    size_t n;
    unsigned status;
};

/* False for what is no answer: without `<hh>` in upper case at its end, or with another one. */
bool rci_read_reply(const char *line, struct rci_reply *ret);

/* What an answer may be.  One with another status than "done" is an error, of any kind. */
enum rci_kind { RCI_STATUS, RCI_TEXT, RCI_COUNT, RCI_SPECTRUM };
bool rci_is_kind(const struct rci_reply *reply, enum rci_kind kind);

/* ---- status ------------------------------------------------------------------------- */

/* What the conversation does about a status, beside telling. */
enum rci_reaction {
    RCI_TELL,
    RCI_DONE,
    RCI_WAIT,    /* busy: ask again */
    RCI_RESEND,  /* not understood: send once more */
    RCI_EMPTY,   /* there is none */
    RCI_ABORTED, /* what waited for the operator */
    RCI_LOST,    /* calibration is due */
    RCI_EXPIRED, /* nobody pressed */
};

struct rci_code {
    unsigned status;
    enum driver_result result;
    enum rci_reaction reaction;
    const char *text; /* what is wrong and what to do */
};

/* NULL for a status that no description has. */
const struct rci_code *rci_find_code(unsigned status);

/* ---- values ------------------------------------------------------------------------- */

/* Decimal digits, at most RCI_MAX_COUNT. */
bool rci_read_count(const struct rci_reply *reply, unsigned *ret);

/* 31 values, counts of RCI_RAW_UNIT. */
enum doubt rci_read_spectrum(const struct rci_reply *reply, int32_t raw[RCI_BANDS]);

#endif
