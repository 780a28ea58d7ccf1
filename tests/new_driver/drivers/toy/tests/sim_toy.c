/* sim_toy.c - five commands. */
#include "drivers/toy/tests/sim_toy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/handheld.h"
#include "tests/sim/serial_end.h"
#include "tests/sim/sim_options.h"

enum { BANDS = 31 };
static const double REPLY_S = 0.002, CALIBRATION_S = 1.0, SHOT_S = 1.0, BYTE_S = 10.0 / 9600.0;

struct sim {
    struct serial_end end;
    struct handheld body;
    char serial[SIM_OPTION_SIZE];
    double delays, helped;
    handheld_spectra white;
};

static void answer(struct sim *s, int64_t now_us, double seconds, const char *text)
{
    serial_end_reply(&s->end, text, strlen(text), now_us, (int64_t)(seconds * 1e6 * s->delays));
}

static void shoot(struct sim *s, int64_t now_us)
{
    char text[BANDS * 7 + 1] = "";
    handheld_spectra R;
    handheld_shoot(&s->body, 1, R);
    for (size_t b = 0; b < BANDS; b++) {
        size_t n = strlen(text);
        snprintf(text + n, sizeof text - n, b > 0 ? ",%ld" : "%ld",
                 lround(fmax(R[SCE][b], 0.0) * 1e4));
    }
    answer(s, now_us, SHOT_S, text);
}

static void obey(void *owner, const char *line, int64_t now_us)
{
    struct sim *s = owner;
    char text[SIM_OPTION_SIZE + 16];
    bool zeroed = s->body.calibration[s->body.port].zeroed;
    bool ready = handheld_calibrated(&s->body, 1u << SCE, false);
    if (line != NULL && strcmp(line, "ID?") == 0) {
        snprintf(text, sizeof text, "TOY1,%s", s->serial);
        answer(s, now_us, REPLY_S, text);
    } else if (line != NULL && strcmp(line, "CAL?") == 0) {
        snprintf(text, sizeof text, "CAL,%d,%d", zeroed, ready);
        answer(s, now_us, REPLY_S, text);
    } else if (line != NULL && strcmp(line, "ZERO") == 0)
        answer(s, now_us, CALIBRATION_S, handheld_zero(&s->body) ? "OK" : "ERR 2");
    else if (line != NULL && strcmp(line, "WHITE") == 0 && zeroed)
        answer(s, now_us, CALIBRATION_S,
               handheld_white(&s->body, s->white, false, 1u << SCE) ? "OK" : "ERR 2");
    else if (line != NULL && strcmp(line, "SHOT") == 0 && ready)
        shoot(s, now_us);
    else if (line != NULL && (strcmp(line, "WHITE") == 0 || strcmp(line, "SHOT") == 0))
        answer(s, now_us, REPLY_S, "ERR 1");
    else
        answer(s, now_us, REPLY_S, "ERR 3");
}

static void toy_free(struct sim *s)
{
    serial_end_done(&s->end);
    free(s);
}

static struct sim *toy_make(const char *options)
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
                  .careful = true },
        .serial = "00042",
        .delays = 1,
        .helped = 1,
    };
    const struct sim_option list[] = {
        { .key = "serial", .text = s->serial },
        { .key = "delays", .number = &s->delays, .max = 1000 },
        { .key = "seed", .number = &s->body.seed, .max = 1e9 },
        { .key = "lightness", .number = &s->body.lightness, .min = 1, .max = 80 },
        { .key = "helped", .number = &s->helped, .max = 1 },
        { .key = NULL },
    };
    if (!sim_options_read("toy", options, list)) {
        toy_free(s);
        return NULL;
    }
    s->body.helped = s->helped > 0;
    s->end.dice.state = (uint64_t)s->body.seed;
    s->end.byte_us = (int64_t)(BYTE_S * 1e6 * s->delays);
    handheld_spectrum_of(&s->body, UNDER_WHITE, s->white);
    return s;
}

static int toy_take(struct sim *s, uint8_t channel, const uint8_t *bytes, size_t n, int64_t now_us)
{
    (void)channel;
    serial_end_take(&s->end, bytes, n, now_us, obey, s);
    return 0;
}

static ssize_t toy_give(struct sim *s, uint8_t channel, uint8_t *bytes, size_t size, int64_t now_us,
                        int64_t *due_us)
{
    (void)channel;
    return serial_end_give(&s->end, bytes, size, now_us, due_us);
}

static bool toy_act(struct sim *s, const char *action, int64_t now_us)
{
    (void)now_us;
    if (strncmp(action, "fault ", 6) == 0)
        return faults_add(&s->end.faults, action + 6);
    if (strcmp(action, "reset") != 0)
        return handheld_act(&s->body, action);
    serial_end_done(&s->end);
    handheld_forget(&s->body);
    return true;
}

static double toy_truth(const struct sim *s, double nm, bool sci)
{
    return handheld_truth(&s->body, nm, sci);
}

const struct sim_kind sim_toy = {
    .name = "toy",
    .make = toy_make,
    .free = toy_free,
    .take = toy_take,
    .give = toy_give,
    .act = toy_act,
    .truth = toy_truth,
    .vid = 0x1209,
    .pid = 0x0001,
    .product = "TOY-1",
};
SIM_IS_FOUND(sim_toy);
