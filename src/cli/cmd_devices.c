/* cmd_devices.c - the station's instruments and what each of them needs. */
#include <stdlib.h>

#include "cli/command.h"
#include "cli/instrument_out.h"
#include "cli/member.h"
#include "cli/options.h"
#include "cli/remote.h"

static const struct argp_option options[] = {
    OPTION_ROW_SOCKET,
    OPTION_ROWS_JSON,
    { 0 },
};

int cmd_devices(int argc, char **argv)
{
    static const struct argp argp = {
        options,
        option_parse_station,
        "",
        "The instruments of the station: how each stands, who holds it, and which calibration is "
        "due.\v"
        "Below an instrument stands what it needs before it can measure; 'skinspec calibrate' "
        "guides through it.  With --json the objects of instrument.list (docs/protocol.md).\n\n"
        "Example: skinspec devices\n",
        NULL,
        NULL,
        NULL
    };
    struct option_station station = { NULL, OUT_PLAIN };
    struct remote *remote;
    option_parse(&argp, "devices", argc, argv, &station);
    if (remote_open(station.socket, NULL, &remote) != STATUS_OK)
        return EXIT_FAILURE;
    cJSON *result = remote_ask(remote, METHOD_INSTRUMENT_LIST, NULL);
    if (result != NULL && station.format == OUT_PLAIN)
        instrument_out(member(result, "instruments"));
    else if (result != NULL)
        out_all(station.format, cJSON_DetachItemFromObjectCaseSensitive(result, "instruments"));
    cJSON_Delete(result);
    remote_close(remote);
    return out_exit(result != NULL);
}
