/* test_export_pages.c - pages joined are the file, whatever their size; and failures. */
#include "station/export.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "tests/station/export_tools.h"
#include "unity.h"

static struct dice dice;

void setUp(void)
{
    export_set_up();
    dice = (struct dice){ 7 };
}

void tearDown(void)
{
    export_tear_down();
}

/* ---- pages -------------------------------------------------------------------------- */

/* Records of all sizes, some that CGATS leaves out. */
static void add_some(int n)
{
    for (int i = 0; i < n; i++) {
        full_record();
        records_uuid(&dice, record.uuid);
        set_bands(400, dice_below(&dice, 4) == 0 ? 20 : 10, 31, dice_between(&dice, 0, 1));
        memset(record.site, 'x', dice_below(&dice, 200));
        add();
    }
}

struct joined {
    char *text;
    size_t n;
    int pages;
};

/* Ask for page after page; `meanwhile` is done between them. */
static struct joined join(struct export_request request, void (*meanwhile)(void))
{
    struct joined j = { NULL, 0, 0 };
    struct export_page page = { .more = true };
    request.first = true;
    while (page.more) {
        TRY(export_page(reader, &request, &page));
        TEST_ASSERT_TRUE(page.next_seq > request.since_seq);
        int64_t records = page.next_seq - request.since_seq;
        TEST_ASSERT_TRUE(records <= (int64_t)request.limit);
        if (page.n > request.bytes && records > 1)
            TEST_FAIL_MESSAGE("a page is too long");
        j.text = realloc(j.text, j.n + page.n + 1);
        TEST_ASSERT_NOT_NULL(j.text);
        memcpy(j.text + j.n, page.text, page.n + 1);
        j.n += page.n;
        j.pages++;
        request.first = false;
        request.since_seq = page.next_seq;
        request.until_seq = page.until_seq;
        free(page.text);
        if (meanwhile != NULL)
            meanwhile();
    }
    return j;
}

static const enum export_format all_formats[] = { EXPORT_CSV, EXPORT_JSON, EXPORT_CGATS };

static void test_pages_join(void)
{
    static const size_t bytes[] = { 1, 700, 1500, 4000, 20000, 1 << 20 };
    static const size_t limits[] = { 1, 2, 7, 40, 1000 };
    add_some(40);
    for (size_t f = 0; f < 3; f++) {
        char *expect = whole(all_formats[f]);
        for (size_t i = 0; i < 6; i++) {
            for (size_t k = 0; k < 5; k++) {
                struct export_request request = { .format = all_formats[f],
                                                  .limit = limits[k],
                                                  .bytes = bytes[i] };
                struct joined j = join(request, NULL);
                TEST_ASSERT_EQUAL_STRING(expect, j.text);
                if (bytes[i] == 1)
                    TEST_ASSERT_GREATER_THAN(f == 2 ? 20 : 39, j.pages);
                if (bytes[i] == 1 << 20)
                    TEST_ASSERT_EQUAL_INT((40 + limits[k] - 1) / limits[k], j.pages);
                free(j.text);
            }
        }
        free(expect);
    }
}

/* The tail counts: a page of just the size takes all, one of a byte less does not. */
static void test_page_that_is_just_full(void)
{
    add_some(10);
    for (size_t f = 0; f < 3; f++) {
        char *expect = whole(all_formats[f]);
        for (size_t less = 0; less < 2; less++) {
            struct export_request request = { .format = all_formats[f],
                                              .limit = 100,
                                              .bytes = strlen(expect) - less };
            struct joined j = join(request, NULL);
            TEST_ASSERT_EQUAL_STRING(expect, j.text);
            TEST_ASSERT_EQUAL_INT(1 + (int)less, j.pages);
            free(j.text);
        }
        free(expect);
    }
}

static void add_one_more(void)
{
    add_some(1);
}

/* The newest at the first page holds for all: a count in the head stays right. */
static void test_records_between_pages(void)
{
    add_some(10);
    for (size_t f = 0; f < 3; f++) {
        char *expect = whole(all_formats[f]);
        struct export_request request = { .format = all_formats[f], .limit = 3, .bytes = 1 << 20 };
        struct joined j = join(request, add_one_more);
        TEST_ASSERT_EQUAL_STRING(expect, j.text);
        TEST_ASSERT_GREATER_THAN(3, j.pages);
        free(j.text);
        free(expect);
    }
}

/* Without `bytes`, 512 KiB: 150 records of 4 KiB and more need two pages. */
static void test_default_size(void)
{
    struct export_page page;
    struct export_request request = { .format = EXPORT_JSON, .first = true, .limit = 100000 };
    tool_add(store, 3, 150);
    TRY(export_page(reader, &request, &page));
    TEST_ASSERT_TRUE(page.more);
    TEST_ASSERT_TRUE(page.n <= 512 * 1024 && page.n > 480 * 1024);
    TEST_ASSERT_EQUAL_INT64(150, page.until_seq);
    free(page.text);
    request.bytes = EXPORT_PAGE_BYTES;
    struct joined j = join(request, NULL);
    cJSON *array = cJSON_Parse(j.text);
    TEST_ASSERT_EQUAL_INT(150, cJSON_GetArraySize(array));
    cJSON_Delete(array);
    free(j.text);
}

/* since_seq, until_seq -> records by seq, next_seq, more; limit 2, five records. */
static void test_ranges(void)
{
    static const struct {
        int64_t since, until;
        const char *seqs;
        int64_t next, until_ret;
        bool more;
    } cases[] = {
        { 0, 0, "1 2 ", 2, 5, true },  { 3, 0, "4 5 ", 5, 5, false }, { 0, 2, "1 2 ", 2, 2, false },
        { 2, 3, "3 ", 3, 3, false },   { 5, 0, "", 5, 5, false },     { 9, 0, "", 9, 5, false },
        { 4, 99, "5 ", 5, 99, false },
    };
    add_some(5);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct export_request request = { EXPORT_CSV, false, cases[i].since, cases[i].until, 2, 0 };
        struct export_page page;
        char seqs[64] = "";
        TRY(export_page(reader, &request, &page));
        for (const char *row = page.text; *row != '\0'; row = strchr(row, '\n') + 1)
            snprintf(seqs + strlen(seqs), 8, "%ld ", strtol(strchr(row, ',') + 1, NULL, 10));
        TEST_ASSERT_EQUAL_STRING(cases[i].seqs, seqs);
        TEST_ASSERT_EQUAL_INT64(cases[i].next, page.next_seq);
        TEST_ASSERT_EQUAL_INT64(cases[i].until_ret, page.until_seq);
        TEST_ASSERT_EQUAL(cases[i].more, page.more);
        free(page.text);
    }
}

/* ---- failures ----------------------------------------------------------------------- */

static void check_fails(enum export_format format, enum status expect)
{
    const struct export_request all = { format, true, 0, 0, 1000, 0 };
    struct export_page page = { NULL, 77, 0, 0, false };
    TEST_ASSERT_EQUAL_INT(expect, export_page(reader, &all, &page));
    TEST_ASSERT_EQUAL_size_t(77, page.n);
}

static void test_record_that_is_no_json(void)
{
    strcpy(record.flags, "spread");
    add();
    check_fails(EXPORT_JSON, STATUS_RANGE);
}

static void test_damaged_store(void)
{
    add();
    TEST_ASSERT_TRUE(tool_without_triggers(folder));
    TEST_ASSERT_TRUE(tool_edit(folder, "UPDATE measurement SET bands = 0"));
    for (size_t f = 0; f < 3; f++)
        check_fails(all_formats[f], STATUS_DAMAGED);
    TEST_ASSERT_TRUE(tool_edit(folder, "DROP TABLE measurement"));
    heard_start();
    check_fails(EXPORT_CSV, STATUS_DB);
    TEST_ASSERT_EQUAL_INT(1, heard_count());
}

/* Every number of cJSON's allocations up to the one that is enough. */
static void test_without_memory(void)
{
    add();
    for (size_t f = 0; f < 2; f++) { /* cgats has no JSON in it */
        const struct export_request all = { all_formats[f], true, 0, 0, 1000, 0 };
        struct export_page page = { NULL, 77, 0, 0, false };
        enum status s = STATUS_NO_MEMORY;
        long n = 0;
        for (; s != STATUS_OK && n < 1000; n++) {
            allocations_left = n;
            s = export_page(reader, &all, &page);
            allocations_left = -1;
            if (s != STATUS_OK) {
                TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, s);
                TEST_ASSERT_EQUAL_size_t(77, page.n);
            }
        }
        TEST_ASSERT_EQUAL_INT(STATUS_OK, s);
        TEST_ASSERT_GREATER_THAN(10, n);
        free(page.text);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_pages_join);
    RUN_TEST(test_page_that_is_just_full);
    RUN_TEST(test_records_between_pages);
    RUN_TEST(test_default_size);
    RUN_TEST(test_ranges);
    RUN_TEST(test_record_that_is_no_json);
    RUN_TEST(test_damaged_store);
    RUN_TEST(test_without_memory);
    return UNITY_END();
}
