/* test_unit.c - what the thread of an instrument does and tells. */
#include "station/unit.h"

#include "tests/station/unit_tools.h"

/* ---- opening and losing ------------------------------------------------------------- */

static void test_opens_and_tells(void)
{
    atomic_store(&fake.white_due, true);
    open_fake();
    TEST_ASSERT_EQUAL_STRING("F-1", heard.identity.serial);
    TEST_ASSERT_EQUAL_INT(80, heard.status.battery_percent);
    TEST_ASSERT_TRUE(heard.status.due[DRIVER_CALIBRATION_WHITE]);
    TEST_ASSERT_EQUAL_UINT64(1, heard.connection);
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&fake.configures)); /* nothing was set before */
    TEST_ASSERT_EQUAL_INT(0, heard.lost);
}

/* unit.h: 200 ms at first, twice as long after each failure; told once for each cause. */
static void test_opens_at_the_fourth_attempt(void)
{
    static const int64_t pause_ms[] = { 200, 400, 800 };
    fake.open_result[0] = fake.open_result[1] = DRIVER_NO_PERMISSION;
    fake.open_result[2] = DRIVER_BUSY;
    open_unit(&fake_driver, "F-1");
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, SLACK_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_NO_PERMISSION, heard.error.result);
    TEST_ASSERT_TRUE(comes(&heard.lost, 2, 600 + SLACK_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_BUSY, heard.error.result);
    TEST_ASSERT_EQUAL_INT(3, atomic_load(&fake.opens));
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, 800 + SLACK_MS));
    TEST_ASSERT_EQUAL_UINT64(1, heard.connection);
    for (size_t i = 0; i < 3; i++) {
        int64_t took_ms = fake.opened_at_ms[i + 1] - fake.opened_at_ms[i];
        TEST_ASSERT_TRUE(took_ms >= pause_ms[i] && took_ms <= pause_ms[i] + SLACK_MS);
    }
    atomic_store(&fake.measure_result, DRIVER_GONE);
    (void)get(UNIT_MEASURE);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, 200 + SLACK_MS)); /* pauses begin anew */
}

static void test_jobs_while_it_is_not_open_are_answered_at_once(void)
{
    for (size_t i = 0; i < FAKE_MAX_OPENS; i++)
        fake.open_result[i] = DRIVER_NO_PERMISSION;
    open_unit(&fake_driver, "F-1");
    struct unit_job *job = ask(0, UNIT_MEASURE); /* perhaps before the first attempt */
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, SLACK_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, job->result);
    TEST_ASSERT_EQUAL_INT(DRIVER_NO_PERMISSION, job->error.result);
    TEST_ASSERT_EQUAL_STRING("fake: cannot be opened", job->error.text);
    TEST_ASSERT_EQUAL_UINT64(0, job->connection);
    TEST_ASSERT_FALSE(job->status_known || job->pressed);
    int opens = atomic_load(&fake.opens);
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, get(UNIT_STATUS)->result);
    TEST_ASSERT_TRUE(call_now_ms() - began_ms < 100);
    TEST_ASSERT_EQUAL_INT(opens, atomic_load(&fake.opens)); /* a job hastens nothing */
}

static void test_gone_in_a_measurement(void)
{
    open_fake();
    atomic_store(&fake.measure_result, DRIVER_GONE);
    for (size_t i = 0; i < 3; i++)
        ask(i, i == 0 ? UNIT_MEASURE : UNIT_STATUS);
    TEST_ASSERT_TRUE(comes(&done_jobs, 3, LONG_MS));
    for (size_t i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL_PTR(&jobs[i], done_order[i]);
        TEST_ASSERT_EQUAL_INT(DRIVER_GONE, jobs[i].result);
        TEST_ASSERT_EQUAL_STRING("fake: gone", jobs[i].error.text);
    }
    TEST_ASSERT_EQUAL_UINT64(1, jobs[0].connection);
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, LONG_MS));
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, 200 + SLACK_MS));
    TEST_ASSERT_EQUAL_UINT64(2, heard.connection);
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&fake.closes));
    TEST_ASSERT_EQUAL_UINT64(2, get(UNIT_STATUS)->connection);
}

static void test_is_set_again_as_it_was(void)
{
    open_fake();
    struct unit_job *job = &jobs[1];
    *job = (struct unit_job){ .job.done = on_done,
                              .command = UNIT_CONFIGURE,
                              .setup = { .grid = 3, .aperture = 1 } };
    unit_ask(unit, job);
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, job->result);
    TEST_ASSERT_TRUE(job->status_known);

    /* Lost, and it refuses the setup when it is back: lost again, for that cause. */
    atomic_store(&fake.grid, 0);
    atomic_store(&fake.configure_result, DRIVER_PROTOCOL);
    atomic_store(&fake.measure_result, DRIVER_GONE);
    (void)get(UNIT_MEASURE);
    TEST_ASSERT_TRUE(comes(&heard.lost, 2, 200 + SLACK_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, heard.error.result);
    TEST_ASSERT_EQUAL_INT(1, heard.opened);
    TEST_ASSERT_EQUAL_INT(DRIVER_GONE, get(UNIT_STATUS)->result);

    atomic_store(&fake.configure_result, DRIVER_OK);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, 400 + SLACK_MS));
    TEST_ASSERT_EQUAL_size_t(3, atomic_load(&fake.grid));
    TEST_ASSERT_EQUAL_INT(atomic_load(&fake.opens), atomic_load(&fake.closes) + 1);
}

static void test_gone_between_jobs(void)
{
    open_fake();
    atomic_store(&fake.wait_result, DRIVER_GONE);
    fake_press(); /* ends the wait under way */
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, LONG_MS));
    atomic_store(&fake.wait_result, DRIVER_OK);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, LONG_MS));
}

/* ---- jobs of each kind -------------------------------------------------------------- */

/* What the driver answers to each command, and what must come of it. */
static const struct job_case {
    const char *what;
    enum unit_command command;
    enum driver_result configure, calibrate, measure, status, expect;
    bool status_known;
} job_cases[] = {
    { "configure", UNIT_CONFIGURE, 0, 0, 0, 0, DRIVER_OK, true },
    { "status", UNIT_STATUS, 0, 0, 0, 0, DRIVER_OK, true },
    { "calibrate", UNIT_CALIBRATE, 0, 0, 0, 0, DRIVER_OK, true },
    { "measure", UNIT_MEASURE, 0, 0, 0, 0, DRIVER_OK, false },
    { "no such grid", UNIT_CONFIGURE, DRIVER_UNSUPPORTED, 0, 0, 0, DRIVER_UNSUPPORTED, false },
    { "silent", UNIT_STATUS, 0, 0, 0, DRIVER_TIMEOUT, DRIVER_TIMEOUT, false },
    { "swapped", UNIT_CALIBRATE, 0, DRIVER_IMPLAUSIBLE, 0, 0, DRIVER_IMPLAUSIBLE, false },
    { "silent shot", UNIT_MEASURE, 0, 0, DRIVER_TIMEOUT, 0, DRIVER_TIMEOUT, false },
    { "white due", UNIT_MEASURE, 0, 0, DRIVER_REFUSED, 0, DRIVER_REFUSED, false },
    { "set, then silent", UNIT_CONFIGURE, 0, 0, 0, DRIVER_TIMEOUT, DRIVER_OK, false },
    { "calibrated, then silent", UNIT_CALIBRATE, 0, 0, 0, DRIVER_TIMEOUT, DRIVER_OK, false },
    { "no such command", (enum unit_command)99, 0, 0, 0, 0, DRIVER_UNSUPPORTED, false },
};

static void test_each_job(void)
{
    open_fake();
    for (size_t i = 0; i < sizeof job_cases / sizeof *job_cases; i++) {
        const struct job_case *c = &job_cases[i];
        atomic_store(&fake.configure_result, c->configure);
        atomic_store(&fake.calibrate_result, c->calibrate);
        atomic_store(&fake.measure_result, c->measure);
        atomic_store(&fake.status_result, c->status);
        struct unit_job *job = get(c->command);
        atomic_store(&fake.status_result, DRIVER_OK);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, job->result, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->expect, job->error.result, c->what);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status_known, job->status_known, c->what);
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(1, job->connection, c->what);
        if (c->status_known)
            TEST_ASSERT_EQUAL_INT_MESSAGE(80, job->status.battery_percent, c->what);
        if (c->command == UNIT_MEASURE && c->expect == DRIVER_OK)
            TEST_ASSERT_EQUAL_DOUBLE(0.25, job->reading.raw_unit);
    }
    TEST_ASSERT_EQUAL_INT(3, atomic_load(&fake.calibrations));
    TEST_ASSERT_EQUAL_INT(0, heard.lost); /* silence is no loss */
}

/* The calibration was made: its job says so, and the loss is found right after. */
static void test_gone_after_calibrating(void)
{
    open_fake();
    atomic_store(&fake.status_result, DRIVER_GONE);
    struct unit_job *job = get(UNIT_CALIBRATE);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, job->result);
    TEST_ASSERT_FALSE(job->status_known);
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, SLACK_MS));
    atomic_store(&fake.status_result, DRIVER_OK);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, 600 + SLACK_MS));
}

/* ---- the button --------------------------------------------------------------------- */

static void test_presses_between_jobs_are_events(void)
{
    open_fake();
    for (int i = 1; i <= 3; i++) {
        fake_press();
        TEST_ASSERT_TRUE(comes(&heard.buttons, i, LONG_MS));
    }
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result);
    TEST_ASSERT_EQUAL_INT(3, heard.buttons);
}

static void test_a_wait_counts_presses_from_its_beginning(void)
{
    open_fake();
    atomic_store(&fake.measure_result, FAKE_HANGS);
    ask(0, UNIT_MEASURE);
    TEST_ASSERT_TRUE(reaches(&fake.shots, 1, LONG_MS));
    struct unit_job *wait = ask(1, UNIT_WAIT);
    fake_press(); /* during the shot: not meant for the wait */
    int waits = atomic_load(&fake.waits);
    atomic_store(&fake.let_go, true);
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    TEST_ASSERT_TRUE(reaches(&fake.waits, waits + 2, LONG_MS)); /* one to forget, one to wait */
    let_pass_ms(20);
    TEST_ASSERT_EQUAL_INT(1, done_jobs);
    fake_press();
    TEST_ASSERT_TRUE(comes(&done_jobs, 2, LONG_MS));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, wait->result);
    TEST_ASSERT_TRUE(wait->pressed);
    TEST_ASSERT_EQUAL_INT(0, heard.buttons);
}

/* What the press measured is fetched before the button is watched again: a new wait would have
 * the instrument give it up. */
static void test_the_reading_of_a_press_comes_first(void)
{
    open_fake();
    struct unit_job *wait = ask(0, UNIT_WAIT);
    int waits = atomic_load(&fake.waits);
    fake_press();
    while (!comes(&done_jobs, 1, 20)) { /* one that was forgotten with those before */
        TEST_ASSERT_TRUE(atomic_load(&fake.waits) < waits + 20);
        fake_press();
    }
    TEST_ASSERT_TRUE(wait->pressed);
    waits = atomic_load(&fake.waits);
    let_pass_ms(100);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_STATUS)->result); /* asked by somebody else */
    let_pass_ms(100);
    TEST_ASSERT_EQUAL_INT(waits, atomic_load(&fake.waits));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
    TEST_ASSERT_TRUE(reaches(&fake.waits, waits + 1, LONG_MS));
    fake_press();
    TEST_ASSERT_TRUE(comes(&heard.buttons, 1, LONG_MS));
}

/* driver.h: after 2 s its reading is not the press's any more.  Then all is as it was. */
static void test_a_press_that_nobody_fetches(void)
{
    open_fake();
    (void)ask(0, UNIT_WAIT);
    TEST_ASSERT_TRUE(reaches(&fake.waits, 2, LONG_MS)); /* or 3: idle, to forget, to wait */
    let_pass_ms(50);
    fake_press();
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    int64_t pressed_ms = call_now_ms();
    int waits = atomic_load(&fake.waits);
    TEST_ASSERT_TRUE(reaches(&fake.waits, waits + 1, 2000 + SLACK_MS));
    TEST_ASSERT_TRUE(call_now_ms() - pressed_ms >= 1900);
    fake_press();
    TEST_ASSERT_TRUE(comes(&heard.buttons, 1, LONG_MS));

    done_jobs = 0; /* and the unit can be closed meanwhile */
    (void)ask(1, UNIT_WAIT);
    let_pass_ms(50);
    fake_press();
    TEST_ASSERT_TRUE(comes(&done_jobs, 1, LONG_MS));
    int64_t began_ms = call_now_ms();
    TEST_ASSERT_TRUE(unit_close(unit, LONG_MS));
    unit = NULL;
    TEST_ASSERT_TRUE(call_now_ms() - began_ms <= SLACK_MS);
}

static void check_wait_ends(const char *what)
{
    int64_t began_ms = call_now_ms();
    jobs[0] = (struct unit_job){ .job.done = on_done, .command = UNIT_WAIT, .timeout_ms = 100 };
    jobs[0].pressed = true;
    done_jobs = 0;
    unit_ask(unit, &jobs[0]);
    TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 1, LONG_MS), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_OK, jobs[0].result, what);
    TEST_ASSERT_FALSE_MESSAGE(jobs[0].pressed, what);
    TEST_ASSERT_TRUE_MESSAGE(call_now_ms() - began_ms >= 99, what);
    TEST_ASSERT_TRUE_MESSAGE(call_now_ms() - began_ms <= 100 + SLACK_MS, what);

    struct unit_job *job = ask(1, UNIT_WAIT); /* for 10 s */
    let_pass_ms(30);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, done_jobs, what);
    began_ms = call_now_ms();
    unit_cancel(unit);
    TEST_ASSERT_TRUE_MESSAGE(comes(&done_jobs, 2, LONG_MS), what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_CANCELLED, job->result, what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRIVER_CANCELLED, job->error.result, what);
    TEST_ASSERT_TRUE_MESSAGE(call_now_ms() - began_ms <= 200, what);
}

static void test_a_wait_ends_by_time_and_by_cancelling(void)
{
    open_fake();
    check_wait_ends("with a button");
}

static void test_a_wait_without_a_button(void)
{
    open_fake_without_button();
    check_wait_ends("without a button");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&fake.waits));
}

/* It is not asked again and again, and jobs find their way without it. */
static void test_a_button_that_fails(void)
{
    atomic_store(&fake.wait_result, DRIVER_PROTOCOL);
    open_fake();
    let_pass_ms(100);
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&fake.waits));
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
    TEST_ASSERT_EQUAL_INT(DRIVER_PROTOCOL, get(UNIT_WAIT)->result);
    atomic_store(&fake.wait_result, DRIVER_OK);
    fake_press(); /* heard after the status that follows a shot */
    TEST_ASSERT_TRUE(comes(&heard.buttons, 1, UNIT_SOON_MS + SLACK_MS));
    TEST_ASSERT_EQUAL_INT(0, heard.lost);
}

/* ---- the status in between ---------------------------------------------------------- */

static void test_status_follows_a_shot_where_it_differs(void)
{
    open_fake();
    atomic_store(&fake.white_due, true);
    TEST_ASSERT_TRUE(get(UNIT_STATUS)->status.due[DRIVER_CALIBRATION_WHITE]);
    (void)get(UNIT_MEASURE);
    let_pass_ms(30);
    TEST_ASSERT_EQUAL_INT(2, atomic_load(&fake.statuses)); /* none delays the next shot */
    TEST_ASSERT_TRUE(reaches(&fake.statuses, 3, UNIT_SOON_MS + SLACK_MS));
    let_pass_ms(30);
    TEST_ASSERT_EQUAL_INT(0, heard.statuses); /* the job brought it: nothing new */

    (void)get(UNIT_MEASURE);
    atomic_store(&fake.battery_percent, 79);
    atomic_store(&fake.charging, true);
    TEST_ASSERT_TRUE(comes(&heard.statuses, 1, UNIT_SOON_MS + SLACK_MS));
    TEST_ASSERT_EQUAL_INT(79, heard.status.battery_percent);
    TEST_ASSERT_TRUE(heard.status.charging);
    atomic_store(&fake.charging, false); /* asked again soon while it charges */
    atomic_store(&fake.white_due, false);
    TEST_ASSERT_TRUE(comes(&heard.statuses, 2, UNIT_SOON_MS + SLACK_MS));
    TEST_ASSERT_FALSE(heard.status.due[DRIVER_CALIBRATION_WHITE] || heard.status.charging);
}

static void test_status_between_jobs_finds_the_loss(void)
{
    open_fake_without_button();
    (void)get(UNIT_MEASURE);
    atomic_store(&fake.status_result, DRIVER_GONE);
    TEST_ASSERT_TRUE(comes(&heard.lost, 1, UNIT_SOON_MS + SLACK_MS));
    atomic_store(&fake.status_result, DRIVER_OK);
    TEST_ASSERT_TRUE(comes(&heard.opened, 2, 600 + SLACK_MS));
}

static int64_t cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

static void check_idling_is_free(void)
{
    let_pass_ms(20);
    int64_t before_ms = cpu_ms();
    int waits = atomic_load(&fake.waits);
    let_pass_ms(500);
    TEST_ASSERT_TRUE(cpu_ms() - before_ms <= 20);
    TEST_ASSERT_EQUAL_INT(waits, atomic_load(&fake.waits));
}

static void test_idling_costs_nothing(void)
{
    open_fake();
    check_idling_is_free();
}

static void test_idling_without_a_button_costs_nothing(void)
{
    open_fake_without_button();
    check_idling_is_free();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_opens_and_tells);
    RUN_TEST(test_opens_at_the_fourth_attempt);
    RUN_TEST(test_jobs_while_it_is_not_open_are_answered_at_once);
    RUN_TEST(test_gone_in_a_measurement);
    RUN_TEST(test_is_set_again_as_it_was);
    RUN_TEST(test_gone_between_jobs);
    RUN_TEST(test_each_job);
    RUN_TEST(test_gone_after_calibrating);
    RUN_TEST(test_presses_between_jobs_are_events);
    RUN_TEST(test_a_wait_counts_presses_from_its_beginning);
    RUN_TEST(test_the_reading_of_a_press_comes_first);
    RUN_TEST(test_a_press_that_nobody_fetches);
    RUN_TEST(test_a_wait_ends_by_time_and_by_cancelling);
    RUN_TEST(test_a_wait_without_a_button);
    RUN_TEST(test_a_button_that_fails);
    RUN_TEST(test_status_follows_a_shot_where_it_differs);
    RUN_TEST(test_status_between_jobs_finds_the_loss);
    RUN_TEST(test_idling_costs_nothing);
    RUN_TEST(test_idling_without_a_button_costs_nothing);
    return UNITY_END();
}
