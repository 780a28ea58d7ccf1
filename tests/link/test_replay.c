/* test_replay.c - a capture instead of an instrument: which call finds which segment, and what
 * happens where the driver says something else. */
#include "drivers/link/kinds.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "unity.h"

#define HEAD \
    "# skinspec capture 1\n# date: 2026-11-22T09:30:00Z by: hand\n0 driver d\n0 open serial\n"

static char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
static struct call call;
static struct link *wire;
static struct driver_error error;

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
    TEST_ASSERT_TRUE(folder_make(folder));
    folder_path(folder, "a.capture", path);
    wire = NULL;
}

void tearDown(void)
{
    link_close(wire);
    folder_remove(folder);
    call_done(&call);
}

/* ---- what the tests say ------------------------------------------------------------- */

static enum driver_result open_it(const char *text)
{
    char address[FOLDER_PATH_SIZE + 8];
    snprintf(address, sizeof address, "replay:%s", path);
    const struct driver_options options = { .address = address };
    const struct link_wanted wanted = { .call = &call, .deadline_ms = call_now_ms() + 1000 };
    TEST_ASSERT_TRUE(file_write(path, text, strlen(text)));
    return link_open(&options, &wanted, &wire, &error);
}

static void start(const char *text)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, open_it(text), error.text);
}

static enum driver_result say(const char *text)
{
    return link_send(wire, LINK_SERIAL, text, strlen(text), call_now_ms() + 50, &error);
}

static char heard[64];

static enum driver_result hear(int within_ms)
{
    size_t n = 0;
    enum driver_result r = link_receive(wire, LINK_SERIAL, heard, sizeof heard - 1, &n,
                                        call_now_ms() + within_ms, &error);
    heard[n] = '\0';
    return r;
}

static void assert_heard(const char *text)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, hear(1000), error.text);
    TEST_ASSERT_EQUAL_STRING(text, heard);
}

/* Begin a call that asks and is answered. */
static void assert_answer(const char *name, const char *answer)
{
    link_begin(wire, name);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, say("?"), error.text);
    assert_heard(answer);
}

static void assert_differs(enum driver_result r, unsigned line, const char *expected,
                           const char *got)
{
    char place[FOLDER_PATH_SIZE + 16];
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_PROTOCOL, r, error.text);
    snprintf(place, sizeof place, "%s:%u: expected ", path, line);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, place), error.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, expected), error.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, got), error.text);
}

/* ---- within a segment --------------------------------------------------------------- */

static void test_a_conversation(void)
{
    int64_t began_ms = call_now_ms();
    start(HEAD "0 > 00 who\n0 < 00 me\n"
               "9 = measure\n10.0 > 00 MES\\r\\n\n90.0 < 00 OK\n90.1 < 00 00\\r\\n\n"
               "95.0 ~ 00\n96.0 @ measure {}\n97.0 > 00 MDR\n98.0 ! gone\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("who"));
    assert_heard("me");
    link_begin(wire, "measure");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("MES\r\n"));
    assert_heard("OK");
    assert_heard("00\r\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(60000));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("MDR"));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(60000));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, error.result);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 5000); /* at once, not as it took */
}

static void test_a_line_may_be_taken_in_bits(void)
{
    char two[2];
    size_t n;
    start(HEAD "0 < 00 abc\n0 < 00 d\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_receive(wire, 0, two, 2, &n, 0, &error));
    TEST_ASSERT_EQUAL_UINT(2, n);
    assert_heard("c");
    assert_heard("d");
}

static void test_a_transfer_is_whole(void)
{
    char two[2];
    size_t n = 7;
    start(HEAD "0 < 81 abc\n0 < 81\n0 < 81 d\n");
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, link_receive(wire, 0x81, two, 2, &n, 0, &error));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "3 bytes came where 2"));
    TEST_ASSERT_EQUAL_UINT(7, n);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_receive(wire, 0x81, two, 2, &n, 0, &error));
    TEST_ASSERT_EQUAL_UINT(0, n);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_receive(wire, 0x81, two, 2, &n, 0, &error));
    TEST_ASSERT_EQUAL_UINT(1, n);
}

static void test_what_differs_is_named(void)
{
    start(HEAD "1 = m\n2 > 00 ABC\n3 < 00 x\n4 = n\n");
    link_begin(wire, "m");
    assert_differs(say("ABD"), 6, "3 bytes sent on channel 00: 'ABC'",
                   "got 3 bytes sent on channel 00: 'ABD'");
    assert_differs(say("AB"), 6, "'ABC'", "'AB'");
    assert_differs(link_send(wire, 2, "ABC", 3, 0, &error), 6, "channel 00", "channel 02");
    assert_differs(hear(10), 6, "'ABC'", "a wait for bytes on channel 00");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("ABC"));
    assert_differs(say("A"), 7, "1 bytes from channel 00: 'x'", "'A'");
    size_t n;
    assert_differs(link_receive(wire, 0x81, heard, 9, &n, 0, &error), 7, "channel 00",
                   "channel 81");
    assert_heard("x");
    assert_differs(hear(10), 7, "the end of 'm'", "a wait for bytes");
    assert_differs(say("more\r\n"), 7, "the end of 'm'", "more\\x0d\\x0a");
}

static void test_captured_failures(void)
{
    static const struct {
        const char *name;
        enum driver_result result;
    } cases[] = { { "gone", DRIVER_GONE },
                  { "protocol", DRIVER_PROTOCOL },
                  { "cancelled", DRIVER_CANCELLED },
                  { "timeout", DRIVER_TIMEOUT },
                  { "no_permission", DRIVER_NO_PERMISSION } };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int way = 0; way < 3; way++) {
            char text[256];
            snprintf(text, sizeof text, HEAD "1 = m\n2 ! %s\n3 < 00 after\n", cases[i].name);
            start(text);
            link_begin(wire, "m");
            TEST_ASSERT_EQUAL_INT(cases[i].result,
                                  way == 0   ? say("x")
                                  : way == 1 ? hear(10)
                                             : link_drain(wire, 0, 5, call_now_ms() + 10, &error));
            TEST_ASSERT_EQUAL_INT(cases[i].result, error.result);
            assert_heard("after");
            link_close(wire);
            wire = NULL;
        }
}

static void test_drain_takes_what_was_thrown_away(void)
{
    start(HEAD "1 = a\n2 < 00 old\n2 < 00 older\n3 ~ 00\n4 < 00 new\n"
               "5 = b\n6 > 00 ?\n6 < 00 new\n");
    link_begin(wire, "a");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_drain(wire, 0, 100, call_now_ms() + 1000, &error));
    assert_heard("new");
    link_begin(wire, "b"); /* nothing was thrown away: as a hand would write it */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, link_drain(wire, 0, 100, call_now_ms() + 1000, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("?"));
    assert_heard("new");
}

/* ---- which segment ------------------------------------------------------------------ */

#define ASKS(call, answer) "1 = " call "\n2 > 00 ?\n3 < 00 " answer "\n"

static void test_calls_in_their_order(void)
{
    start(HEAD ASKS("open", "o") ASKS("measure", "1") ASKS("calibrate zero", "z")
              ASKS("measure", "2"));
    assert_answer("open", "o");
    assert_answer("measure", "1");
    assert_answer("measure", "2"); /* the calibration is left out */
    link_begin(wire, "measure");
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, say("?"));
    TEST_ASSERT_NOT_NULL(strstr(error.text, "no further call 'measure'"));
    link_begin(wire, "calibrate zero"); /* it lies behind */
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, hear(10));
    link_begin(wire, "calibrate"); /* never was */
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, say("?"));
}

static void test_a_call_left_early_is_over(void)
{
    start(HEAD ASKS("measure", "1") ASKS("measure", "2"));
    link_begin(wire, "measure");
    assert_answer("measure", "2");
}

static void test_status_as_often_as_asked(void)
{
    start(HEAD ASKS("open", "o") ASKS("status", "1") ASKS("status", "2") ASKS("measure", "m")
              ASKS("status", "3") ASKS("measure", "n"));
    assert_answer("open", "o");
    assert_answer("status", "1");
    assert_answer("status", "2");
    assert_answer("status", "2"); /* the last again: 3 is behind the measurement */
    assert_answer("measure", "m");
    assert_answer("status", "3");
    assert_answer("status", "3");
    assert_answer("measure", "n");
    assert_answer("status", "3");
}

static void test_status_that_was_never_asked(void)
{
    start(HEAD ASKS("open", "o") ASKS("status", "1") ASKS("measure", "m") ASKS("status", "2"));
    assert_answer("open", "o");
    assert_answer("measure", "m"); /* status 1 left out */
    assert_answer("status", "2");
    link_close(wire);
    start(HEAD ASKS("open", "o") ASKS("measure", "m") ASKS("status", "2"));
    assert_answer("open", "o");
    assert_answer("status", "2"); /* too early, but the only one */
    link_close(wire);
    start(HEAD ASKS("open", "o"));
    link_begin(wire, "status");
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, say("?"));
}

static void assert_silent(const char *name)
{
    link_begin_waiting(wire, name);
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("button on"));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(30));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 30);
}

static void test_waits(void)
{
    start(HEAD ASKS("open", "o") "1 = wait_button\n2 ~ 00\n" ASKS(
        "status",
        "s") "1 = wait_button\n2 ~ 00\n3 < 00 press\n" ASKS("measure",
                                                            "m") "1 = wait_button\n3 < 00 again\n");
    assert_answer("open", "o");
    assert_answer("status", "s");
    link_begin_waiting(wire, "wait_button"); /* the first brought nothing */
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(1000));
    assert_heard("press");
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(30)); /* its end */
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 30);
    assert_silent("wait_button"); /* the other press is behind the measurement */
    assert_silent("wait");
    assert_answer("measure", "m");
    assert_silent("wait");
    link_begin_waiting(wire, "wait_button");
    assert_heard("again");
    assert_silent("wait_button");
}

/* An instrument that is asked once and answers when its button is pressed, as an SP62 does: the
 * wait that asked had no time for the answer, and the wait that has it did not ask. */
static void test_a_wait_that_had_no_time(void)
{
    start(HEAD "1 = measure\n2 = wait_button\n2 ~ 00\n2 > 00 R\n2 ~ 00\n"
               "3 = wait_button\n3 ~ 00\n9 < 00 press\n10 = measure\n");
    link_begin(wire, "measure");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(0));
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, say("R"), error.text);
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(0));
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(0));
    assert_heard("press");
    assert_silent("wait_button");
}

/* It asked nothing at all: the next has all of it. */
static void test_a_wait_that_did_nothing(void)
{
    start(HEAD "2 = wait_button\n3 = wait_button\n4 > 00 R\n4 < 00 no\n5 > 00 R\n9 < 00 press\n");
    link_begin_waiting(wire, "wait_button");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, say("R"), error.text);
    assert_heard("no");
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, say("R"), error.text);
    assert_heard("press");
    assert_silent("wait_button");
}

/* A driver that polls its button: a station that waits at other times replays it all the same. */
static void test_waits_that_were_cut_short(void)
{
    start(HEAD ASKS("open", "o") "1 = wait_button\n2 > 00 R\n2 < 00 none\n3 ! cancelled\n"
                                 "4 = wait_button\n5 > 00 step\n5 < 00 in\n6 > 00 R\n7 < 00 no\n"
                                 "8 ~ 00\n9 > 00 R\n9 < 00 press\n" ASKS("measure", "m"));
    assert_answer("open", "o");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R"));
    assert_heard("none");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R"));
    assert_heard("no");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R")); /* sooner than then */
    assert_heard("press");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R")); /* more often than then: as it was last */
    assert_heard("press");
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(30));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 30);
    assert_answer("measure", "m");
}

/* It would be taken for a press. */
static void test_a_late_answer_is_no_news(void)
{
    start(HEAD "1 = wait_button\n2 > 00 R\n3 ! cancelled\n"
               "4 = wait_button\n5 < 00 late\n6 > 00 R\n7 < 00 no\n"
               "8 = wait_button\n8 ! cancelled\n9 = wait_button\n9 < 00 press\n");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(60000)); /* R was not asked yet */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R"));
    assert_heard("no");
    assert_heard("press"); /* cut short, but not in a question */
}

static void test_a_question_not_asked_yet_is_silence(void)
{
    start(HEAD "1 = wait_button\n2 > 00 R\n3 < 00 no\n4 > 00 R\n5 < 00 press\n");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R"));
    assert_heard("no");
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(60000));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("R"));
    assert_heard("press");
}

static void test_what_came_before_a_question_is_passed_over(void)
{
    start(HEAD "1 = a\n2 < 00 late\n2 ~ 00\n3 > 00 A\n3 < 00 first\n4 > 00 A\n4 < 00 again\n"
               "5 > 00 B\n");
    link_begin(wire, "a");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("A"));
    assert_heard("first");
    assert_differs(say("B"), 10, "1 bytes sent on channel 00: 'A'", "1 bytes sent"); /* not later */
}

/* A question of the capture that the driver leaves out is a difference, also the first. */
static void test_a_question_is_not_passed_over(void)
{
    start(HEAD "1 = a\n2 > 00 step\n2 < 00 in\n3 > 00 A\n3 < 00 first\n");
    link_begin(wire, "a");
    assert_differs(say("A"), 6, "4 bytes sent on channel 00: 'step'", "1 bytes sent");
}

/* But in a wait, where it may be a way back that the capture does not tell. */
static void test_a_way_back_is_passed_over_in_a_wait(void)
{
    start(HEAD "1 = wait_button\n2 < 00 late\n2 > 00 step\n2 < 00 in\n3 > 00 A\n3 < 00 press\n");
    link_begin_waiting(wire, "wait_button");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("A"));
    assert_heard("press");
}

#define CUT_SHORT HEAD "1 = a\n2 = way back\n2 > 00 A\n2 < 00 in\n3 = a\n3 > 00 A\n3 < 00 x\n"

/* Its bytes may be those of the call itself: a capture tells them apart. */
static void test_a_way_back_that_is_told(void)
{
    start(CUT_SHORT);
    link_begin(wire, "a");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("A"));
    assert_heard("x");
    link_close(wire);
    start(CUT_SHORT); /* a replay that goes it as well */
    link_begin(wire, "a");
    link_tell(wire, LINK_WAY_BACK);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("A"));
    assert_heard("in");
    link_tell(wire, "a");
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("A"));
    assert_heard("x");
}

static void test_silence_is_cancelled(void)
{
    start(HEAD ASKS("open", "o"));
    link_begin_waiting(wire, "wait_button");
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, hear(60000));
    link_begin(wire, "open");
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, say("?"));
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, error.result);
}

/* ---- time and files ----------------------------------------------------------------- */

static void test_time_is_that_of_the_capture(void)
{
    enum { DATE = 1795339800 }; /* date -u -d 2026-11-22T09:30Z +%s */
    start(HEAD "12.7 = a\n13.5 > 00 ?\n14.0 clock 1795339999\n14.1 > 00 !\n");
    link_begin(wire, "a");
    TEST_ASSERT_EQUAL_INT64(DATE + 13, link_realtime_s(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("?"));
    TEST_ASSERT_EQUAL_INT64(1795339999, link_realtime_s(wire));
    TEST_ASSERT_EQUAL_INT64(DATE + 14, link_realtime_s(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, say("!"));
}

static void test_files_that_cannot_be_replayed(void)
{
    heard_start();
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, open_it("no capture\n"));
    TEST_ASSERT_NOT_NULL(strstr(error.text, path));
    TEST_ASSERT_NULL(wire);
    const struct link_wanted wanted = { .address = "replay:", .call = &call };
    const struct driver_options options = { .address = "" };
    TEST_ASSERT_EQUAL_INT(DRIVER_UNSUPPORTED, link_open(&options, &wanted, &wire, &error));
    heard_stop();
    start("# skinspec capture 1\n"); /* nothing ever happened */
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, say("?"));
    TEST_ASSERT_EQUAL_INT64(0, link_realtime_s(wire));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_conversation);
    RUN_TEST(test_a_line_may_be_taken_in_bits);
    RUN_TEST(test_a_transfer_is_whole);
    RUN_TEST(test_what_differs_is_named);
    RUN_TEST(test_captured_failures);
    RUN_TEST(test_drain_takes_what_was_thrown_away);
    RUN_TEST(test_calls_in_their_order);
    RUN_TEST(test_a_call_left_early_is_over);
    RUN_TEST(test_status_as_often_as_asked);
    RUN_TEST(test_status_that_was_never_asked);
    RUN_TEST(test_waits);
    RUN_TEST(test_a_wait_that_had_no_time);
    RUN_TEST(test_a_wait_that_did_nothing);
    RUN_TEST(test_waits_that_were_cut_short);
    RUN_TEST(test_a_late_answer_is_no_news);
    RUN_TEST(test_a_question_not_asked_yet_is_silence);
    RUN_TEST(test_what_came_before_a_question_is_passed_over);
    RUN_TEST(test_a_question_is_not_passed_over);
    RUN_TEST(test_a_way_back_is_passed_over_in_a_wait);
    RUN_TEST(test_a_way_back_that_is_told);
    RUN_TEST(test_silence_is_cancelled);
    RUN_TEST(test_time_is_that_of_the_capture);
    RUN_TEST(test_files_that_cannot_be_replayed);
    return UNITY_END();
}
