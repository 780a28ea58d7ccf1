/* serve_table.c - table.list, table.info. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/number.h"
#include "json/give.h"
#include "match/grid.h"
#include "station/params.h"
#include "station/serve.h"
#include "station/ticket.h"

static const char *const state_names[] = { "ready", "loading", "available", "failed", "failed" };

static void add_bands(cJSON *object, const struct recipe *recipe)
{
    if (recipe->bands == 0)
        return;
    cJSON *bands = cJSON_AddObjectToObject(object, "bands");
    cJSON_AddNumberToObject(bands, "first_nm", recipe->first_nm);
    cJSON_AddNumberToObject(bands, "step_nm", recipe->step_nm);
    cJSON_AddNumberToObject(bands, "bands", (double)recipe->bands);
}

static cJSON *entry_json(const struct tables_entry *entry)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "name", entry->name);
    cJSON_AddStringToObject(object, "state", state_names[entry->state]);
    if (entry->state == TABLES_FAILED)
        cJSON_AddStringToObject(object, "error", entry->error);
    cJSON_AddBoolToObject(object, "default", entry->is_default);
    if (!entry->info_known)
        return object;
    cJSON_AddStringToObject(object, "table_sha256", entry->info.content_sha256);
    cJSON_AddStringToObject(object, "model", entry->info.recipe.model->name);
    cJSON_AddNumberToObject(object, "rows", (double)entry->info.rows);
    add_bands(object, &entry->info.recipe);
    return object;
}

static void add_entry(void *context, const struct tables_entry *entry)
{
    json_give_item(context, entry_json(entry));
}

void serve_table_list(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    cJSON *result = cJSON_CreateObject();
    tables_list(station->tables, add_entry, cJSON_AddArrayToObject(result, "tables"));
    station_answer(station, &ticket, result);
}

/* ---- one of them -------------------------------------------------------------------- */

struct wanted {
    const char *name; /* NULL: the default one */
    bool is_there;
    cJSON *found; /* NULL: no memory for it */
};

static void add_axis(cJSON *object, const char *name, const struct axis *axis)
{
    char text[AXIS_TEXT_SIZE];
    cJSON_AddStringToObject(object, name, axis_format(axis, text));
}

static void add_details(cJSON *object, const struct table_file_info *info)
{
    const struct recipe *recipe = &info->recipe;
    add_axis(object, "Cm", &recipe->grid.Cm);
    add_axis(object, "Bm", &recipe->grid.Bm);
    add_axis(object, "Ch", &recipe->grid.Ch);
    cJSON_AddStringToObject(object, "illuminant", illuminant_name(recipe->illuminant));
    cJSON_AddStringToObject(object, "observer", observer_name(recipe->observer));
    cJSON_AddNumberToObject(object, "epidermis_mm", recipe->epidermis_mm);
    cJSON_AddStringToObject(object, "code_version", info->code_version);
}

static void pick_entry(void *context, const struct tables_entry *entry)
{
    struct wanted *wanted = context;
    bool is_it = wanted->name != NULL ? strcmp(wanted->name, entry->name) == 0 : entry->is_default;
    if (!is_it || wanted->is_there)
        return;
    wanted->is_there = true;
    wanted->found = entry_json(entry);
    if (entry->info_known)
        add_details(wanted->found, &entry->info);
}

void serve_table_info(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct wanted wanted = { .name = params_text(request, "table") };
    tables_list(station->tables, pick_entry, &wanted);
    if (wanted.is_there)
        station_answer(station, &ticket, wanted.found);
    else if (wanted.name != NULL)
        station_refuse_for(station, &ticket, REASON_TABLE_UNKNOWN, NULL);
    else
        station_refuse_for(station, &ticket, REASON_TABLE_MISSING, "%s",
                           tables_error(station->tables, NULL));
}
