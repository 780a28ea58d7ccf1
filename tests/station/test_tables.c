/* test_tables.c - files come, change and go; a thread reads them, one load at a time. */
#include "station/tables.h"

#include <poll.h>
#include <sys/stat.h>

#include "tests/station/tables_tools.h"

/* ---- the usual course --------------------------------------------------------------- */

static void test_default_is_loaded_from_the_start(void)
{
    struct loaded_table *t = NULL;
    struct table_file_info info;
    make_table(1, "two-layer", "two-layer");
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_look(tables, NULL));
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, NULL, &t));
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, "two-layer", &t));
    TEST_ASSERT_NULL(t);
    TEST_ASSERT_EQUAL_size_t(1, job_queue_length(&queue)); /* one load, whoever asks */
    TEST_ASSERT_EQUAL_INT(1, settle());
    TEST_ASSERT_EQUAL_INT(1, changed_count);
    TEST_ASSERT_EQUAL_STRING("two-layer", changed_name);
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, NULL, &t));
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_look(tables, "two-layer"));
    TEST_ASSERT_EQUAL_STRING("", tables_error(tables, NULL));
    TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, loaded_table(t)->n);
    TEST_ASSERT_EQUAL_STRING("two-layer", loaded_table(t)->name);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(file_of(1, "two-layer"), &info));
    TEST_ASSERT_EQUAL_STRING(info.content_sha256, loaded_table(t)->sha256);
    TEST_ASSERT_EQUAL_PTR(t, tables_by_hash(tables, info.content_sha256));
    TEST_ASSERT_NULL(tables_by_hash(tables, info.pages_sha256));
}

/* Others are looked at, so that a list can tell what they are, and loaded on demand. */
static void test_others_are_loaded_when_asked_for(void)
{
    struct loaded_table *t = NULL;
    make_table(0, "paper", "paper");
    make_table(0, "two-layer", "two-layer");
    open_tables(TABLES_DEFAULT);
    (void)settle();
    TEST_ASSERT_EQUAL_INT(1, changed_count);
    TEST_ASSERT_EQUAL_INT(TABLES_AVAILABLE, tables_look(tables, "paper"));
    TEST_ASSERT_EQUAL_size_t(0, job_queue_length(&queue)); /* a look asks for nothing */
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, "paper", &t));
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_look(tables, "paper"));
    TEST_ASSERT_EQUAL_INT(1, settle());
    TEST_ASSERT_EQUAL_INT(2, changed_count);
    TEST_ASSERT_EQUAL_STRING("paper", changed_name);
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, "paper", &t));
    TEST_ASSERT_NULL(loaded_table(t)->spectrum);
}

/* Asked for while it is being looked at: the load follows, and changed() comes once. */
static void test_wanted_while_looked_at(void)
{
    struct loaded_table *t = NULL;
    make_table(0, "paper", "paper");
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_look(tables, "paper"));
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_get(tables, "paper", &t));
    TEST_ASSERT_EQUAL_size_t(1, job_queue_length(&queue));
    TEST_ASSERT_EQUAL_INT(2, settle());
    TEST_ASSERT_EQUAL_INT(1, changed_count);
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, "paper", &t));
}

static void test_new_files_are_found(void)
{
    struct loaded_table *t = NULL;
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_get(tables, "paper", &t));
    TEST_ASSERT_EQUAL_STRING("", tables_error(tables, "paper"));
    make_table(1, "paper", "paper");
    TEST_ASSERT_EQUAL_INT(TABLES_READY, get_settled("paper"));
}

/* ---- the default one missing -------------------------------------------------------- */

static void test_missing_default_says_what_to_do(void)
{
    char command[2 * FOLDER_PATH_SIZE];
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_size_t(0, job_queue_length(&queue));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, NULL));
    snprintf(command, sizeof command,
             "skinspec table build --model two-layer --out %s/table-two-layer.db", folder[0]);
    TEST_ASSERT_NOT_NULL(strstr(tables_error(tables, NULL), command));
    TEST_ASSERT_EQUAL_STRING(tables_error(tables, NULL), tables_error(tables, "two-layer"));
    TEST_ASSERT_EQUAL_STRING("", tables_error(tables, "paper"));
    /* Made as told, it is found by whoever looks, and loaded. */
    make_table(0, "two-layer", "two-layer");
    TEST_ASSERT_EQUAL_INT(TABLES_LOADING, tables_look(tables, NULL));
    TEST_ASSERT_EQUAL_STRING("", tables_error(tables, NULL));
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_look(tables, NULL));
    TEST_ASSERT_EQUAL_INT(1, changed_count);
}

static void test_no_folder_at_all(void)
{
    struct tables_settings settings = { .default_name = "mine",
                                        .queue = &queue,
                                        .changed = on_change };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tables_open(&settings, &tables));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, NULL));
    TEST_ASSERT_NOT_NULL(strstr(tables_error(tables, NULL), "--model MODEL"));
    TEST_ASSERT_NOT_NULL(strstr(tables_error(tables, NULL), "/table-mine.db"));
}

/* ---- names -------------------------------------------------------------------------- */

/* A good file lies where each of these names would lead; none may reach it. */
static void test_names_that_are_none(void)
{
    static const char *const names[] = {
        "../t",     "sub/t",
        "a.b",      "a b",
        "-t",       "t\n",
        "\xc3\xa4", "t'",
        "$t",       "t%",
        "t\\",      "a234567890123456789012345678901234567890123456789012345678901234", /* 64 */
    };
    char up[FOLDER_PATH_SIZE], sub[FOLDER_PATH_SIZE];
    mkdir(folder_path(folder[0], "table-..", up), 0700);
    mkdir(folder_path(folder[0], "table-sub", sub), 0700);
    open_tables(TABLES_DEFAULT);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct loaded_table *t = NULL;
        make_table(0, names[i], "paper");
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_UNKNOWN, tables_get(tables, names[i], &t), names[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_UNKNOWN, tables_look(tables, names[i]), names[i]);
        TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, names[i])));
    }
    TEST_ASSERT_EQUAL_size_t(0, job_queue_length(&queue));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, ""));
    TEST_ASSERT_EQUAL_INT(0, rmdir(up));
    TEST_ASSERT_EQUAL_INT(0, rmdir(sub));
}

static void test_names_at_the_limits(void)
{
    static const char *const names[] = {
        "a",
        "_",
        "0",
        "A-b_9",
        "a23456789012345678901234567890123456789012345678901234567890123", /* 63 */
    };
    open_tables(TABLES_DEFAULT);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        make_table(1, names[i], "paper");
        TEST_ASSERT_EQUAL_INT_MESSAGE(TABLES_READY, get_settled(names[i]), names[i]);
    }
}

/* ---- files that go, and folders in order -------------------------------------------- */

static void test_files_that_go(void)
{
    make_table(0, "two-layer", "two-layer");
    make_table(0, "paper", "paper");
    write_text(0, "bad", "bad");
    open_tables(TABLES_DEFAULT);
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_AVAILABLE, tables_look(tables, "paper"));
    TEST_ASSERT_EQUAL_INT(TABLES_FAILED, tables_look(tables, "bad"));
    TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, "two-layer")));
    TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, "paper")));
    TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, "bad")));
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_look(tables, "two-layer")); /* it stays */
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, "paper"));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, "bad"));
    TEST_ASSERT_EQUAL_STRING("", tables_error(tables, "bad"));
    make_table(0, "bad", "paper");
    TEST_ASSERT_EQUAL_INT(TABLES_READY, get_settled("bad"));
}

/* Gone between the look at the folder and the reading. */
static void test_file_goes_while_it_is_loaded(void)
{
    make_table(0, "two-layer", "two-layer");
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, "two-layer")));
    (void)settle();
    TEST_ASSERT_EQUAL_INT(1, changed_count);
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_look(tables, NULL));
    TEST_ASSERT_NOT_NULL(strstr(tables_error(tables, NULL), "skinspec table build"));
}

static void test_first_folder_wins(void)
{
    struct loaded_table *t = NULL;
    make_table(1, "t", "paper"); /* without spectra: tells them apart */
    open_tables(TABLES_DEFAULT);
    (void)settle();
    TEST_ASSERT_EQUAL_INT(TABLES_AVAILABLE, tables_look(tables, "t"));
    make_table(0, "t", "two-layer");
    TEST_ASSERT_EQUAL_INT(TABLES_READY, get_settled("t"));
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, "t", &t));
    TEST_ASSERT_NOT_NULL(loaded_table(t)->spectrum);
}

/* ---- the list ----------------------------------------------------------------------- */

struct listed {
    char text[512];
    size_t n;
};

/* "name state rows model default error?;" */
static void note(void *context, const struct tables_entry *entry)
{
    static const char *const states[] = { "ready", "loading", "available", "failed", "unknown" };
    struct listed *l = context;
    l->n += (size_t)snprintf(l->text + l->n, sizeof l->text - l->n, "%s %s", entry->name,
                             states[entry->state]);
    if (entry->info_known)
        l->n += (size_t)snprintf(l->text + l->n, sizeof l->text - l->n, " %zu %s", entry->info.rows,
                                 entry->info.recipe.model->name);
    l->n += (size_t)snprintf(l->text + l->n, sizeof l->text - l->n, "%s%s;",
                             entry->is_default ? " default" : "",
                             entry->error[0] != '\0' ? " error" : "");
}

static const char *list(void)
{
    static struct listed l;
    memset(&l, 0, sizeof l);
    tables_list(tables, note, &l);
    return l.text;
}

/* expect: small_recipe() has 64 rows; tables.h says when the info is known. */
static void test_list(void)
{
    static const char *const passed_over[] = { "table-.db",      "table-a b.db", "station.db",
                                               "table-x.db.new", "table-y",      "mytable-z.db" };
    char path[FOLDER_PATH_SIZE];
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_EQUAL_STRING("", list());
    make_table(1, "two-layer", "two-layer");
    make_table(0, "paper", "paper");
    write_text(1, "bad", "bad");
    for (size_t i = 0; i < sizeof passed_over / sizeof *passed_over; i++)
        TEST_ASSERT_TRUE(file_write(folder_path(folder[0], passed_over[i], path), "", 0));
    TEST_ASSERT_EQUAL_STRING("bad loading;paper loading;two-layer loading default;", list());
    (void)settle();
    TEST_ASSERT_EQUAL_STRING("bad failed error;paper available 64 paper;"
                             "two-layer ready 64 two-layer default;",
                             list());
    TEST_ASSERT_EQUAL_INT(0, unlink(file_of(0, "paper")));
    TEST_ASSERT_EQUAL_STRING("bad failed error;two-layer ready 64 two-layer default;", list());
}

/* A path that no file can have is no file's. */
static void test_path_too_long(void)
{
    static char deep[4097];
    struct loaded_table *t = NULL;
    memset(deep, 'd', sizeof deep - 1);
    struct tables_settings settings = {
        .folder = { deep },
        .default_name = "t",
        .queue = &queue,
    };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tables_open(&settings, &tables));
    TEST_ASSERT_EQUAL_INT(TABLES_UNKNOWN, tables_get(tables, "t", &t));
}

/* ---- closing with work under way ---------------------------------------------------- */

/* The address sanitizer sees what would be lost. */
static void test_close_with_jobs_under_way(void)
{
    make_table(0, "two-layer", "two-layer");
    open_tables(TABLES_DEFAULT);
    TEST_ASSERT_NOT_NULL(job_queue_take(&queue, 0, NULL));
    tables_close(tables); /* never run */
    open_tables(TABLES_DEFAULT);
    do_jobs(); /* done, not drained */
    tables_close(tables);
    inbox_done(&inbox);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, inbox_init(&inbox));
    tables = NULL;
    TEST_ASSERT_EQUAL_INT(0, changed_count);
}

/* ---- as in the station: a thread that lives, a loop that polls ---------------------- */

static void test_with_a_living_thread(void)
{
    pthread_t thread;
    int for_ever = -1;
    struct loaded_table *t = NULL;
    make_table(0, "two-layer", "two-layer");
    make_table(1, "paper", "paper");
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, work, &for_ever));
    open_tables(TABLES_DEFAULT);
    while (changed_count < 2) {
        struct pollfd readable = { .fd = inbox.fd, .events = POLLIN };
        (void)tables_get(tables, "paper", &t);
        (void)list();
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, poll(&readable, 1, 10000), "a load never ended");
        inbox_drain(&inbox);
    }
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, "paper", &t));
    TEST_ASSERT_EQUAL_INT(TABLES_READY, tables_get(tables, NULL, &t));
    job_queue_close(&queue);
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_default_is_loaded_from_the_start);
    RUN_TEST(test_others_are_loaded_when_asked_for);
    RUN_TEST(test_wanted_while_looked_at);
    RUN_TEST(test_new_files_are_found);
    RUN_TEST(test_missing_default_says_what_to_do);
    RUN_TEST(test_no_folder_at_all);
    RUN_TEST(test_names_that_are_none);
    RUN_TEST(test_names_at_the_limits);
    RUN_TEST(test_files_that_go);
    RUN_TEST(test_file_goes_while_it_is_loaded);
    RUN_TEST(test_first_folder_wins);
    RUN_TEST(test_list);
    RUN_TEST(test_path_too_long);
    RUN_TEST(test_close_with_jobs_under_way);
    RUN_TEST(test_with_a_living_thread);
    return UNITY_END();
}
