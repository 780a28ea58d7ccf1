/* export_tools.h - a store to export from, and the two records that the tests begin with. */
#ifndef SKINSPEC_TESTS_STATION_EXPORT_TOOLS_H
#define SKINSPEC_TESTS_STATION_EXPORT_TOOLS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "station/export.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct store_record record;
static long allocations_left = -1; /* of cJSON; -1: never fail */

static inline void *test_malloc(size_t size)
{
    if (allocations_left == 0)
        return NULL;
    if (allocations_left > 0)
        allocations_left--;
    return malloc(size);
}

/* 2031-05-06T07:08:09.123Z */
static inline int64_t fixed_time(void *context)
{
    (void)context;
    return 1935817689123;
}

#define UUID "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b"
#define SHA "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

static inline void set_bands(double first_nm, double step_nm, size_t n, double level)
{
    record.spectrum =
        (struct spectrum){ .first_nm = first_nm, .step_nm = step_nm, .n = n, .aperture_mm = 8 };
    record.spectrum.specular = SPECULAR_SCE;
    for (size_t i = 0; i < n; i++)
        record.spectrum.value[i] = level;
}

/* As little as a record can have: a spectrum without a colour. */
static inline void least_record(void)
{
    memset(&record, 0, sizeof record);
    record.owner_uid = -1;
    record.specular = SPECULAR_SCE;
    record.aperture_mm = record.surface = record.raw_unit = record.ITA = (double)NAN;
    for (size_t i = 0; i < 3; i++)
        record.XYZ[i] = record.Lab[i] = (double)NAN;
    strcpy(record.illuminant, "D65");
    strcpy(record.observer, "10");
    set_bands(400, 20, 16, 0.25);
}

/* With all but what refers to other rows. */
static inline void full_record(void)
{
    least_record();
    strcpy(record.uuid, UUID);
    strcpy(record.parameters_sha256, SHA);
    strcpy(record.operator_name, "Ada");
    record.instrument = (struct store_instrument){ "simulated", "Acme", "S-1", "0042", "1.0" };
    record.aperture_mm = 8;
    record.surface = 0.04;
    for (size_t i = 0; i < 3; i++) {
        record.XYZ[i] = 30.5 + (double)i;
        record.Lab[i] = 60.25 - 40.0 * (double)i;
        record.sRGB[i] = 255 - (int)i;
    }
    record.ITA = 41.5;
    strcpy(record.ita_scheme, "del-bino-2013");
    strcpy(record.site, "left forearm");
    record.fence = 3;
    strcpy(record.flags, "[\"spread\",\"single\"]");
    strcpy(record.match_json,
           "{\"Cm\":0.1,\"Bm\":0.3333333333333333,\"Ch\":0.01,\"L\":60,\"a\":10,\"b\":15,"
           "\"dE00\":0.5,\"distance\":0.5,\"by\":\"de2000\",\"table\":\"two-layer\","
           "\"table_sha256\":\"" SHA "\",\"flags\":[\"Cm_at_limit\",\"tie\"]}");
    set_bands(400, 10, 31, 0.5);
}

static inline void export_set_up(void)
{
    struct store_clock clock = { fixed_time, NULL };
    cJSON_Hooks hooks = { test_malloc, free };
    allocations_left = -1;
    cJSON_InitHooks(&hooks);
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    TRY(store_open(folder, &clock, &store));
    TRY(store_reader_open(folder, &reader));
    full_record();
}

static inline void export_tear_down(void)
{
    allocations_left = -1;
    cJSON_InitHooks(NULL);
    store_reader_close(reader);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

static inline void add(void)
{
    bool known;
    TRY(store_add_record(store, &record, &known));
    TEST_ASSERT_FALSE(known);
}

/* All records in one page, the caller's to free. */
static inline char *whole(enum export_format format)
{
    const struct export_request all = { format, true, 0, 0, 1000000, 1 << 30 };
    struct export_page page = { NULL, 0, -1, -1, true };
    TRY(export_page(reader, &all, &page));
    TEST_ASSERT_FALSE(page.more);
    TEST_ASSERT_EQUAL_size_t(strlen(page.text), page.n);
    return page.text;
}

#endif
