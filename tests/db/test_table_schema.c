/* test_table_schema.c - the recipe as meta rows, there and back. */
#include "db/table_schema.h"

#include <stdio.h>
#include <string.h>

#include <sqlite3.h>

#include "base/version.h"
#include "tests/support/dice.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: written by hand from DESIGN's defaults, keys in alphabetical order. */
static const char *const two_layer_meta[TABLE_META_COUNT][2] = {
    { "bands_nm", "400:700:10" },
    { "bm", "0:1:21" },
    { "ch", "log:0.001:0.1:48" },
    { "cm", "log:0.001:0.5:50" },
    { "code_version", SKINSPEC_VERSION },
    { "epidermis_mm", "0.08" },
    { "eta", "1.4" },
    { "gamma", "0.75" },
    { "illuminant", "D65" },
    { "model", "two-layer" },
    { "observer_deg", "10" },
    { "rgb_reading", "linear" },
    { "rows", "50400" },
};

static void test_meta_of_the_default(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_meta meta;
    table_meta_of(&recipe, &meta);
    for (size_t i = 0; i < TABLE_META_COUNT; i++) {
        TEST_ASSERT_EQUAL_STRING(two_layer_meta[i][0], meta.key[i]);
        TEST_ASSERT_EQUAL_STRING(two_layer_meta[i][1], meta.value[i]);
    }
    recipe = recipe_default(model_find("paper"));
    recipe.rgb_reading = RGB_READING_CODED;
    table_meta_of(&recipe, &meta);
    TEST_ASSERT_EQUAL_STRING("none", meta.value[0]);
    TEST_ASSERT_EQUAL_STRING("paper", meta.value[9]);
    TEST_ASSERT_EQUAL_STRING("2", meta.value[10]);
    TEST_ASSERT_EQUAL_STRING("coded", meta.value[11]);
}

/* Values by key, one of them perhaps replaced, or missing (NULL). */
struct source {
    const struct table_meta *meta;
    const char *key, *instead;
};

static const char *look_up(void *context, const char *key)
{
    const struct source *s = context;
    if (s->key != NULL && strcmp(key, s->key) == 0)
        return s->instead;
    for (size_t i = 0; i < TABLE_META_COUNT; i++)
        if (strcmp(s->meta->key[i], key) == 0)
            return s->meta->value[i];
    return NULL;
}

static void assert_same_axis(const struct axis *a, const struct axis *b)
{
    TEST_ASSERT_EQUAL_MEMORY(&a->lo, &b->lo, sizeof a->lo);
    TEST_ASSERT_EQUAL_MEMORY(&a->hi, &b->hi, sizeof a->hi);
    TEST_ASSERT_EQUAL_size_t(a->n, b->n);
    TEST_ASSERT_EQUAL_INT(a->log, b->log);
}

/* Property: 500 recipes by chance come back with the same bits. */
static void test_round_trip(void)
{
    static const double steps[] = { 1.0, 5.0, 10.0, 1.0 / 3.0 };
    struct dice dice = { 3 };
    for (int i = 0; i < 500; i++) {
        struct recipe recipe = recipe_default(&model_list[i % MODEL_COUNT]), back;
        struct table_meta meta;
        struct source source = { &meta, NULL, NULL };
        const char *bad_key = NULL;
        recipe.grid.Cm = (struct axis){ dice_between(&dice, 0.01, 0.1),
                                        dice_between(&dice, 0.2, 0.5), 7, i % 2 == 0 };
        recipe.gamma = dice_between(&dice, 0.0, 1.0);
        recipe.epidermis_mm = dice_between(&dice, 0.0, 0.3);
        recipe.eta = dice_between(&dice, 1.0, 2.0);
        recipe.illuminant = (enum illuminant)(i % ILLUMINANT_COUNT);
        recipe.observer = (enum observer)(i % OBSERVER_COUNT);
        recipe.rgb_reading = i % 5 == 0 ? RGB_READING_CODED : RGB_READING_LINEAR;
        if (recipe.bands > 0) {
            recipe.first_nm = dice_between(&dice, 250.0, 500.0);
            recipe.step_nm = steps[i % 4];
            recipe.bands = 1 + dice_below(&dice, SPECTRUM_MAX_BANDS);
        }
        table_meta_of(&recipe, &meta);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_meta_recipe(look_up, &source, &back, &bad_key));
        TEST_ASSERT_NULL(bad_key);
        TEST_ASSERT_EQUAL_PTR(recipe.model, back.model);
        assert_same_axis(&recipe.grid.Cm, &back.grid.Cm);
        assert_same_axis(&recipe.grid.Bm, &back.grid.Bm);
        assert_same_axis(&recipe.grid.Ch, &back.grid.Ch);
        const double expect[] = { recipe.gamma, recipe.epidermis_mm, recipe.eta, recipe.first_nm,
                                  recipe.step_nm };
        const double got[] = { back.gamma, back.epidermis_mm, back.eta, back.first_nm,
                               back.step_nm };
        TEST_ASSERT_EQUAL_MEMORY(expect, got, sizeof got);
        TEST_ASSERT_EQUAL_size_t(recipe.bands, back.bands);
        TEST_ASSERT_EQUAL_INT(recipe.illuminant, back.illuminant);
        TEST_ASSERT_EQUAL_INT(recipe.observer, back.observer);
        TEST_ASSERT_EQUAL_INT(recipe.rgb_reading, back.rgb_reading);
    }
}

/* expect: the key that was spoiled is named; NULL is a missing one. */
static const struct spoiled_case {
    const char *key, *instead;
} spoiled_cases[] = {
    { "model", NULL },
    { "model", "" },
    { "model", "ray-tracing" },
    { "cm", NULL },
    { "cm", "" },
    { "cm", "1:0:3" },
    { "bm", NULL },
    { "bm", "0:1" },
    { "ch", NULL },
    { "ch", "log:0:1:4" },
    { "epidermis_mm", NULL },
    { "epidermis_mm", "thick" },
    { "eta", NULL },
    { "eta", "1,4" },
    { "gamma", NULL },
    { "gamma", "nan" },
    { "bands_nm", NULL },
    { "bands_nm", "" },
    { "bands_nm", "none " },
    { "bands_nm", "400:700" },
    { "illuminant", NULL },
    { "illuminant", "D64" },
    { "observer_deg", NULL },
    { "observer_deg", "4" },
    { "rgb_reading", NULL },
    { "rgb_reading", "Linear" },
};

static void test_spoiled_rows_are_named(void)
{
    struct recipe recipe = recipe_default(model_find("two-layer"));
    struct table_meta meta;
    table_meta_of(&recipe, &meta);
    for (size_t i = 0; i < sizeof spoiled_cases / sizeof *spoiled_cases; i++) {
        const struct spoiled_case *c = &spoiled_cases[i];
        struct source source = { &meta, c->key, c->instead };
        struct recipe got = { .bands = 77 };
        const char *bad_key = "none";
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_FORMAT,
                                      table_meta_recipe(look_up, &source, &got, &bad_key), c->key);
        TEST_ASSERT_EQUAL_STRING(c->key, bad_key);
        TEST_ASSERT_EQUAL_size_t(77, got.bands);
    }
}

static const char *nothing(void *context, const char *key)
{
    (void)context;
    (void)key;
    return NULL;
}

static void test_of_several_the_first_is_named(void)
{
    struct recipe got;
    const char *bad_key = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, table_meta_recipe(nothing, NULL, &got, &bad_key));
    TEST_ASSERT_EQUAL_STRING("model", bad_key);
}

/* expect: by hand; bands = (last - first)/step + 1. */
static const struct bands_case {
    const char *text;
    enum status status;
    double first_nm, step_nm;
    size_t bands;
} bands_cases[] = {
    { "400:700:10", STATUS_OK, 400, 10, 31 },
    { "360:830:1", STATUS_OK, 360, 1, 471 },
    { "400:400:10", STATUS_OK, 400, 10, 1 },
    { "400:401:0.1", STATUS_OK, 400, 0.1, 11 },
    { "0:1023:1", STATUS_OK, 0, 1, 1024 },
    { "0:1024:1", STATUS_RANGE, 0, 0, 0 },
    { "400:700:7", STATUS_RANGE, 0, 0, 0 }, /* 42.86 steps */
    { "400:700.00001:10", STATUS_RANGE, 0, 0, 0 },
    { "700:400:10", STATUS_RANGE, 0, 0, 0 },
    { "700:400:-10", STATUS_RANGE, 0, 0, 0 },
    { "400:700:0", STATUS_RANGE, 0, 0, 0 },
    { "400:400:0", STATUS_RANGE, 0, 0, 0 },
    { "400:700:1e-300", STATUS_RANGE, 0, 0, 0 },
    { "", STATUS_FORMAT, 0, 0, 0 },
    { "none", STATUS_FORMAT, 0, 0, 0 },
    { "400", STATUS_FORMAT, 0, 0, 0 },
    { "400:700", STATUS_FORMAT, 0, 0, 0 },
    { "400:700:", STATUS_FORMAT, 0, 0, 0 },
    { ":700:10", STATUS_FORMAT, 0, 0, 0 },
    { "400::10", STATUS_FORMAT, 0, 0, 0 },
    { "400:700:10:1", STATUS_FORMAT, 0, 0, 0 },
    { "400:700:ten", STATUS_FORMAT, 0, 0, 0 },
    { " 400:700:10", STATUS_FORMAT, 0, 0, 0 },
    { "400:700:1000000000000000000000000000000000000000000000000000000000000000000000000000000000"
      "00000000000000000000000000000000000000000000000000000000",
      STATUS_FORMAT, 0, 0, 0 },
};

static void test_bands(void)
{
    for (size_t i = 0; i < sizeof bands_cases / sizeof *bands_cases; i++) {
        const struct bands_case *c = &bands_cases[i];
        double first_nm = 77.0, step_nm = 78.0;
        size_t bands = 79;
        bool good = c->status == STATUS_OK;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->status, table_bands_parse(c->text, &first_nm, &step_nm, &bands), c->text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(good ? c->first_nm : 77.0, first_nm, c->text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(good ? c->step_nm : 78.0, step_nm, c->text);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(good ? c->bands : 79, bands, c->text);
    }
}

/* The SQL runs, and refuses a row with a hole. */
static void test_schema(void)
{
    sqlite3 *db;
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(":memory:", &db));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_exec(db, table_schema_sql, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_exec(db, table_schema_rtree_sql, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(
        SQLITE_OK,
        sqlite3_exec(db, "INSERT INTO entry VALUES (1,0,0,0,0,0,0,0,0,0,NULL)", NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(SQLITE_CONSTRAINT,
                          sqlite3_exec(db, "INSERT INTO entry VALUES (2,0,0,NULL,0,0,0,0,0,0,NULL)",
                                       NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(
        SQLITE_CONSTRAINT,
        sqlite3_exec(db, "INSERT INTO meta VALUES ('rows', NULL)", NULL, NULL, NULL));
    sqlite3_close(db);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_meta_of_the_default);
    RUN_TEST(test_round_trip);
    RUN_TEST(test_spoiled_rows_are_named);
    RUN_TEST(test_of_several_the_first_is_named);
    RUN_TEST(test_bands);
    RUN_TEST(test_schema);
    return UNITY_END();
}
