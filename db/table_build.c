/* table_build.c - rows computed a chunk at a time on all cores; the chunk before is hashed and
 * inserted meanwhile. */
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
#include "base/parallel.h"
#include "db/entry_rows.h"
#include "db/sql.h"
#include "db/table_file.h"
#include "db/table_hash.h"
#include "db/table_schema.h"
#include "match/table_maker.h"

enum { CHUNK_ROWS = 8192, PIECE_ROWS = 1024 };

/* One thread has the connection: its mutexes would be a quarter of the work. */
#define OPEN_FLAGS (SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX)

struct build {
    const char *path;
    const struct recipe *recipe;
    const struct table_build_options *options;
    char temporary[NEW_NAME_SIZE];
    sqlite3 *db;
    size_t rows;
    struct entry_rows inserting; /* what entry_rows is in SQL */
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

static enum status open_database(struct build *b)
{
    char header[96];
    snprintf(header, sizeof header, "PRAGMA application_id = %d; PRAGMA user_version = %d;",
             (int)TABLE_APPLICATION_ID, (int)TABLE_FORMAT);
    enum status s = sql_status(sqlite3_open_v2(b->temporary, &b->db, OPEN_FLAGS, NULL));
    if (s == STATUS_OK)
        s = sql_run(b->db, table_settings_sql);
    if (s == STATUS_OK)
        s = sql_run(b->db, "BEGIN");
    if (s == STATUS_OK)
        s = sql_run(b->db, header);
    if (s == STATUS_OK)
        s = sql_run(b->db, table_schema_sql);
    if (s == STATUS_OK && b->options->rtree)
        s = sql_run(b->db, table_schema_rtree_sql);
    return s == STATUS_OK ? entry_rows_register(b->db, &b->inserting) : s;
}

/* A closed file is whole: there is no journal. */
static enum status close_database(struct build *b, enum status s)
{
    if (s == STATUS_OK)
        s = sql_run(b->db, "COMMIT");
    if (s != STATUS_OK && s != STATUS_CANCELLED)
        log_error("cannot write '%s': %s", b->path,
                  sqlite3_errcode(b->db) != SQLITE_OK ? sql_reason(b->db) : status_text(s));
    sqlite3_close(b->db);
    b->db = NULL;
    return s;
}

/* ---- rows -------------------------------------------------------------------------------- */

struct chunk {
    size_t first, n;
    struct table table;
};

/* While one chunk is computed the one before is hashed and inserted: each is one piece of work,
 * the others are rows by the hundred. */
struct step {
    struct build *b;
    struct table_maker *maker;
    sqlite3_stmt *insert;
    struct chunk *now, *before; /* either may be NULL */
};
enum { INSERT_PIECE, HASH_PIECE, FIRST_ROWS_PIECE };

/* On whatever thread, but one at a time has the connection. */
static enum status insert_chunk(struct step *step)
{
    const struct chunk *c = step->before;
    step->b->inserting = (struct entry_rows){ &c->table, c->n };
    return sql_step_done(step->insert);
}

static enum status hash_chunk(struct step *step)
{
    const struct chunk *c = step->before;
    table_content_rows(&step->b->content, &c->table, 0, c->n, c->first + 1);
    return STATUS_OK;
}

static enum status make_piece(size_t piece, unsigned worker, void *context)
{
    struct step *step = context;
    if (piece == INSERT_PIECE)
        return step->before != NULL ? insert_chunk(step) : STATUS_OK;
    if (piece == HASH_PIECE)
        return step->before != NULL ? hash_chunk(step) : STATUS_OK;
    struct chunk *c = step->now;
    size_t at = (piece - FIRST_ROWS_PIECE) * PIECE_ROWS, rest = c->n - at;
    return table_maker_some(step->maker, worker, c->first + at,
                            rest < PIECE_ROWS ? rest : PIECE_ROWS, &c->table, at);
}

/* All rows, by chunks, and a last step for what the last chunk leaves to do. */
static enum status make_chunks(struct step *step, struct chunk chunk[2], size_t capacity)
{
    struct build *b = step->b;
    enum status s = STATUS_OK;
    step->before = NULL;
    for (size_t first = 0, turn = 0; s == STATUS_OK && (first < b->rows || step->before != NULL);
         turn++) {
        struct chunk *c = &chunk[turn % 2];
        size_t rest = b->rows - first, pieces = 0;
        c->first = first;
        c->n = rest < capacity ? rest : capacity;
        step->now = c->n > 0 ? c : NULL;
        if (step->now != NULL) {
            if (!progress_go_on(&b->options->progress, first, b->rows))
                return STATUS_CANCELLED;
            pieces = (c->n + PIECE_ROWS - 1) / PIECE_ROWS;
        }
        s = parallel_run(FIRST_ROWS_PIECE + pieces, b->options->threads, make_piece, step);
        step->before = step->now;
        first += c->n;
    }
    if (s == STATUS_OK && !progress_go_on(&b->options->progress, b->rows, b->rows))
        s = STATUS_CANCELLED;
    return s;
}

static enum status insert_rows(struct build *b)
{
    static const char insert[] = /* of an empty table: ids are 1 .. rows */
        "INSERT INTO entry SELECT NULL, * FROM entry_rows";
    struct chunk chunk[2] = { 0 };
    struct step step = { .b = b };
    size_t capacity = b->rows < CHUNK_ROWS ? b->rows : CHUNK_ROWS;
    enum status s = table_maker_open(b->recipe, b->options->threads, &step.maker);
    for (int i = 0; i < 2 && s == STATUS_OK; i++)
        s = table_init(b->recipe, capacity, &chunk[i].table);
    if (s == STATUS_OK)
        s = sql_prepare(b->db, insert, &step.insert);
    if (s == STATUS_OK)
        s = make_chunks(&step, chunk, capacity);
    sqlite3_finalize(step.insert);
    for (int i = 0; i < 2; i++)
        table_done(&chunk[i].table);
    table_maker_close(step.maker);
    return s;
}

/* ---- what comes after the rows ----------------------------------------------------------- */

/* From time to time while SQLite makes an R*Tree; not 0 stops it. */
static int asked_to_stop(void *context)
{
    const struct build *b = context;
    return progress_go_on(&b->options->progress, b->rows, b->rows) ? 0 : 1;
}

static enum status insert_rtree(struct build *b)
{
    enum { STEPS = 1000000 };
    static const char insert[] = "INSERT INTO entry_lab SELECT id, l, l, a, a, b, b FROM entry";
    sqlite3_progress_handler(b->db, STEPS, asked_to_stop, b);
    enum status s = sql_run(b->db, insert);
    if (s != STATUS_OK && sqlite3_errcode(b->db) == SQLITE_INTERRUPT)
        s = STATUS_CANCELLED;
    sqlite3_progress_handler(b->db, 0, NULL, NULL);
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
    enum status s = open_database(b);
    if (s == STATUS_OK)
        s = insert_rows(b);
    if (s == STATUS_OK && b->options->rtree)
        s = insert_rtree(b);
    if (s == STATUS_OK)
        s = insert_meta(b, &meta);
    return close_database(b, s);
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
        s = table_pages_seal(fd, b->options->threads);
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
    b.rows = grid_rows(&recipe->grid);
    s = claim(&b);
    if (s == STATUS_OK)
        s = write_database(&b);
    if (s == STATUS_OK)
        s = seal_and_name(&b);
    if (s != STATUS_OK && b.temporary[0] != '\0')
        unlink(b.temporary);
    return s;
}
