/* serve_record.c - record.get, record.list, record.export, record.recompute. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/give.h"
#include "station/export.h"
#include "station/params.h"
#include "station/reading.h"
#include "station/serve.h"
#include "station/strict_json.h"
#include "station/ticket.h"
#include "station/wire.h"

enum { LIST_LIMIT = 100, EXPORT_LIMIT = 100000 };

/* ---- one ---------------------------------------------------------------------------- */

static cJSON *made_or_refused(enum status s, cJSON *made, struct refusal *refusal)
{
    if (s == STATUS_OK)
        return made;
    refusal_set(refusal, s == STATUS_NO_MEMORY ? REASON_NO_MEMORY : REASON_STORE_FAILED, NULL);
    return NULL;
}

static cJSON *read_one(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    cJSON *made = NULL;
    struct store_record *record = reading_record(reading, worker, refusal);
    if (record == NULL)
        return NULL;
    enum status s = wire_record(record, &made);
    free(record);
    return made_or_refused(s, made, refusal);
}

void serve_record_get(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, 0);
    if (reading == NULL)
        return;
    params_copy(request, "id", reading->id, sizeof reading->id);
    reading->read = read_one;
    reading_ask(reading, station->reader);
}

/* ---- a page ------------------------------------------------------------------------- */

struct page {
    struct store_query query;
    char subject[STORE_UUID_SIZE];
    size_t limit, n;
    size_t bytes; /* of the line so far, at most */
    int64_t next_seq;
    cJSON *records;
    enum status s;
    bool more;
};

/* What a record may take as text: a number has at most 24 characters and a comma. */
static size_t most_bytes(const struct store_record *record)
{
    size_t spectra = 1 + 2 * record->replicates;
    size_t match = strlen(record->match_json) + strlen(record->refined_json);
    return 8192 + match + spectra * (128 + 25 * record->spectrum.n);
}

static bool add_to_page(void *context, const struct store_record *record)
{
    struct page *page = context;
    cJSON *made;
    if (page->n == page->limit ||
        (page->n > 0 && page->bytes + most_bytes(record) > PROTOCOL_MAX_LINE)) {
        page->more = true;
        return false;
    }
    page->s = wire_record(record, &made);
    if (page->s != STATUS_OK)
        return false;
    json_give_item(page->records, made);
    page->bytes += most_bytes(record);
    page->next_seq = record->seq;
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
    page->records = cJSON_AddArrayToObject(result, "records");
    page->next_seq = page->query.since_seq;
    page->bytes = 1024;
    enum status s = store_list(reader, &page->query, add_to_page, page);
    if (s != STATUS_OK)
        reading_failed(worker, s, refusal);
    else if (page->s != STATUS_OK)
        (void)made_or_refused(page->s, NULL, refusal);
    if (s != STATUS_OK || page->s != STATUS_OK) {
        cJSON_Delete(result);
        return NULL;
    }
    cJSON_AddNumberToObject(result, "next_seq", (double)page->next_seq);
    cJSON_AddBoolToObject(result, "more", page->more);
    return result;
}

void serve_record_list(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, sizeof(struct page));
    if (reading == NULL)
        return;
    struct page *page = reading->own;
    page->query.since_seq = params_integer(request, "since_seq", 0);
    page->query.owner_uid = reading->kiosk ? reading->uid : -1;
    page->limit = (size_t)params_integer(request, "limit", LIST_LIMIT);
    params_copy(request, "subject", page->subject, sizeof page->subject);
    page->query.subject = page->subject[0] != '\0' ? page->subject : NULL;
    reading->read = read_page;
    reading_ask(reading, station->reader);
}

/* ---- export ------------------------------------------------------------------------- */

static cJSON *read_export(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    const struct export_request *wanted = reading->own;
    struct export_page page;
    struct store_reader *reader = reading_store(worker, refusal);
    if (reader == NULL)
        return NULL;
    enum status s = export_page(reader, wanted, &page);
    if (s != STATUS_OK) {
        reading_failed(worker, s, refusal);
        return NULL;
    }
    cJSON *result = cJSON_CreateObject();
    cJSON_AddStringToObject(result, "text", page.text);
    cJSON_AddNumberToObject(result, "next_seq", (double)page.next_seq);
    cJSON_AddNumberToObject(result, "until_seq", (double)page.until_seq);
    cJSON_AddBoolToObject(result, "more", page.more);
    free(page.text);
    return result;
}

void serve_record_export(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, sizeof(struct export_request));
    if (reading == NULL)
        return;
    struct export_request *wanted = reading->own;
    (void)export_format_parse(params_text(request, "format"), &wanted->format);
    wanted->first = params_has(request, "head") ? params_is_true(request, "head")
                                                : !params_has(request, "since_seq");
    wanted->since_seq = params_integer(request, "since_seq", 0);
    wanted->until_seq = params_integer(request, "until_seq", 0);
    wanted->limit = (size_t)params_integer(request, "limit", EXPORT_LIMIT);
    reading->read = read_export;
    reading_ask(reading, station->chores);
}

/* ---- computed again ----------------------------------------------------------------- */

/* First the record is read, then its table is found on the loop, then all is computed
 * anew on the worker again. */
struct again {
    struct store_record *record;
    struct loaded_table *table;
    struct refusal refusal;
};

static void free_again(struct reading *reading)
{
    free(((struct again *)reading->own)->record);
}

static void read_for_again(struct job *job, void *thread)
{
    struct reading *reading = (struct reading *)job;
    struct again *again = reading->own;
    refusal_set(&again->refusal, REASON_NO_MEMORY, NULL);
    again->record = reading_record(reading, thread, &again->refusal);
}

static cJSON *compute(struct reading *reading, struct worker *worker, struct refusal *refusal)
{
    struct again *again = reading->own;
    cJSON *made = NULL;
    enum status s = answer_recompute(worker_weights(worker), again->table, again->record, &made);
    return made_or_refused(s, made, refusal);
}

/* REASONS where the table of the record's hash is in memory. */
static enum reason find_table(struct station *station, struct again *again)
{
    const struct store_record *record = again->record;
    struct loaded_table *other;
    if (record->match_json[0] == '\0')
        return REASON_RECORD_WITHOUT_MATCH;
    again->table = tables_by_hash(station->tables, record->table_sha256);
    if (again->table != NULL)
        return REASONS;
    enum tables_state state = tables_get(station->tables, record->table_name, &other);
    return state == TABLES_LOADING ? REASON_TABLE_LOADING : REASON_TABLE_UNKNOWN;
}

static void record_read(struct job *job)
{
    struct reading *reading = (struct reading *)job;
    struct again *again = reading->own;
    struct station *station = reading->station;
    enum reason reason = again->record != NULL ? find_table(station, again) : REASONS;
    if (again->record != NULL && reason == REASONS) {
        reading_ask_again(reading, station->reader);
        return;
    }
    if (again->record == NULL)
        station_refuse(station, &reading->ticket, &again->refusal);
    else if (reason == REASON_TABLE_UNKNOWN)
        station_refuse_for(station, &reading->ticket, reason,
                           "'%s' as it was then, with hash %s, is not here",
                           again->record->table_name, again->record->table_sha256);
    else
        station_refuse_for(station, &reading->ticket, reason, NULL);
    reading_free(reading);
}

void serve_record_recompute(struct station *station, struct client *client, struct request *request)
{
    struct reading *reading = reading_make(station, client, request, sizeof(struct again));
    if (reading == NULL)
        return;
    params_copy(request, "id", reading->id, sizeof reading->id);
    reading->read = compute;
    reading->free = free_again;
    reading->job.run = read_for_again;
    reading->job.done = record_read;
    reading_ask(reading, station->reader);
}
