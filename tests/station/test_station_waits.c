/* test_station_waits.c - requests and measurements that wait for a table, and what they meet
 * meanwhile: their client goes, they are cancelled, the station ends. */
#include <semaphore.h>
#include <unistd.h>

#include "tests/station/station_tools.h"

static struct visitor visitor;

void setUp(void)
{
    heard_start();
    TEST_ASSERT_TRUE(folder_make(folder));
    set_settings();
    make_table();
    visitor.fd = -1;
}

void tearDown(void)
{
    visitor_leave(&visitor);
    if (station.event != NULL)
        close_station();
    folder_remove(folder);
    heard_stop();
}

static void begin_with_visitor(void)
{
    begin_station();
    visitor_open_session(&visitor);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "events.subscribe",
                                                      "{\"topics\":[\"store\",\"measurement\"]}"));
}

/* ---- what waits --------------------------------------------------------------------- */

/* The chores' thread at a gate: what comes after has to wait. */
struct gate {
    struct job job;
    sem_t go;
    bool passed;
};

static struct gate gate;

static void stand_at_gate(struct job *job, void *thread)
{
    (void)thread;
    while (sem_wait(&((struct gate *)job)->go) != 0)
        continue;
}

static void gate_passed(struct job *job)
{
    ((struct gate *)job)->passed = true;
}

static void shut_gate(void)
{
    gate = (struct gate){ .job = { .run = stand_at_gate, .done = gate_passed } };
    TEST_ASSERT_EQUAL_INT(0, sem_init(&gate.go, 0, 0));
    worker_ask(station.chores, &gate.job);
}

static void open_gate(void)
{
    sem_post(&gate.go);
}

/* A second table, which is loaded when it is asked for. */
static void make_other_table(void)
{
    static char path[FOLDER_PATH_SIZE];
    const struct recipe recipe = small_recipe("two-layer");
    folder_path(folder, "table-other.db", path);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, small_table(path, &recipe, false));
}

static const char match_by_other[] =
    "{\"spectrum\":{\"first_nm\":400,\"step_nm\":30,\"values\":[0.1,0.12,0.14,0.16,0.18,0.2,0.22,"
    "0.24,0.26,0.28,0.3]},\"specular\":\"sce\",\"store\":false,\"table\":\"other\"}";

static bool is_parked(void)
{
    return station.parked != NULL;
}

static void test_waits_for_a_table(void)
{
    make_other_table();
    begin_with_visitor();
    shut_gate();
    int first = visitor_say(&visitor, "match.spectrum", match_by_other);
    int second = visitor_say(&visitor, "match.spectrum", match_by_other);
    TEST_ASSERT_TRUE(comes(is_parked));
    open_gate();
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, first));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, second));
    TEST_ASSERT_FALSE(is_parked());
}

static bool nobody_is_there(void)
{
    return clients_count(station.clients).now == 0;
}

static bool nothing_is_parked(void)
{
    return station.parked == NULL;
}

static void test_waits_and_goes(void)
{
    make_other_table();
    begin_with_visitor();
    shut_gate();
    (void)visitor_say(&visitor, "match.spectrum", match_by_other);
    TEST_ASSERT_TRUE(comes(is_parked));
    visitor_leave(&visitor);
    TEST_ASSERT_TRUE(comes(nobody_is_there));
    open_gate();
    TEST_ASSERT_TRUE(comes(nothing_is_parked));
}

static void test_waits_and_the_station_ends(void)
{
    make_other_table();
    begin_with_visitor();
    shut_gate();
    int asked = visitor_say(&visitor, "match.spectrum", match_by_other);
    TEST_ASSERT_TRUE(comes(is_parked));
    station_stop(&station);
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_wait(&visitor, asked));
    TEST_ASSERT_EQUAL_STRING("shutting_down", visitor_text(&visitor, "reason"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_ask(&visitor, "status.get", "{}"));
    TEST_ASSERT_EQUAL_STRING("shutting_down", visitor_text(&visitor, "reason"));
    TEST_ASSERT_TRUE(station_is_quiet(&station));
    open_gate();
}

/* ---- a measurement whose table is on its way ---------------------------------------- */

static char lease[64];

static bool run_matches(void)
{
    const struct run *run = station.benches[0]->run;
    return run != NULL && run->phase == RUN_MATCHING;
}

static bool run_has_ended(void)
{
    return station.benches[0]->run == NULL;
}

/* It is taken, and waits for the table; the id of its request. */
static int measure_with_other_table(const char *uuid)
{
    char params[512];
    make_other_table();
    begin_with_visitor();
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "instrument.acquire",
                                                      "{\"instrument\":\"simulated\","
                                                      "\"ttl_ms\":60000,\"wait\":false}"));
    copy_text(lease, sizeof lease, visitor_text(&visitor, "lease"));
    for (int i = 0; i < 2; i++) {
        snprintf(params, sizeof params, "{\"lease\":\"%s\",\"step\":\"%s\"}", lease,
                 i == 0 ? "zero" : "white");
        TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                              visitor_ask(&visitor, "instrument.calibrate", params));
    }
    shut_gate();
    snprintf(params, sizeof params,
             "{\"lease\":\"%s\",\"uuid\":\"%s\",\"specular\":\"sce\",\"replicates\":1,"
             "\"pace\":\"auto\",\"table\":\"other\"}",
             lease, uuid);
    int id = visitor_say(&visitor, "measure.start", params);
    TEST_ASSERT_TRUE(comes(run_matches));
    return id;
}

static const char uuid[] = "018f2c3a-5b6d-7e8f-9a0b-1c2d3e4f5a6b";

static void test_its_table_comes(void)
{
    int id = measure_with_other_table(uuid);
    open_gate();
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id));
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "\"table\":\"other\""));
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "\"dE00\""));
}

static void test_cancelled_before_its_table_comes(void)
{
    char params[256];
    int id = measure_with_other_table(uuid);
    snprintf(params, sizeof params, "{\"lease\":\"%s\",\"uuid\":\"%s\"}", lease, uuid);
    int cancelled = visitor_say(&visitor, "measure.cancel", params);
    TEST_ASSERT_EQUAL_INT(OUTCOME_ERROR, visitor_wait(&visitor, id));
    TEST_ASSERT_EQUAL_STRING("measurement_cancelled", visitor_text(&visitor, "reason"));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, cancelled));
    TEST_ASSERT_NOT_NULL(strstr(visitor.answer, "\"discarded\":1"));
    open_gate();
    TEST_ASSERT_EQUAL_INT64(0, station.store.last_seq);
}

static void expect_one_record(void)
{
    TEST_ASSERT_TRUE(comes(run_has_ended));
    TEST_ASSERT_EQUAL_INT64(1, station.store.last_seq);
}

/* The reading is there: it is kept though its client goes, and a retry gets it. */
static void test_client_goes_before_its_table_comes(void)
{
    (void)measure_with_other_table(uuid);
    visitor_leave(&visitor);
    TEST_ASSERT_TRUE(comes(nobody_is_there));
    TEST_ASSERT_TRUE(run_matches());
    open_gate();
    expect_one_record();
}

/* The table does not come any more: a record without a match. */
static void test_station_ends_before_its_table_comes(void)
{
    int id = measure_with_other_table(uuid);
    station_stop(&station);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_wait(&visitor, id));
    TEST_ASSERT_NULL(strstr(visitor.answer, "\"dE00\""));
    open_gate();
    expect_one_record();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_waits_for_a_table);
    RUN_TEST(test_waits_and_goes);
    RUN_TEST(test_waits_and_the_station_ends);
    RUN_TEST(test_its_table_comes);
    RUN_TEST(test_cancelled_before_its_table_comes);
    RUN_TEST(test_client_goes_before_its_table_comes);
    RUN_TEST(test_station_ends_before_its_table_comes);
    return UNITY_END();
}
