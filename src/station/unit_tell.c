/* unit_tell.c - what happens to an instrument, on its way to the loop's thread. */
#include "station/unit_private.h"

#include <stdlib.h>

#include "base/log.h"

/* An event on its way: it outlives the unit. */
struct notice {
    struct job job;
    struct unit_events to;
    struct driver_identity identity;
    struct driver_status status;
    struct driver_error error;
    uint64_t connection;
};

static void deliver_opened(struct job *job)
{
    struct notice *n = (struct notice *)job;
    n->to.opened(n->to.context, &n->identity, &n->status, n->connection);
    free(n);
}

static void deliver_lost(struct job *job)
{
    struct notice *n = (struct notice *)job;
    n->to.lost(n->to.context, &n->error);
    free(n);
}

static void deliver_button(struct job *job)
{
    struct notice *n = (struct notice *)job;
    n->to.button(n->to.context);
    free(n);
}

static void deliver_status(struct job *job)
{
    struct notice *n = (struct notice *)job;
    n->to.status(n->to.context, &n->status);
    free(n);
}

/* Through one of the functions above; error may be NULL.  False: it is lost, for want of memory. */
static bool tell(struct unit *u, void (*how)(struct job *job), const struct driver_error *error)
{
    struct notice *n = calloc(1, sizeof *n);
    if (n == NULL) {
        log_error("unit: not enough memory to tell what happened to '%s'", u->driver->name);
        return false;
    }
    n->job.done = how;
    n->to = u->events;
    n->identity = u->identity;
    n->status = u->told;
    n->connection = u->connection;
    if (error != NULL)
        n->error = *error;
    inbox_put(u->inbox, &n->job);
    return true;
}

bool unit_tell_opened(struct unit *u)
{
    return tell(u, deliver_opened, NULL);
}

void unit_tell_lost(struct unit *u, const struct driver_error *error)
{
    (void)tell(u, deliver_lost, error);
}

void unit_tell_button(struct unit *u)
{
    (void)tell(u, deliver_button, NULL);
}

void unit_tell_status(struct unit *u)
{
    (void)tell(u, deliver_status, NULL);
}
