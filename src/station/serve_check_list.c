/* serve_check_list.c - check.list. */
#include <stdlib.h>
#include <string.h>

#include "json/give.h"
#include "station/bench.h"
#include "station/check_json.h"
#include "station/params.h"
#include "station/reading.h"
#include "station/serve.h"
#include "station/ticket.h"

enum { LIST_LIMIT = 100, TILES_MAX = 1000, TILE_BYTES = 128 };

struct page {
    struct store_check_query query;
    struct store_instrument instrument;
    char tile[STORE_TILE_SIZE];
    size_t limit, n;
    size_t bytes; /* of the line so far, at most */
    int64_t next_seq;
    bool more;
    cJSON *checks, *tiles;
};

static bool add_tile(void *context, const struct store_check_tile *tile)
{
    struct page *page = context;
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "tile", tile->tile);
    cJSON_AddNumberToObject(object, "limit", tile->limit_dE00);
    json_give_item(page->tiles, object);
    page->bytes += TILE_BYTES;
    return cJSON_GetArraySize(page->tiles) < TILES_MAX;
}

/* What a check may take as text: a number has at most 24 characters and a comma, and a
 * character of a text becomes six where it has to be escaped. */
static size_t most_bytes(const struct store_check *check)
{
    return 2048 + 6 * sizeof check->operator_name + 25 * check->spectrum.n;
}

static bool add_check(void *context, const struct store_check *check)
{
    struct page *page = context;
    if (page->n == page->limit ||
        (page->n > 0 && page->bytes + most_bytes(check) > PROTOCOL_MAX_LINE)) {
        page->more = true;
        return false;
    }
    json_give_item(page->checks, check_json(check));
    page->bytes += most_bytes(check);
    page->next_seq = check->seq;
    page->n++;
    return true;
}

static cJSON *read_page(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    struct page *page = reading->own;
    struct store_reader *reader = reading_store(worker, refusal);
    if (reader == NULL)
        return NULL;
    cJSON *result = cJSON_CreateObject();
    page->checks = cJSON_AddArrayToObject(result, "checks");
    page->tiles = cJSON_AddArrayToObject(result, "tiles");
    page->next_seq = page->query.since_seq;
    page->bytes = 1024;
    enum status s = store_list_check_tiles(reader, "", add_tile, page);
    if (s == STATUS_OK)
        s = store_list_checks(reader, &page->query, add_check, page);
    if (s != STATUS_OK) {
        reading_failed(worker, s, refusal);
        cJSON_Delete(result);
        return NULL;
    }
    cJSON_AddNumberToObject(result, "next_seq", (double)page->next_seq);
    cJSON_AddBoolToObject(result, "more", page->more);
    return result;
}

/* False: there is no such instrument, or it never said who it is. */
static bool find_instrument(struct station *station, const struct request *request,
                            struct page *page)
{
    const char *name = params_text(request, "instrument");
    const struct bench *bench = name != NULL ? bench_find(station, name) : NULL;
    if (name == NULL)
        return true;
    if (bench == NULL || !bench->known)
        return false;
    page->instrument = bench_instrument(bench);
    page->query.instrument = &page->instrument;
    return true;
}

void serve_check_list(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct reading *reading = reading_make(station, client, request, sizeof(struct page));
    if (reading == NULL)
        return;
    struct page *page = reading->own;
    page->query.since_seq = params_integer(request, "since_seq", 0);
    page->limit = (size_t)params_integer(request, "limit", LIST_LIMIT);
    params_copy(request, "tile", page->tile, sizeof page->tile);
    page->query.tile = page->tile[0] != '\0' ? page->tile : NULL;
    if (!find_instrument(station, request, page)) {
        station_refuse_for(station, &ticket, REASON_INSTRUMENT_UNKNOWN, NULL);
        reading_free(reading);
        return;
    }
    reading->read = read_page;
    reading_ask(reading, station->reader);
}
