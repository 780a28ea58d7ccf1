/* new_file.c - a temporary file beside the target, renamed at the end. */
#define _GNU_SOURCE /* renameat2 */
#include "cli/new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "base/uuid.h"

static enum status failed(const char *path, int error)
{
    if (error == EEXIST) {
        log_error("%s exists already; --force replaces it", path);
        return STATUS_EXISTS;
    }
    log_error("cannot write %s: %s", path, strerror(error));
    return STATUS_IO;
}

/* ".NAME.RANDOM.tmp" beside the target: the same file system, and nobody else's. */
static bool name_temporary(struct new_file *f)
{
    char random[UUID_TEXT_SIZE];
    const char *slash = strrchr(f->path, '/');
    int folder = slash != NULL ? (int)(slash + 1 - f->path) : 0;
    if (uuid4_make(random) != STATUS_OK)
        return false;
    int n = snprintf(f->temporary, sizeof f->temporary, "%.*s.%s.%s.tmp", folder, f->path,
                     f->path + folder, random);
    return n > 0 && (size_t)n < sizeof f->temporary;
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
    if (!name_temporary(&f))
        return failed(path, ENAMETOOLONG);
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

/* Without replacing anything unasked; some file systems cannot promise that by a rename, but
 * a second name can be had on most. */
static int take_name(const struct new_file *f)
{
    unsigned flags = f->overwrite ? 0 : RENAME_NOREPLACE;
    if (renameat2(AT_FDCWD, f->temporary, AT_FDCWD, f->path, flags) == 0)
        return 0;
    if (errno != EINVAL || flags == 0 || link(f->temporary, f->path) != 0)
        return -1;
    return unlink(f->temporary);
}

enum status new_file_end(struct new_file *f, bool keep)
{
    enum status s = STATUS_OK;
    bool failed_before = ferror(f->stream) != 0;
    errno = 0;
    if (keep && (fflush(f->stream) != 0 || fsync(fileno(f->stream)) != 0 || failed_before))
        s = failed(f->path, errno != 0 ? errno : EIO);
    fclose(f->stream);
    if (keep && s == STATUS_OK && take_name(f) != 0)
        s = failed(f->path, errno);
    if (!keep || s != STATUS_OK)
        unlink(f->temporary);
    return s;
}
