/* test_simulated_options.c - the address of the simulated instrument, taken apart. */
#include "drivers/simulated/options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"

static struct options options;
static struct driver_error error;

void setUp(void)
{
    memset(&options, 0x77, sizeof options);
    memset(&error, 0x55, sizeof error);
}

void tearDown(void)
{
}

/* expect: the column "default" of drivers/simulated/simulated.h */
static void test_defaults(void)
{
    static const char *const nothing[] = { NULL, "", "simulated", "simulated:" };
    for (size_t i = 0; i < sizeof nothing / sizeof *nothing; i++) {
        const struct options *o = &options;
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, options_parse(nothing[i], &options, &error));
        TEST_ASSERT_EQUAL_STRING("SIM-1", o->serial);
        TEST_ASSERT_EQUAL_STRING("two-layer", o->model);
        TEST_ASSERT_TRUE(o->Cm == 0.03 && o->Bm == 0.7 && o->Ch == 0.01 && o->epidermis_mm == 0.08);
        TEST_ASSERT_EQUAL_STRING("", o->spectra);
        TEST_ASSERT_TRUE(o->replicates == 1 && o->pressure == 0.0 && o->surface == 0.04);
        TEST_ASSERT_TRUE(o->seed == 1 && o->noise == 0.0005 && o->placement == 0.02);
        TEST_ASSERT_TRUE(o->unit == 0.004 && o->speed == 1.0);
        TEST_ASSERT_TRUE(o->shot_ms == 600 && o->charge_ms == 1000 && o->calibrate_ms == 2000);
        TEST_ASSERT_TRUE(o->slow_ms == 1500 && o->calibration_shots == 1000);
        TEST_ASSERT_TRUE(o->calibration_minutes == 480 && !o->warns_when_overdue);
        TEST_ASSERT_TRUE(o->battery == 100 && o->drain == 0.05 && o->temperature_C == 24);
        TEST_ASSERT_TRUE(o->stored == 0 && o->button_ms == 0);
        TEST_ASSERT_EQUAL_STRING("", o->button_file);
        TEST_ASSERT_EQUAL_size_t(0, o->faults);
    }
}

/* Numbers: the ends of what simulated.h accepts, which are in, and what lies beyond. */
static const struct number_case {
    const char *key;
    size_t at;
    const char *least, *most, *below, *above;
} number_cases[] = {
#define AT(member) offsetof(struct options, member)
    { "cm", AT(Cm), "0", "1", "-1e-9", "1.001" },
    { "bm", AT(Bm), "0", "1", "-0.1", "1.1" },
    { "ch", AT(Ch), "0", "1", "-0.1", "1.1" },
    { "epidermis_mm", AT(epidermis_mm), "0", "10", "-0.1", "10.1" },
    { "replicates", AT(replicates), "1", "1000", "0", "1001" },
    { "surface", AT(surface), "0", "0.1", "-0.01", "0.11" },
    { "seed", AT(seed), "0", "9007199254740992", "-1", "1e17" },
    { "noise", AT(noise), "0", "0.1", "-0.1", "0.11" },
    { "placement", AT(placement), "0", "0.2", "-0.1", "0.21" },
    { "unit", AT(unit), "0", "0.1", "-0.1", "0.11" },
    { "drift", AT(drift), "-0.1", "0.1", "-0.11", "0.11" },
    { "speed", AT(speed), "0.1", "1000", "0.09", "1001" },
    { "shot_ms", AT(shot_ms), "0", "60000", "-1", "60001" },
    { "charge_ms", AT(charge_ms), "0", "60000", "-1", "60001" },
    { "calibrate_ms", AT(calibrate_ms), "0", "60000", "-1", "60001" },
    { "slow_ms", AT(slow_ms), "0", "600000", "-1", "600001" },
    { "calibration_shots", AT(calibration_shots), "1", "1000000", "0", "1000001" },
    { "calibration_minutes", AT(calibration_minutes), "0", "100000", "-1", "100001" },
    { "battery", AT(battery), "0", "100", "-1", "101" },
    { "drain", AT(drain), "0", "100", "-1", "101" },
    { "temperature", AT(temperature_C), "-40", "80", "-41", "81" },
    { "stored", AT(stored), "0", "9999", "-1", "10000" },
    { "button_ms", AT(button_ms), "0", "3600000", "-1", "3600001" },
};

static enum driver_result parse_pair(const char *key, const char *value)
{
    char address[128];
    snprintf(address, sizeof address, "%s=%s", key, value);
    return options_parse(address, &options, &error);
}

static void test_numbers(void)
{
    for (size_t i = 0; i < sizeof number_cases / sizeof *number_cases; i++) {
        const struct number_case *c = &number_cases[i];
        const double *place = (const double *)(const void *)((const char *)&options + c->at);
        double expect;
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, parse_pair(c->key, c->least), c->key);
        TEST_ASSERT_EQUAL_INT(1, sscanf(c->least, "%lf", &expect));
        TEST_ASSERT_TRUE_MESSAGE(*place == expect, c->key);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, parse_pair(c->key, c->most), c->key);
        TEST_ASSERT_EQUAL_INT(1, sscanf(c->most, "%lf", &expect));
        TEST_ASSERT_TRUE_MESSAGE(*place == expect, c->key);

        const char *const bad[] = { c->below, c->above, "", "x", "1x", "nan", "inf", " 1" };
        for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
            char allowed[64];
            TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_UNSUPPORTED, parse_pair(c->key, bad[k]), c->key);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, c->key), error.text);
            snprintf(allowed, sizeof allowed, "number from %s to %s", c->least, c->most);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, allowed), error.text);
        }
    }
}

#define A31 "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
#define A47 A31 "aaaaaaaaaaaaaaaa"
#define A256 A31 A31 A31 A31 A31 A31 A31 A31 "aaaaaaaa"
#define EIGHT_FAULTS \
    "fault=measure:1:nan,fault=measure:2:nan,fault=measure:3:nan,fault=measure:4:nan," \
    "fault=measure:5:nan,fault=measure:6:nan,fault=measure:7:nan,fault=measure:8:nan"

/* said: what the refusal must contain; NULL: accepted */
static const struct text_case {
    const char *what, *address, *said;
} text_cases[] = {
    { "with the driver's name", "simulated:cm=0.1", NULL },
    { "a comma at the end", "cm=0.1,", NULL },
    { "an empty serial number", "serial=", NULL },
    { "the longest serial number", "serial=" A47, NULL },
    { "a longer one", "serial=" A47 "a", "a text of at most 47 characters" },
    { "a value with = in it", "button_file=/tmp/a=b", NULL },
    { "a path too long for its place", "spectra=" A256 A256, "511 characters" },
    { "a path much too long", "spectra=" A256 A256 A256, "spectra: allowed are 511 characters" },
    { "other model", "model=half-space", NULL },
    { "the paper has no spectra", "model=paper", "two-layer or half-space" },
    { "warns", "overdue=warn", NULL },
    { "refuses", "overdue=refuse", NULL },
    { "neither", "overdue=maybe", "refuse or warn" },
    { "no time at all", "speed=instant", NULL },
    { "misspelt", "speed=instantly", "or \"instant\"" },
    { "half a replicate", "replicates=1.5", "a whole number from 1 to 1000" },
    { "unknown: all are listed", "colour=red",
      "serial, model, cm, bm, ch, epidermis_mm, spectra, replicates, pressure, surface, seed, "
      "noise, placement, unit, drift, speed, shot_ms, charge_ms, calibrate_ms, slow_ms, "
      "calibration_shots, calibration_minutes, overdue, battery, drain, temperature, stored, "
      "button_ms, button_file, fault" },
    { "unknown: named", "colour=red", "'colour'" },
    { "capitals are others", "CM=0.1", "'CM'" },
    { "twice", "cm=0.1,cm=0.1", "cm=0.1: allowed is once" },
    { "no value", "cm", "'cm' is no option" },
    { "no key", "=1", "'=1' is no option" },
    { "a key longer than any", A31 "a=1", "is no option" },
    { "nothing between commas", "cm=0.1,,bm=1", "write key=value" },
    { "the name of another driver", "km_ascii:/dev/ttyACM0", "write key=value" },
    { "nearly the driver's name", "simulatedcm=0.1", "'simulatedcm'" },
    { "a control character", "serial=a\nb", "printable ASCII" },
    { "not ASCII", "serial=\xc3\xa4", "printable ASCII" },
    { "pressure over replicates", "replicates=3,pressure=0.5", NULL },
    { "pressure needs replicates", "pressure=0.5", "set replicates to 2 or more" },
    { "pressure on a file", "replicates=2,pressure=0.5,spectra=x", "not on spectra" },
    { "pressure out of range", "replicates=2,pressure=1.5", "from 0 to 1" },
    { "a fault", "fault=measure:3:silence", NULL },
    { "from the third on", "fault=measure:3+:silence", NULL },
    { "eight faults", EIGHT_FAULTS, NULL },
    { "nine faults", EIGHT_FAULTS ",fault=measure:9:nan", "at most 8" },
    { "fault: no parts", "fault=silence", "OPERATION:N:KIND" },
    { "fault: too many parts", "fault=measure:3:silence:1", "OPERATION:N:KIND" },
    { "fault: no number", "fault=measure:x:silence", "OPERATION:N:KIND" },
    { "fault: counted from 1", "fault=measure:0:silence", "N from 1" },
    { "fault: plus first", "fault=measure:+3:silence", "N from 1" },
    { "fault: two pluses", "fault=measure:3++:silence", "N from 1" },
    { "fault: a number too far", "fault=measure:1000001:silence", "N from 1" },
    { "fault: operations are listed", "fault=shoot:1:silence",
      "open, configure, status, calibrate, measure, wait_button, stored_count, stored_read" },
    { "fault: kinds of measure", "fault=measure:1:no_permission",
      "allowed is silence, slow, gone, garbage, lamp, battery, charge, weak_lamp, expired, "
      "wrong_bands, nan, all_zero" },
    { "fault: kinds of calibrate", "fault=calibrate:1:nan",
      "allowed is silence, slow, gone, garbage, swapped, lamp, battery" },
    { "fault: kinds of open", "fault=open:1:x",
      "allowed is silence, slow, gone, garbage, busy, no_permission" },
    { "fault: kinds of stored_read", "fault=stored_read:1:lamp",
      "allowed is silence, slow, gone, garbage, wrong_bands, nan, all_zero" },
};

static void test_texts(void)
{
    static const struct options untouched;
    for (size_t i = 0; i < sizeof text_cases / sizeof *text_cases; i++) {
        const struct text_case *c = &text_cases[i];
        memset(&options, 0, sizeof options);
        enum driver_result result = options_parse(c->address, &options, &error);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->said == NULL ? DRIVER_OK : DRIVER_UNSUPPORTED, result,
                                      c->what);
        if (c->said == NULL)
            continue;
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, c->said), error.text);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&untouched, &options, sizeof options, c->what);
        TEST_ASSERT_TRUE_MESSAGE(strlen(error.text) < DRIVER_TEXT_SIZE - 1, c->what); /* uncut */
    }
}

static void test_values_arrive(void)
{
    static const char address[] =
        "simulated:serial=7 / b,model=half-space,spectra=a b.csv,speed=instant,overdue=warn,"
        "button_file=/run/press";
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, options_parse(address, &options, &error));
    TEST_ASSERT_EQUAL_STRING("7 / b", options.serial);
    TEST_ASSERT_EQUAL_STRING("half-space", options.model);
    TEST_ASSERT_EQUAL_STRING("a b.csv", options.spectra);
    TEST_ASSERT_TRUE(isinf(options.speed));
    TEST_ASSERT_TRUE(options.warns_when_overdue);
    TEST_ASSERT_EQUAL_STRING("/run/press", options.button_file);
}

/* expect: the plan as it is written */
static void test_faults_by_call(void)
{
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, options_parse("fault=measure:2:nan,fault=measure:4+:gone,"
                                                   "fault=status:2:slow",
                                                   &options, &error));
    static const enum fault expect[] = { FAULT_NONE, FAULT_NAN, FAULT_NONE, FAULT_GONE,
                                         FAULT_GONE };
    for (size_t call = 1; call <= 5; call++)
        TEST_ASSERT_EQUAL_INT(expect[call - 1], options_fault(&options, OPERATION_MEASURE, call));
    TEST_ASSERT_EQUAL_INT(FAULT_SLOW, options_fault(&options, OPERATION_STATUS, 2));
    TEST_ASSERT_EQUAL_INT(FAULT_NONE, options_fault(&options, OPERATION_CALIBRATE, 2));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_defaults);
    RUN_TEST(test_numbers);
    RUN_TEST(test_texts);
    RUN_TEST(test_values_arrive);
    RUN_TEST(test_faults_by_call);
    return UNITY_END();
}
