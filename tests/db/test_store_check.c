/* test_store_check.c - references, limits and checks of tiles, as they are kept. */
#include "db/store_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "db/sql.h"
#include "db/station_schema.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct dice dice = { 5 };
static struct store_check_tile found;
static struct store_check check_found;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    TRY(store_open(folder, NULL, &store));
    TRY(store_reader_open(folder, &reader));
}

void tearDown(void)
{
    store_reader_close(reader);
    store_close(store);
    reader = NULL;
    store = NULL;
    heard_stop();
    folder_remove(folder);
}

static struct store_check_tile tile_of(const char *name, enum store_tile_source source)
{
    struct store_check_tile t = { .source = source, .limit_dE00 = 0.5, .aperture_mm = 8.0 };
    records_uuid(&dice, t.uuid);
    memset(t.parameters_sha256, 'a', 64);
    strcpy(t.who, "Zoë, uid 1000");
    strcpy(t.tile, name);
    if (source == STORE_TILE_LIMIT)
        t.aperture_mm = (double)NAN;
    else
        records_spectrum(&dice, 39, SPECULAR_SCE, &t.spectrum);
    if (source == STORE_TILE_MEASURED) {
        t.instrument = records_instrument();
        t.replicates = 3;
    }
    return t;
}

static struct store_check_tile add_tile(struct store_check_tile t)
{
    bool known = true;
    TRY(store_add_check_tile(store, &t, &known));
    TEST_ASSERT_FALSE(known);
    return t;
}

static struct store_check check_of(const struct store_check_tile *reference, double dE00)
{
    struct store_check c = { .aperture_mm = reference->aperture_mm, .replicates = 3, .fence = 7 };
    records_uuid(&dice, c.uuid);
    memset(c.parameters_sha256, 'b', 64);
    strcpy(c.operator_name, "Ada");
    c.instrument = records_instrument();
    strcpy(c.tile, reference->tile);
    strcpy(c.reference_id, reference->id);
    records_spectrum(&dice, 31, SPECULAR_SCE, &c.spectrum);
    c.dE00 = dE00;
    c.rms = dice_between(&dice, 0.0, 0.1);
    c.limit_dE00 = reference->limit_dE00;
    c.passed = dE00 <= c.limit_dE00;
    return c;
}

static struct store_check add_check(struct store_check c)
{
    bool known = true;
    TRY(store_add_check(store, &c, &known));
    TEST_ASSERT_FALSE(known);
    return c;
}

static void same_spectrum(const struct spectrum *a, const struct spectrum *b)
{
    TEST_ASSERT_EQUAL_size_t(a->n, b->n);
    TEST_ASSERT_EQUAL_DOUBLE(a->first_nm, b->first_nm);
    TEST_ASSERT_EQUAL_DOUBLE(a->step_nm, b->step_nm);
    TEST_ASSERT_EQUAL_MEMORY(a->value, b->value, a->n * sizeof *a->value);
}

static void same_tile(const struct store_check_tile *a, const struct store_check_tile *b)
{
    TEST_ASSERT_EQUAL_STRING(a->id, b->id);
    TEST_ASSERT_EQUAL_STRING(a->taken_at, b->taken_at);
    TEST_ASSERT_EQUAL_STRING(a->uuid, b->uuid);
    TEST_ASSERT_EQUAL_STRING(a->parameters_sha256, b->parameters_sha256);
    TEST_ASSERT_EQUAL_STRING(a->who, b->who);
    TEST_ASSERT_EQUAL_STRING(a->tile, b->tile);
    TEST_ASSERT_EQUAL_INT(a->source, b->source);
    TEST_ASSERT_EQUAL_DOUBLE(a->limit_dE00, b->limit_dE00);
    TEST_ASSERT_EQUAL_STRING(a->instrument.serial, b->instrument.serial);
    TEST_ASSERT_EQUAL_size_t(a->replicates, b->replicates);
    TEST_ASSERT_EQUAL_INT(isnan(a->aperture_mm), isnan(b->aperture_mm));
    if (a->source == STORE_TILE_LIMIT)
        TEST_ASSERT_EQUAL_size_t(0, b->spectrum.n);
    else
        same_spectrum(&a->spectrum, &b->spectrum);
}

static void same_check(const struct store_check *a, const struct store_check *b)
{
    TEST_ASSERT_EQUAL_STRING(a->id, b->id);
    TEST_ASSERT_EQUAL_INT64(a->seq, b->seq);
    TEST_ASSERT_EQUAL_STRING(a->taken_at, b->taken_at);
    TEST_ASSERT_EQUAL_STRING(a->uuid, b->uuid);
    TEST_ASSERT_EQUAL_STRING(a->operator_name, b->operator_name);
    TEST_ASSERT_EQUAL_STRING(a->instrument.model, b->instrument.model);
    TEST_ASSERT_EQUAL_INT64(a->fence, b->fence);
    TEST_ASSERT_EQUAL_STRING(a->tile, b->tile);
    TEST_ASSERT_EQUAL_STRING(a->reference_id, b->reference_id);
    TEST_ASSERT_EQUAL_DOUBLE(a->aperture_mm, b->aperture_mm);
    TEST_ASSERT_EQUAL_size_t(a->replicates, b->replicates);
    TEST_ASSERT_EQUAL_DOUBLE(a->dE00, b->dE00);
    TEST_ASSERT_EQUAL_DOUBLE(a->rms, b->rms);
    TEST_ASSERT_EQUAL_DOUBLE(a->limit_dE00, b->limit_dE00);
    TEST_ASSERT_EQUAL_INT(a->passed, b->passed);
    same_spectrum(&a->spectrum, &b->spectrum);
}

/* ---- what comes back ---------------------------------------------------------------- */

static void test_as_they_were(void)
{
    for (int source = STORE_TILE_CERTIFICATE; source <= STORE_TILE_LIMIT; source++) {
        struct store_check_tile tile = add_tile(tile_of("t", (enum store_tile_source)source));
        TRY(store_get_check_tile(reader, tile.uuid, &found));
        same_tile(&tile, &found);
        TRY(store_last_check_tile(reader, "t", &found));
        same_tile(&tile, &found);
    }
    struct store_check_tile reference = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    for (int i = 1; i <= 3; i++) {
        struct store_check check = add_check(check_of(&reference, 0.3 * i));
        TEST_ASSERT_EQUAL_INT64(i, check.seq);
        TRY(store_get_check(reader, check.uuid, &check_found));
        same_check(&check, &check_found);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_get_check(reader, reference.uuid, &check_found));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_last_check_tile(reader, "u", &found));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

static void test_retries(void)
{
    bool known = false;
    struct store_check_tile tile = add_tile(tile_of("t", STORE_TILE_CERTIFICATE)), again = tile;
    again.spectrum.value[0] = 0.99;
    again.id[0] = '\0';
    TRY(store_add_check_tile(store, &again, &known));
    TEST_ASSERT_TRUE(known);
    same_tile(&tile, &again);
    again.parameters_sha256[0] = 'c';
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_add_check_tile(store, &again, &known));
    TEST_ASSERT_EQUAL_STRING("uuid", store_bad_member(store));

    struct store_check check = add_check(check_of(&tile, 0.1)), other = check;
    other.dE00 = 9.0;
    known = false;
    TRY(store_add_check(store, &other, &known));
    TEST_ASSERT_TRUE(known);
    same_check(&check, &other);
    other.parameters_sha256[0] = 'c';
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_add_check(store, &other, &known));
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT count(*) FROM check_reading"));
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT count(*) FROM check_tile"));
}

static void test_refused(void)
{
    bool known;
    struct store_check_tile tile = tile_of("t", STORE_TILE_CERTIFICATE);
    tile.spectrum.n = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, store_add_check_tile(store, &tile, &known));
    TEST_ASSERT_EQUAL_STRING("spectrum", store_bad_member(store));
    tile = tile_of("t", STORE_TILE_MEASURED);
    records_uuid(&dice, tile.calibration_id);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_add_check_tile(store, &tile, &known));
    TEST_ASSERT_EQUAL_STRING("calibration_id", store_bad_member(store));
    tile = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    struct store_check check = check_of(&tile, 0.1);
    records_uuid(&dice, check.reference_id);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_add_check(store, &check, &known));
    TEST_ASSERT_EQUAL_STRING("reference_id", store_bad_member(store));
    /* What was refused left no gap. */
    TEST_ASSERT_EQUAL_INT64(1, add_check(check_of(&tile, 0.1)).seq);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* One commit for records and checks, with those that are refused among them. */
static void test_in_a_group(void)
{
    bool known;
    struct store_check_tile tile = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    struct store_check bad = check_of(&tile, 0.2), good[3];
    struct store_record *record = records_make(&dice);
    bad.reference_id[0] ^= 1;
    TRY(store_begin_together(store));
    for (int i = 0; i < 3; i++) {
        good[i] = add_check(check_of(&tile, 0.1 * i));
        TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_add_check(store, &bad, &known));
        TEST_ASSERT_EQUAL_INT64(i + 1, good[i].seq);
    }
    TRY(store_add_record(store, record, &known));
    TRY(store_commit(store));
    struct store_verify_report report;
    TRY(store_verify(reader, &report));
    TEST_ASSERT_EQUAL_INT(3, tool_number(folder, "SELECT count(*) FROM check_reading"));
    free(record);
}

/* ---- which one counts --------------------------------------------------------------- */

static void expect_reference(const char *id, const char *tile, double aperture_mm,
                             const char *serial)
{
    struct store_instrument instrument = records_instrument();
    strcpy(instrument.serial, serial);
    strcpy(instrument.firmware, "another one");
    enum status s = store_find_check_reference(reader, tile, aperture_mm, &instrument, &found);
    TEST_ASSERT_EQUAL_INT(id != NULL ? STATUS_OK : STATUS_NOT_FOUND, s);
    if (id != NULL)
        TEST_ASSERT_EQUAL_STRING(id, found.id);
}

static void test_which_reference_holds(void)
{
    expect_reference(NULL, "t", 8.0, "S-0001");
    struct store_check_tile own = add_tile(tile_of("t", STORE_TILE_MEASURED));
    expect_reference(own.id, "t", 8.0, "S-0001");
    expect_reference(NULL, "t", 8.0, "S-0002");
    expect_reference(NULL, "t", 8.0, "");
    expect_reference(NULL, "t", 3.0, "S-0001");
    expect_reference(NULL, "u", 8.0, "S-0001");
    struct store_check_tile certificate = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    expect_reference(certificate.id, "t", 8.0, "S-0001");
    expect_reference(certificate.id, "t", 8.0, "S-0002");
    struct store_check_tile newer = add_tile(tile_of("t", STORE_TILE_MEASURED));
    add_tile(tile_of("t", STORE_TILE_LIMIT));
    expect_reference(newer.id, "t", 8.0, "S-0001");
    expect_reference(certificate.id, "t", 8.0, "S-0002");
}

static char seen[256];

static bool see_tile(void *context, const struct store_check_tile *tile)
{
    int *left = context;
    snprintf(seen + strlen(seen), sizeof seen - strlen(seen), "%s %g,", tile->tile,
             tile->limit_dE00);
    return --*left > 0;
}

static bool see_check(void *context, const struct store_check *check)
{
    int *left = context;
    snprintf(seen + strlen(seen), sizeof seen - strlen(seen), "%d ", (int)check->seq);
    return --*left > 0;
}

static const char *tiles_seen(const char *after, int at_most)
{
    seen[0] = '\0';
    TRY(store_list_check_tiles(reader, after, see_tile, &at_most));
    return seen;
}

static const char *checks_seen(struct store_check_query query, int at_most)
{
    seen[0] = '\0';
    TRY(store_list_checks(reader, &query, see_check, &at_most));
    return seen;
}

static const char *last_seen(const char *serial)
{
    struct store_instrument instrument = records_instrument();
    int at_most = 99;
    strcpy(instrument.serial, serial);
    seen[0] = '\0';
    TRY(store_last_checks(reader, &instrument, see_check, &at_most));
    return seen;
}

static void test_lists(void)
{
    TEST_ASSERT_EQUAL_STRING("", tiles_seen("", 9));
    struct store_check_tile b = add_tile(tile_of("b", STORE_TILE_CERTIFICATE));
    struct store_check_tile a = add_tile(tile_of("a", STORE_TILE_CERTIFICATE)), other;
    struct store_check_tile limit = tile_of("b", STORE_TILE_LIMIT);
    limit.limit_dE00 = 1.5;
    add_tile(limit);
    TEST_ASSERT_EQUAL_STRING("a 0.5,b 1.5,", tiles_seen("", 9));
    TEST_ASSERT_EQUAL_STRING("a 0.5,", tiles_seen("", 1));
    TEST_ASSERT_EQUAL_STRING("b 1.5,", tiles_seen("a", 9));

    other = b;
    other.aperture_mm = 3.0;
    add_check(check_of(&b, 0.1));                   /* 1 */
    add_check(check_of(&a, 0.1));                   /* 2 */
    add_check(check_of(&b, 0.1));                   /* 3 */
    add_check(check_of(&other, 0.1));               /* 4: through 3 mm */
    struct store_check foreign = check_of(&b, 0.1); /* 5 */
    strcpy(foreign.instrument.serial, "S-0002");
    add_check(foreign);
    struct store_check updated = check_of(&a, 0.1); /* 6: the same unit, other firmware */
    strcpy(updated.instrument.firmware, "2.0");
    add_check(updated);
    const struct store_instrument mine = records_instrument();
    TEST_ASSERT_EQUAL_STRING("1 2 3 4 5 6 ", checks_seen((struct store_check_query){ 0 }, 9));
    TEST_ASSERT_EQUAL_STRING("1 2 ", checks_seen((struct store_check_query){ 0 }, 2));
    TEST_ASSERT_EQUAL_STRING("5 6 ", checks_seen((struct store_check_query){ .since_seq = 4 }, 9));
    TEST_ASSERT_EQUAL_STRING("2 6 ", checks_seen((struct store_check_query){ .tile = "a" }, 9));
    TEST_ASSERT_EQUAL_STRING("1 2 3 4 6 ",
                             checks_seen((struct store_check_query){ .instrument = &mine }, 9));
    TEST_ASSERT_EQUAL_STRING("3 4 ", checks_seen((struct store_check_query){ 1, "b", &mine }, 9));
    TEST_ASSERT_EQUAL_STRING("1 2 3 4 5 6 ", checks_seen((struct store_check_query){ 0 }, 9));
    TEST_ASSERT_EQUAL_STRING("3 4 6 ", last_seen("S-0001"));
    TEST_ASSERT_EQUAL_STRING("5 ", last_seen("S-0002"));
    TEST_ASSERT_EQUAL_STRING("", last_seen(""));
}

/* ---- the chain ---------------------------------------------------------------------- */

static const struct change_case {
    const char *sql, *says;
} change_cases[] = {
    { "UPDATE check_reading SET passed = 1 WHERE seq = 1", "check_reading" },
    { "UPDATE check_tile SET limit_dE00 = 9 WHERE seq = 1", "check_tile" },
    { "DELETE FROM check_reading WHERE seq = 1", "is missing" },
    { "INSERT INTO check_reading SELECT 9,'x','t','u2','p','',instrument,NULL,0,tile,reference,8.0,"
      "1,400.0,10.0,bands,spectrum,0.0,0.0,0.5,1 FROM check_reading WHERE seq = 2",
      "is in no audit row" },
};

static void test_a_change_is_noticed(void)
{
    struct store_verify_report report;
    struct store_check_tile tile = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    add_check(check_of(&tile, 0.9));
    add_check(check_of(&tile, 0.9));
    TRY(store_verify(reader, &report));
    TEST_ASSERT_TRUE(tool_edit(folder,
                               "DROP TRIGGER check_tile_kept; DROP TRIGGER check_tile_fixed;"
                               "DROP TRIGGER check_reading_kept;"
                               "DROP TRIGGER check_reading_fixed;"));
    for (size_t i = 0; i < sizeof change_cases / sizeof *change_cases; i++) {
        const struct change_case *c = &change_cases[i];
        TEST_ASSERT_TRUE(tool_edit(folder, "CREATE TABLE r AS SELECT * FROM check_reading;"
                                           "CREATE TABLE s AS SELECT * FROM check_tile"));
        TEST_ASSERT_TRUE(tool_edit(folder, c->sql));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DAMAGED, store_verify(reader, &report), c->sql);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.what, c->says), report.what);
        TEST_ASSERT_TRUE(
            tool_edit(folder, "DELETE FROM check_reading; DELETE FROM check_tile;"
                              "INSERT INTO check_tile SELECT * FROM s; INSERT INTO check_reading"
                              " SELECT * FROM r; DROP TABLE r; DROP TABLE s"));
        TRY(store_verify(reader, &report));
    }
}

static int64_t long_ago(void *context)
{
    (void)context;
    return 1000;
}

/* Ids go on above those of checks, whatever the clock does. */
static void test_ids_after_the_clock_went_back(void)
{
    struct store_check_tile tile = add_tile(tile_of("t", STORE_TILE_CERTIFICATE));
    struct store_check check = add_check(check_of(&tile, 0.9));
    store_close(store);
    store = NULL;
    TRY(store_open(folder, &(struct store_clock){ long_ago, NULL }, &store));
    struct store_check later = add_check(check_of(&tile, 0.9));
    TEST_ASSERT_TRUE(strcmp(later.id, check.id) > 0);
    TEST_ASSERT_EQUAL_INT64(2, later.seq);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_as_they_were);
    RUN_TEST(test_retries);
    RUN_TEST(test_refused);
    RUN_TEST(test_in_a_group);
    RUN_TEST(test_which_reference_holds);
    RUN_TEST(test_lists);
    RUN_TEST(test_a_change_is_noticed);
    RUN_TEST(test_ids_after_the_clock_went_back);
    return UNITY_END();
}
