/* brute.h - the nearest rows by looking at every one, for large tables: what an exact search is
 * held against.  It shares no code with the search.
 *
 * Squares are first taken in floats, sixteen rows at once; whatever could be among the
 * nearest, as far as floats can tell, is then measured in doubles. */
#ifndef SKINSPEC_TESTS_SUPPORT_BRUTE_H
#define SKINSPEC_TESTS_SUPPORT_BRUTE_H

#include <stddef.h>

#include "match/nearest.h"
#include "tests/support/skin_queries.h"

/* By Lab, 8-bit codes or spectrum; rows have to be numbers. */
struct brute;
struct brute *brute_open(const struct table *table, enum match_by by); /* NULL: no memory */
void brute_close(struct brute *brute);

/* Of a question to a row, as `by` says (match/nearest.h). */
double brute_distance(const struct brute *brute, const struct skin_query *query, size_t row);

/* The k nearest to each of n questions, by distance and then by row, into hits[n][k]; k <= rows.
 * By all cores. */
void brute_find(const struct brute *brute, const struct skin_query *query, size_t n, size_t k,
                struct nearest_hit *hits);

/* How nearest_find() answers the same. */
struct brute_verdict {
    size_t wrong;    /* questions with a row among the k that is farther than brute force's there */
    size_t rounding; /* with another row, the distances the same to 1e-13 */
    double seconds;  /* of brute force */
};

struct brute_verdict brute_judge(const struct brute *brute, const struct nearest *nearest,
                                 const struct skin_query *query, size_t n, size_t k);

#endif
