/* unit.c - an instrument's thread: open, serve, lose, open again; and what others call. */
#include "station/unit_private.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "drivers/link/link.h"

enum { FIRST_PAUSE_MS = 200, LONGEST_PAUSE_MS = 5000 };

/* A cancellation misses a call that has not quite begun: closing repeats it. */
enum { CANCEL_EVERY_MS = 50 };

/* ---- waiting ------------------------------------------------------------------------ */

/* With the lock held: until something changed, or it is later than that. */
static void wait_for_change(struct unit *u, int64_t until_ms)
{
    struct timespec until = { .tv_sec = until_ms / 1000, .tv_nsec = until_ms % 1000 * 1000000 };
    (void)pthread_cond_timedwait(&u->changed, &u->lock, &until);
}

bool unit_wait_for(struct unit *u, const bool *flag, int64_t until_ms)
{
    pthread_mutex_lock(&u->lock);
    while (!*flag && clock_monotonic_ms() < until_ms)
        wait_for_change(u, until_ms);
    bool raised = *flag;
    pthread_mutex_unlock(&u->lock);
    return raised;
}

bool unit_is(struct unit *u, const bool *flag)
{
    return unit_wait_for(u, flag, 0);
}

/* ---- opening and losing ------------------------------------------------------------- */

static void set_instrument(struct unit *u, struct instrument *instrument)
{
    pthread_mutex_lock(&u->lock);
    u->instrument = instrument;
    pthread_mutex_unlock(&u->lock);
}

static void close_instrument(struct unit *u)
{
    struct instrument *instrument = u->instrument;
    set_instrument(u, NULL); /* nobody cancels it any more */
    u->driver->close(instrument);
}

/* Open it, set it as it was, ask how it is.  It may be half open where that fails. */
static enum driver_result try_to_open(struct unit *u, struct driver_error *error)
{
    struct driver_status status;
    struct instrument *instrument;
    enum driver_result r = u->driver->open(&u->options, &instrument, &u->identity, error);
    if (r != DRIVER_OK)
        return r;
    set_instrument(u, instrument);
    if (u->has_setup)
        r = u->driver->configure(instrument, &u->setup, error);
    if (r == DRIVER_OK)
        r = u->driver->status(instrument, &status, error);
    if (r == DRIVER_OK)
        unit_keep_status(u, &status);
    return r;
}

/* False: it is up, and nobody could be told. */
static bool come_up(struct unit *u)
{
    u->connection++;
    u->press_until_ms = 0;
    u->watches_button = u->identity.has_button && !u->replays;
    pthread_mutex_lock(&u->lock);
    u->down = false; /* before it is told: who hears of it may ask at once */
    pthread_mutex_unlock(&u->lock);
    return unit_tell_opened(u);
}

/* After the instrument was lost, or could not be opened, or when the unit is closed. */
static void go_down(struct unit *u, const struct driver_error *why)
{
    struct job *job;
    pthread_mutex_lock(&u->lock);
    bool is_told =
        u->down && why->result == u->why_down.result && strcmp(why->text, u->why_down.text) == 0;
    bool is_news = !is_told && !u->closing;
    u->down = true;
    u->why_down = *why;
    while ((job = job_queue_take(&u->queue, 0, NULL)) != NULL)
        unit_give_back(u, (struct unit_job *)job);
    u->begun = u->asked;
    pthread_mutex_unlock(&u->lock);
    close_instrument(u);
    if (is_news)
        unit_tell_lost(u, why);
}

/* Before it is opened again; true: cut short, as it may be there by now. */
static bool rest(struct unit *u, int64_t pause_ms)
{
    int64_t until_ms = clock_monotonic_ms() + pause_ms;
    pthread_mutex_lock(&u->lock);
    while (!u->closing && !u->try_now && clock_monotonic_ms() < until_ms)
        wait_for_change(u, until_ms);
    bool cut_short = u->try_now;
    u->try_now = false;
    pthread_mutex_unlock(&u->lock);
    return cut_short;
}

static void *live(void *unit)
{
    struct unit *u = unit;
    struct driver_error error = { .result = DRIVER_OK };
    int64_t pause_ms = FIRST_PAUSE_MS;
    for (;;) {
        if (try_to_open(u, &error) == DRIVER_OK) {
            if (come_up(u))
                unit_serve(u, &error);
            else
                (void)driver_fail(&error, DRIVER_GONE, NULL, "not enough memory to use it");
            pause_ms = FIRST_PAUSE_MS;
        }
        go_down(u, &error);
        if (rest(u, pause_ms))
            pause_ms = FIRST_PAUSE_MS / 2; /* something has come: it may be this */
        if (unit_is(u, &u->closing))
            break;
        pause_ms = 2 * pause_ms < LONGEST_PAUSE_MS ? 2 * pause_ms : LONGEST_PAUSE_MS;
    }
    pthread_mutex_lock(&u->lock);
    u->ended = true;
    pthread_cond_broadcast(&u->changed);
    pthread_mutex_unlock(&u->lock);
    return NULL;
}

/* ---- what others call --------------------------------------------------------------- */

static void init_locks(struct unit *u)
{
    pthread_condattr_t by_monotonic;
    pthread_condattr_init(&by_monotonic);
    pthread_condattr_setclock(&by_monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&u->changed, &by_monotonic);
    pthread_condattr_destroy(&by_monotonic);
    pthread_mutex_init(&u->lock, NULL);
    job_queue_init(&u->queue);
}

static void free_unit(struct unit *u)
{
    job_queue_done(&u->queue);
    pthread_mutex_destroy(&u->lock);
    pthread_cond_destroy(&u->changed);
    free(u->address);
    free(u);
}

enum status unit_open(const struct driver *driver, const struct driver_options *options,
                      struct inbox *inbox, const struct unit_events *events, struct unit **ret)
{
    struct unit *u = calloc(1, sizeof *u);
    if (u == NULL)
        return STATUS_NO_MEMORY;
    u->driver = driver;
    u->options = *options;
    u->inbox = inbox;
    u->events = *events;
    init_locks(u);
    u->address = strdup(options->address != NULL ? options->address : "");
    u->options.address = u->address;
    u->replays = u->address != NULL && link_is_replay(u->address);
    enum status s = u->address != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (s == STATUS_OK && pthread_create(&u->thread, NULL, live, u) != 0)
        s = STATUS_IO;
    if (s != STATUS_OK) {
        free_unit(u);
        return s;
    }
    *ret = u;
    return STATUS_OK;
}

void unit_ask(struct unit *u, struct unit_job *job)
{
    pthread_mutex_lock(&u->lock);
    if (u->closing || u->down) {
        unit_give_back(u, job);
    } else {
        u->asked++;
        job_queue_put(&u->queue, &job->job);
        if (u->idle)
            u->driver->cancel(u->instrument);
    }
    pthread_mutex_unlock(&u->lock);
}

void unit_cancel(struct unit *u)
{
    pthread_mutex_lock(&u->lock);
    u->cancelled_to = u->asked;
    if (u->under_way) {
        u->cancelled = true;
        pthread_cond_broadcast(&u->changed);
        u->driver->cancel(u->instrument);
    }
    pthread_mutex_unlock(&u->lock);
}

void unit_try_now(struct unit *u)
{
    pthread_mutex_lock(&u->lock);
    u->try_now = u->down;
    pthread_cond_broadcast(&u->changed);
    pthread_mutex_unlock(&u->lock);
}

bool unit_close(struct unit *u, int patience_ms)
{
    if (u == NULL)
        return true;
    int64_t until_ms = clock_monotonic_ms() + patience_ms;
    pthread_mutex_lock(&u->lock);
    u->closing = u->cancelled = true;
    pthread_cond_broadcast(&u->changed);
    job_queue_close(&u->queue);
    for (;;) {
        if (u->instrument != NULL)
            u->driver->cancel(u->instrument);
        int64_t left_ms = until_ms - clock_monotonic_ms();
        if (u->ended || left_ms <= 0)
            break;
        wait_for_change(u, clock_monotonic_ms() +
                               (left_ms < CANCEL_EVERY_MS ? left_ms : CANCEL_EVERY_MS));
    }
    bool ended = u->ended;
    pthread_mutex_unlock(&u->lock);
    if (!ended)
        return false;
    pthread_join(u->thread, NULL);
    free_unit(u);
    return true;
}
