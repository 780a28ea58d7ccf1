/* store_claim.c - one writer: the lock on a state folder. */
#include "db/store.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

static enum status lock_folder(const char *folder, int *ret)
{
    char path[STORE_PATH_SIZE];
    int fd = open(store_path(folder, "lock", path), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) {
        enum status s = sql_errno_status(errno);
        log_error("store: cannot write in '%s': %s", folder, strerror(errno));
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
