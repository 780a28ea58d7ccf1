/* answer_tools.h - two small tables, a record to fill, and spectra to fill it with. */
#ifndef SKINSPEC_TESTS_STATION_ANSWER_TOOLS_H
#define SKINSPEC_TESTS_STATION_ANSWER_TOOLS_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/print.h"
#include "station/answer.h"
#include "station/protocol.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"

static char folder[FOLDER_PATH_SIZE];
static struct protocol *protocol;
static struct loaded_table *two_layer, *paper; /* with spectra, and without */
static struct answer_weights weights;
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

static inline struct loaded_table *small(const char *model)
{
    char name[64], path[FOLDER_PATH_SIZE];
    struct recipe recipe = small_recipe(model);
    struct loaded_table *table = NULL;
    snprintf(name, sizeof name, "table-%s.db", model);
    TRY(small_table(folder_path(folder, name, path), &recipe, false));
    TRY(loaded_table_open(path, &table));
    return table;
}

static inline void answer_set_up(void)
{
    cJSON_Hooks hooks = { test_malloc, free };
    allocations_left = -1;
    cJSON_InitHooks(&hooks);
    heard_start();
    if (protocol == NULL)
        TRY(protocol_open(&protocol));
    TEST_ASSERT_TRUE(folder_make(folder));
    two_layer = small("two-layer");
    paper = small("paper");
    memset(&weights, 0, sizeof weights);
    memset(&record, 0, sizeof record);
    record.aperture_mm = record.surface = record.raw_unit = (double)NAN;
    record.owner_uid = -1;
    strcpy(record.id, "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b");
    record.specular = SPECULAR_SCE;
}

static inline void answer_tear_down(void)
{
    allocations_left = -1;
    cJSON_InitHooks(NULL);
    loaded_table_close(two_layer);
    loaded_table_close(paper);
    heard_stop();
    folder_remove(folder);
}

static inline struct spectrum bands(double first_nm, double step_nm, size_t n, double level)
{
    struct spectrum s = { .first_nm = first_nm,
                          .step_nm = step_nm,
                          .n = n,
                          .specular = SPECULAR_SCE,
                          .aperture_mm = (double)NAN };
    for (size_t i = 0; i < n; i++)
        s.value[i] = level;
    return s;
}

/* A row, raised by `offset`: no row has these numbers. */
static inline struct spectrum near_row(size_t row, double offset)
{
    struct spectrum s = bands(400, 10, 31, 0);
    for (size_t i = 0; i < s.n; i++)
        s.value[i] = (double)table_spectrum(loaded_table(two_layer), row)[i] + offset;
    return s;
}

static inline char *text_of(const cJSON *value)
{
    char *text = NULL;
    TRY(json_print(value, 1 << 20, &text, NULL));
    return text;
}

static inline double number_of(const cJSON *object, const char *name)
{
    const cJSON *value = cJSON_GetObjectItemCaseSensitive(object, name);
    TEST_ASSERT_TRUE_MESSAGE(cJSON_IsNumber(value), name);
    return value->valuedouble;
}

static inline void check_reply(enum method method, const cJSON *object)
{
    struct schema_error error = { "", "" };
    if (!protocol_check_result(protocol, method, object, &error))
        TEST_FAIL_MESSAGE(error.what);
}

#endif
