/* quantiles.c - counts by the upper, then the lower 16 bits of what sorts as the float does. */
#include "cube/quantiles.h"

#include <math.h>
#include <string.h>

static uint32_t order_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits >> 31 != 0 ? ~bits : bits | 0x80000000u;
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
    memset(q, 0, sizeof *q);
    q->wanted = wanted;
    memcpy(q->share, share, wanted * sizeof *share);
}

/* NaN counts for nothing, where another adds 1, without a branch; and what is counted alone stays
 * in a register. */
void quantiles_first(struct quantiles *q, const float *value, size_t n)
{
    uint64_t count = 0;
    for (size_t i = 0; i < n; i++) {
        unsigned number = value[i] == value[i] ? 1u : 0u;
        q->upper[order_of(value[i]) >> 16] += number;
        count += number;
    }
    q->count += count;
}

void quantiles_between(struct quantiles *q)
{
    for (size_t k = 0; k < q->wanted && q->count > 0; k++) {
        double wanted = ceil(q->share[k] * (double)q->count);
        uint64_t rank = wanted > 1.0 ? (uint64_t)wanted - 1 : 0;
        uint32_t half = 0;
        if (rank >= q->count)
            rank = q->count - 1;
        for (; rank >= q->upper[half]; half++)
            rank -= q->upper[half];
        q->half[k] = half;
        q->rank[k] = rank;
        q->of_interest[half] = true;
    }
}

void quantiles_second(struct quantiles *q, const float *value, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint32_t order = order_of(value[i]), half = order >> 16;
        if (!q->of_interest[half] || isnan(value[i])) /* most are not */
            continue;
        for (size_t k = 0; k < q->wanted; k++)
            q->lower[k][order & 0xffff] += half == q->half[k] ? 1u : 0u;
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
