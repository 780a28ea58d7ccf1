/* test_xrite_rci.c - conversations with the simulator of an SP62, and what goes wrong in them.
 *
 * CORRUPT=all in the environment tries every byte of the replies instead of some: minutes. */
#include "drivers/xrite_rci/xrite_rci.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "drivers/call.h"
#include "tests/drivers/cue.h"
#include "unity.h"

enum { REPLY_MS = 30, SHOT_MS = 200, BANDS = 31 };

static struct cued_wire wire;
static const struct driver *const rci = &xrite_rci_driver;
static struct instrument *instrument;
static struct driver_identity identity;
static struct driver_error error;
static struct driver_reading reading;
static struct driver_status status;

void setUp(void)
{
    instrument = NULL;
    memset(&error, 0, sizeof error);
}

void tearDown(void)
{
    rci->close(instrument);
    instrument = NULL;
    if (wire.wire != NULL) {
        TEST_ASSERT_EQUAL_UINT(0, wire.forbidden);
        TEST_ASSERT_TRUE(wire_memory_act(wire.wire, "expect writes 0"));
    }
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

/* ---- helpers ------------------------------------------------------------------------ */

static void connect(const char *options)
{
    rci->close(instrument);
    instrument = NULL;
    wire_memory_free(wire.wire);
    cued_wire_init(&wire, wire_memory_make(&sim_sp62, options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    wire.never = "960"; /* 9600BR, another baud rate */
}

static void act(const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(wire_memory_act(wire.wire, action), action);
}

static enum driver_result open_with(int reply_ms, int shot_ms)
{
    struct driver_options options = { .address = "",
                                      .reply_timeout_ms = reply_ms,
                                      .shot_timeout_ms = shot_ms,
                                      .open_timeout_ms = 4000,
                                      .wire = &wire.source };
    return rci->open(&options, &instrument, &identity, &error);
}

static enum driver_result open_within(int reply_ms)
{
    return open_with(reply_ms, SHOT_MS);
}

static enum driver_result open_it(void)
{
    return open_within(REPLY_MS);
}

#define EXPECT(expect, call) \
    do { \
        enum driver_result result_ = (call); \
        char message_[DRIVER_TEXT_SIZE + 64]; \
        snprintf(message_, sizeof message_, "%s (%s)", driver_result_name(result_), \
                 result_ != DRIVER_OK ? error.text : ""); \
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect, result_, message_); \
    } while (0)

#define OK(call) EXPECT(DRIVER_OK, call)

static enum driver_result calibrate(enum driver_calibration step)
{
    return rci->calibrate(instrument, step, &error);
}

/* operator_ms > 0: somebody follows the display. */
static void calibrate_it(void)
{
    OK(calibrate(DRIVER_CALIBRATION_ZERO));
    act("place white");
    OK(calibrate(DRIVER_CALIBRATION_WHITE));
    act("place skin");
}

static void start(const char *options)
{
    connect(options);
    OK(open_it());
    calibrate_it();
}

#define QUICK "delays=0,operator_ms=1"

static enum driver_result measure(void)
{
    return rci->measure(instrument, &reading, &error);
}

static void expect_text(const char *part)
{
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, part), error.text);
}

/* Within noise and rounding of what lies there; noise=0.0003. */
static void check_truth(void)
{
    for (size_t i = 0; i < reading.sce.n; i++) {
        double nm = spectrum_nm(&reading.sce, i);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, wire_memory_truth(wire.wire, nm, false),
                                  reading.sce.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, wire_memory_truth(wire.wire, nm, true),
                                  reading.sci.value[i]);
    }
}

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000 }, NULL);
}

/* ---- opening ------------------------------------------------------------------------ */

static void test_identity(void)
{
    connect("delays=0,serial=007654,samples=2");
    OK(open_it());
    TEST_ASSERT_EQUAL_STRING("X-Rite", identity.maker);
    TEST_ASSERT_EQUAL_STRING("SP60/SP62/SP64", identity.model);
    TEST_ASSERT_EQUAL_STRING("007654", identity.serial);
    TEST_ASSERT_EQUAL_INT(DRIVER_GEOMETRY_D8, identity.geometry);
    TEST_ASSERT_TRUE(identity.has_sce && identity.has_sci && identity.has_button);
    TEST_ASSERT_FALSE(identity.has_battery || identity.has_user_calibration);
    TEST_ASSERT_EQUAL_DOUBLE(400.0, identity.grid[0].first_nm);
    TEST_ASSERT_EQUAL_size_t(BANDS, identity.grid[0].n);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, identity.aperture_mm[0]);
    TEST_ASSERT_NULL(rci->matches); /* an adaptor says nothing: by hand only */
}

static void test_echo_is_switched_off(void)
{
    start("delays=0,operator_ms=1,echo=1");
    OK(measure());
    check_truth();
}

static void test_serial_numbers_that_are_none(void)
{
    connect("delays=0,operator_ms=1,serial=");
    OK(open_it());
    TEST_ASSERT_EQUAL_STRING("", identity.serial);
    calibrate_it();
    cue(&wire, "CE", 1, "fault silence");
    EXPECT(DRIVER_TIMEOUT, measure());
    OK(measure()); /* back into step without one */
    check_truth();
    connect("delays=0,binary_serial=1");
    EXPECT(DRIVER_PROTOCOL, open_it());
}

static void test_nobody_there(void)
{
    connect("delays=0");
    act("fault silence from 1");
    struct driver_options options = { .address = "", .open_timeout_ms = 300, .wire = &wire.source };
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_TIMEOUT, rci->open(&options, &instrument, &identity, &error));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 800);
}

/* Another instrument, another speed. */
static void test_noise_at_opening(void)
{
    connect("delays=0");
    act("fault garbage 900 from 1");
    EXPECT(DRIVER_PROTOCOL, open_it());
    connect("delays=0");
    act("fault reply OK00 from 1");
    EXPECT(DRIVER_PROTOCOL, open_it());
    expect_text("is this the right port?");
}

static void test_one_reply_at_opening_is_lost_or_damaged(void)
{
    static const char *const faults[] = { "fault silence on %d", "fault garbage 20 on %d",
                                          "fault truncated 2 on %d", "fault twice on %d",
                                          "fault reply <14> on %d" };
    for (int n = 1; n <= 16; n++)
        for (size_t f = 0; f < sizeof faults / sizeof *faults; f++) {
            char action[64];
            if (f == 4 && n % 7 != 2)
                continue; /* a second each */
            snprintf(action, sizeof action, faults[f], n);
            connect(QUICK);
            act(action);
            enum driver_result r = open_within(REPLY_MS);
            if (r == DRIVER_OK)
                TEST_ASSERT_EQUAL_STRING_MESSAGE("001234", identity.serial, action);
            else
                TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_TIMEOUT || r == DRIVER_PROTOCOL, action);
            tearDown();
        }
}

/* An instrument that knows fewer settings than one description has, and one that refuses what
 * all have. */
static void test_settings_it_does_not_know(void)
{
    connect(QUICK);
    cue(&wire, "0040CF", CUE_ALWAYS, "fault reply <12>");
    cue(&wire, "0020CF", CUE_ALWAYS, "fault reply <13>");
    OK(open_it());
    tearDown();
    connect(QUICK);
    cue(&wire, "0107CF", CUE_ALWAYS, "fault reply <12>");
    EXPECT(DRIVER_PROTOCOL, open_it());
}

/* ---- calibrating -------------------------------------------------------------------- */

static void test_places(void)
{
    connect(QUICK);
    OK(open_it());
    OK(rci->status(instrument, &status, &error));
    TEST_ASSERT_NOT_NULL(strstr(status.place[DRIVER_CALIBRATION_ZERO], "black trap"));
    TEST_ASSERT_NOT_NULL(strstr(status.place[DRIVER_CALIBRATION_WHITE], "once more"));
    TEST_ASSERT_EQUAL_INT(-1, status.battery_percent);
    TEST_ASSERT_TRUE(isnan(status.temperature_C));
}

/* Somebody who puts it on these two and presses, whatever the display says. */
static void *place_two(void *of)
{
    const char *const *two = of;
    sleep_ms(150); /* into step, and then the display asks */
    for (int i = 0; i < 2; i++) {
        sleep_ms(20);
        wire_memory_act(wire.wire, two[i]);
        wire_memory_act(wire.wire, "press");
    }
    return NULL;
}

static enum driver_result calibrate_on(const char *const two[2])
{
    pthread_t thread;
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, place_two, (void *)(uintptr_t)two));
    enum driver_result r = calibrate(DRIVER_CALIBRATION_ZERO);
    pthread_join(thread, NULL);
    return r;
}

static const char *const in_order[] = { "place white", "place black" };
static const char *const swapped[] = { "place black", "place white" };

static void test_the_instrument_notices_swapped_tiles(void)
{
    connect("delays=0");
    OK(open_it());
    EXPECT(DRIVER_IMPLAUSIBLE, calibrate_on(swapped));
    TEST_ASSERT_EQUAL_STRING("<29>", error.code);
    EXPECT(DRIVER_REFUSED, calibrate(DRIVER_CALIBRATION_WHITE));
    OK(calibrate_on(in_order));
    act("place black"); /* not what the white step asks for */
    EXPECT(DRIVER_IMPLAUSIBLE, calibrate(DRIVER_CALIBRATION_WHITE));
    act("place skin");
    EXPECT(DRIVER_IMPLAUSIBLE, calibrate(DRIVER_CALIBRATION_WHITE));
    expect_text("not white");
    EXPECT(DRIVER_REFUSED, measure());
    act("place white");
    OK(calibrate(DRIVER_CALIBRATION_WHITE));
    act("place skin");
    OK(measure());
    check_truth();
}

static void test_swapped_tiles_that_it_does_not_notice(void)
{
    connect("delays=0,careful=0");
    OK(open_it());
    OK(calibrate_on(swapped));
    act("place white");
    EXPECT(DRIVER_IMPLAUSIBLE, calibrate(DRIVER_CALIBRATION_WHITE));
    expect_text("swapped");
    act("place black"); /* which such a one takes for white */
    enum driver_result r = calibrate(DRIVER_CALIBRATION_WHITE);
    if (r == DRIVER_OK) { /* it shows in any other surface */
        act("place skin");
        r = measure();
        TEST_ASSERT_TRUE(r != DRIVER_OK || reading.sce.value[0] > reading.sce.value[BANDS - 1]);
    }
}

static void test_nobody_follows_the_display(void)
{
    connect("delays=0,operator_ms=1");
    OK(open_it());
    cue(&wire, "10XD", 1, "fault reply <2A>");
    EXPECT(DRIVER_TIMEOUT, calibrate(DRIVER_CALIBRATION_ZERO));
    expect_text("display");
    cue(&wire, "10XD", 1, "fault reply <15>");
    EXPECT(DRIVER_REFUSED, calibrate(DRIVER_CALIBRATION_ZERO));
    calibrate_it();
    OK(measure());
}

static void test_firmware_that_answers_at_once(void)
{
    connect("delays=0,operator_ms=100");
    OK(open_with(REPLY_MS, 0)); /* a shot of seconds */
    calibrate_it();
    OK(rci->configure(instrument, &(struct driver_setup){ .averages = 2 }, &error));
    int64_t began_ms = call_now_ms();
    /* What it says while it goes on: busy, and the spectrum of before. */
    cue(&wire, "0101GM", 1, "fault reply <14>");
    OK(measure());
    check_truth();
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 1000); /* the second that a busy one wants */
    cue(&wire, "00SN", 1, "fault reply <14>");
    cue(&wire, "00SN", 2, "fault reply <14>");
    OK(calibrate(DRIVER_CALIBRATION_ZERO));
}

static void test_calibration_lost(void)
{
    start(QUICK);
    act("forget");
    EXPECT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_STRING("<28>", error.code);
    OK(rci->status(instrument, &status, &error));
    TEST_ASSERT_TRUE(status.due[DRIVER_CALIBRATION_ZERO] && status.due[DRIVER_CALIBRATION_WHITE]);
    calibrate_it();
    act("fault calibration_lost");
    EXPECT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_STRING("<28>", error.code);
    calibrate_it();
    OK(measure());
    check_truth();
}

/* ---- setting ------------------------------------------------------------------------ */

static void test_averages(void)
{
    start(QUICK);
    struct driver_setup setup = { .averages = 9 };
    OK(rci->configure(instrument, &setup, &error));
    OK(measure());
    check_truth();
    setup.averages = 10;
    EXPECT(DRIVER_UNSUPPORTED, rci->configure(instrument, &setup, &error));
}

static void test_another_aperture_wants_calibration(void)
{
    start("delays=0,operator_ms=1,variant=sp64");
    OK(rci->configure(instrument, &(struct driver_setup){ .aperture = 1 }, &error));
    EXPECT(DRIVER_REFUSED, measure());
    act("slide 1");
    calibrate_it();
    OK(measure());
    TEST_ASSERT_EQUAL_DOUBLE(4.0, reading.sce.aperture_mm);
}

/* ---- measuring ---------------------------------------------------------------------- */

static void test_readings_are_true(void)
{
    start(QUICK);
    for (int i = 0; i < 3; i++) {
        OK(measure());
        TEST_ASSERT_EQUAL_UINT(0, reading.warnings);
        check_truth();
        for (size_t b = 0; b < BANDS; b++)
            TEST_ASSERT_TRUE(reading.sce.value[b] == reading.raw_sce[b] * 1e-6);
    }
}

static double measured_ms(void)
{
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    OK(measure());
    clock_gettime(CLOCK_MONOTONIC, &b);
    return (double)(b.tv_sec - a.tv_sec) * 1e3 + (double)(b.tv_nsec - a.tv_nsec) * 1e-6;
}

/* The best of 20: what the driver itself takes, as the simulator takes nothing. */
static void test_a_reading_takes_no_time_of_its_own(void)
{
    double best_ms = 1e9;
    start(QUICK);
    for (int i = 0; i < 20; i++)
        best_ms = fmin(best_ms, measured_ms());
    printf("sp62: a reading takes %.3f ms beside the instrument's own time\n", best_ms);
    TEST_ASSERT_TRUE(best_ms < 2.0);
}

static void *cancel_the_wait(void *argument)
{
    (void)argument;
    nanosleep(&(struct timespec){ .tv_nsec = 3000000 }, NULL);
    rci->cancel(instrument);
    return NULL;
}

/* As the station's do: it waits for the button while nobody asks. */
static void test_nor_does_one_that_ends_a_wait(void)
{
    double best_ms = 1e9;
    start("delays=0,operator_ms=200");
    for (int i = 0; i < 8; i++) {
        pthread_t thread;
        bool pressed;
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_the_wait, NULL));
        EXPECT(DRIVER_CANCELLED, rci->wait_button(instrument, 3000, &pressed, &error));
        pthread_join(thread, NULL);
        best_ms = fmin(best_ms, measured_ms());
        check_truth();
    }
    TEST_ASSERT_TRUE(best_ms < 2.0);
}

static void test_what_it_reports(void)
{
    static const struct {
        const char *act, *code;
        enum driver_result result;
        const char *good_again;
    } rows[] = {
        { "battery 2", "<3B>", DRIVER_BATTERY, "charge" },
        { "lamp dead", "<31>", DRIVER_FAULT, "lamp ok" },
        { "fault lamp", "<31>", DRIVER_FAULT, "fault none" },
        { "place bright", "<27>", DRIVER_IMPLAUSIBLE, "place skin" },
    };
    start(QUICK);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        act(rows[i].act);
        memset(&reading, 0x77, sizeof reading);
        EXPECT(rows[i].result, measure());
        TEST_ASSERT_EQUAL_STRING(rows[i].code, error.code);
        TEST_ASSERT_EQUAL_INT(0x77, *(unsigned char *)&reading);
        act(rows[i].good_again);
        OK(measure()); /* CE has cleared it */
        check_truth();
    }
}

/* Slow: the deadline of a shot is 6 s. */
static void test_battery_dies_in_a_shot(void)
{
    start(QUICK);
    act("fault battery_dies");
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_TIMEOUT, measure());
    int64_t took_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE(took_ms >= SHOT_MS && took_ms < SHOT_MS + 2000);
    expect_text("battery");
    EXPECT(DRIVER_TIMEOUT, measure());
    expect_text("battery");
}

static void test_nonsense_is_refused(void)
{
    static const char *const faults[] = { "fault zero from 1",     "fault over from 1",
                                          "fault negative from 1", "fault text from 1",
                                          "fault bands 30 from 1", "fault bands 32 from 1",
                                          "fault swapped from 1" };
    start(QUICK);
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        act(faults[i]);
        enum driver_result r = measure();
        TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_IMPLAUSIBLE || r == DRIVER_PROTOCOL, faults[i]);
        act("fault none");
        OK(measure());
        check_truth();
    }
}

/* Whose line has a sign: nothing under the port is no damage of the cable. */
static void test_less_than_nothing_asks_what_is_there(void)
{
    start(QUICK);
    act("fault negative from 1");
    EXPECT(DRIVER_IMPLAUSIBLE, measure());
    expect_text("under the port");
}

/* The shot before again, as where RM failed and the answer that said so came damaged.  It is waited
 * for as for a shot. */
static void test_an_old_spectrum_is_no_new_one(void)
{
    start("delays=0,operator_ms=1,noise=0");
    OK(measure());
    EXPECT(DRIVER_PROTOCOL, measure());
    expect_text("the shot before");
}

/* ---- stored samples ----------------------------------------------------------------- */

static void test_stored_samples(void)
{
    size_t n;
    connect("delays=0,samples=9");
    OK(open_it()); /* needs no calibration */
    OK(rci->stored_count(instrument, &n, &error));
    TEST_ASSERT_EQUAL_size_t(9, n);
    OK(rci->stored_read(instrument, 8, &reading, &error));
    TEST_ASSERT_EQUAL_STRING("sample 9", reading.sample);
    EXPECT(DRIVER_REFUSED, rci->stored_read(instrument, 9, &reading, &error));
    expect_text("has stored 9");
    cue(&wire, "00GM", CUE_ALWAYS, "fault reply 12<00>");
    EXPECT(DRIVER_UNSUPPORTED, rci->stored_read(instrument, 9, &reading, &error));
    cue(&wire, "1101GM", 1, "fault xor 3 1");
    wire.cue[0].on = 0;
    OK(rci->stored_read(instrument, 0, &reading, &error));
    TEST_ASSERT_EQUAL_STRING("sample 1", reading.sample);
}

/* ---- the button --------------------------------------------------------------------- */

static void wait_for_press(int ms, bool expect)
{
    bool pressed = !expect;
    OK(rci->wait_button(instrument, ms, &pressed, &error));
    TEST_ASSERT_EQUAL(expect, pressed);
}

static void *press_soon(void *nothing)
{
    (void)nothing;
    sleep_ms(60);
    wire_memory_act(wire.wire, "press");
    return NULL;
}

static void press_while_waiting(void)
{
    pthread_t thread;
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, NULL));
    wait_for_press(5000, true);
    pthread_join(thread, NULL);
}

/* Nobody in the simulator follows the display here: the test itself presses. */
static void start_without_operator(void)
{
    connect("delays=0");
    OK(open_it());
    OK(calibrate_on(in_order));
    act("place white");
    OK(calibrate(DRIVER_CALIBRATION_WHITE));
    act("place skin");
}

static void test_a_press_gives_its_reading(void)
{
    start_without_operator();
    press_while_waiting();
    unsigned sends = wire.sends;
    OK(measure());
    check_truth();
    TEST_ASSERT_EQUAL_UINT(sends + 4, wire.sends); /* fetched, not flashed */
    wait_for_press(0, false);
    OK(measure()); /* the next is a shot */
    check_truth();
    TEST_ASSERT_EQUAL_STRING("0001GM", wire.said);
}

static void test_a_press_between_two_waits(void)
{
    start_without_operator();
    wait_for_press(0, false);
    act("press");
    wait_for_press(5, true);
    wait_for_press(5, false);
    act("lightness 40");
    OK(measure()); /* when it was pressed is not known: a shot of now */
    check_truth();
    wait_for_press(5, false);
    act("press");
    act("lightness 60");
    OK(measure()); /* ends the wait, and keeps the press */
    check_truth();
    wait_for_press(0, true);
}

static void test_a_press_is_old_after_a_setting(void)
{
    start_without_operator();
    press_while_waiting();
    OK(rci->configure(instrument, &(struct driver_setup){ .averages = 1 }, &error));
    act("lightness 40");
    OK(measure());
    check_truth();
}

static void test_waiting_is_ended_by_whatever_comes_next(void)
{
    size_t n;
    start_without_operator();
    wait_for_press(5, false);
    OK(rci->status(instrument, &status, &error));
    wait_for_press(5, false);
    OK(measure());
    check_truth();
    wait_for_press(5, false);
    OK(rci->stored_count(instrument, &n, &error));
    wait_for_press(5, false);
    OK(rci->configure(instrument, &(struct driver_setup){ .averages = 2 }, &error));
    OK(measure());
    check_truth();
}

static void test_the_instrument_stops_waiting(void)
{
    start_without_operator();
    cue(&wire, "01XD", 1, "fault reply <21>");
    wait_for_press(5, false);
    cue(&wire, "01XD", 1, "fault reply <11>");
    pthread_t thread;
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, NULL));
    wait_for_press(30, false);
    pthread_join(thread, NULL);
    OK(measure());
    check_truth();
}

static void test_no_button_before_calibration(void)
{
    connect("delays=0");
    OK(open_it());
    int64_t began_ms = call_now_ms();
    wait_for_press(50, false);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 50);
}

static void test_a_press_whose_shot_fails(void)
{
    start_without_operator();
    act("place bright");
    press_while_waiting();
    EXPECT(DRIVER_IMPLAUSIBLE, measure());
    act("place skin");
    OK(measure());
    check_truth();
}

static void *cancel_soon(void *nothing)
{
    (void)nothing;
    sleep_ms(60);
    rci->cancel(instrument);
    return NULL;
}

static void test_a_cancelled_calibration_leaves_nobody_waiting(void)
{
    pthread_t thread;
    connect("delays=0");
    OK(open_it());
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, NULL));
    EXPECT(DRIVER_CANCELLED, calibrate(DRIVER_CALIBRATION_ZERO));
    pthread_join(thread, NULL);
    OK(calibrate_on(in_order));
}

/* ---- the wire ----------------------------------------------------------------------- */

/* Every reply in two pieces, at every offset. */
static void test_replies_split_anywhere(void)
{
    start(QUICK);
    for (size_t k = 1; k < 300; k++) {
        wire_memory_split(wire.wire, k, 1);
        OK(measure());
        check_truth();
    }
}

static void test_one_byte_each_100_ms(void)
{
    start(QUICK);
    rci->close(instrument);
    OK(open_within(150));
    cue(&wire, "00SN", 1, "fault slow 100");
    OK(rci->status(instrument, &status, &error));
}

/* Whatever becomes of a reply, the reading is true or refused, and so are the next ones. */
static void test_no_reply_is_taken_for_another(void)
{
    static const char *const commands[] = { "CE", "RM", "0101GM", "0001GM" };
    static const char *const faults[] = {
        "fault late",          "fault delay 150",   "fault twice",      "fault garbage 40",
        "fault garbage 3000",  "fault truncated 3", "fault longer 5",   "fault longer 3000",
        "fault silence",       "fault reply <11>",  "fault reply <00>", "fault reply 12<00>",
        "fault reply 1,2<00>", "fault truncated -1"
    };
    start(QUICK);
    for (size_t c = 0; c < sizeof commands / sizeof *commands; c++)
        for (size_t f = 0; f < sizeof faults / sizeof *faults; f++) {
            char what[64];
            snprintf(what, sizeof what, "%s %s", commands[c], faults[f]);
            memset(wire.cue, 0, sizeof wire.cue);
            cue(&wire, commands[c], 1, faults[f]);
            act("lightness 30");
            for (int i = 0; i < 2; i++) { /* and nothing of it in the next, of lighter skin */
                enum driver_result r = measure();
                if (r == DRIVER_OK)
                    check_truth();
                else
                    TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_PROTOCOL || r == DRIVER_TIMEOUT, what);
                act("lightness 70");
            }
            act("fault none");
            wire.cue[0].on = 0;
            EXPECT(DRIVER_OK, measure());
            check_truth();
        }
}

/* Where a wait for the button is ended, the serial number is asked for to get into step: part of
 * its answer is not looked at for ever. */
static void test_a_damaged_marker(void)
{
    static const char *const faults[] = { "fault garbage 40", "fault truncated 3",
                                          "fault truncated -1", "fault longer 3000", "fault late" };
    start_without_operator();
    for (size_t f = 0; f < sizeof faults / sizeof *faults; f++) {
        wait_for_press(5, false);
        memset(wire.cue, 0, sizeof wire.cue);
        cue(&wire, "00SN", 1, faults[f]);
        enum driver_result r = measure();
        if (r == DRIVER_OK)
            check_truth();
        else
            TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_PROTOCOL || r == DRIVER_TIMEOUT, faults[f]);
        act("fault none");
        wire.cue[0].on = 0;
        EXPECT(DRIVER_OK, measure());
        check_truth();
    }
}

static void test_another_program_on_the_port(void)
{
    static const char *const commands[] = { "CE", "RM", "0101GM", "0001GM" };
    start(QUICK);
    for (size_t i = 0; i < 4; i++) {
        cue(&wire, commands[i], 1, "fault prober");
        OK(measure());
        check_truth();
    }
    cue(&wire, "10XD", 1, "fault prober");
    calibrate_it();
    cue(&wire, "00SN", 1, "fault prober");
    OK(rci->status(instrument, &status, &error));
}

static void test_unplugged_anywhere(void)
{
    static const size_t after[] = { 0, 1, 5, 40 };
    for (unsigned sends = 1; sends <= 6; sends++)
        for (size_t i = 0; i < 4; i++) {
            start(QUICK);
            wire_memory_unplug_at(wire.wire, sends, after[i]);
            enum driver_result r = measure();
            if (r != DRIVER_OK)
                EXPECT(DRIVER_GONE, r);
            rci->close(instrument);
            instrument = NULL;
            wire_memory_unplug(wire.wire); /* where it was not reached */
            wire_memory_plug(wire.wire);
            OK(open_it());
            tearDown();
        }
}

static void test_unplugged_while_idle(void)
{
    bool pressed;
    start(QUICK);
    wire_memory_unplug(wire.wire);
    EXPECT(DRIVER_GONE, rci->status(instrument, &status, &error));
    EXPECT(DRIVER_GONE, measure());
    EXPECT(DRIVER_GONE, rci->wait_button(instrument, 1000, &pressed, &error));
}

/* The adaptor stays; the line's settings of the instrument are gone. */
static void test_switched_off_and_on(void)
{
    start(QUICK);
    act("reset");
    EXPECT(DRIVER_GONE, rci->status(instrument, &status, &error));
    expect_text("switched off");
    rci->close(instrument);
    OK(open_it());
    EXPECT(DRIVER_REFUSED, measure());
    calibrate_it();
    OK(measure());
    act("reset");
    EXPECT(DRIVER_GONE, measure());
}

static void test_another_instrument_on_the_line(void)
{
    start(QUICK);
    cue(&wire, "00SN", CUE_ALWAYS, "fault reply 009999<00>");
    EXPECT(DRIVER_GONE, rci->status(instrument, &status, &error));
    expect_text("009999");
}

/* ---- one damaged byte --------------------------------------------------------------- */

/* Two skins in turn, noise=0: the value is right if it is the same to the last digit. */
static int32_t right[2][2][BANDS];

static void learn(int which)
{
    OK(measure());
    memcpy(right[which][0], reading.raw_sce, sizeof right[which][0]);
    memcpy(right[which][1], reading.raw_sci, sizeof right[which][1]);
}

static bool is_right(int which)
{
    return memcmp(right[which][0], reading.raw_sce, sizeof right[which][0]) == 0 &&
           memcmp(right[which][1], reading.raw_sci, sizeof right[which][1]) == 0;
}

static int turn;

static void next_skin(void)
{
    turn = !turn;
    act(turn ? "lightness 66" : "lightness 65");
}

struct tally {
    unsigned right, refused, wrong;
};

static void try_damage(const char *command, unsigned on, const char *damage, struct tally *tally)
{
    memset(wire.cue, 0, sizeof wire.cue);
    cue(&wire, command, on, damage);
    next_skin();
    enum driver_result r = measure();
    if (r == DRIVER_OK && is_right(turn))
        tally->right++;
    else if (r == DRIVER_OK)
        tally->wrong++;
    else
        tally->refused++;
    memset(wire.cue, 0, sizeof wire.cue);
    act("fault none");
    for (int i = 0; r != DRIVER_OK && i < 2; i++) { /* and it goes on */
        next_skin();
        if (r == DRIVER_GONE) {
            rci->close(instrument);
            instrument = NULL;
            OK(open_within(20));
            calibrate_it();
        }
        r = measure();
    }
    OK(r);
    TEST_ASSERT_TRUE(is_right(turn));
}

/* All single bits, and what else lines are made of; some where not all are wanted. */
static void damage_byte(const char *command, unsigned on, size_t at, bool all, struct tally *tally)
{
    static const char others[] = "059,.-<> \r\n";
    char damage[40];
    for (int bit = 0; bit < 8; bit += all ? 1 : 3) {
        snprintf(damage, sizeof damage, "fault xor %zu %d", at, 1 << bit);
        try_damage(command, on, damage, tally);
    }
    for (size_t i = 0; i < sizeof others - 1; i += all ? 1 : 3) {
        snprintf(damage, sizeof damage, "fault replace %zu %d", at, others[i]);
        try_damage(command, on, damage, tally);
    }
}

static void test_one_damaged_byte(void)
{
    static const struct {
        const char *command;
        unsigned on; /* the spectra are asked for twice */
        size_t bytes, step;
    } replies[] = {
        { "CE", 1, 6, 1 },        { "RM", 1, 6, 1 },        { "0101GM", 1, 253, 28 },
        { "0001GM", 1, 253, 28 }, { "0101GM", 2, 253, 63 }, { "0001GM", 2, 253, 63 },
    };
    const char *corrupt = getenv("CORRUPT");
    bool all = corrupt != NULL && strcmp(corrupt, "all") == 0;
    connect("delays=0,operator_ms=1,noise=0");
    OK(open_within(20));
    calibrate_it();
    next_skin();
    learn(turn);
    next_skin();
    learn(turn);
    for (size_t i = 0; i < sizeof replies / sizeof *replies; i++) {
        struct tally tally = { 0 };
        size_t step = !all ? replies[i].step : replies[i].on > 1 ? 5 : 1;
        for (size_t at = 0; at < replies[i].bytes; at += step)
            damage_byte(replies[i].command, replies[i].on, at, all, &tally);
        printf("reply %u to %s: %u damaged: %u right, %u refused, %u wrong\n", replies[i].on,
               replies[i].command, tally.right + tally.refused + tally.wrong, tally.right,
               tally.refused, tally.wrong);
        TEST_ASSERT_EQUAL_UINT(0, tally.wrong);
        TEST_ASSERT_TRUE(tally.right > 0);
    }
}

/* An answer that tells of a failure must not become a reading. */
static void test_one_damaged_byte_of_an_error(void)
{
    start(QUICK);
    OK(measure());
    act("lamp dead");
    for (long at = 0; at < 4; at++)
        for (int bit = 0; bit < 8; bit++) {
            char damage[40];
            memset(wire.cue, 0, sizeof wire.cue);
            snprintf(damage, sizeof damage, "fault xor %ld %d", at, 1 << bit);
            cue(&wire, "RM", 1, damage);
            TEST_ASSERT_TRUE_MESSAGE(measure() != DRIVER_OK, damage);
        }
    act("lamp ok");
    calibrate_it();
    OK(measure());
    check_truth();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_identity);
    RUN_TEST(test_echo_is_switched_off);
    RUN_TEST(test_serial_numbers_that_are_none);
    RUN_TEST(test_nobody_there);
    RUN_TEST(test_noise_at_opening);
    RUN_TEST(test_one_reply_at_opening_is_lost_or_damaged);
    RUN_TEST(test_settings_it_does_not_know);
    RUN_TEST(test_places);
    RUN_TEST(test_the_instrument_notices_swapped_tiles);
    RUN_TEST(test_swapped_tiles_that_it_does_not_notice);
    RUN_TEST(test_nobody_follows_the_display);
    RUN_TEST(test_firmware_that_answers_at_once);
    RUN_TEST(test_calibration_lost);
    RUN_TEST(test_averages);
    RUN_TEST(test_another_aperture_wants_calibration);
    RUN_TEST(test_readings_are_true);
    RUN_TEST(test_a_reading_takes_no_time_of_its_own);
    RUN_TEST(test_nor_does_one_that_ends_a_wait);
    RUN_TEST(test_what_it_reports);
    RUN_TEST(test_battery_dies_in_a_shot);
    RUN_TEST(test_nonsense_is_refused);
    RUN_TEST(test_less_than_nothing_asks_what_is_there);
    RUN_TEST(test_an_old_spectrum_is_no_new_one);
    RUN_TEST(test_stored_samples);
    RUN_TEST(test_a_press_gives_its_reading);
    RUN_TEST(test_a_press_between_two_waits);
    RUN_TEST(test_a_press_is_old_after_a_setting);
    RUN_TEST(test_waiting_is_ended_by_whatever_comes_next);
    RUN_TEST(test_the_instrument_stops_waiting);
    RUN_TEST(test_no_button_before_calibration);
    RUN_TEST(test_a_press_whose_shot_fails);
    RUN_TEST(test_a_cancelled_calibration_leaves_nobody_waiting);
    RUN_TEST(test_replies_split_anywhere);
    RUN_TEST(test_one_byte_each_100_ms);
    RUN_TEST(test_no_reply_is_taken_for_another);
    RUN_TEST(test_a_damaged_marker);
    RUN_TEST(test_another_program_on_the_port);
    RUN_TEST(test_unplugged_anywhere);
    RUN_TEST(test_unplugged_while_idle);
    RUN_TEST(test_switched_off_and_on);
    RUN_TEST(test_another_instrument_on_the_line);
    RUN_TEST(test_one_damaged_byte);
    RUN_TEST(test_one_damaged_byte_of_an_error);
    return UNITY_END();
}
