/* test_station_store.c - how the store stands, as a station's loop knows and tells it: what a write
 * has shown, and a WAL beyond its limit. */
#include "station/station_store.h"
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

/* ---- what a write has shown --------------------------------------------------------- */

static const struct note_case {
    enum status status;
    enum store_state state;
    const char *name, *word; /* of the state; of its error */
    enum reason reason;      /* for a request to store; REASONS: it is tried */
} note_cases[] = {
    { STATUS_FULL, STORE_FULL, "full", "no room", REASONS },
    { STATUS_READ_ONLY, STORE_READ_ONLY, "read_only", "cannot be written", REASON_STORE_READ_ONLY },
    { STATUS_DB, STORE_READ_ONLY, "read_only", "tried again", REASON_STORE_READ_ONLY },
    { STATUS_OK, STORE_OK, "ok", "", REASONS },
};

static void test_what_a_write_has_shown(void)
{
    begin_with_visitor();
    for (size_t i = 0; i < sizeof note_cases / sizeof *note_cases; i++) {
        const struct note_case *c = &note_cases[i];
        char text[64];
        visitor_forget(&visitor);
        station_note_write(&station, c->status);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->state, station.store.state, c->name);
        TEST_ASSERT_EQUAL_STRING(c->name, store_state_name(station.store.state));
        TEST_ASSERT_NOT_NULL(strstr(station.store.error, c->word));
        int64_t told = station.events.last_seq;
        station_note_write(&station, c->status);
        TEST_ASSERT_EQUAL_INT64_MESSAGE(told, station.events.last_seq, "no news is not told");
        enum outcome outcome = visitor_ask(&visitor, "subject.add", "{\"label\":\"x\"}");
        snprintf(text, sizeof text, "\"store\":\"%s\"", c->name);
        TEST_ASSERT_NOT_NULL(strstr(visitor.in, text));
        if (c->reason == REASONS)
            TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, outcome); /* and so it has room again */
        else
            TEST_ASSERT_EQUAL_STRING(reason_name(c->reason), visitor_text(&visitor, "reason"));
    }
    TEST_ASSERT_EQUAL_INT(STORE_OK, station.store.state);
}

/* About one job, and not about the store. */
static void test_what_says_nothing(void)
{
    static const enum status statuses[] = { STATUS_NO_MEMORY, STATUS_EXISTS, STATUS_NOT_FOUND,
                                            STATUS_CANCELLED, STATUS_RANGE };
    begin_with_visitor();
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++) {
        station_note_write(&station, statuses[i]);
        TEST_ASSERT_EQUAL_INT(STORE_OK, station.store.state);
    }
}

/* Damage stays, whatever comes back later of what was asked before. */
static void test_damage_stays(void)
{
    begin_with_visitor();
    station_note_write(&station, STATUS_DAMAGED);
    TEST_ASSERT_EQUAL_INT(STORE_DAMAGED, station.store.state);
    TEST_ASSERT_NOT_NULL(strstr(station.store.error, "begin-anew"));
    station_note_write(&station, STATUS_OK);
    TEST_ASSERT_EQUAL_INT(STORE_DAMAGED, station.store.state);
    (void)visitor_ask(&visitor, "match.spectrum",
                      "{\"spectrum\":{\"first_nm\":400,\"step_nm\":100,\"values\":[0.1,0.2,0.3]},"
                      "\"specular\":\"sce\",\"store\":true}");
    TEST_ASSERT_EQUAL_STRING("store_read_only", visitor_text(&visitor, "reason"));
}

static const struct refusal_case {
    enum status status;
    const char *member;
    enum reason reason;
} refusal_cases[] = {
    { STATUS_FULL, "", REASON_STORE_FULL },
    { STATUS_READ_ONLY, "", REASON_STORE_READ_ONLY },
    { STATUS_DAMAGED, "", REASON_STORE_READ_ONLY },
    { STATUS_NO_MEMORY, "", REASON_NO_MEMORY },
    { STATUS_CANCELLED, "", REASON_SHUTTING_DOWN },
    { STATUS_EXISTS, "", REASON_UUID_REUSED },
    { STATUS_NOT_FOUND, "subject", REASON_SUBJECT_UNKNOWN },
    { STATUS_NOT_FOUND, "corrects", REASON_RECORD_UNKNOWN },
    { STATUS_RANGE, "surface", REASON_INTERNAL },
    { STATUS_IO, "", REASON_STORE_FAILED },
    { STATUS_DB, "", REASON_STORE_FAILED },
};

static void test_refusals(void)
{
    begin_station();
    for (size_t i = 0; i < sizeof refusal_cases / sizeof *refusal_cases; i++) {
        const struct refusal_case *c = &refusal_cases[i];
        struct refusal refusal = station_store_refusal(&station, c->status, c->member);
        TEST_ASSERT_EQUAL_STRING(reason_name(c->reason), reason_name(refusal.reason));
        if (c->reason == REASON_INTERNAL)
            TEST_ASSERT_EQUAL_STRING(c->member, refusal.detail);
    }
}

/* ---- the size of the WAL ------------------------------------------------------------ */

static bool wal_is_in_bounds(void)
{
    return !station.wal_limited && station.store.state == STORE_OK;
}

/* Beyond the limit nothing is stored; housekeeping begins the file anew and all goes on. */
static void test_wal_limit(void)
{
    settings.wal_limit_mb = 1;
    begin_with_visitor();
    station_note_wal(&station, 2 << 20);
    TEST_ASSERT_EQUAL_INT(STORE_FULL, station.store.state);
    TEST_ASSERT_NOT_NULL(strstr(station.store.error, "beyond 1 MB"));
    TEST_ASSERT_TRUE(heard_contains("beyond 1 MB"));
    (void)visitor_ask(&visitor, "subject.add", "{\"label\":\"x\"}");
    TEST_ASSERT_EQUAL_STRING("store_full", visitor_text(&visitor, "reason"));
    station_note_wal(&station, 3 << 20); /* still */
    TEST_ASSERT_EQUAL_INT(STORE_FULL, station.store.state);
    housekeeping_look_at_wal(station.housekeeping);
    TEST_ASSERT_TRUE(comes(wal_is_in_bounds));
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                          visitor_ask(&visitor, "subject.add", "{\"label\":\"x\"}"));
}

static int64_t erased_jobs;

static bool timer_has_been(void)
{
    return clock_boottime_ms() > erased_jobs + 6000;
}

/* By its own timer, every 5 s: the size is looked at, and a store that could not be
 * written is tried again. */
static void test_timer(void)
{
    begin_with_visitor();
    station_note_write(&station, STATUS_DB);
    TEST_ASSERT_EQUAL_INT(STORE_READ_ONLY, station.store.state);
    erased_jobs = clock_boottime_ms();
    TEST_ASSERT_TRUE(comes(timer_has_been));
    TEST_ASSERT_EQUAL_INT(STORE_OK, station.store.state);
    TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT,
                          visitor_ask(&visitor, "subject.add", "{\"label\":\"x\"}"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_a_write_has_shown);
    RUN_TEST(test_what_says_nothing);
    RUN_TEST(test_damage_stays);
    RUN_TEST(test_refusals);
    RUN_TEST(test_wal_limit);
    RUN_TEST(test_timer);
    return UNITY_END();
}
