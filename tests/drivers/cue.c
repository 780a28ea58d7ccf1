/* cue.c - a link that looks at what is sent, and passes everything on. */
#include "tests/drivers/cue.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct cued_link {
    struct link link;
    struct link *inner;
    struct cued_wire *cued;
};

void cue(struct cued_wire *cued, const char *command, unsigned on, const char *action)
{
    for (size_t i = 0; i < CUES_MAX; i++)
        if (cued->cue[i].on == 0) {
            cued->cue[i].command = command;
            cued->cue[i].on = on;
            snprintf(cued->cue[i].action, sizeof cued->cue[i].action, "%s", action);
            return;
        }
    abort(); /* too many cues: a mistake of the test */
}

static void look_at(struct cued_wire *cued, const char *bytes, size_t n)
{
    size_t shown = n < sizeof cued->said - 1 ? n : sizeof cued->said - 1;
    memcpy(cued->said, bytes, shown);
    cued->said[shown] = '\0';
    cued->said[strcspn(cued->said, "\r\n")] = '\0';
    cued->sends++;
    char name[8];
    snprintf(name, sizeof name, "%.3s", cued->said);
    if (cued->never != NULL && strlen(name) == 3 && strstr(cued->never, name) != NULL)
        cued->forbidden++;
    for (size_t i = 0; i < CUES_MAX; i++) {
        struct cue *c = &cued->cue[i];
        if (c->on == 0 || strncmp(cued->said, c->command, strlen(c->command)) != 0)
            continue;
        if (c->on != CUE_ALWAYS && --c->on > 0)
            continue;
        if (!wire_memory_act(cued->wire, c->action))
            abort(); /* no such action */
    }
}

static enum driver_result cued_send(struct link *link, uint8_t channel, const void *bytes, size_t n,
                                    int64_t deadline_ms, struct driver_error *error)
{
    struct cued_link *c = (struct cued_link *)link;
    look_at(c->cued, bytes, n);
    return c->inner->ops->send(c->inner, channel, bytes, n, deadline_ms, error);
}

static enum driver_result cued_receive(struct link *link, uint8_t channel, void *bytes, size_t size,
                                       size_t *n, int64_t deadline_ms, struct driver_error *error)
{
    struct cued_link *c = (struct cued_link *)link;
    return c->inner->ops->receive(c->inner, channel, bytes, size, n, deadline_ms, error);
}

static enum driver_result cued_drain(struct link *link, uint8_t channel, int quiet_ms,
                                     int64_t deadline_ms, struct driver_error *error)
{
    struct cued_link *c = (struct cued_link *)link;
    return c->inner->ops->drain(c->inner, channel, quiet_ms, deadline_ms, error);
}

static void cued_close(struct link *link)
{
    struct cued_link *c = (struct cued_link *)link;
    c->inner->ops->close(c->inner);
    free(c);
}

static const struct link_ops cued_ops = {
    .kind = "cued",
    .send = cued_send,
    .receive = cued_receive,
    .drain = cued_drain,
    .close = cued_close,
};

static enum driver_result cued_open(const struct link_source *source,
                                    const struct link_wanted *wanted, struct link **ret,
                                    struct driver_error *error)
{
    struct cued_wire *cued = (struct cued_wire *)(uintptr_t)source;
    const struct link_source *inner = wire_memory_source(cued->wire);
    struct cued_link *c = calloc(1, sizeof *c);
    if (c == NULL)
        return driver_fail(error, DRIVER_FAULT, NULL, "no memory");
    *c = (struct cued_link){ .link = { &cued_ops, wanted->call }, .cued = cued };
    enum driver_result r = inner->open(inner, wanted, &c->inner, error);
    if (r != DRIVER_OK) {
        free(c);
        return r;
    }
    *ret = &c->link;
    return DRIVER_OK;
}

void cued_wire_init(struct cued_wire *cued, struct wire_memory *wire)
{
    *cued = (struct cued_wire){ .source = { cued_open }, .wire = wire };
}
