/* cmd_measure.c - one measurement: options, instrument, calibration, answer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/uuid.h"
#include "cli/command.h"
#include "cli/guide.h"
#include "cli/instrument.h"
#include "cli/measurement.h"
#include "cli/member.h"
#include "cli/option_refine.h"
#include "cli/options.h"
#include "cli/record_out.h"
#include "cli/remote.h"
#include "db/store.h"
#include "match/nearest.h"

enum {
    OPTION_REPLICATES = OPTION_OWN,
    OPTION_PACE,
    OPTION_SPECULAR,
    OPTION_SURFACE,
    OPTION_SUBJECT,
    OPTION_SITE,
    OPTION_BY,
    OPTION_TABLE,
    OPTION_OPERATOR,
    OPTION_UUID,
    OPTION_WAIT,
};

static const struct argp_option options[] = {
    OPTION_ROW_INSTRUMENT,
    { "replicates", OPTION_REPLICATES, "N", 0, "Shots, 1..32 (3)", 0 },
    { "pace", OPTION_PACE, "auto|prompt", 0,
      "Shot after shot (auto), or each further one on Enter or the instrument's button", 0 },
    { "specular", OPTION_SPECULAR, "sce|sci", 0, "What to match by (sce)", 0 },
    { "surface", OPTION_SURFACE, "S", 0, "With sci: the part to take off (skin: about 0.04)", 0 },
    { "subject", OPTION_SUBJECT, "ID", 0, "Whose skin, as 'skinspec store subjects' says", 0 },
    { "site", OPTION_SITE, "TEXT", 0, "Where on the body", 0 },
    { "by", OPTION_BY, "WAY", 0, "rgb, rgb-float, lab, de2000, spectrum (as the table has it)", 0 },
    { "table", OPTION_TABLE, "NAME", 0, "Table to match with (the station's default)", 0 },
    OPTION_ROWS_REFINE("from the shots"),
    { "operator", OPTION_OPERATOR, "NAME", 0, "Who measures; kept with the record", 0 },
    { "uuid", OPTION_UUID, "UUID", 0, "Of an earlier try: gives its record, never a second one",
      0 },
    { "wait", OPTION_WAIT, NULL, 0, "Wait where somebody else has the instrument", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct arguments {
    struct option_station station;
    const char *instrument, *operator_name;
    bool wait;
    struct measurement measurement;
};

static const char *one_of(struct argp_state *state, const char *option, const char *text,
                          const char *const *names, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(names[i], text) == 0)
            return text;
    argp_error(state, "--%s: '%s' is not known; see --help", option, text);
    return text;
}

static const char *by_of(struct argp_state *state, const char *text)
{
    const char *const ways[] = { match_by_name(MATCH_RGB), match_by_name(MATCH_RGB_FLOAT),
                                 match_by_name(MATCH_LAB), match_by_name(MATCH_DE2000),
                                 match_by_name(MATCH_SPECTRUM) };
    return one_of(state, "by", text, ways, sizeof ways / sizeof *ways);
}

static void check(struct argp_state *state, const struct measurement *m)
{
    bool sci = strcmp(m->specular, "sci") == 0;
    if (sci && isnan(m->surface))
        argp_error(state, "--specular sci also needs --surface S, the part to take off (skin: "
                          "about 0.04)");
    if (!sci && !isnan(m->surface))
        argp_error(state, "--surface goes with --specular sci");
}

static error_t parse_how(int key, char *text, struct argp_state *state, struct measurement *m)
{
    static const char *const paces[] = { "auto", "prompt" }, *const speculars[] = { "sce", "sci" };
    switch (key) {
    case OPTION_REPLICATES:
        m->replicates = option_count(state, "replicates", text, 1, STORE_MAX_REPLICATES);
        break;
    case OPTION_PACE:
        m->pace = one_of(state, "pace", text, paces, 2);
        break;
    case OPTION_SPECULAR:
        m->specular = one_of(state, "specular", text, speculars, 2);
        break;
    case OPTION_SURFACE:
        m->surface = option_number(state, "surface", text, 0.0, SPECTRUM_SURFACE_MAX);
        break;
    case OPTION_BY:
        m->by = by_of(state, text);
        break;
    case OPTION_UUID:
        m->uuid = option_uuid(state, "--uuid", text);
        break;
    case OPTION_SUBJECT:
        m->subject = option_uuid(state, "--subject", text);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_INSTRUMENT:
        a->instrument = text;
        break;
    case OPTION_OPERATOR:
        a->operator_name = text;
        break;
    case OPTION_WAIT:
        a->wait = true;
        break;
    case OPTION_SITE:
        a->measurement.site = text;
        break;
    case OPTION_TABLE:
        a->measurement.table = text;
        break;
    case ARGP_KEY_END:
        check(state, &a->measurement);
        option_refine_check(state, &a->measurement.wish);
        break;
    default:
        if (option_refine(key, text, state, &a->measurement.wish))
            return 0;
        if (parse_how(key, text, state, &a->measurement) == 0)
            return 0;
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

/* The record, or NULL.  What was taken under the lease ends with it in every case. */
static cJSON *take(struct remote *remote, const struct arguments *a, const char *name)
{
    cJSON *record = NULL, *instrument = NULL;
    int exit_status;
    cJSON *subscribed = remote_subscribe(remote, 1u << EVENT_LEASE | 1u << EVENT_MEASUREMENT, -1);
    if (subscribed != NULL && instrument_acquire(remote, name, a->wait))
        instrument = instrument_choose(remote, name, &exit_status);
    if (instrument != NULL && guide_ready(remote, instrument))
        record = measurement_take(remote, instrument, &a->measurement);
    if (instrument != NULL)
        instrument_release(remote);
    cJSON_Delete(subscribed);
    cJSON_Delete(instrument);
    return record;
}

static int measure(struct remote *remote, const struct arguments *a)
{
    int exit_status;
    cJSON *instrument = instrument_choose(remote, a->instrument, &exit_status);
    if (instrument == NULL)
        return exit_status;
    cJSON *record = take(remote, a, member_text(instrument, "instrument"));
    bool good = record != NULL;
    cJSON_Delete(instrument);
    if (good && a->station.format != OUT_PLAIN) {
        out_one(record);
    } else if (good) {
        good = record_out(record) == STATUS_OK;
        cJSON_Delete(record);
    }
    return out_exit(good);
}

int cmd_measure(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Measure skin: takes the instrument, guides through a calibration that is due, takes the "
        "shots, and prints the record that was stored: colour, ITA, melanin (Cm), its blend (Bm), "
        "blood (Ch), and what to beware of; with --refine also the interval that holds each 95 "
        "times "
        "in 100.\v"
        "Place the port flat on the skin before.  Ctrl-C cancels: nothing is stored then.  With "
        "--json the record (docs/protocol.md); progress goes to standard error.\n\n"
        "Examples:\n"
        "  skinspec measure --site forearm --operator Ada\n"
        "  skinspec measure --refine=skin\n"
        "  skinspec measure --pace prompt --replicates 5 --json\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = {
        .station = { NULL, OUT_PLAIN },
        .measurement = { .replicates = 3,
                         .pace = "auto",
                         .specular = "sce",
                         .surface = NAN,
                         .wish = refine_wish_none() },
    };
    char uuid[UUID_TEXT_SIZE];
    struct remote *remote;
    option_parse(&argp, "measure", argc, argv, &a);
    if (a.measurement.uuid == NULL) {
        if (uuid4_make(uuid) != STATUS_OK) {
            log_error("the system has no random numbers for a uuid");
            return EXIT_FAILURE;
        }
        a.measurement.uuid = uuid;
    }
    if (remote_open(a.station.socket, a.operator_name, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    int exit_status = measure(remote, &a);
    remote_close(remote);
    return exit_status;
}
