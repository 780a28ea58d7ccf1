/* test_job.c - queues and inbox, with threads that put while others take. */
#include "station/job.h"

#include <poll.h>
#include <stdlib.h>
#include <time.h>

#include "unity.h"

enum { PRODUCERS = 4, EACH = 2000 };

struct numbered {
    struct job job;
    int producer, number;
    int *done; /* counts up */
};

static struct job_queue queue;
static struct inbox inbox;

void setUp(void)
{
    job_queue_init(&queue);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, inbox_init(&inbox));
}

void tearDown(void)
{
    inbox_done(&inbox);
    job_queue_done(&queue);
}

static void count_done(struct job *job)
{
    ++*((struct numbered *)job)->done;
}

static bool readable(int fd)
{
    struct pollfd p = { .fd = fd, .events = POLLIN };
    return poll(&p, 1, 0) == 1;
}

/* ---- lists -------------------------------------------------------------------------- */

static void test_list_keeps_the_order(void)
{
    struct numbered n[3] = { { .number = 0 }, { .number = 1 }, { .number = 2 } };
    struct job_list list;
    job_list_init(&list);
    TEST_ASSERT_NULL(job_list_take(&list));
    job_list_add(&list, &n[0].job);
    job_list_add(&list, &n[1].job);
    TEST_ASSERT_EQUAL_PTR(&n[0], job_list_take(&list));
    job_list_add(&list, &n[2].job);
    TEST_ASSERT_EQUAL_size_t(2, list.n);
    TEST_ASSERT_EQUAL_PTR(&n[1], job_list_take(&list));
    TEST_ASSERT_EQUAL_PTR(&n[2], job_list_take(&list));
    TEST_ASSERT_NULL(job_list_take(&list));
    job_list_add(&list, &n[0].job); /* after it was empty */
    TEST_ASSERT_EQUAL_PTR(&n[0], job_list_take(&list));
}

/* ---- the queue ---------------------------------------------------------------------- */

static void *produce(void *context)
{
    struct numbered *jobs = context;
    for (int i = 0; i < EACH; i++)
        TEST_ASSERT_TRUE(job_queue_put(&queue, &jobs[i].job));
    return NULL;
}

/* Every job comes once, and those of one producer in their order. */
static void test_many_producers(void)
{
    struct numbered *jobs = calloc((size_t)PRODUCERS * EACH, sizeof *jobs);
    pthread_t thread[PRODUCERS];
    int next[PRODUCERS] = { 0 }, taken = 0;
    TEST_ASSERT_NOT_NULL(jobs);
    for (int p = 0; p < PRODUCERS; p++) {
        for (int i = 0; i < EACH; i++)
            jobs[p * EACH + i] = (struct numbered){ .producer = p, .number = i };
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread[p], NULL, produce, &jobs[p * EACH]));
    }
    while (taken < PRODUCERS * EACH) {
        struct numbered *n = (struct numbered *)job_queue_take(&queue, -1, NULL);
        TEST_ASSERT_EQUAL_INT(next[n->producer]++, n->number);
        taken++;
    }
    for (int p = 0; p < PRODUCERS; p++)
        pthread_join(thread[p], NULL);
    TEST_ASSERT_EQUAL_size_t(0, job_queue_length(&queue));
    free(jobs);
}

/* Behind what is there, in order; the list can be used again. */
static void test_all_at_once(void)
{
    struct numbered n[4] = { { .number = 0 }, { .number = 1 }, { .number = 2 }, { .number = 3 } };
    struct job_list some, none;
    job_list_init(&some);
    job_list_init(&none);
    job_list_add(&some, &n[1].job);
    job_list_add(&some, &n[2].job);
    TEST_ASSERT_TRUE(job_queue_put(&queue, &n[0].job));
    TEST_ASSERT_TRUE(job_queue_put_all(&queue, &some));
    TEST_ASSERT_TRUE(job_queue_put_all(&queue, &none));
    TEST_ASSERT_TRUE(some.n == 0 && some.first == NULL);
    job_list_add(&some, &n[3].job);
    TEST_ASSERT_TRUE(job_queue_put_all(&queue, &some));
    TEST_ASSERT_EQUAL_size_t(4, job_queue_length(&queue));
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_PTR(&n[i], job_queue_take(&queue, 0, NULL));
    job_queue_close(&queue);
    job_list_add(&some, &n[0].job);
    TEST_ASSERT_FALSE(job_queue_put_all(&queue, &some));
    TEST_ASSERT_EQUAL_PTR_MESSAGE(&n[0], job_list_take(&some), "not taken: still there");
}

static void test_closed_queue_gives_what_is_left(void)
{
    struct numbered n[2] = { { .number = 0 }, { .number = 1 } };
    struct job_list all;
    bool closed = true;
    TEST_ASSERT_TRUE(job_queue_put(&queue, &n[0].job));
    job_queue_close(&queue);
    TEST_ASSERT_FALSE(job_queue_put(&queue, &n[1].job));
    job_queue_take_all(&queue, -1, &closed, &all);
    TEST_ASSERT_EQUAL_size_t(1, all.n);
    TEST_ASSERT_FALSE(closed);
    TEST_ASSERT_EQUAL_PTR(&n[0], job_list_take(&all));
    job_queue_take_all(&queue, -1, &closed, &all);
    TEST_ASSERT_TRUE(closed && all.n == 0);
    TEST_ASSERT_NULL(job_queue_take(&queue, -1, &closed));
    TEST_ASSERT_TRUE(closed);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* expect: the time asked for, and ten times that on a busy machine. */
static void test_waiting_ends_in_time(void)
{
    static const int timeouts_ms[] = { 0, 30, 120 };
    for (size_t i = 0; i < sizeof timeouts_ms / sizeof *timeouts_ms; i++) {
        bool closed = true;
        double begun = seconds(), asked = 1e-3 * timeouts_ms[i];
        TEST_ASSERT_NULL(job_queue_take(&queue, timeouts_ms[i], &closed));
        TEST_ASSERT_FALSE(closed);
        TEST_ASSERT_TRUE(seconds() - begun >= asked * 0.99);
        TEST_ASSERT_TRUE(seconds() - begun < 10 * asked + 1.0);
    }
}

/* ---- the inbox ---------------------------------------------------------------------- */

static void test_inbox_is_readable_while_there_is_something(void)
{
    int done = 0;
    struct numbered n[3] = { { .done = &done }, { .done = &done }, { .done = &done } };
    struct job_list list;
    for (int i = 0; i < 3; i++)
        n[i].job.done = count_done;
    TEST_ASSERT_FALSE(readable(inbox.fd));
    TEST_ASSERT_FALSE(inbox_has_jobs(&inbox));
    inbox_put(&inbox, &n[0].job);
    job_list_init(&list);
    inbox_put_all(&inbox, &list); /* nothing */
    job_list_add(&list, &n[1].job);
    job_list_add(&list, &n[2].job);
    inbox_put_all(&inbox, &list);
    TEST_ASSERT_EQUAL_size_t(0, list.n);
    TEST_ASSERT_TRUE(readable(inbox.fd));
    TEST_ASSERT_TRUE(inbox_has_jobs(&inbox));
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT(3, done);
    TEST_ASSERT_FALSE(readable(inbox.fd));
    inbox_drain(&inbox); /* nothing to do is fine */
    TEST_ASSERT_EQUAL_INT(3, done);
}

static void put_again(struct job *job)
{
    struct numbered *n = (struct numbered *)job;
    if (++*n->done < 3)
        inbox_put(&inbox, job);
}

/* What done() puts is for the next drain: the loop has its turn between. */
static void test_done_may_put(void)
{
    int done = 0;
    struct numbered n = { .job.done = put_again, .done = &done };
    inbox_put(&inbox, &n.job);
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT(1, done);
    TEST_ASSERT_TRUE(readable(inbox.fd));
    inbox_drain(&inbox);
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT(3, done);
    TEST_ASSERT_FALSE(readable(inbox.fd));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_list_keeps_the_order);
    RUN_TEST(test_many_producers);
    RUN_TEST(test_all_at_once);
    RUN_TEST(test_closed_queue_gives_what_is_left);
    RUN_TEST(test_waiting_ends_in_time);
    RUN_TEST(test_inbox_is_readable_while_there_is_something);
    RUN_TEST(test_done_may_put);
    return UNITY_END();
}
