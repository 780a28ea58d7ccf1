/* unit_work.c - what the thread does while the instrument is open: jobs, and in between the
 * button and the status. */
#include "base/clock.h"
#include "station/unit_private.h"

/* ---- jobs --------------------------------------------------------------------------- */

static void ask_status_in(struct unit *u, int64_t in_ms)
{
    u->status_at_ms = clock_monotonic_ms() + in_ms;
}

void unit_keep_status(struct unit *u, const struct driver_status *status)
{
    u->told = *status;
    ask_status_in(u, status->charging ? UNIT_SOON_MS : UNIT_STATUS_MS);
}

static enum driver_result do_status(struct unit *u, struct unit_job *job,
                                    struct driver_error *error)
{
    enum driver_result r = u->driver->status(u->instrument, &job->status, error);
    job->status_known = r == DRIVER_OK;
    if (r == DRIVER_OK)
        unit_keep_status(u, &job->status);
    return r;
}

/* The step was done: the status that goes with it.  Where there is none, the next to be
 * asked tells why. */
static void add_status(struct unit *u, struct unit_job *job)
{
    struct driver_error ignored;
    if (do_status(u, job, &ignored) != DRIVER_OK)
        ask_status_in(u, 0);
}

static enum driver_result do_configure(struct unit *u, struct unit_job *job)
{
    enum driver_result r = u->driver->configure(u->instrument, &job->setup, &job->error);
    if (r != DRIVER_OK)
        return r;
    u->setup = job->setup;
    u->has_setup = true;
    add_status(u, job);
    return DRIVER_OK;
}

static enum driver_result do_calibrate(struct unit *u, struct unit_job *job)
{
    enum driver_result r = u->driver->calibrate(u->instrument, job->step, &job->error);
    if (r == DRIVER_OK)
        add_status(u, job);
    else
        ask_status_in(u, UNIT_SOON_MS);
    return r;
}

/* The status would hold up the next shot of a set: it is asked once no more come. */
static enum driver_result do_measure(struct unit *u, struct unit_job *job)
{
    enum driver_result r = u->driver->measure(u->instrument, &job->reading, &job->error);
    ask_status_in(u, UNIT_SOON_MS);
    return r;
}

/* A cancellation that ended something else may reach a wait: only this job's counts. */
static enum driver_result wait_for_press(struct unit *u, int64_t until_ms, bool *pressed,
                                         struct driver_error *error)
{
    enum driver_result r;
    do {
        int64_t left_ms = until_ms - clock_monotonic_ms();
        r = u->driver->wait_button(u->instrument, left_ms > 0 ? (int)left_ms : 0, pressed, error);
    } while (r == DRIVER_CANCELLED && !unit_is(u, &u->cancelled));
    return r;
}

static enum driver_result do_wait(struct unit *u, struct unit_job *job)
{
    bool earlier;
    enum driver_result r = DRIVER_OK;
    int64_t until_ms = clock_monotonic_ms() + job->timeout_ms;
    if (!u->identity.has_button) {
        if (unit_wait_for(u, &u->cancelled, until_ms))
            return driver_fail(&job->error, DRIVER_CANCELLED, NULL, "cancelled");
        return DRIVER_OK;
    }
    if (!u->replays)
        r = wait_for_press(u, 0, &earlier, &job->error);
    if (r == DRIVER_OK)
        r = wait_for_press(u, until_ms, &job->pressed, &job->error);
    if (r == DRIVER_OK && job->pressed)
        u->press_until_ms = clock_monotonic_ms() + DRIVER_PRESS_FRESH_MS;
    return r;
}

static enum driver_result do_command(struct unit *u, struct unit_job *job)
{
    switch (job->command) {
    case UNIT_CONFIGURE:
        return do_configure(u, job);
    case UNIT_STATUS:
        return do_status(u, job, &job->error);
    case UNIT_CALIBRATE:
        return do_calibrate(u, job);
    case UNIT_MEASURE:
        return do_measure(u, job);
    case UNIT_WAIT:
        return do_wait(u, job);
    }
    return driver_fail(&job->error, DRIVER_UNSUPPORTED, NULL, "no such command");
}

static void clear_outputs(struct unit_job *job)
{
    job->error = (struct driver_error){ .result = DRIVER_OK };
    job->status_known = job->pressed = false;
    job->connection = 0;
}

void unit_give_back(struct unit *u, struct unit_job *job)
{
    clear_outputs(job);
    if (u->down && !u->closing) {
        job->result = DRIVER_GONE;
        job->error = u->why_down;
    } else {
        job->result = driver_fail(&job->error, DRIVER_CANCELLED, NULL, "cancelled");
    }
    inbox_put(u->inbox, &job->job);
}

/* False: it was cancelled before, and has gone back. */
static bool begin_job(struct unit *u, struct unit_job *job)
{
    pthread_mutex_lock(&u->lock);
    u->begun++;
    u->cancelled = u->closing || u->begun <= u->cancelled_to;
    u->under_way = !u->cancelled;
    bool may_begin = u->under_way;
    if (!may_begin)
        unit_give_back(u, job);
    pthread_mutex_unlock(&u->lock);
    return may_begin;
}

static void end_job(struct unit *u)
{
    pthread_mutex_lock(&u->lock);
    u->under_way = false;
    pthread_mutex_unlock(&u->lock);
}

/* How it ended, *error why. */
static enum driver_result do_job(struct unit *u, struct unit_job *job, struct driver_error *error)
{
    if (!begin_job(u, job))
        return DRIVER_CANCELLED;
    clear_outputs(job);
    job->connection = u->connection;
    if (job->command != UNIT_STATUS) /* which keeps a press */
        u->press_until_ms = 0;
    enum driver_result r = job->result = do_command(u, job);
    *error = job->error;
    end_job(u);
    inbox_put(u->inbox, &job->job); /* the caller's from here on */
    return r;
}

/* ---- between jobs ------------------------------------------------------------------- */

static bool differ(const struct driver_status *a, const struct driver_status *b)
{
    for (size_t i = 0; i < DRIVER_CALIBRATIONS; i++)
        if (a->due[i] != b->due[i])
            return true;
    return a->charging != b->charging || a->battery_percent != b->battery_percent;
}

static enum driver_result ask_status(struct unit *u, struct driver_error *error)
{
    struct driver_status status;
    enum driver_result r = u->driver->status(u->instrument, &status, error);
    u->watches_button = u->identity.has_button && !u->replays;
    if (r != DRIVER_OK) {
        ask_status_in(u, UNIT_STATUS_MS);
        return r;
    }
    bool is_news = differ(&status, &u->told);
    unit_keep_status(u, &status);
    if (is_news)
        unit_tell_status(u);
    return DRIVER_OK;
}

/* A job that is put after the look at the queue sees idle, and cancels; the driver keeps
 * that for the wait, should it not have begun. */
static bool begin_idling(struct unit *u)
{
    pthread_mutex_lock(&u->lock);
    bool idle = u->idle = !u->closing && job_queue_length(&u->queue) == 0;
    pthread_mutex_unlock(&u->lock);
    return idle;
}

static void end_idling(struct unit *u)
{
    pthread_mutex_lock(&u->lock);
    u->idle = false;
    pthread_mutex_unlock(&u->lock);
}

/* When there is something to do but jobs; 0: at once. */
static int64_t next_ms(const struct unit *u)
{
    if (u->press_until_ms > clock_monotonic_ms())
        return u->press_until_ms;
    return u->watches_button ? 0 : u->status_at_ms;
}

/* Until it is pressed, a job comes, or the status is to be asked. */
static enum driver_result watch_button(struct unit *u, struct driver_error *error)
{
    bool pressed = false;
    int64_t left_ms = u->status_at_ms - clock_monotonic_ms();
    if (!begin_idling(u))
        return DRIVER_OK;
    enum driver_result r =
        u->driver->wait_button(u->instrument, left_ms > 0 ? (int)left_ms : 0, &pressed, error);
    end_idling(u);
    if (r == DRIVER_OK && pressed)
        unit_tell_button(u);
    /* One that fails is left alone until the next status, not asked again and again. */
    if (r != DRIVER_OK && r != DRIVER_CANCELLED)
        u->watches_button = false;
    return r;
}

void unit_serve(struct unit *u, struct driver_error *error)
{
    enum driver_result r = DRIVER_OK;
    while (r != DRIVER_GONE && !unit_is(u, &u->closing)) {
        int64_t left_ms = next_ms(u) - clock_monotonic_ms();
        struct job *job = job_queue_take(&u->queue, left_ms > 0 ? (int)left_ms : 0, NULL);
        if (job != NULL)
            r = do_job(u, (struct unit_job *)job, error);
        else if (u->press_until_ms > clock_monotonic_ms())
            continue; /* nobody has fetched it yet */
        else if (u->status_at_ms <= clock_monotonic_ms())
            r = ask_status(u, error);
        else if (u->watches_button)
            r = watch_button(u, error);
    }
}
