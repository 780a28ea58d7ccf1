/* test_new_name.c - a name beside the target, and that nothing is replaced unasked. */
#include "base/new_name.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/folder.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE];

void setUp(void)
{
    TEST_ASSERT_TRUE(folder_make(folder));
}

void tearDown(void)
{
    folder_remove(folder);
}

/* A point, the name, a point, 16 hexadecimal digits, ".tmp". */
static const struct beside_case {
    const char *path, *begin;
    size_t n;
} beside_cases[] = {
    { "a.db", ".a.db.", 6 + 16 + 4 },
    { "./x/a.db", "./x/.a.db.", 10 + 16 + 4 },
    { "/a", "/.a.", 4 + 16 + 4 },
};

static void test_beside_the_target(void)
{
    for (size_t i = 0; i < sizeof beside_cases / sizeof *beside_cases; i++) {
        const struct beside_case *c = &beside_cases[i];
        char name[NEW_NAME_SIZE], other[NEW_NAME_SIZE];
        size_t begin = strlen(c->begin);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, new_name_make(c->path, name));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, new_name_make(c->path, other));
        TEST_ASSERT_EQUAL_STRING_LEN(c->begin, name, begin);
        TEST_ASSERT_EQUAL_size_t(c->n, strlen(name));
        TEST_ASSERT_EQUAL_size_t(16, strspn(name + begin, "0123456789abcdef"));
        TEST_ASSERT_EQUAL_STRING(".tmp", name + begin + 16);
        TEST_ASSERT_TRUE_MESSAGE(strcmp(name, other) != 0, "nobody else's");
    }
}

static void test_no_file_name(void)
{
    char name[NEW_NAME_SIZE], path[NEW_NAME_SIZE];
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, new_name_make("", name));
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, new_name_make("folder/", name));
    memset(path, 'x', sizeof path - 1);
    path[sizeof path - 1] = '\0';
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, new_name_make(path, name));
    path[NEW_NAME_SIZE - 22] = '\0'; /* two points, 16 digits, ".tmp" and the 0 at the end */
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, new_name_make(path, name));
    path[NEW_NAME_SIZE - 23] = '\0';
    TEST_ASSERT_EQUAL_INT(STATUS_OK, new_name_make(path, name));
}

static void expect_file(const char *path, const char *text)
{
    size_t n;
    unsigned char *bytes = file_bytes(path, &n);
    TEST_ASSERT_NOT_NULL(bytes);
    TEST_ASSERT_EQUAL_STRING(text, (char *)bytes);
    free(bytes);
}

static void test_taken(void)
{
    char old[FOLDER_PATH_SIZE], new[FOLDER_PATH_SIZE], list[FOLDER_LIST_SIZE];
    folder_path(folder, "old", old);
    folder_path(folder, "new", new);
    TEST_ASSERT_TRUE(file_write(old, "1", 1));
    TEST_ASSERT_EQUAL_INT(0, new_name_take(old, new, false));
    TEST_ASSERT_EQUAL_STRING("new ", folder_list(folder, list));
    TEST_ASSERT_TRUE(file_write(old, "2", 1));
    TEST_ASSERT_EQUAL_INT(-1, new_name_take(old, new, false));
    TEST_ASSERT_EQUAL_INT(EEXIST, errno);
    expect_file(new, "1");
    TEST_ASSERT_EQUAL_INT(0, new_name_take(old, new, true));
    TEST_ASSERT_EQUAL_STRING("new ", folder_list(folder, list));
    expect_file(new, "2");
    TEST_ASSERT_EQUAL_INT(-1, new_name_take(old, new, true));
    TEST_ASSERT_EQUAL_INT(ENOENT, errno);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_beside_the_target);
    RUN_TEST(test_no_file_name);
    RUN_TEST(test_taken);
    return UNITY_END();
}
