/* new_file.c - a temporary file beside the target, renamed at the end. */
#include "cli/new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"

static enum status failed(const char *path, int error)
{
    if (error == EEXIST) {
        log_error("%s exists already; --force replaces it", path);
        return STATUS_EXISTS;
    }
    log_error("cannot write %s: %s", path, strerror(error));
    return STATUS_IO;
}

enum status new_file_begin(const char *path, bool overwrite, struct new_file *ret)
{
    struct new_file f = { .path = path, .overwrite = overwrite };
    struct stat there;
    if (stat(path, &there) == 0) {
        if (!S_ISREG(there.st_mode)) {
            log_error("%s is no regular file; without --out the text goes to standard output",
                      path);
            return STATUS_EXISTS;
        }
        if (!overwrite)
            return failed(path, EEXIST);
    }
    enum status s = new_name_make(path, f.temporary);
    if (s != STATUS_OK) {
        log_error("cannot write %s: %s", path,
                  s == STATUS_RANGE ? "it is not a file name" : status_text(s));
        return STATUS_IO;
    }
    int fd = open(f.temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (fd < 0)
        return failed(path, errno);
    f.stream = fdopen(fd, "w");
    if (f.stream == NULL) {
        close(fd);
        unlink(f.temporary);
        return STATUS_NO_MEMORY;
    }
    *ret = f;
    return STATUS_OK;
}

enum status new_file_end(struct new_file *f, bool keep)
{
    enum status s = STATUS_OK;
    bool failed_before = ferror(f->stream) != 0;
    errno = 0;
    if (keep && (fflush(f->stream) != 0 || fsync(fileno(f->stream)) != 0 || failed_before))
        s = failed(f->path, errno != 0 ? errno : EIO);
    fclose(f->stream);
    if (keep && s == STATUS_OK && new_name_take(f->temporary, f->path, f->overwrite) != 0)
        s = failed(f->path, errno);
    if (!keep || s != STATUS_OK)
        unlink(f->temporary);
    return s;
}
