/* test_call.c - waiting, being woken, and whom a cancellation reaches. */
#include "drivers/call.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "tests/support/dice.h"
#include "tests/support/patience.h"
#include "unity.h"

static struct call call;
static int ends[2];

void setUp(void)
{
    TEST_ASSERT_TRUE(call_init(&call));
    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
}

void tearDown(void)
{
    close(ends[0]);
    close(ends[1]);
    call_done(&call);
}

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ .tv_nsec = ms * 1000000 }, NULL);
}

static void test_deadline(void)
{
    static const int64_t in_ms[] = { -1000, 0, 1, 30, 120 };
    call_begin(&call);
    for (size_t i = 0; i < sizeof in_ms / sizeof *in_ms; i++) {
        int64_t began_ms = call_now_ms();
        TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, ends[0], began_ms + in_ms[i]));
        TEST_ASSERT_TRUE(call_now_ms() >= began_ms + in_ms[i]);
        TEST_ASSERT_TRUE(call_now_ms() <= began_ms + (in_ms[i] > 0 ? in_ms[i] : 0) + SLACK_MS);
    }
}

static void test_readable(void)
{
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(1, write(ends[1], "x", 1));
    TEST_ASSERT_EQUAL_INT(CALL_READABLE, call_wait(&call, ends[0], INT64_MAX));
    TEST_ASSERT_EQUAL_INT(CALL_READABLE, call_wait(&call, ends[0], 0));
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));
}

/* Unplugged: a read will say so. */
static void test_closed_at_the_other_end_is_readable(void)
{
    call_begin(&call);
    close(ends[1]);
    TEST_ASSERT_EQUAL_INT(CALL_READABLE, call_wait(&call, ends[0], INT64_MAX));
    ends[1] = dup(ends[0]);
}

static void test_cancel_reaches_the_call_in_progress_only(void)
{
    call_cancel(&call); /* none in progress */
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(1, write(ends[1], "x", 1));
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, ends[0], INT64_MAX));
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, INT64_MAX)); /* and stays so */
    call_cancel(&call);
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, call_now_ms() + 20));
}

/* A wait for the button forgets nothing, and uses up what ends it. */
static void test_cancel_before_a_wait_ends_it(void)
{
    call_cancel(&call);
    call_cancel(&call);
    call_begin_waiting(&call);
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, INT64_MAX));
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, INT64_MAX)); /* stays so */
    call_begin_waiting(&call);
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));

    call_cancel(&call);
    call_begin(&call); /* another call came between */
    call_begin_waiting(&call);
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));

    call_begin(&call);
    call_cancel(&call);
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, 0));
    call_begin_waiting(&call); /* it ended that one */
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));

    call_begin(&call);
    call_cancel(&call); /* that call's answer was there: it does not look again */
    call_begin_waiting(&call);
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, INT64_MAX));
}

static void *cancel_soon(void *unused)
{
    (void)unused;
    sleep_ms(50);
    call_cancel(&call);
    return NULL;
}

static void test_cancel_from_another_thread(void)
{
    pthread_t thread;
    int64_t began_ms = call_now_ms();
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_soon, NULL));
    TEST_ASSERT_EQUAL_INT(CALL_CANCELLED, call_wait(&call, -1, began_ms + 60000));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= 50 + SLACK_MS);
    pthread_join(thread, NULL);
}

static void ignore_signal(int number)
{
    (void)number;
}

static void *interrupt(void *waiting)
{
    for (int i = 0; i < 5; i++) {
        sleep_ms(10);
        pthread_kill(*(pthread_t *)waiting, SIGUSR1);
    }
    return NULL;
}

static void test_signals_do_not_end_a_wait(void)
{
    struct sigaction action = { .sa_handler = ignore_signal };
    pthread_t self = pthread_self(), thread;
    sigaction(SIGUSR1, &action, NULL); /* without SA_RESTART: poll() gives EINTR */
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, interrupt, &self));
    int64_t until_ms = call_now_ms() + 150;
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, until_ms));
    TEST_ASSERT_TRUE(call_now_ms() >= until_ms);
    pthread_join(thread, NULL);
}

/* Property: with calls and cancellations at random, a call that begins after the last
 * cancellation has returned is never cancelled. */
static atomic_bool stop;

static void *cancel_always(void *unused)
{
    (void)unused;
    while (!atomic_load(&stop))
        call_cancel(&call);
    return NULL;
}

static void test_many_cancellations_at_random(void)
{
    pthread_t thread;
    int cancelled = 0;
    atomic_store(&stop, false);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_always, NULL));
    for (int i = 0; i < 2000; i++) {
        call_begin(&call);
        cancelled += call_wait(&call, -1, 0) == CALL_CANCELLED;
    }
    atomic_store(&stop, true);
    pthread_join(thread, NULL);
    call_begin(&call);
    TEST_ASSERT_EQUAL_INT(CALL_DEADLINE, call_wait(&call, -1, 0));
    TEST_ASSERT_TRUE(cancelled <= 2000);
}

/* Property: each cancellation ends a wait, whether it comes before, at, or after its
 * beginning; one that was lost would leave us here. */
static atomic_int rounds_begun, rounds_cancelled;

static void *cancel_each_round(void *dice)
{
    for (int i = 1; !atomic_load(&stop); i++) {
        while (atomic_load(&rounds_begun) < i && !atomic_load(&stop))
            sched_yield();
        for (size_t spin = dice_below(dice, 400); spin > 0; spin--)
            atomic_load(&stop);
        atomic_store(&rounds_cancelled, i);
        call_cancel(&call);
    }
    return NULL;
}

static void test_no_cancellation_misses_a_wait(void)
{
    enum { ROUNDS = 3000 };
    pthread_t thread;
    struct dice dice = { 7 }, theirs = { 8 };
    atomic_store(&stop, false);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, cancel_each_round, &theirs));
    int ended = 0;
    for (int i = 1; i <= ROUNDS; i++) {
        atomic_store(&rounds_begun, i);
        for (size_t spin = dice_below(&dice, 400); spin > 0; spin--)
            atomic_load(&stop);
        call_begin_waiting(&call);
        ended += call_wait(&call, -1, call_now_ms() + 10000) == CALL_CANCELLED &&
                 atomic_load(&rounds_cancelled) == i;
    }
    atomic_store(&stop, true);
    pthread_join(thread, NULL);
    TEST_ASSERT_EQUAL_INT(ROUNDS, ended);
}

static void test_no_descriptor_left(void)
{
    struct rlimit before, none;
    struct call another;
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &before));
    none = before;
    none.rlim_cur = 3;
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &none));
    bool made = call_init(&another);
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &before));
    TEST_ASSERT_FALSE(made);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_deadline);
    RUN_TEST(test_readable);
    RUN_TEST(test_closed_at_the_other_end_is_readable);
    RUN_TEST(test_cancel_reaches_the_call_in_progress_only);
    RUN_TEST(test_cancel_before_a_wait_ends_it);
    RUN_TEST(test_cancel_from_another_thread);
    RUN_TEST(test_signals_do_not_end_a_wait);
    RUN_TEST(test_many_cancellations_at_random);
    RUN_TEST(test_no_cancellation_misses_a_wait);
    RUN_TEST(test_no_descriptor_left);
    return UNITY_END();
}
