/* test_table_file.c - what was built is read back bit for bit; anything else is
 * refused, by name and with what to do. */
#include "db/table_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sqlite3.h>

#include "base/version.h"
#include "db/table_hash.h"
#include "db/table_schema.h"
#include "tests/support/dice.h"
#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "tests/support/table_files.h"
#include "unity.h"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "table-small.db", path);
}

void tearDown(void)
{
    heard_stop();
    folder_remove(folder);
}

/* Both readers refuse with that status, one message each, and touch nothing. */
static void assert_refused(const char *at, enum status status, const char *says, const char *what)
{
    struct table table, table_before;
    struct table_file_info info, info_before;
    memset(&table, 77, sizeof table);
    memset(&info, 77, sizeof info);
    memcpy(&table_before, &table, sizeof table);
    memcpy(&info_before, &info, sizeof info);
    heard_start();
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, table_file_read(at, &table), what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&table_before, &table, sizeof table, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), what);
    TEST_ASSERT_MESSAGE(heard_contains(at), heard_last());
    TEST_ASSERT_MESSAGE(heard_contains(says), heard_last());
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, table_file_info(at, &info), what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&info_before, &info, sizeof info, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(2, heard_count(), what);
}

/* ---- what was built is what is read ------------------------------------------------ */

static const struct model_case {
    const char *model, *file, *name;
    bool rtree;
    double step_nm;
    size_t bands;
} model_cases[] = {
    { "two-layer", "table-small.db", "small", false, 10.0, 31 },
    { "two-layer", "skin.db", "skin", true, 1.0, 301 },
    { "half-space", "table-x", "x", true, 5.0, 61 },
    { "paper", "paper", "paper", false, 0.0, 0 },
    { "paper", "table-paper.db.db", "paper.db", true, 0.0, 0 },
};

/* The same without spectra: 72 bytes a row, rows by eights, and what is left is the same. */
static void assert_colours_alone(const struct model_case *c, const struct table *expect,
                                 off_t file_size)
{
    struct table got;
    struct table_file_bytes bytes;
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        STATUS_OK, table_file_read_parts(path, TABLE_FILE_WITHOUT_SPECTRA, &got, &bytes), c->file);
    TEST_ASSERT_EQUAL_size_t_MESSAGE((size_t)file_size, bytes.file, c->file);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(72 * ((SMALL_TABLE_ROWS + 7) / 8 * 8), bytes.memory, c->file);
    TEST_ASSERT_NULL_MESSAGE(got.spectrum, c->file);
    TEST_ASSERT_NULL_MESSAGE(table_spectrum(&got, 0), c->file);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, got.stride, c->file);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(c->bands, got.recipe.bands, c->file);
    TEST_ASSERT_EQUAL_STRING(c->name, got.name);
    for (size_t row = 0; row < SMALL_TABLE_ROWS; row++) {
        struct table_row p, q;
        table_get(expect, row, &p);
        table_get(&got, row, &q);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&p, &q, sizeof p, c->file);
    }
    table_done(&got);
}

static void test_round_trip(void)
{
    for (size_t i = 0; i < sizeof model_cases / sizeof *model_cases; i++) {
        const struct model_case *c = &model_cases[i];
        struct recipe recipe = small_recipe(c->model);
        struct table expect, got;
        struct table_file_info info;
        struct stat st;
        recipe.step_nm = c->step_nm;
        recipe.bands = c->bands;
        recipe.gamma = 0.6;
        folder_path(folder, c->file, path);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, small_table(path, &recipe, c->rtree), c->file);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, table_file_read(path, &got), c->file);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_init(&recipe, SMALL_TABLE_ROWS, &expect));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_compute(&expect, 0, SMALL_TABLE_ROWS, 1));
        TEST_ASSERT_EQUAL_STRING(c->name, got.name);
        TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, got.n);
        for (size_t row = 0; row < SMALL_TABLE_ROWS; row++) {
            struct table_row p, q;
            table_get(&expect, row, &p);
            table_get(&got, row, &q);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&p, &q, sizeof p, c->file);
        }
        TEST_ASSERT_EQUAL_size_t(expect.stride, got.stride);
        if (c->bands > 0)
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expect.spectrum, got.spectrum,
                                             SMALL_TABLE_ROWS * got.stride * sizeof(float),
                                             c->file);

        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &info));
        TEST_ASSERT_EQUAL_PTR(recipe.model, info.recipe.model);
        TEST_ASSERT_EQUAL_DOUBLE(0.6, info.recipe.gamma);
        TEST_ASSERT_EQUAL_size_t(c->bands, info.recipe.bands);
        TEST_ASSERT_EQUAL_DOUBLE(0.3, info.recipe.grid.Cm.hi);
        TEST_ASSERT_EQUAL_size_t(SMALL_TABLE_ROWS, info.rows);
        TEST_ASSERT_EQUAL_INT(c->rtree, info.rtree);
        TEST_ASSERT_EQUAL_STRING(SKINSPEC_VERSION, info.code_version);
        TEST_ASSERT_EQUAL_STRING(got.sha256, info.content_sha256);
        TEST_ASSERT_EQUAL_size_t(64, strlen(info.pages_sha256));
        TEST_ASSERT_EQUAL_INT(0, stat(path, &st));
        TEST_ASSERT_EQUAL_INT64(st.st_size, info.bytes);
        assert_colours_alone(c, &expect, st.st_size);
        TEST_ASSERT_EQUAL_INT(0, heard_count());
        table_done(&expect);
        table_done(&got);
    }
}

/* Numbers that text would bend, and a zero with a sign, come back with their bits. */
static void test_round_trip_of_odd_numbers(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table got, again;
    recipe.grid.Cm = (struct axis){ -0.0, 1.0 / 3.0, 3, false };
    recipe.epidermis_mm = 0.1 + 0.2;
    recipe.eta = 1.4 + 2.2e-16;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_read(path, &got));
    TEST_ASSERT_EQUAL_MEMORY(&recipe.eta, &got.recipe.eta, sizeof recipe.eta);
    TEST_ASSERT_EQUAL_MEMORY(&recipe.epidermis_mm, &got.recipe.epidermis_mm,
                             sizeof recipe.epidermis_mm);
    TEST_ASSERT_EQUAL_DOUBLE(1.0 / 3.0, got.Cm[got.n - 1]);
    TEST_ASSERT_TRUE(table_rehash(path)); /* changes nothing: the hash was right */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_read(path, &again));
    TEST_ASSERT_EQUAL_STRING(got.sha256, again.sha256);
    table_done(&got);
    table_done(&again);
}

/* expect: without folder, "table-" and ".db". */
static const struct name_case {
    const char *path, *name;
} name_cases[] = {
    { "table-two-layer.db", "two-layer" },
    { "/var/lib/skinspec/tables/table-paper.db", "paper" },
    { "./x", "x" },
    { "x.db", "x" },
    { "table-x", "x" },
    { "table-.db", ".db" },
    { ".db", ".db" },
    { "a/table-b/c.db", "c" },
    { "TABLE-x.DB", "TABLE-x.DB" },
    { "", "" },
    { "folder/", "" },
};

static void test_names(void)
{
    char name[TABLE_NAME_SIZE], text[400];
    for (size_t i = 0; i < sizeof name_cases / sizeof *name_cases; i++) {
        table_file_name(name_cases[i].path, name);
        TEST_ASSERT_EQUAL_STRING(name_cases[i].name, name);
    }
    memset(text, 'x', sizeof text);
    text[sizeof text - 1] = '\0';
    table_file_name(text, name);
    TEST_ASSERT_EQUAL_size_t(TABLE_NAME_SIZE - 1, strlen(name));
}

/* ---- what is no table --------------------------------------------------------------- */

static void test_no_file(void)
{
    assert_refused(path, STATUS_NOT_FOUND, "No such file", "missing");
    assert_refused("/no/such/folder/table-x.db", STATUS_NOT_FOUND, "No such file", "no folder");
    assert_refused(folder, STATUS_IO, "is not a file", "a folder");
    TEST_ASSERT_EQUAL_INT(0, mkfifo(path, 0600));
    assert_refused(path, STATUS_IO, "is not a file", "a pipe nobody writes to");
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    TEST_ASSERT_TRUE(file_write(path, "x", 1));
    char below[FOLDER_PATH_SIZE];
    assert_refused(folder_path(path, "x", below), STATUS_IO, "Not a directory", "below a file");
}

static void test_foreign_files(void)
{
    static const char text[] = "id,400,410\n1,0.1,0.2\n, and so on, for more than a hundred bytes "
                               "that are not a database at all, whatever their name says\n";
    TEST_ASSERT_TRUE(file_write(path, "", 0));
    assert_refused(path, STATUS_FORMAT, "skinspec table build", "empty");
    TEST_ASSERT_TRUE(file_write(path, text, sizeof text));
    assert_refused(path, STATUS_FORMAT, "skinspec table build", "text");
    TEST_ASSERT_TRUE(file_write(path, "SQLite format 3", 16));
    assert_refused(path, STATUS_FORMAT, "skinspec table build", "a beginning");
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    sqlite3 *db;
    TEST_ASSERT_EQUAL_INT(SQLITE_OK, sqlite3_open(path, &db));
    TEST_ASSERT_EQUAL_INT(SQLITE_OK,
                          sqlite3_exec(db, "CREATE TABLE meta(key, value)", NULL, NULL, NULL));
    sqlite3_close(db);
    assert_refused(path, STATUS_FORMAT, "skinspec table build", "another database");
    /* Ours by its header, but of no content and with no hash. */
    char sql[64];
    snprintf(sql, sizeof sql, "PRAGMA application_id = %d", TABLE_APPLICATION_ID);
    TEST_ASSERT_TRUE(table_edit(path, sql));
    assert_refused(path, STATUS_VERSION, "has format 0", "no version");
    snprintf(sql, sizeof sql, "PRAGMA user_version = %d", TABLE_FORMAT);
    TEST_ASSERT_TRUE(table_edit(path, sql));
    assert_refused(path, STATUS_DAMAGED, "--force", "no hash");
}

/* expect: sqlite.org/fileformat.html: user_version at byte 60, application_id at
 * 68, both big-endian; ours are 2 and "SkTb". */
static const struct header_case {
    const char *what;
    size_t at;
    unsigned char bytes[4];
    enum status status;
    const char *says;
} header_cases[] = {
    { "no version", 60, { 0, 0, 0, 0 }, STATUS_VERSION, "has format 0" },
    { "the version before", 60, { 0, 0, 0, 1 }, STATUS_VERSION, "has format 1" },
    { "the version after", 60, { 0, 0, 0, 3 }, STATUS_VERSION, "has format 3" },
    { "a large version", 60, { 0xff, 0xff, 0xff, 0xff }, STATUS_VERSION, "has format 4294967295" },
    { "another program's", 68, { 'S', 'k', 'T', 'c' }, STATUS_FORMAT, "is not a skinspec table" },
    { "nobody's", 68, { 0, 0, 0, 0 }, STATUS_FORMAT, "is not a skinspec table" },
};

static void test_header(void)
{
    struct recipe recipe = small_recipe("paper");
    size_t size;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_NOT_NULL(bytes);
    TEST_ASSERT_EQUAL_MEMORY("\0\0\0\2", bytes + 60, 4);
    TEST_ASSERT_EQUAL_MEMORY("SkTb", bytes + 68, 4);
    for (size_t i = 0; i < sizeof header_cases / sizeof *header_cases; i++) {
        const struct header_case *c = &header_cases[i];
        unsigned char before[4];
        memcpy(before, bytes + c->at, 4);
        memcpy(bytes + c->at, c->bytes, 4);
        TEST_ASSERT_TRUE(file_write(path, bytes, size));
        assert_refused(path, c->status, c->says, c->what);
        TEST_ASSERT_TRUE(heard_contains("skinspec table build"));
        memcpy(bytes + c->at, before, 4);
    }
    free(bytes);
}

/* ---- damage ------------------------------------------------------------------------- */

/* Property: no single byte can change unnoticed; 300 places by chance, and every
 * byte of the header and of the hash's own neighbourhood. */
static void test_any_changed_byte_is_noticed(void)
{
    struct recipe recipe = small_recipe("two-layer");
    struct dice dice = { 13 };
    size_t size;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, true));
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_NOT_NULL(bytes);
    size_t digits = 0;
    while (digits + 12 < size && memcmp(bytes + digits, "pages_sha256", 12) != 0)
        digits++;
    TEST_ASSERT_TRUE(digits + 76 < size);
    for (size_t i = 0; i < 500; i++) {
        size_t at = i < 100 ? i : i < 200 ? digits - 12 + (i - 100) : dice_below(&dice, size);
        unsigned char change = (unsigned char)(1 + dice_below(&dice, 255));
        struct table table;
        char what[64];
        bytes[at] ^= change;
        TEST_ASSERT_TRUE(file_write(path, bytes, size));
        bytes[at] ^= change;
        snprintf(what, sizeof what, "byte %zu changed by %u", at, (unsigned)change);
        enum status got = table_file_read(path, &table);
        enum status expect = at < 16 || (at >= 68 && at < 72) ? STATUS_FORMAT
                             : at >= 60 && at < 64            ? STATUS_VERSION
                                                              : STATUS_DAMAGED;
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect, got, what);
        TEST_ASSERT_MESSAGE(heard_contains("skinspec table build"), heard_last());
    }
    TEST_ASSERT_TRUE(file_write(path, bytes, size));
    struct table_file_info info;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &info));
    free(bytes);
}

/* Cut anywhere, or with something after its end. */
static void test_another_length_is_noticed(void)
{
    struct recipe recipe = small_recipe("two-layer");
    size_t size;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_NOT_NULL(bytes);
    for (size_t length = 0; length < size; length += length < 128 ? 1 : 509) {
        TEST_ASSERT_TRUE(file_write(path, bytes, length));
        assert_refused(path, length < 100 ? STATUS_FORMAT : STATUS_DAMAGED, "skinspec table build",
                       "cut");
    }
    TEST_ASSERT_TRUE(file_write(path, bytes, size - 1));
    assert_refused(path, STATUS_DAMAGED, "--force", "one byte short");
    TEST_ASSERT_TRUE(file_write(path, bytes, size + 1)); /* the buffer has one more */
    assert_refused(path, STATUS_DAMAGED, "--force", "one byte more");
    free(bytes);
}

/* ---- altered, with a pages hash that is right again -------------------------------- */

static void assert_edit_refused(const char *model, const char *sql, enum status status,
                                const char *says)
{
    struct recipe recipe = small_recipe(model);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_TRUE_MESSAGE(table_edit(path, sql), sql);
    TEST_ASSERT_TRUE_MESSAGE(table_reseal(path), sql);
    struct table table = { .n = 77 };
    heard_start();
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, table_file_read(path, &table), sql);
    TEST_ASSERT_EQUAL_size_t(77, table.n);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, heard_count(), sql);
    TEST_ASSERT_MESSAGE(heard_contains(says), heard_last());
    TEST_ASSERT_MESSAGE(heard_contains("build it anew"), heard_last());
}

/* Every meta row but the pages hash has to be there. */
static void test_meta_rows_that_are_missing(void)
{
    struct recipe recipe = small_recipe("two-layer");
    struct table_meta meta;
    table_meta_of(&recipe, &meta);
    for (size_t i = 0; i <= TABLE_META_COUNT; i++) {
        const char *key = i < TABLE_META_COUNT ? meta.key[i] : TABLE_CONTENT_KEY;
        char sql[128], says[64];
        snprintf(sql, sizeof sql, "DELETE FROM meta WHERE key = '%s'", key);
        snprintf(says, sizeof says, "(%s)", key);
        assert_edit_refused("two-layer", sql, STATUS_FORMAT, says);
    }
}

/* expect: nonsense is refused, and so is other text for the same thing: the content
 * hash is over the text. */
static const struct meta_case {
    const char *key, *value, *names;
} meta_cases[] = {
    { "model", "ray-tracing", "(model)" },
    { "model", "paper", "(meta)" }, /* has no bands */
    { "cm", "0:0.3", "(cm)" },
    { "cm", "0:0.9:4", "(meta)" }, /* beyond the paper's ranges */
    { "cm", "0:0.30:4", "(cm)" },
    { "cm", "-0:0.3:4", "(cm)" },
    { "bm", "many", "(bm)" },
    { "ch", "log:0:0.1:4", "(ch)" },
    { "epidermis_mm", "-1", "(meta)" },
    { "epidermis_mm", "0.080", "(epidermis_mm)" },
    { "eta", "9", "(meta)" },
    { "eta", "", "(eta)" },
    { "gamma", "75 %", "(gamma)" },
    { "bands_nm", "400:700:7", "(bands_nm)" },
    { "bands_nm", "none", "(meta)" },
    { "bands_nm", "410:700:10", "(meta)" }, /* too short for a colour */
    { "illuminant", "sunny", "(illuminant)" },
    { "illuminant", "d65", "(illuminant)" },
    { "observer_deg", "010", "(observer_deg)" },
    { "rgb_reading", "LINEAR", "(rgb_reading)" },
    { "rgb_reading", "", "(rgb_reading)" },
    { "rows", "63", "(rows)" },
    { "rows", "064", "(rows)" },
    { "rows", "a few", "(rows)" },
    { "content_sha256", "", "(content_sha256)" },
    { "content_sha256", "0123", "(content_sha256)" },
    { "content_sha256", "G123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef",
      "(content_sha256)" },
    { "content_sha256", "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef0",
      "(content_sha256)" },
};

static void test_meta_rows_that_are_nonsense(void)
{
    for (size_t i = 0; i < sizeof meta_cases / sizeof *meta_cases; i++) {
        const struct meta_case *c = &meta_cases[i];
        char sql[256];
        snprintf(sql, sizeof sql, "UPDATE meta SET value = '%s' WHERE key = '%s'", c->value,
                 c->key);
        assert_edit_refused("two-layer", sql, STATUS_FORMAT, c->names);
    }
}

/* expect: rows as the schema and the meta rows promise them, or the number of the
 * first that is not. */
static const struct entry_case {
    const char *model, *sql, *says;
} entry_cases[] = {
    { "two-layer",
      "DROP TABLE meta; CREATE TABLE other(pages_sha256);"
      "INSERT INTO other VALUES ('" TABLE_PAGES_KEY TABLE_PAGES_UNSET "')",
      "(meta)" },
    { "two-layer", "DROP TABLE entry", "row 1 " },
    { "two-layer", "ALTER TABLE entry DROP COLUMN b_", "row 1 " },
    { "two-layer", "INSERT INTO meta VALUES ('comment', 'made by hand')", "one too many" },
    { "two-layer", "DELETE FROM entry", "row 1 " },
    { "two-layer", "DELETE FROM entry WHERE id = 7", "row 7 " },
    { "two-layer", "DELETE FROM entry WHERE id = 64", "row 64 " },
    { "two-layer",
      "INSERT INTO entry SELECT 65, cm, bm, ch, l, a, b, r, g, b_, spectrum"
      " FROM entry WHERE id = 64",
      "row 65 " },
    { "two-layer", "UPDATE entry SET id = 0 WHERE id = 1", "row 1 " },
    { "two-layer", "UPDATE entry SET id = 9000 WHERE id = 40", "row 40 " },
    { "two-layer", "UPDATE entry SET cm = 'much' WHERE id = 3", "row 3 " },
    { "two-layer", "UPDATE entry SET b_ = x'00' WHERE id = 64", "row 64 " },
    { "two-layer", "UPDATE entry SET spectrum = NULL WHERE id = 5", "row 5 " },
    { "two-layer", "UPDATE entry SET spectrum = zeroblob(120) WHERE id = 5", "row 5 " },
    { "two-layer", "UPDATE entry SET spectrum = zeroblob(128) WHERE id = 5", "row 5 " },
    { "two-layer", "UPDATE entry SET spectrum = printf('%124s', '') WHERE id = 5", "row 5 " },
    { "two-layer", "UPDATE entry SET spectrum = 0.5 WHERE id = 5", "row 5 " },
    { "paper", "UPDATE entry SET spectrum = x'' WHERE id = 5", "row 5 " },
    { "paper", "UPDATE entry SET spectrum = zeroblob(124) WHERE id = 5", "row 5 " },
    { "paper",
      "UPDATE meta SET value = '0:0.3:5' WHERE key = 'cm';"
      "UPDATE meta SET value = '84' WHERE key = 'rows'",
      "row 65 " },
    { "paper",
      "UPDATE meta SET value = '0:0.3:3' WHERE key = 'cm';"
      "UPDATE meta SET value = '44' WHERE key = 'rows'",
      "row 45 " },
};

static void test_rows_that_are_not_as_promised(void)
{
    for (size_t i = 0; i < sizeof entry_cases / sizeof *entry_cases; i++) {
        const struct entry_case *c = &entry_cases[i];
        assert_edit_refused(c->model, c->sql, STATUS_FORMAT, c->says);
    }
}

/* A page that SQLite finds wrong although all hashes are right. */
static void test_broken_page_below_a_right_hash(void)
{
    enum { PAGE = 16384 };
    struct recipe recipe = small_recipe("two-layer");
    size_t size;
    recipe.step_nm = 5.0;
    recipe.bands = 61; /* rows on two pages, and one above them */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    unsigned char *bytes = file_bytes(path, &size);
    TEST_ASSERT_NOT_NULL(bytes);
    int refused = 0;
    for (size_t page = 1; page < size / PAGE; page++) {
        struct table table;
        unsigned char kind = bytes[PAGE * page];
        bytes[PAGE * page] = 0x77; /* no kind of page */
        TEST_ASSERT_TRUE(file_write(path, bytes, size));
        bytes[PAGE * page] = kind;
        TEST_ASSERT_TRUE(table_reseal(path));
        heard_start();
        enum status s = table_file_read(path, &table);
        TEST_ASSERT_EQUAL_INT(STATUS_DAMAGED, s);
        TEST_ASSERT_EQUAL_INT(1, heard_count());
        refused++;
    }
    free(bytes);
    TEST_ASSERT_TRUE(refused >= 3);
}

#ifdef __SANITIZE_ADDRESS__
enum { CAN_LIMIT_MEMORY = 0 };
#else
enum { CAN_LIMIT_MEMORY = 1 };
#endif

/* A file that promises 1e8 rows, for which there is no memory. */
static void test_more_rows_than_memory(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table table = { .n = 77 };
    struct rlimit before, limit;
    if (!CAN_LIMIT_MEMORY)
        TEST_IGNORE_MESSAGE("AddressSanitizer does not live with a limit on memory");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_TRUE(table_edit(path, "UPDATE meta SET value = '0.1:0.5:100' WHERE key = 'cm';"
                                      "UPDATE meta SET value = '0:1:1000' WHERE key = 'bm';"
                                      "UPDATE meta SET value = '0.001:0.1:1000' WHERE key = 'ch';"
                                      "UPDATE meta SET value = '100000000' WHERE key = 'rows'"));
    TEST_ASSERT_TRUE(table_reseal(path));
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_AS, &before));
    limit = before;
    limit.rlim_cur = (rlim_t)2 << 30;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_AS, &limit));
    enum status s = table_file_read(path, &table);
    setrlimit(RLIMIT_AS, &before);
    TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
    TEST_ASSERT_EQUAL_size_t(77, table.n);
    TEST_ASSERT_TRUE(heard_contains("100000000 rows: not enough memory"));
}

/* A file that is larger than what may be mapped: 8 GiB, all of them a hole. */
static void test_file_that_cannot_be_mapped(void)
{
    struct recipe recipe = small_recipe("paper");
    struct table table = { .n = 77 };
    struct rlimit before, limit;
    if (!CAN_LIMIT_MEMORY)
        TEST_IGNORE_MESSAGE("AddressSanitizer does not live with a limit on memory");
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    if (truncate(path, (off_t)8 << 30) != 0)
        TEST_IGNORE_MESSAGE("no files of 8 GiB here");
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_AS, &before));
    limit = before;
    limit.rlim_cur = (rlim_t)2 << 30;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_AS, &limit));
    enum status s = table_file_read(path, &table);
    setrlimit(RLIMIT_AS, &before);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, s);
    TEST_ASSERT_EQUAL_size_t(77, table.n);
    TEST_ASSERT_EQUAL_INT(1, heard_count());
    TEST_ASSERT_MESSAGE(heard_contains("Cannot allocate memory"), heard_last());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_round_trip);
    RUN_TEST(test_round_trip_of_odd_numbers);
    RUN_TEST(test_names);
    RUN_TEST(test_no_file);
    RUN_TEST(test_foreign_files);
    RUN_TEST(test_header);
    RUN_TEST(test_any_changed_byte_is_noticed);
    RUN_TEST(test_another_length_is_noticed);
    RUN_TEST(test_meta_rows_that_are_missing);
    RUN_TEST(test_meta_rows_that_are_nonsense);
    RUN_TEST(test_rows_that_are_not_as_promised);
    RUN_TEST(test_broken_page_below_a_right_hash);
    RUN_TEST(test_more_rows_than_memory);
    RUN_TEST(test_file_that_cannot_be_mapped);
    return UNITY_END();
}
