/* test_connection.c - both ends of a socket pair: framing, limits, a client that
 * never reads, one that leaves. */
#include "station/connection.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "unity.h"

static struct connection c;
static int client; /* the other end */

void setUp(void)
{
    int pair[2];
    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM, 0, pair));
    client = pair[1];
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_init(&c, pair[0]));
}

void tearDown(void)
{
    connection_done(&c);
    connection_done(&c); /* takes what is done already */
    if (client >= 0)
        close(client);
}

/* Lines as they came, '|' after each; NUL shown as '0'. */
struct heard {
    char text[256];
    size_t lines, longest;
    size_t stop_after; /* 0: never */
};

static bool hear(void *context, char *line, size_t length)
{
    struct heard *heard = context;
    size_t used = strlen(heard->text);
    for (size_t i = 0; i < length && used < 200; i++)
        heard->text[used++] = line[i] == '\0' ? '0' : line[i];
    heard->text[used] = '|';
    heard->text[used + 1] = '\0';
    if (length > heard->longest)
        heard->longest = length;
    return ++heard->lines != heard->stop_after;
}

static void say(const char *bytes, size_t n)
{
    while (n > 0) {
        ssize_t sent = send(client, bytes, n, MSG_NOSIGNAL);
        TEST_ASSERT_TRUE(sent > 0);
        bytes += sent;
        n -= (size_t)sent;
    }
}

static const struct line_case {
    const char *what, *bytes;
    size_t n;
    const char *lines;
} line_cases[] = {
    { "one line", "{}\n", 3, "{}|" },
    { "two at once", "a\nb\n", 4, "a|b|" },
    { "an empty one", "\n", 1, "|" },
    { "CR before LF is no part of it", "a\r\n\r\n", 5, "a||" },
    { "CR elsewhere is", "a\rb\n", 4, "a\rb|" },
    { "NUL is a byte like any other here", "a\0b\n", 4, "a0b|" },
    { "no LF yet: nothing", "{\"a\":", 5, "" },
};

static void test_lines(void)
{
    for (size_t i = 0; i < sizeof line_cases / sizeof *line_cases; i++) {
        const struct line_case *row = &line_cases[i];
        struct heard heard = { { 0 }, 0, 0, 0 };
        tearDown();
        setUp();
        say(row->bytes, row->n);
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_OK, connection_read(&c, 1000, hear, &heard),
                                      row->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(row->lines, heard.text, row->what);
    }
}

/* Split at every offset, the lines are the same. */
static void test_split_anywhere(void)
{
    static const char text[] = "first\nsecond\r\n\nlast\n";
    for (size_t at = 0; at < sizeof text; at++) {
        struct heard heard = { { 0 }, 0, 0, 0 };
        tearDown();
        setUp();
        say(text, at);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_read(&c, 1000, hear, &heard));
        say(text + at, sizeof text - 1 - at);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_read(&c, 1000, hear, &heard));
        TEST_ASSERT_EQUAL_STRING("first|second||last|", heard.text);
    }
}

static void test_nothing_there_is_no_error(void)
{
    struct heard heard = { { 0 }, 0, 0, 0 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_read(&c, 1000, hear, &heard));
    TEST_ASSERT_EQUAL_size_t(0, heard.lines);
}

/* Read until the buffer is empty or the connection objects. */
static enum status read_all(struct heard *heard, size_t bytes)
{
    enum status s = STATUS_OK;
    for (size_t rounds = 0; rounds < bytes / 1024 + 16 && s == STATUS_OK; rounds++)
        s = connection_read(&c, 1000, hear, heard);
    return s;
}

static void test_longest_line(void)
{
    static char bytes[CONNECTION_LINE_MAX + 2];
    struct heard heard = { { 0 }, 0, 0, 0 };
    memset(bytes, 'x', sizeof bytes);
    bytes[CONNECTION_LINE_MAX] = '\n';
    say(bytes, CONNECTION_LINE_MAX + 1);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, read_all(&heard, CONNECTION_LINE_MAX));
    TEST_ASSERT_EQUAL_size_t(1, heard.lines);
    TEST_ASSERT_EQUAL_size_t(CONNECTION_LINE_MAX, heard.longest);

    bytes[CONNECTION_LINE_MAX] = 'x';
    bytes[CONNECTION_LINE_MAX + 1] = '\n';
    say(bytes, CONNECTION_LINE_MAX + 2);
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, read_all(&heard, CONNECTION_LINE_MAX));
    TEST_ASSERT_EQUAL_size_t(1, heard.lines);
}

/* CR and LF end it: they are no part of its length. */
static void test_longest_line_with_cr(void)
{
    static char bytes[CONNECTION_LINE_MAX + 3];
    struct heard heard = { { 0 }, 0, 0, 0 };
    memset(bytes, 'x', sizeof bytes);
    memcpy(bytes + CONNECTION_LINE_MAX, "\r\n", 2);
    for (size_t lines = 1; lines <= 2; lines++) {
        say(bytes, CONNECTION_LINE_MAX + 2);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, read_all(&heard, CONNECTION_LINE_MAX));
        TEST_ASSERT_EQUAL_size_t(lines, heard.lines);
        TEST_ASSERT_EQUAL_size_t(CONNECTION_LINE_MAX, heard.longest);
    }
}

static const struct long_line {
    const char *what, *end;
} long_lines[] = {
    { "a byte, LF", "x\n" }, { "a byte, CR, LF", "x\r\n" }, { "CR twice, LF", "\r\r\n" },
    { "CR, a byte", "\rx" }, { "two bytes", "xx" },
};

static void test_too_long(void)
{
    static char bytes[CONNECTION_LINE_MAX];
    memset(bytes, 'x', sizeof bytes);
    for (size_t i = 0; i < sizeof long_lines / sizeof *long_lines; i++) {
        const struct long_line *row = &long_lines[i];
        struct heard heard = { { 0 }, 0, 0, 0 };
        tearDown();
        setUp();
        say(bytes, sizeof bytes);
        say(row->end, strlen(row->end));
        TEST_ASSERT_EQUAL_INT_MESSAGE(STATUS_RANGE, read_all(&heard, CONNECTION_LINE_MAX),
                                      row->what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, heard.lines, row->what);
    }
}

static void test_callback_stops(void)
{
    struct heard heard = { { 0 }, 0, 0, 2 };
    say("a\nb\nc\n", 6);
    TEST_ASSERT_EQUAL_INT(STATUS_CANCELLED, connection_read(&c, 1000, hear, &heard));
    TEST_ASSERT_EQUAL_STRING("a|b|", heard.text);
    TEST_ASSERT_TRUE(c.has_line); /* the socket has no more to tell of it */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_read(&c, 1000, hear, &heard));
    TEST_ASSERT_EQUAL_STRING("a|b|c|", heard.text);
    TEST_ASSERT_FALSE(c.has_line);
}

static void test_client_leaves(void)
{
    struct heard heard = { { 0 }, 0, 0, 0 };
    say("whole\npart", 10);
    close(client);
    client = -1;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_read(&c, 1000, hear, &heard));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, connection_read(&c, 1000, hear, &heard));
    TEST_ASSERT_EQUAL_STRING("whole|", heard.text);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, connection_send(&c, "x", 1, 0)); /* and no SIGPIPE */
}

static size_t take(size_t most)
{
    static char bytes[65536];
    size_t n = most < sizeof bytes ? most : sizeof bytes;
    ssize_t got = recv(client, bytes, n, MSG_DONTWAIT);
    return got > 0 ? (size_t)got : 0;
}

static void test_sent_as_lines(void)
{
    char bytes[16] = "";
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_send(&c, "one", 3, 0));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_send(&c, "", 0, 0));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_send(&c, "two", 3, 0));
    TEST_ASSERT_EQUAL_size_t(0, connection_unsent(&c));
    TEST_ASSERT_EQUAL_INT64(INT64_MAX, connection_deadline_ms(&c));
    TEST_ASSERT_EQUAL_INT(9, recv(client, bytes, sizeof bytes, 0));
    TEST_ASSERT_EQUAL_STRING_LEN("one\n\ntwo\n", bytes, 9);
}

/* One that never reads: nothing blocks, the queue grows to its limit, and the time
 * runs from the last byte it took. */
static void test_client_that_never_reads(void)
{
    static char line[4096];
    enum status s = STATUS_OK;
    size_t sent = 0;
    memset(line, 'x', sizeof line);
    while (s == STATUS_OK && sent < 64 * CONNECTION_UNSENT_MAX) {
        s = connection_send(&c, line, sizeof line, 1000);
        sent += s == STATUS_OK ? sizeof line + 1 : 0;
    }
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, s);
    TEST_ASSERT_TRUE(connection_unsent(&c) <= CONNECTION_UNSENT_MAX);
    TEST_ASSERT_TRUE(connection_unsent(&c) > CONNECTION_UNSENT_MAX - 2 * sizeof line);
    TEST_ASSERT_EQUAL_INT64(1000 + CONNECTION_UNSENT_MS, connection_deadline_ms(&c));

    /* It reads after all: progress starts the time anew, and every byte arrives once. */
    size_t got = take(65536);
    TEST_ASSERT_TRUE(got > 0);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_flush(&c, 5000));
    TEST_ASSERT_EQUAL_INT64(5000 + CONNECTION_UNSENT_MS, connection_deadline_ms(&c));
    while (connection_unsent(&c) > 0) {
        got += take(65536);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, connection_flush(&c, 6000));
    }
    for (size_t more = take(65536); more > 0; more = take(65536))
        got += more;
    TEST_ASSERT_EQUAL_size_t(sent, got);
    TEST_ASSERT_EQUAL_INT64(INT64_MAX, connection_deadline_ms(&c));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_lines);
    RUN_TEST(test_split_anywhere);
    RUN_TEST(test_nothing_there_is_no_error);
    RUN_TEST(test_longest_line);
    RUN_TEST(test_longest_line_with_cr);
    RUN_TEST(test_too_long);
    RUN_TEST(test_callback_stops);
    RUN_TEST(test_client_leaves);
    RUN_TEST(test_sent_as_lines);
    RUN_TEST(test_client_that_never_reads);
    return UNITY_END();
}
