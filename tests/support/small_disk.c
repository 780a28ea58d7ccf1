/* small_disk.c - a tmpfs in a name space of its own. */
#define _GNU_SOURCE /* unshare */
#include "tests/support/small_disk.h"

#include <fcntl.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

static bool say_to(const char *file, const char *text)
{
    int fd = open(file, O_WRONLY);
    bool good = fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text);
    if (fd >= 0)
        close(fd);
    return good;
}

/* Who is not root becomes it in a name space of users first. */
static bool own_mounts(void)
{
    char uid[32], gid[32];
    snprintf(uid, sizeof uid, "0 %u 1", (unsigned)getuid());
    snprintf(gid, sizeof gid, "0 %u 1", (unsigned)getgid());
    if (unshare(CLONE_NEWNS) == 0)
        return true;
    return unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0 && say_to("/proc/self/uid_map", uid) &&
           say_to("/proc/self/setgroups", "deny") && say_to("/proc/self/gid_map", gid);
}

bool small_disk_mount(const char *folder)
{
    return own_mounts() && mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) == 0 &&
           mount("none", folder, "tmpfs", 0, "size=1m") == 0;
}

bool small_disk_remount(const char *folder, bool read_only)
{
    return mount("none", folder, NULL, MS_REMOUNT | (read_only ? MS_RDONLY : 0), "size=1m") == 0;
}

int small_disk_child(int (*body)(void))
{
    int ended = 0;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0)
        exit(body());
    if (child < 0 || waitpid(child, &ended, 0) != child || !WIFEXITED(ended))
        return -1;
    return WEXITSTATUS(ended);
}
