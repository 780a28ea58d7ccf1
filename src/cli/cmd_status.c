/* cmd_status.c - how the station is. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "cli/command.h"
#include "cli/guide.h"
#include "cli/instrument_out.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/remote.h"

static const struct argp_option options[] = {
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON_ONE,
    { 0 },
};

/* "ok", or what is wrong and what to do. */
static void print_part(const cJSON *status, const char *name, const char *error_name)
{
    const char *error = member_text(status, error_name);
    printf("%-9s %s%s%s\n", name, member_text(status, name), *error != '\0' ? ": " : "", error);
}

static void print_status(const cJSON *status, const char *right)
{
    char text[GUIDE_TIME_SIZE];
    printf("station   %s, up %s%s%s\n", member_text(status, "server"),
           guide_duration(member_number(status, "uptime_s"), text),
           *member_text(status, "station_id") != '\0' ? ", id " : "",
           member_text(status, "station_id"));
    print_part(status, "store", "store_error");
    if (cJSON_IsFalse(member(status, "store_sound")))
        puts("          NOT sound; what is wrong: skinspec store verify");
    print_part(status, "table", "table_error");
    printf("records   last %" PRId64 "\n", member_integer(status, "last_seq"));
    printf("clients   %" PRId64 ", you as %s\n\n", member_integer(status, "clients"), right);
    instrument_out(member(status, "instruments"));
}

int cmd_status(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        option_parse_station,
        "",
        "How the station is: program, store, table, clients, instruments.\v"
        "Exit status 0 says that the station answered, whatever it said: programs look at the "
        "members store and table of --json (status.get in docs/protocol.md).\n\n"
        "Example: skinspec status --json\n",
        NULL,
        NULL,
        NULL
    };
    struct option_station station = { NULL, OUT_PLAIN };
    struct remote *remote;
    option_parse(&argp, "status", argc, argv, &station);
    if (remote_open(station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *status = remote_ask(remote, METHOD_STATUS_GET, NULL);
    bool good = status != NULL;
    if (good && station.format != OUT_PLAIN) {
        out_one(status);
    } else if (good) {
        print_status(status, member_text(remote_session(remote), "right"));
        cJSON_Delete(status);
    }
    remote_close(remote);
    return out_exit(good);
}
