/* rounds.h - what benches that go by turns share: this thread's own time, for others run on the
 * machine too, and the median of rounds. */
#ifndef SKINSPEC_TESTS_BENCH_ROUNDS_H
#define SKINSPEC_TESTS_BENCH_ROUNDS_H

#include <stdlib.h>
#include <time.h>

static inline double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static inline int rounds_compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of x[n], n >= 1, which is sorted by it. */
static inline double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, rounds_compare);
    return x[n / 2];
}

#endif
