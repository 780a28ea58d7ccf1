/* test_line.c - lines out of pieces: every cut, what is no line, and what is left over. */
#include "drivers/link/line.h"

#include "tests/link/script.h"
#include "unity.h"

static struct call call;
static struct line_reader reader;
static struct driver_error error;
static char line[LINE_MAX_BYTES];

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
}

void tearDown(void)
{
    call_done(&call);
}

static void start(const struct piece *pieces, size_t n, const char *end)
{
    line_reader_init(&reader, script_start(&call, pieces, n), end);
    line[0] = '\0';
}

static enum driver_result next(void)
{
    return line_read(&reader, line, call_now_ms() + 2, &error);
}

static void test_cut_at_every_offset(void)
{
    static const char text[] = "OK00,12\r\n\r\nER07\r\n";
    static const char *const expected[] = { "OK00,12", "", "ER07" };
    size_t n = strlen(text);
    for (size_t cut = 0; cut <= n; cut++)
        for (size_t again = cut; again <= n; again++) {
            struct piece pieces[3],
                all[] = { { text, cut }, { text + cut, again - cut }, { text + again, n - again } };
            size_t used = 0;
            for (size_t i = 0; i < 3; i++)
                if (all[i].n > 0)
                    pieces[used++] = all[i];
            start(pieces, used, "\r\n");
            for (size_t i = 0; i < 3; i++) {
                TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
                TEST_ASSERT_EQUAL_STRING(expected[i], line);
            }
            TEST_ASSERT_FALSE(line_is_kept(&reader));
            TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, next());
        }
}

static void test_beginning_is_kept_over_silence(void)
{
    static const struct piece pieces[] = { { "OK0", 3 }, { NULL, 0 }, { "0\r\nbut", 6 } };
    start(pieces, 3, "\r\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, next());
    TEST_ASSERT_EQUAL_STRING("", line);
    TEST_ASSERT_TRUE(line_is_kept(&reader));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
    TEST_ASSERT_EQUAL_STRING("OK00", line);
    TEST_ASSERT_TRUE(line_is_kept(&reader));
}

static void test_ends_of_one_and_of_three_bytes(void)
{
    static const struct piece one[] = { { "a\rb", 3 }, { "\r", 1 } };
    static const struct piece three[] = { { "a<", 2 }, { "0", 1 }, { ">b<0>", 5 } };
    static const char *const ends[] = { "\r", "<0>" };
    for (int i = 0; i < 2; i++) {
        start(i == 0 ? one : three, i == 0 ? 2 : 3, ends[i]);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
        TEST_ASSERT_EQUAL_STRING("a", line);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
        TEST_ASSERT_EQUAL_STRING("b", line);
    }
}

/* n times 'x', an end and "OK\r\n", in pieces of `each`. */
static size_t long_line(char *text, size_t n, struct piece *pieces, size_t each)
{
    size_t used = 0, all = n + strlen("\r\nOK\r\n");
    memset(text, 'x', n);
    memcpy(text + n, "\r\nOK\r\n", 6);
    for (size_t at = 0; at < all; at += each)
        pieces[used++] = (struct piece){ text + at, all - at < each ? all - at : each };
    return used;
}

static void test_longest_and_over_long(void)
{
    static char text[5000];
    static struct piece pieces[5000];
    static const struct {
        size_t n;
        enum driver_result result;
    } cases[] = {
        { LINE_MAX_BYTES - 2, DRIVER_OK },       { LINE_MAX_BYTES - 1, DRIVER_PROTOCOL },
        { LINE_MAX_BYTES, DRIVER_PROTOCOL },     { LINE_MAX_BYTES + 1, DRIVER_PROTOCOL },
        { 2 * LINE_MAX_BYTES, DRIVER_PROTOCOL }, { 4500, DRIVER_PROTOCOL },
    };
    static const size_t each[] = { 1, 7, 1023, 1024, 5000 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (size_t k = 0; k < sizeof each / sizeof *each; k++) {
            start(pieces, long_line(text, cases[i].n, pieces, each[k]), "\r\n");
            TEST_ASSERT_EQUAL_INT(cases[i].result, next());
            TEST_ASSERT_EQUAL_UINT(cases[i].result == DRIVER_OK ? cases[i].n : 0, strlen(line));
            TEST_ASSERT_EQUAL_INT(DRIVER_OK, next()); /* in step again */
            TEST_ASSERT_EQUAL_STRING("OK", line);
        }
}

static void test_over_long_without_end(void)
{
    static char text[LINE_MAX_BYTES + 100];
    memset(text, 'x', sizeof text);
    const struct piece pieces[] = { { text, sizeof text }, { NULL, 0 }, { "\r\nOK\r\n", 6 } };
    start(pieces, 3, "\r\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, next());
    TEST_ASSERT_NOT_NULL(strstr(error.text, "1024"));
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, next());
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
    TEST_ASSERT_EQUAL_STRING("OK", line);
}

static void test_bytes_that_are_no_text(void)
{
    for (int byte = 0; byte < 256; byte++) {
        char text[] = "A?C\r\nOK\r\n";
        text[1] = (char)byte;
        const struct piece pieces[] = { { text, strlen("A?C\r\nOK\r\n") } };
        start(pieces, 1, "\r\n");
        bool fine = byte >= 0x20 && byte <= 0x7e;
        TEST_ASSERT_EQUAL_INT(fine ? DRIVER_OK : DRIVER_PROTOCOL, next());
        if (!fine)
            TEST_ASSERT_NOT_NULL(strstr(error.text, "byte 2 "));
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
        TEST_ASSERT_EQUAL_STRING("OK", line);
    }
}

/* The late answer to the last question is not taken for this one's. */
static void test_resync_forgets_what_was_late(void)
{
    static const struct piece pieces[] = {
        { "OLD\r\nOL", 7 }, { "D2\r\n", 4 }, { NULL, 0 }, { "NEW\r\n", 5 }
    };
    start(pieces, 4, "\r\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
    TEST_ASSERT_TRUE(line_is_kept(&reader));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, line_resync(&reader, 5, call_now_ms() + 1000, &error));
    TEST_ASSERT_FALSE(line_is_kept(&reader));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, next());
    TEST_ASSERT_EQUAL_STRING("NEW", line);
}

static void test_resync_of_what_never_stops(void)
{
    static struct piece pieces[100000];
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++)
        pieces[i] = (struct piece){ "x", 1 };
    start(pieces, sizeof pieces / sizeof *pieces, "\r\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, line_resync(&reader, 5, call_now_ms() - 1, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, error.result);
}

static void test_failures_of_the_link_pass(void)
{
    start(NULL, 0, "\r\n");
    script.ends_with = DRIVER_GONE;
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, next());
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, line_resync(&reader, 5, call_now_ms() + 1000, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, error.result);
    start(NULL, 0, "\r\n");
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, next());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_cut_at_every_offset);
    RUN_TEST(test_beginning_is_kept_over_silence);
    RUN_TEST(test_ends_of_one_and_of_three_bytes);
    RUN_TEST(test_longest_and_over_long);
    RUN_TEST(test_over_long_without_end);
    RUN_TEST(test_bytes_that_are_no_text);
    RUN_TEST(test_resync_forgets_what_was_late);
    RUN_TEST(test_resync_of_what_never_stops);
    RUN_TEST(test_failures_of_the_link_pass);
    return UNITY_END();
}
