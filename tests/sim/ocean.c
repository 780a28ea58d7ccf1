#include "tests/sim/ocean.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/ocean_detector.h"
#include "tests/sim/ocean_endpoint.h"

enum { COMMANDS = 0x01, ANSWERS = 0x81, SPECTRA = 0x82, FIRST_PART = 0x86 };
enum { ANSWER_US = 500, READOUT_US = 1000 };
enum { FIRST_PART_BYTES = 2048, SYNC = 0x69, WRONG_SYNC = 0x96 };
enum { FPGA_REGISTERS = 256, FPGA_VERSION = 0x04 };
enum { MOST_OVERLONG = 8192 };
enum { GARBAGE_TEXTS = 16 }; /* slots from here on are not all texts */

enum { AT_81, AT_82, AT_86, ENDPOINTS };

struct slot {
    size_t n;
    uint8_t bytes[OCEAN_TEXT];
};

struct options {
    char serial[OCEAN_TEXT + 1], under[16];
    bool full_speed, flame;
    double lightness, lamp, substitution;
    struct ocean_detector_options detector;
};

struct faults {
    bool mute, garbage_slots;
    double delay_ms;
    /* Once each: */
    int stall; /* -1: none; 0: any endpoint */
    bool sync, stale, twice, cut_answer, gone;
    long truncate, overlong; /* -1: no */
};

struct sim {
    const struct ocean_model *model;
    struct options options;
    struct faults faults;
    struct slot slots[OCEAN_SLOTS];
    uint16_t fpga[FPGA_REGISTERS];
    struct ocean_endpoint endpoints[ENDPOINTS];
    struct ocean_detector detector;
    struct ocean_exposure exposure; /* what is being sent, as light and as bytes */
    uint8_t spectrum[2 * OCEAN_MAX_PIXELS + 1 + MOST_OVERLONG];
    uint8_t late[64]; /* an answer that was kept back */
    size_t n_late;
    bool gone;
    unsigned writes;
    uint8_t last_command;
};

/* ---- options ------------------------------------------------------------------------- */

static void set_slot(struct slot *slot, const void *bytes, size_t n)
{
    slot->n = n < OCEAN_TEXT ? n : OCEAN_TEXT;
    memcpy(slot->bytes, bytes, slot->n);
}

static bool number(const char *text, double least, double most, double *ret)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= least && value <= most))
        return false;
    *ret = value;
    return true;
}

static bool one_of(const char *text, const char *no, const char *yes, bool *ret)
{
    if (strcmp(text, no) != 0 && strcmp(text, yes) != 0)
        return false;
    *ret = strcmp(text, yes) == 0;
    return true;
}

static bool set_text(const char *text, char *ret, size_t size)
{
    if (strlen(text) >= size)
        return false;
    strcpy(ret, text);
    return true;
}

static bool set_option(struct options *o, const char *key, const char *value)
{
    const struct {
        const char *key;
        double least, most, *ret;
    } numbers[] = {
        { "delays", 0, 1000, &o->detector.delays },
        { "noise", 0, 100, &o->detector.noise },
        { "lightness", 5, 95, &o->lightness },
        { "lamp", 0, 100, &o->lamp },
        { "drift", -100, 100, &o->detector.drift },
        { "substitution", 0, 0.3, &o->substitution },
        { "temperature", -40, 120, &o->detector.temperature },
    };
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (strcmp(key, numbers[i].key) == 0)
            return number(value, numbers[i].least, numbers[i].most, numbers[i].ret);

    double whole;
    if (strcmp(key, "seed") == 0 && number(value, 0, 1e15, &whole)) {
        o->detector.seed = (uint64_t)whole;
        return true;
    }
    if (strcmp(key, "level") == 0 && number(value, 0, 65535, &whole)) {
        o->detector.level = (unsigned)whole;
        return true;
    }
    if (strcmp(key, "serial") == 0)
        return set_text(value, o->serial, sizeof o->serial);
    if (strcmp(key, "under") == 0)
        return set_text(value, o->under, sizeof o->under);
    if (strcmp(key, "speed") == 0)
        return one_of(value, "high", "full", &o->full_speed);
    if (strcmp(key, "flame") == 0)
        return one_of(value, "0", "1", &o->flame);
    return strcmp(key, "line") == 0 && one_of(value, "1", "0", &o->detector.always_lit);
}

static bool read_options(const char *text, struct options *o)
{
    char copy[512], *rest = copy;
    if (strlen(text) >= sizeof copy) {
        fprintf(stderr, "ocean: options are too long: %s\n", text);
        return false;
    }
    strcpy(copy, text);
    for (char *one = strtok_r(copy, ",", &rest); one != NULL; one = strtok_r(NULL, ",", &rest)) {
        char *value = strchr(one, '=');
        if (value != NULL)
            *value++ = '\0';
        if (value == NULL || !set_option(o, one, value)) {
            fprintf(stderr, "ocean: option '%s' is not known or cannot be '%s'\n", one,
                    value != NULL ? value : "");
            return false;
        }
    }
    return true;
}

/* ---- life ---------------------------------------------------------------------------- */

static const struct faults no_faults = { .stall = -1, .truncate = -1, .overlong = -1 };

static struct ocean_endpoint *endpoint_of(struct sim *sim, uint8_t address)
{
    for (size_t i = 0; i < ENDPOINTS; i++)
        if (sim->endpoints[i].address == address)
            return &sim->endpoints[i];
    return NULL;
}

/* As after power on: what EEPROM holds stays. */
static void reset(struct sim *sim)
{
    for (size_t i = 0; i < ENDPOINTS; i++)
        ocean_endpoint_clear(&sim->endpoints[i]);
    ocean_detector_reset(&sim->detector);
    memset(sim->fpga, 0, sizeof sim->fpga);
    sim->fpga[FPGA_VERSION] = sim->options.flame ? 0x3005 : 0x2011;
    sim->n_late = 0;
    sim->gone = sim->faults.gone = false;
    sim->last_command = 0;
}

static struct sim *make(const struct ocean_model *model, const char *text)
{
    struct options o = { .serial = "SIM00042",
                         .under = "white",
                         .lightness = 62,
                         .lamp = 1,
                         .detector = { .delays = 1,
                                       .noise = 1,
                                       .temperature = 31.5,
                                       .seed = 1,
                                       .level = model->level } };
    if (!read_options(text, &o))
        return NULL;
    struct ocean_scene scene = { .lightness = o.lightness,
                                 .lamp = o.lamp,
                                 .substitution = o.substitution };
    if (!ocean_scene_place(&scene, o.under)) {
        fprintf(stderr, "ocean: there is no '%s' to lie under the port\n", o.under);
        return NULL;
    }
    struct sim *sim = calloc(1, sizeof *sim);
    if (sim == NULL)
        return NULL;
    sim->model = model;
    sim->options = o;
    sim->faults = no_faults;
    static const uint8_t addresses[ENDPOINTS] = { ANSWERS, SPECTRA, FIRST_PART };
    for (size_t i = 0; i < ENDPOINTS; i++) {
        sim->endpoints[i].address = addresses[i];
        sim->endpoints[i].packet = o.full_speed || i == AT_81 ? 64 : 512;
    }
    for (size_t i = 0; i < OCEAN_SLOTS; i++)
        if (model->slots[i] != NULL)
            set_slot(&sim->slots[i], model->slots[i], strlen(model->slots[i]));
    set_slot(&sim->slots[OCEAN_SLOT_SERIAL], o.serial, strlen(o.serial));
    ocean_detector_init(&sim->detector, model, &o.detector, &scene);
    reset(sim);
    return sim;
}

static void ocean_free(struct sim *sim)
{
    for (size_t i = 0; i < ENDPOINTS; i++)
        ocean_endpoint_clear(&sim->endpoints[i]);
    free(sim);
}

/* ---- answers ------------------------------------------------------------------------- */

static int64_t later(const struct sim *sim, int64_t now_us, double us)
{
    return now_us + (int64_t)(us * sim->options.detector.delays + 1000 * sim->faults.delay_ms);
}

static void answer(struct sim *sim, const uint8_t *bytes, size_t n, int64_t now_us)
{
    struct faults *f = &sim->faults;
    struct ocean_endpoint *out = &sim->endpoints[AT_81];
    int64_t due_us = later(sim, now_us, ANSWER_US);
    if (f->mute)
        return;
    if (f->stale) {
        f->stale = false;
        memcpy(sim->late, bytes, n);
        sim->n_late = n;
        return;
    }
    ocean_endpoint_put(out, sim->late, sim->n_late, due_us);
    sim->n_late = 0;
    if (f->cut_answer)
        n = 2;
    ocean_endpoint_put(out, bytes, n, due_us);
    if (f->twice)
        ocean_endpoint_put(out, bytes, n, due_us);
    f->cut_answer = f->twice = false;
}

static void put_u16(uint8_t *bytes, unsigned value)
{
    bytes[0] = value & 0xff;
    bytes[1] = value >> 8 & 0xff;
}

static void put_u32(uint8_t *bytes, uint32_t value)
{
    put_u16(bytes, value & 0xffff);
    put_u16(bytes + 2, value >> 16);
}

/* What stands behind a text's NUL: leavings that continue a number for who overlooks it. */
static void answer_slot(struct sim *sim, uint8_t number_of_slot, int64_t now_us)
{
    static const uint8_t leavings[OCEAN_TEXT] = { '7', 'e', '9', 0xff, '3', '1', 0xc3, 'E',
                                                  '+', '4', '0', 0x80, '5', '.', '2' };
    static const uint8_t garbage[OCEAN_TEXT] = { 0xde, '%',  'n', 0x1b, '-',  '-',  'N', 'a',
                                                 'N',  0xff, '"', '\\', 0x7f, 0xc0, 0xaf };
    uint8_t bytes[2 + OCEAN_TEXT] = { 0x05, number_of_slot };
    memcpy(bytes + 2, leavings, OCEAN_TEXT);
    if (number_of_slot == OCEAN_SLOT_LEVEL) {
        put_u16(bytes + 6, sim->options.detector.level);
    } else if (sim->faults.garbage_slots && number_of_slot < GARBAGE_TEXTS) {
        memcpy(bytes + 2, garbage, OCEAN_TEXT);
    } else if (number_of_slot < OCEAN_SLOTS) {
        const struct slot *slot = &sim->slots[number_of_slot];
        memcpy(bytes + 2, slot->bytes, slot->n);
        if (slot->n < OCEAN_TEXT)
            bytes[2 + slot->n] = '\0';
    }
    answer(sim, bytes, sizeof bytes, now_us);
}

static void answer_status(struct sim *sim, int64_t now_us)
{
    const struct ocean_detector *d = &sim->detector;
    uint8_t bytes[16] = { 0 };
    size_t packet = sim->endpoints[AT_82].packet;
    put_u16(bytes, (unsigned)sim->model->pixels);
    put_u32(bytes + 2, d->integration_us);
    bytes[6] = d->lamp_line;
    bytes[7] = (uint8_t)d->trigger;
    bytes[8] = d->asked > 0 || d->held;
    bytes[9] = (uint8_t)(2 * sim->model->pixels / packet);
    bytes[10] = d->powered;
    bytes[11] = d->held ? bytes[9] : 0;
    bytes[14] = sim->options.full_speed ? 0 : 0x80;
    answer(sim, bytes, sizeof bytes, now_us);
}

static void answer_register(struct sim *sim, uint8_t number_of_register, int64_t now_us)
{
    uint8_t bytes[3] = { sim->options.flame ? 0xfe : number_of_register };
    put_u16(bytes + 1, sim->fpga[number_of_register]);
    answer(sim, bytes, sizeof bytes, now_us);
}

static void answer_temperature(struct sim *sim, int64_t now_us)
{
    uint8_t bytes[3] = { 0x08 };
    long units = lround(sim->options.detector.temperature / 0.003906);
    put_u16(bytes + 1, (unsigned)units & 0xffff);
    answer(sim, bytes, sizeof bytes, now_us);
}

/* ---- spectra ------------------------------------------------------------------------- */

/* The bytes to their endpoints, however many of them there are by now. */
static void send_spectrum(struct sim *sim, const uint8_t *bytes, size_t n, int64_t due_us)
{
    size_t first = 0;
    if (sim->model->split && !sim->options.full_speed) {
        first = n < FIRST_PART_BYTES ? n : FIRST_PART_BYTES;
        ocean_endpoint_put(&sim->endpoints[AT_86], bytes, first, due_us);
    }
    ocean_endpoint_put(&sim->endpoints[AT_82], bytes + first, n - first, due_us);
}

static void deliver(struct sim *sim, const struct ocean_exposure *exposure, int64_t at_us)
{
    uint8_t *bytes = sim->spectrum;
    struct faults *f = &sim->faults;
    size_t n = 2 * sim->model->pixels;
    for (size_t i = 0; i < sim->model->pixels; i++)
        put_u16(bytes + 2 * i,
                ocean_detector_count(&sim->detector, exposure, i) ^ sim->model->xor_mask);
    bytes[n++] = f->sync ? WRONG_SYNC : SYNC;
    if (f->mute) {
        ocean_detector_fetched(&sim->detector);
        return;
    }
    if (f->overlong > 0) {
        memset(bytes + n, 0x55, (size_t)f->overlong);
        n += (size_t)f->overlong;
    }
    if (f->truncate >= 0 && (size_t)f->truncate < n)
        n = (size_t)f->truncate;
    if (f->gone)
        n = sim->endpoints[AT_82].packet;
    int64_t due_us = later(sim, at_us, READOUT_US);
    send_spectrum(sim, bytes, n, due_us);
    if (f->gone)
        for (size_t i = 0; i < ENDPOINTS; i++)
            ocean_endpoint_put_error(&sim->endpoints[i], -ENODEV, due_us + READOUT_US);
    if (n == 0)
        ocean_detector_fetched(&sim->detector);
    f->sync = f->gone = false;
    f->overlong = f->truncate = -1;
}

static void pass(struct sim *sim, int64_t now_us)
{
    int64_t at_us;
    while (ocean_detector_pass(&sim->detector, now_us, &sim->exposure, &at_us))
        deliver(sim, &sim->exposure, at_us);
}

/* ---- commands ------------------------------------------------------------------------ */

static unsigned u16(const uint8_t *bytes)
{
    return bytes[0] | (unsigned)bytes[1] << 8;
}

static uint32_t u32(const uint8_t *bytes)
{
    return u16(bytes) | (uint32_t)u16(bytes + 2) << 16;
}

static void set_integration(struct sim *sim, uint32_t wanted_us)
{
    uint32_t really_us = ocean_model_integration(sim->model, wanted_us);
    if (really_us > 0)
        sim->detector.integration_us = really_us;
}

static void set_power(struct ocean_detector *d, bool on)
{
    if (!on)
        ocean_detector_stop(d);
    d->powered = on;
}

static void write_slot(struct sim *sim, const uint8_t *bytes)
{
    sim->writes++;
    if (bytes[1] < OCEAN_SLOTS)
        set_slot(&sim->slots[bytes[1]], bytes + 2, strnlen((const char *)bytes + 2, OCEAN_TEXT));
}

/* Bytes that each command has at least, itself included; 0: there is none. */
static size_t length_of(uint8_t command)
{
    switch (command) {
    case 0x01:
    case 0x09:
    case 0x6c:
    case 0xfe:
        return 1;
    case 0x05:
    case 0x6b:
        return 2;
    case 0x03:
    case 0x04:
    case 0x0a:
        return 3;
    case 0x6a:
        return 4;
    case 0x02:
        return 5;
    case 0x06:
        return 2 + OCEAN_TEXT;
    default:
        return 0;
    }
}

static void obey(struct sim *sim, const uint8_t *bytes, int64_t now_us)
{
    struct ocean_detector *d = &sim->detector;
    switch (bytes[0]) {
    case 0x01:
        ocean_detector_stop(d);
        break;
    case 0x02:
        set_integration(sim, u32(bytes + 1));
        break;
    case 0x03:
        d->lamp_line = u16(bytes + 1) != 0;
        break;
    case 0x04:
        set_power(d, u16(bytes + 1) != 0);
        break;
    case 0x05:
        answer_slot(sim, bytes[1], now_us);
        break;
    case 0x06:
        write_slot(sim, bytes);
        break;
    case 0x09:
        d->asked++;
        break;
    case 0x0a:
        d->trigger = u16(bytes + 1);
        break;
    case 0x6a:
        sim->fpga[bytes[1]] = (uint16_t)u16(bytes + 2);
        break;
    case 0x6b:
        answer_register(sim, bytes[1], now_us);
        break;
    case 0x6c:
        answer_temperature(sim, now_us);
        break;
    default: /* 0xfe: length_of() lets no other through */
        answer_status(sim, now_us);
        break;
    }
}

static int take(struct sim *sim, uint8_t channel, const uint8_t *bytes, size_t n, int64_t now_us)
{
    if (sim->gone)
        return -ENODEV;
    if (channel != COMMANDS)
        return -ENOENT;
    if (n == 0)
        return 0;
    pass(sim, now_us);
    sim->last_command = bytes[0];
    size_t length = length_of(bytes[0]);
    if (length > 0 && n >= length)
        obey(sim, bytes, now_us);
    pass(sim, now_us);
    return 0;
}

static ssize_t give(struct sim *sim, uint8_t channel, uint8_t *bytes, size_t size, int64_t now_us,
                    int64_t *due_us)
{
    struct ocean_endpoint *from = endpoint_of(sim, channel);
    struct ocean_detector *d = &sim->detector;
    *due_us = INT64_MAX;
    if (sim->gone)
        return -ENODEV;
    if (from == NULL)
        return -ENOENT;
    if (sim->faults.stall == 0 || sim->faults.stall == channel) {
        sim->faults.stall = -1;
        return -EPIPE;
    }
    pass(sim, now_us);
    ssize_t n = ocean_endpoint_give(from, bytes, size, now_us, due_us);
    if (n == -ENODEV)
        sim->gone = true;
    if (d->held && ocean_endpoint_empty(&sim->endpoints[AT_82]) &&
        ocean_endpoint_empty(&sim->endpoints[AT_86])) {
        ocean_detector_fetched(d);
        pass(sim, now_us);
    }
    if (n == 0 && d->running && d->asked > 0 && !from->silent && d->now.end_us < *due_us)
        *due_us = d->now.end_us;
    return n;
}

/* ---- what the operator or fate does -------------------------------------------------- */

static bool slot_bytes(const char *text, struct slot *slot)
{
    if (strncmp(text, "hex:", 4) != 0) {
        set_slot(slot, text, strlen(text));
        return true;
    }
    text += 4;
    size_t n = strlen(text) / 2;
    if (strlen(text) % 2 != 0 || n > OCEAN_TEXT)
        return false;
    for (size_t i = 0; i < n; i++) {
        unsigned byte;
        if (sscanf(text + 2 * i, "%2x", &byte) != 1)
            return false;
        slot->bytes[i] = (uint8_t)byte;
    }
    slot->n = n;
    return true;
}

/* "slot N TEXT" */
static bool fault_slot(struct sim *sim, const char *text)
{
    char *end;
    unsigned long i = strtoul(text, &end, 10);
    if (end == text || i >= OCEAN_SLOTS || (*end != ' ' && *end != '\0'))
        return false;
    return slot_bytes(*end == ' ' ? end + 1 : end, &sim->slots[i]);
}

static bool fault_silent(struct sim *sim, const char *address)
{
    struct ocean_endpoint *endpoint = endpoint_of(sim, (uint8_t)strtoul(address, NULL, 16));
    if (endpoint != NULL)
        endpoint->silent = true;
    return endpoint != NULL;
}

static void end_faults(struct sim *sim)
{
    sim->faults = no_faults;
    sim->detector.lamp_broken = false;
    for (size_t i = 0; i < ENDPOINTS; i++)
        sim->endpoints[i].silent = false;
}

static bool fault_flag(struct sim *sim, const char *kind)
{
    struct faults *f = &sim->faults;
    const struct {
        const char *kind;
        bool *flag;
    } flags[] = {
        { "mute", &f->mute },        { "sync", &f->sync },
        { "stale", &f->stale },      { "twice", &f->twice },
        { "short", &f->cut_answer }, { "slots", &f->garbage_slots },
        { "gone", &f->gone },        { "lamp", &sim->detector.lamp_broken },
    };
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        if (strcmp(kind, flags[i].kind) == 0) {
            *flags[i].flag = true;
            return true;
        }
    return false;
}

static bool fault(struct sim *sim, const char *text)
{
    struct faults *f = &sim->faults;
    char kind[16];
    int length = 0;
    if (sscanf(text, "%15s %n", kind, &length) != 1)
        return false;
    const char *argument = text + length;
    double x;
    if (strcmp(kind, "slot") == 0)
        return fault_slot(sim, argument);
    if (strcmp(kind, "silent") == 0)
        return fault_silent(sim, argument);
    if (strcmp(kind, "delay") == 0)
        return number(argument, 0, 1e6, &f->delay_ms);
    if (strcmp(kind, "stall") == 0) {
        int at = (int)strtoul(argument, NULL, 16);
        bool there = at == 0 || endpoint_of(sim, (uint8_t)at) != NULL;
        f->stall = there ? at : f->stall;
        return there;
    }
    if (strcmp(kind, "truncate") == 0 && number(argument, 0, 2 * OCEAN_MAX_PIXELS, &x)) {
        f->truncate = (long)x;
        return true;
    }
    if (strcmp(kind, "overlong") == 0 && number(argument, 1, MOST_OVERLONG, &x)) {
        f->overlong = (long)x;
        return true;
    }
    if (*argument != '\0')
        return false;
    if (strcmp(kind, "hang") == 0)
        f->truncate = (long)sim->endpoints[AT_82].packet;
    else if (strcmp(kind, "none") == 0)
        end_faults(sim);
    else
        return fault_flag(sim, kind);
    return true;
}

static bool act(struct sim *sim, const char *action, int64_t now_us)
{
    struct ocean_scene *scene = &sim->detector.scene;
    bool known = true;
    pass(sim, now_us);
    if (strncmp(action, "place ", 6) == 0)
        known = ocean_scene_place(scene, action + 6);
    else if (strncmp(action, "lightness ", 10) == 0)
        known = number(action + 10, 5, 95, &scene->lightness);
    else if (strncmp(action, "lamp ", 5) == 0)
        known = number(action + 5, 0, 100, &scene->lamp);
    else if (strncmp(action, "fault ", 6) == 0)
        known = fault(sim, action + 6);
    else if (strcmp(action, "reset") == 0)
        reset(sim);
    else
        return strcmp(action, "unwritten") == 0 && sim->writes == 0;
    ocean_detector_look(&sim->detector);
    pass(sim, now_us);
    return known;
}

/* ---- what it is ---------------------------------------------------------------------- */

/* The trap of the sphere is open: nothing of the gloss arrives. */
static double truth(const struct sim *sim, double nm, bool sci)
{
    double gloss = sim->detector.scene.under == OCEAN_BLACK ? 0 : 0.04;
    return ocean_scene_reflectance(&sim->detector.scene, nm) + (sci ? gloss : 0);
}

unsigned ocean_writes(const struct sim *sim)
{
    return sim->writes;
}

unsigned ocean_exposures(const struct sim *sim)
{
    return sim->detector.taken;
}

unsigned ocean_unasked_exposures(const struct sim *sim)
{
    return sim->detector.unasked;
}

uint8_t ocean_last_command(const struct sim *sim)
{
    return sim->last_command;
}

double ocean_light(const struct sim *sim, size_t i, uint32_t integration_us)
{
    return ocean_detector_light(&sim->detector, i, integration_us);
}

/* A function has no room for the model. */
#define KIND(NAME, PID, PRODUCT) \
    static struct sim *make_##NAME(const char *options) \
    { \
        return make(&ocean_##NAME, options); \
    } \
    const struct sim_kind sim_##NAME = { .name = #NAME, \
                                         .make = make_##NAME, \
                                         .free = ocean_free, \
                                         .take = take, \
                                         .give = give, \
                                         .act = act, \
                                         .truth = truth, \
                                         .vid = 0x2457, \
                                         .pid = PID, \
                                         .product = PRODUCT }

KIND(usb2000, 0x101e, "USB2000+");
KIND(usb4000, 0x1022, "USB4000");
KIND(hr2000, 0x1016, "HR2000+");
KIND(hr4000, 0x1012, "HR4000");
