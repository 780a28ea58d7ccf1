/* test_tables_refused.c - tables that are none, are damaged or cannot be read: the error says
 * what is wrong and what to do, and a better file is taken. */
#include "station/tables.h"

#include <sys/stat.h>
#include <time.h>

#include "base/utf8.h"
#include "tests/station/tables_tools.h"

enum { RETRY_MS = 1000 }; /* tables.h: "after a second" */

static void spoil_nothing(const char *path)
{
    TEST_ASSERT_TRUE(file_write(path, "", 0));
}

static void spoil_text(const char *path)
{
    TEST_ASSERT_TRUE(file_write(path, "not a database", 14));
}

static void spoil_row(const char *path)
{
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE entry SET l = 1.0 WHERE id = 5"));
}

static void spoil_version(const char *path)
{
    TEST_ASSERT_TRUE(table_edit(path, "PRAGMA user_version = 99") && table_reseal(path));
}

static void spoil_meta(const char *path)
{
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE meta SET value = 'x' WHERE key = 'model'") &&
                     table_reseal(path));
}

static void spoil_rows(const char *path)
{
    TEST_ASSERT_TRUE(table_edit(path, "DELETE FROM entry WHERE id = 64") && table_reseal(path));
}

static const struct refusal_case {
    const char *what;
    void (*spoil)(const char *path);
    enum status status;
    bool at_a_look; /* else only when the rows are read */
} refusal_cases[] = {
    { "empty", spoil_nothing, STATUS_FORMAT, true },
    { "text", spoil_text, STATUS_FORMAT, true },
    { "a row was changed", spoil_row, STATUS_DAMAGED, true },
    { "another format", spoil_version, STATUS_VERSION, true },
    { "an unknown model", spoil_meta, STATUS_FORMAT, true },
    { "a row is missing, hashes right", spoil_rows, STATUS_FORMAT, false },
};

static void expect_refusal(const char *name, enum status status)
{
    const char *error = tables_error(tables, name);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, status_text(status)), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "skinspec table verify "), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "skinspec table build --model "), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, file_of(0, name)), error);
}

/* Refused, and left alone until the file has changed; then it is read again. */
static void test_refused_until_the_file_changes(void)
{
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        struct loaded_table *t = NULL;
        make_table(0, "two-layer", "two-layer");
        c->spoil(file_of(0, "two-layer"));
        changed_count = 0;
        heard_start();
        open_tables(TABLES_DEFAULT);
        (void)settle();
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_FAILED, tables_look(tables, NULL), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_FAILED, tables_get(tables, NULL, &t), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, changed_count, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), heard_last()); /* the cause, once */
        TEST_ASSERT_NULL(t);
        expect_refusal("two-layer", c->status);
        TEST_ASSERT_EQUAL_size_t(0, job_queue_length(&queue));
        make_table(0, "two-layer", "two-layer");
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_READY, get_settled(NULL), c->what);
        TEST_ASSERT_EQUAL_STRING("", tables_error(tables, NULL));
        tables_close(tables);
        tables = NULL;
    }
}

static void test_refused_at_a_look(void)
{
    struct loaded_table *t = NULL;
    open_tables(TABLES_DEFAULT);
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        make_table(0, "other", "two-layer");
        c->spoil(file_of(0, "other"));
        (void)tables_look(tables, "other");
        (void)settle();
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->at_a_look ? TABLES_FAILED : TABLES_AVAILABLE,
                                      tables_look(tables, "other"), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, changed_count, c->what); /* nobody asked for it */
    }
    /* The last one is found out when it is loaded. */
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, "other", &t));
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_FAILED, tables_get(tables, "other", &t));
    TEST_ASSERT_EQUAL_INT(1, changed_count);
    expect_refusal("other", STATUS_FORMAT);
}

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ ms / 1000, ms % 1000 * 1000000 }, NULL);
}

/* A folder in the file's place is the system's refusal (STATUS_IO), which may pass. */
static void test_failure_of_the_system_is_tried_again(void)
{
    struct loaded_table *t = NULL;
    mkdir(file_of(0, "odd"), 0700);
    open_tables(TABLES_DEFAULT);
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_FAILED, tables_get(tables, "odd", &t));
    expect_refusal("odd", STATUS_IO);
    sleep_ms(RETRY_MS + 100);
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, "odd", &t));
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_FAILED, tables_get(tables, "odd", &t));
    TEST_ASSERT_EQUAL_INT(0, rmdir(file_of(0, "odd")));
}

/* A folder's name need not be UTF-8, nor short; what clients are told is. */
static void test_error_is_text(void)
{
    char odd[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
    struct tables_settings settings = {
        .folder = { folder_path(folder[0], "\xff\xfe", odd) },
        .default_name = "bad",
        .queue = &queue,
        .changed = on_change,
        .context = &changed_count,
    };
    TEST_ASSERT_EQUAL_INT(0, mkdir(odd, 0700));
    TEST_ASSERT_TRUE(file_write(folder_path(odd, "table-bad.db", path), "bad", 3));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tables_open(&settings, &tables));
    (void)settle();
    TEST_ASSERT_NOT_NULL(strstr(tables_error(tables, "bad"), "/?"
                                                             "?/table-bad.db"));
    TEST_ASSERT_TRUE(utf8_is_valid(tables_error(tables, "bad")));
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, NULL));
    TEST_ASSERT_TRUE(utf8_is_valid(tables_error(tables, NULL)));
    TEST_ASSERT_EQUAL_INT(0, rmdir(odd));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_refused_until_the_file_changes);
    RUN_TEST(test_refused_at_a_look);
    RUN_TEST(test_failure_of_the_system_is_tried_again);
    RUN_TEST(test_error_is_text);
    return UNITY_END();
}
