/* answers.c - a file written row by row, and gone on with. */
#include "cli/answers.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "cli/cutter.h"
#include "cli/out.h"

/* Rows that are made again. */
enum { AGAIN = 16 };

static enum status failed(const struct answers *a)
{
    log_error("cannot write %s: %s", a->path, strerror(errno));
    return STATUS_IO;
}

static enum status not_ours(const struct answers *a, size_t row)
{
    log_error("%s: the rows from %zu on are not what this run answers: input, table, options or "
              "costs are others; go on with those of the first run, or begin anew with --force",
              a->path, row);
    return STATUS_FORMAT;
}

/* ---- what is there ------------------------------------------------------------------ */

/* Where the complete rows end, and the last AGAIN of them begin. */
struct survey {
    size_t rows;
    uint64_t begins[AGAIN];
    uint64_t whole;
};

static enum status look_through(const struct answers *a, uint64_t begin, struct survey *ret)
{
    struct cutter cutter;
    enum status s;
    *ret = (struct survey){ .whole = begin };
    cutter_init(&cutter, fileno(a->stream));
    cutter.records = a->kind == ANSWERS_CSV ? CUTTER_CSV : CUTTER_LINES;
    for (;;) {
        uint64_t from = begin + cutter.offset;
        size_t before = cutter.row;
        s = cutter_skip_rows(&cutter, 1);
        if (s != STATUS_OK || cutter.row == before || cutter.open)
            break;
        ret->begins[ret->rows++ % AGAIN] = from;
        ret->whole = begin + cutter.offset;
    }
    cutter_done(&cutter);
    if (s != STATUS_OK)
        log_error("%s: %s", a->path, s == STATUS_IO ? strerror(errno) : status_text(s));
    return s;
}

/* n bytes of the file, from there on. */
static enum status read_text(const struct answers *a, uint64_t from, size_t n, struct text *ret)
{
    char bytes[4096];
    while (n > 0) {
        ssize_t got =
            pread(fileno(a->stream), bytes, n < sizeof bytes ? n : sizeof bytes, (off_t)from);
        if (got <= 0) {
            log_error("%s: %s", a->path, got < 0 ? strerror(errno) : "it became shorter");
            return STATUS_IO;
        }
        text_add(ret, bytes, (size_t)got);
        from += (uint64_t)got;
        n -= (size_t)got;
    }
    return STATUS_OK;
}

static enum status check_begin(const struct answers *a, const struct text *begin, uint64_t size,
                               bool *begun)
{
    struct text there = { 0 };
    size_t n = size < begin->n ? (size_t)size : begin->n;
    enum status s = read_text(a, 0, n, &there);
    if (s == STATUS_OK && n > 0 && memcmp(there.bytes, begin->bytes, n) != 0) {
        log_error("%s: its columns are not those of this run; go on with the options of the first, "
                  "or begin anew with --force",
                  a->path);
        s = STATUS_FORMAT;
    }
    *begun = n == begin->n;
    text_done(&there);
    return s;
}

static enum status find_place(struct answers *a, const struct text *begin)
{
    struct stat st;
    struct survey survey;
    bool begun;
    if (fstat(fileno(a->stream), &st) != 0)
        return failed(a);
    enum status s = check_begin(a, begin, (uint64_t)st.st_size, &begun);
    if (s != STATUS_OK || !begun) /* not so much as its columns: as if it were not there */
        return s;
    if (lseek(fileno(a->stream), (off_t)begin->n, SEEK_SET) < 0)
        return failed(a);
    s = look_through(a, begin->n, &survey);
    if (s != STATUS_OK)
        return s;
    a->whole = survey.whole;
    a->rows_again = survey.rows < AGAIN ? survey.rows : AGAIN;
    a->rows_before = survey.rows - a->rows_again;
    if (a->rows_again == 0)
        return STATUS_OK;
    uint64_t from = survey.begins[a->rows_before % AGAIN];
    return read_text(a, from, (size_t)(a->whole - from), &a->again);
}

/* ---- the file ----------------------------------------------------------------------- */

static enum status open_array(struct answers *a, enum answers_mode mode)
{
    enum status s = new_file_begin(a->path, mode == ANSWERS_REPLACE, &a->file);
    a->stream = s == STATUS_OK ? a->file.stream : NULL;
    return s;
}

static enum status open_file(struct answers *a, enum answers_mode mode)
{
    struct stat st;
    if (a->kind == ANSWERS_ARRAY)
        return open_array(a, mode);
    int flags = O_RDWR | O_CREAT | O_CLOEXEC | (mode == ANSWERS_NEW ? O_EXCL : 0);
    if (stat(a->path, &st) == 0 && !S_ISREG(st.st_mode)) {
        log_error("%s is no regular file; without --out the answers go to standard output",
                  a->path);
        return STATUS_EXISTS;
    }
    int fd = open(a->path, flags, 0644);
    if (fd < 0 && errno == EEXIST) {
        log_error("%s exists already; --resume goes on with it, --force replaces it", a->path);
        return STATUS_EXISTS;
    }
    /* A task begun again beside the one it was to follow, say: rows of both would be mixed. */
    if (fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        log_error("%s: another skinspec match is writing it", a->path);
        close(fd);
        return STATUS_EXISTS;
    }
    a->stream = fd >= 0 ? fdopen(fd, "r+") : NULL;
    if (a->stream != NULL)
        return STATUS_OK;
    enum status s = failed(a);
    if (fd >= 0)
        close(fd);
    return s;
}

/* Behind the rows that are there. */
static enum status cut_off(struct answers *a)
{
    if (a->kind == ANSWERS_ARRAY) /* in a file of its own */
        return STATUS_OK;
    if (ftruncate(fileno(a->stream), (off_t)a->whole) != 0 ||
        lseek(fileno(a->stream), (off_t)a->whole, SEEK_SET) < 0)
        return failed(a);
    return STATUS_OK;
}

static enum status write_bytes(struct answers *a, const char *bytes, size_t n)
{
    if (fwrite(bytes, 1, n, a->stream) == n && fflush(a->stream) == 0)
        return STATUS_OK;
    if (a->path == NULL)
        out_exit(false); /* says so */
    else if (a->kind == ANSWERS_ARRAY)
        return failed(a);
    else
        log_error("cannot write %s: %s; the rows in it stay, and when this is mended, %s the same "
                  "command goes on",
                  a->path, strerror(errno), answers_how_to_go_on(a->mode));
    return STATUS_IO;
}

const char *answers_how_to_go_on(enum answers_mode mode)
{
    return mode == ANSWERS_REPLACE ? "with --resume in place of --force" : "with --resume";
}

enum status answers_open(const char *path, enum answers_mode mode, const struct text *begin,
                         enum answers_kind kind, struct answers *ret)
{
    struct answers a = {
        .path = path, .mode = mode, .kind = kind, .stream = path == NULL ? stdout : NULL
    };
    enum status s = STATUS_OK;
    if (path != NULL)
        s = open_file(&a, mode);
    if (s == STATUS_OK && path != NULL && mode == ANSWERS_RESUME)
        s = find_place(&a, begin);
    if (s == STATUS_OK && path != NULL && a.again.n == 0)
        s = cut_off(&a);
    if (s == STATUS_OK && a.whole == 0 && begin->n > 0)
        s = write_bytes(&a, begin->bytes, begin->n);
    *ret = a;
    if (s != STATUS_OK)
        answers_close(ret, false, false);
    return s;
}

/* What comes again has to be what is there. */
static enum status compare(struct answers *a, const char *bytes, size_t n)
{
    if (memcmp(bytes, a->again.bytes + a->same, n) != 0)
        return not_ours(a, a->rows_before + 1);
    a->same += n;
    return a->same == a->again.n ? cut_off(a) : STATUS_OK;
}

enum status answers_write(struct answers *a, const struct text *text)
{
    size_t left = a->again.n - a->same, n = text->n < left ? text->n : left;
    enum status s = n > 0 ? compare(a, text->bytes, n) : STATUS_OK;
    if (s != STATUS_OK || text->n == n)
        return s;
    return write_bytes(a, text->bytes + n, text->n - n);
}

enum status answers_close(struct answers *a, bool ended, bool whole)
{
    enum status s = STATUS_OK;
    if (ended && a->same < a->again.n) {
        log_error("%s has more rows than the input; it belongs to another", a->path);
        s = STATUS_FORMAT;
    }
    text_done(&a->again);
    if (a->path == NULL)
        return out_exit(true) == 0 ? s : STATUS_IO;
    if (a->stream != NULL && a->kind == ANSWERS_ARRAY)
        s = new_file_end(&a->file, whole);
    else if (a->stream != NULL && fclose(a->stream) != 0 && s == STATUS_OK)
        s = failed(a);
    a->stream = NULL;
    return s;
}
