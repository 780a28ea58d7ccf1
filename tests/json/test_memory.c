/* test_memory.c - what cJSON was refused is noted, by thread, and nothing that is given is lost
 * (seen under AddressSanitizer). */
#include "json/memory.h"

#include <pthread.h>

#include "json/give.h"
#include "tests/station/scarce_tools.h"
#include "unity.h"

void setUp(void)
{
    json_memory_begin();
}

void tearDown(void)
{
}

static void be_refused(void)
{
    scarce_begin(SCARCE_ONE, 0);
    TEST_ASSERT_NULL(cJSON_CreateObject());
    TEST_ASSERT_TRUE(scarce_end());
}

static void test_enough(void)
{
    cJSON *object = cJSON_CreateObject();
    json_give_member(object, "list", cJSON_CreateArray());
    json_give_item(cJSON_GetObjectItem(object, "list"), cJSON_CreateNumber(7));
    TEST_ASSERT_FALSE(json_memory_was_short());
    TEST_ASSERT_EQUAL_INT(1, cJSON_GetArraySize(cJSON_GetObjectItem(object, "list")));
    cJSON_Delete(object);
}

static void test_short(void)
{
    be_refused();
    TEST_ASSERT_TRUE(json_memory_was_short());
    cJSON_Delete(cJSON_CreateObject());
    TEST_ASSERT_TRUE_MESSAGE(json_memory_was_short(), "it stays so");
    json_memory_begin();
    TEST_ASSERT_FALSE(json_memory_was_short());
}

static void *look(void *context)
{
    *(bool *)context = json_memory_was_short();
    be_refused();
    return NULL;
}

static void test_each_thread_has_its_own(void)
{
    pthread_t thread;
    bool seen = true;
    be_refused();
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, look, &seen));
    pthread_join(thread, NULL);
    TEST_ASSERT_FALSE(seen);
    json_memory_begin();
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, look, &seen));
    pthread_join(thread, NULL);
    TEST_ASSERT_FALSE(json_memory_was_short());
}

static void test_nothing_takes(void)
{
    json_give_member(NULL, "a", cJSON_CreateString("lost?"));
    json_give_item(NULL, cJSON_CreateString("lost?"));
}

static void test_nothing_is_given(void)
{
    cJSON *object = cJSON_CreateObject(), *array = cJSON_CreateArray();
    json_give_member(object, "a", NULL);
    json_give_item(array, NULL);
    TEST_ASSERT_EQUAL_INT(0, cJSON_GetArraySize(object));
    TEST_ASSERT_EQUAL_INT(0, cJSON_GetArraySize(array));
    cJSON_Delete(object);
    cJSON_Delete(array);
}

int main(void)
{
    json_memory_watch();
    UNITY_BEGIN();
    RUN_TEST(test_enough);
    RUN_TEST(test_short);
    RUN_TEST(test_each_thread_has_its_own);
    RUN_TEST(test_nothing_takes);
    RUN_TEST(test_nothing_is_given);
    return UNITY_END();
}
