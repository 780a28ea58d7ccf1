/* fuzz_ocean_ooi.c - the Ocean driver, and whatever comes from the other end of its wire.
 *
 * The first byte says what the rest is:
 *
 *   t   a tile file         a   an address         w   one reply for every reader
 *   s   a session: the calls, then what each receive gets
 *
 * A session is up to 8 calls (bytes up to a NUL: status, zero, white, measure, averages), then
 * for each receive a byte: below 0xa0 what a sound instrument gives, below 0xe0 the same
 * with a byte changed (two for the place, one for the mask), below 0xf0 so many bytes of the input
 * as they are, and then timeout, a stall, gone.  When the input ends, nothing comes any
 * more.  No wait takes time.  Whatever comes: what is OK is a plausible spectrum, what is not
 * says why, and 06 is never sent. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/link/link.h"
#include "drivers/ocean_ooi/address.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "drivers/ocean_ooi/ocean_ooi_wire.h"
#include "drivers/ocean_ooi/tile_file.h"

enum { PIXELS = 2048, FRAME = 2 * PIXELS + 1 };

static const uint8_t *input;
static size_t left;

static void must(bool condition, const char *what)
{
    if (condition)
        return;
    fprintf(stderr, "fuzz_ocean_ooi: %s\n", what);
    abort();
}

static unsigned next(void)
{
    if (left == 0)
        return 0;
    left--;
    return *input++;
}

/* ---- a sound instrument ------------------------------------------------------------- */

static uint8_t last_request[8];
static uint32_t integration_us;
static double under; /* reflectance of what lies at the port */

static size_t answer_slot(uint8_t slot, uint8_t *reply)
{
    static const char *const texts[] = {
        "FUZZ0001", "340.0", "0.36", "-1e-05", "-1e-09", "0", "1"
    };
    memset(reply, 0, 17);
    reply[0] = 5;
    reply[1] = slot;
    if (slot < sizeof texts / sizeof *texts)
        strcpy((char *)reply + 2, texts[slot]);
    return 17;
}

static size_t sound_reply(uint8_t *reply)
{
    switch (last_request[0]) {
    case 0x05:
        return answer_slot(last_request[1], reply);
    case 0x6b:
        memcpy(reply, (const uint8_t[]){ 4, 1, 0x20 }, 3);
        return 3;
    case 0x6c:
        memcpy(reply, (const uint8_t[]){ 8, 0, 0x19 }, 3);
        return 3;
    default:
        memset(reply, 0, 16);
        reply[1] = 8; /* 2048 */
        for (int i = 0; i < 4; i++)
            reply[2 + i] = (uint8_t)(integration_us >> (8 * i));
        reply[6] = 1;
        reply[14] = 0x80;
        return 16;
    }
}

/* The last is kept: most of the fuzzer's time would go there. */
static size_t sound_frame(uint8_t *to)
{
    static uint8_t frame[FRAME];
    static uint32_t of_us;
    static double of;
    if (of_us == integration_us && of == under) {
        memcpy(to, frame, FRAME);
        return FRAME;
    }
    of_us = integration_us;
    of = under;
    for (size_t p = 0; p < PIXELS; p++) {
        double light = p < 20 ? 0.0 : (under + 0.005) * integration_us * (0.4 + (double)p / 2500.0);
        double counts = fmin(1500.0 + light, 65535.0);
        frame[2 * p] = (uint8_t)(unsigned)counts;
        frame[2 * p + 1] = (uint8_t)((unsigned)counts >> 8);
    }
    frame[FRAME - 1] = 0x69;
    memcpy(to, frame, FRAME);
    return FRAME;
}

/* ---- the link ----------------------------------------------------------------------- */

static enum driver_result fuzz_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                                    int64_t deadline_ms, struct driver_error *error)
{
    (void)link;
    (void)deadline_ms;
    (void)error;
    must(channel == 0x01 && n >= 1 && n <= sizeof last_request, "a request of no kind");
    memcpy(last_request, bytes, n);
    must(last_request[0] != 0x06, "06 was sent");
    if (last_request[0] == 0x02)
        integration_us = (uint32_t)last_request[1] | (uint32_t)last_request[2] << 8 |
                         (uint32_t)last_request[3] << 16 | (uint32_t)last_request[4] << 24;
    return DRIVER_OK;
}

static enum driver_result fuzz_receive(struct link *link, uint8_t channel, void *to, size_t size,
                                       size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    static uint8_t bytes[FRAME];
    unsigned what = next();
    (void)link;
    (void)deadline_ms;
    if (left == 0 || (what >= 0xf0 && what < 0xf8))
        return driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing comes, the input has ended");
    if (what >= 0xfc)
        return driver_fail(error, DRIVER_GONE, NULL, "the instrument is gone by the input");
    if (what >= 0xf8)
        return driver_fail(error, DRIVER_PROTOCOL, NULL, "the endpoint stalls by the input");
    size_t came = channel == 0x81 ? sound_reply(bytes) : sound_frame(bytes);
    if (what >= 0xa0 && what < 0xe0) {
        size_t at = next() << 8;
        at = (at | next()) % came;
        bytes[at] ^= (uint8_t)next();
    } else if (what >= 0xe0) {
        came = next() << 4 | (what & 0xf);
        came = came < left ? came : left;
        memcpy(bytes, input, came);
        input += came;
        left -= came;
    }
    *n = came < size ? came : size;
    memcpy(to, bytes, *n);
    return DRIVER_OK;
}

static enum driver_result fuzz_drain(struct link *link, uint8_t channel, int quiet_ms,
                                     int64_t deadline_ms, struct driver_error *error)
{
    (void)link;
    (void)channel;
    (void)quiet_ms;
    (void)deadline_ms;
    (void)error;
    return DRIVER_OK;
}

static void fuzz_close(struct link *link)
{
    (void)link;
}

static const struct link_ops ops = { .kind = "fuzz",
                                     .send = fuzz_send,
                                     .receive = fuzz_receive,
                                     .drain = fuzz_drain,
                                     .close = fuzz_close };
static struct link the_link = { &ops, NULL };

static enum driver_result fuzz_open(const struct link_source *source,
                                    const struct link_wanted *wanted, struct link **ret,
                                    struct driver_error *error)
{
    (void)source;
    (void)error;
    the_link.call = wanted->call;
    *ret = &the_link;
    return DRIVER_OK;
}

static const struct link_source wire = { fuzz_open };

/* ---- a session ---------------------------------------------------------------------- */

static char tile_path[] = "/tmp/fuzz-ocean-tile-XXXXXX", address[128];

static void remove_tile(void)
{
    (void)unlink(tile_path);
}

static void make_tile(void)
{
    int fd = mkstemp(tile_path);
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    must(f != NULL, "no tile file");
    fprintf(f, "id,specular,380,400,420,440,460,480,500,520,540,560,580,600,620,640,660,680,700,720"
               "\nW,sce");
    for (int i = 0; i < 18; i++)
        fprintf(f, ",0.97");
    fclose(f);
    snprintf(address, sizeof address, "usb,tile=%s,port_mm=8", tile_path);
    atexit(remove_tile);
}

static void check_error(enum driver_result r, const struct driver_error *error)
{
    must(error->result == r, "an error without its result");
    must(memchr(error->text, '\0', sizeof error->text) != NULL && error->text[0] != '\0',
         "an error without a text");
}

static enum driver_result call(struct instrument *in, char which, struct driver_error *error)
{
    const struct driver *d = &ocean_ooi_driver;
    static struct driver_reading reading;
    struct driver_status status;
    struct driver_setup setup = { .averages = 3 };
    enum driver_result r;
    switch (which % 5) {
    case 0:
        return d->status(in, &status, error);
    case 1:
        under = 0.0;
        return d->calibrate(in, DRIVER_CALIBRATION_ZERO, error);
    case 2:
        under = 0.97;
        return d->calibrate(in, DRIVER_CALIBRATION_WHITE, error);
    case 3:
        under = 0.35;
        r = d->measure(in, &reading, error);
        for (size_t b = 0; r == DRIVER_OK && b < 31; b++)
            must(reading.sce.value[b] >= 0.0 && reading.sce.value[b] <= 2.0, "no reflectance");
        return r;
    default:
        return d->configure(in, &setup, error);
    }
}

static void run_session(void)
{
    char calls[8];
    size_t n = 0;
    struct instrument *in = NULL;
    struct driver_identity identity;
    struct driver_error error;
    struct driver_options options = { .address = address, .wire = &wire };
    for (unsigned which; n < sizeof calls && (which = next()) != 0;)
        calls[n++] = (char)(which & 0x7f);
    integration_us = 100000;
    memset(&error, 0, sizeof error);
    enum driver_result r = ocean_ooi_driver.open(&options, &in, &identity, &error);
    if (r != DRIVER_OK) {
        check_error(r, &error);
        return;
    }
    must(memchr(identity.serial, '\0', sizeof identity.serial) != NULL, "a serial without end");
    for (size_t i = 0; i < n; i++) {
        memset(&error, 0, sizeof error);
        r = call(in, calls[i], &error);
        if (r != DRIVER_OK)
            check_error(r, &error);
    }
    ocean_ooi_driver.close(in);
}

/* ---- parsers ------------------------------------------------------------------------ */

static void parse_reply(void)
{
    static uint16_t counts[OOI_MAX_PIXELS];
    char text[OOI_SLOT_TEXT];
    double number;
    uint16_t word;
    struct ooi_status status;
    if (ooi_read_slot(input, left, left > 1 ? input[1] : 0, text))
        (void)ooi_read_number(text, &number);
    (void)ooi_read_level(input, left, &word);
    (void)ooi_read_register(input, left, 4, &word);
    (void)ooi_read_temperature(input, left, &number);
    (void)ooi_read_status(input, left, &status);
    for (const struct ooi_model *m = ooi_models; m->name != NULL; m++)
        (void)ooi_read_frame(m, input, left, counts);
}

static void parse_text(bool tile)
{
    static struct ooi_tile_file file;
    static double measured[OOI_TILE_ROWS][OOI_BANDS], certified[OOI_TILE_ROWS][OOI_BANDS];
    struct ooi_address parsed;
    struct driver_error error;
    size_t n;
    char *text = malloc(left + 1);
    must(text != NULL, "no memory");
    memcpy(text, input, left);
    text[left] = '\0';
    if (!tile) {
        (void)ooi_address_parse(text, &parsed, &error);
    } else if (ooi_tile_parse(text, left, "fuzz", &file, &error) == DRIVER_OK) {
        (void)ooi_tile_is_white(&file, "fuzz", &error);
        (void)ooi_tile_greys(&file, "fuzz", &n, measured, certified, &error);
        double at = ooi_tile_at(&file, 0, 390.0);
        must(at >= 0.0 && at <= 1.2, "no reflectance of a tile");
    }
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bool made;
    if (!made)
        make_tile();
    made = true;
    input = data;
    left = size;
    switch (next()) {
    case 't':
        parse_text(true);
        break;
    case 'a':
        parse_text(false);
        break;
    case 'w':
        parse_reply();
        break;
    default:
        run_session();
    }
    return 0;
}
