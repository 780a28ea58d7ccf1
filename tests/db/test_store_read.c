/* test_store_read.c - readers: lists, look-ups, interruption, files they refuse. */
#include "db/sql.h"
#include "db/store_private.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct store *store;
static struct store_reader *reader;
static struct store_record *record;
static struct dice dice;

void setUp(void)
{
    heard_start();
    dice = (struct dice){ 41 };
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    TRY(store_open(folder, NULL, &store));
    TRY(store_reader_open(folder, &reader));
    record = records_make(&dice);
}

void tearDown(void)
{
    free(record);
    store_reader_close(reader);
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

/* ---- lists -------------------------------------------------------------------------------- */

struct seen {
    int64_t seq[64];
    int n, stop_at;
};

static bool see(void *context, const struct store_record *r)
{
    struct seen *seen = context;
    seen->seq[seen->n++] = r->seq;
    return seen->n != seen->stop_at;
}

/* Ten records, the even ones of a subject; by an account (1, 4, 7, 10), by root (2, 5, 8) and
 * by who knows whom. */
static void add_ten(struct store_subject *subject)
{
    static const int64_t owner[] = { -1, 1000, 0 };
    bool known;
    memset(subject, 0, sizeof *subject);
    TRY(store_add_subject(store, subject, ""));
    for (int i = 1; i <= 10; i++) {
        records_uuid(&dice, record->uuid);
        strcpy(record->subject, i % 2 == 0 ? subject->id : "");
        record->owner_uid = owner[i % 3];
        TRY(store_add_record(store, record, &known));
    }
}

static const struct list_case {
    const char *what;
    int64_t since, until;
    bool of_subject;
    int64_t owner;
    int stop_at, n;
    int64_t first, last;
} list_cases[] = {
    { "all", 0, 0, false, -1, 0, 10, 1, 10 },
    { "since one", 7, 0, false, -1, 0, 3, 8, 10 },
    { "since the last", 10, 0, false, -1, 0, 0, 0, 0 },
    { "since the future", 99, 0, false, -1, 0, 0, 0, 0 },
    { "since before the first", -5, 0, false, -1, 0, 10, 1, 10 },
    { "until told to stop", 2, 0, false, -1, 3, 3, 3, 5 },
    { "until one", 0, 4, false, -1, 0, 4, 1, 4 },
    { "from one until another", 3, 7, false, -1, 0, 4, 4, 7 },
    { "until before the first", 0, -1, false, -1, 0, 0, 0, 0 },
    { "until the future", 8, 99, false, -1, 0, 2, 9, 10 },
    { "of a subject", 0, 0, true, -1, 0, 5, 2, 10 },
    { "of a subject, since", 4, 0, true, -1, 0, 3, 6, 10 },
    { "of a subject, until one", 0, 5, true, -1, 0, 2, 2, 4 },
    { "of a subject, until told to stop", 0, 0, true, -1, 1, 1, 2, 2 },
    { "of an account", 0, 0, false, 1000, 0, 4, 1, 10 },
    { "of root", 0, 0, false, 0, 0, 3, 2, 8 },
    { "of root, from one until another", 2, 7, false, 0, 0, 1, 5, 5 },
    { "of nobody's account", 0, 0, false, 65534, 0, 0, 0, 0 },
    { "of a subject and an account", 0, 0, true, 1000, 0, 2, 4, 10 },
    { "of a subject and root, since", 2, 0, true, 0, 0, 1, 8, 8 },
};

static void test_lists(void)
{
    struct store_subject subject;
    add_ten(&subject);
    for (size_t i = 0; i < sizeof list_cases / sizeof *list_cases; i++) {
        const struct list_case *c = &list_cases[i];
        struct seen seen = { .stop_at = c->stop_at };
        struct store_query query = { c->since, c->until, c->of_subject ? subject.id : NULL,
                                     c->owner };
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_list(reader, &query, see, &seen), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->n, seen.n, c->what);
        for (int j = 1; j < seen.n; j++)
            TEST_ASSERT_TRUE_MESSAGE(seen.seq[j] > seen.seq[j - 1], c->what);
        if (c->n > 0) {
            TEST_ASSERT_EQUAL_INT64_MESSAGE(c->first, seen.seq[0], c->what);
            TEST_ASSERT_EQUAL_INT64_MESSAGE(c->last, seen.seq[seen.n - 1], c->what);
        }
    }
    struct seen seen = { .n = 0 };
    struct store_query nobody = { .subject = "nobody", .owner_uid = -1 };
    TRY(store_list(reader, &nobody, see, &seen));
    TEST_ASSERT_EQUAL_INT(0, seen.n);
}

/* What is added while the callback runs is not in the list, and the callback holds nothing:
 * the WAL can be emptied meanwhile. */
static bool add_and_checkpoint(void *context, const struct store_record *r)
{
    int left = 77;
    bool known;
    (void)r;
    ++*(int *)context;
    records_uuid(&dice, record->uuid);
    TRY(store_add_record(store, record, &known));
    TRY(tool_checkpoint(folder, &left));
    TEST_ASSERT_EQUAL_INT(0, left);
    return true;
}

static void test_nothing_is_held_in_the_callback(void)
{
    int n = 0;
    tool_add(store, 3, 5);
    TRY(store_list(reader, &tool_all, add_and_checkpoint, &n));
    TEST_ASSERT_EQUAL_INT(5, n);
}

/* Subjects after one, in the order they were added; forgotten ones keep their place. */
struct subjects {
    char id[8][STORE_UUID_SIZE];
    int n, stop_at;
};

static bool see_subject(void *context, const struct store_subject *subject)
{
    struct subjects *seen = context;
    memcpy(seen->id[seen->n++], subject->id, STORE_UUID_SIZE);
    return seen->n != seen->stop_at;
}

static const struct page_case {
    const char *what;
    int after, stop_at, n; /* after: -1: from the first */
} page_cases[] = {
    { "all", -1, 0, 5 },           { "the first two", -1, 2, 2 },
    { "the next two", 1, 2, 2 },   { "the last page", 3, 2, 1 },
    { "after the last", 4, 2, 0 }, { "after a forgotten one", 2, 0, 2 },
};

static void test_subjects_page_by_page(void)
{
    char id[5][STORE_UUID_SIZE];
    bool erased;
    struct subjects seen = { .n = 0 };
    for (int i = 0; i < 5; i++) {
        struct store_subject subject = { .name = "Zoë" };
        TRY(store_add_subject(store, &subject, ""));
        memcpy(id[i], subject.id, sizeof id[i]);
    }
    TRY(store_forget_subject(store, id[2], "", &erased));
    for (size_t i = 0; i < sizeof page_cases / sizeof *page_cases; i++) {
        const struct page_case *c = &page_cases[i];
        seen = (struct subjects){ .stop_at = c->stop_at };
        TRY(store_list_subjects(reader, c->after < 0 ? "" : id[c->after], see_subject, &seen));
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->n, seen.n, c->what);
        for (int j = 0; j < seen.n; j++)
            TEST_ASSERT_EQUAL_STRING_MESSAGE(id[c->after + 1 + j], seen.id[j], c->what);
    }
    seen.n = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND,
                          store_list_subjects(reader, "nobody", see_subject, &seen));
    TEST_ASSERT_EQUAL_INT(0, seen.n);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

static void test_station_id(void)
{
    char id[STORE_UUID_SIZE] = "";
    TRY(store_read_station_id(reader, id));
    TEST_ASSERT_EQUAL_STRING(store_station_id(store), id);
}

static void test_newest_and_fence(void)
{
    int64_t seq = 77, fence = 77;
    bool known;
    TRY(store_newest(reader, &seq));
    TRY(store_max_fence(reader, &fence));
    TEST_ASSERT_EQUAL_INT64(0, seq);
    TEST_ASSERT_EQUAL_INT64(0, fence);
    TRY(store_highest_fence(store, &fence));
    TEST_ASSERT_EQUAL_INT64(0, fence);
    for (int i = 0; i < 4; i++) {
        static const int64_t fences[] = { 0, 5, INT64_C(1) << 40, 3 };
        records_uuid(&dice, record->uuid);
        record->fence = fences[i];
        TRY(store_begin(store));
        TRY(store_add_record(store, record, &known));
        TRY(store_highest_fence(store, &fence));
        TEST_ASSERT_EQUAL_INT64(i < 2 ? fences[i] : fences[2], fence);
        TRY(store_commit(store));
        TRY(store_newest(reader, &seq));
        TRY(store_max_fence(reader, &fence));
        TEST_ASSERT_EQUAL_INT64(i + 1, seq);
        TEST_ASSERT_EQUAL_INT64(i < 2 ? fences[i] : fences[2], fence);
    }
}

/* expect: the integers that were given, from 16 bit devices and beyond. */
static void test_raw_integers(void)
{
    static const int32_t raw[] = { 0, 1, -1, INT32_MAX, INT32_MIN, 65535, 123456 };
    int32_t *got = NULL;
    size_t n = 77;
    bool known;
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_read_raw(reader, "x", &got, &n));
    TEST_ASSERT_EQUAL_size_t(77, n);
    record->raw = raw;
    record->raw_n = sizeof raw / sizeof *raw;
    TRY(store_add_record(store, record, &known));
    TRY(store_read_raw(reader, record->id, &got, &n));
    TEST_ASSERT_EQUAL_size_t(sizeof raw / sizeof *raw, n);
    TEST_ASSERT_EQUAL_INT32_ARRAY(raw, got, n);
    free(got);
    record->raw = NULL;
    records_uuid(&dice, record->uuid);
    TRY(store_add_record(store, record, &known));
    TRY(store_read_raw(reader, record->id, &got, &n));
    TEST_ASSERT_EQUAL_size_t(0, n);
    TEST_ASSERT_NULL(got);
}

/* The lists of a kiosk and the start of a daemon must not walk through all records: each
 * statement finds its rows by an index. */
static const struct plan_case {
    const char *what;
    enum reader_query query;
    const char *index;
} plan_cases[] = {
    { "all", QUERY_NEXT, "INTEGER PRIMARY KEY (rowid>? AND rowid<?)" },
    { "of a subject", QUERY_NEXT_OF_SUBJECT,
      "measurement_subject (subject=? AND seq>? AND seq<?)" },
    { "of an owner", QUERY_NEXT_OF_OWNER, "measurement_owner (owner_uid=? AND seq>? AND seq<?)" },
    { "of both", QUERY_NEXT_OF_BOTH, "measurement_subject (subject=? AND seq>? AND seq<?)" },
    { "the fence", QUERY_HIGHEST_FENCE, "measurement_fence (fence>?)" },
};

static void test_found_by_an_index(void)
{
    for (size_t i = 0; i < sizeof plan_cases / sizeof *plan_cases; i++) {
        const struct plan_case *c = &plan_cases[i];
        char sql[4096];
        sqlite3_stmt *plan;
        bool found = false;
        snprintf(sql, sizeof sql, "EXPLAIN QUERY PLAN %s", sqlite3_sql(reader->query[c->query]));
        TRY(sql_prepare(reader->db, sql, &plan));
        while (sqlite3_step(plan) == SQLITE_ROW) {
            const char *detail = (const char *)sqlite3_column_text(plan, 3);
            found = found || strstr(detail, c->index) != NULL;
            TEST_ASSERT_MESSAGE(strstr(detail, "TEMP B-TREE") == NULL, c->what);
        }
        sqlite3_finalize(plan);
        TEST_ASSERT_MESSAGE(found, c->what);
    }
}

static bool see_text(void *context, const char *text)
{
    char *all = context;
    strcat(all, text);
    strcat(all, ";");
    return strlen(all) < 20;
}

static bool count_subjects(void *context, const struct store_subject *subject)
{
    (void)subject;
    return ++*(int *)context < 2;
}

static void test_sites_and_subjects_each_once(void)
{
    static const char *const site[] = { "forearm", "", "cheek", "forearm", "nose", "cheek" };
    struct store_subject subject = { .name = "Zoë" };
    char all[100] = "";
    int n = 0;
    bool known;
    TRY(store_list_sites(reader, see_text, all));
    TRY(store_list_subjects(reader, "", count_subjects, &n));
    TEST_ASSERT_EQUAL_STRING("", all);
    TEST_ASSERT_EQUAL_INT(0, n);
    for (int i = 0; i < 6; i++) {
        records_uuid(&dice, record->uuid);
        strcpy(record->site, site[i]);
        TRY(store_add_record(store, record, &known));
        TRY(store_add_subject(store, &subject, ""));
    }
    TRY(store_list_sites(reader, see_text, all));
    TEST_ASSERT_EQUAL_STRING("forearm;cheek;nose;", all);
    TRY(store_list_sites(reader, see_text, all)); /* stopped after its first */
    TEST_ASSERT_EQUAL_STRING("forearm;cheek;nose;forearm;", all);
    TRY(store_list_subjects(reader, "", count_subjects, &n));
    TEST_ASSERT_EQUAL_INT(2, n);
}

static void test_not_found(void)
{
    struct store_record *got = malloc(sizeof *got);
    got->seq = 77;
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_get(reader, "x", NULL, got));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_get(reader, "", NULL, got));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_get(reader, NULL, "x", got));
    TEST_ASSERT_EQUAL_INT64(77, got->seq);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
    free(got);
}

/* ---- interruption ------------------------------------------------------------------- */

static int interrupt_later(void *context)
{
    int *left = context;
    if (--*left == 0)
        store_reader_interrupt(reader);
    return 0;
}

static int interrupt_at_once(void *context)
{
    (void)context;
    return 1;
}

/* SQLite calls back while it works: the interruption comes in the middle. */
static void test_interrupted(void)
{
    struct store_verify_report report = { .records = 77 };
    struct store_calibration calibration;
    struct store_instrument instrument = records_instrument();
    struct seen seen = { .n = 0 };
    char all[100] = "";
    tool_add(store, 3, 100);
    int worked = 0;
    for (int after = 1; after < 200; after += 20) {
        int left = after;
        sqlite3_progress_handler(reader->db, 50, interrupt_later, &left);
        enum status s = store_verify(reader, &report);
        TEST_ASSERT_TRUE(s == STATUS_OK || s == STATUS_CANCELLED);
        worked += s == STATUS_CANCELLED;
    }
    TEST_ASSERT_TRUE(worked > 5);
    sqlite3_progress_handler(reader->db, 1, interrupt_at_once, NULL);
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, store_list(reader, &tool_all, see, &seen));
    int64_t number = 77;
    int32_t *raw = NULL;
    size_t raw_n = 77;
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, store_newest(reader, &number));
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, store_max_fence(reader, &number));
    TEST_ASSERT_EQUAL_INT64(77, number);
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, store_read_raw(reader, "x", &raw, &raw_n));
    TEST_ASSERT_EQUAL_size_t(77, raw_n);
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, store_list_sites(reader, see_text, all));
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED,
                          store_last_calibration(reader, &instrument, "zero", &calibration));
    sqlite3_progress_handler(reader->db, 0, NULL, NULL);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
    TRY(store_verify(reader, &report)); /* and it works again */
    TEST_ASSERT_EQUAL_INT64(100, report.records);
}

/* ---- files that will not do --------------------------------------------------------- */

static void test_no_file_and_older_files(void)
{
    struct store_reader *other = NULL;
    store_close(store);
    store = NULL;
    store_reader_close(reader);
    reader = NULL;
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA user_version = 3"));
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, store_reader_open(folder, &other));
    TEST_ASSERT_TRUE(heard_contains("version 3"));
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA user_version = 0")); /* whose it is, nobody knows */
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, store_reader_open(folder, &other));
    TEST_ASSERT_TRUE(heard_contains("is no station's store"));
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA user_version = 4; DROP TABLE site"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_reader_open(folder, &other));
    TEST_ASSERT_TRUE(heard_contains("no such table"));
    TEST_ASSERT_TRUE(file_write(path, "not a database, but a letter of some length", 43));
    TEST_ASSERT_EQUAL_INT(STATUS_FORMAT, store_reader_open(folder, &other));
    TEST_ASSERT_TRUE(heard_contains("not a database"));
    unlink(path);
    heard_start();
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_reader_open(folder, &other));
    TEST_ASSERT_NULL(other);
    TEST_ASSERT_EQUAL_INT(0, heard_count());
    store_reader_close(NULL);
}

/* expect: what no record can hold is said, not taken. */
static const struct spoilt_case {
    const char *what, *sql;
} spoilt_cases[] = {
    { "no bands", "UPDATE measurement SET bands = 0" },
    { "too many bands", "UPDATE measurement SET bands = 1025" },
    { "bands of another number", "UPDATE measurement SET bands = 30" },
    { "a short spectrum", "UPDATE measurement SET spectrum = substr(spectrum, 9)" },
    { "an empty spectrum", "UPDATE measurement SET spectrum = x''" },
    { "too many replicates", "UPDATE measurement SET replicates = 33" },
    { "replicates below 0", "UPDATE measurement SET replicates = -1" },
    { "replicates of another number", "UPDATE measurement SET replicates = 2" },
    { "a long spectrum", "UPDATE measurement SET sci = CAST(sci || x'00' AS BLOB)" },
    { "flags of another number", "UPDATE measurement SET band_flags = x'01'" },
};

static void test_spoilt_rows(void)
{
    struct store_record *got = malloc(sizeof *got);
    struct seen seen = { .n = 0 };
    size_t size;
    tool_add(store, 3, 1);
    store_reader_close(reader); /* so that closing the store empties the WAL */
    reader = NULL;
    store_close(store);
    store = NULL;
    TEST_ASSERT_TRUE(tool_without_triggers(folder));
    unsigned char *bytes = file_bytes(path, &size);
    for (size_t i = 0; i < sizeof spoilt_cases / sizeof *spoilt_cases; i++) {
        const struct spoilt_case *c = &spoilt_cases[i];
        store_reader_close(reader);
        reader = NULL;
        char wal[FOLDER_PATH_SIZE];
        unlink(folder_path(folder, "station.db-wal", wal));
        unlink(folder_path(folder, "station.db-shm", wal));
        TEST_ASSERT_TRUE(file_write(path, bytes, size));
        TEST_ASSERT_TRUE(tool_edit(folder, c->sql));
        TRY(store_reader_open(folder, &reader));
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DAMAGED, store_list(reader, &tool_all, see, &seen),
                                      c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains("record 1"), heard_last());
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, seen.n, c->what);
    }
    TEST_ASSERT_TRUE(tool_edit(folder, "DELETE FROM measurement"));
    free(bytes);
    free(got);
}

/* A lock that nobody gives up in time. */
static void test_locked_by_another_program(void)
{
    sqlite3 *other;
    struct store_verify_report report;
    struct store_record *got = malloc(sizeof *got);
    store_close(store);
    store = NULL;
    store_reader_close(reader);
    TRY(store_reader_open(folder, &reader));
    sqlite3_busy_timeout(reader->db, 1);
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_get(reader, "x", NULL, got));
    store_reader_close(reader);
    reader = NULL;
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &other));
    TRY(sql_run(other, "PRAGMA journal_mode = DELETE"));
    TRY(store_reader_open(folder, &reader));
    sqlite3_busy_timeout(reader->db, 1);
    TRY(sql_run(other, "BEGIN EXCLUSIVE"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_get(reader, "x", NULL, got));
    TEST_ASSERT_TRUE(heard_contains("locked"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_verify(reader, &report));
    TEST_ASSERT_TRUE(heard_contains("cannot verify"));
    sqlite3_close(other);
    free(got);
}

/* A path with characters that a URI would take for something else, read in place. */
static void test_strange_names(void)
{
    char strange[FOLDER_PATH_SIZE], file[FOLDER_PATH_SIZE];
    sqlite3 *db;
    folder_path(folder, "50% of #1?.db", strange);
    size_t size;
    store_close(store);
    store = NULL;
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_TRUE(file_write(strange, bytes, size));
    free(bytes);
    TRY(store_connect_alone(strange, &db));
    TRY(sql_run(db, "SELECT count(*) FROM station"));
    sqlite3_close(db);
    TEST_ASSERT_FALSE(store_has_wal(strange));
    snprintf(file, sizeof file, "%.400s-wal", strange);
    TEST_ASSERT_TRUE(file_write(file, "x", 1));
    TEST_ASSERT_TRUE(store_has_wal(strange));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_lists);
    RUN_TEST(test_nothing_is_held_in_the_callback);
    RUN_TEST(test_sites_and_subjects_each_once);
    RUN_TEST(test_subjects_page_by_page);
    RUN_TEST(test_station_id);
    RUN_TEST(test_newest_and_fence);
    RUN_TEST(test_raw_integers);
    RUN_TEST(test_found_by_an_index);
    RUN_TEST(test_not_found);
    RUN_TEST(test_interrupted);
    RUN_TEST(test_no_file_and_older_files);
    RUN_TEST(test_spoilt_rows);
    RUN_TEST(test_locked_by_another_program);
    RUN_TEST(test_strange_names);
    return UNITY_END();
}
