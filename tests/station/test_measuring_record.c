/* test_measuring_record.c - what becomes of the shots in the record, and that the store takes it.
 */
#include "station/measuring.h"

#include "drivers/simulated/simulated.h"
#include "tests/station/measuring_tools.h"
#include "tests/support/folder.h"

/* ---- the record --------------------------------------------------------------------- */

static void test_sce_record(void)
{
    begin(SPECULAR_SCE, 0.04, 2);
    shoot(0.0);
    shoot(0.01);
    finish(0);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, record->specular);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, record->spectrum.specular);
    TEST_ASSERT_TRUE(isnan(record->surface));
    TEST_ASSERT_EQUAL_DOUBLE(8.0, record->aperture_mm);
    TEST_ASSERT_EQUAL_size_t(2, record->replicates);
    for (size_t i = 0; i < BANDS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, ramp(i, 0.005), record->spectrum.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, ramp(i, 0.01), record->replicate[1].value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, ramp(i, 0.05), record->replicate_sci[1].value[i]);
    }
}

/* SCI is 0.04 above the ramp: less a surface of 0.03, 0.01 is left over. */
static void test_sci_record(void)
{
    begin(SPECULAR_SCI, 0.03, 2);
    shoot(0.0);
    shoot(0.01);
    finish(0);
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, record->specular); /* the surface is off */
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCE, record->spectrum.specular);
    TEST_ASSERT_EQUAL_DOUBLE(0.03, record->surface);
    for (size_t i = 0; i < BANDS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, ramp(i, 0.015), record->spectrum.value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, ramp(i, 0.04), record->replicate_sci[0].value[i]);
    }
    TEST_ASSERT_EQUAL_INT(SPECULAR_SCI, record->replicate_sci[0].specular);
}

/* The set is judged by what is matched: SCE agrees here, SCI does not. */
static void test_sci_sets_are_judged_by_sci(void)
{
    begin(SPECULAR_SCI, 0.03, 3);
    for (int shot = 0; shot < 3; shot++) {
        make_shot(0.0);
        fill(&reading.sci, reading.raw_sci, SPECULAR_SCI, shot == 1 ? 0.2 : 0.04);
        take();
    }
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[\"outlier\"]", record->flags);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.2 + 0.04 - 0.03, record->spectrum.value[0]);
}

/* base/spectrum.h: a band may be below the surface by 0.005 and is then 0. */
static void test_surface_above_the_reading(void)
{
    static const struct {
        double sci;
        bool is_refused;
    } cases[] = { { 0.04, false }, { 0.036, false }, { 0.034, true }, { 0.0, true } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        begin(SPECULAR_SCI, 0.04, 1);
        make_shot(0.0);
        reading.sci.value[2] = cases[i].sci;
        TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, take());
        memset(record, 0x77, sizeof *record);
        bool done = measuring_finish(&m, 0, record, &refusal);
        TEST_ASSERT_EQUAL_INT(!cases[i].is_refused, done);
        if (done) {
            TEST_ASSERT_EQUAL_DOUBLE(0.0, record->spectrum.value[2]);
            TEST_ASSERT_EQUAL_INT(cases[i].sci < 0.04, record->spectrum.flag[2] != 0);
            free((void *)record->raw);
        } else {
            TEST_ASSERT_EQUAL_INT(REASON_MEASUREMENT_FAILED, refusal.reason);
            TEST_ASSERT_EQUAL_STRING_LEN("at 420 nm ", refusal.detail, 10);
            TEST_ASSERT_EACH_EQUAL_HEX8(0x77, record, sizeof *record);
        }
        record->raw = NULL;
        measuring_done(&m);
    }
}

static void test_no_shot_no_record(void)
{
    begin(SPECULAR_SCE, NAN, 2);
    TEST_ASSERT_FALSE(measuring_finish(&m, 0, record, &refusal));
    TEST_ASSERT_EQUAL_INT(REASON_MEASUREMENT_FAILED, refusal.reason);
}

/* Counts: 2000 at 400 nm, 2010 in the second shot; SCI 400 more. */
static void test_raw_is_shot_after_shot(void)
{
    begin(SPECULAR_SCE, NAN, 2);
    shoot(0.0);
    shoot(0.001);
    finish(0);
    TEST_ASSERT_EQUAL_size_t(4 * BANDS, record->raw_n);
    TEST_ASSERT_EQUAL_DOUBLE(1e-4, record->raw_unit);
    TEST_ASSERT_EQUAL_INT32(2000, record->raw[0]);
    TEST_ASSERT_EQUAL_INT32(5000, record->raw[BANDS - 1]);
    TEST_ASSERT_EQUAL_INT32(2400, record->raw[BANDS]);
    TEST_ASSERT_EQUAL_INT32(2010, record->raw[2 * BANDS]);
    TEST_ASSERT_EQUAL_INT32(5410, record->raw[4 * BANDS - 1]);
}

static void test_raw_of_one_mode(void)
{
    static const struct {
        enum specular specular;
        int32_t first, second;
    } cases[] = { { SPECULAR_SCE, 2000, 2010 }, { SPECULAR_SCI, 2400, 2410 } };
    for (size_t i = 0; i < 2; i++) {
        begin(cases[i].specular, 0.04, 2);
        for (int shot = 0; shot < 2; shot++) {
            make_shot(0.001 * shot);
            reading.has_sce = cases[i].specular == SPECULAR_SCE;
            reading.has_sci = !reading.has_sce;
            take();
        }
        finish(0);
        TEST_ASSERT_EQUAL_size_t(2 * BANDS, record->raw_n);
        TEST_ASSERT_EQUAL_INT32(cases[i].first, record->raw[0]);
        TEST_ASSERT_EQUAL_INT32(cases[i].second, record->raw[BANDS]);
        TEST_ASSERT_EQUAL_size_t(reading.has_sce ? BANDS : 0, record->replicate[1].n);
        TEST_ASSERT_EQUAL_size_t(reading.has_sci ? BANDS : 0, record->replicate_sci[1].n);
        free((void *)record->raw);
        record->raw = NULL;
        measuring_done(&m);
    }
}

static void test_no_raw(void)
{
    static const double second_unit[] = { 0.0, 2e-4 }; /* none at all; not the same */
    for (size_t i = 0; i < 2; i++) {
        begin(SPECULAR_SCE, NAN, 2);
        make_shot(0.0);
        reading.raw_unit = i == 0 ? 0.0 : 1e-4;
        take();
        reading.raw_unit = second_unit[i];
        take();
        finish(0);
        TEST_ASSERT_NULL(record->raw);
        TEST_ASSERT_EQUAL_size_t(0, record->raw_n);
        TEST_ASSERT_TRUE(isnan(record->raw_unit));
        measuring_done(&m);
    }
}

/* ---- redness ------------------------------------------------------------------------ */

/* Blood is pressed out from shot to shot: its dip at 540..580 nm fills. */
static void shoot_with_dip(double depth)
{
    make_shot(0.0);
    for (size_t i = 0; i < m.bands.n; i++) {
        double nm = spectrum_nm(&m.bands, i);
        if (nm >= 540.0 && nm <= 580.0)
            reading.sce.value[i] -= depth;
    }
    take();
}

static void take_blanching(double first_nm, double step_nm, size_t n)
{
    begin(SPECULAR_SCE, NAN, 3);
    measuring_done(&m);
    m.bands.first_nm = first_nm;
    m.bands.step_nm = step_nm;
    m.bands.n = n;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, measuring_init(&m));
    shoot_with_dip(0.04);
    shoot_with_dip(0.02);
    shoot_with_dip(0.0);
    TEST_ASSERT_EQUAL_size_t(3, m.taken);
    finish(0);
}

static void test_skin_that_blanches(void)
{
    take_blanching(400.0, 10.0, 31);
    TEST_ASSERT_TRUE(m.a_star[0] > m.a_star[1] + 0.5 && m.a_star[1] > m.a_star[2] + 0.5);
    TEST_ASSERT_EQUAL_STRING("[\"redness_falls\"]", record->flags);
    TEST_ASSERT_NOT_NULL(strstr(measuring_prompt(&m), "Lift the probe"));
}

/* Bands by 20 nm give no colour: nothing is said of redness. */
static void test_bands_without_a_colour(void)
{
    take_blanching(400.0, 20.0, 16);
    TEST_ASSERT_TRUE(isnan(m.a_star[0]));
    TEST_ASSERT_EQUAL_STRING("[]", record->flags);
}

/* CIE 15: what reflects all wavelengths alike is grey. */
static void test_grey_has_no_redness(void)
{
    begin(SPECULAR_SCE, NAN, 1);
    make_shot(0.0);
    make_flat(0.4);
    take();
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, m.a_star[0]);
}

/* ---- the simulated instrument, and the store ---------------------------------------- */

static void measure_simulated(const char *address)
{
    struct instrument *instrument = NULL;
    struct driver_identity identity;
    struct driver_error error = { .text = "" };
    const struct driver *d = &simulated_driver;
    struct driver_options options = { .address = address };
    enum driver_result r = d->open(&options, &instrument, &identity, &error);
    if (r == DRIVER_OK)
        r = d->calibrate(instrument, DRIVER_CALIBRATION_ZERO, &error);
    if (r == DRIVER_OK)
        r = d->calibrate(instrument, DRIVER_CALIBRATION_WHITE, &error);
    for (size_t i = 0; i < m.replicates && r == DRIVER_OK; i++) {
        r = d->measure(instrument, &reading, &error);
        if (r == DRIVER_OK)
            (void)take();
    }
    d->close(instrument);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, r, error.text);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(m.replicates, m.taken, refusal.detail);
}

static void test_simulated_skin_reaches_the_store(void)
{
    char folder[FOLDER_PATH_SIZE];
    struct store *store = NULL;
    bool known = true;
    begin(SPECULAR_SCI, 0.03, 3);
    measure_simulated("speed=instant,noise=0,placement=0,surface=0.04");
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[]", record->flags);
    TEST_ASSERT_EQUAL_size_t(6 * BANDS, record->raw_n);
    /* simulated.h: SCI - SCE is 0.04 at 550 nm, in counts of 0.0001 */
    TEST_ASSERT_DOUBLE_WITHIN(1.01e-4, record->replicate[0].value[15] + 0.01,
                              record->spectrum.value[15]);

    TEST_ASSERT_TRUE(folder_make(folder));
    enum status s = store_open(folder, NULL, &store);
    if (s == STATUS_OK)
        s = store_add_record(store, record, &known);
    store_close(store);
    folder_remove(folder);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    TEST_ASSERT_EQUAL_INT64(1, record->seq);
}

static void test_simulated_skin_under_pressure(void)
{
    begin(SPECULAR_SCE, NAN, 3);
    measure_simulated("speed=instant,noise=0,placement=0,replicates=3,pressure=1");
    finish(0);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(record->flags, "redness_falls"), record->flags);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sce_record);
    RUN_TEST(test_sci_record);
    RUN_TEST(test_sci_sets_are_judged_by_sci);
    RUN_TEST(test_surface_above_the_reading);
    RUN_TEST(test_no_shot_no_record);
    RUN_TEST(test_raw_is_shot_after_shot);
    RUN_TEST(test_raw_of_one_mode);
    RUN_TEST(test_no_raw);
    RUN_TEST(test_skin_that_blanches);
    RUN_TEST(test_bands_without_a_colour);
    RUN_TEST(test_grey_has_no_redness);
    RUN_TEST(test_simulated_skin_reaches_the_store);
    RUN_TEST(test_simulated_skin_under_pressure);
    return UNITY_END();
}
