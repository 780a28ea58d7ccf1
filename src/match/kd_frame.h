/* kd_frame.h - a frame of a tree's own for every few hundred points: where these spread, and how
 * far off that a point is.
 *
 * Points of many dimensions that depend on few parameters lie on a surface, which is all but flat
 * where it is small.  So a few directions, of the points that there are, and the norm of what they
 * leave over tell them apart as well as all dimensions do, in fewer lines of memory, and boxes
 * along that surface are flat as it is, so that a query off it meets few of them.
 *
 * Directions are orthonormal but for their rounding to floats; so, as in match/components.h,
 *     |framed(x) - framed(y)| <= |x - y| (1 + 2^-20) + 2^-23 (|x - centre| + |y - centre|),
 * the first for that rounding, the second for the result's: what is between is in doubles. */
#ifndef SKINSPEC_MATCH_KD_FRAME_H
#define SKINSPEC_MATCH_KD_FRAME_H

#include <stddef.h>

#include "base/vectors.h"
#include "match/kd_tree.h"

enum { KD_FRAME_DIRECTIONS = 5, KD_FRAME_DIMS = KD_FRAME_DIRECTIONS + 1 };

/* Zero past the dimensions that there are; directions that there are not are 0. */
struct kd_frame {
    float centre[KD_TREE_MAX_DIMS], direction[KD_FRAME_DIRECTIONS][KD_TREE_MAX_DIMS];
};

/* Of n >= 1 points, point[stride * i][dims].  Cannot fail; the same points, the same frame. */
void kd_frame_make(size_t dims, size_t n, const float *point, size_t stride, struct kd_frame *ret);

/* A point in a frame; any kind of vectors that the processor has gives the same bits. */
void kd_frame_point(enum vectors kind, const struct kd_frame *frame,
                    const float point[KD_TREE_MAX_DIMS], float ret[KD_FRAME_DIMS]);

#endif
