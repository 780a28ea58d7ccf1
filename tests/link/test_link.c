/* test_link.c - what an address means, what is recorded, and that a record replays. */
#include "drivers/link/kinds.h"

#include <string.h>
#include <time.h>
#include <unistd.h>

#include "tests/link/script.h"
#include "tests/support/folder.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct call call;
static struct link *wire;
static struct driver_error error;
static char bytes[64];
static size_t n;

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "a.capture", path);
}

void tearDown(void)
{
    folder_remove(folder);
    call_done(&call);
}

/* ---- pauses ------------------------------------------------------------------------- */

static void test_a_pause_ends_in_time_or_cancelled(void)
{
    struct link link = { .call = &call };
    call_begin(&call);
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_pause(&link, began_ms + 20, &error));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 20);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_pause(&link, 0, &error));
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, link_pause(&link, INT64_MAX, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, link_pause(&link, 0, &error)); /* the call stays so */
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, error.result);
}

/* ---- addresses ---------------------------------------------------------------------- */

static void test_addresses_of_no_use(void)
{
    static const struct link_serial serial = { 9600, false };
    static const struct link_usb_model models[] = { { 0x2457, 0x101e }, { 0, 0 } };
    static const struct link_usb usb = { .models = models };
    static const struct {
        const char *address;
        const struct link_serial *serial;
        const struct link_usb *usb;
        enum driver_result result;
        const char *says;
    } cases[] = {
        { "", &serial, &usb, DRIVER_UNSUPPORTED, "no address" },
        { "ttyACM0", &serial, &usb, DRIVER_UNSUPPORTED, "no address" },
        { "usbx", &serial, &usb, DRIVER_UNSUPPORTED, "no address" },
        { "/dev/ttyACM0", NULL, &usb, DRIVER_UNSUPPORTED, "a USB device" },
        { "usb", &serial, NULL, DRIVER_UNSUPPORTED, "a serial port" },
        { "usb:", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:1", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:001:000", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:001:005x", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb: 457:101e", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:0000:101e", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:2457-101e", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:1:-5", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:2457:101g", NULL, &usb, DRIVER_UNSUPPORTED, "usb:VID:PID" },
        { "usb:046d:c52b", NULL, &usb, DRIVER_UNSUPPORTED, "no instrument of this driver" },
        { "usb:2457:101e", NULL, &usb, DRIVER_GONE, "connect it" },
        { "usb", NULL, &usb, DRIVER_GONE, "connect it" },
        { "/dev/ttySKINSPEC", &serial, NULL, DRIVER_GONE, "/dev/serial/by-id" },
        { "/dev/null", &serial, NULL, DRIVER_UNSUPPORTED, "no serial port" },
        { "/dev/../dev/null", &serial, NULL, DRIVER_UNSUPPORTED, "no serial port" },
        { "/dev/ptmx", &serial, NULL, DRIVER_UNSUPPORTED, "no serial port" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct driver_options options = { .address = cases[i].address };
        const struct link_wanted wanted = { .call = &call,
                                            .serial = cases[i].serial,
                                            .usb = cases[i].usb,
                                            .deadline_ms = call_now_ms() + 1000 };
        memset(&error, 0, sizeof error);
        wire = NULL;
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].result, link_open(&options, &wanted, &wire, &error),
                                      cases[i].address);
        TEST_ASSERT_EQUAL_INT(cases[i].result, error.result);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, cases[i].says), error.text);
        TEST_ASSERT_NULL(wire);
    }
}

/* An address that the driver would refuse is not offered. */
static void test_only_fitting_addresses_are_offered(void)
{
    static const struct link_serial serial = { 9600, false };
    static const struct link_usb_model models[] = { { 0x2457, 0x101e }, { 0, 0 } };
    static const struct link_usb usb = { .models = models };
    static const char *const addresses[] = { "", "ttyACM0" };
    for (size_t i = 0; i < sizeof addresses / sizeof *addresses; i++) {
        const struct driver_options options = { .address = addresses[i] };
        struct link_wanted wanted = { .call = &call, .serial = &serial };
        TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, link_open(&options, &wanted, &wire, &error));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "/dev/ttyACM0"), error.text);
        TEST_ASSERT_NULL_MESSAGE(strstr(error.text, "usb"), error.text);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "or replay:FILE"), error.text);
        wanted.serial = NULL;
        wanted.usb = &usb;
        TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, link_open(&options, &wanted, &wire, &error));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "give usb, usb:VID:PID"), error.text);
        TEST_ASSERT_NULL_MESSAGE(strstr(error.text, "serial"), error.text);
    }
}

static void test_a_loop_of_links(void)
{
    static const struct link_serial serial = { 9600, false };
    TEST_ASSERT_EQUAL_INT(0, symlink("a.capture", path));
    const struct driver_options options = { .address = path };
    char absolute[FOLDER_PATH_SIZE * 2];
    if (path[0] != '/') {
        TEST_ASSERT_NOT_NULL(getcwd(absolute, FOLDER_PATH_SIZE));
        strcat(strcat(absolute, "/"), path);
    } else {
        strcpy(absolute, path);
    }
    const struct link_wanted wanted = {
        .address = absolute, .call = &call, .serial = &serial, .deadline_ms = call_now_ms() + 1000
    };
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, link_open(&options, &wanted, &wire, &error));
    unlink(path);
}

/* ---- recording ---------------------------------------------------------------------- */

static const struct piece pieces[] = {
    { "OK00\r\n", 6 }, { NULL, 0 }, { "\0\xff\\", 3 }, { "late", 4 }
};

static enum driver_result hear(void)
{
    return link_receive(wire, LINK_SERIAL, bytes, sizeof bytes, &n, call_now_ms() + 5, &error);
}

/* A session of a driver; twice, over the script and over what was written of it. */
static void converse(int64_t time_s)
{
    link_begin(wire, "open");
    TEST_ASSERT_EQUAL_INT64(time_s, link_realtime_s(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_send(wire, LINK_SERIAL, "IDR\r\n", 5, 0, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear());
    TEST_ASSERT_EQUAL_UINT(6, n);
    TEST_ASSERT_EQUAL_MEMORY("OK00\r\n", bytes, 6);
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear());
    link_begin(wire, "measure");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear());
    TEST_ASSERT_EQUAL_UINT(3, n);
    TEST_ASSERT_EQUAL_MEMORY("\0\xff\\", bytes, 3);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_drain(wire, LINK_SERIAL, 3, call_now_ms() + 50, &error));
    script.ends_with = DRIVER_GONE;
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear());
    link_close(wire);
}

static void test_a_record_replays(void)
{
    static const enum capture_kind expected[] = {
        CAPTURE_DRIVER,  CAPTURE_OPEN, CAPTURE_CALL, CAPTURE_CLOCK, CAPTURE_SENT,    CAPTURE_CAME,
        CAPTURE_SILENCE, CAPTURE_CALL, CAPTURE_CAME, CAPTURE_CAME,  CAPTURE_SILENCE, CAPTURE_FAILED,
    };
    struct driver_options options = { .address = "" };
    const struct link_wanted wanted = { .call = &call };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_create(path, "test", &options.capture));
    script_start(&call, pieces, 4);
    options.wire = &script.source;
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_open(&options, &wanted, &wire, &error));
    converse(1700000000);
    TEST_ASSERT_EQUAL_INT(1, script.closed);
    TEST_ASSERT_EQUAL_STRING("measure", script.begun);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(options.capture));

    struct capture_file file;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_read(path, &file));
    TEST_ASSERT_EQUAL_UINT(sizeof expected / sizeof *expected, file.n);
    for (size_t i = 0; i < file.n; i++)
        TEST_ASSERT_EQUAL_INT(expected[i], file.lines[i].kind);
    TEST_ASSERT_EQUAL_STRING("script", file.lines[1].text);
    TEST_ASSERT_EQUAL_STRING("gone", file.lines[file.n - 1].text);
    capture_free(&file);

    char address[FOLDER_PATH_SIZE + 8];
    snprintf(address, sizeof address, "replay:%s", path);
    const struct driver_options again = { .address = address };
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_open(&again, &wanted, &wire, &error));
    converse(1700000000);
}

static void test_systems_time(void)
{
    static struct link_ops plain;
    plain = script_ops;
    plain.realtime_s = NULL;
    plain.begin = NULL;
    struct link link = { &plain, &call };
    time_t before = time(NULL);
    TEST_ASSERT_TRUE(link_realtime_s(&link) >= before && link_realtime_s(&link) <= time(NULL));
    link_begin(&link, "of no interest");
    link_close(NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_pause_ends_in_time_or_cancelled);
    RUN_TEST(test_addresses_of_no_use);
    RUN_TEST(test_only_fitting_addresses_are_offered);
    RUN_TEST(test_a_loop_of_links);
    RUN_TEST(test_a_record_replays);
    RUN_TEST(test_systems_time);
    return UNITY_END();
}
