/* store_damage.c - what a file is by its bytes; damaged files are moved aside and kept.
 *
 * The order makes every step safe to be killed at: the marker first, with the name to
 * be, then -wal and -shm, the file itself last. */
#define _GNU_SOURCE /* memmem */
#include "db/store.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "db/sql.h"
#include "db/station_schema.h"
#include "db/store_private.h"

#define ASIDE STORE_FILE ".damaged-"

/* ---- what a file is ----------------------------------------------------------------- */

enum { HEADER_SIZE = 100, SIGN_RANGE = 1 << 20 };
static const char magic[16] = "SQLite format 3";

struct head {
    unsigned char bytes[SIGN_RANGE]; /* the schema stands within the first 100 kB */
    size_t n;
};

/* Through SQLite: closing a descriptor of our own would take the locks along that another
 * connection of this process has on the file. */
static enum status read_head(const char *path, struct head *ret)
{
    sqlite3 *db;
    sqlite3_file *file = NULL;
    sqlite3_int64 size = 0;
    enum status s = store_connect(path, SQLITE_OPEN_READONLY, &db);
    if (s != STATUS_OK)
        return s;
    sqlite3_file_control(db, "main", SQLITE_FCNTL_FILE_POINTER, &file);
    int code = file->pMethods->xFileSize(file, &size);
    ret->n = size < SIGN_RANGE ? (size_t)size : SIGN_RANGE;
    if (code == SQLITE_OK && ret->n > 0)
        code = file->pMethods->xRead(file, ret->bytes, (int)ret->n, 0);
    if (code != SQLITE_OK)
        log_error("store: cannot read '%s': %s", path, strerror(errno));
    sqlite3_close(db);
    return sql_status(code);
}

/* Fields of SQLite's file header: bytes 60 user_version, 68 application_id. */
static uint32_t field(const struct head *head, size_t at)
{
    const unsigned char *p = head->bytes + at;
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | (uint32_t)p[3];
}

static bool is_all_zero(const struct head *head)
{
    for (size_t i = 0; i < head->n; i++)
        if (head->bytes[i] != 0)
            return false;
    return true;
}

/* Even if its header is spoilt. */
static bool has_our_sign(const struct head *head)
{
    return memmem(head->bytes, head->n, STATION_SIGN, sizeof STATION_SIGN - 1) != NULL;
}

static enum status judge_head(const struct head *head, const char **why)
{
    bool sqlite = head->n >= sizeof magic && memcmp(head->bytes, magic, sizeof magic) == 0;
    bool whole = sqlite && head->n >= HEADER_SIZE;
    bool ours = whole && field(head, 68) == STATION_APPLICATION_ID;
    *why = "it holds nothing";
    if (is_all_zero(head)) /* what a power cut leaves; the store itself never does */
        return STATUS_DAMAGED;
    *why = "it is cut short";
    if (sqlite && !whole)
        return STATUS_DAMAGED;
    *why = "its header is damaged";
    if (!ours && has_our_sign(head))
        return STATUS_DAMAGED;
    *why = "it is a foreign file; move it elsewhere or choose another state folder";
    if (!ours)
        return STATUS_FORMAT;
    *why = "a newer program made it; use that one";
    return field(head, 60) > (uint32_t)station_version() ? STATUS_VERSION : STATUS_OK;
}

/* No file: a first start, unless its -wal is left. */
static enum status judge_absence(const char *folder, const char **why)
{
    int64_t wal = 0;
    enum status s = store_wal_bytes(folder, &wal);
    *why = "it is gone, and its -wal is not";
    if (s != STATUS_OK)
        return s;
    return wal > 0 ? STATUS_DAMAGED : STATUS_NOT_FOUND;
}

enum status store_judge(const char *folder, const char **why)
{
    char path[STORE_PATH_SIZE];
    if (access(store_path(folder, STORE_FILE, path), F_OK) != 0)
        return judge_absence(folder, why);
    struct head *head = calloc(1, sizeof *head);
    if (head == NULL)
        return STATUS_NO_MEMORY;
    enum status s = read_head(path, head);
    if (s == STATUS_OK)
        s = judge_head(head, why);
    free(head);
    if (s == STATUS_FORMAT || s == STATUS_VERSION)
        log_error("store: '%s': %s", path, *why);
    return s;
}

/* ---- the marker --------------------------------------------------------------------- */

enum status store_find_aside(const char *folder, char name[STORE_TEXT_SIZE])
{
    char path[STORE_PATH_SIZE];
    name[0] = '\0';
    FILE *file = fopen(store_path(folder, STORE_MARKER, path), "re");
    if (file == NULL && errno == ENOENT)
        return STATUS_NOT_FOUND;
    if (file == NULL) {
        enum status s = sql_errno_status(errno);
        log_error("store: '%s': %s", path, strerror(errno));
        return s;
    }
    if (fgets(name, STORE_TEXT_SIZE, file) != NULL)
        name[strcspn(name, "\n")] = '\0';
    fclose(file);
    if (strncmp(name, ASIDE, sizeof ASIDE - 1) != 0 || strchr(name, '/') != NULL)
        name[0] = '\0';
    return STATUS_OK;
}

static enum status write_marker(const char *folder, const char *name, const char *why)
{
    char path[STORE_PATH_SIZE], text[1024];
    int n = snprintf(text, sizeof text,
                     "%s\n"
                     "is station.db as it was found damaged (%s).\n"
                     "It is kept.  Nothing is stored until an empty store is accepted.\n",
                     name, why);
    int fd =
        open(store_path(folder, STORE_MARKER, path), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    bool good = fd >= 0 && write(fd, text, (size_t)n) == n && fsync(fd) == 0;
    int cause = errno;
    if (fd >= 0) {
        close(fd);
        if (!good)
            (void)unlink(path);
    }
    errno = cause;
    if (good)
        store_sync_folder(folder);
    return good ? STATUS_OK : STATUS_IO;
}

/* ---- moving aside ------------------------------------------------------------------- */

/* A name that nothing has: ...damaged-20260131T120000Z, ...Z-2, ... */
static void choose_name(const char *folder, int64_t now_ms, char name[STORE_TEXT_SIZE])
{
    char at[STORE_TIME_SIZE], path[STORE_PATH_SIZE], digits[STORE_TIME_SIZE];
    size_t n = 0;
    clock_text(now_ms, at);
    for (const char *p = at; *p != '.'; p++)
        if (*p != '-' && *p != ':')
            digits[n++] = *p;
    digits[n] = '\0';
    snprintf(name, STORE_TEXT_SIZE, ASIDE "%sZ", digits);
    for (int i = 2; access(store_path(folder, name, path), F_OK) == 0; i++)
        snprintf(name, STORE_TEXT_SIZE, ASIDE "%sZ-%d", digits, i);
}

static enum status move(const char *folder, const char *name, const char *suffix)
{
    char from[STORE_PATH_SIZE], to[STORE_PATH_SIZE], both[STORE_TEXT_SIZE + 8];
    snprintf(both, sizeof both, STORE_FILE "%s", suffix);
    store_path(folder, both, from);
    snprintf(both, sizeof both, "%s%s", name, suffix);
    store_path(folder, both, to);
    if (rename(from, to) == 0 || errno == ENOENT)
        return STATUS_OK;
    enum status s = sql_errno_status(errno);
    log_error("store: cannot move '%s' aside: %s", from, strerror(errno));
    return s;
}

/* Also what an earlier attempt did not come to; a file put back by hand stays. */
static enum status move_all(const char *folder, const char *name)
{
    char path[STORE_PATH_SIZE];
    enum status s = STATUS_OK;
    if (access(store_path(folder, name, path), F_OK) == 0)
        return STATUS_OK;
    static const char *const suffix[] = { "-wal", "-shm", "" };
    for (size_t i = 0; i < sizeof suffix / sizeof *suffix && s == STATUS_OK; i++)
        s = move(folder, name, suffix[i]);
    store_sync_folder(folder);
    return s;
}

void store_put_aside(const char *folder, int64_t now_ms, const char *why)
{
    char name[STORE_TEXT_SIZE];
    choose_name(folder, now_ms, name);
    enum status s = write_marker(folder, name, why);
    if (s != STATUS_OK)
        log_error("store: '%s/" STORE_FILE "' is damaged (%s) and cannot be moved aside: %s",
                  folder, why, strerror(errno));
    else if (move_all(folder, name) == STATUS_OK)
        log_error("store: '%s/" STORE_FILE "' is damaged (%s); it is kept as '%s', and nothing "
                  "is stored until an empty store is accepted",
                  folder, why, name);
}

/* ---- reading what was moved aside --------------------------------------------------- */

enum status store_connect_aside(const char *path, sqlite3 **ret)
{
    enum status s = store_has_wal(path) ? store_connect(path, SQLITE_OPEN_READONLY, ret)
                                        : store_connect_alone(path, ret);
    /* SQLite then puts up with a file that is cut short, as far as it goes. */
    if (s == STATUS_OK)
        (void)sqlite3_db_config(*ret, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, NULL);
    return s;
}

/* ---- beginning anew ----------------------------------------------------------------- */

/* What the damaged file still tells of seq, each in a place of its own, row by row:
 * beyond the first page that cannot be read nothing is. */
static const char *const seq_sql[] = {
    "SELECT first_seq - 1 FROM station",   "SELECT seq FROM measurement ORDER BY seq",
    "SELECT max(seq) FROM measurement",    "SELECT measurement FROM match ORDER BY measurement",
    "SELECT measurement FROM client_uuid", "SELECT last_seq FROM sync_peer",
};

static int64_t highest_of(sqlite3 *db, const char *sql)
{
    sqlite3_stmt *select;
    int64_t highest = 0;
    if (sql_prepare(db, sql, &select) == STATUS_OK) {
        while (sqlite3_step(select) == SQLITE_ROW) {
            int64_t x = sqlite3_column_int64(select, 0);
            highest = x > highest ? x : highest;
        }
    }
    sqlite3_finalize(select);
    return highest;
}

static int64_t highest_seq(const char *path)
{
    sqlite3 *db;
    int64_t highest = 0;
    if (store_connect_aside(path, &db) != STATUS_OK)
        return 0;
    for (size_t i = 0; i < sizeof seq_sql / sizeof *seq_sql; i++) {
        int64_t x = highest_of(db, seq_sql[i]);
        highest = x > highest ? x : highest;
    }
    sqlite3_close(db);
    return highest;
}

/* A new file in the place of the one that was moved to `aside`. */
static enum status make_after(const char *folder, const char *aside)
{
    char path[STORE_PATH_SIZE];
    int64_t highest = *aside != '\0' ? highest_seq(store_path(folder, aside, path)) : 0;
    if (highest == 0)
        log_warning("store: no seq can be read from the damaged file; numbers begin at 1");
    return store_make(folder, store_now_ms(NULL), highest + 1);
}

/* With the claim held. */
static enum status accept(const char *folder, const char *aside)
{
    char path[STORE_PATH_SIZE], marker[STORE_PATH_SIZE];
    enum status s = *aside != '\0' ? move_all(folder, aside) : STATUS_OK;
    if (s == STATUS_OK && access(store_path(folder, STORE_FILE, path), F_OK) != 0)
        s = make_after(folder, aside);
    if (s == STATUS_OK && unlink(store_path(folder, STORE_MARKER, marker)) != 0) {
        s = sql_errno_status(errno);
        log_error("store: cannot remove '%s': %s", marker, strerror(errno));
    }
    if (s == STATUS_OK)
        store_sync_folder(folder);
    return s;
}

enum status store_begin_anew_claimed(struct store_claim *claim)
{
    char aside[STORE_TEXT_SIZE];
    enum status s = store_find_aside(claim->folder, aside);
    return s == STATUS_OK ? accept(claim->folder, aside) : s;
}

enum status store_begin_anew(const char *state_folder)
{
    struct store_claim *claim;
    enum status s = store_claim(state_folder, &claim);
    if (s != STATUS_OK)
        return s;
    s = store_begin_anew_claimed(claim);
    store_claim_release(claim);
    return s;
}
