/* entry_rows.c - a module that can be read from the first row to the last, and no more. */
#include "db/entry_rows.h"

#include <stdlib.h>
#include <string.h>

#include "base/spectrum.h"
#include "db/sql.h"
#include "db/table_hash.h"

enum { SPECTRUM = 9 }; /* its column, after the numbers */

struct entry_vtab {
    sqlite3_vtab base; /* SQLite's part comes first */
    const struct entry_rows *rows;
};

/* What stands in the table is looked up once a SELECT: SQLite asks for each value by itself. */
struct entry_cursor {
    sqlite3_vtab_cursor base;
    const struct entry_rows *rows;
    const double *number[SPECTRUM];
    size_t at, n, bands;
    unsigned char blob[4 * SPECTRUM_MAX_BANDS];
};

static int entry_connect(sqlite3 *db, void *rows, int argc, const char *const *argv,
                         sqlite3_vtab **ret, char **error)
{
    (void)argc;
    (void)argv;
    (void)error;
    int rc = sqlite3_declare_vtab(db, "CREATE TABLE x(cm, bm, ch, l, a, b, r, g, b_, spectrum)");
    if (rc != SQLITE_OK)
        return rc;
    struct entry_vtab *vtab = calloc(1, sizeof *vtab);
    if (vtab == NULL)
        return SQLITE_NOMEM;
    vtab->rows = rows;
    *ret = &vtab->base;
    return SQLITE_OK;
}

static int entry_disconnect(sqlite3_vtab *vtab)
{
    free(vtab);
    return SQLITE_OK;
}

/* There is one way to read it. */
static int entry_best_index(sqlite3_vtab *vtab, sqlite3_index_info *info)
{
    (void)vtab;
    info->estimatedCost = 1e6;
    return SQLITE_OK;
}

static int entry_open(sqlite3_vtab *vtab, sqlite3_vtab_cursor **ret)
{
    struct entry_cursor *cursor = calloc(1, sizeof *cursor);
    if (cursor == NULL)
        return SQLITE_NOMEM;
    cursor->rows = ((struct entry_vtab *)(void *)vtab)->rows;
    *ret = &cursor->base;
    return SQLITE_OK;
}

static int entry_close(sqlite3_vtab_cursor *cursor)
{
    free(cursor);
    return SQLITE_OK;
}

static struct entry_cursor *own(sqlite3_vtab_cursor *cursor)
{
    return (struct entry_cursor *)(void *)cursor;
}

static int entry_filter(sqlite3_vtab_cursor *cursor, int plan, const char *text, int argc,
                        sqlite3_value **argv)
{
    (void)plan;
    (void)text;
    (void)argc;
    (void)argv;
    struct entry_cursor *c = own(cursor);
    const struct table *t = c->rows->table;
    const double *const number[SPECTRUM] = { t->Cm, t->Bm,  t->Ch,    t->L,   t->a,
                                             t->b,  t->red, t->green, t->blue };
    memcpy(c->number, number, sizeof number);
    c->at = 0;
    c->n = c->rows->n;
    c->bands = t->recipe.bands;
    return SQLITE_OK;
}

static int entry_next(sqlite3_vtab_cursor *cursor)
{
    own(cursor)->at++;
    return SQLITE_OK;
}

static int entry_eof(sqlite3_vtab_cursor *cursor)
{
    return own(cursor)->at >= own(cursor)->n;
}

static int entry_rowid(sqlite3_vtab_cursor *cursor, sqlite3_int64 *ret)
{
    *ret = (sqlite3_int64)own(cursor)->at + 1;
    return SQLITE_OK;
}

static int entry_column(sqlite3_vtab_cursor *cursor, sqlite3_context *context, int column)
{
    struct entry_cursor *c = own(cursor);
    if (column < SPECTRUM)
        sqlite3_result_double(context, c->number[column][c->at]);
    else if (c->bands > 0) { /* NULL else; what stays until the next row is not copied */
        table_spectrum_to_blob(table_spectrum(c->rows->table, c->at), c->bands, c->blob);
        sqlite3_result_blob(context, c->blob, (int)(4 * c->bands), SQLITE_STATIC);
    }
    return SQLITE_OK;
}

/* Nobody makes such a table: it is there by the module's name. */
static const sqlite3_module entry_module = {
    .xConnect = entry_connect,
    .xBestIndex = entry_best_index,
    .xDisconnect = entry_disconnect,
    .xOpen = entry_open,
    .xClose = entry_close,
    .xFilter = entry_filter,
    .xNext = entry_next,
    .xEof = entry_eof,
    .xColumn = entry_column,
    .xRowid = entry_rowid,
};

enum status entry_rows_register(sqlite3 *db, const struct entry_rows *rows)
{
    /* SQLite's module data is not const; nothing is written to it here. */
    union {
        const struct entry_rows *in;
        void *out;
    } data = { .in = rows };
    return sql_status(sqlite3_create_module(db, "entry_rows", &entry_module, data.out));
}
