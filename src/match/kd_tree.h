/* kd_tree.h - rows as points in a few dimensions, kept in nested boxes, so that a search
 * meets the near ones first and never touches most of the far ones.
 *
 * The tree judges by bounds alone: which rows it shows can differ from one build of
 * the program to another, that none is missing cannot.  Distances and ties are the
 * caller's business. */
#ifndef SKINSPEC_MATCH_KD_TREE_H
#define SKINSPEC_MATCH_KD_TREE_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

enum { KD_TREE_MAX_DIMS = 16, KD_TREE_BOUND_DIMS = 8, KD_TREE_WIDTH = 16, KD_TREE_FIELDS = 3 };

/* Points must not lie further apart than the things they stand for, but for rounding:
 * |p(x) - p(y)| <= d(x, y) + rounding (|p(x)| + |p(y)|), see below. */
typedef void kd_tree_point(void *context, size_t row, double *point);

/* What makes a tree: rows 0 .. n-1, n >= 1, at point(context, row, ...)[dims], 1 <= dims <=
 * KD_TREE_MAX_DIMS.  field: columns [n] that a search may be limited by, all or none; they must
 * outlive the tree. */
struct kd_tree_rows {
    size_t n, dims;
    unsigned threads; /* at most so many make it, at least 1; point() is called by all of them */
    kd_tree_point *point;
    double rounding; /* 1e-9 .. 1e-6 */
    void *context;
    const double *field[KD_TREE_FIELDS];
};

/* Made once, then only read: many threads may search at a time. */
struct kd_tree;

/* STATUS_RANGE where a point is not finite or farther than 1e15 from the origin, or there
 * are more rows than 32 bits count; STATUS_NO_MEMORY. */
enum status kd_tree_open(const struct kd_tree_rows *rows, struct kd_tree **ret);
void kd_tree_close(struct kd_tree *tree); /* takes NULL */

/* Shown a row; returns the distance d above which rows no longer matter, which never
 * grows; INFINITY while all do. */
typedef double kd_tree_look(void *context, size_t row);

/* Told which row may be looked at soon, to have it on its way from memory. */
typedef void kd_tree_fetch(void *context, size_t row);

/* A measure of the caller's own instead of the distance between points: to at most what any
 * point in a box can have of it, for KD_TREE_WIDTH boxes at once.  low, high:
 * [dims][KD_TREE_WIDTH], their corners; the points are at both.  They are rounded to floats: a
 * row's own coordinate x lies within 2^-24 |x| of what is kept.  Bounds of boxes past the end do
 * not matter.  Only for trees of up to KD_TREE_BOUND_DIMS: others keep points otherwise. */
typedef void kd_tree_bound(void *context, const float *low, const float *high,
                           float bound[KD_TREE_WIDTH]);

/* Values that fields have to be within, ends included. */
struct kd_tree_range {
    double lo[KD_TREE_FIELDS], hi[KD_TREE_FIELDS];
};

struct kd_tree_task {
    const double *query; /* [dims]; not used with a bound of the caller's own */
    kd_tree_look *look;
    kd_tree_fetch *fetch;              /* NULL: not told */
    kd_tree_bound *bound;              /* NULL: the distance between points */
    void *context;                     /* of all */
    const struct kd_tree_range *range; /* NULL: all rows; only for a tree with fields */
    size_t judged;                     /* boxes and points are added that were judged */
    bool refused;                      /* set: true, and nothing shown, see kd_tree_search() */
};

/* Shows every row that matters and lies in the range, about the nearest first, and some that
 * do not matter.  Boxes without a row in the range are not entered.  false, and nothing
 * shown, where the query is not finite or beyond 1e15, or a bound is given to a tree of too many
 * dimensions for one. */
bool kd_tree_search(const struct kd_tree *tree, struct kd_tree_task *task);

/* Searches that are on their way at a time. */
enum { KD_TREE_TOGETHER = 6 };

/* The next task for a slot below KD_TREE_TOGETHER, whose last one, if it had any, is done now;
 * NULL: none, and the slot is not asked again. */
typedef struct kd_tree_task *kd_tree_next(void *context, size_t slot);

/* kd_tree_search() for all tasks that are given, the same rows shown in the same order for each:
 * in turns, so that while one waits for memory the others go on. */
void kd_tree_search_many(const struct kd_tree *tree, kd_tree_next *next, void *context);

#endif
