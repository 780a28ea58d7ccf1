/* tools.h - a store in a folder of the test's own, and hands on its file. */
#ifndef SKINSPEC_TESTS_STORE_TOOLS_H
#define SKINSPEC_TESTS_STORE_TOOLS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <sqlite3.h>

#include "db/store.h"
#include "tests/store/records.h"
#include "tests/support/folder.h"
#include "unity.h"

#define TRY(call) TEST_ASSERT_EQUAL_INT(STATUS_OK, (call))

/* SQL by a connection of its own, as from a shell; append-only triggers go first. */
static inline bool tool_edit(const char *folder, const char *sql)
{
    char path[FOLDER_PATH_SIZE];
    sqlite3 *db = NULL;
    bool good = sqlite3_open_v2(folder_path(folder, "station.db", path), &db, SQLITE_OPEN_READWRITE,
                                NULL) == SQLITE_OK &&
                sqlite3_exec(db, "PRAGMA synchronous = OFF", NULL, NULL, NULL) == SQLITE_OK &&
                sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK;
    if (!good)
        printf("%s: %s\n", sql, sqlite3_errmsg(db));
    sqlite3_close(db);
    return good;
}

static inline bool tool_without_triggers(const char *folder)
{
    return tool_edit(folder, "DROP TRIGGER measurement_kept; DROP TRIGGER measurement_fixed;"
                             "DROP TRIGGER match_kept; DROP TRIGGER match_fixed;"
                             "DROP TRIGGER calibration_kept; DROP TRIGGER calibration_fixed;"
                             "DROP TRIGGER audit_kept; DROP TRIGGER audit_fixed;");
}

/* The one number a query gives; -1 where it gives none. */
static inline long long tool_number(const char *folder, const char *sql)
{
    char path[FOLDER_PATH_SIZE];
    sqlite3 *db = NULL;
    sqlite3_stmt *select = NULL;
    long long x = -1;
    if (sqlite3_open_v2(folder_path(folder, "station.db", path), &db, SQLITE_OPEN_READONLY, NULL) ==
            SQLITE_OK &&
        sqlite3_prepare_v2(db, sql, -1, &select, NULL) == SQLITE_OK &&
        sqlite3_step(select) == SQLITE_ROW)
        x = sqlite3_column_int64(select, 0);
    sqlite3_finalize(select);
    sqlite3_close(db);
    return x;
}

/* Every record. */
static const struct store_query tool_all = { .owner_uid = -1 };

/* One PASSIVE checkpoint. */
static inline enum status tool_checkpoint(const char *folder, int *left)
{
    struct store_keeper *keeper;
    enum status s = store_keeper_open(folder, &keeper);
    if (s != STATUS_OK)
        return s;
    s = store_keeper_checkpoint(keeper, left);
    store_keeper_close(keeper);
    return s;
}

/* n records with uuids by that seed, in one group. */
static inline void tool_add(struct store *store, uint64_t seed, int n)
{
    struct dice dice = { seed };
    TRY(store_begin(store));
    for (int i = 0; i < n; i++) {
        struct store_record *r = records_make(&dice);
        bool known = true;
        TEST_ASSERT_NOT_NULL(r);
        TRY(store_add_record(store, r, &known));
        TEST_ASSERT_FALSE(known);
        free(r);
    }
    TRY(store_commit(store));
}

static inline enum status tool_verify(const char *folder, struct store_verify_report *ret)
{
    struct store_reader *reader;
    TRY(store_reader_open(folder, &reader));
    enum status s = store_verify(reader, ret);
    store_reader_close(reader);
    return s;
}

#endif
