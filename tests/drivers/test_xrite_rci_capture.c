/* test_xrite_rci_capture.c - the capture in drivers/xrite_rci/captures, replayed through the
 * driver: the readings are those of the simulator that it was made from, bit for bit; and nothing
 * was ever sent but the commands that the driver's list has.
 *
 * SKINSPEC_MAKE_CAPTURES=FOLDER makes it anew there. */
#include "drivers/xrite_rci/xrite_rci.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/link/capture.h"
#include "tests/drivers/cue.h"
#include "unity.h"

enum { SHOTS = 3 };

static const struct driver *const rci = &xrite_rci_driver;

struct session {
    struct driver_identity identity;
    struct driver_status before, after;
    struct driver_reading shot[SHOTS], press, stored;
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

/* Identity, calibration, three shots, a press and its reading. */
static void hold(const struct driver_options *options, struct session *s)
{
    struct instrument *in = NULL;
    memset(s, 0, sizeof *s);
    memset(&error, 0, sizeof error);
    OK(rci->open(options, &in, &s->identity, &error));
    OK(rci->status(in, &s->before, &error));
    OK(rci->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    OK(rci->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    OK(rci->status(in, &s->after, &error));
    for (int i = 0; i < SHOTS; i++)
        OK(rci->measure(in, &s->shot[i], &error));
    OK(rci->wait_button(in, 10000, &s->pressed, &error));
    OK(rci->measure(in, &s->press, &error));
    OK(rci->stored_read(in, 0, &s->stored, &error));
    rci->close(in);
}

static void hold_live(const struct sim_kind *kind, struct capture *capture)
{
    cued_wire_init(&wire,
                   wire_memory_make(kind, "delays=0.1,operator_ms=200,serial=007654,samples=1"));
    TEST_ASSERT_NOT_NULL(wire.wire);
    cue(&wire, "RM", 1, "place white"); /* the white step; the operator does the rest */
    cue(&wire, "RM", 2, "place skin");
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
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_create(path, "xrite_rci", &capture));
    capture_note(capture, "model: X-Rite SP62      firmware: not told");
    capture_note(capture, "by: the wire simulator %s", kind->name);
    capture_note(capture, "done: identified, calibrated, three shots, the button and its reading, "
                          "a stored sample");
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
    snprintf(address, sizeof address, "replay:drivers/xrite_rci/captures/%s.capture", kind->name);
    hold(&(struct driver_options){ .address = address }, &replayed);
    TEST_ASSERT_EQUAL_MEMORY(&live.identity, &replayed.identity, sizeof live.identity);
    TEST_ASSERT_TRUE(replayed.before.due[0] && replayed.before.due[1]);
    TEST_ASSERT_FALSE(replayed.after.due[0] || replayed.after.due[1]);
    TEST_ASSERT_TRUE(live.pressed && replayed.pressed);
    for (int i = 0; i < SHOTS; i++)
        check_reading(&live.shot[i], &replayed.shot[i]);
    check_reading(&live.press, &replayed.press);
    check_reading(&live.stored, &replayed.stored);
}

static void test_replays(void)
{
    replays(&sim_sp62);
}

/* expect: the commands that the descriptions give for reading, by hand */
static void test_nothing_else_was_sent(void)
{
    static const char *const allowed[] = {
        "\r\n",       "CE\r\n",     "0009CF\r\n", "0108CF\r\n", "0005CF\r\n", "0107CF\r\n",
        "0040CF\r\n", "0020CF\r\n", "014BCF\r\n", "00SN\r\n",   "10XD\r\n",   "01XD\r\n",
        "RM\r\n",     "0001GM\r\n", "0101GM\r\n", "00GM\r\n",   "1001GM\r\n", "1101GM\r\n",
    };
    struct capture_file file;
    size_t sent = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          capture_read("drivers/xrite_rci/captures/sp62.capture", &file));
    for (size_t i = 0; i < file.n; i++) {
        bool found = file.lines[i].kind != CAPTURE_SENT;
        sent += !found;
        for (size_t a = 0; !found && a < sizeof allowed / sizeof *allowed; a++)
            found = file.lines[i].n == strlen(allowed[a]) &&
                    memcmp(file.lines[i].bytes, allowed[a], file.lines[i].n) == 0;
        TEST_ASSERT_TRUE_MESSAGE(found, "another command");
    }
    TEST_ASSERT_TRUE(sent > 40);
    capture_free(&file);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_replays);
    RUN_TEST(test_nothing_else_was_sent);
    return UNITY_END();
}
