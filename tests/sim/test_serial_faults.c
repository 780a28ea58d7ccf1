/* test_serial_faults.c - what goes wrong on a line goes wrong as faults.h says. */
#include "tests/sim/faults.h"

#include <stdlib.h>
#include <string.h>

#include "tests/sim/cm700d.h"
#include "tests/sim/sim_options.h"
#include "tests/sim/under_port.h"
#include "tests/sim/wall_clock.h"
#include "tests/support/conversation.h"
#include "unity.h"

static struct conversation c;

void setUp(void)
{
    conversation_begin(&c, &sim_cm700d, "delays=0");
}

void tearDown(void)
{
    conversation_end(&c);
}

#define CPR "OK00,2,3,00,01,01\r\n" /* 19 bytes */

static void test_a_reply(void)
{
    static const struct {
        const char *fault, *first, *second;
    } rows[] = {
        { "fault silence", "", CPR },
        { "fault silence on 2", CPR, "" },
        { "fault silence from 1", "", "" },
        { "fault late", "", CPR CPR },
        { "fault truncated 7", "OK00,2,", CPR },
        { "fault truncated -2", "OK00,2,3,00,01,01", CPR },
        { "fault truncated 19", CPR, CPR },
        { "fault longer 3", "OK00,2,3,00,01,01777\r\n", CPR },
        { "fault twice", CPR CPR, CPR },
        { "fault xor 2 0x05", "OK50,2,3,00,01,01\r\n", CPR },
        { "fault xor -1 8", "OK00,2,3,00,01,01\r\x02", CPR },
        { "fault replace 0 65", "AK00,2,3,00,01,01\r\n", CPR },
        { "fault replace -2 65", "OK00,2,3,00,01,01A\n", CPR },
        { "fault reply ER13 from 2", CPR, "ER13\r\n" },
        { "fault prober", "ER08\r\n", CPR }, /* "AT\rCPR" is no text */
        { "fault prober on 2", CPR, "ER08\r\n" },
        { "fault none", CPR, CPR },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        conversation_act(&c, rows[i].fault);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(rows[i].first, conversation_ask(&c, "CPR\r\n", 1),
                                         rows[i].fault);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(rows[i].second, conversation_ask(&c, "CPR\r\n", 1),
                                         rows[i].fault);
        conversation_act(&c, "fault none");
    }
}

static void test_two_at_once(void)
{
    conversation_act(&c, "fault silence on 2");
    conversation_act(&c, "fault truncated 2 on 2");
    TEST_ASSERT_EQUAL_STRING(CPR, conversation_ask(&c, "CPR\r\n", 1));
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "CPR\r\n", 1));
    TEST_ASSERT_EQUAL_STRING("OK", conversation_ask(&c, "CPR\r\n", 1));
    TEST_ASSERT_EQUAL_STRING(CPR, conversation_ask(&c, "CPR\r\n", 1));
}

static void test_times(void)
{
    conversation_act(&c, "fault delay 700");
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "CPR\r\n", 0.69));
    TEST_ASSERT_EQUAL_STRING(CPR, conversation_hear(&c, 0.02));
    conversation_act(&c, "fault slow 100");
    TEST_ASSERT_EQUAL_STRING("OK00,2", conversation_ask(&c, "CPR\r\n", 0.55));
    TEST_ASSERT_EQUAL_STRING(",3,00,01,01\r", conversation_hear(&c, 1.2));
    TEST_ASSERT_EQUAL_STRING("\n", conversation_hear(&c, 0.1));
    /* What is asked meanwhile comes after it. */
    conversation_act(&c, "fault delay 700");
    conversation_ask(&c, "CPR\r\n", 0.1);
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "USR\r\n", 0.1));
    TEST_ASSERT_EQUAL_STRING(CPR "OK00,0\r\n", conversation_hear(&c, 1));
}

static void test_garbage(void)
{
    conversation_act(&c, "fault garbage 200");
    conversation_ask(&c, "CPR\r\n", 1);
    TEST_ASSERT_EQUAL_INT(200, c.n);
    conversation_act(&c, "fault longer 4000");
    conversation_ask(&c, "CPR\r\n", 1);
    TEST_ASSERT_EQUAL_INT(4019, c.n);
}

static void test_lines_of_the_host(void)
{
    char longest[700];
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "CP", 1));
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "R\r", 1));
    TEST_ASSERT_EQUAL_STRING(CPR, conversation_ask(&c, "\n", 1));
    TEST_ASSERT_EQUAL_STRING(CPR CPR, conversation_ask(&c, "CPR\r\nCPR\n", 1));
    TEST_ASSERT_EQUAL_STRING("ER00\r\n", conversation_ask(&c, "\r\n", 1));
    memset(longest, 'A', sizeof longest);
    strcpy(longest + sizeof longest - 3, "\r\n");
    TEST_ASSERT_EQUAL_STRING("ER08\r\n", conversation_ask(&c, longest, 1));
    TEST_ASSERT_EQUAL_STRING(CPR, conversation_ask(&c, "CPR\r\n", 1));
}

static void test_no_such_fault(void)
{
    static const char *const wrong[] = {
        "fault",
        "fault ",
        "fault nosuch",
        "fault silence 3",
        "fault truncated",
        "fault xor 1",
        "fault xor 1 256",
        "fault silence on 0",
        "fault bands 65",
        "fault longer x",
        "fault garbage 4001",
        "fault xor 1 2 3 4 5",
        "place moon",
        "slide 3",
        "battery",
        "lamp",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        TEST_ASSERT_FALSE_MESSAGE(sim_cm700d.act(c.sim, wrong[i], c.now_us), wrong[i]);
}

static void test_what_lies_under_the_port(void)
{
    for (double nm = 360; nm <= 740; nm += 10) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, under_port_truth(UNDER_BLACK, 0, nm, true));
        for (double L = 1; L <= 80; L += 7) {
            double sce = under_port_truth(UNDER_SKIN, L, nm, false);
            double sci = under_port_truth(UNDER_SKIN, L, nm, true);
            TEST_ASSERT_TRUE(sce > 0.0 && sci > sce + 0.03 && sci < sce + 0.06 && sci < 1.2);
        }
        double white = under_port_truth(UNDER_WHITE, 0, nm, true);
        TEST_ASSERT_TRUE(white > 0.9 && white < 1.0);
    }
}

static void test_days_of_the_clock(void)
{
    struct wall_clock clock = { 0 };
    static const struct wall_clock_time days[] = {
        { 2000, 1, 1, 0, 0, 0 }, { 2000, 2, 29, 12, 0, 0 }, { 2024, 12, 31, 23, 59, 59 },
        { 1980, 3, 1, 1, 2, 3 }, { 2099, 12, 31, 0, 0, 0 }, { 2026, 11, 22, 9, 30, 0 },
    };
    for (size_t i = 0; i < sizeof days / sizeof *days; i++) {
        wall_clock_set(&clock, days[i], 5000000);
        struct wall_clock_time t = wall_clock_now(&clock, 5000000);
        TEST_ASSERT_EQUAL_MEMORY(&days[i], &t, sizeof t);
    }
}

static void test_value_of_an_option(void)
{
    char value[8];
    TEST_ASSERT_TRUE(sim_options_value("delays=0,serial=00012345", "serial", value, sizeof value));
    TEST_ASSERT_EQUAL_STRING("0001234", value);
    TEST_ASSERT_TRUE(sim_options_value("serial=,delays=0", "serial", value, sizeof value));
    TEST_ASSERT_EQUAL_STRING("", value);
    TEST_ASSERT_FALSE(sim_options_value("delays=0", "serial", value, sizeof value));
}

static void test_list(void)
{
    static const char *const names[] = { "cm700d", "cm2600d", "sp62" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        TEST_ASSERT_EQUAL_STRING(names[i], sim_find(names[i])->name);
    TEST_ASSERT_NULL(sim_find("cm"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_reply);
    RUN_TEST(test_two_at_once);
    RUN_TEST(test_times);
    RUN_TEST(test_garbage);
    RUN_TEST(test_lines_of_the_host);
    RUN_TEST(test_no_such_fault);
    RUN_TEST(test_what_lies_under_the_port);
    RUN_TEST(test_days_of_the_clock);
    RUN_TEST(test_value_of_an_option);
    RUN_TEST(test_list);
    return UNITY_END();
}
