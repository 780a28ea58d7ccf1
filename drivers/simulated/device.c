/* device.c - the life of the simulated instrument: calibration, flash, battery,
 * noise, and what goes wrong.  Options are named as in simulated.h. */
#include "drivers/simulated/device.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "drivers/call.h"
#include "drivers/simulated/chance.h"
#include "drivers/simulated/simulated.h"
#include "drivers/simulated/skin.h"

/* The instrument's own figures: low below 20 %, off below 5 %. */
#define BATTERY_LOW 20.0
#define BATTERY_EMPTY 5.0
#define COMMAND_MS 5.0           /* an answer that needs no work */
#define FULL_SCALE 20000.0       /* counts */
#define SAMPLE_STREAM 0x40000000 /* stored samples are not among the shots */

struct device {
    struct options options;
    struct skin *skin;
    struct button button;
    struct driver_grid grid;
    double aperture_mm;
    double level, tilt; /* what makes this unit differ from others */

    size_t calls[OPERATIONS];
    enum fault fault; /* of the call in progress */
    bool gone;

    bool calibrated[DRIVER_CALIBRATIONS];
    double white_since_s; /* CLOCK_BOOTTIME: goes on in suspend */
    size_t shots, shots_since_white;
    double battery_percent;
    int64_t flash_ready_ms;
};

/* ---- time ---------------------------------------------------------------------------- */

static double boot_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_BOOTTIME, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int64_t scaled_ms(const struct device *d, double ms)
{
    return llrint(ms / d->options.speed); /* 0 at infinite speed */
}

/* ---- answers --------------------------------------------------------------------------- */

static void set_code(struct answer *a, const char *code)
{
    snprintf(a->code, sizeof a->code, "%s", code);
}

/* An answer that takes takes_ms, unless something is planned. */
static void begin_answer(struct device *d, double takes_ms, struct answer *ret)
{
    *ret = (struct answer){ .at_ms = call_now_ms() + scaled_ms(d, takes_ms) };
    set_code(ret, "OK00");
    if (d->fault == FAULT_GONE)
        d->gone = true;
    ret->gone = d->gone;
    if (d->fault == FAULT_SLOW)
        ret->at_ms += scaled_ms(d, d->options.slow_ms);
    if (d->fault == FAULT_SILENCE)
        ret->at_ms = DEVICE_NEVER;
    if (d->fault == FAULT_GARBAGE)
        set_code(ret, "\x7f"
                      "U~");
}

/* Whether it does what it is asked: in the other cases nothing changes in it. */
static bool is_sound(const struct answer *a)
{
    return !a->gone && a->at_ms != DEVICE_NEVER && a->code[0] == 'O';
}

static bool white_is_overdue(const struct device *d)
{
    return d->shots_since_white >= (size_t)d->options.calibration_shots ||
           boot_s() - d->white_since_s >= 60.0 * d->options.calibration_minutes;
}

static void add_state(const struct device *d, struct answer *a)
{
    a->due[DRIVER_CALIBRATION_ZERO] = !d->calibrated[DRIVER_CALIBRATION_ZERO];
    a->due[DRIVER_CALIBRATION_WHITE] =
        !d->calibrated[DRIVER_CALIBRATION_WHITE] || white_is_overdue(d);
    a->battery_percent = d->battery_percent;
    a->temperature_C = d->options.temperature_C;
    a->charging = d->flash_ready_ms > call_now_ms();
}

/* ---- life -------------------------------------------------------------------------------- */

static void forget_calibration(struct device *d)
{
    d->calibrated[DRIVER_CALIBRATION_ZERO] = false;
    d->calibrated[DRIVER_CALIBRATION_WHITE] = false;
}

int device_open(const struct options *options, struct device **ret, struct driver_error *error)
{
    enum fault fault = options_fault(options, OPERATION_OPEN, 1);
    if (fault == FAULT_BUSY)
        return EBUSY;
    if (fault == FAULT_NO_PERMISSION)
        return EACCES;

    struct device *d = calloc(1, sizeof *d);
    if (d == NULL)
        return ENOMEM;
    d->options = *options;
    d->battery_percent = options->battery;
    struct chance unit = chance_of(chance_seed(options->serial), 0);
    d->level = options->unit * chance_gauss(&unit);
    d->tilt = options->unit * chance_gauss(&unit);

    int failed = 0;
    double every_ms = options->button_ms > 0.0 ? fmax(options->button_ms / options->speed, 1.0) : 0;
    if (!button_init(&d->button, d->options.button_file, llrint(every_ms), call_now_ms()))
        failed = errno;
    else if (skin_open(options, &d->skin, error) != DRIVER_OK)
        failed = EINVAL;
    if (failed != 0) {
        device_close(d);
        return failed;
    }
    *ret = d;
    return 0;
}

void device_close(struct device *d)
{
    if (d == NULL)
        return;
    button_done(&d->button);
    skin_close(d->skin);
    free(d);
}

void device_expect(struct device *d, enum operation operation)
{
    d->fault = options_fault(&d->options, operation, ++d->calls[operation]);
}

struct button *device_button(struct device *d)
{
    return &d->button;
}

/* Light the flash once.  false with the answer's code set where it cannot. */
static bool flash(struct device *d, struct answer *a)
{
    if (d->fault == FAULT_BATTERY)
        d->battery_percent = 0.0;
    if (d->battery_percent < BATTERY_EMPTY) {
        set_code(a, "ER02");
        return false;
    }
    if (d->fault == FAULT_LAMP) {
        set_code(a, "ER05");
        return false;
    }
    d->battery_percent = fmax(d->battery_percent - d->options.drain, 0.0);
    d->flash_ready_ms = a->at_ms + scaled_ms(d, d->options.charge_ms);
    bool weak = d->fault == FAULT_WEAK_LAMP, low = d->battery_percent < BATTERY_LOW;
    set_code(a, weak ? low ? "OK04" : "OK02" : low ? "OK03" : "OK00");
    return true;
}

/* ---- what the sensor sees ------------------------------------------------------------------ */

static double counts_of(double reflectance)
{
    double counts = nearbyint(reflectance / SIMULATED_RAW_UNIT);
    return fmin(fmax(counts, 0.0), FULL_SCALE);
}

/* One spot through port and sphere; each shot has a stream of chance of its own.  drifted: what
 * the level was multiplied by since the calibration. */
static void expose(const struct device *d, size_t shot, uint64_t stream, double aperture_mm,
                   double drifted, struct answer *a)
{
    const struct options *o = &d->options;
    struct chance chance = chance_of((uint64_t)o->seed, stream);
    double placed = 1.0 + o->placement * chance_gauss(&chance);
    double R[DEVICE_MAX_BANDS];
    skin_reflectance(d->skin, shot, &d->grid, R);
    a->bands = d->grid.n;
    for (size_t i = 0; i < d->grid.n; i++) {
        double nm = d->grid.first_nm + (double)i * d->grid.step_nm;
        double diffuse = R[i] * skin_port_share(aperture_mm, nm) * placed;
        double gain = (1.0 + d->level + d->tilt * (nm - 550.0) / 150.0) * drifted;
        double sci = (diffuse + skin_surface(o->surface, nm)) * gain;
        a->sce[i] = counts_of(diffuse * gain + o->noise * chance_gauss(&chance));
        a->sci[i] = counts_of(sci + o->noise * chance_gauss(&chance));
    }
}

static void spoil(const struct device *d, struct answer *a)
{
    if (d->fault == FAULT_WRONG_BANDS)
        a->bands--;
    if (d->fault == FAULT_NAN)
        a->sce[a->bands / 2] = NAN;
    for (size_t i = 0; d->fault == FAULT_ALL_ZERO && i < a->bands; i++)
        a->sce[i] = a->sci[i] = 0.0;
}

/* ---- the commands ---------------------------------------------------------------------------- */

void device_identify(struct device *d, struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
}

void device_set(struct device *d, const struct driver_grid *grid, double aperture_mm,
                struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
    if (!is_sound(ret))
        return;
    if (aperture_mm != d->aperture_mm)
        forget_calibration(d);
    d->grid = *grid;
    d->aperture_mm = aperture_mm;
}

void device_status(struct device *d, struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
    add_state(d, ret);
}

void device_calibrate(struct device *d, enum driver_calibration step, struct answer *ret)
{
    begin_answer(d, d->options.calibrate_ms, ret);
    if (!is_sound(ret))
        return;
    if (step == DRIVER_CALIBRATION_WHITE && !d->calibrated[DRIVER_CALIBRATION_ZERO]) {
        set_code(ret, "ER07");
        return;
    }
    if (!flash(d, ret))
        return;
    if (d->fault == FAULT_SWAPPED) {
        set_code(ret, "ER11");
        return;
    }
    if (step == DRIVER_CALIBRATION_ZERO) /* white was seen with the zero before */
        forget_calibration(d);
    d->calibrated[step] = true;
    d->white_since_s = boot_s();
    d->shots_since_white = 0;
}

void device_wait_for_flash(struct device *d, struct answer *ret)
{
    *ret = (struct answer){ .at_ms = d->flash_ready_ms, .gone = d->gone };
    if (d->fault == FAULT_CHARGE)
        ret->at_ms = DEVICE_NEVER;
    set_code(ret, "OK00");
}

void device_measure(struct device *d, struct answer *ret)
{
    begin_answer(d, d->options.shot_ms, ret);
    if (!is_sound(ret))
        return;
    if (d->fault == FAULT_EXPIRED)
        d->calibrated[DRIVER_CALIBRATION_WHITE] = false;
    bool has_white = d->calibrated[DRIVER_CALIBRATION_WHITE];
    if (!has_white || (white_is_overdue(d) && !d->options.warns_when_overdue)) {
        set_code(ret, d->calibrated[DRIVER_CALIBRATION_ZERO] ? "ER24" : "ER07");
        return;
    }
    if (!flash(d, ret))
        return;
    add_state(d, ret);
    expose(d, d->shots, d->shots, d->aperture_mm,
           fmax(1.0 + d->options.drift * (double)d->shots_since_white, 0.0), ret);
    spoil(d, ret);
    d->shots++;
    d->shots_since_white++;
}

void device_enable_button(struct device *d, struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
}

void device_count_samples(struct device *d, struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
    ret->stored = (size_t)d->options.stored;
}

void device_read_sample(struct device *d, size_t i, struct answer *ret)
{
    begin_answer(d, COMMAND_MS, ret);
    if (!is_sound(ret))
        return;
    if (i >= (size_t)d->options.stored) {
        set_code(ret, "ER10");
        return;
    }
    add_state(d, ret);
    expose(d, i, SAMPLE_STREAM + i, DEVICE_SAMPLE_APERTURE_MM, 1.0, ret);
    spoil(d, ret);
}
