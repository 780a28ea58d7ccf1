/* measuring_tools.h - shots made by hand, for the tests of station/measuring. */
#ifndef SKINSPEC_TESTS_STATION_MEASURING_TOOLS_H
#define SKINSPEC_TESTS_STATION_MEASURING_TOOLS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "station/measuring.h"
#include "unity.h"

enum { BANDS = 31 };

static struct measuring m;
static struct driver_reading reading;
static struct store_record *record;
static struct refusal refusal;
static unsigned shot_flags;

void setUp(void)
{
    memset(&m, 0, sizeof m);
    record = calloc(1, sizeof *record);
    TEST_ASSERT_NOT_NULL(record);
}

void tearDown(void)
{
    measuring_done(&m);
    free((void *)record->raw);
    free(record);
}

/* ---- shots by hand --------------------------------------------------------------------- */

/* 400..700 nm by 10 through 8 mm. */
static inline void begin(enum specular specular, double surface, size_t replicates)
{
    m.specular = specular;
    m.surface = surface;
    m.replicates = replicates;
    m.bands =
        (struct spectrum){ .first_nm = 400.0, .step_nm = 10.0, .n = BANDS, .aperture_mm = 8.0 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, measuring_init(&m));
}

/* A ramp like skin's, 0.2 at 400 nm to 0.5 at 700 nm, and `over` in every band; counts are
 * ten thousandths. */
static inline double ramp(size_t i, double over)
{
    return 0.2 + 0.01 * (double)i + over;
}

static inline void fill(struct spectrum *s, int32_t *raw, enum specular specular, double over)
{
    *s = m.bands;
    s->specular = specular;
    for (size_t i = 0; i < s->n; i++) {
        raw[i] = (int32_t)lround(1e4 * ramp(i, over));
        s->value[i] = 1e-4 * raw[i];
    }
}

/* SCE higher than the ramp by `over`, SCI 0.04 above that. */
static inline void make_shot(double over)
{
    memset(&reading, 0, sizeof reading);
    reading.has_sce = reading.has_sci = true;
    reading.raw_unit = 1e-4;
    fill(&reading.sce, reading.raw_sce, SPECULAR_SCE, over);
    fill(&reading.sci, reading.raw_sci, SPECULAR_SCI, over + 0.04);
}

static inline enum measuring_step take(void)
{
    memset(&refusal, 0x55, sizeof refusal);
    return measuring_take(&m, &reading, &shot_flags, &refusal);
}

static inline enum measuring_step shoot(double over)
{
    make_shot(over);
    return take();
}

static inline void finish(unsigned extra)
{
    bool done = measuring_finish(&m, extra, record, &refusal);
    TEST_ASSERT_TRUE_MESSAGE(done, refusal.detail);
}

/* All bands of the shot alike. */
static inline void make_flat(double value)
{
    for (size_t i = 0; i < BANDS; i++)
        reading.sce.value[i] = reading.sci.value[i] = value;
}

#endif
