/* test_mock_usb.c - unmodified libusb and a plain client on it, against simulated instruments
 * that are plugged in, pulled out, and misbehave. */
#include "tests/sim/mock/mock_usb.h"

#include <errno.h>
#include <fcntl.h>
#include <libusb.h>
#include <math.h>
#include <pthread.h>
#include <spawn.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "tests/sim/ocean.h"
#include "unity.h"

extern char **environ;

enum { PIXELS = 2048, SPECTRUM = 2 * PIXELS + 1, SHORT_MS = 150, LONG_MS = 5000 };
enum { MOST_MOCKS = 3, MOST_HANDLES = 4 };

static UMockdevTestbed *testbed;
static libusb_context *usb;
static struct mock_usb *mocks[MOST_MOCKS];
static struct sim *sims[MOST_MOCKS];

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000 }, NULL);
}

static int64_t now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

static const struct mock_usb_place first_place = { .bus = 1, .device = 2, .mode = 0666 };

static struct mock_usb *plug(size_t i, const struct sim_kind *kind, const char *options,
                             const struct mock_usb_place *place)
{
    sims[i] = kind->make(options);
    TEST_ASSERT_NOT_NULL(sims[i]);
    return mocks[i] = mock_usb_plug(testbed, kind, sims[i], place);
}

/* umockdev notices a close a little later. */
static unsigned wait_until_closed(struct mock_usb *mock)
{
    for (int64_t end = now_ms() + LONG_MS; mock_usb_clients(mock) > 0 && now_ms() < end;)
        sleep_ms(1);
    return mock_usb_clients(mock);
}

static void pull_and_free(size_t i)
{
    if (mocks[i] == NULL)
        return;
    unsigned still = wait_until_closed(mocks[i]);
    mock_usb_free(mocks[i]);
    sim_usb2000.free(sims[i]);
    mocks[i] = NULL;
    TEST_ASSERT_EQUAL_UINT(0, still);
}

/* What a test that failed left open is closed after it: libusb would not end otherwise. */
static libusb_device_handle *handles_open[MOST_HANDLES];

static void shut(libusb_device_handle *handle)
{
    for (size_t i = 0; i < MOST_HANDLES; i++)
        if (handles_open[i] == handle)
            handles_open[i] = NULL;
    libusb_close(handle);
}

static void remember(libusb_device_handle *handle)
{
    for (size_t i = 0; i < MOST_HANDLES; i++)
        if (handles_open[i] == NULL) {
            handles_open[i] = handle;
            return;
        }
    abort();
}

void setUp(void)
{
    TEST_ASSERT_EQUAL_INT(0, libusb_init(&usb));
}

void tearDown(void)
{
    for (size_t i = 0; i < MOST_HANDLES; i++)
        if (handles_open[i] != NULL)
            shut(handles_open[i]);
    libusb_exit(usb);
    for (size_t i = 0; i < MOST_MOCKS; i++)
        pull_and_free(i);
}

/* ---- a client ------------------------------------------------------------------------ */

/* Without claiming. */
static int open_device(uint16_t pid, unsigned device, libusb_device_handle **ret)
{
    libusb_device **list;
    ssize_t n = libusb_get_device_list(usb, &list);
    int result = LIBUSB_ERROR_NO_DEVICE;
    for (ssize_t i = 0; i < n; i++) {
        struct libusb_device_descriptor d;
        if (libusb_get_device_descriptor(list[i], &d) == 0 && d.idVendor == 0x2457 &&
            d.idProduct == pid && (device == 0 || libusb_get_device_address(list[i]) == device)) {
            result = libusb_open(list[i], ret);
            break;
        }
    }
    libusb_free_device_list(list, 1);
    if (result == 0)
        remember(*ret);
    return result;
}

static libusb_device_handle *opened(uint16_t pid, unsigned device)
{
    libusb_device_handle *handle = NULL;
    TEST_ASSERT_EQUAL_INT(0, open_device(pid, device, &handle));
    TEST_ASSERT_EQUAL_INT(0, libusb_claim_interface(handle, 0));
    return handle;
}

static int command(libusb_device_handle *handle, uint8_t byte, uint8_t argument)
{
    uint8_t bytes[] = { byte, argument, 0, 0, 0 };
    int n = 0, result = libusb_bulk_transfer(handle, 0x01, bytes, sizeof bytes, &n, LONG_MS);
    return result == 0 && n != sizeof bytes ? LIBUSB_ERROR_IO : result;
}

static int receive(libusb_device_handle *handle, uint8_t endpoint, uint8_t *bytes, int size, int *n,
                   unsigned timeout_ms)
{
    memset(bytes, 0, (size_t)size);
    return libusb_bulk_transfer(handle, endpoint, bytes, size, n, timeout_ms);
}

static void set_integration(libusb_device_handle *handle, uint32_t us)
{
    uint8_t bytes[] = { 0x02, (uint8_t)us, (uint8_t)(us >> 8), (uint8_t)(us >> 16),
                        (uint8_t)(us >> 24) };
    int n;
    TEST_ASSERT_EQUAL_INT(0, libusb_bulk_transfer(handle, 0x01, bytes, sizeof bytes, &n, LONG_MS));
}

static int slot(libusb_device_handle *handle, uint8_t i, char text[16])
{
    uint8_t b[64];
    int n = 0, result = command(handle, 0x05, i);
    if (result == 0)
        result = receive(handle, 0x81, b, sizeof b, &n, LONG_MS);
    if (result == 0)
        result = n == 17 && b[0] == 0x05 && b[1] == i ? 0 : LIBUSB_ERROR_OTHER;
    if (result == 0) {
        memcpy(text, b + 2, 15);
        text[15] = '\0';
    }
    return result;
}

/* One spectrum; the mean of what it counted around 600 nm. */
static int spectrum(libusb_device_handle *handle, unsigned timeout_ms, double *mean)
{
    uint8_t b[SPECTRUM / 512 * 512 + 512];
    int n = 0, result = command(handle, 0x09, 0);
    if (result == 0)
        result = receive(handle, 0x82, b, sizeof b, &n, timeout_ms);
    if (result != 0)
        return result;
    if (n != SPECTRUM || b[SPECTRUM - 1] != 0x69)
        return LIBUSB_ERROR_OTHER;
    *mean = 0;
    for (size_t i = 700; i < 800; i++)
        *mean += (b[2 * i] | b[2 * i + 1] << 8) / 100.0;
    return 0;
}

static double third_spectrum(libusb_device_handle *handle)
{
    double mean = 0;
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL_INT(0, spectrum(handle, LONG_MS, &mean));
    return mean;
}

/* ---- what is there ------------------------------------------------------------------- */

static void test_identity(void)
{
    struct mock_usb_place place = first_place;
    place.serial = "USB2+H01234";
    plug(0, &sim_usb2000, "serial=USB2+H01234", &place);
    libusb_device_handle *handle = opened(0x101e, 2);
    libusb_device *device = libusb_get_device(handle);
    struct libusb_device_descriptor d;
    unsigned char text[256];
    char serial[16];
    TEST_ASSERT_EQUAL_INT(0, libusb_get_device_descriptor(device, &d));
    TEST_ASSERT_EQUAL_INT(
        11, libusb_get_string_descriptor_ascii(handle, d.iSerialNumber, text, sizeof text));
    TEST_ASSERT_EQUAL_STRING("USB2+H01234", text);
    TEST_ASSERT_EQUAL_INT(
        8, libusb_get_string_descriptor_ascii(handle, d.iProduct, text, sizeof text));
    TEST_ASSERT_EQUAL_STRING("USB2000+", text);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_PIPE,
                          libusb_control_transfer(handle, 0xc0, 0x42, 0, 0, text, 8, LONG_MS));
    TEST_ASSERT_EQUAL_INT(LIBUSB_SPEED_HIGH, libusb_get_device_speed(device));
    TEST_ASSERT_EQUAL_INT(512, libusb_get_max_packet_size(device, 0x82));
    TEST_ASSERT_EQUAL_INT(64, libusb_get_max_packet_size(device, 0x81));
    TEST_ASSERT_EQUAL_INT(0, slot(handle, 0, serial));
    TEST_ASSERT_EQUAL_STRING("USB2+H01234", serial);
    shut(handle);
}

static void test_full_speed(void)
{
    struct mock_usb_place place = first_place;
    double mean;
    place.full_speed = true;
    plug(0, &sim_usb2000, "speed=full", &place);
    libusb_device_handle *handle = opened(0x101e, 2);
    libusb_device *device = libusb_get_device(handle);
    TEST_ASSERT_EQUAL_INT(LIBUSB_SPEED_FULL, libusb_get_device_speed(device));
    TEST_ASSERT_EQUAL_INT(64, libusb_get_max_packet_size(device, 0x82));
    TEST_ASSERT_EQUAL_INT(0, spectrum(handle, LONG_MS, &mean));
    shut(handle);
}

/* The trap, the tile, a grey of 50 %: what a ratio of three spectra gives. */
static void test_reflectance(void)
{
    struct mock_usb *mock = plug(0, &sim_usb2000, "delays=0.2", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    TEST_ASSERT_EQUAL_INT(0, command(handle, 0x01, 0));
    TEST_ASSERT_EQUAL_INT(0, command(handle, 0x03, 1));
    set_integration(handle, 20000);
    TEST_ASSERT_TRUE(mock_usb_act(mock, "place black"));
    double black = third_spectrum(handle);
    TEST_ASSERT_TRUE(mock_usb_act(mock, "place white"));
    double white = third_spectrum(handle), tile = mock_usb_truth(mock, 600, false);
    TEST_ASSERT_TRUE(mock_usb_act(mock, "place grey 50"));
    double grey = third_spectrum(handle);
    TEST_ASSERT_FALSE(mock_usb_act(mock, "place purple"));
    /* Not corrected for linearity: 2 % are as good as can be had. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.50, (grey - black) / (white - black) * tile);
    TEST_ASSERT_TRUE(mock_usb_act(mock, "unwritten"));
    shut(handle);
}

static void test_usb4000_divides(void)
{
    static uint8_t b[8192];
    int n;
    plug(0, &sim_usb4000, "delays=0", &first_place);
    libusb_device_handle *handle = opened(0x1022, 2);
    TEST_ASSERT_EQUAL_INT(0, command(handle, 0x09, 0));
    TEST_ASSERT_EQUAL_INT(0, receive(handle, 0x86, b, 2048, &n, LONG_MS));
    TEST_ASSERT_EQUAL_INT(2048, n);
    TEST_ASSERT_EQUAL_INT(0, receive(handle, 0x82, b, 6144, &n, LONG_MS));
    TEST_ASSERT_EQUAL_INT(5633, n);
    TEST_ASSERT_EQUAL_HEX8(0x69, b[5632]);
    shut(handle);
}

static void test_several_at_once(void)
{
    static const struct mock_usb_place places[MOST_MOCKS] = {
        { .bus = 1, .device = 2, .mode = 0666 },
        { .bus = 1, .device = 9, .mode = 0666 },
        { .bus = 2, .device = 2, .mode = 0666 },
    };
    libusb_device_handle *handles[MOST_MOCKS];
    char text[16];
    double mean;
    plug(0, &sim_usb2000, "serial=ONE,delays=0", &places[0]);
    plug(1, &sim_usb2000, "serial=TWO,delays=0", &places[1]);
    plug(2, &sim_hr2000, "serial=THREE,delays=0", &places[2]);
    handles[0] = opened(0x101e, 2);
    handles[1] = opened(0x101e, 9);
    handles[2] = opened(0x1016, 2);
    for (int round = 0; round < 3; round++)
        for (size_t i = 0; i < MOST_MOCKS; i++) {
            TEST_ASSERT_EQUAL_INT(0, slot(handles[i], 0, text));
            TEST_ASSERT_EQUAL_STRING(((const char *[]){ "ONE", "TWO", "THREE" })[i], text);
            TEST_ASSERT_EQUAL_INT(0, spectrum(handles[i], LONG_MS, &mean));
        }
    mock_usb_unplug(mocks[1]);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, slot(handles[1], 0, text));
    TEST_ASSERT_EQUAL_INT(0, slot(handles[0], 0, text));
    TEST_ASSERT_EQUAL_INT(0, slot(handles[2], 0, text));
    for (size_t i = 0; i < MOST_MOCKS; i++)
        shut(handles[i]);
}

/* ---- who may have it ----------------------------------------------------------------- */

static void test_claimed_by_another(void)
{
    struct mock_usb *mock = plug(0, &sim_usb2000, "", &first_place);
    libusb_device_handle *first = opened(0x101e, 2), *second = NULL;
    char text[16];
    TEST_ASSERT_EQUAL_INT(0, open_device(0x101e, 2, &second));
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_BUSY, libusb_claim_interface(second, 0));
    TEST_ASSERT_EQUAL_INT(0, slot(first, 0, text));
    shut(first); /* without releasing: the kernel does */
    for (int64_t end = now_ms() + LONG_MS; mock_usb_clients(mock) > 1 && now_ms() < end;)
        sleep_ms(1);
    TEST_ASSERT_EQUAL_INT(0, libusb_claim_interface(second, 0));
    TEST_ASSERT_EQUAL_INT(0, slot(second, 0, text));
    TEST_ASSERT_EQUAL_INT(0, libusb_release_interface(second, 0));
    mock_usb_set_claim_error(mock, EBUSY);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_BUSY, libusb_claim_interface(second, 0));
    mock_usb_set_claim_error(mock, 0);
    TEST_ASSERT_EQUAL_INT(0, libusb_claim_interface(second, 0));
    shut(second);
}

/* As nobody in particular: root may open everything. */
static void test_permission(void)
{
    enum { NOBODY = 65534 };
    struct mock_usb_place place = first_place;
    place.mode = 0;
    struct mock_usb *mock = plug(0, &sim_usb2000, "", &place);
    libusb_device_handle *handle = NULL;
    bool root = geteuid() == 0;
    char *folder = umockdev_testbed_get_root_dir(testbed);
    TEST_ASSERT_EQUAL_INT(0, chmod(folder, 0755));
    g_free(folder);
    TEST_ASSERT_EQUAL_INT(0, root ? seteuid(NOBODY) : 0);
    int without = open_device(0x101e, 2, &handle);
    TEST_ASSERT_EQUAL_INT(0, root ? seteuid(0) : 0);
    mock_usb_set_mode(mock, 0666);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_ACCESS, without);
    TEST_ASSERT_EQUAL_INT(0, open_device(0x101e, 2, &handle));
    shut(handle);
}

/* ---- transfers that go wrong --------------------------------------------------------- */

static void test_no_answer(void)
{
    struct mock_usb *mock = plug(0, &sim_usb2000, "", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    uint8_t b[64];
    int n = -1;
    int64_t from_ms = now_ms();
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_TIMEOUT, receive(handle, 0x81, b, sizeof b, &n, SHORT_MS));
    TEST_ASSERT_EQUAL_INT(0, n);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(from_ms + SHORT_MS - 5, now_ms());
    TEST_ASSERT_EQUAL_UINT(1, mock_usb_counts(mock).cut);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_IO, receive(handle, 0x87, b, sizeof b, &n, SHORT_MS));
    shut(handle);
}

/* Waiting costs next to nothing: the node is not ready for nothing. */
static void test_waiting_is_idle(void)
{
    plug(0, &sim_usb2000, "", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    struct rusage before, after;
    double mean;
    set_integration(handle, 600000);
    getrusage(RUSAGE_SELF, &before);
    TEST_ASSERT_EQUAL_INT(0, spectrum(handle, LONG_MS, &mean));
    getrusage(RUSAGE_SELF, &after);
    long used_us = (after.ru_utime.tv_sec - before.ru_utime.tv_sec) * 1000000 +
                   after.ru_utime.tv_usec - before.ru_utime.tv_usec +
                   (after.ru_stime.tv_sec - before.ru_stime.tv_sec) * 1000000 +
                   after.ru_stime.tv_usec - before.ru_stime.tv_usec;
    TEST_ASSERT_LESS_THAN_INT64(200000, used_us); /* a spinning one takes all 600 000 */
    shut(handle);
}

static void test_stall_lasts_until_cleared(void)
{
    struct mock_usb *mock = plug(0, &sim_usb2000, "", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    char text[16];
    TEST_ASSERT_TRUE(mock_usb_act(mock, "fault stall 81"));
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_PIPE, slot(handle, 0, text));
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_PIPE, slot(handle, 0, text));
    TEST_ASSERT_EQUAL_INT(0, libusb_clear_halt(handle, 0x81));
    TEST_ASSERT_EQUAL_INT(0, slot(handle, 0, text)); /* of the first, but they are equal */
    shut(handle);
}

static void test_spectra_that_go_wrong(void)
{
    static const struct {
        const char *fault;
        int result, bytes;
    } rows[] = {
        { "fault truncate 1000", 0, 1000 },
        { "fault truncate 1024", LIBUSB_ERROR_TIMEOUT, 1024 }, /* what came is not lost */
        { "fault hang", LIBUSB_ERROR_TIMEOUT, 512 },
        { "fault overlong 600", 0, 4608 },
        { "fault mute", LIBUSB_ERROR_TIMEOUT, 0 },
        { "fault silent 82", LIBUSB_ERROR_TIMEOUT, 0 },
        { "fault sync", 0, 4097 },
    };
    struct mock_usb *mock = plug(0, &sim_usb2000, "delays=0", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint8_t b[4608];
        int n = 0;
        double mean;
        TEST_ASSERT_TRUE(mock_usb_act(mock, rows[i].fault));
        TEST_ASSERT_EQUAL_INT(0, command(handle, 0x09, 0));
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            rows[i].result, receive(handle, 0x82, b, sizeof b, &n, SHORT_MS), rows[i].fault);
        TEST_ASSERT_EQUAL_INT_MESSAGE(rows[i].bytes, n, rows[i].fault);
        TEST_ASSERT_TRUE(mock_usb_act(mock, "fault none"));
        while (receive(handle, 0x82, b, sizeof b, &n, 20) == 0)
            ;
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, spectrum(handle, LONG_MS, &mean), rows[i].fault);
    }
    uint8_t little[100];
    int n;
    TEST_ASSERT_EQUAL_INT(0, command(handle, 0x09, 0));
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_OVERFLOW,
                          receive(handle, 0x82, little, sizeof little, &n, LONG_MS));
    shut(handle);
}

/* ---- pulled out ---------------------------------------------------------------------- */

struct waiting {
    libusb_device_handle *handle;
    atomic_int result; /* 1: still waiting */
    atomic_llong ended_ms;
};

static void *wait_for_spectrum(void *arg)
{
    struct waiting *w = arg;
    double mean;
    int result = spectrum(w->handle, LONG_MS, &mean);
    w->ended_ms = now_ms();
    w->result = result;
    return NULL;
}

/* A spectrum of 20 s is under way when it is pulled out: it ends at once, and all after. */
static void pulled_out_in_mid_transfer(enum mock_usb_node node)
{
    struct mock_usb_place place = first_place;
    place.node = node;
    struct mock_usb *mock = plug(0, &sim_usb2000, "", &place);
    struct waiting w = { .handle = opened(0x101e, 2) };
    pthread_t thread;
    char text[16];
    w.result = 1;
    set_integration(w.handle, 20000000);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, wait_for_spectrum, &w));
    sleep_ms(50);
    int still = w.result;
    int64_t pulled_ms = now_ms();
    mock_usb_unplug(mock);
    pthread_join(thread, NULL);
    TEST_ASSERT_EQUAL_INT(1, still);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, w.result);
    TEST_ASSERT_LESS_THAN_INT64(pulled_ms + 1000, w.ended_ms);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, slot(w.handle, 0, text));
    libusb_device_handle *none;
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, open_device(0x101e, 0, &none));
    shut(w.handle);
}

static void test_pulled_out_in_mid_transfer(void)
{
    pulled_out_in_mid_transfer(MOCK_USB_FIFO);
}

static void test_pulled_out_of_a_terminal(void)
{
    pulled_out_in_mid_transfer(MOCK_USB_PTY);
}

/* By itself, after one packet: the same to the client, and the host can tell. */
static void test_gone_in_mid_transfer(void)
{
    struct mock_usb *mock = plug(0, &sim_usb2000, "delays=0", &first_place);
    libusb_device_handle *handle = opened(0x101e, 2);
    double mean;
    char text[16];
    TEST_ASSERT_FALSE(mock_usb_gone(mock));
    TEST_ASSERT_TRUE(mock_usb_act(mock, "fault gone"));
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, spectrum(handle, LONG_MS, &mean));
    TEST_ASSERT_TRUE(mock_usb_gone(mock));
    mock_usb_unplug(mock);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, slot(handle, 0, text));
    shut(handle);
}

static atomic_int left, arrived;

static int on_hotplug(libusb_context *context, libusb_device *device, libusb_hotplug_event event,
                      void *user)
{
    (void)context;
    (void)device;
    (void)user;
    ++*(event == LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT ? &left : &arrived);
    return 0;
}

static bool comes_to(const atomic_int *counter, int value)
{
    for (int64_t end = now_ms() + LONG_MS; *counter != value && now_ms() < end;)
        libusb_handle_events_timeout_completed(usb, &(struct timeval){ .tv_usec = 10000 }, NULL);
    return *counter == value;
}

static size_t open_files(void)
{
    size_t n = 0;
    for (int fd = 0; fd < 1024; fd++)
        n += fcntl(fd, F_GETFD) >= 0;
    return n;
}

/* 50 times: plugged in at another address, seen, read, pulled out, seen; nothing is left. */
static void test_plugged_in_and_pulled_out_again_and_again(void)
{
    libusb_hotplug_callback_handle callback;
    size_t files_before = 0;
    left = arrived = 0;
    TEST_ASSERT_EQUAL_INT(
        0,
        libusb_hotplug_register_callback(
            usb, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0, 0x2457,
            LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY, on_hotplug, NULL, &callback));
    for (int i = 0; i < 50; i++) {
        struct mock_usb_place place = first_place;
        place.device = (unsigned)(2 + i % 100);
        place.node = i % 10 == 9 ? MOCK_USB_PTY : MOCK_USB_FIFO;
        plug(0, &sim_usb2000, "delays=0", &place);
        TEST_ASSERT_TRUE(comes_to(&arrived, i + 1));
        libusb_device_handle *handle = opened(0x101e, place.device);
        char text[16];
        double mean;
        TEST_ASSERT_EQUAL_INT(0, slot(handle, 0, text));
        TEST_ASSERT_EQUAL_INT(0, spectrum(handle, LONG_MS, &mean));
        if (i % 2 == 0)
            TEST_ASSERT_EQUAL_INT(0, command(handle, 0x09, 0));
        mock_usb_unplug(mocks[0]);
        TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, spectrum(handle, LONG_MS, &mean));
        TEST_ASSERT_TRUE(comes_to(&left, i + 1));
        shut(handle);
        pull_and_free(0);
        if (i == 4)
            files_before = open_files();
    }
    TEST_ASSERT_EQUAL_size_t(files_before, open_files());
    libusb_hotplug_deregister_callback(usb, callback);
}

/* The same instrument elsewhere while the client still holds the old node. */
static void test_back_at_another_address(void)
{
    struct mock_usb_place place = first_place;
    plug(0, &sim_usb2000, "delays=0,serial=SAME", &place);
    libusb_device_handle *old = opened(0x101e, 2);
    char text[16];
    TEST_ASSERT_EQUAL_INT(0, slot(old, 0, text));
    mock_usb_unplug(mocks[0]);
    place.device = 3;
    struct mock_usb *back = mock_usb_plug(testbed, &sim_usb2000, sims[0], &place);
    libusb_device_handle *handle = opened(0x101e, 3);
    TEST_ASSERT_EQUAL_INT(0, slot(handle, 0, text));
    TEST_ASSERT_EQUAL_STRING("SAME", text);
    TEST_ASSERT_EQUAL_INT(LIBUSB_ERROR_NO_DEVICE, slot(old, 0, text));
    shut(old);
    TEST_ASSERT_EQUAL_INT(0, slot(handle, 0, text));
    shut(handle);
    TEST_ASSERT_EQUAL_UINT(0, wait_until_closed(back));
    mock_usb_free(back);
}

/* ---- another program ----------------------------------------------------------------- */

static const char *program;

/* This program as a client and nothing else: says the serial number, then waits for a
 * spectrum of 20 s.  Exit status 0: it was told that the instrument has gone. */
static int be_client(void)
{
    const uint8_t long_us[] = { 0x02, 0x00, 0x2d, 0x31, 0x01 };
    libusb_device_handle *handle = NULL;
    char text[16] = "";
    double mean;
    int n, result = libusb_init(&usb);
    if (result == 0)
        result = open_device(0x101e, 0, &handle);
    if (result == 0)
        result = libusb_claim_interface(handle, 0);
    if (result == 0)
        result = slot(handle, 0, text);
    if (result == 0)
        result = libusb_bulk_transfer(handle, 0x01, (unsigned char *)(uintptr_t)long_us,
                                      sizeof long_us, &n, LONG_MS);
    printf("%s\n", result == 0 ? text : libusb_error_name(result));
    fflush(stdout);
    if (result == 0)
        result = spectrum(handle, LONG_MS, &mean);
    if (handle != NULL)
        shut(handle);
    libusb_exit(usb);
    return result == LIBUSB_ERROR_NO_DEVICE ? 0 : 1;
}

static void test_another_program(void)
{
    plug(0, &sim_usb2000, "serial=ELSEWHERE", &first_place);
    int ends[2];
    pid_t client;
    char said[32] = "";
    posix_spawn_file_actions_t actions;
    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    char *const arguments[] = { (char *)(uintptr_t)program, "client", NULL };
    int error = posix_spawn(&client, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    TEST_ASSERT_EQUAL_INT(0, error);

    ssize_t n = read(ends[0], said, sizeof said - 1);
    close(ends[0]);
    sleep_ms(50);
    mock_usb_unplug(mocks[0]);
    int status = -1;
    pid_t ended = waitpid(client, &status, 0);
    TEST_ASSERT_EQUAL_INT(10, n);
    TEST_ASSERT_EQUAL_STRING("ELSEWHERE\n", said);
    TEST_ASSERT_EQUAL_INT(client, ended);
    TEST_ASSERT_EQUAL_INT(0, status);
}

int main(int argc, char **argv)
{
    program = argv[0];
    if (argc == 2 && strcmp(argv[1], "client") == 0)
        return be_client();
    testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) { /* remembers: not to be asked before the line above */
        fprintf(stderr, "the preload library of umockdev is missing\n");
        return 1;
    }
    UNITY_BEGIN();
    RUN_TEST(test_identity);
    RUN_TEST(test_full_speed);
    RUN_TEST(test_reflectance);
    RUN_TEST(test_usb4000_divides);
    RUN_TEST(test_several_at_once);
    RUN_TEST(test_claimed_by_another);
    RUN_TEST(test_permission);
    RUN_TEST(test_no_answer);
    RUN_TEST(test_waiting_is_idle);
    RUN_TEST(test_stall_lasts_until_cleared);
    RUN_TEST(test_spectra_that_go_wrong);
    RUN_TEST(test_pulled_out_in_mid_transfer);
    RUN_TEST(test_pulled_out_of_a_terminal);
    RUN_TEST(test_gone_in_mid_transfer);
    RUN_TEST(test_plugged_in_and_pulled_out_again_and_again);
    RUN_TEST(test_back_at_another_address);
    RUN_TEST(test_another_program);
    int failures = UNITY_END();
    g_object_unref(testbed);
    return failures;
}
