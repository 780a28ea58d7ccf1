/* unit_tools.h - a loop, a unit, and what was heard of it: for the tests of station/unit. */
#ifndef SKINSPEC_TESTS_STATION_UNIT_TOOLS_H
#define SKINSPEC_TESTS_STATION_UNIT_TOOLS_H

#include <poll.h>

#include "station/unit.h"
#include "tests/station/fake_instrument.h"
#include "unity.h"

/* What is waited for at most, and what a busy machine may add to a wait. */
enum { LONG_MS = 10000, SLACK_MS = 400 };

static struct inbox inbox;
static struct unit *unit;

/* ---- the loop ---------------------------------------------------------------------- */

static struct heard {
    int opened, lost, buttons, statuses;
    struct driver_identity identity;
    struct driver_status status;
    struct driver_error error;
    uint64_t connection;
} heard;

static inline void on_opened(void *context, const struct driver_identity *identity,
                             const struct driver_status *status, uint64_t connection)
{
    struct heard *h = context;
    h->opened++;
    h->identity = *identity;
    h->status = *status;
    h->connection = connection;
}

static inline void on_lost(void *context, const struct driver_error *error)
{
    struct heard *h = context;
    h->lost++;
    h->error = *error;
}

static inline void on_button(void *context)
{
    ((struct heard *)context)->buttons++;
}

static inline void on_status(void *context, const struct driver_status *status)
{
    struct heard *h = context;
    h->statuses++;
    h->status = *status;
}

/* Drain until the number is there; false: it did not come in time. */
static inline bool comes(const int *count, int expect, int within_ms)
{
    int64_t until_ms = call_now_ms() + within_ms;
    for (;;) {
        inbox_drain(&inbox);
        int64_t left_ms = until_ms - call_now_ms();
        if (*count >= expect || left_ms <= 0)
            return *count == expect;
        (void)poll(&(struct pollfd){ .fd = inbox.fd, .events = POLLIN }, 1, (int)left_ms);
    }
}

/* The fake's numbers change without the inbox. */
static inline bool reaches(atomic_int *count, int expect, int within_ms)
{
    int64_t until_ms = call_now_ms() + within_ms;
    while (atomic_load(count) < expect && call_now_ms() < until_ms)
        nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
    return atomic_load(count) >= expect;
}

static inline void let_pass_ms(int ms)
{
    int never = 0;
    (void)comes(&never, 1, ms);
}

/* ---- jobs --------------------------------------------------------------------------- */

enum { MAX_JOBS = 1000 };

static struct unit_job jobs[MAX_JOBS];
static int done_jobs;
static struct unit_job *done_order[MAX_JOBS];

static inline void on_done(struct job *job)
{
    done_order[done_jobs++] = (struct unit_job *)job;
}

static inline struct unit_job *ask(size_t i, enum unit_command command)
{
    jobs[i] = (struct unit_job){ .job.done = on_done, .command = command, .timeout_ms = LONG_MS };
    memset(&jobs[i].error, 0x55, sizeof jobs[i].error);
    jobs[i].status_known = jobs[i].pressed = true; /* what comes out must have been set */
    unit_ask(unit, &jobs[i]);
    return &jobs[i];
}

/* Ask and wait for the answer. */
static inline struct unit_job *get(enum unit_command command)
{
    done_jobs = 0;
    struct unit_job *job = ask(0, command);
    TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 1, LONG_MS), "no answer");
    return job;
}

static inline void open_unit(const struct driver *driver, const char *address)
{
    struct driver_options options = { .address = address, .reply_timeout_ms = 200 };
    const struct unit_events events = { on_opened, on_lost, on_button, on_status, &heard };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, unit_open(driver, &options, &inbox, &events, &unit));
}

/* The fake one, and told so. */
static inline void open_fake(void)
{
    open_unit(&fake_driver, "F-1");
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, LONG_MS));
}

static inline void open_fake_without_button(void)
{
    fake.has_button = false;
    open_fake();
}

void setUp(void)
{
    memset(&heard, 0, sizeof heard);
    done_jobs = 0;
    unit = NULL;
    fake_set_up();
    TEST_ASSERT_EQUAL_INT(STATUS_OK, inbox_init(&inbox));
}

void tearDown(void)
{
    atomic_store(&fake.let_go, true);
    TEST_ASSERT_TRUE(unit_close(unit, LONG_MS));
    inbox_drain(&inbox);
    inbox_done(&inbox);
    fake_tear_down();
    TEST_ASSERT_FALSE_MESSAGE(atomic_load(&fake.broken), "two calls at once");
}

#endif
