/* table_files.h - small table files for tests, and ways to alter them by hand. */
#ifndef SKINSPEC_TESTS_SUPPORT_TABLE_FILES_H
#define SKINSPEC_TESTS_SUPPORT_TABLE_FILES_H

#include <stdbool.h>

#include "db/table_build.h"
#include "match/recipe.h"

/* A model's default recipe on a small grid with a Cm of 0: 4 + 3 x 5 x 4 rows. */
enum { SMALL_TABLE_ROWS = 64 };
struct recipe small_recipe(const char *model);

/* Build it there; an existing file is replaced. */
enum status small_table(const char *path, const struct recipe *recipe, bool rtree);

/* Run SQL on the file, whatever its hashes; false where SQLite will not. */
bool table_edit(const char *path, const char *sql);

/* Make the pages hash right again, and for the second the content hash before. */
bool table_reseal(const char *path);
bool table_rehash(const char *path);

#endif
