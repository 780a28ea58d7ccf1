/* table_schema.h - what stands in a table file: the SQL, its version, and the
 * recipe as text.  docs/data.md describes the file for people who query it. */
#ifndef SKINSPEC_DB_TABLE_SCHEMA_H
#define SKINSPEC_DB_TABLE_SCHEMA_H

#include "base/status.h"
#include "match/recipe.h"

/* SQLite's own header fields say what the file is before any SQL is run. */
enum { TABLE_APPLICATION_ID = 0x536b5462 /* "SkTb" */, TABLE_FORMAT = 2 };

extern const char table_settings_sql[]; /* of the connection that builds a file */
extern const char table_schema_sql[];
extern const char table_schema_rtree_sql[]; /* only with an R*Tree */

/* The recipe as the meta rows that carry it, in the order of their keys. */
enum { TABLE_META_COUNT = 13, TABLE_META_VALUE_SIZE = 128 };
struct table_meta {
    const char *key[TABLE_META_COUNT];
    char value[TABLE_META_COUNT][TABLE_META_VALUE_SIZE];
};

/* Two more meta rows, the file's hashes: db/table_hash.h. */
#define TABLE_CONTENT_KEY "content_sha256"
#define TABLE_PAGES_KEY "pages_sha256"

void table_meta_of(const struct recipe *recipe, struct table_meta *ret);

/* Back again.  lookup() gives the value of a key or NULL.  On failure *bad_key is
 * the key whose value is missing or not understood: STATUS_FORMAT. */
typedef const char *table_meta_lookup(void *context, const char *key);
enum status table_meta_recipe(table_meta_lookup *lookup, void *context, struct recipe *ret,
                              const char **bad_key);

/* "400:700:10"; bands as first and last nm and step.  STATUS_FORMAT for other
 * text; STATUS_RANGE where the step does not lead from first to last, there are
 * too many or it is no grid. */
enum status table_bands_parse(const char *text, double *first_nm, double *step_nm, size_t *bands);

#endif
