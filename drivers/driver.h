/* driver.h - the contract between the station and an instrument.
 *
 * One thread owns one open instrument and calls its functions one after the
 * other; only cancel() comes from another thread.  A driver is a straight
 * conversation: it asks, waits for the answer up to a deadline, and returns.  It
 * knows neither sessions nor the database, keeps nothing after close(), and logs
 * nothing: what went wrong is in struct driver_error.
 *
 * A call that does not return DRIVER_OK has filled *error and left its other
 * outputs untouched; one that does has left *error untouched.  No pointer may be
 * NULL except where it says so.
 *
 * NULL in the table of functions means that the device cannot.
 *
 * tests/drivers/contract.c holds every registered driver to this page. */
#ifndef SKINSPEC_DRIVERS_DRIVER_H
#define SKINSPEC_DRIVERS_DRIVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/spectrum.h"

/* ---- what a call can end with ------------------------------------------------------- */

enum driver_result {
    DRIVER_OK = 0,
    DRIVER_CANCELLED,     /* cancel() was called */
    DRIVER_TIMEOUT,       /* the instrument stayed silent past the deadline */
    DRIVER_GONE,          /* unplugged, switched off: close and open again */
    DRIVER_BUSY,          /* held by another process, or still charging */
    DRIVER_REFUSED,       /* the instrument says no: not calibrated, wrong mode */
    DRIVER_IMPLAUSIBLE,   /* it answered, with what cannot be: black as white, all zero */
    DRIVER_PROTOCOL,      /* bytes that are no answer of this instrument */
    DRIVER_BATTERY,       /* too empty to measure */
    DRIVER_FAULT,         /* it reports damage: lamp, detector, memory */
    DRIVER_UNSUPPORTED,   /* no such mode, aperture or option here */
    DRIVER_NO_PERMISSION, /* the device node may not be opened */
};

/* Stable token, "timeout", "no_permission"; "unknown" for a value that is none of
 * the above.  Never NULL.  The other names on this page keep to the same. */
const char *driver_result_name(enum driver_result result);

/* A text has room for a list of what would be allowed. */
enum { DRIVER_TEXT_SIZE = 512, DRIVER_NAME_SIZE = 48, DRIVER_CODE_SIZE = 16 };

struct driver_error {
    enum driver_result result;   /* as the call returned it */
    char code[DRIVER_CODE_SIZE]; /* the instrument's own, "ER21"; "" where it has none */
    char text[DRIVER_TEXT_SIZE]; /* for a person: what is wrong and what to do */
};

/* For drivers: fill *error, cutting what is too long, and return the result, so
 * that a step fails in one line.  code may be NULL. */
enum driver_result driver_fail(struct driver_error *error, enum driver_result result,
                               const char *code, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* ---- what an instrument is ---------------------------------------------------------- */

enum { DRIVER_MAX_APERTURES = 4, DRIVER_MAX_GRIDS = 4 };

enum driver_geometry { DRIVER_GEOMETRY_D8, DRIVER_GEOMETRY_45_0 };
const char *driver_geometry_name(enum driver_geometry geometry); /* "d/8", "45/0" */

struct driver_grid {
    double first_nm, step_nm;
    size_t n;
};

/* What the driver learnt when it opened the instrument. */
struct driver_identity {
    char maker[DRIVER_NAME_SIZE], model[DRIVER_NAME_SIZE];
    char serial[DRIVER_NAME_SIZE];
    char firmware[DRIVER_NAME_SIZE];   /* version; behind it the correction of readings that the
                                          driver was opened with, where there is one */
    char white_tile[DRIVER_NAME_SIZE]; /* serial number of the tile it is calibrated to */
    enum driver_geometry geometry;
    bool has_sci, has_sce, has_button, has_battery, has_stored_samples;
    bool has_user_calibration; /* the white step can be made with the user's own standard */
    struct driver_grid grid[DRIVER_MAX_GRIDS];
    size_t grids;
    double aperture_mm[DRIVER_MAX_APERTURES];
    size_t apertures;
    unsigned max_averages; /* flashes it averages into one shot by itself; 0, 1: it does not */
    int max_delay_ms;      /* it can wait that long before it flashes; 0: it cannot */
};

struct link_source; /* drivers/link/link.h */
struct capture;     /* drivers/link/capture.h */

/* Where an instrument is and how it is to be opened. */
struct driver_options {
    const char *address;  /* "/dev/ttyACM0", "usb:001:005"; simulated: options, see there */
    int open_timeout_ms;  /* open() takes no longer; 0: the driver's own choice */
    int reply_timeout_ms; /* silence after which an answer that should have come is given
                             up; added to the time the job itself takes (a flash charging,
                             an average of ten shots).  0: the driver's own choice */
    int shot_timeout_ms; /* what a shot of one flash may take, of n flashes n times that, beside the
                            reply timeout and the delay that was set; for drivers that
                            wait for its end.  0: the driver's own choice */
    const struct link_source *wire; /* instead of what the address names; NULL */
    struct capture *capture;        /* every byte both ways goes there; NULL: nowhere */
};

/* How it is set; what a measurement was made with travels in the reading. */
struct driver_setup {
    size_t grid, aperture; /* index into the identity's lists; 0, 0 after open() */
    unsigned averages;     /* flashes of one shot; 0 as 1 */
    int delay_ms;          /* before the flash */
    bool user_calibration; /* the white step is made with the user's standard */
};

/* For drivers: DRIVER_UNSUPPORTED, saying what there is, where the instrument cannot be
 * set like this. */
enum driver_result driver_check_setup(const struct driver_identity *identity,
                                      const struct driver_setup *setup, struct driver_error *error);

/* ---- what is due -------------------------------------------------------------------- */

/* In the order in which they are made. */
enum driver_calibration { DRIVER_CALIBRATION_ZERO, DRIVER_CALIBRATION_WHITE, DRIVER_CALIBRATIONS };
const char *driver_calibration_name(enum driver_calibration step); /* "zero", "white" */

struct driver_status {
    bool due[DRIVER_CALIBRATIONS];                     /* as the instrument says */
    char place[DRIVER_CALIBRATIONS][DRIVER_TEXT_SIZE]; /* what the operator must put where;
                                                          "" where the step is not due */
    int battery_percent;                               /* -1: not known or no battery */
    bool charging;                                     /* the flash is not ready yet */
    double temperature_C;                              /* NAN: not known */
};

/* ---- what a measurement gives ------------------------------------------------------- */

enum driver_warning {
    DRIVER_WARNING_BATTERY_LOW = 1 << 0,
    DRIVER_WARNING_LAMP_WEAK = 1 << 1,
    DRIVER_WARNING_CALIBRATION_OLD = 1 << 2, /* the instrument asks for one, but measured */
    DRIVER_WARNING_TEMPERATURE = 1 << 3,
    DRIVER_WARNING_OVER_RANGE = 1 << 4,        /* brighter than it can measure */
    DRIVER_WARNING_CONDITIONS_DIFFER = 1 << 5, /* not those of its target or its calibration */
};
enum { DRIVER_WARNINGS = 6 };
const char *driver_warning_name(size_t bit); /* "battery_low" ... */

/* One shot.  What the instrument sent as integers is kept as it came, and the
 * spectra are exactly raw[i] * raw_unit. */
struct driver_reading {
    bool has_sce, has_sci;
    struct spectrum sce, sci; /* aperture and specular mode set */
    int32_t raw_sce[SPECTRUM_MAX_BANDS], raw_sci[SPECTRUM_MAX_BANDS];
    double raw_unit;               /* reflectance of one count; 0: no raw integers */
    unsigned warnings;             /* bits of enum driver_warning */
    char sample[DRIVER_NAME_SIZE]; /* name of a stored sample; "" for a shot */
};

/* ---- the functions ------------------------------------------------------------------ */

struct instrument; /* each driver's own */

/* How long the reading of a press may be fetched (wait_button()). */
enum { DRIVER_PRESS_FRESH_MS = 2000 };

/* What discovery may take for an instrument of this driver.  A tty whose USB parent is not
 * named here is never opened unless it was configured by hand. */
struct driver_match {
    uint16_t vid, pid; /* pid 0: any of this maker */
    enum { DRIVER_BUS_TTY, DRIVER_BUS_USB } bus;
};

struct driver {
    const char *name;                   /* "simulated", "km_ascii" */
    const char *description;            /* one line for --help */
    const struct driver_match *matches; /* ends with vid 0; NULL: by configuration alone */
    bool has_no_wire;                   /* there are no bytes that could be captured */

    /* Open and identify.  On failure *ret is untouched. */
    enum driver_result (*open)(const struct driver_options *options, struct instrument **ret,
                               struct driver_identity *identity, struct driver_error *error);
    void (*close)(struct instrument *instrument); /* takes NULL */

    /* Makes the call in progress, if any, return DRIVER_CANCELLED within 200 ms,
     * unless its answer is there already; a call that begins later is not affected,
     * but for wait_button().  From any thread, between open() and close(); open()
     * itself is not cancelled but bounded by its timeout. */
    void (*cancel)(struct instrument *instrument);

    /* DRIVER_UNSUPPORTED, and all as it was, for an index outside the lists or a choice that the
     * identity does not offer; DRIVER_REFUSED where the operator has to do something first
     * (move a slider).  Another grid, aperture or kind of calibration may make calibrations
     * due: ask status(). */
    enum driver_result (*configure)(struct instrument *instrument, const struct driver_setup *setup,
                                    struct driver_error *error);
    enum driver_result (*status)(struct instrument *instrument, struct driver_status *ret,
                                 struct driver_error *error);

    /* The operator has placed what status() asked for.  DRIVER_REFUSED where an
     * earlier step is due; DRIVER_IMPLAUSIBLE where something else lies there, and the
     * step stays due. */
    enum driver_result (*calibrate)(struct instrument *instrument, enum driver_calibration step,
                                    struct driver_error *error);

    /* One shot, in every specular mode the instrument has, once the flash is charged.
     * DRIVER_REFUSED where the instrument wants a calibration first. */
    enum driver_result (*measure)(struct instrument *instrument, struct driver_reading *ret,
                                  struct driver_error *error);

    /* Wait for the button up to timeout_ms >= 0; *pressed says whether it was.  A press
     * since the last call (the first: since open()) counts at once, several are one: a
     * call with 0 before the operator is asked to press forgets what came earlier.
     *
     * A cancel() since the last call ended, or one that came too late for that call to
     * notice, ends this one at once, and is used up by it: whoever wants to end a wait
     * need not know whether it has begun.  A press is not lost by it.
     *
     * Where the press itself measures, a measure() that follows a wait that saw it come gives its
     * reading, and there is no second flash.  Not after DRIVER_PRESS_FRESH_MS, nor where anything
     * but status() was called in between, another wait too: a shot of its own is taken then, or
     * may be. */
    enum driver_result (*wait_button)(struct instrument *instrument, int timeout_ms, bool *pressed,
                                      struct driver_error *error);

    /* Samples in the instrument's memory: how many, and number i from 0
     * (DRIVER_REFUSED where there is none).  Needs no calibration. */
    enum driver_result (*stored_count)(struct instrument *instrument, size_t *ret,
                                       struct driver_error *error);
    enum driver_result (*stored_read)(struct instrument *instrument, size_t i,
                                      struct driver_reading *ret, struct driver_error *error);
};

#endif
