/* test_cm2600d.c - the simulated CM-2600d against the description: color4j's minolta/cm2600d and
 * Clsmin26.vb. */
#include "tests/sim/cm2600d.h"

#include <string.h>

#include "tests/support/conversation.h"
#include "unity.h"

static struct conversation c;

void setUp(void)
{
    conversation_begin(&c, &sim_cm2600d, "noise=0");
}

void tearDown(void)
{
    if (c.sim != NULL)
        conversation_end(&c);
}

static void again(const char *options)
{
    conversation_end(&c);
    conversation_begin(&c, &sim_cm2600d, options);
}

static void asked(const char *request, const char *reply)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE(reply, conversation_ask(&c, request, 12), request);
}

static void calibrate(void)
{
    conversation_act(&c, "place black");
    asked("UZC\r\n", "OK00\r\n");
    conversation_act(&c, "place white");
    asked("CAL\r\n", "OK00\r\n");
    conversation_act(&c, "place skin");
}

/* Line i of what came: 39 values of five characters. */
static void line_is(size_t i, bool sci)
{
    struct conversation line = c;
    const char *at = c.text;
    for (; i > 0; i--)
        at = strchr(at, '\n') + 1;
    size_t n = strcspn(at, "\r");
    memcpy(line.text, at, n);
    line.text[n] = '\0';
    TEST_ASSERT_EQUAL_INT(4 + 39 * 6, n);
    TEST_ASSERT_EQUAL_INT(40, conversation_fields(&line, ","));
    for (size_t b = 0; b < 39; b++) {
        double truth = sim_cm2600d.truth(c.sim, 360.0 + 10.0 * (double)b, sci);
        TEST_ASSERT_DOUBLE_WITHIN(0.6e-4, truth, conversation_number(&line, b + 1, ",") / 100.0);
    }
}

static size_t lines(void)
{
    return conversation_fields(&c, "\n") - 1;
}

static void test_texts(void)
{
    static const struct {
        const char *act, *request, *reply;
    } rows[] = {
        /* type, ROM, body number, geometry, 360, 740, 10 */
        { NULL, "IDR\r\n", "OK00,03,104,01001234,0,360,740,10\r\n" },
        /* charge (0 ready), voltage, calibration, capacity, samples, targets */
        { NULL, "STR\r\n", "OK00,0,0,0,700,0,0\r\n" },
        { NULL, "CPR\r\n", "OK00,0,1\r\n" }, /* MAV, SCE with UV */
        { NULL, "CPS,2,1\r\n", "ER03\r\n" },
        { NULL, "CPS,1,3\r\n", "OK00\r\n" },
        { NULL, "CPR\r\n", "OK00,1,3\r\n" },
        { NULL, "CPS,0,4\r\n", "ER03\r\n" }, /* UV adjusted: not here */
        { NULL, "CPS,0,1\r\n", "OK00\r\n" },
        { NULL, "MDR,2\r\n", "ER00\r\n" }, /* there is none */
        { NULL, "MES\r\n", "ER07\r\n" },
        { NULL, "CAL\r\n", "ER07\r\n" },
        { "place black", "UZC\r\n", "OK00\r\n" },
        { NULL, "MES\r\n", "ER24\r\n" },
        { NULL, "CAL\r\n", "ER11\r\n" },
        { "place white", "CAL\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,0,0,3,700,0,0\r\n" },
        { "battery 1", "STR\r\n", "OK00,0,1,3,700,0,0\r\n" },
        { "battery 2", "MES\r\n", "ER02\r\n" },
        { "charge", "SDR,1, 0, 1\r\n", "ER10\r\n" },
        { NULL, "SDR,7, 0, 1\r\n", "ER03\r\n" },
        { "expect writes 0", "WMS,0\r\n", "OK00\r\n" },
        { NULL, "CDS,0,0,1\r\n", "ER03\r\n" },
        { NULL, "WMS,1\r\n", "OK00\r\n" },
        { "expect writes 3", "SWE\r\n", "OK00\r\n" },
        { "lamp dead", "MES\r\n", "ER05\r\n" },
        { "lamp ok", "ID\x01\r\n", "ER08\r\n" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (rows[i].act != NULL)
            conversation_act(&c, rows[i].act);
        asked(rows[i].request, rows[i].reply);
    }
}

/* One line in mode 0, two in 1, ... four in 3; the first two are SCI and SCE. */
static void test_lines_of_the_modes(void)
{
    static const char *const modes[] = { "CPS,0,0\r\n", "CPS,0,1\r\n", "CPS,0,2\r\n",
                                         "CPS,0,3\r\n" };
    calibrate();
    for (size_t mode = 0; mode < 4; mode++) {
        asked(modes[mode], "OK00\r\n");
        conversation_ask(&c, "MES\r\n", 12);
        TEST_ASSERT_EQUAL_INT(mode + 1, lines());
        for (size_t i = 0; i <= mode; i++)
            line_is(i, i % 2 == 0);
    }
}

static void test_the_flash_charges(void)
{
    calibrate();
    /* 1.5 s, then 2 x 240 bytes at 9600 baud */
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "MES\r\n", 1.4));
    conversation_hear(&c, 0.35);
    TEST_ASSERT_EQUAL_INT(1, lines());
    conversation_hear(&c, 0.35);
    TEST_ASSERT_EQUAL_INT(1, lines());
    TEST_ASSERT_EQUAL_STRING("OK00,1,0,3,700,0,0\r\n", conversation_ask(&c, "STR\r\n", 0.3));
    TEST_ASSERT_EQUAL_STRING("ER27\r\n", conversation_ask(&c, "MES\r\n", 0.3));
    conversation_hear(&c, 3);
    asked("STR\r\n", "OK00,0,0,3,700,0,0\r\n");
}

static void test_a_press_comes_unasked(void)
{
    calibrate();
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_STRING("", conversation_hear(&c, 12));
    asked("SWE\r\n", "OK00\r\n");
    conversation_act(&c, "press");
    conversation_hear(&c, 12);
    TEST_ASSERT_EQUAL_INT(2, lines());
    line_is(1, false);
}

static void test_without_a_dot(void)
{
    again("dot=0,noise=0,delays=0,type=13");
    TEST_ASSERT_EQUAL_STRING("OK00,13,104,01001234,0,360,740,10\r\n",
                             conversation_ask(&c, "IDR\r\n", 0));
    calibrate();
    conversation_ask(&c, "MES\r\n", 0);
    TEST_ASSERT_EQUAL_INT(240 * 2, c.n);
    double truth = sim_cm2600d.truth(c.sim, 360, true);
    TEST_ASSERT_DOUBLE_WITHIN(0.6, truth * 1e4, conversation_number(&c, 1, ","));
}

static void test_memory_and_plate(void)
{
    again("samples=1,noise=0");
    conversation_ask(&c, "SDR,1, 0, 1\r\n", 5);
    TEST_ASSERT_EQUAL_STRING_LEN("OK00,1,0\r\nOK00,", c.text, 15);
    line_is(1, false);
    asked("SDR,1, 0, 2\r\n", "ER10\r\n");
    asked("SDR,2, 0, 1\r\n", "ER10\r\n");
    conversation_ask(&c, "CDR,0,0\r\n", 5);
    TEST_ASSERT_EQUAL_INT(40, conversation_fields(&c, ","));
    TEST_ASSERT_DOUBLE_WITHIN(15, 95, conversation_number(&c, 20, ",")); /* percent */
}

static void test_faults_of_a_shot(void)
{
    again("noise=0,delays=0");
    calibrate();
    conversation_act(&c, "fault calibration_lost");
    asked("MES\r\n", "ER07\r\n");
    asked("STR\r\n", "OK00,0,0,0,700,0,0\r\n");
    calibrate();
    conversation_act(&c, "fault swapped on 2");
    conversation_ask(&c, "MES\r\n", 0);
    line_is(0, true);
    line_is(1, true);
    conversation_act(&c, "differ 1");
    conversation_ask(&c, "MES\r\n", 0);
    TEST_ASSERT_EQUAL_STRING_LEN("OK05,", c.text, 5);
    conversation_act(&c, "differ 0");
    conversation_act(&c, "place bright");
    conversation_ask(&c, "MES\r\n", 0);
    TEST_ASSERT_EQUAL_STRING_LEN("OK09,175.0,", c.text, 11);
    conversation_act(&c, "fault battery_dies");
    asked("MES\r\n", "");
    asked("STR\r\n", "");
    conversation_act(&c, "reset");
    asked("STR\r\n", "OK00,0,1,0,700,0,0\r\n");
    again("operator=1");
    asked("UZC\r\n", "OK00\r\n");
    asked("CAL\r\n", "OK00\r\n");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_texts);
    RUN_TEST(test_lines_of_the_modes);
    RUN_TEST(test_the_flash_charges);
    RUN_TEST(test_a_press_comes_unasked);
    RUN_TEST(test_without_a_dot);
    RUN_TEST(test_memory_and_plate);
    RUN_TEST(test_faults_of_a_shot);
    return UNITY_END();
}
