/* press.c - the instrument's own button.
 *
 * A CM-2600d sends the two lines of the shot that a press makes, unasked.  How a CM-700d tells is
 * published nowhere: any line that comes unasked is taken for it, and RDR,1 is asked once a
 * second, which gives the spectrum of the last press (ER10: none yet). */
#include <string.h>

#include "drivers/km_ascii/conversation.h"

enum {
    POLL_MS = 1000,
    BUSY_POLL_MS = 250, /* while the shot of a press is being made */
    OLD_LINES = 64,     /* more is no instrument */
};

static size_t bands(const struct instrument *in)
{
    return in->identity.grid[0].n;
}

void km_forget_press(struct instrument *in)
{
    in->press.ready = false;
}

static void note_press(struct instrument *in, int64_t since_ms)
{
    in->press.pressed = true;
    in->press.since_ms = since_ms;
}

/* ---- CM-2600d: lines unasked -------------------------------------------------------- */

/* SCI, then SCE; the shot before may have come twice. */
static void note_half(struct instrument *in, const char *line, const struct km_reply *sce)
{
    struct km_press *press = &in->press;
    struct km_reply sci;
    if (strcmp(line, press->last) == 0)
        return;
    if (press->first[0] == '\0') {
        memcpy(press->first, line, strlen(line) + 1);
        press->since_ms = INT64_MIN; /* who was not waiting does not know when */
        return;
    }
    press->pressed = true;
    press->has_spectra = km_read_reply(press->first, &sci) &&
                         km_read_lines(in, &sci, sce, &press->spectra) == DOUBT_NONE;
    press->first[0] = '\0';
    memcpy(press->last, line, strlen(line) + 1);
}

void km_note_stray(struct instrument *in, const char *line, const struct km_reply *reply)
{
    in->strays++;
    if (in->dialect != NULL && in->dialect->mes == KM_MES_ANSWERS && reply->ok &&
        reply->fields == bands(in))
        note_half(in, line, reply);
}

static bool is_last_press(const struct instrument *in, const struct km_reply *reply)
{
    int32_t sci[KM_MAX_FIELDS];
    return in->press.has_last &&
           km_read_spectrum(in->dialect, reply, 0, bands(in), sci) == DOUBT_NONE &&
           memcmp(sci, in->press.last_sci, bands(in) * sizeof *sci) == 0;
}

/* The answer to a look that was given up: nothing new, or the spectrum of a press, which may be
 * told once only. */
static bool is_late(struct instrument *in, const struct km_reply *reply)
{
    if (!in->poll_unanswered || (reply->ok && reply->fields != bands(in)))
        return false;
    in->poll_unanswered = false;
    return !reply->ok || is_last_press(in, reply);
}

/* A line in a wait. */
static enum driver_result take_line(struct instrument *in, const char *line,
                                    struct driver_error *error)
{
    struct km_reply reply;
    (void)error;
    if (!km_read_reply(line, &reply) || km_find_code(in->dialect, &reply) == NULL ||
        km_reaction_to(in, &reply) == KM_RESEND)
        return DRIVER_OK; /* another program's, or noise */
    if (is_late(in, &reply))
        return DRIVER_OK;
    if (!reply.ok || in->dialect->mes == KM_MES_THEN_MDR) {
        /* A press that could not be measured is one nevertheless: measure() will say why. */
        in->press.has_spectra = false;
        note_press(in, call_now_ms());
        return DRIVER_OK;
    }
    bool half = in->press.first[0] != '\0';
    km_note_stray(in, line, &reply);
    if (!half)
        in->press.since_ms = call_now_ms();
    return DRIVER_OK;
}

/* ---- CM-700d: asking ---------------------------------------------------------------- */

/* RDR gives each of its spectra once or for as long as there is no other; nobody has said which.
 * The first answer is in line[0]. */
static enum driver_result fetch(struct instrument *in, struct km_spectra *ret, bool *sound,
                                struct driver_error *error)
{
    struct driver_error attempt;
    unsigned warnings;
    bool sci_sure, sce_sure;
    enum driver_result r =
        km_read_one(in, "RDR,1", true, ret->sci, &ret->warnings, &sci_sure, &attempt);
    bool other = r == DRIVER_OK &&
                 !(in->press.has_last &&
                   memcmp(ret->sci, in->press.last_sci, bands(in) * sizeof *ret->sci) == 0);
    *sound = false;
    if (r == DRIVER_OK && !other)
        return DRIVER_OK; /* it was damaged, and is the old one */
    if (r == DRIVER_OK) {
        memcpy(in->press.last_sci, ret->sci, bands(in) * sizeof *ret->sci);
        in->press.has_last = true;
        if (!in->press.pressed)
            note_press(in, in->press.looked_ms);
        r = km_read_one(in, "RDR,2", false, ret->sce, &warnings, &sce_sure, &attempt);
        ret->warnings |= warnings;
    }
    if (r == DRIVER_OK)
        *sound = doubt_pair(bands(in), ret->sci, ret->sce, in->dialect->raw_unit,
                            !sci_sure || !sce_sure) == DOUBT_NONE;
    if (r == DRIVER_PROTOCOL)
        return km_settle(in, error);
    if (r == DRIVER_CANCELLED || r == DRIVER_GONE)
        *error = attempt;
    return r == DRIVER_CANCELLED || r == DRIVER_GONE ? r : DRIVER_OK;
}

/* Whether there is another spectrum than before.  Silence is no error: the next look will tell. */
static enum driver_result poll_button(struct instrument *in, bool *busy, struct driver_error *error)
{
    struct km_press *press = &in->press;
    struct km_reply reply;
    struct driver_error attempt;
    int64_t now_ms = call_now_ms();
    press->listens = false;
    enum driver_result r =
        km_ask(in, "RDR,1", bands(in), in->reply_timeout_ms, in->line[0], &reply, &attempt);
    *busy = false;
    if (r == DRIVER_TIMEOUT) {
        in->poll_unanswered = true;
        return DRIVER_OK;
    }
    if (r == DRIVER_PROTOCOL)
        return km_settle(in, error);
    if (r != DRIVER_OK) {
        *error = attempt;
        return r;
    }
    *busy = !reply.ok && km_reaction_to(in, &reply) == KM_WAIT;
    if (!reply.ok && km_reaction_to(in, &reply) == KM_EMPTY)
        press->has_last = false;
    if (reply.ok && !is_last_press(in, &reply))
        r = fetch(in, &press->spectra, &press->has_spectra, error);
    press->looked_ms = now_ms;
    return r;
}

enum driver_result km_note_button(struct instrument *in, struct driver_error *error)
{
    bool busy;
    in->press.looked_ms = INT64_MIN;
    if (in->dialect->mes != KM_MES_THEN_MDR)
        return DRIVER_OK;
    enum driver_result r = poll_button(in, &busy, error);
    in->press.pressed = false;
    in->press.looked_ms = INT64_MIN;
    return r;
}

/* A line told of a press: what RDR gives is its reading, not another press. */
static enum driver_result follow_line(struct instrument *in, struct driver_error *error)
{
    int64_t deadline_ms = km_deadline(in, 0);
    for (int pause_ms = 0;;) {
        bool busy;
        enum driver_result r = poll_button(in, &busy, error);
        if (r != DRIVER_OK || !busy || call_now_ms() >= deadline_ms)
            return r;
        r = km_pause(in, &pause_ms, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
}

/* ---- waiting ------------------------------------------------------------------------ */

/* Until a line comes: true in *came. */
static enum driver_result listen(struct instrument *in, int64_t until_ms, bool *came,
                                 struct driver_error *error)
{
    struct driver_error attempt;
    in->press.listens = true;
    enum driver_result r = line_read(&in->reader, in->line[0], until_ms, &attempt);
    *came = r == DRIVER_OK;
    if (r == DRIVER_OK)
        return take_line(in, in->line[0], error);
    if (r == DRIVER_TIMEOUT || r == DRIVER_PROTOCOL)
        return DRIVER_OK;
    *error = attempt;
    return r;
}

static enum driver_result wait_button(struct instrument *in, int64_t deadline_ms,
                                      struct driver_error *error)
{
    bool asks = in->dialect->mes == KM_MES_THEN_MDR, came = true, longer = false;
    enum driver_result r = DRIVER_OK;
    /* What came before this wait: a press, but nobody knows when. */
    for (int i = 0; i < OLD_LINES && r == DRIVER_OK && came; i++) {
        r = listen(in, 0, &came, error);
        in->press.since_ms = INT64_MIN;
    }
    while (r == DRIVER_OK) {
        bool busy = false;
        if (asks)
            r = in->press.pressed ? follow_line(in, error) : poll_button(in, &busy, error);
        int64_t now_ms = call_now_ms();
        if (r != DRIVER_OK || in->press.pressed)
            return r;
        if (in->press.first[0] != '\0' && now_ms >= deadline_ms && !longer) {
            deadline_ms = now_ms + in->reply_timeout_ms; /* for its second half */
            longer = true;
        }
        if (now_ms >= deadline_ms) {
            in->press.first[0] = '\0';
            return DRIVER_OK;
        }
        int64_t until_ms = !asks ? deadline_ms : now_ms + (busy ? BUSY_POLL_MS : POLL_MS);
        r = listen(in, until_ms < deadline_ms ? until_ms : deadline_ms, &came, error);
    }
    return r;
}

/* Cancelled while nothing was asked and no line had begun: no answer can come later.  What begun()
 * had still to do is noted where it is. */
static bool is_in_step(const struct instrument *in)
{
    return in->press.listens && !in->poll_unanswered && !line_is_kept(&in->reader) &&
           in->press.first[0] == '\0';
}

enum driver_result km_wait_button(struct instrument *in, int timeout_ms, bool *pressed,
                                  struct driver_error *error)
{
    struct driver_error attempt;
    int64_t deadline_ms = call_now_ms() + timeout_ms;
    in->press.listens = true;
    enum driver_result r = km_begin_waiting(in, "wait_button", &attempt);
    if (r == DRIVER_OK)
        r = wait_button(in, deadline_ms, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return r == DRIVER_CANCELLED && is_in_step(in) ? r : km_end(in, r);
    }
    *pressed = in->press.pressed;
    if (in->press.pressed)
        in->press.ready = true;
    in->press.pressed = false;
    return DRIVER_OK;
}

/* ---- its reading -------------------------------------------------------------------- */

bool km_take_press(struct instrument *in, struct km_spectra *ret)
{
    bool fresh = in->press.ready && in->press.has_spectra &&
                 call_now_ms() - DRIVER_PRESS_FRESH_MS <= in->press.since_ms;
    in->press.ready = false;
    if (fresh)
        *ret = in->press.spectra;
    return fresh;
}
