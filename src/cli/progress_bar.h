/* progress_bar.h - long work shown on the terminal, and stopped by its keys.
 *
 * The bar goes to standard error and only where that is a terminal.  Ctrl-C,
 * SIGTERM, SIGHUP and SIGQUIT make the next report return false; once the work has tidied
 * up, progress_bar_end() lets the signal take its usual course. */
#ifndef SKINSPEC_CLI_PROGRESS_BAR_H
#define SKINSPEC_CLI_PROGRESS_BAR_H

#include <stdbool.h>

#include "base/progress.h"

struct progress_bar {
    const char *what; /* "table-two-layer.db" */
    bool terminal;
    double began, shown; /* seconds, monotonic */
    bool has_signals;
};

/* The progress to hand to the work.  One bar at a time: signals are the process's. */
struct progress progress_bar_begin(struct progress_bar *bar, const char *what);

/* The same for work that sees to signals itself: its reports return true. */
struct progress progress_bar_begin_drawing(struct progress_bar *bar, const char *what);

void progress_bar_end(struct progress_bar *bar);

#endif
