/* replay.c - a capture instead of an instrument; kinds.h has the rules.
 *
 * From top to bottom: segments, finding one, messages, waits, what is asked at another place than
 * in the capture, sending and receiving. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/link/kinds.h"

struct segment {
    const char *call;  /* "": before the first */
    size_t first, end; /* lines of the file */
    bool used, brought_bytes;
};

struct replay {
    struct link link;
    struct capture_file file;
    char *path;
    struct segment *segments;
    size_t n;
    size_t here; /* segments before it are over */

    size_t way_back, own; /* segments of the call begun last; 0: it has no way back */
    bool on_way_back;

    char *call;     /* begun last */
    bool silent;    /* in a wait that the capture has none of */
    bool none;      /* the capture has no such call */
    size_t entered; /* the segment it is in */
    size_t at, end; /* lines of the segment that are left */
    bool fresh;     /* nothing of it was sent or came */
    size_t taken;   /* bytes of line `at` that were received already */
};

/* ---- segments ----------------------------------------------------------------------- */

static bool is_status(const char *call)
{
    return strcmp(call, "status") == 0;
}

static bool is_way_back(const char *call)
{
    return strcmp(call, LINK_WAY_BACK) == 0;
}

static bool is_wait(const char *call)
{
    return strncmp(call, "wait", 4) == 0;
}

static size_t count_calls(const struct capture_file *file)
{
    size_t n = 0;
    for (size_t i = 0; i < file->n; i++)
        n += file->lines[i].kind == CAPTURE_CALL;
    return n;
}

static bool cut_into_segments(struct replay *replay)
{
    const struct capture_file *file = &replay->file;
    replay->segments = calloc(1 + count_calls(file), sizeof *replay->segments);
    if (replay->segments == NULL)
        return false;
    struct segment *segment = &replay->segments[replay->n++];
    *segment = (struct segment){ .call = "", .used = true };
    for (size_t i = 0; i < file->n; i++) {
        if (file->lines[i].kind == CAPTURE_CALL) {
            segment = &replay->segments[replay->n++];
            *segment = (struct segment){ .call = file->lines[i].text, .first = i + 1 };
        }
        segment->end = i + 1;
        segment->brought_bytes |= file->lines[i].kind == CAPTURE_CAME;
    }
    replay->here = 1;
    replay->end = replay->segments[0].end;
    return true;
}

/* ---- being cut short ---------------------------------------------------------------- */

static bool is_cancellation(const struct capture_line *line)
{
    return line->kind == CAPTURE_FAILED &&
           strcmp(line->text, driver_result_name(DRIVER_CANCELLED)) == 0;
}

static bool is_of_wire(const struct capture_line *line)
{
    return line->kind == CAPTURE_SENT || line->kind == CAPTURE_CAME ||
           line->kind == CAPTURE_SILENCE || line->kind == CAPTURE_FAILED;
}

/* Whether the segment ends with a question whose answer was not waited for. */
static bool is_unanswered(const struct replay *replay, const struct segment *segment)
{
    const struct capture_line *last = NULL, *before = NULL;
    for (size_t i = segment->first; i < segment->end; i++) {
        if (!is_of_wire(&replay->file.lines[i]))
            continue;
        before = last;
        last = &replay->file.lines[i];
    }
    return before != NULL && is_cancellation(last) && before->kind == CAPTURE_SENT;
}

/* An answer that came too late for its question is nothing that the instrument said by itself. */
static void pass_over_late_answer(struct replay *replay)
{
    for (size_t i = replay->at; i < replay->end && replay->file.lines[i].kind != CAPTURE_SENT; i++)
        if (replay->file.lines[i].kind == CAPTURE_CAME)
            replay->at = i + 1;
}

/* ---- finding one -------------------------------------------------------------------- */

/* The first segment from here on that is neither status nor a wait; n where there is none. */
static size_t next_other(const struct replay *replay)
{
    size_t i = replay->here;
    while (i < replay->n &&
           (is_status(replay->segments[i].call) || is_wait(replay->segments[i].call) ||
            is_way_back(replay->segments[i].call)))
        i++;
    return i;
}

/* Each gives an index, n where there is none. */
static size_t find_status(const struct replay *replay)
{
    size_t other = next_other(replay);
    for (size_t i = replay->here; i < other; i++)
        if (is_status(replay->segments[i].call) && !replay->segments[i].used)
            return i;
    for (size_t i = other; i-- > 0;)
        if (is_status(replay->segments[i].call))
            return i;
    for (size_t i = other; i < replay->n; i++)
        if (is_status(replay->segments[i].call))
            return i;
    return replay->n;
}

static size_t find_wait(const struct replay *replay, const char *call)
{
    size_t other = next_other(replay);
    for (size_t i = replay->here; i < other; i++) {
        const struct segment *segment = &replay->segments[i];
        if (!segment->used && segment->brought_bytes && strcmp(segment->call, call) == 0)
            return i;
    }
    return replay->n;
}

static size_t find_call(const struct replay *replay, const char *call)
{
    for (size_t i = replay->here; i < replay->n; i++)
        if (!replay->segments[i].used && strcmp(replay->segments[i].call, call) == 0)
            return i;
    return replay->n;
}

/* From 1: what is before the first call is entered by none. */
static void enter(struct replay *replay, size_t segment)
{
    replay->segments[segment].used = true;
    replay->entered = segment;
    replay->at = replay->segments[segment].first;
    replay->end = replay->segments[segment].end;
    replay->taken = 0;
    replay->fresh = true;
    if (is_wait(replay->segments[segment].call) &&
        is_unanswered(replay, &replay->segments[segment - 1]))
        pass_over_late_answer(replay);
}

/* A wait that had no time for any of it leaves it to the next. */
static void leave_to_next(struct replay *replay)
{
    if (replay->call != NULL && is_wait(replay->call) && !replay->silent && replay->fresh)
        replay->segments[replay->entered].used = false;
}

/* The call begun last goes its way back, or is at its end.  A capture that does not tell them
 * apart has both in one segment. */
static bool is_about_way_back(struct replay *replay, const char *call)
{
    bool begins = is_way_back(call);
    bool ends = replay->on_way_back && replay->call != NULL && strcmp(replay->call, call) == 0;
    replay->on_way_back = begins;
    if ((begins || ends) && replay->own != 0)
        enter(replay, begins ? replay->way_back : replay->own);
    return begins || ends;
}

/* Where a way back stands in the call's segment, its own bytes are in the next but one. */
static size_t note_way_back(struct replay *replay, size_t found)
{
    const struct segment *s = replay->segments;
    replay->way_back = replay->own = 0;
    if (found + 2 >= replay->n || !is_way_back(s[found + 1].call) ||
        strcmp(s[found].call, s[found + 2].call) != 0)
        return found;
    replay->segments[found].used = true;
    replay->way_back = found + 1;
    return replay->own = found + 2;
}

static void replay_begin(struct link *link, const char *call)
{
    struct replay *replay = (struct replay *)link;
    if (is_about_way_back(replay, call))
        return;
    leave_to_next(replay);
    bool status = is_status(call), wait = is_wait(call);
    size_t found = status ? find_status(replay)
                   : wait ? find_wait(replay, call)
                          : find_call(replay, call);
    free(replay->call);
    replay->call = strdup(call); /* NULL: a poorer message */
    replay->silent = wait && found == replay->n;
    replay->none = !wait && found == replay->n;
    replay->at = replay->end = replay->taken = 0;
    replay->fresh = false;
    if (found == replay->n)
        return;
    found = note_way_back(replay, found);
    enter(replay, found);
    if (!status && !wait)
        replay->here = found + 1;
}

/* ---- messages ----------------------------------------------------------------------- */

enum { SHOWN_BYTES = 24 };

/* Bytes for a message, quoted. */
static const char *show(const uint8_t *bytes, size_t n, char text[SHOWN_BYTES * 4 + 8])
{
    char *to = text;
    *to++ = '\'';
    for (size_t i = 0; i < n && i < SHOWN_BYTES; i++) {
        if (bytes[i] >= 0x20 && bytes[i] <= 0x7e && bytes[i] != '\\')
            *to++ = (char)bytes[i];
        else
            to += sprintf(to, "\\x%02x", bytes[i]);
    }
    strcpy(to, n > SHOWN_BYTES ? "'..." : "'");
    return text;
}

/* What the capture has at a line instead of what was asked of it. */
static void describe(const struct capture_line *line, char *text, size_t size)
{
    char shown[SHOWN_BYTES * 4 + 8];
    switch (line->kind) {
    case CAPTURE_SENT:
    case CAPTURE_CAME:
        snprintf(text, size, "%zu bytes %s channel %02x: %s", line->n,
                 line->kind == CAPTURE_SENT ? "sent on" : "from", line->channel,
                 show(line->bytes, line->n, shown));
        return;
    case CAPTURE_SILENCE:
        snprintf(text, size, "silence on channel %02x", line->channel);
        return;
    default:
        snprintf(text, size, "'%s'", line->text);
    }
}

/* The line on which the conversation stands; NULL at the end of the segment.  What is of no
 * interest to a wire is passed over. */
static const struct capture_line *next_line(struct replay *replay)
{
    while (replay->at < replay->end) {
        const struct capture_line *line = &replay->file.lines[replay->at];
        if (line->kind == CAPTURE_SENT || line->kind == CAPTURE_CAME ||
            line->kind == CAPTURE_SILENCE || line->kind == CAPTURE_FAILED)
            return line;
        replay->at++;
    }
    return NULL;
}

/* `wanted` was asked, and the capture has something else. */
static enum driver_result differ(struct replay *replay, const char *wanted,
                                 struct driver_error *error)
{
    const char *call = replay->call != NULL ? replay->call : "";
    const struct capture_line *line = next_line(replay);
    char there[SHOWN_BYTES * 4 + 80];
    if (replay->none)
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "%s: no further call '%s' in this capture: it was made of another "
                           "sequence of calls",
                           replay->path, call);
    if (line == NULL)
        return driver_fail(
            error, DRIVER_PROTOCOL, NULL, "%s:%u: expected the end of '%s', got %s", replay->path,
            replay->end > 0 ? replay->file.lines[replay->end - 1].line : 1, call, wanted);
    describe(line, there, sizeof there);
    return driver_fail(error, DRIVER_PROTOCOL, NULL, "%s:%u: expected %s, got %s", replay->path,
                       line->line, there, wanted);
}

static enum driver_result fail_as_captured(struct replay *replay, const struct capture_line *line,
                                           struct driver_error *error)
{
    enum driver_result result = DRIVER_CANCELLED; /* reader: it is one of the names */
    while (result < DRIVER_NO_PERMISSION && strcmp(driver_result_name(result), line->text) != 0)
        result++;
    replay->at++;
    return driver_fail(error, result, NULL, "%s:%u: the link failed here: %s", replay->path,
                       line->line, line->text);
}

/* ---- cancelled ---------------------------------------------------------------------- */

/* A cancellation reaches a replay as well. */
static bool is_cancelled(struct replay *replay, int64_t until_ms)
{
    return call_wait(replay->link.call, -1, until_ms) == CALL_CANCELLED;
}

/* ---- in a wait ---------------------------------------------------------------------- */

static bool in_wait(const struct replay *replay)
{
    return replay->call != NULL && is_wait(replay->call);
}

/* What was one wait may have been several in the capture, cut short by what the station had to do;
 * that somebody cancelled it then is no reason to end it now. */
static const struct capture_line *next_of_wait(struct replay *replay)
{
    for (;;) {
        const struct capture_line *line = next_line(replay);
        if (line != NULL && is_cancellation(line)) {
            replay->at++;
        } else if (line != NULL) {
            return line;
        } else {
            size_t more = replay->silent ? replay->n : find_wait(replay, replay->call);
            if (more == replay->n)
                return NULL;
            enter(replay, more);
        }
    }
}

/* ---- questions that the capture has at another place ---------------------------------- */

static bool is_sent(const struct capture_line *line, uint8_t channel, const void *bytes, size_t n)
{
    return line->kind == CAPTURE_SENT && line->channel == channel && line->n == n &&
           (n == 0 || memcmp(line->bytes, bytes, n) == 0);
}

/* A call that was cut short leaves the wire out of step, and the next begins with the way back
 * into it.  A replay does not cut the same calls short, and goes no such way: where the capture
 * does not tell it apart, it is passed over at the beginning of a wait. */
static bool pass_over_way_back(struct replay *replay, uint8_t channel, const void *bytes, size_t n)
{
    for (size_t i = replay->at; replay->fresh && i < replay->end; i++) {
        if (is_sent(&replay->file.lines[i], channel, bytes, n)) {
            replay->at = i;
            replay->taken = 0;
            return true;
        }
    }
    return false;
}

/* Whether what comes next in a wait answers a question of none of its own, but of a wait before. */
static bool is_asked_before(const struct replay *replay)
{
    for (size_t i = replay->segments[replay->entered].first; i < replay->at; i++)
        if (replay->file.lines[i].kind == CAPTURE_SENT)
            return false;
    return replay->at < replay->end && replay->file.lines[replay->at].kind == CAPTURE_CAME;
}

/* The same, and the question was these bytes. */
static bool is_answer_to(const struct replay *replay, uint8_t channel, const void *bytes, size_t n)
{
    if (!is_asked_before(replay))
        return false;
    for (size_t s = replay->entered; s-- > 0 && is_wait(replay->segments[s].call);)
        for (size_t i = replay->segments[s].end; i-- > replay->segments[s].first;) {
            const struct capture_line *line = &replay->file.lines[i];
            if (line->kind == CAPTURE_SENT || line->kind == CAPTURE_CAME)
                return is_sent(line, channel, bytes, n);
        }
    return false;
}

/* A driver that asks again and again while it waits is answered as it was last: the capture has
 * as many questions as there was time for then. */
static void answer_as_before(struct replay *replay, uint8_t channel, const void *bytes, size_t n)
{
    size_t other = next_other(replay);
    size_t i = other < replay->n ? replay->segments[other].first : replay->file.n, end = i;
    while (i-- > 0) {
        const struct capture_line *line = &replay->file.lines[i];
        if (is_sent(line, channel, bytes, n)) {
            replay->at = i + 1;
            replay->end = end;
            replay->taken = 0;
            return;
        }
        if (line->kind == CAPTURE_CALL || line->kind == CAPTURE_SENT)
            end = i;
    }
}

/* What came before a call's first question was late, or unasked, and a replay need not listen. */
static void pass_over_what_came(struct replay *replay)
{
    const struct capture_line *line;
    while (replay->fresh && (line = next_line(replay)) != NULL &&
           (line->kind == CAPTURE_CAME || line->kind == CAPTURE_SILENCE)) {
        replay->at++;
        replay->taken = 0;
    }
}

/* Where the capture has these bytes in a call that is no wait; false: not there. */
static bool find_in_call(struct replay *replay, uint8_t channel, const void *bytes, size_t n)
{
    pass_over_what_came(replay);
    const struct capture_line *line = next_line(replay);
    bool found = line != NULL && is_sent(line, channel, bytes, n);
    replay->at += found;
    return found;
}

/* The same in a wait, where they are also answered as before, or not at all. */
static bool find_question(struct replay *replay, uint8_t channel, const void *bytes, size_t n)
{
    const struct capture_line *line;
    while ((line = next_of_wait(replay)) != NULL) {
        if (is_sent(line, channel, bytes, n) || pass_over_way_back(replay, channel, bytes, n)) {
            replay->at++;
            return true;
        }
        if (line->kind == CAPTURE_SILENCE) /* its time had not come then */
            replay->at++;
        else if (is_answer_to(replay, channel, bytes, n))
            return true; /* a wait of the capture that had no time for its answer was left out */
        else if (replay->fresh)
            replay->at = replay->end; /* nothing but a way back */
        else
            return false;
    }
    answer_as_before(replay, channel, bytes, n);
    return true;
}

/* ---- sending and receiving ---------------------------------------------------------- */

static enum driver_result replay_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct replay *replay = (struct replay *)link;
    (void)deadline_ms;
    if (is_cancelled(replay, 0))
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    bool found = in_wait(replay) ? find_question(replay, channel, bytes, n)
                                 : find_in_call(replay, channel, bytes, n);
    replay->fresh = false;
    if (found)
        return DRIVER_OK;
    const struct capture_line *line = next_line(replay);
    if (line != NULL && line->kind == CAPTURE_FAILED)
        return fail_as_captured(replay, line, error);
    char shown[SHOWN_BYTES * 4 + 8], wanted[SHOWN_BYTES * 4 + 80];
    snprintf(wanted, sizeof wanted, "%zu bytes sent on channel %02x: %s", n, channel,
             show(bytes, n, shown));
    return differ(replay, wanted, error);
}

/* A line gives what there is room for and the rest later; a transfer is whole or too long. */
static enum driver_result give_bytes(struct replay *replay, const struct capture_line *line,
                                     void *bytes, size_t size, size_t *n,
                                     struct driver_error *error)
{
    size_t left = line->n - replay->taken;
    replay->fresh = false;
    if (left > size && line->channel != LINK_SERIAL) {
        replay->at++;
        return driver_fail(error, DRIVER_PROTOCOL, NULL,
                           "%s:%u: a transfer of %zu bytes came where %zu were asked for",
                           replay->path, line->line, line->n, size);
    }
    size_t now = left < size ? left : size;
    if (now > 0)
        memcpy(bytes, line->bytes + replay->taken, now);
    replay->taken += now;
    if (replay->taken == line->n) {
        replay->taken = 0;
        replay->at++;
    }
    *n = now;
    return DRIVER_OK;
}

static enum driver_result fail_silent(struct driver_error *error)
{
    return driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing came");
}

static enum driver_result replay_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    struct replay *replay = (struct replay *)link;
    const struct capture_line *line = in_wait(replay) ? next_of_wait(replay) : next_line(replay);
    /* The rest of a wait is silent, too: its driver waits for longer than was captured. */
    bool wait = in_wait(replay) && line == NULL;
    if (is_cancelled(replay, wait ? deadline_ms : 0))
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    if (wait)
        return fail_silent(error);
    if (line != NULL && line->kind == CAPTURE_FAILED)
        return fail_as_captured(replay, line, error);
    if (line != NULL && line->kind == CAPTURE_SENT && in_wait(replay))
        return fail_silent(error); /* it had been waited for long enough */
    if (line == NULL || line->kind == CAPTURE_SENT || line->channel != channel) {
        char wanted[64];
        snprintf(wanted, sizeof wanted, "a wait for bytes on channel %02x", channel);
        return differ(replay, wanted, error);
    }
    if (line->kind == CAPTURE_CAME && in_wait(replay) && is_asked_before(replay) &&
        call_now_ms() >= deadline_ms) {
        replay->fresh = true; /* it took longer than this wait: for the next */
        return fail_silent(error);
    }
    if (line->kind == CAPTURE_CAME)
        return give_bytes(replay, line, bytes, size, n, error);
    replay->at++;
    return fail_silent(error);
}

/* Captures of other programs know no silence: what came is left out, whichever way it ends. */
static enum driver_result replay_drain(struct link *link, uint8_t channel, int quiet_ms,
                                       int64_t deadline_ms, struct driver_error *error)
{
    struct replay *replay = (struct replay *)link;
    const struct capture_line *line;
    (void)quiet_ms, (void)deadline_ms;
    if (is_cancelled(replay, 0))
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    while ((line = next_line(replay)) != NULL && line->channel == channel &&
           (line->kind == CAPTURE_CAME || line->kind == CAPTURE_SILENCE)) {
        replay->taken = 0;
        replay->at++;
        if (line->kind == CAPTURE_SILENCE)
            return DRIVER_OK;
    }
    if (line != NULL && line->kind == CAPTURE_FAILED)
        return fail_as_captured(replay, line, error);
    return DRIVER_OK;
}

/* What the driver was told then; where the capture does not say, the time it was. */
static int64_t replay_realtime_s(struct link *link)
{
    struct replay *replay = (struct replay *)link;
    double elapsed_s = 0.0;
    for (size_t i = replay->at; i < replay->end; i++) {
        const struct capture_line *line = &replay->file.lines[i];
        if (line->kind == CAPTURE_CLOCK) {
            replay->at = i + 1;
            return strtoll(line->text, NULL, 10);
        }
        if (line->kind != CAPTURE_ASKED)
            break;
    }
    if (replay->at < replay->end)
        elapsed_s = replay->file.lines[replay->at].at_s;
    return replay->file.realtime_s + (int64_t)elapsed_s;
}

/* ---- its life ----------------------------------------------------------------------- */

static void replay_close(struct link *link)
{
    struct replay *replay = (struct replay *)link;
    capture_free(&replay->file);
    free(replay->segments);
    free(replay->call);
    free(replay->path);
    free(replay);
}

static const struct link_ops replay_ops = {
    .kind = "replay",
    .send = replay_send,
    .receive = replay_receive,
    .drain = replay_drain,
    .begin = replay_begin,
    .realtime_s = replay_realtime_s,
    .close = replay_close,
};

static enum driver_result fail_to_read(const char *path, enum status s, struct driver_error *error)
{
    return driver_fail(error, s == STATUS_NO_MEMORY ? DRIVER_FAULT : DRIVER_UNSUPPORTED, NULL,
                       "cannot replay %s: %s; the log names the line", path, status_text(s));
}

enum driver_result link_open_replay(const char *path, const struct link_wanted *wanted,
                                    struct link **ret, struct driver_error *error)
{
    struct replay *replay = calloc(1, sizeof *replay);
    if (replay == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    replay->link = (struct link){ &replay_ops, wanted->call };
    enum status s = capture_read(path, &replay->file);
    if (s == STATUS_OK) {
        replay->path = strdup(path);
        if (replay->path == NULL || !cut_into_segments(replay))
            s = STATUS_NO_MEMORY;
    }
    if (s != STATUS_OK) {
        replay_close(&replay->link);
        return fail_to_read(path, s, error);
    }
    *ret = &replay->link;
    return DRIVER_OK;
}
