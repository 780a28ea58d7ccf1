/* test_measuring.c - from shot to shot: what is kept, flagged, refused. */
#include "station/measuring.h"

#include "tests/station/measuring_tools.h"

/* ---- from shot to shot -------------------------------------------------------------- */

static void test_how_many(void)
{
    static const size_t wrong[] = { 0, QUALITY_MAX_REPLICATES + 1, SIZE_MAX };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        m.replicates = wrong[i];
        TEST_ASSERT_EQUAL_INT(STATUS_RANGE, measuring_init(&m));
        measuring_done(&m);
    }
    begin(SPECULAR_SCE, NAN, QUALITY_MAX_REPLICATES);
    for (size_t i = 1; i < QUALITY_MAX_REPLICATES; i++)
        TEST_ASSERT_EQUAL_INT(MEASURING_SHOOT, shoot(0.0));
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, shoot(0.0));
    finish(0);
    TEST_ASSERT_EQUAL_size_t(QUALITY_MAX_REPLICATES, record->replicates);
    TEST_ASSERT_EQUAL_STRING("[]", record->flags);
}

static void test_prompt_waits_between_shots(void)
{
    m.prompt = true;
    begin(SPECULAR_SCE, NAN, 3);
    TEST_ASSERT_EQUAL_INT(MEASURING_WAIT, shoot(0.0));
    TEST_ASSERT_NULL(strstr(measuring_prompt(&m), "Lift the probe"));
    /* 0.03 apart: a spread of 0.0212, above 0.0165 (quality.h) */
    TEST_ASSERT_EQUAL_INT(MEASURING_WAIT, shoot(0.03));
    TEST_ASSERT_EQUAL_UINT(QUALITY_SPREAD, shot_flags);
    TEST_ASSERT_NOT_NULL(strstr(measuring_prompt(&m), "Lift the probe"));
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, shoot(0.015)); /* 0.015: all three belong together */
    TEST_ASSERT_EQUAL_UINT(0, shot_flags);
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[]", record->flags);
}

/* A measuring can be used again. */
static void test_init_begins_anew(void)
{
    begin(SPECULAR_SCE, NAN, 2);
    shoot(0.0);
    reading.warnings = DRIVER_WARNING_LAMP_WEAK;
    take();
    measuring_done(&m);
    begin(SPECULAR_SCE, NAN, 1);
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, shoot(0.1));
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[\"single\"]", record->flags);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, record->spectrum.value[0]);
}

/* ---- flags -------------------------------------------------------------------------- */

/* Levels over the ramp; SCI over SCE.  Outlier: further than 0.0255 from the median;
 * spread: a standard deviation above 0.0165 (quality.h). */
static const struct flags_case {
    const char *what;
    size_t n;
    double over[4], sci_over;
    unsigned warnings, extra;
    const char *flags;
    double mean0; /* at 400 nm */
} flags_cases[] = {
    { "as skin is", 3, { 0.0, 0.01, -0.01 }, 0.04, 0, 0, "[]", 0.2 },
    { "one", 1, { 0.0 }, 0.04, 0, 0, "[\"single\"]", 0.2 },
    { "one astray is left out", 3, { 0.0, 0.1, 0.01 }, 0.04, 0, 0, "[\"outlier\"]", 0.205 },
    { "two apart", 2, { 0.0, 0.03 }, 0.04, 0, 0, "[\"spread\"]", 0.215 },
    { "SCI below", 2, { 0.0, 0.0 }, -0.01, 0, 0, "[\"sci_below_sce\"]", 0.2 },
    { "warnings come last",
      1,
      { 0.0 },
      0.04,
      DRIVER_WARNING_BATTERY_LOW | DRIVER_WARNING_TEMPERATURE,
      0,
      "[\"single\",\"battery_low\",\"temperature\"]",
      0.2 },
    { "old, says the station",
      2,
      { 0.0 },
      0.04,
      0,
      QUALITY_CALIBRATION_OLD,
      "[\"calibration_old\"]",
      0.2 },
    { "old, says the instrument",
      2,
      { 0.0 },
      0.04,
      DRIVER_WARNING_CALIBRATION_OLD,
      0,
      "[\"calibration_old\"]",
      0.2 },
    { "old, say both: once",
      2,
      { 0.0 },
      0.04,
      DRIVER_WARNING_CALIBRATION_OLD,
      QUALITY_CALIBRATION_OLD,
      "[\"calibration_old\"]",
      0.2 },
    { "only warnings", 2, { 0.0 }, 0.04, DRIVER_WARNING_LAMP_WEAK, 0, "[\"lamp_weak\"]", 0.2 },
};

static void test_flags_of_the_record(void)
{
    for (size_t i = 0; i < sizeof flags_cases / sizeof *flags_cases; i++) {
        const struct flags_case *c = &flags_cases[i];
        begin(SPECULAR_SCE, NAN, c->n);
        for (size_t shot = 0; shot < c->n; shot++) {
            make_shot(c->over[shot]);
            fill(&reading.sci, reading.raw_sci, SPECULAR_SCI, c->over[shot] + c->sci_over);
            reading.warnings = shot == 0 ? c->warnings : 0; /* once is enough */
            (void)take();
        }
        finish(c->extra);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->flags, record->flags, c->what);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, c->mean0, record->spectrum.value[0], c->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->n, record->replicates, c->what);
        free((void *)record->raw);
        record->raw = NULL;
        measuring_done(&m);
    }
}

static void test_each_shot_tells_what_it_brought(void)
{
    begin(SPECULAR_SCE, NAN, 4);
    shoot(0.0);
    TEST_ASSERT_EQUAL_UINT(0, shot_flags);
    make_shot(0.0);
    fill(&reading.sci, reading.raw_sci, SPECULAR_SCI, -0.01);
    take();
    TEST_ASSERT_EQUAL_UINT(QUALITY_SCI_BELOW_SCE, shot_flags);
    shoot(0.2);
    TEST_ASSERT_EQUAL_UINT(QUALITY_OUTLIER, shot_flags);
    shoot(0.0);
    TEST_ASSERT_EQUAL_UINT(0, shot_flags); /* still an outlier, but not by this one */
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[\"sci_below_sce\",\"outlier\"]", record->flags);
}

/* ---- refused ------------------------------------------------------------------------ */

static void spoil_bands(void)
{
    reading.sce.n--;
}

static void spoil_sci_bands(void)
{
    reading.sci.step_nm = 5.0;
}

static void spoil_zero(void)
{
    make_flat(0.0);
}

static void spoil_swapped(void)
{
    make_flat(15.0);
}

static void spoil_nan(void)
{
    reading.sci.value[7] = NAN;
}

static void spoil_range(void)
{
    reading.sce.value[7] = 1.3;
}

static void spoil_port(void)
{
    reading.sce.aperture_mm = reading.sci.aperture_mm = 3.0;
}

static void spoil_modes(void)
{
    reading.has_sci = false;
}

static const struct refused_case {
    const char *what;
    void (*spoil)(void);
    unsigned flags;
    const char *detail;
} refused_cases[] = {
    { "a band too few", spoil_bands, QUALITY_WRONG_BANDS, "shot 2: the instrument sent other" },
    { "other bands of SCI", spoil_sci_bands, QUALITY_WRONG_BANDS, "shot 2: the instrument sent" },
    { "SCI missing now", spoil_modes, QUALITY_WRONG_BANDS, "shot 2: the instrument sent other" },
    { "nothing there", spoil_zero, QUALITY_ALL_ZERO, "shot 2: no light came back" },
    { "swapped", spoil_swapped, QUALITY_WHITE_BLACK_SWAPPED, "shot 2: white tile and black" },
    { "no number", spoil_nan, QUALITY_NOT_FINITE, "shot 2: a band is no number" },
    { "too much", spoil_range, QUALITY_OUT_OF_RANGE, "shot 2: a band lies outside" },
    { "through another port", spoil_port, 0, "shot 2: taken through another port" },
};

static void test_shots_that_are_refused(void)
{
    begin(SPECULAR_SCE, NAN, 2);
    TEST_ASSERT_EQUAL_INT(MEASURING_SHOOT, shoot(0.0));
    for (size_t i = 0; i < sizeof refused_cases / sizeof *refused_cases; i++) {
        const struct refused_case *c = &refused_cases[i];
        make_shot(0.0);
        c->spoil();
        TEST_ASSERT_EQUAL_INT_MESSAGE(MEASURING_REFUSE, take(), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(REASON_MEASUREMENT_FAILED, refusal.reason, c->what);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->flags, shot_flags, c->what);
        TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(c->detail, refusal.detail, strlen(c->detail), c->what);
    }
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, shoot(0.0)); /* nothing of them was kept */
    finish(0);
    TEST_ASSERT_EQUAL_STRING("[]", record->flags);
}

static void test_a_port_that_is_not_known_is_no_other(void)
{
    begin(SPECULAR_SCE, NAN, 2);
    make_shot(0.0);
    reading.sce.aperture_mm = reading.sci.aperture_mm = NAN;
    TEST_ASSERT_EQUAL_INT(MEASURING_SHOOT, take());
    m.bands.aperture_mm = NAN;
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, shoot(0.0));
}

static const struct mode_case {
    const char *what;
    enum specular specular;
    double surface;
    bool has_sce, has_sci;
    enum reason reason; /* REASONS: taken */
} mode_cases[] = {
    { "SCE of both", SPECULAR_SCE, NAN, true, true, REASONS },
    { "SCE of one", SPECULAR_SCE, NAN, true, false, REASONS },
    { "SCE of none", SPECULAR_SCE, NAN, false, true, REASON_INSTRUMENT_UNSUPPORTED },
    { "SCI of one", SPECULAR_SCI, 0.04, false, true, REASONS },
    { "SCI of none", SPECULAR_SCI, 0.04, true, false, REASON_INSTRUMENT_UNSUPPORTED },
    { "SCI without a surface", SPECULAR_SCI, NAN, true, true, REASON_SURFACE_NEEDED },
    { "less than no surface", SPECULAR_SCI, -0.01, true, true, REASON_SURFACE_NEEDED },
    { "no surface at all", SPECULAR_SCI, 0.0, true, true, REASONS },
    { "a mirror", SPECULAR_SCI, 0.11, true, true, REASON_SURFACE_NEEDED },
};

static void test_modes(void)
{
    for (size_t i = 0; i < sizeof mode_cases / sizeof *mode_cases; i++) {
        const struct mode_case *c = &mode_cases[i];
        begin(c->specular, c->surface, 1);
        make_shot(0.0);
        reading.has_sce = c->has_sce;
        reading.has_sci = c->has_sci;
        enum measuring_step step = take();
        if (c->reason == REASONS) {
            TEST_ASSERT_EQUAL_INT_MESSAGE(MEASURING_FINISH, step, c->what);
        } else {
            TEST_ASSERT_EQUAL_INT_MESSAGE(MEASURING_REFUSE, step, c->what);
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->reason, refusal.reason, c->what);
        }
        measuring_done(&m);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_how_many);
    RUN_TEST(test_prompt_waits_between_shots);
    RUN_TEST(test_init_begins_anew);
    RUN_TEST(test_flags_of_the_record);
    RUN_TEST(test_each_shot_tells_what_it_brought);
    RUN_TEST(test_shots_that_are_refused);
    RUN_TEST(test_a_port_that_is_not_known_is_no_other);
    RUN_TEST(test_modes);
    return UNITY_END();
}
