/* components.h - the few directions in which spectra of a table differ most, and
 * spectra as points in them: what a search looks at instead of all bands.
 *
 * A point is the components of (spectrum - mean) in these directions and the norm of
 * what they leave over.  Directions are orthonormal, so the components together with
 * the whole of the rest have the spectra's own distances; of rests only the
 * norms are kept, which differ by no more than the rests do.  Hence
 *     |point(x) - point(y)| <= |x - y|, Euclidean over all bands,
 * nearly an equality for spectra like the table's, but for rounding of COMPONENTS_ROUNDING of
 * the points' norms: the norm of a rest is told from what the components leave of the whole. */
#ifndef SKINSPEC_MATCH_COMPONENTS_H
#define SKINSPEC_MATCH_COMPONENTS_H

#include <stddef.h>

#include "base/status.h"
#include "match/table.h"

enum { COMPONENTS = 13, COMPONENTS_DIMS = COMPONENTS + 1 };

/* In the norms of two points, what rounding may add to their distance. */
#define COMPONENTS_ROUNDING 3e-7

struct components;

/* From rows spread evenly over the table; the same table gives the same directions.
 * Where spectra differ in fewer ways than COMPONENTS, the others are 0.
 * STATUS_NO_MEMORY. */
enum status components_open(const struct table *table, struct components **ret);
void components_close(struct components *components); /* takes NULL */

/* Of a spectrum over the table's bands.  Cannot fail; NaN in gives NaN out. */
void components_point(const struct components *components, const double *value,
                      double point[COMPONENTS_DIMS]);

/* Of a row's spectrum. */
void components_row_point(const struct components *components, const float *value,
                          double point[COMPONENTS_DIMS]);

#endif
