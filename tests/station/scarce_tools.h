/* scarce_tools.h - memory, threads and event sources that run out when told to.
 *
 * The Makefile links the tests that include this so that every malloc(), calloc(), realloc(),
 * strdup(), pthread_create() and sd_event_add_*() of the station, of the store, of the drivers and
 * (by its hooks) of cJSON comes here.  What libraries allocate for themselves does not. */
#ifndef SKINSPEC_TESTS_STATION_SCARCE_TOOLS_H
#define SKINSPEC_TESTS_STATION_SCARCE_TOOLS_H

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <systemd/sd-event.h>

enum scarcity {
    SCARCE_ONE, /* one is refused, and then there is enough again */
    SCARCE_ALL  /* from one on all are refused, until scarce_end() */
};

static atomic_long scarce_left = -1; /* so many are given; negative: all */
static atomic_bool scarce_lasts, scarce_was_met;

static inline void scarce_begin(enum scarcity scarcity, long given)
{
    atomic_store(&scarce_was_met, false);
    atomic_store(&scarce_lasts, scarcity == SCARCE_ALL);
    atomic_store(&scarce_left, given);
}

/* Whether anything was refused. */
static inline bool scarce_end(void)
{
    atomic_store(&scarce_left, -1);
    return atomic_load(&scarce_was_met);
}

static inline bool scarce_gives(void)
{
    long left = atomic_load(&scarce_left);
    while (left > 0)
        if (atomic_compare_exchange_weak(&scarce_left, &left, left - 1))
            return true;
    if (left < 0)
        return true;
    if (!atomic_load(&scarce_lasts))
        atomic_store(&scarce_left, -1);
    atomic_store(&scarce_was_met, true);
    return false;
}

void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_malloc(size_t size)
{
    return scarce_gives() ? __real_malloc(size) : NULL;
}

void *__real_calloc(size_t n, size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_calloc(size_t n, size_t size)
{
    return scarce_gives() ? __real_calloc(n, size) : NULL;
}

void *__real_realloc(void *old, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_realloc(void *old, size_t size)
{
    return scarce_gives() ? __real_realloc(old, size) : NULL;
}

char *__real_strdup(const char *text);
char *__wrap_strdup(const char *text);
char *__wrap_strdup(const char *text)
{
    return scarce_gives() ? __real_strdup(text) : NULL;
}

int __real_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *context);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *context);
int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                          void *context)
{
    return scarce_gives() ? __real_pthread_create(thread, attributes, run, context) : EAGAIN;
}

int __real_sd_event_add_io(sd_event *event, sd_event_source **ret, int fd, uint32_t events,
                           sd_event_io_handler_t handler, void *context);
int __wrap_sd_event_add_io(sd_event *event, sd_event_source **ret, int fd, uint32_t events,
                           sd_event_io_handler_t handler, void *context);
int __wrap_sd_event_add_io(sd_event *event, sd_event_source **ret, int fd, uint32_t events,
                           sd_event_io_handler_t handler, void *context)
{
    return scarce_gives() ? __real_sd_event_add_io(event, ret, fd, events, handler, context)
                          : -ENOMEM;
}

int __real_sd_event_add_time(sd_event *event, sd_event_source **ret, clockid_t clock,
                             uint64_t at_us, uint64_t slack_us, sd_event_time_handler_t handler,
                             void *context);
int __wrap_sd_event_add_time(sd_event *event, sd_event_source **ret, clockid_t clock,
                             uint64_t at_us, uint64_t slack_us, sd_event_time_handler_t handler,
                             void *context);
int __wrap_sd_event_add_time(sd_event *event, sd_event_source **ret, clockid_t clock,
                             uint64_t at_us, uint64_t slack_us, sd_event_time_handler_t handler,
                             void *context)
{
    return scarce_gives()
               ? __real_sd_event_add_time(event, ret, clock, at_us, slack_us, handler, context)
               : -ENOMEM;
}

int __real_sd_event_add_time_relative(sd_event *event, sd_event_source **ret, clockid_t clock,
                                      uint64_t in_us, uint64_t slack_us,
                                      sd_event_time_handler_t handler, void *context);
int __wrap_sd_event_add_time_relative(sd_event *event, sd_event_source **ret, clockid_t clock,
                                      uint64_t in_us, uint64_t slack_us,
                                      sd_event_time_handler_t handler, void *context);
int __wrap_sd_event_add_time_relative(sd_event *event, sd_event_source **ret, clockid_t clock,
                                      uint64_t in_us, uint64_t slack_us,
                                      sd_event_time_handler_t handler, void *context)
{
    return scarce_gives() ? __real_sd_event_add_time_relative(event, ret, clock, in_us, slack_us,
                                                              handler, context)
                          : -ENOMEM;
}

int __real_sd_event_add_defer(sd_event *event, sd_event_source **ret, sd_event_handler_t handler,
                              void *context);
int __wrap_sd_event_add_defer(sd_event *event, sd_event_source **ret, sd_event_handler_t handler,
                              void *context);
int __wrap_sd_event_add_defer(sd_event *event, sd_event_source **ret, sd_event_handler_t handler,
                              void *context)
{
    return scarce_gives() ? __real_sd_event_add_defer(event, ret, handler, context) : -ENOMEM;
}

#endif
