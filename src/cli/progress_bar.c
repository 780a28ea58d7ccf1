/* progress_bar.c - "what [####    ] 40 %, 12 s left" and a flag set by signals. */
#include "cli/progress_bar.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const int stopping_signals[] = { SIGINT, SIGTERM, SIGHUP, SIGQUIT };
enum { SIGNALS = sizeof stopping_signals / sizeof *stopping_signals };

static volatile sig_atomic_t stopped_by;
static struct sigaction before[SIGNALS];

static void on_signal(int signal)
{
    stopped_by = signal;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void draw(const struct progress_bar *bar, size_t done, size_t total, double elapsed)
{
    enum { WIDTH = 30 };
    char cells[WIDTH + 1];
    double share = total > 0 ? (double)done / (double)total : 1.0;
    int filled = (int)(share * WIDTH);
    for (int i = 0; i < WIDTH; i++)
        cells[i] = i < filled ? '#' : ' ';
    cells[WIDTH] = '\0';
    fprintf(stderr, "\r%s [%s] %3.0f %%", bar->what, cells, 100.0 * share);
    if (done > 0 && done < total)
        fprintf(stderr, ", %.0f s left ", elapsed / share - elapsed);
    else
        fprintf(stderr, ", %.1f s      ", elapsed);
    fflush(stderr);
}

static bool report(void *context, size_t done, size_t total)
{
    struct progress_bar *bar = context;
    double t = now();
    /* What is over in a moment needs no bar; one that was begun is also finished. */
    bool due = bar->shown > 0.0 ? done == total || t - bar->shown >= 0.1 : t - bar->began >= 0.3;
    if (bar->terminal && due && total > 0) { /* of a pipe the end is not known */
        draw(bar, done, total, t - bar->began);
        bar->shown = t;
    }
    return stopped_by == 0;
}

struct progress progress_bar_begin_drawing(struct progress_bar *bar, const char *what)
{
    stopped_by = 0;
    *bar = (struct progress_bar){ what, isatty(STDERR_FILENO) == 1, now(), 0.0, false };
    return (struct progress){ report, bar };
}

struct progress progress_bar_begin(struct progress_bar *bar, const char *what)
{
    const struct progress progress = progress_bar_begin_drawing(bar, what);
    struct sigaction action = { .sa_handler = on_signal };
    sigemptyset(&action.sa_mask);
    bar->has_signals = true;
    for (int i = 0; i < SIGNALS; i++) {
        sigaction(stopping_signals[i], NULL, &before[i]);
        if (before[i].sa_handler != SIG_IGN) /* nohup stays nohup */
            sigaction(stopping_signals[i], &action, NULL);
    }
    return progress;
}

void progress_bar_end(struct progress_bar *bar)
{
    if (bar->terminal && bar->shown > 0.0)
        fputc('\n', stderr);
    if (!bar->has_signals)
        return;
    for (int i = 0; i < SIGNALS; i++)
        sigaction(stopping_signals[i], &before[i], NULL);
    if (stopped_by != 0)
        raise(stopped_by);
}
