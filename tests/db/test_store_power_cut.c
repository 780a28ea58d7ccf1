/* test_store_power_cut.c - the power goes after each single write, and what was not synced is
 * kept, lost, torn or shuffled: every acknowledged record is there, whole, and the chain
 * holds. */
#include "db/sql.h"
#include "db/store.h"
#include "tests/store/older.h"
#include "tests/store/tools.h"
#include "tests/support/fault_disk.h"
#include "tests/support/heard.h"

enum { ACKNOWLEDGED_MAX = 64 };

/* What a client was told, and how many operations the disk had done by then. */
static struct acknowledged {
    size_t ops;
    int64_t seq;
    char id[STORE_UUID_SIZE];
} told[ACKNOWLEDGED_MAX];
static size_t told_n;

static char folder[FOLDER_PATH_SIZE], after[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_record *record;
static struct dice dice;

void setUp(void)
{
    heard_start();
    fault_disk_skip_sync(true);
    dice = (struct dice){ 71 };
    told_n = 0;
    store = NULL;
    record = records_make(&dice);
    TEST_ASSERT_TRUE(folder_make(folder) && folder_make(after));
}

void tearDown(void)
{
    fault_disk_stop();
    free(record);
    store_close(store);
    heard_stop();
    folder_remove(folder);
    folder_remove(after);
}

/* ---- what happens ---------------------------------------------------------------------- */

static void tell(const char *id, int64_t seq)
{
    TEST_ASSERT_TRUE(told_n < ACKNOWLEDGED_MAX);
    told[told_n] = (struct acknowledged){ .ops = fault_disk_ops(), .seq = seq };
    memcpy(told[told_n++].id, id, STORE_UUID_SIZE);
}

static void add_group(int n)
{
    char id[8][STORE_UUID_SIZE];
    int64_t seq[8];
    bool known;
    TRY(store_begin(store));
    for (int i = 0; i < n; i++) {
        records_uuid(&dice, record->uuid);
        TRY(store_add_record(store, record, &known));
        memcpy(id[i], record->id, sizeof id[i]);
        seq[i] = record->seq;
    }
    TRY(store_commit(store));
    for (int i = 0; i < n; i++)
        tell(id[i], seq[i]);
}

/* Groups, checkpoints after which the WAL is written from its beginning again, a person who
 * is forgotten, and the end. */
static void a_day(void)
{
    struct store_subject subject = { .name = "Zoë" };
    struct store_keeper *keeper;
    int left;
    bool erased;
    TRY(store_open(folder, NULL, &store));
    TRY(store_keeper_open(folder, &keeper));
    add_group(1);
    add_group(3);
    TRY(store_keeper_checkpoint(keeper, &left));
    add_group(1);
    TRY(store_add_subject(store, &subject, ""));
    TRY(store_keeper_checkpoint(keeper, &left));
    TRY(store_forget_subject(store, subject.id, "", &erased));
    TEST_ASSERT_TRUE(erased);
    add_group(2);
    store_keeper_close(keeper);
    store_close(store);
    store = NULL;
}

static void a_migration(void)
{
    TRY(store_open(folder, NULL, &store));
    store_close(store);
    store = NULL;
}

/* ---- and what is left of it ---------------------------------------------------------------- */

static void take_image(struct fault_disk_image *ret)
{
    char path[FOLDER_PATH_SIZE];
    *ret = (struct fault_disk_image){ .file = { { NULL, 0 } } };
    struct fault_disk_file *db = &ret->file[FAULT_DISK_DB];
    db->bytes = file_bytes(folder_path(folder, "station.db", path), &db->n);
    TEST_ASSERT_NOT_NULL(db->bytes);
}

static void put_image(const struct fault_disk_image *image)
{
    static const char *const name[FAULT_DISK_FILES] = { "station.db", "station.db-wal" };
    char path[FOLDER_PATH_SIZE];
    for (int f = 0; f < FAULT_DISK_FILES; f++)
        TEST_ASSERT_TRUE(
            file_write(folder_path(after, name[f], path), image->file[f].bytes, image->file[f].n));
    unlink(folder_path(after, "station.db-shm", path));
}

static void check_image(size_t ops, const char *what)
{
    struct store_reader *reader;
    struct store_verify_report report;
    struct store *again = NULL;
    struct store_record *got = malloc(sizeof *got);
    TEST_ASSERT_NOT_NULL(got);
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_open(after, NULL, &again), heard_last());
    TRY(store_reader_open(after, &reader));
    for (size_t i = 0; i < told_n && told[i].ops <= ops; i++) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_get(reader, told[i].id, NULL, got), what);
        TEST_ASSERT_EQUAL_INT64_MESSAGE(told[i].seq, got->seq, what);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_verify(reader, &report), report.what);
    store_reader_close(reader);
    store_close(again);
    free(got);
}

/* Each cut, each way; how many there were. */
static size_t cut_everywhere(void (*happens)(void))
{
    struct fault_disk_image before;
    size_t cuts = 0;
    take_image(&before);
    fault_disk_record();
    happens();
    fault_disk_stop();
    for (size_t ops = 0; ops <= fault_disk_ops(); ops++) {
        for (int cut = 0; cut < FAULT_DISK_CUTS; cut++, cuts++) {
            struct fault_disk_image image;
            char what[64];
            snprintf(what, sizeof what, "after %zu operations, cut %d", ops, cut);
            fault_disk_cut(&before, ops, (enum fault_disk_cut)cut, cuts, &image);
            put_image(&image);
            check_image(ops, what);
            fault_disk_image_done(&image);
        }
    }
    fault_disk_image_done(&before);
    return cuts;
}

static void test_a_day(void)
{
    TRY(store_open(folder, NULL, &store));
    add_group(2);
    store_close(store);
    store = NULL;
    size_t cuts = cut_everywhere(a_day);
    printf("%zu power cuts, %zu records\n", cuts, told_n);
    TEST_ASSERT_TRUE(cuts > 400);
}

/* From the first version to this one, a step after the other: either, with all that was there. */
static void test_a_migration(void)
{
    record->owner_uid = -1; /* it was not known then */
    TRY(store_open(folder, NULL, &store));
    add_group(3);
    store_close(store);
    store = NULL;
    TEST_ASSERT_TRUE(older_make(folder));
    size_t cuts = cut_everywhere(a_migration);
    printf("%zu power cuts while migrating\n", cuts);
    TEST_ASSERT_TRUE(cuts > 40);
    TEST_ASSERT_EQUAL_INT(4, tool_number(folder, "PRAGMA user_version"));
}

int main(void)
{
    UNITY_BEGIN();
    if (!fault_disk_install())
        return 1;
    RUN_TEST(test_a_day);
    RUN_TEST(test_a_migration);
    return UNITY_END();
}
