/* test_km_ascii_wire.c - lines of the CM-700d and the CM-2600d, as the programs that speak to them
 * describe them. */
#include "drivers/km_ascii/km_ascii_wire.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static struct km_reply read_reply(const char *line)
{
    struct km_reply reply;
    TEST_ASSERT_TRUE_MESSAGE(km_read_reply(line, &reply), line);
    return reply;
}

/* ---- a line ------------------------------------------------------------------------- */

static const struct reply_case {
    const char *line;
    bool good, ok;
    unsigned code;
    size_t fields;
} reply_cases[] = {
    { "OK00", true, true, 0, 0 },      { "OK03", true, true, 3, 0 },
    { "ER35", true, false, 35, 0 },    { "OK00,1", true, true, 0, 1 },
    { "OK00,", true, true, 0, 1 }, /* one field, empty */
    { "OK00,1,,2", true, true, 0, 3 }, { "", false, false, 0, 0 },
    { "OK0", false, false, 0, 0 },     { "OK001", false, false, 0, 0 },
    { "OK00 ,1", false, false, 0, 0 }, { "ok00", false, false, 0, 0 },
    { "OR00", false, false, 0, 0 },    { "OK0A,1", false, false, 0, 0 },
    { " OK00", false, false, 0, 0 },
};

static void test_replies(void)
{
    for (size_t i = 0; i < sizeof reply_cases / sizeof *reply_cases; i++) {
        const struct reply_case *c = &reply_cases[i];
        struct km_reply reply;
        TEST_ASSERT_EQUAL_MESSAGE(c->good, km_read_reply(c->line, &reply), c->line);
        if (!c->good)
            continue;
        TEST_ASSERT_EQUAL_MESSAGE(c->ok, reply.ok, c->line);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->code, reply.code, c->line);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->fields, reply.fields, c->line);
    }
}

static void test_too_many_fields(void)
{
    char line[4 + KM_MAX_FIELDS + 2] = "OK00";
    struct km_reply reply;
    memset(line + 4, ',', KM_MAX_FIELDS);
    line[4 + KM_MAX_FIELDS] = '\0';
    TEST_ASSERT_TRUE(km_read_reply(line, &reply));
    TEST_ASSERT_EQUAL_size_t(KM_MAX_FIELDS, reply.fields);
    strcat(line, ",");
    TEST_ASSERT_FALSE(km_read_reply(line, &reply));
}

static const struct number_case {
    const char *text;
    unsigned most;
    bool good;
    unsigned expect;
} number_cases[] = {
    { "0", 9, true, 0 },
    { "007", 9, true, 7 },
    { "10", 9, false, 0 },
    { "", 9, false, 0 },
    { "+1", 9, false, 0 },
    { "-1", 9, false, 0 },
    { " 1", 9, false, 0 },
    { "1.", 9, false, 0 },
    { "999999999", 999999999, true, 999999999 },
    { "4294967297", 9, false, 0 },
    { "0x1", 9, false, 0 },
};

static void test_numbers(void)
{
    for (size_t i = 0; i < sizeof number_cases / sizeof *number_cases; i++) {
        const struct number_case *c = &number_cases[i];
        unsigned value = 77;
        bool good =
            km_read_unsigned((struct km_field){ c->text, strlen(c->text) }, c->most, &value);
        TEST_ASSERT_EQUAL_MESSAGE(c->good, good, c->text);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->good ? c->expect : 77, value, c->text);
    }
}

/* ---- codes -------------------------------------------------------------------------- */

/* expect: the tables of codes in the MATLAB class (CM-700d) and in color4j (CM-2600d) */
static const struct code_case {
    const char *line;
    int of_700, of_2600; /* enum driver_result; -1: not in the table */
    unsigned warnings;
} code_cases[] = {
    { "OK00", DRIVER_OK, DRIVER_OK, 0 },
    { "OK02", DRIVER_OK, DRIVER_OK, DRIVER_WARNING_LAMP_WEAK },
    { "OK03", DRIVER_OK, DRIVER_OK, DRIVER_WARNING_BATTERY_LOW },
    { "OK04", DRIVER_OK, DRIVER_OK, DRIVER_WARNING_LAMP_WEAK | DRIVER_WARNING_BATTERY_LOW },
    { "OK05", -1, DRIVER_OK, DRIVER_WARNING_CONDITIONS_DIFFER },
    { "OK09", DRIVER_OK, -1, DRIVER_WARNING_OVER_RANGE },
    { "OK01", -1, -1, 0 },
    { "ER00", DRIVER_PROTOCOL, DRIVER_PROTOCOL, 0 },
    { "ER01", -1, -1, 0 },
    { "ER02", DRIVER_BATTERY, DRIVER_BATTERY, 0 },
    { "ER03", DRIVER_PROTOCOL, -1, 0 },
    { "ER05", DRIVER_FAULT, DRIVER_FAULT, 0 },
    { "ER07", DRIVER_REFUSED, DRIVER_REFUSED, 0 },
    { "ER08", DRIVER_PROTOCOL, DRIVER_PROTOCOL, 0 },
    { "ER10", DRIVER_REFUSED, DRIVER_REFUSED, 0 },
    { "ER11", DRIVER_IMPLAUSIBLE, DRIVER_IMPLAUSIBLE, 0 },
    { "ER13", DRIVER_FAULT, DRIVER_FAULT, 0 },
    { "ER17", DRIVER_FAULT, -1, 0 },
    { "ER20", DRIVER_FAULT, DRIVER_FAULT, 0 },
    { "ER22", DRIVER_REFUSED, -1, 0 },
    { "ER24", DRIVER_REFUSED, DRIVER_REFUSED, 0 },
    { "ER25", DRIVER_REFUSED, DRIVER_REFUSED, 0 },
    { "ER27", DRIVER_FAULT, DRIVER_BUSY, 0 }, /* the charger; the lamp is not charged */
    { "ER28", DRIVER_BUSY, -1, 0 },
    { "ER35", DRIVER_BUSY, -1, 0 },
    { "ER36", DRIVER_REFUSED, -1, 0 },
    { "ER69", DRIVER_REFUSED, -1, 0 },
    { "ER99", -1, -1, 0 },
};

static void check_code(const struct km_dialect *dialect, int expect, const struct code_case *c)
{
    struct km_reply reply = read_reply(c->line);
    const struct km_code *code = km_find_code(dialect, &reply);
    if (expect < 0) {
        TEST_ASSERT_NULL_MESSAGE(code, c->line);
        return;
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(code, c->line);
    TEST_ASSERT_EQUAL_INT_MESSAGE(expect, code->result, c->line);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(c->warnings, code->warnings, c->line);
    TEST_ASSERT_EQUAL_MESSAGE(reply.ok, strlen(code->text) == 0, c->line);
}

static void test_codes(void)
{
    size_t n700 = 0, n2600 = 0, cases = sizeof code_cases / sizeof *code_cases, of_700 = 0,
           of_2600 = 0;
    for (size_t i = 0; i < cases; i++) {
        check_code(&km_cm700d, code_cases[i].of_700, &code_cases[i]);
        check_code(&km_cm2600d, code_cases[i].of_2600, &code_cases[i]);
        of_700 += code_cases[i].of_700 >= 0;
        of_2600 += code_cases[i].of_2600 >= 0;
    }
    while (km_cm700d.codes[n700].text != NULL)
        n700++;
    while (km_cm2600d.codes[n2600].text != NULL)
        n2600++;
    TEST_ASSERT_EQUAL_size_t(of_700, n700); /* no row that is not above */
    TEST_ASSERT_EQUAL_size_t(of_2600, n2600);
}

/* ---- identity ----------------------------------------------------------------------- */

static const struct identity_case {
    const char *line;
    const struct km_dialect *expect;
    const char *model, *serial, *firmware;
    double first_nm;
    size_t bands;
} identity_cases[] = {
    { "OK00,0100,104,00012345,0,400,700,10", &km_cm700d, "CM-700d", "00012345", "1.04", 400, 31 },
    { "OK00,03,104,1234567,0,360,740,10", &km_cm2600d, "CM-2600d", "1234567", "1.04", 360, 39 },
    { "OK00,13,099,1234567,0,360,740,10", &km_cm2600d, "CM-2500d", "1234567", "0.99", 360, 39 },
    { "OK00,0100,1.10,,0,400,700,10", &km_cm700d, "CM-700d", "", "1.10", 400, 31 },
    { "OK00,0100,104, A 1 ,0,400,700,10", &km_cm700d, "CM-700d", "A 1", "1.04", 400, 31 },
    { "OK00,0100,104,1,0,400,700,5", &km_cm700d, "CM-700d", "1", "1.04", 400, 61 },
    { "OK00,0199,104,1,0,400,700,10", NULL, "0199", NULL, NULL, 0, 0 }, /* another model */
    { "OK00,23,104,1,0,360,740,10", NULL, "23", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,1,400,700,10", NULL, "0100", NULL, NULL, 0, 0 }, /* another geometry */
    { "OK00,0100,104,1,0,400,700", NULL, "0100", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,0,400,700,10,1", NULL, "0100", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,0,700,400,10", NULL, "0100", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,0,400,700,0", NULL, "0100", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,0,400,700,7", NULL, "0100", NULL, NULL, 0, 0 },
    { "OK00,0100,104,1,0,300,1000,1", NULL, "0100", NULL, NULL, 0, 0 }, /* more than a line has */
    { "OK00", NULL, "", NULL, NULL, 0, 0 },
    { "ER00", NULL, "", NULL, NULL, 0, 0 },
};

static void test_identities(void)
{
    for (size_t i = 0; i < sizeof identity_cases / sizeof *identity_cases; i++) {
        const struct identity_case *c = &identity_cases[i];
        struct driver_identity is;
        struct km_reply reply = read_reply(c->line);
        TEST_ASSERT_EQUAL_PTR_MESSAGE(c->expect, km_read_identity(&reply, &is), c->line);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->model, is.model, c->line);
        if (c->expect == NULL)
            continue;
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->serial, is.serial, c->line);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->firmware, is.firmware, c->line);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(c->first_nm, is.grid[0].first_nm, c->line);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c->bands, is.grid[0].n, c->line);
    }
}

static void test_serial_number_is_cut(void)
{
    char line[400];
    struct driver_identity is;
    snprintf(line, sizeof line, "OK00,0100,104,%0300d,0,400,700,10", 7);
    struct km_reply reply = read_reply(line);
    TEST_ASSERT_EQUAL_PTR(&km_cm700d, km_read_identity(&reply, &is));
    TEST_ASSERT_EQUAL_size_t(DRIVER_NAME_SIZE - 1, strlen(is.serial));
}

/* ---- state and settings ------------------------------------------------------------- */

static const struct state_case {
    const struct km_dialect *dialect;
    const char *line;
    bool good, ready, zero, white, user, recalibrate;
    unsigned voltage, samples;
} state_cases[] = {
    { &km_cm700d, "OK00,1,0,3,4000,12,2,0,0", true, true, false, false, false, false, 0, 12 },
    { &km_cm700d, "OK00,0,1,0,4000,0,0,0,1", true, false, true, true, true, true, 1, 0 },
    { &km_cm700d, "OK00,1,2,1,4000,0,0,0,0", true, true, false, true, true, false, 2, 0 },
    { &km_cm700d, "OK03,1,1,2,4000,0,0,1,0", true, true, false, false, true, false, 1, 0 },
    { &km_cm700d, "OK00,2,0,3,4000,12,2,0,0", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm700d, "OK00,1,3,3,4000,12,2,0,0", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm700d, "OK00,1,0,4,4000,12,2,0,0", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm700d, "OK00,1,0,3,4000,12,2,0", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm700d, "ER35", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm2600d, "OK00,0,0,2,1700,12,2", true, true, false, false, false, false, 0, 12 },
    { &km_cm2600d, "OK00,1,1,1,1700,0,0", true, false, false, true, true, false, 1, 0 },
    { &km_cm2600d, "OK00,0,0,0,1700,0,0", true, true, true, true, true, false, 0, 0 },
    { &km_cm2600d, "OK00,0,2,0,1700,0,0", false, 0, 0, 0, 0, 0, 0, 0 },
    { &km_cm2600d, "OK00,0,0,3,1700,0,0,0,0", false, 0, 0, 0, 0, 0, 0, 0 },
};

static void test_states(void)
{
    for (size_t i = 0; i < sizeof state_cases / sizeof *state_cases; i++) {
        const struct state_case *c = &state_cases[i];
        struct km_reply reply = read_reply(c->line);
        struct km_state s;
        TEST_ASSERT_EQUAL_MESSAGE(c->good, c->dialect->read_state(&reply, &s), c->line);
        if (!c->good)
            continue;
        TEST_ASSERT_EQUAL_MESSAGE(c->ready, s.flash_ready, c->line);
        TEST_ASSERT_EQUAL_MESSAGE(c->zero, s.due[DRIVER_CALIBRATION_ZERO], c->line);
        TEST_ASSERT_EQUAL_MESSAGE(c->white, s.due[DRIVER_CALIBRATION_WHITE], c->line);
        TEST_ASSERT_EQUAL_MESSAGE(c->user, s.user_due, c->line);
        TEST_ASSERT_EQUAL_MESSAGE(c->recalibrate, s.recalibrate, c->line);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->voltage, s.voltage, c->line);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(c->samples, s.samples, c->line);
    }
}

static void test_settings_there_and_back(void)
{
    char command[KM_COMMAND_SIZE];
    struct km_settings s;
    km_cm700d.write_settings(&(struct km_settings){ 2, 5, 3 }, command);
    TEST_ASSERT_EQUAL_STRING("CPS,2,3,05,03,01", command);
    km_cm2600d.write_settings(&(struct km_settings){ 1, 0, 1 }, command);
    TEST_ASSERT_EQUAL_STRING("CPS,1,1", command);

    struct km_reply reply = read_reply("OK00,2,3,05,03,01");
    TEST_ASSERT_TRUE(km_cm700d.read_settings(&reply, &s));
    TEST_ASSERT_EQUAL_UINT(2, s.area);
    TEST_ASSERT_EQUAL_UINT(5, s.delay_ds);
    TEST_ASSERT_EQUAL_UINT(3, s.averages);
    reply = read_reply("OK00,2,1,00,01,01"); /* SCI only: not ours */
    TEST_ASSERT_TRUE(km_cm700d.read_settings(&reply, &s));
    TEST_ASSERT_EQUAL_UINT(0, s.averages);
    reply = read_reply("OK00,3,3,00,01,01"); /* no such area */
    TEST_ASSERT_FALSE(km_cm700d.read_settings(&reply, &s));
    reply = read_reply("OK00,0,3,00,01,01");
    TEST_ASSERT_FALSE(km_cm700d.read_settings(&reply, &s));
    reply = read_reply("OK00,1,1");
    TEST_ASSERT_TRUE(km_cm2600d.read_settings(&reply, &s));
    TEST_ASSERT_EQUAL_UINT(1, s.area);
    TEST_ASSERT_EQUAL_UINT(1, s.averages);
}

/* ---- spectra ------------------------------------------------------------------------ */

static const struct spectrum_case {
    const struct km_dialect *dialect;
    const char *line;
    enum doubt doubt;
    int32_t first, last; /* counts; three bands */
} spectrum_cases[] = {
    { &km_cm700d, "OK00,2012,2100,10000", DOUBT_NONE, 2012, 10000 },
    { &km_cm700d, "OK00,002012,002100,010000", DOUBT_NONE, 2012, 10000 },
    { &km_cm700d, "OK09,2012,2100,17500", DOUBT_NONE, 2012, 17500 },
    { &km_cm700d, "OK00,20.12,2100,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,-100,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,nan,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012, 2100,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,1e3,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,1000000,2200", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm700d, "OK00,2012,2100", DOUBT_WRONG_COUNT, 0, 0 },
    { &km_cm700d, "OK00,2012,2100,2200,2300", DOUBT_WRONG_COUNT, 0, 0 },
    { &km_cm2600d, "OK00,20.12,04.56,100.0", DOUBT_NONE, 20120, 100000 },
    { &km_cm2600d, "OK00,20.12, 4.56,98.765", DOUBT_NONE, 20120, 98765 },
    { &km_cm2600d, "OK00,02012,00456,10000", DOUBT_NONE, 20120, 100000 },
    { &km_cm2600d, "OK00,20.12,00456,100.0", DOUBT_NO_NUMBER, 0, 0 }, /* with and without a dot */
    { &km_cm2600d, "OK00,02012,04.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm2600d, "OK00,20.1.2,4.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm2600d, "OK00,20.,04.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm2600d, "OK00,.12,04.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm2600d, "OK00,20.1234,4.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
    { &km_cm2600d, "OK00,-0.12,04.56,100.0", DOUBT_NO_NUMBER, 0, 0 },
};

static void test_spectra(void)
{
    for (size_t i = 0; i < sizeof spectrum_cases / sizeof *spectrum_cases; i++) {
        const struct spectrum_case *c = &spectrum_cases[i];
        struct km_reply reply = read_reply(c->line);
        int32_t raw[3];
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->doubt, km_read_spectrum(c->dialect, &reply, 0, 3, raw),
                                      c->line);
        if (c->doubt != DOUBT_NONE)
            continue;
        TEST_ASSERT_EQUAL_INT32_MESSAGE(c->first, raw[0], c->line);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(c->last, raw[2], c->line);
    }
}

/* ---- clock -------------------------------------------------------------------------- */

/* expect: date -u -d @N */
static void test_clock(void)
{
    char command[KM_COMMAND_SIZE];
    km_write_clock(0, command);
    TEST_ASSERT_EQUAL_STRING("DTS,1970,01,01,00,00,00", command);
    km_write_clock(1795339800, command);
    TEST_ASSERT_EQUAL_STRING("DTS,2026,11,22,09,30,00", command);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_replies);
    RUN_TEST(test_too_many_fields);
    RUN_TEST(test_numbers);
    RUN_TEST(test_codes);
    RUN_TEST(test_identities);
    RUN_TEST(test_serial_number_is_cut);
    RUN_TEST(test_states);
    RUN_TEST(test_settings_there_and_back);
    RUN_TEST(test_spectra);
    RUN_TEST(test_clock);
    return UNITY_END();
}
