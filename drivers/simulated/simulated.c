/* simulated.c - the driver of the simulated instrument, and the pattern for others.
 *
 * To write a driver, copy this file.  What stays: the shape of every function
 * below (begin, ask, judge, fill), the one place that waits, the table of the
 * instrument's codes, and the doubts about what it sends.  What goes: device.h,
 * where another driver has a cable and <name>_wire.h.
 *
 * From top to bottom: asking, doubting, the functions, the table of them. */
#include "drivers/simulated/simulated.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/call.h"
#include "drivers/simulated/device.h"
#include "drivers/simulated/options.h"

/* How long to wait for what should have come, where the station does not say. */
enum { OPEN_TIMEOUT_MS = 5000, REPLY_TIMEOUT_MS = 3000 };

/* An instrument that measured at these temperatures can be trusted. */
#define COLDEST_C 10.0
#define WARMEST_C 40.0

static const struct driver_identity identity_of_all = {
    .maker = "skinspec",
    .model = "simulated d/8",
    .firmware = "1",
    .white_tile = "SIM-W1",
    .geometry = DRIVER_GEOMETRY_D8,
    .has_sci = true,
    .has_sce = true,
    .has_button = true,
    .has_battery = true,
    .has_stored_samples = true,
    .grid = { { 400.0, 10.0, 31 }, { 360.0, 10.0, 39 } },
    .grids = 2,
    .aperture_mm = { 8.0, 3.0 },
    .apertures = 2,
};

struct instrument {
    struct call call;
    struct device *device; /* elsewhere: the descriptor of the cable */
    struct options options;
    struct driver_setup setup;
    int reply_timeout_ms;
    int64_t job_ends_ms; /* of the last shot or calibration, waited for or cancelled */
};

/* ---- asking ---------------------------------------------------------------------------- */

/* What the instrument's codes mean for the station and for a person. */
static const struct code {
    const char *code;
    enum driver_result result;
    unsigned warnings;
    const char *text;
} codes[] = {
    { "OK00", DRIVER_OK, 0, "" },
    { "OK02", DRIVER_OK, DRIVER_WARNING_LAMP_WEAK, "" },
    { "OK03", DRIVER_OK, DRIVER_WARNING_BATTERY_LOW, "" },
    { "OK04", DRIVER_OK, DRIVER_WARNING_LAMP_WEAK | DRIVER_WARNING_BATTERY_LOW, "" },
    { "ER02", DRIVER_BATTERY, 0, "the battery is too low to measure: charge it" },
    { "ER05", DRIVER_FAULT, 0, "the lamp did not flash: have the instrument serviced" },
    { "ER07", DRIVER_REFUSED, 0, "zero calibration is due: aim at the zero box, then calibrate" },
    { "ER10", DRIVER_REFUSED, 0, "there is no such sample in the memory" },
    { "ER11", DRIVER_IMPLAUSIBLE, 0,
      "what lies at the port is not what this step needs: zero box and white tile swapped?" },
    { "ER24", DRIVER_REFUSED, 0,
      "white calibration is due: place the instrument on its white tile, then calibrate" },
};

static const struct code *find_code(const char *code)
{
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++)
        if (strcmp(codes[i].code, code) == 0)
            return &codes[i];
    return NULL;
}

static void begin(struct instrument *in, enum operation operation)
{
    call_begin(&in->call);
    device_expect(in->device, operation);
}

/* The one place that waits for an answer: until it is there, or has not come within
 * the time its job takes and the timeout together. */
static enum driver_result await(struct instrument *in, const struct answer *a, int64_t job_ms,
                                int timeout_ms, struct driver_error *error)
{
    int64_t deadline_ms = call_now_ms() + job_ms + timeout_ms;
    bool comes = a->at_ms != DEVICE_NEVER && a->at_ms <= deadline_ms;
    if (a->gone)
        return driver_fail(error, DRIVER_GONE, NULL,
                           "the instrument is gone: connect it or switch it on");
    if (call_wait(&in->call, -1, comes ? a->at_ms : deadline_ms) == CALL_CANCELLED)
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    if (!comes)
        return driver_fail(error, DRIVER_TIMEOUT, NULL,
                           "no answer in %d ms: is the instrument on and connected?", timeout_ms);
    const struct code *code = find_code(a->code);
    if (code == NULL)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "not an answer of this instrument: is this the right driver?");
    if (code->result != DRIVER_OK)
        return driver_fail(error, code->result, code->code, "%s", code->text);
    return DRIVER_OK;
}

/* Nearly everything waits for an answer that takes no time to make. */
static enum driver_result await_reply(struct instrument *in, const struct answer *a,
                                      struct driver_error *error)
{
    return await(in, a, 0, in->reply_timeout_ms, error);
}

/* ---- doubting ----------------------------------------------------------------------------- */

static const struct driver_grid *grid_of(const struct instrument *in)
{
    return &identity_of_all.grid[in->setup.grid];
}

/* Numbers that a whole instrument cannot send. */
static enum driver_result doubt_counts(size_t n, const double *counts, struct driver_error *error)
{
    double most = 0.0;
    for (size_t i = 0; i < n; i++) {
        if (!(counts[i] >= 0.0 && counts[i] <= 1.2 / SIMULATED_RAW_UNIT)) /* NAN neither */
            return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                               "band %zu is no reflectance: calibrate and measure again", i + 1);
        most = fmax(most, counts[i]);
    }
    if (most == 0.0)
        return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                           "no light came back at all: calibrate and measure again");
    return DRIVER_OK;
}

static enum driver_result doubt(const struct instrument *in, const struct answer *a,
                                struct driver_error *error)
{
    if (a->bands != grid_of(in)->n)
        return driver_fail(error, DRIVER_PROTOCOL, NULL, "%zu bands came instead of %zu", a->bands,
                           grid_of(in)->n);
    enum driver_result r = doubt_counts(a->bands, a->sce, error);
    return r == DRIVER_OK ? doubt_counts(a->bands, a->sci, error) : r;
}

static void fill_spectrum(const struct instrument *in, const double *counts, double aperture_mm,
                          enum specular specular, struct spectrum *ret, int32_t *raw)
{
    const struct driver_grid *grid = grid_of(in);
    ret->first_nm = grid->first_nm;
    ret->step_nm = grid->step_nm;
    ret->n = grid->n;
    ret->specular = specular;
    ret->aperture_mm = aperture_mm;
    for (size_t i = 0; i < grid->n; i++) {
        raw[i] = (int32_t)counts[i];
        ret->value[i] = raw[i] * SIMULATED_RAW_UNIT;
    }
}

static void fill_reading(const struct instrument *in, const struct answer *a, double aperture_mm,
                         struct driver_reading *ret)
{
    memset(ret, 0, sizeof *ret);
    ret->has_sce = ret->has_sci = true;
    ret->raw_unit = SIMULATED_RAW_UNIT;
    fill_spectrum(in, a->sce, aperture_mm, SPECULAR_SCE, &ret->sce, ret->raw_sce);
    fill_spectrum(in, a->sci, aperture_mm, SPECULAR_SCI, &ret->sci, ret->raw_sci);
    ret->warnings = find_code(a->code)->warnings;
}

/* ---- the functions --------------------------------------------------------------------------- */

static enum driver_result take_hold(const struct options *options, struct device **ret,
                                    struct driver_error *error)
{
    int failed = device_open(options, ret, error);
    switch (failed) {
    case 0:
        return DRIVER_OK;
    case EINVAL: /* *error says which option */
        return error->result;
    case EBUSY:
        return driver_fail(error, DRIVER_BUSY, NULL,
                           "another program holds the instrument: close that one first");
    case EACCES:
        return driver_fail(error, DRIVER_NO_PERMISSION, NULL,
                           "no permission to open the instrument: check its group and yours");
    default:
        return driver_fail(error, DRIVER_FAULT, NULL, "cannot open: %s", strerror(failed));
    }
}

static void simulated_close(struct instrument *in)
{
    if (in == NULL)
        return;
    device_close(in->device);
    call_done(&in->call);
    free(in);
}

/* Ask who it is and set it to grid 0 and aperture 0. */
static enum driver_result introduce(struct instrument *in, int timeout_ms,
                                    struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_OPEN);
    device_identify(in->device, &a);
    enum driver_result r = await(in, &a, 0, timeout_ms, error);
    if (r == DRIVER_OK)
        device_set(in->device, grid_of(in), identity_of_all.aperture_mm[0], &a);
    return r;
}

static enum driver_result simulated_open(const struct driver_options *options,
                                         struct instrument **ret, struct driver_identity *identity,
                                         struct driver_error *error)
{
    int timeout_ms = options->open_timeout_ms > 0 ? options->open_timeout_ms : OPEN_TIMEOUT_MS;
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->call)) {
        free(in);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory or no descriptor left");
    }
    in->reply_timeout_ms =
        options->reply_timeout_ms > 0 ? options->reply_timeout_ms : REPLY_TIMEOUT_MS;

    enum driver_result r = options_parse(options->address, &in->options, error);
    if (r == DRIVER_OK)
        r = take_hold(&in->options, &in->device, error);
    if (r == DRIVER_OK)
        r = introduce(in, timeout_ms, error);
    if (r != DRIVER_OK) {
        simulated_close(in);
        return r;
    }
    *identity = identity_of_all;
    memcpy(identity->serial, in->options.serial, sizeof identity->serial);
    *ret = in; /* the caller owns it now; close() gives it back */
    return DRIVER_OK;
}

static void simulated_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

static enum driver_result simulated_configure(struct instrument *in,
                                              const struct driver_setup *setup,
                                              struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_CONFIGURE);
    enum driver_result r = driver_check_setup(&identity_of_all, setup, error);
    if (r != DRIVER_OK)
        return r;
    device_set(in->device, &identity_of_all.grid[setup->grid],
               identity_of_all.aperture_mm[setup->aperture], &a);
    r = await_reply(in, &a, error);
    if (r == DRIVER_OK)
        in->setup = *setup;
    return r;
}

static enum driver_result simulated_status(struct instrument *in, struct driver_status *ret,
                                           struct driver_error *error)
{
    static const char *const place[DRIVER_CALIBRATIONS] = {
        [DRIVER_CALIBRATION_ZERO] = "put the instrument on the zero box, or aim it into open air",
        [DRIVER_CALIBRATION_WHITE] = "put the instrument flat on white tile SIM-W1",
    };
    struct answer a;
    begin(in, OPERATION_STATUS);
    device_status(in->device, &a);
    enum driver_result r = await_reply(in, &a, error);
    if (r != DRIVER_OK)
        return r;
    memset(ret, 0, sizeof *ret);
    for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++) {
        ret->due[i] = a.due[i];
        if (a.due[i])
            memcpy(ret->place[i], place[i], strlen(place[i]) + 1);
    }
    ret->battery_percent = (int)a.battery_percent;
    ret->charging = a.charging;
    ret->temperature_C = a.temperature_C;
    return DRIVER_OK;
}

/* What the instrument's manual says a job takes. */
static int64_t scaled_ms(const struct instrument *in, double nominal_ms)
{
    return llrint(nominal_ms / in->options.speed);
}

/* A shot or a calibration has begun.  It goes on in the instrument even where the call
 * that waits for it is cancelled. */
static enum driver_result await_job(struct instrument *in, const struct answer *a,
                                    double nominal_ms, struct driver_error *error)
{
    int64_t ms = scaled_ms(in, nominal_ms);
    in->job_ends_ms = call_now_ms() + ms;
    return await(in, a, ms, in->reply_timeout_ms, error);
}

/* Ready for the next flash: the last job done, and charged after it. */
static enum driver_result await_flash(struct instrument *in, struct driver_error *error)
{
    struct answer a;
    int64_t left_ms = in->job_ends_ms - call_now_ms();
    int64_t ms = (left_ms > 0 ? left_ms : 0) + scaled_ms(in, in->options.charge_ms);
    device_wait_for_flash(in->device, &a);
    enum driver_result r = await(in, &a, ms, in->reply_timeout_ms, error);
    if (r == DRIVER_TIMEOUT)
        return driver_fail(error, DRIVER_BUSY, "ER28",
                           "the flash does not get ready: wait, then check the battery");
    return r;
}

static enum driver_result simulated_calibrate(struct instrument *in, enum driver_calibration step,
                                              struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_CALIBRATE);
    if (step != DRIVER_CALIBRATION_ZERO && step != DRIVER_CALIBRATION_WHITE)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "no such calibration");
    enum driver_result r = await_flash(in, error);
    if (r != DRIVER_OK)
        return r;
    device_calibrate(in->device, step, &a);
    return await_job(in, &a, in->options.calibrate_ms, error);
}

static enum driver_result simulated_measure(struct instrument *in, struct driver_reading *ret,
                                            struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_MEASURE);
    enum driver_result r = await_flash(in, error);
    if (r != DRIVER_OK)
        return r;
    device_measure(in->device, &a);
    r = await_job(in, &a, in->options.shot_ms, error);
    if (r == DRIVER_OK)
        r = doubt(in, &a, error);
    if (r != DRIVER_OK)
        return r;

    fill_reading(in, &a, identity_of_all.aperture_mm[in->setup.aperture], ret);
    if (a.due[DRIVER_CALIBRATION_WHITE])
        ret->warnings |= DRIVER_WARNING_CALIBRATION_OLD;
    if (!(a.temperature_C >= COLDEST_C && a.temperature_C <= WARMEST_C))
        ret->warnings |= DRIVER_WARNING_TEMPERATURE;
    return DRIVER_OK;
}

static enum driver_result simulated_wait_button(struct instrument *in, int timeout_ms,
                                                bool *pressed, struct driver_error *error)
{
    struct button *button = device_button(in->device);
    struct answer a;
    call_begin_waiting(&in->call); /* the one call that a cancellation before it reaches */
    device_expect(in->device, OPERATION_WAIT_BUTTON);
    device_enable_button(in->device, &a);
    enum driver_result r = await_reply(in, &a, error);
    if (r != DRIVER_OK)
        return r;
    for (int64_t deadline_ms = call_now_ms() + timeout_ms;;) {
        int64_t now_ms = call_now_ms();
        bool is_pressed = button_pressed(button, now_ms);
        if (is_pressed || now_ms >= deadline_ms) {
            *pressed = is_pressed;
            return DRIVER_OK;
        }
        int64_t look_ms = button_look_again_ms(button, now_ms);
        if (call_wait(&in->call, button->fifo, look_ms < deadline_ms ? look_ms : deadline_ms) ==
            CALL_CANCELLED)
            return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    }
}

static enum driver_result simulated_stored_count(struct instrument *in, size_t *ret,
                                                 struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_STORED_COUNT);
    device_count_samples(in->device, &a);
    enum driver_result r = await_reply(in, &a, error);
    if (r == DRIVER_OK)
        *ret = a.stored;
    return r;
}

static enum driver_result simulated_stored_read(struct instrument *in, size_t i,
                                                struct driver_reading *ret,
                                                struct driver_error *error)
{
    struct answer a;
    begin(in, OPERATION_STORED_READ);
    device_read_sample(in->device, i, &a);
    enum driver_result r = await_reply(in, &a, error);
    if (r == DRIVER_OK)
        r = doubt(in, &a, error);
    if (r != DRIVER_OK)
        return r;
    fill_reading(in, &a, DEVICE_SAMPLE_APERTURE_MM, ret);
    snprintf(ret->sample, sizeof ret->sample, "S%04zu", i + 1);
    return DRIVER_OK;
}

const struct driver simulated_driver = {
    .name = "simulated",
    .description = "an instrument that is not there: computed skin, faults on demand",
    .has_no_wire = true,
    .open = simulated_open,
    .close = simulated_close,
    .cancel = simulated_cancel,
    .configure = simulated_configure,
    .status = simulated_status,
    .calibrate = simulated_calibrate,
    .measure = simulated_measure,
    .wait_button = simulated_wait_button,
    .stored_count = simulated_stored_count,
    .stored_read = simulated_stored_read,
};
