/* test_store_open.c - a store is made, found again, locked; anything else is refused or
 * moved aside, and nothing is ever deleted. */
#define _DEFAULT_SOURCE /* truncate, seteuid */
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "db/sql.h"
#include "db/station_schema.h"
#include "base/uuid.h"
#include "tests/store/older.h"
#include "tests/store/tools.h"
#include "tests/support/heard.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE], list[FOLDER_LIST_SIZE];
static struct store *store;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "station.db", path);
    store = NULL;
}

void tearDown(void)
{
    store_close(store);
    heard_stop();
    folder_remove(folder);
}

static void reopen(void)
{
    store_close(store);
    store = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_open(folder, NULL, &store), heard_last());
}

static void close_store(void)
{
    store_close(store);
    store = NULL;
}

/* ---- made and found again ---------------------------------------------------------------- */

static void test_made_and_found_again(void)
{
    char id[STORE_UUID_SIZE];
    struct stat st;
    TRY(store_open(folder, NULL, &store));
    snprintf(id, sizeof id, "%s", store_station_id(store));
    TEST_ASSERT_TRUE(uuid_is_text(id));
    TEST_ASSERT_EQUAL_INT(0, stat(path, &st));
    TEST_ASSERT_EQUAL_HEX(0600, st.st_mode & 0777);
    tool_add(store, 1, 3);
    reopen();
    TEST_ASSERT_EQUAL_STRING(id, store_station_id(store));
    close_store();
    TEST_ASSERT_EQUAL_STRING("lock station.db ", folder_list(folder, list));
    TEST_ASSERT_EQUAL_INT(3, tool_number(folder, "SELECT count(*) FROM measurement"));
    TEST_ASSERT_EQUAL_INT(0, heard_count());
}

/* What a start leaves that was killed while it made the file. */
static void test_left_over_from_making(void)
{
    char other[FOLDER_PATH_SIZE];
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "station.db.new", other), "half", 4));
    TRY(store_open(folder, NULL, &store));
    close_store();
    TEST_ASSERT_EQUAL_STRING("lock station.db ", folder_list(folder, list));
}

static void test_one_writer(void)
{
    struct store *second = NULL;
    TRY(store_open(folder, NULL, &store));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_open(folder, NULL, &second));
    TEST_ASSERT_NULL(second);
    TEST_ASSERT_TRUE(heard_contains("another process"));
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, store_begin_anew(folder));
    close_store();
    TRY(store_open(folder, NULL, &store));
    store_close(NULL);
}

static void test_a_group_left_open_is_dropped(void)
{
    struct dice dice = { 1 };
    struct store_record *r = records_make(&dice);
    bool known;
    TRY(store_open(folder, NULL, &store));
    TRY(store_begin(store));
    TRY(store_add_record(store, r, &known));
    free(r);
    close_store();
    TEST_ASSERT_EQUAL_INT(0, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* ---- folders ------------------------------------------------------------------------------- */

static void test_folders_that_will_not_do(void)
{
    char other[FOLDER_PATH_SIZE];
    char *longest = malloc(5001);
    int left = 77;
    int64_t bytes = 77;
    struct store_reader *reader = NULL;
    folder_path(folder, "none", other);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_open(other, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("No such file or directory"));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_begin_anew(other));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, store_reader_open(other, &reader));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, tool_checkpoint(other, &left));
    TRY(store_wal_bytes(other, &bytes));
    TEST_ASSERT_EQUAL_INT(0, bytes);
    TEST_ASSERT_TRUE(file_write(other, "a file", 6));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_open(other, NULL, &store));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_reader_open(other, &reader));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_wal_bytes(other, &bytes));
    memset(longest, 'x', 5000);
    longest[5000] = '\0';
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_open(longest, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("File name too long"));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_reader_open(longest, &reader));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, tool_checkpoint(longest, &left));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_wal_bytes(longest, &bytes));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_begin_anew(longest));
    TEST_ASSERT_EQUAL_INT(77, left);
    free(longest);
}

/* Root may write anywhere: be nobody for a while. */
static void check_read_only(void)
{
    struct store_reader *reader = NULL;
    struct store_verify_report report = { 0 };
    bool root = geteuid() == 0;
    char *absolute = realpath(path, NULL); /* as SQLite opens it: every folder above counts */
    TEST_ASSERT_NOT_NULL(absolute);
    TEST_ASSERT_EQUAL_INT(0, root ? seteuid(65534) : 0);
    int fd = open(absolute, O_RDONLY);
    if (fd >= 0)
        close(fd);
    free(absolute);
    enum status opened = store_open(folder, NULL, &store);
    enum status read = store_reader_open(folder, &reader);
    enum status verified = read == STATUS_OK ? store_verify(reader, &report) : read;
    TEST_ASSERT_EQUAL_INT(0, root ? seteuid(0) : 0);
    store_reader_close(reader);
    TEST_ASSERT_EQUAL_INT(0, chmod(folder, 0755));
    if (fd < 0)
        TEST_IGNORE_MESSAGE("the build folder is not open to another user");
    TEST_ASSERT_EQUAL_INT(STATUS_READ_ONLY, opened);
    TEST_ASSERT_MESSAGE(heard_contains("Permission denied"), heard_last());
    TEST_ASSERT_EQUAL_INT(STATUS_OK, verified);
    TEST_ASSERT_EQUAL_INT64(3, report.records);
}

/* Nothing can be written, all can be read. */
static void test_read_only_folder(void)
{
    char lock[FOLDER_PATH_SIZE];
    TRY(store_open(folder, NULL, &store));
    tool_add(store, 1, 3);
    close_store();
    TEST_ASSERT_EQUAL_INT(0, chmod(path, 0444));
    TEST_ASSERT_EQUAL_INT(0, chmod(folder_path(folder, "lock", lock), 0444));
    TEST_ASSERT_EQUAL_INT(0, chmod(folder, 0555));
    check_read_only();
}

/* ---- files that are none of ours ------------------------------------------------------------- */

static void make_sqlite(const char *sql)
{
    sqlite3 *db;
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    TRY(sql_run(db, sql));
    sqlite3_close(db);
}

static const struct foreign_case {
    const char *what, *sql, *text;
    enum status status;
    const char *says;
} foreign_cases[] = {
    { "a letter", NULL,
      "Dear station, this is a text and longer than a header of SQLite is; the "
      "header has one hundred bytes, which are now filled.",
      STATUS_FORMAT, "foreign" },
    { "a word", NULL, "SQLite", STATUS_FORMAT, "foreign" },
    { "somebody else's database", "CREATE TABLE t(x); PRAGMA user_version = 1", NULL, STATUS_FORMAT,
      "foreign" },
    { "a table of ours", "CREATE TABLE t(x); PRAGMA application_id = 1399542882", NULL,
      STATUS_FORMAT, "foreign" },
    { "a newer station",
      "CREATE TABLE t(x); PRAGMA application_id = 1399542644; PRAGMA user_version = 1000", NULL,
      STATUS_VERSION, "newer" },
};

static void test_foreign_files_are_untouched(void)
{
    for (size_t i = 0; i < sizeof foreign_cases / sizeof *foreign_cases; i++) {
        const struct foreign_case *c = &foreign_cases[i];
        size_t before_size, size;
        unlink(path);
        if (c->sql != NULL)
            make_sqlite(c->sql);
        else
            TEST_ASSERT_TRUE(file_write(path, c->text, strlen(c->text)));
        unsigned char *before = file_bytes(path, &before_size);
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, store_open(folder, NULL, &store), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        TEST_ASSERT_EQUAL_STRING_MESSAGE("lock station.db ", folder_list(folder, list), c->what);
        unsigned char *after = file_bytes(path, &size);
        TEST_ASSERT_EQUAL_size_t(before_size, size);
        TEST_ASSERT_EQUAL_MEMORY(before, after, size);
        free(before);
        free(after);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NOT_FOUND, store_begin_anew(folder), c->what);
    }
}

/* user_version raised by a newer program in a WAL that was not checkpointed. */
static void test_newer_in_the_wal(void)
{
    sqlite3 *db;
    TRY(store_open(folder, NULL, &store));
    close_store();
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    sqlite3_db_config(db, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, NULL);
    TRY(sql_run(db, "PRAGMA wal_autocheckpoint = 0; PRAGMA user_version = 1000"));
    sqlite3_close(db);
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("version 1000"));
    struct store_reader *reader = NULL;
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, store_reader_open(folder, &reader));
    TEST_ASSERT_NULL(reader);
}

/* ---- older files ---------------------------------------------------------------------------- */

static bool see_old(void *context, const struct store_record *record)
{
    TEST_ASSERT_EQUAL_INT64(-1, record->owner_uid);
    TEST_ASSERT_EQUAL_INT64(7, record->fence);
    ++*(int *)context;
    return true;
}

/* A file of version 1 is brought to this one when it is opened for writing: rows and chain are as
 * they were, and what version 2 added is not known of them. */
static void test_from_version_1(void)
{
    struct dice dice = { 1 };
    struct store_record *record = records_make(&dice);
    struct store_calibration calibration = { .instrument = records_instrument(),
                                             .step = "zero",
                                             .aperture_mm = (double)NAN };
    struct store_verify_report before, after;
    struct store_reader *reader = NULL;
    bool known;
    int n = 0;
    int64_t fence = 0;
    record->owner_uid = -1;
    TRY(store_open(folder, NULL, &store));
    TRY(store_add_calibration(store, &calibration));
    TRY(store_add_record(store, record, &known));
    close_store();
    TRY(tool_verify(folder, &before));
    TEST_ASSERT_TRUE(older_make(folder));
    TEST_ASSERT_EQUAL_INT(STATUS_VERSION, store_reader_open(folder, &reader));
    TEST_ASSERT_TRUE(heard_contains("is of version 1"));
    TRY(store_open(folder, NULL, &store));
    TRY(store_highest_fence(store, &fence));
    TEST_ASSERT_EQUAL_INT64(7, fence);
    TRY(store_reader_open(folder, &reader));
    TRY(store_verify(reader, &after));
    TEST_ASSERT_EQUAL_STRING(before.last_hash, after.last_hash);
    TRY(store_list(reader, &tool_all, see_old, &n));
    TEST_ASSERT_EQUAL_INT(1, n);
    TRY(store_last_calibration(reader, &calibration.instrument, "zero", &calibration));
    TEST_ASSERT_TRUE(isnan(calibration.aperture_mm));
    tool_add(store, 2, 3);
    TRY(store_verify(reader, &after));
    TEST_ASSERT_EQUAL_INT64(4, after.records);
    store_reader_close(reader);
    free(record);
}

/* ---- damage
 * --------------------------------------------------------------------------------------- */

/* A store with three records, its file changed and opened again. */
static void make_three(void)
{
    TRY(store_open(folder, NULL, &store));
    tool_add(store, 1, 300);
    close_store();
}

static void overwrite(long at, int byte, size_t n)
{
    FILE *f = fopen(path, "r+b");
    TEST_ASSERT_NOT_NULL(f);
    fseek(f, at, SEEK_SET);
    for (size_t i = 0; i < n; i++)
        fputc(byte, f);
    fclose(f);
}

static void cut_to(off_t bytes)
{
    TEST_ASSERT_EQUAL_INT(0, truncate(path, bytes));
}

static void spoil_magic(void)
{
    overwrite(0, 'x', 16);
}

static void spoil_application_id(void)
{
    overwrite(68, 'x', 4);
}

static void spoil_first_page(void)
{
    overwrite(0, 0, 4096);
}

static void spoil_page_size(void)
{
    overwrite(16, 0x77, 2);
}

static void spoil_the_middle(void)
{
    long long root =
        tool_number(folder, "SELECT rootpage FROM sqlite_schema WHERE name = 'measurement'");
    overwrite((long)((root - 1) * 4096), 0xff, 4096);
}

static void cut_everything(void)
{
    cut_to(0);
}

static void cut_the_header(void)
{
    cut_to(50);
}

static void cut_the_end(void)
{
    cut_to(48 * 4096 + 100); /* each of the tables and indexes has a page first */
}

static void all_zero(void)
{
    overwrite(0, 0, 5000);
    cut_to(5000);
}

static void lose_the_file(void)
{
    char wal[FOLDER_PATH_SIZE];
    unlink(path);
    TEST_ASSERT_TRUE(file_write(folder_path(folder, "station.db-wal", wal), "records", 7));
}

static void lose_the_station(void)
{
    TEST_ASSERT_TRUE(tool_edit(folder, "PRAGMA writable_schema = ON;"
                                       "UPDATE sqlite_schema SET rootpage = 999999"
                                       " WHERE name = 'station'"));
}

/* expect: seq goes on above 300; or, where only a part of the file can be read, above what
 * that part has; or at 1 where nothing can. */
static const struct damage_case {
    const char *what;
    void (*spoil)(void);
    const char *says;
    int read; /* lowest number that seq may go on from */
} damage_cases[] = {
    { "magic", spoil_magic, "header is damaged", 1 },
    { "application id", spoil_application_id, "header is damaged", 301 },
    { "first page", spoil_first_page, "header is damaged", 1 },
    { "page size", spoil_page_size, "not a database", 1 },
    { "a page in the middle", spoil_the_middle, "", 301 },
    { "zero length", cut_everything, "holds nothing", 1 },
    { "cut within the header", cut_the_header, "cut short", 1 },
    { "cut at the end", cut_the_end, "", 10 },
    { "all zero", all_zero, "holds nothing", 1 },
    { "file gone, -wal left", lose_the_file, "is gone", 1 },
    { "schema", lose_the_station, "", 301 },
};

/* The folder holds the damaged bytes under their new name. */
static void assert_kept(const unsigned char *bytes, size_t size, const char *what)
{
    char aside[FOLDER_PATH_SIZE], marker[FOLDER_PATH_SIZE], name[256] = "";
    size_t kept_size, marker_size;
    unsigned char *text = file_bytes(folder_path(folder, "station.damaged", marker), &marker_size);
    TEST_ASSERT_NOT_NULL_MESSAGE(text, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, sscanf((char *)text, "%255s", name), what);
    TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE("station.db.damaged-20", name, 21, what);
    free(text);
    TEST_ASSERT_TRUE_MESSAGE(access(path, F_OK) != 0, what);
    if (bytes == NULL)
        return;
    unsigned char *kept = file_bytes(folder_path(folder, name, aside), &kept_size);
    TEST_ASSERT_NOT_NULL_MESSAGE(kept, what);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(size, kept_size, what);
    TEST_ASSERT_TRUE_MESSAGE(memcmp(bytes, kept, size) == 0, what);
    free(kept);
}

static void test_damage_is_moved_aside(void)
{
    for (size_t i = 0; i < sizeof damage_cases / sizeof *damage_cases; i++) {
        const struct damage_case *c = &damage_cases[i];
        size_t size = 0;
        make_three();
        c->spoil();
        unsigned char *bytes = file_bytes(path, &size);
        heard_start();
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DAMAGED, store_open(folder, NULL, &store), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), c->what);
        TEST_ASSERT_MESSAGE(heard_contains(c->says), heard_last());
        TEST_ASSERT_MESSAGE(heard_contains("it is kept as"), heard_last());
        assert_kept(bytes, size, c->what);
        /* It keeps this answer until told. */
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_DAMAGED, store_open(folder, NULL, &store), c->what);
        assert_kept(bytes, size, c->what);
        free(bytes);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_begin_anew(folder), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, store_open(folder, NULL, &store), c->what);
        tool_add(store, 2, 1);
        close_store();
        int seq = (int)tool_number(folder, "SELECT seq FROM measurement");
        TEST_ASSERT_TRUE_MESSAGE(c->read == 1 || c->read == 301 ? seq == c->read
                                                                : seq >= c->read && seq <= 301,
                                 c->what);
        struct store_verify_report report;
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, tool_verify(folder, &report), c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_NOT_FOUND, store_begin_anew(folder), c->what);
        folder_remove(folder);
        TEST_ASSERT_TRUE(folder_make(folder));
        folder_path(folder, "station.db", path);
    }
}

/* The WAL goes along under the name that SQLite looks for, and its records are read. */
static void test_the_wal_goes_along(void)
{
    struct store_reader *reader;
    struct store_verify_report report;
    sqlite3 *pin;
    char name[FOLDER_PATH_SIZE] = "", copy[FOLDER_PATH_SIZE];
    size_t size, wal_size;
    TRY(store_open(folder, NULL, &store));
    tool_add(store, 1, 3);
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &pin));
    TRY(sql_run(pin, "BEGIN; SELECT count(*) FROM measurement"));
    tool_add(store, 2, 2);
    close_store(); /* cannot checkpoint all */
    unsigned char *wal = file_bytes(folder_path(folder, "station.db-wal", copy), &wal_size);
    unsigned char *main_file = file_bytes(path, &size);
    TEST_ASSERT_TRUE(wal_size > 0);
    sqlite3_close(pin);
    TEST_ASSERT_TRUE(file_write(copy, wal, wal_size));
    main_file[68] = 'x';
    TEST_ASSERT_TRUE(file_write(path, main_file, size));
    free(wal);
    free(main_file);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    sscanf(strstr(heard_last(), "station.db.damaged-"), "%63[^']", name);
    strcat(name, "-wal");
    TEST_ASSERT_EQUAL_INT(0, access(folder_path(folder, name, copy), F_OK));
    TRY(store_reader_open(folder, &reader)); /* what was moved aside */
    TRY(store_verify(reader, &report));
    TEST_ASSERT_EQUAL_INT(5, report.records);
    store_reader_close(reader);
    TEST_ASSERT_EQUAL_INT(0, access(copy, F_OK)); /* reading left it as it is */
    TRY(store_begin_anew(folder));
    TRY(store_open(folder, NULL, &store));
    tool_add(store, 3, 1);
    TEST_ASSERT_EQUAL_INT(6, tool_number(folder, "SELECT seq FROM measurement"));
}

/* Twice within a second, twice kept. */
static void test_damaged_again(void)
{
    TRY(store_open(folder, NULL, &store));
    for (int i = 0; i < 3; i++) {
        close_store();
        cut_to(0);
        TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
        TRY(store_begin_anew(folder));
        TRY(store_open(folder, NULL, &store));
    }
    int kept = 0;
    for (const char *p = folder_list(folder, list); (p = strstr(p, "damaged-")) != NULL; p++)
        kept++;
    TEST_ASSERT_EQUAL_INT(3, kept);
}

/* A backup put back by hand is taken as it is, and its readers see it. */
static void test_backup_put_back(void)
{
    size_t size;
    make_three();
    unsigned char *backup = file_bytes(path, &size);
    spoil_magic();
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(file_write(path, backup, size));
    free(backup);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    TRY(store_begin_anew(folder));
    TRY(store_open(folder, NULL, &store));
    TEST_ASSERT_EQUAL_INT(300, tool_number(folder, "SELECT count(*) FROM measurement"));
}

/* Killed after the marker was written and before anything was moved. */
static void test_moving_is_finished_later(void)
{
    char marker[FOLDER_PATH_SIZE];
    static const char text[] = "station.db.damaged-20260101T000000Z\nsome more\n";
    make_three();
    folder_path(folder, "station.damaged", marker);
    TEST_ASSERT_TRUE(file_write(marker, text, sizeof text - 1));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("20260101T000000Z"));
    TRY(store_begin_anew(folder));
    TEST_ASSERT_EQUAL_STRING("lock station.db station.db.damaged-20260101T000000Z ",
                             folder_list(folder, list));
    TEST_ASSERT_EQUAL_INT(301, tool_number(folder, "SELECT first_seq FROM station"));
}

/* A marker that names nothing of ours only says: stop. */
static void test_strange_markers(void)
{
    static const char *const texts[] = { "", "\n", "/etc/passwd\n", "station.db.damaged-/x\n",
                                         "station.db\n" };
    char marker[FOLDER_PATH_SIZE];
    folder_path(folder, "station.damaged", marker);
    make_three();
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        TEST_ASSERT_TRUE(file_write(marker, texts[i], strlen(texts[i])));
        TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
        TRY(store_begin_anew(folder));
        TEST_ASSERT_EQUAL_STRING("lock station.db ", folder_list(folder, list));
    }
    TEST_ASSERT_TRUE(file_write(marker, "", 0));
    unlink(path);
    heard_start();
    TRY(store_begin_anew(folder));
    TEST_ASSERT_TRUE(heard_contains("numbers begin at 1"));
    TEST_ASSERT_EQUAL_INT(1, tool_number(folder, "SELECT first_seq FROM station"));
}

/* Without a descriptor left nobody knows whether there is a marker: that is no damage. */
static void test_marker_that_cannot_be_looked_at(void)
{
    struct store_claim *claim;
    struct store_reader *reader = NULL;
    struct rlimit before, none;
    make_three();
    TRY(store_claim(folder, &claim));
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &before));
    none = before;
    none.rlim_cur = 0;
    heard_start();
    setrlimit(RLIMIT_NOFILE, &none);
    enum status s = store_open_claimed(claim, NULL, &store);
    enum status anew = store_begin_anew_claimed(claim);
    enum status read = store_reader_open(folder, &reader);
    setrlimit(RLIMIT_NOFILE, &before);
    TEST_ASSERT_TRUE(heard_contains("station.damaged': Too many open files"));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, s);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, anew);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, read);
    TRY(store_open_claimed(claim, NULL, &store));
    close_store();
    store_claim_release(claim);
}

/* Closed when the file has lost its name: what the WAL has is not emptied into nowhere. */
static void test_closed_without_its_file(void)
{
    int64_t bytes = 0;
    TRY(store_open(folder, NULL, &store));
    tool_add(store, 1, 3);
    unlink(path);
    close_store();
    TRY(store_wal_bytes(folder, &bytes));
    TEST_ASSERT_TRUE(bytes > 0);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
}

/* Where even the marker cannot be written, the file stays where it is. */
static void test_damage_that_cannot_be_moved(void)
{
    char marker[FOLDER_PATH_SIZE];
    struct rlimit before, limit;
    make_three();
    spoil_magic();
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    limit = before;
    limit.rlim_cur = 0;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
    enum status s = store_open(folder, NULL, &store);
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, handler);
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, s);
    TEST_ASSERT_TRUE(heard_contains("cannot be moved aside: File too large"));
    TEST_ASSERT_EQUAL_STRING("lock station.db ", folder_list(folder, list));
    /* A folder in the place of the marker. */
    TEST_ASSERT_EQUAL_INT(0, mkdir(folder_path(folder, "station.damaged", marker), 0700));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_begin_anew(folder));
    TEST_ASSERT_TRUE(heard_contains("cannot remove"));
    rmdir(marker);
    /* One in the place of the file: no file at all, and left alone. */
    unlink(path);
    TEST_ASSERT_EQUAL_INT(0, mkdir(path, 0700));
    TEST_ASSERT_EQUAL_INT(STATUS_IO, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("Is a directory"));
    rmdir(path);
}

/* A station that does not say who it is. */
static void test_a_file_without_a_station(void)
{
    make_three();
    TEST_ASSERT_TRUE(tool_edit(folder, "DELETE FROM station"));
    TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("whose it is"));
    make_sqlite("DROP TABLE sync_peer; DROP TABLE client_uuid");
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("no such table"));
}

static void test_locked_by_another_program(void)
{
    sqlite3 *other;
    make_three();
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &other));
    TRY(sql_run(other, "PRAGMA locking_mode = EXCLUSIVE; BEGIN IMMEDIATE; DELETE FROM sync_peer"));
    TEST_ASSERT_EQUAL_INT(STATUS_DB, store_open(folder, NULL, &store));
    TEST_ASSERT_TRUE(heard_contains("locked"));
    sqlite3_close(other);
    TRY(store_open(folder, NULL, &store));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_made_and_found_again);
    RUN_TEST(test_left_over_from_making);
    RUN_TEST(test_one_writer);
    RUN_TEST(test_a_group_left_open_is_dropped);
    RUN_TEST(test_folders_that_will_not_do);
    RUN_TEST(test_read_only_folder);
    RUN_TEST(test_foreign_files_are_untouched);
    RUN_TEST(test_newer_in_the_wal);
    RUN_TEST(test_from_version_1);
    RUN_TEST(test_damage_is_moved_aside);
    RUN_TEST(test_the_wal_goes_along);
    RUN_TEST(test_damaged_again);
    RUN_TEST(test_backup_put_back);
    RUN_TEST(test_moving_is_finished_later);
    RUN_TEST(test_strange_markers);
    RUN_TEST(test_marker_that_cannot_be_looked_at);
    RUN_TEST(test_closed_without_its_file);
    RUN_TEST(test_damage_that_cannot_be_moved);
    RUN_TEST(test_a_file_without_a_station);
    RUN_TEST(test_locked_by_another_program);
    return UNITY_END();
}
