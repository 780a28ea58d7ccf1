/* serve_status.c - status.get, rpc.describe. */
#include "base/clock.h"
#include "base/version.h"
#include "json/give.h"
#include "station/bench.h"
#include "station/serve.h"
#include "station/station_store.h"
#include "station/station_table.h"
#include "station/ticket.h"

/* ---- status ------------------------------------------------------------------------- */

static void add_store(struct station *station, cJSON *status)
{
    const struct store_standing *store = &station->store;
    cJSON_AddStringToObject(status, "store", store_state_name(store->state));
    if (store->error[0] != '\0')
        cJSON_AddStringToObject(status, "store_error", store->error);
    if (store->verified)
        cJSON_AddBoolToObject(status, "store_sound", store->sound);
    cJSON_AddNumberToObject(status, "last_seq", (double)store->last_seq);
}

cJSON *status_json(struct station *station)
{
    char now[STORE_TIME_SIZE];
    cJSON *status = cJSON_CreateObject();
    clock_text(clock_realtime_ms(), now);
    cJSON_AddStringToObject(status, "server", "skinspecd " SKINSPEC_VERSION);
    if (station->store.station_id[0] != '\0')
        cJSON_AddStringToObject(status, "station_id", station->store.station_id);
    cJSON_AddStringToObject(status, "boot", station->boot);
    cJSON_AddNumberToObject(status, "uptime_s",
                            (double)(clock_boottime_ms() - station->started_ms) / 1e3);
    cJSON_AddStringToObject(status, "time", now);
    station_table_add(station, status, "table_error");
    add_store(station, status);
    cJSON_AddNumberToObject(status, "event_seq", (double)station->events.last_seq);
    cJSON_AddNumberToObject(status, "clients", (double)clients_count(station->clients).now);
    json_give_member(status, "instruments", bench_list_json(station));
    return status;
}

void serve_status_get(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    station_answer(station, &ticket, status_json(station));
}

/* ---- description -------------------------------------------------------------------- */

void serve_rpc_describe(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    cJSON *result = cJSON_CreateObject();
    cJSON_AddRawToObject(result, "schema", protocol_describe(station->protocol));
    station_answer(station, &ticket, result);
}
