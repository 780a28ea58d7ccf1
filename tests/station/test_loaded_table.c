/* test_loaded_table.c - rows in memory, and matchers that several threads ask for at once. */
#include "station/loaded_table.h"

#include <pthread.h>

#include "db/table_file.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "table-t.db", path);
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

static struct loaded_table *open_table(const char *model)
{
    struct loaded_table *t = NULL;
    struct recipe recipe = small_recipe(model);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, loaded_table_open(path, &t));
    TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, loaded_table(t)->n);
    TEST_ASSERT_EQUAL_STRING("t", loaded_table(t)->name);
    return t;
}

static void test_no_table(void)
{
    struct loaded_table *t = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, loaded_table_open(path, &t));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_NULL(t);
    loaded_table_close(t);
}

static void test_matchers_are_made_once(void)
{
    struct loaded_table *t = open_table("paper");
    const struct matcher *first = NULL, *again = NULL;
    TEST_ASSERT_FALSE(loaded_matcher_is_made(t, MATCH_LAB));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, loaded_matcher(t, MATCH_LAB, &first));
    TEST_ASSERT_TRUE(loaded_matcher_is_made(t, MATCH_LAB));
    TEST_ASSERT_FALSE(loaded_matcher_is_made(t, MATCH_RGB));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, loaded_matcher(t, MATCH_LAB, &again));
    TEST_ASSERT_EQUAL_PTR(first, again);
    TEST_ASSERT_EQUAL_INT(MATCH_LAB, first->by);
    TEST_ASSERT_EQUAL_PTR(loaded_table(t), first->table);
    again = NULL; /* the paper's table has no spectra */
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, loaded_matcher(t, MATCH_SPECTRUM, &again));
    TEST_ASSERT_NULL(again);
    TEST_ASSERT_FALSE(loaded_matcher_is_made(t, MATCH_SPECTRUM));
    loaded_table_close(t);
}

struct user {
    struct loaded_table *table;
    const struct matcher *got[MATCH_SPECTRUM + 1];
};

static void *use(void *context)
{
    struct user *user = context;
    for (int by = MATCH_RGB; by <= MATCH_SPECTRUM; by++)
        if (loaded_matcher(user->table, (enum match_by)by, &user->got[by]) != STATUS_OK)
            user->got[by] = NULL;
    return NULL;
}

static void test_matchers_from_many_threads(void)
{
    enum { USERS = 4 };
    pthread_t thread[USERS];
    struct user user[USERS];
    struct loaded_table *t = open_table("two-layer");
    for (int i = 0; i < USERS; i++) {
        user[i] = (struct user){ .table = t };
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread[i], NULL, use, &user[i]));
    }
    for (int i = 0; i < USERS; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_join(thread[i], NULL));
    for (int by = MATCH_RGB; by <= MATCH_SPECTRUM; by++) {
        TEST_ASSERT_NOT_NULL(user[0].got[by]);
        TEST_ASSERT_TRUE(loaded_matcher_is_made(t, (enum match_by)by));
        for (int i = 1; i < USERS; i++)
            TEST_ASSERT_EQUAL_PTR(user[0].got[by], user[i].got[by]);
    }
    loaded_table_close(t);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_table);
    RUN_TEST(test_matchers_are_made_once);
    RUN_TEST(test_matchers_from_many_threads);
    return UNITY_END();
}
