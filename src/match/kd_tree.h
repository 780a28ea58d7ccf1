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

enum { KD_TREE_MAX_DIMS = 16 };

/* Points must not lie further apart than the things they stand for, but for rounding:
 * |p(x) - p(y)| <= d(x, y) + 1e-9 (|p(x)| + |p(y)|). */
typedef void kd_tree_point(void *context, size_t row, double *point);

/* Made once, then only read: many threads may search at a time. */
struct kd_tree;

/* Rows 0 .. n-1, n >= 1, at point(context, row, ...)[dims], 1 <= dims <= KD_TREE_MAX_DIMS.
 * STATUS_RANGE where a point is not finite or farther than 1e15 from the origin, or there
 * are more rows than 32 bits count; STATUS_NO_MEMORY. */
enum status kd_tree_open(size_t n, size_t dims, kd_tree_point *point, void *context,
                         struct kd_tree **ret);
void kd_tree_close(struct kd_tree *tree); /* takes NULL */

/* Shown a row; returns the distance d above which rows no longer matter, which never
 * grows; INFINITY while all do. */
typedef double kd_tree_look(void *context, size_t row);

/* Shows every row that matters, about the nearest first, and some that do not.
 * false, and nothing shown, where the query is not finite or beyond 1e15. */
bool kd_tree_search(const struct kd_tree *tree, const double *query, kd_tree_look *look,
                    void *context);

#endif
