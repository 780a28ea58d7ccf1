/* inputs.c - device and inode of what is read, beside those of what is to be written. */
#include "cli/inputs.h"

#include <libgen.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "base/new_name.h"

void inputs_add(struct inputs *inputs, const char *what, const struct stat *file)
{
    if (!S_ISREG(file->st_mode) || inputs->n == INPUTS_MAX)
        return;
    inputs->file[inputs->n].what = what;
    inputs->file[inputs->n].device = file->st_dev;
    inputs->file[inputs->n].inode = file->st_ino;
    inputs->n++;
}

void inputs_add_path(struct inputs *inputs, const char *what, const char *path)
{
    struct stat file;
    if (path != NULL && stat(path, &file) == 0)
        inputs_add(inputs, what, &file);
}

void inputs_add_file(struct inputs *inputs, const char *path)
{
    struct stat file;
    if (strcmp(path, "-") != 0)
        inputs_add_path(inputs, "the input", path);
    else if (fstat(STDIN_FILENO, &file) == 0)
        inputs_add(inputs, "standard input", &file);
}

enum status inputs_check(const struct inputs *inputs, const char *path)
{
    struct stat file;
    if ((path != NULL ? stat(path, &file) : fstat(STDOUT_FILENO, &file)) != 0)
        return STATUS_OK;
    for (size_t i = 0; i < inputs->n; i++) {
        if (inputs->file[i].device != file.st_dev || inputs->file[i].inode != file.st_ino)
            continue;
        if (path != NULL)
            log_error("%s is %s itself; give another name with --out", path, inputs->file[i].what);
        else
            log_error("standard output is %s itself; send it to another file",
                      inputs->file[i].what);
        return STATUS_EXISTS;
    }
    return STATUS_OK;
}

/* A file that is not there yet is a name in a folder that is. */
static bool same_place(const char *path, const char *other)
{
    char text[4][NEW_NAME_SIZE];
    const char *const of[] = { path, path, other, other };
    struct stat folder[2];
    for (size_t i = 0; i < 4; i++)
        if (snprintf(text[i], sizeof text[i], "%s", of[i]) >= (int)sizeof text[i])
            return false;
    return stat(dirname(text[0]), &folder[0]) == 0 && stat(dirname(text[2]), &folder[1]) == 0 &&
           folder[0].st_dev == folder[1].st_dev && folder[0].st_ino == folder[1].st_ino &&
           strcmp(basename(text[1]), basename(text[3])) == 0;
}

bool inputs_same(const char *path, const char *other)
{
    struct stat file[2];
    bool first = stat(path, &file[0]) == 0, second = stat(other, &file[1]) == 0;
    if (first && second)
        return file[0].st_dev == file[1].st_dev && file[0].st_ino == file[1].st_ino;
    return !first && !second && same_place(path, other);
}
