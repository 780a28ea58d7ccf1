/* lease.h - who may use an instrument: one holder, a queue behind it.
 *
 * Plain state without clocks, threads or sockets: the caller passes the time
 * (milliseconds of CLOCK_BOOTTIME) and carries out what the answers say.  A lease
 * ends by release, by its client's disconnection, or when it expires; every use
 * renews it.  The fence grows with every grant and never returns, so that a result
 * that comes late can be told from the present holder's. */
#ifndef SKINSPEC_STATION_LEASE_H
#define SKINSPEC_STATION_LEASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

enum { LEASE_QUEUE_MAX = 64, LEASE_TTL_MIN_MS = 1000, LEASE_TTL_MAX_MS = 600000 };

struct lease_waiter {
    uint64_t client; /* the caller's number of the connection, never 0 */
    int64_t ttl_ms;
};

struct lease {
    uint64_t holder; /* 0: free */
    int64_t ttl_ms, expires_ms;
    int64_t fence;    /* of the present or the last holder; 0 before the first */
    int64_t *counter; /* the last fence given out, of all leases that share it */
    struct lease_waiter queue[LEASE_QUEUE_MAX];
    size_t waiting;
};

/* counter: the caller's, for all its leases; across restarts it is he who sees that none comes
 * again. */
void lease_init(struct lease *lease, int64_t *counter);

enum lease_outcome {
    LEASE_GRANTED,
    LEASE_QUEUED, /* *place is 1 for the next in line */
    LEASE_HELD,   /* by another, and the caller does not want to wait */
    LEASE_FULL,   /* nor is there room to wait */
};

/* A holder that asks again renews; a client that waits already keeps its place.
 * Call lease_tick() first, so that an expired holder is told.  STATUS_RANGE for a
 * ttl outside LEASE_TTL_MIN_MS..MAX; else *outcome is set, and
 * *place where it is LEASE_QUEUED. */
enum status lease_acquire(struct lease *lease, uint64_t client, int64_t ttl_ms, bool wait,
                          int64_t now_ms, enum lease_outcome *outcome, size_t *place);

/* Whether the client holds the lease of that fence; if so it is renewed by the ttl it
 * asked for. */
bool lease_use(struct lease *lease, uint64_t client, int64_t fence, int64_t now_ms);

/* Renew with another ttl.  STATUS_RANGE for the ttl, STATUS_NOT_FOUND where the client
 * does not hold the lease of that fence. */
enum status lease_renew(struct lease *lease, uint64_t client, int64_t fence, int64_t ttl_ms,
                        int64_t now_ms);

/* The client gives up the lease, or its place in the queue, or both.  False where it
 * had neither. */
bool lease_leave(struct lease *lease, uint64_t client);

/* What time has brought: an expired holder loses the lease (*expired, 0 for nobody),
 * and a free lease goes to the next in line (*granted, 0 for nobody). */
void lease_tick(struct lease *lease, int64_t now_ms, uint64_t *expired, uint64_t *granted);

/* When lease_tick() is due next; INT64_MAX while nobody holds the lease. */
int64_t lease_deadline_ms(const struct lease *lease);

/* Place of a client in the queue from 1; 0 where it does not wait. */
size_t lease_place(const struct lease *lease, uint64_t client);

#endif
