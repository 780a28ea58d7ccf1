/* cmd_store.c - `skinspec store ...`: the table of its commands, verify and begin-anew. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "cli/command.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/prompt.h"
#include "cli/remote.h"
#include "cli/subcommand.h"

/* ---- verify ------------------------------------------------------------------------- */

static const struct argp_option verify_options[] = {
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

static void print_verified(const cJSON *result)
{
    printf("records     %" PRId64, member_integer(result, "records"));
    if (member_integer(result, "records") > 0)
        printf(", seq %" PRId64 " to %" PRId64, member_integer(result, "first_seq"),
               member_integer(result, "last_seq"));
    printf("\naudit rows  %" PRId64 "\n", member_integer(result, "audit_rows"));
    if (*member_text(result, "last_hash") != '\0')
        printf("last hash   %s\n", member_text(result, "last_hash"));
    if (member_true(result, "sound"))
        puts("sound");
    else
        printf("NOT sound: %s\n", member_text(result, "what"));
}

static int run_verify(int argc, char **argv)
{
    static const struct argp argp = {
        verify_options,
        option_parse_station,
        "",
        "Check the station's store: pages, references, gap-free seq, and the audit chain against "
        "every row.\v"
        "Exit status 1 where something is wrong.  The last hash, kept elsewhere, later shows "
        "whether the chain was made anew.  Needs the right 'admin'.\n\n"
        "Example: skinspec store verify\n",
        NULL,
        NULL,
        NULL
    };
    struct option_station station = { NULL, OUT_PLAIN };
    struct remote *remote;
    option_parse(&argp, "store verify", argc, argv, &station);
    if (remote_open(station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *result = remote_ask(remote, METHOD_STORE_VERIFY, NULL);
    bool sound = member_true(result, "sound");
    if (result != NULL && station.format != OUT_PLAIN) {
        out_one(result);
    } else if (result != NULL) {
        print_verified(result);
        cJSON_Delete(result);
    }
    remote_close(remote);
    return out_exit(sound);
}

/* ---- begin-anew --------------------------------------------------------------------- */

static const struct argp_option anew_options[] = {
    { "yes", OPTION_YES, NULL, 0, "Ask nobody", 0 },
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

struct anew_arguments {
    struct option_station station;
    bool yes;
};

static error_t parse_anew(int key, char *text, struct argp_state *state)
{
    struct anew_arguments *a = state->input;
    if (key != OPTION_YES)
        return option_station(key, text, state, &a->station);
    a->yes = true;
    return 0;
}

static int run_begin_anew(int argc, char **argv)
{
    static const struct argp argp = {
        anew_options,
        parse_anew,
        "",
        "After damage: accept an empty store from here on, with a station id of its own.\v"
        "The damaged file stays where the station moved it ('skinspec status' says where), and "
        "seq goes on above the records in it as far as they can be read.  Needs the right "
        "'admin'.\n\n"
        "Example: skinspec store begin-anew\n",
        NULL,
        NULL,
        NULL
    };
    struct anew_arguments a = { { NULL, OUT_PLAIN }, false };
    struct remote *remote;
    option_parse(&argp, "store begin-anew", argc, argv, &a);
    if (!a.yes) {
        int refused = prompt_refuses("Begin an empty store and leave the damaged one aside?");
        if (refused != EXIT_SUCCESS)
            return refused;
    }
    if (remote_open(a.station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *result = remote_ask(remote, METHOD_STORE_BEGIN_ANEW, NULL);
    bool good = result != NULL;
    if (good && a.station.format != OUT_PLAIN) {
        out_one(result);
    } else if (good) {
        printf("a new store, station id %s\n", member_text(result, "station_id"));
        cJSON_Delete(result);
    }
    remote_close(remote);
    return out_exit(good);
}

/* ---- all of them -------------------------------------------------------------------- */

static const struct subcommand subcommands[] = {
    { "verify", "                check every row and the audit chain", run_verify },
    { "begin-anew", "                after damage: an empty store from here on", run_begin_anew },
    { "subjects", "                whose skin was measured", cmd_subjects },
    { "add-subject", "[--label TEXT]  somebody new, under a random id", cmd_add_subject },
    { "forget-subject", "ID              erase a person for good", cmd_forget_subject },
};

int cmd_store(int argc, char **argv)
{
    return subcommand_run(argc, argv, "store",
                          "The station's store: every reading, kept for good.\n", subcommands,
                          sizeof subcommands / sizeof *subcommands);
}
