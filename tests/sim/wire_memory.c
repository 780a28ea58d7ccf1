/* wire_memory.c - a lock around the simulator, and an eventfd that wakes whoever waits for it. */
#include "tests/sim/wire_memory.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

struct wire_memory {
    struct link_source source; /* first: a source is its wire */
    const struct sim_kind *kind;
    pthread_mutex_t lock; /* for all below */
    struct sim *sim;
    int changed_fd; /* written to where a waiting link should look again */
    bool open, gone;
    unsigned unplugged; /* how often it was */
    unsigned sends;
    unsigned
        unplug_sends; /* 0: it stays plugged; 1: after so many bytes; > 1: sends to come, + 1 */
    size_t unplug_bytes;
    size_t split_at;
    int split_ms;
    size_t came;          /* of this reply */
    int64_t rest_from_us; /* what is behind split_at; 0: not reached yet */
};

struct memory_link {
    struct link link;
    struct wire_memory *wire;
    unsigned unplugged; /* the wire's when it was opened: another means that this link is dead */
};

static int64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void wake(struct wire_memory *wire)
{
    (void)eventfd_write(wire->changed_fd, 1);
}

/* ---- the link: called with the lock held where it says so --------------------------- */

static enum driver_result fail_gone(struct driver_error *error)
{
    return driver_fail(error, DRIVER_GONE, NULL,
                       "the simulated instrument is unplugged: plug it in again");
}

/* Locked. */
static void pull_out(struct wire_memory *wire)
{
    wire->gone = true;
    wire->unplugged++;
    wire->unplug_sends = 0;
    wake(wire);
}

/* Locked.  Unplugged since this link was opened? */
static bool is_gone(const struct memory_link *m)
{
    return m->unplugged != m->wire->unplugged;
}

static enum driver_result transfer_failed(int error_number, struct driver_error *error)
{
    if (error_number == ENODEV || error_number == ESHUTDOWN)
        return fail_gone(error);
    return driver_fail(error, DRIVER_PROTOCOL, NULL,
                       "the simulated instrument ended a transfer: %s", strerror(error_number));
}

static enum driver_result memory_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct memory_link *m = (struct memory_link *)link;
    struct wire_memory *wire = m->wire;
    enum driver_result result = DRIVER_OK;
    (void)deadline_ms; /* the wire takes all at once */
    pthread_mutex_lock(&wire->lock);
    if (is_gone(m)) {
        result = fail_gone(error);
    } else {
        int ended = wire->kind->take(wire->sim, channel, bytes, n, now_us());
        if (ended != 0)
            result = transfer_failed(-ended, error);
        wire->sends++;
        wire->came = 0;
        wire->rest_from_us = 0;
        if (wire->unplug_sends > 1)
            wire->unplug_sends--;
        if (wire->unplug_sends == 1 && wire->unplug_bytes == 0)
            pull_out(wire);
    }
    pthread_mutex_unlock(&wire->lock);
    return result;
}

/* Locked.  How much may come now; 0: *due_us is when. */
static size_t allowed(struct wire_memory *wire, uint8_t channel, size_t size, int64_t *due_us)
{
    if (wire->unplug_sends == 1 && channel == LINK_SERIAL) {
        size_t left = wire->unplug_bytes - wire->came; /* > 0, else it was pulled out */
        size = size < left ? size : left;
    }
    if (wire->split_ms == 0 || channel != LINK_SERIAL)
        return size;
    if (wire->came < wire->split_at)
        return size < wire->split_at - wire->came ? size : wire->split_at - wire->came;
    int64_t now = now_us();
    if (wire->rest_from_us == 0)
        wire->rest_from_us = now + (int64_t)wire->split_ms * 1000;
    *due_us = wire->rest_from_us;
    return now < wire->rest_from_us ? 0 : size;
}

/* Locked.  Count what came; a line that ended is followed by another reply. */
static void count(struct wire_memory *wire, uint8_t channel, const uint8_t *bytes, size_t n)
{
    wire->came += n;
    if (wire->unplug_sends == 1 && wire->came >= wire->unplug_bytes)
        pull_out(wire);
    else if (wire->unplug_sends != 1 && channel == LINK_SERIAL && n > 0 && bytes[n - 1] == '\n') {
        wire->came = 0;
        wire->rest_from_us = 0;
    }
}

/* Locked.  Bytes, or 0 and when to ask again. */
static enum driver_result look(struct memory_link *m, uint8_t channel, uint8_t *bytes, size_t size,
                               size_t *n, int64_t *due_us, struct driver_error *error)
{
    struct wire_memory *wire = m->wire;
    *n = 0;
    *due_us = INT64_MAX;
    if (is_gone(m))
        return fail_gone(error);
    size_t most = allowed(wire, channel, size, due_us);
    if (most == 0)
        return DRIVER_OK;
    ssize_t came = wire->kind->give(wire->sim, channel, bytes, most, now_us(), due_us);
    if (came < 0)
        return transfer_failed((int)-came, error);
    /* A transfer that the plug is pulled out of does not arrive. */
    if (channel != LINK_SERIAL && wire->unplug_sends == 1 &&
        wire->came + (size_t)came > wire->unplug_bytes) {
        pull_out(wire);
        return fail_gone(error);
    }
    if (came > 0)
        count(wire, channel, bytes, (size_t)came);
    *n = (size_t)came;
    return DRIVER_OK;
}

static enum driver_result wait_for(struct memory_link *m, int64_t due_us, int64_t deadline_ms,
                                   struct driver_error *error)
{
    eventfd_t forgotten;
    int64_t due_ms = due_us == INT64_MAX ? INT64_MAX : due_us / 1000 + 1;
    int64_t until_ms = due_ms < deadline_ms ? due_ms : deadline_ms;
    switch (call_wait(m->link.call, m->wire->changed_fd, until_ms)) {
    case CALL_CANCELLED:
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    case CALL_READABLE:
        (void)eventfd_read(m->wire->changed_fd, &forgotten);
        return DRIVER_OK;
    case CALL_DEADLINE:
        break;
    }
    if (due_ms <= deadline_ms)
        return DRIVER_OK;
    return driver_fail(error, DRIVER_TIMEOUT, NULL, "the simulated instrument does not answer");
}

static enum driver_result memory_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    struct memory_link *m = (struct memory_link *)link;
    for (;;) {
        size_t came;
        int64_t due_us;
        pthread_mutex_lock(&m->wire->lock);
        enum driver_result result = look(m, channel, bytes, size, &came, &due_us, error);
        pthread_mutex_unlock(&m->wire->lock);
        if (result == DRIVER_OK && came > 0)
            *n = came;
        if (result != DRIVER_OK || came > 0)
            return result;
        result = wait_for(m, due_us, deadline_ms, error);
        if (result != DRIVER_OK)
            return result;
    }
}

static enum driver_result memory_drain(struct link *link, uint8_t channel, int quiet_ms,
                                       int64_t deadline_ms, struct driver_error *error)
{
    uint8_t bytes[4096];
    for (;;) {
        size_t n;
        struct driver_error why;
        int64_t quiet = call_now_ms() + quiet_ms;
        bool enough = quiet > deadline_ms;
        enum driver_result result = memory_receive(link, channel, bytes, sizeof bytes, &n,
                                                   enough ? deadline_ms : quiet, &why);
        if (result == DRIVER_TIMEOUT && !enough)
            return DRIVER_OK;
        if (result != DRIVER_OK) {
            *error = why;
            return result;
        }
    }
}

static void memory_close(struct link *link)
{
    struct memory_link *m = (struct memory_link *)link;
    pthread_mutex_lock(&m->wire->lock);
    m->wire->open = false;
    pthread_mutex_unlock(&m->wire->lock);
    free(m);
}

static const struct link_ops memory_ops = {
    .kind = "memory",
    .send = memory_send,
    .receive = memory_receive,
    .drain = memory_drain,
    .close = memory_close,
};

static enum driver_result memory_open(const struct link_source *source,
                                      const struct link_wanted *wanted, struct link **ret,
                                      struct driver_error *error)
{
    struct wire_memory *wire = (struct wire_memory *)(uintptr_t)source;
    enum driver_result result = DRIVER_OK;
    struct memory_link *m = calloc(1, sizeof *m);
    if (m == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "not enough memory");
    *m = (struct memory_link){ .link = { &memory_ops, wanted->call }, .wire = wire };
    pthread_mutex_lock(&wire->lock);
    if (wire->gone)
        result = fail_gone(error);
    else if (wire->open)
        result = driver_fail(error, DRIVER_BUSY, NULL,
                             "the simulated instrument is held: close the other link");
    else
        wire->open = true;
    m->unplugged = wire->unplugged;
    pthread_mutex_unlock(&wire->lock);
    if (result == DRIVER_OK)
        *ret = &m->link;
    else
        free(m);
    return result;
}

/* ---- the test's side ---------------------------------------------------------------- */

struct wire_memory *wire_memory_make(const struct sim_kind *kind, const char *options)
{
    struct wire_memory *wire = calloc(1, sizeof *wire);
    if (wire == NULL)
        return NULL;
    wire->source.open = memory_open;
    wire->kind = kind;
    wire->changed_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    wire->sim = kind->make(options);
    pthread_mutex_init(&wire->lock, NULL);
    if (wire->changed_fd >= 0 && wire->sim != NULL)
        return wire;
    wire_memory_free(wire);
    return NULL;
}

void wire_memory_free(struct wire_memory *wire)
{
    if (wire == NULL)
        return;
    if (wire->sim != NULL)
        wire->kind->free(wire->sim);
    if (wire->changed_fd >= 0)
        close(wire->changed_fd);
    pthread_mutex_destroy(&wire->lock);
    free(wire);
}

const struct link_source *wire_memory_source(struct wire_memory *wire)
{
    return &wire->source;
}

bool wire_memory_act(struct wire_memory *wire, const char *action)
{
    pthread_mutex_lock(&wire->lock);
    bool done = wire->kind->act(wire->sim, action, now_us());
    wake(wire);
    pthread_mutex_unlock(&wire->lock);
    return done;
}

double wire_memory_truth(struct wire_memory *wire, double nm, bool sci)
{
    pthread_mutex_lock(&wire->lock);
    double R = wire->kind->truth(wire->sim, nm, sci);
    pthread_mutex_unlock(&wire->lock);
    return R;
}

void wire_memory_unplug(struct wire_memory *wire)
{
    pthread_mutex_lock(&wire->lock);
    pull_out(wire);
    pthread_mutex_unlock(&wire->lock);
}

void wire_memory_plug(struct wire_memory *wire)
{
    uint8_t lost[512];
    static const uint8_t channels[] = { LINK_SERIAL, 0x81, 0x82, 0x86 };
    pthread_mutex_lock(&wire->lock);
    int64_t due_us, now = now_us();
    /* What was on its way when it was pulled out. */
    for (size_t i = 0; i < sizeof channels; i++)
        while (wire->kind->give(wire->sim, channels[i], lost, sizeof lost, now, &due_us) > 0)
            ;
    wire->gone = false;
    pthread_mutex_unlock(&wire->lock);
}

void wire_memory_unplug_at(struct wire_memory *wire, unsigned sends, size_t n)
{
    pthread_mutex_lock(&wire->lock);
    wire->unplug_sends = sends + 1;
    wire->unplug_bytes = n;
    pthread_mutex_unlock(&wire->lock);
}

void wire_memory_split(struct wire_memory *wire, size_t k, int ms)
{
    pthread_mutex_lock(&wire->lock);
    wire->split_at = k;
    wire->split_ms = ms;
    pthread_mutex_unlock(&wire->lock);
}

unsigned wire_memory_sends(struct wire_memory *wire)
{
    pthread_mutex_lock(&wire->lock);
    unsigned sends = wire->sends;
    pthread_mutex_unlock(&wire->lock);
    return sends;
}

bool wire_memory_is_open(struct wire_memory *wire)
{
    pthread_mutex_lock(&wire->lock);
    bool open = wire->open;
    pthread_mutex_unlock(&wire->lock);
    return open;
}
