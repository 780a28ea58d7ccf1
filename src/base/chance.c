/* chance.c - one stream of 64 bits, and what is made of it. */
#include "base/chance.h"

#include <math.h>

double chance_even(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) / 9007199254740992.0;
}

double chance_decades(uint64_t *state, double least, double most)
{
    return exp(log(least) + chance_even(state) * log(most / least));
}

double chance_normal(uint64_t *state)
{
    double radius = sqrt(-2.0 * log(chance_even(state)));
    double turn = 2.0 * acos(-1.0) * chance_even(state);
    return radius * cos(turn);
}
