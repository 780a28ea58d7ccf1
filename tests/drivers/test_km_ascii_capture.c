/* test_km_ascii_capture.c - the captures in drivers/km_ascii/captures, replayed through the driver:
 * the readings are those of the simulators that they were made from, bit for bit. */
#include "drivers/km_ascii/km_ascii.h"

#include "tests/drivers/capture_case.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
    capture_case_tear_down();
}

static void replays(const struct sim_kind *kind, const char *path)
{
    capture_case_replays(&(struct capture_case){
        .driver = &km_ascii_driver,
        .kind = kind,
        .options = "delays=0.1,serial=70012345,operator=1",
        .path = path,
        .press = true,
    });
}

static void test_700_replays(void)
{
    replays(&sim_cm700d, "drivers/km_ascii/captures/cm700d.capture");
}

static void test_2600_replays(void)
{
    replays(&sim_cm2600d, "drivers/km_ascii/captures/cm2600d.capture");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_700_replays);
    RUN_TEST(test_2600_replays);
    return UNITY_END();
}
