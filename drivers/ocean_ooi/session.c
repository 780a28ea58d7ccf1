/* session.c - one question at a time.
 *
 * From top to bottom: questions, settings, back into step, spectra. */
#include "drivers/ocean_ooi/session.h"

#include <stdlib.h>

enum {
    SETTLE_MS = 100, /* after 01, as the free drivers do */
    QUIET_MS = 20,
    LOOKS = 2,
    TRIES = 2, /* of a question, of a spectrum */
};

/* ---- questions ---------------------------------------------------------------------- */

/* What happened to a step of the conversation: a failure leaves it out of step. */
static enum driver_result note(struct ooi_session *s, enum driver_result result)
{
    if (result != DRIVER_OK) {
        s->out_of_step = true;
        s->looks = LOOKS;
    }
    return result;
}

static enum driver_result send(struct ooi_session *s, const uint8_t *request, size_t n,
                               struct driver_error *error)
{
    return note(
        s, link_send(s->link, OOI_OUT, request, n, call_now_ms() + s->reply_timeout_ms, error));
}

/* One kind of answer: reads it into *ret, or says that it is none. */
struct answer {
    bool (*read)(const uint8_t *bytes, size_t n, uint8_t which, void *ret);
    uint8_t which; /* slot or register */
    void *ret;
};

static enum driver_result ask(struct ooi_session *s, const uint8_t *request, size_t n_request,
                              const struct answer *answer, struct driver_error *error)
{
    for (int i = 0; i < TRIES; i++) {
        uint8_t reply[OOI_REPLY_BYTES];
        size_t n = 0;
        enum driver_result r = send(s, request, n_request, error);
        if (r == DRIVER_OK)
            r = note(s, link_receive(s->link, OOI_REPLY, reply, sizeof reply, &n,
                                     call_now_ms() + s->reply_timeout_ms, error));
        if (r == DRIVER_OK && answer->read(reply, n, answer->which, answer->ret))
            return DRIVER_OK;
        if (r != DRIVER_OK && r != DRIVER_PROTOCOL)
            return r;
        /* No such answer, or a stall: perhaps the answer to something earlier. */
        r = note(s, link_drain(s->link, OOI_REPLY, QUIET_MS, call_now_ms() + s->reply_timeout_ms,
                               error));
        if (r != DRIVER_OK)
            return r;
    }
    return note(s, driver_fail(error, DRIVER_PROTOCOL, NULL,
                               "no answer of this instrument came to request %02X: unplug the "
                               "spectrometer and connect it again",
                               request[0]));
}

static bool read_slot(const uint8_t *bytes, size_t n, uint8_t which, void *ret)
{
    return ooi_read_slot(bytes, n, which, ret);
}

static bool read_level(const uint8_t *bytes, size_t n, uint8_t which, void *ret)
{
    (void)which;
    return ooi_read_level(bytes, n, ret);
}

static bool read_register(const uint8_t *bytes, size_t n, uint8_t which, void *ret)
{
    return ooi_read_register(bytes, n, which, ret);
}

static bool read_temperature(const uint8_t *bytes, size_t n, uint8_t which, void *ret)
{
    (void)which;
    return ooi_read_temperature(bytes, n, ret);
}

static bool read_status(const uint8_t *bytes, size_t n, uint8_t which, void *ret)
{
    (void)which;
    return ooi_read_status(bytes, n, ret);
}

enum driver_result ooi_get_status(struct ooi_session *s, struct ooi_status *ret,
                                  struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    struct answer answer = { read_status, 0, ret };
    return ask(s, request, ooi_ask_status(request), &answer, error);
}

enum driver_result ooi_get_slot(struct ooi_session *s, uint8_t slot, char text[OOI_SLOT_TEXT],
                                struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    struct answer answer = { read_slot, slot, text };
    return ask(s, request, ooi_ask_slot(request, slot), &answer, error);
}

enum driver_result ooi_get_level(struct ooi_session *s, uint16_t *ret, struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    struct answer answer = { read_level, 0, ret };
    return ask(s, request, ooi_ask_slot(request, OOI_SLOT_AUTO_NULL), &answer, error);
}

enum driver_result ooi_get_register(struct ooi_session *s, uint8_t reg, uint16_t *ret,
                                    struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    struct answer answer = { read_register, reg, ret };
    return ask(s, request, ooi_ask_register(request, reg), &answer, error);
}

enum driver_result ooi_get_temperature(struct ooi_session *s, double *celsius,
                                       struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    struct answer answer = { read_temperature, 0, celsius };
    return ask(s, request, ooi_ask_temperature(request), &answer, error);
}

/* ---- settings ----------------------------------------------------------------------- */

enum driver_result ooi_set_integration(struct ooi_session *s, double us, struct driver_error *error)
{
    const struct ooi_model *m = s->model;
    uint32_t wanted = ooi_model_integration_us(m, us);
    uint32_t step = wanted < m->fine_below_us ? m->fine_step_us : m->step_us;
    uint8_t request[OOI_MAX_REQUEST];
    struct ooi_status status = { .pixels = 0 };
    if (wanted == s->integration_us)
        return DRIVER_OK;
    enum driver_result r = send(s, request, ooi_ask_integration(request, wanted), error);
    if (r == DRIVER_OK)
        r = ooi_get_status(s, &status, error);
    if (r != DRIVER_OK)
        return r;
    if (labs((long)status.integration_us - (long)wanted) > (long)step)
        return note(s, driver_fail(error, DRIVER_PROTOCOL, NULL,
                                   "the spectrometer keeps an integration time of %u us instead of "
                                   "%u us: unplug it and connect it again",
                                   status.integration_us, wanted));
    if (s->integration_us > s->earlier_us)
        s->earlier_us = s->integration_us;
    s->integration_us = status.integration_us;
    return DRIVER_OK;
}

/* ---- back into step ----------------------------------------------------------------- */

/* Twice the integration time: an exposure that runs must end first.  It may be a longer one, from
 * before a change. */
static int64_t exposures_ms(const struct ooi_session *s)
{
    uint32_t us = s->earlier_us > s->integration_us ? s->earlier_us : s->integration_us;
    return 2 * (int64_t)(us / 1000);
}

static int64_t spectrum_deadline_ms(const struct ooi_session *s)
{
    return call_now_ms() + exposures_ms(s) + s->reply_timeout_ms;
}

static bool comes_in_two(const struct ooi_session *s)
{
    return s->high_speed && s->model != NULL && s->model->early_bytes > 0;
}

static enum driver_result drain(struct ooi_session *s, uint8_t endpoint, int quiet_ms,
                                struct driver_error *error)
{
    return link_drain(s->link, endpoint, quiet_ms,
                      call_now_ms() + quiet_ms + exposures_ms(s) + s->reply_timeout_ms, error);
}

enum driver_result ooi_restart(struct ooi_session *s, struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    double us = s->integration_us;
    /* Whoever expects answers sooner than that has no such instrument, but a simulated one. */
    int settle_ms = s->reply_timeout_ms < SETTLE_MS ? s->reply_timeout_ms : SETTLE_MS;
    enum driver_result r = send(s, request, ooi_ask_initialise(request), error);
    if (r == DRIVER_OK) /* the pause, and whatever was still to be answered */
        r = note(s, drain(s, OOI_REPLY, settle_ms, error));
    if (r == DRIVER_OK)
        r = send(s, request, ooi_ask_lamp(request, true), error);
    s->earlier_us = s->integration_us > s->earlier_us ? s->integration_us : s->earlier_us;
    s->integration_us = 0; /* whatever it is now */
    if (r == DRIVER_OK && us > 0.0)
        r = ooi_set_integration(s, us, error);
    if (r != DRIVER_OK)
        s->integration_us = (uint32_t)us; /* to be set by the next try */
    return r;
}

static enum driver_result resync(struct ooi_session *s, struct driver_error *error)
{
    struct driver_error nothing_came;
    size_t n;
    enum driver_result r = DRIVER_OK;
    if (s->pending_until_ms > call_now_ms()) {
        r = link_receive(s->link, comes_in_two(s) ? OOI_EARLY : OOI_LATE, s->bytes, sizeof s->bytes,
                         &n, s->pending_until_ms, &nothing_came);
        if (r != DRIVER_OK && r != DRIVER_TIMEOUT && r != DRIVER_PROTOCOL) {
            *error = nothing_came;
            return note(s, r);
        }
    }
    s->pending_until_ms = 0;
    r = note(s, drain(s, OOI_LATE, QUIET_MS, error));
    if (r == DRIVER_OK && comes_in_two(s))
        r = note(s, drain(s, OOI_EARLY, QUIET_MS, error));
    if (r == DRIVER_OK)
        r = ooi_restart(s, error);
    if (r == DRIVER_OK)
        s->out_of_step = false;
    return r;
}

/* Something late is there although all seemed in step. */
static enum driver_result look(struct ooi_session *s, struct driver_error *error)
{
    static const uint8_t endpoints[] = { OOI_REPLY, OOI_LATE, OOI_EARLY };
    size_t n_endpoints = comes_in_two(s) ? 3 : 2;
    s->looks--;
    for (size_t i = 0; i < n_endpoints; i++) {
        struct driver_error nothing_came;
        size_t n;
        enum driver_result r = link_receive(s->link, endpoints[i], s->bytes, sizeof s->bytes, &n,
                                            call_now_ms(), &nothing_came);
        if (r == DRIVER_TIMEOUT)
            continue;
        if (r == DRIVER_OK || r == DRIVER_PROTOCOL)
            return resync(s, error);
        *error = nothing_came;
        return note(s, r);
    }
    return DRIVER_OK;
}

enum driver_result ooi_begin(struct ooi_session *s, const char *call, struct driver_error *error)
{
    link_begin(s->link, call);
    if (s->out_of_step) {
        link_tell(s->link, LINK_WAY_BACK);
        enum driver_result r = resync(s, error);
        if (r == DRIVER_OK)
            link_tell(s->link, call);
        return r;
    }
    return s->looks > 0 ? look(s, error) : DRIVER_OK;
}

/* ---- spectra -----------------------------------------------------------------------------------
 */

/* Whole packets that hold n bytes and one more. */
static size_t receive_size(size_t n)
{
    return (n / OOI_PACKET + 1) * OOI_PACKET;
}

/* All bytes of one spectrum, however many these are. */
static enum driver_result fetch(struct ooi_session *s, size_t *n, struct driver_error *error)
{
    uint8_t request[OOI_MAX_REQUEST];
    size_t early = 0, late = 0, whole = ooi_frame_bytes(s->model);
    size_t early_size = comes_in_two(s) ? s->model->early_bytes : 0;
    int64_t deadline_ms = spectrum_deadline_ms(s);
    enum driver_result r = send(s, request, ooi_ask_spectrum(request), error);
    s->pending_until_ms = deadline_ms;
    if (r == DRIVER_OK && early_size > 0)
        r = note(
            s, link_receive(s->link, OOI_EARLY, s->bytes, early_size, &early, deadline_ms, error));
    if (r == DRIVER_OK && early == early_size)
        r = note(s, link_receive(s->link, OOI_LATE, s->bytes + early,
                                 receive_size(whole - early_size), &late, deadline_ms, error));
    if (r == DRIVER_OK) {
        s->pending_until_ms = 0;
        *n = early == early_size ? early + late : early;
    }
    return r;
}

static enum driver_result refuse_frame(struct ooi_session *s, enum ooi_frame frame, size_t n,
                                       struct driver_error *error)
{
    switch (frame) {
    case OOI_FRAME_COUNT:
        return note(s, driver_fail(error, DRIVER_PROTOCOL, NULL,
                                   "spectra of %zu bytes came instead of %zu: unplug the "
                                   "spectrometer and connect it again",
                                   n, ooi_frame_bytes(s->model)));
    case OOI_FRAME_SYNC:
        return note(s, driver_fail(error, DRIVER_PROTOCOL, NULL,
                                   "spectra come without their end mark: unplug the spectrometer "
                                   "and connect it again"));
    default:
        return note(s, driver_fail(error, DRIVER_PROTOCOL, NULL,
                                   "spectra hold counts above %u: is this a %s?",
                                   s->model->full_scale, s->model->name));
    }
}

/* stale frames and one more; DRIVER_PROTOCOL at the first that is none. */
static enum driver_result take_one(struct ooi_session *s, size_t stale, uint16_t *counts,
                                   struct driver_error *error)
{
    for (size_t i = 0; i <= stale; i++) {
        size_t n = 0;
        enum driver_result r = fetch(s, &n, error);
        if (r != DRIVER_OK)
            return r;
        enum ooi_frame frame = ooi_read_frame(s->model, s->bytes, n, counts);
        if (frame != OOI_FRAME_OK)
            return refuse_frame(s, frame, n, error);
    }
    if (stale >= OOI_STALE_FRAMES)
        s->earlier_us = 0;
    return DRIVER_OK;
}

enum driver_result ooi_take_frame(struct ooi_session *s, size_t stale, uint16_t *counts,
                                  struct driver_error *error)
{
    struct driver_error first;
    enum driver_result r = take_one(s, stale, counts, &first);
    if (r == DRIVER_PROTOCOL) {
        r = resync(s, error);
        return r == DRIVER_OK ? take_one(s, OOI_STALE_FRAMES, counts, error) : r;
    }
    if (r != DRIVER_OK)
        *error = first;
    return r;
}
