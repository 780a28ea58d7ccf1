/* test_usb_umockdev.c - a USB link on a mocked usbfs: which device is opened, how transfers end,
 * and what happens when the instrument is pulled out of one. */
#define _GNU_SOURCE /* credentials of one thread: syscall(); RTLD_NEXT */
#include "drivers/link/kinds.h"

#include <dlfcn.h>
#include <errno.h>
#include <libusb.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "tests/sim/mock/mock_usb.h"
#include "tests/support/patience.h"
#include "unity.h"

enum { NOBODY = 65534, OUT = 0x01, IN = 0x81, IN_LARGE = 0x82 };

/* ---- an instrument that does as it is told ------------------------------------------ */

/* The first byte sent says what the next transfer from it is: 'e' the bytes that follow, 'l' 4097
 * bytes on IN_LARGE, 'p' 512 of them and no end, 's' a stall, 'o' too much, 'x' an error of the
 * bus; 'S' stalls at once; all others nothing. */
struct sim {
    uint8_t bytes[4200];
    size_t n, at;
    int ends_with;
    uint8_t channel;
};

static struct sim *make(const char *options)
{
    (void)options;
    return calloc(1, sizeof(struct sim));
}

static void free_sim(struct sim *sim)
{
    free(sim);
}

static int take(struct sim *sim, uint8_t channel, const uint8_t *bytes, size_t n, int64_t now_us)
{
    (void)channel, (void)now_us;
    sim->at = sim->n = 0;
    sim->ends_with = 0;
    sim->channel = IN;
    for (size_t i = 0; i < sizeof sim->bytes; i++)
        sim->bytes[i] = (uint8_t)(i * 7);
    switch (n > 0 ? bytes[0] : 0) {
    case 'e':
        sim->n = n - 1;
        memcpy(sim->bytes, bytes + 1, n - 1);
        return 0;
    case 'l':
    case 'p':
        sim->channel = IN_LARGE;
        sim->n = bytes[0] == 'l' ? 4097 : 512;
        return 0;
    case 's':
        sim->ends_with = -EPIPE;
        return 0;
    case 'o':
        sim->ends_with = -EOVERFLOW;
        return 0;
    case 'x':
        sim->ends_with = -EPROTO;
        return 0;
    case 'S':
        return -EPIPE;
    default:
        return 0;
    }
}

static ssize_t give(struct sim *sim, uint8_t channel, uint8_t *bytes, size_t size, int64_t now_us,
                    int64_t *due_us)
{
    (void)now_us;
    *due_us = INT64_MAX;
    int ends_with = sim->ends_with;
    sim->ends_with = 0;
    if (ends_with != 0)
        return ends_with;
    if (channel != sim->channel)
        return 0;
    size_t left = sim->n - sim->at, now = left < size ? left : size;
    memcpy(bytes, sim->bytes + sim->at, now);
    sim->at += now;
    return (ssize_t)now;
}

/* "speak": five bytes unasked. */
static bool act(struct sim *sim, const char *action, int64_t now_us)
{
    (void)now_us;
    if (strcmp(action, "speak") == 0) {
        sim->n = 5;
        sim->at = 0;
        sim->channel = IN;
    }
    return true;
}

#define KIND(name_, vid_, pid_) \
    { \
        .name = name_, .make = make, .free = free_sim, .take = take, .give = give, .act = act, \
        .vid = vid_, .pid = pid_, .product = name_ \
    }
static const struct sim_kind obedient = KIND("obedient", 0x2457, 0x101e),
                             sister = KIND("sister", 0x2457, 0x1022),
                             mouse = KIND("mouse", 0x046d, 0xc52b);

/* ---- a libusb that does what no mock can ------------------------------------------- */

/* In place of the library's, for the link as for everybody in this program. */
static bool cancels_nothing, calls_permission_io;

int LIBUSB_CALL libusb_cancel_transfer(struct libusb_transfer *transfer)
{
    int(LIBUSB_CALL * real)(struct libusb_transfer *);
    *(void **)&real = dlsym(RTLD_NEXT, "libusb_cancel_transfer");
    return cancels_nothing ? 0 : real(transfer);
}

/* libusb 1.0.26 has a name for EACCES alone; for EPERM, which a device cgroup gives, it has none.
 */
int LIBUSB_CALL libusb_open(libusb_device *device, libusb_device_handle **ret)
{
    int(LIBUSB_CALL * real)(libusb_device *, libusb_device_handle **);
    *(void **)&real = dlsym(RTLD_NEXT, "libusb_open");
    int failed = real(device, ret);
    return failed == LIBUSB_ERROR_ACCESS && calls_permission_io ? LIBUSB_ERROR_IO : failed;
}

/* ---- plugging ----------------------------------------------------------------------- */

enum { MOCKS = 3 };
static UMockdevTestbed *testbed;
static struct mock_usb *mocks[MOCKS];
static struct sim *sims[MOCKS];
static unsigned next_device = 2;
static enum mock_usb_node node_kind;

/* As mocks[i]; its address. */
static const char *plug(size_t i, const struct sim_kind *kind, unsigned mode)
{
    static char addresses[MOCKS][32];
    const struct mock_usb_place place = {
        .bus = 1, .device = next_device++, .mode = mode, .node = node_kind
    };
    sims[i] = kind->make("");
    mocks[i] = mock_usb_plug(testbed, kind, sims[i], &place);
    snprintf(addresses[i], sizeof addresses[i], "usb:001:%03u", place.device);
    return addresses[i];
}

static int64_t now_us(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){ .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L }, NULL);
}

/* ---- the link ----------------------------------------------------------------------- */

static struct call call;
static struct link *wire;
static struct driver_error error;
static uint8_t bytes[4608];
static size_t n;

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
    wire = NULL;
}

/* umockdev hears of a close a little later. */
static unsigned clients_after_close(struct mock_usb *mock)
{
    for (int i = 0; i < 2000 && mock_usb_clients(mock) > 0; i++)
        sleep_ms(1);
    return mock_usb_clients(mock);
}

void tearDown(void)
{
    link_close(wire);
    call_done(&call);
    for (size_t i = 0; i < MOCKS; i++) {
        if (mocks[i] == NULL)
            continue;
        unsigned still = clients_after_close(mocks[i]);
        mock_usb_free(mocks[i]);
        mocks[i] = NULL;
        free_sim(sims[i]);
        TEST_ASSERT_EQUAL_UINT(0, still); /* the link let go of it */
    }
}

static enum driver_result open_address(const char *address, int within_ms, struct link **ret)
{
    static const struct link_usb_model models[] = { { 0x2457, 0x101e }, { 0x2457, 0x1022 }, { 0 } };
    static const struct link_usb usb = { .models = models };
    const struct driver_options options = { .address = address };
    const struct link_wanted wanted = { .call = &call,
                                        .usb = &usb,
                                        .deadline_ms = call_now_ms() + within_ms };
    return link_open(&options, &wanted, ret, &error);
}

static void start(void)
{
    plug(0, &obedient, 0666);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, open_address("usb", 2000, &wire), error.text);
    call_begin(&call);
}

static enum driver_result say(const char *text)
{
    return link_send(wire, OUT, text, strlen(text), call_now_ms() + 2000, &error);
}

static enum driver_result hear(uint8_t endpoint, size_t size, int within_ms)
{
    n = 0;
    return link_receive(wire, endpoint, bytes, size, &n, call_now_ms() + within_ms, &error);
}

static void assert_echo(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, say("ehello"), error.text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, hear(IN, 64, 2000), error.text);
    TEST_ASSERT_EQUAL_UINT(5, n);
    TEST_ASSERT_EQUAL_MEMORY("hello", bytes, 5);
}

/* ---- what fate does meanwhile ------------------------------------------------------- */

struct later {
    int after_ms;
    void (*does)(void);
    pthread_t thread;
    int64_t at_us;
};

static void *do_later(void *of)
{
    struct later *later = of;
    sleep_ms(later->after_ms);
    later->at_us = now_us(CLOCK_MONOTONIC);
    later->does();
    return NULL;
}

static void begin_later(struct later *later)
{
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&later->thread, NULL, do_later, later));
}

static double since(struct later *later)
{
    int64_t now = now_us(CLOCK_MONOTONIC);
    pthread_join(later->thread, NULL);
    return (double)(now - later->at_us) / 1e3;
}

static void cancel(void)
{
    call_cancel(&call);
}

static void unplug(void)
{
    mock_usb_unplug(mocks[0]);
}

static void allow(void)
{
    mock_usb_set_mode(mocks[0], 0666);
}

/* This thread alone: the others stay who they are. */
static void become(uid_t uid)
{
    if (getuid() == 0)
        TEST_ASSERT_EQUAL_INT(0, (int)syscall(SYS_setresuid, -1, uid, -1));
}

/* ---- which device ------------------------------------------------------------------- */

static void assert_opens(const char *address)
{
    struct link *link = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, open_address(address, 2000, &link), error.text);
    TEST_ASSERT_EQUAL_STRING("usb", link->ops->kind);
    link_close(link);
}

static void assert_refuses(enum driver_result result, const char *address, const char *says,
                           const char *and_says)
{
    struct link *link = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(result, open_address(address, 2000, &link), error.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, says), error.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, and_says), error.text);
    TEST_ASSERT_NULL(link);
}

static void test_the_only_one(void)
{
    const char *other = plug(1, &mouse, 0666);
    assert_refuses(DRIVER_GONE, "usb", "'usb'", "connect it");
    assert_refuses(DRIVER_UNSUPPORTED, other, "046d:c52b", "no instrument of this driver");
    assert_refuses(DRIVER_UNSUPPORTED, "usb:046d:c52b", "046d:c52b", "no instrument");
    const char *address = plug(0, &obedient, 0666);
    assert_opens("usb");
    assert_opens("usb:2457:101e");
    assert_opens("usb:2457:101E");
    assert_opens(address);
    assert_refuses(DRIVER_GONE, "usb:2457:1022", "usb:2457:1022", "connect it");
    assert_refuses(DRIVER_GONE, "usb:001:099", "usb:001:099", "connect it");
    TEST_ASSERT_EQUAL_UINT(0, mock_usb_counts(mocks[1]).claims); /* never touched */
}

static void test_two_of_them(void)
{
    const char *first = plug(0, &obedient, 0666), *second = plug(1, &sister, 0666);
    assert_refuses(DRIVER_UNSUPPORTED, "usb", first, second);
    assert_opens("usb:2457:1022");
    const char *third = plug(2, &obedient, 0666);
    assert_refuses(DRIVER_UNSUPPORTED, "usb:2457:101e", first, third);
    assert_opens(second);
    assert_opens(third);
}

static void test_held_by_another(void)
{
    struct link *second = NULL;
    start();
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, open_address("usb", 2000, &second));
    assert_echo();
    link_close(wire);
    wire = NULL;
    TEST_ASSERT_EQUAL_UINT(0, clients_after_close(mocks[0]));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_address("usb", 2000, &wire));
}

static void assert_permission_is_waited_for(void)
{
    struct later later = { .after_ms = 400, .does = allow };
    plug(0, &obedient, 0);
    become(NOBODY);
    int64_t began_ms = call_now_ms();
    enum driver_result never = open_address("usb", 300, &wire);
    int64_t never_ms = call_now_ms() - began_ms;
    become(0);
    begin_later(&later); /* who it is from its birth */
    become(NOBODY);
    began_ms = call_now_ms();
    enum driver_result comes = open_address("usb", 5000, &wire);
    int64_t comes_ms = call_now_ms() - began_ms;
    become(0);
    (void)since(&later);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_NO_PERMISSION, never, error.text);
    TEST_ASSERT_TRUE(never_ms >= 290 && never_ms < 300 + SLACK_MS);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, comes, error.text);
    TEST_ASSERT_TRUE(comes_ms >= 350 && comes_ms < 500 + SLACK_MS);
}

static void test_permission(void)
{
    assert_permission_is_waited_for();
}

static void test_permission_by_another_name(void)
{
    calls_permission_io = true;
    assert_permission_is_waited_for();
    calls_permission_io = false;
}

/* ---- how transfers end -------------------------------------------------------------- */

static void test_short_and_long(void)
{
    start();
    assert_echo();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("l"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(IN_LARGE, 4608, 2000));
    TEST_ASSERT_EQUAL_UINT(4097, n);
    for (size_t i = 0; i < n; i++)
        TEST_ASSERT_EQUAL_HEX8((uint8_t)(i * 7), bytes[i]);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("l"));
    for (size_t at = 0; at < 4097; at += n) {
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(IN_LARGE, 512, 2000));
        TEST_ASSERT_EQUAL_UINT(at < 4096 ? 512 : 1, n);
        TEST_ASSERT_EQUAL_HEX8((uint8_t)(at * 7), bytes[0]);
    }
}

static void test_timeout(void)
{
    start();
    int64_t began_ms = call_now_ms(), cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID);
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(IN, 64, 100));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 100);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 200 + SLACK_MS);
    TEST_ASSERT_TRUE(now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_us < 50000);
    TEST_ASSERT_EQUAL_UINT(1, mock_usb_counts(mocks[0]).cut);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("p"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(IN_LARGE, 4608, 60)); /* what came */
    TEST_ASSERT_EQUAL_UINT(512, n);
    TEST_ASSERT_EQUAL_HEX8(7, bytes[1]);
    assert_echo();
}

static void test_stall(void)
{
    start();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("s"));
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, hear(IN, 64, 2000));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "endpoint 81"), error.text);
    TEST_ASSERT_EQUAL_UINT(1, mock_usb_counts(mocks[0]).halts_cleared);
    assert_echo();
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, say("S"));
    TEST_ASSERT_EQUAL_UINT(2, mock_usb_counts(mocks[0]).halts_cleared);
    assert_echo();
}

static void test_more_than_asked_for(void)
{
    start();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("o"));
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, hear(IN, 64, 2000));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "more than"), error.text);
    assert_echo();
}

static void test_drain(void)
{
    start();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("l"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_drain(wire, IN_LARGE, 50, call_now_ms() + 2000, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(IN_LARGE, 512, 20));
}

/* ---- cancelled and pulled out ------------------------------------------------------- */

static void test_cancelled(void)
{
    struct later later = { .after_ms = 60, .does = cancel };
    start();
    int64_t cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID);
    begin_later(&later);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, hear(IN, 64, 10000));
    double ms = since(&later);
    printf("cancelled %.1f ms after the cancel, waiting took %lld us of CPU\n", ms,
           (long long)(now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_us));
    TEST_ASSERT_TRUE(ms < 200.0);
    struct mock_usb_counts counts = mock_usb_counts(mocks[0]);
    TEST_ASSERT_EQUAL_UINT(1, counts.cut);
    TEST_ASSERT_EQUAL_UINT(counts.submitted, counts.reaped);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, say("ehello")); /* the whole call is */
    TEST_ASSERT_EQUAL_UINT(counts.submitted, mock_usb_counts(mocks[0]).submitted);
    link_begin(wire, "measure");
    assert_echo();
}

static void assert_pulled_out_of_a_transfer(void)
{
    struct later later = { .after_ms = 60, .does = unplug };
    start();
    begin_later(&later);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(IN, 64, 10000));
    double ms = since(&later);
    printf("gone %.1f ms after the unplugging\n", ms);
    TEST_ASSERT_TRUE(ms < 100.0 + SLACK_MS);
    int64_t began_ms = call_now_ms(), cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, say("ehello"));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(IN, 64, 10000));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, link_drain(wire, IN, 50, call_now_ms() + 10000, &error));
    cpu_us = now_us(CLOCK_THREAD_CPUTIME_ID) - cpu_us;
    printf("after it: three calls took %lld ms and %lld us of CPU\n",
           (long long)(call_now_ms() - began_ms), (long long)cpu_us);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 100 && cpu_us < 20000);
    link_close(wire);
    wire = NULL;
    assert_refuses(DRIVER_GONE, "usb", "usb", "connect it");
    plug(1, &obedient, 0666); /* at another address */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_address("usb", 2000, &wire));
    assert_echo();
}

static void test_pulled_out_of_a_transfer(void)
{
    assert_pulled_out_of_a_transfer();
}

/* As the kernel's own nodes do. */
static void test_pulled_out_and_hung_up(void)
{
    node_kind = MOCK_USB_PTY;
    assert_pulled_out_of_a_transfer();
    node_kind = MOCK_USB_FIFO;
}

/* Of AddressSanitizer, where it is there. */
void __lsan_disable(void) __attribute__((weak));
void __lsan_enable(void) __attribute__((weak));

/* A transfer that does not end where it is taken back: its memory stays the system's, and
 * nobody waits for it for ever. */
static void test_a_transfer_that_never_completes(void)
{
    start();
    cancels_nothing = true;
    int64_t began_ms = call_now_ms();
    if (__lsan_disable != NULL)
        __lsan_disable(); /* libusb 1.0.26 frees what it keeps of a transfer when it ends */
    enum driver_result late = hear(IN, 64, 50);
    if (__lsan_enable != NULL)
        __lsan_enable();
    int64_t late_ms = call_now_ms() - began_ms;
    began_ms = call_now_ms();
    enum driver_result next = say("ehello");
    int64_t next_ms = call_now_ms() - began_ms;
    enum driver_result after = hear(IN, 64, 50);
    link_close(wire);
    wire = NULL;
    cancels_nothing = false;
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, late);
    TEST_ASSERT_TRUE(late_ms < 150 + SLACK_MS);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, next);
    TEST_ASSERT_TRUE(next_ms >= 2000 && next_ms < 2000 + SLACK_MS);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, after);
    TEST_ASSERT_EQUAL_UINT(0, clients_after_close(mocks[0]));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_address("usb", 2000, &wire));
    assert_echo();
}

/* One that ends late is waited for by the next, and what it brought is gone with it. */
static void test_a_transfer_that_completes_late(void)
{
    struct later later = { .after_ms = 30, .does = cancel };
    start();
    cancels_nothing = true;
    begin_later(&later);
    enum driver_result cancelled = hear(IN, 64, 10000);
    double ms = since(&later);
    cancels_nothing = false;
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, cancelled);
    TEST_ASSERT_TRUE(ms < 200.0);
    TEST_ASSERT_TRUE(mock_usb_act(mocks[0], "speak"));
    link_begin(wire, "measure");
    assert_echo();
}

static void test_pulled_out_before_a_call(void)
{
    start();
    unplug();
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, say("ehello"));
}

/* What a host sees first of an unplugging is often this. */
static void test_error_of_the_bus(void)
{
    start();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("x"));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(IN, 64, 2000));
}

static void test_descriptors(void)
{
    int before = -1;
    plug(0, &obedient, 0666);
    for (int i = 0; i < 20; i++) {
        assert_opens("usb");
        TEST_ASSERT_EQUAL_UINT(0, clients_after_close(mocks[0]));
        assert_refuses(DRIVER_GONE, "usb:2457:1022", "usb", "connect");
        int next = dup(0);
        close(next);
        if (i == 5)
            before = next;
        if (i > 5)
            TEST_ASSERT_INT_WITHIN(2, before, next); /* the mock's own come and go */
    }
}

int main(void)
{
    umask(0); /* for whom become() makes of us */
    testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) {
        fprintf(stderr, "libumockdev-preload is not the first library\n");
        return 1;
    }
    char *root = umockdev_testbed_get_root_dir(testbed);
    chmod(root, 0777); /* libudev of whom become() makes of us puts a socket there */
    g_free(root);
    UNITY_BEGIN();
    RUN_TEST(test_the_only_one);
    RUN_TEST(test_two_of_them);
    RUN_TEST(test_held_by_another);
    RUN_TEST(test_permission);
    RUN_TEST(test_permission_by_another_name);
    RUN_TEST(test_short_and_long);
    RUN_TEST(test_timeout);
    RUN_TEST(test_stall);
    RUN_TEST(test_more_than_asked_for);
    RUN_TEST(test_drain);
    RUN_TEST(test_cancelled);
    RUN_TEST(test_pulled_out_of_a_transfer);
    RUN_TEST(test_pulled_out_and_hung_up);
    RUN_TEST(test_a_transfer_that_never_completes);
    RUN_TEST(test_a_transfer_that_completes_late);
    RUN_TEST(test_pulled_out_before_a_call);
    RUN_TEST(test_error_of_the_bus);
    RUN_TEST(test_descriptors);
    for (int i = patience_number("PLUGS"); i > 1; i--) {
        RUN_TEST(test_pulled_out_of_a_transfer);
        RUN_TEST(test_pulled_out_and_hung_up);
        RUN_TEST(test_pulled_out_before_a_call);
    }
    int failed = UNITY_END();
    g_object_unref(testbed);
    return failed;
}
