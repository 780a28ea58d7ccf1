/* test_no_memory.c - allocations that fail, one after the other, in station/unit and
 * station/measuring: the status says so, and nothing leaks (seen under AddressSanitizer).
 *
 * The sources are compiled into this test under other names, with an allocator and a
 * pthread_create() that fail on request. */
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

static atomic_int allocations_left = -1; /* -1: never fail */
static atomic_bool no_thread;

static int may_allocate(void)
{
    if (atomic_load(&allocations_left) > 0)
        atomic_fetch_sub(&allocations_left, 1);
    else if (atomic_load(&allocations_left) == 0)
        return 0;
    return 1;
}

static void *test_malloc(size_t size)
{
    return may_allocate() ? malloc(size) : NULL;
}

static void *test_calloc(size_t n, size_t size)
{
    return may_allocate() ? calloc(n, size) : NULL;
}

static char *test_strdup(const char *text)
{
    return may_allocate() ? strdup(text) : NULL;
}

static int test_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                               void *(*run)(void *), void *context)
{
    return atomic_load(&no_thread) ? EAGAIN : pthread_create(thread, attributes, run, context);
}

#define measuring_init test_measuring_init
#define measuring_done test_measuring_done
#define measuring_take test_measuring_take
#define measuring_prompt test_measuring_prompt
#define measuring_finish test_measuring_finish
#define unit_open test_unit_open
#define unit_ask test_unit_ask
#define unit_cancel test_unit_cancel
#define unit_close test_unit_close
#define unit_try_now test_unit_try_now
#define unit_wait_for test_unit_wait_for
#define unit_is test_unit_is
#define unit_serve test_unit_serve
#define unit_give_back test_unit_give_back
#define unit_keep_status test_unit_keep_status
#define unit_tell_opened test_unit_tell_opened
#define unit_tell_lost test_unit_tell_lost
#define unit_tell_button test_unit_tell_button
#define unit_tell_status test_unit_tell_status
#define malloc test_malloc
#define calloc test_calloc
#define strdup test_strdup
#define pthread_create test_pthread_create
#include "station/measuring.c"
#include "station/unit.c"
#include "station/unit_tell.c"
#include "station/unit_work.c"
#undef malloc
#undef calloc
#undef strdup
#undef pthread_create

#include "tests/station/unit_tools.h"
#include "tests/support/heard.h"

/* ---- measuring ---------------------------------------------------------------------- */

static void test_measuring(void)
{
    static struct measuring m;
    static struct driver_reading reading;
    struct refusal refusal;
    unsigned flags;
    struct store_record *record = calloc(1, sizeof *record);
    TEST_ASSERT_NOT_NULL(record);
    m = (struct measuring){ .specular = SPECULAR_SCE, .replicates = 1 };
    m.bands = (struct spectrum){ .first_nm = 400.0, .step_nm = 10.0, .n = 31 };
    for (int enough = 0; enough < 3; enough++) { /* readings, matched, weights */
        atomic_store(&allocations_left, enough);
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY, measuring_init(&m));
        measuring_done(&m);
    }
    atomic_store(&allocations_left, 3);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, measuring_init(&m));

    reading.has_sce = true;
    reading.raw_unit = 1e-4;
    reading.sce = m.bands;
    reading.sce.value[0] = 0.5;
    TEST_ASSERT_EQUAL_INT(MEASURING_FINISH, measuring_take(&m, &reading, &flags, &refusal));
    TEST_ASSERT_FALSE(measuring_finish(&m, 0, record, &refusal)); /* raw */
    TEST_ASSERT_EQUAL_INT(REASON_NO_MEMORY, refusal.reason);
    TEST_ASSERT_EQUAL_size_t(0, record->replicates);
    measuring_done(&m);
    free(record);
}

/* ---- unit --------------------------------------------------------------------------- */

static void test_unit_that_cannot_be_made(void)
{
    const struct driver_options options = { .address = "F-1" };
    const struct unit_events events = { on_opened, on_lost, on_button, on_status, &heard };
    for (int enough = 0; enough < 2; enough++) { /* unit, address */
        atomic_store(&allocations_left, enough);
        TEST_ASSERT_EQUAL_INT(STATUS_NO_MEMORY,
                              unit_open(&fake_driver, &options, &inbox, &events, &unit));
    }
    atomic_store(&allocations_left, -1);
    atomic_store(&no_thread, true);
    TEST_ASSERT_EQUAL_INT(STATUS_IO, unit_open(&fake_driver, &options, &inbox, &events, &unit));
    atomic_store(&no_thread, false);
    TEST_ASSERT_NULL(unit);
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&fake.opens));
}

static void test_unit_without_an_address(void)
{
    open_unit(&fake_driver, NULL);
    TEST_ASSERT_TRUE(comes(&heard.opened, 1, LONG_MS));
    TEST_ASSERT_EQUAL_STRING("", heard.identity.serial);
}

/* An event is lost, and the log says so; jobs are done. */
static void test_event_that_cannot_be_told(void)
{
    open_fake();
    heard_start();
    atomic_store(&allocations_left, 0);
    fake_press();
    TEST_ASSERT_TRUE(reaches(&fake.waits, 2, LONG_MS)); /* the press has been dealt with */
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
    atomic_store(&allocations_left, -1);
    bool told = heard_contains("not enough memory to tell");
    heard_stop();
    TEST_ASSERT_TRUE(told);
    TEST_ASSERT_EQUAL_INT(0, heard.buttons);
}

/* Else it would be there, and nobody would ever use it: it is opened anew. */
static void test_opening_that_cannot_be_told(void)
{
    const struct driver_options options = { .address = "F-1" };
    const struct unit_events events = { on_opened, on_lost, on_button, on_status, &heard };
    heard_start();
    atomic_store(&allocations_left, 2); /* unit, address */
    TEST_ASSERT_EQUAL_INT(STATUS_OK, unit_open(&fake_driver, &options, &inbox, &events, &unit));
    TEST_ASSERT_TRUE(reaches(&fake.closes, 1, LONG_MS));
    TEST_ASSERT_EQUAL_INT(0, heard.opened);
    atomic_store(&allocations_left, -1);
    bool comes_up = comes(&heard.opened, 1, LONG_MS);
    heard_stop();
    TEST_ASSERT_TRUE(comes_up);
    TEST_ASSERT_EQUAL_INT(DRIVER_OK, get(UNIT_MEASURE)->result);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_measuring);
    RUN_TEST(test_unit_that_cannot_be_made);
    RUN_TEST(test_unit_without_an_address);
    RUN_TEST(test_event_that_cannot_be_told);
    RUN_TEST(test_opening_that_cannot_be_told);
    return UNITY_END();
}
