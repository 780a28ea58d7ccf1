/* de2000_rows.h - queries by CIEDE2000 and their nearest rows, found without a search: every row's
 * distance is taken, by delta_e_2000_squares(), and by delta_e_2000() where that could be among
 * the nearest. */
#ifndef SKINSPEC_TESTS_SUPPORT_DE2000_ROWS_H
#define SKINSPEC_TESTS_SUPPORT_DE2000_ROWS_H

#include <stdbool.h>
#include <stddef.h>

#include "match/nearest.h"
#include "match/table.h"

/* A step from a row in a chance direction: 0.5 to 1 dE*ab, and 3 to 10. */
enum de2000_sort { DE2000_TYPICAL, DE2000_OFF, DE2000_SORTS };

/* A table of the two-layer model, about so many rows, Cm and Ch evenly spaced in the logarithm. */
enum status de2000_table(size_t rows, struct table *t);

/* A number's query is the same whoever asks for it. */
void de2000_query(const struct table *t, enum de2000_sort sort, size_t number,
                  struct nearest_query *ret);

/* Whether nearest_find() answers query `number` as all rows do: the same rows and distances to the
 * last bit.  By the number: both sorts, 1 and 5 rows, and one in three within a range of Cm, Bm and
 * Ch, whose count is added to. */
bool de2000_agrees(const struct nearest *nearest, const struct table *t, size_t number,
                   size_t *limited);

#endif
