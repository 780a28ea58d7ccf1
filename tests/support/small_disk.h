/* small_disk.h - a file system of a megabyte that only this process sees.
 *
 * For a child process: the mounts end with it. */
#ifndef SKINSPEC_TESTS_SUPPORT_SMALL_DISK_H
#define SKINSPEC_TESTS_SUPPORT_SMALL_DISK_H

#include <stdbool.h>

/* Mount it over a folder; false without the right to. */
bool small_disk_mount(const char *folder);

/* As an administrator, or a kernel that met errors, remounts it. */
bool small_disk_remount(const char *folder, bool read_only);

/* Run `body` in a child; its exit status, or SMALL_DISK_NONE, which body may return too. */
enum { SMALL_DISK_NONE = 77 };
int small_disk_child(int (*body)(void));

#endif
