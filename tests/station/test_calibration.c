/* test_calibration.c - one thing changed at a time from a calibration that is good. */
#include "station/calibration.h"

#include <string.h>

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static const char boot[] = "11111111-2222-4333-8444-555555555555";

/* Both steps made at 1 000 000 ms over connection 3 with 8 mm; now is a minute later;
 * zero may be an hour old, white ten minutes. */
static void good_pair(struct calibration_made made[2], struct calibration_now *now)
{
    for (int i = 0; i < 2; i++) {
        made[i] = (struct calibration_made){ true, "", 1000000, 3, 8.0 };
        strcpy(made[i].boot_id, boot);
    }
    *now = (struct calibration_now){ boot, 1060000, 3, 8.0, { 3600000, 600000 }, { 0 } };
}

static void check(const struct calibration_made made[2], const struct calibration_now *now,
                  enum calibration_due zero, enum calibration_due white, const char *what)
{
    struct calibration_state state = calibration_judge(made, now);
    TEST_ASSERT_EQUAL_INT_MESSAGE(zero, state.due[0], what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(white, state.due[1], what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(zero == CALIBRATION_GOOD && white == CALIBRATION_GOOD, state.good,
                                  what);
}

static void test_good(void)
{
    struct calibration_made made[2];
    struct calibration_now now;
    good_pair(made, &now);
    struct calibration_state state = calibration_judge(made, &now);
    TEST_ASSERT_TRUE(state.good);
    TEST_ASSERT_EQUAL_INT64(60000, state.age_ms[1]);
    TEST_ASSERT_EQUAL_INT64(540000, state.expires_in_ms[1]);
    TEST_ASSERT_EQUAL_INT64(3540000, state.expires_in_ms[0]);
}

static void test_each_reason(void)
{
    struct calibration_made made[2];
    struct calibration_now now;

    good_pair(made, &now);
    made[0].made = made[1].made = false;
    check(made, &now, CALIBRATION_NEVER, CALIBRATION_NEVER, "never");

    good_pair(made, &now);
    now.instrument_asks[1] = true;
    check(made, &now, CALIBRATION_GOOD, CALIBRATION_INSTRUMENT, "the instrument asks for white");

    good_pair(made, &now);
    now.boot_id = "99999999-2222-4333-8444-555555555555";
    check(made, &now, CALIBRATION_BOOT, CALIBRATION_BOOT, "another boot");
    TEST_ASSERT_EQUAL_INT64(-1, calibration_judge(made, &now).age_ms[0]); /* no common clock */

    good_pair(made, &now);
    now.connection = 4;
    check(made, &now, CALIBRATION_RECONNECTED, CALIBRATION_RECONNECTED, "plugged in again");

    good_pair(made, &now);
    made[0].connection = made[1].connection = 0;
    check(made, &now, CALIBRATION_RECONNECTED, CALIBRATION_RECONNECTED, "an earlier run's record");

    good_pair(made, &now);
    now.aperture_mm = 3.0;
    check(made, &now, CALIBRATION_APERTURE, CALIBRATION_APERTURE, "another aperture");

    good_pair(made, &now);
    made[0].made = false;
    check(made, &now, CALIBRATION_NEVER, CALIBRATION_EARLIER_STEP, "white without zero");
}

/* Edges by hand: white is made at 1 000 000 and may be 600 000 old. */
static void test_expiry(void)
{
    struct calibration_made made[2];
    struct calibration_now now;
    good_pair(made, &now);
    now.boottime_ms = 1599999;
    check(made, &now, CALIBRATION_GOOD, CALIBRATION_GOOD, "the last millisecond");
    TEST_ASSERT_EQUAL_INT64(1, calibration_judge(made, &now).expires_in_ms[1]);
    now.boottime_ms = 1600000;
    check(made, &now, CALIBRATION_GOOD, CALIBRATION_EXPIRED, "expired");
    TEST_ASSERT_EQUAL_INT64(-1, calibration_judge(made, &now).expires_in_ms[1]);
    now.max_age_ms[1] = 0;
    check(made, &now, CALIBRATION_GOOD, CALIBRATION_GOOD, "no limit");
    now.boottime_ms = 1000000 + 3 * 3600000; /* three hours of suspend count */
    check(made, &now, CALIBRATION_EXPIRED, CALIBRATION_EARLIER_STEP, "zero expired in suspend");
}

static void test_names(void)
{
    TEST_ASSERT_EQUAL_STRING("reconnected", calibration_due_name(CALIBRATION_RECONNECTED));
    TEST_ASSERT_EQUAL_STRING("unknown", calibration_due_name((enum calibration_due)99));
    TEST_ASSERT_EQUAL_STRING("unknown", calibration_due_text((enum calibration_due)99));
    for (int i = CALIBRATION_GOOD; i <= CALIBRATION_EARLIER_STEP; i++)
        TEST_ASSERT_TRUE(strlen(calibration_due_text((enum calibration_due)i)) > 5);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_good);
    RUN_TEST(test_each_reason);
    RUN_TEST(test_expiry);
    RUN_TEST(test_names);
    return UNITY_END();
}
