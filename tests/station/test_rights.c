/* test_rights.c - what the kernel says of a peer, and what follows: by its user, its group and its
 * further groups, however many; and nothing where it cannot be known. */
#define _GNU_SOURCE /* setgroups(), setegid() */
#include "station/rights.h"

#include <grp.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/station/scarce_tools.h"
#include "unity.h"

/* No account and no group of the machine's has to have these. */
enum { SOMEBODY = 64001, KIOSK = 64101, CLINIC = 64102, ADMIN = 64103, OTHERS = 65000 };

static const struct rights rights = {
    .own = 64000, .group = { [RIGHT_KIOSK] = KIOSK, [RIGHT_CLINIC] = CLINIC, [RIGHT_ADMIN] = ADMIN }
};

void setUp(void)
{
}

void tearDown(void)
{
    (void)scarce_end();
}

enum found { FOUND_NOTHING, FOUND_KIOSK, FOUND_CLINIC, FOUND_ADMIN, FOUND_FAILURE, FOUND_WRONG };

/* Of the process itself, as its own peer. */
static enum found rights_here(void)
{
    int fd[2];
    struct peer peer;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, fd) != 0)
        return FOUND_WRONG;
    bool known = rights_of_peer(&rights, fd[0], &peer);
    close(fd[0]);
    close(fd[1]);
    if (!known)
        return FOUND_FAILURE;
    if (peer.pid != getpid() || peer.uid != geteuid())
        return FOUND_WRONG;
    return !peer.may ? FOUND_NOTHING : (enum found)(FOUND_KIOSK + (int)peer.right);
}

static const struct member_case {
    const char *what;
    uid_t uid;
    gid_t gid, member_of[2]; /* 0: none */
    size_t others;           /* further groups that mean nothing */
    bool scarce;
    enum found expect;
} member_cases[] = {
    { "a stranger", SOMEBODY, OTHERS, { 0 }, 3, false, FOUND_NOTHING },
    { "without any further group", SOMEBODY, OTHERS, { 0 }, 0, false, FOUND_NOTHING },
    { "by the first group", SOMEBODY, KIOSK, { 0 }, 0, false, FOUND_KIOSK },
    { "by a further one", SOMEBODY, OTHERS, { CLINIC }, 3, false, FOUND_CLINIC },
    { "the highest counts", SOMEBODY, KIOSK, { ADMIN, CLINIC }, 0, false, FOUND_ADMIN },
    { "a lower one takes nothing away", SOMEBODY, ADMIN, { KIOSK }, 0, false, FOUND_ADMIN },
    { "among 63 and it", SOMEBODY, OTHERS, { CLINIC }, 63, false, FOUND_CLINIC },
    { "among 64 and it", SOMEBODY, OTHERS, { CLINIC }, 64, false, FOUND_CLINIC },
    { "among very many", SOMEBODY, OTHERS, { ADMIN }, 3000, false, FOUND_ADMIN },
    { "few take no memory", SOMEBODY, OTHERS, { CLINIC }, 3, true, FOUND_CLINIC },
    { "many do, and there is none", SOMEBODY, OTHERS, { CLINIC }, 300, true, FOUND_FAILURE },
    { "the station's own user", 64000, OTHERS, { 0 }, 0, false, FOUND_ADMIN },
    { "root", 0, OTHERS, { 0 }, 0, false, FOUND_ADMIN },
};

/* In a process of its own, whose exit status is what it found. */
static enum found found_as(const struct member_case *c)
{
    static gid_t groups[4000];
    size_t n = 0;
    int status = 0;
    for (size_t i = 0; i < c->others; i++)
        groups[n++] = (gid_t)(OTHERS + 1 + i);
    for (size_t i = 0; i < 2 && c->member_of[i] != 0; i++)
        groups[n++] = c->member_of[i];
    fflush(NULL); /* or the child writes it as well */
    pid_t child = fork();
    if (child == 0) {
        if (setgroups(n, groups) != 0 || setegid(c->gid) != 0 || seteuid(c->uid) != 0)
            exit(FOUND_WRONG);
        if (c->scarce)
            scarce_begin(SCARCE_ALL, 0);
        enum found found = rights_here();
        (void)scarce_end();
        exit(seteuid(0) == 0 ? (int)found : FOUND_WRONG); /* what it leaves is root's */
    }
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &status, 0));
    return WIFEXITED(status) ? (enum found)WEXITSTATUS(status) : FOUND_WRONG;
}

static void test_members(void)
{
    if (getuid() != 0)
        TEST_IGNORE_MESSAGE("only root can become somebody else");
    for (size_t i = 0; i < sizeof member_cases / sizeof *member_cases; i++)
        TEST_ASSERT_EQUAL_INT_MESSAGE(member_cases[i].expect, found_as(&member_cases[i]),
                                      member_cases[i].what);
}

static void test_no_socket(void)
{
    int fd[2];
    struct peer peer = { .pid = 7 };
    TEST_ASSERT_EQUAL_INT(0, pipe(fd));
    TEST_ASSERT_FALSE(rights_of_peer(&rights, fd[0], &peer));
    TEST_ASSERT_FALSE(rights_of_peer(&rights, -1, &peer));
    TEST_ASSERT_EQUAL_INT(7, peer.pid); /* untouched */
    close(fd[0]);
    close(fd[1]);
}

/* A name that no group has gives nobody a right: not even those whose group is -1. */
static void test_groups_by_name(void)
{
    static const char *const names[RIGHTS] = {
        [RIGHT_KIOSK] = "root", [RIGHT_CLINIC] = "no-such-group", [RIGHT_ADMIN] = "daemon"
    };
    struct rights found;
    rights_init(&found, names);
    TEST_ASSERT_EQUAL_UINT(getuid(), found.own);
    TEST_ASSERT_EQUAL_UINT(0, found.group[RIGHT_KIOSK]);
    TEST_ASSERT_TRUE(found.group[RIGHT_CLINIC] == (gid_t)-1);
    TEST_ASSERT_EQUAL_UINT(getgrnam("daemon")->gr_gid, found.group[RIGHT_ADMIN]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_members);
    RUN_TEST(test_no_socket);
    RUN_TEST(test_groups_by_name);
    return UNITY_END();
}
