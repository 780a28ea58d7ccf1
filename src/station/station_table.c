/* station_table.c - tables as the station has them. */
#include "station/station_table.h"

#include <stdio.h>
#include <string.h>

#include "station/parking.h"
#include "station/run.h"
#include "station/tell.h"

enum status station_table(struct station *station, const char *name, struct loaded_table **ret,
                          struct refusal *refusal)
{
    switch (tables_get(station->tables, name, ret)) {
    case TABLES_READY:
        return STATUS_OK;
    case TABLES_LOADING:
    case TABLES_AVAILABLE:
        return STATUS_CANCELLED;
    case TABLES_FAILED:
        refusal_set(refusal, REASON_TABLE_UNSUITABLE, "%s", tables_error(station->tables, name));
        return STATUS_NOT_FOUND;
    default:
        refusal_set(refusal, name == NULL ? REASON_TABLE_MISSING : REASON_TABLE_UNKNOWN, "%s",
                    name == NULL ? tables_error(station->tables, NULL) : "");
        return STATUS_NOT_FOUND;
    }
}

bool station_table_refines(const struct loaded_table *table, const struct refine_wish *wish,
                           struct refusal *refusal)
{
    const struct recipe *recipe = &loaded_table(table)->recipe;
    const char *why = NULL;
    struct fit fit;
    if (wish->kind == REFINE_NOT)
        return true;
    enum status s = refine_wish_fit(wish, recipe, &fit, &why);
    if (s == STATUS_OK)
        return true;
    refusal_set(refusal, s == STATUS_RANGE ? REASON_PARAMS_INVALID : REASON_TABLE_UNSUITABLE,
                "model %s: %s", recipe->model->name, why != NULL ? why : status_text(s));
    if (s == STATUS_RANGE) /* noise has ranges of its own: what is left is what was fixed */
        snprintf(refusal->path, sizeof refusal->path, "/params/fix");
    return false;
}

void station_table_add(struct station *station, cJSON *object, const char *error_name)
{
    static const char *const names[] = {
        [TABLES_READY] = "ready",   [TABLES_LOADING] = "loading", [TABLES_AVAILABLE] = "loading",
        [TABLES_FAILED] = "failed", [TABLES_UNKNOWN] = "missing",
    };
    enum tables_state state = tables_look(station->tables, NULL);
    cJSON_AddStringToObject(object, "table", names[state]);
    if (state == TABLES_FAILED || state == TABLES_UNKNOWN)
        cJSON_AddStringToObject(object, error_name, tables_error(station->tables, NULL));
}

void station_table_changed(void *context, const char *name)
{
    struct station *station = context;
    if (strcmp(name, station->settings->table) == 0) {
        cJSON *data = cJSON_CreateObject();
        station_table_add(station, data, "error");
        station_tell(station, EVENT_STORE, "table", data);
    }
    station_serve_parked(station);
    for (size_t i = 0; i < station->benches_n; i++)
        run_table_changed(station->benches[i]);
}
