/* test_sp62.c - the simulated SP62 against the description: color4j's xrite/sp62, Clsxku.vb, and
 * X-Rite's page on RCI switches. */
#include "tests/sim/sp62.h"

#include <string.h>

#include "tests/support/conversation.h"
#include "unity.h"

static struct conversation c;

void setUp(void)
{
    conversation_begin(&c, &sim_sp62, "noise=0,operator_ms=100");
}

void tearDown(void)
{
    if (c.sim != NULL)
        conversation_end(&c);
}

static void asked(const char *request, const char *reply)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE(reply, conversation_ask(&c, request, 10), request);
}

static void configure(void)
{
    conversation_ask(&c, "\r\n", 1);
    asked("0108CF\r\n", "<00>\r\n");
    asked("0107CF\r\n", "<00>\r\n");
}

static void again(const char *options)
{
    conversation_end(&c);
    conversation_begin(&c, &sim_sp62, options);
    configure();
}

static void spectrum_is_the_truth(const char *request, bool sci)
{
    conversation_ask(&c, request, 5);
    TEST_ASSERT_EQUAL_INT_MESSAGE(31, conversation_fields(&c, ","), c.text);
    TEST_ASSERT_TRUE(c.n > 200);
    TEST_ASSERT_EQUAL_STRING("<00>\r\n", c.text + c.n - 6);
    for (size_t b = 0; b < 31; b++) {
        double truth = sim_sp62.truth(c.sim, 400.0 + 10.0 * (double)b, sci);
        TEST_ASSERT_DOUBLE_WITHIN(0.6e-6, truth, conversation_number(&c, b, ",") / 100.0);
    }
}

static void test_texts(void)
{
    static const struct {
        const char *act, *request, *reply;
    } rows[] = {
        { NULL, "CE\r", "<00>\r" }, /* delimiter CR at first */
        { NULL, "0108CF\r", "<00>\r\n" },
        { NULL, "0005CF\r\n", "<00>\r\n" },
        { NULL, "0107CF\r\n", "<00>\r\n" },
        { NULL, "0009CF\r\n", "<00>\r\n" },
        { NULL, "0040CF\r\n", "<00>\r\n" },
        { NULL, "0120CF\r\n", "<00>\r\n" },
        { NULL, "0023CF\r\n", "<00>\r\n" },
        { NULL, "0A4BCF\r\n", "<00>\r\n" },
        { NULL, "014BCF\r\n", "<00>\r\n" },
        { NULL, "004BCF\r\n", "<13>\r\n" },
        { NULL, "0099CF\r\n", "<12>\r\n" },
        { NULL, "9600BR\r\n", "<00>\r\n" },
        { NULL, "9601BR\r\n", "<12>\r\n" },
        { NULL, "00SN\r\n", "001234<00>\r\n" },
        { NULL, "QQ\r\n", "<11>\r\n" },
        { NULL, "X\r\n", "<11>\r\n" },
        { NULL, "AT\r", "<11>\r\n" }, /* a modem prober */
        { NULL, "0G01GM\r\n", "<12>\r\n" },
        { NULL, "00GM\r\n", "0<00>\r\n" },
        { NULL, "00GS\r\n", "0<00>\r\n" },
        { NULL, "0001SM\r\n", "<00>\r\n" },
        { NULL, "0001GM\r\n", "<16>\r\n" },
        { NULL, "1001GM\r\n", "<13>\r\n" },
        { NULL, "RM\r\n", "<28>\r\n" },
        { NULL, "RM\r\n", "<28>\r\n" }, /* until it is cleared */
        { NULL, "10XD\r\n", "<28>\r\n" },
        { NULL, "CE\r\n", "<00>\r\n" },
        { NULL, "10XD\r\n", "<00>\r\n" }, /* the operator is there */
        { NULL, "RM\r\n", "<00>\r\n" },
        { "lamp dead", "RM\r\n", "<31>\r\n" },
        { "lamp ok", "CE\r\n", "<00>\r\n" },
        { "battery 2", "RM\r\n", "<3B>\r\n" },
        { "battery 0", "CE\r\n", "<00>\r\n" },
        { "place bright", "RM\r\n", "<27>\r\n" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (rows[i].act != NULL)
            conversation_act(&c, rows[i].act);
        asked(rows[i].request, rows[i].reply);
    }
}

static void test_spectra(void)
{
    configure();
    asked("10XD\r\n", "<00>\r\n");
    asked("RM\r\n", "<00>\r\n");
    spectrum_is_the_truth("0001GM\r\n", true);
    spectrum_is_the_truth("0101GM\r\n", false);
    spectrum_is_the_truth("001GM\r\n", true); /* a leading zero may be dropped */
    spectrum_is_the_truth("101GM\r\n", false);
    conversation_act(&c, "store");
    asked("00GM\r\n", "1<00>\r\n");
    spectrum_is_the_truth("1101GM\r\n", false);
}

static void test_the_operator_takes_his_time(void)
{
    again("noise=0");
    conversation_act(&c, "place white");
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "10XD\r\n", 30));
    TEST_ASSERT_EQUAL_STRING("<14>\r\n", conversation_ask(&c, "RM\r\n", 1));
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_STRING("", conversation_hear(&c, 30));
    conversation_act(&c, "place black");
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_STRING("<00>\r\n", conversation_hear(&c, 5));
    conversation_act(&c, "place skin");
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "01XD\r\n", 300));
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_STRING("<00>\r\n", conversation_hear(&c, 5));
    spectrum_is_the_truth("101GM\r\n", false);
    TEST_ASSERT_EQUAL_STRING("<21>\r\n", conversation_ask(&c, "01XD\r\n", 321));
    asked("CE\r\n", "<00>\r\n");
    TEST_ASSERT_EQUAL_STRING("<2A>\r\n", conversation_ask(&c, "10XD\r\n", 121));
    asked("CE\r\n", "<00>\r\n");
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "10XD\r\n", 1));
    asked("CE\r\n", "<15>\r\n");
}

static void test_swapped_tiles_fail(void)
{
    again("noise=0");
    conversation_act(&c, "place black");
    conversation_ask(&c, "10XD\r\n", 1);
    conversation_act(&c, "press");
    conversation_act(&c, "place white");
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_STRING("<29>\r\n", conversation_hear(&c, 5));
    asked("CE\r\n", "<00>\r\n");
    asked("RM\r\n", "<28>\r\n");
}

static void test_echo_and_slider(void)
{
    conversation_end(&c);
    conversation_begin(&c, &sim_sp62, "echo=1,variant=sp64,operator_ms=1");
    asked("00SN\r", "00SN\r001234<00>\r");
    asked("0009CF\r", "0009CF\r<00>\r");
    asked("10XD\r", "<00>\r");
    conversation_act(&c, "slide 1");
    asked("RM\r", "<28>\r");
    TEST_ASSERT_NULL(sim_sp62.make("variant=sp61"));
}

static void test_faults_of_a_shot(void)
{
    again("noise=0,operator_ms=1,delays=0");
    asked("10XD\r\n", "<00>\r\n");
    conversation_act(&c, "fault calibration_lost");
    asked("RM\r\n", "<28>\r\n");
    asked("CE\r\n", "<00>\r\n");
    asked("0001GM\r\n", "<16>\r\n");
    asked("10XD\r\n", "<00>\r\n");
    asked("RM\r\n", "<00>\r\n");
    conversation_act(&c, "fault bands 30");
    conversation_ask(&c, "0101GM\r\n", 1);
    TEST_ASSERT_EQUAL_INT(30, conversation_fields(&c, ","));
    conversation_act(&c, "fault battery_dies");
    asked("RM\r\n", "");
    asked("CE\r\n", "");
    conversation_act(&c, "reset");
    asked("00SN\r", "001234<00>\r");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_texts);
    RUN_TEST(test_spectra);
    RUN_TEST(test_the_operator_takes_his_time);
    RUN_TEST(test_swapped_tiles_fail);
    RUN_TEST(test_echo_and_slider);
    RUN_TEST(test_faults_of_a_shot);
    return UNITY_END();
}
