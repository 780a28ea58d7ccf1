/* test_lease.c - who holds, who waits, and what time does to both. */
#include "station/lease.h"

#include "unity.h"

static struct lease lease;
static int64_t counter;

void setUp(void)
{
    counter = 41;
    lease_init(&lease, &counter);
}

void tearDown(void)
{
}

static enum lease_outcome acquire(uint64_t client, bool wait, int64_t now_ms, size_t *place)
{
    enum lease_outcome outcome = LEASE_FULL;
    TEST_ASSERT_EQUAL_INT(STATUS_OK,
                          lease_acquire(&lease, client, 5000, wait, now_ms, &outcome, place));
    return outcome;
}

static void tick(int64_t now_ms, uint64_t expired, uint64_t granted)
{
    uint64_t lost = 77, won = 77;
    lease_tick(&lease, now_ms, &lost, &won);
    TEST_ASSERT_EQUAL_UINT64(expired, lost);
    TEST_ASSERT_EQUAL_UINT64(granted, won);
}

/* The fence continues above the one on record and grows with every grant. */
static void test_grant_release_grant(void)
{
    size_t place = 0;
    TEST_ASSERT_EQUAL_INT64(INT64_MAX, lease_deadline_ms(&lease));
    TEST_ASSERT_EQUAL_INT(LEASE_GRANTED, acquire(1, false, 100, &place));
    TEST_ASSERT_EQUAL_INT64(42, lease.fence);
    TEST_ASSERT_EQUAL_INT64(5100, lease_deadline_ms(&lease));
    TEST_ASSERT_EQUAL_INT(LEASE_HELD, acquire(2, false, 200, &place));
    TEST_ASSERT_TRUE(lease_leave(&lease, 1));
    TEST_ASSERT_EQUAL_INT(LEASE_GRANTED, acquire(2, false, 300, &place));
    TEST_ASSERT_EQUAL_INT64(43, lease.fence);
}

/* Two instruments: no number comes twice, and who asks in vain changes no number. */
static void test_leases_share_a_counter(void)
{
    struct lease other;
    enum lease_outcome outcome;
    size_t place = 0;
    uint64_t lost, won;
    lease_init(&other, &counter);
    TEST_ASSERT_EQUAL_INT(LEASE_GRANTED, acquire(1, false, 0, &place));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, lease_acquire(&other, 3, 5000, false, 0, &outcome, &place));
    TEST_ASSERT_EQUAL_INT64(43, other.fence);
    TEST_ASSERT_EQUAL_INT(LEASE_HELD, acquire(2, false, 10, &place));
    TEST_ASSERT_EQUAL_INT(LEASE_QUEUED, acquire(2, true, 10, &place));
    TEST_ASSERT_EQUAL_INT64(42, lease.fence);
    TEST_ASSERT_TRUE(lease_leave(&lease, 1));
    lease_tick(&lease, 20, &lost, &won);
    TEST_ASSERT_EQUAL_UINT64(2, won);
    TEST_ASSERT_EQUAL_INT64(44, lease.fence);
}

static void test_asking_again_renews(void)
{
    size_t place = 0;
    TEST_ASSERT_EQUAL_INT(LEASE_GRANTED, acquire(1, false, 0, &place));
    TEST_ASSERT_EQUAL_INT(LEASE_GRANTED, acquire(1, true, 4000, &place));
    TEST_ASSERT_EQUAL_INT64(42, lease.fence); /* the same lease */
    TEST_ASSERT_EQUAL_INT64(9000, lease_deadline_ms(&lease));
}

static void test_queue_is_first_come_first_served(void)
{
    size_t place = 0;
    acquire(1, true, 0, &place);
    for (uint64_t client = 2; client <= 4; client++) {
        TEST_ASSERT_EQUAL_INT(LEASE_QUEUED, acquire(client, true, 10, &place));
        TEST_ASSERT_EQUAL_size_t(client - 1, place);
    }
    TEST_ASSERT_EQUAL_INT(LEASE_QUEUED, acquire(3, true, 20, &place)); /* keeps its place */
    TEST_ASSERT_EQUAL_size_t(2, place);
    TEST_ASSERT_TRUE(lease_leave(&lease, 3)); /* disconnects while it waits */
    TEST_ASSERT_EQUAL_size_t(2, lease_place(&lease, 4));
    TEST_ASSERT_TRUE(lease_leave(&lease, 1));
    /* Free, but somebody waits: a newcomer does not overtake. */
    TEST_ASSERT_EQUAL_INT(LEASE_HELD, acquire(9, false, 30, &place));
    tick(40, 0, 2);
    TEST_ASSERT_EQUAL_INT64(43, lease.fence);
    tick(41, 0, 0);
    tick(5040, 2, 4); /* expires at 40 + 5000 */
    TEST_ASSERT_EQUAL_size_t(0, lease.waiting);
}

static void test_a_full_queue(void)
{
    size_t place = 0;
    acquire(1, true, 0, &place);
    for (uint64_t client = 2; client < 2 + LEASE_QUEUE_MAX; client++)
        TEST_ASSERT_EQUAL_INT(LEASE_QUEUED, acquire(client, true, 0, &place));
    TEST_ASSERT_EQUAL_INT(LEASE_FULL, acquire(1000, true, 0, &place));
    TEST_ASSERT_EQUAL_size_t(LEASE_QUEUE_MAX, lease.waiting);
}

static void test_use_renews_and_expiry_ends(void)
{
    size_t place = 0;
    acquire(1, false, 0, &place);
    TEST_ASSERT_TRUE(lease_use(&lease, 1, 42, 4999));
    TEST_ASSERT_EQUAL_INT64(9999, lease_deadline_ms(&lease));
    TEST_ASSERT_FALSE(lease_use(&lease, 1, 41, 5000)); /* an older lease's fence */
    TEST_ASSERT_FALSE(lease_use(&lease, 2, 42, 5000)); /* somebody else's */
    TEST_ASSERT_FALSE(lease_use(&lease, 1, 42, 9999)); /* expired, though nobody ticked */
    tick(9999, 1, 0);
    tick(10000, 0, 0);
    TEST_ASSERT_FALSE(lease_use(&lease, 1, 42, 10000));
    TEST_ASSERT_FALSE(lease_leave(&lease, 1));
}

static void test_renew(void)
{
    size_t place = 0;
    acquire(1, false, 0, &place);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, lease_renew(&lease, 1, 42, 60000, 1000));
    TEST_ASSERT_EQUAL_INT64(61000, lease_deadline_ms(&lease));
    TEST_ASSERT_TRUE(lease_use(&lease, 1, 42, 2000)); /* by the new ttl from here on */
    TEST_ASSERT_EQUAL_INT64(62000, lease_deadline_ms(&lease));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, lease_renew(&lease, 2, 42, 60000, 2000));
    TEST_ASSERT_EQUAL_INT(STATUS_NOT_FOUND, lease_renew(&lease, 1, 42, 60000, 62000));
}

static void test_ttl_limits(void)
{
    static const struct {
        int64_t ttl_ms;
        enum status status;
    } rows[] = { { LEASE_TTL_MIN_MS, STATUS_OK },
                 { LEASE_TTL_MIN_MS - 1, STATUS_RANGE },
                 { LEASE_TTL_MAX_MS, STATUS_OK },
                 { LEASE_TTL_MAX_MS + 1, STATUS_RANGE },
                 { 0, STATUS_RANGE },
                 { -1, STATUS_RANGE },
                 { INT64_MAX, STATUS_RANGE } };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        enum lease_outcome outcome;
        size_t place;
        TEST_ASSERT_EQUAL_INT(rows[i].status,
                              lease_acquire(&lease, 1, rows[i].ttl_ms, false, 0, &outcome, &place));
        TEST_ASSERT_EQUAL_INT(rows[i].status,
                              lease_renew(&lease, 1, lease.fence, rows[i].ttl_ms, 0));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grant_release_grant);
    RUN_TEST(test_leases_share_a_counter);
    RUN_TEST(test_asking_again_renews);
    RUN_TEST(test_queue_is_first_come_first_served);
    RUN_TEST(test_a_full_queue);
    RUN_TEST(test_use_renews_and_expiry_ends);
    RUN_TEST(test_renew);
    RUN_TEST(test_ttl_limits);
    return UNITY_END();
}
