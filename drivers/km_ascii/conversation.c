/* conversation.c - asking, and getting back into step. */
#include "drivers/km_ascii/conversation.h"

#include <stdio.h>
#include <string.h>

enum {
    QUIET_MS = 30,    /* of silence, after which nothing more is on its way */
    SETTLE_MS = 2000, /* at most for that */
    STRAY_MS = 200,   /* after a line that is no answer the answer must follow */
    SLOW_MS = 30000,  /* a line of which bytes keep coming */
    LONGEST_PAUSE_MS = 250,
    SHORTEST_ROUND_MS = 100, /* for the answer to IDR */
    BUSY_ROUND_MS = 1000,
};

static int64_t least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

int64_t km_deadline(const struct instrument *in, int64_t job_ms)
{
    return least(call_now_ms() + job_ms + in->reply_timeout_ms, in->call_ends_ms);
}

/* ---- codes -------------------------------------------------------------------------- */

enum km_reaction km_reaction_to(const struct instrument *in, const struct km_reply *reply)
{
    return km_find_code(in->dialect, reply)->reaction;
}

unsigned km_warnings_of(const struct instrument *in, const struct km_reply *reply)
{
    return km_find_code(in->dialect, reply)->warnings;
}

enum driver_result km_fail(const struct instrument *in, const struct km_reply *reply,
                           struct driver_error *error)
{
    char number[DRIVER_CODE_SIZE];
    const struct km_code *code = km_find_code(in->dialect, reply);
    snprintf(number, sizeof number, "ER%02u", reply->code);
    return driver_fail(error, code->result, number, "%s", code->text);
}

/* ---- one question ------------------------------------------------------------------- */

static enum driver_result send_line(struct instrument *in, const char *line,
                                    struct driver_error *error)
{
    char bytes[KM_COMMAND_SIZE + 2];
    int n = snprintf(bytes, sizeof bytes, "%s\r\n", line);
    return link_send(in->link, LINK_SERIAL, bytes, (size_t)n, km_deadline(in, 0), error);
}

static enum driver_result fail_silent(const struct instrument *in, bool began,
                                      struct driver_error *error)
{
    if (began)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "an answer broke off: check the cable, or come nearer with Bluetooth");
    return driver_fail(error, DRIVER_TIMEOUT, NULL,
                       "no answer in %d ms: is the instrument on and connected?",
                       in->reply_timeout_ms);
}

/* A line begins by the deadline.  While bytes of it keep coming it gets more time; where they stop
 * coming it broke off. */
static enum driver_result read_line(struct instrument *in, char line[LINE_MAX_BYTES],
                                    int64_t deadline_ms, struct driver_error *error)
{
    int64_t last_ms = least(deadline_ms + SLOW_MS, in->call_ends_ms);
    size_t before = in->reader.filled;
    for (;;) {
        int64_t step_ms = call_now_ms() + in->reply_timeout_ms;
        int64_t until_ms = least(step_ms, before > 0 ? last_ms : deadline_ms);
        enum driver_result r = line_read(&in->reader, line, until_ms, error);
        if (r != DRIVER_TIMEOUT)
            return r;
        size_t filled = in->reader.filled;
        if (filled == 0 ? call_now_ms() >= deadline_ms
                        : filled == before || call_now_ms() >= last_ms)
            return fail_silent(in, filled > 0, error);
        before = filled;
    }
}

/* Printable already: the reader of lines lets nothing else through. */
static enum driver_result fail_no_answer(const char *line, struct driver_error *error)
{
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "'%.40s' is no answer of this instrument: check the cable, and that no "
                       "other program uses the port",
                       line);
}

enum driver_result km_await(struct instrument *in, size_t fields, int timeout_ms,
                            char line[LINE_MAX_BYTES], struct km_reply *ret,
                            struct driver_error *error)
{
    struct driver_error attempt;
    int64_t deadline_ms = least(call_now_ms() + timeout_ms, in->call_ends_ms);
    int64_t latest_ms = deadline_ms; /* lines may come for ever */
    size_t other = SIZE_MAX;
    for (;;) {
        enum driver_result r = read_line(in, line, deadline_ms, &attempt);
        if (other != SIZE_MAX && (r == DRIVER_TIMEOUT || call_now_ms() > latest_ms))
            return driver_fail(error, DRIVER_PROTOCOL, NULL,
                               "an answer has %zu fields instead of %zu: measure again; if it "
                               "stays so, check the cable",
                               other, fields);
        if (r != DRIVER_OK) {
            *error = attempt;
            return r;
        }
        if (!km_read_reply(line, ret) ||
            (in->dialect != NULL && km_find_code(in->dialect, ret) == NULL))
            return fail_no_answer(line, error);
        if (!ret->ok || ret->fields == fields)
            return DRIVER_OK;
        km_note_stray(in, line, ret);
        other = ret->fields;
        deadline_ms = least(deadline_ms, call_now_ms() + least(STRAY_MS, in->reply_timeout_ms));
    }
}

enum driver_result km_ask(struct instrument *in, const char *question, size_t fields,
                          int timeout_ms, char line[LINE_MAX_BYTES], struct km_reply *ret,
                          struct driver_error *error)
{
    enum driver_result r = send_line(in, question, error);
    return r == DRIVER_OK ? km_await(in, fields, timeout_ms, line, ret, error) : r;
}

enum driver_result km_settle(struct instrument *in, struct driver_error *error)
{
    int quiet_ms = (int)least(QUIET_MS, in->reply_timeout_ms / 4 + 1);
    return line_resync(&in->reader, quiet_ms, least(call_now_ms() + SETTLE_MS, in->call_ends_ms),
                       error);
}

enum driver_result km_pause(struct instrument *in, int *pause_ms, int64_t deadline_ms,
                            struct driver_error *error)
{
    *pause_ms = *pause_ms == 0 ? 1 : (int)least((int64_t)*pause_ms * 2, LONGEST_PAUSE_MS);
    return link_pause(in->link, least(call_now_ms() + *pause_ms, deadline_ms), error);
}

/* ---- asking until it is sure -------------------------------------------------------- */

/* Not understood, or another program's line was answered: its answer may come as well. */
static bool is_confused(const struct instrument *in, const struct km_reply *reply)
{
    return in->dialect != NULL ? km_reaction_to(in, reply) == KM_RESEND : !reply->ok;
}

enum driver_result km_confirm(struct instrument *in, const char *question, size_t fields,
                              bool first, struct km_reply *ret, struct driver_error *error)
{
    struct driver_error attempt;
    bool came[KM_READINGS] = { first };
    size_t any = first;
    for (size_t i = first; i < KM_READINGS; i++) {
        struct km_reply reply;
        enum driver_result r =
            km_ask(in, question, fields, in->reply_timeout_ms, in->line[i], &reply, &attempt);
        /* It may have fallen asleep: the first question wakes it. */
        bool asleep = r == DRIVER_TIMEOUT && i == 0 && call_now_ms() < in->call_ends_ms;
        bool confused =
            asleep || r == DRIVER_PROTOCOL || (r == DRIVER_OK && is_confused(in, &reply));
        came[i] = r == DRIVER_OK;
        if (!came[i])
            in->line[i][0] = '\0'; /* no part of it, nor of an earlier answer, counts */
        any += came[i];
        for (size_t j = 0; came[i] && j < i; j++)
            if (came[j] && strcmp(in->line[i], in->line[j]) == 0) {
                *ret = reply;
                return DRIVER_OK;
            }
        /* Where it is too late to settle, what was heard says more. */
        bool too_late = r == DRIVER_PROTOCOL && call_now_ms() >= in->call_ends_ms;
        if (confused && !too_late)
            r = km_settle(in, error);
        else if (r != DRIVER_OK)
            *error = attempt;
        if (r != DRIVER_OK)
            return r;
    }
    if (any == 0) {
        *error = attempt;
        return DRIVER_PROTOCOL; /* any other has ended the loop */
    }
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "of three answers to one question no two agree: check the cable, or come "
                       "nearer with Bluetooth");
}

enum driver_result km_ask_twice(struct instrument *in, const char *question, size_t fields,
                                struct km_reply *ret, struct driver_error *error)
{
    return km_confirm(in, question, fields, false, ret, error);
}

enum driver_result km_query(struct instrument *in, const char *question, size_t fields,
                            int64_t deadline_ms, struct km_reply *ret, struct driver_error *error)
{
    for (int pause_ms = 0;;) {
        struct km_reply reply = { .ok = false };
        enum driver_result r = km_ask_twice(in, question, fields, &reply, error);
        if (r != DRIVER_OK)
            return r;
        if (reply.ok) {
            *ret = reply;
            return DRIVER_OK;
        }
        if (km_reaction_to(in, &reply) != KM_WAIT || call_now_ms() >= deadline_ms)
            return km_fail(in, &reply, error);
        r = km_pause(in, &pause_ms, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
}

enum driver_result km_query_state(struct instrument *in, int64_t deadline_ms, struct km_state *ret,
                                  struct driver_error *error)
{
    struct km_reply reply;
    enum driver_result r =
        km_query(in, "STR", in->dialect->state_fields, deadline_ms, &reply, error);
    if (r != DRIVER_OK)
        return r;
    if (!in->dialect->read_state(&reply, ret))
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "the state '%.40s' cannot be: is this the right driver?", in->line[0]);
    in->voltage = ret->voltage;
    return DRIVER_OK;
}

enum driver_result km_command(struct instrument *in, const char *command, int job_ms, int wait_ms,
                              struct driver_error *error)
{
    int64_t deadline_ms = km_deadline(in, wait_ms);
    bool again = false;
    for (int pause_ms = 0;;) {
        struct km_reply reply;
        struct driver_error attempt;
        in->job_ends_ms = km_deadline(in, job_ms);
        enum driver_result r =
            km_ask(in, command, 0, job_ms + in->reply_timeout_ms, in->line[0], &reply, &attempt);
        if (r == DRIVER_OK)
            in->job_ends_ms = 0;
        if (r == DRIVER_OK && reply.ok)
            return DRIVER_OK;
        bool wait = r == DRIVER_OK && km_reaction_to(in, &reply) == KM_WAIT;
        bool confused = r == DRIVER_PROTOCOL || (r == DRIVER_OK && is_confused(in, &reply));
        if (r == DRIVER_OK)
            r = km_fail(in, &reply, &attempt);
        if (!(wait && call_now_ms() < deadline_ms) && !(confused && !again)) {
            *error = attempt;
            return r;
        }
        again = again || confused;
        r = wait ? km_pause(in, &pause_ms, deadline_ms, error) : km_settle(in, error);
        if (r != DRIVER_OK)
            return r;
    }
}

/* ---- into step ---------------------------------------------------------------------- */

/* Until the answer to IDR itself comes: what came before belongs to questions of old. */
static enum driver_result look_for_identity(struct instrument *in, int64_t deadline_ms, bool *found,
                                            bool *busy, struct driver_error *error)
{
    struct driver_error attempt;
    enum driver_result r = km_settle(in, error);
    if (r == DRIVER_OK)
        r = send_line(in, "IDR", error);
    *found = *busy = false;
    while (r == DRIVER_OK && !*found && !*busy && call_now_ms() <= deadline_ms) {
        enum driver_result came = line_read(&in->reader, in->line[0], deadline_ms, &attempt);
        if (came == DRIVER_TIMEOUT)
            return DRIVER_OK;
        if (came != DRIVER_OK && came != DRIVER_PROTOCOL) {
            *error = attempt;
            return came;
        }
        *found = came == DRIVER_OK && strcmp(in->line[0], in->identity_line) == 0;
        *busy = came == DRIVER_OK && strncmp(in->line[0], "ER", 2) == 0;
    }
    return r;
}

static enum driver_result into_step(struct instrument *in, struct driver_error *error)
{
    int64_t now_ms = call_now_ms();
    int64_t job_ms = in->job_ends_ms > now_ms ? in->job_ends_ms - now_ms : 0;
    int64_t deadline_ms =
        most(km_deadline(in, job_ms), least(call_now_ms() + SHORTEST_ROUND_MS, in->call_ends_ms));
    bool was_busy = false;
    int round = 0;
    for (int pause_ms = 0;; round++) {
        bool found = false, busy = false;
        /* A busy instrument answers each IDR in the end: not too many of them. */
        int64_t third_ms = most(in->reply_timeout_ms / 3, SHORTEST_ROUND_MS);
        int64_t round_ms = call_now_ms() + (job_ms > 0 ? most(third_ms, BUSY_ROUND_MS) : third_ms);
        enum driver_result r =
            look_for_identity(in, least(round_ms, deadline_ms), &found, &busy, error);
        was_busy = was_busy || busy;
        if (r == DRIVER_OK && found)
            break;
        if (r == DRIVER_OK && call_now_ms() >= deadline_ms)
            r = was_busy ? driver_fail(error, DRIVER_TIMEOUT, NULL,
                                       "the instrument is busy with an earlier shot that does not "
                                       "end: switch it off and on, and check its battery")
                         : fail_silent(in, false, error);
        if (r == DRIVER_OK)
            r = km_pause(in, &pause_ms, deadline_ms, error);
        if (r != DRIVER_OK)
            return r;
    }
    in->out_of_step = false;
    return round > 0 ? km_settle(in, error) : DRIVER_OK; /* each round's IDR has its answer */
}

static enum driver_result begun(struct instrument *in, const char *call, struct driver_error *error)
{
    in->call_ends_ms = INT64_MAX;
    if (in->out_of_step) {
        link_tell(in->link, LINK_WAY_BACK);
        enum driver_result back = into_step(in, error);
        if (back == DRIVER_OK)
            link_tell(in->link, call);
        return back;
    }
    if (!in->poll_unanswered)
        return DRIVER_OK;
    enum driver_result r = km_settle(in, error);
    in->poll_unanswered = r != DRIVER_OK;
    return r;
}

enum driver_result km_begin(struct instrument *in, const char *call, struct driver_error *error)
{
    link_begin(in->link, call);
    return begun(in, call, error);
}

enum driver_result km_begin_waiting(struct instrument *in, const char *call,
                                    struct driver_error *error)
{
    link_begin_waiting(in->link, call);
    enum driver_result r = link_pause(in->link, 0, error);
    return r == DRIVER_OK ? begun(in, call, error) : r;
}

enum driver_result km_end(struct instrument *in, enum driver_result r)
{
    if (r == DRIVER_TIMEOUT || r == DRIVER_PROTOCOL || r == DRIVER_CANCELLED)
        in->out_of_step = true;
    return r;
}
