/* store_row.c - one row on its way into the file: each value is bound, and dumped for the audit
 * chain, so that the row need not be read again to take its digest. */
#include <math.h>
#include <string.h>

#include "db/sql.h"
#include "db/store_private.h"

void store_row_begin(struct store_row *row, sqlite3_stmt *insert, const char *table)
{
    row->insert = insert;
    row->i = 0;
    audit_dump_begin(&row->dump, NULL, table);
}

static void null(struct store_row *row)
{
    sqlite3_bind_null(row->insert, ++row->i);
}

void store_row_text(struct store_row *row, const char *name, const char *text)
{
    size_t n = strlen(text);
    if (n == 0) {
        null(row);
        return;
    }
    sqlite3_bind_text(row->insert, ++row->i, text, (int)n, SQLITE_STATIC);
    audit_dump_text(&row->dump, name, text, n);
}

void store_row_integer(struct store_row *row, const char *name, int64_t x)
{
    sqlite3_bind_int64(row->insert, ++row->i, x);
    audit_dump_integer(&row->dump, name, x);
}

void store_row_integer_unless(struct store_row *row, const char *name, int64_t x, bool absent)
{
    if (absent)
        null(row);
    else
        store_row_integer(row, name, x);
}

void store_row_number(struct store_row *row, const char *name, double x)
{
    if (isnan(x)) {
        null(row);
        return;
    }
    if (x == 0.0)
        x = 0.0; /* SQLite keeps no -0 */
    sqlite3_bind_double(row->insert, ++row->i, x);
    audit_dump_float(&row->dump, name, x);
}

void store_row_blob(struct store_row *row, const char *name, const unsigned char *bytes, size_t n)
{
    if (n == 0) {
        null(row);
        return;
    }
    sqlite3_bind_blob(row->insert, ++row->i, bytes, (int)n, SQLITE_STATIC);
    audit_dump_blob(&row->dump, name, bytes, n);
}

enum status store_row_insert(struct store_row *row, struct audit_digests *digests)
{
    enum status s = sql_step_done(row->insert);
    sqlite3_clear_bindings(row->insert); /* the memory goes */
    audit_dump_end(&row->dump, digests->bytes + digests->n++ * AUDIT_HASH_SIZE);
    return s;
}
