/* test_events.c - the ring, inside it, outside it, and at its edges. */
#include "station/events.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

static struct events events;

void setUp(void)
{
    events_init(&events);
}

void tearDown(void)
{
    events_done(&events);
}

/* Event n carries {"n":n}; topics go round. */
static void add_to(int64_t last)
{
    for (int64_t n = events.last_seq + 1; n <= last; n++) {
        char data[32];
        int64_t seq = 0;
        snprintf(data, sizeof data, "{\"n\":%lld}", (long long)n);
        TEST_ASSERT_EQUAL_INT(STATUS_OK, events_add(&events, (enum event_topic)(n % EVENT_TOPICS),
                                                    "type", data, &seq));
        TEST_ASSERT_EQUAL_INT64(n, seq);
        TEST_ASSERT_EQUAL_INT64(n, events_last(&events)->seq);
        TEST_ASSERT_EQUAL_STRING(data, events_last(&events)->data);
    }
}

struct seen {
    int64_t first, last;
    size_t n;
};

static void look(void *context, const struct event *event)
{
    struct seen *seen = context;
    char *colon = strchr(event->data, ':');
    TEST_ASSERT_EQUAL_INT64(event->seq, strtoll(colon + 1, NULL, 10));
    TEST_ASSERT_TRUE(event->seq > seen->last);
    if (seen->n == 0)
        seen->first = event->seq;
    seen->last = event->seq;
    seen->n++;
}

enum { ALL = (1 << EVENT_TOPICS) - 1 };

/* expect: counted by hand from the size of the ring. */
static void test_resuming(void)
{
    static const struct {
        const char *what;
        int64_t last, since;
        bool lost;
        int64_t first;
        size_t n;
    } rows[] = {
        { "nothing happened yet", 0, 0, false, 0, 0 },
        { "all from the start", 5, 0, false, 1, 5 },
        { "some", 5, 3, false, 4, 2 },
        { "up to date", 5, 5, false, 0, 0 },
        { "a number of another boot", 5, 6, true, 1, 5 },
        { "no number at all", 5, -1, true, 1, 5 },
        { "the ring just full", EVENTS_KEPT, 0, false, 1, EVENTS_KEPT },
        { "the first one gone", EVENTS_KEPT + 1, 0, true, 2, EVENTS_KEPT },
        { "the oldest kept is the next", EVENTS_KEPT + 1, 1, false, 2, EVENTS_KEPT },
        { "long gone", 5000, 100, true, 5000 - EVENTS_KEPT + 1, EVENTS_KEPT },
        { "inside the ring", 5000, 4990, false, 4991, 10 },
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct seen seen = { 0, 0, 0 };
        events_done(&events);
        add_to(rows[i].last);
        bool lost = events_since(&events, rows[i].since, ALL, look, &seen);
        TEST_ASSERT_EQUAL_INT_MESSAGE(rows[i].lost, lost, rows[i].what);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(rows[i].n, seen.n, rows[i].what);
        TEST_ASSERT_EQUAL_INT64_MESSAGE(rows[i].first, seen.first, rows[i].what);
    }
}

static void test_only_the_topics_asked_for(void)
{
    struct seen seen = { 0, 0, 0 };
    add_to(20); /* n % 5 == 2: lease; 2, 7, 12, 17 */
    TEST_ASSERT_FALSE(events_since(&events, 0, 1u << EVENT_LEASE, look, &seen));
    TEST_ASSERT_EQUAL_size_t(4, seen.n);
    TEST_ASSERT_EQUAL_INT64(2, seen.first);
    TEST_ASSERT_EQUAL_INT64(17, seen.last);
}

static void test_topics_by_name(void)
{
    static const char *const names[EVENT_TOPICS] = { "instrument", "calibration", "lease",
                                                     "measurement", "store" };
    enum event_topic topic;
    for (size_t i = 0; i < EVENT_TOPICS; i++) {
        TEST_ASSERT_EQUAL_STRING(names[i], event_topic_name((enum event_topic)i));
        TEST_ASSERT_EQUAL_INT(STATUS_OK, event_topic_parse(names[i], &topic));
        TEST_ASSERT_EQUAL_INT(i, topic);
    }
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, event_topic_parse("Lease", &topic));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, event_topic_parse("", &topic));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_resuming);
    RUN_TEST(test_only_the_topics_asked_for);
    RUN_TEST(test_topics_by_name);
    return UNITY_END();
}
