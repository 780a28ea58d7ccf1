/* test_unit_threads.c - the thread of an instrument against those that ask, cancel and close. */
#include "station/unit.h"

#include <pthread.h>
#include <stdio.h>

#include "drivers/simulated/simulated.h"
#include "tests/station/unit_tools.h"
#include "tests/support/dice.h"

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* By chance and without sleeping, which would take longer. */
static void spin(struct dice *dice, size_t most_ns)
{
    int64_t until_ns = now_ns() + (int64_t)dice_below(dice, most_ns);
    while (now_ns() < until_ns)
        continue;
}

/* ---- cancelling --------------------------------------------------------------------- */

static void test_a_job_that_is_asked_ends_no_other(void)
{
    open_fake();
    atomic_store(&fake.measure_result, FAKE_SLOW);
    ask(0, UNIT_MEASURE);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    let_pass_ms(20);
    ask(1, UNIT_STATUS);
    let_pass_ms(50);
    TEST_ASSERT_EQUAL_INT(0, done_jobs);
}

static void test_cancel_ends_what_was_asked_before(void)
{
    open_fake();
    unit_cancel(unit); /* nothing was */
    atomic_store(&fake.measure_result, FAKE_SLOW);
    ask(0, UNIT_MEASURE);
    ask(1, UNIT_STATUS);
    ask(2, UNIT_MEASURE);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    let_pass_ms(20);
    atomic_store(&fake.measure_result, DRIVER_OK);
    int64_t began_ms = call_now_ms();
    unit_cancel(unit);
    ask(3, UNIT_MEASURE);
    TEST_ASSERT_TRUE(comes(&done_jobs, 4, LONG_MS));
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= 200);
    for (size_t i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_PTR(&jobs[i], done_order[i]);
        TEST_ASSERT_EQUAL_INT(i < 3 ? DRIVER_CANCELLED : DRIVER_OK, jobs[i].result);
        TEST_ASSERT_EQUAL_INT(jobs[i].result, jobs[i].error.result);
    }
    TEST_ASSERT_EQUAL_INT(2, atomic_load(&fake.shots)); /* the third was not begun */
    unit_cancel(unit);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
}

/* Jobs that were given back count as well: a cancellation reaches none that is asked later. */
static void test_cancel_after_a_loss(void)
{
    open_fake();
    atomic_store(&fake.measure_result, FAKE_HANGS);
    atomic_store(&fake.hang_result, DRIVER_GONE);
    for (size_t i = 0; i < 4; i++)
        ask(i, UNIT_MEASURE);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    atomic_store(&fake.let_go, true);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, LONG_MS));
    TEST_ASSERT_EQUAL_INT(4, done_jobs);
    atomic_store(&fake.measure_result, DRIVER_OK);
    unit_cancel(unit);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result);
}

/* Whatever it hits: a wait of 10 s always ends by its cancellation, what is quick ends one
 * way or the other, and the next job never by that of the one before. */
static void check_cancel_at_random_moments(void)
{
    struct dice dice = { 5 };
    for (int round = 0; round < 400; round++) {
        done_jobs = 0;
        struct unit_job *job = ask(0, round % 2 == 0 ? UNIT_WAIT : UNIT_MEASURE);
        spin(&dice, 200000);
        unit_cancel(unit);
        TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 1, LONG_MS / 2), "outlived its cancellation");
        if (round % 2 == 0)
            TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, job->result);
        else
            TEST_ASSERT_TRUE(job->result == DRIVER_OK || job->result == DRIVER_CANCELLED);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result);
    }
    TEST_ASSERT_EQUAL_INT(0, heard.lost);
}

static void test_cancel_at_random_moments(void)
{
    open_fake();
    check_cancel_at_random_moments();
}

static void test_cancel_at_random_moments_without_a_button(void)
{
    open_fake_without_button();
    check_cancel_at_random_moments();
}

/* ---- many jobs ---------------------------------------------------------------------- */

static void *ask_a_thousand(void *dice)
{
    for (size_t i = 0; i < MAX_JOBS; i++) {
        ask(i, i % 2 == 0 ? UNIT_MEASURE : UNIT_STATUS);
        if (i % 8 == 0) /* so that it is idle now and then */
            nanosleep(&(struct timespec){ .tv_nsec = (long)dice_below(dice, 200) * 1000 }, NULL);
    }
    return NULL;
}

static void check_a_thousand(void)
{
    pthread_t thread;
    struct dice dice = { 6 };
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, ask_a_thousand, &dice));
    bool all = comes(&done_jobs, MAX_JOBS, LONG_MS);
    pthread_join(thread, NULL);
    TEST_ASSERT_TRUE(all);
    for (size_t i = 0; i < MAX_JOBS; i++) {
        TEST_ASSERT_EQUAL_PTR(&jobs[i], done_order[i]);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, jobs[i].result);
    }
    TEST_ASSERT_EQUAL_INT(MAX_JOBS / 2, atomic_load(&fake.shots));
}

static void test_a_thousand_jobs_from_another_thread(void)
{
    open_fake();
    check_a_thousand();
}

static void test_a_thousand_jobs_without_a_button(void)
{
    open_fake_without_button();
    check_a_thousand();
}

static int compare_ns(const void *left, const void *right)
{
    int64_t x = *(const int64_t *)left, y = *(const int64_t *)right;
    return (x > y) - (x < y);
}

/* A job at an idle thread comes back at once. */
static void test_a_job_wakes_the_idle_thread(void)
{
    enum { ROUNDS = 300 };
    static int64_t took_ns[ROUNDS];
    open_fake();
    for (size_t i = 0; i < ROUNDS; i++) {
        nanosleep(&(struct timespec){ .tv_nsec = 200000 }, NULL);
        int64_t began_ns = now_ns();
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result);
        took_ns[i] = now_ns() - began_ns;
    }
    qsort(took_ns, ROUNDS, sizeof *took_ns, compare_ns);
    TEST_ASSERT_TRUE(took_ns[ROUNDS / 2] < 5000000);
}

/* Around the moment when a press ends the idling and it begins anew: a job that comes just
 * before is not overlooked (it would wait for 30 s). */
static void test_jobs_at_the_edge_of_idling(void)
{
    struct dice dice = { 9 };
    open_fake();
    for (int round = 0; round < 8000; round++) {
        struct unit_job *job = &jobs[0];
        done_jobs = 0;
        *job = (struct unit_job){ .job.done = on_done, .command = UNIT_STATUS };
        fake_press();
        spin(&dice, 200000);
        unit_ask(unit, job);
        TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 1, LONG_MS), "overlooked");
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, job->result);
    }
}

static void ask_for_a_wait(void)
{
    fake.on_press = NULL; /* once */
    jobs[0] = (struct unit_job){ .job.done = on_done, .command = UNIT_WAIT, .timeout_ms = 60 };
    unit_ask(unit, &jobs[0]);
}

/* What was to end the idling comes when a press has ended it: it ends no later wait. */
static void test_a_late_wake_ends_no_wait(void)
{
    fake.on_press = ask_for_a_wait;
    open_fake();
    fake_press();
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, jobs[0].result);
    TEST_ASSERT_EQUAL_INT(1, heard.buttons);
}

/* A driver that is asked for a job when its wait for the button is about to begin. */
static struct driver asking_driver;
static const struct driver *asked_driver;
static atomic_bool asks;

static enum driver_result ask_then_wait(struct instrument *instrument, int timeout_ms,
                                        bool *pressed, struct driver_error *error)
{
    if (atomic_exchange(&asks, false))
        ask(1, UNIT_STATUS);
    return asked_driver->wait_button(instrument, timeout_ms, pressed, error);
}

/* What is to end the idling comes before its wait: it would wait for 30 s were it forgotten. */
static void check_a_job_just_before_a_wait(const struct driver *driver, const char *address)
{
    asked_driver = driver;
    asking_driver = *driver;
    asking_driver.wait_button = ask_then_wait;
    atomic_store(&asks, false);
    open_unit(&asking_driver, address);
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, LONG_MS));
    for (int round = 0; round < 20; round++) {
        done_jobs = 0;
        atomic_store(&asks, true);
        ask(0, UNIT_STATUS); /* ends the wait under way: the next asks */
        TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 2, LONG_MS), "overlooked");
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, jobs[0].result);
        TEST_ASSERT_EQUAL_INT(DRIVER_OK, jobs[1].result);
    }
}

static void test_a_job_between_idling_and_its_wait(void)
{
    check_a_job_just_before_a_wait(&fake_driver, "F-1");
}

static void test_a_job_between_idling_and_its_simulated_wait(void)
{
    check_a_job_just_before_a_wait(&simulated_driver, "speed=5");
}

/* ---- closing ------------------------------------------------------------------------ */

static void test_close_takes_null(void)
{
    TEST_ASSERT_TRUE(unit_close(NULL, 0));
}

static void check_closes_at_once(const char *what)
{
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_TRUE_MESSAGE(unit_close(unit, LONG_MS), what);
    unit = NULL;
    TEST_ASSERT_TRUE_MESSAGE(call_now_ms() - began_ms <= 200, what);
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, heard.lost, what); /* being closed is no loss */
}

static void test_close_while_idle(void)
{
    open_fake();
    check_closes_at_once("with a button");
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&fake.closes));
    heard.opened = 0;
    open_fake_without_button();
    check_closes_at_once("without a button");
    TEST_ASSERT_EQUAL_INT(2, atomic_load(&fake.closes));
}

static void test_close_while_it_cannot_be_opened(void)
{
    for (size_t i = 0; i < FAKE_MAX_OPENS; i++)
        fake.open_result[i] = DRIVER_BUSY;
    open_unit(&fake_driver, "F-1");
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, LONG_MS));
    heard.lost = 0;
    check_closes_at_once("in a pause");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&fake.closes));
}

static void test_close_with_jobs_under_way_and_waiting(void)
{
    open_fake();
    atomic_store(&fake.measure_result, FAKE_SLOW);
    for (size_t i = 0; i < 5; i++)
        ask(i, UNIT_MEASURE);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    check_closes_at_once("in a shot");
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT(5, done_jobs);
    for (size_t i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_PTR(&jobs[i], done_order[i]);
        TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, jobs[i].result);
        TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, jobs[i].error.result);
    }
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&fake.shots));
}

/* Closing at any moment of a unit's life ends it, and every job comes back. */
static void test_close_at_random_moments(void)
{
    struct dice dice = { 11 };
    for (int round = 0; round < 200; round++) {
        done_jobs = 0;
        fake.has_button = round % 2 == 0;
        open_unit(&fake_driver, "F-1");
        for (size_t i = 0; i < 4; i++)
            ask(i, i % 2 == 0 ? UNIT_MEASURE : UNIT_STATUS);
        nanosleep(&(struct timespec){ .tv_nsec = (long)dice_below(&dice, 200) * 1000 }, NULL);
        check_closes_at_once("at random");
        inbox_drain(&inbox);
        TEST_ASSERT_EQUAL_INT(4, done_jobs);
    }
    TEST_ASSERT_EQUAL_INT(atomic_load(&fake.opens), atomic_load(&fake.closes));
}

static void test_close_gives_up_a_call_that_hangs(void)
{
    open_fake();
    atomic_store(&fake.measure_result, FAKE_HANGS);
    ask(0, UNIT_MEASURE);
    ask(1, UNIT_STATUS);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_FALSE(unit_close(unit, 150));
    int64_t took_ms = call_now_ms() - began_ms;
    TEST_ASSERT_TRUE(took_ms >= 150 && took_ms <= 150 + SLACK_MS);
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, ask(2, UNIT_STATUS)->result); /* at once */

    atomic_store(&fake.let_go, true); /* it ends after all, and nothing is lost */
    check_closes_at_once("at the second attempt");
    inbox_drain(&inbox);
    TEST_ASSERT_EQUAL_INT(3, done_jobs);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, jobs[0].result); /* its answer was there */
    TEST_ASSERT_EQUAL_INT(DRIVER_CANCELLED, jobs[1].result);
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&fake.closes));
}

/* ---- the simulated instrument ------------------------------------------------------- */

static struct unit_job *calibrate(enum driver_calibration step)
{
    done_jobs = 0;
    jobs[0] = (struct unit_job){ .job.done = on_done, .command = UNIT_CALIBRATE, .step = step };
    unit_ask(unit, &jobs[0]);
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    return &jobs[0];
}

static void test_simulated_from_opening_to_reading(void)
{
    open_unit(&simulated_driver, "serial=SIM-7,speed=100,fault=measure:3:gone");
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, LONG_MS));
    TEST_ASSERT_EQUAL_STRING("SIM-7", heard.identity.serial);
    TEST_ASSERT_TRUE(heard.status.due[DRIVER_CALIBRATION_WHITE]);
    TEST_ASSERT_EQUAL_INT(DRIVER_REFUSED, get(UNIT_MEASURE)->result);
    TEST_ASSERT_TRUE(calibrate(DRIVER_CALIBRATION_ZERO)->status.due[DRIVER_CALIBRATION_WHITE]);
    TEST_ASSERT_FALSE(calibrate(DRIVER_CALIBRATION_WHITE)->status.due[DRIVER_CALIBRATION_WHITE]);
    struct unit_job *job = get(UNIT_MEASURE);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, job->result);
    TEST_ASSERT_TRUE(job->reading.has_sce && job->reading.sce.n == 31);

    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, get(UNIT_MEASURE)->result);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, LONG_MS));
    TEST_ASSERT_EQUAL_INT(1, heard.lost);
    TEST_ASSERT_TRUE(heard.status.due[DRIVER_CALIBRATION_WHITE]); /* it was off */
}

/* At its real speed: a job cuts the wait for the button short, and a press is heard. */
static void test_simulated_wakes_and_waits(void)
{
    open_unit(&simulated_driver, "button_ms=400");
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, LONG_MS));
    TEST_ASSERT_TRUE(comes(&heard.buttons, 1, 400 + SLACK_MS));
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= 200); /* 5 ms are its own */
    struct unit_job *job = get(UNIT_WAIT);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, job->result);
    TEST_ASSERT_TRUE(job->pressed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_job_that_is_asked_ends_no_other);
    RUN_TEST(test_cancel_ends_what_was_asked_before);
    RUN_TEST(test_cancel_after_a_loss);
    RUN_TEST(test_cancel_at_random_moments);
    RUN_TEST(test_cancel_at_random_moments_without_a_button);
    RUN_TEST(test_a_thousand_jobs_from_another_thread);
    RUN_TEST(test_a_thousand_jobs_without_a_button);
    RUN_TEST(test_a_job_wakes_the_idle_thread);
    RUN_TEST(test_jobs_at_the_edge_of_idling);
    RUN_TEST(test_a_late_wake_ends_no_wait);
    RUN_TEST(test_close_takes_null);
    RUN_TEST(test_close_while_idle);
    RUN_TEST(test_close_while_it_cannot_be_opened);
    RUN_TEST(test_close_with_jobs_under_way_and_waiting);
    RUN_TEST(test_close_at_random_moments);
    RUN_TEST(test_close_gives_up_a_call_that_hangs);
    RUN_TEST(test_simulated_from_opening_to_reading);
    RUN_TEST(test_simulated_wakes_and_waits);
    RUN_TEST(test_a_job_between_idling_and_its_wait);
    RUN_TEST(test_a_job_between_idling_and_its_simulated_wait);
    return UNITY_END();
}
