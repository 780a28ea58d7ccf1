/* xrite_rci.c - opening, setting and calibrating; the table of the driver.  Shots and stored
 * samples are in shot.c, the button in press.c, asking in conversation.c. */
#include "drivers/xrite_rci/xrite_rci.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/xrite_rci/conversation.h"

enum {
    OPEN_TIMEOUT_MS = 20000,
    REPLY_TIMEOUT_MS = 15000,
    CALIBRATION_MS = 260000, /* 120 s for each tile, and the flashes */
    WAKE_UP_MS = 300,        /* what comes of an empty line, if anything */
    FIRST_REPLY_MS = 3000,   /* then said again */
    FIRST_QUIET_MS = 5,      /* behind an answer: its LF */
    LAST_WORD_MS = 200,
};

static const struct driver_identity identity_of_all = {
    .maker = "X-Rite",
    .model = "SP60/SP62/SP64",
    .geometry = DRIVER_GEOMETRY_D8,
    .has_sci = true,
    .has_sce = true,
    .has_button = true,
    .has_stored_samples = true,
    .grid = { { RCI_FIRST_NM, RCI_STEP_NM, RCI_BANDS } },
    .grids = 1,
    .aperture_mm = { 8.0, 4.0 },
    .apertures = 2,
    .max_averages = RCI_MAX_NUMBER,
};

/* ---- opening: before the line is set ------------------------------------------------ */

/* Where in n bytes an answer's status stands that has ended, by CR, LF or both. */
static const char *find_status(const char *bytes, size_t n)
{
    for (size_t i = 0; i + 5 <= n; i++)
        if (bytes[i] == '<' && bytes[i + 3] == '>' &&
            (bytes[i + 4] == '\r' || bytes[i + 4] == '\n'))
            return bytes + i;
    return NULL;
}

/* Whatever comes until an answer has ended; DRIVER_TIMEOUT for nothing. */
static enum driver_result hear(struct instrument *in, int64_t deadline_ms, char status[5],
                               struct driver_error *error)
{
    char bytes[512];
    size_t n = 0, more;
    const char *at;
    status[0] = '\0';
    do {
        struct driver_error attempt;
        enum driver_result r = link_receive(in->link, LINK_SERIAL, bytes + n, sizeof bytes - n,
                                            &more, deadline_ms, &attempt);
        if (r == DRIVER_TIMEOUT && n > 0)
            return driver_fail(error, DRIVER_PROTOCOL, NULL,
                               "what answered is no SP60, SP62 or SP64: is this the right port?");
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        n += more;
        at = find_status(bytes, n);
    } while (at == NULL && n < sizeof bytes);
    if (at == NULL)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "noise on the line: is this the right port, and the instrument set to "
                           "9600 baud?");
    memcpy(status, at, 4);
    status[4] = '\0';
    return DRIVER_OK;
}

/* Its answer ends as the instrument was set before, and may have an echo in front: only that it
 * ended matters.  Again where it is lost or damaged, as another program may have left half a line
 * in the instrument's ear. */
static enum driver_result say(struct instrument *in, const char *command,
                              struct driver_error *error)
{
    for (int damaged = 0;;) {
        char status[5] = "";
        struct driver_error attempt;
        int wait_ms = in->reply_timeout_ms < FIRST_REPLY_MS ? in->reply_timeout_ms : FIRST_REPLY_MS;
        int64_t until_ms = call_now_ms() + wait_ms;
        enum driver_result r = rci_send(in, command, error);
        if (r != DRIVER_OK)
            return r;
        r = hear(in, until_ms < in->call_ends_ms ? until_ms : in->call_ends_ms, status, &attempt);
        bool busy = r == DRIVER_OK && strcmp(status, "<14>") == 0;
        if (r == DRIVER_OK && !busy)
            return line_resync(&in->reader, FIRST_QUIET_MS, in->call_ends_ms, error);
        damaged += r == DRIVER_PROTOCOL;
        bool again = busy || r == DRIVER_TIMEOUT || damaged == 1;
        if (busy)
            driver_fail(&attempt, DRIVER_BUSY, status, "%s", rci_find_code(0x14)->text);
        if (!again || call_now_ms() >= in->call_ends_ms) {
            *error = attempt;
            return attempt.result;
        }
        r = busy ? rci_pause(in, in->call_ends_ms, error) : rci_settle(in, error);
        if (r != DRIVER_OK)
            return r;
    }
}

/* It may sleep, or have half a line of another program in its ear: an empty line first, and what
 * comes of it is nobody's.  Then how the line is. */
static enum driver_result set_line(struct instrument *in, struct driver_error *error)
{
    static const char *const commands[] = { "CE", "0009CF", "0108CF" };
    char status[5];
    struct driver_error attempt;
    int64_t until_ms = call_now_ms() + WAKE_UP_MS;
    enum driver_result r = rci_send(in, "", error);
    if (r != DRIVER_OK)
        return r;
    r = hear(in, until_ms < in->call_ends_ms ? until_ms : in->call_ends_ms, status, &attempt);
    if (r != DRIVER_OK && r != DRIVER_TIMEOUT && r != DRIVER_PROTOCOL) {
        *error = attempt;
        return r;
    }
    r = r == DRIVER_TIMEOUT ? DRIVER_OK
                            : line_resync(&in->reader, FIRST_QUIET_MS, in->call_ends_ms, error);
    for (size_t i = 0; r == DRIVER_OK && i < sizeof commands / sizeof *commands; i++)
        r = say(in, commands[i], error);
    return r;
}

/* ---- opening: setting and identifying ----------------------------------------------- */

static enum driver_result set_averages(struct instrument *in, unsigned averages,
                                       struct driver_error *error)
{
    char command[RCI_COMMAND_SIZE];
    snprintf(command, sizeof command, "%02X4BCF", averages > 1 ? averages : 1);
    return rci_command(in, command, error);
}

/* Those that two descriptions have must succeed; the others are of one, and an instrument that
 * does not know them has nothing to be switched off. */
static enum driver_result set_up(struct instrument *in, struct driver_error *error)
{
    static const struct {
        const char *command;
        bool must;
    } settings[] = {
        { "0108CF", true }, { "0009CF", false }, { "0005CF", true },
        { "0107CF", true }, { "0040CF", false }, { "0020CF", false },
    };
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        struct driver_error attempt;
        enum driver_result r = rci_command(in, settings[i].command, &attempt);
        bool unknown = r != DRIVER_OK && strncmp(attempt.code, "<1", 2) == 0; /* <11> <12> <13> */
        if (r != DRIVER_OK && (settings[i].must || !unknown)) {
            *error = attempt;
            return r;
        }
    }
    return set_averages(in, 1, error);
}

static enum driver_result identify(struct instrument *in, struct driver_error *error)
{
    struct rci_reply reply;
    enum driver_result r = rci_query(in, "00SN", RCI_TEXT, rci_deadline(in, 0), &reply, error);
    if (r != DRIVER_OK)
        return r;
    reading_plain_text(reply.data, reply.n, in->identity.serial, sizeof in->identity.serial);
    memcpy(in->identity_line, reply.data, strlen(reply.data) + 1);
    return DRIVER_OK;
}

static enum driver_result open_link(struct instrument *in, const struct driver_options *options,
                                    struct driver_error *error)
{
    static const struct link_serial serial = { .baud = 9600 };
    struct link_wanted wanted = {
        .address = options->address,
        .call = &in->call,
        .serial = &serial,
        .deadline_ms = in->call_ends_ms,
    };
    enum driver_result r = link_open(options, &wanted, &in->link, error);
    if (r != DRIVER_OK)
        return r;
    line_reader_init(&in->reader, in->link, "\r\n");
    link_begin(in->link, "open");
    return DRIVER_OK;
}

/* Nobody waits for the operator any more: the instrument shall not either. */
static void rci_close(struct instrument *in)
{
    struct driver_error ignored;
    if (in == NULL)
        return;
    if (in->link != NULL && (in->press.armed || in->out_of_step))
        (void)link_send(in->link, LINK_SERIAL, "CE\r\n", 4, call_now_ms() + LAST_WORD_MS, &ignored);
    link_close(in->link);
    call_done(&in->call);
    free(in);
}

static enum driver_result rci_open(const struct driver_options *options, struct instrument **ret,
                                   struct driver_identity *identity, struct driver_error *error)
{
    int timeout_ms = options->open_timeout_ms > 0 ? options->open_timeout_ms : OPEN_TIMEOUT_MS;
    struct driver_error attempt;
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->call)) {
        free(in);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory or no descriptor left");
    }
    in->identity = identity_of_all;
    in->due[DRIVER_CALIBRATION_ZERO] = in->due[DRIVER_CALIBRATION_WHITE] = true;
    in->call_ends_ms = call_now_ms() + timeout_ms;
    in->reply_timeout_ms =
        options->reply_timeout_ms > 0 ? options->reply_timeout_ms : REPLY_TIMEOUT_MS;
    in->shot_timeout_ms = options->shot_timeout_ms;

    enum driver_result r = open_link(in, options, &attempt);
    if (r == DRIVER_OK)
        r = set_line(in, &attempt);
    if (r == DRIVER_OK)
        r = set_up(in, &attempt);
    if (r == DRIVER_OK)
        r = identify(in, &attempt);
    if (r == DRIVER_OK)
        r = rci_note_last(in, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        rci_close(in);
        return r;
    }
    *identity = in->identity;
    *ret = in; /* the caller owns it now; close() gives it back */
    return DRIVER_OK;
}

static void rci_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

/* ---- setting and calibrating -------------------------------------------------------- */

static void all_due(struct instrument *in)
{
    in->due[DRIVER_CALIBRATION_ZERO] = in->due[DRIVER_CALIBRATION_WHITE] = true;
}

static enum driver_result configure(struct instrument *in, const struct driver_setup *setup,
                                    struct driver_error *error)
{
    enum driver_result r = rci_clear(in, error);
    if (r == DRIVER_OK)
        r = set_averages(in, setup->averages, error);
    if (r != DRIVER_OK)
        return r;
    if (setup->aperture != in->setup.aperture)
        all_due(in);
    in->setup = *setup;
    return DRIVER_OK;
}

static enum driver_result rci_configure(struct instrument *in, const struct driver_setup *setup,
                                        struct driver_error *error)
{
    struct driver_error attempt;
    enum driver_result r = driver_check_setup(&in->identity, setup, error);
    if (r != DRIVER_OK)
        return r;
    r = rci_begin(in, "configure", &attempt);
    rci_forget_press(in);
    if (r == DRIVER_OK)
        r = configure(in, setup, &attempt);
    if (r != DRIVER_OK)
        *error = attempt;
    return rci_end(in, r);
}

/* 10XD: done when it is idle again, whether it answered at the end or at once. */
static enum driver_result run_calibration(struct instrument *in, struct driver_error *error)
{
    for (bool again = false;; again = true) {
        struct rci_reply reply, idle;
        enum driver_result r = rci_clear(in, error);
        if (r != DRIVER_OK)
            return r;
        in->out_of_step = true; /* until it has answered: what ends this call ends it by CE */
        int64_t deadline_ms = rci_deadline(in, CALIBRATION_MS);
        r = rci_ask(in, "10XD", RCI_STATUS, deadline_ms, in->line[0], &reply, error);
        if (r != DRIVER_OK)
            return r;
        bool confused = rci_reaction_to(&reply) == RCI_RESEND && !again;
        r = confused ? DRIVER_OK : rci_judge(in, &reply, error);
        in->out_of_step = false;
        if (r != DRIVER_OK)
            return r;
        if (!confused)
            return rci_query(in, "00SN", RCI_TEXT, deadline_ms, &idle, error);
    }
}

/* What the white tile reflects at least from 450 nm on, with the gloss.  A ceramic tile has 0.8 and
 * more; the lightest of 130 measured skins has less than 0.5 at 450 nm. */
#define WHITE_FROM_NM 450.0
#define WHITE_LEAST 0.6

static bool is_white(const struct rci_spectra *spectra)
{
    for (size_t i = 0; i < RCI_BANDS; i++)
        if (RCI_FIRST_NM + RCI_STEP_NM * (double)i >= WHITE_FROM_NM &&
            spectra->sci[i] * RCI_RAW_UNIT < WHITE_LEAST)
            return false;
    return true;
}

static enum driver_result prove_white(struct instrument *in, struct driver_error *error)
{
    struct rci_spectra spectra;
    struct driver_error attempt;
    if (in->due[DRIVER_CALIBRATION_ZERO])
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "the zero step comes first: it runs the instrument's own calibration, "
                           "on the white tile and then the black trap");
    enum driver_result r = rci_shoot(in, &spectra, &attempt);
    if (r == DRIVER_IMPLAUSIBLE || (r == DRIVER_OK && !is_white(&spectra)))
        return driver_fail(error, DRIVER_IMPLAUSIBLE, NULL,
                           "what lies under the instrument is not white: put it on its white "
                           "tile.  If that is where it is, white and black were swapped: begin "
                           "again with the zero step");
    if (r != DRIVER_OK)
        *error = attempt;
    return r;
}

static enum driver_result rci_calibrate(struct instrument *in, enum driver_calibration step,
                                        struct driver_error *error)
{
    struct driver_error attempt;
    bool zero = step == DRIVER_CALIBRATION_ZERO;
    if (!zero && step != DRIVER_CALIBRATION_WHITE)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "no such calibration");
    enum driver_result r = rci_begin(in, zero ? "calibrate zero" : "calibrate white", &attempt);
    rci_forget_press(in);
    if (zero)
        all_due(in);
    if (r == DRIVER_OK)
        r = zero ? run_calibration(in, &attempt) : prove_white(in, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return rci_end(in, r);
    }
    in->due[step] = false;
    return DRIVER_OK;
}

/* ---- status ------------------------------------------------------------------------- */

/* Where it waits for a press, it is left waiting: the line is watched by the wait. */
static enum driver_result see_that_it_is_there(struct instrument *in, bool *busy,
                                               struct driver_error *error)
{
    struct rci_reply reply;
    *busy = false;
    if (in->press.armed)
        return DRIVER_OK;
    enum driver_result r = rci_confirm(in, "00SN", RCI_TEXT, &reply, error);
    if (r != DRIVER_OK)
        return r;
    *busy = rci_reaction_to(&reply) == RCI_WAIT;
    if (*busy || rci_reaction_to(&reply) != RCI_DONE || strcmp(reply.data, in->identity_line) == 0)
        return DRIVER_OK;
    return driver_fail(error, DRIVER_GONE, NULL,
                       "another instrument answers, '%.40s': it has to be opened anew", reply.data);
}

static void tell_places(const struct instrument *in, struct driver_status *ret)
{
    if (in->due[DRIVER_CALIBRATION_ZERO])
        snprintf(ret->place[DRIVER_CALIBRATION_ZERO], DRIVER_TEXT_SIZE,
                 "have the white tile and the black trap at hand and start: the instrument's "
                 "display asks for the white tile and then for the black trap; put it on each and "
                 "press it down");
    if (in->due[DRIVER_CALIBRATION_WHITE])
        snprintf(ret->place[DRIVER_CALIBRATION_WHITE], DRIVER_TEXT_SIZE,
                 "put the instrument on its white tile once more: it is measured, to see that the "
                 "calibration is right");
}

static enum driver_result rci_status(struct instrument *in, struct driver_status *ret,
                                     struct driver_error *error)
{
    struct driver_error attempt;
    bool busy;
    enum driver_result r = rci_begin(in, "status", &attempt);
    if (r == DRIVER_OK)
        r = see_that_it_is_there(in, &busy, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return rci_end(in, r);
    }
    memset(ret, 0, sizeof *ret);
    memcpy(ret->due, in->due, sizeof ret->due);
    tell_places(in, ret);
    ret->battery_percent = -1;
    ret->charging = busy;
    ret->temperature_C = NAN;
    return DRIVER_OK;
}

const struct driver xrite_rci_driver = {
    .name = "xrite_rci",
    .description = "X-Rite SP60, SP62, SP64 on a serial port",
    .open = rci_open,
    .close = rci_close,
    .cancel = rci_cancel,
    .configure = rci_configure,
    .status = rci_status,
    .calibrate = rci_calibrate,
    .measure = rci_measure,
    .wait_button = rci_wait_button,
    .stored_count = rci_stored_count,
    .stored_read = rci_stored_read,
};
