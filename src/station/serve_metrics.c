/* serve_metrics.c - metrics.get. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json/give.h"
#include "station/serve.h"
#include "station/ticket.h"

enum { METRICS_MAX = METHODS + 16 };

struct metric {
    char name[64];
    cJSON *object;
};

/* They are listed by name. */
struct metrics {
    struct metric metric[METRICS_MAX];
    size_t n;
};

static void add_metric(struct metrics *list, const char *name, const char *kind, double value,
                       const char *unit, const char *help)
{
    cJSON *metric = cJSON_CreateObject();
    cJSON_AddStringToObject(metric, "name", name);
    cJSON_AddStringToObject(metric, "kind", kind);
    cJSON_AddNumberToObject(metric, "value", value);
    if (unit != NULL)
        cJSON_AddStringToObject(metric, "unit", unit);
    cJSON_AddStringToObject(metric, "help", help);
    snprintf(list->metric[list->n].name, sizeof list->metric->name, "%s", name);
    list->metric[list->n++].object = metric;
}

static int compare_names(const void *left, const void *right)
{
    return strcmp(((const struct metric *)left)->name, ((const struct metric *)right)->name);
}

/* "requests_record_get" */
static void add_requests(const struct station *station, struct metrics *list)
{
    for (int i = 0; i < METHODS; i++) {
        char name[64], *dot;
        snprintf(name, sizeof name, "requests_%s", method_name((enum method)i));
        while ((dot = strchr(name, '.')) != NULL)
            *dot = '_';
        add_metric(list, name, "counter", (double)station->counters.requests[i], NULL,
                   "Requests of this method.");
    }
}

static void add_store_metrics(struct station *station, struct metrics *list)
{
    struct writer_counts writer = { 0 };
    if (station->writer != NULL)
        writer = writer_count(station->writer);
    add_metric(list, "records", "counter", (double)station->counters.records, NULL,
               "Records stored.");
    add_metric(list, "store_commits", "counter", (double)writer.groups, NULL,
               "Groups of jobs that were committed together.");
    add_metric(list, "store_jobs", "counter", (double)writer.jobs, NULL, "Jobs of these groups.");
    add_metric(list, "store_commit_longest", "gauge", (double)writer.longest_us / 1e3, "ms",
               "Longest group since the metrics were asked for last.");
    add_metric(list, "store_wal", "gauge", (double)station->wal_bytes, "bytes",
               "Size of the write-ahead log when last looked at.");
    add_metric(list, "reader_queue", "gauge",
               (double)job_queue_length(worker_queue(station->reader)), NULL,
               "Jobs waiting for the reader.");
}

void serve_metrics_get(struct station *station, struct client *client, struct request *request)
{
    struct ticket ticket = ticket_of(client, request);
    struct clients_counts clients = clients_count(station->clients);
    struct metrics metrics = { .n = 0 }, *list = &metrics;
    cJSON *result = cJSON_CreateObject(), *array = cJSON_AddArrayToObject(result, "metrics");
    add_metric(list, "clients", "gauge", (double)clients.now, NULL, "Connections now.");
    add_metric(list, "clients_accepted", "counter", (double)clients.accepted, NULL,
               "Connections let in.");
    add_metric(list, "clients_refused", "counter", (double)clients.refused, NULL,
               "Connections turned away by a limit.");
    add_metric(list, "clients_dropped", "counter", (double)clients.dropped, NULL,
               "Connections ended because the client did not read.");
    add_metric(list, "events", "counter", (double)station->counters.events, NULL, "Events told.");
    add_metric(list, "requests_refused", "counter", (double)station->counters.refused, NULL,
               "Requests answered by an error.");
    add_store_metrics(station, list);
    add_requests(station, list);
    qsort(metrics.metric, metrics.n, sizeof *metrics.metric, compare_names);
    for (size_t i = 0; i < metrics.n; i++)
        json_give_item(array, metrics.metric[i].object);
    station_answer(station, &ticket, result);
}
