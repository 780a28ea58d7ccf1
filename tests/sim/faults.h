/* faults.h - what can go wrong at the instrument's end of a serial line, on demand.
 *
 * `fault KIND [ARGUMENTS] [on N | from N]`: on the N-th reply (command, spectrum, shot) from now,
 * or on all from the N-th; without either on the next.  Bytes of a reply are counted from 0, its CR
 * and LF included; a negative number counts from its end, -1 is the LF.
 *
 *   a reply:    silence              it never comes
 *               late                 it comes with the reply to the next command, before it
 *               delay MS             it comes MS ms later
 *               slow MS              one byte each MS ms
 *               truncated K          its first K bytes
 *               longer K             K digits more before its end, at most 4000
 *               twice                and once more
 *               garbage K            K bytes by chance instead, at most 4000
 *               xor K MASK           byte K with bits turned over
 *               replace K VALUE      byte K is another
 *               reply TEXT           TEXT instead, one word
 *   a command:  prober               the instrument hears "AT\r" before it: another program
 *   a spectrum: bands N              that many values, at most 64
 *               zero                 all of them 0
 *               over                 beyond what can be measured: 250 %
 *               negative             -5 %
 *               text                 "nan" for the third value
 *               swapped              SCI and SCE exchanged
 *   a shot:     battery_dies [MS]    it never ends, or ends without data after MS ms
 *               calibration_lost     it ends without data, and uncalibrated
 *               lamp                 it does not flash
 *
 * `fault none` forgets them all. */
#ifndef SKINSPEC_TESTS_SIM_FAULTS_H
#define SKINSPEC_TESTS_SIM_FAULTS_H

#include <stdbool.h>
#include <stddef.h>

enum fault_kind {
    FAULT_NONE,
    FAULT_SILENCE,
    FAULT_LATE,
    FAULT_DELAY,
    FAULT_SLOW,
    FAULT_TRUNCATED,
    FAULT_LONGER,
    FAULT_TWICE,
    FAULT_GARBAGE,
    FAULT_XOR,
    FAULT_REPLACE,
    FAULT_REPLY,
    FAULT_PROBER,
    FAULT_BANDS,
    FAULT_ZERO,
    FAULT_OVER,
    FAULT_NEGATIVE,
    FAULT_TEXT,
    FAULT_SWAPPED,
    FAULT_BATTERY_DIES,
    FAULT_CALIBRATION_LOST,
    FAULT_LAMP,
};

enum fault_place { FAULT_AT_REPLY, FAULT_AT_COMMAND, FAULT_AT_SPECTRUM, FAULT_AT_SHOT };

struct fault {
    enum fault_kind kind;
    enum fault_place place;
    long a, b;
    char text[64];
    long on; /* how many more to come, this one included */
    bool stays;
};

enum { FAULTS_MAX = 16 };

struct faults {
    struct fault list[FAULTS_MAX];
    size_t n;
};

/* What stands behind "fault ".  False where it is none of the above, or too many. */
bool faults_add(struct faults *faults, const char *text);

/* One more reply, command ...: the fault for it, at most one; kind FAULT_NONE for none. */
struct fault faults_next(struct faults *faults, enum fault_place place);

#endif
