/* fuzz_km_ascii.c - any bytes as what a CM-700d or CM-2600d sends: to the readers of lines, then to
 * a whole session.  What comes out as a reading is a reflectance; what fails says why.
 *
 * In the bytes 0xfe is silence: a wait ends there in vain, and a drain takes all up to it.  When
 * the bytes are used up, or after many silences, the instrument is gone: nothing waits. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/km_ascii/km_ascii_wire.h"
#include "drivers/link/line.h"

enum { SILENCE = 0xfe, MOST_SILENCES = 24, MOST_SENDS = 2000 };

static const unsigned char *at, *end;
static unsigned silences, sends;

static void must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_km_ascii: %s\n", what);
    abort();
}

/* ---- time --------------------------------------------------------------------------- */

/* Instead of call_wait(), by --wrap: no pause takes any time, and nobody cancels. */
enum call_end_of_wait __wrap_call_wait(struct call *call, int fd, int64_t deadline_ms);

enum call_end_of_wait __wrap_call_wait(struct call *call, int fd, int64_t deadline_ms)
{
    (void)call, (void)fd, (void)deadline_ms;
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
    static const char *const never[] = { "CDS", "UCS", "CIS", "SDD", "SAD", "WMS" };
    (void)link, (void)channel, (void)deadline_ms;
    for (size_t i = 0; i < sizeof never / sizeof *never; i++)
        must(n < 3 || memcmp(bytes, never[i], 3) != 0, "a command that writes factory data");
    return at < end && sends++ < MOST_SENDS ? DRIVER_OK : gone(error);
}

static enum driver_result fuzz_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                       size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel, (void)deadline_ms;
    if (at == end)
        return gone(error);
    if (*at == SILENCE) {
        at++;
        return silences++ < MOST_SILENCES ? driver_fail(error, DRIVER_TIMEOUT, NULL, "silence")
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

/* ---- the readers -------------------------------------------------------------------- */

static void check_spectrum(const struct km_dialect *dialect, size_t n, const int32_t *raw)
{
    if (doubt_spectrum(n, raw, dialect->raw_unit) != DOUBT_NONE)
        return;
    for (size_t i = 0; i < n; i++)
        must(raw[i] >= 0 && raw[i] * dialect->raw_unit <= 2.0 + 1e-9, "a band out of range");
}

static void read_line_as(const struct km_dialect *dialect, const struct km_reply *reply)
{
    int32_t raw[KM_MAX_FIELDS];
    struct km_state state;
    struct km_settings settings;
    (void)km_find_code(dialect, reply);
    if (dialect->read_state(reply, &state))
        must(state.voltage <= 2, "voltage");
    if (dialect->read_settings(reply, &settings))
        must(settings.area <= 2 && settings.averages <= 10, "settings");
    if (reply->fields > 0 && km_read_spectrum(dialect, reply, 0, reply->fields, raw) == DOUBT_NONE)
        check_spectrum(dialect, reply->fields, raw);
}

static void read_lines(const unsigned char *data, size_t size)
{
    char line[LINE_MAX_BYTES];
    for (const unsigned char *from = data, *stop = data + size; from < stop;) {
        const unsigned char *feed = memchr(from, '\n', (size_t)(stop - from));
        size_t n = (size_t)((feed != NULL ? feed : stop) - from);
        struct km_reply reply;
        struct driver_identity identity;
        size_t kept = n < sizeof line - 1 ? n : sizeof line - 1;
        memcpy(line, from, kept);
        line[kept] = '\0';
        if (km_read_reply(line, &reply)) {
            read_line_as(&km_cm700d, &reply);
            read_line_as(&km_cm2600d, &reply);
            if (km_read_identity(&reply, &identity) != NULL)
                must(identity.grid[0].n >= 2 && identity.grid[0].n <= KM_MAX_FIELDS, "bands");
        }
        from += n + 1;
    }
}

/* ---- a session ---------------------------------------------------------------------- */

static struct driver_error error;

static bool went(enum driver_result r)
{
    if (r != DRIVER_OK) {
        must(error.result == r, "another result in the error");
        must(error.text[0] != '\0' && memchr(error.text, 0, sizeof error.text) != NULL, "no text");
    }
    error.result = DRIVER_OK;
    error.text[0] = '\0';
    return r == DRIVER_OK;
}

static void check_reading(const struct driver_reading *r)
{
    must(r->has_sce || r->has_sci, "no spectrum");
    must(r->warnings >> DRIVER_WARNINGS == 0, "warnings");
    for (size_t i = 0; i < r->sce.n && r->has_sce; i++)
        must(r->sce.value[i] >= 0.0 && r->sce.value[i] <= 2.0 + 1e-9, "SCE");
    for (size_t i = 0; i < r->sci.n && r->has_sci; i++)
        must(r->sci.value[i] >= 0.0 && r->sci.value[i] <= 2.0 + 1e-9, "SCI");
}

static void hold_session(void)
{
    static struct driver_reading reading;
    static const struct link_source source = { fuzz_open };
    const struct driver *km = &km_ascii_driver;
    struct driver_options options = {
        .address = "", .reply_timeout_ms = 1000, .open_timeout_ms = 4000, .wire = &source
    };
    struct driver_identity identity;
    struct driver_status status;
    struct instrument *in;
    bool pressed;
    size_t stored;
    if (!went(km->open(&options, &in, &identity, &error)))
        return;
    must(memchr(identity.serial, 0, sizeof identity.serial) != NULL, "serial");
    went(km->status(in, &status, &error));
    went(km->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    went(km->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    for (int i = 0; i < 3; i++)
        if (went(km->measure(in, &reading, &error)))
            check_reading(&reading);
    if (went(km->wait_button(in, 0, &pressed, &error)) && went(km->measure(in, &reading, &error)))
        check_reading(&reading);
    struct driver_setup setup = { .averages = identity.max_averages > 1 ? 2 : 1 };
    went(km->configure(in, &setup, &error));
    if (went(km->stored_count(in, &stored, &error)) && stored > 0 &&
        went(km->stored_read(in, 0, &reading, &error)))
        check_reading(&reading);
    km->close(in);
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    read_lines(data, size);
    at = data;
    end = data + size;
    silences = sends = 0;
    hold_session();
    return 0;
}
