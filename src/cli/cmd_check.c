/* cmd_check.c - a check tile: measured and compared, its reference, its history. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/uuid.h"
#include "cli/certificate.h"
#include "cli/check_out.h"
#include "cli/command.h"
#include "cli/guide.h"
#include "cli/instrument.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/prompt.h"
#include "cli/remote.h"

enum {
    OPTION_TILE = OPTION_OWN,
    OPTION_REFERENCE,
    OPTION_DE00,
    OPTION_HISTORY,
    OPTION_REPLICATES,
    OPTION_OPERATOR,
    OPTION_WAIT,
};
enum { MAX_REPLICATES = 32, TILE_SIZE = 64 };
#define FIRST_TILE "tile" /* the name of the first one, where none is given */

static const struct argp_option options[] = {
    OPTION_ROW_INSTRUMENT,
    { "tile", OPTION_TILE, "NAME", 0, "Which tile (the only one)", 0 },
    { "reference", OPTION_REFERENCE, NULL, 0,
      "Make its reference: of FILE, its certificate, else by measuring it now", 0 },
    { "limit", OPTION_DE00, "X", 0,
      "Largest dE00 that passes, 0.01..20 (0.5 at first); alone: nothing is measured", 0 },
    { "history", OPTION_HISTORY, NULL, 0, "Show the checks there were, oldest first", 0 },
    { "replicates", OPTION_REPLICATES, "N", 0, "Shots, 1..32 (3)", 0 },
    { "operator", OPTION_OPERATOR, "NAME", 0, "Who measures; kept with the check", 0 },
    { "wait", OPTION_WAIT, NULL, 0, "Wait where somebody else has the instrument", 0 },
    { "yes", OPTION_YES, NULL, 0, "The tile lies under the port: ask nobody", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct arguments {
    struct option_station station;
    const char *instrument, *tile, *operator_name;
    const char *file;  /* the certificate; NULL: none */
    double limit;      /* NAN: not given */
    size_t replicates; /* 0: not given */
    bool reference, history, wait, yes;
};

static void check(struct argp_state *state, const struct arguments *a)
{
    bool sets = a->reference || !isnan(a->limit);
    if (a->history && (sets || a->replicates > 0 || a->yes))
        argp_error(state, "--history shows what was; --tile and --instrument narrow it down");
    if (a->file != NULL && !a->reference)
        argp_error(state, "FILE is the certificate of a tile and goes with --reference");
    if (a->replicates > 0 && (a->file != NULL || (sets && !a->reference)))
        argp_error(state, "--replicates has no meaning where nothing is measured");
}

/* As the protocol's format "name" has it. */
static const char *tile_of(struct argp_state *state, const char *text)
{
    static const char allowed[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
    size_t n = strlen(text);
    if (n == 0 || n >= TILE_SIZE || text[0] == '-' || strspn(text, allowed) != n)
        argp_error(state,
                   "--tile: '%.63s' is no name: up to %d letters, digits, - and _, no - first",
                   text, TILE_SIZE - 1);
    return text;
}

static error_t parse_what(int key, char *text, struct argp_state *state, struct arguments *a)
{
    switch (key) {
    case OPTION_TILE:
        a->tile = tile_of(state, text);
        break;
    case OPTION_REFERENCE:
        a->reference = true;
        break;
    case OPTION_DE00:
        a->limit = option_number(state, "limit", text, 0.01, 20.0);
        break;
    case OPTION_HISTORY:
        a->history = true;
        break;
    case OPTION_REPLICATES:
        a->replicates = option_count(state, "replicates", text, 1, MAX_REPLICATES);
        break;
    case ARGP_KEY_ARG:
        option_file(state, text, &a->file);
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
    case OPTION_YES:
        a->yes = true;
        break;
    case ARGP_KEY_END:
        check(state, a);
        break;
    default:
        if (parse_what(key, text, state, a) == 0)
            return 0;
        return option_station(key, text, state, &a->station);
    }
    return 0;
}

/* ---- which tile --------------------------------------------------------------------- */

static void log_tiles(const cJSON *tiles)
{
    char names[512] = "";
    const cJSON *one;
    cJSON_ArrayForEach(one, tiles)
    {
        size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", used > 0 ? ", " : "",
                 member_text(one, "tile"));
    }
    log_error("say which tile by --tile NAME; the station knows %s", names);
}

/* Into *name where none was given.  EXIT_SUCCESS, else logged. */
static int choose_tile(struct remote *remote, const struct arguments *a, char name[TILE_SIZE])
{
    if (a->tile != NULL) {
        snprintf(name, TILE_SIZE, "%s", a->tile);
        return EXIT_SUCCESS;
    }
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "limit", 1);
    cJSON *list = remote_ask(remote, METHOD_CHECK_LIST, params);
    const cJSON *tiles = member(list, "tiles");
    int n = cJSON_GetArraySize(tiles), exit_status = EXIT_SUCCESS;
    if (list == NULL) {
        exit_status = EXIT_FAILURE;
    } else if (n == 1) {
        snprintf(name, TILE_SIZE, "%s", member_text(cJSON_GetArrayItem(tiles, 0), "tile"));
    } else if (n > 1) {
        log_tiles(tiles);
        exit_status = EXIT_USAGE;
    } else if (a->reference) {
        snprintf(name, TILE_SIZE, FIRST_TILE);
    } else {
        log_error("no check tile has a reference yet; make one with the tile at hand: skinspec "
                  "check --tile NAME --reference");
        exit_status = EXIT_FAILURE;
    }
    cJSON_Delete(list);
    return exit_status;
}

/* ---- history ------------------------------------------------------------------------ */

static cJSON *history_params(const struct arguments *a, int64_t since_seq)
{
    cJSON *params = cJSON_CreateObject();
    cJSON_AddNumberToObject(params, "since_seq", (double)since_seq);
    if (a->tile != NULL)
        cJSON_AddStringToObject(params, "tile", a->tile);
    if (a->instrument != NULL)
        cJSON_AddStringToObject(params, "instrument", a->instrument);
    return params;
}

static int show_history(struct remote *remote, const struct arguments *a)
{
    struct out out;
    bool more = true, good = true;
    int64_t since_seq = 0;
    out_begin(&out, a->station.format);
    if (out.format == OUT_PLAIN)
        check_out_head();
    while (more && good) {
        cJSON *page = remote_ask(remote, METHOD_CHECK_LIST, history_params(a, since_seq)), *one;
        cJSON *checks = cJSON_GetObjectItemCaseSensitive(page, "checks");
        good = page != NULL;
        while (good && (one = cJSON_DetachItemFromArray(checks, 0)) != NULL) {
            if (out.format != OUT_PLAIN) {
                out_object(&out, one);
                continue;
            }
            check_out_line(one);
            cJSON_Delete(one);
        }
        since_seq = member_integer(page, "next_seq");
        more = member_true(page, "more");
        cJSON_Delete(page);
    }
    good = out_end(&out) == STATUS_OK && good;
    return out_exit(good);
}

/* ---- asking the station ------------------------------------------------------------- */

/* Given away.  The result, or NULL, logged: the caller's to delete. */
static cJSON *ask(struct remote *remote, const struct arguments *a, const char *tile, cJSON *params)
{
    char uuid[UUID_TEXT_SIZE];
    struct answer answer;
    cJSON *result = NULL;
    bool sets = a->reference || !isnan(a->limit);
    if (uuid4_make(uuid) != STATUS_OK) {
        log_error("the system has no random numbers for a uuid");
        cJSON_Delete(params);
        return NULL;
    }
    cJSON_AddStringToObject(params, "uuid", uuid);
    cJSON_AddStringToObject(params, "tile", tile);
    if (!isnan(a->limit))
        cJSON_AddNumberToObject(params, "limit", a->limit);
    if (a->replicates > 0)
        cJSON_AddNumberToObject(params, "replicates", (double)a->replicates);
    if (!remote_try(remote, sets ? METHOD_CHECK_SET : METHOD_CHECK_TAKE, params, &answer))
        return NULL;
    if (answer.result != NULL)
        result = cJSON_DetachItemFromObjectCaseSensitive(answer.tree, "result");
    else
        remote_complain(&answer);
    remote_done(&answer);
    return result;
}

/* Calibrated where that is due, and the tile in place. */
static bool make_ready(struct remote *remote, const struct arguments *a, const cJSON *instrument,
                       const char *tile, int *exit_status)
{
    char what[128];
    bool was_due = guide_is_due(instrument);
    if (!guide_ready(remote, instrument))
        return false;
    if (a->yes && !was_due)
        return true; /* else what the calibration needed lies there */
    if (!prompt_is_possible()) {
        log_error("standard input is no terminal, so nobody can be asked to place the tile; --yes "
                  "says that it lies under the port");
        *exit_status = EXIT_USAGE;
        return false;
    }
    snprintf(what, sizeof what, "put the port on the check tile '%s'", tile);
    return guide_place(remote, stderr, what);
}

/* Under the lease, which is given back. */
static cJSON *measure(struct remote *remote, const struct arguments *a, const char *name,
                      const char *tile, int *exit_status)
{
    cJSON *instrument = NULL, *result = NULL;
    cJSON *subscribed = remote_subscribe(remote, 1u << EVENT_LEASE, -1);
    *exit_status = EXIT_FAILURE;
    if (subscribed != NULL && instrument_acquire(remote, name, a->wait))
        instrument = instrument_choose(remote, name, exit_status);
    if (instrument != NULL && make_ready(remote, a, instrument, tile, exit_status))
        result = ask(remote, a, tile, remote_lease_params(remote));
    instrument_release(remote);
    cJSON_Delete(subscribed);
    cJSON_Delete(instrument);
    return result;
}

static cJSON *set_from_file(struct remote *remote, const struct arguments *a,
                            const cJSON *instrument, const char *tile)
{
    cJSON *params = cJSON_CreateObject();
    double aperture_mm = member_number(instrument, "aperture_mm");
    if (isnan(aperture_mm)) {
        log_error("%s has not been opened yet, so its port is not known: %s",
                  member_text(instrument, "instrument"), member_text(instrument, "error"));
        cJSON_Delete(params);
        return NULL;
    }
    if (!certificate_read(a->file, aperture_mm, params)) {
        cJSON_Delete(params);
        return NULL;
    }
    return ask(remote, a, tile, params);
}

static int finish(const struct arguments *a, cJSON *result)
{
    bool sets = a->reference || !isnan(a->limit);
    bool good = sets || member_true(result, "passed");
    if (a->station.format != OUT_PLAIN) {
        out_one(result);
        return out_exit(good);
    }
    if (sets)
        check_out_tile(result);
    else
        check_out(result);
    cJSON_Delete(result);
    return out_exit(good);
}

static int run(struct remote *remote, const struct arguments *a)
{
    char tile[TILE_SIZE];
    int exit_status;
    if (a->history)
        return show_history(remote, a);
    exit_status = choose_tile(remote, a, tile);
    if (exit_status != EXIT_SUCCESS)
        return exit_status;
    cJSON *result = NULL, *instrument = NULL;
    bool limit_alone = !isnan(a->limit) && !a->reference;
    exit_status = EXIT_FAILURE;
    if (limit_alone)
        result = ask(remote, a, tile, cJSON_CreateObject());
    else
        instrument = instrument_choose(remote, a->instrument, &exit_status);
    if (instrument != NULL && a->file != NULL)
        result = set_from_file(remote, a, instrument, tile);
    else if (instrument != NULL)
        result = measure(remote, a, member_text(instrument, "instrument"), tile, &exit_status);
    cJSON_Delete(instrument);
    return result != NULL ? finish(a, result) : exit_status;
}

int cmd_check(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        parse,
        "[FILE]",
        "Check an instrument against a small coloured tile that never changes: measures it, SCE, "
        "and compares it with its reference.  Where the difference (CIEDE2000, D65, 10 degrees) "
        "passes the limit, every later record of the instrument through that port carries the flag "
        "'drift', until a check of the same tile passes.\v"
        "First the reference, once: with the tile under the port of an instrument that is known to "
        "be sound, or from the tile's certificate, a spectrum file (as for 'skinspec convert') "
        "of one row with a column 'specular' that says sce.  A measured reference holds for the "
        "instrument that measured it, a certificate for all, and each only for the port "
        "(aperture) it was made for.  Setting reference and limit needs the right 'clinic'.\n\n"
        "Then each morning, after the calibration: skinspec check.  Exit status 0 where it passed, "
        "1 where it failed.\n\n"
        "Examples:\n"
        "  skinspec check --tile cyan --reference\n"
        "  skinspec check --tile cyan --reference certificate.csv --limit 1\n"
        "  skinspec check --operator Ada\n"
        "  skinspec check --history\n",
        NULL,
        NULL,
        NULL
    };
    struct arguments a = { .station = { NULL, OUT_PLAIN }, .limit = (double)NAN };
    struct remote *remote;
    option_parse(&argp, "check", argc, argv, &a);
    if (remote_open(a.station.socket, a.operator_name, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    int exit_status = run(remote, &a);
    remote_close(remote);
    return exit_status;
}
