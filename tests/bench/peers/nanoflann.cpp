// nanoflann.cpp - nanoflann as its own examples use it: floats, three fixed dimensions, the
// Euclidean metric that it recommends for so few (L2_Simple).
#include "tests/bench/peers/nanoflann.h"

#include <nanoflann.hpp>

namespace {

struct points {
    size_t n;
    const float *point;
    size_t kdtree_get_point_count() const { return n; }
    float kdtree_get_pt(size_t row, size_t dim) const { return point[3 * row + dim]; }
    template <class box> bool kdtree_get_bbox(box &) const { return false; }
};

using index_of_3 = nanoflann::KDTreeSingleIndexAdaptor<
    nanoflann::L2_Simple_Adaptor<float, points>, points, 3, uint32_t>;

} // namespace

struct peer_tree {
    points p;
    index_of_3 index;
    peer_tree(size_t n, const float *point, size_t leaf)
        : p{n, point}, index(3, p, nanoflann::KDTreeSingleIndexAdaptorParams(leaf))
    {
        index.buildIndex();
    }
};

peer_tree *peer_tree_open(size_t n, const float *point, size_t leaf)
{
    return new peer_tree(n, point, leaf);
}

void peer_tree_close(peer_tree *tree)
{
    delete tree;
}

uint32_t peer_tree_find(const peer_tree *tree, const float *query)
{
    uint32_t row = 0;
    float square = 0.0f;
    tree->index.knnSearch(query, 1, &row, &square);
    return row;
}
