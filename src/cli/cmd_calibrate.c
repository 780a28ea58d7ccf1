/* cmd_calibrate.c - zero and white, with a person guided through them. */
#include <stdio.h>
#include <stdlib.h>

#include "base/log.h"
#include "cli/command.h"
#include "cli/guide.h"
#include "cli/instrument.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/prompt.h"
#include "cli/remote.h"

static const struct argp_option options[] = {
    OPTION_ROW_INSTRUMENT,
    { "force", OPTION_FORCE, NULL, 0, "Every step, not only those that are due", 0 },
    { "yes", OPTION_YES, NULL, 0, "What each step needs lies there: ask nobody", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON,
    { 0 },
};

struct arguments {
    struct option_station station;
    const char *instrument;
    bool force, yes;
};

static error_t parse(int key, char *text, struct argp_state *state)
{
    struct arguments *a = state->input;
    switch (key) {
    case OPTION_INSTRUMENT:
        a->instrument = text;
        break;
    case OPTION_FORCE:
        a->force = true;
        break;
    case OPTION_YES:
        a->yes = true;
        break;
    default:
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

/* The instrument is chosen; how it stands is read again once the lease is ours. */
static int calibrate(struct remote *remote, const struct arguments *a, const char *name)
{
    struct guide guide = { .all = a->force, .yes = a->yes, .to = stdout };
    int exit_status = EXIT_FAILURE;
    if (!instrument_acquire(remote, name, false))
        return EXIT_FAILURE;
    cJSON *instrument = instrument_choose(remote, name, &exit_status);
    if (instrument == NULL)
        return exit_status;
    if (a->station.format != OUT_PLAIN) {
        guide.to = stderr;
        guide.steps = cJSON_CreateArray();
    }
    if (member(instrument, "calibration") == NULL) {
        log_error("%s is %s: %s", name, member_text(instrument, "state"),
                  member_text(instrument, "error"));
    } else if (!a->force && !guide_is_due(instrument)) {
        fprintf(guide.to, "%s: nothing is due\n", name);
        exit_status = EXIT_SUCCESS;
    } else if (!a->yes && !prompt_is_possible()) {
        log_error("standard input is no terminal, so nobody can be asked to place anything; "
                  "--yes says that what each step needs lies there");
        exit_status = EXIT_USAGE;
    } else if (guide_calibrate(remote, instrument, &guide)) {
        exit_status = EXIT_SUCCESS;
    }
    if (guide.steps != NULL)
        out_all(a->station.format, guide.steps);
    cJSON_Delete(instrument);
    instrument_release(remote);
    return exit_status;
}

int cmd_calibrate(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "",
        "Calibrate an instrument: for each step that is due, zero before white, says what to place "
        "at the port, waits for Enter, and does it.  What is not plausible is explained and asked "
        "for again.\v"
        "With --json an array of what instrument.calibrate answered; the guide then speaks on "
        "standard error.  Exit status 0 also where nothing was due.\n\n"
        "Examples:\n"
        "  skinspec calibrate\n"
        "  skinspec calibrate --instrument simulated --force --yes\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .station = { NULL, OUT_PLAIN } };
    struct remote *remote;
    int exit_status;
    option_parse(&argp, "calibrate", argc, argv, &a);
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *instrument = instrument_choose(remote, a.instrument, &exit_status);
    if (instrument != NULL)
        exit_status = calibrate(remote, &a, member_text(instrument, "instrument"));
    cJSON_Delete(instrument);
    remote_close(remote);
    return exit_status == EXIT_USAGE ? EXIT_USAGE : out_exit(exit_status == EXIT_SUCCESS);
}
