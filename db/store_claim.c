/* store_claim.c - one writer: the lock on a state folder, and the numbers it keeps. */
#include "db/store.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

static const char *what_to_do(int error)
{
    switch (error) {
    case ENOENT:
        return "make the folder, or choose another state folder";
    case ENOTDIR:
        return "choose a folder";
    case ENOSPC:
    case EDQUOT:
        return "free some room";
    default:
        return "make it writable, or choose another state folder";
    }
}

static enum status lock_folder(const char *folder, int *ret)
{
    char path[STORE_PATH_SIZE];
    int fd = open(store_path(folder, "lock", path), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) {
        enum status s = sql_errno_status(errno);
        log_error("store: cannot write in '%s': %s; %s", folder, strerror(errno),
                  what_to_do(errno));
        return s;
    }
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
        *ret = fd;
        return STATUS_OK;
    }
    bool taken = errno == EWOULDBLOCK;
    log_error("store: '%s': %s", folder,
              taken ? "another process has it open for writing; stop that one first"
                    : strerror(errno));
    close(fd);
    return taken ? STATUS_EXISTS : STATUS_IO;
}

enum status store_claim(const char *state_folder, struct store_claim **ret)
{
    enum status s = store_folder_fits(state_folder);
    if (s != STATUS_OK)
        return s;
    struct store_claim *claim = calloc(1, sizeof *claim);
    if (claim == NULL)
        return STATUS_NO_MEMORY;
    memcpy(claim->folder, state_folder, strlen(state_folder) + 1);
    s = lock_folder(state_folder, &claim->lock);
    if (s == STATUS_OK)
        *ret = claim;
    else
        free(claim);
    return s;
}

/* The file stays: removing it would let two in. */
void store_claim_release(struct store_claim *claim)
{
    if (claim == NULL)
        return;
    close(claim->lock);
    free(claim);
}

const char *store_claim_folder(const struct store_claim *claim)
{
    return claim->folder;
}

/* ---- fences ------------------------------------------------------------------------- */

/* STATE/lock holds the last fence reserved, in digits: always as many, so that the number is
 * written over in its place, at once, and needs no room on a full disk. */
enum { FENCE_DIGITS = 19, FENCE_LINE = FENCE_DIGITS + 1 };
#define FENCE_LAST INT64_C(9007199254740991) /* the protocol's largest integer, 2^53 - 1 */

/* 0 where the file says none, as that of an older program. */
static enum status read_reserved(const struct store_claim *claim, int64_t *ret)
{
    char line[FENCE_LINE + 1] = "";
    ssize_t n = pread(claim->lock, line, FENCE_LINE, 0);
    if (n < 0) {
        enum status s = sql_errno_status(errno);
        log_error("store: cannot read '%s/lock': %s", claim->folder, strerror(errno));
        return s;
    }
    bool good = n == 0 || (n == FENCE_LINE && strspn(line, "0123456789") == FENCE_DIGITS &&
                           line[FENCE_DIGITS] == '\n');
    if (!good)
        log_warning("store: '%s/lock' does not hold a number of leases; they go on above those "
                    "on record",
                    claim->folder);
    *ret = good && n > 0 ? strtoll(line, NULL, 10) : 0;
    return STATUS_OK;
}

static enum status write_reserved(const struct store_claim *claim, int64_t last)
{
    char line[FENCE_LINE + 1];
    snprintf(line, sizeof line, "%0*" PRId64 "\n", FENCE_DIGITS, last);
    errno = EIO; /* of a write cut short */
    if (pwrite(claim->lock, line, FENCE_LINE, 0) == FENCE_LINE && fdatasync(claim->lock) == 0)
        return STATUS_OK;
    enum status s = sql_errno_status(errno);
    log_error("store: cannot write '%s/lock': %s", claim->folder, strerror(errno));
    return s;
}

enum status store_reserve_fences(struct store_claim *claim, int64_t above, int64_t n,
                                 int64_t *first)
{
    int64_t last = 0;
    enum status s = read_reserved(claim, &last);
    if (s != STATUS_OK)
        return s;
    last = last > above ? last : above;
    if (last > FENCE_LAST - n) {
        log_error("store: '%s': the numbers of leases have run out", claim->folder);
        return STATUS_RANGE;
    }
    s = write_reserved(claim, last + n);
    if (s == STATUS_OK)
        *first = last + 1;
    return s;
}
