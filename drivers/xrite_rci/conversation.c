/* conversation.c - asking, and getting back into step. */
#include "drivers/xrite_rci/conversation.h"

#include <stdio.h>
#include <string.h>

enum {
    QUIET_MS = 30,    /* of silence, after which nothing more is on its way */
    SETTLE_MS = 2000, /* at most for that */
    STRAY_MS = 2000,  /* after a line that is no answer the answer must follow */
    SLOW_MS = 30000,  /* a line of which bytes keep coming */
    LOOK_MS = 1000,
    BUSY_MS = 1000,   /* between two commands to a busy one */
    UNASKED_MAX = 16, /* lines that are heard at the beginning of a call */
};

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

int64_t rci_deadline(const struct instrument *in, int64_t job_ms)
{
    return least(call_now_ms() + job_ms + in->reply_timeout_ms, in->call_ends_ms);
}

/* ---- status ------------------------------------------------------------------------- */

enum rci_reaction rci_reaction_to(const struct rci_reply *reply)
{
    return rci_find_code(reply->status)->reaction;
}

enum driver_result rci_judge(struct instrument *in, const struct rci_reply *reply,
                             struct driver_error *error)
{
    char number[DRIVER_CODE_SIZE];
    const struct rci_code *code = rci_find_code(reply->status);
    if (code->reaction == RCI_DONE)
        return DRIVER_OK;
    if (code->reaction == RCI_LOST)
        for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++)
            in->due[i] = true;
    snprintf(number, sizeof number, "<%02X>", reply->status);
    return driver_fail(error, code->result, number, "%s", code->text);
}

/* ---- one question ------------------------------------------------------------------- */

enum driver_result rci_send(struct instrument *in, const char *command, struct driver_error *error)
{
    char bytes[RCI_COMMAND_SIZE + 2];
    int n = snprintf(bytes, sizeof bytes, "%s\r\n", command);
    if (line_is_kept(&in->reader)) { /* whatever it is, it is no answer to this */
        enum driver_result r = rci_settle(in, error);
        if (r != DRIVER_OK)
            return r;
    }
    return link_send(in->link, LINK_SERIAL, bytes, (size_t)n, rci_deadline(in, 0), error);
}

/* Silence, or an answer that broke off.  One that ends with CR alone is that of an instrument which
 * has its settings from power-on; once it may be a lost byte. */
static enum driver_result fail_silent(struct instrument *in, struct driver_error *error)
{
    const struct line_reader *reader = &in->reader;
    size_t n = reader->filled;
    if (n == 0)
        return driver_fail(error, DRIVER_TIMEOUT, NULL,
                           "no answer in %d ms: is the instrument on and connected?",
                           in->reply_timeout_ms);
    if (n >= 2 && memcmp(reader->bytes + n - 2, ">\r", 2) == 0 && ++in->bare_ends >= 2)
        return driver_fail(error, DRIVER_GONE, NULL,
                           "the instrument was switched off and on: it has to be opened again");
    return driver_fail(error, DRIVER_PROTOCOL, NULL, "an answer broke off: check the cable");
}

/* Looks up once a second: a line that has begun but does not go on is broken, however long the job
 * may take; one of which bytes keep coming gets more time than the deadline. */
static enum driver_result read_line(struct instrument *in, char line[LINE_MAX_BYTES],
                                    int64_t deadline_ms, struct driver_error *error)
{
    int64_t last_ms = least(deadline_ms + SLOW_MS, in->call_ends_ms);
    for (size_t before = in->reader.filled;; before = in->reader.filled) {
        int64_t now_ms = call_now_ms();
        int64_t look_ms = now_ms + least(LOOK_MS, in->reply_timeout_ms);
        int64_t until_ms = least(look_ms, before > 0 ? last_ms : deadline_ms);
        enum driver_result r = line_read(&in->reader, line, until_ms, error);
        if (r == DRIVER_OK)
            in->bare_ends = 0;
        if (r != DRIVER_TIMEOUT)
            return r;
        bool grew = in->reader.filled > before;
        bool over = call_now_ms() >= (grew ? last_ms : deadline_ms);
        if (over || (in->reader.filled > 0 && !grew))
            return fail_silent(in, error);
    }
}

static enum driver_result fail_no_answer(const char *line, struct driver_error *error)
{
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "'%.40s' is no answer to what was asked: check the cable, and that no other "
                       "program uses the port",
                       line);
}

enum driver_result rci_await(struct instrument *in, enum rci_kind kind, int64_t deadline_ms,
                             char line[LINE_MAX_BYTES], struct rci_reply *ret,
                             struct driver_error *error)
{
    bool stray = false;
    for (;;) {
        struct driver_error attempt;
        enum driver_result r = read_line(in, line, deadline_ms, &attempt);
        if (r == DRIVER_TIMEOUT && stray)
            return fail_no_answer(line, error);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        if (!rci_read_reply(line, ret) || rci_find_code(ret->status) == NULL)
            return fail_no_answer(line, error);
        if (rci_is_kind(ret, kind)) {
            in->has_error = in->has_error || ret->status >= 0x20;
            return DRIVER_OK;
        }
        stray = true;
        int64_t now_ms = call_now_ms();
        if (deadline_ms - now_ms <= in->reply_timeout_ms) /* a job's answer takes its time */
            deadline_ms = least(deadline_ms, now_ms + STRAY_MS);
    }
}

enum driver_result rci_ask(struct instrument *in, const char *command, enum rci_kind kind,
                           int64_t deadline_ms, char line[LINE_MAX_BYTES], struct rci_reply *ret,
                           struct driver_error *error)
{
    enum driver_result r = rci_send(in, command, error);
    return r == DRIVER_OK ? rci_await(in, kind, deadline_ms, line, ret, error) : r;
}

enum driver_result rci_settle(struct instrument *in, struct driver_error *error)
{
    int quiet_ms = (int)least(QUIET_MS, in->reply_timeout_ms / 4 + 1);
    return line_resync(&in->reader, quiet_ms, least(call_now_ms() + SETTLE_MS, in->call_ends_ms),
                       error);
}

enum driver_result rci_pause(struct instrument *in, int64_t deadline_ms, struct driver_error *error)
{
    return link_pause(in->link, least(call_now_ms() + BUSY_MS, deadline_ms), error);
}

/* ---- asking until it is sure -------------------------------------------------------- */

enum driver_result rci_confirm(struct instrument *in, const char *command, enum rci_kind kind,
                               struct rci_reply *ret, struct driver_error *error)
{
    struct driver_error attempt;
    bool came[RCI_READINGS] = { false };
    for (size_t i = 0; i < RCI_READINGS; i++) {
        struct rci_reply reply;
        enum driver_result r =
            rci_ask(in, command, kind, rci_deadline(in, 0), in->line[i], &reply, &attempt);
        came[i] = r == DRIVER_OK;
        for (size_t j = 0; came[i] && j < i; j++)
            if (came[j] && strcmp(in->line[i], in->line[j]) == 0) {
                *ret = reply;
                return DRIVER_OK;
            }
        if (r == DRIVER_PROTOCOL || (r == DRIVER_OK && i > 0))
            r = rci_settle(in, &attempt);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
    }
    if (!came[0] && !came[1] && !came[2]) {
        *error = attempt;
        return error->result;
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "of three answers to one question no two agree: check the cable");
}

enum driver_result rci_query(struct instrument *in, const char *command, enum rci_kind kind,
                             int64_t deadline_ms, struct rci_reply *ret, struct driver_error *error)
{
    for (;;) {
        struct rci_reply reply = { .n = 0 };
        enum driver_result r = rci_confirm(in, command, kind, &reply, error);
        if (r != DRIVER_OK)
            return r;
        if (rci_reaction_to(&reply) != RCI_WAIT || call_now_ms() >= deadline_ms) {
            r = rci_judge(in, &reply, error);
            if (r == DRIVER_OK)
                *ret = reply;
            return r;
        }
        r = rci_pause(in, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
}

/* Once more where it is damaged or was not understood, waiting where it is busy. */
static enum driver_result send_until_heard(struct instrument *in, const char *command,
                                           int64_t deadline_ms, struct rci_reply *ret,
                                           struct driver_error *error)
{
    for (bool again = false;;) {
        struct driver_error attempt;
        enum driver_result r =
            rci_ask(in, command, RCI_STATUS, rci_deadline(in, 0), in->line[0], ret, &attempt);
        enum rci_reaction reaction = r == DRIVER_OK ? rci_reaction_to(ret) : RCI_TELL;
        bool confused = r == DRIVER_PROTOCOL || reaction == RCI_RESEND || reaction == RCI_EMPTY ||
                        (r == DRIVER_OK && ret->status == 0x04);
        bool wait = reaction == RCI_WAIT && call_now_ms() < deadline_ms;
        if (!wait && !(confused && !again)) {
            if (r != DRIVER_OK)
                *error = attempt;
            return r;
        }
        again = again || confused;
        r = wait ? rci_pause(in, deadline_ms, error) : rci_settle(in, error);
        if (r != DRIVER_OK)
            return r;
    }
}

static int64_t job_left_ms(const struct instrument *in)
{
    int64_t left = in->job_ends_ms - call_now_ms();
    return left > 0 ? left : 0;
}

enum driver_result rci_command(struct instrument *in, const char *command,
                               struct driver_error *error)
{
    struct rci_reply reply;
    enum driver_result r =
        send_until_heard(in, command, rci_deadline(in, job_left_ms(in)), &reply, error);
    return r == DRIVER_OK ? rci_judge(in, &reply, error) : r;
}

/* ---- into step ---------------------------------------------------------------------- */

/* What is asked to get into step has to be known from all else: the serial number, or where there
 * is none the number of samples, which has digits at least. */
static bool is_marker(const struct instrument *in, const char *line)
{
    struct rci_reply reply;
    if (in->identity.serial[0] != '\0')
        return strcmp(line, in->identity_line) == 0;
    return rci_read_reply(line, &reply) && reply.status == 0 && rci_is_kind(&reply, RCI_COUNT);
}

/* Until the marker itself comes: what came before belongs to questions of old. */
static enum driver_result look_for_marker(struct instrument *in, bool settle, int64_t deadline_ms,
                                          bool *found, bool *busy, struct driver_error *error)
{
    struct driver_error attempt;
    enum driver_result r = settle ? rci_settle(in, error) : DRIVER_OK;
    if (r == DRIVER_OK)
        r = rci_send(in, in->identity.serial[0] != '\0' ? "00SN" : "00GM", error);
    *found = *busy = false;
    while (r == DRIVER_OK && !*found && !*busy) {
        enum driver_result came = read_line(in, in->line[0], deadline_ms, &attempt);
        /* Part of a line would stay, and be told of for ever: ask again instead. */
        bool broken = came == DRIVER_PROTOCOL && line_is_kept(&in->reader);
        if (came == DRIVER_TIMEOUT || broken)
            return DRIVER_OK;
        if (came != DRIVER_OK && came != DRIVER_PROTOCOL) {
            *error = attempt;
            return came;
        }
        *found = came == DRIVER_OK && is_marker(in, in->line[0]);
        *busy = came == DRIVER_OK && strcmp(in->line[0], "<14>") == 0;
    }
    return r;
}

static enum driver_result fail_out_of_step(const struct instrument *in, bool busy,
                                           struct driver_error *error)
{
    if (busy)
        return driver_fail(error, DRIVER_TIMEOUT, "<14>",
                           "the instrument is busy with something that does not end: bring it to "
                           "its main screen, or switch it off and on");
    return driver_fail(error, DRIVER_TIMEOUT, NULL,
                       "no answer in %d ms: is the instrument on and connected?  If it was in the "
                       "middle of a shot, its battery is probably empty: charge it",
                       in->reply_timeout_ms);
}

/* settle: there may be noise, or part of a line, before the marker; where an answer has just come
 * whole, none of the 30 ms that it takes are lost. */
static enum driver_result into_step(struct instrument *in, bool settle, struct driver_error *error)
{
    enum { ROUNDS = 3, SHORTEST_MS = 100 };
    int64_t deadline_ms = most(rci_deadline(in, job_left_ms(in)),
                               least(call_now_ms() + SHORTEST_MS, in->call_ends_ms));
    int64_t round_ms = most(in->reply_timeout_ms / ROUNDS, SHORTEST_MS);
    bool found = false, busy = false;
    int rounds = 0;
    do {
        enum driver_result r =
            look_for_marker(in, settle || rounds > 0, least(call_now_ms() + round_ms, deadline_ms),
                            &found, &busy, error);
        if (r == DRIVER_OK && busy)
            r = rci_pause(in, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
        rounds++;
    } while (!found && call_now_ms() < deadline_ms);
    if (!found)
        return fail_out_of_step(in, busy, error);
    in->out_of_step = false;
    return rounds > 1 ? rci_settle(in, error) : DRIVER_OK; /* each round has its answer */
}

enum driver_result rci_clear(struct instrument *in, struct driver_error *error)
{
    struct rci_reply reply;
    bool armed = in->press.armed;
    enum driver_result r =
        send_until_heard(in, "CE", rci_deadline(in, job_left_ms(in)), &reply, error);
    if (r != DRIVER_OK)
        return r;
    in->press.armed = false;
    in->has_error = false;
    switch (rci_reaction_to(&reply)) {
    case RCI_WAIT:
        return rci_judge(in, &reply, error);
    case RCI_ABORTED: /* nobody has said whether another answer follows, for CE itself */
        return into_step(in, false, error);
    case RCI_EXPIRED:
    case RCI_DONE:
        return DRIVER_OK;
    default: /* the error that is cleared by it; ours is told where it arises */
        return armed ? into_step(in, false, error) : DRIVER_OK;
    }
}

/* ---- a call's beginning and end ----------------------------------------------------- */

static enum driver_result hear_unasked(struct instrument *in, struct driver_error *error)
{
    for (int i = 0; i < UNASKED_MAX; i++) {
        struct rci_reply reply;
        struct driver_error attempt;
        enum driver_result r = line_read(&in->reader, in->line[0], call_now_ms(), &attempt);
        if (r == DRIVER_TIMEOUT)
            return DRIVER_OK;
        if (r == DRIVER_OK && rci_read_reply(in->line[0], &reply))
            rci_note_unasked(in, &reply);
        if (r != DRIVER_OK && r != DRIVER_PROTOCOL) {
            *error = attempt;
            return r;
        }
    }
    return rci_settle(in, error);
}

/* CE ends what waits for the operator; whatever it says comes before the marker. */
static enum driver_result begun(struct instrument *in, const char *call, struct driver_error *error)
{
    in->call_ends_ms = INT64_MAX;
    if (!in->out_of_step)
        return hear_unasked(in, error);
    in->press.armed = false;
    link_tell(in->link, LINK_WAY_BACK);
    enum driver_result r = rci_settle(in, error);
    if (r == DRIVER_OK)
        r = rci_send(in, "CE", error);
    if (r == DRIVER_OK)
        r = into_step(in, true, error);
    if (r == DRIVER_OK)
        link_tell(in->link, call);
    return r;
}

enum driver_result rci_begin(struct instrument *in, const char *call, struct driver_error *error)
{
    link_begin(in->link, call);
    return begun(in, call, error);
}

enum driver_result rci_begin_waiting(struct instrument *in, const char *call,
                                     struct driver_error *error)
{
    link_begin_waiting(in->link, call);
    enum driver_result r = link_pause(in->link, 0, error);
    return r == DRIVER_OK ? begun(in, call, error) : r;
}

enum driver_result rci_end(struct instrument *in, enum driver_result r)
{
    if (r == DRIVER_TIMEOUT || r == DRIVER_PROTOCOL || r == DRIVER_CANCELLED)
        in->out_of_step = true;
    return r;
}
