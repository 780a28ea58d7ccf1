/* options.c - texts of options into values, or a usage error that says which. */
#include "cli/options.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/number.h"
#include "base/uuid.h"
#include "db/table_schema.h"
#include "optics/dipole.h"
#include "station/protocol.h"

double option_number(struct argp_state *state, const char *option, const char *text, double low,
                     double high)
{
    double x = 0.0;
    enum status s = number_parse(text, &x);
    if (s == STATUS_FORMAT)
        argp_error(state, "--%s: '%s' is not a number", option, text);
    if (s != STATUS_OK || x < low || x > high)
        argp_error(state, "--%s: %s is outside %g..%g", option, text, low, high);
    return x;
}

size_t option_count(struct argp_state *state, const char *option, const char *text, size_t low,
                    size_t high)
{
    size_t n = 0;
    if (number_parse_count(text, high, &n) != STATUS_OK || n < low)
        argp_error(state, "--%s: '%s' is not a whole number %zu..%zu", option, text, low, high);
    return n;
}

enum illuminant option_illuminant(struct argp_state *state, const char *text)
{
    enum illuminant illuminant = ILLUMINANT_D65;
    if (illuminant_parse(text, &illuminant) != STATUS_OK)
        argp_error(state, "--illuminant: '%s' is none of A C D50 D55 D65 D75 E FL2 FL7 FL11 LED-B3",
                   text);
    return illuminant;
}

enum observer option_observer(struct argp_state *state, const char *text)
{
    enum observer observer = OBSERVER_10DEG;
    if (observer_parse(text, &observer) != STATUS_OK)
        argp_error(state, "--observer: '%s' is neither 2 nor 10 (degrees)", text);
    return observer;
}

const struct model *option_model(struct argp_state *state, const char *text)
{
    const struct model *model = model_find(text);
    char names[256] = "";
    for (size_t i = 0, at = 0; i < MODEL_COUNT && at < sizeof names; i++)
        at += (size_t)snprintf(names + at, sizeof names - at, "%s%s", i > 0 ? ", " : "",
                               model_list[i].name);
    if (model == NULL)
        argp_error(state, "--model: there is no model '%s'; expected one of %s", text, names);
    return model;
}

bool option_format(int key, enum out_format *format)
{
    if (key != OPTION_JSON && key != OPTION_NDJSON)
        return false;
    *format = key == OPTION_JSON ? OUT_JSON : OUT_NDJSON;
    return true;
}

void option_file(struct argp_state *state, const char *text, const char **path)
{
    if (*path != NULL)
        argp_error(state, "one FILE at a time");
    *path = text;
}

struct option_bands option_bands(struct argp_state *state, const char *text)
{
    struct option_bands b = { 0 };
    enum status s = table_bands_parse(text, &b.first_nm, &b.step_nm, &b.n);
    if (s == STATUS_FORMAT)
        argp_error(state, "--bands: '%s' is not LO:HI:STEP in nm, as 400:700:10", text);
    if (s == STATUS_RANGE)
        argp_error(
            state,
            "--bands: '%s': HI must lie above LO by a whole number of steps, at most %d bands",
            text, SPECTRUM_MAX_BANDS);
    double last_nm = b.first_nm + (double)(b.n - 1) * b.step_nm;
    if (b.first_nm < CHROMOPHORES_MIN_NM || last_nm > CHROMOPHORES_MAX_NM)
        argp_error(state, "--bands: '%s' leaves %g..%g nm, where haemoglobin is known", text,
                   CHROMOPHORES_MIN_NM, CHROMOPHORES_MAX_NM);
    return b;
}

static double option_eta(struct argp_state *state, const char *text)
{
    double A, eta = option_number(state, "eta", text, 0.0, 1e6);
    if (dipole_A(eta, &A) != STATUS_OK)
        argp_error(state,
                   "--eta: at %s the internal reflection F_dr reaches 1; expected an index above "
                   "0.260 and below 3.848",
                   text);
    return eta;
}

bool option_skin(int key, const char *text, struct argp_state *state, struct tissue *t,
                 unsigned *given)
{
    switch (key) {
    case OPTION_CM:
        t->Cm = option_number(state, "cm", text, 0.0, 1.0);
        break;
    case OPTION_BM:
        t->Bm = option_number(state, "bm", text, 0.0, 1.0);
        break;
    case OPTION_CH:
        t->Ch = option_number(state, "ch", text, 0.0, 1.0);
        break;
    case OPTION_GAMMA:
        t->gamma = option_number(state, "gamma", text, 0.0, 1.0);
        break;
    case OPTION_EPIDERMIS_MM:
        t->epidermis_mm = option_number(state, "epidermis-mm", text, 0.0, TISSUE_EPIDERMIS_MM_MAX);
        break;
    case OPTION_ETA:
        t->eta = option_eta(state, text);
        break;
    default:
        return false;
    }
    *given |= 1u << (key - OPTION_CM);
    return true;
}

static void need_skin(struct argp_state *state, unsigned given)
{
    static const char *const name[] = { "cm", "bm", "ch" };
    for (unsigned i = 0; i < 3; i++)
        if (!(given & 1u << i))
            argp_error(state, "--%s is missing", name[i]);
}

struct option_skin_bands option_skin_bands_default(void)
{
    return (
        struct option_skin_bands){ tissue_of(0.0, 0.0, 0.0), 0, { 380.0, 10.0, 37 }, OUT_PLAIN };
}

error_t option_parse_skin_bands(int key, char *text, struct argp_state *state,
                                struct option_skin_bands *a)
{
    switch (key) {
    case OPTION_BANDS:
        a->bands = option_bands(state, text);
        return 0;
    case ARGP_KEY_ARG:
        option_unexpected(state, text);
        return 0;
    case ARGP_KEY_END:
        need_skin(state, a->given);
        return 0;
    default:
        return option_format(key, &a->format) ||
                       option_skin(key, text, state, &a->tissue, &a->given)
                   ? 0
                   : ARGP_ERR_UNKNOWN;
    }
}

error_t option_station(int key, char *text, struct argp_state *state,
                       struct option_station *station)
{
    if (key == OPTION_SOCKET)
        station->socket = text;
    else if (key == ARGP_KEY_ARG)
        option_unexpected(state, text);
    else if (!option_format(key, &station->format))
        return ARGP_ERR_UNKNOWN;
    return 0;
}

error_t option_parse_station(int key, char *text, struct argp_state *state)
{
    return option_station(key, text, state, state->input);
}

const char *option_uuid(struct argp_state *state, const char *option, const char *text)
{
    if (!uuid_is_text(text))
        argp_error(state, "%s: '%s' is no uuid, as 018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b", option,
                   text);
    return text;
}

int64_t option_seq(struct argp_state *state, const char *option, const char *text)
{
    return (int64_t)option_count(state, option, text, 0, (size_t)PROTOCOL_MAX_INTEGER);
}

void option_unexpected(struct argp_state *state, const char *text)
{
    argp_error(state, "'%s' is not expected; values go with options, see --help", text);
}

void option_parse(const struct argp *argp, const char *command, int argc, char **argv, void *input)
{
    static char name[64]; /* argp keeps the pointer */
    snprintf(name, sizeof name, "skinspec %s", command);
    argv[0] = name;
    argp_parse(argp, argc, argv, 0, NULL, input);
}
