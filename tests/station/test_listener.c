/* test_listener.c - the station's socket: made here, or handed over by systemd; what is in its
 * way is left alone, and what cannot be used is refused. */
#define _DEFAULT_SOURCE /* mkdtemp() */
#include "station/listener.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/folder.h"
#include "tests/support/heard.h"
#include "unity.h"

static char folder[64], path[128];

void setUp(void)
{
    heard_start();
    strcpy(folder, "/tmp/sk-listener-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/socket", folder);
}

void tearDown(void)
{
    (void)unlink(path);
    (void)rmdir(folder);
    heard_stop();
}

static int socket_at(const char *where, bool listens)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    strcpy(address.sun_path, where);
    TEST_ASSERT_EQUAL_INT(0, bind(fd, (struct sockaddr *)&address, sizeof address));
    if (listens)
        TEST_ASSERT_EQUAL_INT(0, listen(fd, 1));
    return fd;
}

static bool somebody_answers(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    strcpy(address.sun_path, path);
    bool answered = connect(fd, (struct sockaddr *)&address, sizeof address) == 0;
    close(fd);
    return answered;
}

/* ---- made here ---------------------------------------------------------------------- */

static void test_made_and_removed(void)
{
    struct listener listener = { .fd = -1 };
    struct stat st;
    TEST_ASSERT_EQUAL_INT(STATUS_OK, listener_open(path, &listener));
    TEST_ASSERT_TRUE(somebody_answers());
    TEST_ASSERT_EQUAL_INT(0, stat(path, &st));
    TEST_ASSERT_EQUAL_HEX(0600, st.st_mode & 07777);
    listener_close(&listener);
    TEST_ASSERT_EQUAL_INT(-1, access(path, F_OK));
    listener_close(&listener); /* again is nothing */
}

static void test_dead_one_is_replaced(void)
{
    struct listener listener = { .fd = -1 };
    close(socket_at(path, true));
    TEST_ASSERT_EQUAL_INT(STATUS_OK, listener_open(path, &listener));
    TEST_ASSERT_TRUE(somebody_answers());
    listener_close(&listener);
}

static void test_living_one_is_left(void)
{
    struct listener listener = { .fd = -1 };
    int fd = socket_at(path, true);
    TEST_ASSERT_EQUAL_INT(STATUS_EXISTS, listener_open(path, &listener));
    TEST_ASSERT_TRUE(heard_contains("answered by another program"));
    TEST_ASSERT_TRUE(somebody_answers());
    TEST_ASSERT_EQUAL_INT(-1, listener.fd);
    close(fd);
}

static void test_another_in_its_place_is_left(void)
{
    struct listener listener = { .fd = -1 };
    TEST_ASSERT_EQUAL_INT(STATUS_OK, listener_open(path, &listener));
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    int fd = socket_at(path, true);
    listener_close(&listener);
    TEST_ASSERT_TRUE(somebody_answers());
    close(fd);
}

static const struct refused_case {
    const char *name, *word;
    enum status status;
} refused_cases[] = {
    { "/none/socket", "cannot listen on", STATUS_IO },
    { "/file/socket", "cannot look at", STATUS_IO },
    { "/file", "no socket", STATUS_EXISTS },
    { "/sssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssssss"
      "sss",
      "shorter", STATUS_RANGE },
};

static void test_refused(void)
{
    char file[128], where[256];
    snprintf(file, sizeof file, "%s/file", folder);
    TEST_ASSERT_TRUE(file_write(file, "kept", 4));
    for (size_t i = 0; i < sizeof refused_cases / sizeof *refused_cases; i++) {
        const struct refused_case *c = &refused_cases[i];
        struct listener listener = { .fd = -1 };
        snprintf(where, sizeof where, "%s%s", folder, c->name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(c->status, listener_open(where, &listener), c->name);
        TEST_ASSERT_TRUE_MESSAGE(heard_contains(c->word), c->name);
        TEST_ASSERT_EQUAL_INT(-1, listener.fd);
    }
    TEST_ASSERT_EQUAL_INT(0, unlink(file));
}

/* Without a descriptor left, the name is neither taken nor, where a dead one has it, freed. */
static void test_no_descriptor(void)
{
    struct listener listener = { .fd = -1 };
    struct rlimit usual, none;
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_NOFILE, &usual));
    for (int dead = 0; dead < 2; dead++) {
        if (dead)
            close(socket_at(path, true));
        none = (struct rlimit){ 0, usual.rlim_max };
        TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &none));
        enum status s = listener_open(path, &listener);
        TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_NOFILE, &usual));
        TEST_ASSERT_EQUAL_INT(STATUS_IO, s);
        TEST_ASSERT_TRUE(heard_contains("cannot make a socket"));
        TEST_ASSERT_EQUAL_INT(dead ? 0 : -1, access(path, F_OK));
    }
}

/* ---- handed over -------------------------------------------------------------------- */

enum handed { HANDED_LISTENING, HANDED_BOUND, HANDED_FILE, HANDED_TWO };

static const struct handed_case {
    enum handed what;
    enum status status;
} handed_cases[] = {
    { HANDED_LISTENING, STATUS_OK },
    { HANDED_BOUND, STATUS_IO }, /* does not listen */
    { HANDED_FILE, STATUS_IO },
    { HANDED_TWO, STATUS_IO },
};

/* As systemd.exec hands over: from descriptor 3 on.  In a process of its own. */
static int take_over(const struct handed_case *c)
{
    char pid[32];
    struct listener listener = { .fd = -1 };
    int fd = c->what == HANDED_FILE ? open("/dev/null", O_RDONLY)
                                    : socket_at(path, c->what != HANDED_BOUND);
    snprintf(pid, sizeof pid, "%ld", (long)getpid());
    setenv("LISTEN_PID", pid, 1);
    setenv("LISTEN_FDS", c->what == HANDED_TWO ? "2" : "1", 1);
    if (fd != 3 && dup2(fd, 3) != 3)
        return 1;
    if (c->what == HANDED_TWO && dup2(fd, 4) != 4)
        return 2;
    if (listener_open("/not/used", &listener) != c->status)
        return 3;
    if (c->status != STATUS_OK)
        return heard_contains("one listening Unix stream socket") ? 0 : 4;
    if (listener.fd != 3 || listener.ours || (fcntl(3, F_GETFL) & O_NONBLOCK) == 0)
        return 5;
    listener_close(&listener);
    return access(path, F_OK) == 0 ? 0 : 6; /* systemd's, not ours to remove */
}

static void test_handed_over(void)
{
    for (size_t i = 0; i < sizeof handed_cases / sizeof *handed_cases; i++) {
        int status = 0;
        (void)unlink(path);
        fflush(NULL); /* or the child writes it as well */
        pid_t child = fork();
        if (child == 0)
            exit(take_over(&handed_cases[i]));
        TEST_ASSERT_EQUAL_INT(child, waitpid(child, &status, 0));
        TEST_ASSERT_TRUE(WIFEXITED(status));
        TEST_ASSERT_EQUAL_INT(0, WEXITSTATUS(status));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_made_and_removed);
    RUN_TEST(test_dead_one_is_replaced);
    RUN_TEST(test_living_one_is_left);
    RUN_TEST(test_another_in_its_place_is_left);
    RUN_TEST(test_refused);
    RUN_TEST(test_no_descriptor);
    RUN_TEST(test_handed_over);
    return UNITY_END();
}
