/* costs_file.c - where the file is, and all of it read. */
#include "db/costs_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"

enum { BYTES_MAX = 256 * 1024 }; /* COSTS_MAX lines are 30 KB */

enum status costs_file_path(char ret[COSTS_PATH_SIZE])
{
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int n;
    if (state != NULL && state[0] == '/')
        n = snprintf(ret, COSTS_PATH_SIZE, "%s/skinspec/costs.csv", state);
    else if (home != NULL && home[0] == '/')
        n = snprintf(ret, COSTS_PATH_SIZE, "%s/.local/state/skinspec/costs.csv", home);
    else
        return STATUS_NOT_FOUND;
    return n >= 0 && n < COSTS_PATH_SIZE ? STATUS_OK : STATUS_RANGE;
}

static enum status read_text(const char *path, char *text)
{
    FILE *f = fopen(path, "r");
    if (f == NULL && errno == ENOENT)
        return STATUS_NOT_FOUND;
    if (f == NULL) {
        log_error("cannot read %s: %s", path, strerror(errno));
        return STATUS_IO;
    }
    size_t n = fread(text, 1, BYTES_MAX, f);
    enum status s = STATUS_OK;
    if (ferror(f)) {
        log_error("cannot read %s: %s", path, strerror(errno));
        s = STATUS_IO;
    } else if (n == BYTES_MAX || memchr(text, '\0', n) != NULL) {
        log_error("%s is no file of costs; 'skinspec bench --calibrate' makes one", path);
        s = STATUS_FORMAT;
    }
    text[n < BYTES_MAX ? n : 0] = '\0';
    fclose(f);
    return s;
}

enum status costs_file_read(const char *path, struct costs *ret)
{
    size_t line = 0;
    char *text = malloc(BYTES_MAX + 1);
    if (text == NULL) {
        log_error("%s: %s", path, status_text(STATUS_NO_MEMORY));
        return STATUS_NO_MEMORY;
    }
    enum status s = read_text(path, text);
    if (s == STATUS_OK) {
        s = costs_parse(text, ret, &line);
        if (s != STATUS_OK)
            log_error(
                "%s:%zu: not a line of costs; 'skinspec bench --calibrate' makes the file anew",
                path, line);
    }
    free(text);
    return s;
}
