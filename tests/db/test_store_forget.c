/* test_store_forget.c - a forgotten name is in no byte of station.db, -wal and -shm. */
#define _GNU_SOURCE /* memmem */
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "db/sql.h"
#include "db/store_private.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct store *store;
static struct dice dice;

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 21 };
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    TRY(store_open(folder, NULL, &store));
}

void tearDown(void)
{
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

/* How often the bytes stand in the three files. */
static int occurrences(const char *bytes)
{
    static const char *const name[] = { "station.db", "station.db-wal", "station.db-shm" };
    int n = 0;
    for (int i = 0; i < 3; i++) {
        char file[FOLDER_PATH_SIZE];
        size_t size = 0;
        unsigned char *all = file_bytes(folder_path(folder, name[i], file), &size);
        for (unsigned char *p = all; p != NULL; n++, p++)
            if ((p = memmem(p, size - (size_t)(p - all), bytes, strlen(bytes))) == NULL)
                break;
        free(all);
    }
    return n;
}

static void add_person(const char *name, size_t notes, struct store_subject *ret)
{
    memset(ret, 0, sizeof *ret);
    snprintf(ret->label, sizeof ret->label, "label-of-%s", name);
    snprintf(ret->name, sizeof ret->name, "name-of-%s", name);
    /* Notes that say the name all along, so that each piece of them shows. */
    for (size_t n = 0; n + 40 < notes && n + 40 < sizeof ret->notes;)
        n += (size_t)snprintf(ret->notes + n, 40, "note-of-%s;", name);
    ret->birth_year = 1900;
    TRY(store_add_subject(store, ret, "clinic"));
}

static void forget(const struct store_subject *subject, bool expect_erased)
{
    bool erased = !expect_erased;
    TRY(store_forget_subject(store, subject->id, "admin", &erased));
    TEST_ASSERT_EQUAL_INT(expect_erased, erased);
}

static void assert_gone(const char *name)
{
    char text[128];
    static const char *const what[] = { "label", "name", "note" };
    for (int i = 0; i < 3; i++) {
        snprintf(text, sizeof text, "%s-of-%s", what[i], name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, occurrences(text), text);
    }
}

static bool first_subject(void *context, const struct store_subject *subject)
{
    *(struct store_subject *)context = *subject;
    return false;
}

/* The measurements stay, and so does the id. */
static void test_forgotten(void)
{
    struct store_subject subject, seen;
    struct store_record *record = records_make(&dice);
    struct store_reader *reader;
    struct store_verify_report report;
    bool known;
    add_person("Zoe", 500, &subject);
    strcpy(record->subject, subject.id);
    TRY(store_add_record(store, record, &known));
    TEST_ASSERT_TRUE(occurrences("name-of-Zoe") > 0);
    forget(&subject, true);
    assert_gone("Zoe");
    TRY(store_reader_open(folder, &reader));
    TRY(store_list_subjects(reader, "", first_subject, &seen));
    TEST_ASSERT_EQUAL_STRING(subject.id, seen.id);
    TEST_ASSERT_TRUE(seen.forgotten);
    TEST_ASSERT_EQUAL_STRING("", seen.name);
    TEST_ASSERT_EQUAL_INT(0, seen.birth_year);
    TRY(store_get(reader, record->id, NULL, record));
    TEST_ASSERT_EQUAL_STRING(subject.id, record->subject);
    TRY(store_verify(reader, &report));
    store_reader_close(reader);
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT count(*) FROM audit WHERE who = 'admin'"
                                                 " AND action = 'subject.forget'"));
    records_uuid(&dice, record->uuid);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_add_record(store, record, &known));
    TEST_ASSERT_EQUAL_STRING("subject", store_bad_member(store));
    free(record);
}

static void test_nobody_to_forget(void)
{
    struct store_subject subject;
    bool erased = false;
    add_person("Zoe", 0, &subject);
    forget(&subject, true);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND,
                          store_forget_subject(store, subject.id, "admin", &erased));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_forget_subject(store, "x", "admin", &erased));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_forget_subject(store, "", "admin", &erased));
    TEST_ASSERT_EQUAL_STRING("subject_id", store_bad_member(store));
    TEST_ASSERT_FALSE(erased);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
    TRY(store_begin(store));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_forget_subject(store, subject.id, "", &erased));
    store_rollback(store);
    TEST_ASSERT_TRUE(heard_contains("inside a group"));
}

/* Some of the people of the test, each at once. */
enum { PEOPLE = 300 };
static struct store_subject people[PEOPLE];
static bool gone[PEOPLE];

static void name_of(int i, char name[16])
{
    snprintf(name, 16, "p%03d.", i);
}

static void add_some(int from, int to)
{
    static const size_t notes[] = { 24, 160, 960, 4000 };
    char name[16];
    TRY(store_begin(store));
    for (int i = from; i < to; i++) {
        name_of(i, name);
        add_person(name, dice_below(&dice, notes[dice_below(&dice, 4)]), &people[i]);
        gone[i] = false;
    }
    TRY(store_commit(store));
}

static void forget_one_of(int n)
{
    char name[16];
    int i = (int)dice_below(&dice, (size_t)n);
    if (gone[i])
        return;
    forget(&people[i], true);
    gone[i] = true;
    name_of(i, name);
    assert_gone(name);
}

/* Property: people with notes of any length come and go, in the file and in the WAL by
 * turns, and SQLite moves their rows from page to page meanwhile, which leaves stale copies
 * that secure_delete alone does not reach.  Whoever was forgotten is nowhere from then on,
 * whoever was not is whole. */
static void test_many(void)
{
    int left;
    dice = (struct dice){ 3 }; /* without the rewriting a label stays: seen at this seed */
    for (int n = 0; n < PEOPLE; n += 10) {
        add_some(n, n + 10);
        if (n % 20 == 0)
            TRY(tool_checkpoint(folder, &left));
        for (int i = 0; i < (n < PEOPLE / 2 ? 3 : 14); i++)
            forget_one_of(n + 10);
    }
    for (int i = 0; i < PEOPLE; i++) {
        char sql[512], name[16];
        name_of(i, name);
        snprintf(sql, sizeof sql,
                 "SELECT count(*) FROM subject_person WHERE subject = '%.36s'"
                 " AND name = 'name-of-%s'",
                 people[i].id, name);
        TEST_ASSERT_EQUAL_INT(gone[i] ? 0 : 1, tool_number(folder, sql));
        if (gone[i])
            assert_gone(name);
    }
}

/* With a reader in the middle of a statement the bytes go when it is done. */
static void test_while_somebody_reads(void)
{
    sqlite3 *pin;
    struct store_subject subject;
    bool erased = true;
    add_person("Zoe", 500, &subject);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM subject_person"));
    forget(&subject, false);
    TEST_ASSERT_TRUE(occurrences("name-of-Zoe") > 0);
    TEST_ASSERT_EQUAL_INT(0, tool_number(folder, "SELECT count(*) FROM subject_person"));
    TRY(store_finish_erasing(store, &erased));
    TEST_ASSERT_FALSE(erased);
    TRY(sql_run(pin, "COMMIT"));
    TRY(store_finish_erasing(store, &erased));
    TEST_ASSERT_TRUE(erased);
    assert_gone("Zoe");
    erased = false;
    TRY(store_finish_erasing(store, &erased)); /* nothing is left to do */
    TEST_ASSERT_TRUE(erased);
    sqlite3_close(pin);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* An idle reader does not hinder; one that is busy until after the store was closed leaves
 * the rest to the next start. */
static void test_across_a_restart(void)
{
    sqlite3 *pin;
    struct store_reader *idle;
    struct store_subject subject;
    add_person("Zoe", 500, &subject);
    TRY(store_reader_open(folder, &idle));
    TRY(store_list_subjects(idle, "", first_subject, &subject));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    sqlite3_db_config(pin, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM subject_person"));
    forget(&subject, false);
    store_close(store);
    store = NULL;
    TEST_ASSERT_TRUE(occurrences("name-of-Zoe") > 0);
    sqlite3_close(pin);
    TRY(store_open(folder, NULL, &store));
    assert_gone("Zoe");
    store_reader_close(idle);
}

/* Killed between the commit and the end of it. */
static void test_killed_in_between(void)
{
    sqlite3 *pin;
    struct store_subject subject;
    add_person("Zoe", 500, &subject);
    store_close(store);
    store = NULL;
    pid_t child = fork();
    if (child == 0) {
        bool erased;
        if (store_open(folder, NULL, &store) != STATUS_OK ||
            sqlite3_open(path, &pin) != SQLITE_OK ||
            sql_run(pin, "BEGIN; SELECT count(*) FROM subject_person") != STATUS_OK ||
            store_forget_subject(store, subject.id, "", &erased) != STATUS_OK)
            _exit(1);
        kill(getpid(), SIGKILL);
    }
    int ended = 0;
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &ended, 0));
    TEST_ASSERT_TRUE(WIFSIGNALED(ended));
    TEST_ASSERT_TRUE(occurrences("name-of-Zoe") > 0);
    TRY(store_open(folder, NULL, &store));
    assert_gone("Zoe");
    TEST_ASSERT_EQUAL_INT(0, tool_number(folder, "SELECT count(*) FROM subject_person"));
}

/* A full disk: forgotten or not, but said; finished when there is room. */
static void test_full_disk(void)
{
    struct store_subject subject;
    struct rlimit before, limit;
    bool erased = true;
    add_person("Zoe", 4000, &subject);
    tool_add(store, 3, 20); /* the file has to grow for the checkpoint */
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    signal(SIGXFSZ, SIG_IGN);
    limit = before;
    limit.rlim_cur = 1000;
    setrlimit(RLIMIT_FSIZE, &limit);
    enum status none = store_forget_subject(store, subject.id, "admin", &erased);
    setrlimit(RLIMIT_FSIZE, &before);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, none);
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT count(*) FROM subject_person"));
    tool_add(store, 4, 60);
    store->erasing = true;
    limit.rlim_cur = 100000;
    setrlimit(RLIMIT_FSIZE, &limit);
    enum status rest = store_finish_erasing(store, &erased);
    setrlimit(RLIMIT_FSIZE, &before);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, rest);
    TEST_ASSERT_TRUE(heard_contains("cannot checkpoint"));
    forget(&subject, true);
    assert_gone("Zoe");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_forgotten);
    RUN_TEST(test_nobody_to_forget);
    RUN_TEST(test_many);
    RUN_TEST(test_while_somebody_reads);
    RUN_TEST(test_across_a_restart);
    RUN_TEST(test_killed_in_between);
    RUN_TEST(test_full_disk);
    return UNITY_END();
}
