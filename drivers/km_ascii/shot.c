/* shot.c - one shot: flash, wait, fetch, doubt. */
#include <stdio.h>
#include <string.h>

#include "drivers/km_ascii/conversation.h"

enum {
    SHOT_MS = 7000,  /* with the reply timeout 10 s */
    FLASH_MS = 4000, /* for each flash of an average */
    LONGEST_MS = 240000,
};

static const struct driver_grid *grid(const struct instrument *in)
{
    return &in->identity.grid[0];
}

static size_t bands(const struct instrument *in)
{
    return grid(in)->n;
}

/* ---- fetching ----------------------------------------------------------------------- */

enum driver_result km_read_one(struct instrument *in, const char *question, bool first,
                               int32_t *raw, unsigned *warnings, bool *confirmed,
                               struct driver_error *error)
{
    int64_t deadline_ms = km_deadline(in, 0);
    for (int pause_ms = 0;;) {
        struct km_reply reply;
        enum driver_result r = km_confirm(in, question, bands(in), first, &reply, error);
        if (r != DRIVER_OK)
            return r;
        *confirmed = reply.ok;
        enum km_reaction reaction = km_reaction_to(in, &reply);
        if (!reply.ok && reaction == KM_WAIT && call_now_ms() < deadline_ms) {
            r = km_pause(in, &pause_ms, deadline_ms, error);
            if (r != DRIVER_OK)
                return r;
            first = false;
            continue;
        }
        /* Nobody has said whether an instrument gives a spectrum twice: the first answer is in
         * line[0], and "no data" came behind it. */
        struct km_reply once;
        if (!reply.ok && reaction == KM_EMPTY && km_read_reply(in->line[0], &once) && once.ok)
            reply = once;
        if (!reply.ok)
            return km_fail(in, &reply, error);
        *warnings = km_warnings_of(in, &reply);
        enum doubt doubt = km_read_spectrum(in->dialect, &reply, 0, bands(in), raw);
        if (doubt == DOUBT_NONE)
            doubt = doubt_spectrum(bands(in), raw, in->dialect->raw_unit);
        return doubt_fail(doubt, error);
    }
}

enum driver_result km_read_both(struct instrument *in, const char *command, struct km_spectra *ret,
                                struct driver_error *error)
{
    char question[2][KM_COMMAND_SIZE];
    unsigned sci_warnings, sce_warnings;
    bool sci_sure, sce_sure;
    for (int i = 0; i < 2; i++)
        snprintf(question[i], sizeof question[i], "%s,%d", command, i + 1);
    enum driver_result r =
        km_read_one(in, question[1], false, ret->sce, &sce_warnings, &sce_sure, error);
    if (r == DRIVER_OK)
        r = km_read_one(in, question[0], false, ret->sci, &sci_warnings, &sci_sure, error);
    if (r != DRIVER_OK)
        return r;
    ret->warnings = sci_warnings | sce_warnings;
    return doubt_fail(
        doubt_pair(bands(in), ret->sci, ret->sce, in->dialect->raw_unit, !sci_sure || !sce_sure),
        error);
}

enum doubt km_read_lines(const struct instrument *in, const struct km_reply *sci,
                         const struct km_reply *sce, struct km_spectra *ret)
{
    size_t n = bands(in);
    enum doubt doubt = km_read_spectrum(in->dialect, sci, 0, n, ret->sci);
    if (doubt == DOUBT_NONE)
        doubt = km_read_spectrum(in->dialect, sce, 0, n, ret->sce);
    if (doubt == DOUBT_NONE)
        doubt = doubt_both(n, ret->sci, ret->sce, in->dialect->raw_unit, true);
    /* Lamp and battery stay as they are from line to line: what one alone says came damaged. */
    ret->warnings = km_warnings_of(in, sci) & km_warnings_of(in, sce);
    return doubt;
}

/* ---- waiting ------------------------------------------------------------------------ */

static int64_t shot_ms(const struct instrument *in)
{
    int64_t flashes = in->settings.averages;
    int64_t ms =
        in->shot_timeout_ms > 0 ? in->shot_timeout_ms * flashes : SHOT_MS + FLASH_MS * flashes;
    int64_t most = LONGEST_MS - in->reply_timeout_ms;
    ms += in->setup.delay_ms;
    return ms < most ? ms : most;
}

/* An instrument whose battery dies in a shot never says so: it looks unfinished for ever. */
static enum driver_result fail_unfinished(const struct instrument *in, struct driver_error *error)
{
    return driver_fail(
        error, DRIVER_TIMEOUT, "ER35",
        in->voltage > 0 ? "the shot does not end, and the battery was low: it is probably empty; "
                          "charge it or connect the adapter, switch off and on"
                        : "the shot does not end: switch the instrument off and on; if it stays "
                          "so, check its battery");
}

/* Ask at once, then at growing intervals: a shot that is over is seen at once, one that is not
 * does not drown in questions. */
static enum driver_result await_end(struct instrument *in, int64_t deadline_ms,
                                    struct km_state *state, struct driver_error *error)
{
    for (int pause_ms = 0;;) {
        struct km_reply reply;
        struct driver_error attempt;
        enum driver_result r = km_ask(in, "STR", in->dialect->state_fields, in->reply_timeout_ms,
                                      in->line[0], &reply, &attempt);
        if (r == DRIVER_PROTOCOL) {
            r = km_settle(in, error);
            if (r != DRIVER_OK)
                return r;
            break;
        }
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        if (reply.ok || km_reaction_to(in, &reply) != KM_WAIT)
            break;
        if (call_now_ms() >= deadline_ms)
            return fail_unfinished(in, error);
        r = km_pause(in, &pause_ms, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
    enum driver_result r = km_query_state(in, deadline_ms, state, error);
    return r == DRIVER_BUSY ? fail_unfinished(in, error) : r;
}

/* ---- the two ways ------------------------------------------------------------------- */

static unsigned warnings_of_state(const struct km_state *state)
{
    return (state->voltage > 0 ? DRIVER_WARNING_BATTERY_LOW : 0u) |
           (state->recalibrate ? DRIVER_WARNING_CALIBRATION_OLD : 0u);
}

/* The shot had ended, and there are no data: it is not that nobody measured. */
static enum driver_result fail_without_data(struct driver_error *error)
{
    return driver_fail(error, DRIVER_REFUSED, "ER10",
                       "the shot ended without data: measure again; if it stays so, the battery is "
                       "probably empty: charge it or connect the adapter");
}

/* CM-700d.  What MES itself warns of is not taken: the flash comes later, and of all answers this
 * is the one that cannot be read twice. */
static enum driver_result shoot_and_fetch(struct instrument *in, struct km_spectra *ret,
                                          struct driver_error *error)
{
    struct km_state state = { .voltage = 0 };
    enum driver_result r = km_command(in, "MES,1", 0, KM_CHARGING_MS, error);
    if (r != DRIVER_OK)
        return r;
    in->job_ends_ms = km_deadline(in, shot_ms(in));
    r = await_end(in, in->job_ends_ms, &state, error);
    if (r == DRIVER_OK || call_now_ms() >= in->job_ends_ms)
        in->job_ends_ms = 0;
    if (r == DRIVER_OK)
        r = km_read_both(in, "MDR", ret, error);
    if (r == DRIVER_REFUSED && strcmp(error->code, "ER10") == 0)
        return fail_without_data(error);
    if (r == DRIVER_OK)
        ret->warnings |= warnings_of_state(&state);
    return r;
}

/* A line that nobody asked for may have been taken for the answer to MES: then the spectra may be
 * those of the shot before.  Once more. */
static enum driver_result shoot_in_order(struct instrument *in, struct km_spectra *ret,
                                         struct driver_error *error)
{
    for (int i = 0; i < 2; i++) {
        unsigned strays = in->strays;
        enum driver_result r = shoot_and_fetch(in, ret, error);
        if (r != DRIVER_OK || in->strays == strays)
            return r;
        r = km_settle(in, error);
        if (r != DRIVER_OK)
            return r;
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "the instrument speaks without being asked: see that no other program uses "
                       "the port");
}

/* CM-2600d: the answer to MES is SCI, then SCE. */
static enum driver_result await_lines(struct instrument *in, struct km_reply *sci,
                                      struct km_reply *sce, struct driver_error *error)
{
    int ms = (int)shot_ms(in) + in->reply_timeout_ms;
    in->job_ends_ms = call_now_ms() + ms;
    enum driver_result r = km_ask(in, "MES", bands(in), ms, in->line[0], sci, error);
    if (r == DRIVER_OK && sci->ok)
        r = km_await(in, bands(in), in->reply_timeout_ms, in->line[1], sce, error);
    if (r == DRIVER_OK)
        in->job_ends_ms = 0;
    return r;
}

static enum driver_result shoot_and_hear(struct instrument *in, struct km_spectra *ret,
                                         struct driver_error *error)
{
    int64_t deadline_ms = km_deadline(in, KM_CHARGING_MS);
    struct km_reply sci, sce;
    struct km_state state = { .voltage = 0 };
    bool again = false;
    for (int pause_ms = 0;;) {
        enum driver_result r = await_lines(in, &sci, &sce, error);
        if (r != DRIVER_OK)
            return r;
        if (sci.ok)
            break;
        enum km_reaction reaction = km_reaction_to(in, &sci);
        if (reaction == KM_WAIT && call_now_ms() < deadline_ms)
            r = km_pause(in, &pause_ms, deadline_ms, error);
        else if (reaction == KM_RESEND && !again)
            r = km_settle(in, error);
        else
            r = km_fail(in, &sci, error);
        again = again || reaction == KM_RESEND;
        if (r != DRIVER_OK)
            return r;
    }
    if (!sce.ok)
        return km_fail(in, &sce, error);
    enum driver_result r = doubt_fail(km_read_lines(in, &sci, &sce, ret), error);
    if (r != DRIVER_OK)
        return r;
    memcpy(in->press.last, in->line[1], sizeof in->press.last);
    r = km_query_state(in, km_deadline(in, 0), &state, error);
    if (r == DRIVER_OK)
        ret->warnings |= warnings_of_state(&state);
    return r;
}

/* ---- the reading -------------------------------------------------------------------- */

static enum driver_result measure(struct instrument *in, struct km_spectra *ret,
                                  struct driver_error *error)
{
    if (km_take_press(in, ret))
        return DRIVER_OK;
    enum driver_result r = km_check_settings(in, error);
    if (r != DRIVER_OK)
        return r;
    return in->dialect->mes == KM_MES_THEN_MDR ? shoot_in_order(in, ret, error)
                                               : shoot_and_hear(in, ret, error);
}

enum driver_result km_measure(struct instrument *in, struct driver_reading *ret,
                              struct driver_error *error)
{
    struct driver_error attempt;
    struct km_spectra spectra;
    enum driver_result r = km_begin(in, "measure", &attempt);
    if (r == DRIVER_OK)
        r = measure(in, &spectra, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return km_end(in, r);
    }
    double aperture_mm = in->identity.aperture_mm[in->setup.aperture];
    reading_init(in->dialect->raw_unit, spectra.warnings, ret);
    reading_add(grid(in), spectra.sce, SPECULAR_SCE, aperture_mm, ret);
    reading_add(grid(in), spectra.sci, SPECULAR_SCI, aperture_mm, ret);
    return DRIVER_OK;
}
