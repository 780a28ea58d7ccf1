/* record.c - another link, every byte both ways written to a capture. */
#include <stdio.h>
#include <stdlib.h>

#include "drivers/link/kinds.h"

struct record {
    struct link link;
    struct link *inner;
    struct capture *capture;
};

static struct record *record_of(struct link *link)
{
    return (struct record *)link;
}

static void write_failure(struct record *record, enum driver_result result)
{
    char event[64];
    snprintf(event, sizeof event, "! %s", driver_result_name(result));
    capture_event(record->capture, event);
}

static enum driver_result record_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    struct record *record = record_of(link);
    enum driver_result r = link_send(record->inner, channel, bytes, n, deadline_ms, error);
    if (r == DRIVER_OK)
        capture_bytes(record->capture, '>', channel, bytes, n);
    else
        write_failure(record, r);
    return r;
}

static enum driver_result record_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    struct record *record = record_of(link);
    enum driver_result r = link_receive(record->inner, channel, bytes, size, n, deadline_ms, error);
    if (r == DRIVER_OK)
        capture_bytes(record->capture, '<', channel, bytes, *n);
    else if (r == DRIVER_TIMEOUT)
        capture_bytes(record->capture, '~', channel, NULL, 0);
    else
        write_failure(record, r);
    return r;
}

static void record_begin(struct link *link, const char *call)
{
    struct record *record = record_of(link);
    capture_call(record->capture, call);
    if (record->inner->ops->begin != NULL)
        record->inner->ops->begin(record->inner, call);
}

static int64_t record_realtime_s(struct link *link)
{
    struct record *record = record_of(link);
    int64_t now_s = link_realtime_s(record->inner);
    capture_clock(record->capture, now_s);
    return now_s;
}

static void record_close(struct link *link)
{
    struct record *record = record_of(link);
    link_close(record->inner);
    free(record);
}

static const struct link_ops record_ops = {
    .kind = "record",
    .send = record_send,
    .receive = record_receive,
    .drain = link_drain_by_receiving, /* so that what is thrown away is in the capture */
    .begin = record_begin,
    .realtime_s = record_realtime_s,
    .close = record_close,
};

enum driver_result link_record(struct link *inner, struct capture *capture, struct link **ret,
                               struct driver_error *error)
{
    char event[64];
    struct record *record = malloc(sizeof *record);
    if (record == NULL) {
        link_close(inner);
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    }
    *record = (struct record){ { &record_ops, inner->call }, inner, capture };
    snprintf(event, sizeof event, "open %s", inner->ops->kind);
    capture_event(capture, event);
    *ret = &record->link;
    return DRIVER_OK;
}
