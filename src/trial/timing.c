/* timing.c - groups of items by a clock, less what reading the clock takes. */
#include "trial/timing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define GROUP_US 1.0  /* fifty times what reading the clock takes */
#define LONG_US 100.0 /* the clock of a thread takes 0.3 to be read */
enum { GROUPS_MIN = 8, ITEMS_A_GROUP_MAX = 16, LOOKS = 5 };

static double now_us(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* x[n] is put in order. */
static double quantile(double *x, size_t n, double share)
{
    qsort(x, n, sizeof *x, compare);
    double place = share * (double)(n - 1);
    size_t i = (size_t)place;
    double rest = place - (double)i;
    return i + 1 < n ? x[i] + rest * (x[i + 1] - x[i]) : x[n - 1];
}

/* What reading the clock takes. */
static double reading_us(clockid_t clock)
{
    double x[101];
    for (size_t i = 0; i < sizeof x / sizeof *x; i++) {
        double begin = now_us(clock);
        x[i] = now_us(clock) - begin;
    }
    return quantile(x, sizeof x / sizeof *x, 0.5);
}

enum status trial_timing_init(trial_work *work, const void *context, size_t items, size_t rounds,
                              double budget_us, struct trial_timing *ret)
{
    struct trial_timing t = { .work = work, .context = context, .rounds = rounds };
    double look[LOOKS], reading = reading_us(CLOCK_THREAD_CPUTIME_ID);
    for (size_t i = 0; i < LOOKS; i++) {
        double begin = now_us(CLOCK_THREAD_CPUTIME_ID);
        enum status s = work(context, i % items);
        if (s != STATUS_OK)
            return s;
        look[i] = fmax(now_us(CLOCK_THREAD_CPUTIME_ID) - begin - reading, 1e-3);
    }
    double us = quantile(look, LOOKS, 0.5);
    t.group = (size_t)fmin(fmax(ceil(GROUP_US / us), 1.0), ITEMS_A_GROUP_MAX);
    t.group = t.group > items ? items : t.group;
    t.clock = us * (double)t.group < LONG_US ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID;
    t.groups = items / t.group;
    double room = floor(budget_us / (us * (double)t.group));
    if (room < (double)t.groups)
        t.groups = room > GROUPS_MIN ? (size_t)room : t.groups < GROUPS_MIN ? t.groups : GROUPS_MIN;
    t.us = calloc(t.groups * rounds, sizeof *t.us);
    if (t.us == NULL)
        return STATUS_NO_MEMORY;
    *ret = t;
    return STATUS_OK;
}

void trial_timing_done(struct trial_timing *timing)
{
    free(timing->us);
    memset(timing, 0, sizeof *timing);
}

enum status trial_timing_round(struct trial_timing *t)
{
    double reading = reading_us(t->clock);
    for (size_t g = 0; g < t->groups; g++) {
        double begin = now_us(t->clock);
        for (size_t i = 0; i < t->group; i++) {
            enum status s = t->work(t->context, g * t->group + i);
            if (s != STATUS_OK)
                return s;
        }
        t->us[g * t->rounds + t->done] = (now_us(t->clock) - begin - reading) / (double)t->group;
    }
    t->done++;
    return STATUS_OK;
}

void trial_timing_again(struct trial_timing *timing)
{
    timing->done = 0;
}

void trial_timing_result(const struct trial_timing *t, double *us, double *us_p95)
{
    double *of = calloc(t->groups, sizeof *of), *round = calloc(t->done, sizeof *round);
    *us = *us_p95 = NAN;
    if (of != NULL && round != NULL && t->done > 0) {
        for (size_t g = 0; g < t->groups; g++) {
            memcpy(round, &t->us[g * t->rounds], t->done * sizeof *round);
            of[g] = quantile(round, t->done, 0.5);
        }
        *us = quantile(of, t->groups, 0.5);
        *us_p95 = quantile(of, t->groups, 0.95);
    }
    free(of);
    free(round);
}
