/* press.c - the instrument's own button: 01XD, answered when it has been pressed.
 *
 * Between two waits 01XD goes on waiting, so that a press that comes then is in the line when the
 * next wait begins.  Every other call ends it with CE. */
#include "drivers/xrite_rci/conversation.h"

static void note_press(struct instrument *in, int64_t at_ms)
{
    in->press.armed = false;
    in->press.pressed = true;
    in->press.at_ms = at_ms;
}

/* An answer to 01XD: true for a press, also one whose shot failed. */
static bool is_press(const struct rci_reply *reply)
{
    return reply->n == 0 &&
           (rci_reaction_to(reply) == RCI_DONE || reply->status == 0x20 || reply->status == 0x27);
}

void rci_note_unasked(struct instrument *in, const struct rci_reply *reply)
{
    if (!in->press.armed || rci_find_code(reply->status) == NULL || reply->n > 0)
        return;
    in->has_error = in->has_error || reply->status >= 0x20;
    if (is_press(reply))
        note_press(in, INT64_MIN); /* who was not waiting does not know when */
    in->press.armed = false;
}

void rci_forget_press(struct instrument *in)
{
    in->press.ready = false;
}

bool rci_take_press(struct instrument *in)
{
    bool fresh = in->press.ready && !in->has_error &&
                 call_now_ms() - DRIVER_PRESS_FRESH_MS <= in->press.at_ms;
    in->press.ready = false;
    return fresh;
}

/* ---- waiting ------------------------------------------------------------------------ */

static enum driver_result arm(struct instrument *in, struct driver_error *error)
{
    enum driver_result r = in->has_error ? rci_clear(in, error) : DRIVER_OK;
    if (r == DRIVER_OK)
        r = rci_send(in, "01XD", error);
    in->press.armed = r == DRIVER_OK;
    return r;
}

static enum driver_result take_answer(struct instrument *in, const struct rci_reply *reply,
                                      int64_t deadline_ms, struct driver_error *error)
{
    in->press.armed = false;
    if (is_press(reply)) {
        note_press(in, call_now_ms());
        return DRIVER_OK;
    }
    switch (rci_reaction_to(reply)) {
    case RCI_WAIT:
    case RCI_RESEND: /* another program's bytes were in the way */
        return rci_pause(in, deadline_ms, error);
    case RCI_ABORTED: /* by the instrument's keys; or another's bytes */
    case RCI_EXPIRED: /* after 320 s */
        return DRIVER_OK;
    default:
        return rci_judge(in, reply, error);
    }
}

static enum driver_result wait_button(struct instrument *in, int64_t deadline_ms,
                                      struct driver_error *error)
{
    for (bool first = true;; first = false) {
        struct rci_reply reply;
        struct driver_error attempt;
        enum driver_result r = DRIVER_OK;
        if (in->press.pressed || (!first && call_now_ms() >= deadline_ms))
            return DRIVER_OK;
        if (!in->press.armed)
            r = arm(in, error);
        if (r != DRIVER_OK)
            return r;
        r = rci_await(in, RCI_STATUS, deadline_ms, in->line[0], &reply, &attempt);
        if (r == DRIVER_TIMEOUT)
            return DRIVER_OK;
        if (r == DRIVER_PROTOCOL) { /* noise, or an answer that came damaged: begin anew */
            r = rci_clear(in, error);
        } else if (r == DRIVER_OK) {
            r = take_answer(in, &reply, deadline_ms, error);
        } else {
            *error = attempt;
        }
        if (r != DRIVER_OK)
            return r;
    }
}

enum driver_result rci_wait_button(struct instrument *in, int timeout_ms, bool *pressed,
                                   struct driver_error *error)
{
    struct driver_error attempt;
    int64_t deadline_ms = call_now_ms() + timeout_ms;
    bool may = !in->due[DRIVER_CALIBRATION_ZERO] && !in->due[DRIVER_CALIBRATION_WHITE];
    enum driver_result r = rci_begin_waiting(in, "wait_button", &attempt);
    /* Where there is nothing to press for, the wait is one nevertheless. */
    if (r == DRIVER_OK)
        r = may || in->press.pressed ? wait_button(in, deadline_ms, &attempt)
                                     : link_pause(in->link, deadline_ms, &attempt);
    if (r != DRIVER_OK) {
        bool goes_on = r == DRIVER_CANCELLED && in->press.armed;
        *error = attempt;
        return goes_on ? r : rci_end(in, r);
    }
    *pressed = in->press.pressed;
    in->press.ready = in->press.pressed;
    in->press.pressed = false;
    return DRIVER_OK;
}
