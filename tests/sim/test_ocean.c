/* test_ocean.c - the simulated spectrometer against what the descriptions say, by a clock of
 * the test's own.  Rows are transcribed from the data sheets of USB2000+ and USB4000 and
 * from what others found out; formulas are written again here. */
#include "tests/sim/ocean.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

enum { MOST = 3840 };

static const struct sim_kind *kind;
static struct sim *sim;
static int64_t now_us;

static void start(const struct sim_kind *of, const char *options)
{
    if (sim != NULL)
        kind->free(sim);
    kind = of;
    sim = kind->make(options);
    TEST_ASSERT_NOT_NULL_MESSAGE(sim, options);
}

void setUp(void)
{
    sim = NULL;
    now_us = 1000000;
}

void tearDown(void)
{
    if (sim != NULL)
        kind->free(sim);
}

static void above(double bound, double actual)
{
    char text[80];
    snprintf(text, sizeof text, "%g is not above %g", actual, bound);
    TEST_ASSERT_TRUE_MESSAGE(actual > bound, text);
}

static void below(double bound, double actual)
{
    char text[80];
    snprintf(text, sizeof text, "%g is not below %g", actual, bound);
    TEST_ASSERT_TRUE_MESSAGE(actual < bound, text);
}

/* ---- a host -------------------------------------------------------------------------- */

static void act(const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(kind->act(sim, action, now_us), action);
}

#define SEND(...) send((const uint8_t[]){ __VA_ARGS__ }, sizeof(const uint8_t[]){ __VA_ARGS__ })
static void send(const uint8_t *bytes, size_t n)
{
    TEST_ASSERT_EQUAL_INT(0, kind->take(sim, 0x01, bytes, n, now_us));
}

/* One transfer: the clock goes on until it ends or nothing is to come. */
static ssize_t receive(uint8_t endpoint, uint8_t *bytes, size_t size)
{
    size_t packet = endpoint == 0x81 ? 64 : 512, n = 0;
    while (n < size) {
        int64_t due_us;
        ssize_t more = kind->give(sim, endpoint, bytes + n, size - n, now_us, &due_us);
        if (more < 0)
            return more;
        n += (size_t)more;
        if ((size_t)more % packet != 0)
            break;
        if (more == 0 && due_us == INT64_MAX)
            break;
        if (more == 0) {
            TEST_ASSERT_GREATER_THAN_INT64(now_us, due_us);
            now_us = due_us;
        }
    }
    return (ssize_t)n;
}

static void set_integration(uint32_t us)
{
    SEND(0x02, (uint8_t)us, (uint8_t)(us >> 8), (uint8_t)(us >> 16), (uint8_t)(us >> 24));
}

static void status(uint8_t bytes[16])
{
    uint8_t answer[64];
    SEND(0xfe);
    TEST_ASSERT_EQUAL_INT(16, receive(0x81, answer, sizeof answer));
    memcpy(bytes, answer, 16);
}

static uint32_t integration(void)
{
    uint8_t b[16];
    status(b);
    return b[2] | (uint32_t)b[3] << 8 | (uint32_t)b[4] << 16 | (uint32_t)b[5] << 24;
}

static void slot(uint8_t i, char text[16])
{
    uint8_t b[64];
    SEND(0x05, i);
    TEST_ASSERT_EQUAL_INT(17, receive(0x81, b, sizeof b));
    TEST_ASSERT_EQUAL_HEX8(0x05, b[0]);
    TEST_ASSERT_EQUAL_HEX8(i, b[1]);
    memcpy(text, b + 2, 15);
    text[15] = '\0';
}

/* Ask for one and fetch it, from one endpoint. */
static void spectrum(unsigned *counts, size_t pixels)
{
    static uint8_t b[8192];
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(2 * (int)pixels + 1, receive(0x82, b, 2 * pixels + 512));
    TEST_ASSERT_EQUAL_HEX8(0x69, b[2 * pixels]);
    for (size_t i = 0; i < pixels; i++)
        counts[i] = b[2 * i] | (unsigned)b[2 * i + 1] << 8;
}

/* ---- identity, commands -------------------------------------------------------------- */

static void test_models(void)
{
    static const struct {
        const struct sim_kind *kind;
        const char *options;
        uint16_t pid;
        uint8_t status[16]; /* 20 ms, lamp on: FE of the data sheets */
    } rows[] = {
        { &sim_usb2000,
          "",
          0x101e,
          { 0x00, 0x08, 0x20, 0x4e, 0, 0, 1, 0, 0, 8, 1, 0, 0, 0, 0x80 } },
        { &sim_usb2000,
          "speed=full",
          0x101e,
          { 0x00, 0x08, 0x20, 0x4e, 0, 0, 1, 0, 0, 64, 1, 0, 0, 0, 0 } },
        { &sim_usb4000,
          "",
          0x1022,
          { 0x00, 0x0f, 0x20, 0x4e, 0, 0, 1, 0, 0, 15, 1, 0, 0, 0, 0x80 } },
        { &sim_usb4000,
          "speed=full",
          0x1022,
          { 0x00, 0x0f, 0x20, 0x4e, 0, 0, 1, 0, 0, 120, 1, 0, 0, 0, 0 } },
        { &sim_hr2000, "", 0x1016, { 0x00, 0x08, 0x20, 0x4e, 0, 0, 1, 0, 0, 8, 1, 0, 0, 0, 0x80 } },
        { &sim_hr4000,
          "",
          0x1012,
          { 0x00, 0x0f, 0x20, 0x4e, 0, 0, 1, 0, 0, 15, 1, 0, 0, 0, 0x80 } },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        start(rows[i].kind, rows[i].options);
        TEST_ASSERT_EQUAL_HEX16(0x2457, kind->vid);
        TEST_ASSERT_EQUAL_HEX16(rows[i].pid, kind->pid);
        SEND(0x01);
        set_integration(20000);
        SEND(0x03, 1, 0);
        uint8_t b[16];
        status(b);
        TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(rows[i].status, b, 16, kind->name);
    }
}

static void test_integration_time(void)
{
    static const struct {
        const struct sim_kind *kind;
        uint32_t wanted, really;
    } rows[] = {
        { &sim_usb2000, 1000, 1000 },
        { &sim_usb2000, 1019, 1010 },
        { &sim_usb2000, 654987, 654980 },
        { &sim_usb2000, 700999, 700000 },
        { &sim_usb2000, 65535000, 65535000 },
        { &sim_usb2000, 999, 50000 },
        { &sim_usb2000, 65535001, 50000 },
        { &sim_usb2000, 0, 50000 },
        { &sim_usb4000, 10, 10 },
        { &sim_usb4000, 9, 50000 },
        { &sim_usb4000, 3799, 3799 },
        { &sim_usb4000, 3807, 3800 },
        { &sim_usb4000, 65535000, 65535000 },
        { &sim_usb4000, UINT32_MAX, 50000 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        start(rows[i].kind, "");
        set_integration(50000);
        set_integration(rows[i].wanted);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(rows[i].really, integration(), kind->name);
    }
}

static void test_slots(void)
{
    char text[16];
    start(&sim_usb2000, "serial=USB2+H01234");
    slot(0, text);
    TEST_ASSERT_EQUAL_STRING("USB2+H01234", text);
    TEST_ASSERT_NOT_EQUAL(0, text[12]); /* behind the NUL: no further NUL, but leavings */
    slot(1, text);
    TEST_ASSERT_EQUAL_DOUBLE(346.71, strtod(text, NULL));
    slot(14, text);
    TEST_ASSERT_EQUAL_STRING("7", text);
    slot(15, text);
    TEST_ASSERT_EQUAL_STRING("03 025 050 UVVI", text); /* all 15, and no NUL */
    slot(18, text);
    TEST_ASSERT_EQUAL_STRING("9600", text);
    slot(99, text); /* there is none: an answer, of leavings */

    act("fault slot 0 ");
    slot(0, text);
    TEST_ASSERT_EQUAL_STRING("", text);
    act("fault slot 0 hex:01ff0080");
    slot(0, text);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x01\xff\x00\x80\x00", text, 5);
    act("fault slots");
    for (uint8_t i = 0; i < 15; i++) {
        char *end;
        slot(i, text);
        strtod(text, &end);
        TEST_ASSERT_EQUAL_PTR(text, end);
    }
}

static void test_saturation_level(void)
{
    static const struct {
        const char *options;
        unsigned level;
    } rows[] = { { "", 60000 }, { "level=0", 0 }, { "level=52000", 52000 } };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint8_t b[64];
        start(&sim_usb2000, rows[i].options);
        SEND(0x05, 0x11);
        TEST_ASSERT_EQUAL_INT(17, receive(0x81, b, sizeof b));
        TEST_ASSERT_EQUAL_UINT(rows[i].level, b[6] | b[7] << 8);
    }
}

static void test_flame_and_temperature(void)
{
    uint8_t b[64];
    start(&sim_usb2000, "");
    SEND(0x6b, 0x04);
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, sizeof b));
    TEST_ASSERT_EQUAL_HEX8(0x04, b[0]);
    TEST_ASSERT_LESS_THAN(3, b[2] >> 4);
    SEND(0x6a, 0x28, 0x34, 0x12);
    SEND(0x6b, 0x28);
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, sizeof b));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x28\x34\x12", b, 3);

    start(&sim_usb2000, "flame=1,temperature=-5");
    SEND(0x6b, 0x04);
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, sizeof b));
    TEST_ASSERT_EQUAL_HEX8(0xfe, b[0]);
    TEST_ASSERT_GREATER_OR_EQUAL(3, b[2] >> 4);
    SEND(0x6c);
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, sizeof b));
    TEST_ASSERT_EQUAL_HEX8(0x08, b[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, -5, (int16_t)(b[1] | b[2] << 8) * 0.003906);
}

static void test_writing_is_counted(void)
{
    char text[16];
    start(&sim_usb2000, "");
    act("unwritten");
    SEND(0x06, 0, 'x', 'y', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    TEST_ASSERT_EQUAL_UINT(1, ocean_writes(sim));
    TEST_ASSERT_FALSE(kind->act(sim, "unwritten", now_us));
    slot(0, text);
    TEST_ASSERT_EQUAL_STRING("xy", text);
}

static void test_nonsense_changes_nothing(void)
{
    uint8_t before[16], after[16], b[64];
    start(&sim_usb2000, "");
    status(before);
    SEND(0x02, 1, 2, 3); /* cut short */
    SEND(0x77, 1, 2, 3);
    SEND('A', 'T', '\r');
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, sizeof b));
    status(after);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(before, after, 16);
    TEST_ASSERT_EQUAL_INT(-ENOENT, kind->take(sim, 0x02, b, 1, now_us));
    TEST_ASSERT_EQUAL_INT(-ENOENT, receive(0x87, b, sizeof b));
}

/* ---- spectra: the bytes -------------------------------------------------------------- */

static void test_packets_of_usb2000(void)
{
    uint8_t b[512];
    start(&sim_usb2000, "");
    set_integration(10000);
    int64_t asked_us = now_us;
    SEND(0x09);
    for (int i = 0; i < 8; i++)
        TEST_ASSERT_EQUAL_INT(512, receive(0x82, b, 512));
    TEST_ASSERT_EQUAL_INT(1, receive(0x82, b, 512)); /* the sync byte in a packet of its own */
    TEST_ASSERT_EQUAL_HEX8(0x69, b[0]);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(asked_us + 10000, now_us);
    TEST_ASSERT_LESS_THAN_INT64(asked_us + 12000, now_us);
    TEST_ASSERT_EQUAL_INT(0, receive(0x82, b, 512)); /* what is taken ahead, nobody asked for */
    TEST_ASSERT_EQUAL_INT(0, receive(0x86, b, 512));
}

static void test_usb4000_divides_at_high_speed(void)
{
    static uint8_t b[8192];
    start(&sim_usb4000, "");
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(2048, receive(0x86, b, 2048));
    TEST_ASSERT_EQUAL_INT(5633, receive(0x82, b + 2048, 6144));
    TEST_ASSERT_EQUAL_HEX8(0x69, b[7680]);
    start(&sim_usb4000, "speed=full");
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(7681, receive(0x82, b, 8192));
    TEST_ASSERT_EQUAL_HEX8(0x69, b[7680]);
}

static void test_a_packet_that_does_not_fit(void)
{
    uint8_t b[512];
    start(&sim_usb2000, "");
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(-EOVERFLOW, receive(0x82, b, 100));
    TEST_ASSERT_EQUAL_INT(512, receive(0x82, b, 512)); /* the next one */
}

static void test_14_bits(void)
{
    static unsigned counts[MOST];
    start(&sim_hr2000, "noise=0");
    SEND(0x03, 1, 0);
    set_integration(1000000); /* far beyond the scale */
    spectrum(counts, 2048);
    TEST_ASSERT_EQUAL_HEX(16383, counts[1000] ^ 0x2000);
    TEST_ASSERT_DOUBLE_WITHIN(10, 380, counts[5] ^ 0x2000); /* black: 1500 of 65536 */
}

/* ---- spectra: when they are exposed -------------------------------------------------- */

static double mean_light(const unsigned *counts, size_t pixels)
{
    double sum = 0;
    for (size_t i = 100; i < pixels - 400; i++)
        sum += counts[i];
    return sum / (double)(pixels - 500);
}

/* USB2000+: two spectra taken ahead have the light of before; the third is the first new one. */
static void test_stale_light_of_usb2000(void)
{
    static unsigned counts[MOST];
    static const char *const delays[] = { "noise=0", "noise=0,delays=0" };
    for (size_t with = 0; with < 2; with++)
        for (int wait_us = 0; wait_us < 100000; wait_us += 33000) {
            start(&sim_usb2000, delays[with]);
            SEND(0x03, 1, 0);
            set_integration(20000);
            spectrum(counts, 2048);
            double white = mean_light(counts, 2048);
            now_us += wait_us; /* so that they are on their way, or ready */
            act("place black");
            spectrum(counts, 2048);
            double first = mean_light(counts, 2048);
            spectrum(counts, 2048);
            spectrum(counts, 2048);
            below(2000, mean_light(counts, 2048));
            if (wait_us > 20000 || with == 1)
                TEST_ASSERT_DOUBLE_WITHIN(1, white, first);
            TEST_ASSERT_EQUAL_UINT(ocean_exposures(sim) - 1, ocean_unasked_exposures(sim));
        }
}

/* ... and so with the integration time. */
static void test_stale_integration_time(void)
{
    static unsigned counts[MOST];
    double mean[4];
    start(&sim_usb2000, "noise=0");
    SEND(0x03, 1, 0);
    set_integration(20000);
    spectrum(counts, 2048);
    now_us += 100000;
    set_integration(5000);
    for (size_t i = 0; i < 3; i++) {
        spectrum(counts, 2048);
        mean[i] = mean_light(counts, 2048);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1, mean[0], mean[1]);
    below(0.5 * mean[0], mean[2]);
}

/* After initialising nothing is taken ahead; but what was not fetched is still there. */
static void test_initialising(void)
{
    static unsigned counts[MOST];
    uint8_t b[16];
    start(&sim_usb2000, "noise=0");
    SEND(0x03, 1, 0);
    spectrum(counts, 2048);
    now_us += 1000000;
    SEND(0x03, 0, 0);
    SEND(0x01);
    spectrum(counts, 2048);
    below(2000, mean_light(counts, 2048));

    SEND(0x01);
    SEND(0x09);
    now_us += 1000000;
    status(b); /* dark, ready, not fetched */
    TEST_ASSERT_EQUAL_UINT(8, b[11]);
    SEND(0x01);
    SEND(0x03, 1, 0);
    spectrum(counts, 2048);
    below(2000, mean_light(counts, 2048));
}

/* USB4000: the cycle that runs when it is asked may have begun before; the next is new. */
static void test_idle_cycles_of_usb4000(void)
{
    static unsigned counts[MOST];
    start(&sim_usb4000, "noise=0,speed=full");
    SEND(0x03, 1, 0);
    set_integration(20000);
    spectrum(counts, 3840);
    spectrum(counts, 3840);
    double white = mean_light(counts, 3840);
    now_us += 7 * 20000 + 15000; /* three quarters of a cycle, about */
    act("place black");
    spectrum(counts, 3840);
    double mixed = mean_light(counts, 3840);
    spectrum(counts, 3840);
    below(2000, mean_light(counts, 3840));
    above(0.6 * white, mixed);
    below(0.9 * white, mixed);
}

static void test_a_trigger_that_never_comes(void)
{
    uint8_t b[512];
    start(&sim_usb2000, "");
    SEND(0x0a, 3, 0);
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(0, receive(0x82, b, 512));
    SEND(0x01); /* free-running again */
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(512, receive(0x82, b, 512));
}

static void test_shut_down(void)
{
    uint8_t b[512];
    start(&sim_usb2000, "");
    SEND(0x04, 0, 0);
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(0, receive(0x82, b, 512));
    SEND(0x04, 1, 0);
    TEST_ASSERT_EQUAL_INT(512, receive(0x82, b, 512));
}

/* ---- spectra: what is in them -------------------------------------------------------- */

/* As a host computes it: scale to the level, subtract the black pixels, divide by the polynomial.
 */
static void corrected(const unsigned *counts, size_t pixels, double level, double full, double *ret)
{
    double n[8], black = 0;
    for (uint8_t k = 0; k < 8; k++) {
        char text[16];
        slot((uint8_t)(6 + k), text);
        n[k] = strtod(text, NULL);
    }
    for (size_t i = 6; i <= 15; i++)
        black += counts[i] * full / level / 10;
    for (size_t i = 0; i < pixels; i++) {
        double x = counts[i] * full / level - black;
        ret[i] =
            x / (n[0] +
                 x * (n[1] +
                      x * (n[2] + x * (n[3] + x * (n[4] + x * (n[5] + x * (n[6] + x * n[7])))))));
    }
}

static double nm_of(size_t i)
{
    double nm = 0, power = 1;
    for (uint8_t k = 1; k <= 4; k++, power *= (double)i) {
        char text[16];
        slot(k, text);
        nm += strtod(text, NULL) * power;
    }
    return nm;
}

static void fresh(const char *place, unsigned *counts, size_t pixels)
{
    char action[32];
    snprintf(action, sizeof action, "place %s", place);
    act(action);
    for (int i = 0; i < 3; i++)
        spectrum(counts, pixels);
}

/* The way of the measurement back: (S - D) / (W - D) x the tile is what lies there. */
static void reflectance_comes_back(const struct sim_kind *of, const char *options, size_t pixels,
                                   double level, double full)
{
    static unsigned counts[MOST];
    static double black[MOST], white[MOST], sample[MOST];
    static const char *const samples[] = { "skin", "grey 18", "grey 50", "skin" };
    start(of, options);
    SEND(0x03, 1, 0);
    set_integration(20000);
    fresh("black", counts, pixels);
    corrected(counts, pixels, level, full, black);
    fresh("white", counts, pixels);
    corrected(counts, pixels, level, full, white);
    for (size_t k = 0; k < sizeof samples / sizeof *samples; k++) {
        if (k == 3)
            act("lightness 35");
        fresh(samples[k], counts, pixels);
        corrected(counts, pixels, level, full, sample);
        size_t compared = 0;
        for (size_t i = 0; i < pixels; i += 16) {
            double nm = nm_of(i);
            if (nm < 400 || nm > 700)
                continue;
            compared++;
            above(2000 * full / 65535, white[i] - black[i]);
            act("place white");
            double tile = kind->truth(sim, nm, false);
            act((const char *[]){ "place skin", "place grey 18", "place grey 50",
                                  "place skin" }[k]);
            double R = (sample[i] - black[i]) / (white[i] - black[i]) * tile;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(8e-4 * sqrt(65535 / full),
                                              kind->truth(sim, nm, false), R, samples[k]);
        }
        TEST_ASSERT_GREATER_THAN(50, compared);
    }
}

static void test_reflectance_comes_back(void)
{
    reflectance_comes_back(&sim_usb2000, "noise=0", 2048, 60000, 65535);
    reflectance_comes_back(&sim_usb2000, "noise=0,level=0", 2048, 65535, 65535);
    reflectance_comes_back(&sim_usb4000, "noise=0,speed=full", 3840, 60000, 65535);
}

/* Without the correction it is wrong by more than a percent: the instrument does bend. */
static void test_it_bends(void)
{
    static unsigned counts[MOST];
    static double straight[MOST];
    start(&sim_usb2000, "noise=0,under=grey 50,level=0");
    SEND(0x03, 1, 0);
    set_integration(20000);
    spectrum(counts, 2048);
    corrected(counts, 2048, 65535, 65535, straight);
    for (size_t i = 300; i < 900; i += 100) {
        double light = ocean_light(sim, i, 20000);
        TEST_ASSERT_DOUBLE_WITHIN(30, light, straight[i]);
        above(0.01 * light, fabs(counts[i] - 1500 - light));
    }
}

static void test_saturation(void)
{
    static unsigned counts[MOST];
    start(&sim_usb2000, "");
    SEND(0x03, 1, 0);
    set_integration(200000);
    spectrum(counts, 2048);
    for (size_t i = 400; i < 900; i++)
        TEST_ASSERT_EQUAL_UINT(60000, counts[i]);
}

static void test_dark(void)
{
    static unsigned counts[MOST];
    start(&sim_usb2000, "level=0");
    spectrum(counts, 2048); /* the lamp is off */
    double mean = 0, square = 0;
    for (size_t i = 0; i < 2048; i++) {
        mean += counts[i] / 2048.0;
        square += (double)counts[i] * counts[i] / 2048.0;
    }
    TEST_ASSERT_DOUBLE_WITHIN(5, 1502, mean);
    /* Read noise 18 and an even pattern of +-12 counts: sqrt(18^2 + 12^2 / 3). */
    TEST_ASSERT_DOUBLE_WITHIN(2, 19.3, sqrt(square - mean * mean));
    SEND(0x03, 1, 0);
    for (int i = 0; i < 3; i++)
        spectrum(counts, 2048);
    for (size_t i = 0; i < 18; i++) /* no light reaches these */
        TEST_ASSERT_DOUBLE_WITHIN(100, 1502, counts[i]);
    TEST_ASSERT_GREATER_THAN(4000, counts[600]);
}

static void test_noise_is_that_of_the_seed(void)
{
    static unsigned first[MOST], again[MOST], other[MOST];
    start(&sim_usb2000, "seed=7");
    spectrum(first, 2048);
    start(&sim_usb2000, "seed=7");
    spectrum(again, 2048);
    start(&sim_usb2000, "seed=8");
    spectrum(other, 2048);
    TEST_ASSERT_EQUAL_MEMORY(first, again, 2048 * sizeof *first);
    TEST_ASSERT_TRUE(memcmp(first, other, 2048 * sizeof *first) != 0);
}

/* 250:1 at full scale, as the data sheet has it, and the root of that with less light. */
static void test_shot_noise(void)
{
    static unsigned counts[MOST];
    double sum = 0, square = 0;
    start(&sim_usb2000, "level=0,lamp=1.9");
    SEND(0x03, 1, 0);
    set_integration(20000);
    enum { SHOTS = 60, PIXEL = 880 };
    for (int i = 0; i < SHOTS; i++) {
        spectrum(counts, 2048);
        TEST_ASSERT_LESS_THAN(65535, counts[PIXEL]);
        sum += counts[PIXEL];
        square += (double)counts[PIXEL] * counts[PIXEL];
    }
    double mean = sum / SHOTS, sd = sqrt(square / SHOTS - mean * mean);
    above(50000, mean);
    TEST_ASSERT_DOUBLE_WITHIN(60, 250 * sqrt(mean / 65535), mean / sd);
}

static void test_lamp(void)
{
    static unsigned counts[MOST];
    static const struct {
        const char *options, *action;
        uint8_t line;
        bool light;
    } rows[] = {
        { "", "place white", 0, false },      { "", "place white", 1, true },
        { "line=0", "place white", 0, true }, { "line=0", "fault lamp", 0, false },
        { "", "fault lamp", 1, false },       { "", "lamp 0", 1, false },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        start(&sim_usb2000, rows[i].options);
        SEND(0x03, rows[i].line, 0);
        act(rows[i].action);
        spectrum(counts, 2048);
        TEST_ASSERT_EQUAL_INT(rows[i].light, counts[600] > 10000);
    }
}

/* The lamp drifts by so many percent in a minute; all else cancels in the ratio. */
static void test_drift(void)
{
    static unsigned counts[MOST];
    static double early[MOST], late[MOST];
    start(&sim_usb2000, "noise=0,drift=2");
    SEND(0x03, 1, 0);
    set_integration(10000);
    fresh("white", counts, 2048);
    corrected(counts, 2048, 60000, 65535, early);
    now_us += 60000000;
    fresh("white", counts, 2048);
    corrected(counts, 2048, 60000, 65535, late);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 1.02, late[700] / early[700]);
}

/* The light in a sphere goes as 1 / (1 - mean reflectance of its wall): wall 0.97, a twentieth
 * of it the port, a grey of 0.18: 0.03 / (1 - (0.95 x 0.97 + 0.05 x 0.18)) = 0.4317. */
static void test_substitution(void)
{
    static unsigned counts[MOST];
    static double with[MOST], without[MOST];
    start(&sim_usb2000, "noise=0");
    SEND(0x03, 1, 0);
    fresh("grey 18", counts, 2048);
    corrected(counts, 2048, 60000, 65535, without);
    start(&sim_usb2000, "noise=0,substitution=0.05");
    SEND(0x03, 1, 0);
    fresh("grey 18", counts, 2048);
    corrected(counts, 2048, 60000, 65535, with);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, 0.4317, with[700] / without[700]);
}

static void test_truth(void)
{
    start(&sim_usb2000, "under=grey 30");
    TEST_ASSERT_EQUAL_DOUBLE(0.30, kind->truth(sim, 550, false));
    TEST_ASSERT_EQUAL_DOUBLE(0.34, kind->truth(sim, 550, true));
    act("place black");
    TEST_ASSERT_EQUAL_DOUBLE(0, kind->truth(sim, 550, true));
    act("place white");
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.96, kind->truth(sim, 420, false));
    /* Skin: haemoglobin's two bands with a dip between, the rise to the red, lighter is lighter. */
    act("place skin");
    double at_542 = kind->truth(sim, 542, false), at_560 = kind->truth(sim, 560, false);
    double at_577 = kind->truth(sim, 577, false), at_650 = kind->truth(sim, 650, false);
    TEST_ASSERT_TRUE(at_560 > at_542 && at_560 > at_577 && at_650 > 1.3 * at_560);
    act("lightness 30");
    below(0.5 * at_560, kind->truth(sim, 560, false));
}

/* ---- faults -------------------------------------------------------------------------- */

static void test_faults_of_a_spectrum(void)
{
    static const struct {
        const char *fault;
        int bytes;   /* of the transfer, which asks for 4608 */
        int sync_at; /* where the last byte of a good one is; -1: not there */
        uint8_t sync;
    } rows[] = {
        { "fault sync", 4097, 4096, 0x96 },
        { "fault truncate 1000", 1000, -1, 0 },
        { "fault truncate 1024", 1024, -1, 0 },
        { "fault truncate 4096", 4096, -1, 0 },
        { "fault truncate 0", 0, -1, 0 },
        { "fault overlong 1", 4098, 4096, 0x69 },
        { "fault overlong 600", 4608, 4096, 0x69 },
        { "fault hang", 512, -1, 0 },
        { "fault mute", 0, -1, 0 },
        { "fault silent 82", 0, -1, 0 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        static uint8_t b[4608];
        static unsigned counts[MOST];
        start(&sim_usb2000, "");
        act(rows[i].fault);
        SEND(0x09);
        TEST_ASSERT_EQUAL_INT_MESSAGE(rows[i].bytes, receive(0x82, b, 4608), rows[i].fault);
        if (rows[i].sync_at >= 0)
            TEST_ASSERT_EQUAL_HEX8_MESSAGE(rows[i].sync, b[rows[i].sync_at], rows[i].fault);
        act("fault none");
        while (receive(0x82, b, 4608) > 0) /* what was kept or is too much */
            ;
        spectrum(counts, 2048); /* well again */
    }
}

static void test_stall(void)
{
    uint8_t b[64];
    start(&sim_usb2000, "");
    act("fault stall 82");
    SEND(0xfe);
    TEST_ASSERT_EQUAL_INT(16, receive(0x81, b, 64));
    TEST_ASSERT_EQUAL_INT(-EPIPE, receive(0x82, b, 64));
    act("fault stall 0");
    TEST_ASSERT_EQUAL_INT(-EPIPE, receive(0x81, b, 64));
    status((uint8_t[16]){ 0 });
}

static void test_faults_of_an_answer(void)
{
    uint8_t b[64];
    start(&sim_usb2000, "");
    act("fault stale");
    SEND(0x05, 0);
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, 64));
    SEND(0xfe);
    TEST_ASSERT_EQUAL_INT(17, receive(0x81, b, 64)); /* of the slot */
    TEST_ASSERT_EQUAL_HEX8(0x05, b[0]);
    TEST_ASSERT_EQUAL_INT(16, receive(0x81, b, 64));

    act("fault twice");
    SEND(0x6c);
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, 64));
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, 64));
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, 64));

    act("fault short");
    SEND(0xfe);
    TEST_ASSERT_EQUAL_INT(2, receive(0x81, b, 64));

    act("fault silent 81");
    SEND(0x6c);
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, 64));
    act("fault none"); /* late, but there */
    TEST_ASSERT_EQUAL_INT(3, receive(0x81, b, 64));

    act("fault mute");
    SEND(0x6c);
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, 64));
    act("fault none"); /* never */
    TEST_ASSERT_EQUAL_INT(0, receive(0x81, b, 64));
}

static void test_delay(void)
{
    start(&sim_usb2000, "delays=0");
    int64_t from_us = now_us;
    integration();
    TEST_ASSERT_EQUAL_INT64(from_us, now_us);
    act("fault delay 250");
    integration();
    TEST_ASSERT_EQUAL_INT64(from_us + 250000, now_us);
}

static void test_gone(void)
{
    uint8_t b[4608];
    start(&sim_usb2000, "");
    act("fault gone");
    SEND(0x09);
    TEST_ASSERT_EQUAL_INT(-ENODEV, receive(0x82, b, sizeof b)); /* after one packet of it */
    TEST_ASSERT_EQUAL_INT(-ENODEV, receive(0x81, b, 64));
    TEST_ASSERT_EQUAL_INT(-ENODEV, kind->take(sim, 0x01, (const uint8_t[]){ 0x01 }, 1, now_us));
    act("reset");
    set_integration(2000);
    TEST_ASSERT_EQUAL_UINT32(2000, integration());
}

static void test_what_cannot_be(void)
{
    static const char *const options[] = {
        "colour=red", "delays=-1",     "delays=",  "noise",      "level=70000",
        "speed=low",  "lightness=abc", "under=me", "seed=1.5.2", "serial=0123456789abcdef",
    };
    static const char *const actions[] = {
        "place",
        "place grey",
        "place grey 101",
        "fault",
        "fault everything",
        "fault silent",
        "fault truncate -1",
        "fault slot 19",
        "fault stall 33",
        "press",
        "fault mute 3",
        "lightness 0",
        "",
        "fault slot 0 hex:0",
    };
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        TEST_ASSERT_NULL_MESSAGE(sim_usb2000.make(options[i]), options[i]);
    start(&sim_usb2000, "");
    for (size_t i = 0; i < sizeof actions / sizeof *actions; i++)
        TEST_ASSERT_FALSE_MESSAGE(kind->act(sim, actions[i], now_us), actions[i]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_models);
    RUN_TEST(test_integration_time);
    RUN_TEST(test_slots);
    RUN_TEST(test_saturation_level);
    RUN_TEST(test_flame_and_temperature);
    RUN_TEST(test_writing_is_counted);
    RUN_TEST(test_nonsense_changes_nothing);
    RUN_TEST(test_packets_of_usb2000);
    RUN_TEST(test_usb4000_divides_at_high_speed);
    RUN_TEST(test_a_packet_that_does_not_fit);
    RUN_TEST(test_14_bits);
    RUN_TEST(test_stale_light_of_usb2000);
    RUN_TEST(test_stale_integration_time);
    RUN_TEST(test_initialising);
    RUN_TEST(test_idle_cycles_of_usb4000);
    RUN_TEST(test_a_trigger_that_never_comes);
    RUN_TEST(test_shut_down);
    RUN_TEST(test_reflectance_comes_back);
    RUN_TEST(test_it_bends);
    RUN_TEST(test_saturation);
    RUN_TEST(test_dark);
    RUN_TEST(test_noise_is_that_of_the_seed);
    RUN_TEST(test_shot_noise);
    RUN_TEST(test_lamp);
    RUN_TEST(test_drift);
    RUN_TEST(test_substitution);
    RUN_TEST(test_truth);
    RUN_TEST(test_faults_of_a_spectrum);
    RUN_TEST(test_stall);
    RUN_TEST(test_faults_of_an_answer);
    RUN_TEST(test_delay);
    RUN_TEST(test_gone);
    RUN_TEST(test_what_cannot_be);
    return UNITY_END();
}
