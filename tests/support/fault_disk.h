/* fault_disk.h - the disk as SQLite sees it: it can be full or read-only, and it remembers what
 * was written, so that a power cut at any moment can be played.
 *
 * A VFS in front of the system's.  For one thread. */
#ifndef SKINSPEC_TESTS_SUPPORT_FAULT_DISK_H
#define SKINSPEC_TESTS_SUPPORT_FAULT_DISK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* From now on every new connection goes through it. */
bool fault_disk_install(void);

/* After so many more bytes writes fail: with the code, and errno set to the cause.  Negative:
 * none fails. */
void fault_disk_limit(int64_t bytes, int code, int cause);
bool fault_disk_met(void); /* one has failed since then */

/* fsync does nothing: for what need not survive. */
void fault_disk_skip_sync(bool skip);

/* ---- what was done to station.db and its WAL ---------------------------------------------- */

enum { FAULT_DISK_DB, FAULT_DISK_WAL, FAULT_DISK_FILES };

void fault_disk_record(void); /* begin anew */
size_t fault_disk_ops(void);  /* writes, truncations and syncs so far */
void fault_disk_stop(void);

/* ---- power cuts ------------------------------------------------------------------------------ */

struct fault_disk_file {
    unsigned char *bytes;
    size_t n;
};
struct fault_disk_image {
    struct fault_disk_file file[FAULT_DISK_FILES];
};

/* What a power cut does to writes that were not synced yet. */
enum fault_disk_cut {
    FAULT_DISK_KEPT,    /* all reached the disk */
    FAULT_DISK_DROPPED, /* none did */
    FAULT_DISK_TORN,    /* all did, but of the last a part */
    FAULT_DISK_SOME,    /* some did, in any order */
    FAULT_DISK_CUTS
};

/* The disk after the first `ops` of what was recorded, from `before` on.  The caller's to free
 * by fault_disk_image_done(). */
void fault_disk_cut(const struct fault_disk_image *before, size_t ops, enum fault_disk_cut cut,
                    uint64_t seed, struct fault_disk_image *ret);
void fault_disk_image_done(struct fault_disk_image *image);

#endif
