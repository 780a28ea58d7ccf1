/* test_settings.c - the options of skinspecd that can be, and what holds without them.  Those that
 * cannot be are in test_settings.py: the program ends there. */
#include "station/settings.h"

#include <stdlib.h>
#include <string.h>

#include "unity.h"

static struct settings settings;

void setUp(void)
{
    unsetenv("SKINSPEC_SOCKET");
    unsetenv("XDG_RUNTIME_DIR");
    unsetenv("STATE_DIRECTORY");
}

void tearDown(void)
{
}

static void read_none(void)
{
    char name[] = "skinspecd", *argv[] = { name, NULL };
    settings_read(1, argv, &settings);
}

/* expect: docs of the options, in `skinspecd --help` */
static void test_defaults(void)
{
    read_none();
    TEST_ASSERT_EQUAL_STRING("/run/skinspec/skinspecd.sock", settings.socket);
    TEST_ASSERT_EQUAL_STRING("/var/lib/skinspec", settings.state);
    TEST_ASSERT_NULL(settings.tables);
    TEST_ASSERT_NULL(settings.user);
    TEST_ASSERT_EQUAL_size_t(0, settings.instruments_n);
    TEST_ASSERT_EQUAL_STRING("skinspec", settings.kiosk_group);
    TEST_ASSERT_EQUAL_STRING("skinspec-clinic", settings.clinic_group);
    TEST_ASSERT_EQUAL_STRING("skinspec-admin", settings.admin_group);
    TEST_ASSERT_EQUAL_size_t(64, settings.max_clients);
    TEST_ASSERT_EQUAL_size_t(48, settings.max_per_user);
    TEST_ASSERT_EQUAL_size_t(16, settings.max_per_process);
    TEST_ASSERT_EQUAL_size_t(1024, settings.wal_limit_mb);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, settings.calibration_hours);
    TEST_ASSERT_TRUE(settings.calibration_blocks);
    TEST_ASSERT_FALSE(settings.verbose);
}

static const struct environment_case {
    const char *what, *socket, *runtime, *state; /* NULL: not set */
    const char *expect_socket, *expect_state;
} environment_cases[] = {
    { "the runtime folder", NULL, "/run/user/7", NULL, "/run/user/7/skinspec.sock",
      "/var/lib/skinspec" },
    { "the socket comes first", "/tmp/s", "/run/user/7", "/state", "/tmp/s", "/state" },
    { "set to nothing is not set", "", "", "", "/run/skinspec/skinspecd.sock",
      "/var/lib/skinspec" },
    { "an empty socket, a runtime folder", "", "/run/user/7", "/state", "/run/user/7/skinspec.sock",
      "/state" },
};

static void set_or_not(const char *name, const char *value)
{
    if (value != NULL)
        setenv(name, value, 1);
    else
        unsetenv(name);
}

static void test_environment(void)
{
    for (size_t i = 0; i < sizeof environment_cases / sizeof *environment_cases; i++) {
        const struct environment_case *c = &environment_cases[i];
        set_or_not("SKINSPEC_SOCKET", c->socket);
        set_or_not("XDG_RUNTIME_DIR", c->runtime);
        set_or_not("STATE_DIRECTORY", c->state);
        read_none();
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->expect_socket, settings.socket, c->what);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(c->expect_state, settings.state, c->what);
    }
}

static void test_options(void)
{
    static char text[][64] = { "skinspecd",
                               "--socket=/tmp/o",
                               "--state=/tmp/state",
                               "--tables=/tmp/tables",
                               "--table=paper",
                               "--instrument=simulated",
                               "--instrument=simulated:serial=2",
                               "--user=somebody",
                               "--kiosk-group=k",
                               "--clinic-group=c",
                               "--admin-group=a",
                               "--max-clients=4096",
                               "--max-per-user=1",
                               "--max-per-process=7",
                               "--wal-limit=2",
                               "--calibration-hours=100000",
                               "--calibration-policy=warn",
                               "--verbose" };
    enum { N = sizeof text / sizeof *text };
    char *argv[N + 1] = { NULL };
    for (int i = 0; i < N; i++)
        argv[i] = text[i];
    setenv("SKINSPEC_SOCKET", "/tmp/not-used", 1);
    settings_read(N, argv, &settings);
    TEST_ASSERT_EQUAL_STRING("/tmp/o", settings.socket);
    TEST_ASSERT_EQUAL_STRING("/tmp/state", settings.state);
    TEST_ASSERT_EQUAL_STRING("/tmp/tables", settings.tables);
    TEST_ASSERT_EQUAL_STRING("paper", settings.table);
    TEST_ASSERT_EQUAL_size_t(2, settings.instruments_n);
    TEST_ASSERT_EQUAL_STRING("simulated:serial=2", settings.instruments[1]);
    TEST_ASSERT_EQUAL_STRING("somebody", settings.user);
    TEST_ASSERT_EQUAL_STRING("k", settings.kiosk_group);
    TEST_ASSERT_EQUAL_STRING("c", settings.clinic_group);
    TEST_ASSERT_EQUAL_STRING("a", settings.admin_group);
    TEST_ASSERT_EQUAL_size_t(4096, settings.max_clients);
    TEST_ASSERT_EQUAL_size_t(1, settings.max_per_user);
    TEST_ASSERT_EQUAL_size_t(7, settings.max_per_process);
    TEST_ASSERT_EQUAL_size_t(2, settings.wal_limit_mb);
    TEST_ASSERT_EQUAL_DOUBLE(100000.0, settings.calibration_hours);
    TEST_ASSERT_FALSE(settings.calibration_blocks);
    TEST_ASSERT_TRUE(settings.verbose);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_defaults);
    RUN_TEST(test_environment);
    RUN_TEST(test_options);
    return UNITY_END();
}
