/* housekeeping.c - one timer; what takes long is done by the chores' worker and the writer. */
#include "station/housekeeping.h"

#include <stdlib.h>

#include "base/log.h"
#include "station/bench.h"

enum { EVERY_MS = 5000, PRUNE_EVERY_MS = 24 * 3600 * 1000, SLACK_US = 500000 };
/* Begun anew from this size on; a size that only a reader who holds it can bring about. */
#define WAL_RESTART INT64_C(8388608)
#define WAL_ALARM INT64_C(134217728)

struct housekeeping {
    struct station *station;
    sd_event_source *timer;
    struct store_keeper *keeper; /* the chores' thread alone uses it */
    bool checking, alarmed;
    int64_t pruned_ms;
    uint64_t records; /* stored when the WAL was looked at last */
};

static void written(struct job *job)
{
    free(job);
}

static void ask_writer(struct station *station, enum write_kind kind)
{
    struct write_job *write = station->writer != NULL ? calloc(1, sizeof *write) : NULL;
    if (write == NULL)
        return; /* next time */
    write->job.done = written;
    write->kind = kind;
    writer_ask(station->writer, write);
}

/* ---- the WAL --------------------------------------------------------------------------- */

struct check {
    struct job job;
    struct housekeeping *keeping;
    int64_t wal_bytes;
    bool checkpoint;
};

/* One that failed may hold a file that is no longer there. */
static void checkpoint(struct housekeeping *keeping, const char *folder)
{
    int left;
    if (keeping->keeper == NULL && store_keeper_open(folder, &keeping->keeper) != STATUS_OK)
        return;
    if (store_keeper_checkpoint(keeping->keeper, &left) == STATUS_OK)
        return;
    store_keeper_close(keeping->keeper);
    keeping->keeper = NULL;
}

static void run_check(struct job *job, void *thread)
{
    struct check *check = (struct check *)job;
    const char *folder = worker_state_folder(thread);
    if (check->checkpoint)
        checkpoint(check->keeping, folder);
    (void)store_wal_bytes(folder, &check->wal_bytes);
}

static void alarm_if_pinned(struct housekeeping *keeping, int64_t wal_bytes)
{
    if (wal_bytes > WAL_ALARM && !keeping->alarmed)
        log_warning("station: station.db-wal has grown to %lld MB: some program keeps reading "
                    "station.db (a shell, a backup?); end it",
                    (long long)(wal_bytes >> 20));
    keeping->alarmed = wal_bytes > WAL_ALARM;
}

static void checked(struct job *job)
{
    struct check *check = (struct check *)job;
    struct housekeeping *keeping = check->keeping;
    struct station *station = keeping->station;
    station->wal_bytes = check->wal_bytes;
    keeping->checking = false;
    alarm_if_pinned(keeping, check->wal_bytes);
    station_note_wal(station, check->wal_bytes);
    if (check->wal_bytes > WAL_RESTART)
        ask_writer(station, WRITE_RESTART_WAL);
    free(check);
}

void housekeeping_look_at_wal(struct housekeeping *keeping)
{
    struct station *station = keeping->station;
    struct check *check = keeping->checking ? NULL : calloc(1, sizeof *check);
    if (check == NULL)
        return; /* next time */
    *check = (struct check){ .job = { .run = run_check, .done = checked }, .keeping = keeping };
    check->checkpoint = station->store.state == STORE_OK || station->store.state == STORE_FULL;
    keeping->checking = true;
    keeping->records = station->counters.records;
    worker_ask(station->chores, &check->job);
}

/* ---- the timer ------------------------------------------------------------------------- */

static int on_timer(sd_event_source *source, uint64_t at_us, void *userdata)
{
    struct housekeeping *keeping = userdata;
    struct station *station = keeping->station;
    int64_t now_ms = station_now_ms();
    (void)at_us;
    for (size_t i = 0; i < station->benches_n; i++)
        bench_tell_changes(station->benches[i]);
    if (keeping->records != station->counters.records || station->wal_limited)
        housekeeping_look_at_wal(keeping);
    if (station->store.state == STORE_OK)
        ask_writer(station, WRITE_FINISH_ERASING);
    if (station->store.state == STORE_OK && now_ms >= keeping->pruned_ms + PRUNE_EVERY_MS) {
        keeping->pruned_ms = now_ms;
        ask_writer(station, WRITE_PRUNE);
    }
    sd_event_source_set_time_relative(source, EVERY_MS * UINT64_C(1000));
    return sd_event_source_set_enabled(source, SD_EVENT_ONESHOT);
}

void housekeeping_stop(struct housekeeping *keeping)
{
    if (keeping == NULL)
        return;
    store_keeper_close(keeping->keeper);
    free(keeping);
}

enum status housekeeping_start(struct station *station)
{
    struct housekeeping *keeping = calloc(1, sizeof *keeping);
    if (keeping == NULL)
        return STATUS_NO_MEMORY;
    keeping->station = station;
    keeping->pruned_ms = station_now_ms();
    if (sd_event_add_time_relative(station->event, NULL, CLOCK_BOOTTIME, EVERY_MS * UINT64_C(1000),
                                   SLACK_US, on_timer, keeping) < 0) {
        free(keeping);
        return STATUS_NO_MEMORY;
    }
    station->housekeeping = keeping;
    return STATUS_OK;
}
