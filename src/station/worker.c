/* worker.c - one job after the other, beside the loop. */
#define _GNU_SOURCE /* gettid() */
#include "station/worker.h"

#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/log.h"
#include "json/memory.h"

enum { BACKGROUND_NICE = 10 };

struct worker {
    pthread_t thread;
    struct job_queue queue;
    struct inbox *inbox;
    char *state_folder;
    struct answer_weights weights;
    pthread_mutex_t lock; /* of the two below */
    struct store_reader *reader;
    bool ending, in_background;
};

static bool is_ending(struct worker *worker)
{
    pthread_mutex_lock(&worker->lock);
    bool ending = worker->ending;
    pthread_mutex_unlock(&worker->lock);
    return ending;
}

enum status worker_reader(struct worker *worker, struct store_reader **ret)
{
    struct store_reader *opened = NULL;
    enum status s = STATUS_OK;
    if (worker->reader == NULL && !is_ending(worker)) /* set by this thread alone */
        s = store_reader_open(worker->state_folder, &opened);
    pthread_mutex_lock(&worker->lock);
    if (opened != NULL)
        worker->reader = opened;
    if (s == STATUS_OK && worker->ending)
        s = STATUS_CANCELLED;
    pthread_mutex_unlock(&worker->lock);
    if (s == STATUS_OK)
        *ret = worker->reader;
    return s;
}

void worker_forget_reader(struct worker *worker)
{
    pthread_mutex_lock(&worker->lock);
    struct store_reader *reader = worker->reader;
    worker->reader = NULL;
    pthread_mutex_unlock(&worker->lock);
    store_reader_close(reader);
}

struct answer_weights *worker_weights(struct worker *worker)
{
    return &worker->weights;
}

const char *worker_state_folder(const struct worker *worker)
{
    return worker->state_folder;
}

static void do_job(struct worker *worker, struct job *job)
{
    json_memory_begin();
    if (job->cancel != NULL && is_ending(worker))
        job->cancel(job);
    else
        job->run(job, worker);
}

static void *work(void *context)
{
    struct worker *worker = context;
    bool closed = false;
    if (worker->in_background) /* of this thread alone, as Linux has it */
        (void)setpriority(PRIO_PROCESS, (id_t)gettid(), BACKGROUND_NICE);
    while (!closed) {
        struct job *job = job_queue_take(&worker->queue, -1, &closed);
        if (job == NULL)
            continue;
        do_job(worker, job);
        inbox_put(worker->inbox, job);
    }
    worker_forget_reader(worker);
    return NULL;
}

enum status worker_open(const char *state_folder, bool in_background, struct inbox *inbox,
                        struct worker **ret)
{
    struct worker *worker = calloc(1, sizeof *worker);
    if (worker == NULL || (worker->state_folder = strdup(state_folder)) == NULL) {
        free(worker);
        return STATUS_NO_MEMORY;
    }
    worker->inbox = inbox;
    worker->in_background = in_background;
    job_queue_init(&worker->queue);
    pthread_mutex_init(&worker->lock, NULL);
    if (pthread_create(&worker->thread, NULL, work, worker) != 0) {
        log_error("station: cannot start a worker's thread");
        pthread_mutex_destroy(&worker->lock);
        job_queue_done(&worker->queue);
        free(worker->state_folder);
        free(worker);
        return STATUS_NO_MEMORY;
    }
    *ret = worker;
    return STATUS_OK;
}

void worker_ask(struct worker *worker, struct job *job)
{
    if (job_queue_put(&worker->queue, job))
        return;
    do_job(worker, job); /* the thread has ended: nothing is in its way */
    inbox_put(worker->inbox, job);
}

struct job_queue *worker_queue(struct worker *worker)
{
    return &worker->queue;
}

void worker_stop(struct worker *worker)
{
    if (worker == NULL)
        return;
    pthread_mutex_lock(&worker->lock);
    worker->ending = true;
    if (worker->reader != NULL)
        store_reader_interrupt(worker->reader);
    pthread_mutex_unlock(&worker->lock);
    job_queue_close(&worker->queue);
    pthread_join(worker->thread, NULL);
}

void worker_close(struct worker *worker)
{
    if (worker == NULL)
        return;
    pthread_mutex_destroy(&worker->lock);
    job_queue_done(&worker->queue);
    free(worker->state_folder);
    free(worker);
}
