/* fault.c - between a link and its driver: a queue of bytes that come, and what spoils it. */
#include "drivers/link/fault.h"

#include <stdlib.h>
#include <string.h>

#include "drivers/link/kinds.h"

/* A byte on its way to the driver. */
struct coming {
    uint8_t byte;
    bool alone;    /* a receive ends before it */
    int64_t at_ms; /* not before */
};

struct faulty {
    struct link link;
    struct link *inner;
    struct fault_source *source;
    struct coming *queue;
    size_t queued, room;
    uint8_t *reply; /* of the reply that is to be duplicated */
    size_t reply_n, reply_room;
    bool duplicate, truncate, dribble, closed;
    int64_t not_before_ms; /* of all that comes */
};

/* ---- the queue ---------------------------------------------------------------------- */

/* Tests alone use this: without memory they end. */
static void *grown(void *memory, size_t n, size_t *room, size_t size)
{
    if (n < *room)
        return memory;
    *room = *room > 0 ? *room * 2 : 256;
    memory = realloc(memory, *room * size);
    if (memory == NULL)
        abort();
    return memory;
}

static void enqueue(struct faulty *faulty, uint8_t byte, bool alone)
{
    faulty->queue = grown(faulty->queue, faulty->queued, &faulty->room, sizeof *faulty->queue);
    faulty->queue[faulty->queued++] =
        (struct coming){ byte, alone || faulty->dribble, faulty->not_before_ms };
    if (faulty->dribble)
        faulty->not_before_ms += faulty->source->fault.delay_ms;
}

static void keep_for_duplicate(struct faulty *faulty, uint8_t byte)
{
    faulty->reply = grown(faulty->reply, faulty->reply_n, &faulty->reply_room, 1);
    faulty->reply[faulty->reply_n++] = byte;
}

/* Nothing more of this reply comes. */
static void end_reply(struct faulty *faulty)
{
    if (faulty->duplicate)
        for (size_t i = 0; i < faulty->reply_n; i++)
            enqueue(faulty, faulty->reply[i], i == 0);
    faulty->reply_n = 0;
    faulty->duplicate = false;
}

/* ---- the fault ---------------------------------------------------------------------- */

static bool is_here(const struct fault_source *source)
{
    return !source->happened && source->fault.kind != FAULT_NONE &&
           (source->fault.reply == 0 || source->fault.reply == source->replies) &&
           source->bytes >= source->fault.byte;
}

/* Before the byte; true where it is lost. */
static bool strike(struct faulty *faulty, uint8_t *byte, bool *alone)
{
    struct fault_source *source = faulty->source;
    const struct fault *fault = &source->fault;
    int64_t now_ms = call_now_ms();
    source->happened = fault->kind != FAULT_DROP || source->bytes + 1 >= fault->byte + fault->count;
    switch (fault->kind) {
    case FAULT_DROP:
        return true;
    case FAULT_FLIP:
        *byte ^= fault->mask;
        return false;
    case FAULT_SPLIT:
        *alone = true;
        return false;
    case FAULT_DRIBBLE:
        faulty->dribble = true;
        faulty->not_before_ms = now_ms + fault->delay_ms;
        return false;
    case FAULT_DELAY:
        faulty->not_before_ms = now_ms + fault->delay_ms;
        return false;
    case FAULT_GARBAGE:
        for (size_t i = 0; i < fault->count; i++)
            enqueue(faulty, (uint8_t)(0xf1 + i % 15), false);
        return false;
    case FAULT_DUPLICATE:
        faulty->duplicate = true;
        return false;
    case FAULT_TRUNCATE:
        faulty->truncate = true;
        return true;
    case FAULT_CLOSE:
        faulty->closed = true;
        return true;
    case FAULT_NONE:
        break;
    }
    return false;
}

static void let_through(struct faulty *faulty, const uint8_t *bytes, size_t n)
{
    for (size_t i = 0; i < n && !faulty->truncate && !faulty->closed; i++) {
        uint8_t byte = bytes[i];
        bool alone = false, lost = is_here(faulty->source) && strike(faulty, &byte, &alone);
        faulty->source->bytes++;
        keep_for_duplicate(faulty, byte);
        if (!lost)
            enqueue(faulty, byte, alone);
    }
}

/* ---- the link ----------------------------------------------------------------------- */

static enum driver_result fail_gone(struct driver_error *error)
{
    return driver_fail(error, DRIVER_GONE, NULL, "the instrument is gone: connect it again");
}

static enum driver_result faulty_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct faulty *faulty = (struct faulty *)link;
    struct fault_source *source = faulty->source;
    if (faulty->closed)
        return fail_gone(error);
    end_reply(faulty);
    faulty->truncate = false;
    source->replies++;
    if (source->fault.reply != 0)
        source->bytes = 0;
    return link_send(faulty->inner, channel, bytes, n, deadline_ms, error);
}

/* What is due of the queue, up to a byte that comes alone. */
static size_t dequeue(struct faulty *faulty, uint8_t *bytes, size_t size)
{
    int64_t now_ms = call_now_ms();
    size_t n = 0;
    while (n < size && n < faulty->queued && faulty->queue[n].at_ms <= now_ms &&
           (n == 0 || !faulty->queue[n].alone)) {
        bytes[n] = faulty->queue[n].byte;
        n++;
    }
    faulty->queued -= n;
    if (n > 0)
        memmove(faulty->queue, faulty->queue + n, faulty->queued * sizeof *faulty->queue);
    return n;
}

static int64_t sooner(int64_t a_ms, int64_t b_ms)
{
    return a_ms < b_ms ? a_ms : b_ms;
}

static enum driver_result wait_until(struct faulty *faulty, int64_t at_ms, int64_t deadline_ms,
                                     struct driver_error *error)
{
    if (call_wait(faulty->link.call, -1, sooner(at_ms, deadline_ms)) == CALL_CANCELLED)
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    if (at_ms > deadline_ms)
        return driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing came");
    return DRIVER_OK;
}

static enum driver_result receive_inner(struct faulty *faulty, uint8_t channel, size_t size,
                                        int64_t deadline_ms, bool *empty,
                                        struct driver_error *error)
{
    size_t n = 0;
    uint8_t *bytes = calloc(1, size > 0 ? size : 1);
    if (bytes == NULL)
        abort();
    enum driver_result r =
        link_receive(faulty->inner, channel, bytes, size, &n, deadline_ms, error);
    *empty = r == DRIVER_OK && n == 0;
    if (r == DRIVER_OK)
        let_through(faulty, bytes, n);
    free(bytes);
    return r;
}

static enum driver_result faulty_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    struct faulty *faulty = (struct faulty *)link;
    for (;;) {
        enum driver_result r;
        size_t got = dequeue(faulty, bytes, size);
        bool empty = false;
        if (got > 0) {
            *n = got;
            return DRIVER_OK;
        }
        if (faulty->queued > 0)
            r = wait_until(faulty, faulty->queue[0].at_ms, deadline_ms, error);
        else if (faulty->closed)
            return fail_gone(error);
        else
            r = receive_inner(faulty, channel, size, deadline_ms, &empty, error);
        if (r == DRIVER_TIMEOUT && faulty->queued == 0) {
            end_reply(faulty);
            if (faulty->queued > 0)
                continue; /* the duplicate came instead of silence */
        }
        if (r != DRIVER_OK)
            return r;
        if (empty) { /* a transfer of no bytes */
            *n = 0;
            return DRIVER_OK;
        }
    }
}

static void faulty_begin(struct link *link, const char *call)
{
    struct faulty *faulty = (struct faulty *)link;
    if (faulty->inner->ops->begin != NULL)
        faulty->inner->ops->begin(faulty->inner, call);
}

static int64_t faulty_realtime_s(struct link *link)
{
    return link_realtime_s(((struct faulty *)link)->inner);
}

static void faulty_close(struct link *link)
{
    struct faulty *faulty = (struct faulty *)link;
    link_close(faulty->inner);
    free(faulty->queue);
    free(faulty->reply);
    free(faulty);
}

static const struct link_ops faulty_ops = {
    .kind = "fault",
    .send = faulty_send,
    .receive = faulty_receive,
    .drain = link_drain_by_receiving, /* through the fault */
    .begin = faulty_begin,
    .realtime_s = faulty_realtime_s,
    .close = faulty_close,
};

static enum driver_result fault_open(const struct link_source *source,
                                     const struct link_wanted *wanted, struct link **ret,
                                     struct driver_error *error)
{
    /* The source is the caller's own and not const: it counts. */
    struct fault_source *of = (struct fault_source *)source;
    struct link *inner;
    enum driver_result r = of->wire->open(of->wire, wanted, &inner, error);
    if (r != DRIVER_OK)
        return r;
    struct faulty *faulty = calloc(1, sizeof *faulty);
    if (faulty == NULL) {
        link_close(inner);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    }
    faulty->link = (struct link){ &faulty_ops, wanted->call };
    faulty->inner = inner;
    faulty->source = of;
    *ret = &faulty->link;
    return DRIVER_OK;
}

void fault_source_init(struct fault_source *source, const struct link_source *wire,
                       struct fault fault)
{
    *source = (struct fault_source){ .source = { fault_open }, .wire = wire, .fault = fault };
}
