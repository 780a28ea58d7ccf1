/* cm2600d.c - its commands, one function each. */
#include "tests/sim/cm2600d.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/km_line.h"
#include "tests/sim/sim_options.h"

enum { BANDS = 39, SAMPLES = 50, BINARY_SERIAL = 1024, ANSWER_SIZE = 2048 };

/* Seconds, at delays=1; 10 bits a byte. */
static const double REPLY_S = 0.02, ZERO_S = 5.0, WHITE_S = 4.0, FLASH_S = 1.5, CHARGE_S = 3.0;
static const double BYTE_S = 10.0 / 9600.0;

struct sim {
    struct serial_end end;
    struct handheld body;
    char type[SIM_OPTION_SIZE], rom[SIM_OPTION_SIZE], serial[SIM_OPTION_SIZE];
    double delays, samples_at_first, dot, careful, helped, binary_serial, asleep;

    long mode;
    bool button_on, writing;
    bool differ; /* the conditions are not those of its target */
    int64_t charged_us, measuring_until_us;

    handheld_spectra plate_data[HANDHELD_PORTS], sample[SAMPLES];
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

/* Five characters of percent. */
static int print_value(const struct sim *s, char *at, size_t size, double fraction)
{
    double percent = fraction * 100.0;
    if (s->dot == 0)
        return snprintf(at, size, ",%05ld", lround(percent * 100.0));
    return snprintf(at, size, percent < 99.995 ? ",%05.2f" : ",%05.1f", percent);
}

static void tell_spectrum(struct sim *s, int64_t now_us, double seconds, handheld_spectra R,
                          int mode)
{
    char text[ANSWER_SIZE];
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SPECTRUM);
    int bands = f.kind == FAULT_BANDS ? (int)f.a : BANDS;
    bool over = false;
    for (int b = 0; b < BANDS; b++)
        over = over || R[mode][b] > 1.75;
    int n = snprintf(text, sizeof text, "OK%02d", s->differ ? 5 : km_line_ok(&s->body, over));
    for (int b = 0; b < bands; b++) {
        double told = km_line_told(&f, R, mode, (size_t)(b % BANDS));
        if (f.kind != FAULT_OVER)
            told = fmin(told, 1.75);
        if (f.kind == FAULT_TEXT && b == 2)
            n += snprintf(text + n, sizeof text - (size_t)n, ",  nan");
        else
            n += print_value(s, text + n, sizeof text - (size_t)n, told);
    }
    serial_end_reply(&s->end, text, (size_t)n, now_us, scaled_us(s, seconds));
}

/* ---- identity, state and conditions ------------------------------------------------- */

static void identity(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    char text[ANSWER_SIZE];
    size_t n = (size_t)snprintf(text, sizeof text, "OK00,%s,%s,", s->type, s->rom);
    if (s->binary_serial > 0)
        for (int i = 0; i < BINARY_SERIAL; i++) {
            char c = (char)dice_bits(&s->end.dice);
            text[n++] = c == '\n' || c == '\r' ? '\0' : c;
        }
    else
        n += (size_t)snprintf(text + n, sizeof text - n, "%s", s->serial);
    n += (size_t)snprintf(text + n, sizeof text - n, ",0,360,740,10");
    serial_end_reply(&s->end, text, n, now_us, scaled_us(s, REPLY_S));
}

/* 0 none, 1 zero only, 3 complete. */
static int calibration(const struct sim *s)
{
    if (!s->body.calibration[s->body.port].zeroed)
        return 0;
    return handheld_calibrated(&s->body, 1u << SCI | 1u << SCE, false) ? 3 : 1;
}

static void state(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    /* The sense of the first is the CM-700d's turned round: 0 is ready. */
    answer(s, now_us, REPLY_S, "OK00,%d,%d,%d,%d,%zu,0", now_us<s->charged_us, s->body.battery> 0,
           calibration(s), 700 - (int)s->samples, s->samples);
}

static int area(const struct sim *s)
{
    return s->body.port == 1 ? 0 : 1; /* 0 MAV, 1 SAV */
}

static void conditions(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    answer(s, now_us, REPLY_S, "OK00,%d,%ld", area(s), s->mode);
}

static void set_conditions(struct sim *s, char **field, int64_t now_us)
{
    long a, mode;
    if (!km_line_number(field[1], 0, 1, &a) || !km_line_number(field[2], 0, 3, &mode)) {
        say(s, now_us, "ER03");
        return;
    }
    s->body.port = a == 0 ? 1 : 0;
    s->mode = mode;
    say(s, now_us, "OK00");
}

/* ---- calibration -------------------------------------------------------------------- */

static bool can_flash(struct sim *s, int64_t now_us)
{
    if (s->body.battery == 2)
        say(s, now_us, "ER02");
    else if (s->body.lamp == LAMP_DEAD)
        answer(s, now_us, FLASH_S, "ER05");
    else if (now_us < s->charged_us)
        say(s, now_us, "ER27");
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

static void white(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    if (calibration(s) == 0) {
        say(s, now_us, "ER07");
        return;
    }
    if (!can_flash(s, now_us))
        return;
    if (handheld_white(&s->body, s->plate_data[s->body.port], false, 1u << SCI | 1u << SCE))
        answer(s, now_us, WHITE_S, "OK%02d", km_line_ok(&s->body, false));
    else
        answer(s, now_us, WHITE_S, "ER11");
}

/* field[1], field[2]: area and gloss, 0 SCI or 1 SCE as the modes of CPS. */
static bool read_place(char **field, size_t *port, int *mode)
{
    long a, gloss;
    if (!km_line_number(field[1], 0, 1, &a) || !km_line_number(field[2], 0, 1, &gloss))
        return false;
    *port = a == 0 ? 1 : 0;
    *mode = gloss == 0 ? SCI : SCE;
    return true;
}

static void plate_data(struct sim *s, char **field, int64_t now_us)
{
    char text[ANSWER_SIZE];
    size_t port;
    int mode;
    if (!read_place(field, &port, &mode)) {
        say(s, now_us, "ER03");
        return;
    }
    int n = snprintf(text, sizeof text, "OK00");
    for (int b = 0; b < BANDS; b++)
        n += snprintf(text + n, sizeof text - (size_t)n, ",%06.3f",
                      s->plate_data[port][mode][b] * 100.0);
    serial_end_reply(&s->end, text, (size_t)n, now_us, scaled_us(s, REPLY_S));
}

static void write_switch(struct sim *s, char **field, int64_t now_us)
{
    long on;
    if (!km_line_number(field[1], 0, 1, &on)) {
        say(s, now_us, "ER03");
        return;
    }
    s->writing = on == 0; /* WMS,0 opens the bracket */
    say(s, now_us, "OK00");
}

static void set_plate_data(struct sim *s, char **field, int64_t now_us)
{
    size_t port;
    int mode;
    double value[BANDS];
    bool good = s->writing && read_place(field, &port, &mode);
    for (int b = 0; good && b < BANDS; b++) {
        char *end;
        value[b] = strtod(field[3 + b], &end) / 100.0;
        good = end != field[3 + b] && *end == '\0' && value[b] >= 0.8 && value[b] <= 1.1;
    }
    if (good)
        memcpy(s->plate_data[port][mode], value, sizeof value);
    say(s, now_us, good ? "OK00" : "ER03");
}

/* ---- measuring ---------------------------------------------------------------------- */

static bool may_measure(const struct sim *s, int64_t now_us, const char **code)
{
    int done = calibration(s);
    *code = s->body.battery == 2     ? "ER02"
            : done == 0              ? "ER07"
            : done == 1              ? "ER24"
            : now_us < s->charged_us ? "ER27"
                                     : NULL;
    return *code == NULL;
}

static void shoot(struct sim *s, int64_t now_us)
{
    static const int lines[4][4] = {
        { SCI }, { SCI, SCE }, { SCI, SCE, SCI }, { SCI, SCE, SCI, SCE }
    };
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SHOT);
    double seconds = FLASH_S * (s->mode >= 2 ? 2.0 : 1.0);
    handheld_spectra R;
    s->measuring_until_us = now_us + scaled_us(s, seconds);
    s->charged_us = s->measuring_until_us + scaled_us(s, CHARGE_S);
    if (f.kind == FAULT_BATTERY_DIES) {
        s->body.battery = 2;
        s->measuring_until_us = f.a < 0 ? INT64_MAX : now_us + (int64_t)f.a * 1000;
        return;
    }
    if (f.kind == FAULT_CALIBRATION_LOST)
        handheld_forget(&s->body);
    if (f.kind != FAULT_NONE || s->body.lamp == LAMP_DEAD) {
        answer(s, now_us, seconds, f.kind == FAULT_CALIBRATION_LOST ? "ER07" : "ER05");
        return;
    }
    handheld_shoot(&s->body, 1, R);
    for (long i = 0; i <= s->mode; i++)
        tell_spectrum(s, now_us, seconds, R, lines[s->mode][i]);
}

static void measure(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    const char *code;
    if (may_measure(s, now_us, &code))
        shoot(s, now_us);
    else
        say(s, now_us, code);
}

static void button_on(struct sim *s, char **field, int64_t now_us)
{
    (void)field;
    s->button_on = true;
    say(s, now_us, "OK00");
}

static void press(struct sim *s, int64_t now_us)
{
    const char *code;
    if (s->button_on && now_us >= s->measuring_until_us && may_measure(s, now_us, &code))
        shoot(s, now_us);
}

/* ---- memory ------------------------------------------------------------------------- */

static bool store(struct sim *s)
{
    if (s->samples == SAMPLES)
        return false;
    handheld_spectrum_of(&s->body, s->body.under, s->sample[s->samples++]);
    return true;
}

static void sample(struct sim *s, char **field, int64_t now_us)
{
    long environment, zero_field, number;
    if (!km_line_number(field[1], 1, 6, &environment) ||
        !km_line_number(field[2], 0, 0, &zero_field) || !km_line_number(field[3], 1, 9999, &number))
        say(s, now_us, "ER03");
    else if (environment != 1 || number > (long)s->samples)
        say(s, now_us, "ER10");
    else {
        say(s, now_us, "OK00,1,0");
        tell_spectrum(s, now_us, REPLY_S, s->sample[number - 1], SCE);
    }
}

/* ---- the list of commands ----------------------------------------------------------- */

static const struct command {
    const char *name;
    size_t arguments;
    void (*run)(struct sim *s, char **field, int64_t now_us);
} commands[] = {
    { "IDR", 0, identity },       { "STR", 0, state },        { "CPR", 0, conditions },
    { "CPS", 2, set_conditions }, { "UZC", 0, zero },         { "CAL", 0, white },
    { "SWE", 0, button_on },      { "MES", 0, measure },      { "SDR", 3, sample },
    { "CDR", 2, plate_data },     { "WMS", 1, write_switch }, { "CDS", 2 + BANDS, set_plate_data },
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
    if (now_us < s->measuring_until_us && s->body.battery == 2)
        return; /* it died while measuring: nothing answers */
    if (line == NULL) {
        say(s, now_us, "ER08");
        return;
    }
    memcpy(text, line, strlen(line) + 1);
    size_t n = km_line_split(text, field);
    while (c < end && strcmp(c->name, field[0]) != 0)
        c++;
    s->writes += c < end && strstr("CDS WMS", c->name) != NULL;
    if (c == end)
        say(s, now_us, "ER00");
    else if (n - 1 != c->arguments)
        say(s, now_us, "ER03");
    else
        c->run(s, field, now_us);
}

/* ---- the simulator ------------------------------------------------------------------ */

static void cm2600d_free(struct sim *s)
{
    serial_end_done(&s->end);
    free(s);
}

static void power_on(struct sim *s)
{
    s->mode = 1;
    s->button_on = s->writing = false;
    s->measuring_until_us = s->charged_us = 0;
    handheld_forget(&s->body);
}

static bool read_options(struct sim *s, const char *options)
{
    const struct sim_option list[] = {
        { .key = "serial", .text = s->serial },
        { .key = "type", .text = s->type },
        { .key = "rom", .text = s->rom },
        { .key = "delays", .number = &s->delays, .max = 1000 },
        { .key = "seed", .number = &s->body.seed, .max = 1e9 },
        { .key = "lightness", .number = &s->body.lightness, .min = 1, .max = 80 },
        { .key = "noise", .number = &s->body.noise, .max = 0.1 },
        { .key = "samples", .number = &s->samples_at_first, .max = SAMPLES },
        { .key = "dot", .number = &s->dot, .max = 1 },
        { .key = "careful", .number = &s->careful, .max = 1 },
        { .key = "operator", .number = &s->helped, .max = 1 },
        { .key = "binary_serial", .number = &s->binary_serial, .max = 1 },
        { .key = "asleep", .number = &s->asleep, .max = 1 },
        { .key = NULL },
    };
    return sim_options_read("cm2600d", options, list);
}

static struct sim *cm2600d_make(const char *options)
{
    struct sim *s = calloc(1, sizeof *s);
    if (s == NULL)
        return NULL;
    *s = (struct sim){
        .end = { .host_end = '\n', .own_end = "\r\n" },
        .body = { .bands = BANDS,
                  .first_nm = 360,
                  .step_nm = 10,
                  .under = UNDER_SKIN,
                  .lightness = 65,
                  .noise = 0.0003,
                  .seed = 1,
                  .port = 1,
                  .two_ports = true },
        .type = "03",
        .rom = "104",
        .serial = "01001234",
        .delays = 1,
        .dot = 1,
        .careful = 1,
    };
    if (!read_options(s, options)) {
        cm2600d_free(s);
        return NULL;
    }
    s->end.dice.state = (uint64_t)s->body.seed;
    s->end.byte_us = scaled_us(s, BYTE_S);
    s->body.careful = s->careful > 0;
    s->body.helped = s->helped > 0;
    for (int port = 0; port < HANDHELD_PORTS; port++)
        handheld_spectrum_of(&s->body, UNDER_WHITE, s->plate_data[port]);
    double lightness = s->body.lightness;
    for (int i = 0; i < (int)s->samples_at_first; i++, s->body.lightness = 30 + (i * 7) % 50)
        store(s);
    s->body.lightness = lightness;
    power_on(s);
    return s;
}

static int cm2600d_take(struct sim *s, uint8_t channel, const uint8_t *bytes, size_t n,
                        int64_t now_us)
{
    (void)channel;
    serial_end_take(&s->end, bytes, n, now_us, obey, s);
    return 0;
}

static ssize_t cm2600d_give(struct sim *s, uint8_t channel, uint8_t *bytes, size_t size,
                            int64_t now_us, int64_t *due_us)
{
    (void)channel;
    return serial_end_give(&s->end, bytes, size, now_us, due_us);
}

static bool cm2600d_act(struct sim *s, const char *action, int64_t now_us)
{
    long n;
    if (strncmp(action, "fault ", 6) == 0)
        return faults_add(&s->end.faults, action + 6);
    if (handheld_argument(action, "expect writes", 0, 1000000, &n))
        return s->writes == n;
    if (handheld_argument(action, "differ", 0, 1, &n))
        s->differ = n == 1;
    else if (strcmp(action, "press") == 0)
        press(s, now_us);
    else if (strcmp(action, "store") == 0)
        return store(s);
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

static double cm2600d_truth(const struct sim *s, double nm, bool sci)
{
    return handheld_truth(&s->body, nm, sci);
}

/* No USB of its own: a common adapter. */
const struct sim_kind sim_cm2600d = {
    SIM_CALLS(cm2600d),
    .vid = 0x0403,
    .pid = 0x6001,
    .product = "FT232R USB UART",
};
