/* flow.c - a ring of slots, and threads that look for what can be done next. */
#include "base/flow.h"

#include <pthread.h>
#include <stdbool.h>

#include "base/parallel.h"

/* So that the others have something to do while one of them is kept from its core. */
enum { SLOTS_A_THREAD = 4 };

enum slot_state { FREE, WORKED_ON, DONE };

struct run {
    const struct flow *flow;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    size_t taken, given, slots;
    enum slot_state state[SLOTS_A_THREAD * PARALLEL_MAX_THREADS];
    bool taking, giving; /* some thread does */
    bool ended, failed;  /* take() has no more; give() failed */
    enum status status;  /* of the give() that failed, else of take() */
};

struct worker {
    struct run *run;
    unsigned number;
    pthread_t thread;
};

size_t flow_slots(unsigned threads)
{
    return SLOTS_A_THREAD *
           (size_t)(threads < PARALLEL_MAX_THREADS ? threads : PARALLEL_MAX_THREADS);
}

static bool can_give(const struct run *r)
{
    return !r->giving && !r->failed && r->given < r->taken && r->state[r->given % r->slots] == DONE;
}

static bool can_take(const struct run *r)
{
    return !r->taking && !r->ended && !r->failed && r->taken - r->given < r->slots;
}

static bool is_over(const struct run *r)
{
    return r->failed || (r->ended && r->given == r->taken);
}

/* Each is called with the lock and returns with it; what takes time is done without. */
static void give(struct run *r)
{
    size_t slot = r->given % r->slots;
    r->giving = true;
    pthread_mutex_unlock(&r->lock);
    enum status s = r->flow->give(r->flow->context, slot);
    pthread_mutex_lock(&r->lock);
    r->giving = false;
    r->state[slot] = FREE;
    r->given++;
    if (s != STATUS_OK) {
        r->status = s;
        r->failed = true;
        if (r->taking)
            r->flow->stop(r->flow->context);
    }
    pthread_cond_broadcast(&r->changed);
}

static void take_and_work(struct run *r, unsigned worker)
{
    size_t slot = r->taken % r->slots;
    r->taking = true;
    pthread_mutex_unlock(&r->lock);
    enum status s = r->flow->take(r->flow->context, slot);
    pthread_mutex_lock(&r->lock);
    r->taking = false;
    pthread_cond_broadcast(&r->changed);
    if (s != STATUS_OK) {
        if (r->status == STATUS_OK)
            r->status = s;
        r->ended = true;
        return;
    }
    r->taken++;
    r->state[slot] = WORKED_ON;
    pthread_mutex_unlock(&r->lock);
    r->flow->work(r->flow->context, slot, worker);
    pthread_mutex_lock(&r->lock);
    r->state[slot] = DONE;
    pthread_cond_broadcast(&r->changed);
}

static void *run_worker(void *argument)
{
    struct worker *w = argument;
    struct run *r = w->run;
    pthread_mutex_lock(&r->lock);
    while (!is_over(r)) {
        if (can_give(r))
            give(r);
        else if (can_take(r))
            take_and_work(r, w->number);
        else
            pthread_cond_wait(&r->changed, &r->lock);
    }
    pthread_cond_broadcast(&r->changed);
    pthread_mutex_unlock(&r->lock);
    return NULL;
}

enum status flow_run(const struct flow *flow, unsigned threads)
{
    struct run run = { .flow = flow,
                       .lock = PTHREAD_MUTEX_INITIALIZER,
                       .changed = PTHREAD_COND_INITIALIZER };
    struct worker workers[PARALLEL_MAX_THREADS];
    unsigned started = 1;
    run.slots = flow_slots(threads);
    for (; started < threads && started < PARALLEL_MAX_THREADS; started++) {
        workers[started] = (struct worker){ .run = &run, .number = started };
        if (pthread_create(&workers[started].thread, NULL, run_worker, &workers[started]) != 0)
            break;
    }
    workers[0] = (struct worker){ .run = &run, .number = 0 };
    run_worker(&workers[0]);
    for (unsigned i = 1; i < started; i++)
        pthread_join(workers[i].thread, NULL);
    pthread_cond_destroy(&run.changed);
    pthread_mutex_destroy(&run.lock);
    return run.status;
}
