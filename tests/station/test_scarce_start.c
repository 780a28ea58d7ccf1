/* test_scarce_start.c - a station that is started with too little: it is not up, says so by its
 * status and leaves nothing behind (seen under AddressSanitizer); with enough it starts.  And
 * visitors who come, and housekeeping that is done, while something is short. */
#include <sys/stat.h>

#include "json/memory.h"
#include "tests/station/scarce_tools.h"
#include "tests/station/station_tools.h"

static struct visitor visitor, other;

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
    (void)scarce_end();
    visitor_leave(&visitor);
    visitor_leave(&other);
    if (station.event != NULL)
        close_station();
    folder_remove(folder);
    heard_stop();
}

/* ---- starting ----------------------------------------------------------------------- */

/* Until the threads are told to begin: what they do then is as below. */
static void starts(enum scarcity scarcity)
{
    long given = 0;
    for (bool scarce = true; scarce; given++) {
        scarce_begin(scarcity, given);
        enum status s = open_station();
        scarce = scarce_end();
        if (s == STATUS_OK)
            TEST_ASSERT_TRUE(comes(station_is_up));
        TEST_ASSERT_TRUE(s == STATUS_OK || s == STATUS_NO_MEMORY || s == STATUS_IO);
        TEST_ASSERT_TRUE_MESSAGE(s == STATUS_OK || scarce, "nothing was refused");
        close_station();
        TEST_ASSERT_EQUAL_INT_MESSAGE(-1, access(settings.socket, F_OK), "its socket stays");
    }
    TEST_ASSERT_GREATER_THAN(20, given);
    begin_station();
    visitor_open_session(&visitor);
}

static void test_start_without_one(void)
{
    starts(SCARCE_ONE);
}

static void test_start_without_more(void)
{
    starts(SCARCE_ALL);
}

/* ---- coming ------------------------------------------------------------------------- */

static size_t clients_now(void)
{
    return clients_count(station.clients).now;
}

static bool is_alone(void)
{
    return clients_now() == 1;
}

/* Greeted, refused or hung up on; those who are there do not notice. */
static void comes_in(enum scarcity scarcity)
{
    long given = 0, let_in = 0;
    begin_station();
    visitor_open_session(&visitor);
    for (bool scarce = true; scarce; given++) {
        scarce_begin(scarcity, given);
        bool greeted = visitor_come(&other);
        scarce = scarce_end();
        bool is_hello = greeted && strstr(other.in, "\"hello\"") != NULL;
        let_in += is_hello;
        if (greeted && !is_hello)
            TEST_ASSERT_NOT_NULL(strstr(other.in, "\"no_memory\""));
        if (!scarce)
            TEST_ASSERT_TRUE(is_hello);
        visitor_leave(&other);
        TEST_ASSERT_TRUE(comes(is_alone));
        TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "status.get", "{}"));
    }
    TEST_ASSERT_GREATER_THAN(5, given);
    TEST_ASSERT_GREATER_THAN(0, let_in);
}

static void test_come_without_one(void)
{
    comes_in(SCARCE_ONE);
}

static void test_come_without_more(void)
{
    comes_in(SCARCE_ALL);
}

/* A line too long is refused where there is memory to say so; hung up on it is in any case. */
static void test_long_line(void)
{
    static char line[PROTOCOL_MAX_REQUEST + 64];
    memset(line, 'x', sizeof line);
    begin_station();
    for (long given = 0; given < 20; given++) {
        TEST_ASSERT_TRUE(visitor_come(&visitor));
        scarce_begin(SCARCE_ALL, given);
        (void)send(visitor.fd, line, sizeof line, MSG_NOSIGNAL);
        enum outcome outcome = visitor_wait(&visitor, 1);
        if (!scarce_end())
            TEST_ASSERT_EQUAL_STRING("line_too_long", visitor_text(&visitor, "reason"));
        if (outcome == OUTCOME_ERROR)
            outcome = visitor_wait(&visitor, 1);
        TEST_ASSERT_EQUAL_INT(OUTCOME_CLOSED, outcome);
    }
}

/* ---- housekeeping ------------------------------------------------------------------- */

static uint64_t jobs_before;

static bool wal_is_looked_at(void)
{
    return writer_look(station.writer).wal_bytes >= 0 && !inbox_has_jobs(&station.inbox) &&
           station.store.state == STORE_OK;
}

/* Left out now, it is done the next time. */
static void test_housekeeping(void)
{
    begin_station();
    visitor_open_session(&visitor);
    for (long given = 0; given < 8; given++) {
        char label[64];
        snprintf(label, sizeof label, "{\"label\":\"%ld\"}", given);
        TEST_ASSERT_EQUAL_INT(OUTCOME_RESULT, visitor_ask(&visitor, "subject.add", label));
        scarce_begin(SCARCE_ALL, given);
        housekeeping_look_at_wal(station.housekeeping);
        housekeeping_look_at_wal(station.housekeeping); /* while the first is under way */
        (void)scarce_end();
        TEST_ASSERT_TRUE(comes(wal_is_looked_at));
    }
    jobs_before = writer_look(station.writer).jobs;
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(8, jobs_before);
    TEST_ASSERT_GREATER_THAN_INT64(0, station.wal_bytes);
}

int main(void)
{
    json_memory_watch();
    UNITY_BEGIN();
    RUN_TEST(test_start_without_one);
    RUN_TEST(test_start_without_more);
    RUN_TEST(test_come_without_one);
    RUN_TEST(test_come_without_more);
    RUN_TEST(test_long_line);
    RUN_TEST(test_housekeeping);
    return UNITY_END();
}
