/* job.c - queues with a lock each; an eventfd where the loop has to wake. */
#include "station/job.h"

#include <errno.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

void job_list_init(struct job_list *list)
{
    list->first = NULL;
    list->end = &list->first;
    list->n = 0;
}

void job_list_add(struct job_list *list, struct job *job)
{
    job->next = NULL;
    *list->end = job;
    list->end = &job->next;
    list->n++;
}

struct job *job_list_take(struct job_list *list)
{
    struct job *job = list->first;
    if (job == NULL)
        return NULL;
    list->first = job->next;
    list->n--;
    if (list->first == NULL)
        list->end = &list->first;
    return job;
}

/* All of `from` behind what `to` has; `from` is empty then. */
static void append_all(struct job_list *to, struct job_list *from)
{
    if (from->first == NULL)
        return;
    *to->end = from->first;
    to->end = from->end;
    to->n += from->n;
    job_list_init(from);
}

/* ---- inbox -------------------------------------------------------------------------- */

enum status inbox_init(struct inbox *inbox)
{
    inbox->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (inbox->fd < 0)
        return STATUS_IO;
    pthread_mutex_init(&inbox->lock, NULL);
    job_list_init(&inbox->jobs);
    return STATUS_OK;
}

void inbox_done(struct inbox *inbox)
{
    close(inbox->fd);
    pthread_mutex_destroy(&inbox->lock);
}

void inbox_put_all(struct inbox *inbox, struct job_list *jobs)
{
    if (jobs->first == NULL)
        return;
    pthread_mutex_lock(&inbox->lock);
    append_all(&inbox->jobs, jobs);
    pthread_mutex_unlock(&inbox->lock);
    /* Each puts its own: the one who found it empty may lose its core before it writes, and
     * what others put meanwhile would wait for that.  Fails at 2^64 - 1 unread only. */
    (void)eventfd_write(inbox->fd, 1);
}

void inbox_put(struct inbox *inbox, struct job *job)
{
    struct job_list one;
    job_list_init(&one);
    job_list_add(&one, job);
    inbox_put_all(inbox, &one);
}

bool inbox_has_jobs(struct inbox *inbox)
{
    pthread_mutex_lock(&inbox->lock);
    bool has = inbox->jobs.first != NULL;
    pthread_mutex_unlock(&inbox->lock);
    return has;
}

void inbox_drain(struct inbox *inbox)
{
    struct job_list taken;
    struct job *job;
    eventfd_t count;
    job_list_init(&taken);
    (void)eventfd_read(inbox->fd, &count); /* before the jobs: one put now wakes us again */
    pthread_mutex_lock(&inbox->lock);
    append_all(&taken, &inbox->jobs);
    pthread_mutex_unlock(&inbox->lock);
    while ((job = job_list_take(&taken)) != NULL)
        job->done(job);
}

/* ---- queue -------------------------------------------------------------------------- */

void job_queue_init(struct job_queue *queue)
{
    pthread_condattr_t by_monotonic;
    pthread_condattr_init(&by_monotonic);
    pthread_condattr_setclock(&by_monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&queue->lock, NULL);
    pthread_cond_init(&queue->some, &by_monotonic);
    pthread_condattr_destroy(&by_monotonic);
    job_list_init(&queue->jobs);
    queue->closed = false;
}

void job_queue_done(struct job_queue *queue)
{
    pthread_cond_destroy(&queue->some);
    pthread_mutex_destroy(&queue->lock);
}

bool job_queue_put_all(struct job_queue *queue, struct job_list *jobs)
{
    pthread_mutex_lock(&queue->lock);
    bool takes = !queue->closed;
    if (takes)
        append_all(&queue->jobs, jobs);
    pthread_mutex_unlock(&queue->lock);
    if (takes)
        pthread_cond_signal(&queue->some); /* not before: it would run into the lock */
    return takes;
}

bool job_queue_put(struct job_queue *queue, struct job *job)
{
    struct job_list one;
    job_list_init(&one);
    job_list_add(&one, job);
    return job_queue_put_all(queue, &one);
}

size_t job_queue_length(struct job_queue *queue)
{
    pthread_mutex_lock(&queue->lock);
    size_t n = queue->jobs.n;
    pthread_mutex_unlock(&queue->lock);
    return n;
}

void job_queue_close(struct job_queue *queue)
{
    pthread_mutex_lock(&queue->lock);
    queue->closed = true;
    pthread_cond_broadcast(&queue->some);
    pthread_mutex_unlock(&queue->lock);
}

static struct timespec in_ms(int ms)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    t.tv_sec += ms / 1000;
    t.tv_nsec += ms % 1000 * 1000000L;
    if (t.tv_nsec >= 1000000000L) {
        t.tv_sec++;
        t.tv_nsec -= 1000000000L;
    }
    return t;
}

/* With the lock held: until there is a job, or it is closed, or time is up. */
static void wait_for_some(struct job_queue *queue, int timeout_ms)
{
    struct timespec until = in_ms(timeout_ms < 0 ? 0 : timeout_ms);
    int e = timeout_ms == 0 ? ETIMEDOUT : 0; /* just looking needs no call of the system */
    while (queue->jobs.first == NULL && !queue->closed && e != ETIMEDOUT)
        e = timeout_ms < 0 ? pthread_cond_wait(&queue->some, &queue->lock)
                           : pthread_cond_timedwait(&queue->some, &queue->lock, &until);
}

struct job *job_queue_take(struct job_queue *queue, int timeout_ms, bool *closed)
{
    pthread_mutex_lock(&queue->lock);
    wait_for_some(queue, timeout_ms);
    struct job *job = job_list_take(&queue->jobs);
    if (closed != NULL)
        *closed = job == NULL && queue->closed;
    pthread_mutex_unlock(&queue->lock);
    return job;
}

void job_queue_take_all(struct job_queue *queue, int timeout_ms, bool *closed, struct job_list *ret)
{
    pthread_mutex_lock(&queue->lock);
    wait_for_some(queue, timeout_ms);
    job_list_init(ret);
    append_all(ret, &queue->jobs);
    if (closed != NULL)
        *closed = ret->n == 0 && queue->closed;
    pthread_mutex_unlock(&queue->lock);
}
