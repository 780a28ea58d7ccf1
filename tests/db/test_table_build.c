/* test_table_build.c - all of a table file or nothing, and the same bytes always. */
#define _GNU_SOURCE /* syscall */
#include "db/table_build.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <sqlite3.h>

#include "db/table_file.h"
#include "match/nearest.h"
#include "tests/support/dice.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/small_disk.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];

/* In this program these stand before the C library's: what the system does, or the
 * error that is asked for. */
static int rename_error, fsync_error;

int renameat2(int old_folder, const char *old, int new_folder, const char *new, unsigned flags)
{
    if (rename_error != 0) {
        errno = rename_error;
        return -1;
    }
    return (int)syscall(SYS_renameat2, old_folder, old, new_folder, new, flags);
}

int fsync(int fd)
{
    if (fsync_error != 0) {
        errno = fsync_error;
        return -1;
    }
    return (int)syscall(SYS_fsync, fd);
}

void setUp(void)
{
    rename_error = fsync_error = 0;
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "t.db", path);
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

static void assert_folder_holds(const char *expect, const char *what)
{
    char list[FOLDER_LIST_SIZE];
    TEST_ASSERT_EQUAL_STRING_MESSAGE(expect, folder_list(folder, list), what);
}

static const struct table_build_options plain = { .threads = 1 };
static const struct table_build_options replacing = { .threads = 2, .overwrite = true };

/* ---- the same bytes ------------------------------------------------------------------ */

/* Property: for any number of threads, on any day, under any name. */
static void test_builds_are_byte_identical(void)
{
    static const char *const models[] = { "two-layer", "half-space", "paper" };
    static const unsigned threads[] = { 1, 2, 3, 7, 300 };
    for (size_t m = 0; m < 3; m++) {
        for (int rtree = 0; rtree <= 1; rtree++) {
            struct recipe recipe = small_recipe(models[m]);
            unsigned char *first = NULL;
            size_t first_size = 0;
            recipe.grid.Cm.n = 30; /* 4 + 29 x 20 = 584 rows: three pieces of work */
            for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
                struct table_build_options options = { .rtree = rtree, .threads = threads[i] };
                char name[32];
                size_t size;
                snprintf(name, sizeof name, "%zu-%d-%u.db", m, rtree, threads[i]);
                folder_path(folder, name, path);
                TEST_ASSERT_EQUAL_INT(STATUS_OK, table_build(path, &recipe, &options));
                unsigned char *bytes = file_bytes(path, &size);
                TEST_ASSERT_NOT_NULL(bytes);
                TEST_ASSERT_EQUAL_INT(0, unlink(path));
                if (i == 0) {
                    first = bytes;
                    first_size = size;
                    continue;
                }
                TEST_ASSERT_EQUAL_size_t_MESSAGE(first_size, size, models[m]);
                TEST_ASSERT_EQUAL_INT_MESSAGE(0, memcmp(first, bytes, size), models[m]);
                free(bytes);
            }
            free(first);
        }
    }
    assert_folder_holds("", "all removed");
}

/* A table of several chunks holds what its pieces hold: 50 400 rows, 7 chunks. */
static void test_chunks_follow_each_other(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    struct row_maker *maker;
    struct table table;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_build(path, &recipe, &replacing));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_read(path, &table));
    TEST_ASSERT_EQUAL_size_t(50400, table.n);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_open(&recipe, &maker));
    for (size_t row = 0; row < table.n; row += row % 8192 < 8190 ? 455 : 1) {
        struct table_row expect, got;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, row_maker_make(maker, row, &expect, NULL));
        table_get(&table, row, &got);
        TEST_ASSERT_EQUAL_MEMORY(&expect, &got, sizeof got);
    }
    row_maker_close(maker);
    table_done(&table);
}

/* ---- what is refused ------------------------------------------------------------------ */

static void test_recipes_that_are_refused(void)
{
    struct recipe recipe = small_recipe("two-layer");
    recipe.grid.Cm.hi = 0.9;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_TRUE(heard_contains("t.db"));
    recipe = small_recipe("paper");
    recipe.observer = OBSERVER_10DEG;
    TEST_ASSERT_EQUAL_INT(STATUS_UNSUPPORTED, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(2, heard_count());
    assert_folder_holds("", "nothing was begun");
}

/* A model whose later rows fail: what recipe_check() could not foresee. */
static enum status half_a_model(const struct tissue *t, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = t->Cm;
    return t->Cm < 0.2 ? STATUS_OK : STATUS_RANGE;
}

static void test_row_that_cannot_be_made(void)
{
    struct model model = { .name = "half a model", .rgb = half_a_model };
    struct recipe recipe = small_recipe("paper");
    recipe.model = &model;
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_MESSAGE(heard_contains("outside its range"), heard_last());
    assert_folder_holds("", "nothing left");
}

/* A number no database keeps: NaN becomes NULL, which the schema refuses. */
static enum status not_a_colour(const struct tissue *t, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = t->Cm < 0.2 ? 0.5 : (double)NAN;
    return STATUS_OK;
}

static void test_row_that_is_not_a_number(void)
{
    struct model model = { .name = "no model", .rgb = not_a_colour };
    struct recipe recipe = small_recipe("paper");
    recipe.model = &model;
    TEST_ASSERT_EQUAL_INT(STATUS_DB, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_MESSAGE(heard_contains("NOT NULL"), heard_last());
    assert_folder_holds("", "nothing left");
}

/* An earlier table, as far as its header tells: SQLite's words, "SkTb" at byte 68. */
enum { OLD_TABLE_SIZE = 120 };

static void put_old_table(void)
{
    char bytes[OLD_TABLE_SIZE] = "SQLite format 3";
    memcpy(bytes + 68, "SkTb", 4);
    TEST_ASSERT_TRUE(file_write(path, bytes, sizeof bytes));
}

static void test_existing_file(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table_file_info info;
    size_t size;
    TEST_ASSERT_TRUE(file_write(path, "precious", 8));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_MESSAGE(heard_contains("--force"), heard_last());
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_EQUAL_size_t(8, size);
    TEST_ASSERT_EQUAL_MEMORY("precious", bytes, 8);
    free(bytes);
    assert_folder_holds("t.db ", "untouched");
    /* Not even --force takes what is no table. */
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, table_build(path, &recipe, &replacing));
    TEST_ASSERT_MESSAGE(heard_contains("is no table"), heard_last());
    put_old_table();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_build(path, &recipe, &replacing));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &info));
    assert_folder_holds("t.db ", "replaced");
}

/* A file that appears under the name while the table is being made is not replaced. */
static bool put_a_file_there(void *context, size_t done, size_t total)
{
    if (done == total)
        (void)file_write(context, "precious", 8);
    return true;
}

static void test_file_that_appears_meanwhile(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table_build_options options = plain;
    size_t size;
    options.progress = (struct progress){ put_a_file_there, path };
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, table_build(path, &recipe, &options));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_EQUAL_size_t(8, size);
    free(bytes);
    assert_folder_holds("t.db ", "the file, and nothing beside it");
}

/* A link to nowhere is a name that is taken as well. */
static void test_link_to_nowhere(void)
{
    struct recipe recipe = small_recipe("paper");
    TEST_ASSERT_EQUAL_INT(0, symlink("nowhere", path));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, table_build(path, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, table_build(path, &recipe, &replacing));
    TEST_ASSERT_MESSAGE(heard_contains("is not a file"), heard_last());
    assert_folder_holds("t.db ", "the link");
}

/* Somebody tidies the folder up: what was computed cannot be named any more. */
static bool take_it_away(void *context, size_t done, size_t total)
{
    (void)context;
    if (done == total)
        folder_remove(folder); /* all of it */
    return true;
}

static void test_folder_that_vanishes_meanwhile(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table_build_options options = replacing;
    options.progress.report = take_it_away;
    TEST_ASSERT_EQUAL_INT(STATUS_IO, table_build(path, &recipe, &options));
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_MESSAGE(heard_contains("No such file or directory"), heard_last());
}

/* expect: a file system that cannot promise not to replace (EINVAL) still gets its
 * file; any other refusal of the name, or of the disk, leaves nothing. */
static const struct last_step_case {
    const char *what;
    int rename_error, fsync_error;
    bool overwrite;
    enum status status;
    const char *says, *left;
} last_step_cases[] = {
    { "no promise", EINVAL, 0, false, STATUS_OK, "", "t.db " },
    { "no promise asked for, no name given", EINVAL, 0, true, STATUS_IO, "Invalid argument", "" },
    { "no right to the name", EACCES, 0, false, STATUS_READ_ONLY, "Permission denied", "" },
    { "taken at the last moment", EEXIST, 0, false, STATUS_EXISTS, "exists; choose", "" },
    { "the disk fails", 0, EIO, false, STATUS_IO, "Input/output error", "" },
    { "the disk is full", 0, ENOSPC, false, STATUS_FULL, "No space left on device", "" },
};

static void test_last_steps(void)
{
    struct recipe recipe = small_recipe("paper");
    for (size_t i = 0; i < sizeof last_step_cases / sizeof *last_step_cases; i++) {
        const struct last_step_case *c = &last_step_cases[i];
        heard_start();
        rename_error = c->rename_error;
        fsync_error = c->fsync_error;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->status, table_build(path, &recipe, c->overwrite ? &replacing : &plain), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status == STATUS_OK ? 0 : 1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        assert_folder_holds(c->left, c->what);
        (void)unlink(path);
    }
}

/* expect: the system's own word for it. */
static const struct place_case {
    const char *what, *path; /* %s: the test's folder */
    bool overwrite;
    enum status status;
    const char *says;
} place_cases[] = {
    { "no such folder", "/no/such/folder/t.db", false, STATUS_IO, "make the folder first" },
    { "a folder of the kernel's", "/proc/t.db", false, STATUS_IO, "cannot write '/proc/t.db'" },
    { "no name", "", false, STATUS_IO, "is not a file name" },
    { "a folder", "%s", false, STATUS_EXISTS, "name a file in it" },
    { "a folder, said with a slash", "%s/", false, STATUS_EXISTS, "is a folder" },
    { "a folder, to be replaced", "%s", true, STATUS_EXISTS, "is a folder" },
    { "the same with a slash", "%s/", true, STATUS_EXISTS, "is a folder" },
    { "a folder that is not there", "%s/no/", false, STATUS_IO, "is not a file name" },
    { "below a file", "%s/file/t.db", false, STATUS_IO, "Not a directory" },
};

static void test_places_that_are_refused(void)
{
    struct recipe recipe = small_recipe("paper");
    char file[FOLDER_PATH_SIZE];
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "file", file), "x", 1));
    for (size_t i = 0; i < sizeof place_cases / sizeof *place_cases; i++) {
        const struct place_case *c = &place_cases[i];
        char at[2 * FOLDER_PATH_SIZE];
        const char *marker = strstr(c->path, "%s");
        snprintf(at, sizeof at, "%s%s", marker != NULL ? folder : "",
                 marker != NULL ? marker + 2 : c->path);
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            c->status, table_build(at, &recipe, c->overwrite ? &replacing : &plain), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        assert_folder_holds("file ", c->what);
    }
}

static void test_name_that_is_too_long(void)
{
    struct recipe recipe = small_recipe("paper");
    static char at[5000];
    memset(at, 'x', sizeof at - 1);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, table_build(at, &recipe, &plain));
    at[300] = '\0'; /* fits in memory, not in a folder */
    TEST_ASSERT_EQUAL_INT(STATUS_IO, table_build(at, &recipe, &plain));
    TEST_ASSERT_EQUAL_INT(2, heard_count());
}

/* A name without a folder is one in the current folder. */
static void test_name_without_folder(void)
{
    struct recipe recipe = small_recipe("paper");
    int here = open(".", O_RDONLY | O_DIRECTORY);
    TEST_ASSERT_TRUE(here >= 0);
    TEST_ASSERT_EQUAL_INT(0, chdir(folder));
    enum status s = table_build("plain-name.db", &recipe, &plain);
    TEST_ASSERT_EQUAL_INT(0, fchdir(here));
    close(here);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
    assert_folder_holds("plain-name.db ", "there it is");
}

/* ---- progress, and stopping ------------------------------------------------------------ */

struct watch {
    size_t calls, stop_at; /* the call that says no; 0: never */
    size_t done, total;
    bool rises;
    char list[FOLDER_LIST_SIZE];
};

static bool watch_on(void *context, size_t done, size_t total)
{
    struct watch *w = context;
    w->rises = w->calls == 0 ? done == 0 : w->rises && done > w->done && total == w->total;
    w->done = done;
    w->total = total;
    w->calls++;
    folder_list(folder, w->list);
    return w->calls != w->stop_at;
}

/* 50 400 rows in chunks of 8 192: seven reports before a chunk, one at the end. */
static void test_progress(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    struct table_build_options options = plain;
    struct watch w = { 0 };
    char temporary[64];
    options.progress = (struct progress){ watch_on, &w };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_build(path, &recipe, &options));
    TEST_ASSERT_TRUE(w.rises);
    TEST_ASSERT_EQUAL_size_t(8, w.calls);
    TEST_ASSERT_EQUAL_size_t(50400, w.done);
    TEST_ASSERT_EQUAL_size_t(50400, w.total);
    /* Meanwhile the file is hidden beside its place. */
    unsigned long long random;
    TEST_ASSERT_EQUAL_INT(1, sscanf(w.list, ".t.db.%llx.tmp ", &random));
    snprintf(temporary, sizeof temporary, ".t.db.%016llx.tmp ", random);
    TEST_ASSERT_EQUAL_STRING(temporary, w.list); /* that alone */
    assert_folder_holds("t.db ", "and then has its name");
}

static void test_stopped_anywhere(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    for (int there = 0; there <= 1; there++) {
        for (size_t stop_at = 1; stop_at <= 8; stop_at++) {
            struct table_build_options options = { .threads = 2, .overwrite = there };
            struct watch w = { .stop_at = stop_at };
            size_t size;
            options.progress = (struct progress){ watch_on, &w };
            if (there)
                put_old_table();
            TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, table_build(path, &recipe, &options));
            TEST_ASSERT_EQUAL_size_t(stop_at, w.calls);
            TEST_ASSERT_EQUAL_INT(0, heard_count());
            assert_folder_holds(there ? "t.db " : "", "nothing left behind");
            if (there) {
                unsigned char *bytes = file_bytes(path, &size);
                TEST_ASSERT_EQUAL_size_t(OLD_TABLE_SIZE, size);
                free(bytes);
            }
        }
    }
}

/* ---- full disks ------------------------------------------------------------------------ */

/* Build under a limit on the size of files, which stops writes as a full disk does. */
static enum status build_limited(const struct recipe *recipe, rlim_t bytes)
{
    struct rlimit before, limit;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    limit = before;
    limit.rlim_cur = bytes;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &limit));
    enum status s = table_build(path, recipe, &replacing);
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, handler);
    return s;
}

static void test_file_size_limit(void)
{
    /* 4.5 MB in all: SQLite writes early on, as its cache is smaller. */
    static const rlim_t limits[] = { 0, 1, 4096, 100000, 1000000, 4000000, 4500000 };
    struct recipe recipe = recipe_default(model_find("paper"));
    for (int there = 0; there <= 1; there++) {
        for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
            size_t size;
            if (there)
                put_old_table();
            heard_start();
            TEST_ASSERT_EQUAL_INT(STATUS_IO, build_limited(&recipe, limits[i]));
            TEST_ASSERT_EQUAL_INT(1, heard_count());
            TEST_ASSERT_MESSAGE(heard_contains("cannot write"), heard_last());
            TEST_ASSERT_MESSAGE(heard_contains("File too large"), heard_last());
            assert_folder_holds(there ? "t.db " : "", "nothing left behind");
            if (there) {
                unsigned char *bytes = file_bytes(path, &size);
                TEST_ASSERT_EQUAL_size_t(OLD_TABLE_SIZE, size);
                free(bytes);
            }
        }
    }
}

static int build_on_a_small_disk(void)
{
    struct recipe recipe = recipe_default(model_find("paper"));
    struct recipe small = small_recipe("paper");
    struct table_file_info info;
    char list[FOLDER_LIST_SIZE];
    if (!small_disk_mount(folder))
        return SMALL_DISK_NONE;
    if (small_table(path, &small, false) != STATUS_OK)
        return 1;
    if (table_build(path, &recipe, &replacing) != STATUS_FULL)
        return 2;
    if (heard_count() != 1 || !heard_contains("No space left on device"))
        return 3;
    if (strcmp(folder_list(folder, list), "t.db ") != 0)
        return 4;
    return table_file_info(path, &info) == STATUS_OK ? 0 : 5;
}

static void test_full_disk(void)
{
    int ended = small_disk_child(build_on_a_small_disk);
    if (ended == SMALL_DISK_NONE)
        TEST_IGNORE_MESSAGE("no right to mount a small disk");
    TEST_ASSERT_EQUAL_INT(0, ended);
}

/* ---- the R*Tree ------------------------------------------------------------------------ */

/* expect: the query that docs/data.md gives for people; D is the distance to any row. */
static sqlite3_int64 nearest_by_sql(sqlite3_stmt *select, const double Lab[3], double D,
                                    double *distance)
{
    static const char *const name[4] = { ":L", ":a", ":b", ":D" };
    const double value[4] = { Lab[0], Lab[1], Lab[2], D };
    sqlite3_int64 id = 0;
    for (int i = 0; i < 4; i++)
        sqlite3_bind_double(select, sqlite3_bind_parameter_index(select, name[i]), value[i]);
    if (sqlite3_step(select) == SQLITE_ROW) {
        id = sqlite3_column_int64(select, 0);
        *distance = sqrt(sqlite3_column_double(select, 4));
    }
    sqlite3_reset(select);
    return id;
}

static void test_rtree_finds_the_same_rows(void)
{
    static const char sql[] =
        "SELECT id, cm, bm, ch, (l-:L)*(l-:L) + (a-:a)*(a-:a) + (b-:b)*(b-:b) AS square "
        "FROM entry JOIN entry_lab USING (id) "
        "WHERE l_max >= :L-:D AND l_min <= :L+:D AND a_max >= :a-:D AND a_min <= :a+:D"
        "  AND b_max >= :b-:D AND b_min <= :b+:D "
        "ORDER BY square, id LIMIT 1";
    struct recipe recipe = small_recipe("two-layer");
    struct dice dice = { 17 };
    struct nearest *nearest;
    struct table table;
    sqlite3 *db;
    sqlite3_stmt *select;
    recipe.grid.Cm.n = 12;
    recipe.grid.Ch.n = 12; /* 12 + 11 x 60 = 672 rows */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, true));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_read(path, &table));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_open(&table, MATCH_LAB, &nearest));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_prepare_v2(db, sql, -1, &select, NULL));
    for (int i = 0; i < 200; i++) {
        size_t row = dice_below(&dice, table.n), found;
        double near = i % 2 == 0 ? 3.0 : 60.0, distance = 0.0, D = 0.0;
        struct nearest_query q = { .has_colour = true,
                                   .Lab = { table.L[row] + dice_between(&dice, -near, near),
                                            table.a[row] + dice_between(&dice, -near, near),
                                            table.b[row] + dice_between(&dice, -near, near) } };
        struct nearest_hit hit;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, nearest_find(nearest, &q, 1, &hit, &found));
        const double any[3] = { table.L[row], table.a[row], table.b[row] };
        for (int k = 0; k < 3; k++)
            D += (any[k] - q.Lab[k]) * (any[k] - q.Lab[k]);
        sqlite3_int64 id = nearest_by_sql(select, q.Lab, sqrt(D), &distance);
        TEST_ASSERT_EQUAL_INT64((long long)hit.row + 1, id);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, hit.distance, distance);
    }
    sqlite3_finalize(select);
    sqlite3_close(db);
    nearest_close(nearest);
    table_done(&table);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_builds_are_byte_identical);
    RUN_TEST(test_chunks_follow_each_other);
    RUN_TEST(test_recipes_that_are_refused);
    RUN_TEST(test_row_that_cannot_be_made);
    RUN_TEST(test_row_that_is_not_a_number);
    RUN_TEST(test_existing_file);
    RUN_TEST(test_file_that_appears_meanwhile);
    RUN_TEST(test_link_to_nowhere);
    RUN_TEST(test_folder_that_vanishes_meanwhile);
    RUN_TEST(test_last_steps);
    RUN_TEST(test_places_that_are_refused);
    RUN_TEST(test_name_that_is_too_long);
    RUN_TEST(test_name_without_folder);
    RUN_TEST(test_progress);
    RUN_TEST(test_stopped_anywhere);
    RUN_TEST(test_file_size_limit);
    RUN_TEST(test_full_disk);
    RUN_TEST(test_rtree_finds_the_same_rows);
    return UNITY_END();
}
