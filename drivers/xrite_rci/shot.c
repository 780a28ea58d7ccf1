/* shot.c - one shot: flash, fetch, doubt; and the samples that are stored. */
#include <stdio.h>
#include <string.h>

#include "drivers/xrite_rci/conversation.h"

enum {
    SHOT_MS = 3000,    /* beside the readings of an average */
    READING_MS = 3000, /* each */
};

static const struct driver_grid *grid(const struct instrument *in)
{
    return &in->identity.grid[0];
}

/* ---- fetching ----------------------------------------------------------------------- */

/* Both spectra once: lines 2 pass and 2 pass + 1.  An error is the answer to the first. */
static enum driver_result ask_both(struct instrument *in, unsigned number, size_t pass,
                                   struct rci_reply *sce, struct rci_reply *sci,
                                   struct driver_error *error)
{
    char command[RCI_COMMAND_SIZE];
    char *first = in->line[2 * pass], *second = in->line[2 * pass + 1];
    second[0] = '\0';
    snprintf(command, sizeof command, "%X101GM", number);
    enum driver_result r =
        rci_ask(in, command, RCI_SPECTRUM, rci_deadline(in, 0), first, sce, error);
    if (r != DRIVER_OK || rci_reaction_to(sce) != RCI_DONE)
        return r;
    snprintf(command, sizeof command, "%X001GM", number);
    return rci_ask(in, command, RCI_SPECTRUM, rci_deadline(in, 0), second, sci, error);
}

static bool agree(const struct instrument *in, size_t a, size_t b)
{
    return strcmp(in->line[2 * a], in->line[2 * b]) == 0 &&
           strcmp(in->line[2 * a + 1], in->line[2 * b + 1]) == 0;
}

/* Two passes that agree, of at most three; DRIVER_BUSY where one met a busy instrument. */
static enum driver_result confirm_both(struct instrument *in, unsigned number,
                                       struct rci_reply *sce, struct rci_reply *sci,
                                       struct driver_error *error)
{
    bool came[RCI_READINGS] = { false };
    struct driver_error attempt;
    for (size_t i = 0; i < RCI_READINGS; i++) {
        *sci = (struct rci_reply){ .status = 0 };
        enum driver_result r = ask_both(in, number, i, sce, sci, &attempt);
        came[i] = r == DRIVER_OK;
        if (came[i] && (rci_reaction_to(sce) == RCI_WAIT || rci_reaction_to(sci) == RCI_WAIT))
            return driver_fail(error, DRIVER_BUSY, "<14>", "%s", rci_find_code(0x14)->text);
        for (size_t j = 0; came[i] && j < i; j++)
            if (came[j] && agree(in, i, j))
                return DRIVER_OK;
        if (r == DRIVER_PROTOCOL || (r == DRIVER_OK && i > 0))
            r = rci_settle(in, &attempt);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "a spectrum was asked for three times, and no two answers agree: measure "
                       "again; if it stays so, check the cable");
}

static enum driver_result doubt(const struct rci_reply *sce, const struct rci_reply *sci,
                                struct rci_spectra *ret, struct driver_error *error)
{
    enum doubt doubt = rci_read_spectrum(sce, ret->sce);
    if (doubt == DOUBT_NONE)
        doubt = rci_read_spectrum(sci, ret->sci);
    if (doubt == DOUBT_NONE)
        doubt = doubt_both(RCI_BANDS, ret->sci, ret->sce, RCI_RAW_UNIT, false);
    return doubt_fail(doubt, error);
}

/* Of the last shot (number 0) or a stored sample, waiting where it is busy until the deadline. */
static enum driver_result fetch(struct instrument *in, unsigned number, int64_t deadline_ms,
                                struct rci_spectra *ret, struct driver_error *error)
{
    for (;;) {
        struct rci_reply sce, sci;
        struct driver_error attempt;
        enum driver_result r = confirm_both(in, number, &sce, &sci, &attempt);
        if (r == DRIVER_BUSY && call_now_ms() < deadline_ms) {
            r = rci_pause(in, deadline_ms, error);
            if (r != DRIVER_OK)
                return r;
            continue;
        }
        if (r == DRIVER_OK)
            r = rci_judge(in, &sce, &attempt);
        if (r == DRIVER_OK)
            r = rci_judge(in, &sci, &attempt);
        if (r == DRIVER_OK)
            r = doubt(&sce, &sci, ret, &attempt);
        if (r != DRIVER_OK)
            *error = attempt;
        return r;
    }
}

static bool is_last(const struct instrument *in, const struct rci_spectra *spectra)
{
    return in->has_last && memcmp(spectra->sce, in->last_sce, sizeof in->last_sce) == 0;
}

static void keep_last(struct instrument *in, const struct rci_spectra *spectra)
{
    memcpy(in->last_sce, spectra->sce, sizeof in->last_sce);
    in->has_last = true;
}

/* What the instrument gives may still be the shot before: where it answered RM at once, and where
 * the answer that told of a failure came damaged.  No two shots have 31 equal values of four
 * decimals. */
static enum driver_result fetch_new(struct instrument *in, int64_t deadline_ms,
                                    struct rci_spectra *ret, struct driver_error *error)
{
    for (;;) {
        enum driver_result r = fetch(in, 0, deadline_ms, ret, error);
        if (r != DRIVER_OK)
            return r;
        if (!is_last(in, ret)) {
            keep_last(in, ret);
            return DRIVER_OK;
        }
        if (call_now_ms() >= deadline_ms)
            return driver_fail(error, DRIVER_PROTOCOL, NULL,
                               "the instrument gives the spectrum of the shot before: measure "
                               "again");
        r = rci_pause(in, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
}

enum driver_result rci_note_last(struct instrument *in, struct driver_error *error)
{
    struct rci_spectra spectra;
    struct driver_error attempt;
    enum driver_result r = fetch(in, 0, rci_deadline(in, 0), &spectra, &attempt);
    if (r == DRIVER_OK)
        keep_last(in, &spectra);
    if (r != DRIVER_GONE && r != DRIVER_TIMEOUT && r != DRIVER_CANCELLED)
        return DRIVER_OK; /* there is none, or none that one of ours could be mistaken for */
    *error = attempt;
    return r;
}

/* ---- flashing ----------------------------------------------------------------------- */

static int64_t shot_ms(const struct instrument *in)
{
    int64_t readings = in->setup.averages > 1 ? in->setup.averages : 1;
    return in->shot_timeout_ms > 0 ? in->shot_timeout_ms * readings
                                   : SHOT_MS + READING_MS * readings;
}

/* Nothing tells of a battery that dies in a shot but silence. */
static enum driver_result fail_unfinished(struct driver_error *error)
{
    return driver_fail(error, DRIVER_TIMEOUT, NULL,
                       "the shot does not end: the battery is probably empty; charge it, and "
                       "switch the instrument off and on");
}

static enum driver_result flash(struct instrument *in, struct driver_error *error)
{
    int64_t deadline_ms = call_now_ms() + shot_ms(in) + in->reply_timeout_ms;
    for (bool again = false;;) {
        struct rci_reply reply;
        struct driver_error attempt;
        in->job_ends_ms = call_now_ms() + shot_ms(in);
        enum driver_result r = rci_ask(in, "RM", RCI_STATUS, in->job_ends_ms + in->reply_timeout_ms,
                                       in->line[0], &reply, &attempt);
        if (r == DRIVER_PROTOCOL) /* it came damaged: what can be fetched tells */
            return rci_settle(in, error);
        if (r == DRIVER_TIMEOUT)
            return fail_unfinished(error);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        enum rci_reaction reaction = rci_reaction_to(&reply);
        if (reaction == RCI_WAIT && call_now_ms() < deadline_ms)
            r = rci_pause(in, deadline_ms, error);
        else if (reaction == RCI_RESEND && !again)
            r = rci_settle(in, error);
        else
            return rci_judge(in, &reply, error);
        again = again || reaction == RCI_RESEND;
        if (r != DRIVER_OK)
            return r;
    }
}

enum driver_result rci_shoot(struct instrument *in, struct rci_spectra *ret,
                             struct driver_error *error)
{
    enum driver_result r = rci_clear(in, error);
    if (r == DRIVER_OK)
        r = flash(in, error);
    if (r == DRIVER_OK)
        r = fetch_new(in, in->job_ends_ms, ret, error);
    if (r != DRIVER_TIMEOUT && r != DRIVER_CANCELLED)
        in->job_ends_ms = 0;
    return r;
}

/* ---- the reading -------------------------------------------------------------------- */

static void fill(const struct instrument *in, const struct rci_spectra *spectra, double aperture_mm,
                 struct driver_reading *ret)
{
    reading_init(RCI_RAW_UNIT, 0, ret);
    reading_add(grid(in), spectra->sce, SPECULAR_SCE, aperture_mm, ret);
    reading_add(grid(in), spectra->sci, SPECULAR_SCI, aperture_mm, ret);
}

static enum driver_result measure(struct instrument *in, struct rci_spectra *ret,
                                  struct driver_error *error)
{
    for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++)
        if (in->due[i])
            return driver_fail(error, DRIVER_REFUSED, NULL,
                               "calibration is due (%s): take the white tile and the black trap, "
                               "and calibrate",
                               driver_calibration_name((enum driver_calibration)i));
    struct driver_error attempt;
    if (rci_take_press(in)) {
        enum driver_result r = fetch_new(in, call_now_ms(), ret, &attempt);
        if (r == DRIVER_OK)
            return r;
        r = rci_settle(in, error); /* whatever became of it: flash */
        if (r != DRIVER_OK)
            return r;
    }
    return rci_shoot(in, ret, error);
}

enum driver_result rci_measure(struct instrument *in, struct driver_reading *ret,
                               struct driver_error *error)
{
    struct driver_error attempt;
    struct rci_spectra spectra;
    enum driver_result r = rci_begin(in, "measure", &attempt);
    if (r == DRIVER_OK)
        r = measure(in, &spectra, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return rci_end(in, r);
    }
    fill(in, &spectra, in->identity.aperture_mm[in->setup.aperture], ret);
    return DRIVER_OK;
}

/* ---- stored samples ----------------------------------------------------------------- */

static enum driver_result count(struct instrument *in, size_t *ret, struct driver_error *error)
{
    struct rci_reply reply;
    unsigned n;
    enum driver_result r = rci_clear(in, error);
    if (r == DRIVER_OK)
        r = rci_query(in, "00GM", RCI_COUNT, rci_deadline(in, 0), &reply, error);
    if (r != DRIVER_OK)
        return r;
    if (!rci_read_count(&reply, &n))
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "'%.20s' is no number of stored samples: is this the right driver?",
                           reply.data);
    *ret = n;
    return DRIVER_OK;
}

enum driver_result rci_stored_count(struct instrument *in, size_t *ret, struct driver_error *error)
{
    struct driver_error attempt;
    size_t n = 0;
    enum driver_result r = rci_begin(in, "stored_count", &attempt);
    if (r == DRIVER_OK)
        r = count(in, &n, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return rci_end(in, r);
    }
    *ret = n;
    return DRIVER_OK;
}

static enum driver_result read_stored(struct instrument *in, size_t i, struct rci_spectra *ret,
                                      struct driver_error *error)
{
    size_t n = 0;
    enum driver_result r = count(in, &n, error);
    if (r != DRIVER_OK)
        return r;
    if (i >= n)
        return driver_fail(error, DRIVER_REFUSED, NULL,
                           "no sample %zu: the instrument has stored %zu", i + 1, n);
    if (i >= RCI_MAX_NUMBER)
        return driver_fail(error, DRIVER_UNSUPPORTED, NULL,
                           "sample %zu: only the first %d can be read over this line", i + 1,
                           RCI_MAX_NUMBER);
    return fetch(in, (unsigned)i + 1, rci_deadline(in, 0), ret, error);
}

enum driver_result rci_stored_read(struct instrument *in, size_t i, struct driver_reading *ret,
                                   struct driver_error *error)
{
    struct driver_error attempt;
    struct rci_spectra spectra;
    char call[40];
    snprintf(call, sizeof call, "stored_read %zu", i);
    enum driver_result r = rci_begin(in, call, &attempt);
    if (r == DRIVER_OK)
        r = read_stored(in, i, &spectra, &attempt);
    if (r != DRIVER_OK) {
        *error = attempt;
        return rci_end(in, r);
    }
    /* Through which aperture is not stored with it. */
    fill(in, &spectra, in->identity.aperture_mm[in->setup.aperture], ret);
    snprintf(ret->sample, sizeof ret->sample, "sample %zu", i + 1);
    return DRIVER_OK;
}
