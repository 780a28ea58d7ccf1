/* tables_tools.h - what the tests of station/tables share: two folders, a queue whose
 * jobs a thread does when told to, and what the loop is told. */
#ifndef SKINSPEC_TESTS_STATION_TABLES_TOOLS_H
#define SKINSPEC_TESTS_STATION_TABLES_TOOLS_H

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "station/tables.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[2][FOLDER_PATH_SIZE];
static struct job_queue queue;
static struct inbox inbox;
static struct tables *tables;
static char changed_name[TABLE_NAME_SIZE];
static int changed_count;

static inline void on_change(void *context, const char *name)
{
    TEST_ASSERT_EQUAL_PTR(&changed_count, context);
    changed_count++;
    snprintf(changed_name, sizeof changed_name, "%s", name);
}

void setUp(void)
{
    heard_start();
    for (int i = 0; i < 2; i++)
        TEST_ASSERT_TRUE(folder_make(folder[i]));
    job_queue_init(&queue);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, inbox_init(&inbox));
    changed_count = 0;
    changed_name[0] = '\0';
    tables = NULL;
}

void tearDown(void)
{
    tables_close(tables);
    inbox_done(&inbox);
    job_queue_done(&queue);
    for (int i = 0; i < 2; i++)
        folder_remove(folder[i]);
    heard_stop();
}

/* ---- files and settings --------------------------------------------------------------- */

static inline const char *file_of(int where, const char *name)
{
    static char path[FOLDER_PATH_SIZE];
    char file[300];
    snprintf(file, sizeof file, "table-%s.db", name);
    return folder_path(folder[where], file, path);
}

static inline void make_table(int where, const char *name, const char *model)
{
    struct recipe recipe = small_recipe(model);
    (void)unlink(file_of(where, name)); /* what is no table would not be replaced */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(file_of(where, name), &recipe, false));
}

static inline void write_text(int where, const char *name, const char *text)
{
    TEST_ASSERT_TRUE(file_write(file_of(where, name), text, strlen(text)));
}

/* Settings with both folders, and between them one that is not there. */
static inline void open_tables(const char *default_name)
{
    static char nowhere[FOLDER_PATH_SIZE];
    struct tables_settings settings = {
        .folder = { folder[0], folder_path(folder[0], "nowhere", nowhere), folder[1] },
        .default_name = default_name,
        .queue = &queue,
        .changed = on_change,
        .context = &changed_count,
    };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, tables_open(&settings, &tables));
}

/* ---- the thread ------------------------------------------------------------------------- */

static inline void *work(void *context)
{
    struct job *job;
    int *timeout_ms = context;
    while ((job = job_queue_take(&queue, *timeout_ms, NULL)) != NULL) {
        job->run(job, NULL);
        inbox_put(&inbox, job);
    }
    return NULL;
}

/* A thread does what is queued now and ends; nothing is drained. */
static inline void do_jobs(void)
{
    pthread_t thread;
    int at_once = 0;
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, work, &at_once));
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
}

/* Until nothing is left to do; how many rounds that took. */
static inline int settle(void)
{
    int rounds = 0;
    for (; job_queue_length(&queue) > 0; rounds++) {
        do_jobs();
        inbox_drain(&inbox);
    }
    return rounds;
}

static inline enum tables_state get_settled(const char *name)
{
    struct loaded_table *t = NULL;
    (void)tables_get(tables, name, &t);
    (void)settle();
    return tables_get(tables, name, &t);
}

#endif
