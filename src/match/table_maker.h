/* table_maker.h - rows of a table computed, many at a time and on several cores.
 *
 * half-space and two-layer go by vectors, what rows share computed once (optics/shared_layers.h,
 * colour/colour_many.h): spectra within 1e-12 and colours within 1e-11 of the row maker's
 * (match/recipe.h); colours of large tables, interpolated (match/lattice.h), within 3e-11.  Rows
 * beyond those formulas, and other models, are the row maker's own. */
#ifndef SKINSPEC_MATCH_TABLE_MAKER_H
#define SKINSPEC_MATCH_TABLE_MAKER_H

#include <stddef.h>

#include "base/status.h"
#include "match/table.h"

struct table_maker;

/* For at most `threads` threads (0 is 1).  Statuses of row_maker_open(). */
enum status table_maker_open(const struct recipe *recipe, unsigned threads,
                             struct table_maker **ret);
void table_maker_close(struct table_maker *maker); /* takes NULL */

/* Rows first .. first+count-1 of the recipe into rows 0 .. count-1 of a table of that recipe,
 * count <= table->n.  The same bits for any number of threads and in any pieces. */
enum status table_maker_rows(struct table_maker *maker, size_t first, size_t count,
                             struct table *table);

/* Of these, n rows from first on into rows at .. at+n-1, on the calling thread; worker, below
 * `threads`, is one that no other thread uses meanwhile. */
enum status table_maker_some(struct table_maker *maker, unsigned worker, size_t first, size_t n,
                             struct table *table, size_t at);

#endif
