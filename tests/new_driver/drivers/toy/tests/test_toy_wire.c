/* test_toy_wire.c - answers of a TOY-1: those of the capture, and what is none. */
#include "drivers/toy/toy_wire.h"

#include <string.h>

#include "drivers/toy/toy.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_answers_that_are_none(void)
{
    char serial[DRIVER_NAME_SIZE];
    bool done[DRIVER_CALIBRATIONS];
    static const char *const bad_identity[] = { "", "TOY1,", "TOY1,0004x", "TOY2,00042", "OK" };
    static const char *const bad_status[] = { "", "CAL,1", "CAL,1,2", "CAL,1,00", "CAL,11,", "OK" };
    for (size_t i = 0; i < sizeof bad_identity / sizeof *bad_identity; i++)
        TEST_ASSERT_FALSE_MESSAGE(toy_read_identity(bad_identity[i], serial), bad_identity[i]);
    for (size_t i = 0; i < sizeof bad_status / sizeof *bad_status; i++)
        TEST_ASSERT_FALSE_MESSAGE(toy_read_calibrated(bad_status[i], done), bad_status[i]);
    TEST_ASSERT_TRUE(toy_read_calibrated("CAL,1,0", done) && done[0] && !done[1]);
    TEST_ASSERT_NULL(toy_find_error("ERR 9"));
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, toy_find_error("ERR 1")->result);
}

static void test_shots_that_are_none(void)
{
    static const char good[] = "1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,9";
    char line[sizeof good + 8];
    int32_t raw[TOY_BANDS];
    TEST_ASSERT_EQUAL_INT(DOUBT_NONE, toy_read_shot(good, raw));
    TEST_ASSERT_EQUAL_INT32(9, raw[TOY_BANDS - 1]);
    TEST_ASSERT_EQUAL_INT(DOUBT_WRONG_COUNT, toy_read_shot(good + 2, raw));
    strcpy(line, good);
    line[0] = '-';
    TEST_ASSERT_EQUAL_INT(DOUBT_NO_NUMBER, toy_read_shot(line, raw));
    strcpy(line + strlen(good), "000"); /* 90 % beside 0.01 % */
    line[0] = '1';
    TEST_ASSERT_EQUAL_INT(DOUBT_JUMP, toy_read_shot(line, raw));
}

/* The capture through the whole driver.  expect: its last line, by hand */
static void test_replays(void)
{
    static struct driver_error error;
    struct driver_options options = { .address = "replay:drivers/toy/captures/toy1.capture" };
    struct driver_identity identity;
    struct driver_status status;
    struct driver_reading reading;
    struct instrument *in = NULL;
#define OK(call) TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, (call), error.text)
    OK(toy_driver.open(&options, &in, &identity, &error));
    TEST_ASSERT_EQUAL_STRING("00042", identity.serial);
    OK(toy_driver.status(in, &status, &error));
    TEST_ASSERT_TRUE(status.due[0] && status.due[1]);
    OK(toy_driver.calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    OK(toy_driver.calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    OK(toy_driver.measure(in, &reading, &error));
    TEST_ASSERT_EQUAL_DOUBLE(0.2260, reading.sce.value[0]);
    TEST_ASSERT_EQUAL_DOUBLE(0.6030, reading.sce.value[TOY_BANDS - 1]);
    toy_driver.close(in);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_answers_that_are_none);
    RUN_TEST(test_shots_that_are_none);
    RUN_TEST(test_replays);
    return UNITY_END();
}
