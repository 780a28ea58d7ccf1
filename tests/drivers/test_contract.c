/* test_contract.c - the contract of every driver in the registry, and the names. */
#include "tests/drivers/contract.h"

#include <string.h>

#include "drivers/km_ascii/km_ascii.h"
#include "drivers/registry.h"
#include "drivers/ocean_ooi/ocean_ooi.h"
#include "drivers/simulated/simulated.h"
#include "tests/drivers/cue.h"
#include "tests/support/ocean_bench.h"
#include "unity.h"

/* ---- how to have each instrument ----------------------------------------------------- */

static const char *set_up_simulated(enum contract_situation situation)
{
    static const char *const address[CONTRACT_SITUATIONS] = {
        [CONTRACT_SOUND] = "speed=instant,stored=3",
        [CONTRACT_TAKES_TIME] = "shot_ms=1000,calibrate_ms=1000,charge_ms=100",
        [CONTRACT_FALLS_SILENT] = "speed=instant,fault=measure:2:silence",
        [CONTRACT_SILENT] = "speed=instant,fault=open:1:silence",
    };
    return address[situation];
}

static void tear_down_simulated(void)
{
}

/* Simulators on a wire in this program. */
static struct cued_wire wire;

static const struct link_source *wire_source(void)
{
    return &wire.source;
}

static void connect(const struct sim_kind *kind, const char *options, const char *zero)
{
    cued_wire_init(&wire, wire_memory_make(kind, options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    /* The operator does as he is told. */
    cue(&wire, zero, CUE_ALWAYS, "place black");
    cue(&wire, "CAL", CUE_ALWAYS, "place white");
    cue(&wire, "MES", CUE_ALWAYS, "place skin");
}

static void disconnect(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

static const char *set_up_cm700d(enum contract_situation situation)
{
    connect(&sim_cm700d, situation == CONTRACT_TAKES_TIME ? "delays=0.65" : "delays=0,samples=3",
            "ZRC");
    if (situation == CONTRACT_FALLS_SILENT)
        cue(&wire, "MES", 2, "fault silence");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

/* Its answer to a shot is the spectrum: it may take as long as that. */
static const char *set_up_cm2600d(enum contract_situation situation)
{
    if (situation == CONTRACT_FALLS_SILENT)
        return NULL;
    connect(&sim_cm2600d, situation == CONTRACT_TAKES_TIME ? "delays=0.7" : "delays=0", "UZC");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

static struct ocean_bench ocean;

static const char *set_up_ocean(enum contract_situation situation)
{
    /* A lamp so weak that white takes 200 ms, and a reading three times that. */
    const char *options =
        situation == CONTRACT_TAKES_TIME ? "under=black,lamp=0.08,noise=0" : "under=black,delays=0";
    ocean_bench_make(&ocean, &sim_usb2000, options);
    ocean.hands = true;
    if (situation == CONTRACT_SILENT)
        (void)wire_memory_act(ocean.memory, "fault mute");
    if (situation == CONTRACT_FALLS_SILENT)
        ocean.silent_measure = 2;
    return ocean_bench_address();
}

static void tear_down_ocean(void)
{
    ocean_bench_free(&ocean);
    ocean_bench_clean();
}

static const struct link_source *wire_ocean(void)
{
    return &ocean.source;
}

static const struct contract_fixture fixtures[] = {
    { .driver = &simulated_driver,
      .set_up = set_up_simulated,
      .tear_down = tear_down_simulated,
      .deterministic = true },
    { .driver = &km_ascii_driver,
      .set_up = set_up_cm700d,
      .tear_down = disconnect,
      .wire = wire_source,
      .deterministic = true },
    { .driver = &km_ascii_driver,
      .set_up = set_up_cm2600d,
      .tear_down = disconnect,
      .wire = wire_source,
      .deterministic = true },
    { .driver = &ocean_ooi_driver,
      .set_up = set_up_ocean,
      .tear_down = tear_down_ocean,
      .wire = wire_ocean,
      .deterministic = true },
};
enum { FIXTURES = sizeof fixtures / sizeof *fixtures };

static bool contract_runs;

void setUp(void)
{
    if (contract_runs)
        contract_set_up();
}

void tearDown(void)
{
    if (contract_runs)
        contract_tear_down();
}

/* ---- the registry ---------------------------------------------------------------------- */

static void test_every_driver_is_under_contract(void)
{
    size_t n = 0;
    for (; driver_registry[n] != NULL; n++) {
        const struct driver *d = driver_registry[n];
        bool found = false;
        for (size_t i = 0; i < FIXTURES; i++)
            found = found || fixtures[i].driver == d;
        TEST_ASSERT_TRUE_MESSAGE(found, d->name);
        TEST_ASSERT_EQUAL_PTR_MESSAGE(d, driver_find(d->name), d->name);
    }
    TEST_ASSERT_TRUE(FIXTURES >= n); /* a driver of several models has several */
}

static void test_find_refuses(void)
{
    static const char *const unknown[] = { "", "Simulated", "simulated:", "simulate", "km" };
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        TEST_ASSERT_NULL_MESSAGE(driver_find(unknown[i]), unknown[i]);
}

/* ---- names ------------------------------------------------------------------------------- */

static const char *result_name(size_t value)
{
    return driver_result_name((enum driver_result)value);
}

static const char *geometry_name(size_t value)
{
    return driver_geometry_name((enum driver_geometry)value);
}

static const char *calibration_name(size_t value)
{
    return driver_calibration_name((enum driver_calibration)value);
}

/* expect: the tokens that reach the socket, which never change */
static const struct names_case {
    const char *what;
    const char *(*name)(size_t value);
    const char *expect[13]; /* from 0; then NULL */
} names_cases[] = {
    { "result",
      result_name,
      { "ok", "cancelled", "timeout", "gone", "busy", "refused", "implausible", "protocol",
        "battery", "fault", "unsupported", "no_permission" } },
    { "geometry", geometry_name, { "d/8", "45/0" } },
    { "calibration", calibration_name, { "zero", "white" } },
    { "warning",
      driver_warning_name,
      { "battery_low", "lamp_weak", "calibration_old", "temperature", "over_range",
        "conditions_differ" } },
};

static void test_names(void)
{
    for (size_t i = 0; i < sizeof names_cases / sizeof *names_cases; i++) {
        const struct names_case *c = &names_cases[i];
        size_t n = 0;
        for (; c->expect[n] != NULL; n++)
            TEST_ASSERT_EQUAL_STRING_MESSAGE(c->expect[n], c->name(n), c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unknown", c->name(n), c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unknown", c->name((size_t)-1), c->what);
    }
}

static void test_fail_cuts_what_is_too_long(void)
{
    struct driver_error error;
    char text[2 * DRIVER_TEXT_SIZE];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, driver_fail(&error, DRIVER_BUSY, text, "%s", text));
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, error.result);
    TEST_ASSERT_EQUAL_size_t(DRIVER_TEXT_SIZE - 1, strlen(error.text));
    TEST_ASSERT_EQUAL_size_t(DRIVER_CODE_SIZE - 1, strlen(error.code));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, driver_fail(&error, DRIVER_GONE, NULL, "%d", 7));
    TEST_ASSERT_EQUAL_STRING("", error.code);
    TEST_ASSERT_EQUAL_STRING("7", error.text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_driver_is_under_contract);
    RUN_TEST(test_find_refuses);
    RUN_TEST(test_names);
    RUN_TEST(test_fail_cuts_what_is_too_long);
    contract_runs = true;
    for (size_t i = 0; i < FIXTURES; i++)
        contract_run(&fixtures[i]);
    return UNITY_END();
}
