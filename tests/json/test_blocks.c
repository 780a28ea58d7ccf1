/* test_blocks.c - trees made of kept blocks are as others, on every thread. */
#include "json/blocks.h"

#include <cjson/cJSON.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "json/print.h"
#include "unity.h"

void setUp(void)
{
    json_keep_blocks();
}

void tearDown(void)
{
    json_keep_no_blocks();
}

/* Items, names and texts of all lengths around a block's, each with contents of its own. */
static cJSON *make_tree(int n)
{
    char text[200];
    cJSON *tree = cJSON_CreateObject();
    for (int i = 0; i < n; i++) {
        memset(text, 'a' + i % 26, sizeof text);
        text[i % 150] = '\0';
        cJSON *list = cJSON_AddArrayToObject(tree, text);
        cJSON_AddItemToArray(list, cJSON_CreateString(text));
        cJSON_AddItemToArray(list, cJSON_CreateNumber(i));
    }
    return tree;
}

static void assert_intact(cJSON *tree, int n)
{
    const cJSON *list = tree->child;
    for (int i = 0; i < n; i++, list = list->next) {
        TEST_ASSERT_EQUAL_size_t((size_t)i % 150, strlen(list->string));
        TEST_ASSERT_EQUAL_STRING(list->string, list->child->valuestring);
        TEST_ASSERT_EQUAL_INT(i, list->child->next->valueint);
        TEST_ASSERT_TRUE(i % 150 == 0 || list->string[0] == 'a' + i % 26);
    }
    TEST_ASSERT_NULL(list);
}

/* More than is kept, several at a time, so that blocks come back in all orders. */
static void test_trees_in_turn(void)
{
    cJSON *kept[8] = { NULL };
    for (int i = 0; i < 400; i++) {
        cJSON **tree = &kept[i * 5 % 8];
        int n = i * 37 % 900;
        if (*tree != NULL)
            assert_intact(*tree, cJSON_GetArraySize(*tree));
        cJSON_Delete(*tree);
        *tree = make_tree(n);
        assert_intact(*tree, n);
    }
    for (int i = 0; i < 8; i++) {
        assert_intact(kept[i], cJSON_GetArraySize(kept[i]));
        cJSON_Delete(kept[i]);
    }
}

static void test_a_block_comes_back(void)
{
#ifndef __SANITIZE_ADDRESS__
    cJSON *item = cJSON_CreateNull();
    const void *was = item;
    cJSON_Delete(item);
    item = cJSON_CreateNull();
    TEST_ASSERT_EQUAL_PTR(was, item);
    cJSON_Delete(item);
#endif
    char *printed;
    cJSON *tree = make_tree(3);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, json_print(tree, 1000, &printed, NULL));
    free(printed); /* json_print() has its text from malloc() itself */
    cJSON_Delete(tree);
}

static void *delete_and_make(void *context)
{
    cJSON *tree = context;
    assert_intact(tree, 200);
    cJSON_Delete(tree);
    return make_tree(200);
}

/* Made here and deleted there, and the other way round. */
static void test_other_threads(void)
{
    for (int i = 0; i < 50; i++) {
        pthread_t thread;
        void *theirs;
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, delete_and_make, make_tree(200)));
        cJSON *ours = make_tree(200);
        TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, &theirs));
        assert_intact(theirs, 200);
        assert_intact(ours, 200);
        cJSON_Delete(theirs);
        cJSON_Delete(ours);
    }
}

static void test_trees_outlive_the_keeping(void)
{
    cJSON *tree = make_tree(200);
    json_keep_no_blocks();
    assert_intact(tree, 200);
    cJSON_Delete(tree);
    json_keep_no_blocks(); /* nothing left */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_trees_in_turn);
    RUN_TEST(test_a_block_comes_back);
    RUN_TEST(test_other_threads);
    RUN_TEST(test_trees_outlive_the_keeping);
    return UNITY_END();
}
