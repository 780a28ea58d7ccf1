/* test_utf8.c - well-formed or not, at every edge of RFC 3629. */
#include "base/utf8.h"

#include <stdint.h>
#include <stdio.h>

#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* expect: the grammar in RFC 3629, section 4; first and last of each of its lines,
 * and their neighbours outside. */
static const struct edge_case {
    const char *what, *text;
    bool valid;
} edge_cases[] = {
    { "empty", "", true },
    { "ASCII", "Fitzpatrick III", true },
    { "U+0001", "\x01", true },
    { "U+007F", "\x7f", true },
    { "a continuation alone", "\x80", false },
    { "the last continuation alone", "\xbf", false },
    { "overlong U+0000", "\xc0\x80", false },
    { "overlong U+007F", "\xc1\xbf", false },
    { "U+0080", "\xc2\x80", true },
    { "U+07FF", "\xdf\xbf", true },
    { "two bytes, second too low", "\xc2\x7f", false },
    { "two bytes, second too high", "\xc2\xc0", false },
    { "two bytes, cut", "\xc2", false },
    { "two bytes, then ASCII", "\xc2x", false },
    { "overlong U+07FF", "\xe0\x9f\xbf", false },
    { "U+0800", "\xe0\xa0\x80", true },
    { "U+0FFF", "\xe0\xbf\xbf", true },
    { "U+1000", "\xe1\x80\x80", true },
    { "U+CFFF", "\xec\xbf\xbf", true },
    { "U+D7FF", "\xed\x9f\xbf", true },
    { "the first surrogate", "\xed\xa0\x80", false },
    { "the last surrogate", "\xed\xbf\xbf", false },
    { "U+E000", "\xee\x80\x80", true },
    { "U+FFFD", "\xef\xbf\xbd", true },
    { "U+FFFF, no character but well-formed", "\xef\xbf\xbf", true },
    { "three bytes, second too high", "\xe1\xc0\x80", false },
    { "three bytes, third too low", "\xe1\x80\x7f", false },
    { "three bytes, third too high", "\xe1\x80\xc0", false },
    { "three bytes, cut after one", "\xe1", false },
    { "three bytes, cut after two", "\xe1\x80", false },
    { "overlong U+FFFF", "\xf0\x8f\xbf\xbf", false },
    { "U+10000", "\xf0\x90\x80\x80", true },
    { "U+3FFFF", "\xf0\xbf\xbf\xbf", true },
    { "U+40000", "\xf1\x80\x80\x80", true },
    { "U+FFFFF", "\xf3\xbf\xbf\xbf", true },
    { "U+100000", "\xf4\x80\x80\x80", true },
    { "U+10FFFF", "\xf4\x8f\xbf\xbf", true },
    { "U+110000", "\xf4\x90\x80\x80", false },
    { "four bytes, third too low", "\xf1\x80\x7f\x80", false },
    { "four bytes, fourth too high", "\xf1\x80\x80\xc0", false },
    { "four bytes, cut after three", "\xf1\x80\x80", false },
    { "a lead byte beyond", "\xf5\x80\x80\x80", false },
    { "five bytes", "\xf8\x88\x80\x80\x80", false },
    { "0xFE", "\xfe", false },
    { "0xFF", "\xff", false },
    { "a byte order mark", "\xef\xbb\xbf", true },
    { "valid, then not", "Z\xc3\xbcrich \xc3", false },
    { "not, then valid", "\xc3 Z\xc3\xbcrich", false },
    { "several", "Z\xc3\xbcrich \xe6\x9d\xb1\xe4\xba\xac \xf0\x9f\x99\x82", true },
    { "Latin-1", "Z\xfcrich", false },
    { "the state of one does not reach into the next", "\xe0\xa0\x80\xc2\x80", true },
};

static void test_edges(void)
{
    for (size_t i = 0; i < sizeof edge_cases / sizeof *edge_cases; i++)
        TEST_ASSERT_EQUAL_INT_MESSAGE(edge_cases[i].valid, utf8_is_valid(edge_cases[i].text),
                                      edge_cases[i].what);
}

/* Property: every scalar value, encoded by the RFC's bit patterns, is text; no
 * surrogate is; and no text is when its last byte is missing. */
static void test_every_code_point(void)
{
    for (uint32_t c = 1; c <= 0x110fff; c++) {
        char text[5] = { 0 };
        int n = c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4;
        static const unsigned lead[5] = { 0, 0x00, 0xc0, 0xe0, 0xf0 };
        for (int i = n - 1, shift = 0; i > 0; i--, shift += 6)
            text[i] = (char)(0x80 | ((c >> shift) & 0x3f));
        text[0] = (char)(lead[n] | (c >> (6 * (n - 1))));
        bool scalar = c <= 0x10ffff && !(c >= 0xd800 && c <= 0xdfff);
        if (utf8_is_valid(text) != scalar) {
            char what[32];
            snprintf(what, sizeof what, "U+%04X", (unsigned)c);
            TEST_FAIL_MESSAGE(what);
        }
        text[n - 1] = '\0';
        TEST_ASSERT_TRUE(n == 1 || !utf8_is_valid(text));
    }
}

/* The bytes that count end where n says, in the middle of a character too. */
static void test_by_length(void)
{
    TEST_ASSERT_TRUE(utf8_is_valid_n("a\0b", 3));
    TEST_ASSERT_TRUE(utf8_is_valid_n("\xc3\xa9\xff", 2));
    TEST_ASSERT_FALSE(utf8_is_valid_n("\xc3\xa9", 1));
    TEST_ASSERT_FALSE(utf8_is_valid_n("\xf0\x9f\x98\x80", 3));
    TEST_ASSERT_TRUE(utf8_is_valid_n("\xff", 0));
}

/* expect: by hand; valid text stays, of other text the bytes beyond ASCII go. */
static void test_make_plain(void)
{
    static const struct {
        const char *text, *expect;
    } rows[] = {
        { "", "" },
        { "plain", "plain" },
        { "Zo\xc3\xab", "Zo\xc3\xab" },
        { "Zo\xeb S/N 7", "Zo? S/N 7" },
        { "\xff\xfe", "??" },
        { "cut \xe2\x82", "cut ??" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[32];
        strcpy(text, rows[i].text);
        utf8_make_plain(text);
        TEST_ASSERT_EQUAL_STRING(rows[i].expect, text);
    }
}

/* Plain text is looked at eight bytes at a time: each other byte is seen wherever it is. */
static void test_long_text(void)
{
    char text[40];
    for (size_t n = 1; n <= sizeof text; n++) {
        for (size_t at = 0; at < n; at++) {
            memset(text, 'x', sizeof text);
            TEST_ASSERT_TRUE(utf8_is_valid_n(text, n));
            text[at] = '\xff';
            TEST_ASSERT_FALSE(utf8_is_valid_n(text, n));
            text[at] = '\xc3';
            if (at + 1 < n)
                text[at + 1] = '\xbc';
            TEST_ASSERT_EQUAL_INT_MESSAGE(at + 1 < n, utf8_is_valid_n(text, n), "cut at the end");
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_edges);
    RUN_TEST(test_every_code_point);
    RUN_TEST(test_by_length);
    RUN_TEST(test_make_plain);
    RUN_TEST(test_long_text);
    return UNITY_END();
}
