/* fuzz_xrite_rci.c - any bytes as what an SP62 sends: to the readers of lines, then to a whole
 * session.  What comes out as a reading is a reflectance; what fails says why; and nothing is sent
 * but the commands of the driver's list.
 *
 * In the bytes 0xfe is silence: a wait ends there in vain, and a drain takes all up to it.  When
 * the bytes are used up, or after many silences, the instrument is gone.  No wait takes time. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/link/line.h"
#include "drivers/xrite_rci/xrite_rci.h"
#include "drivers/xrite_rci/xrite_rci_wire.h"

enum { SILENCE = 0xfe, MOST_SILENCES = 400, MOST_SENDS = 2000 };

static const unsigned char *at, *end;
static unsigned silences, sends;
static int64_t now_ms;

static void must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_xrite_rci: %s\n", what);
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

static bool is_ours(const char *bytes, size_t n)
{
    static const char *const commands[] = { "",       "CE",     "0005CF", "0107CF", "0108CF",
                                            "0009CF", "0040CF", "0020CF", "014BCF", "024BCF",
                                            "00SN",   "10XD",   "01XD",   "RM",     "0001GM",
                                            "0101GM", "00GM",   "1001GM", "1101GM" };
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (n == strlen(commands[i]) + 2 && memcmp(bytes, commands[i], n - 2) == 0)
            return memcmp(bytes + n - 2, "\r\n", 2) == 0;
    return false;
}

static enum driver_result fuzz_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                                    int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel, (void)deadline_ms;
    must(is_ours(bytes, n), "a command that is not in the list");
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

static void read_line_as(const char *line)
{
    struct rci_reply reply;
    int32_t raw[RCI_BANDS];
    char text[DRIVER_NAME_SIZE];
    unsigned n = 0;
    if (!rci_read_reply(line, &reply))
        return;
    must(reply.n + 4 == strlen(line) && reply.status <= 0xFF, "a reply");
    for (int kind = RCI_STATUS; kind <= RCI_SPECTRUM; kind++)
        (void)rci_is_kind(&reply, (enum rci_kind)kind);
    if (rci_read_count(&reply, &n))
        must(n <= RCI_MAX_COUNT, "a count");
    reading_plain_text(reply.data, reply.n, text, sizeof text);
    if (rci_read_spectrum(&reply, raw) != DOUBT_NONE ||
        doubt_spectrum(RCI_BANDS, raw, RCI_RAW_UNIT) != DOUBT_NONE)
        return;
    for (size_t i = 0; i < RCI_BANDS; i++)
        must(raw[i] >= 0 && raw[i] <= 2000000, "a band out of range");
}

static void read_lines(const unsigned char *data, size_t size)
{
    char line[LINE_MAX_BYTES];
    for (const unsigned char *from = data, *stop = data + size; from < stop;) {
        const unsigned char *feed = memchr(from, '\n', (size_t)(stop - from));
        size_t n = (size_t)((feed != NULL ? feed : stop) - from);
        size_t kept = n < sizeof line - 1 ? n : sizeof line - 1;
        memcpy(line, from, kept);
        line[kept] = '\0';
        line[strcspn(line, "\r")] = '\0';
        read_line_as(line);
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
    const struct driver *rci = &xrite_rci_driver;
    struct driver_options options = {
        .address = "", .reply_timeout_ms = 1000, .open_timeout_ms = 20000, .wire = &source
    };
    struct driver_identity identity;
    struct driver_status status;
    struct instrument *in;
    bool pressed;
    size_t stored;
    if (!went(rci->open(&options, &in, &identity, &error)))
        return;
    must(memchr(identity.serial, 0, sizeof identity.serial) != NULL, "serial");
    went(rci->status(in, &status, &error));
    went(rci->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    went(rci->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    for (int i = 0; i < 3; i++)
        if (went(rci->measure(in, &reading, &error)))
            check_reading(&reading);
    if (went(rci->wait_button(in, 0, &pressed, &error)) && went(rci->measure(in, &reading, &error)))
        check_reading(&reading);
    struct driver_setup setup = { .averages = identity.max_averages > 1 ? 2 : 1 };
    went(rci->configure(in, &setup, &error));
    if (went(rci->stored_count(in, &stored, &error)) && stored > 0 &&
        went(rci->stored_read(in, 0, &reading, &error)))
        check_reading(&reading);
    rci->close(in);
}

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size)
{
    read_lines(data, size);
    at = data;
    end = data + size;
    silences = sends = 0;
    now_ms = 1000;
    hold_session();
    return 0;
}
