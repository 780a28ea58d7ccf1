/* lattice.h - XYZ of a large table's rows, interpolated between rows of few values of each axis.
 *
 * R, and so XYZ, is a smooth function of Cm, Bm and Ch: the values at the nodes of each axis
 * (match/skeleton.h), which are rows of the table, give all others as weighted sums, first along
 * Cm, then Bm, then Ch.  No figure is taken on trust: opening compares rows between nodes with rows
 * computed (docs/decisions/0016). */
#ifndef SKINSPEC_MATCH_LATTICE_H
#define SKINSPEC_MATCH_LATTICE_H

#include <stddef.h>

#include "base/status.h"
#include "colour/colour_many.h"
#include "match/grid.h"
#include "optics/shared_layers.h"

struct lattice;

/* What it is made of; values of the axes, and all dermises in the formulas' range, one after the
 * other.  Used only while opening, but for the grid. */
struct lattice_source {
    const struct grid *grid;
    const double *Cm, *Bm, *Ch;
    const struct shared_layers *layers;
    const double *dermis;
    const struct colour_many *colour;
};

/* *ret stays NULL where computing all rows is about as quick (fewer than LATTICE_ROWS_MIN in
 * all, or than 256 for each value of an axis), the model is transport (not tried), an epidermis is
 * beyond the formulas' range, an axis has no skeleton, or a compared colour is further off than
 * LATTICE_TOLERANCE (of L*, a*, b*; linear sRGB a hundredth of it). */
#define LATTICE_ROWS_MIN 32768u
#define LATTICE_TOLERANCE 1e-11
enum status lattice_open(const struct lattice_source *source, struct lattice **ret);
void lattice_close(struct lattice *l); /* takes NULL */

/* Of one thread: sums that rows one after the other share. */
struct lattice_sums;
enum status lattice_sums_open(const struct lattice *l, struct lattice_sums **ret);
void lattice_sums_close(struct lattice_sums *s); /* takes NULL */

/* XYZ of n rows from place on, all of one epidermis; XYZ[k] has room for n rounded up to
 * VECTORS_LANES.  The same bits in any pieces and with AVX2 and AVX-512. */
void lattice_xyz(const struct lattice *l, struct lattice_sums *sums, struct grid_place place,
                 size_t n, double *const XYZ[3]);

/* Rows computed to open it. */
size_t lattice_nodes(const struct lattice *l);

#endif
