/* store_keeper.c - checkpoints: from the WAL into the file, beside the writer. */
#include "db/store.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/store_private.h"

struct store_keeper {
    sqlite3 *db;
    struct store_files files;
};

/* A connection that has read nothing does not know that there is a WAL. */
static enum status connect(const char *folder, sqlite3 **ret)
{
    char path[STORE_PATH_SIZE];
    sqlite3 *db;
    store_path(folder, STORE_FILE, path);
    enum status s = store_connect(path, SQLITE_OPEN_READWRITE, &db);
    if (s != STATUS_OK)
        return s;
    s = sql_run(db, "SELECT count(*) FROM sqlite_schema");
    if (s == STATUS_OK) {
        *ret = db;
        return STATUS_OK;
    }
    log_error("store: cannot checkpoint '%s': %s", path, sql_reason(db));
    sqlite3_close(db);
    return s;
}

enum status store_keeper_open(const char *state_folder, struct store_keeper **ret)
{
    enum status s = store_folder_fits(state_folder);
    if (s != STATUS_OK)
        return s;
    struct store_keeper *keeper = calloc(1, sizeof *keeper);
    if (keeper == NULL)
        return STATUS_NO_MEMORY;
    s = connect(state_folder, &keeper->db);
    if (s == STATUS_OK) {
        store_remember_files(&keeper->files, state_folder);
        *ret = keeper;
    } else {
        free(keeper);
    }
    return s;
}

void store_keeper_close(struct store_keeper *keeper)
{
    if (keeper == NULL)
        return;
    sqlite3_close(keeper->db);
    free(keeper);
}

bool store_is_moved(const struct store *store)
{
    return store_files_moved(&store->files);
}

int64_t store_own_wal_bytes(const struct store *store)
{
    struct stat st;
    return stat(store->files.file[1].path, &st) == 0 ? st.st_size : 0;
}

enum status store_try(struct store *store)
{
    enum status s = store_begin(store);
    if (s != STATUS_OK)
        return s;
    /* Written as it was: SQLite does not look whether it differs. */
    s = sql_run(store->db, "PRAGMA application_id = 1399542644"); /* STATION_APPLICATION_ID */
    if (s == STATUS_OK)
        return store_commit(store);
    log_error("store: cannot write: %s", sql_reason(store->db));
    store_rollback(store);
    return s;
}

enum status store_restart_wal(struct store *store, bool cut, bool *restarted)
{
    /* Overwriting pages that are there is cheaper than new ones; one that grew out of
     * measure is cut to nothing. */
    bool large = cut || store_own_wal_bytes(store) > STORE_LARGE_WAL;
    int mode = large ? SQLITE_CHECKPOINT_TRUNCATE : SQLITE_CHECKPOINT_RESTART;
    if (store_files_moved(&store->files)) {
        log_error("store: " STORE_FILE " or its -wal was moved or deleted; no checkpoint");
        return STATUS_IO;
    }
    sqlite3_busy_timeout(store->db, 0);
    int code = sqlite3_wal_checkpoint_v2(store->db, NULL, mode, NULL, NULL);
    sqlite3_busy_timeout(store->db, STORE_PATIENCE_MS);
    enum status s = code == SQLITE_BUSY ? STATUS_OK : sql_status_of(store->db, code);
    if (s == STATUS_OK)
        *restarted = code == SQLITE_OK;
    else
        log_error("store: cannot checkpoint: %s", sql_reason(store->db));
    return s;
}

enum status store_keeper_checkpoint(struct store_keeper *keeper, int *left)
{
    int log = 0, done = 0;
    if (store_files_moved(&keeper->files)) {
        log_error("store: " STORE_FILE " or its -wal was moved or deleted; no checkpoint");
        return STATUS_IO;
    }
    int code = sqlite3_wal_checkpoint_v2(keeper->db, NULL, SQLITE_CHECKPOINT_PASSIVE, &log, &done);
    if (code == SQLITE_BUSY) /* another one under way is as good */
        code = SQLITE_OK;
    enum status s = sql_status_of(keeper->db, code);
    if (s == STATUS_OK)
        *left = log > done ? log - done : 0;
    else
        log_error("store: cannot checkpoint '%s': %s", keeper->files.file[0].path,
                  sql_reason(keeper->db));
    return s;
}

enum status store_wal_bytes(const char *state_folder, int64_t *ret)
{
    char path[STORE_PATH_SIZE];
    struct stat st;
    enum status s = store_folder_fits(state_folder);
    if (s != STATUS_OK)
        return s;
    if (stat(store_path(state_folder, STORE_FILE "-wal", path), &st) == 0) {
        *ret = st.st_size;
    } else if (errno == ENOENT) {
        *ret = 0;
    } else {
        log_error("store: '%s': %s", path, strerror(errno));
        s = STATUS_IO;
    }
    return s;
}
