/* dice.h - numbers by chance that are the same every time: splitmix64 (Steele, Lea
 * and Flood, 2014; public-domain code by S. Vigna). */
#ifndef SKINSPEC_TESTS_SUPPORT_DICE_H
#define SKINSPEC_TESTS_SUPPORT_DICE_H

#include <stddef.h>
#include <stdint.h>

struct dice {
    uint64_t state; /* the seed; any value */
};

static inline uint64_t dice_bits(struct dice *d)
{
    uint64_t z = d->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* low <= x < high, up to rounding. */
static inline double dice_between(struct dice *d, double low, double high)
{
    return low + (high - low) * ((double)(dice_bits(d) >> 11) / 9007199254740992.0);
}

/* 0 .. n-1. */
static inline size_t dice_below(struct dice *d, size_t n)
{
    return (size_t)(dice_bits(d) % n);
}

#endif
