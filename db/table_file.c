/* table_file.c - check the bytes, then the meta rows, then read the entries. */
#include "db/table_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "db/sql.h"
#include "db/table_hash.h"
#include "db/table_schema.h"

void table_file_name(const char *path, char name[TABLE_NAME_SIZE])
{
    static const char prefix[] = "table-", suffix[] = ".db";
    const char *slash = strrchr(path, '/');
    const char *base = slash != NULL ? slash + 1 : path;
    if (strncmp(base, prefix, sizeof prefix - 1) == 0)
        base += sizeof prefix - 1;
    size_t n = strlen(base), ending = sizeof suffix - 1;
    if (n > ending && strcmp(base + n - ending, suffix) == 0)
        n -= ending;
    snprintf(name, TABLE_NAME_SIZE, "%.*s", (int)(n < TABLE_NAME_SIZE ? n : TABLE_NAME_SIZE - 1),
             base);
}

/* Fields of SQLite's file header: bytes 60 user_version, 68 application_id. */
static uint32_t header_field(const unsigned char *header, size_t at)
{
    const unsigned char *p = header + at;
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | (uint32_t)p[3];
}

static bool is_table_header(const unsigned char header[100])
{
    return memcmp(header, "SQLite format 3", 16) == 0 &&
           header_field(header, 68) == TABLE_APPLICATION_ID;
}

static enum status check_header(int fd, const char *path)
{
    unsigned char header[100];
    ssize_t n = pread(fd, header, sizeof header, 0);
    if (n < 0) {
        log_error("table '%s': %s", path, strerror(errno));
        return STATUS_IO;
    }
    if ((size_t)n < sizeof header || !is_table_header(header)) {
        log_error("'%s' is not a skinspec table; make one with 'skinspec table build'", path);
        return STATUS_FORMAT;
    }
    if (header_field(header, 60) != TABLE_FORMAT) {
        log_error("table '%s' has format %u, this program reads format %d; build it anew with "
                  "'skinspec table build'",
                  path, (unsigned)header_field(header, 60), (int)TABLE_FORMAT);
        return STATUS_VERSION;
    }
    return STATUS_OK;
}

bool table_file_is_table(const char *path)
{
    unsigned char header[100];
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return false;
    bool whole = pread(fd, header, sizeof header, 0) == (ssize_t)sizeof header;
    close(fd);
    return whole && is_table_header(header);
}

static enum status check_pages(int fd, const char *path, char computed[TABLE_SHA256_SIZE])
{
    char written[TABLE_SHA256_SIZE];
    enum status s = table_pages_hash(fd, 1, computed, written);
    if (s == STATUS_OK && strcmp(computed, written) == 0)
        return STATUS_OK;
    if (s == STATUS_IO) {
        log_error("table '%s': %s", path, strerror(errno));
        return s;
    }
    log_error("table '%s' is damaged or was changed: its bytes do not match its hash; "
              "take it from a backup or build it anew with 'skinspec table build --force'",
              path);
    return STATUS_DAMAGED;
}

/* Header and pages of the file at path, before SQLite opens it. */
static enum status check_bytes(const char *path, char pages_sha256[TABLE_SHA256_SIZE])
{
    struct stat there;
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC); /* nor wait for a pipe's writer */
    if (fd < 0) {
        log_error("table '%s': %s", path, strerror(errno));
        return errno == ENOENT ? STATUS_NOT_FOUND : STATUS_IO;
    }
    enum status s = STATUS_IO;
    if (fstat(fd, &there) != 0 || !S_ISREG(there.st_mode))
        log_error("table '%s' is not a file", path);
    else
        s = check_header(fd, path);
    if (s == STATUS_OK)
        s = check_pages(fd, path, pages_sha256);
    close(fd);
    return s;
}

/* The path as a URI that tells SQLite that nobody changes the file: it then takes no
 * locks and looks for no journal.  The bytes were checked just before. */
static enum status immutable_uri(const char *path, char *uri, size_t size)
{
    static const char hex[] = "0123456789ABCDEF", after[] = "?immutable=1";
    size_t n = (size_t)snprintf(uri, size, "file:%s", path[0] == '/' ? "//" : "./");
    for (const char *p = path; *p != '\0'; p++) {
        if (n + 3 + sizeof after > size)
            return STATUS_RANGE;
        if (strchr("%?#", *p) == NULL) {
            uri[n++] = *p;
            continue;
        }
        uri[n++] = '%';
        uri[n++] = hex[(unsigned char)*p >> 4];
        uri[n++] = hex[(unsigned char)*p & 15];
    }
    memcpy(uri + n, after, sizeof after);
    return STATUS_OK;
}

static enum status open_checked(const char *path, char pages_sha256[TABLE_SHA256_SIZE],
                                sqlite3 **ret)
{
    sqlite3 *db = NULL;
    char uri[3 * 4096 + 32]; /* the longest path, every byte escaped */
    enum status s = check_bytes(path, pages_sha256);
    if (s != STATUS_OK)
        return s;
    s = immutable_uri(path, uri, sizeof uri);
    if (s != STATUS_OK) {
        log_error("table '%s': the path is too long", path);
        return s;
    }
    /* One thread has the connection: its mutexes would be a quarter of the work. */
    const int flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
    s = sql_status(sqlite3_open_v2(uri, &db, flags, NULL));
    if (s != STATUS_OK) {
        log_error("table '%s': %s", path, sql_reason(db));
        sqlite3_close(db);
        return s;
    }
    *ret = db;
    return STATUS_OK;
}

/* Memory and disk keep their status; anything else that keeps SQL from working
 * is that the file does not hold what it should. */
static enum status blame(enum status s)
{
    if (s == STATUS_FULL || s == STATUS_READ_ONLY) /* by errno: it could not be read */
        return STATUS_IO;
    return s == STATUS_NO_MEMORY || s == STATUS_IO || s == STATUS_DAMAGED ? s : STATUS_FORMAT;
}

/* Values of meta by key; the text lives until the next look-up. */
struct meta_query {
    sqlite3_stmt *select;
    enum status status; /* of the first look-up that failed for another reason than the key */
    char value[TABLE_META_VALUE_SIZE];
};

static const char *look_up(void *context, const char *key)
{
    struct meta_query *q = context;
    const char *found = NULL;
    sqlite3_bind_text(q->select, 1, key, -1, SQLITE_STATIC);
    int stepped = sqlite3_step(q->select);
    const char *text = NULL;
    if (stepped == SQLITE_ROW)
        text = (const char *)sqlite3_column_text(q->select, 0);
    if (text != NULL) {
        snprintf(q->value, sizeof q->value, "%s", text);
        found = q->value;
    } else if (stepped == SQLITE_ROW) {
        stepped = sqlite3_errcode(sqlite3_db_handle(q->select)); /* no memory, or NULL */
    }
    if (q->status == STATUS_OK)
        q->status = sql_status(stepped);
    sqlite3_reset(q->select);
    return found;
}

/* The one number that a query gives. */
static enum status number_of(sqlite3 *db, const char *sql, long long *ret)
{
    sqlite3_stmt *select;
    enum status s = sql_prepare(db, sql, &select);
    if (s == STATUS_OK) {
        s = sql_status(sqlite3_step(select));
        *ret = sqlite3_column_int64(select, 0);
    }
    sqlite3_finalize(select);
    return s;
}

/* All meta rows, and just as this program writes them: the content hash is over
 * their text, and verifying takes it from the recipe again. */
static enum status read_other_meta(sqlite3 *db, struct meta_query *q, struct table_file_info *info,
                                   const char **bad_key)
{
    struct table_meta meta;
    const char *text;
    table_meta_of(&info->recipe, &meta);
    for (size_t i = 0; i < TABLE_META_COUNT; i++) {
        *bad_key = meta.key[i];
        text = look_up(q, meta.key[i]);
        if (text == NULL)
            return STATUS_FORMAT;
        if (strcmp(meta.key[i], "code_version") == 0)
            snprintf(info->code_version, sizeof info->code_version, "%s", text);
        else if (strcmp(text, meta.value[i]) != 0)
            return STATUS_FORMAT;
    }
    *bad_key = TABLE_CONTENT_KEY;
    text = look_up(q, TABLE_CONTENT_KEY);
    if (text == NULL || strlen(text) != TABLE_SHA256_SIZE - 1 ||
        strspn(text, "0123456789abcdef") != TABLE_SHA256_SIZE - 1)
        return STATUS_FORMAT;
    memcpy(info->content_sha256, text, TABLE_SHA256_SIZE);
    *bad_key = "one too many or too few";
    long long rows = 0;
    enum status s = number_of(db, "SELECT count(*) FROM meta", &rows);
    return s == STATUS_OK && rows != TABLE_META_COUNT + 2 ? STATUS_FORMAT : s;
}

static enum status read_meta(sqlite3 *db, const char *path, struct table_file_info *ret)
{
    struct meta_query q = { 0 };
    const char *bad_key = "meta";
    enum status s = sql_prepare(db, "SELECT value FROM meta WHERE key = ?", &q.select);
    if (s == STATUS_OK)
        s = table_meta_recipe(look_up, &q, &ret->recipe, &bad_key);
    if (s == STATUS_OK)
        s = recipe_check(&ret->recipe);
    if (s == STATUS_OK)
        s = read_other_meta(db, &q, ret, &bad_key);
    if (q.status != STATUS_OK)
        s = q.status;
    if (s == STATUS_OK) {
        ret->rows = grid_rows(&ret->recipe.grid);
    } else {
        s = blame(s);
        if (s == STATUS_FORMAT)
            log_error("table '%s': its meta rows are not understood (%s); build it anew with "
                      "'skinspec table build --force'",
                      path, bad_key);
        else
            log_error("table '%s': %s", path, status_text(s));
    }
    sqlite3_finalize(q.select);
    return s;
}

static enum status read_size(sqlite3 *db, struct table_file_info *info)
{
    static const char rtree[] = "SELECT count(*) FROM sqlite_schema WHERE name = 'entry_lab'";
    static const char size[] =
        "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size";
    long long rtrees = 0;
    enum status s = number_of(db, rtree, &rtrees);
    if (s == STATUS_OK)
        s = number_of(db, size, &info->bytes);
    info->rtree = rtrees > 0;
    return s;
}

enum status table_file_info(const char *path, struct table_file_info *ret)
{
    struct table_file_info info = { 0 };
    sqlite3 *db;
    enum status s = open_checked(path, info.pages_sha256, &db);
    if (s != STATUS_OK)
        return s;
    s = read_meta(db, path, &info);
    if (s == STATUS_OK) {
        s = read_size(db, &info);
        if (s == STATUS_OK)
            *ret = info;
        else
            log_error("table '%s': %s", path, status_text(s));
    }
    sqlite3_close(db);
    return s;
}

/* One entry; false where it is not what the schema promises. */
static bool read_entry(sqlite3_stmt *select, struct table *table, size_t row)
{
    float spectrum[SPECTRUM_MAX_BANDS];
    size_t bands = table->recipe.bands;
    double v[9];
    if (sqlite3_column_int64(select, 0) != (sqlite3_int64)row + 1)
        return false;
    for (int i = 0; i < 9; i++) {
        if (sqlite3_column_type(select, i + 1) != SQLITE_FLOAT)
            return false;
        v[i] = sqlite3_column_double(select, i + 1);
    }
    if (sqlite3_column_count(select) > 10) {
        if (sqlite3_column_type(select, 10) != (bands > 0 ? SQLITE_BLOB : SQLITE_NULL))
            return false;
        const unsigned char *blob = sqlite3_column_blob(select, 10);
        if ((size_t)sqlite3_column_bytes(select, 10) != 4 * bands)
            return false;
        if (bands > 0)
            table_spectrum_from_blob(blob, bands, spectrum);
    }
    struct table_row values = { v[0], v[1], v[2], { v[3], v[4], v[5] }, { v[6], v[7], v[8] } };
    table_set(table, row, &values, spectrum);
    return true;
}

static enum status read_entries(sqlite3 *db, const char *path, enum table_file_parts parts,
                                struct table *table)
{
    static const char whole[] =
        "SELECT id, cm, bm, ch, l, a, b, r, g, b_, spectrum FROM entry ORDER BY id";
    static const char colours[] = "SELECT id, cm, bm, ch, l, a, b, r, g, b_ FROM entry ORDER BY id";
    sqlite3_stmt *select;
    size_t row = 0;
    enum status s = sql_prepare(db, parts == TABLE_FILE_WHOLE ? whole : colours, &select);
    if (s == STATUS_OK) {
        int stepped;
        while ((stepped = sqlite3_step(select)) == SQLITE_ROW && row < table->n &&
               read_entry(select, table, row))
            row++;
        s = sql_status(stepped);
        if (s == STATUS_OK && (stepped != SQLITE_DONE || row < table->n))
            s = STATUS_FORMAT;
    }
    if (s != STATUS_OK) {
        s = blame(s);
        if (s == STATUS_FORMAT)
            log_error("table '%s': row %zu is missing or not as its meta rows say; build it anew "
                      "with 'skinspec table build --force'",
                      path, row + 1);
        else
            log_error("table '%s': row %zu: %s", path, row + 1, status_text(s));
    }
    sqlite3_finalize(select);
    return s;
}

enum status table_file_read(const char *path, struct table *ret)
{
    return table_file_read_parts(path, TABLE_FILE_WHOLE, ret, NULL);
}

enum status table_file_read_parts(const char *path, enum table_file_parts parts, struct table *ret,
                                  struct table_file_bytes *bytes_ret)
{
    struct table_file_info info = { 0 };
    struct table table = { 0 };
    sqlite3 *db;
    enum status s = open_checked(path, info.pages_sha256, &db);
    if (s != STATUS_OK)
        return s;
    s = read_meta(db, path, &info);
    if (s != STATUS_OK)
        goto done;
    s = parts == TABLE_FILE_WHOLE ? table_init(&info.recipe, info.rows, &table)
                                  : table_init_without_spectra(&info.recipe, info.rows, &table);
    if (s != STATUS_OK) {
        log_error("table '%s': %zu rows: %s", path, info.rows, status_text(s));
        goto done;
    }
    s = read_entries(db, path, parts, &table);
    if (s == STATUS_OK && (s = read_size(db, &info)) != STATUS_OK)
        log_error("table '%s': %s", path, status_text(s));
    if (s != STATUS_OK) {
        table_done(&table);
        goto done;
    }
    table_file_name(path, table.name);
    memcpy(table.sha256, info.content_sha256, sizeof table.sha256);
    if (bytes_ret != NULL)
        *bytes_ret = (struct table_file_bytes){ (size_t)info.bytes, table_bytes(&table) };
    *ret = table;
done:
    sqlite3_close(db);
    return s;
}
