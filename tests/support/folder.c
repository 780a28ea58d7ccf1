/* folder.c - a temporary folder, its list, and files as bytes. */
#include "tests/support/folder.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool folder_make(char folder[FOLDER_PATH_SIZE])
{
    const char *build = getenv("BUILD");
    if (build == NULL || *build == '\0')
        build = "build";
    int n = snprintf(folder, FOLDER_PATH_SIZE, "%s/test-XXXXXX", build);
    return n > 0 && n < FOLDER_PATH_SIZE && mkdtemp(folder) != NULL;
}

const char *folder_path(const char *folder, const char *name, char path[FOLDER_PATH_SIZE])
{
    if (snprintf(path, FOLDER_PATH_SIZE, "%s/%s", folder, name) >= FOLDER_PATH_SIZE)
        abort();
    return path;
}

void folder_remove(const char *folder)
{
    DIR *d = opendir(folder);
    if (d == NULL)
        return;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        char path[FOLDER_PATH_SIZE];
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0)
            (void)unlink(folder_path(folder, e->d_name, path));
    }
    closedir(d);
    (void)rmdir(folder);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(a, b);
}

const char *folder_list(const char *folder, char list[FOLDER_LIST_SIZE])
{
    char name[FOLDER_FILES][256];
    size_t n = 0, used = 0;
    DIR *d = opendir(folder);
    list[0] = '\0';
    if (d == NULL)
        return "(no such folder)";
    for (struct dirent *e; n < FOLDER_FILES && (e = readdir(d)) != NULL;)
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0)
            snprintf(name[n++], sizeof name[0], "%s", e->d_name);
    closedir(d);
    qsort(name, n, sizeof name[0], by_name);
    for (size_t i = 0; i < n; i++) {
        int added = snprintf(list + used, FOLDER_LIST_SIZE - used, "%s ", name[i]);
        if (added < 0 || used + (size_t)added >= FOLDER_LIST_SIZE)
            abort();
        used += (size_t)added;
    }
    return list;
}

unsigned char *file_bytes(const char *path, size_t *size)
{
    struct stat st;
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return NULL;
    unsigned char *bytes = NULL;
    if (fstat(fileno(f), &st) == 0) {
        *size = (size_t)st.st_size;
        bytes = calloc(*size + 1, 1);
        if (bytes != NULL && fread(bytes, 1, *size, f) != *size) {
            free(bytes);
            bytes = NULL;
        }
    }
    fclose(f);
    return bytes;
}

bool file_write(const char *path, const void *bytes, size_t size)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL)
        return false;
    bool good = size == 0 || fwrite(bytes, 1, size, f) == size;
    return fclose(f) == 0 && good;
}
