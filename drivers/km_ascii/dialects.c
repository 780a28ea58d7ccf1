/* dialects.c - what the CM-700d and the CM-2600d say differently, as data. */
#include "drivers/km_ascii/km_ascii_wire.h"

#include <stdio.h>

/* ---- what both mean alike ----------------------------------------------------------- */

#define LOW DRIVER_WARNING_BATTERY_LOW
#define LAMP DRIVER_WARNING_LAMP_WEAK

/* ok, number, result, warnings, reaction, text */
#define SHARED_CODES \
    { true, 0, DRIVER_OK, 0, KM_TELL, "" }, { true, 2, DRIVER_OK, LAMP, KM_TELL, "" }, \
        { true, 3, DRIVER_OK, LOW, KM_TELL, "" }, { true, 4, DRIVER_OK, LAMP | LOW, KM_TELL, "" }, \
        { false, 0,         DRIVER_PROTOCOL, \
          0,     KM_RESEND, "the instrument does not know this command: is this the right driver?" }, \
        { false, 2,       DRIVER_BATTERY, \
          0,     KM_TELL, "the battery is too low to measure: charge it or connect the adapter" }, \
        { false, 5, DRIVER_FAULT, 0, KM_TELL, "the lamp did not flash: have the instrument serviced" }, \
        { false, 7,       DRIVER_REFUSED, \
          0,     KM_TELL, "zero and white calibration are due: calibrate zero, then white" }, \
        { false, 8,         DRIVER_PROTOCOL, \
          0,     KM_RESEND, "the instrument did not understand the line: check the cable" }, \
        { false,          10, \
          DRIVER_REFUSED, 0, \
          KM_EMPTY,       "the instrument has no such data: measure first, or choose another sample" }, \
        { false, \
          11, \
          DRIVER_IMPLAUSIBLE, \
          0, \
          KM_TELL, \
          "the calibration did not succeed: zero box and white plate swapped, or not flat on " \
          "it? Place it again and repeat the step" }, \
        { false, \
          13, \
          DRIVER_FAULT, \
          0, \
          KM_TELL, \
          "the A/D converter failed: switch off and on; if it stays so, have it serviced" }, \
        { false, 20,      DRIVER_FAULT, \
          0,     KM_TELL, "the instrument cannot write its memory: have it serviced" }, \
    { \
        false, 24, DRIVER_REFUSED, 0, KM_TELL, \
            "white calibration is due: place the instrument on its white plate and calibrate" \
    }

static const struct km_code cm700d_codes[] = {
    SHARED_CODES,
    { true, 9, DRIVER_OK, DRIVER_WARNING_OVER_RANGE, KM_TELL, "" },
    { false, 3, DRIVER_PROTOCOL, 0, KM_TELL,
      "the instrument refuses a parameter: is this the right driver, and its firmware current?" },
    { false, 17, DRIVER_FAULT, 0, KM_TELL,
      "the instrument's clock stands still: set it on the instrument; if it stays so, have its "
      "backup battery replaced" },
    { false, 22, DRIVER_REFUSED, 0, KM_TELL,
      "the instrument holds no user calibration data: write it with the maker's program, or "
      "calibrate on the instrument's own plate" },
    { false, 25, DRIVER_REFUSED, 0, KM_MOVE,
      "the slider for the measuring area stands elsewhere: move it" },
    { false, 27, DRIVER_FAULT, 0, KM_TELL,
      "the charging circuit failed: switch off and on; if it stays so, have it serviced" },
    { false, 28, DRIVER_BUSY, 0, KM_WAIT,
      "the flash does not get ready: wait, then check the battery" },
    { false, 35, DRIVER_BUSY, 0, KM_WAIT, "a measurement is in progress: wait for its end" },
    { false, 36, DRIVER_REFUSED, 0, KM_TELL,
      "the user calibration is incomplete: calibrate white again" },
    { false, 69, DRIVER_REFUSED, 0, KM_TELL,
      "target data are protected: take the protection off on the instrument" },
    { .text = NULL },
};

static const struct km_code cm2600d_codes[] = {
    SHARED_CODES,
    { true, 5, DRIVER_OK, DRIVER_WARNING_CONDITIONS_DIFFER, KM_TELL, "" },
    { false, 25, DRIVER_REFUSED, 0, KM_TELL,
      "the conditions are not those of the target: choose no target on the instrument" },
    { false, 27, DRIVER_BUSY, 0, KM_WAIT,
      "the flash does not get ready: wait, then check the battery" },
    { .text = NULL },
};

/* Fields of a reply as small numbers; most[i] is the largest that field i may be. */
static bool read_numbers(const struct km_reply *reply, size_t n, const unsigned *most,
                         unsigned *ret)
{
    if (!reply->ok || reply->fields != n)
        return false;
    for (size_t i = 0; i < n; i++)
        if (!km_read_unsigned(reply->field[i], most[i], &ret[i]))
            return false;
    return true;
}

/* ---- CM-700d ------------------------------------------------------------------------ */

/* STR: flash (1 ready), voltage (0 normal, 1 warning, 2 error), calibration (0 none, 1 white
 * missing, 2 user's missing, 3 complete), capacity, samples, targets, custom, recalibrate. */
static bool read_state_700(const struct km_reply *reply, struct km_state *ret)
{
    static const unsigned most[8] = { 1, 2, 3, 99999, 99999, 99999, 99, 1 };
    unsigned f[8];
    if (!read_numbers(reply, 8, most, f))
        return false;
    *ret = (struct km_state){
        .flash_ready = f[0] == 1,
        .recalibrate = f[7] == 1,
        .due = { f[2] == 0, f[2] <= 1 },
        .user_due = f[2] <= 2,
        .voltage = f[1],
        .samples = f[4],
    };
    return true;
}

/* CPR: area, specular, delay in 0.1 s, averages of the instrument, averages by hand. */
static bool read_settings_700(const struct km_reply *reply, struct km_settings *ret)
{
    static const unsigned most[5] = { 2, 3, 30, 10, 30 };
    unsigned f[5];
    if (!read_numbers(reply, 5, most, f) || f[0] == 0)
        return false;
    /* Other than SCI and SCE, or averaged by hand: nothing that this driver set. */
    bool ours = f[1] == 3 && f[4] == 1;
    *ret = (struct km_settings){ .area = f[0], .delay_ds = f[2], .averages = ours ? f[3] : 0 };
    return true;
}

static void write_settings_700(const struct km_settings *settings, char ret[KM_COMMAND_SIZE])
{
    snprintf(ret, KM_COMMAND_SIZE, "CPS,%u,3,%02u,%02u,01", settings->area, settings->delay_ds,
             settings->averages);
}

const struct km_dialect km_cm700d = {
    /* The CM-600d's id is not known: one line here, once somebody has seen it. */
    .models = (const struct km_model[]){ { "0100", "CM-700d" }, { NULL, NULL } },
    .serial = { 115200, false },
    .codes = cm700d_codes,
    .zero = "ZRC",
    .white = "CAL",
    .white_user = "USC",
    .button_on = "SWS,1",
    .mes = KM_MES_THEN_MDR,
    .area = { 2, 1 },
    .max_averages = 10,
    .max_delay_ms = 3000,
    .has_clock = true,
    .has_plate_id = true,
    .has_samples = true,
    .raw_unit = 1e-4,
    .state_fields = 8,
    .settings_fields = 5,
    .read_state = read_state_700,
    .read_settings = read_settings_700,
    .write_settings = write_settings_700,
};

/* ---- CM-2600d, CM-2500d ------------------------------------------------------------- */

/* STR: flash (0 ready), voltage (0, 1), calibration (0 none, 1 zero only, 2 and 3 complete),
 * capacity, samples, targets. */
static bool read_state_2600(const struct km_reply *reply, struct km_state *ret)
{
    static const unsigned most[6] = { 1, 1, 3, 99999, 99999, 99999 };
    unsigned f[6];
    if (!read_numbers(reply, 6, most, f))
        return false;
    *ret = (struct km_state){
        .flash_ready = f[0] == 0,
        .due = { f[2] == 0, f[2] <= 1 },
        .user_due = f[2] <= 1,
        .voltage = f[1],
        .samples = f[4],
    };
    return true;
}

/* CPR: area, mode.  Mode 1 measures SCI and SCE with ultraviolet. */
static bool read_settings_2600(const struct km_reply *reply, struct km_settings *ret)
{
    static const unsigned most[2] = { 1, 5 };
    unsigned f[2];
    if (!read_numbers(reply, 2, most, f))
        return false;
    *ret = (struct km_settings){ .area = f[0], .averages = f[1] == 1 ? 1 : 0 };
    return true;
}

static void write_settings_2600(const struct km_settings *settings, char ret[KM_COMMAND_SIZE])
{
    snprintf(ret, KM_COMMAND_SIZE, "CPS,%u,1", settings->area);
}

const struct km_dialect km_cm2600d = {
    .models =
        (const struct km_model[]){ { "03", "CM-2600d" }, { "13", "CM-2500d" }, { NULL, NULL } },
    .serial = { 9600, true },
    .codes = cm2600d_codes,
    .zero = "UZC",
    .white = "CAL",
    .button_on = "SWE",
    .mes = KM_MES_ANSWERS,
    .area = { 0, 1 },
    .max_averages = 1,
    .dots = true,
    .raw_unit = 1e-5,
    .state_fields = 6,
    .settings_fields = 2,
    .read_state = read_state_2600,
    .read_settings = read_settings_2600,
    .write_settings = write_settings_2600,
};
