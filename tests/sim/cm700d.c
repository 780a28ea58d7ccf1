/* cm700d.c - its commands, one function each. */
#include "tests/sim/cm700d.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "colour/lab.h"
#include "colour/xyz.h"
#include "tests/sim/km_line.h"
#include "tests/sim/sim_options.h"
#include "tests/sim/wall_clock.h"

enum { BANDS = 31, SAMPLES = 50, BINARY_SERIAL = 1024, ANSWER_SIZE = 2048 };

/* Seconds, at delays=1. */
static const double REPLY_S = 0.015, ZERO_S = 4.0, WHITE_S = 3.0, FLASH_S = 1.0, BOTH_S = 1.6,
                    CHARGE_S = 1.5;

struct sample {
    long area, specular;
    struct wall_clock_time at;
    char name[16];
    handheld_spectra R;
};

struct shot {
    bool has, read, told[HANDHELD_MODES]; /* told: since it was taken */
    long specular;
    handheld_spectra R;
};

struct sim {
    struct serial_end end;
    struct handheld body;
    char id[SIM_OPTION_SIZE], rom[SIM_OPTION_SIZE], serial[SIM_OPTION_SIZE], plate[SIM_OPTION_SIZE];
    char variant[SIM_OPTION_SIZE], index[SIM_OPTION_SIZE], notify[SIM_OPTION_SIZE];
    char keep[SIM_OPTION_SIZE];
    double delays, first_area, samples_at_first, user, careful, helped, binary_serial, asleep;

    long specular, delay_ds, automatic, manual, manual_done;
    bool user_on, button_on, recalibrate;
    struct wall_clock clock;

    int64_t measuring_until_us, charged_us; /* measuring_until_us 0: not measuring */
    bool by_button;
    const char *ends_with; /* an error code of the measurement in progress, or NULL */
    bool loses_calibration;
    struct shot taking, last, pressed;
    const char *failed; /* code of the last measurement, or NULL */
    bool failure_told;  /* by STR, which says it once; MDR goes on saying so */

    handheld_spectra plate_data[HANDHELD_PORTS], user_data[HANDHELD_PORTS];
    struct sample sample[SAMPLES];
    size_t samples;
    long writes;
};

/* ---- answers ------------------------------------------------------------------------ */

static int64_t scaled_us(const struct sim *s, double seconds)
{
    return (int64_t)(seconds * 1e6 * s->delays);
}

__attribute__((format(printf, 4, 5))) static void answer(struct sim *s, int64_t now_us,
                                                         double seconds, const char *format, ...)
{
    char text[ANSWER_SIZE];
    va_list list;
    va_start(list, format);
    int n = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    serial_end_reply(&s->end, text, (size_t)n, now_us, scaled_us(s, seconds));
}

static void say(struct sim *s, int64_t now_us, const char *code)
{
    answer(s, now_us, REPLY_S, "%s", code);
}

static void say_ok(struct sim *s, int64_t now_us)
{
    say(s, now_us, "OK00");
}

/* ---- state -------------------------------------------------------------------------- */

static unsigned modes_of(long specular)
{
    return specular == 1 ? 1u << SCI : specular == 2 ? 1u << SCE : 1u << SCI | 1u << SCE;
}

static long area(const struct sim *s)
{
    return (long)s->first_area + (long)s->body.port;
}

/* As STR tells it: 0 none, 1 white missing, 2 the user's missing, 3 complete. */
static int calibration(const struct sim *s)
{
    unsigned modes = modes_of(s->specular);
    if (!s->body.calibration[s->body.port].zeroed)
        return 0;
    if (handheld_calibrated(&s->body, modes, s->user_on))
        return 3;
    return s->user_on && handheld_calibrated(&s->body, modes, false) ? 2 : 1;
}

/* The code of the calibration that is missing, NULL for none. */
static const char *uncalibrated(const struct sim *s)
{
    static const char *const codes[] = { "ER07", "ER24", "ER36", NULL };
    return codes[calibration(s)];
}

static void tell_spectrum(struct sim *s, int64_t now_us, handheld_spectra R, int mode)
{
    char text[ANSWER_SIZE];
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SPECTRUM);
    int bands = f.kind == FAULT_BANDS ? (int)f.a : BANDS;
    bool over = false;
    for (int b = 0; b < BANDS; b++)
        over = over || R[mode][b] > 1.75;
    int n = snprintf(text, sizeof text, "OK%02d", km_line_ok(&s->body, over));
    for (int b = 0; b < bands; b++) {
        double told = km_line_told(&f, R, mode, (size_t)(b % BANDS));
        if (f.kind != FAULT_OVER)
            told = fmin(told, 1.75);
        if (f.kind == FAULT_TEXT && b == 2)
            n += snprintf(text + n, sizeof text - (size_t)n, ",nan");
        else
            n += snprintf(text + n, sizeof text - (size_t)n, ",%06ld", lround(told * 1e4));
    }
    serial_end_reply(&s->end, text, (size_t)n, now_us, scaled_us(s, REPLY_S));
}

static void measurement_ends(struct sim *s, int64_t now_us)
{
    s->charged_us = s->measuring_until_us + scaled_us(s, CHARGE_S);
    s->measuring_until_us = 0;
    s->failed = s->ends_with;
    s->failure_told = false;
    if (s->loses_calibration)
        handheld_forget(&s->body);
    if (s->failed != NULL)
        return;
    if (s->by_button) {
        s->pressed = s->taking;
        s->pressed.has = true;
        if (strcmp(s->notify, "line") == 0)
            tell_spectrum(s, now_us, s->pressed.R, s->specular == 2 ? SCE : SCI);
        return;
    }
    double share = 1.0 / (double)++s->manual_done;
    s->last.specular = s->taking.specular;
    for (int mode = 0; mode < HANDHELD_MODES; mode++)
        for (int b = 0; b < BANDS; b++)
            s->last.R[mode][b] += share * (s->taking.R[mode][b] - s->last.R[mode][b]);
    if (s->manual_done < s->manual)
        return;
    s->manual_done = 0;
    s->last.has = true;
}

/* Let happen what should have by now. */
static void settle(struct sim *s, int64_t now_us)
{
    if (s->measuring_until_us != 0 && now_us >= s->measuring_until_us)
        measurement_ends(s, s->measuring_until_us);
}

static void measurement_begins(struct sim *s, bool by_button, int64_t now_us)
{
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SHOT);
    double each = s->specular == 3 ? BOTH_S : FLASH_S;
    double seconds = (double)s->delay_ds / 10.0 + each * (double)s->automatic;
    s->by_button = by_button;
    s->ends_with = f.kind == FAULT_LAMP || s->body.lamp == LAMP_DEAD ? "ER05" : NULL;
    s->loses_calibration = f.kind == FAULT_CALIBRATION_LOST;
    if (s->loses_calibration)
        s->ends_with = "ER07";
    memset(&s->taking, 0, sizeof s->taking);
    s->taking.specular = s->specular;
    handheld_shoot(&s->body, (unsigned)s->automatic, s->taking.R);
    if (!by_button) {
        s->last.has = s->last.read = false;
        s->pressed.has = false;
    }
    s->measuring_until_us = now_us + 1 + scaled_us(s, seconds);
    if (f.kind == FAULT_BATTERY_DIES) {
        s->body.battery = 2;
        s->ends_with = "ER10";
        s->measuring_until_us = f.a < 0 ? INT64_MAX : now_us + (int64_t)f.a * 1000;
    }
}

/* ---- identity, state and conditions ------------------------------------------------- */

static void identity(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    char text[ANSWER_SIZE];
    size_t n = (size_t)snprintf(text, sizeof text, "OK00,%s,%s,", s->id, s->rom);
    if (s->binary_serial > 0)
        for (int i = 0; i < BINARY_SERIAL; i++) {
            char c = (char)dice_bits(&s->end.dice);
            text[n++] = c == '\n' || c == '\r' ? '\0' : c;
        }
    else
        n += (size_t)snprintf(text + n, sizeof text - n, "%s", s->serial);
    n += (size_t)snprintf(text + n, sizeof text - n, ",0,400,700,10");
    serial_end_reply(&s->end, text, n, now_us, scaled_us(s, REPLY_S));
}

static void state(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    if (s->failed != NULL && strcmp(s->failed, "ER05") == 0 && !s->failure_told) {
        s->failure_told = true;
        say(s, now_us, s->failed);
        return;
    }
    answer(s, now_us, REPLY_S, "OK00,%d,%u,%d,%d,%zu,0,0,%d", now_us >= s->charged_us,
           s->body.battery, calibration(s), 4000 - (int)s->samples, s->samples, s->recalibrate);
}

static void conditions(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    answer(s, now_us, REPLY_S, "OK00,%ld,%ld,%02ld,%02ld,%02ld", area(s), s->specular, s->delay_ds,
           s->automatic, s->manual);
}

static void set_conditions(struct sim *s, char **field, int64_t now_us)
{
    long a, specular, delay, automatic, manual, first = (long)s->first_area;
    if (!km_line_number(field[1], first, first + 1, &a) ||
        !km_line_number(field[2], 1, 3, &specular) || !km_line_number(field[3], 0, 30, &delay) ||
        !km_line_number(field[4], 1, 10, &automatic) || !km_line_number(field[5], 1, 30, &manual)) {
        say(s, now_us, "ER03");
        return;
    }
    if (a != area(s)) {
        say(s, now_us, "ER25");
        return;
    }
    s->specular = specular;
    s->delay_ds = delay;
    s->automatic = automatic;
    s->manual = manual;
    s->manual_done = 0;
    say_ok(s, now_us);
}

static void user_calibration_on(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    answer(s, now_us, REPLY_S, "OK00,%d", s->user_on);
}

static void set_user_calibration(struct sim *s, char **field, int64_t now_us)
{
    long on;
    if (!km_line_number(field[1], 0, 1, &on))
        say(s, now_us, "ER03");
    else if (on == 1 && s->user == 0)
        say(s, now_us, "ER22");
    else {
        s->user_on = on == 1;
        say_ok(s, now_us);
    }
}

/* ---- calibration -------------------------------------------------------------------- */

/* Battery and lamp: before any flash. */
static bool can_flash(struct sim *s, int64_t now_us)
{
    if (s->body.battery == 2)
        say(s, now_us, "ER02");
    else if (s->body.lamp == LAMP_DEAD)
        answer(s, now_us, FLASH_S, "ER05");
    else
        return true;
    return false;
}

static void zero(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    if (!can_flash(s, now_us))
        return;
    if (handheld_zero(&s->body))
        answer(s, now_us, ZERO_S, "OK%02d", km_line_ok(&s->body, false));
    else
        answer(s, now_us, ZERO_S, "ER11");
}

static void white_by(struct sim *s, handheld_spectra standard, bool user, int64_t now_us)
{
    if (!s->body.calibration[s->body.port].zeroed) {
        say(s, now_us, "ER07");
        return;
    }
    if (!can_flash(s, now_us))
        return;
    if (handheld_white(&s->body, standard, user, modes_of(s->specular))) {
        s->recalibrate = false;
        answer(s, now_us, WHITE_S, "OK%02d", km_line_ok(&s->body, false));
    } else {
        answer(s, now_us, WHITE_S, "ER11");
    }
}

static void white(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    white_by(s, s->plate_data[s->body.port], false, now_us);
}

static void white_by_user(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    if (s->user == 0)
        say(s, now_us, "ER22");
    else
        white_by(s, s->user_data[s->body.port], true, now_us);
}

static void plate_id(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    answer(s, now_us, REPLY_S, "OK00,%s", s->plate);
}

static void set_plate_id(struct sim *s, char **field, int64_t now_us)
{
    if (strlen(field[1]) > 8) {
        say(s, now_us, "ER03");
        return;
    }
    memcpy(s->plate, field[1], strlen(field[1]) + 1);
    say_ok(s, now_us);
}

/* field[1], field[2]: area and specular mode, 1 SCI or 2 SCE. */
static bool read_place(const struct sim *s, char **field, size_t *port, int *mode)
{
    long a, specular, first = (long)s->first_area;
    if (!km_line_number(field[1], first, first + 1, &a) ||
        !km_line_number(field[2], 1, 2, &specular))
        return false;
    *port = (size_t)(a - first);
    *mode = specular == 1 ? SCI : SCE;
    return true;
}

static void tell_data(struct sim *s, handheld_spectra *data, char **field, int64_t now_us)
{
    char text[ANSWER_SIZE];
    size_t port;
    int mode;
    if (!read_place(s, field, &port, &mode)) {
        say(s, now_us, "ER03");
        return;
    }
    int n = snprintf(text, sizeof text, "OK00");
    for (int b = 0; b < BANDS; b++)
        n += snprintf(text + n, sizeof text - (size_t)n, ",%06ld",
                      lround(data[port][mode][b] * 1e5));
    serial_end_reply(&s->end, text, (size_t)n, now_us, scaled_us(s, REPLY_S));
}

static void set_data(struct sim *s, handheld_spectra *data, long min, long max, char **field,
                     int64_t now_us)
{
    size_t port;
    int mode;
    long value[BANDS];
    bool good = read_place(s, field, &port, &mode);
    for (int b = 0; good && b < BANDS; b++)
        good = km_line_number(field[3 + b], min, max, &value[b]);
    if (!good) {
        say(s, now_us, "ER03");
        return;
    }
    for (int b = 0; b < BANDS; b++)
        data[port][mode][b] = (double)value[b] / 1e5;
    say_ok(s, now_us);
}

static void plate_data(struct sim *s, char **field, int64_t now_us)
{
    tell_data(s, s->plate_data, field, now_us);
}

static void set_plate_data(struct sim *s, char **field, int64_t now_us)
{
    set_data(s, s->plate_data, 80000, 110000, field, now_us);
}

static void user_data(struct sim *s, char **field, int64_t now_us)
{
    if (s->user == 0)
        say(s, now_us, "ER22");
    else
        tell_data(s, s->user_data, field, now_us);
}

static void set_user_data(struct sim *s, char **field, int64_t now_us)
{
    set_data(s, s->user_data, 50000, 150000, field, now_us);
    s->user = 1;
}

/* ---- measuring ---------------------------------------------------------------------- */

static void measure(struct sim *s, char **field, int64_t now_us)
{
    if (strcmp(field[1], "1") != 0)
        say(s, now_us, "ER03");
    else if (s->body.battery == 2)
        say(s, now_us, "ER02");
    else if (uncalibrated(s) != NULL)
        say(s, now_us, uncalibrated(s));
    else if (now_us < s->charged_us)
        say(s, now_us, "ER28");
    else {
        measurement_begins(s, false, now_us);
        answer(s, now_us, REPLY_S, "OK%02d", km_line_ok(&s->body, false));
    }
}

/* Which spectrum k means; -1: ER03, -2: ER10. */
static int mode_of(const struct sim *s, const char *k, long specular)
{
    long number;
    if (!km_line_number(k, 1, 2, &number))
        return -1;
    if (strcmp(s->index, "running") == 0 && specular != 3)
        return number != 1 ? -1 : specular == 1 ? SCI : SCE;
    int mode = number == 1 ? SCI : SCE;
    return (modes_of(specular) & 1u << mode) != 0 ? mode : -2;
}

static bool no_data(struct sim *s, const struct shot *shot, int mode, int64_t now_us)
{
    if (!shot->has && s->failed != NULL)
        say(s, now_us, s->failed);
    else if (mode == -1)
        say(s, now_us, "ER03");
    else if (!shot->has || mode == -2)
        say(s, now_us, "ER10");
    else
        return false;
    return true;
}

static void last_spectrum(struct sim *s, char **field, int64_t now_us)
{
    int mode = mode_of(s, field[1], s->last.specular == 0 ? s->specular : s->last.specular);
    if (no_data(s, &s->last, mode, now_us))
        return;
    s->last.read = true;
    tell_spectrum(s, now_us, s->last.R, mode);
}

static void pressed_spectrum(struct sim *s, char **field, int64_t now_us)
{
    int mode = mode_of(s, field[1], s->pressed.specular == 0 ? s->specular : s->pressed.specular);
    if (no_data(s, &s->pressed, mode, now_us))
        return;
    if (s->pressed.told[mode] && strcmp(s->keep, "once") == 0) {
        say(s, now_us, "ER10");
        return;
    }
    s->pressed.told[mode] = s->pressed.read = true;
    tell_spectrum(s, now_us, s->pressed.R, mode);
}

/* obs, ill and val to a number; false for one that is not known here. */
static bool colour(handheld_spectra R, int mode, long obs, long ill, long val, double *ret)
{
    static const enum illuminant known[12] = {
        [1] = ILLUMINANT_A,   [2] = ILLUMINANT_C,   [3] = ILLUMINANT_D50,  [4] = ILLUMINANT_D65,
        [5] = ILLUMINANT_FL2, [7] = ILLUMINANT_FL7, [10] = ILLUMINANT_FL11
    };
    struct xyz_weights w;
    double XYZ[3], Lab[3], LCh[3];
    if (val > 10 || ill == 6 || ill == 8 || ill == 9 || ill == 11 ||
        xyz_weights_init(known[ill], obs == 1 ? OBSERVER_2DEG : OBSERVER_10DEG, 400, 10, BANDS,
                         &w) != STATUS_OK)
        return false;
    xyz_from_reflectance(&w, R[mode], XYZ);
    lab_from_xyz(XYZ, w.white, Lab);
    lab_to_lch(Lab, LCh);
    double sum = XYZ[0] + XYZ[1] + XYZ[2];
    const double all[10] = { XYZ[0], XYZ[1], XYZ[2], XYZ[0] / sum, XYZ[1] / sum,
                             Lab[0], Lab[1], Lab[2], LCh[1],       LCh[2] };
    *ret = all[val - 1];
    return true;
}

static void tell_colour(struct sim *s, struct shot *shot, char **field, int64_t now_us)
{
    long obs, ill, val;
    double x;
    int mode = mode_of(s, field[1], shot->specular == 0 ? s->specular : shot->specular);
    if (no_data(s, shot, mode, now_us))
        return;
    if (shot->read) /* the spectrum takes it away */
        say(s, now_us, "ER10");
    else if (!km_line_number(field[2], 1, 2, &obs) || !km_line_number(field[3], 1, 11, &ill) ||
             !km_line_number(field[4], 1, 16, &val) || !colour(shot->R, mode, obs, ill, val, &x))
        say(s, now_us, "ER03");
    else
        answer(s, now_us, REPLY_S, "OK%02d,%.4f", km_line_ok(&s->body, false), x);
}

static void last_colour(struct sim *s, char **field, int64_t now_us)
{
    tell_colour(s, &s->last, field, now_us);
}

static void pressed_colour(struct sim *s, char **field, int64_t now_us)
{
    tell_colour(s, &s->pressed, field, now_us);
}

static void set_button(struct sim *s, char **field, int64_t now_us)
{
    long on;
    if (!km_line_number(field[1], 0, 1, &on)) {
        say(s, now_us, "ER03");
        return;
    }
    s->button_on = on == 1;
    s->pressed.has = false;
    say_ok(s, now_us);
}

/* ---- memory and clock --------------------------------------------------------------- */

static bool store(struct sim *s, int64_t now_us)
{
    if (s->samples == SAMPLES)
        return false;
    struct sample *sample = &s->sample[s->samples];
    memset(sample, 0, sizeof *sample);
    sample->area = area(s);
    sample->specular = 3;
    sample->at = wall_clock_now(&s->clock, now_us);
    snprintf(sample->name, sizeof sample->name, "S%04zu", ++s->samples);
    handheld_spectrum_of(&s->body, s->body.under, sample->R);
    return true;
}

static struct sample *find(struct sim *s, const char *field, int64_t now_us)
{
    long number;
    if (!km_line_number(field, 1, 99999, &number))
        say(s, now_us, "ER03");
    else if (number > (long)s->samples)
        say(s, now_us, "ER10");
    else
        return &s->sample[number - 1];
    return NULL;
}

static void sample_header(struct sim *s, char **field, int64_t now_us)
{
    const struct sample *p = find(s, field[1], now_us);
    if (p != NULL)
        answer(s, now_us, REPLY_S, "OK00,%ld,%ld,0,%04d,%02d,%02d,%02d,%02d,%02d,0,%s", p->area,
               p->specular, p->at.year, p->at.month, p->at.day, p->at.hour, p->at.minute,
               p->at.second, p->name);
}

static void sample_spectrum(struct sim *s, char **field, int64_t now_us)
{
    struct sample *p = find(s, field[1], now_us);
    if (p == NULL)
        return;
    int mode = mode_of(s, field[2], p->specular);
    if (mode < 0)
        say(s, now_us, mode == -1 ? "ER03" : "ER10");
    else
        tell_spectrum(s, now_us, p->R, mode);
}

static void delete_sample(struct sim *s, char **field, int64_t now_us)
{
    struct sample *p = find(s, field[1], now_us);
    if (p == NULL)
        return;
    size_t behind = s->samples - (size_t)(p - s->sample) - 1;
    memmove(p, p + 1, behind * sizeof *p);
    s->samples--;
    say_ok(s, now_us);
}

static void delete_samples(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    s->samples = 0;
    say_ok(s, now_us);
}

static void tell_clock(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    struct wall_clock_time t = wall_clock_now(&s->clock, now_us);
    if (s->clock.lost)
        say(s, now_us, "ER17");
    else
        answer(s, now_us, REPLY_S, "OK00,%04d,%02d,%02d,%02d,%02d,%02d", t.year, t.month, t.day,
               t.hour, t.minute, t.second);
}

static void set_clock(struct sim *s, char **field, int64_t now_us)
{
    long v[6];
    static const long min[6] = { 1980, 1, 1, 0, 0, 0 }, max[6] = { 2099, 12, 31, 23, 59, 59 };
    for (int i = 0; i < 6; i++)
        if (!km_line_number(field[1 + i], min[i], max[i], &v[i])) {
            say(s, now_us, "ER03");
            return;
        }
    wall_clock_set(&s->clock,
                   (struct wall_clock_time){ (int)v[0], (int)v[1], (int)v[2], (int)v[3], (int)v[4],
                                             (int)v[5] },
                   now_us);
    say_ok(s, now_us);
}

static void set_date_format(struct sim *s, char **field, int64_t now_us)
{
    long format;
    say(s, now_us, km_line_number(field[1], 0, 2, &format) ? "OK00" : "ER03");
}

/* ---- the list of commands ----------------------------------------------------------- */

static const struct command {
    const char *name;
    size_t arguments;
    void (*run)(struct sim *s, char **field, int64_t now_us);
} commands[] = {
    { "IDR", 0, identity },
    { "STR", 0, state },
    { "CPR", 0, conditions },
    { "CPS", 5, set_conditions },
    { "ZRC", 0, zero },
    { "CAL", 0, white },
    { "USC", 0, white_by_user },
    { "USR", 0, user_calibration_on },
    { "USS", 1, set_user_calibration },
    { "CIR", 0, plate_id },
    { "CIS", 1, set_plate_id },
    { "CDR", 2, plate_data },
    { "CDS", 2 + BANDS, set_plate_data },
    { "UCR", 2, user_data },
    { "UCS", 2 + BANDS, set_user_data },
    { "MES", 1, measure },
    { "MDR", 1, last_spectrum },
    { "RDR", 1, pressed_spectrum },
    { "COR", 4, last_colour },
    { "RCR", 4, pressed_colour },
    { "SWS", 1, set_button },
    { "SPR", 1, sample_header },
    { "SDR", 2, sample_spectrum },
    { "SDD", 1, delete_sample },
    { "SAD", 0, delete_samples },
    { "DTR", 0, tell_clock },
    { "DTS", 6, set_clock },
    { "DFS", 1, set_date_format },
};

static void obey(void *owner, const char *line, int64_t now_us)
{
    struct sim *s = owner;
    char text[SERIAL_END_LINE], *field[KM_FIELDS];
    const struct command *c = commands, *end = c + sizeof commands / sizeof *commands;
    if (s->asleep > 0) {
        s->asleep = 0;
        return;
    }
    if (line == NULL) {
        say(s, now_us, "ER08");
        return;
    }
    memcpy(text, line, strlen(line) + 1);
    size_t n = km_line_split(text, field);
    while (c < end && strcmp(c->name, field[0]) != 0)
        c++;
    s->writes += c < end && strstr("CIS CDS UCS SDD SAD", c->name) != NULL;
    if (c == end)
        say(s, now_us, "ER00");
    else if (n - 1 != c->arguments)
        say(s, now_us, "ER03");
    else if (s->measuring_until_us != 0)
        say(s, now_us, "ER35");
    else
        c->run(s, field, now_us);
}

/* ---- the simulator ------------------------------------------------------------------ */

static void cm700d_free(struct sim *s)
{
    serial_end_done(&s->end);
    free(s);
}

static void power_on(struct sim *s)
{
    s->specular = 3;
    s->delay_ds = 0;
    s->automatic = s->manual = 1;
    s->manual_done = 0;
    s->user_on = s->button_on = false;
    s->measuring_until_us = s->charged_us = 0;
    s->failed = NULL;
    memset(&s->last, 0, sizeof s->last);
    memset(&s->pressed, 0, sizeof s->pressed);
    handheld_forget(&s->body);
}

static bool one_of(const char *value, const char *first, const char *second)
{
    if (strcmp(value, first) == 0 || strcmp(value, second) == 0)
        return true;
    fprintf(stderr, "cm700d: %s has to be %s or %s\n", value, first, second);
    return false;
}

static bool read_options(struct sim *s, const char *options)
{
    const struct sim_option list[] = {
        { .key = "serial", .text = s->serial },
        { .key = "id", .text = s->id },
        { .key = "rom", .text = s->rom },
        { .key = "plate", .text = s->plate },
        { .key = "variant", .text = s->variant },
        { .key = "index", .text = s->index },
        { .key = "notify", .text = s->notify },
        { .key = "keep", .text = s->keep },
        { .key = "delays", .number = &s->delays, .max = 1000 },
        { .key = "seed", .number = &s->body.seed, .max = 1e9 },
        { .key = "lightness", .number = &s->body.lightness, .min = 1, .max = 80 },
        { .key = "noise", .number = &s->body.noise, .max = 0.1 },
        { .key = "first_area", .number = &s->first_area, .max = 1 },
        { .key = "samples", .number = &s->samples_at_first, .max = SAMPLES },
        { .key = "user", .number = &s->user, .max = 1 },
        { .key = "careful", .number = &s->careful, .max = 1 },
        { .key = "operator", .number = &s->helped, .max = 1 },
        { .key = "binary_serial", .number = &s->binary_serial, .max = 1 },
        { .key = "asleep", .number = &s->asleep, .max = 1 },
        { .key = NULL },
    };
    return sim_options_read("cm700d", options, list) && one_of(s->variant, "cm700d", "cm600d") &&
           one_of(s->index, "fixed", "running") && one_of(s->notify, "silent", "line") &&
           one_of(s->keep, "once", "stays");
}

static struct sim *cm700d_make(const char *options)
{
    struct sim *s = calloc(1, sizeof *s);
    if (s == NULL)
        return NULL;
    *s = (struct sim){
        .end = { .host_end = '\n', .own_end = "\r\n" },
        .body = { .bands = BANDS,
                  .first_nm = 400,
                  .step_nm = 10,
                  .under = UNDER_SKIN,
                  .lightness = 65,
                  .noise = 0.0003,
                  .seed = 1,
                  .port = 1 },
        .id = "0100",
        .rom = "104",
        .serial = "00012345",
        .plate = "12345678",
        .variant = "cm700d",
        .index = "fixed",
        .notify = "silent",
        .keep = "once",
        .delays = 1,
        .first_area = 1,
        .careful = 1,
    };
    if (!read_options(s, options)) {
        cm700d_free(s);
        return NULL;
    }
    s->end.dice.state = (uint64_t)s->body.seed;
    s->body.careful = s->careful > 0;
    s->body.helped = s->helped > 0;
    s->body.two_ports = strcmp(s->variant, "cm700d") == 0;
    for (int port = 0; port < HANDHELD_PORTS; port++) {
        handheld_spectrum_of(&s->body, UNDER_WHITE, s->plate_data[port]);
        handheld_spectrum_of(&s->body, UNDER_USER, s->user_data[port]);
    }
    double lightness = s->body.lightness;
    for (int i = 0; i < (int)s->samples_at_first; i++, s->body.lightness = 30 + (i * 7) % 50)
        store(s, 0);
    s->body.lightness = lightness;
    power_on(s);
    return s;
}

static int cm700d_take(struct sim *s, uint8_t channel, const uint8_t *bytes, size_t n,
                       int64_t now_us)
{
    (void)channel;
    settle(s, now_us);
    serial_end_take(&s->end, bytes, n, now_us, obey, s);
    return 0;
}

static ssize_t cm700d_give(struct sim *s, uint8_t channel, uint8_t *bytes, size_t size,
                           int64_t now_us, int64_t *due_us)
{
    (void)channel;
    settle(s, now_us);
    ssize_t n = serial_end_give(&s->end, bytes, size, now_us, due_us);
    if (s->measuring_until_us != 0 && s->measuring_until_us < *due_us)
        *due_us = s->measuring_until_us; /* a line may come unasked then */
    return n;
}

static void press(struct sim *s, int64_t now_us)
{
    if (s->button_on && s->measuring_until_us == 0 && now_us >= s->charged_us &&
        s->body.battery < 2 && uncalibrated(s) == NULL)
        measurement_begins(s, true, now_us);
}

static bool cm700d_act(struct sim *s, const char *action, int64_t now_us)
{
    long n;
    settle(s, now_us);
    if (strncmp(action, "fault ", 6) == 0)
        return faults_add(&s->end.faults, action + 6);
    if (handheld_argument(action, "expect writes", 0, 1000000, &n))
        return s->writes == n;
    if (handheld_argument(action, "expect averages", 1, 10, &n))
        return s->automatic == n;
    if (handheld_argument(action, "recalibrate", 0, 1, &n))
        s->recalibrate = n == 1;
    else if (strcmp(action, "press") == 0)
        press(s, now_us);
    else if (strcmp(action, "store") == 0)
        return store(s, now_us);
    else if (strcmp(action, "clock lost") == 0)
        s->clock.lost = true;
    else if (strcmp(action, "sleep") == 0)
        s->asleep = 1;
    else if (strcmp(action, "forget") == 0)
        handheld_forget(&s->body);
    else if (strcmp(action, "reset") == 0) {
        serial_end_done(&s->end);
        power_on(s);
    } else
        return handheld_act(&s->body, action);
    return true;
}

static double cm700d_truth(const struct sim *s, double nm, bool sci)
{
    return handheld_truth(&s->body, nm, sci);
}

/* The maker's number is known, the product's is not: 2107 stands in for it. */
const struct sim_kind sim_cm700d = {
    SIM_CALLS(cm700d),
    .vid = 0x132b,
    .pid = 0x2107,
    .product = "KONICA MINOLTA CM-700d",
};
