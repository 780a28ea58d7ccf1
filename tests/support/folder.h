/* folder.h - a fresh folder for a test's files, below $BUILD (default "build"). */
#ifndef SKINSPEC_TESTS_SUPPORT_FOLDER_H
#define SKINSPEC_TESTS_SUPPORT_FOLDER_H

#include <stdbool.h>
#include <stddef.h>

enum { FOLDER_PATH_SIZE = 512, FOLDER_LIST_SIZE = 1024, FOLDER_FILES = 16 };

/* Make it; false where that fails.  folder_remove() takes its files along, but no
 * folders in it. */
bool folder_make(char folder[FOLDER_PATH_SIZE]);
void folder_remove(const char *folder);

/* Its names in order, hidden ones too, each followed by a blank: "a b ". */
const char *folder_list(const char *folder, char list[FOLDER_LIST_SIZE]);

/* "FOLDER/NAME", in a buffer of the caller's. */
const char *folder_path(const char *folder, const char *name, char path[FOLDER_PATH_SIZE]);

/* A whole file and a 0 after it, the caller's to free; NULL where it cannot be read. */
unsigned char *file_bytes(const char *path, size_t *size);
bool file_write(const char *path, const void *bytes, size_t size);

#endif
