/* serve_site.c - site.list. */
#include "json/give.h"
#include "station/reading.h"
#include "station/serve.h"

enum { SITES_MAX = 3000 };

static bool add_site(void *context, const char *site)
{
    cJSON *sites = context;
    json_give_item(sites, cJSON_CreateString(site));
    return cJSON_GetArraySize(sites) < SITES_MAX;
}

static cJSON *read_sites(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    struct store_reader *reader = reading_store(worker, refusal);
    (void)reading;
    if (reader == NULL)
        return NULL;
    cJSON *result = cJSON_CreateObject();
    enum status s = store_list_sites(reader, add_site, cJSON_AddArrayToObject(result, "sites"));
    if (s == STATUS_OK)
        return result;
    reading_failed(worker, s, refusal);
    cJSON_Delete(result);
    return NULL;
}

void serve_site_list(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, 0);
    if (reading == NULL)
        return;
    reading->read = read_sites;
    reading_ask(reading, station->reader);
}
