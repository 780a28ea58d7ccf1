/* kd_judge.c - one source, compiled for several kinds of vectors: the same operations in the same
 * order, so the same bits. */
#include "match/kd_judge.h"

#include "match/kd_frame.h"

/* As fmaxf(), which a call and its care for NaN make slow. */
VECTORS_INLINE float higher(float x, float y)
{
    return x > y ? x : y;
}

/* Nothing is written into keys: a vector that is read after a part of it was written waits. */
VECTORS_INLINE int32_t least_any(const int32_t key[KD_WIDTH], int32_t after)
{
    int32_t least = KD_KEY_NONE, above[KD_WIDTH];
    for (size_t i = 0; i < KD_WIDTH; i++)
        above[i] = key[i] > after ? key[i] : KD_KEY_NONE;
    for (size_t i = 0; i < KD_WIDTH; i++)
        least = above[i] < least ? above[i] : least;
    return least;
}

VECTORS_INLINE void add_squares(const float *low, const float *high, float query,
                                float sum[KD_WIDTH])
{
    float outside[KD_WIDTH]; /* two loops: in one, a compiler jumps over what is not outside */
    for (size_t i = 0; i < KD_WIDTH; i++)
        outside[i] = higher(higher(low[i] - query, query - high[i]), 0.0f);
    for (size_t i = 0; i < KD_WIDTH; i++)
        sum[i] += outside[i] * outside[i];
}

VECTORS_INLINE int32_t group_any(size_t dims, const float *low, const float *high,
                                 const float *query, int32_t key[KD_WIDTH])
{
    const size_t last = (size_t)2 * KD_WIDTH;
    float sum[KD_WIDTH] = { 0.0f };
    int32_t bits[KD_WIDTH];
    if (dims == 3) { /* colours */
        add_squares(low, high, query[0], sum);
        add_squares(low + KD_WIDTH, high + KD_WIDTH, query[1], sum);
        add_squares(low + last, high + last, query[2], sum);
    } else if (dims == KD_FRAME_DIMS) { /* points of spectra */
        for (size_t dim = 0; dim < KD_FRAME_DIMS; dim++)
            add_squares(low + dim * KD_WIDTH, high + dim * KD_WIDTH, query[dim], sum);
    } else {
        for (size_t dim = 0; dim < dims; dim++)
            add_squares(low + dim * KD_WIDTH, high + dim * KD_WIDTH, query[dim], sum);
    }
    memcpy(bits, sum, sizeof bits);
    for (int32_t i = 0; i < KD_WIDTH; i++)
        bits[i] = (bits[i] & ~KD_KEY_NUMBER) | i;
    memcpy(key, bits, sizeof bits);
    return least_any(bits, KD_KEY_BEFORE);
}

static int32_t group_plain(size_t dims, const float *low, const float *high, const float *query,
                           int32_t key[KD_WIDTH])
{
    return group_any(dims, low, high, query, key);
}

static int32_t least_plain(const int32_t key[KD_WIDTH], int32_t after)
{
    return least_any(key, after);
}

VECTORS_AVX2 static int32_t group_avx2(size_t dims, const float *low, const float *high,
                                       const float *query, int32_t key[KD_WIDTH])
{
    return group_any(dims, low, high, query, key);
}

VECTORS_AVX2 static int32_t least_avx2(const int32_t key[KD_WIDTH], int32_t after)
{
    return least_any(key, after);
}

VECTORS_AVX512 static int32_t group_avx512(size_t dims, const float *low, const float *high,
                                           const float *query, int32_t key[KD_WIDTH])
{
    return group_any(dims, low, high, query, key);
}

VECTORS_AVX512 static int32_t least_avx512(const int32_t key[KD_WIDTH], int32_t after)
{
    return least_any(key, after);
}

static const struct kd_judge judges[VECTORS_KINDS] = {
    [VECTORS_PLAIN] = { "plain", group_plain, least_plain },
    [VECTORS_WITH_AVX2] = { "AVX2", group_avx2, least_avx2 },
    [VECTORS_WITH_AVX512] = { "AVX-512", group_avx512, least_avx512 },
};

const struct kd_judge *kd_judge_of(enum vectors kind)
{
    return &judges[kind];
}
