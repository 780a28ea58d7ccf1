/* parallel.c - threads that draw piece numbers from one counter. */
#define _GNU_SOURCE /* sched_getaffinity */
#include "base/parallel.h"

#include <pthread.h>
#include <sched.h>
#include <stdbool.h>

struct job {
    pthread_mutex_t lock;
    size_t next, pieces, failed_piece;
    enum status status;
    parallel_piece *run;
    void *context;
};

struct worker {
    struct job *job;
    unsigned number;
    pthread_t thread;
};

unsigned parallel_cores(void)
{
    cpu_set_t set;
    int cores = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    if (cores < 1)
        return 1;
    return cores > PARALLEL_MAX_THREADS ? PARALLEL_MAX_THREADS : (unsigned)cores;
}

static bool draw(struct job *job, size_t *piece)
{
    pthread_mutex_lock(&job->lock);
    bool more = job->status == STATUS_OK && job->next < job->pieces;
    if (more)
        *piece = job->next++;
    pthread_mutex_unlock(&job->lock);
    return more;
}

static void note_failure(struct job *job, size_t piece, enum status s)
{
    pthread_mutex_lock(&job->lock);
    if (job->status == STATUS_OK || piece < job->failed_piece) {
        job->status = s;
        job->failed_piece = piece;
    }
    pthread_mutex_unlock(&job->lock);
}

static void *work(void *argument)
{
    struct worker *w = argument;
    size_t piece;
    while (draw(w->job, &piece)) {
        enum status s = w->job->run(piece, w->number, w->job->context);
        if (s != STATUS_OK)
            note_failure(w->job, piece, s);
    }
    return NULL;
}

enum status parallel_run(size_t pieces, unsigned threads, parallel_piece *run, void *context)
{
    struct job job = { PTHREAD_MUTEX_INITIALIZER, 0, pieces, 0, STATUS_OK, run, context };
    struct worker workers[PARALLEL_MAX_THREADS];
    unsigned started = 1;
    if (threads > PARALLEL_MAX_THREADS)
        threads = PARALLEL_MAX_THREADS;
    if (threads > pieces)
        threads = (unsigned)pieces;
    for (; started < threads; started++) {
        workers[started] = (struct worker){ .job = &job, .number = started };
        if (pthread_create(&workers[started].thread, NULL, work, &workers[started]) != 0)
            break;
    }
    workers[0] = (struct worker){ .job = &job, .number = 0 };
    work(&workers[0]);
    for (unsigned i = 1; i < started; i++)
        pthread_join(workers[i].thread, NULL);
    return job.status;
}
