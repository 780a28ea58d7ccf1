/* test_km_ascii.c - conversations with the simulators of a CM-700d and a CM-2600d, and what goes
 * wrong in them. */
#include "drivers/km_ascii/km_ascii.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "drivers/call.h"
#include "tests/drivers/cue.h"
#include "unity.h"

enum { REPLY_MS = 60, SHOT_MS = 300 };

static struct cued_wire wire;
static const struct driver *const km = &km_ascii_driver;
static struct instrument *instrument;
static struct driver_identity identity;
static struct driver_error error;
static struct driver_reading reading, other;
static struct driver_status status;

/* Written by none: plate data, stored samples. */
static const char forbidden[] = "CDS,UCS,CIS,SDD,SAD,WMS";

void setUp(void)
{
    instrument = NULL;
    memset(&error, 0, sizeof error);
}

void tearDown(void)
{
    km->close(instrument);
    if (wire.wire != NULL) {
        TEST_ASSERT_EQUAL_UINT(0, wire.forbidden);
        TEST_ASSERT_TRUE(wire_memory_act(wire.wire, "expect writes 0"));
    }
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

/* ---- helpers ------------------------------------------------------------------------ */

static void connect(const struct sim_kind *kind, const char *options)
{
    wire_memory_free(wire.wire);
    cued_wire_init(&wire, wire_memory_make(kind, options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    wire.never = forbidden;
}

static void act(const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(wire_memory_act(wire.wire, action), action);
}

static enum driver_result open_within(int reply_ms)
{
    struct driver_options options = { .address = "",
                                      .reply_timeout_ms = reply_ms,
                                      .shot_timeout_ms = SHOT_MS,
                                      .wire = &wire.source };
    return km->open(&options, &instrument, &identity, &error);
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

static void calibrate_it(void)
{
    act("place black");
    OK(km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    act("place white");
    OK(km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    act("place skin");
}

static void start(const struct sim_kind *kind, const char *options)
{
    connect(kind, options);
    OK(open_it());
    calibrate_it();
}

static enum driver_result measure(void)
{
    return km->measure(instrument, &reading, &error);
}

static void expect_text(const char *part)
{
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, part), error.text);
}

/* Within noise and rounding of what lies there; noise=0.0003. */
static void check_truth(const struct driver_reading *r)
{
    for (size_t i = 0; i < r->sce.n; i++) {
        double nm = spectrum_nm(&r->sce, i);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, wire_memory_truth(wire.wire, nm, false), r->sce.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, wire_memory_truth(wire.wire, nm, true), r->sci.value[i]);
    }
}

static void both_models(void (*test)(const struct sim_kind *kind))
{
    test(&sim_cm700d);
    tearDown();
    setUp();
    test(&sim_cm2600d);
}

/* ---- opening ------------------------------------------------------------------------ */

static void test_identity_of_700(void)
{
    connect(&sim_cm700d, "delays=0,serial=20012345,plate=A1234567,samples=2");
    OK(open_it());
    TEST_ASSERT_EQUAL_STRING("Konica Minolta", identity.maker);
    TEST_ASSERT_EQUAL_STRING("CM-700d", identity.model);
    TEST_ASSERT_EQUAL_STRING("20012345", identity.serial);
    TEST_ASSERT_EQUAL_STRING("A1234567", identity.white_tile);
    TEST_ASSERT_EQUAL_STRING("1.04", identity.firmware);
    TEST_ASSERT_EQUAL_size_t(31, identity.grid[0].n);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, identity.aperture_mm[0]); /* where the slider stands */
    TEST_ASSERT_TRUE(identity.has_user_calibration && identity.has_stored_samples);
}

static void test_identity_of_2600(void)
{
    connect(&sim_cm2600d, "delays=0,type=13");
    OK(open_it());
    TEST_ASSERT_EQUAL_STRING("CM-2500d", identity.model);
    TEST_ASSERT_EQUAL_DOUBLE(360.0, identity.grid[0].first_nm);
    TEST_ASSERT_EQUAL_size_t(39, identity.grid[0].n);
    TEST_ASSERT_FALSE(identity.has_user_calibration || identity.has_stored_samples);
    size_t n;
    EXPECT(DRIVER_UNSUPPORTED, km->stored_count(instrument, &n, &error));
    EXPECT(DRIVER_UNSUPPORTED, km->stored_read(instrument, 0, &reading, &error));
}

static void test_small_area_at_opening(void)
{
    connect(&sim_cm700d, "delays=0");
    act("slide 1");
    OK(open_it());
    TEST_ASSERT_EQUAL_DOUBLE(3.0, identity.aperture_mm[0]);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, identity.aperture_mm[1]);
    calibrate_it();
    OK(measure());
    TEST_ASSERT_EQUAL_DOUBLE(3.0, reading.sce.aperture_mm);
}

static void test_another_model_is_named(void)
{
    connect(&sim_cm700d, "delays=0,id=0777");
    EXPECT(DRIVER_UNSUPPORTED, open_it());
    expect_text("0777");
    connect(&sim_sp62, "delays=0");
    enum driver_result r = open_it();
    TEST_ASSERT_TRUE(r == DRIVER_PROTOCOL || r == DRIVER_TIMEOUT);
    wire_memory_free(wire.wire); /* it knows no "expect writes" of this kind */
    wire.wire = NULL;
}

static void test_asleep_at_opening(void)
{
    connect(&sim_cm700d, "delays=0,asleep=1");
    OK(open_it());
}

static void sleeps(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    act("sleep");
    OK(km->status(instrument, &status, &error));
}

static void test_asleep_later(void)
{
    both_models(sleeps);
}

static void test_serial_number_that_is_no_text(void)
{
    connect(&sim_cm700d, "delays=0,binary_serial=1");
    EXPECT(DRIVER_PROTOCOL, open_it());
}

static void test_clock_that_cannot_be_set(void)
{
    connect(&sim_cm700d, "delays=0");
    cue(&wire, "DTS", 1, "fault reply ER17");
    OK(open_it());
}

/* At the simulator's area numbering from 0 this driver's "small" would be the large one. */
static void test_areas_counted_from_0_are_refused(void)
{
    connect(&sim_cm700d, "delays=0,first_area=0");
    act("slide 1");
    EXPECT(DRIVER_PROTOCOL, open_it());
}

/* ---- measuring ---------------------------------------------------------------------- */

static void measures(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    for (int i = 0; i < 3; i++) {
        OK(measure());
        TEST_ASSERT_EQUAL_UINT(0, reading.warnings);
        check_truth(&reading);
    }
}

static void test_readings_are_true(void)
{
    both_models(measures);
}

static void test_without_dots(void)
{
    start(&sim_cm2600d, "delays=0,dot=0");
    OK(measure());
    check_truth(&reading);
}

/* Both models, the best of 20: what the driver itself takes, as the simulators take nothing. */
static void takes_little(const struct sim_kind *kind)
{
    double best_ms = 1e9;
    start(kind, "delays=0");
    for (int i = 0; i < 20; i++) {
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        OK(measure());
        clock_gettime(CLOCK_MONOTONIC, &b);
        best_ms = fmin(best_ms, (double)(b.tv_sec - a.tv_sec) * 1e3 +
                                    (double)(b.tv_nsec - a.tv_nsec) * 1e-6);
    }
    printf("%s: a reading takes %.3f ms beside the instrument's own time\n", kind->name, best_ms);
    TEST_ASSERT_TRUE(best_ms < 2.0);
}

static void test_a_reading_takes_no_time_of_its_own(void)
{
    both_models(takes_little);
}

static void warns(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    act("battery 1");
    act("lamp weak");
    OK(measure());
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_BATTERY_LOW | DRIVER_WARNING_LAMP_WEAK, reading.warnings);
    check_truth(&reading);
    OK(km->status(instrument, &status, &error));
    TEST_ASSERT_EQUAL_INT(15, status.battery_percent);
    act("battery 2");
    EXPECT(DRIVER_BATTERY, measure());
    TEST_ASSERT_EQUAL_STRING("ER02", error.code);
    act("charge");
    act("lamp ok");
    OK(measure());
    TEST_ASSERT_EQUAL_UINT(0, reading.warnings);
}

static void test_warnings_travel_with_data(void)
{
    both_models(warns);
}

static void test_recommended_calibration(void)
{
    start(&sim_cm700d, "delays=0");
    act("recalibrate 1");
    OK(measure());
    TEST_ASSERT_EQUAL_UINT(DRIVER_WARNING_CALIBRATION_OLD, reading.warnings);
    OK(km->status(instrument, &status, &error));
    TEST_ASSERT_FALSE(status.due[DRIVER_CALIBRATION_ZERO]);
    TEST_ASSERT_TRUE(status.due[DRIVER_CALIBRATION_WHITE]);
}

static void test_brighter_than_can_be_measured(void)
{
    start(&sim_cm700d, "delays=0");
    act("place bright");
    enum driver_result r = measure(); /* both spectra at their limit are one and the same */
    TEST_ASSERT_TRUE(r == DRIVER_PROTOCOL || (reading.warnings & DRIVER_WARNING_OVER_RANGE) != 0);
}

/* ---- settings ----------------------------------------------------------------------- */

static void test_slider(void)
{
    start(&sim_cm700d, "delays=0");
    struct driver_setup small = { .aperture = 1 };
    EXPECT(DRIVER_REFUSED, km->configure(instrument, &small, &error));
    expect_text("SAV (3 mm)");
    OK(measure()); /* all as it was */
    act("slide 1");
    EXPECT(DRIVER_REFUSED, measure());
    expect_text("MAV (8 mm)");
    OK(km->configure(instrument, &small, &error));
    EXPECT(DRIVER_REFUSED, measure()); /* not calibrated there */
    calibrate_it();
    OK(measure());
    TEST_ASSERT_EQUAL_DOUBLE(3.0, reading.sce.aperture_mm);
    check_truth(&reading);
}

static void test_averages_and_delay(void)
{
    start(&sim_cm700d, "delays=0");
    struct driver_setup setup = { .averages = 10, .delay_ms = 1950 };
    OK(km->configure(instrument, &setup, &error));
    OK(measure());
    check_truth(&reading);
    setup.averages = 11;
    EXPECT(DRIVER_UNSUPPORTED, km->configure(instrument, &setup, &error));
}

/* Somebody at the instrument's menu: a reset sets it as it was built. */
static void test_settings_changed_behind_our_back(void)
{
    start(&sim_cm700d, "delays=0");
    struct driver_setup setup = { .averages = 5 };
    OK(km->configure(instrument, &setup, &error));
    act("reset");
    EXPECT(DRIVER_REFUSED, measure()); /* the calibrations are gone, too */
    TEST_ASSERT_EQUAL_STRING("ER07", error.code);
    calibrate_it();
    OK(measure());
}

static void test_user_calibration(void)
{
    connect(&sim_cm700d, "delays=0,user=1");
    OK(open_it());
    struct driver_setup setup = { .user_calibration = true };
    OK(km->configure(instrument, &setup, &error));
    act("place black");
    OK(km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    OK(km->status(instrument, &status, &error));
    TEST_ASSERT_NOT_NULL(strstr(status.place[DRIVER_CALIBRATION_WHITE], "your own standard"));
    act("place user");
    OK(km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    act("place skin");
    OK(measure());
    check_truth(&reading);
}

static void test_user_calibration_without_data(void)
{
    start(&sim_cm700d, "delays=0");
    struct driver_setup setup = { .user_calibration = true };
    EXPECT(DRIVER_REFUSED, km->configure(instrument, &setup, &error));
    TEST_ASSERT_EQUAL_STRING("ER22", error.code);
    OK(measure());
}

/* ---- calibrating -------------------------------------------------------------------- */

static void swaps(const struct sim_kind *kind)
{
    connect(kind, "delays=0");
    OK(open_it());
    act("place white");
    EXPECT(DRIVER_IMPLAUSIBLE, km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    expect_text("swapped");
    act("place black");
    EXPECT(DRIVER_REFUSED, km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    OK(km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    EXPECT(DRIVER_IMPLAUSIBLE, km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    OK(km->status(instrument, &status, &error));
    TEST_ASSERT_TRUE(status.due[DRIVER_CALIBRATION_WHITE]);
}

static void test_white_and_black_swapped(void)
{
    both_models(swaps);
}

static void refuses_nonsense(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    const char *const faults[] = { "fault zero", "fault over from 1",     "fault negative",
                                   "fault text", "fault bands 30 from 1", "fault swapped from 1" };
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        act(faults[i]);
        memset(&reading, 0x77, sizeof reading);
        enum driver_result r = measure();
        if (r == DRIVER_OK) /* where the next readings agree */
            check_truth(&reading);
        else
            TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_IMPLAUSIBLE || r == DRIVER_PROTOCOL, faults[i]);
        if (strstr(faults[i], "from") != NULL)
            TEST_ASSERT_TRUE_MESSAGE(r != DRIVER_OK, faults[i]);
        act("fault none");
        OK(measure());
        check_truth(&reading);
    }
}

static void test_nonsense_is_refused(void)
{
    both_models(refuses_nonsense);
}

/* Neither family is known to write a sign: what has one is refused, and the cable is not all that
 * the operator is asked to look at. */
static void sees_less_than_nothing(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    act("fault negative from 1");
    EXPECT(DRIVER_PROTOCOL, measure());
    expect_text("under the port");
    act("fault none");
    OK(measure());
}

static void test_less_than_nothing_asks_what_is_there(void)
{
    both_models(sees_less_than_nothing);
}

/* ---- a shot that fails -------------------------------------------------------------- */

static void fails(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    act("fault lamp");
    EXPECT(DRIVER_FAULT, measure());
    TEST_ASSERT_EQUAL_STRING("ER05", error.code);
    OK(measure());
    act("fault calibration_lost");
    EXPECT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_STRING("ER07", error.code);
    calibrate_it();
    OK(measure());
    check_truth(&reading);
}

static void test_lamp_and_lost_calibration(void)
{
    both_models(fails);
}

static void test_no_data_after_a_shot(void)
{
    start(&sim_cm700d, "delays=0");
    act("fault battery_dies 50");
    EXPECT(DRIVER_REFUSED, measure());
    TEST_ASSERT_EQUAL_STRING("ER10", error.code);
    expect_text("battery");
}

static void test_battery_dies_in_a_shot(void)
{
    start(&sim_cm700d, "delays=0");
    act("battery 1");
    OK(km->status(instrument, &status, &error));
    act("fault battery_dies");
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_TIMEOUT, measure());
    int64_t took_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE(took_ms >= SHOT_MS && took_ms < SHOT_MS + 2000);
    expect_text("battery was low");
    EXPECT(DRIVER_TIMEOUT, measure());
    expect_text("switch it off and on");
    act("reset");
    act("charge");
    calibrate_it();
    OK(measure());
}

/* ---- the wire ----------------------------------------------------------------------- */

/* Every reply in two pieces, at every offset. */
static void splits(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    for (size_t k = 1; k < 250; k++) {
        wire_memory_split(wire.wire, k, 1);
        OK(measure());
        check_truth(&reading);
    }
}

static void test_replies_split_anywhere(void)
{
    both_models(splits);
}

static void disturbs(const struct sim_kind *kind)
{
    static const char *const commands[] = { "STR", "CPR", "MES", "MDR,1", "MDR,2" };
    static const char *const faults[] = {
        "fault late",         "fault delay 120",   "fault twice",     "fault garbage 40",
        "fault garbage 3000", "fault truncated 3", "fault longer 5",  "fault longer 3000",
        "fault silence",      "fault reply ER00",  "fault reply OK00"
    };
    start(kind, "delays=0");
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
                    check_truth(&reading);
                else
                    TEST_ASSERT_TRUE_MESSAGE(r == DRIVER_PROTOCOL || r == DRIVER_TIMEOUT, what);
                act("lightness 70");
            }
            act("fault none");
            wire.cue[0].on = 0;
            EXPECT(DRIVER_OK, measure());
            check_truth(&reading);
        }
}

/* Whatever becomes of a reply, the reading is true or refused, and the next ones are true. */
static void test_no_reply_is_taken_for_another(void)
{
    both_models(disturbs);
}

/* "No data" behind a damaged answer: nothing of that answer, nor of the one before, is taken. */
static void test_no_data_behind_a_damaged_answer(void)
{
    static const char *const faults[] = { "fault reply OK77,1,2,3", "fault garbage 20" };
    for (size_t i = 0; i < 2; i++) {
        start(&sim_cm700d, "delays=0");
        cue(&wire, "MDR,1", 1, faults[i]);
        cue(&wire, "MDR,1", 2, "fault reply ER10");
        cue(&wire, "MDR,1", 3, "fault reply ER10");
        EXPECT(DRIVER_REFUSED, measure());
        TEST_ASSERT_EQUAL_STRING("ER10", error.code);
        tearDown();
        setUp();
    }
}

static void test_another_program_on_the_port(void)
{
    start(&sim_cm700d, "delays=0");
    const char *const commands[] = { "CPR", "MES", "STR", "MDR,1" };
    for (size_t i = 0; i < 4; i++) {
        cue(&wire, commands[i], 1, "fault prober");
        OK(measure());
        check_truth(&reading);
    }
}

static void test_one_byte_each_100_ms(void)
{
    connect(&sim_cm2600d, "delays=0");
    OK(open_within(150));
    cue(&wire, "STR", 1, "fault slow 100");
    OK(km->status(instrument, &status, &error));
}

static void unplugs(const struct sim_kind *kind)
{
    static const size_t after[] = { 0, 1, 5, 40 };
    for (unsigned sends = 1; sends <= 8; sends++)
        for (size_t i = 0; i < 4; i++) {
            start(kind, "delays=0");
            wire_memory_unplug_at(wire.wire, sends, after[i]);
            enum driver_result r = measure();
            if (r != DRIVER_OK)
                EXPECT(DRIVER_GONE, r);
            km->close(instrument);
            instrument = NULL;
            wire_memory_unplug(wire.wire); /* where it was not reached */
            wire_memory_plug(wire.wire);
            OK(open_it());
            tearDown();
            setUp();
        }
}

static void test_unplugged_anywhere(void)
{
    both_models(unplugs);
}

static void test_unplugged_while_idle(void)
{
    start(&sim_cm700d, "delays=0");
    wire_memory_unplug(wire.wire);
    EXPECT(DRIVER_GONE, km->status(instrument, &status, &error));
    EXPECT(DRIVER_GONE, measure());
}

/* ---- the button --------------------------------------------------------------------- */

static void wait_for_press(bool expect)
{
    bool pressed = !expect;
    OK(km->wait_button(instrument, 0, &pressed, &error));
    TEST_ASSERT_EQUAL(expect, pressed);
}

static void presses(const struct sim_kind *kind, const char *options)
{
    start(kind, options);
    wait_for_press(false);
    act("press");
    wait_for_press(true);
    wait_for_press(false);
    act("press");
    act("press");
    wait_for_press(true); /* several are one */
    wait_for_press(false);
    OK(measure());
    check_truth(&reading);
    wait_for_press(false); /* our own shot is no press */
}

static void test_press_counts_once(void)
{
    presses(&sim_cm700d, "delays=0");
    tearDown();
    presses(&sim_cm700d, "delays=0,keep=stays");
    tearDown();
    presses(&sim_cm700d, "delays=0,notify=line");
    tearDown();
    presses(&sim_cm2600d, "delays=0");
}

static void *press_soon(void *argument)
{
    (void)argument;
    nanosleep(&(struct timespec){ .tv_nsec = 150 * 1000000 }, NULL);
    wire_memory_act(wire.wire, "press");
    wire_memory_act(wire.wire, "lightness 30"); /* another skin lies there afterwards */
    return NULL;
}

static void returns_pressed(const struct sim_kind *kind, const char *options)
{
    pthread_t thread;
    bool pressed = false;
    start(kind, options);
    double light = wire_memory_truth(wire.wire, 600.0, false);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, NULL));
    OK(km->wait_button(instrument, 3000, &pressed, &error));
    pthread_join(thread, NULL);
    TEST_ASSERT_TRUE(pressed);
    OK(measure());
    size_t band = spectrum_band(&reading.sce, 600.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, light, reading.sce.value[band]); /* the press's own */
    OK(measure());
    check_truth(&reading); /* a flash */
}

static void test_measure_returns_what_was_pressed(void)
{
    returns_pressed(&sim_cm700d, "delays=0");
    tearDown();
    returns_pressed(&sim_cm700d, "delays=0,keep=stays");
    tearDown();
    returns_pressed(&sim_cm700d, "delays=0,notify=line");
    tearDown();
    returns_pressed(&sim_cm2600d, "delays=0");
}

/* Who knows when that was. */
static void flashes(const struct sim_kind *kind)
{
    start(kind, "delays=0");
    act("press");
    act("lightness 30");
    wait_for_press(true);
    OK(measure());
    check_truth(&reading);
}

static void test_an_old_press_is_measured_anew(void)
{
    both_models(flashes);
}

/* The answer to a look comes when nobody waits for it any more. */
static void late_answers(const char *options, bool pressed_before)
{
    bool pressed = true;
    start(&sim_cm700d, options);
    if (pressed_before) {
        act("press");
        wait_for_press(true);
    }
    cue(&wire, "RDR", 1, "fault delay 250");
    OK(km->wait_button(instrument, 1800, &pressed, &error));
    TEST_ASSERT_FALSE(pressed);
    act("press");
    wait_for_press(true);
    OK(measure());
    check_truth(&reading);
}

static void test_a_late_answer_is_no_press(void)
{
    late_answers("delays=0", false);
    tearDown();
    setUp();
    late_answers("delays=0,keep=stays", true);
}

/* It may be told once only. */
static void test_a_press_that_is_told_late_counts(void)
{
    bool pressed = false;
    start(&sim_cm700d, "delays=0,keep=once");
    wait_for_press(false);
    act("press");
    cue(&wire, "RDR", 1, "fault delay 250");
    OK(km->wait_button(instrument, 1800, &pressed, &error));
    TEST_ASSERT_TRUE(pressed);
}

static void *cancel_soon(void *argument)
{
    (void)argument;
    nanosleep(&(struct timespec){ .tv_nsec = 100 * 1000000 }, NULL);
    km->cancel(instrument);
    return NULL;
}

/* The station ends a wait for each reading: that must not cost a way back into step. */
static void stays_in_step(const struct sim_kind *kind)
{
    pthread_t thread;
    bool pressed;
    start(kind, "delays=0");
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, NULL));
    EXPECT(DRIVER_CANCELLED, km->wait_button(instrument, 3000, &pressed, &error));
    pthread_join(thread, NULL);
    wire.never = "IDR";
    OK(measure());
    TEST_ASSERT_EQUAL_UINT(0, wire.forbidden);
    check_truth(&reading);
    wire.never = forbidden;
}

static void test_a_wait_that_is_cancelled_stays_in_step(void)
{
    both_models(stays_in_step);
}

/* In the middle of a look its answer is still to come. */
static void test_a_look_that_is_cancelled_does_not(void)
{
    pthread_t thread;
    bool pressed;
    start(&sim_cm700d, "delays=0");
    cue(&wire, "RDR", 1, "fault delay 130");
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, NULL));
    EXPECT(DRIVER_CANCELLED, km->wait_button(instrument, 3000, &pressed, &error));
    pthread_join(thread, NULL);
    OK(measure());
    check_truth(&reading);
}

/* ---- stored samples ----------------------------------------------------------------- */

static void test_stored_samples(void)
{
    size_t n;
    connect(&sim_cm700d, "delays=0,samples=3");
    OK(open_it());
    OK(km->stored_count(instrument, &n, &error));
    TEST_ASSERT_EQUAL_size_t(3, n);
    OK(km->stored_read(instrument, 2, &reading, &error));
    TEST_ASSERT_EQUAL_STRING("S0003", reading.sample);
    TEST_ASSERT_TRUE(reading.has_sce && reading.has_sci);
    EXPECT(DRIVER_REFUSED, km->stored_read(instrument, 3, &reading, &error));
}

/* Which `k` a sample with SCE alone is read by: programs differ, and the header says what it is. */
static void test_stored_sample_without_gloss_alone(void)
{
    connect(&sim_cm700d, "delays=0,samples=1");
    OK(open_it());
    OK(km->stored_read(instrument, 0, &other, &error));
    for (int i = 0; i < 2; i++) {
        cue(&wire, "SPR", 1, "fault reply OK00,2,2,0,2026,01,02,03,04,05,0, on 1");
        cue(&wire, "SPR", 2, "fault reply OK00,2,2,0,2026,01,02,03,04,05,0, on 1");
        if (i == 1) {
            cue(&wire, "SDR,00001,2", 1, "fault reply ER10");
            cue(&wire, "SDR,00001,2", 2, "fault reply ER10");
        }
        OK(km->stored_read(instrument, 0, &reading, &error));
        TEST_ASSERT_TRUE(reading.has_sce && !reading.has_sci);
        TEST_ASSERT_EQUAL_STRING("sample 1", reading.sample);
        TEST_ASSERT_EQUAL_MEMORY(i == 0 ? other.raw_sce : other.raw_sci, reading.raw_sce,
                                 31 * sizeof reading.raw_sce[0]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_identity_of_700);
    RUN_TEST(test_identity_of_2600);
    RUN_TEST(test_small_area_at_opening);
    RUN_TEST(test_another_model_is_named);
    RUN_TEST(test_asleep_at_opening);
    RUN_TEST(test_asleep_later);
    RUN_TEST(test_serial_number_that_is_no_text);
    RUN_TEST(test_clock_that_cannot_be_set);
    RUN_TEST(test_areas_counted_from_0_are_refused);
    RUN_TEST(test_readings_are_true);
    RUN_TEST(test_without_dots);
    RUN_TEST(test_a_reading_takes_no_time_of_its_own);
    RUN_TEST(test_warnings_travel_with_data);
    RUN_TEST(test_recommended_calibration);
    RUN_TEST(test_brighter_than_can_be_measured);
    RUN_TEST(test_slider);
    RUN_TEST(test_averages_and_delay);
    RUN_TEST(test_settings_changed_behind_our_back);
    RUN_TEST(test_user_calibration);
    RUN_TEST(test_user_calibration_without_data);
    RUN_TEST(test_white_and_black_swapped);
    RUN_TEST(test_nonsense_is_refused);
    RUN_TEST(test_less_than_nothing_asks_what_is_there);
    RUN_TEST(test_lamp_and_lost_calibration);
    RUN_TEST(test_no_data_after_a_shot);
    RUN_TEST(test_battery_dies_in_a_shot);
    RUN_TEST(test_replies_split_anywhere);
    RUN_TEST(test_no_reply_is_taken_for_another);
    RUN_TEST(test_no_data_behind_a_damaged_answer);
    RUN_TEST(test_another_program_on_the_port);
    RUN_TEST(test_one_byte_each_100_ms);
    RUN_TEST(test_unplugged_anywhere);
    RUN_TEST(test_unplugged_while_idle);
    RUN_TEST(test_press_counts_once);
    RUN_TEST(test_measure_returns_what_was_pressed);
    RUN_TEST(test_an_old_press_is_measured_anew);
    RUN_TEST(test_a_late_answer_is_no_press);
    RUN_TEST(test_a_press_that_is_told_late_counts);
    RUN_TEST(test_a_wait_that_is_cancelled_stays_in_step);
    RUN_TEST(test_a_look_that_is_cancelled_does_not);
    RUN_TEST(test_stored_samples);
    RUN_TEST(test_stored_sample_without_gloss_alone);
    return UNITY_END();
}
