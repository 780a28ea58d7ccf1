/* station.c - the parts put together, and taken apart again. */
#include "station/station.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/version.h"
#include "db/costs_file.h"
#include "station/answer_scene.h"
#include "station/asked.h"
#include "station/bench.h"
#include "station/dispatch.h"
#include "station/parking.h"
#include "station/run.h"
#include "station/seat.h"
#include "station/station_record.h"
#include "station/station_store.h"
#include "station/station_table.h"

enum { STOP_PATIENCE_MS = 400 };

/* ---- life --------------------------------------------------------------------------- */

static int on_inbox(sd_event_source *source, int fd, uint32_t events, void *userdata)
{
    struct station *station = userdata;
    (void)source;
    (void)fd;
    (void)events;
    inbox_drain(&station->inbox);
    return 0;
}

/* Before the loop looks for what is next: what was asked of the writer meanwhile. */
static int before_next(sd_event_source *source, void *userdata)
{
    struct station *station = userdata;
    (void)source;
    writer_hand_over(station->writer);
    return 0;
}

static bool watch_inbox(struct station *station)
{
    sd_event_source *source = NULL;
    bool good = sd_event_add_io(station->event, &source, station->inbox.fd, EPOLLIN, on_inbox,
                                station) >= 0 &&
                sd_event_source_set_prepare(source, before_next) >= 0 &&
                sd_event_source_set_floating(source, 1) >= 0;
    sd_event_source_unref(source); /* floating: it is the loop's now */
    return good;
}

/* The kernel makes it anew with every start of the machine: CLOCK_BOOTTIME counts from there. */
static void read_machine_boot(char text[UUID_TEXT_SIZE])
{
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "re");
    char line[64] = "";
    if (file != NULL && fgets(line, sizeof line, file) != NULL)
        line[strcspn(line, "\n")] = '\0';
    if (file != NULL)
        fclose(file);
    snprintf(text, UUID_TEXT_SIZE, "%.36s", line);
    if (uuid_is_text(text))
        return;
    text[0] = '\0'; /* records then do not tell which start their boottime_ms counts from */
    log_warning("station: the machine does not tell its boot id");
}

static enum status open_tables(struct station *station)
{
    static char beside_state[SETTINGS_PATH_SIZE + 16];
    snprintf(beside_state, sizeof beside_state, "%s/tables", station->settings->state);
    struct tables_settings settings = {
        .default_name = station->settings->table,
        .queue = worker_queue(station->chores),
        .changed = station_table_changed,
        .context = station,
    };
    size_t n = 0;
    if (station->settings->tables != NULL)
        settings.folder[n++] = station->settings->tables;
    settings.folder[n++] = beside_state;
    settings.folder[n++] = "/var/lib/skinspec/tables";
    settings.folder[n++] = "build/tables";
    return tables_open(&settings, &station->tables);
}

/* Of `skinspec bench --calibrate --costs STATE/costs.csv`.  A file that makes no sense is told, and
 * no reason not to measure skin. */
static void read_costs(const struct station *station)
{
    static struct costs costs;
    char path[SETTINGS_PATH_SIZE + 16];
    snprintf(path, sizeof path, "%s/costs.csv", station->settings->state);
    enum status s = costs_file_read(path, &costs);
    if (s == STATUS_OK)
        answer_scene_costs(&costs);
    else if (s != STATUS_NOT_FOUND)
        log_warning("station: plans go by the costs compiled in");
}

enum status station_open(struct station *station)
{
    const struct settings *settings = station->settings;
    station->started_ms = clock_boottime_ms();
    events_init(&station->events);
    read_machine_boot(station->machine_boot);
    enum status s = inbox_init(&station->inbox);
    station->is_open = s == STATUS_OK;
    if (s == STATUS_OK)
        s = uuid4_make(station->boot);
    if (s == STATUS_OK)
        s = protocol_open(&station->protocol);
    if (s == STATUS_OK)
        s = station_claim_store(station);
    if (s == STATUS_OK)
        read_costs(station);
    if (s == STATUS_OK)
        s = worker_open(settings->state, false, &station->inbox, &station->reader);
    if (s == STATUS_OK)
        s = worker_open(settings->state, true, &station->inbox, &station->chores);
    if (s == STATUS_OK)
        s = open_tables(station);
    if (s == STATUS_OK)
        s = seats_open(station);
    if (s == STATUS_OK && !watch_inbox(station))
        s = STATUS_NO_MEMORY;
    if (s == STATUS_OK)
        s = parking_open(station);
    return s;
}

/* ---- clients come and go ------------------------------------------------------------ */

static bool greet(void *context, struct client *client)
{
    struct station *station = context;
    const struct hello hello = { .server = "skinspecd " SKINSPEC_VERSION,
                                 .station_id = station->store.station_id,
                                 .boot = station->boot };
    struct line line;
    if (protocol_hello(&hello, &line) != STATUS_OK)
        return false;
    client_send(client, &line);
    free(line.text);
    return true;
}

static void gone(void *context, struct client *client)
{
    bench_leave_all(context, client);
}

enum status station_listen(struct station *station, int listener_fd)
{
    const char *const group[RIGHTS] = { [RIGHT_KIOSK] = station->settings->kiosk_group,
                                        [RIGHT_CLINIC] = station->settings->clinic_group,
                                        [RIGHT_ADMIN] = station->settings->admin_group };
    struct clients_settings settings = {
        .event = station->event,
        .listener_fd = listener_fd,
        .max = station->settings->max_clients,
        .max_per_user = station->settings->max_per_user,
        .max_per_process = station->settings->max_per_process,
        .protocol = station->protocol,
        .greet = greet,
        .line = station_line,
        .gone = gone,
        .context = station,
    };
    rights_init(&settings.rights, group);
    enum status s = clients_open(&settings, &station->clients);
    if (s == STATUS_OK)
        station_look_at_store(station); /* ready is told when it is: the socket is there before */
    return s;
}

void station_stop(struct station *station)
{
    station->stopping = true;
    clients_stop_accepting(station->clients);
    for (size_t i = 0; i < station->benches_n; i++) {
        struct bench *bench = station->benches[i];
        if (bench->run != NULL)
            run_end(bench, bench->run->record->fence, RUN_STOPPING);
        if (bench->at_work || bench->restoring)
            bench_cancel(bench);
        bench_send_queue_away(bench);
    }
    parking_send_away(station);
}

static void note_busy(void *context, struct client *client)
{
    bool *quiet = context;
    *quiet = *quiet && client->open_requests == 0 && connection_unsent(&client->connection) == 0;
}

bool station_is_quiet(struct station *station)
{
    bool quiet = true;
    for (size_t i = 0; i < station->benches_n; i++)
        quiet = quiet && !bench_is_at_work(station->benches[i]);
    clients_each(station->clients, note_busy, &quiet);
    return quiet;
}

/* What is done may ask for more, which then ends at once. */
static void drain(struct station *station)
{
    while (inbox_has_jobs(&station->inbox))
        inbox_drain(&station->inbox);
}

/* Those who ask before those who are asked. */
static bool stop_threads(struct station *station)
{
    bool all = seats_stop(station, STOP_PATIENCE_MS);
    drain(station);
    worker_stop(station->reader);
    worker_stop(station->chores);
    drain(station);
    writer_stop(station->writer);
    drain(station);
    return all;
}

void station_close(struct station *station)
{
    station->stopping = true; /* also where it was never begun: nothing is unplugged by that */
    bool all_ended = !station->is_open || stop_threads(station);
    if (station->clients != NULL)
        parking_send_away(station); /* while there is somebody to tell */
    clients_close(station->clients);
    store_claim_release(station->claim);
    if (!all_ended) { /* a thread still uses what follows; the process ends anyway */
        asked_flush(station, STOP_PATIENCE_MS);
        return;
    }
    seats_close(station);
    for (size_t i = 0; i < station->benches_n; i++)
        bench_close(station->benches[i]);
    tables_close(station->tables);
    parking_close(station);
    worker_close(station->reader);
    worker_close(station->chores);
    writer_close(station->writer);
    station_free_records(station);
    events_done(&station->events);
    protocol_close(station->protocol);
    if (station->is_open)
        inbox_done(&station->inbox);
}
