/* test_costs_file.c - where the costs of a machine are, and what is wrong with a file. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "db/costs_file.h"
#include "tests/support/folder.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE];
static struct costs costs;

void setUp(void)
{
    TEST_ASSERT_TRUE(folder_make(folder));
    costs.n = 77;
}
void tearDown(void)
{
    folder_remove(folder);
}

/* The path of a file with this in it. */
static const char *file(const void *bytes, size_t size)
{
    static char path[FOLDER_PATH_SIZE];
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "costs.csv", path), bytes, size));
    return path;
}

static void test_where_it_is(void)
{
    char path[COSTS_PATH_SIZE];
    setenv("HOME", "/home/x", 1);
    unsetenv("XDG_STATE_HOME");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_file_path(path));
    TEST_ASSERT_EQUAL_STRING("/home/x/.local/state/skinspec/costs.csv", path);
    setenv("XDG_STATE_HOME", "/state", 1);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_file_path(path));
    TEST_ASSERT_EQUAL_STRING("/state/skinspec/costs.csv", path);
    /* The XDG base directory specification: a path that is not absolute is ignored. */
    setenv("XDG_STATE_HOME", "state", 1);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_file_path(path));
    TEST_ASSERT_EQUAL_STRING("/home/x/.local/state/skinspec/costs.csv", path);
    unsetenv("HOME");
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, costs_file_path(path));
}

static void test_a_path_too_long(void)
{
    static char home[COSTS_PATH_SIZE + 1];
    char path[COSTS_PATH_SIZE];
    memset(home, 'x', sizeof home - 1);
    home[0] = '/';
    unsetenv("XDG_STATE_HOME");
    setenv("HOME", home, 1);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, costs_file_path(path));
}

static void test_reads_what_was_printed(void)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    costs_print(stream, costs_builtin());
    fclose(stream);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, costs_file_read(file(text, size), &costs));
    TEST_ASSERT_EQUAL_size_t(costs_builtin()->n, costs.n);
    TEST_ASSERT_EQUAL_STRING(costs_builtin()->machine, costs.machine);
    free(text);
}

static void test_none_there(void)
{
    char path[FOLDER_PATH_SIZE];
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND,
                          costs_file_read(folder_path(folder, "none.csv", path), &costs));
    TEST_ASSERT_EQUAL_size_t(77, costs.n);
}

static void test_refuses_what_is_none(void)
{
    static char large[300 * 1024];
    memset(large, '#', sizeof large);
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_file_read(file("model,rows\n", 11), &costs));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_file_read(file("", 0), &costs));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_file_read(file("a\0b\n", 4), &costs));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, costs_file_read(file(large, sizeof large), &costs));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, costs_file_read(folder, &costs)); /* a folder */
    TEST_ASSERT_EQUAL_size_t(77, costs.n);
}

/* What may be made anew, and what is somebody's. */
static void test_tells_costs_from_other_files(void)
{
    static char large[300 * 1024];
    char *text = NULL, path[FOLDER_PATH_SIZE];
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    costs_print(stream, costs_builtin());
    fclose(stream);
    memset(large, '#', sizeof large);
    TEST_ASSERT_TRUE(costs_file_is_one(file(text, size)));
    TEST_ASSERT_TRUE(costs_file_is_one(file("", 0)));
    TEST_ASSERT_FALSE(costs_file_is_one(file("id,400,410\n", 11)));
    TEST_ASSERT_FALSE(costs_file_is_one(file("# notes\n", 8)));
    TEST_ASSERT_FALSE(costs_file_is_one(file("\0", 1)));
    TEST_ASSERT_FALSE(costs_file_is_one(file(large, sizeof large)));
    TEST_ASSERT_FALSE(costs_file_is_one(folder));
    TEST_ASSERT_FALSE(costs_file_is_one(folder_path(folder, "none.csv", path)));
    free(text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_where_it_is);
    RUN_TEST(test_a_path_too_long);
    RUN_TEST(test_reads_what_was_printed);
    RUN_TEST(test_none_there);
    RUN_TEST(test_refuses_what_is_none);
    RUN_TEST(test_tells_costs_from_other_files);
    return UNITY_END();
}
