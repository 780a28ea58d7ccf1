/* nanoflann.h - the k-d tree of nanoflann (C++, Debian's libnanoflann-dev), from C. */
#ifndef SKINSPEC_TESTS_BENCH_PEERS_NANOFLANN_H
#define SKINSPEC_TESTS_BENCH_PEERS_NANOFLANN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct peer_tree;

/* Points [n][3], which must outlive the tree; `leaf` points to a leaf. */
struct peer_tree *peer_tree_open(size_t n, const float *point, size_t leaf);
void peer_tree_close(struct peer_tree *tree);

/* The nearest point to query[3]. */
uint32_t peer_tree_find(const struct peer_tree *tree, const float *query);

#ifdef __cplusplus
}
#endif

#endif
