/* km_ascii.c - setup, status, calibrating, and the table of the driver.  Opening is in open.c,
 * settings in settings.c, shots in shot.c, the button in press.c, stored samples in samples.c,
 * asking in conversation.c. */
#include "drivers/km_ascii/km_ascii.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drivers/km_ascii/conversation.h"

enum {
    CALIBRATION_MS = 27000, /* with the reply timeout 30 s: others wait up to 20 s */
};

static void km_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

/* ---- setting ------------------------------------------------------------------------ */

static enum driver_result configure(struct instrument *in, const struct driver_setup *setup,
                                    struct driver_error *error)
{
    struct km_settings settings = km_settings_for(in, setup);
    bool other = setup->user_calibration != in->setup.user_calibration;
    enum driver_result r = DRIVER_OK;
    if (other)
        r = km_set_user_calibration(in, setup->user_calibration, error);
    if (r != DRIVER_OK)
        return r;
    r = km_set(in, &settings, error);
    if (r == DRIVER_OK) {
        in->setup = *setup;
        return DRIVER_OK;
    }
    struct driver_error undone; /* as it was, as far as the instrument lets us */
    if (other && r == DRIVER_REFUSED)
        (void)km_set_user_calibration(in, in->setup.user_calibration, &undone);
    return r;
}

static enum driver_result km_configure(struct instrument *in, const struct driver_setup *setup,
                                       struct driver_error *error)
{
    struct driver_error attempt;
    enum driver_result r = driver_check_setup(&in->identity, setup, error);
    if (r != DRIVER_OK)
        return r;
    r = km_begin(in, "configure", &attempt);
    km_forget_press(in);
    if (r == DRIVER_OK)
        r = configure(in, setup, &attempt);
    if (r != DRIVER_OK)
        *error = attempt;
    return km_end(in, r);
}

/* ---- status and calibrating --------------------------------------------------------- */

/* A shot that a cancelled call left behind goes on: its end is waited for. */
static int64_t job_left_ms(const struct instrument *in)
{
    int64_t left = in->job_ends_ms - call_now_ms();
    return left > 0 ? left : 0;
}

static bool is_white_due(const struct instrument *in, const struct km_state *state)
{
    return state->recalibrate || state->due[DRIVER_CALIBRATION_WHITE] ||
           (in->setup.user_calibration && state->user_due);
}

static void tell_places(const struct instrument *in, struct driver_status *ret)
{
    char *zero = ret->place[DRIVER_CALIBRATION_ZERO], *white = ret->place[DRIVER_CALIBRATION_WHITE];
    const char *tile = in->identity.white_tile;
    if (ret->due[DRIVER_CALIBRATION_ZERO])
        snprintf(zero, DRIVER_TEXT_SIZE,
                 "put the instrument on the zero calibration box, or aim it into open air, a metre "
                 "from anything");
    if (!ret->due[DRIVER_CALIBRATION_WHITE])
        return;
    if (in->setup.user_calibration)
        snprintf(white, DRIVER_TEXT_SIZE, "put the instrument flat on your own standard");
    else
        snprintf(white, DRIVER_TEXT_SIZE,
                 "put the instrument flat on its white calibration plate%s%s",
                 tile[0] != '\0' ? " " : "", tile);
}

static enum driver_result km_status(struct instrument *in, struct driver_status *ret,
                                    struct driver_error *error)
{
    static const int percent[3] = { 100, 15, 0 };
    struct driver_error attempt;
    struct km_state state;
    enum driver_result r = km_begin(in, "status", &attempt);
    if (r == DRIVER_OK)
        r = km_query_state(in, km_deadline(in, job_left_ms(in)), &state, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return km_end(in, r);
    }
    memset(ret, 0, sizeof *ret);
    ret->due[DRIVER_CALIBRATION_ZERO] = state.due[DRIVER_CALIBRATION_ZERO];
    ret->due[DRIVER_CALIBRATION_WHITE] = is_white_due(in, &state);
    tell_places(in, ret);
    ret->battery_percent = percent[state.voltage];
    ret->charging = !state.flash_ready;
    ret->temperature_C = NAN;
    return DRIVER_OK;
}

static enum driver_result calibrate(struct instrument *in, enum driver_calibration step,
                                    struct driver_error *error)
{
    const struct km_dialect *dialect = in->dialect;
    struct km_state state;
    enum driver_result r = km_query_state(in, km_deadline(in, job_left_ms(in)), &state, error);
    if (r != DRIVER_OK)
        return r;
    if (step == DRIVER_CALIBRATION_ZERO)
        return km_command(in, dialect->zero, CALIBRATION_MS, KM_CHARGING_MS, error);
    if (state.due[DRIVER_CALIBRATION_ZERO])
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "zero calibration comes first: put the instrument on the zero "
                           "calibration box and calibrate zero");
    return km_command(in, in->setup.user_calibration ? dialect->white_user : dialect->white,
                      CALIBRATION_MS, KM_CHARGING_MS, error);
}

static enum driver_result km_calibrate(struct instrument *in, enum driver_calibration step,
                                       struct driver_error *error)
{
    struct driver_error attempt;
    if (step != DRIVER_CALIBRATION_ZERO && step != DRIVER_CALIBRATION_WHITE)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "no such calibration");
    enum driver_result r = km_begin(
        in, step == DRIVER_CALIBRATION_ZERO ? "calibrate zero" : "calibrate white", &attempt);
    km_forget_press(in);
    if (r == DRIVER_OK)
        r = calibrate(in, step, &attempt);
    if (r != DRIVER_OK)
        *error = attempt;
    return km_end(in, r);
}

static const struct driver_match matches[] = {
    { 0x132b, 0, DRIVER_BUS_TTY }, /* Konica Minolta */
    { 0, 0, DRIVER_BUS_TTY },
};

const struct driver km_ascii_driver = {
    .name = "km_ascii",
    .description = "Konica Minolta CM-700d, CM-2600d, CM-2500d on a serial port",
    .matches = matches,
    .open = km_open,
    .close = km_close,
    .cancel = km_cancel,
    .configure = km_configure,
    .status = km_status,
    .calibrate = km_calibrate,
    .measure = km_measure,
    .wait_button = km_wait_button,
    .stored_count = km_stored_count,
    .stored_read = km_stored_read,
};
