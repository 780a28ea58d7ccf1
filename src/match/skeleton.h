/* skeleton.h - a few values of an axis from which functions follow at all others.
 *
 * An interpolative decomposition by rows: F(value i) = sum over nodes m of weight[i][m]
 * F(value node[m]) for all functions that the samples stand for, the nodes taken one after the
 * other where what is still missing is largest (Gram and Schmidt with pivoting).  Cheng, Gimbutas,
 * Martinsson and Rokhlin, On the Compression of Low Rank Matrices, 2005. */
#ifndef SKINSPEC_MATCH_SKELETON_H
#define SKINSPEC_MATCH_SKELETON_H

#include <stddef.h>

#include "base/status.h"
#include "base/vectors.h"

enum { SKELETON_MAX = 32 };

struct skeleton {
    size_t n, nodes;
    size_t node[SKELETON_MAX];
    double *weight; /* [n][SKELETON_MAX]; of a node itself exactly 1 and 0 */
};

/* Doubles between samples of n values. */
#define SKELETON_STRIDE(n) (((n) + VECTORS_LANES - 1) / VECTORS_LANES * VECTORS_LANES)

/* Of F[sample * SKELETON_STRIDE(n) + value], 0 past n, which is used up.  The root of the sum of
 * the squares of what is missing of a value is at most `missing` of the largest value's own.
 * STATUS_UNSUPPORTED where that takes more than SKELETON_MAX nodes, STATUS_NO_MEMORY; then *ret is
 * empty.  The same bits with AVX2 and AVX-512. */
enum status skeleton_init(size_t n, size_t samples, double *F, double missing, enum vectors vectors,
                          struct skeleton *ret);
void skeleton_done(struct skeleton *s); /* takes an empty one */

#endif
