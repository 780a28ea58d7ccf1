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

bool costs_file_is_one(const char *path)
{
    static struct costs costs;
    char *text = calloc(1, BYTES_MAX + 1);
    FILE *f = text != NULL ? fopen(path, "r") : NULL;
    size_t n = f != NULL ? fread(text, 1, BYTES_MAX + 1, f) : 0, line;
    bool good = f != NULL && !ferror(f) && n <= BYTES_MAX && strlen(text) == n &&
                (n == 0 || costs_parse(text, &costs, &line) == STATUS_OK);
    if (f != NULL)
        fclose(f);
    free(text);
    return good;
}

static size_t lines_of(const char *text)
{
    size_t n = 0;
    for (const char *at = text; *at != '\0'; n++)
        at += strcspn(at, "\n") + (strchr(at, '\n') != NULL ? 1 : 0);
    return n;
}

static enum status parse(const char *path, const char *text, struct costs *costs)
{
    size_t line = 0;
    const char *wrong = "not a line of costs";
    enum status s = costs_parse(text, costs, &line);
    if (s == STATUS_OK && costs->counted)
        return s;
    if (s == STATUS_NO_MEMORY) {
        log_error("%s: %s", path, status_text(s));
        return s;
    }
    if (s == STATUS_OK) {
        line = 1;
        wrong = "no line '# costs: N' says how many there are, as of an older program, so the file "
                "may be cut short";
    } else if (line > lines_of(text)) {
        wrong = "the file ends too soon";
    }
    log_error("%s:%zu: %s; 'skinspec bench --calibrate' makes it anew", path, line, wrong);
    return STATUS_FORMAT;
}

enum status costs_file_read(const char *path, struct costs *ret)
{
    char *text = malloc(BYTES_MAX + 1);
    struct costs *costs = malloc(sizeof *costs);
    enum status s = text != NULL && costs != NULL ? read_text(path, text) : STATUS_NO_MEMORY;
    if (text == NULL || costs == NULL)
        log_error("%s: %s", path, status_text(s));
    if (s == STATUS_OK)
        s = parse(path, text, costs);
    if (s == STATUS_OK)
        *ret = *costs;
    free(costs);
    free(text);
    return s;
}
