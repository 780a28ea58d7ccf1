/* capture_case.c - one session twice: with the simulator, and out of a file. */
#include "tests/drivers/capture_case.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "unity.h"

enum { PRESS_AFTER_MS = 500, BUTTON_MS = 10000 };

static struct cued_wire wire;
static struct driver_error error;
#define OK(call) TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, (call), error.text)

void capture_case_tear_down(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

/* ---- a session ---------------------------------------------------------------------- */

static void *press_soon(void *argument)
{
    (void)argument;
    nanosleep(&(struct timespec){ .tv_nsec = PRESS_AFTER_MS * 1000000L }, NULL);
    wire_memory_act(wire.wire, "press");
    return NULL;
}

static void wait_for_press(const struct capture_case *c, struct instrument *in, bool *pressed)
{
    pthread_t thread;
    bool press = c->press && wire.wire != NULL;         /* a capture has its own */
    OK(c->driver->wait_button(in, 0, pressed, &error)); /* as a station does: forget what was */
    TEST_ASSERT_FALSE(*pressed);
    if (press)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, press_soon, NULL));
    enum driver_result r = c->driver->wait_button(in, BUTTON_MS, pressed, &error);
    if (press)
        pthread_join(thread, NULL);
    OK(r);
}

void capture_case_hold(const struct capture_case *c, const struct driver_options *options,
                       struct capture_session *ret)
{
    const struct driver *driver = c->driver;
    struct instrument *in = NULL;
    memset(ret, 0, sizeof *ret);
    memset(&error, 0, sizeof error);
    OK(driver->open(options, &in, &ret->identity, &error));
    OK(driver->status(in, &ret->before, &error));
    OK(driver->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    OK(driver->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    OK(driver->status(in, &ret->after, &error));
    for (int i = 0; i < CAPTURE_CASE_SHOTS; i++)
        OK(driver->measure(in, &ret->shot[i], &error));
    wait_for_press(c, in, &ret->pressed);
    OK(driver->measure(in, &ret->press, &error));
    if (c->stored)
        OK(driver->stored_read(in, 0, &ret->stored, &error));
    driver->close(in);
}

void capture_case_hold_live(const struct capture_case *c, struct capture *capture,
                            struct capture_session *ret)
{
    cued_wire_init(&wire, wire_memory_make(c->kind, c->options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    if (c->cue != NULL)
        c->cue(&wire);
    capture_case_hold(
        c, &(struct driver_options){ .address = "", .wire = &wire.source, .capture = capture },
        ret);
    capture_case_tear_down();
}

/* ---- both --------------------------------------------------------------------------- */

static void check_reading(const struct driver_reading *expect, const struct driver_reading *r)
{
    TEST_ASSERT_EQUAL_MEMORY(expect->raw_sce, r->raw_sce, sizeof r->raw_sce);
    TEST_ASSERT_EQUAL_MEMORY(expect->raw_sci, r->raw_sci, sizeof r->raw_sci);
    TEST_ASSERT_EQUAL_MEMORY(expect->sce.value, r->sce.value, sizeof r->sce.value);
    TEST_ASSERT_EQUAL_MEMORY(expect->sci.value, r->sci.value, sizeof r->sci.value);
    TEST_ASSERT_EQUAL_UINT(expect->warnings, r->warnings);
}

void capture_case_replays(const struct capture_case *c)
{
    static struct capture_session live, replayed;
    char address[256];
    capture_case_hold_live(c, NULL, &live);
    snprintf(address, sizeof address, "replay:%s", c->path);
    capture_case_hold(c, &(struct driver_options){ .address = address }, &replayed);
    TEST_ASSERT_EQUAL_MEMORY(&live.identity, &replayed.identity, sizeof live.identity);
    TEST_ASSERT_TRUE(replayed.before.due[0] && replayed.before.due[1]);
    TEST_ASSERT_FALSE(replayed.after.due[0] || replayed.after.due[1]);
    TEST_ASSERT_TRUE(live.pressed && replayed.pressed);
    for (int i = 0; i < CAPTURE_CASE_SHOTS; i++)
        check_reading(&live.shot[i], &replayed.shot[i]);
    check_reading(&live.press, &replayed.press);
    check_reading(&live.stored, &replayed.stored);
}
