/* job.h - work that leaves the loop's thread and comes back to it.
 *
 * A thread takes jobs from its queue, in order, and runs them; what it has done goes to the
 * loop's inbox, whose descriptor the loop watches.  run() and done() are the job's own: run()
 * works on the thread, done() on the loop's thread, where the job belongs to the
 * caller again.  Whoever makes a job embeds this as its first member. */
#ifndef SKINSPEC_STATION_JOB_H
#define SKINSPEC_STATION_JOB_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

struct job {
    void (*run)(struct job *job, void *thread); /* thread: what the thread works with */
    void (*cancel)(struct job *job); /* instead, where the thread is to end soon; NULL: run() */
    void (*done)(struct job *job);
    struct job *next;
};

struct job_list {
    struct job *first, **end;
    size_t n;
};

/* ---- done: to the loop -------------------------------------------------------------- */

struct inbox {
    pthread_mutex_t lock;
    struct job_list jobs;
    int fd; /* an eventfd: readable while there is something to drain */
};

enum status inbox_init(struct inbox *inbox); /* STATUS_IO: no descriptor left */
void inbox_done(struct inbox *inbox);
void inbox_put(struct inbox *inbox, struct job *job); /* from any thread */
void inbox_put_all(struct inbox *inbox, struct job_list *jobs);

bool inbox_has_jobs(struct inbox *inbox);

/* On the loop's thread: done() of each that is there. */
void inbox_drain(struct inbox *inbox);

/* ---- to do: for a thread ------------------------------------------------------------ */

struct job_queue {
    pthread_mutex_t lock;
    pthread_cond_t some; /* waits by CLOCK_MONOTONIC */
    struct job_list jobs;
    bool closed;
};

void job_queue_init(struct job_queue *queue);
void job_queue_done(struct job_queue *queue);
bool job_queue_put(struct job_queue *queue, struct job *job); /* false: closed, not taken */
/* The same of all in the list, which is empty then; for a queue that one thread takes from. */
bool job_queue_put_all(struct job_queue *queue, struct job_list *jobs);
size_t job_queue_length(struct job_queue *queue);

/* No more will come: takers get what is left, then nothing. */
void job_queue_close(struct job_queue *queue);

/* The next, or all there are, waiting until there is one, up to timeout_ms (negative: for
 * ever).  NULL and an empty list: time is up, or closed and empty (*closed, may be NULL). */
struct job *job_queue_take(struct job_queue *queue, int timeout_ms, bool *closed);
/* Into an empty list. */
void job_queue_take_all(struct job_queue *queue, int timeout_ms, bool *closed,
                        struct job_list *ret);

void job_list_init(struct job_list *list);
void job_list_add(struct job_list *list, struct job *job);
struct job *job_list_take(struct job_list *list); /* NULL: empty */

#endif
