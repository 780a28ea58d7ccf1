/* best.h - the k best rows of a search, in the caller's hits[]: sorted by distance,
 * then by row, whatever order they are offered in. */
#ifndef SKINSPEC_MATCH_BEST_H
#define SKINSPEC_MATCH_BEST_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#include "match/nearest.h"

struct best {
    struct nearest_hit *hits;
    size_t k, n;
};

/* Nothing above this can enter the list. */
static inline double best_limit(const struct best *best)
{
    return best->n < best->k ? (double)INFINITY : best->hits[best->n - 1].distance;
}

/* The same for the squares that searches work with, wider by more than root and product
 * round.  The list itself holds roots: squares that differ in their last bits may
 * have the same one, and then the lower row comes first. */
static inline double best_limit_square(const struct best *best)
{
    double distance = best_limit(best);
    return distance * distance * (1.0 + 1e-15);
}

static inline bool best_comes_before(double distance, size_t row, const struct nearest_hit *hit)
{
    return distance < hit->distance || (distance == hit->distance && row < hit->row);
}

static inline void best_offer(struct best *best, size_t row, double distance)
{
    if (best->n == best->k && !best_comes_before(distance, row, &best->hits[best->n - 1]))
        return;
    size_t place = best->n < best->k ? best->n++ : best->n - 1;
    for (; place > 0 && best_comes_before(distance, row, &best->hits[place - 1]); place--)
        best->hits[place] = best->hits[place - 1];
    best->hits[place] = (struct nearest_hit){ row, distance };
}

#endif
