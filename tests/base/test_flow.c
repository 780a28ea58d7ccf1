/* test_flow.c - pieces in their order, however long each takes and whatever fails. */
#include "base/flow.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <time.h>

#include "base/parallel.h"
#include "unity.h"

enum { MOST = 400 };

struct line {
    size_t pieces;      /* there are */
    size_t fails_after; /* give() does, after so many */
    size_t taken, given;
    size_t piece[4 * PARALLEL_MAX_THREADS]; /* of a slot */
    size_t result[4 * PARALLEL_MAX_THREADS];
    size_t order[MOST];
    atomic_int taking, giving, at_work[PARALLEL_MAX_THREADS];
    atomic_bool stopped;
    bool overlaps, waits_at_end;
};

void setUp(void)
{
}

void tearDown(void)
{
}

static void rest(long us)
{
    const struct timespec t = { 0, 1000 * us };
    nanosleep(&t, NULL);
}

static enum status take(void *context, size_t slot)
{
    struct line *l = context;
    l->overlaps = atomic_fetch_add(&l->taking, 1) != 0 || l->overlaps;
    enum status s = l->taken < l->pieces ? STATUS_OK : STATUS_NOT_FOUND;
    while (s == STATUS_NOT_FOUND && l->waits_at_end && !atomic_load(&l->stopped))
        rest(100); /* a pipe with nothing in it */
    if (s == STATUS_OK)
        l->piece[slot] = l->taken++;
    atomic_fetch_sub(&l->taking, 1);
    return s;
}

static void work(void *context, size_t slot, unsigned worker)
{
    struct line *l = context;
    size_t piece = l->piece[slot];
    if (atomic_fetch_add(&l->at_work[worker], 1) != 0)
        l->overlaps = true;
    rest(piece % 7 == 0 ? 900 : 30 * (long)(piece % 5));
    l->result[slot] = 3 * piece + 1;
    atomic_fetch_sub(&l->at_work[worker], 1);
}

static enum status give(void *context, size_t slot)
{
    struct line *l = context;
    l->overlaps = atomic_fetch_add(&l->giving, 1) != 0 || l->overlaps;
    l->order[l->given++] = l->result[slot];
    atomic_fetch_sub(&l->giving, 1);
    return l->given == l->fails_after ? STATUS_IO : STATUS_OK;
}

static void stop(void *context)
{
    struct line *l = context;
    atomic_store(&l->stopped, true);
}

static enum status run(struct line *l, unsigned threads)
{
    const struct flow flow = { take, work, give, stop, l };
    return flow_run(&flow, threads);
}

static const unsigned threads[] = { 1, 2, 3, 8 };

static void assert_in_order(const struct line *l, size_t n)
{
    TEST_ASSERT_EQUAL_size_t(n, l->given);
    for (size_t i = 0; i < n; i++)
        TEST_ASSERT_EQUAL_size_t(3 * i + 1, l->order[i]);
    TEST_ASSERT_FALSE(l->overlaps);
}

static void test_order(void)
{
    for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
        struct line line = { .pieces = MOST };
        TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, run(&line, threads[i]));
        assert_in_order(&line, MOST);
    }
}

static void test_nothing_to_do(void)
{
    struct line line = { .pieces = 0 };
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, run(&line, 4));
    TEST_ASSERT_EQUAL_size_t(0, line.given);
}

/* No more is given, and its status is what counts. */
static void test_a_give_that_fails(void)
{
    for (size_t i = 0; i < sizeof threads / sizeof *threads; i++) {
        struct line line = { .pieces = MOST, .fails_after = 50 };
        TEST_ASSERT_EQUAL_INT(STATUS_IO, run(&line, threads[i]));
        assert_in_order(&line, 50);
        TEST_ASSERT_LESS_OR_EQUAL_size_t(50 + flow_slots(threads[i]), line.taken);
    }
}

static void test_the_last_give_fails(void)
{
    struct line line = { .pieces = 20, .fails_after = 20 };
    TEST_ASSERT_EQUAL_INT(STATUS_IO, run(&line, 3));
    assert_in_order(&line, 20);
}

/* A thread that waits for more is told that there is no need. */
static void test_a_take_that_waits_is_stopped(void)
{
    struct line line = { .pieces = 3, .fails_after = 2, .waits_at_end = true };
    TEST_ASSERT_EQUAL_INT(STATUS_IO, run(&line, 3));
    TEST_ASSERT_EQUAL_size_t(2, line.given);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_order);
    RUN_TEST(test_nothing_to_do);
    RUN_TEST(test_a_give_that_fails);
    RUN_TEST(test_the_last_give_fails);
    RUN_TEST(test_a_take_that_waits_is_stopped);
    return UNITY_END();
}
