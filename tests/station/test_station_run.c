/* test_station_run.c - a measurement within the station, and what may come in its way: a button
 * that fails, a lease that expires, requests for the same, the end of the station. */
#include "station/parking.h"
#include "tests/station/station_tools.h"

static struct visitor visitor, other;
static char lease[64];

static const char uuid[] = "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b";

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    set_settings();
    make_table();
    visitor.fd = other.fd = -1;
}

void tearDown(void)
{
    visitor_leave(&visitor);
    visitor_leave(&other);
    if (station.event != NULL)
        close_station();
    folder_remove(folder);
    heard_stop();
}

static enum outcome ask_with_lease(struct visitor *v, const char *method, const char *more)
{
    char params[512];
    snprintf(params, sizeof params, "{\"lease\":\"%s\"%s}", lease, more);
    return visitor_ask(v, method, params);
}

/* Calibrated, with a lease of so long. */
static void begin(const char *instrument, int ttl_ms)
{
    char params[256];
    if (instrument != NULL)
        settings.instruments[0] = instrument;
    begin_station();
    visitor_open_session(&visitor);
    snprintf(params, sizeof params, "{\"instrument\":\"simulated\",\"ttl_ms\":%d,\"wait\":false}",
             ttl_ms);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "instrument.acquire", params));
    copy_text(lease, sizeof lease, visitor_text(&visitor, "lease"));
    for (int i = 0; i < 2; i++)
        TEST_ASSERT_EQUAL_INT(
            OUTCOME_RESULT, ask_with_lease(&visitor, "instrument.calibrate",
                                           i == 0 ? ",\"step\":\"zero\"" : ",\"step\":\"white\""));
}

static int say_start(struct visitor *v, const char *which, int replicates, const char *pace)
{
    char params[512];
    snprintf(params, sizeof params,
             "{\"lease\":\"%s\",\"uuid\":\"%s\",\"specular\":\"sce\",\"replicates\":%d,"
             "\"pace\":\"%s\"}",
             lease, which, replicates, pace);
    return visitor_say(v, "measure.start", params);
}

static enum outcome ask_for_run(const char *method)
{
    char more[128];
    snprintf(more, sizeof more, ",\"uuid\":\"%s\"", uuid);
    return ask_with_lease(&visitor, method, more);
}

static bool run_waits(void)
{
    const struct run *run = station.benches[0]->run;
    return run != NULL && run->phase == RUN_WAITING;
}

static bool run_shoots(void)
{
    const struct run *run = station.benches[0]->run;
    return run != NULL && run->phase == RUN_SHOOTING && run->under_way;
}

static bool button_has_failed(void)
{
    return run_waits() && station.benches[0]->run->no_button;
}

static void expect_refusal(int id, const char *reason)
{
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_wait(&visitor, id));
    TEST_ASSERT_EQUAL_STRING(reason, visitor_text(&visitor, "reason"));
}

/* ---- the button --------------------------------------------------------------------- */

/* The shots that are there are not lost with it: measure.next takes the others. */
static void test_button_fails(void)
{
    begin("simulated:speed=instant,fault=wait_button:1+:garbage", 60000);
    int id = say_start(&visitor, uuid, 3, "prompt");
    TEST_ASSERT_TRUE(comes(button_has_failed));
    TEST_ASSERT_TRUE(heard_contains("the button of 'simulated' fails"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_for_run("measure.next"));
    TEST_ASSERT_TRUE(comes(button_has_failed));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_for_run("measure.next"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
}

static void test_button_fails_and_is_cancelled(void)
{
    begin("simulated:speed=instant,fault=wait_button:1+:garbage", 60000);
    (void)say_start(&visitor, uuid, 3, "prompt");
    TEST_ASSERT_TRUE(comes(button_has_failed));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_for_run("measure.cancel"));
    TEST_ASSERT_NULL(station.benches[0]->run);
    TEST_ASSERT_NOT_NULL(strstr(visitor.in, "\"measurement_cancelled\""));
    TEST_ASSERT_EQUAL_INT64(0, station.store.last_seq);
}

static void test_instrument_goes(void)
{
    begin("simulated:speed=instant,fault=measure:2:gone", 60000);
    int id = say_start(&visitor, uuid, 3, "prompt");
    TEST_ASSERT_TRUE(comes(run_waits));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_for_run("measure.next"));
    expect_refusal(id, "instrument_gone");
    TEST_ASSERT_NULL(station.benches[0]->run);
}

/* ---- the lease ---------------------------------------------------------------------- */

static void test_expires_while_it_waits(void)
{
    begin(NULL, 1000);
    int id = say_start(&visitor, uuid, 2, "prompt");
    TEST_ASSERT_TRUE(comes(run_waits));
    expect_refusal(id, "lease_expired");
    TEST_ASSERT_EQUAL_INT64(0, station.store.last_seq);
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, ask_for_run("measure.next"));
    TEST_ASSERT_EQUAL_STRING("lease_expired", visitor_text(&visitor, "reason"));
}

/* What was taken is kept and not told as current; a retry gets it. */
static void test_expires_during_a_shot(void)
{
    begin("simulated:shot_ms=2000,charge_ms=0,calibrate_ms=0", 1000);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                          ask_with_lease(&visitor, "instrument.renew", ",\"ttl_ms\":1000"));
    int id = say_start(&visitor, uuid, 2, "auto");
    expect_refusal(id, "lease_expired");
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "kept as record"));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
    id = say_start(&visitor, uuid, 2, "auto");
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id));
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "\"lease_expired\""));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
}

static void test_released_while_it_waits(void)
{
    begin(NULL, 60000);
    int id = say_start(&visitor, uuid, 2, "prompt");
    TEST_ASSERT_TRUE(comes(run_waits));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_with_lease(&visitor, "instrument.release", ""));
    expect_refusal(id, "measurement_cancelled");
    TEST_ASSERT_EQUAL_INT64(0, station.store.last_seq);
}

/* ---- the same again ----------------------------------------------------------------- */

static void test_joined(void)
{
    int id[RUN_ASKERS + 1];
    begin(NULL, 60000);
    for (int i = 0; i <= RUN_ASKERS; i++)
        id[i] = say_start(&visitor, uuid, 2, "prompt");
    expect_refusal(id[RUN_ASKERS], "measurement_running"); /* one too many */
    int another = say_start(&visitor, uuid, 3, "prompt");
    expect_refusal(another, "uuid_reused");
    TEST_ASSERT_TRUE(comes(run_waits));
    int next = say_start(&visitor, "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6c", 2, "prompt");
    expect_refusal(next, "measurement_running"); /* the instrument is at work */
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, ask_for_run("measure.next"));
    for (int i = 0; i < RUN_ASKERS; i++)
        TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id[i]));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
}

/* The next has to wait until what was cancelled has given the instrument back. */
static void test_cancelled_and_begun_anew(void)
{
    begin("simulated:shot_ms=400,charge_ms=0,calibrate_ms=0", 60000);
    int id = say_start(&visitor, uuid, 1, "auto");
    TEST_ASSERT_TRUE(comes(run_shoots));
    char params[256];
    snprintf(params, sizeof params, "{\"lease\":\"%s\",\"uuid\":\"%s\"}", lease, uuid);
    int cancelled = visitor_say(&visitor, "measure.cancel", params);
    int again = say_start(&visitor, "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6c", 1, "auto");
    expect_refusal(id, "measurement_cancelled");
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, cancelled));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, again));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
}

/* ---- the station's end -------------------------------------------------------------- */

static bool other_waits(void)
{
    return station.benches[0]->lease.waiting == 1;
}

static void test_station_ends(void)
{
    begin("simulated:shot_ms=60000,charge_ms=0,calibrate_ms=0", 60000);
    visitor_open_session(&other);
    int queued = visitor_say(&other, "instrument.acquire",
                             "{\"instrument\":\"simulated\",\"ttl_ms\":1000,\"wait\":true}");
    TEST_ASSERT_TRUE(comes(other_waits));
    int id = say_start(&visitor, uuid, 1, "auto");
    TEST_ASSERT_TRUE(comes(run_shoots));
    /* Until the driver has begun: a cancellation just before that is missed (station/unit.c), and
     * the shot goes on to its end or until the unit is closed. */
    for (int i = 0; i < 100; i++)
        turn(LOOK_US);
    TEST_ASSERT_FALSE(station_is_quiet(&station));
    station_stop(&station);
    expect_refusal(id, "shutting_down");
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_wait(&other, queued));
    TEST_ASSERT_EQUAL_STRING("shutting_down", visitor_text(&other, "reason"));
    TEST_ASSERT_EQUAL_INT64(0, station.store.last_seq);
    TEST_ASSERT_TRUE(station_is_quiet(&station));
}

static bool is_parked(void)
{
    return station.parked != NULL;
}

/* It begins when the store has said what checks there were: the record might lack the flag. */
static void test_waits_for_the_checks(void)
{
    static const struct store_check failed = { .seq = 1, .tile = "a", .aperture_mm = 8.0 };
    begin(NULL, 60000);
    struct bench *bench = station.benches[0];
    bench->recalls++;
    int id = say_start(&visitor, uuid, 1, "auto");
    TEST_ASSERT_TRUE(comes(is_parked));
    TEST_ASSERT_NULL(bench->run);
    checks_note(&bench->checks, checked_make(&failed));
    bench->recalls--;
    station_serve_parked(&station);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id));
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "\"drift\""));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_button_fails);
    RUN_TEST(test_button_fails_and_is_cancelled);
    RUN_TEST(test_instrument_goes);
    RUN_TEST(test_expires_while_it_waits);
    RUN_TEST(test_expires_during_a_shot);
    RUN_TEST(test_released_while_it_waits);
    RUN_TEST(test_joined);
    RUN_TEST(test_cancelled_and_begun_anew);
    RUN_TEST(test_station_ends);
    RUN_TEST(test_waits_for_the_checks);
    return UNITY_END();
}
