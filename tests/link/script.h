/* script.h - a link that gives pieces of bytes as they are listed, for tests of what is above.
 *
 * A piece is one receive (cut to its size) of any channel; NULL in between is one silence, and
 * after the last there is silence for ever.  What was sent is kept. */
#ifndef SKINSPEC_TESTS_LINK_SCRIPT_H
#define SKINSPEC_TESTS_LINK_SCRIPT_H

#include <stdlib.h>
#include <string.h>

#include "drivers/link/link.h"

struct piece {
    const char *bytes; /* NULL: silence */
    size_t n;
};

struct script {
    struct link link;
    struct link_source source;
    const struct piece *pieces;
    size_t n, at, taken;
    enum driver_result ends_with; /* after the last; DRIVER_OK: silence */
    char sent[256];
    char begun[64];
    int closed;
};

static struct script script;

static enum driver_result script_send(struct link *link, uint8_t channel, const void *bytes,
                                      size_t n, int64_t deadline_ms, struct driver_error *error)
{
    (void)link, (void)channel, (void)deadline_ms, (void)error;
    strncat(script.sent, bytes, n);
    return DRIVER_OK;
}

static enum driver_result script_receive(struct link *link, uint8_t channel, void *bytes,
                                         size_t size, size_t *n, int64_t deadline_ms,
                                         struct driver_error *error)
{
    (void)channel;
    if (script.at < script.n && script.pieces[script.at].bytes != NULL) {
        const struct piece *piece = &script.pieces[script.at];
        size_t left = piece->n - script.taken, now = left < size ? left : size;
        memcpy(bytes, piece->bytes + script.taken, now);
        script.taken += now;
        if (script.taken == piece->n) {
            script.taken = 0;
            script.at++;
        }
        *n = now;
        return DRIVER_OK;
    }
    if (script.at < script.n)
        script.at++;
    else if (script.ends_with != DRIVER_OK)
        return driver_fail(error, script.ends_with, NULL, "as the script has it");
    if (call_wait(link->call, -1, deadline_ms) == CALL_CANCELLED)
        return driver_fail(error, DRIVER_CANCELLED, NULL, "cancelled");
    return driver_fail(error, DRIVER_TIMEOUT, NULL, "nothing came");
}

static void script_begin(struct link *link, const char *call)
{
    (void)link;
    strcpy(script.begun, call);
}

static int64_t script_realtime_s(struct link *link)
{
    (void)link;
    return 1700000000;
}

static void script_close(struct link *link)
{
    (void)link;
    script.closed++;
}

static const struct link_ops script_ops = {
    .kind = "script",
    .send = script_send,
    .receive = script_receive,
    .begin = script_begin,
    .realtime_s = script_realtime_s,
    .close = script_close,
};

static enum driver_result script_open(const struct link_source *source,
                                      const struct link_wanted *wanted, struct link **ret,
                                      struct driver_error *error)
{
    (void)source, (void)error;
    script.link.call = wanted->call;
    *ret = &script.link;
    return DRIVER_OK;
}

/* The link; call is its call. */
static struct link *script_start(struct call *call, const struct piece *pieces, size_t n)
{
    memset(&script, 0, sizeof script);
    script.link = (struct link){ &script_ops, call };
    script.source.open = script_open;
    script.pieces = pieces;
    script.n = n;
    return &script.link;
}

#endif
