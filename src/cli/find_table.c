/* find_table.c - a name looked for in a few folders. */
#include "cli/find_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/log.h"
#include "optics/model.h"

static int is_path(const char *table)
{
    size_t n = strlen(table);
    return strchr(table, '/') != NULL || (n > 3 && strcmp(table + n - 3, ".db") == 0);
}

static enum status not_found(const char *table)
{
    if (model_find(table) != NULL)
        log_error("there is no table '%s' yet; make it with: mkdir -p build/tables && skinspec "
                  "table build --model %s --out build/tables/table-%s.db",
                  table, table, table);
    else
        log_error("there is no table '%s'; give a path, or a name after 'skinspec table build "
                  "--model M --out build/tables/table-%s.db'",
                  table, table);
    return STATUS_NOT_FOUND;
}

/* In the folders, by a name. */
static bool look(const char *table, const char *tables_folder, char path[FIND_TABLE_PATH_SIZE])
{
    char state[FIND_TABLE_PATH_SIZE];
    const char *state_folder = getenv("SKINSPEC_STATE");
    snprintf(state, sizeof state, "%s/tables", state_folder != NULL ? state_folder : ".");
    const char *folders[] = { tables_folder, state_folder != NULL ? state : NULL,
                              "/var/lib/skinspec/tables", "build/tables" };
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        if (folders[i] == NULL)
            continue;
        int n = snprintf(path, FIND_TABLE_PATH_SIZE, "%s/table-%s.db", folders[i], table);
        if (n < FIND_TABLE_PATH_SIZE && access(path, F_OK) == 0)
            return true;
    }
    return false;
}

enum status find_table(const char *table, const char *tables_folder,
                       char path[FIND_TABLE_PATH_SIZE])
{
    if (is_path(table)) {
        int n = snprintf(path, FIND_TABLE_PATH_SIZE, "%s", table);
        return n < FIND_TABLE_PATH_SIZE ? STATUS_OK : not_found(table);
    }
    return look(table, tables_folder, path) ? STATUS_OK : not_found(table);
}

bool find_table_if_there(const char *table, const char *tables_folder,
                         char path[FIND_TABLE_PATH_SIZE])
{
    return look(table, tables_folder, path);
}
