/* writer.c - groups of jobs, a commit each. */
#include "station/writer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/log.h"

struct writer {
    pthread_t thread;
    struct job_list asked; /* of the asking thread, as is `stopped` */
    bool stopped;
    struct job_queue queue;
    struct inbox *inbox;
    struct store_claim *claim;
    struct store *store; /* NULL: not opened, or it cannot be */
    enum status opening; /* what stays so until it is begun anew; STATUS_OK: it is tried */
    pthread_mutex_t lock;
    struct writer_counts counts;
};

/* ---- opening ------------------------------------------------------------------------ */

static bool passes(enum status s)
{
    return s != STATUS_DAMAGED && s != STATUS_FORMAT && s != STATUS_VERSION;
}

static enum status open_store(struct writer *writer)
{
    if (writer->store != NULL || writer->opening != STATUS_OK)
        return writer->opening;
    enum status s = store_open_claimed(writer->claim, NULL, &writer->store);
    if (!passes(s))
        writer->opening = s;
    return s;
}

static void close_store(struct writer *writer)
{
    store_close(writer->store);
    writer->store = NULL;
    writer->opening = STATUS_OK;
}

static enum status tell_opened(struct writer *writer, struct write_job *job)
{
    enum status s = open_store(writer);
    if (s != STATUS_OK)
        return s;
    snprintf(job->opened.station_id, sizeof job->opened.station_id, "%s",
             store_station_id(writer->store));
    return STATUS_OK;
}

/* One just opened has been written to, or need not be yet. */
static enum status open_or_try(struct writer *writer, struct write_job *job)
{
    bool was_open = writer->store != NULL;
    enum status s = was_open ? store_try(writer->store) : open_store(writer);
    job->moved = was_open && store_is_moved(writer->store);
    return s == STATUS_OK ? tell_opened(writer, job) : s;
}

/* Damage that was met while writing or reading is put aside by the opening.  A file that
 * was moved is not: opening would make an empty one in its place. */
static enum status begin_anew(struct writer *writer, struct write_job *job)
{
    job->moved = writer->store != NULL && store_is_moved(writer->store);
    if (job->moved)
        return STATUS_IO;
    close_store(writer);
    enum status s = tell_opened(writer, job);
    if (s == STATUS_OK)
        return STATUS_NOT_FOUND; /* it is sound */
    if (s != STATUS_DAMAGED)
        return s;
    s = store_begin_anew_claimed(writer->claim);
    if (s != STATUS_OK)
        return s == STATUS_NOT_FOUND ? STATUS_DAMAGED : s; /* it could not be put aside */
    close_store(writer);
    return tell_opened(writer, job);
}

/* ---- fences ------------------------------------------------------------------------- */

/* The highest on record that can be read, be it in a damaged file that was moved aside; 0
 * where nothing can. */
static int64_t highest_fence(struct writer *writer)
{
    int64_t highest = 0;
    struct store_reader *reader = NULL;
    if (writer->store != NULL)
        return store_highest_fence(writer->store, &highest) == STATUS_OK ? highest : 0;
    if (store_reader_open(store_claim_folder(writer->claim), &reader) == STATUS_OK &&
        store_max_fence(reader, &highest) != STATUS_OK)
        highest = 0;
    store_reader_close(reader);
    return highest;
}

static enum status reserve_fences(struct writer *writer, struct write_job *job)
{
    int64_t highest = highest_fence(writer);
    if (highest > job->fences.above)
        job->fences.above = highest;
    return store_reserve_fences(writer->claim, job->fences.above, job->fences.n,
                                &job->fences.first);
}

/* ---- jobs --------------------------------------------------------------------------- */

static bool stands_alone(enum write_kind kind)
{
    return kind >= WRITE_OPEN;
}

static enum status run_in_group(struct store *store, struct write_job *job)
{
    switch (job->kind) {
    case WRITE_RECORD:
        return store_add_record(store, job->record, &job->known);
    case WRITE_CALIBRATION:
        return store_add_calibration(store, &job->calibration);
    case WRITE_CHECK_TILE:
        return store_add_check_tile(store, job->tile, &job->known);
    case WRITE_CHECK:
        return store_add_check(store, job->check, &job->known);
    default:
        return store_add_subject(store, job->subject, job->who);
    }
}

static enum status run_alone(struct writer *writer, struct write_job *job)
{
    if (job->kind == WRITE_BEGIN_ANEW)
        return begin_anew(writer, job);
    if (job->kind == WRITE_OPEN)
        return open_or_try(writer, job);
    if (job->kind == WRITE_FENCES)
        return reserve_fences(writer, job);
    enum status s = open_store(writer);
    if (s != STATUS_OK)
        return s;
    switch (job->kind) {
    case WRITE_FORGET:
        return store_forget_subject(writer->store, job->subject->id, job->who, &job->erased);
    case WRITE_FINISH_ERASING:
        return store_finish_erasing(writer->store, &job->erased);
    case WRITE_RESTART_WAL:
        return store_restart_wal(writer->store, job->cut, &job->restarted);
    default:
        return store_prune(writer->store);
    }
}

static void note_member(const struct writer *writer, struct write_job *job)
{
    if (writer->store != NULL && (job->status == STATUS_NOT_FOUND || job->status == STATUS_RANGE))
        snprintf(job->bad_member, sizeof job->bad_member, "%s", store_bad_member(writer->store));
}

/* ---- groups ------------------------------------------------------------------------- */

/* Jobs from the front of `jobs` that may share a transaction. */
static void take_group(struct job_list *jobs, struct job_list *group)
{
    job_list_init(group);
    while (jobs->first != NULL && group->n < WRITER_GROUP_MAX &&
           !stands_alone(((struct write_job *)jobs->first)->kind))
        job_list_add(group, job_list_take(jobs));
}

static void fail_all(struct job_list *group, enum status s)
{
    for (struct job *job = group->first; job != NULL; job = job->next)
        ((struct write_job *)job)->status = s;
}

/* What was kept by the group is kept by the commit, or not at all. */
static void fail_kept(struct job_list *group, enum status s)
{
    for (struct job *job = group->first; job != NULL; job = job->next) {
        struct write_job *write = (struct write_job *)job;
        if (write->status == STATUS_OK)
            write->status = s;
    }
}

/* False where a job has failed half way and nothing is written: once more, each with its
 * savepoint. */
static bool write_group_by(struct writer *writer, struct job_list *group,
                           enum status (*begin)(struct store *store))
{
    enum status s = open_store(writer);
    if (s == STATUS_OK)
        s = begin(writer->store);
    if (s != STATUS_OK) {
        fail_all(group, s);
        return true;
    }
    for (struct job *job = group->first; job != NULL; job = job->next) {
        struct write_job *write = (struct write_job *)job;
        write->status = run_in_group(writer->store, write);
        note_member(writer, write);
        if (store_must_part(writer->store)) {
            store_rollback(writer->store);
            return false;
        }
    }
    s = store_commit(writer->store);
    if (s != STATUS_OK)
        fail_kept(group, s);
    return true;
}

static void write_group(struct writer *writer, struct job_list *group)
{
    if (!write_group_by(writer, group, store_begin_together))
        (void)write_group_by(writer, group, store_begin);
}

static int64_t now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

/* The station's own, now and then. */
static bool is_upkeep(enum write_kind kind)
{
    return kind == WRITE_OPEN || kind == WRITE_FINISH_ERASING || kind == WRITE_PRUNE ||
           kind == WRITE_RESTART_WAL || kind == WRITE_FENCES;
}

static void count(struct writer *writer, const struct job_list *group, int64_t took_us)
{
    bool upkeep = is_upkeep(((struct write_job *)group->first)->kind);
    int64_t wal_bytes = writer->store != NULL ? store_own_wal_bytes(writer->store) : 0;
    pthread_mutex_lock(&writer->lock);
    writer->counts.groups += !upkeep;
    writer->counts.jobs += upkeep ? 0 : group->n;
    writer->counts.wal_bytes = wal_bytes;
    if (took_us > writer->counts.longest_us)
        writer->counts.longest_us = took_us;
    pthread_mutex_unlock(&writer->lock);
}

static void do_all(struct writer *writer, struct job_list *jobs)
{
    while (jobs->first != NULL) {
        struct job_list group;
        int64_t begun_us = now_us();
        take_group(jobs, &group);
        if (group.n > 0) {
            write_group(writer, &group);
        } else {
            struct write_job *job = (struct write_job *)job_list_take(jobs);
            job->status = run_alone(writer, job);
            note_member(writer, job);
            job_list_add(&group, &job->job);
        }
        count(writer, &group, now_us() - begun_us);
        inbox_put_all(writer->inbox, &group);
    }
}

static void *work(void *context)
{
    struct writer *writer = context;
    bool closed = false;
    while (!closed) {
        struct job_list jobs;
        job_queue_take_all(&writer->queue, -1, &closed, &jobs);
        do_all(writer, &jobs);
    }
    store_close(writer->store);
    return NULL;
}

/* ---- the thread --------------------------------------------------------------------- */

enum status writer_open(struct store_claim *claim, struct inbox *inbox, struct writer **ret)
{
    struct writer *writer = calloc(1, sizeof *writer);
    if (writer == NULL)
        return STATUS_NO_MEMORY;
    writer->claim = claim;
    writer->inbox = inbox;
    job_list_init(&writer->asked);
    job_queue_init(&writer->queue);
    pthread_mutex_init(&writer->lock, NULL);
    if (pthread_create(&writer->thread, NULL, work, writer) != 0) {
        log_error("station: cannot start the writer's thread");
        pthread_mutex_destroy(&writer->lock);
        job_queue_done(&writer->queue);
        free(writer);
        return STATUS_NO_MEMORY;
    }
    *ret = writer;
    return STATUS_OK;
}

void writer_ask(struct writer *writer, struct write_job *job)
{
    if (writer->stopped) {
        job->status = STATUS_CANCELLED;
        inbox_put(writer->inbox, &job->job);
        return;
    }
    job_list_add(&writer->asked, &job->job);
}

void writer_hand_over(struct writer *writer)
{
    if (writer != NULL && writer->asked.first != NULL)
        (void)job_queue_put_all(&writer->queue, &writer->asked); /* closed by writer_stop() alone */
}

void writer_stop(struct writer *writer)
{
    if (writer == NULL)
        return;
    writer_hand_over(writer);
    writer->stopped = true;
    job_queue_close(&writer->queue);
    pthread_join(writer->thread, NULL);
}

void writer_close(struct writer *writer)
{
    if (writer == NULL)
        return;
    pthread_mutex_destroy(&writer->lock);
    job_queue_done(&writer->queue);
    free(writer);
}

static struct writer_counts look(struct writer *writer, bool begin_longest)
{
    pthread_mutex_lock(&writer->lock);
    struct writer_counts counts = writer->counts;
    if (begin_longest)
        writer->counts.longest_us = 0;
    pthread_mutex_unlock(&writer->lock);
    return counts;
}

struct writer_counts writer_count(struct writer *writer)
{
    return look(writer, true);
}

struct writer_counts writer_look(struct writer *writer)
{
    return look(writer, false);
}
