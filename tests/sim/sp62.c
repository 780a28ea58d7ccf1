/* sp62.c - its commands, one function each. */
#include "tests/sim/sp62.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/handheld.h"
#include "tests/sim/km_line.h"
#include "tests/sim/serial_end.h"
#include "tests/sim/sim_options.h"

enum { BANDS = 31, SAMPLES = 9, BINARY_SERIAL = 1024, ANSWER_SIZE = 2048 };

/* Seconds, at delays=1; 10 bits a byte.  WAIT: for the operator, never scaled. */
static const double REPLY_S = 0.05, SHOT_S = 2.0, BYTE_S = 10.0 / 9600.0;
static const double CALIBRATION_WAIT_S = 120.0, READY_WAIT_S = 320.0;

enum display { DISPLAY_MAIN, DISPLAY_WHITE, DISPLAY_BLACK, DISPLAY_READY };

struct sim {
    struct serial_end end;
    struct handheld body;
    char variant[SIM_OPTION_SIZE], serial[SIM_OPTION_SIZE];
    double delays, samples_at_first, careful, binary_serial, echo, operator_ms;

    const char *separator;
    unsigned averages;
    unsigned pending; /* an error not cleared */
    enum display display;
    int64_t give_up_us, operator_us, busy_until_us; /* operator_us: he presses; INT64_MAX: never */
    enum under_port first_seen;                     /* by the white step of 10XD */
    bool has_shot;
    handheld_spectra shot, white, sample[SAMPLES];
    size_t samples;
};

/* ---- answers ------------------------------------------------------------------------ */

static int64_t scaled_us(const struct sim *s, double seconds)
{
    return (int64_t)(seconds * 1e6 * s->delays);
}

static void answer(struct sim *s, int64_t now_us, double seconds, const char *data, size_t n,
                   unsigned code)
{
    char text[ANSWER_SIZE];
    memcpy(text, data, n);
    n += (size_t)snprintf(text + n, sizeof text - n, "<%02X>", code);
    serial_end_reply(&s->end, text, n, now_us, scaled_us(s, seconds));
    if (code >= 0x20)
        s->pending = code;
}

static void say(struct sim *s, int64_t now_us, unsigned code)
{
    answer(s, now_us, REPLY_S, "", 0, code);
}

static void tell_spectrum(struct sim *s, int64_t now_us, handheld_spectra R, int mode)
{
    char text[ANSWER_SIZE] = "";
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SPECTRUM);
    int n = 0, bands = f.kind == FAULT_BANDS ? (int)f.a : BANDS;
    for (int b = 0; b < bands; b++) {
        const char *between = b > 0 ? s->separator : "";
        double percent = 100.0 * km_line_told(&f, R, mode, (size_t)(b % BANDS));
        if (f.kind == FAULT_TEXT && b == 2)
            n += snprintf(text + n, sizeof text - (size_t)n, "%snan", between);
        else
            n += snprintf(text + n, sizeof text - (size_t)n, "%s%.4f", between, percent);
    }
    answer(s, now_us, REPLY_S, text, (size_t)n, 0);
}

/* ---- shots and calibration ---------------------------------------------------------- */

/* What keeps it from flashing; 0: nothing. */
static unsigned trouble(const struct sim *s)
{
    if (s->pending != 0)
        return s->pending;
    return s->body.battery == 2 ? 0x3B : s->body.lamp == LAMP_DEAD ? 0x31 : 0;
}

static bool calibrated(const struct sim *s)
{
    return handheld_calibrated(&s->body, 1u << SCI | 1u << SCE, false);
}

static void shoot(struct sim *s, int64_t now_us)
{
    struct fault f = faults_next(&s->end.faults, FAULT_AT_SHOT);
    double seconds = SHOT_S * s->averages;
    bool over = handheld_truth(&s->body, 550, true) > 2.0;
    if (f.kind == FAULT_BATTERY_DIES) {
        s->body.battery = 2;
        s->busy_until_us = f.a < 0 ? INT64_MAX : now_us + (int64_t)f.a * 1000;
        return; /* and no answer */
    }
    if (f.kind == FAULT_CALIBRATION_LOST)
        handheld_forget(&s->body);
    s->has_shot = f.kind == FAULT_NONE && !over;
    if (s->has_shot)
        handheld_shoot(&s->body, s->averages, s->shot);
    s->busy_until_us = now_us + scaled_us(s, seconds);
    answer(s, now_us, seconds, "", 0,
           f.kind == FAULT_CALIBRATION_LOST ? 0x28
           : f.kind == FAULT_LAMP           ? 0x31
           : over                           ? 0x27
                                            : 0);
}

static void operator_comes(struct sim *s, int64_t now_us)
{
    s->operator_us = s->operator_ms > 0 ? now_us + (int64_t)(s->operator_ms * 1000.0) : INT64_MAX;
}

static void show(struct sim *s, enum display display, double wait_s, int64_t now_us)
{
    s->display = display;
    s->give_up_us = display == DISPLAY_MAIN ? INT64_MAX : now_us + (int64_t)(wait_s * 1e6);
    s->operator_us = INT64_MAX;
    if (display != DISPLAY_MAIN)
        operator_comes(s, now_us);
}

static void calibration_ends(struct sim *s, int64_t now_us)
{
    /* White came first here; the arithmetic wants the dark first. */
    enum under_port now = s->body.under;
    bool good = handheld_zero(&s->body);
    s->body.under = s->first_seen;
    good = good && handheld_white(&s->body, s->white, false, 1u << SCI | 1u << SCE);
    s->body.under = now;
    if (!good)
        handheld_forget(&s->body);
    show(s, DISPLAY_MAIN, 0, now_us);
    answer(s, now_us, SHOT_S, "", 0, good ? 0 : 0x29);
}

static void press(struct sim *s, int64_t now_us)
{
    switch (s->display) {
    case DISPLAY_WHITE:
        s->first_seen = s->body.under;
        show(s, DISPLAY_BLACK, CALIBRATION_WAIT_S, now_us);
        break;
    case DISPLAY_BLACK:
        calibration_ends(s, now_us);
        break;
    case DISPLAY_READY:
        show(s, DISPLAY_MAIN, 0, now_us);
        shoot(s, now_us);
        break;
    case DISPLAY_MAIN:
        break;
    }
}

static void operator_presses(struct sim *s, int64_t now_us)
{
    bool black = s->display == DISPLAY_BLACK;
    if (s->display == DISPLAY_WHITE)
        s->body.under = UNDER_WHITE;
    if (black)
        s->body.under = UNDER_BLACK;
    press(s, now_us);
    if (black)
        s->body.under = UNDER_SKIN;
}

/* Let happen what should have by now. */
static void settle(struct sim *s, int64_t now_us)
{
    while (s->display != DISPLAY_MAIN && now_us >= s->operator_us)
        operator_presses(s, s->operator_us);
    if (s->display != DISPLAY_MAIN && now_us >= s->give_up_us) {
        unsigned code = s->display == DISPLAY_READY ? 0x21 : 0x2A;
        show(s, DISPLAY_MAIN, 0, now_us);
        answer(s, now_us, 0, "", 0, code);
    }
}

/* ---- commands: p has the hex digits before the letters ------------------------------ */

static unsigned hex(const char *digits, size_t n)
{
    unsigned x = 0;
    for (size_t i = 0; i < n; i++)
        x = x * 16 +
            (unsigned)(isdigit((unsigned char)digits[i]) ? digits[i] - '0' : digits[i] - 'A' + 10);
    return x;
}

/* vvoo: option oo is set to vv. */
static void configure(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    static const char *const separators[] = { " ", ",", "\t", "\r", "\r\n" };
    static const char *const delimiters[] = { "\r", "\r\n", "\n" };
    unsigned value = hex(p, 2), option = n == 4 ? hex(p + 2, 2) : 0x100;
    unsigned most = option == 0x05   ? 1
                    : option == 0x07 ? 4
                    : option == 0x08 ? 2
                    : option == 0x4B ? 99
                                     : 1;
    bool known = option == 0x05 || option == 0x07 || option == 0x08 || option == 0x09 ||
                 option == 0x40 || option == 0x4B || option == 0x20 || option == 0x23;
    if (!known || value > most || (option == 0x4B && value == 0)) {
        say(s, now_us, known ? 0x13 : 0x12);
        return;
    }
    if (option == 0x07)
        s->separator = separators[value];
    if (option == 0x08)
        s->end.own_end = delimiters[value];
    if (option == 0x09)
        s->echo = value;
    if (option == 0x4B)
        s->averages = value;
    say(s, now_us, 0);
}

static void baud(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    static const char *const rates[] = { "300", "1200", "2400", "4800", "9600", "19200" };
    bool known = false;
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++)
        known = known || (strlen(rates[i]) == n && strncmp(rates[i], p, n) == 0);
    say(s, now_us, known ? 0 : 0x12);
}

static void serial(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    char text[BINARY_SERIAL];
    if (n != 2 || hex(p, 2) != 0) {
        say(s, now_us, 0x12);
        return;
    }
    size_t length = strlen(s->serial);
    memcpy(text, s->serial, length);
    if (s->binary_serial > 0)
        for (length = 0; length < sizeof text; length++) {
            char c = (char)dice_bits(&s->end.dice);
            text[length] = c == '\n' || c == '\r' ? '\0' : c;
        }
    answer(s, now_us, REPLY_S, text, length, 0);
}

static void ask_operator(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    unsigned what = n == 2 ? hex(p, 2) : 0;
    if (what != 0x10 && what != 0x01)
        say(s, now_us, 0x12);
    else if (trouble(s) != 0)
        say(s, now_us, trouble(s));
    else if (what == 0x01 && !calibrated(s))
        say(s, now_us, 0x28);
    else if (what == 0x10)
        show(s, DISPLAY_WHITE, CALIBRATION_WAIT_S, now_us);
    else
        show(s, DISPLAY_READY, READY_WAIT_S, now_us);
}

static void measure(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    (void)p;
    if (n != 0)
        say(s, now_us, 0x12);
    else if (trouble(s) != 0)
        say(s, now_us, trouble(s));
    else if (!calibrated(s))
        say(s, now_us, 0x28);
    else
        shoot(s, now_us);
}

/* 00: how many; NM01: sample N, 0 the last measurement; M 0 SCI, 1 SCE.  N may be left out. */
static void get(struct sim *s, const char *p, size_t n, size_t samples, bool has_last,
                int64_t now_us)
{
    char text[16];
    if (n == 2 && hex(p, 2) == 0) {
        int length = snprintf(text, sizeof text, "%zu", samples);
        answer(s, now_us, REPLY_S, text, (size_t)length, 0);
        return;
    }
    unsigned number = n > 3 ? hex(p, n - 3) : 0;
    if (n < 3 || n > 6 || hex(p + n - 3, 1) > 1 || hex(p + n - 2, 2) != 0x01)
        say(s, now_us, 0x12);
    else if (s->pending != 0)
        say(s, now_us, s->pending);
    else if (number > samples)
        say(s, now_us, 0x13);
    else if (number == 0 && !has_last)
        say(s, now_us, 0x16);
    else
        tell_spectrum(s, now_us, number == 0 ? s->shot : s->sample[number - 1],
                      hex(p + n - 3, 1) == 0 ? SCI : SCE);
}

static void measured(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    get(s, p, n, s->samples, s->has_shot, now_us);
}

static void standards(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    get(s, p, n, 0, false, now_us); /* none are kept */
}

static void screen(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    say(s, now_us, n == 4 && hex(p + 2, 2) == 1 ? 0 : 0x12);
}

static void clear_error(struct sim *s, const char *p, size_t n, int64_t now_us)
{
    (void)p;
    s->pending = 0;
    say(s, now_us, n == 0 ? 0 : 0x12);
}

static const struct command {
    char name[3];
    void (*run)(struct sim *s, const char *digits, size_t n, int64_t now_us);
} commands[] = {
    { "CF", configure },    { "BR", baud },    { "SN", serial },
    { "XD", ask_operator }, { "RM", measure }, { "GM", measured },
    { "GS", standards },    { "SM", screen },  { "CE", clear_error },
};

static void obey(void *owner, const char *line, int64_t now_us)
{
    struct sim *s = owner;
    const struct command *c = commands, *end = c + sizeof commands / sizeof *commands;
    size_t n = line == NULL ? 0 : strlen(line), digits = n < 2 ? 0 : n - 2;
    if (s->busy_until_us == INT64_MAX)
        return; /* died while measuring */
    while (n >= 2 && c < end && strcmp(c->name, line + digits) != 0)
        c++;
    bool waits = s->display != DISPLAY_MAIN;
    if (waits && n == 2 && strcmp(line, "CE") == 0) {
        show(s, DISPLAY_MAIN, 0, now_us);
        say(s, now_us, 0x15);
    } else if (waits || now_us < s->busy_until_us)
        say(s, now_us, 0x14);
    else if (line != NULL && n == 0)
        say(s, now_us, 0);
    else if (n < 2 || c == end)
        say(s, now_us, 0x11);
    else if (strspn(line, "0123456789ABCDEF") < digits)
        say(s, now_us, 0x12);
    else
        c->run(s, line, digits, now_us);
}

/* ---- the simulator ------------------------------------------------------------------ */

static void sp62_free(struct sim *s)
{
    serial_end_done(&s->end);
    free(s);
}

static void power_on(struct sim *s)
{
    s->separator = " ";
    s->end.own_end = "\r";
    s->averages = 1;
    s->pending = 0;
    s->has_shot = false;
    s->busy_until_us = 0;
    show(s, DISPLAY_MAIN, 0, 0);
    handheld_forget(&s->body);
}

static bool store(struct sim *s)
{
    if (s->samples == SAMPLES)
        return false;
    handheld_spectrum_of(&s->body, s->body.under, s->sample[s->samples++]);
    return true;
}

static bool read_options(struct sim *s, const char *options)
{
    const struct sim_option list[] = {
        { .key = "serial", .text = s->serial },
        { .key = "variant", .text = s->variant },
        { .key = "delays", .number = &s->delays, .max = 1000 },
        { .key = "seed", .number = &s->body.seed, .max = 1e9 },
        { .key = "lightness", .number = &s->body.lightness, .min = 1, .max = 80 },
        { .key = "noise", .number = &s->body.noise, .max = 0.1 },
        { .key = "samples", .number = &s->samples_at_first, .max = SAMPLES },
        { .key = "careful", .number = &s->careful, .max = 1 },
        { .key = "binary_serial", .number = &s->binary_serial, .max = 1 },
        { .key = "echo", .number = &s->echo, .max = 1 },
        { .key = "operator_ms", .number = &s->operator_ms, .max = 1e6 },
        { .key = NULL },
    };
    if (!sim_options_read("sp62", options, list))
        return false;
    static const char *const variants[] = { "sp60", "sp62", "sp64" };
    for (size_t i = 0; i < 3; i++)
        if (strcmp(s->variant, variants[i]) == 0)
            return true;
    fprintf(stderr, "sp62: variant has to be sp60, sp62 or sp64\n");
    return false;
}

static struct sim *sp62_make(const char *options)
{
    struct sim *s = calloc(1, sizeof *s);
    if (s == NULL)
        return NULL;
    *s = (struct sim){
        .end = { .host_end = '\r', .own_end = "\r" },
        .body = { .bands = BANDS,
                  .first_nm = 400,
                  .step_nm = 10,
                  .under = UNDER_SKIN,
                  .lightness = 65,
                  .noise = 0.0003,
                  .seed = 1,
                  .port = 1 },
        .variant = "sp62",
        .serial = "001234",
        .delays = 1,
        .careful = 1,
    };
    if (!read_options(s, options)) {
        sp62_free(s);
        return NULL;
    }
    s->end.dice.state = (uint64_t)s->body.seed;
    s->end.byte_us = scaled_us(s, BYTE_S);
    s->body.careful = s->careful > 0;
    s->body.two_ports = strcmp(s->variant, "sp64") == 0;
    handheld_spectrum_of(&s->body, UNDER_WHITE, s->white);
    double lightness = s->body.lightness;
    for (int i = 0; i < (int)s->samples_at_first; i++, s->body.lightness = 30 + (i * 7) % 50)
        store(s);
    s->body.lightness = lightness;
    power_on(s);
    return s;
}

static int sp62_take(struct sim *s, uint8_t channel, const uint8_t *bytes, size_t n, int64_t now_us)
{
    (void)channel;
    settle(s, now_us);
    if (s->echo > 0)
        serial_end_echo(&s->end, bytes, n, now_us);
    serial_end_take(&s->end, bytes, n, now_us, obey, s);
    return 0;
}

static ssize_t sp62_give(struct sim *s, uint8_t channel, uint8_t *bytes, size_t size,
                         int64_t now_us, int64_t *due_us)
{
    (void)channel;
    settle(s, now_us);
    ssize_t n = serial_end_give(&s->end, bytes, size, now_us, due_us);
    int64_t next_us = s->operator_us < s->give_up_us ? s->operator_us : s->give_up_us;
    if (next_us < *due_us)
        *due_us = next_us;
    return n;
}

static bool sp62_act(struct sim *s, const char *action, int64_t now_us)
{
    long n;
    settle(s, now_us);
    if (strncmp(action, "fault ", 6) == 0)
        return faults_add(&s->end.faults, action + 6);
    if (handheld_argument(action, "expect writes", 0, 1000000, &n))
        return n == 0;
    if (strcmp(action, "operator leaves") == 0) {
        s->operator_ms = 0;
        s->operator_us = INT64_MAX;
    } else if (strcmp(action, "press") == 0)
        press(s, now_us);
    else if (strcmp(action, "store") == 0)
        return store(s);
    else if (strcmp(action, "forget") == 0)
        handheld_forget(&s->body);
    else if (strcmp(action, "reset") == 0) {
        serial_end_done(&s->end);
        power_on(s);
    } else
        return handheld_act(&s->body, action);
    return true;
}

static double sp62_truth(const struct sim *s, double nm, bool sci)
{
    return handheld_truth(&s->body, nm, sci);
}

/* No USB of its own: a common adapter. */
const struct sim_kind sim_sp62 = {
    SIM_CALLS(sp62),
    .vid = 0x067b,
    .pid = 0x2303,
    .product = "USB-Serial Controller",
};
