/* table_files.c - see table_files.h. */
#include "tests/support/table_files.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <sqlite3.h>

#include "db/table_file.h"
#include "db/table_hash.h"
#include "db/table_schema.h"

struct recipe small_recipe(const char *model)
{
    struct recipe recipe = recipe_default(model_find(model));
    recipe.grid =
        (struct grid){ { 0.0, 0.3, 4, false }, { 0.0, 1.0, 5, false }, { 0.001, 0.1, 4, true } };
    return recipe;
}

enum status small_table(const char *path, const struct recipe *recipe, bool rtree)
{
    struct table_build_options options = { .rtree = rtree, .overwrite = true, .threads = 2 };
    return table_build(path, recipe, &options);
}

bool table_edit(const char *path, const char *sql)
{
    sqlite3 *db = NULL;
    bool good = sqlite3_open_v2(path, &db, SQLITE_OPEN_READWRITE, NULL) == SQLITE_OK &&
                sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK;
    sqlite3_close(db);
    return good;
}

bool table_reseal(const char *path)
{
    int fd = open(path, O_RDWR);
    bool good = fd >= 0 && table_pages_seal(fd, 1) == STATUS_OK;
    if (fd >= 0)
        close(fd);
    return good;
}

bool table_rehash(const char *path)
{
    struct table table;
    struct table_meta meta;
    struct table_content_hash hash;
    char hex[TABLE_SHA256_SIZE], sql[256];
    if (!table_reseal(path) || table_file_read(path, &table) != STATUS_OK)
        return false;
    table_meta_of(&table.recipe, &meta);
    table_content_begin(&hash, &meta);
    table_content_rows(&hash, &table, 0, table.n, 1);
    table_content_end(&hash, hex);
    table_done(&table);
    snprintf(sql, sizeof sql, "UPDATE meta SET value = '%s' WHERE key = 'content_sha256'", hex);
    return table_edit(path, sql) && table_reseal(path);
}
