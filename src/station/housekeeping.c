/* housekeeping.c - one timer; what takes long is done by the chores' worker and the writer. */
#include "station/housekeeping.h"

#include <stdlib.h>

#include "base/clock.h"
#include "base/log.h"
#include "station/bench.h"
#include "station/station_store.h"

enum { EVERY_MS = 5000, PRUNE_EVERY_MS = 24 * 3600 * 1000, SLACK_US = 500000 };
/* Begun anew from this size on; a size that only a reader who holds it can bring about. */
#define WAL_RESTART INT64_C(8388608)
#define WAL_ALARM INT64_C(134217728)

struct housekeeping {
    struct station *station;
    sd_event_source *timer;
    struct store_keeper *keeper; /* the chores' thread alone uses it */
    bool checking, restarting, alarmed;
    int64_t pruned_ms;
    uint64_t jobs; /* written when the WAL was looked at last */
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

/* ---- the size of the WAL: the writer knows it, however long the chores take --------- */

static void look_at_size(struct housekeeping *keeping);

struct restart {
    struct write_job write;
    struct housekeeping *keeping;
};

/* Cut below the limit it is wanted again at once. */
static void restarted(struct job *job)
{
    struct restart *restart = (struct restart *)job;
    struct housekeeping *keeping = restart->keeping;
    bool done = restart->write.status == STATUS_OK && restart->write.restarted;
    keeping->restarting = false;
    if (restart->write.status != STATUS_OK)
        station_note_write(keeping->station, restart->write.status);
    if (done && keeping->station->wal_limited)
        look_at_size(keeping);
    free(restart);
}

/* A file that is only begun anew keeps its size, and above the limit nothing would begin
 * it. */
static void restart_wal(struct housekeeping *keeping)
{
    struct restart *restart = keeping->restarting ? NULL : calloc(1, sizeof *restart);
    if (restart == NULL)
        return; /* next time */
    restart->write.job.done = restarted;
    restart->write.kind = WRITE_RESTART_WAL;
    restart->write.cut = keeping->station->wal_limited;
    restart->keeping = keeping;
    keeping->restarting = true;
    writer_ask(keeping->station->writer, &restart->write);
}

static void alarm_if_pinned(struct housekeeping *keeping, int64_t wal_bytes)
{
    if (wal_bytes > WAL_ALARM && !keeping->alarmed)
        log_warning("station: station.db-wal has grown to %lld MB: some program keeps reading "
                    "station.db (a shell, a backup?); end it",
                    (long long)(wal_bytes >> 20));
    keeping->alarmed = wal_bytes > WAL_ALARM;
}

static void look_at_size(struct housekeeping *keeping)
{
    struct station *station = keeping->station;
    if (station->writer == NULL)
        return;
    struct writer_counts counts = writer_look(station->writer);
    keeping->jobs = counts.jobs;
    station->wal_bytes = counts.wal_bytes;
    alarm_if_pinned(keeping, counts.wal_bytes);
    station_note_wal(station, counts.wal_bytes);
}

/* ---- checkpoints -------------------------------------------------------------------- */

struct check {
    struct job job;
    struct housekeeping *keeping;
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
    checkpoint(check->keeping, worker_state_folder(thread));
}

static void restart_if_large(struct housekeeping *keeping)
{
    struct station *station = keeping->station;
    bool writable = station->store.status == STATUS_OK || station->store.status == STATUS_FULL;
    if (writable && (station->wal_limited || station->wal_bytes > WAL_RESTART))
        restart_wal(keeping);
}

static void checked(struct job *job)
{
    struct check *check = (struct check *)job;
    struct housekeeping *keeping = check->keeping;
    keeping->checking = false;
    look_at_size(keeping);
    restart_if_large(keeping);
    free(check);
}

void housekeeping_look_at_wal(struct housekeeping *keeping)
{
    enum status s = keeping->station->store.status;
    look_at_size(keeping);
    if (keeping->checking) { /* or it waits for something long: the writer copies what there is */
        restart_if_large(keeping);
        return;
    }
    bool possible = keeping->station->store.open && (s == STATUS_OK || s == STATUS_FULL);
    struct check *check = possible ? calloc(1, sizeof *check) : NULL;
    if (check == NULL)
        return; /* next time */
    *check = (struct check){ .job = { .run = run_check, .done = checked }, .keeping = keeping };
    keeping->checking = true;
    worker_ask(keeping->station->chores, &check->job);
}

/* ---- the timer ---------------------------------------------------------------------- */

static int on_timer(sd_event_source *source, uint64_t at_us, void *userdata)
{
    struct housekeeping *keeping = userdata;
    struct station *station = keeping->station;
    int64_t now_ms = clock_boottime_ms();
    (void)at_us;
    for (size_t i = 0; i < station->benches_n; i++)
        bench_tell_changes(station->benches[i]);
    station_try_store(station);
    if (station->wal_limited ||
        (station->writer != NULL && keeping->jobs != writer_look(station->writer).jobs))
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
    keeping->pruned_ms = clock_boottime_ms() - PRUNE_EVERY_MS; /* a station may be off at night */
    if (sd_event_add_time_relative(station->event, NULL, CLOCK_BOOTTIME, EVERY_MS * UINT64_C(1000),
                                   SLACK_US, on_timer, keeping) < 0) {
        free(keeping);
        return STATUS_NO_MEMORY;
    }
    station->housekeeping = keeping;
    return STATUS_OK;
}
