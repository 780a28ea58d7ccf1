/* test_store_keeper.c - checkpoints on a connection that is kept: beside a writer, behind a
 * reader that holds the WAL, and never into a file that lost its place. */
#include "db/sql.h"
#include "db/station_schema.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_keeper *keeper;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    TRY(store_open(folder, NULL, &store));
    TRY(store_keeper_open(folder, &keeper));
}

void tearDown(void)
{
    store_keeper_close(keeper);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

static int checkpoint(void)
{
    int left = -1;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_keeper_checkpoint(keeper, &left), heard_last());
    return left;
}

/* Each takes all that was committed until then, and the WAL is used again from its begin. */
static void test_again_and_again(void)
{
    int64_t first, last;
    TEST_ASSERT_EQUAL_INT(0, checkpoint()); /* nothing yet */
    tool_add(store, 1, 50);
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
    TRY(store_wal_bytes(folder, &first));
    for (uint64_t i = 2; i < 12; i++) {
        tool_add(store, i, 50);
        TEST_ASSERT_EQUAL_INT(0, checkpoint());
        TEST_ASSERT_EQUAL_INT(0, checkpoint());
    }
    TRY(store_wal_bytes(folder, &last));
    TEST_ASSERT_TRUE(last < 2 * first);
    TEST_ASSERT_EQUAL_INT(550, tool_number(folder, "SELECT count(*) FROM measurement"));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* Without a keeper the WAL only grows; begun anew it is overwritten from its start. */
static void test_restarted_by_the_writer(void)
{
    int64_t first, grown, last;
    bool restarted = false;
    tool_add(store, 1, 50);
    TRY(store_wal_bytes(folder, &first));
    tool_add(store, 2, 50);
    TRY(store_wal_bytes(folder, &grown));
    TEST_ASSERT_TRUE(grown > first * 3 / 2);
    for (uint64_t i = 3; i < 13; i++) {
        TRY(store_restart_wal(store, false, &restarted));
        TEST_ASSERT_TRUE(restarted);
        tool_add(store, i, 50);
    }
    TRY(store_wal_bytes(folder, &last));
    TEST_ASSERT_TRUE(last < 2 * grown);
    TEST_ASSERT_EQUAL_INT(600, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* A reader in the middle of something is not waited for, and not disturbed. */
static void test_not_restarted_under_a_reader(void)
{
    sqlite3 *pin;
    bool restarted = true;
    tool_add(store, 1, 10);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM measurement"));
    tool_add(store, 2, 10);
    TRY(store_restart_wal(store, false, &restarted));
    TEST_ASSERT_FALSE(restarted);
    tool_add(store, 3, 10);
    TRY(sql_run(pin, "COMMIT"));
    sqlite3_close(pin);
    TRY(store_restart_wal(store, false, &restarted));
    TEST_ASSERT_TRUE(restarted);
    TEST_ASSERT_EQUAL_INT(30, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* However small it is. */
static void test_cut_by_the_writer(void)
{
    int64_t bytes;
    bool restarted = false;
    tool_add(store, 1, 10);
    TEST_ASSERT_TRUE(store_own_wal_bytes(store) > 0);
    TRY(store_restart_wal(store, true, &restarted));
    TEST_ASSERT_TRUE(restarted);
    TRY(store_wal_bytes(folder, &bytes));
    TEST_ASSERT_EQUAL_INT64(0, bytes);
    TEST_ASSERT_EQUAL_INT64(0, store_own_wal_bytes(store));
    TEST_ASSERT_EQUAL_INT(10, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* It is a write and no pretence, and leaves everything as it is. */
static void test_trying(void)
{
    sqlite3 *other;
    tool_add(store, 1, 3);
    int64_t before = store_own_wal_bytes(store);
    TRY(store_try(store));
    TEST_ASSERT_TRUE(store_own_wal_bytes(store) > before);
    TEST_ASSERT_EQUAL_INT(3, tool_number(folder, "SELECT count(*) FROM measurement"));
    TEST_ASSERT_EQUAL_INT(STATION_APPLICATION_ID, tool_number(folder, "PRAGMA application_id"));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &other));
    TRY(sql_run(other, "BEGIN IMMEDIATE"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_try(store));
    sqlite3_close(other);
    TRY(store_try(store));
}

/* In the middle of a group only what was committed is copied; nobody waits. */
static void test_beside_an_open_group(void)
{
    struct dice dice = { 3 };
    struct store_record *r = records_make(&dice);
    bool known;
    tool_add(store, 1, 5);
    TRY(store_begin(store));
    TRY(store_add_record(store, r, &known));
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
    TRY(store_commit(store));
    free(r);
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
    TEST_ASSERT_EQUAL_INT(6, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* A long reader: pages are left and counted until it is done. */
static void test_behind_a_reader(void)
{
    sqlite3 *pin;
    tool_add(store, 1, 10);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM measurement"));
    tool_add(store, 2, 100);
    int pinned = checkpoint();
    TEST_ASSERT_TRUE(pinned > 100);
    tool_add(store, 3, 100);
    TEST_ASSERT_TRUE(checkpoint() > pinned);
    TRY(sql_run(pin, "COMMIT"));
    sqlite3_close(pin);
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
}

/* One that is there first, at the WAL's own lock: as good as ours. */
static void test_beside_another_checkpoint(void)
{
    struct store_keeper *other;
    TRY(store_keeper_open(folder, &other));
    tool_add(store, 1, 10);
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
    int left = 77;
    TRY(store_keeper_checkpoint(other, &left));
    TEST_ASSERT_EQUAL_INT(0, left);
    store_keeper_close(other);
    store_keeper_close(NULL);
}

/* The file, or its WAL, moved away: neither copied from nor into. */
static void test_moved(void)
{
    char elsewhere[FOLDER_PATH_SIZE];
    bool restarted;
    int left = 77;
    size_t before_size, after_size;
    tool_add(store, 1, 10);
    folder_path(folder, "elsewhere", elsewhere);
    TEST_ASSERT_EQUAL_INT(0, rename(path, elsewhere));
    unsigned char *before = file_bytes(elsewhere, &before_size);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_keeper_checkpoint(keeper, &left));
    TEST_ASSERT_TRUE(heard_contains("moved or deleted"));
    TEST_ASSERT_EQUAL_INT(77, left);
    unsigned char *after = file_bytes(elsewhere, &after_size);
    TEST_ASSERT_EQUAL_size_t(before_size, after_size);
    TEST_ASSERT_EQUAL_MEMORY(before, after, after_size);
    free(before);
    free(after);
    TEST_ASSERT_TRUE(store_is_moved(store));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_restart_wal(store, true, &restarted));
    TEST_ASSERT_TRUE(store_own_wal_bytes(store) > 0);
    TEST_ASSERT_EQUAL_INT(0, rename(elsewhere, path));
    TEST_ASSERT_EQUAL_INT(0, checkpoint());
}

/* expect: store.h; nothing is made where nothing is. */
static void test_no_store(void)
{
    char other[FOLDER_PATH_SIZE], list[FOLDER_LIST_SIZE];
    struct store_keeper *none = NULL;
    static char longest[5001];
    store_keeper_close(keeper);
    keeper = NULL;
    store_close(store);
    store = NULL;
    memset(longest, 'x', sizeof longest - 1);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_keeper_open(longest, &none));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_keeper_open(folder_path(folder, "none", other), &none));
    unlink(path);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_keeper_open(folder, &none));
    TEST_ASSERT_EQUAL_STRING("lock ", folder_list(folder, list));
    TEST_ASSERT_TRUE(file_write(path, "not a database, but a letter of some length", 43));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, store_keeper_open(folder, &none));
    TEST_ASSERT_TRUE(heard_contains("not a database"));
    TEST_ASSERT_NULL(none);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_again_and_again);
    RUN_TEST(test_restarted_by_the_writer);
    RUN_TEST(test_not_restarted_under_a_reader);
    RUN_TEST(test_cut_by_the_writer);
    RUN_TEST(test_trying);
    RUN_TEST(test_beside_an_open_group);
    RUN_TEST(test_behind_a_reader);
    RUN_TEST(test_beside_another_checkpoint);
    RUN_TEST(test_moved);
    RUN_TEST(test_no_store);
    return UNITY_END();
}
