/* test_table_no_memory.c - SQLite's allocations fail, each one in its turn: the
 * status says so, nothing is touched and nothing is left behind. */
#include <stdlib.h>
#include <string.h>

#include "db/table_build.h"
#include "db/table_file.h"
#include "db/table_verify.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/no_memory.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE], list[FOLDER_LIST_SIZE];

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "t.db", path);
}

void tearDown(void)
{
    no_memory_after(-1);
    heard_stop();
    folder_remove(folder);
}

/* One thing to try with so much memory; true where it did what it should. */
typedef enum status attempt(void);

static enum status attempt_info(void)
{
    struct table_file_info info = { .rows = 77 };
    enum status s = table_file_info(path, &info);
    TEST_ASSERT_EQUAL_size_t(s == STATUS_OK ? SMALL_TABLE_ROWS : 77, info.rows);
    if (s == STATUS_OK) { /* all of it, then */
        TEST_ASSERT_TRUE(info.rtree);
        TEST_ASSERT_TRUE(info.bytes > 4096);
        TEST_ASSERT_EQUAL_size_t(64, strlen(info.content_sha256));
    }
    return s;
}

static enum status attempt_read(void)
{
    struct table table = { .n = 77 };
    enum status s = table_file_read(path, &table);
    TEST_ASSERT_EQUAL_size_t(s == STATUS_OK ? SMALL_TABLE_ROWS : 77, table.n);
    if (s == STATUS_OK)
        table_done(&table);
    return s;
}

static enum status attempt_verify(void)
{
    struct table_verify_report report = { .rows = 77 };
    enum status s = table_verify(path, 1, NULL, &report);
    TEST_ASSERT_EQUAL_size_t(s == STATUS_OK ? SMALL_TABLE_ROWS : 77, report.rows);
    return s;
}

static enum status attempt_build(void)
{
    struct recipe recipe = small_recipe("two-layer");
    char other[FOLDER_PATH_SIZE];
    folder_path(folder, "u.db", other);
    enum status s = small_table(other, &recipe, true);
    TEST_ASSERT_EQUAL_STRING(s == STATUS_OK ? "t.db u.db " : "t.db ", folder_list(folder, list));
    if (s == STATUS_OK) {
        size_t size, other_size;
        unsigned char *bytes = file_bytes(path, &size);
        unsigned char *other_bytes = file_bytes(other, &other_size);
        TEST_ASSERT_EQUAL_size_t(size, other_size);
        TEST_ASSERT_EQUAL_INT(0, memcmp(bytes, other_bytes, size));
        free(bytes);
        free(other_bytes);
    }
    return s;
}

static const struct attempt_case {
    const char *what;
    attempt *run;
} attempt_cases[] = {
    { "info", attempt_info },
    { "read", attempt_read },
    { "verify", attempt_verify },
    { "build", attempt_build },
};

static void test_every_allocation_in_turn(void)
{
    struct recipe recipe = small_recipe("two-layer");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, true));
    for (size_t i = 0; i < sizeof attempt_cases / sizeof *attempt_cases; i++) {
        const struct attempt_case *c = &attempt_cases[i];
        long refused = 0;
        for (long enough = 0;; enough++) {
            heard_start();
            no_memory_after(enough);
            enum status s = c->run();
            bool failed = no_memory_met();
            no_memory_after(-1);
            if (s == STATUS_OK) {
                TEST_ASSERT_EQUAL_INT_MESSAGE(0, heard_count(), c->what);
                if (!failed)
                    break;
                continue; /* an allocation that SQLite can do without */
            }
            refused++;
            TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NO_MEMORY, s, heard_last());
            TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), heard_last());
        }
        TEST_ASSERT_MESSAGE(refused > 10, c->what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    if (!no_memory_install())
        return 1;
    RUN_TEST(test_every_allocation_in_turn);
    return UNITY_END();
}
