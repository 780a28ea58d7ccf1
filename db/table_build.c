/* table_build.c - rows computed a chunk at a time on all cores, inserted in order
 * in one transaction, hashed on the way. */
#include "db/table_build.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "base/new_name.h"
#include "db/sql.h"
#include "db/table_file.h"
#include "db/table_hash.h"
#include "db/table_schema.h"

enum { CHUNK_ROWS = 8192 };

/* One thread has the connection: its mutexes would be a quarter of the work. */
#define OPEN_FLAGS (SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX)

struct build {
    const char *path;
    const struct recipe *recipe;
    const struct table_build_options *options;
    char temporary[NEW_NAME_SIZE];
    sqlite3 *db;
    sqlite3_stmt *insert, *insert_lab;
    struct table chunk;
    struct table_content_hash content;
};

static const char *what_to_do(int error)
{
    switch (error) {
    case ENOENT:
        return "; make the folder first";
    case EACCES:
    case EPERM:
    case EROFS:
        return "; choose a folder you may write to";
    default:
        return "";
    }
}

static enum status exists(const char *path)
{
    log_error("'%s' exists; choose another name or say --force to replace it", path);
    return STATUS_EXISTS;
}

/* What stands at the target: nothing, or a table that may be replaced. */
static enum status check_target(const struct build *b)
{
    struct stat there;
    if (lstat(b->path, &there) != 0)
        return STATUS_OK; /* what is wrong with the folder shows when it is written to */
    if (S_ISDIR(there.st_mode))
        log_error("'%s' is a folder; name a file in it", b->path);
    else if (!S_ISREG(there.st_mode))
        log_error("'%s' is not a file; choose another name", b->path);
    else if (!b->options->overwrite)
        return exists(b->path);
    else if (there.st_size > 0 && !table_file_is_table(b->path))
        log_error("'%s' is no table; remove it yourself or choose another name", b->path);
    else
        return STATUS_OK;
    return STATUS_EXISTS;
}

/* Refuse early what could only fail after all the work. */
static enum status claim(struct build *b)
{
    enum status s = check_target(b);
    if (s != STATUS_OK)
        return s;
    s = new_name_make(b->path, b->temporary);
    if (s != STATUS_OK) {
        log_error("cannot write '%s': %s", b->path,
                  s == STATUS_RANGE ? "it is not a file name" : status_text(s));
        b->temporary[0] = '\0';
        return STATUS_IO;
    }
    int fd = open(b->temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (fd < 0) {
        s = sql_errno_status(errno);
        log_error("cannot write '%s': %s%s", b->path, strerror(errno), what_to_do(errno));
        b->temporary[0] = '\0';
        return s;
    }
    close(fd);
    return STATUS_OK;
}

/* Journal and syncs off: until it is renamed the file may be lost, not half kept. */
static const char open_sql[] = "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;"
                               "PRAGMA locking_mode = EXCLUSIVE; BEGIN;";

static enum status create_schema(struct build *b)
{
    char header[96];
    enum status s = sql_status(sqlite3_open_v2(b->temporary, &b->db, OPEN_FLAGS, NULL));
    snprintf(header, sizeof header, "PRAGMA application_id = %d; PRAGMA user_version = %d;",
             (int)TABLE_APPLICATION_ID, (int)TABLE_FORMAT);
    if (s == STATUS_OK)
        s = sql_run(b->db, open_sql);
    if (s == STATUS_OK)
        s = sql_run(b->db, header);
    if (s == STATUS_OK)
        s = sql_run(b->db, table_schema_sql);
    if (s == STATUS_OK && b->options->rtree)
        s = sql_run(b->db, table_schema_rtree_sql);
    if (s == STATUS_OK)
        s = sql_prepare(b->db, "INSERT INTO entry VALUES (?,?,?,?,?,?,?,?,?,?,?)", &b->insert);
    if (s == STATUS_OK && b->options->rtree)
        s = sql_prepare(b->db, "INSERT INTO entry_lab VALUES (?1,?2,?2,?3,?3,?4,?4)",
                        &b->insert_lab);
    return s;
}

static enum status insert_row(struct build *b, size_t i, size_t id)
{
    const struct table *t = &b->chunk;
    unsigned char blob[4 * SPECTRUM_MAX_BANDS];
    size_t bands = b->recipe->bands;
    const double column[9] = { t->Cm[i], t->Bm[i],  t->Ch[i],    t->L[i],   t->a[i],
                               t->b[i],  t->red[i], t->green[i], t->blue[i] };
    sqlite3_bind_int64(b->insert, 1, (sqlite3_int64)id);
    for (int c = 0; c < 9; c++)
        sqlite3_bind_double(b->insert, c + 2, column[c]);
    if (bands > 0) {
        table_spectrum_to_blob(table_spectrum(t, i), bands, blob);
        sqlite3_bind_blob(b->insert, 11, blob, (int)(4 * bands), SQLITE_STATIC);
    }
    enum status s = sql_step_done(b->insert);
    if (s == STATUS_OK && b->insert_lab != NULL) {
        sqlite3_bind_int64(b->insert_lab, 1, (sqlite3_int64)id);
        for (int c = 0; c < 3; c++)
            sqlite3_bind_double(b->insert_lab, c + 2, column[3 + c]);
        s = sql_step_done(b->insert_lab);
    }
    return s;
}

static enum status insert_rows(struct build *b)
{
    size_t total = grid_rows(&b->recipe->grid);
    size_t capacity = total < CHUNK_ROWS ? total : CHUNK_ROWS;
    enum status s = table_init(b->recipe, capacity, &b->chunk);
    for (size_t first = 0; first < total && s == STATUS_OK; first += capacity) {
        size_t count = total - first < capacity ? total - first : capacity;
        if (!progress_go_on(&b->options->progress, first, total))
            return STATUS_CANCELLED;
        s = table_compute(&b->chunk, first, count, b->options->threads);
        for (size_t i = 0; i < count && s == STATUS_OK; i++) {
            table_content_row(&b->content, &b->chunk, i, first + i + 1);
            s = insert_row(b, i, first + i + 1);
        }
    }
    if (s == STATUS_OK && !progress_go_on(&b->options->progress, total, total))
        s = STATUS_CANCELLED;
    return s;
}

static enum status insert_meta(struct build *b, const struct table_meta *meta)
{
    char content[TABLE_SHA256_SIZE];
    sqlite3_stmt *insert = NULL;
    const char *row[TABLE_META_COUNT + 2][2];
    table_content_end(&b->content, content);
    for (size_t i = 0; i < TABLE_META_COUNT; i++) {
        row[i][0] = meta->key[i];
        row[i][1] = meta->value[i];
    }
    row[TABLE_META_COUNT][0] = TABLE_CONTENT_KEY;
    row[TABLE_META_COUNT][1] = content;
    row[TABLE_META_COUNT + 1][0] = TABLE_PAGES_KEY;
    row[TABLE_META_COUNT + 1][1] = TABLE_PAGES_UNSET;
    enum status s = sql_prepare(b->db, "INSERT INTO meta VALUES (?, ?)", &insert);
    for (size_t i = 0; i < TABLE_META_COUNT + 2 && s == STATUS_OK; i++) {
        sqlite3_bind_text(insert, 1, row[i][0], -1, SQLITE_STATIC);
        sqlite3_bind_text(insert, 2, row[i][1], -1, SQLITE_STATIC);
        s = sql_step_done(insert);
    }
    sqlite3_finalize(insert);
    return s;
}

static enum status write_database(struct build *b)
{
    struct table_meta meta;
    table_meta_of(b->recipe, &meta);
    table_content_begin(&b->content, &meta);
    enum status s = create_schema(b);
    if (s == STATUS_OK)
        s = insert_rows(b);
    if (s == STATUS_OK)
        s = insert_meta(b, &meta);
    if (s == STATUS_OK)
        s = sql_run(b->db, "COMMIT");
    if (s != STATUS_OK && s != STATUS_CANCELLED)
        log_error("cannot write '%s': %s", b->path,
                  sqlite3_errcode(b->db) != SQLITE_OK ? sql_reason(b->db) : status_text(s));
    return s;
}

static void close_database(struct build *b)
{
    sqlite3_finalize(b->insert);
    sqlite3_finalize(b->insert_lab);
    sqlite3_close(b->db);
    table_done(&b->chunk);
}

static void sync_folder(const char *path)
{
    char folder[NEW_NAME_SIZE];
    const char *slash = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", slash != NULL ? (int)(slash + 1 - path) : 1,
             slash != NULL ? path : ".");
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)fsync(fd); /* not every file system can; the file itself is synced */
        close(fd);
    }
}

static enum status seal_and_name(const struct build *b)
{
    enum status s = STATUS_IO;
    int fd = open(b->temporary, O_RDWR | O_CLOEXEC);
    if (fd >= 0)
        s = table_pages_seal(fd);
    if (s == STATUS_OK && fsync(fd) != 0)
        s = sql_errno_status(errno);
    if (fd >= 0)
        close(fd);
    if (s == STATUS_OK && new_name_take(b->temporary, b->path, b->options->overwrite) != 0) {
        if (errno == EEXIST) /* made by somebody else meanwhile */
            return exists(b->path);
        s = sql_errno_status(errno);
    }
    if (s != STATUS_OK) {
        log_error("cannot write '%s': %s", b->path,
                  s == STATUS_FORMAT ? status_text(s) : strerror(errno));
        return s;
    }
    sync_folder(b->path);
    return STATUS_OK;
}

enum status table_build(const char *path, const struct recipe *recipe,
                        const struct table_build_options *options)
{
    struct build b = { .path = path, .recipe = recipe, .options = options };
    enum status s = recipe_check(recipe);
    if (s != STATUS_OK) {
        log_error("cannot build '%s': %s", path, status_text(s));
        return s;
    }
    s = claim(&b);
    if (s == STATUS_OK) {
        s = write_database(&b);
        close_database(&b);
    }
    if (s == STATUS_OK)
        s = seal_and_name(&b);
    if (s != STATUS_OK && b.temporary[0] != '\0')
        unlink(b.temporary);
    return s;
}
