/* map_file.c - written in place by pwrite(), noted beside it, renamed at the end. */
#include "cli/map_file.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "base/number.h"
#include "cli/new_file.h"

static const char notice[] = "A map that was stopped; run the same command with --resume.\n";
static const char replaces[] = "replaces a map: yes\n";
static const char lines_done[] = "lines done: ";
enum { NOTE_MOST = 1 << 16 };

static enum status failed(const char *what, const char *path, int error)
{
    log_error("cannot %s %s: %s", what, path, strerror(error));
    return error == ENOSPC || error == EDQUOT || error == EFBIG ? STATUS_FULL : STATUS_IO;
}

static bool is_there(const char *path)
{
    struct stat there;
    return lstat(path, &there) == 0;
}

static uint64_t size_of(const struct map_file *f)
{
    return (uint64_t)f->samples * f->lines * f->bands * sizeof(float);
}

/* ---- the note beside it ------------------------------------------------------------- */

enum status map_file_note(const struct map_file *f, size_t done)
{
    struct new_file note;
    if (done > 0 && fdatasync(f->fd) != 0)
        return failed("write", f->part, errno);
    enum status s = new_file_begin(f->resume, true, &note);
    if (s != STATUS_OK)
        return s;
    fprintf(note.stream, "%s%s%s%s%zu\n", notice, f->key, f->replace ? replaces : "", lines_done,
            done);
    return new_file_end(&note, true);
}

/* what: a map, begun or whole, that is of another key. */
static enum status other_key(const struct map_file *f, const char *what, const char *was)
{
    const char *is = f->key;
    size_t same = 0;
    for (size_t i = 0; was[i] != '\0' && was[i] == is[i]; i++)
        if (is[i] == '\n')
            same = i + 1;
    log_error("%s was made with '%.*s', this is '%.*s'; what is there cannot be gone on with "
              "(--force begins anew)",
              what, (int)strcspn(was + same, "\n"), was + same, (int)strcspn(is + same, "\n"),
              is + same);
    return STATUS_EXISTS;
}

static enum status no_note(const struct map_file *f)
{
    log_error("%s does not say what %s is made of; --force begins anew", f->resume, f->part);
    return STATUS_EXISTS;
}

static enum status take_note(struct map_file *f, char *text)
{
    size_t done;
    char *lines = strstr(text, lines_done), *end = lines != NULL ? strchr(lines, '\n') : NULL;
    if (strncmp(text, notice, sizeof notice - 1) != 0 || end == NULL)
        return no_note(f);
    char *was = text + sizeof notice - 1;
    *lines = *end = '\0';
    size_t n = strlen(was), tail = sizeof replaces - 1;
    if (n >= tail && strcmp(was + n - tail, replaces) == 0) {
        was[n - tail] = '\0';
        f->replace = true;
    }
    if (strcmp(was, f->key) != 0) /* of another shape, perhaps: before its lines */
        return other_key(f, f->part, was);
    if (number_parse_count(lines + sizeof lines_done - 1, f->lines, &done) != STATUS_OK)
        return no_note(f);
    f->done = done;
    return STATUS_OK;
}

/* A header tells it behind semicolons, as ENVI's remarks. */
static enum status take_header(struct map_file *f, char *text)
{
    char *was = text, *end = text;
    for (char *line = text, *next; *line != '\0'; line = next) {
        size_t n = strcspn(line, "\n");
        next = line + n + (line[n] == '\n');
        if (strncmp(line, MAP_FILE_KEY_LINE, sizeof MAP_FILE_KEY_LINE - 1) == 0) {
            line += sizeof MAP_FILE_KEY_LINE - 1;
            memmove(end, line, (size_t)(next - line)); /* never beyond what was read */
            end += next - line;
        }
    }
    *end = '\0';
    if (strcmp(was, f->key) != 0)
        return other_key(f, f->image, was);
    f->done = f->lines;
    return STATUS_OK;
}

typedef enum status take_text(struct map_file *f, char *text);

static enum status read_key(struct map_file *f, const char *path, take_text *take)
{
    char *text = calloc(1, NOTE_MOST + 1);
    FILE *file = fopen(path, "rb");
    enum status s = STATUS_NO_MEMORY;
    if (text != NULL && file != NULL) {
        (void)fread(text, 1, NOTE_MOST, file);
        s = take(f, text);
    } else if (text != NULL) {
        s = no_note(f);
    }
    if (file != NULL)
        fclose(file);
    free(text);
    return s;
}

/* ---- opened ------------------------------------------------------------------------- */

static enum status names(const char *prefix, struct map_file *f)
{
    const struct {
        char *name;
        const char *ending;
    } all[] = { { f->prefix, "" },
                { f->image, ".img" },
                { f->header, ".hdr" },
                { f->part, ".img.part" },
                { f->resume, ".img.resume" } };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        if (snprintf(all[i].name, MAP_FILE_PATH_SIZE, "%s%s", prefix, all[i].ending) >=
            MAP_FILE_PATH_SIZE - 64) { /* pictures add more */
            log_error("%s: the name is too long", prefix);
            return STATUS_RANGE;
        }
    }
    return STATUS_OK;
}

static bool is_whole(const struct map_file *f)
{
    return is_there(f->image) && is_there(f->header) && !is_there(f->part);
}

static enum status exists(const char *there)
{
    log_error("%s exists already; --force replaces it, --out NAME makes another", there);
    return STATUS_EXISTS;
}

static enum status look(const struct map_file *f)
{
    bool begun = is_there(f->part);
    const char *there = is_there(f->image) ? f->image : is_there(f->header) ? f->header : NULL;
    /* What is gone on with: its note says whether it replaces a map; its header may be there
     * since its last moment. */
    if (there != NULL && !f->replace && !(begun && f->go_on))
        return exists(there);
    if (begun && !f->go_on && !f->replace) {
        log_error("%s: a run was stopped here; --resume goes on with it, --force begins anew",
                  f->part);
        return STATUS_EXISTS;
    }
    return STATUS_OK;
}

/* Nobody else makes the same map meanwhile. */
static enum status open_part(struct map_file *f, bool go_on)
{
    f->fd = open(f->part, O_RDWR | O_CLOEXEC | O_NOFOLLOW | (go_on ? 0 : O_CREAT), 0644);
    if (f->fd < 0)
        return failed("write", f->part, errno);
    if (flock(f->fd, LOCK_EX | LOCK_NB) != 0) {
        log_error("%s: another skinspec map is making it", f->part);
        close(f->fd);
        f->fd = -1;
        return STATUS_EXISTS;
    }
    return STATUS_OK;
}

/* All of its room is taken at once: a disk too small is found out before the work, not after. */
static enum status begin(struct map_file *f)
{
    f->done = 0;
    (void)unlink(f->resume);
    int error = ftruncate(f->fd, 0) != 0 ? errno : posix_fallocate(f->fd, 0, (off_t)size_of(f));
    enum status s = error != 0 ? failed("make room for", f->part, error) : map_file_note(f, 0);
    if (s != STATUS_OK) {
        (void)unlink(f->part);
        (void)unlink(f->resume);
    }
    return s;
}

enum status map_file_open(const char *prefix, struct map_file *f)
{
    f->fd = -1;
    enum status s = names(prefix, f);
    if (s == STATUS_OK && f->go_on && !f->replace && is_whole(f))
        return read_key(f, f->header, take_header);
    if (s == STATUS_OK)
        s = look(f);
    if (s != STATUS_OK)
        return s;
    bool go_on = f->go_on && is_there(f->part);
    s = open_part(f, go_on);
    if (s != STATUS_OK)
        return s;
    struct stat there;
    if (!go_on) {
        s = begin(f);
    } else {
        s = read_key(f, f->resume, take_note);
        if (s == STATUS_OK && (fstat(f->fd, &there) != 0 || (uint64_t)there.st_size != size_of(f)))
            s = no_note(f);
        if (s == STATUS_OK && !f->replace && is_there(f->image))
            s = exists(f->image);
    }
    if (s != STATUS_OK)
        map_file_close(f);
    return s;
}

void map_file_close(struct map_file *f)
{
    if (f->fd >= 0)
        close(f->fd);
    f->fd = -1;
}

/* ---- values ------------------------------------------------------------------------- */

static off_t place(const struct map_file *f, size_t band, size_t line, size_t sample)
{
    return (off_t)((((uint64_t)band * f->lines + line) * f->samples + sample) * sizeof(float));
}

enum status map_file_write(const struct map_file *f, size_t band, size_t line, size_t sample,
                           size_t n, const float *value)
{
    const char *from = (const char *)value;
    off_t at = place(f, band, line, sample);
    for (size_t left = n * sizeof *value; left > 0;) {
        ssize_t wrote = pwrite(f->fd, from, left, at);
        if (wrote < 0 && errno == EINTR)
            continue;
        if (wrote <= 0)
            return failed("write", f->part, wrote < 0 ? errno : ENOSPC);
        from += wrote;
        at += wrote;
        left -= (size_t)wrote;
    }
    return STATUS_OK;
}

enum status map_file_read(const struct map_file *f, size_t band, size_t line, size_t lines,
                          float *value)
{
    char *to = (char *)value;
    off_t at = place(f, band, line, 0);
    for (size_t left = lines * f->samples * sizeof *value; left > 0;) {
        ssize_t got = pread(f->fd, to, left, at);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return failed("read", f->part, got < 0 ? errno : EIO);
        to += got;
        at += got;
        left -= (size_t)got;
    }
    return STATUS_OK;
}

/* ---- whole -------------------------------------------------------------------------- */

enum status map_file_finish(struct map_file *f, const char *header)
{
    struct new_file file;
    if (fsync(f->fd) != 0)
        return failed("write", f->part, errno);
    enum status s = new_file_begin(f->header, f->replace || f->go_on, &file);
    if (s != STATUS_OK)
        return s;
    fputs(header, file.stream);
    s = new_file_end(&file, true);
    if (s != STATUS_OK)
        return s;
    if (new_name_take(f->part, f->image, f->replace) != 0)
        return failed("write", f->image, errno);
    (void)unlink(f->resume);
    return STATUS_OK;
}
