/* test_store_no_memory.c - SQLite's allocations fail, one after the other: what is said to
 * be kept is kept, what is not is not there, and the chain holds. */
#include "db/store.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"
#include "tests/support/no_memory.h"

static char folder[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct store_record *record;
static struct dice dice;

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 51 };
    TEST_ASSERT_TRUE(folder_make(folder));
    TRY(store_open(folder, NULL, &store));
    TRY(store_reader_open(folder, &reader));
    record = records_make(&dice);
}

void tearDown(void)
{
    no_memory_after(-1);
    free(record);
    store_reader_close(reader);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

/* Each of the first allocations, then every second, every third, ... */
enum { STRIDE = 40 };

/* One thing to try with so much memory. */
typedef enum status attempt(void);

static enum status attempt_group(void)
{
    struct store_calibration calibration = { .instrument = records_instrument(), .step = "zero" };
    bool known;
    snprintf(calibration.instrument.serial, sizeof calibration.instrument.serial, "%zu",
             dice_below(&dice, 1000000));
    records_uuid(&dice, record->uuid);
    records_uuid(&dice, record->site);
    enum status s = store_begin(store);
    if (s != STATUS_OK)
        return s;
    s = store_add_record(store, record, &known);
    enum status other = store_add_calibration(store, &calibration);
    enum status end = store_commit(store);
    return s != STATUS_OK ? s : other != STATUS_OK ? other : end;
}

/* As the writer does: a group that must part is done again. */
static enum status attempt_together(void)
{
    struct store_calibration calibration = { .instrument = records_instrument(), .step = "zero" };
    bool known;
    records_uuid(&dice, record->uuid);
    records_uuid(&dice, record->site);
    enum status s = store_begin_together(store);
    if (s != STATUS_OK)
        return s;
    s = store_add_record(store, record, &known);
    enum status other = store_add_calibration(store, &calibration);
    if (store_must_part(store)) {
        store_rollback(store);
        return attempt_group();
    }
    enum status end = store_commit(store);
    return s != STATUS_OK ? s : other != STATUS_OK ? other : end;
}

static enum status attempt_single(void)
{
    bool known;
    records_uuid(&dice, record->uuid);
    return store_add_record(store, record, &known);
}

static enum status attempt_subject(void)
{
    struct store_subject subject = { .name = "Zoë" };
    bool erased;
    enum status s = store_add_subject(store, &subject, "x");
    return s == STATUS_OK ? store_forget_subject(store, subject.id, "x", &erased) : s;
}

static enum status attempt_rest(void)
{
    int left;
    enum status s = store_prune(store);
    return s == STATUS_OK ? tool_checkpoint(folder, &left) : s;
}

static bool nothing(void *context, const struct store_record *r)
{
    (void)r;
    ++*(int *)context;
    return true;
}

static enum status attempt_list(void)
{
    int n = 0;
    return store_list(reader, &tool_all, nothing, &n);
}

static enum status attempt_verify(void)
{
    struct store_verify_report report;
    return store_verify(reader, &report);
}

static enum status attempt_reader(void)
{
    struct store_reader *other;
    enum status s = store_reader_open(folder, &other);
    if (s == STATUS_OK)
        store_reader_close(other);
    return s;
}

static enum status attempt_open(void)
{
    store_close(store);
    store = NULL;
    return store_open(folder, NULL, &store);
}

static enum status attempt_make(void)
{
    char file[FOLDER_PATH_SIZE];
    store_close(store);
    store = NULL;
    unlink(folder_path(folder, "station.db", file));
    unlink(folder_path(folder, "station.db-wal", file));
    return store_open(folder, NULL, &store);
}

static const struct attempt_case {
    const char *what;
    attempt *run;
} attempt_cases[] = {
    { "a group", attempt_group },    { "a group together", attempt_together },
    { "a record", attempt_single },  { "a subject", attempt_subject },
    { "the rest", attempt_rest },    { "a list", attempt_list },
    { "verifying", attempt_verify }, { "a reader", attempt_reader },
    { "opening", attempt_open },     { "making", attempt_make },
};

static void test_allocations_in_turn(void)
{
    tool_add(store, 9, 3);
    for (size_t i = 0; i < sizeof attempt_cases / sizeof *attempt_cases; i++) {
        const struct attempt_case *c = &attempt_cases[i];
        struct store_verify_report report;
        long refused = 0;
        for (long enough = 0;; enough += 1 + enough / STRIDE) {
            no_memory_after(enough);
            enum status s = c->run();
            bool failed = no_memory_met();
            no_memory_after(-1);
            TEST_ASSERT_TRUE_MESSAGE(s == STATUS_OK || s == STATUS_NO_MEMORY || s == STATUS_IO ||
                                         s == STATUS_DB,
                                     c->what);
            if (s == STATUS_OK && !failed)
                break;
            refused += s != STATUS_OK;
            TEST_ASSERT_MESSAGE(enough < 20000, heard_last());
        }
        TEST_ASSERT_MESSAGE(refused > 3, c->what);
        if (store == NULL)
            TRY(store_open(folder, NULL, &store));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, tool_verify(folder, &report), heard_last());
    }
}

int main(void)
{
    UNITY_BEGIN();
    if (!no_memory_install())
        return 1;
    RUN_TEST(test_allocations_in_turn);
    return UNITY_END();
}
