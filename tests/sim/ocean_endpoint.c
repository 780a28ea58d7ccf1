#include "tests/sim/ocean_endpoint.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

struct ocean_bytes {
    struct ocean_bytes *next;
    int64_t due_us;
    int error; /* 0 or -errno instead of bytes */
    size_t n, given;
    uint8_t bytes[];
};

static void put(struct ocean_endpoint *endpoint, const void *bytes, size_t n, int error,
                int64_t due_us)
{
    struct ocean_bytes *more = calloc(1, sizeof *more + n);
    if (more == NULL)
        abort();
    more->due_us = due_us;
    more->error = error;
    more->n = n;
    if (n > 0)
        memcpy(more->bytes, bytes, n);
    if (endpoint->last != NULL)
        endpoint->last->next = more;
    else
        endpoint->first = more;
    endpoint->last = more;
}

void ocean_endpoint_put(struct ocean_endpoint *endpoint, const void *bytes, size_t n,
                        int64_t due_us)
{
    if (n > 0)
        put(endpoint, bytes, n, 0, due_us);
}

void ocean_endpoint_put_error(struct ocean_endpoint *endpoint, int error, int64_t due_us)
{
    put(endpoint, NULL, 0, error, due_us);
}

static void drop_first(struct ocean_endpoint *endpoint)
{
    struct ocean_bytes *first = endpoint->first;
    endpoint->first = first->next;
    if (endpoint->first == NULL)
        endpoint->last = NULL;
    free(first);
}

ssize_t ocean_endpoint_give(struct ocean_endpoint *endpoint, uint8_t *bytes, size_t size,
                            int64_t now_us, int64_t *due_us)
{
    size_t n = 0;
    bool short_packet = false;
    *due_us = INT64_MAX;
    while (!endpoint->silent && endpoint->first != NULL && n < size && !short_packet) {
        struct ocean_bytes *first = endpoint->first;
        if (first->due_us > now_us) {
            *due_us = first->due_us;
            break;
        }
        if (first->error != 0) {
            if (n > 0)
                break; /* the next transfer's */
            int error = first->error;
            drop_first(endpoint);
            return error;
        }
        size_t left = first->n - first->given;
        size_t packet = left < endpoint->packet ? left : endpoint->packet;
        bool fits = packet <= size - n;
        if (fits)
            memcpy(bytes + n, first->bytes + first->given, packet);
        first->given += packet;
        if (first->given == first->n)
            drop_first(endpoint);
        if (!fits)
            return -EOVERFLOW;
        n += packet;
        short_packet = packet < endpoint->packet;
    }
    return (ssize_t)n;
}

bool ocean_endpoint_empty(const struct ocean_endpoint *endpoint)
{
    return endpoint->first == NULL;
}

void ocean_endpoint_clear(struct ocean_endpoint *endpoint)
{
    while (endpoint->first != NULL)
        drop_first(endpoint);
}
