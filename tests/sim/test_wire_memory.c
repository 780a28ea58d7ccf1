/* test_wire_memory.c - a link on a simulator keeps to link.h, and can be pulled out at any moment.
 */
#include "tests/sim/wire_memory.h"

#include <pthread.h>
#include <string.h>
#include <time.h>

#include "tests/sim/cm700d.h"
#include "tests/support/patience.h"
#include "unity.h"

static struct wire_memory *wire;
static struct call call;
static struct link *link;
static struct driver_error error;

static enum driver_result open_link(struct link **ret)
{
    const struct link_source *source = wire_memory_source(wire);
    static const struct link_serial serial = { .baud = 115200 };
    struct link_wanted wanted = {
        .address = "", .call = &call, .serial = &serial, .deadline_ms = call_now_ms() + 1000
    };
    return source->open(source, &wanted, ret, &error);
}

static void set_up_with(const char *options)
{
    TEST_ASSERT_TRUE(call_init(&call));
    wire = wire_memory_make(&sim_cm700d, options);
    TEST_ASSERT_NOT_NULL(wire);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_link(&link));
    call_begin(&call);
    memset(&error, 0, sizeof error);
}

void setUp(void)
{
    set_up_with("delays=0");
}

void tearDown(void)
{
    if (link != NULL)
        link->ops->close(link);
    link = NULL;
    wire_memory_free(wire);
    call_done(&call);
}

static void again(const char *options)
{
    tearDown();
    set_up_with(options);
}

static enum driver_result send(const char *text)
{
    return link->ops->send(link, LINK_SERIAL, text, strlen(text), call_now_ms() + 100, &error);
}

static char heard[4096];

/* Until the line ends, or a failure. */
static enum driver_result hear(int ms)
{
    size_t n, all = 0;
    int64_t deadline_ms = call_now_ms() + ms;
    heard[0] = '\0';
    for (;;) {
        enum driver_result r = link->ops->receive(link, LINK_SERIAL, heard + all,
                                                  sizeof heard - 1 - all, &n, deadline_ms, &error);
        if (r != DRIVER_OK)
            return r;
        all += n;
        heard[all] = '\0';
        if (heard[all - 1] == '\n')
            return DRIVER_OK;
    }
}

static void sleep_ms(int ms)
{
    nanosleep(&(struct timespec){ ms / 1000, (long)(ms % 1000) * 1000000 }, NULL);
}

#define IDR "OK00,0100,104,00012345,0,400,700,10\r\n"

static void test_question_and_answer(void)
{
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
    TEST_ASSERT_EQUAL_STRING(IDR, heard);
    TEST_ASSERT_EQUAL_INT(1, wire_memory_sends(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(20));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, error.result);
    TEST_ASSERT_TRUE(error.text[0] != '\0');
}

static void test_real_time(void)
{
    again("");
    TEST_ASSERT_TRUE(wire_memory_act(wire, "place black"));
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("ZRC\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(8000));
    TEST_ASSERT_INT_WITHIN((unsigned)(200 + SLACK_MS), 4000 + SLACK_MS / 2,
                           call_now_ms() - began_ms);
}

static void test_held_alone(void)
{
    struct link *second = NULL;
    TEST_ASSERT_TRUE(wire_memory_is_open(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, open_link(&second));
    TEST_ASSERT_NULL(second);
    link->ops->close(link);
    TEST_ASSERT_FALSE(wire_memory_is_open(wire));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_link(&link));
}

static void test_drain(void)
{
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\nIDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK,
                          link->ops->drain(link, LINK_SERIAL, 30, call_now_ms() + 1000, &error));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT, hear(20));
    TEST_ASSERT_TRUE(wire_memory_act(wire, "fault slow 20"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_TIMEOUT,
                          link->ops->drain(link, LINK_SERIAL, 200, call_now_ms() + 300, &error));
}

/* ---- while a driver waits ----------------------------------------------------------- */

static void *later(void *what)
{
    sleep_ms(60);
    ((void (*)(void))(uintptr_t)what)();
    return NULL;
}

static enum driver_result hear_while(void (*what)(void), int64_t *took_ms)
{
    pthread_t thread;
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, later, (void *)(uintptr_t)what));
    enum driver_result r = hear(5000);
    *took_ms = call_now_ms() - began_ms;
    pthread_join(thread, NULL);
    return r;
}

static void unplug(void)
{
    wire_memory_unplug(wire);
}

static void cancel(void)
{
    call_cancel(&call);
}

static void press(void)
{
    wire_memory_act(wire, "press");
}

static void test_woken_by_what_happens(void)
{
    int64_t took_ms;
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, hear_while(cancel, &took_ms));
    TEST_ASSERT_TRUE(took_ms < 60 + SLACK_MS);
    again("delays=0,notify=line");
    static const char *const prepare[] = { "place black", "ZRC\r\n",    "place white",
                                           "CAL\r\n",     "place skin", "SWS,1\r\n" };
    for (size_t i = 0; i < 6; i += 2) {
        TEST_ASSERT_TRUE(wire_memory_act(wire, prepare[i]));
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, send(prepare[i + 1]));
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(500));
    }
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear_while(press, &took_ms));
    TEST_ASSERT_EQUAL_INT(223, strlen(heard));
    TEST_ASSERT_TRUE(took_ms < 60 + SLACK_MS);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear_while(unplug, &took_ms));
    TEST_ASSERT_TRUE(took_ms < 60 + 100 + SLACK_MS);
}

/* ---- unplugged ---------------------------------------------------------------------- */

static void test_unplugged_while_idle(void)
{
    struct link *second = NULL;
    wire_memory_unplug(wire);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(1000));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, open_link(&second));
    wire_memory_plug(wire);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, send("IDR\r\n")); /* this link stays dead */
    link->ops->close(link);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, open_link(&link));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
}

static void test_unplugged_and_plugged_unnoticed(void)
{
    wire_memory_unplug(wire);
    wire_memory_plug(wire);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, send("IDR\r\n"));
}

static void test_unplugged_between_command_and_reply(void)
{
    wire_memory_unplug_at(wire, 2, 0);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(1000));
    TEST_ASSERT_EQUAL_STRING("", heard);
}

static void test_unplugged_in_mid_frame(void)
{
    for (size_t n = 1; n < strlen(IDR); n += 7) {
        again("delays=0");
        wire_memory_unplug_at(wire, 1, n);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
        TEST_ASSERT_EQUAL_INT(DRIVER_GONE, hear(1000));
        TEST_ASSERT_EQUAL_INT(n, strlen(heard));
        TEST_ASSERT_EQUAL_STRING_LEN(IDR, heard, n);
    }
}

static void test_split_at_every_offset(void)
{
    for (size_t k = 0; k < strlen(IDR); k++) {
        size_t n = 0;
        wire_memory_split(wire, k, 5);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
        int64_t began_ms = call_now_ms();
        enum driver_result r =
            link->ops->receive(link, LINK_SERIAL, heard, sizeof heard, &n, began_ms + 1000, &error);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, r);
        TEST_ASSERT_EQUAL_INT(k == 0 ? strlen(IDR) : k, n);
        heard[n] = '\0';
        if (k > 0)
            TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
        TEST_ASSERT_EQUAL_STRING(k == 0 ? IDR : &IDR[k], heard);
        TEST_ASSERT_TRUE(call_now_ms() - began_ms >= 4);
    }
    wire_memory_split(wire, 0, 0);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, send("IDR\r\n"));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, hear(1000));
    TEST_ASSERT_EQUAL_STRING(IDR, heard);
}

static void test_bad_options(void)
{
    TEST_ASSERT_NULL(wire_memory_make(&sim_cm700d, "nosuch=1"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_question_and_answer);
    RUN_TEST(test_real_time);
    RUN_TEST(test_held_alone);
    RUN_TEST(test_drain);
    RUN_TEST(test_woken_by_what_happens);
    RUN_TEST(test_unplugged_while_idle);
    RUN_TEST(test_unplugged_and_plugged_unnoticed);
    RUN_TEST(test_unplugged_between_command_and_reply);
    RUN_TEST(test_unplugged_in_mid_frame);
    RUN_TEST(test_split_at_every_offset);
    RUN_TEST(test_bad_options);
    return UNITY_END();
}
