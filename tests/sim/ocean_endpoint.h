/* ocean_endpoint.h - what an IN endpoint has to give: packets, each from its time on. */
#ifndef SKINSPEC_TESTS_SIM_OCEAN_ENDPOINT_H
#define SKINSPEC_TESTS_SIM_OCEAN_ENDPOINT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

struct ocean_bytes; /* some that were put together */

struct ocean_endpoint {
    uint8_t address;
    size_t packet;
    bool silent; /* gives nothing, and keeps what it has */
    struct ocean_bytes *first, *last;
};

/* n bytes from due_us on, of packets as large as they may be and then a shorter one. */
void ocean_endpoint_put(struct ocean_endpoint *endpoint, const void *bytes, size_t n,
                        int64_t due_us);

/* After all that was put: -errno, once. */
void ocean_endpoint_put_error(struct ocean_endpoint *endpoint, int error, int64_t due_us);

/* As struct sim_kind's give().  A packet that does not fit is lost: -EOVERFLOW. */
ssize_t ocean_endpoint_give(struct ocean_endpoint *endpoint, uint8_t *bytes, size_t size,
                            int64_t now_us, int64_t *due_us);

bool ocean_endpoint_empty(const struct ocean_endpoint *endpoint);
void ocean_endpoint_clear(struct ocean_endpoint *endpoint);

#endif
