/* driver_session.c - the link that gives a fuzzer's bytes, and the calls of a session. */
#include "tests/fuzz/driver_session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/link/line.h"

enum { SILENCE = 0xfe, MOST_SENDS = 2000 };

static const struct driver_session *held;
static const unsigned char *at, *end;
static unsigned silences, sends;
static int64_t now_ms;

void driver_session_must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "driver_session: %s\n", what);
    abort();
}

/* ---- time --------------------------------------------------------------------------- */

/* Instead of call.c's, by --wrap: a wait in vain is over at once, and then it is its deadline. */
int64_t __wrap_call_now_ms(void);
enum call_end_of_wait __wrap_call_wait(struct call *call, int fd, int64_t deadline_ms);

int64_t __wrap_call_now_ms(void)
{
    return now_ms;
}

static void wait_until(int64_t deadline_ms)
{
    now_ms = deadline_ms > now_ms ? deadline_ms : now_ms;
}

enum call_end_of_wait __wrap_call_wait(struct call *call, int fd, int64_t deadline_ms)
{
    (void)call, (void)fd;
    wait_until(deadline_ms);
    return CALL_DEADLINE;
}

/* ---- the link ----------------------------------------------------------------------- */

static enum driver_result gone(struct driver_error *error)
{
    return driver_fail(error, DRIVER_GONE, NULL, "the bytes are used up");
}

static enum driver_result fuzz_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                                    int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel, (void)deadline_ms;
    driver_session_must(held->may_send(bytes, n), "a command that may not be sent");
    return at < end && sends++ < MOST_SENDS ? DRIVER_OK : gone(error);
}

static enum driver_result fuzz_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                       size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel;
    if (at == end)
        return gone(error);
    if (*at == SILENCE) {
        at++;
        wait_until(deadline_ms);
        return silences++ < held->most_silences
                   ? driver_fail(error, DRIVER_TIMEOUT, NULL, "silence")
                   : gone(error);
    }
    const unsigned char *stop = memchr(at, SILENCE, (size_t)(end - at));
    const unsigned char *feed = memchr(at, '\n', (size_t)(end - at));
    stop = stop == NULL ? end : stop;
    if (feed != NULL && feed < stop)
        stop = feed + 1; /* a line at a time: what comes unasked comes later */
    *n = (size_t)(stop - at) < size ? (size_t)(stop - at) : size;
    memcpy(bytes, at, *n);
    at += *n;
    return DRIVER_OK;
}

static enum driver_result fuzz_drain(struct link *link, uint8_t channel, int quiet_ms,
                                     int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel, (void)quiet_ms, (void)deadline_ms;
    if (at == end)
        return gone(error);
    const unsigned char *stop = memchr(at, SILENCE, (size_t)(end - at));
    if (stop != NULL && stop - at < 64)
        at = stop + 1;
    return DRIVER_OK;
}

static void fuzz_close(struct link *link)
{
    (void)link;
}

static const struct link_ops fuzz_ops = { .kind = "fuzz",
                                          .send = fuzz_send,
                                          .receive = fuzz_receive,
                                          .drain = fuzz_drain,
                                          .close = fuzz_close };

static enum driver_result fuzz_open(const struct link_source *source,
                                    const struct link_wanted *wanted, struct link **ret,
                                    struct driver_error *error)
{
    static struct link link;
    (void)source, (void)error;
    link = (struct link){ &fuzz_ops, wanted->call };
    *ret = &link;
    return DRIVER_OK;
}

/* ---- lines -------------------------------------------------------------------------- */

void driver_session_lines(const unsigned char *data, size_t size, void (*read)(char *line))
{
    char line[LINE_MAX_BYTES];
    for (const unsigned char *from = data, *stop = data + size; from < stop;) {
        const unsigned char *feed = memchr(from, '\n', (size_t)(stop - from));
        size_t n = (size_t)((feed != NULL ? feed : stop) - from);
        size_t kept = n < sizeof line - 1 ? n : sizeof line - 1;
        memcpy(line, from, kept);
        line[kept] = '\0';
        read(line);
        from += n + 1;
    }
}

/* ---- a session ---------------------------------------------------------------------- */

static struct driver_error error;

static bool went(enum driver_result r)
{
    if (r != DRIVER_OK) {
        driver_session_must(error.result == r, "another result in the error");
        driver_session_must(
            error.text[0] != '\0' && memchr(error.text, 0, sizeof error.text) != NULL, "no text");
    }
    error.result = DRIVER_OK;
    error.text[0] = '\0';
    return r == DRIVER_OK;
}

static void check_reading(const struct driver_reading *r)
{
    driver_session_must(r->has_sce || r->has_sci, "no spectrum");
    driver_session_must(r->warnings >> DRIVER_WARNINGS == 0, "warnings");
    for (size_t i = 0; i < r->sce.n && r->has_sce; i++)
        driver_session_must(r->sce.value[i] >= 0.0 && r->sce.value[i] <= 2.0 + 1e-9, "SCE");
    for (size_t i = 0; i < r->sci.n && r->has_sci; i++)
        driver_session_must(r->sci.value[i] >= 0.0 && r->sci.value[i] <= 2.0 + 1e-9, "SCI");
}

void driver_session_hold(const struct driver_session *session, const unsigned char *data,
                         size_t size)
{
    static struct driver_reading reading;
    static const struct link_source source = { fuzz_open };
    const struct driver *driver = session->driver;
    struct driver_options options = { .address = "",
                                      .reply_timeout_ms = 1000,
                                      .open_timeout_ms = session->open_timeout_ms,
                                      .wire = &source };
    struct driver_identity identity;
    struct driver_status status;
    struct instrument *in;
    bool pressed;
    size_t stored;
    held = session;
    at = data;
    end = data + size;
    silences = sends = 0;
    now_ms = 1000;
    if (!went(driver->open(&options, &in, &identity, &error)))
        return;
    driver_session_must(memchr(identity.serial, 0, sizeof identity.serial) != NULL, "serial");
    went(driver->status(in, &status, &error));
    went(driver->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    went(driver->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    for (int i = 0; i < 3; i++)
        if (went(driver->measure(in, &reading, &error)))
            check_reading(&reading);
    if (went(driver->wait_button(in, 0, &pressed, &error)) &&
        went(driver->measure(in, &reading, &error)))
        check_reading(&reading);
    struct driver_setup setup = { .averages = identity.max_averages > 1 ? 2 : 1 };
    went(driver->configure(in, &setup, &error));
    if (went(driver->stored_count(in, &stored, &error)) && stored > 0 &&
        went(driver->stored_read(in, 0, &reading, &error)))
        check_reading(&reading);
    driver->close(in);
}
