/* chance.h - numbers by chance that are the same every time: splitmix64 (Steele,
 * Lea and Flood, 2014; public-domain code by S. Vigna) and Box-Muller. */
#ifndef SKINSPEC_DRIVERS_SIMULATED_CHANCE_H
#define SKINSPEC_DRIVERS_SIMULATED_CHANCE_H

#include <math.h>
#include <stdint.h>

#include "base/units.h"

struct chance {
    uint64_t state;
};

static inline uint64_t chance_bits(struct chance *c)
{
    uint64_t z = c->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* One stream per seed and number (of a shot): what comes first or goes missing does
 * not change the others. */
static inline struct chance chance_of(uint64_t seed, uint64_t number)
{
    struct chance of_seed = { seed };
    return (struct chance){ chance_bits(&of_seed) + number * 0xd1342543de82ef95u };
}

/* FNV-1a: a seed from a text. */
static inline uint64_t chance_seed(const char *text)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (; *text != '\0'; text++)
        h = (h ^ (unsigned char)*text) * 0x100000001b3u;
    return h;
}

/* Normally distributed, mean 0, sd 1. */
static inline double chance_gauss(struct chance *c)
{
    double u = ((double)(chance_bits(c) >> 11) + 1.0) / 9007199254740992.0; /* above 0 */
    double v = (double)(chance_bits(c) >> 11) / 9007199254740992.0;
    return sqrt(-2.0 * log(u)) * cos(2.0 * UNITS_PI * v);
}

#endif
