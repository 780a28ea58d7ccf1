/* km_ascii.c - opening, setting and calibrating; the table of the driver.  Shots are in shot.c,
 * the button in press.c, stored samples in samples.c, asking in conversation.c. */
#include "drivers/km_ascii/km_ascii.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/km_ascii/conversation.h"

enum {
    OPEN_TIMEOUT_MS = 6000,
    REPLY_TIMEOUT_MS = 3000,
    CALIBRATION_MS = 27000, /* with the reply timeout 30 s: others wait up to 20 s */
    CHARGING_MS = 20000,    /* until the flash is ready again */
};

/* ---- who is there ------------------------------------------------------------------- */

static enum driver_result fail_model(const char *model, const char *line,
                                     struct driver_error *error)
{
    if (model[0] != '\0')
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "an instrument with the model number '%s' answered, none of CM-700d "
                           "(0100), CM-2600d (03), CM-2500d (13): choose the driver for it",
                           model);
    return driver_fail(
        error, DRIVER_PROTOCOL, NULL,
        "what answered is no CM-700d, CM-2600d or CM-2500d; it said '%.40s': is this "
        "the right port?",
        line);
}

/* It may sleep, and what is left of another program's line may stand in its ear: an empty line
 * first, and what comes of it is nobody's. */
static enum driver_result wake_up(struct instrument *in, int64_t until_ms,
                                  struct driver_error *error)
{
    enum driver_result r = link_send(in->link, LINK_SERIAL, "\r\n", 2, until_ms, error);
    return r == DRIVER_OK ? km_settle(in, error) : r;
}

/* With a shot that an earlier conversation began. */
static bool is_busy(const struct km_reply *reply)
{
    const struct km_code *code = km_find_code(&km_cm700d, reply);
    return code != NULL && code->reaction == KM_WAIT;
}

static enum driver_result identify(struct instrument *in, int64_t until_ms,
                                   struct driver_error *error)
{
    struct km_reply reply;
    in->call_ends_ms = until_ms;
    enum driver_result r = wake_up(in, until_ms, error);
    for (int pause_ms = 0; r == DRIVER_OK;) {
        r = km_ask_twice(in, "IDR", KM_IDENTITY_FIELDS, &reply, error);
        if (r != DRIVER_OK || !is_busy(&reply) || call_now_ms() >= until_ms)
            break;
        r = km_pause(in, &pause_ms, until_ms, error);
    }
    if (r != DRIVER_OK)
        return r;
    in->dialect = km_read_identity(&reply, &in->identity);
    /* The two that agreed may be any of the three lines. */
    const char *line = reply.fields > 0 ? reply.field[0].at - 5 : in->line[0];
    if (in->dialect == NULL)
        return fail_model(in->identity.model, line, error);
    snprintf(in->identity_line, sizeof in->identity_line, "%s", line);
    return DRIVER_OK;
}

static enum driver_result open_link(struct instrument *in, const struct driver_options *options,
                                    const struct link_serial *serial, int64_t until_ms,
                                    struct driver_error *error)
{
    struct link_wanted wanted = {
        .address = options->address,
        .call = &in->call,
        .serial = serial,
        .deadline_ms = until_ms,
    };
    enum driver_result r = link_open(options, &wanted, &in->link, error);
    if (r == DRIVER_OK)
        line_reader_init(&in->reader, in->link, "\r\n");
    return r;
}

/* At both settings of the line, until something that we know answers.  Only a silent or unreadable
 * line is tried at the other one. */
static enum driver_result find(struct instrument *in, const struct driver_options *options,
                               int64_t deadline_ms, struct driver_error *error)
{
    static const struct {
        const struct km_dialect *dialect;
        const char *call; /* two names: a replay tells them apart */
    } tries[] = { { &km_cm700d, "open" }, { &km_cm2600d, "open 9600" } };
    struct driver_error heard = { .result = DRIVER_TIMEOUT };
    for (size_t i = 0; i < 2; i++) {
        struct driver_error attempt;
        int64_t now_ms = call_now_ms();
        int64_t until_ms = i == 0 ? now_ms + (deadline_ms - now_ms) * 2 / 5 : deadline_ms;
        enum driver_result r =
            open_link(in, options, &tries[i].dialect->serial, until_ms, &attempt);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        link_begin(in->link, tries[i].call);
        r = identify(in, until_ms, &attempt);
        if (r == DRIVER_OK)
            return DRIVER_OK;
        if (i == 0 || r != DRIVER_TIMEOUT)
            heard = attempt;
        if (r != DRIVER_TIMEOUT && r != DRIVER_PROTOCOL)
            break;
        link_close(in->link);
        in->link = NULL;
    }
    *error = heard;
    return error->result;
}

/* ---- setting ------------------------------------------------------------------------ */

static const double area_mm[2] = { 8.0, 3.0 }; /* as in dialect->area */
static const char *const area_name[2] = { "MAV (8 mm)", "SAV (3 mm)" };

static size_t index_of_area(const struct instrument *in, unsigned area)
{
    return area == in->dialect->area[0] ? 0 : 1;
}

static enum driver_result fail_slider(const struct instrument *in, unsigned wanted,
                                      const char *code, struct driver_error *error)
{
    return driver_fail(error, DRIVER_REFUSED, code,
                       "the slider for the measuring area stands elsewhere: move it to %s, then "
                       "calibrate",
                       area_name[index_of_area(in, wanted)]);
}

static enum driver_result query_settings(struct instrument *in, struct km_settings *ret,
                                         struct driver_error *error)
{
    struct km_reply reply;
    enum driver_result r =
        km_query(in, "CPR", in->dialect->settings_fields, km_deadline(in, 0), &reply, error);
    if (r == DRIVER_OK && !in->dialect->read_settings(&reply, ret))
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "the instrument's settings cannot be: is this the right driver?");
    return r;
}

/* Send them and see that they are so. */
static enum driver_result set(struct instrument *in, const struct km_settings *settings,
                              struct driver_error *error)
{
    char command[KM_COMMAND_SIZE];
    struct km_settings are;
    in->dialect->write_settings(settings, command);
    enum driver_result r = km_command(in, command, 0, CHARGING_MS, error);
    if (r == DRIVER_REFUSED && strcmp(error->code, "ER25") == 0 &&
        in->dialect->mes == KM_MES_THEN_MDR)
        return fail_slider(in, settings->area, error->code, error);
    if (r == DRIVER_OK)
        r = query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;
    if (are.area != settings->area)
        return fail_slider(in, settings->area, NULL, error);
    if (are.averages != settings->averages || are.delay_ds != settings->delay_ds)
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "the instrument does not keep its settings: leave its menu, then try "
                           "again");
    in->settings = *settings;
    return DRIVER_OK;
}

static enum driver_result set_user_calibration(struct instrument *in, bool on,
                                               struct driver_error *error)
{
    return km_command(in, on ? "USS,1" : "USS,0", 0, 0, error);
}

/* Whether our settings still hold: somebody may have used the slider or the instrument's menu. */
enum driver_result km_check_settings(struct instrument *in, struct driver_error *error)
{
    struct km_settings are;
    enum driver_result r = query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;
    if (are.area != in->settings.area)
        return fail_slider(in, in->settings.area, NULL, error);
    if (are.averages != in->settings.averages || are.delay_ds != in->settings.delay_ds)
        return set(in, &in->settings, error);
    return DRIVER_OK;
}

static struct km_settings settings_for(const struct instrument *in,
                                       const struct driver_setup *setup)
{
    return (struct km_settings){
        .area = in->area[setup->aperture],
        .delay_ds = (unsigned)(setup->delay_ms + 99) / 100,
        .averages = setup->averages > 1 ? setup->averages : 1,
    };
}

/* ---- opening ------------------------------------------------------------------------ */

static enum driver_result read_plate(struct instrument *in, struct driver_error *error)
{
    struct km_reply reply;
    enum driver_result r = km_ask_twice(in, "CIR", 1, &reply, error);
    if (r == DRIVER_OK && reply.ok) /* none given: "" */
        km_read_text(reply.field[0], in->identity.white_tile, sizeof in->identity.white_tile);
    return r;
}

/* DFS,0: year, month, day.  What the instrument says to it is of no matter, see km_ascii.h. */
static enum driver_result set_clock(struct instrument *in, struct driver_error *error)
{
    char command[KM_COMMAND_SIZE];
    struct km_reply reply;
    km_write_clock(link_realtime_s(in->link), command);
    enum driver_result r = km_ask(in, "DFS,0", 0, in->reply_timeout_ms, in->line[0], &reply, error);
    if (r == DRIVER_OK)
        r = km_ask(in, command, 0, in->reply_timeout_ms, in->line[0], &reply, error);
    return r == DRIVER_PROTOCOL ? km_settle(in, error) : r;
}

static enum driver_result no_user_calibration(struct instrument *in, struct driver_error *error)
{
    struct km_reply reply;
    unsigned on;
    enum driver_result r = km_query(in, "USR", 1, km_deadline(in, 0), &reply, error);
    if (r != DRIVER_OK)
        return r;
    if (!km_read_unsigned(reply.field[0], 1, &on))
        return driver_fail(error, DRIVER_PROTOCOL, NULL, "the answer to USR is no 0 or 1");
    return on == 1 ? set_user_calibration(in, false, error) : DRIVER_OK;
}

/* From whatever state it is in to grid 0, aperture 0, one flash, button on. */
static enum driver_result prepare(struct instrument *in, struct driver_error *error)
{
    const struct km_dialect *dialect = in->dialect;
    struct km_settings are;
    struct km_state state;
    enum driver_result r = km_query_state(in, km_deadline(in, 0), &state, error);
    if (r == DRIVER_OK && dialect->has_clock)
        r = set_clock(in, error);
    if (r == DRIVER_OK && dialect->has_plate_id)
        r = read_plate(in, error);
    if (r == DRIVER_OK && dialect->white_user != NULL)
        r = no_user_calibration(in, error);
    if (r == DRIVER_OK)
        r = query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;

    size_t first = index_of_area(in, are.area);
    for (size_t i = 0; i < 2; i++) {
        in->area[i] = dialect->area[first ^ i];
        in->identity.aperture_mm[i] = area_mm[first ^ i];
    }
    struct km_settings settings = settings_for(in, &in->setup);
    r = set(in, &settings, error);
    if (r == DRIVER_OK)
        r = km_command(in, dialect->button_on, 0, 0, error);
    return r == DRIVER_OK ? km_note_button(in, error) : r;
}

static void km_close(struct instrument *in)
{
    if (in == NULL)
        return;
    link_close(in->link);
    call_done(&in->call);
    free(in);
}

static enum driver_result km_open(const struct driver_options *options, struct instrument **ret,
                                  struct driver_identity *identity, struct driver_error *error)
{
    int64_t deadline_ms =
        call_now_ms() + (options->open_timeout_ms > 0 ? options->open_timeout_ms : OPEN_TIMEOUT_MS);
    struct driver_error attempt;
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->call)) {
        free(in);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory or no descriptor left");
    }
    in->reply_timeout_ms =
        options->reply_timeout_ms > 0 ? options->reply_timeout_ms : REPLY_TIMEOUT_MS;
    in->shot_timeout_ms = options->shot_timeout_ms;

    enum driver_result r = find(in, options, deadline_ms, &attempt);
    in->call_ends_ms = deadline_ms;
    if (r == DRIVER_OK)
        r = prepare(in, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        km_close(in);
        return r;
    }
    *identity = in->identity;
    *ret = in; /* the caller owns it now; close() gives it back */
    return DRIVER_OK;
}

static void km_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

/* ---- what the contract asks for ----------------------------------------------------- */

static enum driver_result configure(struct instrument *in, const struct driver_setup *setup,
                                    struct driver_error *error)
{
    struct km_settings settings = settings_for(in, setup);
    bool other = setup->user_calibration != in->setup.user_calibration;
    enum driver_result r = DRIVER_OK;
    if (other)
        r = set_user_calibration(in, setup->user_calibration, error);
    if (r != DRIVER_OK)
        return r;
    r = set(in, &settings, error);
    if (r == DRIVER_OK) {
        in->setup = *setup;
        return DRIVER_OK;
    }
    struct driver_error undone; /* as it was, as far as the instrument lets us */
    if (other && r == DRIVER_REFUSED)
        (void)set_user_calibration(in, in->setup.user_calibration, &undone);
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
        return km_command(in, dialect->zero, CALIBRATION_MS, CHARGING_MS, error);
    if (state.due[DRIVER_CALIBRATION_ZERO])
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "zero calibration comes first: put the instrument on the zero "
                           "calibration box and calibrate zero");
    return km_command(in, in->setup.user_calibration ? dialect->white_user : dialect->white,
                      CALIBRATION_MS, CHARGING_MS, error);
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
