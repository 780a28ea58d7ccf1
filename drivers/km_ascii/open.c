/* open.c - finding the instrument at one of two settings of the line, and making it ready. */
#include <stdio.h>
#include <stdlib.h>

#include "drivers/km_ascii/conversation.h"

enum {
    OPEN_TIMEOUT_MS = 6000,
    REPLY_TIMEOUT_MS = 3000,
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
    if (r == DRIVER_PROTOCOL) {
        const struct driver_error heard = *error;
        return driver_fail(error, r, heard.code,
                           "no CM-700d, CM-2600d or CM-2500d was understood at this port: %.300s",
                           heard.text);
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

/* ---- making it ready ---------------------------------------------------------------- */

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
    return on == 1 ? km_set_user_calibration(in, false, error) : DRIVER_OK;
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
        r = km_query_settings(in, &are, error);
    if (r != DRIVER_OK)
        return r;

    km_take_areas(in, are.area);
    struct km_settings settings = km_settings_for(in, &in->setup);
    r = km_set(in, &settings, error);
    if (r == DRIVER_OK)
        r = km_command(in, dialect->button_on, 0, 0, error);
    return r == DRIVER_OK ? km_note_button(in, error) : r;
}

/* ---- opening and closing ------------------------------------------------------------ */

void km_close(struct instrument *in)
{
    if (in == NULL)
        return;
    link_close(in->link);
    call_done(&in->call);
    free(in);
}

enum driver_result km_open(const struct driver_options *options, struct instrument **ret,
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
