/* test_km_ascii_corruption.c - one damaged byte in one reply: the right value or a clear error.
 *
 * Every position of every reply of a measurement, a status, a calibration and an opening, with:
 * another digit, a comma, a CR, and each of the eight bits turned over.  Two skins lie there by
 * turns, so that a reading of the shot before shows.
 *
 * A CM-2600d sends a spectrum once and without a checksum: there the share that no check can see
 * is counted and its size bounded.
 *
 * SKINSPEC_ALL=1 tries all (minutes); else every fifth byte of a spectrum, and of those what costs
 * a reply timeout at every seventh only. */
#include "drivers/km_ascii/km_ascii.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/drivers/cue.h"
#include "tests/support/patience.h"
#include "unity.h"

/* Waited out some thousand times. */
#define REPLY_MS (patience_number("TEST_PATIENCE") > 1 ? 40 : 6)

enum { SUBSTITUTIONS = 11, SKINS = 2 };

static const struct driver *const km = &km_ascii_driver;
static struct cued_wire wire;
static struct instrument *instrument;
static struct driver_identity identity, true_identity;
static struct driver_error error;
static struct driver_reading reading, truth[SKINS];
static struct driver_status status, true_status;
static unsigned shots;

static struct tally {
    unsigned tried, right, refused, wrong;
    double worst; /* reflectance */
} tally;

void setUp(void)
{
    instrument = NULL;
    shots = 0;
    memset(&tally, 0, sizeof tally);
}

void tearDown(void)
{
    km->close(instrument);
    wire_memory_free(wire.wire);
    instrument = NULL;
    wire.wire = NULL;
}

/* ---- the instrument ----------------------------------------------------------------- */

static void act(const char *action)
{
    TEST_ASSERT_TRUE_MESSAGE(wire_memory_act(wire.wire, action), action);
}

static enum driver_result open_it(void)
{
    struct driver_options options = { .address = "",
                                      .reply_timeout_ms = REPLY_MS,
                                      .wire = &wire.source };
    return km->open(&options, &instrument, &identity, &error);
}

static enum driver_result measure(void)
{
    act(shots++ % SKINS == 0 ? "lightness 40" : "lightness 70");
    return km->measure(instrument, &reading, &error);
}

static void must(enum driver_result r)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, r, error.text);
}

static void start(const struct sim_kind *kind)
{
    cued_wire_init(&wire, wire_memory_make(kind, "delays=0,noise=0"));
    must(open_it());
    true_identity = identity;
    act("place black");
    must(km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error));
    act("place white");
    must(km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    act("place skin");
    must(km->status(instrument, &true_status, &error));
    for (int i = 0; i < SKINS; i++) {
        must(measure());
        truth[i] = reading;
    }
}

/* ---- trying ------------------------------------------------------------------------- */

/* A fault at byte k of the reply.  Digits are what most bytes are. */
static void substitution(char *text, size_t size, int which, size_t k)
{
    static const char *const values[3] = { "55", "44", "13" }; /* '7', ',', CR */
    if (which < 3)
        snprintf(text, size, "fault replace %zu %s", k, values[which]);
    else
        snprintf(text, size, "fault xor %zu %d", k, 1 << (which - 3));
}

static bool is_slow(int which)
{
    return which == 1 || which == 2 || which == 10;
}

static double deviation(const struct driver_reading *r, const struct driver_reading *from)
{
    double worst = 0.0;
    for (size_t i = 0; i < r->sce.n; i++) {
        worst = fmax(worst, fabs(r->sce.value[i] - from->sce.value[i]));
        worst = fmax(worst, fabs(r->sci.value[i] - from->sci.value[i]));
    }
    return worst;
}

static void count(enum driver_result r, double wrong_by)
{
    tally.tried++;
    if (r != DRIVER_OK) {
        TEST_ASSERT_TRUE(strlen(error.text) > 20);
        tally.refused++;
    } else if (wrong_by == 0.0)
        tally.right++;
    else {
        tally.wrong++;
        tally.worst = fmax(tally.worst, wrong_by);
    }
}

static void try_measure(void)
{
    enum driver_result r = measure();
    const struct driver_reading *expect = &truth[(shots - 1) % SKINS];
    double wrong_by = 0.0;
    if (r == DRIVER_OK) {
        wrong_by = deviation(&reading, expect);
        if (reading.warnings != expect->warnings || reading.raw_unit != expect->raw_unit ||
            reading.sce.aperture_mm != expect->sce.aperture_mm)
            wrong_by = 1.0;
    }
    count(r, wrong_by);
    /* And nothing of it is left. */
    memset(wire.cue, 0, sizeof wire.cue);
    act("fault none");
    must(measure());
    TEST_ASSERT_TRUE(deviation(&reading, &truth[(shots - 1) % SKINS]) == 0.0);
}

static void try_status(void)
{
    memset(&status, 0, sizeof status);
    enum driver_result r = km->status(instrument, &status, &error);
    bool same = memcmp(status.due, true_status.due, sizeof status.due) == 0 &&
                status.battery_percent == true_status.battery_percent &&
                status.charging == true_status.charging;
    count(r, same ? 0.0 : 1.0);
}

static void try_zero(void)
{
    act("place black");
    enum driver_result r = km->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error);
    count(r, 0.0);
    act("place skin");
}

static void try_open(void)
{
    km->close(instrument);
    instrument = NULL;
    memset(&identity, 0, sizeof identity);
    enum driver_result r = open_it();
    count(r, memcmp(&identity, &true_identity, sizeof identity) == 0 ? 0.0 : 1.0);
    if (instrument == NULL) {
        memset(wire.cue, 0, sizeof wire.cue);
        act("fault none");
        must(open_it());
    }
}

/* Each substitution at each of the n bytes of the reply number `on` to a command. */
static void damage(const char *command, unsigned on, size_t n, void (*try)(void))
{
    bool all = getenv("SKINSPEC_ALL") != NULL;
    struct tally before = tally;
    for (size_t k = 0; k < n; k++)
        for (int which = 0; which < SUBSTITUTIONS; which++) {
            char fault[48], action[64];
            if (!all && n > 100 && (k % 5 != 0 || (is_slow(which) && k % 7 != 0)))
                continue;
            substitution(fault, sizeof fault, which, k);
            snprintf(action, sizeof action, "%s on %u", fault, on);
            memset(wire.cue, 0, sizeof wire.cue);
            act("fault none");
            cue(&wire, command, 1, action);
            try();
        }
    printf("  %-12s %3zu bytes: %5u tried, %5u right, %4u refused, %4u wrong\n", command, n,
           tally.tried - before.tried, tally.right - before.right, tally.refused - before.refused,
           tally.wrong - before.wrong);
    fflush(stdout);
}

/* ---- CM-700d ------------------------------------------------------------------------ */

enum {
    BARE = 6,          /* OK00 CR LF */
    STATE_700 = 26,    /* OK00,1,0,3,4000,0,0,0,0 and its end, at least */
    SETTINGS_700 = 19, /* OK00,2,3,00,01,01 */
    SPECTRUM_700 = 4 + 31 * 7 + 2,
    IDENTITY_700 = 37,
};

static void test_700_measures_right_or_not_at_all(void)
{
    start(&sim_cm700d);
    damage("CPR", 1, SETTINGS_700, try_measure);
    damage("MES", 1, BARE, try_measure);
    damage("STR", 1, STATE_700, try_measure);
    damage("MDR,2", 1, SPECTRUM_700, try_measure);
    damage("MDR,1", 1, SPECTRUM_700, try_measure);
    TEST_ASSERT_EQUAL_UINT(0, tally.wrong);
}

static void test_700_tells_its_state_right_or_not_at_all(void)
{
    start(&sim_cm700d);
    damage("STR", 1, STATE_700, try_status);
    damage("ZRC", 1, BARE, try_zero);
    TEST_ASSERT_EQUAL_UINT(0, tally.wrong);
}

static void test_700_opens_right_or_not_at_all(void)
{
    start(&sim_cm700d);
    damage("IDR", 1, IDENTITY_700, try_open);
    damage("STR", 1, STATE_700, try_open);
    damage("CIR", 1, 15, try_open);
    damage("USR", 1, 8, try_open);
    damage("CPR", 1, SETTINGS_700, try_open);
    damage("CPS", 1, BARE, try_open);
    damage("SWS", 1, BARE, try_open);
    damage("DTS", 1, BARE, try_open);
    TEST_ASSERT_EQUAL_UINT(0, tally.wrong);
}

/* ---- CM-2600d ----------------------------------------------------------------------- */

enum {
    STATE_2600 = 20,
    SETTINGS_2600 = 10,
    SPECTRUM_2600 = 4 + 39 * 6 + 2,
    IDENTITY_2600 = 35,
};

static void test_2600_all_but_the_spectrum(void)
{
    start(&sim_cm2600d);
    damage("CPR", 1, SETTINGS_2600, try_measure);
    damage("STR", 1, STATE_2600, try_measure);
    damage("STR", 1, STATE_2600, try_status);
    damage("UZC", 1, BARE, try_zero);
    act("place white");
    must(km->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error));
    act("place skin");
    damage("IDR", 1, IDENTITY_2600, try_open);
    damage("CPS", 1, BARE, try_open);
    damage("SWE", 1, BARE, try_open);
    TEST_ASSERT_EQUAL_UINT(0, tally.wrong);
}

/* What no check can see is less than the step that the gloss may make, and half of it more at
 * most for its neighbours. */
static void test_2600_the_spectrum(void)
{
    start(&sim_cm2600d);
    damage("MES", 1, SPECTRUM_2600, try_measure);
    damage("MES", 2, SPECTRUM_2600, try_measure);
    printf("  CM-2600d: of %u damaged spectra %u right, %u refused, %u (%.1f %%) not seen, by %.4f "
           "at most\n",
           tally.tried, tally.right, tally.refused, tally.wrong, 100.0 * tally.wrong / tally.tried,
           tally.worst);
    TEST_ASSERT_TRUE(tally.worst < 0.02);
    TEST_ASSERT_TRUE(tally.wrong < tally.tried / 3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_700_measures_right_or_not_at_all);
    RUN_TEST(test_700_tells_its_state_right_or_not_at_all);
    RUN_TEST(test_700_opens_right_or_not_at_all);
    RUN_TEST(test_2600_all_but_the_spectrum);
    RUN_TEST(test_2600_the_spectrum);
    return UNITY_END();
}
