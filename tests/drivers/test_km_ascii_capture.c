/* test_km_ascii_capture.c - the captures in drivers/km_ascii/captures, replayed through the driver:
 * the readings are those of the simulator that they were made from, bit for bit.
 *
 * SKINSPEC_MAKE_CAPTURES=FOLDER makes them anew there. */
#include "drivers/km_ascii/km_ascii.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "drivers/link/capture.h"
#include "tests/drivers/cue.h"
#include "unity.h"

enum { SHOTS = 3 };

static const struct driver *const km = &km_ascii_driver;

struct session {
    struct driver_identity identity;
    struct driver_status before, after;
    struct driver_reading shot[SHOTS], press;
    bool pressed;
};
static struct session live, replayed;
static struct cued_wire wire;

void setUp(void)
{
}

void tearDown(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

static struct driver_error error;
#define OK(call) TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, (call), error.text)

static void *press_soon(void *argument)
{
    (void)argument;
    nanosleep(&(struct timespec){ .tv_nsec = 500 * 1000000 }, NULL);
    if (wire.wire != NULL)
        wire_memory_act(wire.wire, "press");
    return NULL;
}

/* Identity, calibration, three shots, a press and its reading. */
static void hold(const struct driver_options *options, struct session *s)
{
    struct instrument *in = NULL;
    pthread_t thread;
    memset(s, 0, sizeof *s);
    memset(&error, 0, sizeof error);
    OK(km->open(options, &in, &s->identity, &error));
    OK(km->status(in, &s->before, &error));
    OK(km->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    OK(km->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    OK(km->status(in, &s->after, &error));
    for (int i = 0; i < SHOTS; i++)
        OK(km->measure(in, &s->shot[i], &error));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, NULL));
    OK(km->wait_button(in, 10000, &s->pressed, &error));
    pthread_join(thread, NULL);
    OK(km->measure(in, &s->press, &error));
    km->close(in);
}

static void hold_live(const struct sim_kind *kind, struct capture *capture)
{
    cued_wire_init(&wire, wire_memory_make(kind, "delays=0.1,serial=70012345"));
    TEST_ASSERT_NOT_NULL(wire.wire);
    cue(&wire, "ZRC", CUE_ALWAYS, "place black");
    cue(&wire, "UZC", CUE_ALWAYS, "place black");
    cue(&wire, "CAL", CUE_ALWAYS, "place white");
    cue(&wire, "MES", CUE_ALWAYS, "place skin");
    hold(&(struct driver_options){ .address = "", .wire = &wire.source, .capture = capture },
         &live);
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

static void make_capture(const struct sim_kind *kind, const char *folder)
{
    char path[512];
    struct capture *capture;
    snprintf(path, sizeof path, "%s/%s.capture", folder, kind->name);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_create(path, "km_ascii", &capture));
    capture_note(capture, "model: %s      firmware: 1.04", kind->product);
    capture_note(capture, "by: the wire simulator %s", kind->name);
    capture_note(capture, "done: identified, calibrated, three shots, the button and its reading");
    capture_note(capture, "simulated, not seen on hardware");
    hold_live(kind, capture);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
}

static void check_reading(const struct driver_reading *expect, const struct driver_reading *r)
{
    TEST_ASSERT_EQUAL_MEMORY(expect->raw_sce, r->raw_sce, sizeof r->raw_sce);
    TEST_ASSERT_EQUAL_MEMORY(expect->raw_sci, r->raw_sci, sizeof r->raw_sci);
    TEST_ASSERT_EQUAL_MEMORY(expect->sce.value, r->sce.value, sizeof r->sce.value);
    TEST_ASSERT_EQUAL_MEMORY(expect->sci.value, r->sci.value, sizeof r->sci.value);
    TEST_ASSERT_EQUAL_UINT(expect->warnings, r->warnings);
}

static void replays(const struct sim_kind *kind)
{
    char address[128];
    const char *folder = getenv("SKINSPEC_MAKE_CAPTURES");
    if (folder != NULL)
        make_capture(kind, folder);
    hold_live(kind, NULL);
    snprintf(address, sizeof address, "replay:drivers/km_ascii/captures/%s.capture", kind->name);
    hold(&(struct driver_options){ .address = address }, &replayed);
    TEST_ASSERT_EQUAL_MEMORY(&live.identity, &replayed.identity, sizeof live.identity);
    TEST_ASSERT_TRUE(replayed.before.due[0] && replayed.before.due[1]);
    TEST_ASSERT_FALSE(replayed.after.due[0] || replayed.after.due[1]);
    TEST_ASSERT_TRUE(live.pressed && replayed.pressed);
    for (int i = 0; i < SHOTS; i++)
        check_reading(&live.shot[i], &replayed.shot[i]);
    check_reading(&live.press, &replayed.press);
}

static void test_700_replays(void)
{
    replays(&sim_cm700d);
}

static void test_2600_replays(void)
{
    replays(&sim_cm2600d);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_700_replays);
    RUN_TEST(test_2600_replays);
    return UNITY_END();
}
