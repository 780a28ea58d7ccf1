/* quantiles.c - counts by the upper, then the lower 16 bits of what sorts as the float does. */
#include "cube/quantiles.h"

#include <math.h>
#include <string.h>

#include "base/vectors.h"

/* Values that are worked on side by side. */
enum { GROUP = 16, MANY = 32 * GROUP };
/* The half that NaN is said to be in. */
enum { NOT_A_NUMBER = QUANTILES_HALF };

VECTORS_INLINE uint32_t order_of(uint32_t bits)
{
    return bits >> 31 != 0 ? ~bits : bits | 0x80000000u;
}

VECTORS_INLINE uint32_t half_of(uint32_t bits)
{
    return (bits & 0x7fffffffu) > 0x7f800000u ? (uint32_t)NOT_A_NUMBER : order_of(bits) >> 16;
}

static float value_of(uint32_t order)
{
    uint32_t bits = order >> 31 != 0 ? order & 0x7fffffffu : ~order;
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

void quantiles_begin(struct quantiles *q, const double *share, size_t wanted)
{
    q->wanted = wanted;
    q->count = 0;
    memcpy(q->share, share, wanted * sizeof *share);
    memset(q->upper, 0, sizeof q->upper);
    memset(q->lower, 0, wanted * sizeof *q->lower);
}

/* ---- the first pass ------------------------------------------------------------------ */

/* Halves of many values, then their counts: what a vector wrote just now is read slowly. */
VECTORS_INLINE void first_groups(struct quantiles *q, const float *value, size_t n)
{
    uint32_t half[MANY];
    for (size_t i = 0; i < n; i += MANY) {
        size_t many = n - i < MANY ? n - i : MANY;
        for (size_t k = 0; k < many; k += GROUP) {
            uint32_t bits[GROUP];
            memcpy(bits, value + i + k, sizeof bits);
            for (size_t l = 0; l < GROUP; l++)
                half[k + l] = half_of(bits[l]);
        }
        for (size_t k = 0; k < many; k += 2) {
            q->upper[half[k]][0]++;
            q->upper[half[k + 1]][1]++;
        }
    }
}

/* ---- the second ---------------------------------------------------------------------- */

static void second_one(struct quantiles *q, uint32_t bits)
{
    uint32_t half = half_of(bits), order = order_of(bits);
    for (size_t k = 0; k < q->wanted; k++)
        if (half == q->half[k])
            q->lower[k][order & 0xffff]++;
}

/* Most groups have none that lies in a half with a quantile, and few have more than one. */
VECTORS_INLINE void second_groups(struct quantiles *q, const float *value, size_t n)
{
    uint32_t wanted[QUANTILES_MOST];
    for (size_t k = 0; k < QUANTILES_MOST; k++)
        wanted[k] = q->half[k < q->wanted ? k : 0];
    for (size_t i = 0; i < n; i += GROUP) {
        uint32_t bits[GROUP], there = 0; /* bit k: value k does */
        memcpy(bits, value + i, sizeof bits);
        for (uint32_t k = 0; k < GROUP; k++) {
            uint32_t half = half_of(bits[k]);
            uint32_t one = (half == wanted[0]) | (half == wanted[1]) | (half == wanted[2]) |
                           (half == wanted[3]);
            there |= one << k;
        }
        for (; there != 0; there &= there - 1)
            second_one(q, bits[__builtin_ctz(there)]);
    }
}

/* ---- by vectors ---------------------------------------------------------------------- */

typedef void pass_function(struct quantiles *q, const float *value, size_t n);

static void first_plain(struct quantiles *q, const float *value, size_t n)
{
    first_groups(q, value, n);
}

VECTORS_AVX2 static void first_avx2(struct quantiles *q, const float *value, size_t n)
{
    first_groups(q, value, n);
}

VECTORS_AVX512 static void first_avx512(struct quantiles *q, const float *value, size_t n)
{
    first_groups(q, value, n);
}

static void second_plain(struct quantiles *q, const float *value, size_t n)
{
    second_groups(q, value, n);
}

VECTORS_AVX2 static void second_avx2(struct quantiles *q, const float *value, size_t n)
{
    second_groups(q, value, n);
}

VECTORS_AVX512 static void second_avx512(struct quantiles *q, const float *value, size_t n)
{
    second_groups(q, value, n);
}

void quantiles_first(struct quantiles *q, const float *value, size_t n)
{
    static pass_function *const by[VECTORS_KINDS] = { first_plain, first_avx2, first_avx512 };
    size_t whole = n / GROUP * GROUP;
    by[vectors_best()](q, value, whole);
    for (size_t i = whole; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, value + i, sizeof bits);
        q->upper[half_of(bits)][0]++;
    }
}

void quantiles_second(struct quantiles *q, const float *value, size_t n)
{
    static pass_function *const by[VECTORS_KINDS] = { second_plain, second_avx2, second_avx512 };
    size_t whole = n / GROUP * GROUP;
    if (q->count == 0)
        return;
    by[vectors_best()](q, value, whole);
    for (size_t i = whole; i < n; i++) {
        uint32_t bits;
        memcpy(&bits, value + i, sizeof bits);
        second_one(q, bits);
    }
}

/* ---- what they found ----------------------------------------------------------------- */

void quantiles_between(struct quantiles *q)
{
    for (size_t half = 0; half < QUANTILES_HALF; half++)
        q->count += q->upper[half][0] + q->upper[half][1];
    for (size_t k = 0; k < q->wanted && q->count > 0; k++) {
        double wanted = ceil(q->share[k] * (double)q->count);
        uint64_t rank = wanted > 1.0 ? (uint64_t)wanted - 1 : 0;
        uint32_t half = 0;
        if (rank >= q->count)
            rank = q->count - 1;
        for (; rank >= q->upper[half][0] + q->upper[half][1]; half++)
            rank -= q->upper[half][0] + q->upper[half][1];
        q->half[k] = half;
        q->rank[k] = rank;
    }
}

double quantiles_end(const struct quantiles *q, size_t i)
{
    uint64_t rank = q->rank[i];
    uint32_t low = 0;
    if (q->count == 0)
        return (double)NAN;
    for (; rank >= q->lower[i][low]; low++)
        rank -= q->lower[i][low];
    return (double)value_of(q->half[i] << 16 | low);
}
