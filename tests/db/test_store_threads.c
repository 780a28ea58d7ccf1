/* test_store_threads.c - one thread writes, three read, one checkpoints: for the
 * thread sanitizer, and to see that readers never meet half a group. */
#include <pthread.h>
#include <stdatomic.h>

#include "tests/store/tools.h"
#include "tests/support/heard.h"

enum { GROUPS = 60, EACH = 5, READERS = 3 };

static char folder[FOLDER_PATH_SIZE];
static atomic_bool done;
static atomic_int failures;

void setUp(void)
{
    TEST_ASSERT_TRUE(folder_make(folder));
}

void tearDown(void)
{
    folder_remove(folder);
}

struct counted {
    int64_t last;
    int n;
};

static bool count(void *context, const struct store_record *record)
{
    struct counted *c = context;
    if (record->seq != c->last + 1)
        atomic_fetch_add(&failures, 1);
    c->last = record->seq;
    c->n++;
    return true;
}

/* Unity's asserts are for the main thread: failures are counted. */
static void *read_all(void *context)
{
    struct store_reader *reader;
    struct store_verify_report report;
    (void)context;
    if (store_reader_open(folder, &reader) != STATUS_OK) {
        atomic_fetch_add(&failures, 1);
        return NULL;
    }
    do {
        struct counted c = { 0 };
        if (store_list(reader, &tool_all, count, &c) != STATUS_OK || c.n % EACH != 0 ||
            store_verify(reader, &report) != STATUS_OK || report.records < c.n)
            atomic_fetch_add(&failures, 1);
    } while (!atomic_load(&done));
    store_reader_close(reader);
    return NULL;
}

static void *checkpoint(void *context)
{
    struct store_keeper *keeper;
    int left;
    int64_t bytes;
    (void)context;
    if (store_keeper_open(folder, &keeper) != STATUS_OK) {
        atomic_fetch_add(&failures, 1);
        return NULL;
    }
    while (!atomic_load(&done))
        if (store_keeper_checkpoint(keeper, &left) != STATUS_OK ||
            store_wal_bytes(folder, &bytes) != STATUS_OK)
            atomic_fetch_add(&failures, 1);
    store_keeper_close(keeper);
    return NULL;
}

static void test_all_at_once(void)
{
    struct store *store;
    struct store_subject subject = { .name = "Zoë" };
    struct store_verify_report report;
    pthread_t thread[READERS + 1];
    bool erased = false;
    TRY(store_open(folder, NULL, &store));
    TRY(store_add_subject(store, &subject, ""));
    for (int i = 0; i <= READERS; i++)
        TEST_ASSERT_EQUAL_INT(
            0, pthread_create(&thread[i], NULL, i < READERS ? read_all : checkpoint, NULL));
    for (int i = 0; i < GROUPS; i++) {
        tool_add(store, 100 + (uint64_t)i, EACH);
        if (i == GROUPS / 2)
            TRY(store_forget_subject(store, subject.id, "", &erased));
    }
    atomic_store(&done, true);
    for (int i = 0; i <= READERS; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_join(thread[i], NULL));
    TRY(store_finish_erasing(store, &erased));
    TEST_ASSERT_TRUE(erased);
    store_close(store);
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&failures));
    TRY(tool_verify(folder, &report));
    TEST_ASSERT_EQUAL_INT64(GROUPS * EACH, report.records);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_at_once);
    return UNITY_END();
}
