/* test_store_claim.c - one writer, told at once; stores and beginnings anew under one claim. */
#define _GNU_SOURCE /* syscall */
#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE], list[FOLDER_LIST_SIZE];
static struct store_claim *claim;
static struct store *store;

/* In this program this stands before the C library's: what the system does, or the error that is
 * asked for. */
static int flock_error;

int flock(int fd, int operation)
{
    if (flock_error == 0)
        return (int)syscall(SYS_flock, fd, operation);
    errno = flock_error;
    return -1;
}

void setUp(void)
{
    flock_error = 0;
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    claim = NULL;
    store = NULL;
}

void tearDown(void)
{
    store_close(store);
    store_claim_release(claim);
    heard_stop();
    folder_remove(folder);
}

static void close_store(void)
{
    store_close(store);
    store = NULL;
}

/* As another program sees it. */
static bool is_locked(void)
{
    char lock[FOLDER_PATH_SIZE];
    int fd = open(folder_path(folder, "lock", lock), O_RDWR);
    bool locked = fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) != 0;
    if (fd >= 0)
        close(fd);
    return locked;
}

/* Nothing but the lock is made, whatever else is in the folder. */
static void test_claimed_and_released(void)
{
    struct store_claim *second = NULL;
    TEST_ASSERT_TRUE(file_write(path, "a foreign file", 14));
    TRY(store_claim(folder, &claim));
    TEST_ASSERT_TRUE(is_locked());
    TEST_ASSERT_EQUAL_STRING("lock station.db ", folder_list(folder, list));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_claim(folder, &second));
    TEST_ASSERT_NULL(second);
    TEST_ASSERT_TRUE(heard_contains("another process"));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_open(folder, NULL, &store));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_begin_anew(folder));
    store_claim_release(claim);
    TEST_ASSERT_FALSE(is_locked());
    TRY(store_claim(folder, &claim));
    store_claim_release(NULL);
}

/* The claim outlives its stores, and is held in between. */
static void test_stores_under_one_claim(void)
{
    TRY(store_claim(folder, &claim));
    for (int i = 0; i < 3; i++) {
        TRY(store_open_claimed(claim, NULL, &store));
        tool_add(store, 7 + (uint64_t)i, 2);
        close_store();
        TEST_ASSERT_TRUE(is_locked());
    }
    TEST_ASSERT_EQUAL_INT(6, tool_number(folder, "SELECT count(*) FROM measurement"));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* A store of its own claim gives it back; one that could not be opened as well. */
static void test_a_claim_of_its_own(void)
{
    TRY(store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(is_locked());
    close_store();
    TEST_ASSERT_FALSE(is_locked());
    unlink(path);
    TEST_ASSERT_TRUE(file_write(path, "a foreign file", 14));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, store_open(folder, NULL, &store));
    TEST_ASSERT_FALSE(is_locked());
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_begin_anew(folder));
    TEST_ASSERT_FALSE(is_locked());
}

/* Damage, and a new beginning, without letting anybody else in. */
static void test_begin_anew_under_the_claim(void)
{
    char id[STORE_UUID_SIZE];
    TRY(store_claim(folder, &claim));
    TRY(store_open_claimed(claim, NULL, &store));
    tool_add(store, 1, 5);
    snprintf(id, sizeof id, "%s", store_station_id(store));
    close_store();
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_begin_anew_claimed(claim));
    FILE *f = fopen(path, "r+b");
    TEST_ASSERT_NOT_NULL(f);
    fseek(f, 68, SEEK_SET); /* SQLite's application_id */
    fputs("spoilt", f);
    fclose(f);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open_claimed(claim, NULL, &store));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open_claimed(claim, NULL, &store));
    TEST_ASSERT_NULL(store);
    TEST_ASSERT_TRUE(is_locked());
    TRY(store_begin_anew_claimed(claim));
    TEST_ASSERT_TRUE(is_locked());
    TRY(store_open_claimed(claim, NULL, &store));
    TEST_ASSERT_TRUE(strcmp(id, store_station_id(store)) != 0);
    tool_add(store, 2, 1);
    TEST_ASSERT_EQUAL_INT(6, tool_number(folder, "SELECT seq FROM measurement"));
}

/* expect: store.h. */
static const struct folder_case {
    const char *what, *name;
    enum status status;
    const char *says;
} folder_cases[] = {
    { "no such folder", "none", STATUS_IO, "No such file or directory" },
    { "a file", "file", STATUS_IO, "Not a directory" },
    { "a folder in the lock's place", ".", STATUS_IO, "Is a directory" },
};

static void test_folders_that_will_not_do(void)
{
    char other[FOLDER_PATH_SIZE], lock[FOLDER_PATH_SIZE];
    static char longest[5001];
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "file", other), "x", 1));
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder_path(folder, "lock", lock), 0700));
    for (size_t i = 0; i < sizeof folder_cases / sizeof *folder_cases; i++) {
        const struct folder_case *c = &folder_cases[i];
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->status, store_claim(folder_path(folder, c->name, other), &claim), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
    }
    rmdir(lock);
    memset(longest, 'x', sizeof longest - 1);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_claim(longest, &claim));
    TEST_ASSERT_TRUE(heard_contains("File name too long"));
    TEST_ASSERT_NULL(claim);
}

/* A file system that cannot lock at all is not one that somebody has. */
static void test_no_locks_to_be_had(void)
{
    flock_error = ENOLCK;
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_claim(folder, &claim));
    TEST_ASSERT_TRUE(heard_contains("No locks available"));
    TEST_ASSERT_NULL(claim);
}

/* ---- fences ------------------------------------------------------------------------- */

static void claim_again(void)
{
    store_claim_release(claim);
    claim = NULL;
    TRY(store_claim(folder, &claim));
}

/* Whatever becomes of station.db, of the claim, and with what the caller knows. */
static void test_fences_never_come_again(void)
{
    int64_t first = 0;
    TRY(store_claim(folder, &claim));
    TRY(store_reserve_fences(claim, 0, 10, &first));
    TEST_ASSERT_EQUAL_INT64(1, first);
    claim_again();
    TRY(store_reserve_fences(claim, 0, 5, &first));
    TEST_ASSERT_EQUAL_INT64(11, first);
    TRY(store_reserve_fences(claim, 1000, 1, &first));
    TEST_ASSERT_EQUAL_INT64(1001, first);
    claim_again();
    TRY(store_reserve_fences(claim, 7, 1, &first));
    TEST_ASSERT_EQUAL_INT64(1002, first);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* The last that a double can tell from the next: 2^53 - 1. */
static void test_fences_run_out(void)
{
    const int64_t most = INT64_C(9007199254740991);
    int64_t first = 0;
    TRY(store_claim(folder, &claim));
    TRY(store_reserve_fences(claim, most - 1, 1, &first));
    TEST_ASSERT_EQUAL_INT64(most, first);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, store_reserve_fences(claim, 0, 1, &first));
    TEST_ASSERT_EQUAL_INT64(most, first);
}

/* What somebody else wrote there is no number. */
static void test_a_lock_that_holds_something_else(void)
{
    static const char *const texts[] = { "12\n", "000000000000000000x\n", "0000000000000000001" };
    char lock[FOLDER_PATH_SIZE];
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        int64_t first = 0;
        TEST_ASSERT_TRUE(file_write(folder_path(folder, "lock", lock), texts[i], strlen(texts[i])));
        claim_again();
        TRY(store_reserve_fences(claim, 41, 1, &first));
        TEST_ASSERT_EQUAL_INT64_MESSAGE(42, first, texts[i]);
        TEST_ASSERT_TRUE_MESSAGE(heard_contains("those on record"), texts[i]);
    }
}

/* ---- within one process -------------------------------------------------------------------- */

/* Does this process hold a POSIX lock on the file?  Another one is asked to look. */
static bool holds_lock(const char *name)
{
    char file[FOLDER_PATH_SIZE];
    int ended = 0;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        struct flock all = { .l_type = F_WRLCK, .l_whence = SEEK_SET };
        int fd = open(folder_path(folder, name, file), O_RDWR);
        _exit(fd >= 0 && fcntl(fd, F_GETLK, &all) == 0 && all.l_type != F_UNLCK ? 0 : 1);
    }
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &ended, 0));
    return WIFEXITED(ended) && WEXITSTATUS(ended) == 0;
}

static bool one(void *context, const struct store_record *record)
{
    (void)context;
    (void)record;
    return true;
}

static void do_a_reader(void)
{
    struct store_reader *reader;
    struct store_verify_report report;
    TRY(store_reader_open(folder, &reader));
    TRY(store_verify(reader, &report));
    TRY(store_list(reader, &tool_all, one, NULL));
    store_reader_close(reader);
}

static void do_a_keeper(void)
{
    int left;
    TRY(tool_checkpoint(folder, &left));
}

static void do_wal_bytes(void)
{
    int64_t bytes;
    TRY(store_wal_bytes(folder, &bytes));
    TEST_ASSERT_TRUE(bytes > 0);
}

static void do_a_second_claim(void)
{
    struct store_claim *second;
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_claim(folder, &second));
}

static void do_a_second_store(void)
{
    struct store *second;
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_open(folder, NULL, &second));
}

/* With a store open in this process nothing else here takes its locks away: a second
 * program would then write, or recover the WAL, beside it. */
static const struct neighbour_case {
    const char *what;
    void (*does)(void);
} neighbour_cases[] = {
    { "a reader", do_a_reader },
    { "a keeper", do_a_keeper },
    { "the size of the WAL", do_wal_bytes },
    { "a second claim", do_a_second_claim },
    { "a second store", do_a_second_store },
};

static void test_locks_stay(void)
{
    TRY(store_open(folder, NULL, &store));
    for (size_t i = 0; i < sizeof neighbour_cases / sizeof *neighbour_cases; i++) {
        const struct neighbour_case *c = &neighbour_cases[i];
        tool_add(store, i, 3);
        TEST_ASSERT_TRUE_MESSAGE(holds_lock("station.db"), c->what);
        TEST_ASSERT_TRUE_MESSAGE(holds_lock("station.db-shm"), c->what);
        c->does();
        TEST_ASSERT_TRUE_MESSAGE(holds_lock("station.db"), c->what);
        TEST_ASSERT_TRUE_MESSAGE(holds_lock("station.db-shm"), c->what);
    }
    /* What they are to be kept from. */
    int fd = open(path, O_RDONLY);
    close(fd);
    TEST_ASSERT_FALSE(holds_lock("station.db"));
}

/* The same the other way round: a reader is there, and a store is opened and closed, which
 * looks at the bytes of the file before anything else. */
static void test_locks_of_a_reader_stay(void)
{
    struct store_reader *reader;
    int64_t seq;
    TRY(store_claim(folder, &claim));
    TRY(store_open_claimed(claim, NULL, &store));
    tool_add(store, 1, 1);
    TRY(store_reader_open(folder, &reader));
    TRY(store_newest(reader, &seq));
    for (int i = 0; i < 2; i++) {
        close_store();
        TEST_ASSERT_TRUE(holds_lock("station.db"));
        TRY(store_open_claimed(claim, NULL, &store));
        TEST_ASSERT_TRUE(holds_lock("station.db"));
        TEST_ASSERT_TRUE(holds_lock("station.db-shm"));
    }
    store_reader_close(reader);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_claimed_and_released);
    RUN_TEST(test_stores_under_one_claim);
    RUN_TEST(test_a_claim_of_its_own);
    RUN_TEST(test_begin_anew_under_the_claim);
    RUN_TEST(test_folders_that_will_not_do);
    RUN_TEST(test_no_locks_to_be_had);
    RUN_TEST(test_fences_never_come_again);
    RUN_TEST(test_fences_run_out);
    RUN_TEST(test_a_lock_that_holds_something_else);
    RUN_TEST(test_locks_stay);
    RUN_TEST(test_locks_of_a_reader_stay);
    return UNITY_END();
}
