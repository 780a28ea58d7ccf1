/* test_parallel.c - every piece once, whoever does it, and the first failure.
 *
 * The source is compiled into this test with threads that fail to start on
 * request; its object in the library is then not linked. */
#define _GNU_SOURCE /* sched_setaffinity */
#include <pthread.h>

static int threads_left = -1; /* -1: as many as asked for */
static int threads_started;

static int test_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                               void *(*run)(void *), void *argument)
{
    if (threads_left == 0)
        return 11; /* EAGAIN */
    if (threads_left > 0)
        threads_left--;
    threads_started++;
    return pthread_create(thread, attributes, run, argument);
}

#define pthread_create test_pthread_create
#include "base/parallel.c"
#undef pthread_create

#include <string.h>

#include "unity.h"

enum { PIECES = 1000 };

static struct work {
    pthread_mutex_t lock;
    unsigned threads;   /* as asked for */
    int times[PIECES];  /* how often each was run */
    bool beyond, crowd; /* a worker number out of range; one number used twice at a time */
    bool busy[PARALLEL_MAX_THREADS];
    size_t begun;
    size_t fails_from; /* pieces from here on fail, each with its own status */
} job_seen;

void setUp(void)
{
    threads_left = -1;
    threads_started = 0;
    memset(&job_seen, 0, sizeof job_seen);
    pthread_mutex_init(&job_seen.lock, NULL);
    job_seen.fails_from = PIECES;
}

void tearDown(void)
{
}

static enum status note_piece(size_t piece, unsigned number, void *context)
{
    struct work *w = context;
    volatile double busy = 1.0;
    pthread_mutex_lock(&w->lock);
    w->times[piece]++;
    w->begun++;
    w->beyond = w->beyond || number >= w->threads || number >= PARALLEL_MAX_THREADS;
    w->crowd = w->crowd || w->busy[number];
    w->busy[number] = true;
    pthread_mutex_unlock(&w->lock);
    for (int i = 0; i < 1000; i++)
        busy = busy * 1.0001;
    pthread_mutex_lock(&w->lock);
    w->busy[number] = false;
    pthread_mutex_unlock(&w->lock);
    if (piece < w->fails_from)
        return STATUS_OK;
    return piece % 2 == 0 ? STATUS_RANGE : STATUS_IO;
}

/* expect: all pieces once; threads no more than asked for, pieces, or the limit,
 * the calling one among them. */
static const struct run_case {
    const char *what;
    size_t pieces;
    unsigned threads;
    int started;
} run_cases[] = {
    { "nothing to do", 0, 4, 0 },
    { "nothing to do, alone", 0, 0, 0 },
    { "one piece needs one thread", 1, 8, 0 },
    { "alone", 100, 1, 0 },
    { "none asked for is alone", 100, 0, 0 },
    { "two", 1000, 2, 1 },
    { "seven", 1000, 7, 6 },
    { "as many as pieces", 5, 5, 4 },
    { "more than pieces", 5, 9, 4 },
    { "more than there may be", 1000, 1000, PARALLEL_MAX_THREADS - 1 },
    { "far more", 1000, (unsigned)-1, PARALLEL_MAX_THREADS - 1 },
};

static void test_every_piece_once(void)
{
    for (size_t i = 0; i < sizeof run_cases / sizeof *run_cases; i++) {
        const struct run_case *c = &run_cases[i];
        setUp();
        job_seen.threads = c->threads > 0 ? c->threads : 1;
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            STATUS_OK, parallel_run(c->pieces, c->threads, note_piece, &job_seen), c->what);
        for (size_t piece = 0; piece < PIECES; piece++)
            TEST_ASSERT_EQUAL_INT_MESSAGE(piece < c->pieces, job_seen.times[piece], c->what);
        TEST_ASSERT_FALSE_MESSAGE(job_seen.beyond, c->what);
        TEST_ASSERT_FALSE_MESSAGE(job_seen.crowd, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->started, threads_started, c->what);
    }
}

/* Of all that fail it is the lowest piece's status, on any number of threads; even
 * ones say STATUS_RANGE here, odd ones STATUS_IO.  Pieces far behind are not begun. */
static void test_lowest_failure_counts(void)
{
    static const unsigned threads[] = { 1, 2, 3, 7, 16 };
    for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
        for (size_t from = 0; from < 60; from++) {
            setUp();
            job_seen.threads = threads[i];
            job_seen.fails_from = from;
            TEST_ASSERT_EQUAL_INT(from % 2 == 0 ? STATUS_RANGE : STATUS_IO,
                                  parallel_run(PIECES, threads[i], note_piece, &job_seen));
            for (size_t piece = 0; piece <= from; piece++)
                TEST_ASSERT_EQUAL_INT(1, job_seen.times[piece]);
            TEST_ASSERT_TRUE(job_seen.begun <= from + threads[i]);
        }
    }
}

/* A failure is waited for: piece 1 fails at once, piece 0 later. */
static enum status slow_first(size_t piece, unsigned number, void *context)
{
    struct work *w = context;
    (void)number;
    if (piece == 1) {
        pthread_mutex_lock(&w->lock);
        w->begun = 1;
        pthread_mutex_unlock(&w->lock);
        return STATUS_IO;
    }
    for (bool second_failed = false; !second_failed;) {
        pthread_mutex_lock(&w->lock);
        second_failed = w->begun == 1;
        pthread_mutex_unlock(&w->lock);
    }
    return STATUS_RANGE;
}

static void test_lower_piece_that_fails_later(void)
{
    TEST_ASSERT_EQUAL_INT(STATUS_RANGE, parallel_run(2, 2, slow_first, &job_seen));
}

/* Threads that do not start leave the work to those that did. */
static void test_threads_that_do_not_start(void)
{
    for (int enough = 0; enough < 5; enough++) {
        setUp();
        threads_left = enough;
        job_seen.threads = 6;
        TEST_ASSERT_EQUAL_INT(STATUS_OK, parallel_run(PIECES, 6, note_piece, &job_seen));
        for (size_t piece = 0; piece < PIECES; piece++)
            TEST_ASSERT_EQUAL_INT(1, job_seen.times[piece]);
        TEST_ASSERT_EQUAL_INT(enough, threads_started);
        TEST_ASSERT_FALSE(job_seen.crowd);
    }
}

static void test_cores(void)
{
    unsigned cores = parallel_cores();
    TEST_ASSERT_TRUE(cores >= 1 && cores <= PARALLEL_MAX_THREADS);
    /* Bound to one core there is one. */
    cpu_set_t before, one;
    TEST_ASSERT_EQUAL_INT(0, sched_getaffinity(0, sizeof before, &before));
    CPU_ZERO(&one);
    for (size_t i = 0; i < CPU_SETSIZE; i++) {
        if (CPU_ISSET(i, &before)) {
            CPU_SET(i, &one);
            break;
        }
    }
    if (sched_setaffinity(0, sizeof one, &one) == 0)
        TEST_ASSERT_EQUAL_UINT(1, parallel_cores());
    TEST_ASSERT_EQUAL_INT(0, sched_setaffinity(0, sizeof before, &before));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_piece_once);
    RUN_TEST(test_lowest_failure_counts);
    RUN_TEST(test_lower_piece_that_fails_later);
    RUN_TEST(test_threads_that_do_not_start);
    RUN_TEST(test_cores);
    return UNITY_END();
}
