/* test_store_full.c - no room, or no right to write, at each place the store writes: said, by
 * the right status, nothing acknowledged is lost, and it goes on when the cause is gone. */
#include <errno.h>

#include "db/sql.h"
#include "tests/store/tools.h"
#include "tests/support/fault_disk.h"
#include "tests/support/heard.h"
#include "tests/support/small_disk.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct store_record *record;
static struct dice dice;

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 61 };
    fault_disk_limit(-1, 0, 0);
    record = records_make(&dice);
    store = NULL;
    reader = NULL;
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
}

void tearDown(void)
{
    fault_disk_limit(-1, 0, 0);
    free(record);
    store_reader_close(reader);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

static void open_both(void)
{
    TRY(store_open(folder, NULL, &store));
    TRY(store_reader_open(folder, &reader));
}

static enum status add(void)
{
    bool known;
    records_uuid(&dice, record->uuid);
    return store_add_record(store, record, &known);
}

static enum status add_group(int n)
{
    enum status s = store_begin(store);
    for (int i = 0; i < n && s == STATUS_OK; i++)
        s = add();
    enum status end = store_commit(store);
    return s != STATUS_OK ? s : end;
}

static int64_t newest(void)
{
    int64_t seq = -1;
    TRY(store_newest(reader, &seq));
    return seq;
}

/* expect: what the unix VFS of SQLite makes of each errno of a write, and store.h of that.
 * "quota" and "remounted" are SQLITE_IOERR, which only errno tells apart. */
static const struct cause_case {
    const char *what;
    int code, cause;
    enum status status;
    const char *says;
} cause_cases[] = {
    { "full", SQLITE_FULL, ENOSPC, STATUS_FULL, "No space left on device" },
    { "quota", SQLITE_IOERR_WRITE, EDQUOT, STATUS_FULL, "Disk quota exceeded" },
    { "remounted", SQLITE_IOERR_WRITE, EROFS, STATUS_READ_ONLY, "Read-only file system" },
    { "read-only", SQLITE_READONLY, EACCES, STATUS_READ_ONLY, "readonly database" },
    { "failing", SQLITE_IOERR_WRITE, EIO, STATUS_IO, "Input/output error" },
};
enum { CAUSES = sizeof cause_cases / sizeof *cause_cases };

static void limit(const struct cause_case *c, int64_t bytes)
{
    fault_disk_limit(bytes, c->code, c->cause);
}

static void no_limit(void)
{
    fault_disk_limit(-1, 0, 0);
}

static void test_making(void)
{
    static const int64_t room[] = { 0, 4096, 50000 };
    char list[FOLDER_LIST_SIZE];
    for (size_t i = 0; i < CAUSES; i++) {
        const struct cause_case *c = &cause_cases[i];
        for (size_t j = 0; j < sizeof room / sizeof *room; j++) {
            heard_start();
            limit(c, room[j]);
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, store_open(folder, NULL, &store), c->what);
            TEST_ASSERT_TRUE_MESSAGE(heard_contains(c->says), heard_last());
            TEST_ASSERT_EQUAL_STRING_MESSAGE("lock ", folder_list(folder, list), c->what);
        }
        no_limit();
    }
    open_both();
    TRY(add());
}

/* An old store opens even then: it can be read, and written when there is room. */
static void test_opening_an_old_one(void)
{
    open_both();
    TRY(add_group(20));
    store_reader_close(reader);
    reader = NULL;
    store_close(store);
    store = NULL;
    fault_disk_limit(0, SQLITE_FULL, ENOSPC);
    open_both();
    TEST_ASSERT_EQUAL_INT64(20, newest());
    TEST_ASSERT_EQUAL_INT(STATUS_FULL, add());
    no_limit();
    TRY(add());
    TEST_ASSERT_EQUAL_INT64(21, record->seq);
}

/* After each: the same seq again, for nothing of the failed group is there. */
static void test_commits(void)
{
    static const int64_t room[] = { 0, 5000, 30000 };
    struct store_verify_report report;
    int64_t kept = 0;
    open_both();
    for (size_t i = 0; i < CAUSES; i++) {
        const struct cause_case *c = &cause_cases[i];
        for (size_t j = 0; j < sizeof room / sizeof *room; j++) {
            heard_start();
            limit(c, room[j]);
            enum status s = add_group(5);
            no_limit();
            TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, s, heard_last());
            TEST_ASSERT_TRUE_MESSAGE(heard_contains(c->says), heard_last());
            TEST_ASSERT_EQUAL_INT64_MESSAGE(kept, newest(), c->what);
            TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, add(), c->what);
            TEST_ASSERT_EQUAL_INT64_MESSAGE(++kept, record->seq, c->what);
        }
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_verify(reader, &report), report.what);
    TEST_ASSERT_EQUAL_INT64(kept, report.records);
}

/* The cache spills into the WAL before the commit: the group is lost then, and says so. */
static void test_within_a_group(void)
{
    enum status s = STATUS_OK;
    open_both();
    TRY(add());
    fault_disk_limit(400000, SQLITE_FULL, ENOSPC);
    TRY(store_begin(store));
    for (int i = 0; i < 5000 && s == STATUS_OK; i++)
        s = add();
    enum status end = store_commit(store);
    no_limit();
    TEST_ASSERT_EQUAL_INT(STATUS_FULL, s);
    TEST_ASSERT_EQUAL_INT(STATUS_FULL, end);
    TEST_ASSERT_EQUAL_INT64(1, newest());
    TRY(add());
    TEST_ASSERT_EQUAL_INT64(2, record->seq);
}

/* What could not be copied into the file stays in the WAL. */
static void test_checkpoints(void)
{
    struct store_keeper *keeper;
    struct store_verify_report report;
    int left = 77;
    open_both();
    TRY(add_group(60));
    TRY(store_keeper_open(folder, &keeper));
    for (size_t i = 0; i < CAUSES; i++) {
        const struct cause_case *c = &cause_cases[i];
        heard_start();
        limit(c, 20000);
        enum status s = store_keeper_checkpoint(keeper, &left);
        no_limit();
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, s, c->what);
        TEST_ASSERT_TRUE_MESSAGE(heard_contains(c->says), heard_last());
        TEST_ASSERT_EQUAL_INT(77, left);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_verify(reader, &report), c->what);
        TEST_ASSERT_EQUAL_INT64(60, report.records);
    }
    TRY(store_keeper_checkpoint(keeper, &left));
    TEST_ASSERT_EQUAL_INT(0, left);
    store_keeper_close(keeper);
    /* And the last one, when it is closed: the next start finds all in the WAL. */
    TRY(add());
    store_reader_close(reader);
    reader = NULL;
    fault_disk_limit(0, SQLITE_FULL, ENOSPC);
    store_close(store);
    store = NULL;
    no_limit();
    open_both();
    TEST_ASSERT_EQUAL_INT64(61, newest());
}

/* ---- a real disk ------------------------------------------------------------------------- */

/* A file that takes all the room there is; its size. */
static long fill(const char *file)
{
    static const char zeros[4096];
    FILE *f = fopen(file, "wb");
    long n = 0;
    if (f == NULL)
        return -1;
    setvbuf(f, NULL, _IONBF, 0);
    while (fwrite(zeros, 1, sizeof zeros, f) == sizeof zeros)
        n += (long)sizeof zeros;
    fclose(f);
    return n;
}

#define MUST(x) \
    do { \
        if (!(x)) { \
            printf("line %d: %s; said: %s\n", __LINE__, #x, heard_last()); \
            fflush(NULL); \
            return 1; \
        } \
    } while (0)

static int on_a_full_disk(void)
{
    char filler[FOLDER_PATH_SIZE];
    struct store_keeper *keeper;
    enum status s = STATUS_OK;
    int left = 0;
    folder_path(folder, "filler", filler);
    if (!small_disk_mount(folder))
        return SMALL_DISK_NONE;
    MUST(fill(filler) > 500000);
    MUST(store_open(folder, NULL, &store) == STATUS_FULL);
    MUST(heard_contains("No space left on device"));
    unlink(filler);
    MUST(store_open(folder, NULL, &store) == STATUS_OK);
    MUST(store_reader_open(folder, &reader) == STATUS_OK);
    for (int i = 0; i < 1000 && s == STATUS_OK; i++)
        s = add_group(2);
    MUST(s == STATUS_FULL);
    int64_t kept = newest();
    MUST(kept > 10 && kept % 2 == 0);
    /* There is no room to copy the WAL into the file either: only a checkpoint would make some. */
    MUST(store_keeper_open(folder, &keeper) == STATUS_OK);
    MUST(store_keeper_checkpoint(keeper, &left) == STATUS_FULL);
    MUST(newest() == kept);
    store_keeper_close(keeper);
    store_reader_close(reader);
    reader = NULL;
    store_close(store);
    store = NULL;
    /* Closed without room: the WAL is kept, and read. */
    MUST(store_reader_open(folder, &reader) == STATUS_OK);
    MUST(newest() == kept);
    return 0;
}

static int on_a_read_only_disk(void)
{
    struct store_verify_report report;
    struct store_claim *claim = NULL;
    if (!small_disk_mount(folder))
        return SMALL_DISK_NONE;
    MUST(store_open(folder, NULL, &store) == STATUS_OK);
    MUST(add_group(3) == STATUS_OK);
    store_close(store);
    store = NULL;
    if (!small_disk_remount(folder, true))
        return SMALL_DISK_NONE;
    MUST(store_claim(folder, &claim) == STATUS_READ_ONLY && claim == NULL);
    MUST(store_open(folder, NULL, &store) == STATUS_READ_ONLY);
    MUST(store_begin_anew(folder) == STATUS_READ_ONLY);
    MUST(heard_contains("Read-only file system"));
    MUST(store_reader_open(folder, &reader) == STATUS_OK);
    MUST(store_verify(reader, &report) == STATUS_OK && report.records == 3);
    MUST(small_disk_remount(folder, false));
    MUST(store_open(folder, NULL, &store) == STATUS_OK);
    MUST(add() == STATUS_OK && record->seq == 4);
    return 0;
}

static const struct disk_case {
    const char *what;
    int (*body)(void);
} disk_cases[] = {
    { "full", on_a_full_disk },
    { "read-only", on_a_read_only_disk },
};

static void test_real_disks(void)
{
    for (size_t i = 0; i < sizeof disk_cases / sizeof *disk_cases; i++) {
        int ended = small_disk_child(disk_cases[i].body);
        if (ended == SMALL_DISK_NONE)
            TEST_IGNORE_MESSAGE("no right to mount a small disk");
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, ended, disk_cases[i].what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    if (!fault_disk_install())
        return 1;
    RUN_TEST(test_making);
    RUN_TEST(test_opening_an_old_one);
    RUN_TEST(test_commits);
    RUN_TEST(test_within_a_group);
    RUN_TEST(test_checkpoints);
    RUN_TEST(test_real_disks);
    return UNITY_END();
}
