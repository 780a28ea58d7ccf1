/* test_table_hash.c - both hashes against another program's, and the search for the
 * place of the second. */
#include "db/table_hash.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "db/table_file.h"
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

/* expect: IEEE 754 single precision by hand, least byte first. */
static const struct blob_case {
    float value;
    unsigned char bytes[4];
} blob_cases[] = {
    { 0.0f, { 0x00, 0x00, 0x00, 0x00 } },           { 1.0f, { 0x00, 0x00, 0x80, 0x3f } },
    { 0.5f, { 0x00, 0x00, 0x00, 0x3f } },           { -2.0f, { 0x00, 0x00, 0x00, 0xc0 } },
    { 0x1.234568p-3f, { 0xb4, 0xa2, 0x11, 0x3e } }, { 0x1p-149f, { 0x01, 0x00, 0x00, 0x00 } },
};
enum { BLOB_CASES = sizeof blob_cases / sizeof *blob_cases };

static void test_blob(void)
{
    float value[BLOB_CASES], back[BLOB_CASES];
    unsigned char blob[4 * BLOB_CASES];
    for (size_t i = 0; i < BLOB_CASES; i++)
        value[i] = blob_cases[i].value;
    table_spectrum_to_blob(value, BLOB_CASES, blob);
    for (size_t i = 0; i < BLOB_CASES; i++)
        TEST_ASSERT_EQUAL_MEMORY(blob_cases[i].bytes, blob + 4 * i, 4);
    table_spectrum_from_blob(blob, BLOB_CASES, back);
    TEST_ASSERT_EQUAL_MEMORY(value, back, sizeof value);
}

/* expect: tests/reference/table_dump.py, which shares nothing with this program. */
static const struct dump_case {
    const char *model;
    bool rtree;
    double step_nm;
    size_t bands;
} dump_cases[] = {
    { "two-layer", false, 10.0, 31 },
    { "half-space", true, 5.0, 61 },
    { "paper", true, 0.0, 0 },
};

static void test_both_hashes_by_another_program(void)
{
    for (size_t i = 0; i < sizeof dump_cases / sizeof *dump_cases; i++) {
        const struct dump_case *c = &dump_cases[i];
        struct recipe recipe = small_recipe(c->model);
        struct table_file_info info;
        char command[FOLDER_PATH_SIZE + 64], said[1024], content[65], pages[65], written[2][65];
        recipe.step_nm = c->step_nm;
        recipe.bands = c->bands;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, c->rtree));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &info));
        snprintf(command, sizeof command, "python3 tests/reference/table_dump.py '%s'", path);
        FILE *f = popen(command, "r");
        TEST_ASSERT_NOT_NULL(f);
        said[fread(said, 1, sizeof said - 1, f)] = '\0';
        int ended = pclose(f);
        if (WIFEXITED(ended) && WEXITSTATUS(ended) == 3)
            TEST_IGNORE_MESSAGE("python3 has no sqlite3 module");
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, ended, c->model);
        int read = sscanf(said, "content %64s pages %64s written %64s %64s", content, pages,
                          written[0], written[1]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(4, read, c->model);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(content, info.content_sha256, c->model);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(pages, info.pages_sha256, c->model);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(written[0], info.content_sha256, c->model);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(written[1], info.pages_sha256, c->model);
    }
}

/* Property: what a table says does not depend on how its file is laid out. */
static void test_content_hash_is_of_the_content(void)
{
    struct recipe recipe = small_recipe("two-layer");
    struct table_file_info plain, indexed, packed;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &plain));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, true));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &indexed));
    TEST_ASSERT_TRUE(table_edit(path, "PRAGMA page_size = 8192; VACUUM"));
    TEST_ASSERT_TRUE(table_reseal(path));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_file_info(path, &packed));
    TEST_ASSERT_EQUAL_STRING(plain.content_sha256, indexed.content_sha256);
    TEST_ASSERT_EQUAL_STRING(plain.content_sha256, packed.content_sha256);
    TEST_ASSERT_TRUE(strcmp(plain.pages_sha256, indexed.pages_sha256) != 0);
    TEST_ASSERT_TRUE(strcmp(packed.pages_sha256, indexed.pages_sha256) != 0);
}

#define KEY "pages_sha256"
#define DIGITS_63 "000000000000000000000000000000000000000000000000000000000000000"
#define DIGITS "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

/* expect: tests/reference/table_dump.py --pages; NULL where there is no place for the digits. */
static const struct place_case {
    const char *what, *text, *sha256;
} place_cases[] = {
    { "in the middle", "x " KEY DIGITS_63 "0y",
      "cd08a63b30d4229e433df4f30821913a3fe9ae8a796822396b8facb226e8840d" },
    { "nothing else", KEY DIGITS_63 "0",
      "b2ff2402d4a9b1a1c188bff85e690719f52469cd8cd9ed8f246b6b4bf00138b5" },
    { "the same whatever the digits", KEY DIGITS,
      "b2ff2402d4a9b1a1c188bff85e690719f52469cd8cd9ed8f246b6b4bf00138b5" },
    { "the key alone comes first", "CREATE " KEY " and then " KEY DIGITS_63 "0!",
      "7060b69b70061fdb3cf172ae0597362b92df79f32fe503a93455bf331b06f3ce" },
    { "once with a digit too few", KEY DIGITS_63 KEY DIGITS_63 "0",
      "98c95422a15b1190da7efaf0e44bac04666fc7c33e52c3c1464de01168fb7960" },
    { "nothing", "", NULL },
    { "no key", "SQLite format 3", NULL },
    { "no digits", KEY, NULL },
    { "a digit too few at the end", KEY DIGITS_63, NULL },
    { "a digit too few", KEY DIGITS_63 "g and more", NULL },
    { "capitals", KEY DIGITS_63 "A and more", NULL },
};

static void test_place_of_the_pages_hash(void)
{
    for (size_t i = 0; i < sizeof place_cases / sizeof *place_cases; i++) {
        const struct place_case *c = &place_cases[i];
        char computed[TABLE_SHA256_SIZE], written[TABLE_SHA256_SIZE];
        TEST_ASSERT_TRUE(file_write(path, c->text, strlen(c->text)));
        int fd = open(path, O_RDWR);
        TEST_ASSERT_TRUE(fd >= 0);
        enum status expect = c->sha256 != NULL ? STATUS_OK : STATUS_FORMAT;
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect, table_pages_hash(fd, 2, computed, written), c->what);
        if (c->sha256 != NULL) {
            TEST_ASSERT_EQUAL_STRING_MESSAGE(c->sha256, computed, c->what);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(c->text, written), c->what);
        }
        TEST_ASSERT_EQUAL_INT_MESSAGE(expect, table_pages_seal(fd, 2), c->what);
        if (c->sha256 != NULL) {
            TEST_ASSERT_EQUAL_INT(STATUS_OK, table_pages_hash(fd, 2, computed, written));
            TEST_ASSERT_EQUAL_STRING_MESSAGE(c->sha256, computed, c->what);
            TEST_ASSERT_EQUAL_STRING_MESSAGE(c->sha256, written, c->what);
        }
        close(fd);
    }
}

/* Pieces of 1 MiB, the digits across two of them, by as many threads; expect: as above. */
static const struct piece_case {
    size_t size, key_at;
    const char *sha256;
} piece_cases[] = {
    { (1 << 20), 0, "eaec55e4ffd0e8f7c80184986d5a5c4b37ab1dec8893978f559498425072da27" },
    { (2 << 20) + 5, (1 << 20) - 32,
      "6417bb6ae306c45817654d694007524e003c0b63633c45eeadbf133e4773623b" },
};

static void test_pieces_of_a_large_file(void)
{
    for (size_t i = 0; i < sizeof piece_cases / sizeof *piece_cases; i++) {
        const struct piece_case *c = &piece_cases[i];
        unsigned char *bytes = malloc(c->size);
        char computed[TABLE_SHA256_SIZE], written[TABLE_SHA256_SIZE];
        TEST_ASSERT_NOT_NULL(bytes);
        for (size_t k = 0; k < c->size; k++)
            bytes[k] = (unsigned char)(k * 7 + (k >> 10));
        memcpy(bytes + c->key_at, KEY DIGITS, strlen(KEY DIGITS));
        TEST_ASSERT_TRUE(file_write(path, bytes, c->size));
        int fd = open(path, O_RDONLY);
        TEST_ASSERT_TRUE(fd >= 0);
        for (unsigned threads = 1; threads <= 3; threads++) {
            TEST_ASSERT_EQUAL_INT(STATUS_OK, table_pages_hash(fd, threads, computed, written));
            TEST_ASSERT_EQUAL_STRING(c->sha256, computed);
            TEST_ASSERT_EQUAL_STRING(DIGITS, written);
        }
        close(fd);
        free(bytes);
    }
}

/* What the system refuses: no file, no file to map, no writing. */
static void test_files_that_cannot_be_hashed(void)
{
    char computed[TABLE_SHA256_SIZE], written[TABLE_SHA256_SIZE];
    TEST_ASSERT_EQUAL_INT(STATUS_IO, table_pages_hash(-1, 1, computed, written));
    int fd = open(folder, O_RDONLY | O_DIRECTORY);
    TEST_ASSERT_TRUE(fd >= 0);
    enum status s = table_pages_hash(fd, 2, computed, written);
    TEST_ASSERT_TRUE(s == STATUS_IO || s == STATUS_FORMAT); /* some folders have size 0 */
    close(fd);
    TEST_ASSERT_TRUE(file_write(path, KEY DIGITS, strlen(KEY DIGITS)));
    fd = open(path, O_RDONLY);
    TEST_ASSERT_TRUE(fd >= 0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, table_pages_hash(fd, 2, computed, written));
    TEST_ASSERT_EQUAL_STRING(DIGITS, written);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, table_pages_seal(fd, 2));
    close(fd);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_blob);
    RUN_TEST(test_both_hashes_by_another_program);
    RUN_TEST(test_content_hash_is_of_the_content);
    RUN_TEST(test_place_of_the_pages_hash);
    RUN_TEST(test_pieces_of_a_large_file);
    RUN_TEST(test_files_that_cannot_be_hashed);
    return UNITY_END();
}
