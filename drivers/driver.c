/* driver.c - names of what the contract counts, and how a driver fails. */
#include "drivers/driver.h"

#include <stdarg.h>
#include <stdio.h>

/* The name of a value that counts from 0, "unknown" outside the list. */
#define NAME_IN(list, value) \
    ((size_t)(value) < sizeof(list) / sizeof *(list) ? (list)[value] : "unknown")

const char *driver_result_name(enum driver_result result)
{
    static const char *const names[] = {
        [DRIVER_OK] = "ok",
        [DRIVER_CANCELLED] = "cancelled",
        [DRIVER_TIMEOUT] = "timeout",
        [DRIVER_GONE] = "gone",
        [DRIVER_BUSY] = "busy",
        [DRIVER_REFUSED] = "refused",
        [DRIVER_IMPLAUSIBLE] = "implausible",
        [DRIVER_PROTOCOL] = "protocol",
        [DRIVER_BATTERY] = "battery",
        [DRIVER_FAULT] = "fault",
        [DRIVER_UNSUPPORTED] = "unsupported",
        [DRIVER_NO_PERMISSION] = "no_permission",
    };
    return NAME_IN(names, result);
}

const char *driver_geometry_name(enum driver_geometry geometry)
{
    static const char *const names[] = {
        [DRIVER_GEOMETRY_D8] = "d/8",
        [DRIVER_GEOMETRY_45_0] = "45/0",
    };
    return NAME_IN(names, geometry);
}

const char *driver_calibration_name(enum driver_calibration step)
{
    static const char *const names[] = {
        [DRIVER_CALIBRATION_ZERO] = "zero",
        [DRIVER_CALIBRATION_WHITE] = "white",
    };
    return NAME_IN(names, step);
}

const char *driver_warning_name(size_t bit)
{
    static const char *const names[DRIVER_WARNINGS] = { "battery_low",     "lamp_weak",
                                                        "calibration_old", "temperature",
                                                        "over_range",      "conditions_differ" };
    return NAME_IN(names, bit);
}

enum driver_result driver_check_setup(const struct driver_identity *is,
                                      const struct driver_setup *setup, struct driver_error *error)
{
    unsigned most = is->max_averages > 1 ? is->max_averages : 1;
    if (setup->grid >= is->grids || setup->aperture >= is->apertures)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "grid %zu, aperture %zu: there are %zu and %zu, from 0", setup->grid,
                           setup->aperture, is->grids, is->apertures);
    if (setup->averages > most)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "%u flashes for one shot: this instrument averages at most %u; take "
                           "replicates instead",
                           setup->averages, most);
    if (setup->delay_ms < 0 || setup->delay_ms > is->max_delay_ms)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "a delay of %d ms: this instrument waits 0 to %d ms", setup->delay_ms,
                           is->max_delay_ms);
    if (setup->user_calibration && !is->has_user_calibration)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "this instrument has no user calibration: calibrate on its white tile");
    return DRIVER_OK;
}

enum driver_result driver_fail(struct driver_error *error, enum driver_result result,
                               const char *code, const char *format, ...)
{
    va_list arguments;
    error->result = result;
    snprintf(error->code, sizeof error->code, "%s", code != NULL ? code : "");
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return result;
}
