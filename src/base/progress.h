/* progress.h - how long work tells where it is, and is told to stop. */
#ifndef SKINSPEC_BASE_PROGRESS_H
#define SKINSPEC_BASE_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

/* Called now and then on the thread that asked for the work; return false to stop
 * it (it then gives STATUS_CANCELLED and leaves nothing half done). */
typedef bool progress_report(void *context, size_t done, size_t total);

struct progress {
    progress_report *report; /* NULL: work in silence */
    void *context;
};

static inline bool progress_go_on(const struct progress *p, size_t done, size_t total)
{
    return p == NULL || p->report == NULL || p->report(p->context, done, total);
}

#endif
