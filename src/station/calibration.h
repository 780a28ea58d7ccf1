/* calibration.h - is the calibration of an instrument still good, and if not, why?
 *
 * Plain state; ages are by CLOCK_BOOTTIME, which goes on in suspend and is not
 * stepped.  A calibration made under another boot of this machine, before the
 * instrument was connected again, or at another aperture is due whatever the
 * clock says, and so is one of which the instrument itself says so. */
#ifndef SKINSPEC_STATION_CALIBRATION_H
#define SKINSPEC_STATION_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CALIBRATION_STEPS = 2 }; /* zero, white: in the order they are made */

enum calibration_due {
    CALIBRATION_GOOD = 0,
    CALIBRATION_NEVER,       /* none is on record */
    CALIBRATION_INSTRUMENT,  /* the instrument asks for it */
    CALIBRATION_BOOT,        /* made before this machine was started */
    CALIBRATION_RECONNECTED, /* made before the instrument was plugged in (again) */
    CALIBRATION_APERTURE,    /* made with another aperture */
    CALIBRATION_EXPIRED,     /* older than the policy allows */
    CALIBRATION_EARLIER_STEP /* good itself, but the step before it is due */
};

/* Token and text: "good", "never", ... */
const char *calibration_due_name(enum calibration_due due);
const char *calibration_due_text(enum calibration_due due);

enum { CALIBRATION_BOOT_ID_SIZE = 37 };

/* One step as it was made. */
struct calibration_made {
    bool made;
    char boot_id[CALIBRATION_BOOT_ID_SIZE];
    int64_t boottime_ms;
    uint64_t connection; /* number of the connection it was made over, of this daemon; 0: before */
    double aperture_mm;
};

/* What holds now. */
struct calibration_now {
    const char *boot_id;
    int64_t boottime_ms;
    uint64_t connection; /* from 1, one more with every reconnection */
    double aperture_mm;
    int64_t max_age_ms[CALIBRATION_STEPS]; /* 0: no limit of our own */
    bool instrument_asks[CALIBRATION_STEPS];
};

struct calibration_state {
    enum calibration_due due[CALIBRATION_STEPS];
    int64_t age_ms[CALIBRATION_STEPS];        /* -1: cannot be told */
    int64_t expires_in_ms[CALIBRATION_STEPS]; /* -1: no limit, or due already */
    bool good;                                /* all steps are */
};

/* The reasons are tried in the order of the enum; the first that applies is given.
 * A connection number of 0 in `made` (a calibration read back from the record of an
 * earlier run of the daemon, this boot) counts as another connection. */
struct calibration_state calibration_judge(const struct calibration_made made[CALIBRATION_STEPS],
                                           const struct calibration_now *now);

#endif
