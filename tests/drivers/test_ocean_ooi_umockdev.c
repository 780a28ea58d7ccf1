/* test_ocean_ooi_umockdev.c - the Ocean driver through libusb, on a mocked usbfs: both endpoints,
 * which model, two alike, and pulled out in a reading. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "drivers/ocean_ooi/ocean_ooi.h"
#include "tests/sim/mock/mock_usb.h"
#include "tests/support/ocean_bench.h"
#include "unity.h"

enum { BANDS = 31, MOST = 2 };

static const struct driver *const driver = &ocean_ooi_driver;
static UMockdevTestbed *testbed;
static struct sim *sims[MOST];
static const struct sim_kind *kinds[MOST];
static struct mock_usb *mocks[MOST];
static struct instrument *instruments[MOST];
static struct driver_identity identity;
static struct driver_error error;
static struct driver_reading reading;

static void plug(size_t i, const struct sim_kind *kind, const char *options, bool full_speed)
{
    struct mock_usb_place place = { .bus = 1,
                                    .device = (unsigned)i + 4,
                                    .full_speed = full_speed,
                                    .node = MOCK_USB_FIFO,
                                    .mode = 0660 };
    kinds[i] = kind;
    sims[i] = kind->make(options);
    TEST_ASSERT_NOT_NULL(sims[i]);
    mocks[i] = mock_usb_plug(testbed, kind, sims[i], &place);
}

void setUp(void)
{
}

static void clear(void)
{
    for (size_t i = 0; i < MOST; i++) {
        driver->close(instruments[i]);
        instruments[i] = NULL;
        mock_usb_free(mocks[i]);
        mocks[i] = NULL;
        if (sims[i] != NULL)
            kinds[i]->free(sims[i]);
        sims[i] = NULL;
    }
    ocean_bench_clean();
}

void tearDown(void)
{
    clear();
}

#define EXPECT(expect, call) TEST_ASSERT_EQUAL_INT_MESSAGE(expect, call, error.text)

static enum driver_result open_at(size_t i, const char *link)
{
    char address[600];
    const char *rest = strchr(ocean_bench_address(), ',');
    struct driver_options options = { .address = address };
    snprintf(address, sizeof address, "%s%s", link, rest);
    return driver->open(&options, &instruments[i], &identity, &error);
}

static void calibrate(size_t i)
{
    TEST_ASSERT_TRUE(mock_usb_act(mocks[i], "place black"));
    EXPECT(DRIVER_OK, driver->calibrate(instruments[i], DRIVER_CALIBRATION_ZERO, &error));
    TEST_ASSERT_TRUE(mock_usb_act(mocks[i], "place white"));
    EXPECT(DRIVER_OK, driver->calibrate(instruments[i], DRIVER_CALIBRATION_WHITE, &error));
}

static double worst_of_a_reading(size_t i)
{
    double worst = 0.0;
    EXPECT(DRIVER_OK, driver->measure(instruments[i], &reading, &error));
    for (size_t b = 0; b < BANDS; b++)
        worst = fmax(worst, fabs(reading.sce.value[b] -
                                 mock_usb_truth(mocks[i], 400.0 + 10.0 * (double)b, false)));
    return worst;
}

static const struct {
    const struct sim_kind *kind;
    const char *options, *model;
    bool full_speed;
} models[] = {
    { &sim_usb2000, "delays=0,noise=0.2", "USB2000+", false },
    { &sim_usb2000, "delays=0,noise=0.2,flame=1,speed=full", "Flame-S", true },
    { &sim_usb4000, "delays=0,noise=0.2", "USB4000", false },
    { &sim_usb4000, "delays=0,noise=0.2,speed=full", "USB4000", true },
    { &sim_hr2000, "delays=0,noise=0.2", "HR2000+", false },
    { &sim_hr4000, "delays=0,noise=0.2", "HR4000", false },
};

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void test_models(void)
{
    for (size_t m = 0; m < sizeof models / sizeof *models; m++) {
        plug(0, models[m].kind, models[m].options, models[m].full_speed);
        EXPECT(DRIVER_OK, open_at(0, "usb"));
        TEST_ASSERT_EQUAL_STRING(models[m].model, identity.model);
        calibrate(0);
        TEST_ASSERT_TRUE(mock_usb_act(mocks[0], "place grey 35"));
        double began = now_ms(), worst = worst_of_a_reading(0);
        printf("%s: %.1f ms a reading, worst band %.5f off\n", models[m].model, now_ms() - began,
               worst);
        TEST_ASSERT_TRUE(worst < 2e-3);
        TEST_ASSERT_TRUE(mock_usb_act(mocks[0], "unwritten"));
        clear();
    }
}

static void test_two_alike(void)
{
    plug(0, &sim_usb2000, "delays=0,serial=USB2P11", false);
    plug(1, &sim_usb2000, "delays=0,serial=USB2P22", false);
    EXPECT(DRIVER_UNSUPPORTED, open_at(0, "usb"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "usb:001:004"), error.text);
    EXPECT(DRIVER_OK, open_at(1, "usb:001:005"));
    TEST_ASSERT_EQUAL_STRING("USB2P22", identity.serial);
    EXPECT(DRIVER_OK, open_at(0, "usb:001:004"));
    TEST_ASSERT_EQUAL_STRING("USB2P11", identity.serial);
}

static void *pull_out(void *unused)
{
    (void)unused;
    nanosleep(&(struct timespec){ .tv_nsec = 100000000 }, NULL);
    mock_usb_act(mocks[0], "fault gone");
    return NULL;
}

/* A reading of 600 ms, and gone after 100. */
static void test_pulled_out_in_a_reading(void)
{
    pthread_t thread;
    plug(0, &sim_usb4000, "lamp=0.08,noise=0", false);
    EXPECT(DRIVER_OK, open_at(0, "usb:2457:1022"));
    calibrate(0);
    TEST_ASSERT_TRUE(mock_usb_act(mocks[0], "place skin"));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, pull_out, NULL));
    EXPECT(DRIVER_GONE, driver->measure(instruments[0], &reading, &error));
    pthread_join(thread, NULL);
}

int main(void)
{
    testbed = umockdev_testbed_new();
    UNITY_BEGIN();
    RUN_TEST(test_models);
    RUN_TEST(test_two_alike);
    RUN_TEST(test_pulled_out_in_a_reading);
    int failed = UNITY_END();
    g_object_unref(testbed);
    return failed;
}
