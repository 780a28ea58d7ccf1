/* device.h - the simulated instrument itself: what another driver has at the far
 * end of its cable.
 *
 * It is asked, and gives an answer with the time at which that answer would
 * arrive; waiting for it, giving it up, and doubting it are the driver's part.
 * An answer begins with a code as on the CM-700d: "OK00", or "OKnn" with a
 * warning, or "ERnn". */
#ifndef SKINSPEC_DRIVERS_SIMULATED_DEVICE_H
#define SKINSPEC_DRIVERS_SIMULATED_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/driver.h"
#include "drivers/simulated/button.h"
#include "drivers/simulated/options.h"

enum { DEVICE_MAX_BANDS = 64, DEVICE_NEVER = -1 };
#define DEVICE_SAMPLE_APERTURE_MM 8.0 /* its stored samples were taken through this port */

struct answer {
    int64_t at_ms; /* of CLOCK_MONOTONIC; DEVICE_NEVER */
    bool gone;     /* the cable says so, instead of an answer */
    char code[DRIVER_CODE_SIZE];

    /* After a status and with every spectrum. */
    bool due[DRIVER_CALIBRATIONS];
    double battery_percent, temperature_C;
    bool charging;

    /* After a shot or a sample: counts, as text would bring them. */
    size_t bands;
    double sce[DEVICE_MAX_BANDS], sci[DEVICE_MAX_BANDS];

    size_t stored;
};

struct device;

/* Take hold of it.  0, or an errno as open(2) of a device node has it, with a text in
 * *error where the options were at fault (EINVAL). */
int device_open(const struct options *options, struct device **ret, struct driver_error *error);
void device_close(struct device *device); /* takes NULL */

/* A call of the driver begins: what is planned for it happens in it.  (Faults are
 * planned by calls; nothing of the kind exists in another driver.) */
void device_expect(struct device *device, enum operation operation);

/* The commands, each with its answer. */
void device_identify(struct device *device, struct answer *ret);
void device_set(struct device *device, const struct driver_grid *grid, double aperture_mm,
                struct answer *ret);
void device_status(struct device *device, struct answer *ret);
void device_calibrate(struct device *device, enum driver_calibration step, struct answer *ret);
void device_wait_for_flash(struct device *device, struct answer *ret);
void device_measure(struct device *device, struct answer *ret);
void device_enable_button(struct device *device, struct answer *ret);
void device_count_samples(struct device *device, struct answer *ret);
void device_read_sample(struct device *device, size_t i, struct answer *ret);

struct button *device_button(struct device *device);

#endif
