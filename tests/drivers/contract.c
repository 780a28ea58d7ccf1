/* contract.c - one suite for all drivers; drivers/driver.h is where its claims come
 * from, but for limits of time, which stand here. */
#include "tests/drivers/contract.h"

#include <dirent.h>
#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "drivers/call.h"
#include "tests/support/patience.h"
#include "unity.h"

/* Reply timeout of the tests, and what a busy machine may add to any wait. */
enum { REPLY_MS = 150 };
/* driver.h: "within 200 ms"; instruments that wait for somebody take minutes. */
#define CANCEL_MS patience_ms(200)

static const struct contract_fixture *fixture;
static const struct driver *driver;
static struct instrument *instrument;
static struct driver_identity identity;
static struct driver_error error;
static struct driver_reading reading, other;

void contract_set_up(void)
{
    instrument = NULL;
}

void contract_tear_down(void)
{
    driver->close(instrument);
    instrument = NULL;
    fixture->tear_down();
}

/* ---- helpers ----------------------------------------------------------------------- */

/* A text that ends, and says something. */
static bool is_text(const char *text, size_t size)
{
    size_t length = strnlen(text, size);
    return length > 0 && length < size;
}

/* The call must have ended with `expect` and, if that is a failure, told why. */
#define EXPECT(expect, call) \
    do { \
        memset(&error, 0x55, sizeof error); \
        enum driver_result result_ = (call); \
        check_result(__LINE__, expect, result_); \
    } while (0)

static void check_result(int line, enum driver_result expect, enum driver_result result)
{
    char message[DRIVER_TEXT_SIZE + 64];
    bool told = result != DRIVER_OK && is_text(error.text, sizeof error.text);
    snprintf(message, sizeof message, "line %d: expected %s, not %s (%s)", line,
             driver_result_name(expect), driver_result_name(result), told ? error.text : "");
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, result, message);
    if (result == DRIVER_OK)
        return;
    TEST_ASSERT_EQUAL_INT_MESSAGE(result, error.result, "error.result");
    TEST_ASSERT_TRUE_MESSAGE(told, "error.text");
    TEST_ASSERT_TRUE_MESSAGE(strnlen(error.code, sizeof error.code) < sizeof error.code,
                             "error.code");
}

static enum driver_result open_in(enum contract_situation situation, struct instrument **ret)
{
    struct driver_options options = { .reply_timeout_ms = REPLY_MS, .open_timeout_ms = 2000 };
    options.address = fixture->set_up(situation);
    if (options.address == NULL)
        TEST_IGNORE_MESSAGE("this situation cannot be had");
    if (fixture->wire != NULL)
        options.wire = fixture->wire();
    if (situation == CONTRACT_SILENT)
        options.open_timeout_ms = REPLY_MS;
    return driver->open(&options, ret, &identity, &error);
}

static void open_it(enum contract_situation situation)
{
    EXPECT(DRIVER_OK, open_in(situation, &instrument));
}

static void calibrate_it(void)
{
    EXPECT(DRIVER_OK, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    EXPECT(DRIVER_OK, driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
}

static bool all_bytes_are(unsigned char byte, const void *at, size_t size)
{
    const unsigned char *bytes = at;
    for (size_t i = 0; i < size; i++)
        if (bytes[i] != byte)
            return false;
    return true;
}

/* ---- opening ----------------------------------------------------------------------- */

static void test_table(void)
{
    TEST_ASSERT_TRUE(strlen(driver->name) > 0 && strlen(driver->description) > 0);
    TEST_ASSERT_TRUE(strspn(driver->name, "abcdefghijklmnopqrstuvwxyz0123456789_") ==
                     strlen(driver->name));
    TEST_ASSERT_TRUE(driver->open != NULL && driver->close != NULL && driver->cancel != NULL);
    TEST_ASSERT_TRUE(driver->configure != NULL && driver->status != NULL);
    TEST_ASSERT_TRUE(driver->calibrate != NULL && driver->measure != NULL);
    TEST_ASSERT_EQUAL_INT(driver->stored_count != NULL, driver->stored_read != NULL);
}

static void test_identity(void)
{
    open_it(CONTRACT_SOUND);
    TEST_ASSERT_TRUE(is_text(identity.maker, sizeof identity.maker));
    TEST_ASSERT_TRUE(is_text(identity.model, sizeof identity.model));
    TEST_ASSERT_TRUE(strnlen(identity.serial, DRIVER_NAME_SIZE) < DRIVER_NAME_SIZE);
    TEST_ASSERT_TRUE(strnlen(identity.firmware, DRIVER_NAME_SIZE) < DRIVER_NAME_SIZE);
    TEST_ASSERT_TRUE(strnlen(identity.white_tile, DRIVER_NAME_SIZE) < DRIVER_NAME_SIZE);
    TEST_ASSERT_NOT_EQUAL(0, strcmp("unknown", driver_geometry_name(identity.geometry)));
    TEST_ASSERT_TRUE(identity.has_sce || identity.has_sci);
    TEST_ASSERT_TRUE(!identity.has_button || driver->wait_button != NULL);
    TEST_ASSERT_TRUE(!identity.has_stored_samples || driver->stored_read != NULL);

    TEST_ASSERT_TRUE(identity.grids >= 1 && identity.grids <= DRIVER_MAX_GRIDS);
    for (size_t i = 0; i < identity.grids; i++) {
        const struct driver_grid *g = &identity.grid[i];
        TEST_ASSERT_TRUE(g->n >= 2 && g->n <= SPECTRUM_MAX_BANDS && g->step_nm > 0.0);
        TEST_ASSERT_TRUE(g->first_nm >= 250.0);
        TEST_ASSERT_TRUE(g->first_nm + (double)(g->n - 1) * g->step_nm <= 1100.0);
    }
    TEST_ASSERT_TRUE(identity.apertures >= 1 && identity.apertures <= DRIVER_MAX_APERTURES);
    for (size_t i = 0; i < identity.apertures; i++)
        TEST_ASSERT_TRUE(identity.aperture_mm[i] > 0.0 && identity.aperture_mm[i] < 100.0);
}

static void test_close_takes_null(void)
{
    driver->close(NULL);
}

static void test_open_that_fails_touches_nothing(void)
{
    struct instrument *untouched = (struct instrument *)&error;
    int64_t began_ms = call_now_ms();
    memset(&identity, 0x77, sizeof identity);
    EXPECT(DRIVER_TIMEOUT, open_in(CONTRACT_SILENT, &untouched));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= REPLY_MS + SLACK_MS);
    TEST_ASSERT_EQUAL_PTR(&error, untouched);
    TEST_ASSERT_TRUE(all_bytes_are(0x77, &identity, sizeof identity));
}

static size_t open_descriptors(void)
{
    size_t n = 0;
    DIR *d = opendir("/proc/self/fd");
    TEST_ASSERT_NOT_NULL(d);
    while (readdir(d) != NULL)
        n++;
    closedir(d);
    return n;
}

static void test_fifty_openings_leak_no_descriptor(void)
{
    open_it(CONTRACT_SOUND); /* what is made once, at the first, is no leak */
    driver->close(instrument);
    instrument = NULL;
    fixture->tear_down();
    size_t before = open_descriptors();
    for (int i = 0; i < 50; i++) {
        open_it(CONTRACT_SOUND);
        if (i % 2 == 0)
            calibrate_it();
        driver->close(instrument);
        instrument = NULL;
        fixture->tear_down();
    }
    TEST_ASSERT_EQUAL_size_t(before, open_descriptors());
}

/* ---- setting and calibrating ----------------------------------------------------------- */

static void test_configure_within_bounds_only(void)
{
    open_it(CONTRACT_SOUND);
    const struct driver_setup beyond[] = {
        { .grid = identity.grids },
        { .aperture = identity.apertures },
        { .grid = SIZE_MAX, .aperture = SIZE_MAX },
        { .averages = (identity.max_averages > 1 ? identity.max_averages : 1) + 1 },
        { .averages = UINT_MAX },
        { .delay_ms = -1 },
        { .delay_ms = identity.max_delay_ms + 1 },
        { .user_calibration = true },
    };
    size_t n = sizeof beyond / sizeof *beyond - (identity.has_user_calibration ? 1 : 0);
    for (size_t i = 0; i < n; i++)
        EXPECT(DRIVER_UNSUPPORTED, driver->configure(instrument, &beyond[i], &error));
    /* Any slider that has to be moved by hand stands at aperture 0. */
    for (size_t i = 0; i < identity.grids; i++)
        EXPECT(DRIVER_OK,
               driver->configure(instrument, &(struct driver_setup){ .grid = i }, &error));
}

static void check_places(const bool due[DRIVER_CALIBRATIONS])
{
    static struct driver_status status;
    memset(&status, 0x55, sizeof status);
    EXPECT(DRIVER_OK, driver->status(instrument, &status, &error));
    for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++) {
        const char *name = driver_calibration_name((enum driver_calibration)i);
        TEST_ASSERT_EQUAL_INT_MESSAGE(due[i], status.due[i], name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(due[i], is_text(status.place[i], DRIVER_TEXT_SIZE), name);
    }
    TEST_ASSERT_TRUE(status.battery_percent >= -1 && status.battery_percent <= 100);
    TEST_ASSERT_EQUAL_INT(identity.has_battery, status.battery_percent >= 0);
    TEST_ASSERT_TRUE(isnan(status.temperature_C) || fabs(status.temperature_C) < 100.0);
}

static void test_calibration_from_step_to_step(void)
{
    open_it(CONTRACT_SOUND);
    memset(&reading, 0x77, sizeof reading);
    check_places((const bool[]){ true, true });
    EXPECT(DRIVER_REFUSED, driver->measure(instrument, &reading, &error));
    EXPECT(DRIVER_REFUSED, driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    check_places((const bool[]){ true, true });
    EXPECT(DRIVER_OK, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    check_places((const bool[]){ false, true });
    EXPECT(DRIVER_REFUSED, driver->measure(instrument, &reading, &error));
    TEST_ASSERT_TRUE(all_bytes_are(0x77, &reading, sizeof reading));
    EXPECT(DRIVER_OK, driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    check_places((const bool[]){ false, false });
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
}

static void test_no_other_calibration(void)
{
    open_it(CONTRACT_SOUND);
    EXPECT(DRIVER_UNSUPPORTED, driver->calibrate(instrument, DRIVER_CALIBRATIONS, &error));
}

static void test_calibration_ends_with_power(void)
{
    open_it(CONTRACT_SOUND);
    calibrate_it();
    contract_tear_down();
    open_it(CONTRACT_SOUND);
    check_places((const bool[]){ true, true });
}

/* ---- measuring ------------------------------------------------------------------------ */

static void check_spectrum(const struct spectrum *s, enum specular specular, size_t grid,
                           size_t aperture, const int32_t *raw, double raw_unit)
{
    const struct driver_grid *g = &identity.grid[grid];
    TEST_ASSERT_EQUAL_INT(specular, s->specular);
    TEST_ASSERT_EQUAL_DOUBLE(identity.aperture_mm[aperture], s->aperture_mm);
    TEST_ASSERT_EQUAL_DOUBLE(g->first_nm, s->first_nm);
    TEST_ASSERT_EQUAL_DOUBLE(g->step_nm, s->step_nm);
    TEST_ASSERT_EQUAL_size_t(g->n, s->n);
    for (size_t i = 0; i < s->n; i++) {
        TEST_ASSERT_TRUE(isfinite(s->value[i]) && s->value[i] >= 0.0 && s->value[i] <= 1.2);
        if (raw_unit > 0.0)
            TEST_ASSERT_TRUE(s->value[i] == raw[i] * raw_unit);
    }
}

static void check_reading(const struct driver_reading *r, size_t grid, size_t aperture)
{
    TEST_ASSERT_EQUAL_INT(identity.has_sce, r->has_sce);
    TEST_ASSERT_EQUAL_INT(identity.has_sci, r->has_sci);
    TEST_ASSERT_TRUE(r->raw_unit >= 0.0);
    TEST_ASSERT_EQUAL_UINT(0, r->warnings >> DRIVER_WARNINGS);
    if (r->has_sce)
        check_spectrum(&r->sce, SPECULAR_SCE, grid, aperture, r->raw_sce, r->raw_unit);
    if (r->has_sci)
        check_spectrum(&r->sci, SPECULAR_SCI, grid, aperture, r->raw_sci, r->raw_unit);
    for (size_t i = 0; r->has_sce && r->has_sci && i < r->sce.n; i++)
        TEST_ASSERT_TRUE(r->sci.value[i] >= r->sce.value[i]);
}

static void test_readings_are_sound(void)
{
    open_it(CONTRACT_SOUND);
    for (size_t grid = 0; grid < identity.grids; grid++) {
        struct driver_setup setup = { .grid = grid };
        EXPECT(DRIVER_OK, driver->configure(instrument, &setup, &error));
        calibrate_it();
        for (int shot = 0; shot < 3; shot++) {
            memset(&reading, 0x55, sizeof reading);
            EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
            check_reading(&reading, grid, 0);
            TEST_ASSERT_EQUAL_STRING("", reading.sample);
        }
    }
}

static void test_same_instrument_same_numbers(void)
{
    if (!fixture->deterministic)
        TEST_IGNORE_MESSAGE("nothing measured is ever quite the same");
    open_it(CONTRACT_SOUND);
    calibrate_it();
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    contract_tear_down();
    open_it(CONTRACT_SOUND);
    calibrate_it();
    EXPECT(DRIVER_OK, driver->measure(instrument, &other, &error));
    TEST_ASSERT_EQUAL_MEMORY(reading.raw_sce, other.raw_sce, sizeof reading.raw_sce);
    TEST_ASSERT_EQUAL_MEMORY(reading.raw_sci, other.raw_sci, sizeof reading.raw_sci);
    TEST_ASSERT_EQUAL_MEMORY(reading.sce.value, other.sce.value, sizeof reading.sce.value);
}

static void test_stored_samples(void)
{
    size_t n = SIZE_MAX;
    open_it(CONTRACT_SOUND);
    if (!identity.has_stored_samples)
        TEST_IGNORE_MESSAGE("has none");
    EXPECT(DRIVER_OK, driver->stored_count(instrument, &n, &error));
    TEST_ASSERT_TRUE(n >= 1 && n < 100000);
    EXPECT(DRIVER_OK, driver->stored_read(instrument, 0, &reading, &error));
    TEST_ASSERT_TRUE(is_text(reading.sample, sizeof reading.sample));
    EXPECT(DRIVER_OK, driver->stored_read(instrument, n - 1, &reading, &error));
    check_reading(&reading, 0, 0);
    memset(&reading, 0x77, sizeof reading);
    EXPECT(DRIVER_REFUSED, driver->stored_read(instrument, n, &reading, &error));
    TEST_ASSERT_TRUE(all_bytes_are(0x77, &reading, sizeof reading));
}

static void test_button_that_nobody_presses(void)
{
    bool pressed = true;
    open_it(CONTRACT_SOUND);
    if (!identity.has_button)
        TEST_IGNORE_MESSAGE("has none");
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_OK, driver->wait_button(instrument, 120, &pressed, &error));
    TEST_ASSERT_FALSE(pressed);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 120);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= 120 + REPLY_MS + SLACK_MS);
}

/* ---- waiting ------------------------------------------------------------------------------ */

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000 }, NULL);
}

/* Cancels some time after it is started, and notes when. */
static long cancel_after_ms;
static void *cancel_soon(void *at_ms)
{
    sleep_ms(cancel_after_ms);
    *(int64_t *)at_ms = call_now_ms();
    driver->cancel(instrument);
    return NULL;
}

/* Make the call with a cancellation on its way; ms from cancelling to its return. */
static int64_t cancelled_after_ms(enum driver_result (*make_call)(void), long after_ms)
{
    pthread_t thread;
    int64_t at_ms = 0;
    cancel_after_ms = after_ms;
    memset(&error, 0x55, sizeof error);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, &at_ms));
    enum driver_result result = make_call();
    int64_t ended_ms = call_now_ms();
    pthread_join(thread, NULL);
    check_result(__LINE__, DRIVER_CANCELLED, result);
    return ended_ms - at_ms;
}

static enum driver_result call_measure(void)
{
    return driver->measure(instrument, &reading, &error);
}

static enum driver_result call_calibrate(void)
{
    return driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error);
}

static enum driver_result call_wait_button(void)
{
    bool pressed;
    return driver->wait_button(instrument, 60000, &pressed, &error);
}

static void test_cancel_a_calibration(void)
{
    bool pressed;
    open_it(CONTRACT_TAKES_TIME);
    TEST_ASSERT_TRUE(cancelled_after_ms(call_calibrate, 100) <= CANCEL_MS);
    if (identity.has_button) /* what ended one call does not end the next, not even this */
        EXPECT(DRIVER_OK, driver->wait_button(instrument, 0, &pressed, &error));
    calibrate_it();
}

static void test_cancel_a_shot(void)
{
    open_it(CONTRACT_TAKES_TIME);
    calibrate_it();
    memset(&reading, 0x77, sizeof reading);
    TEST_ASSERT_TRUE(cancelled_after_ms(call_measure, 100) <= CANCEL_MS);
    TEST_ASSERT_TRUE(all_bytes_are(0x77, &reading, sizeof reading));
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    check_reading(&reading, 0, 0);
}

/* The answer to a shot that was cancelled half way is not the next one's: that takes its time. */
static void test_cancelled_shot_is_not_the_next(void)
{
    open_it(CONTRACT_TAKES_TIME);
    calibrate_it();
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    int64_t shot_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE_MESSAGE(shot_ms >= 500, "a shot has to take half a second here");
    TEST_ASSERT_TRUE(cancelled_after_ms(call_measure, (long)shot_ms / 2) <= CANCEL_MS);
    began_ms = call_now_ms();
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    int64_t took_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE_MESSAGE(took_ms >= shot_ms * 3 / 4, "a late answer was taken for this shot's");
}

static void test_cancel_a_wait_for_the_button(void)
{
    bool pressed;
    open_it(CONTRACT_SOUND);
    if (!identity.has_button)
        TEST_IGNORE_MESSAGE("has none");
    TEST_ASSERT_TRUE(cancelled_after_ms(call_wait_button, 100) <= CANCEL_MS);
    EXPECT(DRIVER_OK, driver->wait_button(instrument, 0, &pressed, &error));
}

/* But for the wait, which may be about to begin: it ends at once, and the next is a new one. */
static void test_cancel_before_a_wait_for_the_button(void)
{
    bool pressed;
    open_it(CONTRACT_SOUND);
    if (!identity.has_button)
        TEST_IGNORE_MESSAGE("has none");
    driver->cancel(instrument);
    driver->cancel(instrument);
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_CANCELLED, driver->wait_button(instrument, 60000, &pressed, &error));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= CANCEL_MS);
    EXPECT(DRIVER_OK, driver->wait_button(instrument, 50, &pressed, &error));
    driver->cancel(instrument);
    calibrate_it();
    EXPECT(DRIVER_OK, driver->wait_button(instrument, 50, &pressed, &error));
}

static void *press_soon(void *done)
{
    sleep_ms(150);
    *(bool *)done = fixture->act("press") && fixture->act("lightness 30");
    return NULL;
}

static double largest_difference(const struct spectrum *a, const struct spectrum *b)
{
    double largest = 0.0;
    for (size_t i = 0; i < a->n; i++)
        largest = fmax(largest, fabs(a->value[i] - b->value[i]));
    return largest;
}

/* One press, one flash, and its spectrum, though another skin lies there by now. */
static void test_reading_of_a_press(void)
{
    pthread_t thread;
    bool pressed = true, done = false;
    open_it(CONTRACT_SOUND);
    if (!identity.has_button || fixture->act == NULL)
        TEST_IGNORE_MESSAGE("a press makes no shot");
    calibrate_it();
    TEST_ASSERT_TRUE(fixture->act("count shots"));
    EXPECT(DRIVER_OK, driver->measure(instrument, &other, &error));
    EXPECT(DRIVER_OK, driver->wait_button(instrument, 0, &pressed, &error));
    TEST_ASSERT_FALSE(pressed);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, &done));
    enum driver_result result = driver->wait_button(instrument, 60000, &pressed, &error);
    pthread_join(thread, NULL);
    check_result(__LINE__, DRIVER_OK, result);
    TEST_ASSERT_TRUE(done && pressed);
    EXPECT(DRIVER_OK, driver->status(instrument, &(struct driver_status){ .due = { false } },
                                     &error)); /* it keeps the press */
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    check_reading(&reading, 0, 0);
    TEST_ASSERT_TRUE_MESSAGE(fixture->act("expect shots 2"), "it has flashed again");
    TEST_ASSERT_TRUE(largest_difference(&other.sce, &reading.sce) < 0.01);
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error)); /* a shot of its own */
    TEST_ASSERT_TRUE(fixture->act("expect shots 3"));
    TEST_ASSERT_TRUE(largest_difference(&other.sce, &reading.sce) > 0.05);
}

/* A cancellation that finds no call must not lie in wait for the next. */
static void test_cancel_between_calls_does_nothing(void)
{
    open_it(CONTRACT_SOUND);
    driver->cancel(instrument);
    calibrate_it();
    driver->cancel(instrument);
    driver->cancel(instrument);
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
}

static void test_silence_ends_at_the_deadline(void)
{
    open_it(CONTRACT_FALLS_SILENT);
    calibrate_it();
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    memset(&reading, 0x77, sizeof reading);
    int64_t began_ms = call_now_ms();
    EXPECT(DRIVER_TIMEOUT, driver->measure(instrument, &reading, &error));
    int64_t took_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE(took_ms >= REPLY_MS);
    TEST_ASSERT_TRUE(took_ms <= REPLY_MS + fixture->shot_ms + SLACK_MS);
    TEST_ASSERT_TRUE(all_bytes_are(0x77, &reading, sizeof reading));
    EXPECT(DRIVER_OK, driver->measure(instrument, &reading, &error));
    check_reading(&reading, 0, 0);
}

/* ---- all of it ------------------------------------------------------------------------------ */

static const struct contract_test {
    const char *name;
    void (*run)(void);
} tests[] = {
    { "table", test_table },
    { "identity", test_identity },
    { "close takes NULL", test_close_takes_null },
    { "an open that fails touches nothing", test_open_that_fails_touches_nothing },
    { "fifty openings leak no descriptor", test_fifty_openings_leak_no_descriptor },
    { "configure within bounds only", test_configure_within_bounds_only },
    { "calibration from step to step", test_calibration_from_step_to_step },
    { "no other calibration", test_no_other_calibration },
    { "calibration ends with power", test_calibration_ends_with_power },
    { "readings are sound", test_readings_are_sound },
    { "same instrument, same numbers", test_same_instrument_same_numbers },
    { "stored samples", test_stored_samples },
    { "a button that nobody presses", test_button_that_nobody_presses },
    { "cancel a calibration", test_cancel_a_calibration },
    { "cancel a shot", test_cancel_a_shot },
    { "a cancelled shot is not the next", test_cancelled_shot_is_not_the_next },
    { "cancel a wait for the button", test_cancel_a_wait_for_the_button },
    { "cancel before a wait for the button", test_cancel_before_a_wait_for_the_button },
    { "reading of a press", test_reading_of_a_press },
    { "cancel between calls does nothing", test_cancel_between_calls_does_nothing },
    { "silence ends at the deadline", test_silence_ends_at_the_deadline },
};

static void run(const struct contract_fixture *of)
{
    fixture = of;
    driver = of->driver;
    for (size_t i = 0; i < sizeof tests / sizeof *tests; i++) {
        char name[128]; /* Unity shows the name while the test runs, not later */
        snprintf(name, sizeof name, "%s: %s", driver->name, tests[i].name);
        UnityDefaultTestRun(tests[i].run, name, __LINE__);
    }
}

int contract_main(const struct contract_fixture *fixtures, size_t n)
{
    UNITY_BEGIN();
    for (size_t i = 0; i < n; i++)
        run(&fixtures[i]);
    return UNITY_END();
}
