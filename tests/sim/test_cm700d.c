/* test_cm700d.c - the simulated CM-700d against the description of its commands: MATLAB class
 * `CM700` (after KMSE A0E8-CS 0133E) and clsmin700.vb. */
#include "tests/sim/cm700d.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/conversation.h"
#include "unity.h"

static struct conversation c;

void setUp(void)
{
    conversation_begin(&c, &sim_cm700d, "noise=0");
}

void tearDown(void)
{
    if (c.sim != NULL)
        conversation_end(&c);
}

static void again(const char *options)
{
    conversation_end(&c);
    conversation_begin(&c, &sim_cm700d, options);
}

/* Everything is answered within 10 s here, a measurement after its OK00 too. */
static void asked(const char *request, const char *reply)
{
    TEST_ASSERT_EQUAL_STRING_MESSAGE(reply, conversation_ask(&c, request, 10), request);
}

static void calibrate(void)
{
    conversation_act(&c, "place black");
    asked("ZRC\r\n", "OK00\r\n");
    conversation_act(&c, "place white");
    asked("CAL\r\n", "OK00\r\n");
    conversation_act(&c, "place skin");
}

struct exchange {
    const char *act, *request, *reply; /* act, request: NULL for none */
};

static void talk(const struct exchange *row, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (row[i].act != NULL)
            conversation_act(&c, row[i].act);
        if (row[i].request != NULL)
            asked(row[i].request, row[i].reply);
    }
}
#define TALK(rows) talk(rows, sizeof rows / sizeof *rows)

static void test_identity_state_conditions(void)
{
    static const struct exchange rows[] = {
        /* model 0100, ROM, serial number, geometry, first, last, step */
        { NULL, "IDR\r\n", "OK00,0100,104,00012345,0,400,700,10\r\n" },
        /* flash ready, voltage, calibration, capacity, samples, targets, custom, recalibrate */
        { NULL, "STR\r\n", "OK00,1,0,0,4000,0,0,0,0\r\n" },
        { "battery 1", "STR\r\n", "OK00,1,1,0,4000,0,0,0,0\r\n" },
        { "recalibrate 1", "STR\r\n", "OK00,1,1,0,4000,0,0,0,1\r\n" },
        /* area 2 MAV, specular 3 both, delay, averages */
        { NULL, "CPR\r\n", "OK00,2,3,00,01,01\r\n" },
        { NULL, "CPS,2,2,20,1,1\r\n", "OK00\r\n" }, /* as VB pads */
        { NULL, "CPR\r\n", "OK00,2,2,20,01,01\r\n" },
        { NULL, "CPS,2,3,30,10,30\r\n", "OK00\r\n" },
        { NULL, "CPS,2,4,00,01,01\r\n", "ER03\r\n" },
        { NULL, "CPS,2,3,31,01,01\r\n", "ER03\r\n" },
        { NULL, "CPS,2,3,00,11,01\r\n", "ER03\r\n" },
        { NULL, "CPS,2,3,00,01,31\r\n", "ER03\r\n" },
        { NULL, "CPS,1,3,00,01,01\r\n", "ER25\r\n" }, /* the slider stands elsewhere */
        { "slide 1", "CPS,1,3,00,01,01\r\n", "OK00\r\n" },
        { NULL, "CPR\r\n", "OK00,1,3,00,01,01\r\n" },
        { NULL, "XYZ\r\n", "ER00\r\n" },
        { NULL, "IDR,1\r\n", "ER03\r\n" },
        { NULL, "ID\x80\r\n", "ER08\r\n" },
    };
    TALK(rows);
}

static void test_calibration_in_its_order(void)
{
    static const struct exchange rows[] = {
        { NULL, "MES,1\r\n", "ER07\r\n" },
        { NULL, "CAL\r\n", "ER07\r\n" },
        { "place black", "ZRC\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,1,4000,0,0,0,0\r\n" },
        { NULL, "MES,1\r\n", "ER24\r\n" },
        { "place white", "CAL\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n" },
        { "slide 1", "STR\r\n", "OK00,1,0,0,4000,0,0,0,0\r\n" }, /* per area */
        { "slide 2", "STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n" },
        { "place black", "CAL\r\n", "ER11\r\n" }, /* that is not white */
        { "place skin", "ZRC\r\n", "ER11\r\n" },  /* nor that black */
    };
    TALK(rows);
}

static void test_a_white_calibration_counts_for_its_modes(void)
{
    static const struct exchange rows[] = {
        { NULL, "CPS,2,2,00,01,01\r\n", "OK00\r\n" },
        { "place black", "ZRC\r\n", "OK00\r\n" },
        { "place white", "CAL\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n" },
        { NULL, "CPS,2,3,00,01,01\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,1,4000,0,0,0,0\r\n" },
        { NULL, "CAL\r\n", "OK00\r\n" },
        { NULL, "CPS,2,1,00,01,01\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n" },
    };
    TALK(rows);
}

static void test_user_calibration(void)
{
    static const struct exchange without[] = {
        { NULL, "USR\r\n", "OK00,0\r\n" },
        { NULL, "UCR,2,2\r\n", "ER22\r\n" },
        { NULL, "USC\r\n", "ER22\r\n" },
        { NULL, "USS,1\r\n", "ER22\r\n" },
    };
    TALK(without);
    again("user=1,noise=0");
    static const struct exchange with[] = {
        { NULL, "USS,1\r\n", "OK00\r\n" },
        { NULL, "USR\r\n", "OK00,1\r\n" },
        { NULL, "USC\r\n", "ER07\r\n" },
        { "place black", "ZRC\r\n", "OK00\r\n" },
        { "place white", "CAL\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,2,4000,0,0,0,0\r\n" },
        { NULL, "MES,1\r\n", "ER36\r\n" },
        { "place user", "USC\r\n", "OK00\r\n" },
        { NULL, "STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n" },
        { NULL, "MES,1\r\n", "OK00\r\n" },
    };
    TALK(with);
    conversation_ask(&c, "UCR,2,2\r\n", 1);
    TEST_ASSERT_EQUAL_INT(32, conversation_fields(&c, ","));
    TEST_ASSERT_DOUBLE_WITHIN(1e4, 61000, conversation_number(&c, 16, ",")); /* 0.001 % */
}

static void spectrum_is_the_truth(const char *request, bool sci, double tolerance)
{
    conversation_ask(&c, request, 1);
    TEST_ASSERT_EQUAL_INT_MESSAGE(32, conversation_fields(&c, ","), c.text);
    TEST_ASSERT_EQUAL_INT(31 * 7 + 6, c.n); /* 223 bytes a line */
    for (size_t b = 0; b < 31; b++) {
        double truth = sim_cm700d.truth(c.sim, 400.0 + 10.0 * (double)b, sci);
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, truth, conversation_number(&c, b + 1, ",") * 1e-4);
    }
}

static void test_a_measurement_takes_its_time(void)
{
    calibrate();
    TEST_ASSERT_EQUAL_STRING("OK00\r\n", conversation_ask(&c, "MES,1\r\n", 0.1));
    TEST_ASSERT_EQUAL_STRING("ER35\r\n", conversation_ask(&c, "STR\r\n", 0.1));
    TEST_ASSERT_EQUAL_STRING("ER35\r\n", conversation_ask(&c, "MDR,2\r\n", 0.1));
    conversation_hear(&c, 1.5);
    TEST_ASSERT_EQUAL_STRING("OK00,0,0,3,4000,0,0,0,0\r\n", conversation_ask(&c, "STR\r\n", 0.1));
    TEST_ASSERT_EQUAL_STRING("ER28\r\n", conversation_ask(&c, "MES,1\r\n", 0.1)); /* charging */
    spectrum_is_the_truth("MDR,1\r\n", true, 0.6e-4);
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4);
    conversation_hear(&c, 2);
    asked("STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n");
    asked("MDR,3\r\n", "ER03\r\n");
}

static void test_what_lies_there_is_measured(void)
{
    static const char *const places[] = { "place white", "place black", "place user" };
    again("delays=0,seed=7");
    calibrate();
    for (size_t i = 0; i < 3; i++) {
        conversation_act(&c, places[i]);
        asked("MES,1\r\n", "OK00\r\n");
        spectrum_is_the_truth("MDR,1\r\n", true, 0.003);
        spectrum_is_the_truth("MDR,2\r\n", false, 0.003);
    }
}

static void test_no_data_before_and_between(void)
{
    static const struct exchange rows[] = {
        { NULL, "MDR,2\r\n", "ER10\r\n" },
        { NULL, "RDR,1\r\n", "ER10\r\n" },
        { NULL, "CPS,2,3,00,01,02\r\n", "OK00\r\n" },
        { NULL, "MES,1\r\n", "OK00\r\n" },
        { NULL, "MDR,2\r\n", "ER10\r\n" }, /* one of two manual averages */
        { NULL, "MES,1\r\n", "OK00\r\n" },
        { NULL, "MES,2\r\n", "ER03\r\n" },
    };
    calibrate();
    TALK(rows);
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4);
}

/* The sources do not agree on the index where SCE alone is selected. */
static void test_index_of_sce_alone(void)
{
    static const struct exchange fixed[] = {
        { NULL, "CPS,2,2,00,01,01\r\n", "OK00\r\n" },
        { NULL, "MES,1\r\n", "OK00\r\n" },
        { NULL, "MDR,1\r\n", "ER10\r\n" },
    };
    calibrate();
    TALK(fixed);
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4);
    again("noise=0,index=running");
    static const struct exchange running[] = {
        { NULL, "CPS,2,2,00,01,01\r\n", "OK00\r\n" },
        { NULL, "MES,1\r\n", "OK00\r\n" },
        { NULL, "MDR,2\r\n", "ER03\r\n" },
    };
    calibrate();
    TALK(running);
    spectrum_is_the_truth("MDR,1\r\n", false, 0.6e-4);
}

static void test_colours_before_the_spectrum(void)
{
    calibrate();
    asked("MES,1\r\n", "OK00\r\n");
    conversation_act(&c, "place skin");
    conversation_ask(&c, "COR,2,2,04,06\r\n", 1); /* L* of SCE, D65, 10 degrees */
    TEST_ASSERT_DOUBLE_WITHIN(5, 65, conversation_number(&c, 1, ","));
    asked("COR,2,2,06,06\r\n", "ER03\r\n"); /* F6: not here */
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4);
    asked("COR,2,2,04,06\r\n", "ER10\r\n");
}

static void test_button(void)
{
    calibrate();
    conversation_act(&c, "press"); /* not enabled: nothing */
    asked("RDR,1\r\n", "ER10\r\n");
    asked("SWS,1\r\n", "OK00\r\n");
    conversation_act(&c, "press");
    asked("STR\r\n", "ER35\r\n");
    TEST_ASSERT_EQUAL_STRING("", conversation_hear(&c, 5));
    spectrum_is_the_truth("RDR,1\r\n", true, 0.6e-4);
    spectrum_is_the_truth("RDR,2\r\n", false, 0.6e-4);
    asked("RDR,1\r\n", "ER10\r\n"); /* once */
    asked("MDR,1\r\n", "ER10\r\n");
    again("noise=0,notify=line,keep=stays");
    calibrate();
    asked("SWS,1\r\n", "OK00\r\n");
    conversation_act(&c, "press");
    TEST_ASSERT_EQUAL_INT(223, strlen(conversation_hear(&c, 5)));
    spectrum_is_the_truth("RDR,2\r\n", false, 0.6e-4);
    spectrum_is_the_truth("RDR,2\r\n", false, 0.6e-4);
    asked("SWS,0\r\n", "OK00\r\n");
    asked("RDR,2\r\n", "ER10\r\n");
}

static void test_memory(void)
{
    again("samples=2,noise=0");
    static const struct exchange rows[] = {
        { NULL, "STR\r\n", "OK00,1,0,0,3998,2,0,0,0\r\n" },
        { NULL, "SPR,1\r\n", "OK00,2,3,0,2000,01,01,00,00,00,0,S0001\r\n" },
        { NULL, "SPR,3\r\n", "ER10\r\n" },
        { NULL, "SDR,00003,1\r\n", "ER10\r\n" },
        { NULL, "SDR,00001,3\r\n", "ER03\r\n" },
        { "store", "SPR,3\r\n", NULL },
    };
    talk(rows, 5);
    spectrum_is_the_truth("SDR,00001,2\r\n", false, 0.6e-4);
    conversation_act(&c, "expect writes 0");
    conversation_act(&c, "store");
    asked("SDD,2\r\n", "OK00\r\n");
    asked("SAD\r\n", "OK00\r\n");
    asked("SPR,1\r\n", "ER10\r\n");
    conversation_act(&c, "expect writes 2");
    TEST_ASSERT_FALSE(sim_cm700d.act(c.sim, "expect writes 0", c.now_us));
}

static void test_plate_and_clock(void)
{
    static const struct exchange rows[] = {
        { NULL, "CIR\r\n", "OK00,12345678\r\n" },
        { NULL, "CIS,123456789\r\n", "ER03\r\n" },
        { NULL, "CIS,87654321\r\n", "OK00\r\n" },
        { NULL, "CIR\r\n", "OK00,87654321\r\n" },
        { NULL, "CDR,3,1\r\n", "ER03\r\n" },
        { NULL, "CDS,1,1,100000\r\n", "ER03\r\n" },
        { "expect writes 3", "DFS,0\r\n", "OK00\r\n" },
        { NULL, "DTS,2028,02,28,23,59,55\r\n", "OK00\r\n" },
        { NULL, "DTR\r\n", "OK00,2028,02,29,00,00,05\r\n" }, /* 10 s later, a leap year */
        { NULL, "DTS,2028,13,01,00,00,00\r\n", "ER03\r\n" },
        { "clock lost", "DTR\r\n", "ER17\r\n" },
        { NULL, "DTS,2027,03,01,00,00,00\r\n", "OK00\r\n" },
        { NULL, "DTR\r\n", "OK00,2027,03,01,00,00,10\r\n" },
    };
    TALK(rows);
    conversation_ask(&c, "CDR,2,1\r\n", 1);
    TEST_ASSERT_EQUAL_INT(32, conversation_fields(&c, ","));
    for (size_t b = 1; b < 32; b++) /* 0.001 %, in the range that CDS takes */
        TEST_ASSERT_DOUBLE_WITHIN(15000, 95000, conversation_number(&c, b, ","));
}

static void test_warnings_travel_with_the_data(void)
{
    static const struct {
        const char *act[2], *code;
    } rows[] = {
        { { "lamp weak", "battery 0" }, "OK02," },
        { { "lamp ok", "battery 1" }, "OK03," },
        { { "lamp weak", "battery 1" }, "OK04," },
        { { "lamp ok", "place bright" }, "OK09," },
    };
    calibrate();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        conversation_act(&c, rows[i].act[0]);
        conversation_act(&c, rows[i].act[1]);
        conversation_ask(&c, "MES,1\r\n", 10);
        conversation_ask(&c, "MDR,2\r\n", 10);
        TEST_ASSERT_EQUAL_STRING_LEN(rows[i].code, c.text, 5);
    }
}

static void test_battery_and_lamp(void)
{
    calibrate();
    conversation_act(&c, "battery 2");
    asked("MES,1\r\n", "ER02\r\n");
    asked("ZRC\r\n", "ER02\r\n");
    conversation_act(&c, "charge");
    conversation_act(&c, "lamp dead");
    asked("CAL\r\n", "ER05\r\n");
    asked("MES,1\r\n", "OK00\r\n");
    asked("STR\r\n", "ER05\r\n");
    asked("STR\r\n", "OK00,1,0,3,4000,0,0,0,0\r\n");
    asked("MDR,1\r\n", "ER05\r\n");
}

static void test_faults_of_a_shot(void)
{
    calibrate();
    conversation_act(&c, "fault battery_dies");
    asked("MES,1\r\n", "OK00\r\n");
    for (int i = 0; i < 30; i++)
        asked("STR\r\n", "ER35\r\n"); /* five minutes: it only looks unfinished */
    conversation_act(&c, "reset");
    conversation_act(&c, "charge");
    asked("STR\r\n", "OK00,1,0,0,4000,0,0,0,0\r\n");
    calibrate();
    conversation_act(&c, "fault battery_dies 8000");
    asked("MES,1\r\n", "OK00\r\n");
    asked("STR\r\n", "OK00,1,2,3,4000,0,0,0,0\r\n"); /* charged at 9.6 s */
    asked("MDR,1\r\n", "ER10\r\n");
    conversation_act(&c, "charge");
    conversation_act(&c, "fault calibration_lost");
    asked("MES,1\r\n", "OK00\r\n");
    asked("STR\r\n", "OK00,1,0,0,4000,0,0,0,0\r\n");
    asked("MDR,2\r\n", "ER07\r\n");
}

static void test_faults_of_a_spectrum(void)
{
    again("delays=0,noise=0");
    calibrate();
    asked("MES,1\r\n", "OK00\r\n");
    conversation_act(&c, "fault bands 30");
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_EQUAL_INT(31, conversation_fields(&c, ","));
    conversation_act(&c, "fault zero");
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_EQUAL_STRING_LEN("OK00,000000,000000,", c.text, 19);
    conversation_act(&c, "fault over on 2");
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4);
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_EQUAL_STRING_LEN("OK00,025000,025000,", c.text, 19);
    conversation_act(&c, "fault negative");
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_EQUAL_STRING_LEN("OK00,-00500,-00500,", c.text, 19);
    conversation_act(&c, "fault text");
    TEST_ASSERT_NOT_NULL(strstr(conversation_ask(&c, "MDR,2\r\n", 1), ",nan,"));
    conversation_act(&c, "fault swapped from 1");
    spectrum_is_the_truth("MDR,2\r\n", true, 0.6e-4);
    spectrum_is_the_truth("MDR,1\r\n", false, 0.6e-4);
}

/* Not noticed by the instrument: what it tells is turned upside down. */
static void test_white_and_black_swapped(void)
{
    again("careful=0,noise=0,delays=0");
    conversation_act(&c, "place white");
    asked("ZRC\r\n", "OK00\r\n");
    conversation_act(&c, "place black");
    asked("CAL\r\n", "OK00\r\n");
    asked("MES,1\r\n", "OK00\r\n");
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_DOUBLE_WITHIN(200, 9350, conversation_number(&c, 16, ","));
    conversation_act(&c, "place white");
    asked("MES,1\r\n", "OK00\r\n");
    conversation_ask(&c, "MDR,2\r\n", 1);
    TEST_ASSERT_DOUBLE_WITHIN(10, 0, conversation_number(&c, 16, ","));
}

static void test_an_operator_helps(void)
{
    again("operator=1,delays=0,noise=0");
    asked("ZRC\r\n", "OK00\r\n");
    asked("CAL\r\n", "OK00\r\n");
    asked("MES,1\r\n", "OK00\r\n");
    spectrum_is_the_truth("MDR,2\r\n", false, 0.6e-4); /* of the skin that lay there */
}

static void test_options(void)
{
    static const char *const wrong[] = {
        "serial",
        "delays=x",
        "delays=-1",
        "nosuch=1",
        "index=no",
        "lightness=81",
        "delays=1e9",
        "=1",
        "serial=0123456789012345678901234567890123456789012345678901234567890123"
    };
    again("serial=,id=9999,delays=0,variant=cm600d");
    TEST_ASSERT_EQUAL_STRING("OK00,9999,104,,0,400,700,10\r\n", conversation_ask(&c, "IDR\r\n", 0));
    TEST_ASSERT_FALSE(sim_cm700d.act(c.sim, "slide 1", c.now_us)); /* it has none */
    again("binary_serial=1,first_area=0,asleep=1");
    TEST_ASSERT_EQUAL_STRING("", conversation_ask(&c, "\r\n", 1));
    conversation_ask(&c, "IDR\r\n", 1);
    TEST_ASSERT_EQUAL_INT(strlen("OK00,0100,104,,0,400,700,10\r\n") + 1024, c.n);
    asked("CPR\r\n", "OK00,1,3,00,01,01\r\n");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        TEST_ASSERT_NULL_MESSAGE(sim_cm700d.make(wrong[i]), wrong[i]);
}

static void test_the_same_seed_gives_the_same(void)
{
    char first[300];
    for (int round = 0; round < 3; round++) {
        again(round < 2 ? "delays=0,seed=5" : "delays=0,seed=6");
        calibrate();
        asked("MES,1\r\n", "OK00\r\n");
        conversation_ask(&c, "MDR,2\r\n", 1);
        if (round == 0)
            memcpy(first, c.text, c.n + 1);
        TEST_ASSERT_EQUAL_INT(round == 2, strcmp(first, c.text) != 0);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_identity_state_conditions);
    RUN_TEST(test_calibration_in_its_order);
    RUN_TEST(test_a_white_calibration_counts_for_its_modes);
    RUN_TEST(test_user_calibration);
    RUN_TEST(test_a_measurement_takes_its_time);
    RUN_TEST(test_what_lies_there_is_measured);
    RUN_TEST(test_no_data_before_and_between);
    RUN_TEST(test_index_of_sce_alone);
    RUN_TEST(test_colours_before_the_spectrum);
    RUN_TEST(test_button);
    RUN_TEST(test_memory);
    RUN_TEST(test_plate_and_clock);
    RUN_TEST(test_warnings_travel_with_the_data);
    RUN_TEST(test_battery_and_lamp);
    RUN_TEST(test_faults_of_a_shot);
    RUN_TEST(test_faults_of_a_spectrum);
    RUN_TEST(test_white_and_black_swapped);
    RUN_TEST(test_an_operator_helps);
    RUN_TEST(test_options);
    RUN_TEST(test_the_same_seed_gives_the_same);
    return UNITY_END();
}
