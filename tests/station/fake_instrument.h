/* fake_instrument.h - a driver that does what the test says, and notes what it was asked.
 *
 * There is one of it.  A test sets the script before the unit is opened, or while it knows
 * the thread to be waiting; the counters may be read at any time. */
#ifndef SKINSPEC_TESTS_STATION_FAKE_INSTRUMENT_H
#define SKINSPEC_TESTS_STATION_FAKE_INSTRUMENT_H

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "drivers/call.h"
#include "drivers/driver.h"

enum { FAKE_MAX_OPENS = 16 };

/* What a shot does: it ends at once with a result, or FAKE_SLOW: takes 20 s unless it is cancelled,
 * or FAKE_HANGS: until the test lets go, whatever happens. */
enum { FAKE_SLOW = 100, FAKE_HANGS = 101 };

struct fake {
    /* the script */
    enum driver_result open_result[FAKE_MAX_OPENS]; /* of the first ones; then DRIVER_OK */
    bool has_button;
    atomic_int configure_result, status_result, calibrate_result, measure_result, wait_result;
    atomic_int battery_percent;
    atomic_bool charging, white_due;
    int press[2];           /* a pipe: whatever is written to it is a press */
    void (*on_press)(void); /* called when a wait has seen one and is about to say so */
    atomic_bool let_go;     /* a shot that hangs: it ends with... */
    atomic_int hang_result;

    /* what happened */
    atomic_int opens, closes, configures, statuses, calibrations, shots, waits;
    atomic_int inside;  /* calls at the same time */
    atomic_bool broken; /* two at once, or one without an instrument */
    atomic_size_t grid;
    int64_t opened_at_ms[FAKE_MAX_OPENS];
};

struct instrument {
    struct call call;
};

static struct fake fake;

static inline void fake_begin(const struct instrument *in)
{
    if (in == NULL || atomic_fetch_add(&fake.inside, 1) != 0)
        atomic_store(&fake.broken, true);
}

static inline enum driver_result fake_end(int result, struct driver_error *error)
{
    atomic_fetch_sub(&fake.inside, 1);
    if (result == DRIVER_OK)
        return DRIVER_OK;
    return driver_fail(error, (enum driver_result)result, "F1", "fake: %s",
                       driver_result_name((enum driver_result)result));
}

static enum driver_result fake_open(const struct driver_options *options, struct instrument **ret,
                                    struct driver_identity *identity, struct driver_error *error)
{
    int n = atomic_load(&fake.opens);
    if (n < FAKE_MAX_OPENS)
        fake.opened_at_ms[n] = call_now_ms();
    atomic_store(&fake.opens, n + 1);
    if (n < FAKE_MAX_OPENS && fake.open_result[n] != DRIVER_OK)
        return driver_fail(error, fake.open_result[n], NULL, "fake: cannot be opened");
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->call))
        abort();
    *identity = (struct driver_identity){ .maker = "fake", .has_button = fake.has_button };
    strncpy(identity->serial, options->address, sizeof identity->serial - 1);
    *ret = in;
    return DRIVER_OK;
}

static void fake_close(struct instrument *in)
{
    if (in == NULL)
        return;
    atomic_fetch_add(&fake.closes, 1);
    call_done(&in->call);
    free(in);
}

static void fake_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

static enum driver_result fake_configure(struct instrument *in, const struct driver_setup *setup,
                                         struct driver_error *error)
{
    fake_begin(in);
    call_begin(&in->call);
    atomic_fetch_add(&fake.configures, 1);
    int result = atomic_load(&fake.configure_result);
    if (result == DRIVER_OK)
        atomic_store(&fake.grid, setup->grid);
    return fake_end(result, error);
}

static enum driver_result fake_status(struct instrument *in, struct driver_status *ret,
                                      struct driver_error *error)
{
    fake_begin(in);
    call_begin(&in->call);
    atomic_fetch_add(&fake.statuses, 1);
    int result = atomic_load(&fake.status_result);
    if (result == DRIVER_OK) {
        memset(ret, 0, sizeof *ret);
        ret->battery_percent = atomic_load(&fake.battery_percent);
        ret->charging = atomic_load(&fake.charging);
        ret->due[DRIVER_CALIBRATION_WHITE] = atomic_load(&fake.white_due);
    }
    return fake_end(result, error);
}

static enum driver_result fake_calibrate(struct instrument *in, enum driver_calibration step,
                                         struct driver_error *error)
{
    (void)step;
    fake_begin(in);
    call_begin(&in->call);
    atomic_fetch_add(&fake.calibrations, 1);
    return fake_end(atomic_load(&fake.calibrate_result), error);
}

static enum driver_result fake_measure(struct instrument *in, struct driver_reading *ret,
                                       struct driver_error *error)
{
    fake_begin(in);
    call_begin(&in->call);
    atomic_fetch_add(&fake.shots, 1);
    int result = atomic_load(&fake.measure_result);
    while (result == FAKE_HANGS && !atomic_load(&fake.let_go))
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    if (result == FAKE_HANGS)
        result = atomic_load(&fake.hang_result);
    if (result == FAKE_SLOW)
        result = call_wait(&in->call, -1, call_now_ms() + 20000) == CALL_CANCELLED
                     ? DRIVER_CANCELLED
                     : DRIVER_TIMEOUT;
    if (result == DRIVER_OK)
        ret->raw_unit = 0.25; /* to be recognized */
    return fake_end(result, error);
}

static enum driver_result fake_wait_button(struct instrument *in, int timeout_ms, bool *pressed,
                                           struct driver_error *error)
{
    char bytes[64];
    fake_begin(in);
    call_begin_waiting(&in->call);
    atomic_fetch_add(&fake.waits, 1);
    int result = atomic_load(&fake.wait_result);
    if (result != DRIVER_OK)
        return fake_end(result, error);
    switch (call_wait(&in->call, fake.press[0], call_now_ms() + timeout_ms)) {
    case CALL_CANCELLED:
        return fake_end(DRIVER_CANCELLED, error);
    case CALL_READABLE:
        *pressed = read(fake.press[0], bytes, sizeof bytes) > 0;
        if (fake.on_press != NULL)
            fake.on_press();
        break;
    case CALL_DEADLINE:
        *pressed = false;
        break;
    }
    return fake_end(DRIVER_OK, error);
}

static const struct driver fake_driver = {
    .name = "fake",
    .description = "does what the test says",
    .open = fake_open,
    .close = fake_close,
    .cancel = fake_cancel,
    .configure = fake_configure,
    .status = fake_status,
    .calibrate = fake_calibrate,
    .measure = fake_measure,
    .wait_button = fake_wait_button,
};

static inline void fake_press(void)
{
    if (write(fake.press[1], "x", 1) != 1)
        abort();
}

/* A sound one with a button; what is not zero has to be put back by hand. */
static inline void fake_set_up(void)
{
    memset(&fake, 0, sizeof fake);
    fake.has_button = true;
    atomic_store(&fake.battery_percent, 80);
    if (pipe(fake.press) != 0)
        abort();
}

static inline void fake_tear_down(void)
{
    close(fake.press[0]);
    close(fake.press[1]);
}

#endif
