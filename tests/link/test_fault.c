/* test_fault.c - each fault of a wire, at its byte and nowhere else. */
#include "drivers/link/fault.h"

#include <string.h>

#include "tests/link/script.h"
#include "unity.h"

static struct call call;
static struct fault_source source;
static struct link *wire;
static struct driver_error error;

static const struct piece two_replies[] = { { "abcdef", 6 }, { NULL, 0 }, { "ghijkl", 6 } };

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
}

void tearDown(void)
{
    link_close(wire);
    wire = NULL;
    call_done(&call);
}

static void open_it(void)
{
    const struct driver_options options = { .address = "", .wire = &source.source };
    const struct link_wanted wanted = { .call = &call, .deadline_ms = call_now_ms() + 1000 };
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_open(&options, &wanted, &wire, &error));
}

static void start(struct fault fault)
{
    link_close(wire);
    script_start(&call, two_replies, 3);
    fault_source_init(&source, &script.source, fault);
    open_it();
}

/* What comes after a question until it is quiet, receives apart by '|', '!' if it is gone. */
static const char *ask(int quiet_ms)
{
    static char text[128];
    size_t at = 0, n;
    enum driver_result r;
    if (link_send(wire, LINK_SERIAL, "?", 1, 0, &error) != DRIVER_OK)
        return "!";
    while ((r = link_receive(wire, LINK_SERIAL, text + at, sizeof text - at - 2, &n,
                             call_now_ms() + quiet_ms, &error)) == DRIVER_OK) {
        at += n;
        text[at++] = '|';
    }
    text[at++] = r == DRIVER_GONE ? '!' : '\0';
    text[at] = '\0';
    return text;
}

static void test_bytes(void)
{
    static const struct {
        struct fault fault;
        const char *first, *second;
    } cases[] = {
        { { .kind = FAULT_NONE }, "abcdef|", "ghijkl|" },
        { { FAULT_DROP, .reply = 0, .byte = 2, .count = 1 }, "abdef|", "ghijkl|" },
        { { FAULT_DROP, .reply = 0, .byte = 5, .count = 2 }, "abcde|", "hijkl|" },
        { { FAULT_DROP, .reply = 2, .byte = 0, .count = 3 }, "abcdef|", "jkl|" },
        { { FAULT_FLIP, .reply = 1, .byte = 0, .mask = 0x20 }, "Abcdef|", "ghijkl|" },
        { { FAULT_FLIP, .reply = 0, .byte = 11, .mask = 0x20 }, "abcdef|", "ghijkL|" },
        { { FAULT_SPLIT, .reply = 2, .byte = 1 }, "abcdef|", "g|hijkl|" },
        { { FAULT_SPLIT, .reply = 1, .byte = 0 }, "abcdef|", "ghijkl|" },
        { { FAULT_GARBAGE, .reply = 1, .byte = 1, .count = 2 },
          "a\xf1\xf2"
          "bcdef|",
          "ghijkl|" },
        { { FAULT_DUPLICATE, .reply = 2 }, "abcdef|", "ghijkl|ghijkl|" },
        { { FAULT_TRUNCATE, .reply = 1, .byte = 4 }, "abcd|", "ghijkl|" },
        { { FAULT_TRUNCATE, .reply = 1, .byte = 0 }, "", "ghijkl|" },
        { { FAULT_CLOSE, .reply = 0, .byte = 3 }, "abc|!", "!" },
        { { FAULT_CLOSE, .reply = 2, .byte = 0 }, "abcdef|", "!" },
        { { FAULT_DROP, .reply = 3, .byte = 0, .count = 1 }, "abcdef|", "ghijkl|" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char what[32];
        snprintf(what, sizeof what, "case %zu", i);
        start(cases[i].fault);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(cases[i].first, ask(3), what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(cases[i].second, ask(3), what);
        link_close(wire);
        wire = NULL;
        TEST_ASSERT_EQUAL_INT(1, script.closed);
    }
}

/* The answer that comes too late is there for the next question. */
static void test_delay(void)
{
    start((struct fault){ FAULT_DELAY, .reply = 1, .byte = 0, .delay_ms = 40 });
    TEST_ASSERT_EQUAL_STRING("", ask(10));
    TEST_ASSERT_EQUAL_STRING("abcdef|", ask(60));
    start((struct fault){ FAULT_DELAY, .reply = 1, .byte = 0, .delay_ms = 40 });
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_STRING("abcdef|", ask(60));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 40);
}

static void test_dribble(void)
{
    start((struct fault){ FAULT_DRIBBLE, .reply = 1, .byte = 3, .delay_ms = 20 });
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_STRING("abc|d|e|f|", ask(200));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 60);
}

static void test_close_lasts_until_it_is_opened_again(void)
{
    start((struct fault){ FAULT_CLOSE, .reply = 1, .byte = 0 });
    TEST_ASSERT_EQUAL_STRING("!", ask(3));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, link_drain(wire, 0, 3, call_now_ms() + 50, &error));
    link_close(wire);
    open_it();
    TEST_ASSERT_EQUAL_STRING("", ask(3)); /* the silence of the script */
    TEST_ASSERT_EQUAL_STRING("ghijkl|", ask(3));
}

static void test_drain_takes_a_duplicate(void)
{
    static const struct piece pieces[] = { { "abc", 3 }, { NULL, 0 }, { NULL, 0 }, { "def", 3 } };
    char text[16];
    size_t n;
    start((struct fault){ FAULT_DUPLICATE, .reply = 1 });
    script.pieces = pieces;
    script.n = 4;
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_send(wire, 0, "?", 1, 0, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_receive(wire, 0, text, 16, &n, 0, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_drain(wire, 0, 5, call_now_ms() + 500, &error));
    TEST_ASSERT_EQUAL_STRING("def|", ask(3));
}

static void test_the_rest_passes(void)
{
    start((struct fault){ .kind = FAULT_NONE });
    link_begin(wire, "measure");
    TEST_ASSERT_EQUAL_STRING("measure", script.begun);
    TEST_ASSERT_EQUAL_INT64(1700000000, link_realtime_s(wire));
    call_cancel(&call);
    size_t n;
    char text[16];
    script.at = 3;
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED,
                          link_receive(wire, 0, text, 16, &n, call_now_ms() + 60000, &error));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bytes);
    RUN_TEST(test_delay);
    RUN_TEST(test_dribble);
    RUN_TEST(test_close_lasts_until_it_is_opened_again);
    RUN_TEST(test_drain_takes_a_duplicate);
    RUN_TEST(test_the_rest_passes);
    return UNITY_END();
}
