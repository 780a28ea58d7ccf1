/* test_station_tables.c - what the station tells of its tables: those that are ready, those on
 * disk, one that is no table, and none at all. */
#include "tests/station/station_tools.h"

static struct visitor visitor;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    set_settings();
    visitor.fd = -1;
}

void tearDown(void)
{
    visitor_leave(&visitor);
    if (station.event != NULL)
        close_station();
    folder_remove(folder);
    heard_stop();
}

static void make_table_of(const char *model, const char *file)
{
    char path[FOLDER_PATH_SIZE];
    const struct recipe recipe = small_recipe(model);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(folder_path(folder, file, path), &recipe, false));
}

static void make_broken(const char *file)
{
    char path[FOLDER_PATH_SIZE];
    static const char text[] = "no table at all, and longer than a header of SQLite's is: "
                               "it is looked at before SQLite is asked, which it never is";
    TEST_ASSERT_TRUE(file_write(folder_path(folder, file, path), text, sizeof text));
}

static void begin(void)
{
    begin_station();
    visitor_open_session(&visitor);
}

/* The member `name` of the list's entry for this table; NULL: absent. */
static const cJSON *of_table(const struct answer *list, const char *table, const char *name)
{
    const cJSON *one, *tables = strict_json_member(list->result, "tables");
    cJSON_ArrayForEach(one, tables)
    {
        const char *its = cJSON_GetStringValue(strict_json_member(one, "name"));
        if (its != NULL && strcmp(its, table) == 0)
            return strict_json_member(one, name);
    }
    return NULL;
}

static struct answer list_tables(void)
{
    struct answer list;
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "table.list", "{}"));
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          protocol_read_answer(visitor.answer, strlen(visitor.answer), &list));
    return list;
}

static void match_with_other(const char *reason)
{
    (void)visitor_ask(&visitor, "match.spectrum",
                      "{\"spectrum\":{\"first_nm\":400,\"step_nm\":30,\"values\":[0.1,0.12,0.14,"
                      "0.16,0.18,0.2,0.22,0.24,0.26,0.28,0.3]},\"specular\":\"sce\","
                      "\"store\":false,\"table\":\"broken\"}");
    TEST_ASSERT_EQUAL_STRING(reason, visitor_text(&visitor, "reason"));
}

static void test_listed(void)
{
    make_table_of("two-layer", "table-two-layer.db");
    make_table_of("paper", "table-paper.db");
    make_broken("table-broken.db");
    begin();
    match_with_other("table_unsuitable"); /* so it is looked into */
    struct answer list = list_tables();
    TEST_ASSERT_EQUAL_STRING("ready", cJSON_GetStringValue(of_table(&list, "two-layer", "state")));
    TEST_ASSERT_TRUE(cJSON_IsTrue(of_table(&list, "two-layer", "default")));
    TEST_ASSERT_EQUAL_INT(SMALL_TABLE_ROWS, of_table(&list, "two-layer", "rows")->valueint);
    TEST_ASSERT_NOT_NULL(of_table(&list, "two-layer", "bands"));
    TEST_ASSERT_TRUE(cJSON_IsFalse(of_table(&list, "paper", "default")));
    TEST_ASSERT_NULL_MESSAGE(of_table(&list, "paper", "bands"), "it has no spectra");
    TEST_ASSERT_EQUAL_STRING("failed", cJSON_GetStringValue(of_table(&list, "broken", "state")));
    TEST_ASSERT_NOT_NULL(of_table(&list, "broken", "error"));
    TEST_ASSERT_NULL(of_table(&list, "broken", "rows"));
    cJSON_Delete(list.tree);
}

static void test_one(void)
{
    make_table_of("two-layer", "table-two-layer.db");
    make_table_of("paper", "table-paper.db");
    make_broken("table-broken.db");
    begin();
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "table.info", "{}"));
    TEST_ASSERT_EQUAL_STRING("two-layer", visitor_text(&visitor, "name"));
    TEST_ASSERT_EQUAL_STRING("10", visitor_text(&visitor, "observer"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                          visitor_ask(&visitor, "table.info", "{\"table\":\"paper\"}"));
    TEST_ASSERT_EQUAL_STRING("paper", visitor_text(&visitor, "name"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                          visitor_ask(&visitor, "table.info", "{\"table\":\"broken\"}"));
    TEST_ASSERT_NULL(strstr(visitor.answer, "\"observer\""));
}

/* The default one is not there: all but matching goes on. */
static void test_none(void)
{
    settings.table = "not-there";
    begin();
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_ask(&visitor, "table.info", "{}"));
    TEST_ASSERT_EQUAL_STRING("table_missing", visitor_text(&visitor, "reason"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "status.get", "{}"));
    TEST_ASSERT_EQUAL_STRING("missing", visitor_text(&visitor, "table"));
    TEST_ASSERT_NOT_EQUAL_INT(0, visitor_text(&visitor, "table_error")[0]);
    match_with_other("table_unknown");
}

static void test_broken_default(void)
{
    make_broken("table-two-layer.db");
    begin();
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "status.get", "{}"));
    TEST_ASSERT_EQUAL_STRING("failed", visitor_text(&visitor, "table"));
    TEST_ASSERT_NOT_EQUAL_INT(0, visitor_text(&visitor, "table_error")[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_listed);
    RUN_TEST(test_one);
    RUN_TEST(test_none);
    RUN_TEST(test_broken_default);
    return UNITY_END();
}
