/* lease.c - grants, renewals and the queue. */
#include "station/lease.h"

#include <string.h>

void lease_init(struct lease *lease, int64_t *counter)
{
    *lease = (struct lease){ .counter = counter };
}

static bool ttl_is_good(int64_t ttl_ms)
{
    return ttl_ms >= LEASE_TTL_MIN_MS && ttl_ms <= LEASE_TTL_MAX_MS;
}

static void grant(struct lease *lease, uint64_t client, int64_t ttl_ms, int64_t now_ms)
{
    lease->holder = client;
    lease->ttl_ms = ttl_ms;
    lease->expires_ms = now_ms + ttl_ms;
    lease->fence = ++*lease->counter;
}

static void drop_waiter(struct lease *lease, size_t place)
{
    struct lease_waiter *at = &lease->queue[place - 1];
    memmove(at, at + 1, (lease->waiting - place) * sizeof *at);
    lease->waiting--;
}

size_t lease_place(const struct lease *lease, uint64_t client)
{
    for (size_t i = 0; i < lease->waiting; i++)
        if (lease->queue[i].client == client)
            return i + 1;
    return 0;
}

/* An expired lease is free even before the tick that says so. */
static bool is_held(const struct lease *lease, int64_t now_ms)
{
    return lease->holder != 0 && now_ms < lease->expires_ms;
}

static enum lease_outcome queue_up(struct lease *lease, uint64_t client, int64_t ttl_ms,
                                   size_t *place)
{
    *place = lease_place(lease, client);
    if (*place == 0 && lease->waiting == LEASE_QUEUE_MAX)
        return LEASE_FULL;
    if (*place == 0) {
        lease->queue[lease->waiting++] = (struct lease_waiter){ client, ttl_ms };
        *place = lease->waiting;
    }
    lease->queue[*place - 1].ttl_ms = ttl_ms;
    return LEASE_QUEUED;
}

enum status lease_acquire(struct lease *lease, uint64_t client, int64_t ttl_ms, bool wait,
                          int64_t now_ms, enum lease_outcome *outcome, size_t *place)
{
    if (!ttl_is_good(ttl_ms))
        return STATUS_RANGE;
    if (is_held(lease, now_ms) && lease->holder == client) {
        lease->ttl_ms = ttl_ms;
        lease->expires_ms = now_ms + ttl_ms;
        *outcome = LEASE_GRANTED;
    } else if (!is_held(lease, now_ms) && lease->waiting == 0) {
        grant(lease, client, ttl_ms, now_ms);
        *outcome = LEASE_GRANTED;
    } else if (wait) {
        /* Free, but others wait: the next tick serves them in their order. */
        *outcome = queue_up(lease, client, ttl_ms, place);
    } else {
        *outcome = LEASE_HELD;
    }
    return STATUS_OK;
}

static bool holds(const struct lease *lease, uint64_t client, int64_t fence, int64_t now_ms)
{
    return is_held(lease, now_ms) && lease->holder == client && lease->fence == fence;
}

bool lease_use(struct lease *lease, uint64_t client, int64_t fence, int64_t now_ms)
{
    if (!holds(lease, client, fence, now_ms))
        return false;
    lease->expires_ms = now_ms + lease->ttl_ms;
    return true;
}

enum status lease_renew(struct lease *lease, uint64_t client, int64_t fence, int64_t ttl_ms,
                        int64_t now_ms)
{
    if (!ttl_is_good(ttl_ms))
        return STATUS_RANGE;
    if (!holds(lease, client, fence, now_ms))
        return STATUS_NOT_FOUND;
    lease->ttl_ms = ttl_ms;
    lease->expires_ms = now_ms + ttl_ms;
    return STATUS_OK;
}

bool lease_leave(struct lease *lease, uint64_t client)
{
    size_t place = lease_place(lease, client);
    bool held = lease->holder == client;
    if (held)
        lease->holder = 0;
    if (place > 0)
        drop_waiter(lease, place);
    return held || place > 0;
}

void lease_tick(struct lease *lease, int64_t now_ms, uint64_t *expired, uint64_t *granted)
{
    *expired = *granted = 0;
    if (lease->holder != 0 && !is_held(lease, now_ms)) {
        *expired = lease->holder;
        lease->holder = 0;
    }
    if (lease->holder == 0 && lease->waiting > 0) {
        struct lease_waiter next = lease->queue[0];
        drop_waiter(lease, 1);
        grant(lease, next.client, next.ttl_ms, now_ms);
        *granted = next.client;
    }
}

int64_t lease_deadline_ms(const struct lease *lease)
{
    return lease->holder != 0 ? lease->expires_ms : INT64_MAX;
}
