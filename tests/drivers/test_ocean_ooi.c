/* test_ocean_ooi.c - the Ocean driver against the simulated spectrometer, its scene and its
 * faults. */
#include "drivers/ocean_ooi/ocean_ooi.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "tests/support/dice.h"
#include "tests/support/ocean_bench.h"
#include "tests/support/patience.h"
#include "unity.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))
enum { BANDS = 31, REPLIES = 0x81, SPECTRA = 0x82, EARLY = 0x86 };

static const struct driver *const driver = &ocean_ooi_driver;
/* Of a reply: at delays=0 as short as can be, in real time for a busy machine. */
enum { REPLY_MS = 25, REAL_TIME_REPLY_MS = 150 };

static struct ocean_bench bench;
static struct instrument *instrument;
static int reply_ms;
static struct driver_identity identity;
static struct driver_error error;
static struct driver_reading reading;

void setUp(void)
{
    instrument = NULL;
    reply_ms = REPLY_MS;
}

static void shut(void)
{
    driver->close(instrument);
    instrument = NULL;
}

/* Nobody has written the EEPROM, whatever the test did. */
void tearDown(void)
{
    shut();
    if (bench.memory != NULL)
        TEST_ASSERT_TRUE(wire_memory_act(bench.memory, "unwritten"));
    ocean_bench_free(&bench);
    ocean_bench_clean();
}

/* ---- helpers ------------------------------------------------------------------------ */

#define EXPECT(expect, call) \
    do { \
        memset(&error, 0, sizeof error); \
        enum driver_result result_ = (call); \
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect, result_, error.text); \
        if (result_ != DRIVER_OK) \
            TEST_ASSERT_TRUE(error.result == result_ && strlen(error.text) > 20); \
    } while (0)

static void act(const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(wire_memory_act(bench.memory, action), action);
}

static enum driver_result try_to_open(const char *address)
{
    struct driver_options options = { .address = address,
                                      .open_timeout_ms = 3000,
                                      .reply_timeout_ms = reply_ms,
                                      .wire = &bench.source };
    return driver->open(&options, &instrument, &identity, &error);
}

static void open_with(const struct sim_kind *kind, const char *options)
{
    ocean_bench_make(&bench, kind, options);
    EXPECT(DRIVER_OK, try_to_open(ocean_bench_address()));
}

static enum driver_result zero(void)
{
    act("place black");
    return driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error);
}

static enum driver_result white(void)
{
    act("place white");
    return driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error);
}

static void calibrate(void)
{
    EXPECT(DRIVER_OK, zero());
    EXPECT(DRIVER_OK, white());
}

static enum driver_result measure(void)
{
    return driver->measure(instrument, &reading, &error);
}

static bool due(enum driver_calibration step)
{
    struct driver_status status;
    EXPECT(DRIVER_OK, driver->status(instrument, &status, &error));
    return status.due[step];
}

/* Worst and sum of squares of a reading against the truth, as a band sees it: its triangle over
 * the truth in steps of 0.25 nm. */
struct deviation {
    double worst, sum;
    size_t n;
};

static double truth_in_band(double centre)
{
    double sum = 0.0, weight = 0.0;
    for (double at = -10.0; at <= 10.0; at += 0.25) {
        double w = 1.0 - fabs(at) / 10.0;
        sum += w * wire_memory_truth(bench.memory, centre + at, false);
        weight += w;
    }
    return sum / weight;
}

static void deviate(struct deviation *d)
{
    for (size_t b = 0; b < BANDS; b++) {
        double off = reading.sce.value[b] - truth_in_band(400.0 + 10.0 * (double)b);
        d->worst = fmax(d->worst, fabs(off));
        d->sum += off * off;
        d->n++;
    }
}

static double rms(const struct deviation *d)
{
    return sqrt(d->sum / (double)d->n);
}

static const char *const samples[] = {
    "place white",  "place grey 60", "place grey 35", "place grey 18", "place grey 5",
    "lightness 80", "lightness 65",  "lightness 50",  "lightness 35",  "lightness 25",
};

static void place(const char *sample)
{
    if (strncmp(sample, "lightness", 9) == 0)
        act("place skin");
    act(sample);
}

/* ---- who it is ---------------------------------------------------------------------- */

static const struct {
    const struct sim_kind *kind;
    const char *options, *model;
} models[] = {
    { &sim_usb2000, "delays=0,serial=USB2P12", "USB2000+" },
    { &sim_usb2000, "delays=0,serial=USB2P12,flame=1", "Flame-S" },
    { &sim_usb4000, "delays=0,serial=USB2P12", "USB4000" },
    { &sim_usb4000, "delays=0,serial=USB2P12,speed=full", "USB4000" },
    { &sim_hr2000, "delays=0,serial=USB2P12", "HR2000+" },
    { &sim_hr4000, "delays=0,serial=USB2P12", "HR4000" },
};

static void test_identity(void)
{
    for (size_t i = 0; i < COUNT(models); i++) {
        open_with(models[i].kind, models[i].options);
        TEST_ASSERT_EQUAL_STRING("Ocean Optics", identity.maker);
        TEST_ASSERT_EQUAL_STRING(models[i].model, identity.model);
        TEST_ASSERT_EQUAL_STRING("USB2P12", identity.serial);
        TEST_ASSERT_EQUAL_STRING_LEN("FPGA ", identity.firmware, 5);
        TEST_ASSERT_EQUAL_STRING("SIM-WHITE", identity.white_tile);
        TEST_ASSERT_TRUE(identity.has_sce && !identity.has_sci);
        TEST_ASSERT_EQUAL_DOUBLE(8.0, identity.aperture_mm[0]);
        shut();
    }
}

/* A link that cannot tell (a replay): the address says it, else the pixels. */
static void test_model_without_pid(void)
{
    char address[600];
    ocean_bench_make(&bench, &sim_usb4000, "delays=0");
    bench.pid = 0;
    EXPECT(DRIVER_OK, try_to_open(ocean_bench_address()));
    TEST_ASSERT_EQUAL_STRING("USB4000", identity.model);
    shut();
    ocean_bench_make(&bench, &sim_hr4000, "delays=0");
    bench.pid = 0;
    snprintf(address, sizeof address, "%s,model=hr4000", ocean_bench_address());
    EXPECT(DRIVER_OK, try_to_open(address));
    TEST_ASSERT_EQUAL_STRING("HR4000", identity.model);
    shut();
    snprintf(address, sizeof address, "%s,model=usb2000+", ocean_bench_address());
    EXPECT(DRIVER_UNSUPPORTED, try_to_open(address));
    bench.pid = 0x1012;
    snprintf(address, sizeof address, "%s,model=usb4000", ocean_bench_address());
    EXPECT(DRIVER_UNSUPPORTED, try_to_open(address));
}

static const struct {
    const char *fault;
    enum driver_result expect;
} slot_faults[] = {
    { "fault slot 1 ", DRIVER_PROTOCOL },         /* empty */
    { "fault slot 1 339,51", DRIVER_PROTOCOL },   /* a comma */
    { "fault slot 2 -0.37", DRIVER_UNSUPPORTED }, /* falling wavelengths */
    { "fault slot 1 600", DRIVER_UNSUPPORTED },   /* near infrared */
    { "fault slot 6 0.1", DRIVER_PROTOCOL },      /* ten times too much light */
    { "fault slot 14 9", DRIVER_PROTOCOL },       /* no such order */
    { "fault slot 14 1.5", DRIVER_PROTOCOL },
    { "fault slots", DRIVER_PROTOCOL },
    { "fault slot 0 ", DRIVER_OK },
    { "fault slot 0 hex:ff80411b7f", DRIVER_OK },
};

static void test_bad_slots(void)
{
    for (size_t i = 0; i < COUNT(slot_faults); i++) {
        ocean_bench_make(&bench, &sim_usb2000, "delays=0");
        act(slot_faults[i].fault);
        memset(&error, 0, sizeof error);
        enum driver_result r = try_to_open(ocean_bench_address());
        TEST_ASSERT_EQUAL_INT_MESSAGE(slot_faults[i].expect, r, slot_faults[i].fault);
        if (r == DRIVER_OK) {
            TEST_ASSERT_TRUE(strspn(identity.serial, "?A") == strlen(identity.serial));
            shut();
        }
    }
}

static void test_bad_level(void)
{
    ocean_bench_make(&bench, &sim_usb2000, "delays=0,level=1000");
    EXPECT(DRIVER_PROTOCOL, try_to_open(ocean_bench_address()));
}

static void test_no_tile_no_instrument(void)
{
    ocean_bench_make(&bench, &sim_usb2000, "delays=0");
    EXPECT(DRIVER_UNSUPPORTED, try_to_open("usb,port_mm=8"));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "tile"));
    EXPECT(DRIVER_UNSUPPORTED, try_to_open("usb,port_mm=8,tile=/nowhere/tile.csv"));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "/nowhere/tile.csv"));
    TEST_ASSERT_EQUAL_UINT(0, wire_memory_sends(bench.memory));
}

/* ---- reflectance -------------------------------------------------------------------- */

static void measure_all(struct deviation *d, unsigned averages)
{
    struct driver_setup setup = { .averages = averages };
    EXPECT(DRIVER_OK, driver->configure(instrument, &setup, &error));
    for (size_t i = 0; i < COUNT(samples); i++) {
        place(samples[i]);
        EXPECT(DRIVER_OK, measure());
        TEST_ASSERT_EQUAL_UINT(0, reading.warnings);
        deviate(d);
    }
}

/* Without noise what is left is rounding to counts, the fixed pattern at the two times of the
 * zero, the tile's interpolation, and stray light that a sphere adds to all. */
static const struct accuracy_case {
    const struct sim_kind *kind;
    const char *options;
    unsigned averages;
    double rms, worst; /* bars; what is measured is printed */
} accuracy_cases[] = {
    { &sim_usb2000, "delays=0,noise=0", 1, 2e-4, 5e-4 },
    { &sim_usb4000, "delays=0,noise=0", 1, 2e-4, 5e-4 },
    { &sim_usb2000, "delays=0,seed=5", 1, 1.5e-3, 6e-3 },
    { &sim_usb2000, "delays=0,seed=6", 10, 6e-4, 3e-3 },
    { &sim_usb4000, "delays=0,seed=7", 1, 1.5e-3, 8e-3 },
    { &sim_usb4000, "delays=0,seed=8,speed=full,level=0", 10, 6e-4, 3e-3 },
    { &sim_hr2000, "delays=0,seed=9", 10, 6e-4, 3e-3 },
    { &sim_hr4000, "delays=0,seed=10", 10, 6e-4, 3e-3 },
};

static void test_accuracy(void)
{
    for (size_t i = 0; i < COUNT(accuracy_cases); i++) {
        const struct accuracy_case *c = &accuracy_cases[i];
        struct deviation d = { 0.0, 0.0, 0 };
        open_with(c->kind, c->options);
        calibrate();
        measure_all(&d, c->averages);
        printf("%s %s, %u averaged: rms %.5f, worst %.5f of %zu bands\n", c->kind->name, c->options,
               c->averages, rms(&d), d.worst, d.n);
        TEST_ASSERT_TRUE(rms(&d) <= c->rms && d.worst <= c->worst);
        shut();
    }
}

/* ---- substitution ------------------------------------------------------------------- */

/* Measure the greys as they are read, and write them beside their truth. */
static void write_greys(const char *path)
{
    static const int greys[] = { 5, 20, 40, 60 };
    FILE *f = fopen(path, "we");
    TEST_ASSERT_NOT_NULL(f);
    fprintf(f, "id,what,specular");
    for (int nm = 400; nm <= 700; nm += 10)
        fprintf(f, ",%d", nm);
    for (size_t i = 0; i < COUNT(greys); i++) {
        char action[32];
        snprintf(action, sizeof action, "place grey %d", greys[i]);
        act(action);
        EXPECT(DRIVER_OK, measure());
        fprintf(f, "\nG%d,measured,sce", greys[i]);
        for (size_t b = 0; b < BANDS; b++)
            fprintf(f, ",%.6f", reading.sce.value[b]);
        fprintf(f, "\nG%d,certified,sce", greys[i]);
        for (size_t b = 0; b < BANDS; b++)
            fprintf(f, ",%.6f", greys[i] / 100.0);
    }
    fclose(f);
}

static void test_substitution(void)
{
    static const char *const spheres[] = { "substitution=0.002", "substitution=0.005",
                                           "substitution=0.01", "substitution=0.02" };
    for (size_t i = 0; i < COUNT(spheres); i++) {
        struct deviation raw = { 0.0, 0.0, 0 }, corrected = { 0.0, 0.0, 0 };
        char options[64], address[900];
        snprintf(options, sizeof options, "delays=0,noise=0.2,%s", spheres[i]);
        open_with(&sim_usb2000, options);
        calibrate();
        measure_all(&raw, 4);
        write_greys(ocean_bench_path("greys.csv"));
        shut();
        int n = snprintf(address, sizeof address, "%s", ocean_bench_address());
        snprintf(address + n, sizeof address - (size_t)n, ",greys=%s",
                 ocean_bench_path("greys.csv"));
        EXPECT(DRIVER_OK, try_to_open(address));
        calibrate();
        measure_all(&corrected, 4);
        printf("%s: rms %.5f, worst %.5f; with greys rms %.5f, worst %.5f\n", spheres[i], rms(&raw),
               raw.worst, rms(&corrected), corrected.worst);
        TEST_ASSERT_TRUE(rms(&corrected) < 0.5 * rms(&raw));
        TEST_ASSERT_TRUE(corrected.worst < 0.5 * raw.worst);
        shut();
    }
}

/* expect: what sha256sum prints of the file. */
static void expect_hash_of(const char *path, const char *got)
{
    char command[1024], hash[17] = "";
    snprintf(command, sizeof command, "sha256sum '%s'", path);
    FILE *sum = popen(command, "re");
    TEST_ASSERT_NOT_NULL(sum);
    TEST_ASSERT_NOT_NULL(fgets(hash, sizeof hash, sum));
    while (fgetc(sum) != EOF)
        ;
    TEST_ASSERT_EQUAL_INT(0, pclose(sum));
    TEST_ASSERT_EQUAL_size_t(16, strlen(hash));
    TEST_ASSERT_EQUAL_STRING(hash, got);
}

/* Records refer to it: whether the readings were corrected, and by which file. */
static void test_identity_names_the_correction(void)
{
    char address[900], plain[DRIVER_NAME_SIZE];
    static const char correction[] = ", greys ";
    open_with(&sim_usb2000, "delays=0,noise=0.2,substitution=0.01");
    strcpy(plain, identity.firmware);
    TEST_ASSERT_NULL(strstr(plain, "greys"));
    calibrate();
    write_greys(ocean_bench_path("greys.csv"));
    shut();
    int n = snprintf(address, sizeof address, "%s", ocean_bench_address());
    snprintf(address + n, sizeof address - (size_t)n, ",greys=%s", ocean_bench_path("greys.csv"));
    EXPECT(DRIVER_OK, try_to_open(address));
    TEST_ASSERT_EQUAL_STRING_LEN(plain, identity.firmware, strlen(plain));
    TEST_ASSERT_EQUAL_STRING_LEN(correction, identity.firmware + strlen(plain), strlen(correction));
    expect_hash_of(ocean_bench_path("greys.csv"),
                   identity.firmware + strlen(plain) + strlen(correction));
    shut();
}

static void test_greys_of_another_sphere_are_refused(void)
{
    char address[900];
    const char *path = ocean_bench_path("greys.csv");
    FILE *f = fopen(path, "we");
    TEST_ASSERT_NOT_NULL(f);
    fprintf(f, "id,what,specular,400,420,440,460,480,500,520,540,560,580,600,620,640,660,680,700");
    fprintf(f, "\nG,certified,sce");
    for (int i = 0; i < 16; i++)
        fprintf(f, ",0.2");
    fprintf(f, "\nG,measured,sce");
    for (int i = 0; i < 16; i++)
        fprintf(f, ",0.3"); /* a darker sample never looks brighter in a sphere */
    fclose(f);
    ocean_bench_make(&bench, &sim_usb2000, "delays=0");
    snprintf(address, sizeof address, "%s,greys=%s", ocean_bench_address(), path);
    EXPECT(DRIVER_UNSUPPORTED, try_to_open(address));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "greys"), error.text);
}

/* ---- what is refused ---------------------------------------------------------------- */

static void test_white_for_zero(void)
{
    open_with(&sim_usb2000, "delays=0");
    act("place white");
    EXPECT(DRIVER_IMPLAUSIBLE, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    TEST_ASSERT_TRUE(due(DRIVER_CALIBRATION_ZERO));
    calibrate();
    act("place white");
    EXPECT(DRIVER_IMPLAUSIBLE, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    TEST_ASSERT_FALSE(due(DRIVER_CALIBRATION_ZERO)); /* the last good one stands */
}

/* A lamp so weak that the white tile does not show in the first zero; the white step sees it. */
static void test_swapped(void)
{
    open_with(&sim_usb2000, "delays=0,lamp=0.07");
    act("place white");
    if (driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error) == DRIVER_OK) {
        act("place black");
        EXPECT(DRIVER_IMPLAUSIBLE, driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    }
    calibrate();
}

static void test_black_for_white(void)
{
    open_with(&sim_usb2000, "delays=0");
    EXPECT(DRIVER_OK, zero());
    act("place black");
    EXPECT(DRIVER_IMPLAUSIBLE, driver->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    TEST_ASSERT_TRUE(due(DRIVER_CALIBRATION_WHITE));
    EXPECT(DRIVER_OK, white());
}

static void test_lamps(void)
{
    open_with(&sim_usb2000, "delays=0,lamp=0.01");
    EXPECT(DRIVER_OK, zero());
    EXPECT(DRIVER_IMPLAUSIBLE, white()); /* too weak */
    shut();
    open_with(&sim_usb2000, "delays=0,lamp=60");
    EXPECT(DRIVER_OK, zero());
    EXPECT(DRIVER_IMPLAUSIBLE, white()); /* above 70 % even in a millisecond */
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "too bright"), error.text);
    shut();
    open_with(&sim_usb4000, "delays=0,lamp=60"); /* which can do with less */
    calibrate();
}

static void test_lamp_fails(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    act("place skin");
    act("fault lamp");
    EXPECT(DRIVER_IMPLAUSIBLE, measure());
    EXPECT(DRIVER_IMPLAUSIBLE, white());
    act("fault none");
    act("place skin");
    EXPECT(DRIVER_OK, measure());
}

static void test_saturated_sample(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    act("place white");
    act("lamp 1.5");
    EXPECT(DRIVER_IMPLAUSIBLE, measure());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "saturates"), error.text);
}

/* Between two whites: refused and due; the one after agrees with it. */
static void test_lamp_drift(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    act("lamp 1.006");
    EXPECT(DRIVER_OK, white());
    act("lamp 1.03");
    EXPECT(DRIVER_REFUSED, white());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "2.4 %"), error.text);
    TEST_ASSERT_TRUE(due(DRIVER_CALIBRATION_WHITE));
    act("place skin");
    EXPECT(DRIVER_REFUSED, measure());
    EXPECT(DRIVER_OK, white());
    act("place skin");
    EXPECT(DRIVER_OK, measure());
}

/* Within one: 100 % a minute, in real time. */
static void test_lamp_drift_within_a_white(void)
{
    reply_ms = REAL_TIME_REPLY_MS;
    open_with(&sim_usb2000, "drift=100,lamp=0.2,noise=0.1");
    EXPECT(DRIVER_OK, zero());
    EXPECT(DRIVER_REFUSED, white());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "within"), error.text);
}

/* ---- stale spectra ------------------------------------------------------------------------------
 */

/* In real time, with what the USB2000+ takes ahead by itself: each reading is of what lies there.
 */
static void test_no_reading_is_of_the_last_scene(void)
{
    static const struct sim_kind *const kinds[] = { &sim_usb2000, &sim_usb4000 };
    reply_ms = REAL_TIME_REPLY_MS;
    for (size_t i = 0; i < COUNT(kinds); i++) {
        open_with(kinds[i], "lamp=12,noise=0.1");
        calibrate();
        for (int round = 0; round < 6; round++) {
            struct deviation d = { 0.0, 0.0, 0 };
            act(round % 2 == 0 ? "place grey 10" : "place grey 70");
            EXPECT(DRIVER_OK, measure());
            deviate(&d);
            TEST_ASSERT_TRUE(d.worst < 0.01);
        }
        shut();
    }
}

/* ---- faults of the wire
 * -------------------------------------------------------------------------- */

static const struct {
    const char *fault;
    enum driver_result first; /* of the reading during it; the one after is good */
} wire_faults[] = {
    { "fault sync", DRIVER_OK },           { "fault truncate 100", DRIVER_OK },
    { "fault truncate 512", DRIVER_OK },   { "fault truncate 4096", DRIVER_OK },
    { "fault overlong 3", DRIVER_OK },     { "fault overlong 600", DRIVER_OK },
    { "fault stall 82", DRIVER_OK },       { "fault stall 81", DRIVER_OK },
    { "fault stale", DRIVER_TIMEOUT },     { "fault twice", DRIVER_OK },
    { "fault short", DRIVER_OK },          { "fault hang", DRIVER_OK },
    { "fault mute", DRIVER_TIMEOUT },      { "fault silent 81", DRIVER_TIMEOUT },
    { "fault silent 82", DRIVER_TIMEOUT }, { "fault delay 200", DRIVER_TIMEOUT },
};

/* Whatever happens: the right reading, or an error and then the right reading. */
static void check_wire_faults(const struct sim_kind *kind)
{
    for (size_t i = 0; i < COUNT(wire_faults); i++) {
        open_with(kind, "delays=0,noise=0.1");
        calibrate();
        act("place grey 70");
        EXPECT(DRIVER_OK, measure());
        act("place grey 20");
        act(wire_faults[i].fault);
        memset(&error, 0, sizeof error);
        enum driver_result r = measure();
        TEST_ASSERT_TRUE_MESSAGE(r == wire_faults[i].first ||
                                     (r == DRIVER_TIMEOUT && strstr(wire_faults[i].fault, "hang")),
                                 wire_faults[i].fault);
        for (int shot = 0; shot < 4; shot++) {
            struct deviation d = { 0.0, 0.0, 0 };
            if (r == DRIVER_OK) {
                deviate(&d);
                TEST_ASSERT_TRUE_MESSAGE(d.worst < 0.01, wire_faults[i].fault);
            }
            act("fault none");
            act(shot % 2 == 0 ? "place grey 45" : "place grey 12");
            /* What comes later still than the next call's deadline ends that one too. */
            for (int tries = 0; (r = measure()) == DRIVER_TIMEOUT && tries < 3; tries++)
                TEST_ASSERT_TRUE_MESSAGE(shot == 0, wire_faults[i].fault);
            TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, r, wire_faults[i].fault);
        }
        shut();
    }
}

static void test_wire_faults_usb2000(void)
{
    check_wire_faults(&sim_usb2000);
}

static void test_wire_faults_usb4000(void)
{
    check_wire_faults(&sim_usb4000);
}

/* The same fault every time: the second is the end of it. */
static void test_sync_never_comes(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    ocean_bench_spoil(&bench, SPECTRA, 0, 4096, 0xff);
    bench.every = true;
    EXPECT(DRIVER_PROTOCOL, measure());
    bench.every = false;
    act("place skin");
    EXPECT(DRIVER_OK, measure());
}

/* FE tells another time than was set: never taken for good. */
static void test_integration_is_read_back(void)
{
    open_with(&sim_usb2000, "delays=0");
    ocean_bench_spoil(&bench, REPLIES, 0, 3, 0x40);
    bench.every = true;
    act("place black");
    EXPECT(DRIVER_PROTOCOL, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    bench.every = false;
    calibrate();
}

/* It was reset between two readings: lamp line and time are gone, and so is the calibration. */
static void test_reset_by_itself(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    act("place skin");
    act("reset");
    memset(&reading, 0x77, sizeof reading);
    enum driver_result r = measure();
    TEST_ASSERT_TRUE(r == DRIVER_REFUSED || r == DRIVER_IMPLAUSIBLE);
    r = measure();
    TEST_ASSERT_TRUE(r == DRIVER_REFUSED || r == DRIVER_IMPLAUSIBLE);
    EXPECT(DRIVER_OK, white());
    act("place skin");
    EXPECT(DRIVER_OK, measure());
}

static void test_unplugged(void)
{
    open_with(&sim_usb2000, "delays=0");
    calibrate();
    wire_memory_unplug(bench.memory); /* while idle */
    EXPECT(DRIVER_GONE, measure());
    EXPECT(DRIVER_GONE, driver->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    shut();
    wire_memory_plug(bench.memory);
    EXPECT(DRIVER_OK, try_to_open(ocean_bench_address()));
    calibrate();
    act("fault gone"); /* in mid-frame */
    EXPECT(DRIVER_GONE, measure());
    shut();
    wire_memory_plug(bench.memory);
    for (unsigned sends = 1; sends <= 4; sends++) {
        wire_memory_unplug_at(bench.memory, sends, 0); /* between command and reply */
        memset(&error, 0, sizeof error);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_GONE, try_to_open(ocean_bench_address()), error.text);
        wire_memory_plug(bench.memory);
    }
}

/* ---- corruption
 * ------------------------------------------------------------------------------------ */

/* One byte of one frame is another: the frame is taken again (right), refused, or used.  USB's CRC
 * keeps this from happening; what the driver's own checks let through is counted. */
static void test_corrupt_bytes_of_a_spectrum(void)
{
    static const uint8_t masks[] = { 0xff, 0x80, 0x20, 0x08, 0x04, 0x01 };
    unsigned shots = 0, refused = 0, off = 0;
    double worst = 0.0, good[BANDS];
    open_with(&sim_usb2000, "delays=0,noise=0");
    calibrate();
    act("place skin");
    act("lightness 45");
    EXPECT(DRIVER_OK, measure());
    memcpy(good, reading.sce.value, sizeof good);
    for (size_t byte = 0; byte < 4097; byte += byte < 48 ? 1 : 29)
        for (size_t m = 0; m < COUNT(masks); m++, shots++) {
            double most = 0.0;
            ocean_bench_spoil(&bench, SPECTRA, 3, byte, masks[m]);
            memset(&error, 0, sizeof error);
            if (measure() != DRIVER_OK) {
                refused++;
                continue;
            }
            TEST_ASSERT_TRUE(bench.spoiled);
            for (size_t b = 0; b < BANDS; b++)
                most = fmax(most, fabs(reading.sce.value[b] - good[b]));
            off += most > 1e-4;
            worst = fmax(worst, most);
        }
    printf("%u corrupted bytes: %u refused, %u readings off by more than 0.0001, worst %.5f\n",
           shots, refused, off, worst);
    TEST_ASSERT_TRUE(worst < 0.008);
}

/* One byte of each answer of an opening, and of a status: never another identity that could be
 * believed, but for what only the CRC guards: text and digits of the slots. */
static void test_corrupt_bytes_of_replies(void)
{
    unsigned tries = 0, refused = 0, same = 0;
    struct driver_identity good;
    open_with(&sim_usb2000, "delays=0,noise=0");
    good = identity;
    shut();
    for (unsigned reply = 1; reply <= 20; reply++)
        for (size_t byte = 0; byte < 17; byte += 3) {
            ocean_bench_spoil(&bench, REPLIES, reply, byte, byte % 2 == 0 ? 0x80 : 0x02);
            memset(&error, 0, sizeof error);
            memset(&identity, 0, sizeof identity);
            enum driver_result r = try_to_open(ocean_bench_address());
            tries++;
            refused += r != DRIVER_OK;
            same += r == DRIVER_OK && strcmp(good.serial, identity.serial) == 0 &&
                    strcmp(good.model, identity.model) == 0 &&
                    strcmp(good.firmware, identity.firmware) == 0;
            shut();
        }
    printf("%u corrupted reply bytes at opening: %u refused, %u opened the same, %u otherwise\n",
           tries, refused, same, tries - refused - same);
    TEST_ASSERT_TRUE(refused + same >= tries * 3 / 4);
}

/* ---- time
 * -------------------------------------------------------------------------------------------- */

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What the driver adds: a reading's time less that of the same three spectra from the
 * simulator, asked for without a driver. */
static void test_a_reading_adds_two_milliseconds_at_most(void)
{
    enum { SHOTS = 41 };
    double took[SHOTS], bare[SHOTS];
    uint8_t bytes[8192];
    const struct sim_kind *kind = &sim_usb2000;
    struct sim *sim = kind->make("delays=0");
    TEST_ASSERT_NOT_NULL(sim);
    open_with(kind, "delays=0");
    calibrate();
    act("place skin");
    for (int i = 0; i < SHOTS; i++) {
        double began = now_ms();
        EXPECT(DRIVER_OK, measure());
        took[i] = now_ms() - began;
        began = now_ms();
        for (int frame = 0; frame < 3; frame++) {
            int64_t due_us, at_us = (int64_t)(now_ms() * 1e3);
            TEST_ASSERT_EQUAL_INT(0, kind->take(sim, 0x01, (const uint8_t[]){ 0x09 }, 1, at_us));
            TEST_ASSERT_EQUAL_INT(4097, kind->give(sim, SPECTRA, bytes, 4608, at_us + 1, &due_us));
        }
        bare[i] = now_ms() - began;
    }
    kind->free(sim);
    qsort(took, SHOTS, sizeof *took, by_size);
    qsort(bare, SHOTS, sizeof *bare, by_size);
    printf("a reading: %.3f ms (median), of which the simulator's three spectra %.3f ms\n",
           took[SHOTS / 2], bare[SHOTS / 2]);
    TEST_ASSERT_TRUE(took[SHOTS / 2] - bare[SHOTS / 2] <= patience_ms(2));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_identity);
    RUN_TEST(test_model_without_pid);
    RUN_TEST(test_bad_slots);
    RUN_TEST(test_bad_level);
    RUN_TEST(test_no_tile_no_instrument);
    RUN_TEST(test_accuracy);
    RUN_TEST(test_substitution);
    RUN_TEST(test_identity_names_the_correction);
    RUN_TEST(test_greys_of_another_sphere_are_refused);
    RUN_TEST(test_white_for_zero);
    RUN_TEST(test_swapped);
    RUN_TEST(test_black_for_white);
    RUN_TEST(test_lamps);
    RUN_TEST(test_lamp_fails);
    RUN_TEST(test_saturated_sample);
    RUN_TEST(test_lamp_drift);
    RUN_TEST(test_lamp_drift_within_a_white);
    RUN_TEST(test_no_reading_is_of_the_last_scene);
    RUN_TEST(test_wire_faults_usb2000);
    RUN_TEST(test_wire_faults_usb4000);
    RUN_TEST(test_sync_never_comes);
    RUN_TEST(test_integration_is_read_back);
    RUN_TEST(test_reset_by_itself);
    RUN_TEST(test_unplugged);
    RUN_TEST(test_corrupt_bytes_of_a_spectrum);
    RUN_TEST(test_corrupt_bytes_of_replies);
    RUN_TEST(test_a_reading_adds_two_milliseconds_at_most);
    return UNITY_END();
}
