/* kd_layout.h - where the boxes and points of a tree stand: for kd_tree.c, kd_make.c only.
 *
 * Rows are put in an order in which every KD_TREE_WIDTH neighbours are close together, every 16
 * such leaves, and so on; so a tree is just arrays, and where a box's content stands follows
 * from its number.  Entries stand in groups of KD_TREE_WIDTH, dimension by dimension, which
 * lets a compiler judge them all at once.
 *
 * Points of many dimensions, and the boxes around KD_WIDTH of them, stand in frames
 * (match/kd_frame.h): one for each group of such boxes, which are up to KD_FRAMED points. */
#ifndef SKINSPEC_MATCH_KD_LAYOUT_H
#define SKINSPEC_MATCH_KD_LAYOUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "match/kd_frame.h"
#include "match/kd_judge.h"
#include "match/kd_tree.h"

enum { KD_MAX_LEVELS = 8 }; /* 16^8 = 2^32 rows */

/* Points in a frame; points of more than KD_TREE_BOUND_DIMS are framed. */
enum { KD_FRAMED = KD_WIDTH * KD_WIDTH };

/* Arrays up to this size lie in a core's own cache, and it is not worth the while to fetch from
 * them ahead: measured; some 54 000 rows of colours. */
#define KD_NEAR_BYTES ((size_t)1 << 20)

/* Squares of this still fit a float. */
#define KD_LARGEST_NORM 1e15

/* Level 0 are the points, level l + 1 the boxes around groups of level l; the top level has one
 * group.  What is past the end is 0. */
struct kd_tree {
    size_t dims;
    unsigned levels;
    size_t entries[KD_MAX_LEVELS]; /* points or boxes of a level */
    /* [group][dims][KD_WIDTH] of points, [group][2][dims][KD_WIDTH] of boxes: low, then high. */
    float *corner[KD_MAX_LEVELS];
    /* The same of their fields, [group][2][KD_TREE_FIELDS][KD_WIDTH]; NULL for points, which have
     * their own in the columns, and without fields. */
    float *ends[KD_MAX_LEVELS];
    const double *field[KD_TREE_FIELDS];
    uint32_t *row;          /* [entries[0]] */
    struct kd_frame *frame; /* [groups of level 1]; NULL where points are not framed */
    void *block;            /* all of these arrays */
    double norm;            /* of the farthest point */
    double rounding;        /* of the points that were given */
    bool framed;            /* points are */
    bool large;             /* more than KD_NEAR_BYTES */
    bool few;               /* so few points that all are judged, and no boxes */
    enum vectors vectors;
    const struct kd_judge *judge;
};

/* That entries of a level are told in. */
static inline size_t kd_dims(const struct kd_tree *tree, unsigned level)
{
    return tree->framed && level <= 1 ? (size_t)KD_FRAME_DIMS : tree->dims;
}

/* Low corner of an entry at dimension 0; the next dimension is KD_WIDTH further.  The high one is
 * kd_high() further. */
static inline size_t kd_place(size_t dims, unsigned level, size_t entry)
{
    size_t corners = level == 0 ? 1 : 2;
    return entry / KD_WIDTH * corners * dims * KD_WIDTH + entry % KD_WIDTH;
}

static inline size_t kd_high(size_t dims, unsigned level)
{
    return level == 0 ? 0 : dims * KD_WIDTH;
}

/* The nearest floats that enclose x. */
float kd_float_below(double x);
float kd_float_above(double x);

#endif
