/* toy.c - the conversation with a TOY-1. */
#include "drivers/toy/toy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/link/line.h"
#include "drivers/toy/toy_wire.h"

enum {
    OPEN_TIMEOUT_MS = 5000,
    REPLY_TIMEOUT_MS = 2000,
    CALIBRATION_MS = 2000, /* twice what it takes */
    SHOT_MS = 2000,        /* the same */
    QUIET_MS = 10,
};

struct instrument {
    struct call call;
    struct link *link;
    struct line_reader reader;
    struct driver_identity identity;
    int reply_timeout_ms;
    int64_t call_ends_ms; /* open() takes no longer; INT64_MAX */
    bool out_of_step;     /* an answer to an earlier call may still come, */
    int64_t late_ms;      /* until about then */
    char line[LINE_MAX_BYTES];
};

static const struct driver_identity identity_of_all = {
    .maker = "Nobody",
    .model = "TOY-1",
    .geometry = DRIVER_GEOMETRY_D8,
    .has_sce = true,
    .grid = { { TOY_FIRST_NM, TOY_STEP_NM, TOY_BANDS } },
    .grids = 1,
    .aperture_mm = { 8.0 },
    .apertures = 1,
};

/* ---- asking ------------------------------------------------------------------------- */

/* One question, one line: in->line. */
static enum driver_result ask(struct instrument *in, const char *command, int64_t job_ms,
                              struct driver_error *error)
{
    char bytes[16];
    int n = snprintf(bytes, sizeof bytes, "%s\r\n", command);
    int64_t until_ms = call_now_ms() + job_ms + in->reply_timeout_ms;
    if (until_ms > in->call_ends_ms)
        until_ms = in->call_ends_ms;
    in->out_of_step = true; /* until it has answered */
    in->late_ms = until_ms;
    enum driver_result r = link_send(in->link, LINK_SERIAL, bytes, (size_t)n, until_ms, error);
    if (r == DRIVER_OK)
        r = line_read(&in->reader, in->line, until_ms, error);
    if (r != DRIVER_OK)
        return r;
    in->out_of_step = false;
    const struct toy_code *code = toy_find_error(in->line);
    if (code != NULL)
        return driver_fail(error, code->result, code->line, "%s", code->text);
    return DRIVER_OK;
}

static enum driver_result fail_no_answer(const struct instrument *in, struct driver_error *error)
{
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "'%.40s' is no answer to what was asked: check the cable, and that no other "
                       "program uses the port",
                       in->line);
}

/* The answers come in order: what is before that to ID? was meant for somebody else. */
static enum driver_result into_step(struct instrument *in, struct driver_error *error)
{
    char serial[DRIVER_NAME_SIZE];
    int64_t now_ms = call_now_ms();
    int64_t until_ms = (in->late_ms > now_ms ? in->late_ms : now_ms) + in->reply_timeout_ms;
    enum driver_result r = link_send(in->link, LINK_SERIAL, "ID?\r\n", 5, until_ms, error);
    while (r == DRIVER_OK) {
        struct driver_error attempt;
        r = line_read(&in->reader, in->line, until_ms, &attempt);
        if (r == DRIVER_OK && toy_read_identity(in->line, serial)) {
            in->out_of_step = false;
            return DRIVER_OK;
        }
        if (r == DRIVER_PROTOCOL) /* a damaged line is nobody's either */
            r = DRIVER_OK;
        if (r != DRIVER_OK)
            *error = attempt;
    }
    return r;
}

/* How each function begins that talks. */
static enum driver_result begin(struct instrument *in, const char *call, struct driver_error *error)
{
    link_begin(in->link, call);
    in->call_ends_ms = INT64_MAX;
    enum driver_result r =
        line_resync(&in->reader, QUIET_MS, call_now_ms() + in->reply_timeout_ms, error);
    return r == DRIVER_OK && in->out_of_step ? into_step(in, error) : r;
}

/* ---- opening ------------------------------------------------------------------------ */

static enum driver_result identify(struct instrument *in, const struct driver_options *options,
                                   struct driver_error *error)
{
    static const struct link_serial serial = { .baud = 9600 };
    const struct link_wanted wanted = {
        .call = &in->call,
        .serial = &serial,
        .deadline_ms = in->call_ends_ms,
    };
    enum driver_result r = link_open(options, &wanted, &in->link, error);
    if (r != DRIVER_OK)
        return r;
    line_reader_init(&in->reader, in->link, "\r\n");
    link_begin(in->link, "open");
    r = line_resync(&in->reader, QUIET_MS, in->call_ends_ms, error);
    if (r == DRIVER_OK)
        r = ask(in, "ID?", 0, error);
    if (r != DRIVER_OK)
        return r;
    return toy_read_identity(in->line, in->identity.serial) ? DRIVER_OK : fail_no_answer(in, error);
}

static void toy_close(struct instrument *in)
{
    if (in == NULL)
        return;
    link_close(in->link);
    call_done(&in->call);
    free(in);
}

static enum driver_result toy_open(const struct driver_options *options, struct instrument **ret,
                                   struct driver_identity *identity, struct driver_error *error)
{
    struct driver_error attempt;
    struct instrument *in = calloc(1, sizeof *in);
    if (in == NULL || !call_init(&in->call)) {
        free(in);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory or no descriptor left");
    }
    in->identity = identity_of_all;
    in->reply_timeout_ms =
        options->reply_timeout_ms > 0 ? options->reply_timeout_ms : REPLY_TIMEOUT_MS;
    in->call_ends_ms =
        call_now_ms() + (options->open_timeout_ms > 0 ? options->open_timeout_ms : OPEN_TIMEOUT_MS);
    enum driver_result r = identify(in, options, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        toy_close(in);
        return r;
    }
    *identity = in->identity;
    *ret = in; /* the caller owns it now; close() gives it back */
    return DRIVER_OK;
}

static void toy_cancel(struct instrument *in)
{
    call_cancel(&in->call);
}

/* ---- setting and calibrating -------------------------------------------------------- */

static enum driver_result toy_configure(struct instrument *in, const struct driver_setup *setup,
                                        struct driver_error *error)
{
    return driver_check_setup(&in->identity, setup, error); /* there is nothing to choose */
}

static enum driver_result toy_status(struct instrument *in, struct driver_status *ret,
                                     struct driver_error *error)
{
    static const char *const place[DRIVER_CALIBRATIONS] = {
        "put the instrument on its black trap", "put the instrument on its white tile"
    };
    bool calibrated[DRIVER_CALIBRATIONS];
    enum driver_result r = begin(in, "status", error);
    if (r == DRIVER_OK)
        r = ask(in, "CAL?", 0, error);
    if (r != DRIVER_OK)
        return r;
    if (!toy_read_calibrated(in->line, calibrated))
        return fail_no_answer(in, error);
    memset(ret, 0, sizeof *ret);
    for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++) {
        ret->due[i] = !calibrated[i];
        snprintf(ret->place[i], DRIVER_TEXT_SIZE, "%s", ret->due[i] ? place[i] : "");
    }
    ret->battery_percent = -1;
    ret->temperature_C = NAN;
    return DRIVER_OK;
}

static enum driver_result toy_calibrate(struct instrument *in, enum driver_calibration step,
                                        struct driver_error *error)
{
    bool zero = step == DRIVER_CALIBRATION_ZERO;
    if (!zero && step != DRIVER_CALIBRATION_WHITE)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL, "no such calibration");
    enum driver_result r = begin(in, zero ? "calibrate zero" : "calibrate white", error);
    if (r == DRIVER_OK)
        r = ask(in, zero ? "ZERO" : "WHITE", CALIBRATION_MS, error);
    if (r != DRIVER_OK)
        return r;
    return toy_read_done(in->line) ? DRIVER_OK : fail_no_answer(in, error);
}

/* ---- measuring ---------------------------------------------------------------------- */

static enum driver_result toy_measure(struct instrument *in, struct driver_reading *ret,
                                      struct driver_error *error)
{
    int32_t raw[TOY_BANDS];
    enum driver_result r = begin(in, "measure", error);
    if (r == DRIVER_OK)
        r = ask(in, "SHOT", SHOT_MS, error);
    if (r == DRIVER_OK)
        r = doubt_fail(toy_read_shot(in->line, raw), error);
    if (r != DRIVER_OK)
        return r;
    reading_init(TOY_RAW_UNIT, 0, ret);
    reading_add(&in->identity.grid[0], raw, SPECULAR_SCE, in->identity.aperture_mm[0], ret);
    return DRIVER_OK;
}

static const struct driver_match matches[] = {
    { 0x1209, 0x0001, DRIVER_BUS_TTY },
    { .vid = 0 },
};

const struct driver toy_driver = {
    .name = "toy",
    .description = "TOY-1, which shows how to add an instrument",
    .matches = matches,
    .open = toy_open,
    .close = toy_close,
    .cancel = toy_cancel,
    .configure = toy_configure,
    .status = toy_status,
    .calibrate = toy_calibrate,
    .measure = toy_measure,
};
