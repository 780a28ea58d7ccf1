/* fault_disk.c - a VFS that limits and records, and the disk after a power cut. */
#include "tests/support/fault_disk.h"

#include <errno.h>
#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/dice.h"

enum what { WRITE, TRUNCATE, SYNC };

struct operation {
    enum what what;
    int file;
    size_t at, n; /* TRUNCATE: to size n */
    unsigned char *bytes;
};

static sqlite3_vfs *usual, shim;
static int64_t left = -1;
static int fail_code, fail_cause;
static bool failed, skip_sync, recording;
static struct operation *ops;
static size_t ops_n, ops_room;

/* ---- recording ----------------------------------------------------------------------------- */

static void *must(void *memory)
{
    if (memory == NULL)
        abort();
    return memory;
}

static void note(int file, enum what what, size_t at, const void *bytes, size_t n)
{
    if (!recording || file < 0)
        return;
    if (ops_n == ops_room) {
        ops_room = ops_room * 2 + 64;
        ops = must(realloc(ops, ops_room * sizeof *ops));
    }
    struct operation *op = &ops[ops_n++];
    *op = (struct operation){ .what = what, .file = file, .at = at, .n = n };
    if (bytes != NULL)
        op->bytes = memcpy(must(malloc(n)), bytes, n);
}

void fault_disk_record(void)
{
    fault_disk_stop();
    for (size_t i = 0; i < ops_n; i++)
        free(ops[i].bytes);
    ops_n = 0;
    recording = true;
}

size_t fault_disk_ops(void)
{
    return ops_n;
}

void fault_disk_stop(void)
{
    recording = false;
}

/* ---- the files ---------------------------------------------------------------------- */

struct shim_file {
    sqlite3_file base;
    int which; /* FAULT_DISK_DB, _WAL, or -1: not recorded */
    sqlite3_file *real;
};

static sqlite3_file *real_of(sqlite3_file *file)
{
    return ((struct shim_file *)file)->real;
}

static int which_of(sqlite3_file *file)
{
    return ((struct shim_file *)file)->which;
}

static int shim_close(sqlite3_file *file)
{
    return real_of(file)->pMethods->xClose(real_of(file));
}

static int shim_read(sqlite3_file *file, void *bytes, int n, sqlite3_int64 at)
{
    return real_of(file)->pMethods->xRead(real_of(file), bytes, n, at);
}

static int refuse(void)
{
    failed = true;
    errno = fail_cause;
    return fail_code;
}

static int shim_write(sqlite3_file *file, const void *bytes, int n, sqlite3_int64 at)
{
    if (left >= 0) {
        if (n > left)
            return refuse();
        left -= n;
    }
    int code = real_of(file)->pMethods->xWrite(real_of(file), bytes, n, at);
    if (code == SQLITE_OK)
        note(which_of(file), WRITE, (size_t)at, bytes, (size_t)n);
    return code;
}

static int shim_truncate(sqlite3_file *file, sqlite3_int64 size)
{
    if (left >= 0 && fail_cause == EROFS)
        return refuse();
    int code = real_of(file)->pMethods->xTruncate(real_of(file), size);
    if (code == SQLITE_OK)
        note(which_of(file), TRUNCATE, 0, NULL, (size_t)size);
    return code;
}

static int shim_sync(sqlite3_file *file, int flags)
{
    int code = skip_sync ? SQLITE_OK : real_of(file)->pMethods->xSync(real_of(file), flags);
    if (code == SQLITE_OK)
        note(which_of(file), SYNC, 0, NULL, 0);
    return code;
}

static int shim_size(sqlite3_file *file, sqlite3_int64 *size)
{
    return real_of(file)->pMethods->xFileSize(real_of(file), size);
}

static int shim_lock(sqlite3_file *file, int lock)
{
    return real_of(file)->pMethods->xLock(real_of(file), lock);
}

static int shim_unlock(sqlite3_file *file, int lock)
{
    return real_of(file)->pMethods->xUnlock(real_of(file), lock);
}

static int shim_check_lock(sqlite3_file *file, int *ret)
{
    return real_of(file)->pMethods->xCheckReservedLock(real_of(file), ret);
}

static int shim_control(sqlite3_file *file, int op, void *arg)
{
    return real_of(file)->pMethods->xFileControl(real_of(file), op, arg);
}

static int shim_sector(sqlite3_file *file)
{
    return real_of(file)->pMethods->xSectorSize(real_of(file));
}

static int shim_device(sqlite3_file *file)
{
    return real_of(file)->pMethods->xDeviceCharacteristics(real_of(file));
}

static int shim_shm_map(sqlite3_file *file, int page, int size, int extend, void volatile **ret)
{
    return real_of(file)->pMethods->xShmMap(real_of(file), page, size, extend, ret);
}

static int shim_shm_lock(sqlite3_file *file, int at, int n, int flags)
{
    return real_of(file)->pMethods->xShmLock(real_of(file), at, n, flags);
}

static void shim_shm_barrier(sqlite3_file *file)
{
    real_of(file)->pMethods->xShmBarrier(real_of(file));
}

static int shim_shm_unmap(sqlite3_file *file, int remove)
{
    return real_of(file)->pMethods->xShmUnmap(real_of(file), remove);
}

/* Version 2: SQLite reads and writes by these calls alone, not by a map of the file. */
static const sqlite3_io_methods shim_methods = {
    .iVersion = 2,
    .xClose = shim_close,
    .xRead = shim_read,
    .xWrite = shim_write,
    .xTruncate = shim_truncate,
    .xSync = shim_sync,
    .xFileSize = shim_size,
    .xLock = shim_lock,
    .xUnlock = shim_unlock,
    .xCheckReservedLock = shim_check_lock,
    .xFileControl = shim_control,
    .xSectorSize = shim_sector,
    .xDeviceCharacteristics = shim_device,
    .xShmMap = shim_shm_map,
    .xShmLock = shim_shm_lock,
    .xShmBarrier = shim_shm_barrier,
    .xShmUnmap = shim_shm_unmap,
};

/* ---- the VFS
 * -------------------------------------------------------------------------------------- */

static bool ends_with(const char *name, const char *end)
{
    size_t n = strlen(name), m = strlen(end);
    return n >= m && strcmp(name + n - m, end) == 0;
}

static int which_file(const char *name)
{
    if (name == NULL)
        return -1;
    if (ends_with(name, "/station.db"))
        return FAULT_DISK_DB;
    return ends_with(name, "/station.db-wal") ? FAULT_DISK_WAL : -1;
}

static int shim_open(sqlite3_vfs *vfs, const char *name, sqlite3_file *file, int flags, int *ret)
{
    struct shim_file *f = (struct shim_file *)file;
    (void)vfs;
    f->which = which_file(name);
    f->real = (sqlite3_file *)(f + 1);
    int code = usual->xOpen(usual, name, f->real, flags, ret);
    f->base.pMethods = f->real->pMethods != NULL ? &shim_methods : NULL;
    return code;
}

/* A name that goes is content that goes: it comes to the same for what recovery sees. */
static int shim_delete(sqlite3_vfs *vfs, const char *name, int sync_folder)
{
    (void)vfs;
    int code = usual->xDelete(usual, name, sync_folder);
    if (code == SQLITE_OK)
        note(which_file(name), TRUNCATE, 0, NULL, 0);
    return code;
}

bool fault_disk_install(void)
{
    usual = sqlite3_vfs_find(NULL);
    if (usual == NULL)
        return false;
    shim = *usual;
    shim.zName = "fault-disk";
    shim.szOsFile = (int)sizeof(struct shim_file) + usual->szOsFile;
    shim.xOpen = shim_open;
    shim.xDelete = shim_delete;
    return sqlite3_vfs_register(&shim, 1) == SQLITE_OK;
}

void fault_disk_limit(int64_t bytes, int code, int cause)
{
    left = bytes;
    fail_code = code;
    fail_cause = cause;
    failed = false;
}

bool fault_disk_met(void)
{
    return failed;
}

void fault_disk_skip_sync(bool skip)
{
    skip_sync = skip;
}

/* ---- power cuts
 * -------------------------------------------------------------------------------------- */

static void resize(struct fault_disk_file *file, size_t n)
{
    file->bytes = must(realloc(file->bytes, n + 1));
    if (n > file->n)
        memset(file->bytes + file->n, 0, n - file->n);
    file->n = n;
}

/* The first n bytes of a write; all of a truncation. */
static void apply(struct fault_disk_image *image, const struct operation *op, size_t n)
{
    struct fault_disk_file *file = &image->file[op->file];
    if (op->what == TRUNCATE)
        resize(file, op->n);
    if (op->what != WRITE || n == 0)
        return;
    if (op->at + n > file->n)
        resize(file, op->at + n);
    memcpy(file->bytes + op->at, op->bytes, n);
}

/* Is operation i on the disk when the power goes after `end`, and how much of it? */
static bool survives(size_t i, size_t end, enum fault_disk_cut cut, struct dice *dice, size_t *n)
{
    *n = ops[i].n;
    if (cut == FAULT_DISK_DROPPED)
        return false;
    if (cut == FAULT_DISK_TORN && i + 1 == end)
        *n = dice_below(dice, *n + 1);
    return cut != FAULT_DISK_SOME || dice_below(dice, 2) == 0;
}

void fault_disk_cut(const struct fault_disk_image *before, size_t end, enum fault_disk_cut cut,
                    uint64_t seed, struct fault_disk_image *ret)
{
    struct dice dice = { seed };
    size_t synced[FAULT_DISK_FILES] = { 0 }; /* operations before are safe */
    *ret = (struct fault_disk_image){ .file = { { NULL, 0 } } };
    for (int f = 0; f < FAULT_DISK_FILES; f++) {
        resize(&ret->file[f], before->file[f].n);
        if (before->file[f].n > 0)
            memcpy(ret->file[f].bytes, before->file[f].bytes, before->file[f].n);
    }
    for (size_t i = 0; i < end; i++)
        if (ops[i].what == SYNC)
            synced[ops[i].file] = i;
    for (size_t i = 0; i < end; i++) {
        size_t n = ops[i].n;
        if (i < synced[ops[i].file] || survives(i, end, cut, &dice, &n))
            apply(ret, &ops[i], n);
    }
}

void fault_disk_image_done(struct fault_disk_image *image)
{
    for (int f = 0; f < FAULT_DISK_FILES; f++)
        free(image->file[f].bytes);
}
