/* kd_judge.h - boxes of a tree held against a query, sixteen at once.
 *
 * Squares of distances are told as keys: the bits of the float, which order as floats that are
 * not negative do, the last KD_KEY_BITS replaced by the entry's number.  So the least of many keys
 * says which entry that is, and a key says at most the square, less by at most 2^-19 of it. */
#ifndef SKINSPEC_MATCH_KD_JUDGE_H
#define SKINSPEC_MATCH_KD_JUDGE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/vectors.h"
#include "match/kd_tree.h"

enum { KD_WIDTH = KD_TREE_WIDTH };

enum { KD_KEY_BITS = 4, KD_KEY_NUMBER = (1 << KD_KEY_BITS) - 1 };

/* Of an entry that is none: above any square. */
#define KD_KEY_NONE INT32_MAX

/* Below any key. */
#define KD_KEY_BEFORE (-1)

/* Above every key of a square up to this one. */
static inline int32_t kd_key_limit(float square)
{
    int32_t bits;
    memcpy(&bits, &square, sizeof bits);
    return bits | KD_KEY_NUMBER;
}

/* One kind of vectors; all kinds give the same keys. */
struct kd_judge {
    const char *name;
    /* Keys of the squared distances from query[dims] to 16 entries whose corners are
     * [dims][KD_WIDTH]: to a point itself, to a box's nearest side, 0 inside.  Returns the least.
     */
    int32_t (*group)(size_t dims, const float *low, const float *high, const float *query,
                     int32_t key[KD_WIDTH]);
    /* The least of those above `after`. */
    int32_t (*least)(const int32_t key[KD_WIDTH], int32_t after);
};

/* Only for vectors that the processor has. */
const struct kd_judge *kd_judge_of(enum vectors kind);

#endif
