/* test_xrite_rci_capture.c - the capture in drivers/xrite_rci/captures, replayed through the
 * driver: the readings are those of the simulator that it was made from, bit for bit; and nothing
 * was ever sent but the commands that the driver's list has. */
#include "drivers/xrite_rci/xrite_rci.h"

#include <stdio.h>
#include <string.h>

#include "drivers/link/capture.h"
#include "tests/drivers/capture_case.h"
#include "tests/support/folder.h"
#include "unity.h"

#define SP62 "drivers/xrite_rci/captures/sp62.capture"

/* The white step is the first RM; the simulator's operator does the rest. */
static void place(struct cued_wire *wire)
{
    cue(wire, "RM", 1, "place white");
    cue(wire, "RM", 2, "place skin");
}

static const struct capture_case sp62 = {
    .driver = &xrite_rci_driver,
    .kind = &sim_sp62,
    .options = "delays=0.1,operator_ms=200,serial=007654",
    .path = SP62,
    .cue = place,
};

void setUp(void)
{
}

void tearDown(void)
{
    capture_case_tear_down();
}

static void test_replays(void)
{
    capture_case_replays(&sp62);
}

/* expect: the commands that the descriptions give for reading, by hand */
static void check_commands(const char *path, size_t at_least)
{
    static const char *const allowed[] = {
        "\r\n",       "CE\r\n",     "0009CF\r\n", "0108CF\r\n", "0005CF\r\n", "0107CF\r\n",
        "0040CF\r\n", "0020CF\r\n", "014BCF\r\n", "00SN\r\n",   "10XD\r\n",   "01XD\r\n",
        "RM\r\n",     "0001GM\r\n", "0101GM\r\n", "00GM\r\n",   "1001GM\r\n", "1101GM\r\n",
    };
    struct capture_file file;
    size_t sent = 0;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_read(path, &file));
    for (size_t i = 0; i < file.n; i++) {
        bool found = file.lines[i].kind != CAPTURE_SENT;
        sent += !found;
        for (size_t a = 0; !found && a < sizeof allowed / sizeof *allowed; a++)
            found = file.lines[i].n == strlen(allowed[a]) &&
                    memcmp(file.lines[i].bytes, allowed[a], file.lines[i].n) == 0;
        TEST_ASSERT_TRUE_MESSAGE(found, "another command");
    }
    TEST_ASSERT_GREATER_THAN(at_least, sent);
    capture_free(&file);
}

static void test_nothing_else_was_sent(void)
{
    check_commands(SP62, 40);
}

/* A station asks for none; recorded here, and then replayed. */
static void test_stored_sample(void)
{
    static struct capture_session live;
    struct capture_case stored = sp62;
    struct capture *capture;
    char folder[FOLDER_PATH_SIZE], path[FOLDER_PATH_SIZE];
    stored.options = "delays=0.1,operator_ms=200,serial=007654,samples=1";
    stored.stored = true;
    TEST_ASSERT_TRUE(folder_make(folder));
    stored.path = folder_path(folder, "stored.capture", path);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_create(stored.path, "xrite_rci", &capture));
    capture_case_hold_live(&stored, capture, &live);
    TEST_ASSERT_EQUAL_INT(STATUS_OK, capture_close(capture));
    TEST_ASSERT_TRUE(live.stored.has_sce && live.stored.sce.n == 31);
    capture_case_replays(&stored);
    check_commands(stored.path, 40);
    folder_remove(folder);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_replays);
    RUN_TEST(test_stored_sample);
    RUN_TEST(test_nothing_else_was_sent);
    return UNITY_END();
}
