/* options.h - the simulated instrument's address, taken apart; simulated.h says
 * what each option means. */
#ifndef SKINSPEC_DRIVERS_SIMULATED_OPTIONS_H
#define SKINSPEC_DRIVERS_SIMULATED_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/driver.h"

enum { OPTIONS_PATH_SIZE = 512, OPTIONS_MAX_FAULTS = 8 };

enum operation {
    OPERATION_OPEN,
    OPERATION_CONFIGURE,
    OPERATION_STATUS,
    OPERATION_CALIBRATE,
    OPERATION_MEASURE,
    OPERATION_WAIT_BUTTON,
    OPERATION_STORED_COUNT,
    OPERATION_STORED_READ,
    OPERATIONS
};

enum fault {
    FAULT_NONE,
    FAULT_SILENCE,
    FAULT_SLOW,
    FAULT_GONE,
    FAULT_GARBAGE,
    FAULT_BUSY,
    FAULT_NO_PERMISSION,
    FAULT_SWAPPED,
    FAULT_LAMP,
    FAULT_BATTERY,
    FAULT_CHARGE,
    FAULT_WEAK_LAMP,
    FAULT_EXPIRED,
    FAULT_WRONG_BANDS,
    FAULT_NAN,
    FAULT_ALL_ZERO,
    FAULTS
};

struct planned_fault {
    enum operation operation;
    size_t call;    /* from 1 */
    bool and_later; /* "3+" */
    enum fault fault;
};

/* Numbers are all double, whole ones too: one table reads them. */
struct options {
    char serial[DRIVER_NAME_SIZE];
    char model[DRIVER_NAME_SIZE];
    double Cm, Bm, Ch, epidermis_mm;
    char spectra[OPTIONS_PATH_SIZE]; /* "": a computed skin */
    double replicates, pressure, surface;
    double seed, noise, placement, unit, drift;
    double speed; /* INFINITY: instant */
    double shot_ms, charge_ms, calibrate_ms, slow_ms;
    double calibration_shots, calibration_minutes;
    bool warns_when_overdue;
    double battery, drain, temperature_C;
    double stored;
    double button_ms;
    char button_file[OPTIONS_PATH_SIZE];
    struct planned_fault fault[OPTIONS_MAX_FAULTS];
    size_t faults;
};

/* NULL is an address without options.  DRIVER_UNSUPPORTED with a text that says what
 * is allowed for an unknown or repeated option or a value that is not accepted. */
enum driver_result options_parse(const char *address, struct options *ret,
                                 struct driver_error *error);

/* The fault planned for this call of the operation. */
enum fault options_fault(const struct options *options, enum operation operation, size_t call);

#endif
