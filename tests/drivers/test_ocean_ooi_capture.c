/* test_ocean_ooi_capture.c - a recorded session replayed: the same readings, bit for bit.
 *
 * tests/station/make_captures.py makes the capture;
 *
 *   build/tests/drivers/test_ocean_ooi_capture --write
 *
 * the readings beside it, from the simulated spectrometer without a capture. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "tests/support/ocean_bench.h"
#include "unity.h"

#define FOLDER "drivers/ocean_ooi/captures/"
#define CAPTURE FOLDER "usb2000-simulated.txt"
#define READINGS FOLDER "usb2000-simulated.csv"
#define OPTIONS ",tile=" FOLDER "tile-simulated.csv,port_mm=8"

enum { SHOTS = 3, BANDS = 31 };

static const struct driver *const driver = &ocean_ooi_driver;
static struct driver_error error;

void setUp(void)
{
}

void tearDown(void)
{
}

#define MUST(call) TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, call, error.text)

static void run(const struct driver_options *options, struct ocean_bench *bench,
                struct driver_reading readings[SHOTS], struct driver_identity *identity)
{
    static const char *const skins[SHOTS] = { "lightness 75", "lightness 55", "lightness 30" };
    struct instrument *in;
    struct driver_status status;
    MUST(driver->open(options, &in, identity, &error));
    MUST(driver->status(in, &status, &error));
    MUST(driver->calibrate(in, DRIVER_CALIBRATION_ZERO, &error));
    MUST(driver->calibrate(in, DRIVER_CALIBRATION_WHITE, &error));
    for (int i = 0; i < SHOTS; i++) {
        if (bench != NULL)
            TEST_ASSERT_TRUE(wire_memory_act(bench->memory, skins[i]));
        MUST(driver->measure(in, &readings[i], &error));
    }
    MUST(driver->status(in, &status, &error));
    driver->close(in);
}

/* ---- writing ------------------------------------------------------------------------------------
 */

static void write_readings(const struct driver_reading *readings)
{
    FILE *f = fopen(READINGS, "we");
    char text[NUMBER_TEXT_SIZE];
    TEST_ASSERT_NOT_NULL(f);
    fprintf(f, "# what " CAPTURE " gives, digit for digit\nid,specular");
    for (int nm = 400; nm <= 700; nm += 10)
        fprintf(f, ",%d", nm);
    for (int i = 0; i < SHOTS; i++) {
        fprintf(f, "\nshot-%d,sce", i + 1);
        for (size_t b = 0; b < BANDS; b++)
            fprintf(f, ",%s", number_format_exact(readings[i].sce.value[b], text));
    }
    fprintf(f, "\n");
    fclose(f);
}

static void measure_live(void)
{
    static struct ocean_bench bench;
    static struct driver_reading readings[SHOTS];
    struct driver_identity identity;
    ocean_bench_make(&bench, &sim_usb2000, "noise=0,lamp=0.07");
    bench.hands = true;
    struct driver_options options = { .address = "usb" OPTIONS, .wire = &bench.source };
    run(&options, &bench, readings, &identity);
    ocean_bench_free(&bench);
    write_readings(readings);
}

/* ---- replaying ----------------------------------------------------------------------------------
 */

static void test_replay_gives_the_same_readings(void)
{
    static struct driver_reading readings[SHOTS];
    struct driver_identity identity;
    struct driver_options options = { .address = "replay:" CAPTURE OPTIONS };
    char line[4096];
    size_t row = 0;
    run(&options, NULL, readings, &identity);
    TEST_ASSERT_EQUAL_STRING("USB2000+", identity.model);
    TEST_ASSERT_EQUAL_STRING("SIM00042", identity.serial);
    FILE *f = fopen(READINGS, "re");
    TEST_ASSERT_NOT_NULL(f);
    while (fgets(line, sizeof line, f) != NULL) {
        if (strncmp(line, "shot-", 5) != 0)
            continue;
        char *at = strtok(line, ",\n");
        at = strtok(NULL, ",\n");
        TEST_ASSERT_EQUAL_STRING("sce", at);
        for (size_t b = 0; b < BANDS; b++) {
            double expect;
            at = strtok(NULL, ",\n");
            TEST_ASSERT_TRUE(at != NULL && number_parse(at, &expect) == STATUS_OK);
            TEST_ASSERT_TRUE(row < SHOTS && expect == readings[row].sce.value[b]);
        }
        row++;
    }
    fclose(f);
    TEST_ASSERT_EQUAL_size_t(SHOTS, row);
}

int main(int argc, char **argv)
{
    UNITY_BEGIN();
    if (argc > 1 && strcmp(argv[1], "--write") == 0)
        RUN_TEST(measure_live);
    RUN_TEST(test_replay_gives_the_same_readings);
    return UNITY_END();
}
