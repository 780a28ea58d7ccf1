/* replay_script.c - the lines `@ WORD {...}` of a capture. */
#include "cli/replay_script.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "cli/out.h"
#include "drivers/link/capture.h"
#include "station/strict_json.h"

static const char *const words[] = {
    [REPLAY_CONFIGURE] = "configure", [REPLAY_CALIBRATE] = "calibrate",
    [REPLAY_MEASURE] = "measure",     [REPLAY_NEXT] = "next",
    [REPLAY_BUTTON] = "button",       [REPLAY_REFUSED] = "refused",
    [REPLAY_CANCELLED] = "cancelled", [REPLAY_RECORD] = "record",
    [REPLAY_STATION] = "station",
};
enum { WORDS = sizeof words / sizeof *words };

static void *more(void *array, size_t n, size_t size)
{
    void *larger = realloc(array, (n + 1) * size);
    if (larger == NULL)
        out_of_memory();
    return larger;
}

/* ---- a step ------------------------------------------------------------------------- */

static enum status read_step(const char *path, const struct capture_line *line,
                             struct replay_step *ret)
{
    size_t word = strcspn(line->text, " "), kind = 0;
    const char *json = line->text + word + (line->text[word] == ' ');
    enum strict_json_fault fault;
    while (kind < WORDS &&
           (strlen(words[kind]) != word || strncmp(words[kind], line->text, word) != 0))
        kind++;
    if (kind == WORDS) {
        log_error("%s:%u: nothing is known of '@ %.*s'; a newer skinspec may know", path,
                  line->line, (int)(word < 40 ? word : 40), line->text);
        return STATUS_FORMAT;
    }
    *ret = (struct replay_step){ .kind = (enum replay_kind)kind, .line = line->line };
    if (*json == '\0')
        json = "{}";
    enum status s = strict_json_parse(json, strlen(json), &ret->what, &fault, NULL);
    if (s == STATUS_OK && cJSON_IsObject(ret->what))
        return STATUS_OK;
    if (s == STATUS_OK)
        cJSON_Delete(ret->what);
    if (s == STATUS_NO_MEMORY)
        out_of_memory();
    log_error("%s:%u: what follows '@ %s' is damaged: no JSON object", path, line->line,
              words[kind]);
    return STATUS_FORMAT;
}

static void add_step(struct replay_part *part, const struct replay_step *step)
{
    part->steps = more(part->steps, part->n, sizeof *part->steps);
    part->steps[part->n++] = *step;
}

/* ---- parts -------------------------------------------------------------------------- */

static void begin_part(struct replay_script *script, unsigned line)
{
    script->parts = more(script->parts, script->n, sizeof *script->parts);
    script->parts[script->n++] = (struct replay_part){ .first_line = line, .end_line = line + 1 };
}

static void free_part(struct replay_part *part)
{
    for (size_t i = 0; i < part->n; i++)
        cJSON_Delete(part->steps[i].what);
    free(part->steps);
}

/* Opened and lost again, or opened in vain. */
static void leave_out_idle_parts(struct replay_script *script)
{
    size_t kept = 0;
    for (size_t i = 0; i < script->n; i++) {
        if (script->parts[i].n > 0)
            script->parts[kept++] = script->parts[i];
        else
            free_part(&script->parts[i]);
    }
    script->n = kept;
}

/* The last configure of the part that was not refused; NULL. */
static const struct replay_step *last_setup(const struct replay_part *part)
{
    for (size_t i = part->n; i-- > 0;)
        if (part->steps[i].kind == REPLAY_CONFIGURE &&
            (i + 1 == part->n || part->steps[i + 1].kind != REPLAY_REFUSED))
            return &part->steps[i];
    return NULL;
}

static void carry_setups(struct replay_script *script)
{
    for (size_t i = 1; i < script->n; i++) {
        const struct replay_step *setup = last_setup(&script->parts[i - 1]);
        struct replay_part *part = &script->parts[i];
        if (setup == NULL)
            continue;
        struct replay_step again = { REPLAY_CONFIGURE, 0, cJSON_Duplicate(setup->what, true) };
        if (again.what == NULL)
            out_of_memory();
        add_step(part, &again);
        memmove(part->steps + 1, part->steps, (part->n - 1) * sizeof again);
        part->steps[0] = again;
    }
}

/* ---- reading ------------------------------------------------------------------------ */

static enum status take_line(struct replay_script *script, const struct capture_line *line)
{
    struct replay_part *part = script->n > 0 ? &script->parts[script->n - 1] : NULL;
    struct replay_step step;
    if (line->kind == CAPTURE_DRIVER && script->driver == NULL) {
        script->driver = strdup(line->text);
        return script->driver != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    }
    if (line->kind == CAPTURE_OPEN) {
        if (part == NULL)
            script->header_lines = line->line - 1;
        begin_part(script, line->line);
        return STATUS_OK;
    }
    if (part != NULL)
        part->end_line = line->line + 1;
    if (line->kind != CAPTURE_ASKED)
        return STATUS_OK;
    enum status s = read_step(script->path, line, &step);
    if (s == STATUS_OK && step.kind == REPLAY_STATION) {
        cJSON_Delete(script->station);
        script->station = step.what;
    } else if (s == STATUS_OK && part != NULL) {
        add_step(part, &step);
    } else if (s == STATUS_OK) { /* before it was ever open: it cannot have been done */
        cJSON_Delete(step.what);
    }
    return s;
}

static enum status check(const struct replay_script *script)
{
    if (script->driver == NULL) {
        log_error("%s: no line 'driver NAME': the capture does not say whose it is", script->path);
        return STATUS_FORMAT;
    }
    if (script->n > 0)
        return STATUS_OK;
    log_error("%s: nothing was asked in this capture (no lines '@ measure ...'): what "
              "'skinspecd --record FILE' writes while somebody measures can be replayed",
              script->path);
    return STATUS_FORMAT;
}

enum status replay_script_read(const char *path, struct replay_script *ret)
{
    struct replay_script script = { .path = strdup(path) };
    struct capture_file file;
    if (script.path == NULL)
        out_of_memory();
    enum status s = capture_read(path, &file);
    if (s != STATUS_OK) {
        free(script.path);
        return s;
    }
    for (size_t i = 0; i < file.n && s == STATUS_OK; i++)
        s = take_line(&script, &file.lines[i]);
    capture_free(&file);
    if (s == STATUS_OK) {
        leave_out_idle_parts(&script);
        carry_setups(&script);
        s = check(&script);
    }
    if (s != STATUS_OK) {
        replay_script_free(&script);
        return s;
    }
    *ret = script;
    return STATUS_OK;
}

void replay_script_free(struct replay_script *script)
{
    for (size_t i = 0; i < script->n; i++)
        free_part(&script->parts[i]);
    free(script->parts);
    cJSON_Delete(script->station);
    free(script->driver);
    free(script->path);
    *script = (struct replay_script){ 0 };
}

/* ---- writing a part ----------------------------------------------------------------- */

static bool copy_lines(const struct replay_script *script, size_t i, FILE *from, FILE *to)
{
    const struct replay_part *part = &script->parts[i];
    char *line = NULL;
    size_t room = 0;
    ssize_t n;
    for (unsigned number = 1; (n = getline(&line, &room, from)) > 0; number++)
        if (number <= script->header_lines ||
            (number >= part->first_line && number < part->end_line))
            fwrite(line, 1, (size_t)n, to);
    free(line);
    return !ferror(from) && fflush(to) == 0 && !ferror(to);
}

enum status replay_script_write(const struct replay_script *script, size_t i, const char *to)
{
    FILE *from = fopen(script->path, "re"), *part = fopen(to, "we");
    bool good = from != NULL && part != NULL && copy_lines(script, i, from, part);
    int why = errno;
    if (from != NULL)
        fclose(from);
    if (part != NULL)
        good = fclose(part) == 0 && good;
    if (!good)
        log_error("cannot copy %s to %s: %s", script->path, to, strerror(why));
    return good ? STATUS_OK : STATUS_IO;
}
